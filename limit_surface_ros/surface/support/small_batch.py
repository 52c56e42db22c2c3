# SPDX-License-Identifier: Apache-2.0
"""Support points of few normals, one after another in plain floats: numpy is slow with few.

Newton's method as in `newton`. Whatever does not go smoothly is left to the solver of many.
"""

from __future__ import annotations

from math import hypot, inf, sqrt
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from limit_surface_ros.surface.gauges.corners import FLAT, RIM, reach
from limit_surface_ros.surface.support.solvers import SupportSolver

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.gauges.corners import Corners
    from limit_surface_ros.surface.gauges.gauge import ScalarGauge, Vector
    from limit_surface_ros.surface.support.solvers import StartedSolver

# Normals up to which one after another is the quicker way.
FEW = 24
_STEPS = 30
_LAST_STEP = 1e-8
# Power below which a unit normal is as good as across a corner's point.
_ACROSS = 1e-9


class _Corner(NamedTuple):
    """A corner; see `Corners`."""

    point: list[float]
    inverse: list[list[float]]
    centre: list[float]
    curvature: list[list[float]]
    width: float


class SmallBatch(SupportSolver):
    """Solves few normals in plain floats, many by another solver."""

    def __init__(
        self,
        solver: StartedSolver,
        gauge: ScalarGauge,
        corners: Corners | None = None,
        few: int = FEW,
    ) -> None:
        """Keep the two.

        Args:
            solver: For many normals, and for one that does not go smoothly alone.
            gauge: Of the surface g = 1.
            corners: The solver's corners, if it has any.
            few: Normals up to which one after another is the quicker way.
        """
        self._solver = solver
        self._gauge = gauge
        self._few = few
        self._corners = (
            []
            if corners is None
            else [
                _Corner(*each)
                for each in zip(
                    corners.points.tolist(),
                    corners.inverses.tolist(),
                    corners.centres.tolist(),
                    corners.curvatures.tolist(),
                    corners.widths.tolist(),
                    strict=True,
                )
            ]
        )

    def solve(self, normals: Floats) -> tuple[Floats, Floats]:
        """Return support points and powers; see `SupportSolver`."""
        if normals.shape[1] > self._few:
            return self._solver.solve(normals)
        return one_by_one(self, self._solver, normals)

    def solve_scalar(self, normal: Vector) -> Vector | None:
        """Return one support point; see `SupportSolver`."""
        x, y, z = normal
        length = sqrt(x * x + y * y + z * z)
        unit = (x / length, y / length, z / length)
        beside = None
        if self._corners:
            found = self._by_corner(unit)
            if found is None:
                return None
            point, exact = found
            size = self._gauge.value(point)
            if size is None:
                return None
            if exact:
                x, y, z = point
                return x / size, y / size, z / size
            beside = point, size
        starts: list[Sequence[float]] = self._solver.starts_of(np.array(unit)).tolist()
        # A surface with corners is convex, and has one other start.
        if (
            beside is not None
            and _product(beside[0], unit) > _product(starts[0], unit) * beside[1]
        ):
            starts = [beside[0]]
        return self._highest(unit, starts)

    def _highest(self, unit: Vector, starts: list[Sequence[float]]) -> Vector | None:
        """Return the highest of the points to which starts lead, None if one leads nowhere."""
        best = None
        most = 0.0
        for start in starts:
            point = self._climb(unit, start)
            if point is None:
                return None
            power = _product(point, unit)
            if power > most:
                best, most = point, power
        return best

    def _climb(self, unit: Vector, start: Sequence[float]) -> Vector | None:
        """Minimise log g over the plane n.x = 1 through the unit vector n."""
        nx, ny, nz = unit
        sign = 1.0 if nz >= 0.0 else -1.0
        a = -1.0 / (sign + nz)
        b = nx * ny * a
        first = (1.0 + sign * nx * nx * a, sign * b, -sign * nx)
        second = (b, sign + ny * ny * a, -ny)
        along = _product(start, unit)
        p, q = _product(start, first) / along, _product(start, second) / along
        newton = self._gauge.in_plane(unit, first, second)
        previous = inf
        step_p = step_q = 0.0
        for _ in range(_STEPS):
            found = newton(p, q)
            if found is None:
                return None
            height, move = found
            if height > previous + 1e-15:
                step_p, step_q = 0.5 * step_p, 0.5 * step_q
                p -= step_p
                q -= step_q
                continue
            previous = height
            step_p, step_q = move
            step = hypot(*move) / sqrt(1.0 + p * p + q * q)
            p += step_p
            q += step_q
            if step <= _LAST_STEP:
                x = nx + p * first[0] + q * second[0]
                y = ny + p * first[1] + q * second[1]
                z = nz + p * first[2] + q * second[2]
                size = self._gauge.value((x, y, z))
                return None if size is None else (x / size, y / size, z / size)
        return None

    def _by_corner(self, unit: Vector) -> tuple[Vector, bool] | None:
        """Return the point to expect by the nearest corner, and whether it is the corner itself.

        As `Corners.nearest`, for one normal.
        """
        least = inf
        for corner in self._corners:
            power = _product(corner.point, unit)
            if abs(power) > _ACROSS:
                q0 = _product(corner.inverse[0], unit) / power - corner.centre[0]
                q1 = _product(corner.inverse[1], unit) / power - corner.centre[1]
                square = q0 * q0 + q1 * q1
                if square < least:
                    least, nearest = square, (corner, power, q0, q1)
        if least == inf:
            return None
        corner, power, q0, q1 = nearest
        sign = 1.0 if power > 0.0 else -1.0
        distance = sqrt(least)
        x, y, z = corner.point
        if distance <= 1.0 + RIM and corner.width == 0.0:
            return (sign * x, sign * y, sign * z), True
        (m00, m01), (m10, m11) = corner.curvature
        if least == 0.0:
            return (sign * x, sign * y, sign * z), False
        curvature = (q0 * (m00 * q0 + m01 * q1) + q1 * (m10 * q0 + m11 * q1)) / least + FLAT
        if corner.width > 0.0:
            part = reach(distance, curvature, corner.width) / distance
        else:
            part = (distance - 1.0) / (curvature * distance)
        y0, y1 = part * q0, part * q1
        first, second = corner.inverse
        steps = [y0 * a + y1 * b for a, b in zip(first, second, strict=True)]
        back = 1.0 - _product(steps, unit) / power
        x, y, z = (sign * (back * k + step) for k, step in zip(corner.point, steps, strict=True))
        return (x, y, z), False

    def expect(self, count: float) -> None:
        """Make what pays if so many normals come; see `SupportSolver`."""
        self._solver.expect(count)


def one_by_one(few: SupportSolver, many: SupportSolver, normals: Floats) -> tuple[Floats, Floats]:
    """Return support points and powers for few normals; see `SupportSolver.solve`.

    Args:
        few: Solves one normal after another.
        many: Solves what that leaves.
        normals: Shape (3, m).
    """
    points: Floats = np.empty_like(normals)
    for column, (x, y, z) in enumerate(normals.T.tolist()):
        found = few.solve_scalar((x, y, z))
        if found is None:
            points[:, [column]] = many.solve(normals[:, [column]])[0]
        else:
            points[:, column] = found
    return points, (normals * points).sum(axis=0)


def _product(a: Sequence[float], b: Sequence[float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
