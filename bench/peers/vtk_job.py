#!/usr/bin/python3
"""What a VTK user would write for the whole job: load every .vdb step, render it, save the picture. Needs xvfb-run.

  xvfb-run -a /usr/bin/python3 bench/peers/vtk_job.py JOB.json OUT_DIR [--threads 2]

Prints the seconds that loading, rendering and writing took; Python's start and VTK's import are not in them. JOB.json
is compare_jobs.py's. Leaves the last image as OUT_DIR/last.raw as well.
"""
import argparse
import json
import time

import numpy as np
import pyopenvdb
import vtk
from vtk.util import numpy_support

from vtk_driver import mapper, rendered, volume_property, window


def load(path, job, buffer):
    """The box of the job as VTK's image, voxel by voxel in index space."""
    grid = pyopenvdb.read(path, job["grid"])
    buffer[:] = 0
    grid.copyToArray(buffer, ijk=tuple(job["box"][0]))
    data = vtk.vtkImageData()
    data.SetDimensions(*buffer.shape)
    data.SetOrigin(*job["box"][0])
    data.GetPointData().SetScalars(numpy_support.numpy_to_vtk(buffer.ravel(order="F"), deep=1))
    return data


def write_png(w, path):
    grab = vtk.vtkWindowToImageFilter()
    grab.SetInput(w)
    grab.ReadFrontBufferOff()
    grab.ShouldRerenderOff()
    writer = vtk.vtkPNGWriter()
    writer.SetFileName(path)
    writer.SetInputConnection(grab.GetOutputPort())
    writer.Write()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("job")
    parser.add_argument("out")
    parser.add_argument("--threads", type=int, default=2)
    arguments = parser.parse_args()
    with open(arguments.job) as f:
        job = json.load(f)
    m = mapper(arguments.threads, 1.0)
    volume = vtk.vtkVolume()
    volume.SetMapper(m)
    volume.SetProperty(volume_property(np.loadtxt(job["transfer"])))
    buffer = np.zeros(np.subtract(job["box"][1], job["box"][0]) + 1, np.float32)
    m.SetInputData(load(job["files"][0], job, buffer))
    w = window(volume, job["index_camera"], job["size"])
    seconds = dict(load=0.0, render=0.0, write=0.0)
    for step, path in enumerate(job["files"]):
        begin = time.perf_counter()
        m.SetInputData(load(path, job, buffer))
        loaded = time.perf_counter()
        w.Render()
        w.WaitForCompletion()
        shown = time.perf_counter()
        write_png(w, f"{arguments.out}/frame.{step:04d}.png")
        seconds["load"] += loaded - begin
        seconds["render"] += shown - loaded
        seconds["write"] += time.perf_counter() - shown
    rendered(m, job["size"]).astype("<f4").tofile(f"{arguments.out}/last.raw")
    print(json.dumps(seconds))


if __name__ == "__main__":
    main()
