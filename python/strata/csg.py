"""Boolean trees of solids: combine them with ``-``, ``|`` and ``&``, then draw, measure, mesh or voxelize the result.

>>> from strata import csg
>>> part = csg.cube(20, center=True) - csg.sphere(13, fn=100)
>>> round(part.measure().volume)  # doctest: +SKIP
838
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, Iterable, Optional, Sequence, Tuple, Union

import numpy as np

from . import _strata
from ._arrays import PathLike, axis_of, integer_of, limits_of, number_of, numbers_of, size_of, text_of_path, three_of, warn_of
from ._errors import InputError, UsageError
from ._lists import DepthLists, depth_lists
from ._mesh import Mesh, mesh_of
from ._pictures import Camera, png_of
from ._voxels import Voxels, voxelize

__all__ = [
    "Measures",
    "Solid",
    "cube",
    "cylinder",
    "intersection",
    "load",
    "parse",
    "solid",
    "sphere",
    "union",
]


@dataclass(frozen=True)
class Measures:
    """Sizes of a solid.

    Attributes
    ----------
    volume : float
        Cubic world units.
    volume_error : float
        Bound of its error; of exact measures: how much the rounding of vertices to the lattice can change it.
    area : float
        Square world units.
    area_error : float
        Estimate of its error.
    centre : (float, float, float)
        Centre of mass.
    low, high : (float, float, float)
        Corners of the box around the solid.
    inertia : 3 x 3 tuple, or None
        Tensor of inertia about the centre for the density 1; exact measures only.
    exact : bool
        False: summed along rays, since solids are open or too large, or since a resolution was given.
    empty : bool
        The solid has no inside.
    """

    volume: float
    volume_error: float
    area: float
    area_error: float
    centre: Tuple[float, float, float]
    low: Tuple[float, float, float]
    high: Tuple[float, float, float]
    inertia: Optional[Tuple[Tuple[float, float, float], ...]]
    exact: bool
    empty: bool


class Solid:
    """A Boolean tree of solids, as a value: operations make a new one, in time proportional to the number of solids.

    ``a | b`` is the union, ``a & b`` the intersection, ``a - b`` is a without b. Made by the functions of this module, or of
    a mesh: ``Solid(mesh)``.

    Parameters
    ----------
    mesh : Mesh, path, or what Mesh() takes
        It need not be closed, convex or free of self-intersections.
    threads : int
        0: one for each processor.
    """

    _native: Any

    def __init__(self, mesh: Any, *, threads: int = 0) -> None:
        self._native = _strata.solid_of_mesh(mesh_of(mesh, threads)._native)

    @classmethod
    def _of(cls, native: Any) -> "Solid":
        made = cls.__new__(cls)
        made._native = native
        return made

    # --- operations -------------------------------------------------------------------------------------------------

    def __or__(self, other: "Solid") -> "Solid":
        return _combined(_strata.unite, self, other)

    def __and__(self, other: "Solid") -> "Solid":
        return _combined(_strata.intersect, self, other)

    def __sub__(self, other: "Solid") -> "Solid":
        return _combined(_strata.subtract, self, other)

    def __add__(self, other: "Solid") -> "Solid":
        return _combined(_strata.unite, self, other)

    def translate(self, x: Any, y: Optional[float] = None, z: Optional[float] = None) -> "Solid":
        """Moves the solid: ``translate(x, y, z)`` or ``translate((x, y, z))``, in world units."""
        matrix = np.eye(4)
        matrix[:3, 3] = _vector(x, y, z, "translate")
        return self.transform(matrix)

    def rotate(self, x: Any, y: Optional[float] = None, z: Optional[float] = None) -> "Solid":
        """Turns the solid about x, then y, then z, in degrees, as OpenSCAD does: ``rotate(x, y, z)`` or ``rotate((x, y, z))``."""
        matrix = np.eye(4)
        for axis, degrees in enumerate(_vector(x, y, z, "rotate")):
            matrix = _rotation(axis, degrees) @ matrix
        return self.transform(matrix)

    def scale(self, x: Any, y: Optional[float] = None, z: Optional[float] = None) -> "Solid":
        """Stretches the solid: ``scale(factor)``, ``scale(x, y, z)`` or ``scale((x, y, z))``. Factors are not 0."""
        factors = (x, x, x) if y is None and z is None and np.ndim(x) == 0 else _vector(x, y, z, "scale")
        return self.transform(np.diag([*(number_of(factor, "scale") for factor in factors), 1.0]))

    def mirror(self, x: Any, y: Optional[float] = None, z: Optional[float] = None) -> "Solid":
        """Mirrors the solid at the plane through the origin with this normal, which is not 0. ``mirror("x")`` will do."""
        if isinstance(x, str):
            normal = np.eye(3)[axis_of(x)]
        else:
            normal = np.array(_vector(x, y, z, "mirror"))
        length = float(np.linalg.norm(normal))
        if not length > 0:
            raise UsageError("the normal of mirror must not be 0, 0, 0")
        normal = normal / length
        matrix = np.eye(4)
        matrix[:3, :3] -= 2 * np.outer(normal, normal)
        return self.transform(matrix)

    def transform(self, matrix: Any) -> "Solid":
        """Moves the solid by an affine matrix.

        Parameters
        ----------
        matrix : (4, 4) or (3, 4) array_like
            A column (x, y, z, 1) becomes ``matrix @ column``; the last row is 0, 0, 0, 1. It must not flatten the solid; one
            that mirrors keeps outside outside.
        """
        values = np.asarray(matrix, dtype=np.float64)
        if values.shape == (3, 4):
            values = np.vstack([values, [0, 0, 0, 1]])
        if values.shape != (4, 4):
            raise InputError(f"matrix must have the shape (4, 4) or (3, 4), got {values.shape}")
        if not np.isfinite(values).all():
            raise InputError("matrix must be finite")
        return Solid._of(_strata.moved(self._native, np.ascontiguousarray(values)))

    def colour(self, red: Any, green: Optional[float] = None, blue: Optional[float] = None, alpha: float = 1.0) -> "Solid":
        """Colours all of the solid.

        ``colour(red, green, blue, alpha)``, ``colour((red, green, blue))`` with numbers from 0 to 1, or ``colour("#f9d72c")``.
        """
        return Solid._of(_strata.coloured(self._native, colour_of(red, green, blue, alpha)))

    color = colour

    # --- what it is -------------------------------------------------------------------------------------------------

    @property
    def bounds(self) -> np.ndarray:
        """(2, 3) array: corners of a box that the result lies in; infinite where there is nothing. `measure` has the exact one."""
        return np.array(_strata.solid_bounds(self._native))

    @property
    def names(self) -> Tuple[str, ...]:
        """Names of the solids in the tree; the voxels of solid n have the label n + 1 with ``voxelize(ids=True)``."""
        return tuple(_strata.solid_names(self._native))

    def measure(self, *, resolution: Optional[int] = None, threads: int = 0, memory_limit: Optional[int] = None) -> Measures:
        """Volume, area, centre and bounds of the result.

        Parameters
        ----------
        resolution : int, optional
            Sum along rays on a grid of so many voxels a side, 1 to 32768. Default: exactly, if the solids allow it.
        threads : int
            0: one for each processor.
        memory_limit : int, optional
            Bytes. Default: half of the machine's memory.
        """
        rays = None if resolution is None else integer_of(resolution, "resolution")
        if rays is not None and not 1 <= rays <= 32768:
            raise UsageError(f"resolution must be 1 to 32768, got {rays}")
        found: Dict[str, Any] = _strata.measure(self._native, rays, limits_of(threads, memory_limit))
        return Measures(**found)

    # --- what is made of it -----------------------------------------------------------------------------------------

    def picture(
        self,
        size: Union[int, Sequence[int]] = (512, 512),
        *,
        camera: Optional[Camera] = None,
        samples: int = 8,
        edges: bool = False,
        ground_shadow: bool = False,
        scheme: str = "",
        background: Any = None,
        threads: int = 0,
        memory_limit: Optional[int] = None,
    ) -> np.ndarray:
        """A shaded picture of the result, as `strata csg` draws it.

        Parameters
        ----------
        size : int or (int, int)
            Width and height in pixels.
        camera : Camera, optional
            Default: that of the scene's file, else one that sees all.
        samples : {1, 2, 4, 8, 16, 32, 64}
            Samples a pixel.
        edges, ground_shadow : bool
            Dark lines where faces differ; a soft shadow on the plane that the result stands on.
        scheme : str
            A colour scheme of OpenSCAD, such as "Cornfield"; empty: Neutral.
        background : colour, optional
            As `colour` takes it, or "transparent". Default: the scheme's.
        threads : int
            0: one for each processor.
        memory_limit : int, optional
            Bytes. Default: half of the machine's memory.

        Returns
        -------
        (height, width, 4) uint8 array
            Red, green, blue, alpha, rows from the top.
        """
        behind = None
        if isinstance(background, str) and background == "transparent":
            behind = (0, 0, 0, 0)
        elif background is not None:
            behind = bytes_of_colour(background)
        look = _strata.Look(integer_of(samples, "samples"), bool(edges), bool(ground_shadow), str(scheme), behind)
        native = None if camera is None else camera._native()
        return _strata.solid_picture(self._native, native, size_of(size), look, limits_of(threads, memory_limit))

    def mesh(
        self,
        *,
        bits: int = 26,
        faces: str = "canonical",
        open: str = "cap",
        threads: int = 0,
        memory_limit: Optional[int] = None,
    ) -> Mesh:
        """The exact boundary of the result: closed, 2-manifold, without self-intersections, as `strata mesh` makes it.

        Parameters
        ----------
        bits : int
            Vertices lie on a lattice of 2^bits steps along the longest side; 10 to 28.
        faces : {"canonical", "input"}
            As large as they can be, or the pieces of the solids' own triangles.
        open : {"cap", "fail"}
            Solids with holes: the holes are closed, or GeometryError.
        threads : int
            0: one for each processor.
        memory_limit : int, optional
            Bytes. Default: half of the machine's memory.
        """
        limits = limits_of(threads, memory_limit)
        native, told = _strata.solid_mesh(self._native, integer_of(bits, "bits"), str(faces), str(open), limits)
        warn_of(told)
        return Mesh._of(native)

    def voxelize(self, **options: Any) -> Voxels:
        """The voxels of the result: ``strata.voxelize(self, ...)``; see there."""
        return voxelize(self, **options)

    def depth_lists(self, **options: Any) -> DepthLists:
        """The depth lists of the result: ``strata.depth_lists(self, ...)``; see there."""
        return depth_lists(self, **options)

    def save(
        self,
        path: PathLike,
        *,
        bits: int = 26,
        faces: str = "canonical",
        parts: str = "colours",
        open: str = "cap",
        threads: int = 0,
        memory_limit: Optional[int] = None,
    ) -> None:
        """Writes the exact boundary as .3mf, .stl, .obj, .ply or .off. The file appears when it is complete.

        Parameters
        ----------
        path : str or os.PathLike
            The file.
        bits, faces, open
            As for `mesh`.
        parts : {"one", "colours", "solids"}
            A part in the file for all, for each colour, or for each solid.
        threads : int
            0: one for each processor.
        memory_limit : int, optional
            Bytes. Default: half of the machine's memory.
        """
        limits = limits_of(threads, memory_limit)
        _strata.save_solid(self._native, text_of_path(path), integer_of(bits, "bits"), str(faces), str(parts), str(open), limits)

    def _repr_png_(self) -> bytes:
        return png_of(self.picture(400))

    def __repr__(self) -> str:
        count = len(self.names)
        return f"<strata.csg.Solid of {count} solid{'' if count == 1 else 's'}>"


# --- primitives, as OpenSCAD makes them, vertex for vertex ------------------------------------------------------------


def cube(size: Any = 1.0, *, center: bool = False) -> Solid:
    """A box from the origin to `size`, or centred there.

    Parameters
    ----------
    size : float or (float, float, float)
        World units, above 0.
    center : bool
        Its middle is the origin.
    """
    return Solid._of(_strata.cube(three_of(size, "size"), bool(center)))


def sphere(r: Optional[float] = None, *, d: Optional[float] = None, fn: float = 0, fa: float = 12, fs: float = 2) -> Solid:
    """A sphere about the origin.

    Parameters
    ----------
    r, d : float
        Radius or diameter, above 0. Default: radius 1.
    fn, fa, fs : float
        OpenSCAD's ``$fn`` (segments of a circle; 0: by the others), ``$fa`` (degrees) and ``$fs`` (world units).
    """
    return Solid._of(_strata.sphere(_radius(r, d, 1.0, "r", "d"), *_segments(fn, fa, fs)))


def cylinder(
    h: float = 1.0,
    r: Optional[float] = None,
    *,
    r1: Optional[float] = None,
    r2: Optional[float] = None,
    d: Optional[float] = None,
    d1: Optional[float] = None,
    d2: Optional[float] = None,
    center: bool = False,
    fn: float = 0,
    fa: float = 12,
    fs: float = 2,
) -> Solid:
    """A cylinder or cone along z that stands on z = 0, or is centred there.

    Parameters
    ----------
    h : float
        Height, above 0.
    r, d : float
        Radius or diameter of both ends. Default: radius 1.
    r1, d1, r2, d2 : float
        Of the lower and of the upper end; 0 makes a tip.
    center : bool
        Its middle is the origin.
    fn, fa, fs : float
        As for `sphere`.
    """
    both = _radius(r, d, 1.0, "r", "d")
    lower, upper = _radius(r1, d1, both, "r1", "d1"), _radius(r2, d2, both, "r2", "d2")
    return Solid._of(_strata.cylinder(number_of(h, "h"), lower, upper, bool(center), *_segments(fn, fa, fs)))


def solid(mesh: Any, *, threads: int = 0) -> Solid:
    """A mesh as a solid: ``Solid(mesh)``."""
    return Solid(mesh, threads=threads)


def union(solids: Iterable[Solid]) -> Solid:
    """The union of any number of solids; of none: the empty set. Faster than ``|`` one by one."""
    return _combined(_strata.unite, *solids)


def intersection(solids: Iterable[Solid]) -> Solid:
    """The intersection of any number of solids; of none: the empty set."""
    return _combined(_strata.intersect, *solids)


# --- scenes -----------------------------------------------------------------------------------------------------------


def load(
    path: PathLike,
    *,
    defines: Optional[Dict[str, Any]] = None,
    root: PathLike = ".",
    parts: bool = True,
    threads: int = 0,
) -> Solid:
    """Reads a scene: .csg, or .scad with the help of an installed `openscad`; or a mesh file as a solid.

    Parameters
    ----------
    path : str or os.PathLike
        The file.
    defines : dict, optional
        Variables of a .scad program: numbers, texts, truth values, lists.
    root : str or os.PathLike
        With the default any file may be imported; else the scene may read files below this folder only.
    parts : bool
        Each part of a mesh file becomes a solid of its own, with its name, for ``voxelize(ids=True)``.
    threads : int
        0: one for each processor.

    Returns
    -------
    Solid
        Pictures show the parts that ``%`` and ``#`` mark, and the scene's camera; operations forget both.

    Raises
    ------
    InputError
        With file, line and column.
    """
    words = [f"{name}={_scad(value)}" for name, value in (defines or {}).items()]
    folder = "" if root == "." else text_of_path(root)
    native, told, notes = _strata.load_scene(text_of_path(path), words, folder, bool(parts), limits_of(threads, None))
    warn_of([*told, *notes])
    return Solid._of(native)


def parse(text: str, *, folder: PathLike = ".", threads: int = 0) -> Solid:
    """Makes a solid of a scene's text in the language of .csg files, such as ``'text("A", size = 10);'``.

    Parameters
    ----------
    text : str
        The scene. It has no variables and loops: .scad programs do, see `load`.
    folder : str or os.PathLike
        Where imported files are looked for.
    threads : int
        0: one for each processor.

    Raises
    ------
    InputError
        With line and column.
    """
    if not isinstance(text, str):
        raise TypeError(f"text must be a str, got {type(text).__name__}")
    native, told, notes = _strata.parse_scene(text, text_of_path(folder), limits_of(threads, None))
    warn_of([*told, *notes])
    return Solid._of(native)


# --- details ----------------------------------------------------------------------------------------------------------


def _combined(operation: Any, *solids: Any) -> Any:
    for one in solids:
        if not isinstance(one, Solid):
            if len(solids) == 2 and one is solids[1]:
                return NotImplemented
            raise TypeError(f"operands must be solids, got {type(one).__name__}; strata.csg.solid(mesh) makes one")
    return Solid._of(operation([one._native for one in solids]))


def _vector(x: Any, y: Any, z: Any, name: str) -> Tuple[float, ...]:
    if np.ndim(x) > 0:
        if y is not None or z is not None:
            raise UsageError(f"{name} takes three numbers or one vector, not both")
        return numbers_of(x, 3, name)
    return numbers_of((x, y or 0.0, z or 0.0), 3, name)


def _rotation(axis: int, degrees: float) -> np.ndarray:
    turn = degrees % 360.0
    exact = {0.0: (1.0, 0.0), 90.0: (0.0, 1.0), 180.0: (-1.0, 0.0), 270.0: (0.0, -1.0)}
    c, s = exact.get(turn, (float(np.cos(np.radians(turn))), float(np.sin(np.radians(turn)))))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(4)
    matrix[i, i], matrix[i, j], matrix[j, i], matrix[j, j] = c, -s, s, c
    return matrix


def colour_of(red: Any, green: Any, blue: Any, alpha: float) -> Tuple[float, ...]:
    """Red, green, blue, alpha from 0 to 1, however they are given."""
    if isinstance(red, str):
        digits = red[1:]
        if not red.startswith("#") or len(digits) not in (6, 8) or any(c not in "0123456789abcdefABCDEF" for c in digits):
            raise UsageError(f"a colour must be '#rrggbb', '#rrggbbaa' or numbers from 0 to 1, got {red!r}")
        parts = [int(digits[i : i + 2], 16) / 255 for i in range(0, len(digits), 2)]
        return tuple(parts if len(parts) == 4 else [*parts, float(alpha)])
    if np.ndim(red) > 0:
        parts = [number_of(one, "colour") for one in red]
        parts = parts if len(parts) == 4 else [*parts, float(alpha)]
    else:
        parts = [number_of(one, "colour") for one in (red, green, blue, alpha)]
    if len(parts) != 4 or not all(0 <= one <= 1 for one in parts):
        raise UsageError(f"a colour must be three or four numbers from 0 to 1, got {parts}")
    return tuple(parts)


def bytes_of_colour(colour: Any) -> Tuple[int, int, int, int]:
    """Red, green, blue, alpha as bytes; without an alpha it is opaque."""
    red, green, blue, alpha = (int(round(255 * part)) for part in colour_of(colour, None, None, 1.0))
    return red, green, blue, alpha


def _radius(radius: Any, diameter: Any, default: float, name: str, twice: str) -> float:
    if radius is not None and diameter is not None:
        raise UsageError(f"{name} and {twice} must not both be given")
    if diameter is not None:
        return number_of(diameter, twice) / 2
    return default if radius is None else number_of(radius, name)


def _segments(fn: Any, fa: Any, fs: Any) -> Tuple[float, float, float]:
    return number_of(fn, "fn"), number_of(fa, "fa"), number_of(fs, "fs")


def _scad(value: Any) -> str:
    """A value in OpenSCAD's language."""
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'
    if np.ndim(value) > 0:
        return "[" + ", ".join(_scad(one) for one in value) + "]"
    return repr(number_of(value, "a define"))
