#!/usr/bin/python3
"""Times the whole job, from simulation files to an image file of every step, by Kairos and its peers, interleaved.

  /usr/bin/python3 bench/peers/make_smoke.py out/smoke
  /usr/bin/python3 bench/peers/compare_jobs.py out/smoke --kairos build/release/bin --out out/peers.json

Any folder of .vdb steps will do. Kairos is timed as a user runs it, from the start of the program to its end: straight
from the simulation's files, and from a sequence that `kairos diff` made of them before. VTK is a script (vtk_job.py) of
which only loading, rendering and writing count; vdb_render is run once for every file.

Two transfer functions: `colour` hides the thinnest smoke; `grey` is one colour and an extinction proportional to the
density, which vdb_render can draw too (see vdb_render_driver.py). With shadows it is run with its own defaults.
"""
import argparse
import glob
import json
import os
import subprocess
import tempfile
import time

import numpy as np
import pyopenvdb

import measure
from make_scenes import GREY, GREY_EXTINCTION, grey, write_transfer_function
from vdb_render_driver import camera_options, options, triple

HERE = os.path.dirname(os.path.abspath(__file__))
SIZE = [512, 512]
TERMINATE = 0.999
COLOUR = [(0, 0, 0, 0, 0), (.05, .3, .1, .5, 0), (.4, .9, .4, .2, .08), (1, 1, 1, .6, .3)]


def describe(folder, grid_name, transfer):
    """What all of them have to know: files, box of active voxels, camera in index and world space."""
    files = sorted(glob.glob(os.path.join(os.path.abspath(folder), "*.vdb")))
    if not files:
        raise SystemExit(f"{folder}: no .vdb file")
    grids = [pyopenvdb.readGridMetadata(f, grid_name) for f in files]
    lo = np.min([g.metadata["file_bbox_min"] for g in grids], axis=0)
    hi = np.max([g.metadata["file_bbox_max"] for g in grids], axis=0)
    centre, height = (lo + hi) / 2, max(hi - lo) + 1
    index_camera = dict(eye=(centre + [0, -2.2 * height, .4 * height]).tolist(), target=centre.tolist(), up=[0, 0, 1],
                        fov=28)
    transform = pyopenvdb.read(files[0], grid_name).transform
    camera = dict(index_camera, eye=transform.indexToWorld(tuple(index_camera["eye"])),
                  target=transform.indexToWorld(tuple(index_camera["target"])))
    return dict(files=files, grid=grid_name, box=[lo.tolist(), hi.tolist()], transfer=transfer, size=SIZE,
                index_camera=index_camera, camera=camera)


def run(command, **more):
    """Seconds of a program's run and what it printed."""
    begin = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, check=True, **more)
    return time.perf_counter() - begin, done.stdout


def kairos(job, source, out, arguments, precision):
    camera = job["camera"]
    return [f"{arguments.kairos}/kairos", "render", source, "-o", f"{out}/frame.####.exr",
            "--eye", triple(camera["eye"]), "--target", triple(camera["target"]), "--up", triple(camera["up"]),
            "--fov", str(camera["fov"]), "--size", f"{SIZE[0]}x{SIZE[1]}", "--tf", job["transfer"],
            "--terminate", str(TERMINATE), "--precision", precision, "--threads", str(arguments.threads), "--quiet"]


class Contest:
    """The contestants of one transfer function; each does the whole job and returns seconds."""

    def __init__(self, job, arguments, folder):
        self.job, self.arguments, self.folder = job, arguments, folder
        self.parts = []  # of VTK's runs
        self.contestants = {}
        sequence = os.path.join(folder, "sequence")
        run([f"{arguments.kairos}/kairos", "diff", *job["files"], "-o", sequence, "--grid", job["grid"], "--quiet"])
        for precision in arguments.precisions:
            self.add_kairos(f"Kairos {precision}, from the files", os.path.dirname(job["files"][0]), precision)
            self.add_kairos(f"Kairos {precision}, from the sequence", sequence, precision)
        self.add("VTK", self.vtk)
        if job["name"] == "grey":
            self.add("vdb_render", lambda: self.vdb_render(False))
            self.add("vdb_render with shadows", lambda: self.vdb_render(True))

    def add_kairos(self, label, source, precision):
        out = self.out_of(label)
        command = kairos(self.job, source, out, self.arguments, precision)
        self.add(label, lambda: run(command)[0])

    def out_of(self, label):
        out = os.path.join(self.folder, label.replace(" ", "_").replace(",", ""))
        os.makedirs(out, exist_ok=True)
        return out

    def add(self, label, work):
        """Keeps it if it is installed. The untimed run it takes to know fills the file cache for all of them."""
        try:
            work()
            self.contestants[label] = work
        except (OSError, subprocess.CalledProcessError) as error:
            print(f"  {label} takes no part: {measure.missing([label], error)}")

    def vtk(self):
        command, environment = measure.with_display(
            ["/usr/bin/python3", f"{HERE}/vtk_job.py", self.job["path"], self.out_of("VTK"),
             "--threads", str(self.arguments.threads)])
        seconds = json.loads(run(command, env=environment)[1])
        self.parts.append(seconds)
        return sum(seconds.values())

    def vdb_render(self, shadows):
        out, total = self.out_of("vdb_render with shadows" if shadows else "vdb_render"), 0
        drawn = (camera_options(self.job["camera"], SIZE) if shadows else
                 options(self.job["camera"], SIZE, 1.0, GREY_EXTINCTION, GREY, TERMINATE))
        for step, path in enumerate(self.job["files"]):
            total += run(["vdb_render", path, f"{out}/frame.{step:04d}.exr", "-name", self.job["grid"],
                          "-cpus", str(self.arguments.threads)] + drawn)[0]
        return total

    def last_image(self, label):
        out = self.out_of(label)
        if label == "VTK":
            return measure.read_raw(f"{out}/last.raw", SIZE)
        raw = f"{self.folder}/image.raw"
        run([f"{self.arguments.kairos}/kairos_driver", "--convert", sorted(glob.glob(f"{out}/*.exr"))[-1], raw])
        return measure.read_raw(raw, SIZE)


def compare(name, transfer, arguments):
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "job.json")
        table = os.path.join(folder, "transfer.txt")
        transfer(table)
        job = dict(describe(arguments.smoke, arguments.grid, table), name=name, path=path)
        with open(path, "w") as f:
            json.dump(job, f)
        print(f"{name}, {len(job['files'])} steps:", flush=True)
        contest = Contest(job, arguments, folder)
        contest.parts.clear()
        times = measure.take_turns(contest.contestants, arguments.rounds)
        own = contest.last_image(f"Kairos {arguments.precisions[0]}, from the files")
        result = {"threads": arguments.threads, "steps": len(job["files"]), "box": job["box"], "drivers": {}}
        for label, seconds in times.items():
            result["drivers"][label] = {"s": seconds, "to_kairos": measure.difference(contest.last_image(label), own)}
            print(f"  {label}: {np.median(seconds):.2f} s", flush=True)
        if "VTK" in times:
            parts = {key: float(np.median([p[key] for p in contest.parts])) for key in contest.parts[0]}
            result["drivers"]["VTK"]["parts"] = parts
        return {name: result}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("smoke", help="folder of .vdb steps")
    parser.add_argument("--grid", default="density")
    parser.add_argument("--kairos", required=True, help="folder of kairos and kairos_driver")
    parser.add_argument("--precisions", nargs="+", default=["full", "fast"])
    parser.add_argument("--transfer", nargs="+", choices=["colour", "grey"], default=["colour", "grey"])
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--out")
    arguments = parser.parse_args()
    transfers = {"colour": lambda path: np.savetxt(path, COLOUR, fmt="%.9g"),
                 "grey": lambda path: write_transfer_function(path, grey(np.linspace(0, 1, 256)), 1)}
    for name in arguments.transfer:
        entries = compare(name, transfers[name], arguments)
        if arguments.out:
            measure.merge_results(arguments.out, "jobs", entries)


if __name__ == "__main__":
    main()
