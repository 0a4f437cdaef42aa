"""Conversions to and from the attitudes of other packages: unit quaternions x, y, z, w, body to earth."""

from __future__ import annotations

from math import asin, atan2, cos, sin

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._afbc import AfbcError
from ._check import finite

#: Largest accepted deviation of a quaternion's length from 1. No integrator's steps cause so much.
OFF = 0.1


def euler(quaternion: ArrayLike) -> tuple[float, float, float]:
    """Returns roll, pitch, yaw [rad] of the z-y-x sequence. Refuses a quaternion whose length is not 1."""
    given = finite("quaternion", quaternion, (4,))
    length = float(np.linalg.norm(given))
    if abs(length - 1.0) > OFF:
        raise AfbcError(f"quaternion: length {length:g} given; a unit quaternion x, y, z, w is needed")
    x, y, z, w = map(float, given / length)
    return (
        atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
        asin(min(1.0, max(-1.0, 2 * (w * y - x * z)))),
        atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
    )


def quaternion(attitude_rad: ArrayLike) -> NDArray[np.float64]:
    """Returns the quaternion x, y, z, w for roll, pitch, yaw [rad]."""
    roll, pitch, yaw = finite("attitude_rad", attitude_rad, (3,)) / 2
    (cr, sr), (cp, sp), (cy, sy) = ((cos(half), sin(half)) for half in (roll, pitch, yaw))
    return np.array(
        [
            cy * cp * sr - sy * sp * cr,
            cy * sp * cr + sy * cp * sr,
            sy * cp * cr - cy * sp * sr,
            cy * cp * cr + sy * sp * sr,
        ]
    )
