# SPDX-License-Identifier: Apache-2.0
"""The motion under a single load for a sum of few norms, in plain floats.

The twin of `gauge_inverse.ConvexInverse` with the same corners and the same starts. What does not
go smoothly is left to that class: the answer is then None.
"""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.surface.gauges.corners import FLAT, RIM
from limit_surface_ros.surface.gauges.one_power_sum import OnePowerSum
from limit_surface_ros.surface.gauges.one_twist import most_power_of_one

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.gauges.one_load import Vector
    from limit_surface_ros.surface.support.solvers import ConvexInverse

# Power below which a load is as good as across a corner's motion.
_ACROSS = 1e-9


class OneMotion:
    """The motion v of D(v) = 1 with the most power under a load, D(v) = sum_k |R_k v|."""

    def __init__(self, roots: Floats, inverse: ConvexInverse) -> None:
        """Keep R_k, shape (k, 3, 3), and the inverse for many loads of the same sum."""
        self._gauge = OnePowerSum(roots, np.full(len(roots), 0.5))
        self._inverse = inverse
        corners = inverse.corners
        self._corners = (
            []
            if corners is None
            else list(
                zip(
                    corners.points.tolist(),
                    corners.inverses.tolist(),
                    corners.centres.tolist(),
                    corners.bends.tolist(),
                    strict=True,
                )
            )
        )

    def of_load(self, load: Vector) -> Vector | None:
        """Return the motion under a load of size about one, both scaled."""
        x, y, z = self._inverse.start_of_one(np.array(load)).tolist()
        start = (x, y, z)
        if self._corners:
            found = self._at_corner(load)
            if found is None:
                return None
            motion, exact = found
            if exact:
                return motion
            dissipation = self._gauge.of_load(motion)
            if dissipation is None:
                return None
            if _product(motion, load) > _product(start, load) * dissipation:
                start = motion
        return most_power_of_one(self._gauge, load, [start])

    def _at_corner(self, load: Vector) -> tuple[Vector, bool] | None:
        """Return the motion to expect by the nearest corner, and whether the load is in its cone.

        As `Corners.nearest`, for one load.
        """
        least = float("inf")
        for corner in self._corners:
            point, (first, second), (c0, c1), _ = corner
            power = _product(point, load)
            if abs(power) > _ACROSS:
                q0 = _product(first, load) / power - c0
                q1 = _product(second, load) / power - c1
                square = q0 * q0 + q1 * q1
                if square < least:
                    least, nearest = square, (corner, power, q0, q1)
        if least == float("inf"):
            return None
        (point, (first, second), _, ((m00, m01), (m10, m11))), power, q0, q1 = nearest
        sign = 1.0 if power > 0.0 else -1.0
        distance = sqrt(least)
        if distance <= 1.0 + RIM:
            return (sign * point[0], sign * point[1], sign * point[2]), True
        bend = q0 * (m00 * q0 + m01 * q1) + q1 * (m10 * q0 + m11 * q1) + FLAT * least
        reach = (distance - 1.0) * distance / bend
        y0, y1 = reach * q0, reach * q1
        moves = [y0 * a + y1 * b for a, b in zip(first, second, strict=True)]
        back = 1.0 - _product(moves, load) / power
        x, y, z = (sign * (back * k + move) for k, move in zip(point, moves, strict=True))
        return (x, y, z), False


def _product(a: Sequence[float], b: Sequence[float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
