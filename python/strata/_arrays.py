"""Arrays that come from a user become what the native part takes, or a clear error."""

from __future__ import annotations

import operator
import os
import warnings
from typing import Any, Iterable, Optional, Sequence, Tuple, Union

import numpy as np

from . import _strata
from ._errors import InputError, LimitError, StrataWarning, UsageError

PathLike = Union[str, "os.PathLike[str]"]


def text_of_path(path: PathLike) -> str:
    """The text of a path; bytes that are no UTF-8 are kept."""
    text = os.fsdecode(os.fspath(path))
    if "\0" in text:
        raise InputError(f"a path must not hold a zero byte, got {text!r}")
    if not text:
        raise InputError("a path must not be empty")
    return text


def limits_of(threads: int, memory_limit: Optional[int]) -> Any:
    """Threads and memory of a call."""
    count = integer_of(threads, "threads")
    if not 0 <= count <= 4096:
        raise UsageError(f"threads must be 0 to 4096, got {count}")
    memory = 0 if memory_limit is None else integer_of(memory_limit, "memory_limit")
    if memory_limit is not None and not 1 <= memory < 2**63:
        raise UsageError(f"memory_limit must be at least 1 byte, got {memory}")
    return _strata.Limits(count, memory)


def integer_of(value: Any, name: str) -> int:
    """A whole number, of whichever type."""
    if isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{name} must be a whole number, got {value}")
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} must be a whole number, got {value!r}") from None
    if not -(2**62) < number < 2**62:
        raise UsageError(f"{name} is out of range, got {number}")
    return number


def number_of(value: Any, name: str) -> float:
    """A finite number."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{name} must be a number, got {value!r}") from None
    if not np.isfinite(number):
        raise UsageError(f"{name} must be finite, got {number}")
    return number


def numbers_of(value: Any, count: int, name: str) -> Tuple[float, ...]:
    """So many finite numbers."""
    try:
        values = tuple(value)
    except TypeError:
        raise TypeError(f"{name} must be {count} numbers, got {value!r}") from None
    if len(values) != count:
        raise UsageError(f"{name} must be {count} numbers, got {len(values)}")
    return tuple(number_of(one, name) for one in values)


def three_of(value: Any, name: str) -> Tuple[float, ...]:
    """Three finite numbers, or one for all three."""
    if np.ndim(value) == 0:
        return (number_of(value, name),) * 3
    return numbers_of(value, 3, name)


def points_of(points: Any, name: str) -> np.ndarray:
    """An (n, 3) array of finite doubles, contiguous and in the byte order of this machine.

    Raises
    ------
    InputError
        For another shape, for text and complex numbers, and for a row that is not finite, which it names.
    """
    values = _numeric(points, name)
    if values.size == 0 and values.ndim < 2:
        values = values.reshape(0, 3)
    if values.ndim != 2 or values.shape[1] != 3:
        raise InputError(f"{name} must have the shape (n, 3), got {values.shape}")
    values = np.ascontiguousarray(values, dtype=np.float64)
    finite = np.isfinite(values).all(axis=1)
    if not finite.all():
        row = int(np.argmin(finite))
        raise InputError(f"{name}[{row}] is ({', '.join(f'{x:g}' for x in values[row])}): coordinates must be finite")
    return values


def whole_of(values: Any, name: str) -> np.ndarray:
    """Whole numbers as int64, contiguous, of any shape. Floats that are whole numbers will do."""
    array = _numeric(values, name)
    if array.dtype.kind == "b":
        raise InputError(f"{name} must be whole numbers, got bool")
    if array.dtype.kind == "f":
        if not (np.isfinite(array).all() and (array == np.floor(array)).all() and (np.abs(array) < 2.0**62).all()):
            raise InputError(f"{name} must be whole numbers, got {array.dtype} with fractions, infinities or NaN")
    elif array.dtype.kind == "u" and array.size and int(array.max()) >= 2**63:
        raise InputError(f"{name} must be below 2^63, got {int(array.max())}")
    return np.ascontiguousarray(array, dtype=np.int64)


def triangles_of(faces: Any, vertices: int, name: str = "faces") -> Tuple[np.ndarray, Optional[np.ndarray]]:
    """Corners of faces, flat, and where each face begins; None where all are triangles.

    Raises
    ------
    InputError
        For another shape and for an index that is not that of a vertex.
    """
    offsets: Optional[np.ndarray] = None
    ragged = isinstance(faces, (list, tuple)) and len({len(f) if hasattr(f, "__len__") else -1 for f in faces}) > 1
    if ragged:
        lists = [whole_of(face, f"{name}[{row}]").reshape(-1) for row, face in enumerate(faces)]
        offsets = np.concatenate([[0], np.cumsum([len(one) for one in lists])]).astype(np.int64)
        corners = np.concatenate(lists)
    else:
        array = whole_of(faces, name)
        if array.size == 0:
            array = array.reshape(0, 3)
        if array.ndim != 2 or array.shape[1] < 3:
            raise InputError(f"{name} must have the shape (n, 3), or (n, k) for polygons of k corners, got {array.shape}")
        if array.shape[1] > 3:
            offsets = np.arange(array.shape[0] + 1, dtype=np.int64) * array.shape[1]
        corners = array.reshape(-1)
    return check_corners(corners, offsets, vertices, name), offsets


def check_corners(corners: np.ndarray, offsets: Optional[np.ndarray], vertices: int, name: str) -> np.ndarray:
    """Corners that all are indices of vertices."""
    if vertices > 2**32 - 2:
        raise LimitError(f"a mesh has at most 2^32 - 2 vertices, got {vertices}")
    bad = (corners < 0) | (corners >= vertices)
    if bad.any():
        at = int(np.argmax(bad))
        face = at // 3 if offsets is None else int(np.searchsorted(offsets, at, side="right")) - 1
        raise InputError(f"{name}[{face}] refers to vertex {int(corners[at])}, there are {vertices} vertices")
    return np.ascontiguousarray(corners, dtype=np.int64)


def colours_of(colours: Any, count: int, name: str) -> Optional[np.ndarray]:
    """(count, 4) bytes, contiguous; None where none are given."""
    if colours is None:
        return None
    array = _numeric(colours, name)
    if array.ndim != 2 or array.shape[0] != count or array.shape[1] not in (3, 4):
        raise InputError(f"{name} must have the shape ({count}, 3) or ({count}, 4), got {array.shape}")
    most = 1.0 if array.dtype.kind == "f" else 255
    bad = ~((array >= 0) & (array <= most)).all(axis=1)
    if bad.any():
        row = int(np.argmax(bad))
        raise InputError(f"{name}[{row}] must be 0 to {most:g}, got {', '.join(f'{x:g}' for x in array[row])}")
    if array.dtype.kind == "f":
        array = np.rint(array * 255)
    made = np.full((count, 4), 255, np.uint8)
    made[:, : array.shape[1]] = array
    return made


def warn_of(sentences: Iterable[str]) -> None:
    """Python's warnings; they name the line that called Strata."""
    for sentence in sentences:
        warnings.warn(sentence, StrataWarning, stacklevel=3)


def axis_of(axis: Union[int, str]) -> int:
    """0, 1 or 2."""
    names = {"x": 0, "y": 1, "z": 2}
    if isinstance(axis, str) and axis.lower() in names:
        return names[axis.lower()]
    if not isinstance(axis, str):
        number = integer_of(axis, "axis")
        if 0 <= number <= 2:
            return number
    raise UsageError(f"axis must be 'x', 'y', 'z', 0, 1 or 2, got {axis!r}")


def size_of(size: Union[int, Sequence[int]]) -> Tuple[int, int]:
    """Width and height of a picture."""
    if isinstance(size, (int, np.integer)):
        return (integer_of(size, "size"),) * 2
    try:
        sides = tuple(size)
    except TypeError:
        raise TypeError(f"size must be one or two whole numbers, got {size!r}") from None
    if len(sides) != 2:
        raise UsageError(f"size must be one or two whole numbers, got {len(sides)}")
    return integer_of(sides[0], "size"), integer_of(sides[1], "size")


def _numeric(values: Any, name: str) -> np.ndarray:
    try:
        array = np.asarray(values)
    except (ValueError, TypeError) as error:
        raise InputError(f"{name} is no array: {error}") from None
    if array.dtype.kind == "O":
        try:
            array = np.asarray(values, dtype=np.float64)
        except (ValueError, TypeError, OverflowError) as error:
            raise InputError(f"{name} must be numbers: {error}") from None
    if array.dtype.kind not in "biuf":
        raise InputError(f"{name} must be numbers, got {array.dtype}")
    return array
