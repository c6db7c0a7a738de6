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

import numpy as np

from grouped_bars import Bar, grouped_bars


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
    grouped_bars([Bar(group, what, float(np.median(values)), min(values), max(values))
                  for (group, what), values in samples.items()], path, unit)


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
