#!/usr/bin/python3
"""Writes a sparse smoke sequence as a simulation would: one .vdb file a step, a FloatGrid `density`, half precision.

  /usr/bin/python3 bench/peers/make_smoke.py OUT_DIR [--steps 40]

A rising, meandering, ragged plume in a box of 149x149x224 voxels whose turbulence moves with it, so that everything
visible changes at every step. Ends with about 0.4 million active voxels; prints how many are active and how many
change.
"""
import argparse
import os

import numpy as np
import pyopenvdb as vdb

DIMS = (149, 149, 224)
THRESHOLD = 1e-3  # thinner smoke is not stored


def turbulence(seed, edge=256):
    """Periodic noise of four octaves, mean 0.5, [edge]^3."""
    rng = np.random.default_rng(seed)
    total = np.zeros((edge,) * 3, np.float32)
    for weight, cells in [(1, 8), (.5, 16), (.25, 32), (.125, 64)]:
        values = rng.random((cells,) * 3, np.float32)
        place = np.arange(edge) * cells / edge
        cell = place.astype(int)
        t = (place - cell).astype(np.float32)
        t = t * t * (3 - 2 * t)
        for axis in range(3):
            shape = [1, 1, 1]
            shape[axis] = edge
            w = t.reshape(shape)
            values = np.take(values, cell, axis) * (1 - w) + np.take(values, (cell + 1) % cells, axis) * w
        total += weight * values
    return total / 1.875


class Plume:
    def __init__(self):
        self.noise = turbulence(7)
        self.x, self.y, self.z = (c.astype(np.float32) for c in np.ogrid[0:DIMS[0], 0:DIMS[1], 0:DIMS[2]])

    def density(self, time):
        """[x][y][z] in 0 to 1; time runs from 0 to 1."""
        front = DIMS[2] * (.1 + .88 * time)
        height = np.clip(self.z / front, 0, 1)
        sway = 12 * self.z / DIMS[2]
        x = self.x - 74 - sway * np.sin(self.z / 30 - 5 * time)
        y = self.y - 74 - sway * np.cos(self.z / 37 - 4 * time)
        inside = 1 - np.hypot(x, y) / (9 + (12 + 64 * time) * height)
        risen = int(round(110 * time))  # the turbulence rises with the smoke
        noise = np.roll(self.noise, risen, axis=2)[:DIMS[0], :DIMS[1], :DIMS[2]]
        cap = np.clip((front - self.z) / 12, 0, 1)
        thickness = cap * (1.5 * inside * (1 - .55 * height) + 4 * (noise - .55) - .9 * np.sqrt(height))
        return np.clip(thickness, 0, 1) * (inside > 0)


def write(path, density):
    grid = vdb.FloatGrid()
    grid.copyFromArray(np.where(density > THRESHOLD, density, 0))
    grid.prune()
    grid.name, grid.gridClass, grid.saveFloatAsHalf = "density", vdb.GridClass.FOG_VOLUME, True
    vdb.write(path, grids=[grid])
    return grid.activeVoxelCount()


def main():
    parser = argparse.ArgumentParser(description="Writes a sparse smoke sequence.")
    parser.add_argument("out")
    parser.add_argument("--steps", type=int, default=40)
    arguments = parser.parse_args()
    os.makedirs(arguments.out, exist_ok=True)
    plume, before, changed = Plume(), None, []
    for step in range(arguments.steps):
        density = plume.density((step + 1) / arguments.steps)
        active = write(f"{arguments.out}/smoke_{step:04d}.vdb", density)
        stored = np.where(density > THRESHOLD, density, 0).astype(np.float16)
        if before is not None:
            changed.append(float((stored != before).mean()))
        before = stored
    print(f"{arguments.steps} steps, {active} active voxels at the end, "
          f"median {100 * np.median(changed):.1f} % of the box changing")


if __name__ == "__main__":
    main()
