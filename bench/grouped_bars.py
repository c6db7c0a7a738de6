"""The plot of the benchmark scripts: horizontal bars in groups, a colour for what is compared, whiskers for the spread.

Needs python3-matplotlib.
"""
from typing import NamedTuple

import matplotlib

matplotlib.use("Agg")
matplotlib.rcParams["svg.fonttype"] = "none"  # text stays text
from matplotlib import pyplot  # noqa: E402  (the backend is chosen first)


class Bar(NamedTuple):
    group: str
    what: str
    middle: float
    low: float
    high: float


def grouped_bars(bars, path, label, base=0, log_ticks=None, text="{:.3g}"):
    """Bars from `base` to their middle, into an .svg or .png file; with `log_ticks` the axis is logarithmic."""
    groups, whats = list(dict.fromkeys(b.group for b in bars)), list(dict.fromkeys(b.what for b in bars))
    figure, axes = pyplot.subplots(figsize=(8, .9 + .17 * len(bars) + .14 * len(groups)), layout="constrained")
    position, ticks = 0.0, []
    for group in groups:
        members = [b for b in bars if b.group == group]
        ticks.append(position + (len(members) - 1) / 2)
        for b in members:
            axes.barh(position, b.middle - base, .85, left=base, color=f"C{whats.index(b.what)}", label=b.what,
                      xerr=[[b.middle - min(b.low, b.middle)], [max(b.high, b.middle) - b.middle]],
                      error_kw=dict(lw=.8))
            axes.annotate(text.format(b.middle), (b.high, position), (3, 0), textcoords="offset points", va="center",
                          fontsize=7)
            position += 1
        position += .7
    axes.set_yticks(ticks, groups, fontsize=8)
    axes.invert_yaxis()
    if log_ticks:
        axes.margins(y=.01)
        axes.set_xscale("log")
        axes.set_xticks(log_ticks, [str(t) for t in log_ticks])
    else:
        axes.margins(x=.08)
    axes.set_xlabel(label)
    handles, labels = axes.get_legend_handles_labels()
    unique = dict(zip(labels, handles))
    axes.legend(unique.values(), unique.keys(), fontsize=7)
    figure.savefig(path, metadata={"Date": None} if path.endswith(".svg") else None)
