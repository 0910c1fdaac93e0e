"""Cameras, and pictures as PNG."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Optional, Tuple

import numpy as np

from . import _strata
from ._arrays import number_of, numbers_of
from ._errors import InputError, UsageError


@dataclass(frozen=True)
class Camera:
    """Where a picture is taken from. What is not given is found so that all is seen.

    Parameters
    ----------
    eye : (float, float, float), optional
        World point of the eye; it looks at `target`, with z up. Not with `rotation` or `distance`.
    target : (float, float, float), optional
        World point in the middle of the picture. The origin if the place of the camera is given.
    rotation : (float, float, float), optional
        Degrees, as OpenSCAD's ``$vpr``: 0, 0, 0 looks down from +z with +y up. Default 55, 0, 25.
    distance : float, optional
        Of the eye from `target`, world units, above 0. Without `eye` and `distance` the camera moves to where all is
        seen.
    fov : float
        Degrees of the picture's height, between 0 and 180.
    projection : {"perspective", "orthographic"}
        How rays leave the eye.
    """

    eye: Optional[Tuple[float, float, float]] = None
    target: Optional[Tuple[float, float, float]] = None
    rotation: Optional[Tuple[float, float, float]] = None
    distance: Optional[float] = None
    fov: float = 22.5
    projection: str = "perspective"

    def __post_init__(self) -> None:
        if self.projection not in ("perspective", "orthographic"):
            raise UsageError(f"projection must be 'perspective' or 'orthographic', got {self.projection!r}")
        if self.eye is not None and (self.rotation is not None or self.distance is not None):
            raise UsageError("a camera has either an eye, or a rotation and a distance")
        if not 0 < number_of(self.fov, "fov") < 180:
            raise UsageError(f"fov must be between 0 and 180 degrees, got {self.fov}")
        if self.distance is not None and not number_of(self.distance, "distance") > 0:
            raise UsageError(f"distance must be above 0, got {self.distance}")

    def _native(self) -> Any:
        three = {}
        for name in ("eye", "target", "rotation"):
            given = getattr(self, name)
            three[name] = None if given is None else numbers_of(given, 3, name)
        return _strata.Camera(
            distance=self.distance, fov=float(self.fov), orthographic=self.projection == "orthographic", **three
        )


def png_of(picture: np.ndarray) -> bytes:
    """A picture as the bytes of a PNG file.

    Parameters
    ----------
    picture : (height, width, 4) uint8 array
        Red, green, blue, alpha, rows from the top.
    """
    pixels = np.asarray(picture)
    if pixels.dtype != np.uint8 or pixels.ndim != 3 or pixels.shape[2] != 4 or pixels.size == 0:
        raise InputError(f"a picture must be a uint8 array of the shape (height, width, 4), got {pixels.dtype} {pixels.shape}")
    return _strata.png(np.ascontiguousarray(pixels))
