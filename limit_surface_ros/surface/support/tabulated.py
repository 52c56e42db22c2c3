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

from limit_surface_ros.surface.support.small_batch import FEW, one_by_one
from limit_surface_ros.surface.support.solvers import SupportSolver
from limit_surface_ros.surface.support.table import SAMPLES, SupportTable
from limit_surface_ros.surface.support.table_scalar import TableScalar

if TYPE_CHECKING:
    from limit_surface_ros.checks import Bools, Floats, Places
    from limit_surface_ros.surface.gauges.corners import Corners
    from limit_surface_ros.surface.gauges.gauge import FirstOrder, ScalarGauge, Vector

# Corners up to which a look at all cones comes before the table.
_FEW_CORNERS = 6
# A table pays for a batch of so many times the vectors that are solved to make it.
_PAYS = 1.3


class Tabulated(SupportSolver):
    """A solver with a table of its answers."""

    def __init__(
        self,
        gauge: FirstOrder,
        solver: SupportSolver,
        *,
        scalar: ScalarGauge | None = None,
        corners: Corners | None = None,
        convex: bool = True,
        ahead: bool = True,
    ) -> None:
        """Keep the gauge and its solver, which makes the table and solves what is hard.

        Args:
            gauge: Of the surface g = 1.
            solver: For its support points.
            scalar: The gauge for one point, if plain floats are quicker.
            corners: Of the surface, if it has any.
            convex: Whether a point with the wanted normal is the answer for that alone.
            ahead: Whether a table is worth its time before any large batch is there.
        """
        self._ahead = ahead
        self._gauge = gauge
        self._solver = solver
        self._convex = convex
        self._scalar = scalar
        self._table: SupportTable | None = None
        self._one: TableScalar | None = None
        self._corners = None
        if corners is not None and len(corners.points) <= _FEW_CORNERS:
            self._corners = corners
            self._at_corners = corners.points.T / gauge.values_and_normals(corners.points.T)[0]

    def solve(self, normals: Floats) -> tuple[Floats, Floats]:
        """Return support points and powers; see `SupportSolver`."""
        # One look: another thread may put the table there between two.
        table = self._table
        if table is None:
            return self._solver.solve(normals)
        if self._one is not None and normals.shape[1] <= FEW:
            return one_by_one(self, self._solver, normals)
        if self._corners is not None:
            inside, which = self._corners.within(normals)
            if inside.any():
                return self._beside_corners(table, normals, inside, which)
        return self._from_table(table, normals)

    def _beside_corners(
        self, table: SupportTable, normals: Floats, inside: Bools, which: Places
    ) -> tuple[Floats, Floats]:
        """Return what `solve` does where some normals are in the cones of corners."""
        points = self._at_corners.take(which, axis=1)
        power = np.einsum("im,im->m", normals, points)
        points *= np.copysign(1.0, power)
        np.abs(power, out=power)
        rest = np.flatnonzero(~inside)
        if len(rest):
            found = self._from_table(table, normals.take(rest, axis=1))
            points[:, rest], power[rest] = found
        return points, power

    def _from_table(self, table: SupportTable, normals: Floats) -> tuple[Floats, Floats]:
        """Return support points and powers, from the table where that is certain."""
        points, certain = table.points(normals)
        hard = np.flatnonzero(~certain)
        if len(hard):
            points[:, hard] = self._solver.solve(normals.take(hard, axis=1))[0]
        return points, np.einsum("im,im->m", normals, points)

    def solve_scalar(self, normal: Vector) -> Vector | None:
        """Return one support point in plain floats; see `SupportSolver`."""
        one = self._one
        point = None if one is None else one.point(normal)
        return self._solver.solve_scalar(normal) if point is None else point

    def expect(self, count: float) -> None:
        """Make the table if it pays for so many normals at once."""
        if count == inf and not self._ahead:
            return
        if self._table is None and count >= _PAYS * SAMPLES:
            table = SupportTable(self._gauge, self._solver, convex=self._convex)
            self._one = None if self._scalar is None else TableScalar(table, self._scalar)
            self._table = table
