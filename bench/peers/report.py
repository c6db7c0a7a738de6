#!/usr/bin/python3
"""Tables, a CSV file and a plot of what compare_frames.py and compare_jobs.py measured.

  /usr/bin/python3 bench/peers/report.py out/peers.json [--csv out/peers.csv] [--plot out/peers.svg]

A ratio is that of the medians; in brackets the smallest and the largest ratio of a single round.
"""
import argparse
import csv
import json

import numpy as np

import measure


def own(label):
    return label.startswith("Kairos")


def rows_of(drivers, unit):
    """One row a contestant: label, median, {own label: ratio}, errors."""
    ours = [label for label in drivers if own(label)]
    for label, driver in drivers.items():
        ratios = {} if own(label) else {o: measure.ratio(driver[unit], drivers[o][unit]) for o in ours}
        errors = {key[3:]: driver[key] for key in driver if key.startswith("to_")}
        yield {"label": label, "median": float(np.median(driver[unit])), "low": min(driver[unit]),
               "high": max(driver[unit]), "ratios": ratios, "errors": errors}


def ratio_text(r):
    return f"{r['of_medians']:.1f} ({r['min']:.1f} to {r['max']:.1f})"


def table(drivers, unit):
    """Markdown."""
    rows = list(rows_of(drivers, unit))
    ours = [r["label"] for r in rows if own(r["label"])]
    kinds = list(rows[0]["errors"])
    head = ["", f"{unit} (fastest to slowest round)"] + [f"ratio to {o}" for o in ours]
    head += [f"RMSE, largest difference to {k}" for k in kinds]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for r in rows:
        digits = 1 if unit == "ms" else 2
        cells = [r["label"], f"{r['median']:.{digits}f} ({r['low']:.{digits}f} to {r['high']:.{digits}f})"]
        cells += [ratio_text(r["ratios"][o]) if r["ratios"] else "" for o in ours]
        cells += [f"{r['errors'][k]['rmse']:.1e}, {r['errors'][k]['max']:.1e}" for k in kinds]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def sections(results):
    for kind, unit in [("frames", "ms"), ("jobs", "s")]:
        for name, result in results.get(kind, {}).items():
            yield kind, name, result, unit


def write_csv(results, path):
    with open(path, "w", newline="") as f:
        out = csv.writer(f)
        out.writerow(["kind", "scene", "threads", "contestant", "version", "unit", "round", "time"])
        for kind, name, result, unit in sections(results):
            for label, driver in result["drivers"].items():
                for number, time in enumerate(driver[unit]):
                    out.writerow([kind, name, result["threads"], label, driver.get("version", ""), unit, number,
                                  f"{time:.5g}"])


def plot(results, path):
    """How many times as long every peer takes as Kairos, with the spread over the rounds."""
    import matplotlib
    matplotlib.use("Agg")
    matplotlib.rcParams["svg.fonttype"] = "none"  # text stays text
    from matplotlib import pyplot
    bars = []
    for kind, name, result, unit in sections(results):
        for r in rows_of(result["drivers"], unit):
            for o, ratio in r["ratios"].items():
                what = name.replace("_", " ") if kind == "frames" else f"whole job, {name}"
                bars.append((f"{what}: {r['label']}", o, ratio))
    names, ours = list(dict.fromkeys(b[0] for b in bars)), list(dict.fromkeys(b[1] for b in bars))
    figure, axes = pyplot.subplots(figsize=(8, 1 + .14 * len(bars) + .16 * len(names)), layout="constrained")
    position, ticks = 0.0, []
    for name in names:
        group = [b for b in bars if b[0] == name]
        ticks.append(position + (len(group) - 1) / 2)
        for _, o, r in group:
            middle = r["of_medians"]
            low, high = min(r["min"], middle), max(r["max"], middle)
            axes.barh(position, middle - 1, .85, left=1, color=f"C{ours.index(o)}", label=o,
                      xerr=[[middle - low], [high - middle]], error_kw=dict(lw=.8))
            axes.annotate(f"{middle:.1f}", (high, position), (3, 0), textcoords="offset points", va="center",
                          fontsize=7)
            position += 1
        position += .7
    axes.set_yticks(ticks, names, fontsize=8)
    axes.invert_yaxis()
    axes.margins(y=.01)
    axes.set_xscale("log")
    axes.set_xticks([1, 2, 5, 10, 20, 50, 100, 200], ["1", "2", "5", "10", "20", "50", "100", "200"])
    axes.set_xlabel("time of the peer / time of Kairos")
    handles, labels = axes.get_legend_handles_labels()
    unique = dict(zip(labels, handles))
    axes.legend(unique.values(), unique.keys(), fontsize=7)
    figure.savefig(path, metadata={"Date": None} if path.endswith(".svg") else None)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("results")
    parser.add_argument("--csv")
    parser.add_argument("--plot", help=".svg or .png")
    arguments = parser.parse_args()
    with open(arguments.results) as f:
        results = json.load(f)
    print(", ".join(f"{key} {value}" for key, value in results["machine"].items()))
    for kind, name, result, unit in sections(results):
        print(f"\n{name}, {'1 thread' if result['threads'] == 1 else str(result['threads']) + ' threads'}\n")
        print(table(result["drivers"], unit))
        for label, driver in result["drivers"].items():
            if "parts" in driver:
                print(f"\n{label}: " + ", ".join(f"{k} {v:.2f} s" for k, v in driver["parts"].items()))
    if arguments.csv:
        write_csv(results, arguments.csv)
    if arguments.plot:
        plot(results, arguments.plot)


if __name__ == "__main__":
    main()
