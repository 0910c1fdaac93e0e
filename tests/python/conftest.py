"""What the tests of the Python package share. They need STRATA_ROOT, the source folder, and STRATA_TOOL, the tool."""
import os
import subprocess

import numpy as np
import pytest

import strata

ROOT = os.environ["STRATA_ROOT"]
TOOL = os.environ["STRATA_TOOL"]


def data(name):
    return os.path.join(ROOT, "data", name)


def tool(*arguments):
    """What the tool prints."""
    return subprocess.run([TOOL, *map(str, arguments)], capture_output=True, text=True, check=True).stdout


def torus(rings, sides, major=2.0, minor=0.7):
    """Vertices and faces of a torus about z, outward."""
    ring, side = np.meshgrid(np.arange(rings), np.arange(sides), indexing="ij")
    a, b = 2 * np.pi * ring.ravel() / rings, 2 * np.pi * side.ravel() / sides
    r = major + minor * np.cos(b)
    vertices = np.column_stack([r * np.cos(a), r * np.sin(a), minor * np.sin(b)])

    def at(i, j):
        return (i % rings) * sides + j % sides

    i, j = ring.ravel(), side.ravel()
    faces = np.concatenate(
        [
            np.column_stack([at(i, j), at(i + 1, j), at(i + 1, j + 1)]),
            np.column_stack([at(i, j), at(i + 1, j + 1), at(i, j + 1)]),
        ]
    )
    return vertices, faces


CUBE_VERTICES = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
CUBE_QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


def cube_triangles():
    return np.array([t for a, b, c, d in CUBE_QUADS for t in ((a, b, c), (a, c, d))])


@pytest.fixture(scope="session")
def knot():
    return strata.read_mesh(data("knot.obj"))


@pytest.fixture(scope="session")
def knot_voxels(knot):
    return strata.voxelize(knot, resolution=64)
