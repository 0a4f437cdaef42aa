"""Attitudes as other people's packages write them: unit quaternions x, y, z, w, body to earth."""

from __future__ import annotations

from math import asin, atan2, cos, sin

import numpy as np
from numpy.typing import ArrayLike, NDArray


def euler(quaternion: ArrayLike) -> tuple[float, float, float]:
    """Returns roll, pitch, yaw [rad] of the z-y-x sequence."""
    x, y, z, w = map(float, np.asarray(quaternion))
    return (
        atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
        asin(min(1.0, max(-1.0, 2 * (w * y - x * z)))),
        atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
    )


def quaternion(attitude_rad: ArrayLike) -> NDArray[np.float64]:
    """Returns x, y, z, w of roll, pitch, yaw [rad]."""
    roll, pitch, yaw = (float(angle) / 2 for angle in np.asarray(attitude_rad))
    (cr, sr), (cp, sp), (cy, sy) = ((cos(half), sin(half)) for half in (roll, pitch, yaw))
    return np.array(
        [
            cy * cp * sr - sy * sp * cr,
            cy * sp * cr + sy * cp * sr,
            sy * cp * cr - cy * sp * sr,
            cy * cp * cr + sy * sp * sr,
        ]
    )
