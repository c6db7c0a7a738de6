#!/usr/bin/python3
"""Times whole frames of Kairos and its peers on the scenes of make_scenes.py, interleaved in one run.

  /usr/bin/python3 bench/peers/make_scenes.py out/scenes
  /usr/bin/python3 bench/peers/compare_frames.py out/scenes/*.json --kairos build/release/bin/kairos_driver

Every driver is a process that has loaded the scene and stays alive. In each round every driver has one turn: an untimed
frame, which brings its data back into the caches, and then timed ones for a quarter of a second, of which the median
counts; one that takes over a second goes without the untimed frame. Peers that are not installed are named and left
out. Before anything is timed, each image is compared with Kairos's double-precision reference at the same sample
distance, and with a converged image (an eighth of the sample distance, no early ray termination): the first says
whether it is the same picture, the second how good a picture it is.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile
import time

import numpy as np

import measure

HERE = os.path.dirname(os.path.abspath(__file__))
TURN_SECONDS = 0.25
SLOW_MS = 1000


class Driver:
    """A driver process (see driver.py)."""

    def __init__(self, command, environment=None):
        self.command = command
        self.process = subprocess.Popen(command, env=environment, text=True, stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.description = json.loads(self.answer())
        self.slow = False

    def answer(self):
        line = self.process.stdout.readline()
        if not line:
            raise RuntimeError(self.process.stderr.read())
        return line.strip()

    def ask(self, command):
        self.process.stdin.write(command + "\n")
        self.process.stdin.flush()
        return self.answer()

    def turn(self):
        """Milliseconds of a frame."""
        if not self.slow:
            self.slow = float(self.ask("frame")) > SLOW_MS
        times, end = [], time.monotonic() + TURN_SECONDS
        while not times or time.monotonic() < end:
            times.append(float(self.ask("frame")))
        return float(np.median(times))

    def image(self, path, size):
        self.ask("frame")
        self.ask(f"image {path}")
        return measure.read_raw(path, size)

    def close(self):
        self.process.stdin.close()
        self.process.wait()


def commands(scene_path, scene, arguments):
    """{label: (command, environment)} of all who could take part."""
    threads = ["--threads", str(arguments.threads)]
    own = {f"Kairos {v}": ([arguments.kairos, scene_path, *threads, "--precision", *v.split()], None)
           for v in arguments.variants}
    python = "/usr/bin/python3"
    peers = {"VTK": measure.with_display([python, f"{HERE}/vtk_driver.py", scene_path, *threads])}
    if arguments.openvkl and arguments.threads == 1:
        peers["Open VKL"] = ([arguments.openvkl, scene_path], None)
    if "grey" in scene:
        command = [python, f"{HERE}/vdb_render_driver.py", scene_path, *threads, "--convert", arguments.kairos]
        peers["vdb_render"] = (command, None)
        peers["vdb_render with shadows"] = (command + ["--shadows"], None)
    return own | peers


def start(candidates):
    drivers = {}
    for label, (command, environment) in candidates.items():
        try:
            drivers[label] = Driver(command, environment)
        except (OSError, RuntimeError, ValueError) as error:
            print(f"  {label} takes no part: {measure.missing(command, error)}")
    return drivers


def references(scene_path, scene, arguments):
    """(double precision at the scene's step, converged); computed once and kept beside the scene."""
    images = []
    for kind, options in [("double", ["--double"]),
                          ("converged", ["--step", str(scene["step"] / 8), "--terminate", "1"])]:
        path = scene_path.replace(".json", f".{kind}.raw")
        if not os.path.exists(path):
            driver = Driver([arguments.kairos, scene_path, *options])
            driver.image(path, scene["size"])
            driver.close()
        images.append(measure.read_raw(path, scene["size"]))
    return images


def compare(scene_path, arguments):
    with open(scene_path) as f:
        scene = json.load(f)
    print(f"{scene['name']}:", flush=True)
    reference, converged = references(scene_path, scene, arguments)
    if arguments.prepare:
        return None
    drivers = start(commands(scene_path, scene, arguments))
    result = {"threads": arguments.threads, "drivers": {}}
    with tempfile.TemporaryDirectory() as folder:
        for label, driver in drivers.items():
            image = driver.image(f"{folder}/image.raw", scene["size"])
            result["drivers"][label] = {"version": driver.description["version"],
                                        "to_reference": measure.difference(image, reference),
                                        "to_converged": measure.difference(image, converged)}
    times = measure.take_turns({label: driver.turn for label, driver in drivers.items()}, arguments.rounds)
    for label, driver in drivers.items():
        driver.close()
        result["drivers"][label]["ms"] = times[label]
        print(f"  {label}: {np.median(times[label]):.1f} ms", flush=True)
    return {scene["name"]: result}


def parsed(words):
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--kairos", required=True, help="kairos_driver")
    parser.add_argument("--openvkl", help="openvkl_driver, where it could be built")
    parser.add_argument("--variants", nargs="+", default=["full", "fast"],
                        help='of Kairos: a precision and further options, as "full --isa avx2" [full fast]')
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--prepare", action="store_true", help="only compute the references")
    parser.add_argument("--out", help="JSON file that the results are put into; see report.py")
    return parser.parse_args(words)


def run(words):
    arguments = parsed(words)
    for path in arguments.scenes:
        entries = compare(os.path.abspath(path), arguments)
        if entries and arguments.out:
            measure.merge_results(arguments.out, "frames", entries)


if __name__ == "__main__":
    run(sys.argv[1:])
