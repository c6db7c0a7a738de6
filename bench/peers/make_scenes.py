#!/usr/bin/python3
"""Writes the scenes of the single-frame comparison: a sparse plume and a dense noise, 256^3, u8 and f32.

  /usr/bin/python3 bench/peers/make_scenes.py OUT_DIR [--edge 256] [--size 512]

A scene is a JSON file that every driver reads: volume (raw, x fastest, voxel (i, j, k) at world (i, j, k)), transfer
function (rows `value r g b a`, opacity over one unit), camera, image size, sample distance and where rays end.
The `grey` scenes hold what `vdb_render` can draw as well: one colour, and an extinction proportional to the value.
"""
import argparse
import json
import os

import numpy as np

GREY_EXTINCTION = 0.3  # of the largest value, per unit
GREY = 0.7
CAMERA = dict(eye=[128, -500, 300], target=[128, 128, 128])  # of 256 voxels
TRANSFER_FUNCTIONS = dict(plume=["ramp"], noise=["bands", "ramp"])


def octave(rng, cells, edge):
    """A lattice of random numbers, smoothly interpolated; [z][y][x]."""
    values = rng.random((cells + 1,) * 3).astype(np.float32)
    place = np.linspace(0, cells, edge, endpoint=False)
    cell = place.astype(int)
    t = (place - cell).astype(np.float32)
    t = t * t * (3 - 2 * t)
    for axis in (2, 1, 0):
        shape = [1, 1, 1]
        shape[axis] = edge
        w = t.reshape(shape)
        values = np.take(values, cell, axis) * (1 - w) + np.take(values, cell + 1, axis) * w
    return values


def noise(edge):
    rng = np.random.default_rng(7)
    return sum(octave(rng, cells, edge) / weight for weight, cells in [(1, 6), (2, 12), (4, 24), (8, 48)]) / 1.875


def plume(noise):
    edge = len(noise)
    z, y, x = np.mgrid[0:edge, 0:edge, 0:edge].astype(np.float32) / edge
    r = np.hypot(x - .5 - .06 * np.sin(6 * z), y - .5 - .06 * np.cos(5 * z))
    return np.clip(1.4 * (1 - r / (.07 + .16 * z)) * (.35 + noise) - .15, 0, 1) * (z < .92)


def write_transfer_function(path, rgba, largest=255):
    rows = np.column_stack([np.linspace(0, largest, len(rgba)), rgba])
    np.savetxt(path, rows, fmt="%.9g", header="value r g b a: linear colour, opacity over one unit")


def colourful(t, opacity):
    red, green, blue = np.clip(1.5 * t, 0, 1), np.clip(1.6 * t - .3, 0, 1), .4 + .4 * np.sin(6 * t)
    return np.stack([red, green, blue, opacity], 1)


def ramp(t):
    """Nothing below an eighth of the range: what is thin can be skipped."""
    return colourful(t, np.clip((t - .12) / .88, 0, 1) ** 1.5 * .25)


def bands(t):
    """Something everywhere and little anywhere: nothing can be skipped, and hardly a ray ends early."""
    return colourful(t, np.maximum(np.abs(np.sin(25 * t)) * .02, .002))


def grey(t):
    colour = np.full_like(t, GREY)
    return np.stack([colour, colour, colour, -np.expm1(-GREY_EXTINCTION * t)], 1)


def write_scene(out, raw, element, transfer, edge, size):
    name = f"{raw.removesuffix('.raw')}_{transfer}"
    camera = {key: [x * edge / 256 for x in point] for key, point in CAMERA.items()}
    scene = dict(name=name, raw=raw, dims=[edge] * 3, type=element, transfer=f"{transfer}.txt", value_range=[0, 255],
                 camera=dict(camera, up=[0, 0, 1], fov=28), size=[size, size], step=1.0, terminate=0.999)
    if transfer == "grey":
        scene["grey"] = dict(colour=GREY, extinction=GREY_EXTINCTION)
    with open(f"{out}/{name}.json", "w") as f:
        json.dump(scene, f, indent=1)


def make_scenes(out, edge, size):
    os.makedirs(out, exist_ok=True)
    t = np.linspace(0, 1, 256)
    for name, function in dict(ramp=ramp, bands=bands, grey=grey).items():
        write_transfer_function(f"{out}/{name}.txt", function(t))
    dense = noise(edge)
    for volume, values in [("plume", plume(dense)), ("noise", dense)]:
        for element, array in [("u8", (values * 255).astype(np.uint8)), ("f32", (values * 255).astype(np.float32))]:
            raw = f"{volume}_{element}.raw"
            array.tofile(f"{out}/{raw}")
            for transfer in TRANSFER_FUNCTIONS[volume] + ["grey"] * (element == "f32"):
                write_scene(out, raw, element, transfer, edge, size)
        print(f"{volume}: {100 * (values > 0).mean():.1f} % of the voxels above 0, mean {values.mean():.3f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("out")
    parser.add_argument("--edge", type=int, default=256, help="voxels [256]")
    parser.add_argument("--size", type=int, default=512, help="pixels [512]")
    arguments = parser.parse_args()
    make_scenes(arguments.out, arguments.edge, arguments.size)


if __name__ == "__main__":
    main()
