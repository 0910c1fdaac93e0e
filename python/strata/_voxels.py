"""Voxels: made of meshes and solids, read from files, shown as arrays."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, Optional, Sequence, Tuple, Union

import numpy as np

from . import _strata
from ._arrays import PathLike, axis_of, integer_of, limits_of, number_of, numbers_of, points_of, size_of, text_of_path, three_of, warn_of
from ._errors import InputError, UsageError
from ._mesh import mesh_of
from ._pictures import Camera, png_of


@dataclass(frozen=True)
class Grid:
    """A box of voxels. Voxel (i, j, k) covers ``origin + (i..i+1, j..j+1, k..k+1) * spacing``.

    Parameters
    ----------
    dims : (int, int, int)
        Voxels along x, y, z, each 1 to 65536.
    origin : (float, float, float)
        World position of the lower corner of voxel (0, 0, 0).
    spacing : float or (float, float, float)
        World length of a voxel along x, y, z.
    direction : 3 x 3 array_like
        Its columns are the directions of the axes in the world, of length 1 and at right angles; `origin` is then a point of
        the grid's own axes: the world's is ``direction @ origin``.
    """

    dims: Tuple[int, int, int]
    origin: Tuple[float, float, float] = (0.0, 0.0, 0.0)
    spacing: Union[float, Tuple[float, float, float]] = (1.0, 1.0, 1.0)
    direction: Tuple[Tuple[float, float, float], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

    def __post_init__(self) -> None:
        native = self._native()
        for name in ("dims", "origin", "spacing", "direction"):
            object.__setattr__(self, name, getattr(native, name))

    @classmethod
    def of_affine(cls, shape: Sequence[int], affine: Any) -> "Grid":
        """The grid whose voxel (i, j, k) has its centre at ``affine @ (i, j, k, 1)``, as NIfTI's.

        Parameters
        ----------
        shape : (int, int, int)
            Voxels along the axes.
        affine : (4, 4) array_like
            Without shear: its first three columns are at right angles.
        """
        matrix = np.asarray(affine, dtype=np.float64)
        if matrix.shape != (4, 4) or not np.isfinite(matrix).all() or not np.array_equal(matrix[3], [0, 0, 0, 1]):
            raise UsageError("affine must be a finite 4 x 4 matrix with the last row 0, 0, 0, 1")
        spacing = np.linalg.norm(matrix[:3, :3], axis=0)
        if not (spacing > 0).all():
            raise UsageError("affine must not flatten voxels: a column is 0")
        direction = matrix[:3, :3] / spacing
        direction[np.abs(direction) < 1e-12] = 0  # of axes that are the world's
        corner = direction.T @ matrix[:3, 3] - 0.5 * spacing
        return cls(tuple(shape)[:3], tuple(corner), tuple(spacing), tuple(map(tuple, direction)))

    def _native(self) -> Any:
        direction = np.asarray(self.direction, dtype=np.float64)
        if direction.shape != (3, 3) or not np.allclose(direction.T @ direction, np.eye(3), atol=1e-6):
            raise UsageError("direction must be 3 x 3 numbers with columns of length 1 and at right angles")
        rows = tuple(tuple(float(x) for x in row) for row in direction)
        return _strata.Grid(_whole_three(self.dims, "dims"), numbers_of(self.origin, 3, "origin"), three_of(self.spacing, "spacing"), rows)

    @classmethod
    def _of(cls, native: Any) -> "Grid":
        return cls(native.dims, native.origin, native.spacing, native.direction)


class Voxels:
    """A set of solid voxels on a grid, kept as runs: memory grows with the surface, not with the volume.

    A voxel is solid when its centre is inside. Voxels may have labels (ids of solids or parts, colours of a palette) or
    values (densities, distances). Objects of this class do not change once they are made.

    Parameters
    ----------
    array : (nx, ny, nz) array_like
        bool: solid or not. Whole numbers from 0 to 2^32 - 1: labels; 0 is empty.
    origin : (float, float, float)
        World position of the lower corner of voxel (0, 0, 0).
    spacing : float or (float, float, float)
        World length of a voxel along x, y, z.
    threads : int
        0: one for each processor.

    Raises
    ------
    InputError
        For arrays of another shape or type.
    """

    _native: Any

    def __init__(self, array: Any, *, origin: Sequence[float] = (0, 0, 0), spacing: Any = 1.0, threads: int = 0) -> None:
        values = np.asarray(array)
        if values.ndim != 3 or 0 in values.shape:
            raise InputError(f"voxels must have the shape (nx, ny, nz), each at least 1, got {values.shape}")
        grid = Grid(values.shape, origin, spacing)._native()
        limits = limits_of(threads, None)
        if values.dtype.kind == "b":
            self._native = _strata.voxels_of_mask(np.ascontiguousarray(values), grid, limits)
            return
        if values.dtype.kind not in "iu":
            raise InputError(f"voxels must be bool or whole numbers, got {values.dtype}; compare with a threshold: array > 0.5")
        if int(values.min()) < 0 or int(values.max()) >= 2**32:
            raise InputError(f"labels must be 0 to 2^32 - 1, got {int(values.min())} to {int(values.max())}")
        self._native = _strata.voxels_of_labels(np.ascontiguousarray(values, dtype=np.uint32), grid, limits)

    @classmethod
    def _of(cls, native: Any) -> "Voxels":
        made = cls.__new__(cls)
        made._native = native
        return made

    # --- where they lie ---------------------------------------------------------------------------------------------

    @property
    def dims(self) -> Tuple[int, int, int]:
        """Voxels along x, y, z: the shape of `numpy`."""
        return self._native.grid.dims

    @property
    def origin(self) -> np.ndarray:
        """World position of the lower corner of voxel (0, 0, 0)."""
        return self._native.direction @ np.array(self._native.grid.origin)

    @property
    def spacing(self) -> np.ndarray:
        """World length of a voxel along its axes x, y, z."""
        return np.array(self._native.grid.spacing)

    @property
    def direction(self) -> np.ndarray:
        """(3, 3) array, orthonormal: its columns are the directions of the voxels' axes in the world."""
        return self._native.direction

    @property
    def affine(self) -> np.ndarray:
        """(4, 4) array: the world position of the centre of voxel (i, j, k) is ``affine @ (i, j, k, 1)``, as in NIfTI."""
        made = np.eye(4)
        made[:3, :3] = self.direction * self.spacing
        made[:3, 3] = self.origin + made[:3, :3] @ (0.5, 0.5, 0.5)
        return made

    @property
    def bounds(self) -> np.ndarray:
        """(2, 3) array: the box of the grid in its own axes, ``origin`` and ``origin + dims * spacing``."""
        low = np.array(self._native.grid.origin)
        return np.array([low, low + np.array(self.dims) * self.spacing])

    @property
    def grid(self) -> Grid:
        """The grid, for `voxelize`'s `like`."""
        return Grid._of(self._native.grid)

    # --- what they are ----------------------------------------------------------------------------------------------

    @property
    def kind(self) -> str:
        """"mask", "ids", "colours", "fog" (densities), "distances", "values" or "lists"."""
        return self._native.kind

    @property
    def axis(self) -> str:
        """The axis of the runs: "x", "y" or "z"."""
        return "xyz"[self._native.axis]

    @property
    def count(self) -> int:
        """Number of solid voxels."""
        return self._native.count

    @property
    def volume(self) -> float:
        """Of the solid voxels, in cubic world units."""
        return self.count * float(np.prod(self.spacing))

    @property
    def notes(self) -> Tuple[str, ...]:
        """Facts about the file that the voxels were read from, a sentence each."""
        return tuple(self._native.notes)

    def checksum(self, *, threads: int = 0) -> int:
        """A 64-bit hash of the solid voxels and the grid; ``f"{checksum:016x}"`` is what `strata voxelize --checksum` prints.

        Equal for equal sets, whatever made them; labels and values do not count.
        """
        return self._native.checksum(limits_of(threads, None))

    def numpy(self, *, mask: bool = False, threads: int = 0, memory_limit: Optional[int] = None) -> np.ndarray:
        """All voxels as an array ``[x, y, z]``, made anew by each call.

        Parameters
        ----------
        mask : bool
            Whether voxels are solid, also where they have labels or values.
        threads : int
            0: one for each processor.
        memory_limit : int, optional
            Bytes that the array may have. Default: half of the machine's memory.

        Returns
        -------
        (nx, ny, nz) array
            bool; uint32 for labels (0 is empty); float32 for values, which are 0 to 1 for fractions; for colours uint8, with a
            fourth axis of red, green, blue, alpha. x is next to x in memory (Fortran's order), as VTK
            and NRRD have it.

        Raises
        ------
        LimitError
            If the array would be larger than the limit; `runs` and `slice` need less.
        """
        limits = limits_of(threads, memory_limit)
        if not mask and self._native.has_values:
            return self._native.values(limits)
        if not mask and self._native.has_labels:
            return self._native.labels(limits)
        return self._native.mask(limits)

    def runs(self) -> np.ndarray:
        """The runs of solid voxels along `axis`, in the order of the columns.

        Returns
        -------
        (n,) structured array
            Fields ``x``, ``y``, ``z`` (int32; the first voxel), ``length`` (int32; voxels), ``label`` (uint32; 1 where
            voxels have none).
        """
        return self._native.runs()

    def contains(self, points: Any, *, threads: int = 0) -> np.ndarray:
        """Whether points lie in solid voxels.

        Parameters
        ----------
        points : (n, 3) array_like
            World positions, finite. A point outside of the grid is in no voxel.
        threads : int
            0: one for each processor.

        Returns
        -------
        (n,) bool array
        """
        return self._native.contains(points_of(points, "points"), limits_of(threads, None))

    def slice(self, axis: Union[str, int], index: int) -> "Slice":
        """The plane of voxels across an axis.

        Parameters
        ----------
        axis : {"x", "y", "z", 0, 1, 2}
            Across the plane.
        index : int
            Of the plane along `axis`; negative ones count from the end.

        Raises
        ------
        UsageError
            If the plane is outside of the grid.
        """
        across = axis_of(axis)
        at = integer_of(index, "index")
        if -self.dims[across] <= at < 0:
            at += self.dims[across]
        return Slice(self, across, at)

    def picture(
        self,
        size: Union[int, Sequence[int]] = (512, 512),
        *,
        camera: Optional[Camera] = None,
        samples: int = 8,
        threads: int = 0,
    ) -> np.ndarray:
        """A picture of the voxels, as `strata picture` draws it.

        Parameters
        ----------
        size : int or (int, int)
            Width and height in pixels.
        camera : Camera, optional
            Default: all voxels are seen.
        samples : {1, 2, 4, 8, 16, 32, 64}
            Rays a pixel where colours change.
        threads : int
            0: one for each processor.

        Returns
        -------
        (height, width, 4) uint8 array
            Red, green, blue, alpha, rows from the top.
        """
        native = (camera or Camera())._native()
        return self._native.picture(None, native, size_of(size), integer_of(samples, "samples"), limits_of(threads, None))

    # --- where they go ----------------------------------------------------------------------------------------------

    def save(self, path: PathLike, *, threads: int = 0, memory_limit: Optional[int] = None) -> None:
        """Writes a file of voxels in the format of its extension, as `strata voxelize -o` does. It appears when complete.

        Raises
        ------
        UsageError
            For an unknown extension, and for labels that the format cannot hold; with the formats that can.
        OutputError
            If the file cannot be written.
        """
        self._native.save(text_of_path(path), limits_of(threads, memory_limit))

    def to_vtk(self, *, name: str = "voxels") -> Any:
        """A ``vtkImageData`` with a number for each cell; ``pyvista.wrap()`` takes it. Needs the package vtk.

        bool becomes unsigned char. The numbers are not copied once more.
        """
        from vtkmodules.util.numpy_support import numpy_to_vtk
        from vtkmodules.vtkCommonDataModel import vtkImageData

        values = self.numpy()
        if values.dtype == np.bool_:
            values = values.view(np.uint8)
        colours = values.ndim == 4
        image = vtkImageData()
        image.SetDimensions(*(side + 1 for side in self.dims))
        image.SetOrigin(*self.origin)
        image.SetSpacing(*self.spacing)
        image.SetDirectionMatrix(*self.direction.reshape(-1))
        data = numpy_to_vtk(np.ascontiguousarray(values.transpose(2, 1, 0, 3).reshape(-1, 4)) if colours else values.reshape(-1, order="F"))
        data.SetName(name)
        image.GetCellData().SetScalars(data)
        return image

    def to_openvdb(self, *, name: str = "solid") -> Any:
        """An OpenVDB grid of the package pyopenvdb (or openvdb): bool for a mask, else float. Index points are centres."""
        try:
            import openvdb as vdb
        except ImportError:
            import pyopenvdb as vdb

        values = self.numpy()
        if values.ndim == 4:
            grid, values = vdb.Vec3SGrid(), values[..., :3].astype(np.float32) / 255
        elif values.dtype == np.bool_:
            grid = vdb.BoolGrid()
        else:
            grid, values = vdb.FloatGrid(), values.astype(np.float32)
        grid.copyFromArray(np.ascontiguousarray(values))
        grid.transform = vdb.createLinearTransform(self.affine.T.tolist())
        grid.name = name
        return grid

    def _repr_png_(self) -> bytes:
        return png_of(self.picture(400))

    def __repr__(self) -> str:
        return f"<strata.Voxels: {' x '.join(map(str, self.dims))}, {self.count} solid, {self.kind}>"


class Slice:
    """A plane of voxels, made by `Voxels.slice`. A notebook shows it as a picture."""

    def __init__(self, voxels: Voxels, axis: int, index: int) -> None:
        self._voxels, self._axis, self._index = voxels, axis, index
        self._values = voxels._native.slice(axis, index)

    @property
    def axis(self) -> str:
        """The axis across the plane."""
        return "xyz"[self._axis]

    @property
    def index(self) -> int:
        """Of the plane along `axis`."""
        return self._index

    @property
    def position(self) -> float:
        """Of the centres of the voxels along `axis`, in the axes of the grid."""
        native = self._voxels._native.grid
        return native.origin[self._axis] + (self._index + 0.5) * native.spacing[self._axis]

    def numpy(self) -> np.ndarray:
        """The voxels as an array: [y, z] for x, [x, z] for y, [x, y] for z; of the types of `Voxels.numpy`."""
        return self._values

    def picture(self, size: Union[int, Sequence[int]] = (512, 512), *, threads: int = 0) -> np.ndarray:
        """The plane, flat and as large as fits; the first axis to the right, the second one up.

        Returns
        -------
        (height, width, 4) uint8 array
            Red, green, blue, alpha, rows from the top.
        """
        plane = (self._axis, self._index)
        return self._voxels._native.picture(plane, Camera()._native(), size_of(size), 8, limits_of(threads, None))

    def _repr_png_(self) -> bytes:
        return png_of(self.picture(400))

    def __repr__(self) -> str:
        return f"<strata.Slice {self.axis} = {self.index} of {self._voxels!r}>"


def voxelize(
    mesh: Any,
    *,
    resolution: Optional[int] = None,
    voxel_size: Optional[Union[float, Sequence[float]]] = None,
    dims: Optional[Sequence[int]] = None,
    like: Any = None,
    bounds: Optional[Sequence[Sequence[float]]] = None,
    origin: Optional[Sequence[float]] = None,
    padding: int = 0,
    align: bool = False,
    solid: bool = True,
    surface: bool = False,
    surface_kind: Union[str, int] = "conservative",
    ids: bool = False,
    coverage: Union[bool, int] = False,
    colours: bool = False,
    fill_colour: Any = None,
    sdf: bool = False,
    band: Optional[float] = 3.0,
    open: str = "vote",
    threads: int = 0,
    memory_limit: Optional[int] = None,
) -> Voxels:
    """Voxelizes a mesh or a solid, as `strata voxelize` does: a voxel is solid when its centre is inside.

    Vertices are rounded to 1/256 voxel; all else is exact. The voxels are the same for any number of threads. Exactly one
    of `resolution`, `voxel_size`, `dims` and `like` is given.

    Parameters
    ----------
    mesh : Mesh, csg.Solid, path, or what Mesh() takes
        It need not be closed, see `open`.
    resolution : int
        Voxels along the longest side of the box; cubic voxels. Padding is added to it.
    voxel_size : float or (float, float, float)
        World length of a voxel along x, y, z.
    dims : (int, int, int)
        Voxels along x, y, z, padding included; voxels are stretched to fit the box.
    like : Voxels, Grid, path, or an image with ``affine`` and ``shape``
        The same grid: of other voxels, of a file of voxels, of an image of nibabel. Its axes may be turned.
    bounds : ((float, float, float), (float, float, float))
        The box to cover, instead of the mesh's.
    origin : (float, float, float)
        Lower corner of the grid without padding. Parts of the mesh below it are cut off.
    padding : int
        Empty voxels on each of the six sides.
    align : bool
        The origin becomes a multiple of the voxel size.
    solid, surface : bool
        Voxels whose centre is inside; voxels that the surface touches; or both.
    surface_kind : {"conservative", 26, 6}
        Every voxel that the surface touches; 26-separating; 6-separating, the thinnest.
    ids : bool
        Solids and files: the label of a voxel is the number of the solid, or of the part of the file, that it belongs to,
        from 1.
    coverage : bool or {1, 2, 4, 8, 16}
        Each voxel has the fraction of it that is filled, above 0: the mean over so many times so many rays along z, each of which
        counts the length inside exactly. True: 8. `numpy` gives float32.
    colours : bool
        Each voxel has the colour of the nearest point of the surface, textures filtered, or of the solid that it belongs
        to. `numpy` gives uint8 ``[x, y, z, rgba]``; alpha is 0 where nothing is solid.
    fill_colour : colour, optional
        With `colours`, of meshes: of the voxels deep inside, as `csg.Solid.colour` takes it. Default: grey.
    sdf : bool
        Each voxel has its signed distance to the surface in world units, negative inside. `numpy` gives float32. Faces that
        lie inside do not count, also where parts of a mesh overlap; those of a mesh that is not closed do.
    band : float or None
        With `sdf`: half the width of the band around the surface, in voxels; beyond it distances are plus or minus the
        band. None: all voxels have their distance.
    open : {"vote", "surface", "fail"}
        What to do with a mesh that is not closed: caps and winding numbers decide; surface only; GeometryError.
    threads : int
        0: one for each processor.
    memory_limit : int, optional
        Bytes that the work may take beyond the mesh. Default: half of the machine's memory.

    Returns
    -------
    Voxels

    Raises
    ------
    UsageError
        For a grid that is not given exactly, and for numbers out of range.
    GeometryError
        For a mesh without extent, coordinates that are too large, and an open mesh with ``open="fail"``.
    LimitError
        For more than 65536 voxels along a side, or too much memory.

    Notes
    -----
    The lists of crossings are sorted by an HA-buffer (S. Lefebvre, S. Hornus, A. Lasram: HA-Buffer: Coherent Hashing for
    single-pass A-buffer, 2013) or by a count/scan store, whichever is faster.
    """
    from .csg import Solid

    limits = limits_of(threads, memory_limit)
    rays = 8 * coverage if isinstance(coverage, (bool, np.bool_)) else integer_of(coverage, "coverage")
    if ids and isinstance(mesh, (str, os.PathLike)):
        from .csg import load

        mesh = load(mesh, threads=threads)
    if isinstance(mesh, Solid):
        shape, make = mesh, _strata.voxelize_solid
    else:
        shape, make = mesh_of(mesh, threads), _strata.voxelize_mesh
        if ids:
            raise UsageError("ids are of solids: give strata.csg.load(path), which has the parts of a file, or another csg.Solid")
    grid = grid_of(
        shape.bounds,
        resolution=resolution,
        voxel_size=voxel_size,
        dims=dims,
        like=like,
        bounds=bounds,
        origin=origin,
        padding=padding,
        align=align,
    )
    choice = _strata.VoxelChoice(
        bool(solid), bool(surface), bool(ids), rays, bool(colours), _fill(fill_colour), bool(sdf), _band(sdf, band), str(open), str(surface_kind)
    )
    native, told = make(shape._native, grid, choice, limits)
    warn_of(told)
    return Voxels._of(native)


def read_voxels(
    path: PathLike,
    *,
    grid: str = "",
    threshold: Optional[float] = None,
    integers: str = "auto",
    threads: int = 0,
    memory_limit: Optional[int] = None,
) -> Voxels:
    """Reads a file or folder of voxels: what `strata voxelize` and `strata ldi` write, and what others write in these formats.

    Parameters
    ----------
    path : str or os.PathLike
        .vdb, .npy, .npz, .nrrd, .vti, .binvox, .vox, .zarr, ...: docs/formats.md.
    grid : str
        .vdb, .vti: name of the grid or array; empty: the first that can be read.
    threshold : float, optional
        Voxels above it are solid, of distances those below. Default: 0 for distances, else half of the greatest value.
    integers : {"auto", "ids", "values"}
        How whole numbers are read.
    threads : int
        0: one for each processor.
    memory_limit : int, optional
        Bytes. Default: half of the machine's memory.

    Raises
    ------
    InputError
        With the place in the file.
    LimitError
        If the voxels take more memory than the limit.
    """
    level = None if threshold is None else number_of(threshold, "threshold")
    return Voxels._of(
        _strata.read_voxels(text_of_path(path), str(grid), level, str(integers), limits_of(threads, memory_limit))
    )


def grid_of(
    box: np.ndarray,
    *,
    resolution: Optional[int] = None,
    voxel_size: Any = None,
    dims: Any = None,
    like: Any = None,
    bounds: Any = None,
    origin: Any = None,
    padding: int = 0,
    align: bool = False,
) -> Any:
    """The grid that voxelize() was asked for. See there."""
    sizes = [name for name, one in (("resolution", resolution), ("voxel_size", voxel_size), ("dims", dims), ("like", like)) if one is not None]
    if len(sizes) != 1:
        got = " and ".join(sizes) if sizes else "none"
        raise UsageError(f"exactly one of resolution, voxel_size, dims and like must be given, got {got}")
    if like is not None:
        if bounds is not None or origin is not None or padding or align:
            raise UsageError("like gives the whole grid; bounds, origin, padding and align must not be given")
        return _grid_like(like)
    return _strata.fit_grid(
        low=tuple(box[0]),
        high=tuple(box[1]),
        resolution=None if resolution is None else integer_of(resolution, "resolution"),
        voxel_size=None if voxel_size is None else three_of(voxel_size, "voxel_size"),
        dims=None if dims is None else _whole_three(dims, "dims"),
        bounds=None if bounds is None else tuple(numbers_of(corner, 3, "bounds") for corner in _two(bounds)),
        origin=None if origin is None else numbers_of(origin, 3, "origin"),
        padding=integer_of(padding, "padding"),
        align=bool(align),
    )


def _grid_like(like: Any) -> Any:
    if isinstance(like, Voxels):
        return like._native.grid
    if isinstance(like, Grid):
        return like._native()
    if isinstance(like, (str, os.PathLike)):
        return _strata.grid_of_file(text_of_path(like), limits_of(0, None))
    if hasattr(like, "affine") and hasattr(like, "shape"):
        return Grid.of_affine(like.shape, like.affine)._native()
    raise TypeError(f"like must be Voxels, a Grid, a path, or an image with affine and shape, got {type(like).__name__}")


def _fill(colour: Any) -> Optional[Tuple[int, int, int]]:
    if colour is None:
        return None
    from .csg import bytes_of_colour

    return bytes_of_colour(colour)[:3]


def _band(sdf: bool, band: Optional[float]) -> float:
    if not sdf or band is None:
        return 0.0
    width = number_of(band, "band")
    if not 0.5 <= width <= 1024:
        raise UsageError(f"band must be 0.5 to 1024 voxels, or None, got {width:g}")
    return width


def _two(bounds: Any) -> Tuple[Any, Any]:
    corners = tuple(bounds)
    if len(corners) != 2:
        raise UsageError(f"bounds must be the lower and the upper corner, got {len(corners)} rows")
    return corners  # type: ignore[return-value]


def _whole_three(value: Any, name: str) -> Tuple[int, ...]:
    sides = tuple(value)
    if len(sides) != 3:
        raise UsageError(f"{name} must be 3 whole numbers, got {len(sides)}")
    return tuple(integer_of(side, name) for side in sides)
