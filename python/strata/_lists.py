"""Sorted depth lists: of meshes and solids, and of a user's own fragments."""

from __future__ import annotations

from typing import Any, List, Optional, Sequence, Tuple, Union

import numpy as np

from . import _strata
from ._arrays import axis_of, integer_of, limits_of, whole_of
from ._errors import InputError, UsageError
from ._mesh import mesh_of
from ._voxels import Grid, grid_of

_MOST_DEPTH = 2**24 - 1
_STEPS = 256  # of depth, a voxel


class DepthLists:
    """Where the rays through the voxel columns of a grid cross a surface: one sorted list a ray, in compressed sparse rows.

    The list of pixel ``(u, v)`` is rows ``offsets[v * width + u]`` to ``offsets[v * width + u + 1]`` of the other arrays. u
    and v are the axes of the grid that rays do not run along, in the order x, y, z. Made by `depth_lists`.
    """

    def __init__(self, offsets: np.ndarray, items: np.ndarray, grid: Grid, axis: int) -> None:
        self._offsets, self._items, self._grid, self._axis = offsets, items, grid, axis
        offsets.setflags(write=False)
        items.setflags(write=False)

    @property
    def grid(self) -> Grid:
        """The grid whose columns are the rays."""
        return self._grid

    @property
    def axis(self) -> str:
        """The axis that rays run along."""
        return "xyz"[self._axis]

    @property
    def shape(self) -> Tuple[int, int]:
        """Rows and columns of pixels: (height, width)."""
        u, v = (a for a in range(3) if a != self._axis)
        return self._grid.dims[v], self._grid.dims[u]

    @property
    def offsets(self) -> np.ndarray:
        """(pixels + 1,) uint64 array. It cannot be written to."""
        return self._offsets

    @property
    def items(self) -> np.ndarray:
        """(n,) uint64 array, increasing in each list: ``[steps:32 | exit:1 | triangle:31]``. It cannot be written to."""
        return self._items

    @property
    def steps(self) -> np.ndarray:
        """(n,) uint32 array: the exact floor of the depth, in steps of 1/256 voxel from the grid's lower side."""
        return (self._items >> np.uint64(32)).astype(np.uint32)

    @property
    def depth(self) -> np.ndarray:
        """(n,) float64 array: world coordinates along `axis`, the floor of a step."""
        return self._grid.origin[self._axis] + self.steps * (self._grid.spacing[self._axis] / _STEPS)

    @property
    def exit(self) -> np.ndarray:
        """(n,) bool array: the ray leaves the solid."""
        return (self._items >> np.uint64(31) & np.uint64(1)).astype(bool)

    @property
    def triangle(self) -> np.ndarray:
        """(n,) uint32 array: the triangle that is crossed, an index into the mesh's `faces`."""
        return (self._items & np.uint64(2**31 - 1)).astype(np.uint32)

    def counts(self) -> np.ndarray:
        """(height, width) int64 array: crossings of each pixel's ray, the depth complexity."""
        return np.diff(self._offsets.astype(np.int64)).reshape(self.shape)

    def thickness(self) -> np.ndarray:
        """(height, width) float64 array: world length of each ray inside of a closed surface."""
        signed = np.where(self.exit, 1.0, -1.0) * self.steps
        total = np.concatenate([[0.0], np.cumsum(signed)])
        inside = np.diff(total[self._offsets.astype(np.int64)])
        return inside.reshape(self.shape) * (self._grid.spacing[self._axis] / _STEPS)

    def __len__(self) -> int:
        return len(self._items)

    def __repr__(self) -> str:
        return f"<strata.DepthLists along {self.axis}: {self.shape[1]} x {self.shape[0]} pixels, {len(self)} crossings>"


def depth_lists(
    mesh: Any,
    *,
    axis: Union[str, int] = "z",
    resolution: Optional[int] = None,
    voxel_size: Any = None,
    dims: Optional[Sequence[int]] = None,
    like: Any = None,
    bounds: Optional[Sequence[Sequence[float]]] = None,
    origin: Optional[Sequence[float]] = None,
    padding: int = 0,
    align: bool = False,
    threads: int = 0,
    memory_limit: Optional[int] = None,
) -> DepthLists:
    """The sorted depth lists of a mesh or a solid: every crossing of every ray, exactly.

    Parameters
    ----------
    mesh : Mesh, csg.Solid, path, or what Mesh() takes
        Of a solid: the crossings of the result of its operations.
    axis : {"x", "y", "z"}
        That rays run along, through the centres of the voxels.
    resolution, voxel_size, dims, like, bounds, origin, padding, align
        The grid, as for `voxelize`.
    threads : int
        0: one for each processor.
    memory_limit : int, optional
        Bytes. Default: half of the machine's memory.

    Returns
    -------
    DepthLists
        Its arrays show the memory that was filled; nothing is copied.

    Notes
    -----
    S. Lefebvre, S. Hornus, A. Lasram: HA-Buffer: Coherent Hashing for single-pass A-buffer, 2013.
    """
    from .csg import Solid

    limits = limits_of(threads, memory_limit)
    along = axis_of(axis)
    if isinstance(mesh, Solid):
        shape, make = mesh, _strata.solid_lists
    else:
        shape, make = mesh_of(mesh, threads), _strata.mesh_lists
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
    offsets, items = make(shape._native, grid, along, limits)
    return DepthLists(offsets, items, Grid._of(grid), along)


class FragmentLists:
    """Sorted lists of a user's own fragments, in compressed sparse rows. Made by `HashBuffer.lists`.

    The list of pixel ``p = y * width + x`` is rows ``offsets[p]`` to ``offsets[p + 1]``, by depth, then payload.
    """

    def __init__(self, offsets: np.ndarray, depth: np.ndarray, payload: np.ndarray, shape: Tuple[int, int]) -> None:
        self._offsets, self._depth, self._payload, self._shape = offsets, depth, payload, shape

    @property
    def shape(self) -> Tuple[int, int]:
        """(height, width) in pixels."""
        return self._shape

    @property
    def offsets(self) -> np.ndarray:
        """(pixels + 1,) uint64 array."""
        return self._offsets

    @property
    def depth(self) -> np.ndarray:
        """(n,) uint32 array, below 2^24."""
        return self._depth

    @property
    def payload(self) -> np.ndarray:
        """(n,) uint32 array."""
        return self._payload

    def counts(self) -> np.ndarray:
        """(height, width) int64 array: fragments of each pixel."""
        return np.diff(self._offsets.astype(np.int64)).reshape(self._shape)

    def __len__(self) -> int:
        return len(self._depth)

    def __repr__(self) -> str:
        return f"<strata.FragmentLists: {self._shape[1]} x {self._shape[0]} pixels, {len(self)} fragments>"


class HashBuffer:
    """Sorts fragments of your own, pixel by pixel: insert them in any order, then take the lists. Nothing is dropped.

    Parameters
    ----------
    width, height : int
        Pixels, each 1 to 65536.
    store : {"hash", "count-scan"}
        "hash": the HA-buffer, at most 255 fragments a pixel. "count-scan": any number. The lists are the same.

    Notes
    -----
    S. Lefebvre, S. Hornus, A. Lasram: HA-Buffer: Coherent Hashing for single-pass A-buffer, 2013.
    """

    def __init__(self, width: int, height: int, *, store: str = "hash") -> None:
        self._width, self._height = integer_of(width, "width"), integer_of(height, "height")
        for name, side in (("width", self._width), ("height", self._height)):
            if not 1 <= side <= 65536:
                raise UsageError(f"{name} must be 1 to 65536, got {side}")
        if store not in ("hash", "count-scan"):
            raise UsageError(f"store must be 'hash' or 'count-scan', got {store!r}")
        self._hashed = store == "hash"
        self._parts: List[Tuple[np.ndarray, np.ndarray, np.ndarray]] = []

    def insert(self, pixel: Any, depth: Any, payload: Any = 0) -> None:
        """Adds fragments. May be called any number of times, from any thread.

        Parameters
        ----------
        pixel : (n,) or (n, 2) array_like of whole numbers
            ``y * width + x``, or rows ``(x, y)``; y counts from the top.
        depth : (n,) array_like
            Whole numbers from 0 to 2^24 - 1, or floats from 0 to 1, which are rounded down to those.
        payload : (n,) array_like of whole numbers, or one
            0 to 2^32 - 1.

        Raises
        ------
        InputError
            For arrays of different lengths, and for the first number that is out of range, which it names.
        """
        places = self._pixels(pixel)
        depths = self._depths(depth)
        loads = whole_of(payload, "payload")
        if np.ndim(payload) == 0:
            loads = np.full(places.shape, loads[0], dtype=np.int64)
        if depths.shape != places.shape or loads.shape != places.shape:
            raise InputError(
                f"pixel, depth and payload must have one length, got {len(places)}, {depths.shape} and {loads.shape}"
            )
        _check_range(loads, 2**32 - 1, "payload")
        self._parts.append((places, depths.astype(np.uint32), loads.astype(np.uint32)))

    def lists(self, *, threads: int = 0, memory_limit: Optional[int] = None) -> FragmentLists:
        """Sorts all that was inserted. May be called again after further fragments were inserted.

        Raises
        ------
        LimitError
            If a list is too long for the HA-buffer, or memory does not suffice; with the pixel or the number.
        """
        made = _strata.build_lists(
            self._width, self._height, self._hashed, list(self._parts), limits_of(threads, memory_limit)
        )
        return FragmentLists(*made, (self._height, self._width))

    def clear(self) -> None:
        """Forgets all fragments."""
        self._parts = []

    def __len__(self) -> int:
        return sum(len(part[0]) for part in self._parts)

    def __repr__(self) -> str:
        return f"<strata.HashBuffer: {self._width} x {self._height} pixels, {len(self)} fragments>"

    def _pixels(self, pixel: Any) -> np.ndarray:
        places = whole_of(pixel, "pixel")
        if places.ndim == 2 and places.shape[1] == 2:
            _check_range(np.ascontiguousarray(places[:, 0]), self._width - 1, "x of pixel")
            _check_range(np.ascontiguousarray(places[:, 1]), self._height - 1, "y of pixel")
            return np.ascontiguousarray(places[:, 1] * self._width + places[:, 0])
        if places.size == 0:
            places = places.reshape(-1)
        if places.ndim != 1:
            raise InputError(f"pixel must have the shape (n,) or (n, 2), got {places.shape}")
        _check_range(places, self._width * self._height - 1, "pixel")
        # Whole numbers of the caller's own array may change before lists() is called.
        return places.copy() if np.shares_memory(places, np.asarray(pixel)) else places

    def _depths(self, depth: Any) -> np.ndarray:
        array = np.asarray(depth)
        if array.dtype.kind == "f" and array.size:
            inside = (array >= 0) & (array <= 1)
            if not inside.all():
                row = int(np.argmin(inside))
                raise InputError(f"depth[{row}] is {array.reshape(-1)[row]:g}: floats must be 0 to 1")
            return np.floor(array.astype(np.float64) * _MOST_DEPTH).astype(np.int64)
        depths = whole_of(depth, "depth")
        _check_range(depths, _MOST_DEPTH, "depth")
        return depths.reshape(-1) if depths.size == 0 else depths


def _check_range(values: np.ndarray, most: int, name: str) -> None:
    bad = (values < 0) | (values > most)
    if bad.any():
        row = int(np.argmax(bad))
        raise InputError(f"{name}[{row}] must be 0 to {most}, got {int(values.reshape(-1)[row])}")
