#!/usr/bin/python3
"""Plots Google Benchmark results: a bar for every case, grouped, with the spread over the repetitions.

  build/bench/bin/kernel_bench --benchmark_repetitions=5 --benchmark_enable_random_interleaving=true \\
      --benchmark_out=kernels.json
  /usr/bin/python3 bench/plot.py kernels.json -o kernels.svg --counter ns/sample

The last part of a case's name is what is compared (a bar's colour), what stands before it the group. A bar is the
median of the repetitions, its whisker reaches from the fastest to the slowest. Without --counter it shows the real
time. Needs python3-numpy and python3-matplotlib.
"""
import argparse
import json
import re

import matplotlib
import numpy as np

matplotlib.use("Agg")
matplotlib.rcParams["svg.fonttype"] = "none"  # text stays text
from matplotlib import pyplot  # noqa: E402  (the backend is chosen first)


def samples_of(results, counter, cases):
    """{(group, what): the repetitions' values}, in the file's order, and their unit."""
    samples, unit = {}, counter
    for run in results["benchmarks"]:
        if run["run_type"] != "iteration" or "error_message" in run or not re.search(cases, run["run_name"]):
            continue
        # Google Benchmark adds what it was told, as in `noise/u8/fastest/repeats:5/real_time`.
        parts = [p for p in run["run_name"].split("/") if ":" not in p and p not in ("real_time", "process_time")]
        if counter not in run:
            known = ", ".join(key for key, value in run.items() if isinstance(value, float))
            raise SystemExit(f"{run['run_name']} has no {counter}; it has {known}")
        group, what = " ".join(parts[:-1]).replace("_", " "), parts[-1].replace("_", " ")
        samples.setdefault((group, what), []).append(run[counter])
        if counter in ("real_time", "cpu_time"):
            unit = run["time_unit"]
    if not samples:
        raise SystemExit("no case in the file matches")
    return samples, unit


def plot(samples, unit, path):
    groups = list(dict.fromkeys(group for group, _ in samples))
    whats = list(dict.fromkeys(what for _, what in samples))
    figure, axes = pyplot.subplots(figsize=(8, .8 + .19 * len(samples) + .12 * len(groups)), layout="constrained")
    position, ticks = 0.0, []
    for group in groups:
        members = [(what, values) for (g, what), values in samples.items() if g == group]
        ticks.append(position + (len(members) - 1) / 2)
        for what, values in members:
            middle = float(np.median(values))
            axes.barh(position, middle, .85, color=f"C{whats.index(what)}", label=what,
                      xerr=[[middle - min(values)], [max(values) - middle]], error_kw=dict(lw=.8))
            axes.annotate(f"{middle:.3g}", (max(values), position), (3, 0), textcoords="offset points", va="center",
                          fontsize=7)
            position += 1
        position += .7
    axes.set_yticks(ticks, groups, fontsize=8)
    axes.invert_yaxis()
    axes.margins(x=.08)
    axes.set_xlabel(unit)
    handles, labels = axes.get_legend_handles_labels()
    unique = dict(zip(labels, handles))
    axes.legend(unique.values(), unique.keys(), fontsize=7)
    figure.savefig(path, metadata={"Date": None} if path.endswith(".svg") else None)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("results", help="JSON of --benchmark_out")
    parser.add_argument("-o", "--out", required=True, help=".svg or .png")
    parser.add_argument("--counter", default="real_time", help="real_time, cpu_time or one of the cases' own counters")
    parser.add_argument("--cases", default="", help="a regular expression that the names must match")
    arguments = parser.parse_args()
    with open(arguments.results) as f:
        samples, unit = samples_of(json.load(f), arguments.counter, arguments.cases)
    plot(samples, unit, arguments.out)


if __name__ == "__main__":
    main()
