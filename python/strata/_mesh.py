"""Meshes of triangles: from files, from arrays, from the objects of other packages."""

from __future__ import annotations

import os
from typing import Any, Dict, Optional, Sequence, Tuple

import numpy as np

from . import _strata
from ._arrays import PathLike, check_corners, colours_of, limits_of, numbers_of, points_of, text_of_path, three_of, triangles_of, warn_of
from ._errors import InputError, UsageError

_METRES = {"": 0.0, "um": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254, "ft": 0.3048}


class Mesh:
    """A mesh of triangles, counter-clockwise seen from outside. It does not change once it is made.

    Nothing is required of its edges and vertices. Strata looks whether the mesh is closed, and turns parts that are inside
    out; a warning (`StrataWarning`) says so.

    Parameters
    ----------
    vertices : (n, 3) array_like, or an object
        World positions, finite. Or an object with vertices and faces: of trimesh, Open3D, PyVista, VTK or meshio, or a pair
        ``(vertices, faces)``.
    faces : (m, 3) or (m, k) array_like, or a list of lists, optional
        Indices of vertices, from 0. Polygons are cut into triangles.
    vertex_colours, face_colours : (n, 3) or (n, 4) array_like, optional
        Of each vertex, of each face, sRGB and alpha: uint8, or floats from 0 to 1. For `voxelize`'s `colours`.
    rule : {"winding", "nonzero", "parity"}
        Which winding numbers are inside: above 0, not 0, odd.
    keep_orientation : bool
        Parts that are inside out are left as they are.
    name : str
        Stands for the mesh in messages.
    threads : int
        0: one for each processor.

    Raises
    ------
    InputError
        For arrays of another shape or type, for a coordinate that is not finite, for an index that is not that of a vertex.
    """

    _native: Any

    def __init__(
        self,
        vertices: Any,
        faces: Any = None,
        *,
        vertex_colours: Any = None,
        face_colours: Any = None,
        rule: str = "winding",
        keep_orientation: bool = False,
        name: str = "the mesh",
        threads: int = 0,
    ) -> None:
        limits = limits_of(threads, None)
        if faces is None:
            points, corners, offsets = arrays_of(vertices)
        else:
            points = points_of(vertices, "vertices")
            corners, offsets = triangles_of(faces, len(points))
        count = len(corners) // 3 if offsets is None else len(offsets) - 1
        colours = (colours_of(vertex_colours, len(points), "vertex_colours"), colours_of(face_colours, count, "face_colours"))
        self._native, told = _strata.make_mesh(
            points, corners, offsets, *colours, str(name), str(rule), bool(keep_orientation), limits
        )
        warn_of(told)

    @classmethod
    def _of(cls, native: Any) -> "Mesh":
        made = cls.__new__(cls)
        made._native = native
        return made

    @property
    def vertices(self) -> np.ndarray:
        """(n, 3) float64 array of world positions. It shows the mesh's own memory and cannot be written to."""
        return self._native.vertices

    @property
    def faces(self) -> np.ndarray:
        """(m, 3) uint32 array of triangles. It shows the mesh's own memory and cannot be written to."""
        return self._native.faces

    @property
    def closed(self) -> bool:
        """Whether every ray enters the mesh as often as it leaves it."""
        return self._native.closed

    @property
    def name(self) -> str:
        """The path of the file, or what stands for the mesh in messages."""
        return self._native.name

    @property
    def rule(self) -> str:
        """Which winding numbers are inside: the rule that was given, or "parity" where the mesh has no outside."""
        return self._native.rule

    @property
    def area(self) -> float:
        """Square world units."""
        return self._native.area

    @property
    def volume(self) -> float:
        """Signed, in cubic world units; without meaning for a mesh that is not closed."""
        return self._native.volume

    @property
    def bounds(self) -> np.ndarray:
        """(2, 3) float64 array: the lower and the upper corner of the box around the triangles."""
        return np.array([self._native.low, self._native.high])

    def info(self, *, threads: int = 0) -> Dict[str, Any]:
        """What `strata info` says of a mesh: counts, edges by their faults, area, volume, parts.

        Returns
        -------
        dict
            With the keys ``name``, ``format``, ``vertices``, ``welded_vertices`` (different positions), ``triangles``,
            ``faces`` (of the file), ``components``, ``closed``, ``rule``, ``area``, ``volume``, ``low``, ``high``,
            ``edges``, ``boundary_edges`` (used once), ``non_manifold_edges`` (more than twice), ``misoriented_edges``,
            ``unbalanced_edges`` (not used equally often in both directions), ``degenerate_faces`` (without area),
            ``duplicate_faces``, ``dropped_faces``, ``turned_around``, ``parts`` (names) and ``coloured``.
        """
        return self._native.info(limits_of(threads, None))

    def contour(self, *, threads: int = 0, memory_limit: Optional[int] = None, **grid: Any) -> "Mesh":
        """A closed mesh by dual contouring: its voxels on the same grid are those of this mesh.

        After T. Ju, F. Losasso, S. Schaefer, J. Warren: Dual contouring of Hermite data, 2002.

        Parameters
        ----------
        threads, memory_limit
            As for `voxelize`.
        **grid
            The grid, as `voxelize` takes it: `resolution`, `voxel_size`, `dims`, `like`, and the rest.
        """
        from ._voxels import grid_of

        native, told = self._native.contour(grid_of(self.bounds, **grid), limits_of(threads, memory_limit))
        warn_of(told)
        return Mesh._of(native)

    def save(self, path: PathLike, *, threads: int = 0) -> None:
        """Writes a .obj, .stl, .ply, .off or .3mf file, which appears only when it is complete.

        Raises
        ------
        UsageError
            For another extension.
        OutputError
            If the file cannot be written.
        """
        self._native.save(text_of_path(path), limits_of(threads, None))

    def __repr__(self) -> str:
        kind = "closed" if self.closed else "open"
        return f"<strata.Mesh {self.name!r}: {len(self.vertices)} vertices, {len(self.faces)} triangles, {kind}>"


def read_mesh(
    path: PathLike,
    *,
    rule: str = "winding",
    keep_orientation: bool = False,
    parts: Sequence[str] = (),
    unit: str = "",
    up: str = "file",
    scale: Any = 1.0,
    translate: Sequence[float] = (0, 0, 0),
    threads: int = 0,
) -> Mesh:
    """Reads a mesh file: .obj, .stl, .ply, .off, .3mf, .amf, .gltf, .glb, with parts, materials and colours.

    Parameters
    ----------
    path : str or os.PathLike
        The file.
    rule : {"winding", "nonzero", "parity"}
        Which winding numbers are inside.
    keep_orientation : bool
        Parts that are inside out are left as they are.
    parts : sequence of str
        Names of the parts to keep; empty: all.
    unit : {"", "um", "mm", "cm", "m", "in", "ft"}
        Unit of the world. Files that say their unit (3MF, AMF, glTF) are converted to it; empty: they are taken as they are.
    up : {"file", "y", "z"}
        The axis that is up in the file: y is turned to z. "file": y in glTF, else z.
    scale : float or (float, float, float)
        Factors along x, y, z, after the unit and the turn; not 0.
    translate : (float, float, float)
        World units, after the scale.
    threads : int
        0: one for each processor.

    Raises
    ------
    InputError
        There is no such file, or it is malformed; with the line or the byte.
    """
    names = [parts] if isinstance(parts, str) else [str(part) for part in parts]
    if unit not in _METRES:
        raise UsageError(f"unit must be one of {', '.join(repr(name) for name in _METRES)}, got {unit!r}")
    factors = three_of(scale, "scale")
    if 0 in factors:
        raise UsageError(f"scale must not be 0, got {scale}")
    place = _strata.Placement(_METRES[unit], str(up), factors, numbers_of(translate, 3, "translate"))
    limits = limits_of(threads, None)
    native, told = _strata.read_mesh(text_of_path(path), str(rule), bool(keep_orientation), names, place, limits)
    warn_of(told)
    return Mesh._of(native)


def mesh_of(given: Any, threads: int = 0) -> Mesh:
    """A mesh from whatever a user has: a Mesh, a path, or what Mesh() takes."""
    if isinstance(given, Mesh):
        return given
    if isinstance(given, (str, os.PathLike)):
        return read_mesh(given, threads=threads)
    return Mesh(given, threads=threads)


def arrays_of(given: Any) -> Tuple[np.ndarray, np.ndarray, Optional[np.ndarray]]:
    """Points, corners and offsets of an object with a mesh, whichever package it comes from."""
    if isinstance(given, Mesh):
        return given.vertices, given.faces.astype(np.int64).reshape(-1), None
    if isinstance(given, (tuple, list)) and len(given) == 2:
        points = points_of(given[0], "vertices")
        return (points, *triangles_of(given[1], len(points)))
    for reader in (_of_trimesh, _of_open3d, _of_open3d_tensor, _of_meshio, _of_vtk):
        found = reader(given)
        if found is not None:
            return found
    raise TypeError(
        f"a mesh must be a Mesh, a path, a pair (vertices, faces), or an object of trimesh, Open3D, PyVista, VTK or meshio, "
        f"got {type(given).__name__}"
    )


def _triangles(vertices: Any, faces: Any) -> Tuple[np.ndarray, np.ndarray, Optional[np.ndarray]]:
    points = points_of(vertices, "vertices")
    return (points, *triangles_of(np.asarray(faces), len(points)))


def _of_trimesh(given: Any) -> Any:
    if hasattr(given, "vertices") and hasattr(given, "faces"):
        return _triangles(given.vertices, given.faces)
    return None


def _of_open3d(given: Any) -> Any:
    if hasattr(given, "vertices") and hasattr(given, "triangles"):
        return _triangles(given.vertices, given.triangles)
    return None


def _of_open3d_tensor(given: Any) -> Any:
    if not (hasattr(given, "vertex") and hasattr(given, "triangle")):
        return None
    return _triangles(given.vertex["positions"].numpy(), given.triangle["indices"].numpy())


def _of_meshio(given: Any) -> Any:
    if not (hasattr(given, "points") and hasattr(given, "cells") and isinstance(given.cells, (list, tuple))):
        return None
    points = points_of(given.points, "points")
    rows = []
    for block in given.cells:
        kind, data = (block.type, block.data) if hasattr(block, "type") else block
        if kind in ("triangle", "quad", "polygon"):
            rows.extend(np.asarray(data).tolist())
        elif kind not in ("vertex", "line"):
            raise InputError(f"cells of the kind {kind!r} are no faces; a mesh has cells of the kinds triangle, quad, polygon")
    if not rows:
        raise InputError("the mesh has no faces: no cells of the kinds triangle, quad, polygon")
    return (points, *triangles_of(rows, len(points), "cells"))


def _of_vtk(given: Any) -> Any:
    if hasattr(given, "GetPolys") and hasattr(given, "GetPoints"):  # vtkPolyData, and pyvista.PolyData
        return _of_polydata(given)
    if hasattr(given, "extract_surface"):  # other meshes of PyVista
        return _of_vtk(given.extract_surface())
    return None


def _of_polydata(given: Any) -> Any:
    from vtkmodules.util.numpy_support import vtk_to_numpy  # it is loaded: the object is its

    if given.GetPoints() is None:
        raise InputError("the mesh has no points")
    points = points_of(vtk_to_numpy(given.GetPoints().GetData()), "points")
    if given.GetNumberOfStrips():
        raise InputError("the mesh has triangle strips; vtkTriangleFilter makes triangles of them")
    polys = given.GetPolys()
    if polys.GetNumberOfCells() == 0:
        raise InputError("the mesh has no polygons")
    offsets = vtk_to_numpy(polys.GetOffsetsArray()).astype(np.int64)
    corners = vtk_to_numpy(polys.GetConnectivityArray()).astype(np.int64)
    plain = bool((np.diff(offsets) == 3).all())
    known = None if plain else np.ascontiguousarray(offsets)
    return points, check_corners(corners, known, len(points), "faces"), known
