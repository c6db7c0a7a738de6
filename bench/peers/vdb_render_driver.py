#!/usr/bin/python3
"""Times OpenVDB's vdb_render on one `grey` scene of make_scenes.py (see driver.py).

  /usr/bin/python3 bench/peers/vdb_render_driver.py SCENE.json [--threads 1] [--shadows] --convert KAIROS_DRIVER

vdb_render has no transfer function: it scatters light once, through an extinction proportional to the value. With
--shadows it is run with its own defaults, as users do. Without, the shadow rays' step is longer than the volume, so
that they sample nothing (they are still set up, at every sample) and the image is what emission and absorption give:
the same as a transfer function of one colour. It is a program of its own, so every frame reads the file anew; the
milliseconds are those that it reports for rendering alone.
"""
import argparse
import os
import re
import subprocess
import tempfile

import numpy as np

from driver import load_scene, serve


def write_grid(scene, path):
    import pyopenvdb as vdb  # slow to load, and only used here
    values = np.fromfile(scene["raw"], np.uint8 if scene["type"] == "u8" else np.float32).reshape(scene["dims"][::-1])
    grid = vdb.FloatGrid()
    grid.copyFromArray(np.ascontiguousarray(values.transpose(2, 1, 0), np.float32) / scene["value_range"][1])
    grid.name, grid.gridClass = "density", vdb.GridClass.FOG_VOLUME
    vdb.write(path, grids=[grid])


def triple(v):
    return ",".join(f"{x:.9g}" for x in v)


def camera_options(camera, size):
    return ["-camera", "perspective", "-translate", triple(camera["eye"]), "-lookat", triple(camera["target"]),
            "-up", triple(camera["up"]), "-fov", f"{camera['fov']:.9g}", "-res", f"{size[0]}x{size[1]}"]


def options(camera, size, step, extinction, colour, terminate):
    """Emission and absorption as a renderer with a one-coloured transfer function sees it."""
    # A ray ends when the sum of its squared transmittances falls below the cutoff; thinner voxels are left out as well.
    cutoff = 3 * (1 - terminate) ** 2
    return camera_options(camera, size) + [
        "-step", f"{step:.9g}", "-shadowstep", "1e6", "-absorb", "0,0,0", "-scatter", triple([extinction] * 3),
        "-light", "0.3,0.3,0," + triple([colour] * 3), "-cutoff", f"{cutoff:.9g}"]


def rendering_ms(text):
    """Of what vdb_render -v prints: only the time between reading the file and writing the image."""
    return 1e3 * float(re.search(r"ray-tracing.*?completed in ([\d.e+-]+) sec", text, re.S).group(1))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("scene")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--shadows", action="store_true")
    parser.add_argument("--convert", required=True, help="kairos_driver, which turns EXR into raw")
    arguments = parser.parse_args()
    scene = load_scene(arguments.scene)
    folder = tempfile.TemporaryDirectory()
    volume, picture = os.path.join(folder.name, "volume.vdb"), os.path.join(folder.name, "image.exr")
    write_grid(scene, volume)
    command = ["vdb_render", volume, picture, "-v", "-cpus", str(arguments.threads), "-name", "density"]
    if arguments.shadows:
        command += camera_options(scene["camera"], scene["size"])
    else:
        command += options(scene["camera"], scene["size"], scene["step"], scene["grey"]["extinction"],
                           scene["grey"]["colour"], scene["terminate"])

    def frame():
        text = subprocess.run(command, capture_output=True, text=True, check=True)
        return rendering_ms(text.stdout + text.stderr)

    def image():
        raw = os.path.join(folder.name, "image.raw")
        subprocess.run([arguments.convert, "--convert", picture, raw], check=True)
        return np.fromfile(raw, "<f4").reshape(scene["size"][1], scene["size"][0], 4)

    version = subprocess.run(["vdb_render", "-version"], capture_output=True, text=True).stdout.strip()
    serve({"name": "vdb_render" + (" with shadows" if arguments.shadows else ""), "version": version}, frame, image)


if __name__ == "__main__":
    main()
