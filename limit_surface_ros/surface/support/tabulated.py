# SPDX-License-Identifier: Apache-2.0
"""Many points of most power at once, from a table as soon as that pays.

What the table is not certain of, as across a kink, the inverse that made it solves.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.surface.support.table import SAMPLES, SupportTable

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.support.solvers import Inverse
    from limit_surface_ros.surface.support.table import FirstOrder


class TabulatedInverse:
    """The inverse of a gauge, with a table from the moment that it pays."""

    def __init__(self, gauge: FirstOrder, inverse: Inverse, *, convex: bool = True) -> None:
        """Keep the gauge and its inverse, which makes the table and solves what is hard.

        Args:
            gauge: The gauge.
            inverse: Its inverse.
            convex: Whether a point with the wanted normal is the answer for that alone.
        """
        self._gauge = gauge
        self._inverse = inverse
        self._convex = convex
        self._asked = 0
        self._table: SupportTable | None = None

    def solve(self, normals: Floats) -> tuple[Floats, Floats]:
        """Return the points (3, m) of most power for vectors (3, m), and that power (m,).

        Raises:
            SolverError: A point could not be certified.
        """
        if self._table is None:
            self._asked += normals.shape[1]
            if self._asked <= SAMPLES:
                return self._inverse.solve(normals)
            self._table = SupportTable(self._gauge, self._inverse, convex=self._convex)
        points, certain = self._table.points(normals)
        hard = np.flatnonzero(~certain)
        if len(hard):
            points[:, hard] = self._inverse.solve(normals[:, hard])[0]
        return points, np.einsum("im,im->m", normals, points)

    def starts_of_one(self, normal: Floats) -> Floats:
        """Return points (s, 3) that lead smoothly to the answer for one vector (3,), if any do."""
        return self._inverse.starts_of_one(normal)
