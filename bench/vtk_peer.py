#!/usr/bin/python3
"""Pictures of bench_transparency's meshes by VTK's dual depth peeling.

    bench_transparency --tables meshes --export FOLDER
    xvfb-run -a bench/vtk_peer.py FOLDER/*.mesh

Needs Debian's python3-vtk9 and python3-numpy; without a GPU VTK draws by llvmpipe. Prints the
median time of a picture and how far it is from Strata's. Lighting is off; each triangle has the
colour that Strata gives its visible side.
"""
import statistics
import sys
import time

import numpy
import vtk
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy


def read(path):
    with open(path, 'rb') as file:
        head = file.readline().split()
        vertices, triangles, width, height = (int(word) for word in head[:4])
        numbers = [float(word) for word in head[4:]]

        def array(kind, count, columns):
            return numpy.fromfile(file, kind, count * columns).reshape(count, columns)
        return {'size': (width, height), 'angle': numbers[0], 'eye': numbers[1:4], 'centre': numbers[4:7],
                'positions': array('f8', vertices, 3), 'triangles': array('u4', triangles, 3),
                'colours': array('f4', triangles, 4), 'picture': array('f4', width * height, 4)}


def actor_of(mesh):
    points = vtk.vtkPoints()
    points.SetData(numpy_to_vtk(mesh['positions'].astype('f4'), deep=True))
    count = len(mesh['triangles'])
    cells = vtk.vtkCellArray()
    with_size = numpy.hstack([numpy.full((count, 1), 3), mesh['triangles']]).astype('i8')
    cells.SetCells(count, numpy_to_vtkIdTypeArray(with_size.ravel(), deep=True))
    data = vtk.vtkPolyData()
    data.SetPoints(points)
    data.SetPolys(cells)
    data.GetCellData().SetScalars(numpy_to_vtk(numpy.rint(mesh['colours'] * 255).astype('u1'), deep=True))
    mapper = vtk.vtkPolyDataMapper()
    mapper.SetInputData(data)
    actor = vtk.vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().LightingOff()
    actor.ForceTranslucentOn()
    return actor


def window_of(mesh):
    renderer = vtk.vtkRenderer()
    renderer.AddActor(actor_of(mesh))
    renderer.SetBackground(0, 0, 0)
    renderer.SetUseDepthPeeling(True)
    renderer.SetMaximumNumberOfPeels(100)
    renderer.SetOcclusionRatio(0)
    camera = renderer.GetActiveCamera()
    camera.SetPosition(mesh['eye'])
    camera.SetFocalPoint(mesh['centre'])
    camera.SetViewUp(0, 0, 1)
    camera.SetViewAngle(mesh['angle'])
    renderer.ResetCameraClippingRange()
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(True)
    window.SetMultiSamples(0)
    window.SetAlphaBitPlanes(1)
    window.SetSize(*mesh['size'])
    window.AddRenderer(renderer)
    return window, renderer


def milliseconds(window, rounds=5):
    """Wall and CPU time of a picture in memory, the window made and the mesh on the GPU before."""
    walls, cpus = [], []
    pixels = vtk.vtkUnsignedCharArray()
    width, height = window.GetSize()
    for _ in range(rounds):
        wall, cpu = time.perf_counter(), time.process_time()
        window.Render()
        window.GetPixelData(0, 0, width - 1, height - 1, 0, pixels, 0)
        walls.append(1e3 * (time.perf_counter() - wall))
        cpus.append(1e3 * (time.process_time() - cpu))
    picture = vtk_to_numpy(pixels).reshape(height, width, 3)[::-1]
    return statistics.median(walls), statistics.median(cpus), picture


def main():
    for path in sys.argv[1:]:
        mesh = read(path)
        window, renderer = window_of(mesh)
        window.Render()
        wall, cpu, picture = milliseconds(window)
        width, height = mesh['size']
        own = mesh['picture'].reshape(height, width, 4)[:, :, :3]
        by = numpy.abs(picture.astype(int) - numpy.rint(own * 255).astype(int)).max(axis=2)
        covered = own.max(axis=2) > 0
        same = (picture.max(axis=2) > 0) == covered
        within = [f'{(by <= step)[covered].mean() * 100:.3f} % within {step}/255' for step in (1, 2, 3)]
        print(f'{path}: {len(mesh["triangles"])} triangles, {wall:.0f} ms, {cpu:.0f} ms of CPU time, '
              f'dual depth peeling {renderer.GetLastRenderingUsedDepthPeeling()}; covered pixels: '
              f'{", ".join(within)}, {(~same).sum()} only in one picture', flush=True)
        window.Finalize()


if __name__ == '__main__':
    main()
