# SPDX-License-Identifier: Apache-2.0
"""Motions of loads: support points of the dissipation D(v) = sum_k |R_k v|.

The motion of a load f is where f.v is largest on D = 1, and that power is the load factor.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.surface.gauges.norm_sum import NormSum, PointNormSum
from limit_surface_ros.surface.gauges.scalar import NormSumScalar
from limit_surface_ros.surface.linalg import even_directions, null_space
from limit_surface_ros.surface.support.many_points import ManyPoints
from limit_surface_ros.surface.support.small_batch import SmallBatch
from limit_surface_ros.surface.support.solvers import ConvexNewton, InFrame, SupportSolver
from limit_surface_ros.surface.support.tabulated import Tabulated

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats

# Motions from which Newton's method may start.
_STARTS = 400
# Terms up to which plain floats are quicker than numpy for one vector.
FEW_TERMS = 30
# Points from which their sums are the cost of a motion, and single precision pays.
_MANY = 200
# Points up to which a table is made before any large batch is there: it takes a second then.
_TABLE_AHEAD = 1000
# Part of a load along a free motion, above which the load causes that motion.
_FREE = 1e-12
# Condition of the axes in which D is round beyond which rounding would spoil its kinks.
_CONDITION = 1e6


class WithFreeMotions(SupportSolver):
    """A solver where some motions are resisted by nothing: loads along them have no limit.

    A single support point turns freely. The load factor of a load along such a motion is infinite,
    and its motion is that one.
    """

    def __init__(self, free: Floats, solver: SupportSolver) -> None:
        """Keep the free motions, orthonormal, (q, 3), and the solver for loads across them."""
        self._free = free
        self._solver = solver

    def solve(self, normals: Floats) -> tuple[Floats, Floats]:
        """Return motions and load factors; see `SupportSolver`."""
        powers = self._free @ normals
        # Beside what rounding may leave of a sum.
        moves = (np.abs(powers) > _FREE * (np.abs(self._free) @ np.abs(normals))).any(axis=0)
        motions: Floats = self._free.T @ powers
        factors: Floats = np.full(normals.shape[1], np.inf)
        rest = np.flatnonzero(~moves)
        if len(rest):
            across = normals[:, rest] - motions[:, rest]
            motions[:, rest], factors[rest] = self._solver.solve(across)
        return motions, factors

    def expect(self, count: float) -> None:
        """Make what pays if so many loads come; see `SupportSolver`."""
        self._solver.expect(count)


def dissipation_solver(roots: Floats) -> SupportSolver:
    """Return the solver for D(v) = sum_k |R_k v|.

    Args:
        roots: R_k, shape (k, 3, 3).
    """
    free = null_space(roots)
    if len(free):
        # A resistance within one norm keeps the motions of other loads at zero along the free.
        first = np.concatenate([roots[0], np.sqrt(np.square(roots[0]).sum()) * free])
        roots = np.concatenate([np.linalg.qr(first)[1][np.newaxis], roots[1:]])
        return WithFreeMotions(free, _in_round_frame(roots))
    return _in_round_frame(roots)


def _in_round_frame(roots: Floats) -> SupportSolver:
    """Return the solver in units, and if they are not too skew in axes, in which D is round."""
    rows = roots.reshape(-1, 3)
    sizes = np.sqrt(np.square(rows).sum(axis=0))
    # Those in which sum_k |R_k v|^2 is a sphere.
    axes = np.linalg.inv(np.linalg.qr(rows / sizes)[1])
    frame = np.diag(1.0 / sizes)
    if np.linalg.cond(axes) < _CONDITION:
        frame = frame @ axes
    return InFrame(frame, _solver_of_norms(roots @ frame))


def _solver_of_norms(roots: Floats) -> SupportSolver:
    gauge = NormSum(roots)
    corners = gauge.corners()
    newton = ConvexNewton(gauge, even_directions(_STARTS).T, corners)
    if len(roots) > FEW_TERMS:
        return Tabulated(gauge, newton)
    scalar = NormSumScalar(roots)
    small = SmallBatch(newton, scalar, corners)
    return Tabulated(gauge, small, scalar=scalar, corners=corners)


def points_solver(gauge: PointNormSum) -> SupportSolver:
    """Return the solver for the dissipation of support points."""
    if len(gauge.limits) == 1:
        # It turns freely about the point, and any other motion is resisted alike.
        return dissipation_solver(gauge.roots())
    # About their middle, and in parts of their mean distance from it, points are well to solve
    # for wherever the reference point is and however small the body.
    heaviest = gauge.points[gauge.limits.argmax()]
    points = gauge.points - heaviest
    middle = gauge.limits @ points / gauge.limits.sum()
    points -= middle
    length = gauge.limits @ np.hypot(*points.T) / gauge.limits.sum()
    x, y = heaviest + middle
    frame = np.array([[1.0, 0.0, y / length], [0.0, 1.0, -x / length], [0.0, 0.0, 1.0 / length]])
    return InFrame(frame, _solver_of_points(PointNormSum(points / length, gauge.limits)))


def _solver_of_points(gauge: PointNormSum) -> SupportSolver:
    starts = even_directions(_STARTS).T
    if len(gauge.limits) >= _MANY:
        many = ManyPoints(gauge, ConvexNewton(gauge, starts))
        return Tabulated(many, many, ahead=len(gauge.limits) <= _TABLE_AHEAD)
    corners = gauge.corners()
    newton = ConvexNewton(gauge, starts, corners)
    if len(gauge.limits) > FEW_TERMS:
        return Tabulated(gauge, newton)
    scalar = NormSumScalar(gauge.roots())
    small = SmallBatch(newton, scalar, corners)
    return Tabulated(gauge, small, scalar=scalar, corners=corners)
