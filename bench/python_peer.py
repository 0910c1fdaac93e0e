#!/usr/bin/env python3
"""Times strata.voxelize() against VTK, and against trimesh and PyVista where they are installed, in processor seconds.

usage: PYTHONPATH=build/release/python bench/python_peer.py [RESOLUTION]
"""
import os
import sys
import time

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "tests", "python"))
os.environ.setdefault("STRATA_ROOT", "")
os.environ.setdefault("STRATA_TOOL", "")

import strata  # noqa: E402
from conftest import torus  # noqa: E402
from test_voxels import by_vtk  # noqa: E402


def best(run, times):
    """Least processor time, which depends less on what else runs, and the value."""
    found = []
    for _ in range(times):
        begin = time.process_time()
        value = run()
        found.append(time.process_time() - begin)
    return min(found), value


def main():
    resolution = int(sys.argv[1]) if len(sys.argv) > 1 else 256
    ball = strata.csg.sphere(1, fn=316).mesh(faces="input")
    for name, (vertices, faces) in (("torus", torus(500, 100)), ("sphere", (ball.vertices, ball.faces.astype(np.int64)))):
        print(name, end=": ")
        compare(vertices, faces, resolution)


def compare(vertices, faces, resolution):
    mesh = strata.Mesh(vertices, faces)
    ours, voxels = best(lambda: strata.voxelize(mesh, resolution=resolution), 15)
    array, solid = best(voxels.numpy, 5)
    made, _ = best(lambda: strata.Mesh(vertices, faces), 5)
    print(f"{len(faces)} triangles, {voxels.dims} voxels, {voxels.count} solid")
    print(f"strata.voxelize     {ours:9.4f} s   (Mesh() of the arrays {made:.4f} s, numpy() {array:.4f} s)")

    def tell(name, seconds, theirs):
        ratio = seconds / ours
        print(f"{name:19} {seconds:9.4f} s   {ratio:7.1f} times as long; {int((theirs != solid).sum())} voxels differ")

    try:
        seconds, theirs = best(lambda: by_vtk(vertices, faces, voxels), 2)
        tell("VTK's stencil", seconds, theirs)
    except ImportError:
        print("VTK is not installed: python3-vtk9")
    try:
        import pyvista

        grid = pyvista.wrap(voxels.to_vtk())
        surface = pyvista.PolyData(vertices, np.column_stack([np.full(len(faces), 3), faces]))
        seconds, theirs = best(lambda: surface.voxelize_binary_mask(reference_volume=grid), 2)
        tell("pyvista's mask", seconds, np.asarray(theirs["mask"]).reshape(voxels.dims, order="F").astype(bool))
    except ImportError:
        print("pyvista is not installed")
    try:
        import trimesh

        body = trimesh.Trimesh(vertices, faces, process=False)
        pitch = float(voxels.spacing[0])
        seconds, filled = best(lambda: body.voxelized(pitch).fill(), 1)
        print(f"{'trimesh, fill()':19} {seconds:9.4f} s   {seconds / ours:7.1f} times as long; {filled.filled_count} voxels, of the surface too")
    except ImportError:
        print("trimesh is not installed")


if __name__ == "__main__":
    main()
