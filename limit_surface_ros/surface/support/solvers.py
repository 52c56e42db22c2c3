# SPDX-License-Identifier: Apache-2.0
"""Support points: where on a surface n.x is largest, for any normal n.

With loads as points and motions as normals these are the loads of maximum dissipation, and the
other way round the motions that loads cause. Where the surface is convex, one descent from a good
start is enough, and a normal in the cone of a corner is met exactly. Elsewhere all peaks among a
table of starts are climbed.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from limit_surface_ros.surface.gauges.gauge import BoundedGauge
from limit_surface_ros.surface.linalg import even_directions, of_unit_length
from limit_surface_ros.surface.support.newton import certain_minimum, plane_minimum

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats, Places
    from limit_surface_ros.surface.gauges.corners import Corners
    from limit_surface_ros.surface.gauges.gauge import Gauge, Vector

# Neighbours of a start among which it must be best to be a peak.
_NEIGHBOURS = 8
# Distance from a corner's cone, in its radii, up to which the start beside it is the best one, and
# up to which it may be.
_CLOSE = 1.2
_BESIDE = 4.0
# Vectors whose table stays in the processor's cache.
_TABLE_COLUMNS = 200
# A lower peak is climbed if the table shows at least this part of the best one's power.
_WORTH = 0.7
# Effort for the axes in which a surface is about round.
_FRAME_POINTS = 300
_FRAME_STEPS = 6


class SupportSolver(ABC):
    """Finds, for normals n, the points of a surface with the largest n.x."""

    @abstractmethod
    def solve(self, normals: Floats) -> tuple[Floats, Floats]:
        """Return the points (3, m) for normals (3, m), none zero, and the largest n.x (m,).

        Raises:
            SolverError: A point could not be certified.
        """

    def solve_scalar(self, _normal: Vector) -> Vector | None:
        """Return the point for one normal in plain floats; None leaves it to `solve`."""
        return None

    def expect(self, _count: float) -> None:  # noqa: B027, most solvers have nothing to make
        """Make now what pays if so many normals come; see `tabulated`."""


class StartedSolver(SupportSolver):
    """A solver that can tell where it would start from."""

    @abstractmethod
    def starts_of(self, normal: Floats) -> Floats:
        """Return points (s, 3) of which the best leads to the answer for one normal (3,)."""


class _Starts(NamedTuple):
    """Points (3, m) to start from, with the gauge's values (m,) and derivatives there."""

    values: Floats
    points: Floats
    gradients: Floats
    hessians: Floats


class ConvexNewton(StartedSolver):
    """Support points of g(x) = 1 for a convex gauge g, by Newton's method."""

    def __init__(self, gauge: Gauge, directions: Floats, corners: Corners | None = None) -> None:
        """Prepare the table of starts.

        Args:
            gauge: The gauge g, above 0 but at 0.
            directions: Where to start from, spread over the sphere, shape (3, d).
            corners: Corners of the surface, if it has any.
        """
        self._gauge = gauge
        self._corners = corners
        values, gradients, hessians = gauge.derivatives(directions, np.zeros(directions.shape[1]))
        self._starts = directions / values
        self._gradients = gradients
        self._hessians = hessians * values

    def solve(self, normals: Floats) -> tuple[Floats, Floats]:
        """Return support points and powers; see `SupportSolver`."""
        return self.solve_beside(normals, self._corners)

    def solve_beside(self, normals: Floats, corners: Corners | None) -> tuple[Floats, Floats]:
        """Return what `solve` does, with other corners: those that may be near to the answers."""
        units = of_unit_length(normals)
        if corners is None:
            starts = _Starts(np.ones(units.shape[1]), *self.starts(units))
            points = self._descended(units, starts)
        else:
            distance, points = corners.nearest(units)
            smooth = np.flatnonzero(distance > 1.0)
            if len(smooth):
                some, near = units.take(smooth, axis=1), points.take(smooth, axis=1)
                starts = self._starts_beside(some, near, distance[smooth])
                points[:, smooth] = self._descended(some, starts)
        points /= self._gauge.values(points)
        return points, (normals * points).sum(axis=0)

    def _descended(self, units: Floats, starts: _Starts) -> Floats:
        """Return the support points (3, m) for unit vectors (3, m)."""
        values, points, gradients, hessians = starts
        return certain_minimum(self._gauge, units, points, (values, gradients, hessians))

    def _starts_beside(self, units: Floats, near: Floats, distance: Floats) -> _Starts:
        """Return the better starts, the points by the corners or those of the table.

        Args:
            units: Unit vectors (3, m).
            near: Points (3, m) by the corners nearest to them.
            distance: From the cones of these, in their radii, (m,).
        """
        count = len(distance)
        points = near / self._gauge.values(near)
        found = _Starts(np.ones(count), points, np.empty((3, count)), np.empty((3, 3, count)))
        beside = np.ones(count, dtype=bool)
        far = np.flatnonzero(distance > _CLOSE)
        if len(far):
            wanted = units.take(far, axis=1)
            table = self.starts(wanted)
            by_corner, by_table = (
                np.einsum("im,im->m", wanted, each)
                for each in (points.take(far, axis=1), table[0])
            )
            beside[far] = (by_corner > by_table) & (distance[far] < _BESIDE)
            others = np.flatnonzero(~beside[far])
            for array, rows in zip(found[1:], table, strict=True):
                array[..., far[others]] = rows.take(others, axis=-1)
        at = np.flatnonzero(beside)
        if len(at):
            found.values[at], found.gradients[:, at], found.hessians[:, :, at] = (
                self._gauge.derivatives(points.take(at, axis=1), np.zeros(len(at)))
            )
        return found

    def starts(self, normals: Floats) -> tuple[Floats, Floats, Floats]:
        """Return starts (3, m) for vectors (3, m), with their gradients and Hessians (3, 3, m)."""
        which = np.argmax(normals.T @ self._starts, axis=1)
        return (
            self._starts.take(which, axis=1),
            self._gradients.take(which, axis=1),
            self._hessians.take(which, axis=2),
        )

    def starts_of(self, normal: Floats) -> Floats:
        """Return the start with the most power; see `StartedSolver`."""
        return np.asarray(self._starts[:, np.argmax(normal @ self._starts)])[np.newaxis]


class PeakSearch(StartedSolver):
    """Support points of g(x) = 1 for a gauge g that need not be convex.

    The surface holds an ellipsoid through each point of a table. How far these reach along n is
    known at once, and the peaks among them are climbed.
    """

    def __init__(self, gauge: Gauge, directions: Floats) -> None:
        """Prepare the table and who is whose neighbour in it.

        Args:
            gauge: The gauge g, above 0 but at 0.
            directions: Where to start from, spread over half the sphere and along any ridges of
                the surface, shape (3, d).
        """
        self._gauge = gauge
        self._ellipsoids = self._inside(directions / gauge.values(directions))
        likeness = np.abs(directions.T @ directions)
        nearest = np.argsort(-likeness, axis=1)[:, 1 : _NEIGHBOURS + 1]
        self._neighbours = np.ascontiguousarray(nearest.T)

    def solve(self, normals: Floats) -> tuple[Floats, Floats]:
        """Return support points and powers; see `SupportSolver`."""
        units = of_unit_length(normals)
        found = [
            self._peaks(units[:, start : start + _TABLE_COLUMNS])
            for start in range(0, units.shape[1], _TABLE_COLUMNS)
        ]
        rows = np.concatenate([row for row, _ in found])
        columns = np.concatenate(
            [column + _TABLE_COLUMNS * block for block, (_, column) in enumerate(found)]
        )
        climbed = units.take(columns, axis=1)
        points = self._climb(climbed, self._ellipsoids[rows])
        power = (points * climbed).sum(axis=0)
        # The highest comes last, and stays.
        rising = np.argsort(power)
        best = np.zeros(units.shape[1], dtype=np.intp)
        best[columns[rising]] = rising
        summits = points.take(best, axis=1)
        return summits, (normals * summits).sum(axis=0)

    def starts_of(self, normal: Floats) -> Floats:
        """Return the starts that are worth climbing; see `StartedSolver`."""
        unit = normal / np.sqrt(normal @ normal)
        reach = self._ellipsoids.reshape(-1, 9) @ np.multiply.outer(unit, unit).ravel()
        high = reach >= _WORTH**2 * reach.max()
        high &= reach >= np.maximum.reduce(reach.take(self._neighbours))
        return np.asarray(self._ellipsoids[np.flatnonzero(high)] @ unit)

    def _peaks(self, units: Floats) -> tuple[Places, Places]:
        """Return the rows of the table that are worth climbing, and for which vectors (3, m)."""
        squares = (units[:, np.newaxis] * units).reshape(9, -1)
        reach = self._ellipsoids.reshape(-1, 9) @ squares
        high = reach >= _WORTH**2 * reach.max(axis=0)
        for neighbour in self._neighbours:
            high &= reach >= reach[neighbour]
        rows, columns = np.nonzero(high)
        return rows, columns

    def _inside(self, points: Floats) -> Floats:
        """Return ellipsoids (m, 3, 3) within the surface through its points (3, m).

        Where the gauge offers none they are no more than the lines to the points.
        """
        if isinstance(self._gauge, BoundedGauge):
            return self._gauge.ellipsoids(points)
        lines: Floats = np.einsum("im,jm->mij", points, points)
        return lines

    def _climb(self, units: Floats, ellipsoids: Floats) -> Floats:
        points = np.einsum("mij,jm->im", ellipsoids, units)
        points, _, _ = plane_minimum(self._gauge, units, points, np.zeros(units.shape[1]))
        return points / self._gauge.values(points)


class InFrame(SupportSolver):
    """A solver in other axes, in which the surface is about as wide in all directions."""

    def __init__(self, frame: Floats, solver: SupportSolver) -> None:
        """Keep the frame F, points x = F y, and the solver in y."""
        self._frame = frame
        self._rows: list[list[float]] = frame.tolist()
        self._solver = solver

    def solve(self, normals: Floats) -> tuple[Floats, Floats]:
        """Return support points and powers; see `SupportSolver`."""
        points, power = self._solver.solve(self._frame.T @ normals)
        return self._frame @ points, power

    def solve_scalar(self, normal: Vector) -> Vector | None:
        """Return one support point in plain floats; see `SupportSolver`."""
        (a, b, c), (d, e, f), (g, h, i) = self._rows
        x, y, z = normal
        found = self._solver.solve_scalar(
            (a * x + d * y + g * z, b * x + e * y + h * z, c * x + f * y + i * z)
        )
        if found is None:
            return None
        x, y, z = found
        return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z

    def expect(self, count: float) -> None:
        """Make what pays if so many normals come; see `SupportSolver`."""
        self._solver.expect(count)


def round_frame(gauge: Gauge) -> Floats:
    """Return a matrix F (3, 3) so that the points y with g(F y) = 1 spread evenly about zero."""
    directions = even_directions(_FRAME_POINTS).T
    frame = np.eye(3)
    for _ in range(_FRAME_STEPS):
        points = frame @ directions
        points /= gauge.values(points)
        frame = np.linalg.cholesky(3.0 * points @ points.T / _FRAME_POINTS)
    return frame
