#!/usr/bin/env python3
"""Reads what strata writes with numpy and pyopenvdb (python3-numpy, python3-openvdb).

usage: python_readers.py STRATA    exit code 77: one of the two is not installed
"""
import json
import os
import subprocess
import sys
import tempfile

try:
    import numpy
    import pyopenvdb
except ImportError as missing:
    print(f"skipped: {missing} (Debian: python3-numpy, python3-openvdb)")
    sys.exit(77)

STRATA = os.path.abspath(sys.argv[1])


def write_boxes(path, boxes):
    """An OBJ of boxes, so that no mirror image or permutation of axes is the same."""
    with open(path, "w", encoding="ascii") as out:
        for number, (low, high) in enumerate(boxes):
            for corner in range(8):
                print("v", *((high if corner >> axis & 1 else low)[axis] for axis in range(3)), file=out)
            for face in ((1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (3, 7, 8, 4), (1, 5, 7, 3), (2, 4, 8, 6)):
                print("f", *(vertex + 8 * number for vertex in face), file=out)


def strata(*words):
    run = subprocess.run([STRATA, "voxelize", *words], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    return run.stdout


def read_vdb(path, shape):
    (grid,), _ = pyopenvdb.readAll(path)
    values = numpy.zeros(shape, dtype=bool if isinstance(grid, pyopenvdb.BoolGrid) else float)
    grid.copyToArray(values)
    return grid, values


def check_distances(files, size):
    """A level set has the values of the array and the signs of the solid."""
    sizes = ("--voxel-size", str(size), "--padding", "3")
    strata(*files, *sizes, "-o", "solid.npz")
    strata(*files, *sizes, "--sdf", "-o", "distances.npz")
    strata(*files, *sizes, "--sdf", "-o", "surface.vdb")
    solid, array = numpy.load("solid.npz")["voxels"], numpy.load("distances.npz")["voxels"]
    grid, values = read_vdb("surface.vdb", array.shape)
    assert array.dtype == numpy.float32 and ((array < 0) == solid).all() and solid.any()
    assert grid.name == "surface" and grid.gridClass == "level set"
    assert numpy.isclose(grid.background, 3 * size) and (values.astype(numpy.float32) == array).all()
    assert grid.activeVoxelCount() == (abs(array) < array.max()).sum()


def check_fog(files, size):
    """A value is the mean of the 4 x 4 x 4 voxels of a finer grid."""
    strata(*files, "--voxel-size", str(size), "-o", "coarse.npz")
    arrays = numpy.load("coarse.npz")
    shape, origin, spacing = arrays["voxels"].shape, arrays["origin"], arrays["spacing"]
    strata(*files, "--voxel-size", str(size), "--fog", "-o", "fog.vdb")
    grid, values = read_vdb("fog.vdb", shape)
    assert grid.name == "density" and grid.gridClass == "fog volume"
    fine = ",".join(str(4 * side) for side in shape)
    bounds = ",".join(str(x) for x in [*origin, *(origin + numpy.array(shape) * spacing)])
    strata(*files, "--grid", fine, "--bounds=" + bounds, "-o", "fine.npz")
    samples = numpy.load("fine.npz")["voxels"]
    nx, ny, nz = shape
    assert (values == samples.reshape(nx, 4, ny, 4, nz, 4).mean(axis=(1, 3, 5))).all()
    assert ((values > 0) & (values < 1)).sum() > 100


def main():
    write_boxes("a.obj", [((10, 20, 30), (17, 22, 32.2))])
    write_boxes("b.obj", [((10, 22, 30), (12.3, 29, 35.1))])
    both, size = ["a.obj", "b.obj", "--voxel-size", "0.3"], 0.3

    report = json.loads(strata(*both, "-o", "a.npz", "--json"))
    arrays = numpy.load("a.npz")
    solid, origin, spacing = arrays["voxels"], arrays["origin"], arrays["spacing"]
    assert solid.dtype == bool and list(solid.shape) == report["grid"]["dims"]
    assert solid.sum() == report["voxels"]["solid"] > 1000
    assert list(origin) == report["grid"]["origin"] and list(spacing) == report["grid"]["voxel_size"]
    indices = numpy.indices(solid.shape).reshape(3, -1).T
    centres = origin + (indices + 0.5) * spacing
    inside = numpy.zeros(len(centres), dtype=bool)
    for low, high in (((10, 20, 30), (17, 22, 32.2)), ((10, 22, 30), (12.3, 29, 35.1))):
        inside |= ((centres > low) & (centres < high)).all(axis=1)
    assert (solid.reshape(-1) == inside).all()

    strata(*both, "-o", "a.npy")
    assert (numpy.load("a.npy") == solid).all()
    strata(*both, "--ids", "-o", "ids.npz")
    ids = numpy.load("ids.npz")["voxels"]
    assert ids.dtype == numpy.uint8 and ((ids != 0) == solid).all() and set(ids.flat) == {0, 1, 2}

    strata(*both, "-o", "a.vdb")
    grid, values = read_vdb("a.vdb", solid.shape)
    assert isinstance(grid, pyopenvdb.BoolGrid) and grid.name == "solid"
    assert (values == solid).all() and grid.activeVoxelCount() == solid.sum()
    assert numpy.allclose(grid.transform.indexToWorld((3, 4, 5)), origin + numpy.array((3.5, 4.5, 5.5)) * size)
    grid.deepCopy()

    strata(*both, "--ids", "--name", "parts", "-o", "ids.vdb")
    grid, values = read_vdb("ids.vdb", solid.shape)
    assert isinstance(grid, pyopenvdb.FloatGrid) and grid.name == "parts"
    assert (values == ids).all()

    with open("c.csg", "w", encoding="ascii") as out:
        out.write("difference() { sphere(r = 5, $fn = 20); cube([3, 9, 4]); }")
    check_fog(["a.obj", "b.obj"], size)
    check_fog(["c.csg"], size)
    check_distances(["a.obj", "b.obj"], size)
    print("read", solid.sum(), "voxels")


with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    main()
    os.chdir("/")
