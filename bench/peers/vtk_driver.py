#!/usr/bin/python3
"""Times VTK's fixed-point volume ray cast mapper on one scene (see driver.py); needs an X server: xvfb-run.

The milliseconds are the mapper's own, without what showing the image in the window takes.

  xvfb-run -a /usr/bin/python3 bench/peers/vtk_driver.py SCENE.json [--threads 1]
"""
import argparse
import ctypes

import numpy as np
import vtk
from vtk.util import numpy_support

from driver import load_scene, serve


def image_data(scene):
    values = np.fromfile(scene["raw"], np.uint8 if scene["type"] == "u8" else np.float32)
    data = vtk.vtkImageData()
    data.SetDimensions(*scene["dims"])
    data.GetPointData().SetScalars(numpy_support.numpy_to_vtk(values, deep=1))
    return data


def volume_property(transfer):
    """transfer: rows value, r, g, b, opacity over one unit."""
    colour, opacity = vtk.vtkColorTransferFunction(), vtk.vtkPiecewiseFunction()
    for value, r, g, b, a in transfer:
        colour.AddRGBPoint(value, r, g, b)
        opacity.AddPoint(value, a)
    properties = vtk.vtkVolumeProperty()
    properties.SetColor(colour)
    properties.SetScalarOpacity(opacity)
    properties.SetScalarOpacityUnitDistance(1)
    properties.SetInterpolationTypeToLinear()
    properties.ShadeOff()
    return properties


def mapper(threads, step):
    """One ray a pixel, the sample distance kept, space leaping as it is by default."""
    m = vtk.vtkFixedPointVolumeRayCastMapper()
    m.SetNumberOfThreads(threads)
    m.AutoAdjustSampleDistancesOff()
    m.SetImageSampleDistance(1)
    m.SetSampleDistance(step)
    m.SetInteractiveSampleDistance(step)
    m.IntermixIntersectingGeometryOff()
    return m


def window(volume, camera, size):
    renderer = vtk.vtkRenderer()
    renderer.SetBackground(0, 0, 0)
    renderer.AddVolume(volume)
    w = vtk.vtkRenderWindow()
    w.SetOffScreenRendering(1)
    w.SetMultiSamples(0)
    w.SetSize(*size)
    w.AddRenderer(renderer)
    view = renderer.GetActiveCamera()
    view.SetPosition(*camera["eye"])
    view.SetFocalPoint(*camera["target"])
    view.SetViewUp(*camera["up"])
    view.SetViewAngle(camera["fov"])
    renderer.ResetCameraClippingRange()
    return w


def rendered(m, size):
    """The mapper's own image, 15-bit fixed point, as [height][width][4] in 0 to 1, top row first.

    The window would show it rounded to 8 bits and without alpha. VTK's Python gives the address and no array.
    """
    image = m.GetRayCastImage()
    memory_width, memory_height = image.GetImageMemorySize()
    address = int(image.GetImage().split("_")[1], 16)
    words = (ctypes.c_uint16 * (4 * memory_width * memory_height)).from_address(address)
    used = np.frombuffer(words, np.uint16).reshape(memory_height, memory_width, 4)
    (width, height), (left, bottom) = image.GetImageInUseSize(), image.GetImageOrigin()
    whole = np.zeros((size[1], size[0], 4))
    whole[bottom:bottom + height, left:left + width] = used[:height, :width] / 32767
    return whole[::-1]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("scene")
    parser.add_argument("--threads", type=int, default=1)
    arguments = parser.parse_args()
    scene = load_scene(arguments.scene)
    m = mapper(arguments.threads, scene["step"])
    m.SetInputData(image_data(scene))
    volume = vtk.vtkVolume()
    volume.SetMapper(m)
    volume.SetProperty(volume_property(np.loadtxt(scene["transfer"])))
    w = window(volume, scene["camera"], scene["size"])

    def frame():
        volume.Modified()
        w.Render()
        w.WaitForCompletion()
        return m.GetTimeToDraw() * 1e3

    frame()
    serve({"name": "VTK", "version": vtk.vtkVersion().GetVTKVersion()}, frame, lambda: rendered(m, scene["size"]))


if __name__ == "__main__":
    main()
