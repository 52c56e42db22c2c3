# SPDX-License-Identifier: Apache-2.0
"""Motions under loads for hundreds of support points: Newton's method in two precisions.

Sums over the points are the cost. With the squares of velocities and all moments as products of
small matrices, a step in single precision costs a seventh of one with `PointNormSum`; steps in
double need no more than a gradient, and take the curvature from the last single one. What does not
settle, as beside a support point, is left to `ConvexNewton` with the corner of that point alone:
all corners of n points would cost n^2.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.surface.linalg import of_unit_length
from limit_surface_ros.surface.support.newton import newton_moves, plane_basis
from limit_surface_ros.surface.support.solvers import SupportSolver

if TYPE_CHECKING:
    from collections.abc import Iterator

    from limit_surface_ros.checks import Bools, Floats, Places
    from limit_surface_ros.surface.gauges.norm_sum import PointNormSum
    from limit_surface_ros.surface.support.solvers import ConvexNewton

# Points and motions in one block, of which two arrays stay in the processor's cache.
_POINTS = 1024
_MOTIONS = 64
# Coarse steps end with one of this length, near enough for their curvature to serve to the end.
_COARSE_STEP = 1e-4
_COARSE_STEPS = 6
# The answer is certain after a step of this length from where gradient and load are parallel.
_LAST_STEP = 1e-8
_SINE = 1e-9
_STEPS = 4
# Loads whose hard ones are solved together, with the corners of the points beside their motions.
_HARD_AT_ONCE = 1024
# Squares of velocities, relative to the largest ones, below which rounding would tell.
_CLEAR = 1e-6
_CLEAR_SINGLE = 2e-7


class ManyPoints(SupportSolver):
    """Motions under loads, and the loads' factors, for D(v) = sum_k m_k |w_k| over many points."""

    def __init__(self, gauge: PointNormSum, general: ConvexNewton) -> None:
        """Keep the moments of the points.

        Args:
            gauge: D, of points about the origin that are about one apart.
            general: The solver for the same points, for starts and for hard loads.
        """
        self._gauge = gauge
        self._general = general
        limits = gauge.limits
        x, y = gauge.points.T
        squares = np.array([np.ones_like(x), x, y, x * x + y * y])
        products = np.array([np.ones_like(x), x, y, x * x, x * y, y * y])
        self._reach = max(1.0, float(squares[3].max()))
        self._squares = np.ascontiguousarray(squares.T)
        self._weights = limits * squares
        self._single_squares = self._squares.astype(np.float32)
        self._single_weights = self._weights.astype(np.float32)
        self._single_curvatures = (limits * products).astype(np.float32)

    def solve(self, normals: Floats) -> tuple[Floats, Floats]:
        """Return the motions of loads on D = 1, and their factors; see `SupportSolver`."""
        units = of_unit_length(normals)
        basis = plane_basis(units)
        points, hessians = self._approach(units, basis)
        points, values, settled = self._settle(units, basis, points, hessians)
        points /= values
        for start in range(0, units.shape[1], _HARD_AT_ONCE):
            hard = start + np.flatnonzero(~settled[start : start + _HARD_AT_ONCE])
            if len(hard):
                corners = self._gauge.corners_of(self._nearest_points(points[:, hard]))
                points[:, hard] = self._general.solve_beside(units[:, hard], corners)[0]
        return points, (normals * points).sum(axis=0)

    def _nearest_points(self, twists: Floats) -> Places:
        """Return which support points are the slowest in some of the motions (3, m)."""
        speeds = self._squares @ _square_weights(twists)
        return np.asarray(np.unique(speeds.argmin(axis=0)))

    def values_and_normals(self, twists: Floats) -> tuple[Floats, Floats]:
        """Return D (m,) and its gradients (3, m), NaN where a point is near to rest."""
        gradients, clear = self._gradients(of_unit_length(twists))
        gradients[:, ~clear] = np.nan
        return np.einsum("im,im->m", gradients, twists), gradients

    def _approach(self, units: Floats, basis: Floats) -> tuple[Floats, Floats]:
        """Return twists (3, m) right to single precision, and Hessians (3, 3, m) close by."""
        points, gradients, hessians = self._general.starts(units)
        size = np.sqrt((points * points).sum(axis=0))
        points /= size
        hessians *= size
        todo = np.arange(units.shape[1])
        for _ in range(_COARSE_STEPS):
            moves, _, _ = newton_moves(
                units[:, todo], basis[:, :, todo], points[:, todo], gradients, hessians[:, :, todo]
            )
            points[:, todo] = of_unit_length(points[:, todo] + moves)
            todo = todo[(moves * moves).sum(axis=0) > _COARSE_STEP**2]
            if len(todo) == 0:
                break
            gradients, hessians[:, :, todo] = self._single_derivatives(points[:, todo])
        return points, hessians

    def _settle(
        self, units: Floats, basis: Floats, points: Floats, hessians: Floats
    ) -> tuple[Floats, Floats, Bools]:
        """Return exact twists (3, m), their D (m,), and which of them are certain (m,)."""
        values = np.ones(units.shape[1])
        settled = np.zeros(units.shape[1], dtype=bool)
        todo = np.arange(units.shape[1])
        for _ in range(_STEPS):
            gradients, clear = self._gradients(points[:, todo])
            moves, _, sines = newton_moves(
                units[:, todo], basis[:, :, todo], points[:, todo], gradients, hessians[:, :, todo]
            )
            moved = points[:, todo] + moves
            # The move across the load changes D by no more than its square.
            values[todo] = (gradients * moved).sum(axis=0)
            points[:, todo] = moved
            lengths = np.sqrt((moves * moves).sum(axis=0))
            certain = (lengths <= _LAST_STEP) & (sines <= _SINE)
            settled[todo] = clear & certain
            todo = todo[clear & ~certain]
            if len(todo) == 0:
                break
        return points, values, settled

    def _gradients(self, twists: Floats) -> tuple[Floats, Bools]:
        """Return the gradients (3, m) of D, and whether no point is near to rest (m,)."""
        weights = _square_weights(twists)
        sums = np.zeros_like(weights)
        clear = np.ones(twists.shape[1], dtype=bool)
        least = _CLEAR * self._reach
        for motions, part, speed in self._blocks(twists.shape[1], np.float64):
            np.matmul(self._squares[part], weights[:, motions], out=speed)
            # The least of all is cheaper than the least of each motion.
            if speed.min() <= least:
                clear[motions] &= speed.min(axis=0) > least
                np.maximum(speed, least, out=speed)
            np.sqrt(speed, out=speed)
            sums[:, motions] += self._weights[:, part] @ np.divide(1.0, speed, out=speed)
        return _gradient(twists, sums), clear

    def _single_derivatives(self, twists: Floats) -> tuple[Floats, Floats]:
        """Return gradients (3, m) and Hessians (3, 3, m) of D, computed in single precision."""
        weights = _square_weights(twists).astype(np.float32)
        sums = np.zeros_like(weights)
        curvatures = np.zeros((6, twists.shape[1]), dtype=np.float32)
        least = np.float32(_CLEAR_SINGLE * self._reach)
        cubes = np.empty(_POINTS * _MOTIONS, dtype=np.float32)
        for motions, part, slowness in self._blocks(twists.shape[1], np.float32):
            np.matmul(self._single_squares[part], weights[:, motions], out=slowness)
            np.abs(slowness, out=slowness)
            slowness += least
            np.sqrt(slowness, out=slowness)
            np.divide(np.float32(1.0), slowness, out=slowness)
            sums[:, motions] += self._single_weights[:, part] @ slowness
            cube = cubes[: slowness.size].reshape(slowness.shape)
            np.multiply(slowness, slowness, out=cube)
            cube *= slowness
            curvatures[:, motions] += self._single_curvatures[:, part] @ cube
        return _gradient(twists, sums.astype(np.float64)), _hessian(
            twists, curvatures.astype(np.float64)
        )

    def _blocks(
        self, columns: int, dtype: type[np.floating[Any]]
    ) -> Iterator[tuple[slice, slice, Floats]]:
        """Yield slices of motions and of points, and one array of points by motions for them all.

        It stays in the cache; fresh memory for each would cost as much as the sums.
        """
        count = len(self._squares)
        array = np.empty(_POINTS * _MOTIONS, dtype=dtype)
        for start in range(0, columns, _MOTIONS):
            width = min(_MOTIONS, columns - start)
            for first in range(0, count, _POINTS):
                height = min(_POINTS, count - first)
                yield (
                    slice(start, start + width),
                    slice(first, first + height),
                    array[: height * width].reshape(height, width),
                )


def _square_weights(twists: Floats) -> Floats:
    """Return weights (4, m) of 1, x, y and x^2 + y^2 in the squares |w|^2 of velocities."""
    vx, vy, omega = twists
    return np.array([vx * vx + vy * vy, 2.0 * omega * vy, -2.0 * omega * vx, omega * omega])


def _gradient(twists: Floats, sums: Floats) -> Floats:
    """Return the gradient (3, m) of D from the sums (4, m) of m / |w| times 1, x, y, x^2 + y^2."""
    vx, vy, omega = twists
    mass, in_x, in_y, inertia = sums
    return np.array(
        [
            vx * mass - omega * in_y,
            vy * mass + omega * in_x,
            vy * in_x - vx * in_y + omega * inertia,
        ]
    )


def _hessian(twists: Floats, sums: Floats) -> Floats:
    """Return the Hessian (3, 3, m) of D from sums of m / |w|^3 times 1, x, y, x^2, xy, y^2.

    A speed's Hessian is n n' / |w|^3 with n = (-(vy + omega x), vx - omega y, x vx + y vy).
    """
    vx, vy, omega = twists
    one, x, y, xx, xy, yy = sums
    hessian = np.empty((3, 3, twists.shape[1]))
    hessian[0, 0] = vy * vy * one + 2.0 * vy * omega * x + omega * omega * xx
    hessian[1, 1] = vx * vx * one - 2.0 * vx * omega * y + omega * omega * yy
    hessian[2, 2] = vx * vx * xx + 2.0 * vx * vy * xy + vy * vy * yy
    hessian[0, 1] = omega * (vy * y - vx * x + omega * xy) - vx * vy * one
    hessian[0, 2] = -vy * (vx * x + vy * y) - omega * (vx * xx + vy * xy)
    hessian[1, 2] = vx * (vx * x + vy * y) - omega * (vx * xy + vy * yy)
    hessian[1, 0], hessian[2, 0], hessian[2, 1] = hessian[0, 1], hessian[0, 2], hessian[1, 2]
    return hessian
