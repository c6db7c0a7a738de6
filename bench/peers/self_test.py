#!/usr/bin/python3
"""Checks the comparison itself on a scene that takes seconds, with whichever peers are installed.

  /usr/bin/python3 bench/peers/self_test.py --kairos build/release/bin/kairos_driver
"""
import argparse
import csv
import json
import os
import tempfile

import compare_frames
import measure
import report
from make_scenes import make_scenes

# A peer that draws another picture than ours is off by tenths everywhere; edges and sampling explain this much.
LARGEST_RMSE = 0.05


def check_statistics():
    r = measure.ratio([10, 20, 30], [1, 2, 6])
    assert (r["of_medians"], r["min"], r["max"]) == (10, 5, 10), r
    calls = []
    times = measure.take_turns({"a": lambda: calls.append("a") or 1, "b": lambda: calls.append("b") or 2}, 4)
    assert times == {"a": [1] * 4, "b": [2] * 4}, times
    assert all(set(calls[i:i + 2]) == {"a", "b"} for i in range(0, 8, 2)), calls


def check_results(results):
    assert set(results["frames"]) == {"plume_u8_ramp", "plume_f32_grey"}
    for name, result in results["frames"].items():
        drivers = result["drivers"]
        assert drivers["Kairos full"]["to_reference"]["max"] < 1e-5, (name, drivers["Kairos full"])
        for label, driver in drivers.items():
            assert len(driver["ms"]) == 2 and min(driver["ms"]) > 0, (name, label)
            if "shadows" not in label:
                assert driver["to_reference"]["rmse"] < LARGEST_RMSE, (name, label, driver["to_reference"])


def check_report(results, folder):
    assert "| Kairos full |" in report.table(results["frames"]["plume_u8_ramp"]["drivers"], "ms")
    report.write_csv(results, f"{folder}/results.csv")
    with open(f"{folder}/results.csv") as f:
        rows = list(csv.DictReader(f))
    assert len(rows) == sum(2 * len(r["drivers"]) for r in results["frames"].values()), len(rows)
    try:
        report.plot(results, f"{folder}/results.svg")
        assert os.path.getsize(f"{folder}/results.svg") > 0
    except ImportError:
        print("matplotlib is not installed: no plot")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--kairos", required=True, help="kairos_driver")
    arguments = parser.parse_args()
    check_statistics()
    with tempfile.TemporaryDirectory() as folder:
        make_scenes(folder, edge=48, size=64)
        out = f"{folder}/results.json"
        compare_frames.run([f"{folder}/plume_u8_ramp.json", f"{folder}/plume_f32_grey.json", "--kairos",
                            arguments.kairos, "--rounds", "2", "--out", out])
        with open(out) as f:
            results = json.load(f)
        check_results(results)
        check_report(results, folder)
    print("self test passed")


if __name__ == "__main__":
    main()
