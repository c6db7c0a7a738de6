#!/usr/bin/python3
"""Tables, a CSV file and a plot of what compare_frames.py and compare_jobs.py measured.

  /usr/bin/python3 bench/peers/report.py out/peers.json [--csv out/peers.csv] [--plot out/peers.svg]

A ratio is that of the medians; in brackets the smallest and the largest ratio of a single round.
"""
import argparse
import csv
import json
import os
import sys

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
    sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
    from grouped_bars import Bar, grouped_bars
    bars = []
    for kind, name, result, unit in sections(results):
        for r in rows_of(result["drivers"], unit):
            for o, ratio in r["ratios"].items():
                what = name.replace("_", " ") if kind == "frames" else f"whole job, {name}"
                bars.append(Bar(f"{what}: {r['label']}", o, ratio["of_medians"], ratio["min"], ratio["max"]))
    grouped_bars(bars, path, "time of the peer / time of Kairos", base=1,
                 log_ticks=[1, 2, 5, 10, 20, 50, 100, 200], text="{:.1f}")


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
