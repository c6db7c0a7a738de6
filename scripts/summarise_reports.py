#!/usr/bin/env python3
"""Tables of several reports of `kairos bench`, as Markdown: what docs/experiments.md quotes.

  scripts/summarise_reports.py REPORT.json...

Each report is called by the directory it stands in. Only the first sample distance and number of threads count.
"""
import json
import math
import os
import sys


def load(path):
    with open(path) as f:
        report = json.load(f)
    first = report["cases"][0]
    report["name"] = os.path.basename(os.path.dirname(os.path.abspath(path)))
    report["group"] = [i for i, c in enumerate(report["cases"])
                       if (c["threads"], c["sample_distance"]) == (first["threads"], first["sample_distance"])]
    return report


def cases(report, method=None, budget=None):
    return [(i, report["cases"][i]) for i in report["group"]
            if method in (None, report["cases"][i]["method"]) and budget in (None, report["cases"][i]["budget"])]


def budgets(reports):
    found = []
    for r in reports:
        for _, c in cases(r):
            if c["budget"] and c["budget"] not in found:
                found.append(c["budget"])
    return found


def budgeted_methods(reports):
    found = []
    for r in reports:
        for _, c in cases(r):
            if c["budget"] and c["method"] not in found:
                found.append(c["method"])
    return found


def table(header, rows):
    print("| " + " | ".join(header) + " |")
    print("|" + "---|" * len(header))
    for row in rows:
        print("| " + " | ".join(row) + " |")
    print()


def decibels(value):
    return "exact" if value is None else "%.1f" % value


def psnr(report, method, budget):
    found = cases(report, method, budget)
    return found[0][1]["error"]["psnr"] if found else math.nan


LATE = 1.1  # a median time of so many budgets is another budget


def late(report, method, budget):
    found = cases(report, method, budget)
    ms = found[0][1]["budget_ms"] if found else None
    return bool(ms) and found[0][1]["time_ms"]["median"] > LATE * ms


def times(reports):
    print("## Exact methods: median time of a step, ms\n")
    methods = []
    for r in reports:
        methods += [c["method"] for _, c in cases(r) if not c["budget"] and c["method"] not in methods]
    rows = []
    for r in reports:
        found = {c["method"]: "%.2f" % c["time_ms"]["median"] for _, c in cases(r) if not c["budget"]}
        exact = all(c["error"]["max"] == 0 for _, c in cases(r) if not c["budget"])
        rows.append([r["name"]] + [found.get(m, "–") for m in methods] + ["yes" if exact else "no"])
    table(["report"] + methods + ["all equal to full, bit for bit"], rows)


def errors(reports):
    print("## PSNR in dB of the mean squared error, %s of a full frame's time\n" % "/".join(budgets(reports)))
    methods = budgeted_methods(reports)
    rows = []
    for r in reports:
        rows.append([r["name"]] + ["/".join(decibels(psnr(r, m, b)) + "*" * late(r, m, b) for b in budgets([r]))
                                   for m in methods])
    table(["report"] + methods, rows)
    print("\\* The median step took more than %.0f %% of its budget.\n" % (100 * LATE))


def margins(reports):
    methods = budgeted_methods(reports)
    if "anytime" not in methods:
        return
    print("## `anytime` above the others, dB: least, mean (without the others' late ones)\n")
    rows = []
    for kind in sorted({r["name"].rsplit("-", 1)[-1] for r in reports}):
        of_kind = [r for r in reports if r["name"].endswith(kind)]
        row = [kind]
        for m in methods:
            if m == "anytime":
                continue
            gaps = []
            for r in of_kind:
                for b in budgets([r]):
                    a, other = psnr(r, "anytime", b), psnr(r, m, b)
                    if not late(r, m, b) and a is not None and other is not None and not math.isnan(other):
                        gaps.append(a - other)
            row.append("%.1f, %.1f" % (min(gaps), sum(gaps) / len(gaps)) if gaps else "–")
        rows.append(row)
    table(["transfer function"] + [m for m in methods if m != "anytime"], rows)


def conformity(reports):
    print("## |time - budget| / budget in %: 95th and 99th percentile (steps done early left out)\n")
    methods = budgeted_methods(reports)
    rows = []
    for r in reports:
        for b in budgets([r]):
            found = {c["method"]: c for _, c in cases(r, budget=b)}
            ms = next(iter(found.values()))["budget_ms"]
            if ms is None:
                continue
            row = [r["name"], b, "%.2f" % ms]
            for m in methods:
                k = found[m]["conformity"] if m in found else None
                row.append("%.1f, %.1f" % (100 * k["deviation"]["p95"], 100 * k["deviation"]["p99"])
                           if k and k["frames"] else "–")
            rows.append(row)
    table(["report", "budget", "ms"] + methods, rows)


def estimates(reports):
    print("## True RMSE inside the reported 95 % interval\n")
    rows = []
    for r in reports:
        for _, c in cases(r):
            if c["estimate"]:
                e = c["estimate"]
                rows.append([r["name"], c["method"], c["budget"], "%d of %d" % (e["covered"], e["frames"]),
                             "%.0f %%" % (100 * e["covered"] / e["frames"]), "%.2f" % e["ratio"]])
    table(["report", "method", "budget", "frames", "share", "estimated / true, median"], rows)


def stages(reports):
    print("## `tcdvrm`: stages in % of a step, and changed voxels sampled at the steps shown\n")
    rows = []
    for r in reports:
        for i, c in cases(r, "tcdvrm"):
            s, total = c["stages_ms"], c["time_ms"]["mean"]
            sampled = ["%.1f %%" % (100 * h["voxels_sampled_fraction"]) for h in r["histograms"] if h["case"] == i]
            rows.append([r["name"], c["budget"]] +
                        ["%.0f" % (100 * s[k] / total) for k in ("update", "select", "cast", "compose", "other")] +
                        [", ".join(sampled) or "–"])
    table(["report", "budget", "update", "select", "cast", "compose", "other", "sampled"], rows)


def pictures(reports):
    print("## Pictures: PSNR, SSIM, FLIP\n")
    rows = []
    for r in reports:
        for p in r["pictures"]:
            c = r["cases"][p["case"]]
            if c["budget"]:
                rows.append([r["name"], str(p["step"]), c["method"], c["budget"], decibels(p["psnr"]),
                             "%.4f" % p["ssim"], "%.4f" % p["flip"]])
    table(["report", "step", "method", "budget", "PSNR", "SSIM", "FLIP"], rows)


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    reports = [load(path) for path in sys.argv[1:]]
    for part in (times, errors, margins, conformity, estimates, stages, pictures):
        part(reports)


if __name__ == "__main__":
    main()
