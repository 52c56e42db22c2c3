# SPDX-License-Identifier: Apache-2.0
"""Many support points at once, read from a table if there is one.

What the table is not certain of, as across a kink, the solver that made it solves. A table is
made when a surface is prepared or at the start of one batch that it pays for, never because of
what was asked before: a call takes the same time whatever came before it.
"""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.surface.support.solvers import SupportSolver
from limit_surface_ros.surface.support.table import SAMPLES, SupportTable

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.gauges.gauge import FirstOrder, Vector

# A table pays for a batch of so many times the vectors that are solved to make it.
_PAYS = 1.3


class Tabulated(SupportSolver):
    """A solver with a table of its answers."""

    def __init__(
        self,
        gauge: FirstOrder,
        solver: SupportSolver,
        *,
        convex: bool = True,
        ahead: bool = True,
    ) -> None:
        """Keep the gauge and its solver, which makes the table and solves what is hard.

        Args:
            gauge: Of the surface g = 1.
            solver: For its support points.
            convex: Whether a point with the wanted normal is the answer for that alone.
            ahead: Whether a table is worth its time before any large batch is there.
        """
        self._ahead = ahead
        self._gauge = gauge
        self._solver = solver
        self._convex = convex
        self._table: SupportTable | None = None

    def solve(self, normals: Floats) -> tuple[Floats, Floats]:
        """Return support points and powers; see `SupportSolver`."""
        # One look: another thread may put the table there between two.
        table = self._table
        if table is None:
            return self._solver.solve(normals)
        points, certain = table.points(normals)
        hard = np.flatnonzero(~certain)
        if len(hard):
            points[:, hard] = self._solver.solve(normals[:, hard])[0]
        return points, np.einsum("im,im->m", normals, points)

    def solve_scalar(self, normal: Vector) -> Vector | None:
        """Return one support point in plain floats; see `SupportSolver`."""
        return self._solver.solve_scalar(normal)

    def expect(self, count: float) -> None:
        """Make the table if it pays for so many normals at once."""
        if count == inf and not self._ahead:
            return
        if self._table is None and count >= _PAYS * SAMPLES:
            self._table = SupportTable(self._gauge, self._solver, convex=self._convex)
