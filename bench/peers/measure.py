"""What both comparisons share: taking turns, statistics, images, the machine."""
import datetime
import json
import os
import platform
import random
import subprocess

import numpy as np


def machine():
    def first(path, key):
        with open(path) as f:
            for line in f:
                if line.startswith(key):
                    return line.split(":", 1)[1].strip()
        return "unknown"
    release = platform.freedesktop_os_release()
    return {"date": datetime.date.today().isoformat(), "processor": first("/proc/cpuinfo", "model name"),
            "cores": os.cpu_count(), "memory": first("/proc/meminfo", "MemTotal"), "system": release["PRETTY_NAME"],
            "megahertz": first("/proc/cpuinfo", "cpu MHz")}


def take_turns(contestants, rounds, seed=1):
    """{label: function that does its work and returns a time} -> {label: [a time of every round]}.

    All take their turn in every round, in a random order, so that whatever slows the machine down slows all of them.
    """
    order = random.Random(seed)
    times = {label: [] for label in contestants}
    for _ in range(rounds):
        for label in order.sample(list(contestants), len(contestants)):
            times[label].append(contestants[label]())
    return times


def ratio(peer, own):
    """Of medians, with the quartiles and the extremes of the ratios of single rounds."""
    rounds = np.array(peer) / np.array(own)
    low, first, third, high = np.percentile(rounds, [0, 25, 75, 100])
    return {"of_medians": float(np.median(peer) / np.median(own)), "min": low, "first_quartile": first,
            "third_quartile": third, "max": high}


def difference(image, reference):
    """Root mean square and largest difference over all channels."""
    d = np.abs(image - reference)
    return {"rmse": float(np.sqrt(np.mean(d * d))), "max": float(d.max())}


def read_raw(path, size):
    return np.fromfile(path, "<f4").reshape(size[1], size[0], 4).astype(float)


def with_display(command):
    """VTK's window needs an X server; llvmpipe, which draws it, stays with one thread."""
    environment = dict(os.environ, LP_NUM_THREADS="1")
    return (command if "DISPLAY" in os.environ else ["xvfb-run", "-a"] + command), environment


def merge_results(path, section, entries):
    """Puts `entries` into the JSON file's `section`, keeping what other runs put there."""
    results = {}
    if os.path.exists(path):
        with open(path) as f:
            results = json.load(f)
    results["machine"] = machine()
    results.setdefault(section, {}).update(entries)
    with open(path, "w") as f:
        json.dump(results, f, indent=1)


def missing(command, error):
    """Why a peer takes no part, in one line."""
    text = error.stderr if isinstance(error, subprocess.CalledProcessError) and error.stderr else str(error)
    return f"{os.path.basename(command[0])}: {text.strip().splitlines()[-1] if text.strip() else 'failed'}"
