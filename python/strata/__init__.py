"""Strata: solids as sorted depth lists per pixel. Meshes to voxels, Boolean trees, depth lists.

>>> import strata
>>> voxels = strata.voxelize("knot.obj", resolution=256)  # doctest: +SKIP
>>> voxels.numpy().sum()  # doctest: +SKIP
1137108

Work runs on all processors, without the interpreter's lock. Ctrl-C stops it. Results do not depend on the number of threads.
"""

from . import csg
from ._errors import (
    CancelledError,
    Error,
    GeometryError,
    InputError,
    InternalError,
    LimitError,
    OutputError,
    StrataWarning,
    UsageError,
    VerificationError,
)
from ._lists import DepthLists, FragmentLists, HashBuffer, depth_lists
from ._mesh import Mesh, read_mesh
from ._pictures import Camera, png_of
from ._strata import version as __version__
from ._voxels import Grid, Slice, Voxels, read_voxels, voxelize

__all__ = [
    "Camera",
    "CancelledError",
    "DepthLists",
    "Error",
    "FragmentLists",
    "GeometryError",
    "Grid",
    "HashBuffer",
    "InputError",
    "InternalError",
    "LimitError",
    "Mesh",
    "OutputError",
    "Slice",
    "StrataWarning",
    "UsageError",
    "VerificationError",
    "Voxels",
    "csg",
    "depth_lists",
    "png_of",
    "read_mesh",
    "read_voxels",
    "voxelize",
]
