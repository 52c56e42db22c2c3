# SPDX-License-Identifier: Apache-2.0
"""What a smooth dissipation model costs at recorded pushes, and how that changes with it.

    J = sum_k m_k (log(s_k)^2 + w rho(|v_k - v^_k|))

s_k is the load factor of f_k and v^_k the unit motion of it. The load factor's logarithm fixes
the scale; it goes to infinity when the surface shrinks to nothing or grows without bound. The
motion is found by `SmoothSupportSolver`; its change with the model follows from the condition that
D be least, so that the gradient costs no more than a Newton step: with u from the adjoint,

    dJ/dB_i = sum_k dJ/dD v v' / (2 s_i) + u v' / s_i - (u' B_i v) v v' / (2 s_i^3).

The motion of a load f is where D is least on the plane f . v = 1. With a basis (z1, z2) of the
directions in that plane and v = v0 + y1 z1 + y2 z2, each term is the root of a quadratic in y, and
D(y) a smooth convex function of two variables: Newton's method with backtracking, all loads at
once, warm-started where the model has changed a little.

rho is the squared chord d = |v - v^|, or a robust form of it with a scale c,

    rho(d) = 2 c (sqrt(d^2 + c^2) - c),

which is the square for chords below c and grows like 2 c d beyond, so that a few pushes that went
astray change the surface little (pseudo-Huber; Charbonnier et al. 1997, doi:10.1109/83.551699).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from limit_surface_ros.checks import Bools, Floats
    from limit_surface_ros.fitting.pairs import ScaledPairs

_ITERATIONS = 60
_HALVINGS = 40
# Newton decrement, relative to D, below which one more step is exact to rounding.
_NEAR = 1e-9
# Relative rise of D that is rounding and none to step back from.
_ROUNDING = 1e-13
# Positions of the six distinct entries of a symmetric 3x3 matrix.
_ROWS, _COLUMNS = np.triu_indices(3)


def direction_loss(cosines: Floats, robust_scale: float | None) -> tuple[Floats, Floats]:
    """Return rho and its slope with respect to the cosine of the angle.

    Args:
        cosines: v . v^ of unit vectors, shape (n,).
        robust_scale: c; None for the square.

    Returns:
        rho and d rho / d cosine, shape (n,) each.
    """
    squares = np.maximum(2.0 - 2.0 * cosines, 0.0)
    if robust_scale is None:
        return squares, np.full_like(squares, -2.0)
    roots = np.sqrt(squares + robust_scale**2)
    return 2.0 * robust_scale * (roots - robust_scale), -2.0 * robust_scale / roots


class MotionCost:
    """The error of motion and of load factor at the pairs' loads."""

    def __init__(
        self, pairs: ScaledPairs, velocity_weight: float, robust_scale: float | None
    ) -> None:
        """Hold the pairs and the planes of their loads.

        Args:
            pairs: What to fit.
            velocity_weight: w.
            robust_scale: See `motion_cost`.
        """
        self._weights = pairs.weights
        self._velocity_weight = velocity_weight
        self._robust_scale = robust_scale
        self._directions = np.ascontiguousarray(pairs.directions.T)
        self._solver = SmoothSupportSolver(np.ascontiguousarray(pairs.wrenches.T))

    def of(self, matrices: Floats) -> tuple[float, Floats]:
        """Return the cost of a model, and its gradient by the model's matrices.

        Args:
            matrices: B_i, positive definite, shape (k, 3, 3).

        Returns:
            J, and G with dJ = sum G_ij dB_ij, shape (k, 3, 3), not symmetric.
        """
        solver, weights = self._solver, self._weights
        solver.solve(matrices)
        motions, speeds = solver.motions, solver.speeds
        norms = np.sqrt(np.einsum("cn,cn->n", motions, motions))
        units = motions / norms
        cosines = np.einsum("cn,cn->n", units, self._directions)
        loss, slope = direction_loss(cosines, self._robust_scale)
        log_factors = -np.log(solver.dissipation)
        cost = weights @ (log_factors**2 + self._velocity_weight * loss)
        slope *= self._velocity_weight * weights / norms
        slope = slope * (self._directions - cosines * units)
        places = solver.response(np.einsum("cn,zcn->zn", slope, solver.frame[1:]))
        response = places[0] * solver.frame[1] + places[1] * solver.frame[2]
        along = np.einsum("kzn,zn->kn", solver.gradients, places)
        curvatures = (-weights * log_factors / solver.dissipation - 0.5 * along / speeds) / speeds
        weighted = curvatures[:, None] * motions + response / speeds[:, None]
        gradient = weighted.reshape(-1, motions.shape[1]) @ motions.T
        return float(cost), gradient.reshape(-1, 3, 3)


class SmoothSupportSolver:
    """The plane of each load, and the minimum of D on it.

    Attributes:
        frame: v0, z1, z2 of each load, shape (3 vectors, 3 components, n).
        motions: v of each load at the last model, shape (3, n), with f . v = 1.
        speeds: sqrt(v' B_k v), shape (k, n).
        dissipation: D(v), the reciprocal of the load factor, shape (n,).
    """

    motions: Floats
    speeds: Floats
    dissipation: Floats

    def __init__(self, loads: Floats) -> None:
        """Build the planes.

        Args:
            loads: Scaled loads, shape (3, n), none zero.
        """
        count = loads.shape[1]
        units = loads / np.linalg.norm(loads, axis=0)
        least = np.zeros_like(units)
        least[np.abs(units).argmin(axis=0), np.arange(count)] = 1.0
        first = cross(units, least)
        first /= np.linalg.norm(first, axis=0)
        second = cross(units, first)
        base = loads / np.einsum("cn,cn->n", loads, loads)
        self.frame = np.stack([base, first, second])
        self._planes = _Planes.of(self.frame)
        self._place = np.zeros((2, count))
        # Place of the motions, and derivatives there, where these were asked for last.
        nothing = np.empty((0, 2, count))
        self._known = np.empty_like(self._place), nothing, np.empty((3, count))

    def begin_at(self, motions: Floats) -> None:
        """Look for the motions of the last loads at known ones, shape (3, m), m of 1 to n."""
        count = motions.shape[1]
        across = self.frame[1:, :, -count:]
        self._place[:, -count:] = np.einsum("zcn,cn->zn", across, motions)

    def solve(self, matrices: Floats) -> None:
        """Find the motions under the model with these matrices, shape (k, 3, 3)."""
        self._entries = np.ascontiguousarray(matrices[:, _ROWS, _COLUMNS])
        self._place = _descended(self._entries, self._planes, self._place)
        self._point = self._planes.at(self._place)
        self.speeds = self._point.speeds(self._entries)
        self.dissipation = self.speeds.sum(axis=0)
        base, first, second = self.frame
        self.motions = base + self._place[0] * first + self._place[1] * second

    @property
    def gradients(self) -> Floats:
        """Gradient of every term's speed in the planes, along (z1, z2), shape (k, 2, n)."""
        return self._derivatives[0]

    def response(self, changes: Floats) -> Floats:
        """Return how the motions change in their planes with changes of grad D in them.

        From the condition that D be least: d(grad D) + H dv vanishes in the plane. H is symmetric,
        so that this is the adjoint, too.

        Args:
            changes: Along (z1, z2), shape (2, ..., n).

        Returns:
            -H^-1 changes, shape (2, ..., n).
        """
        return _newton_step(changes, self._derivatives[1])

    @property
    def _derivatives(self) -> tuple[Floats, Floats]:
        """Gradients of the terms, and Hessian of D, shape (3, n): 11, 12 and 22."""
        place, gradients, hessian = self._known
        if place is not self._place:
            gradients, _, hessian = self._point.derivatives(self._entries, self.speeds)
            self._known = self._place, gradients, hessian
        return gradients, hessian


@dataclass(frozen=True)
class _Planes:
    """Planes of loads in the form that solves need.

    Attributes:
        lifts: Row ij of [d, :, e] is what entry ij of B counts in d' B e, for d, e of v0, z1, z2;
            shape (3, 6, 3, n).
        squares: The same for z1' B z1, z1' B z2 and z2' B z2, shape (6, 3, n).
    """

    lifts: Floats
    squares: Floats

    @classmethod
    def of(cls, frame: Floats) -> _Planes:
        """Return those of v0, z1, z2 of each load, shape (3 vectors, 3 components, n)."""
        rows, columns = frame[:, _ROWS], frame[:, _COLUMNS]
        lifts = rows[:, :, None] * columns.swapaxes(0, 1)
        lifts += columns[:, :, None] * rows.swapaxes(0, 1)
        lifts[:, _ROWS == _COLUMNS] *= 0.5
        squares = np.stack([lifts[1, :, 1], lifts[1, :, 2], lifts[2, :, 2]], axis=1)
        return cls(lifts, squares)

    def take(self, which: Bools) -> _Planes:
        """Return some of them."""
        return _Planes(self.lifts[..., which], self.squares[..., which])

    def at(self, place: Floats) -> _Point:
        """Return the motions at these places in the planes, shape (2, n)."""
        first, second = place
        base, along, across = self.lifts
        sides = base + first * along + second * across
        square = sides[:, 0] + first * sides[:, 1] + second * sides[:, 2]
        return _Point(sides[:, 1:], square, self.squares)


@dataclass(frozen=True)
class _Point:
    """A motion v in each plane.

    Attributes:
        sides: What entries of B count in z1' B v and z2' B v, shape (6, 2, n).
        square: The same for v' B v, shape (6, n).
        squares: See `_Planes`.
    """

    sides: Floats
    square: Floats
    squares: Floats

    def speeds(self, entries: Floats) -> Floats:
        """Return sqrt(v' B_k v) of matrices with these entries, shape (k, n)."""
        return np.asarray(np.sqrt(np.maximum(entries @ self.square, 1e-300)))

    def derivatives(self, entries: Floats, speeds: Floats) -> tuple[Floats, Floats, Floats]:
        """Return each speed's gradient in the plane, that of D, and the Hessian of D.

        Their shapes are (k, 2, n), (2, n) and (3, n).
        """
        count = speeds.shape[1]
        slowness = 1.0 / speeds
        gradients = (entries @ self.sides.reshape(6, -1)).reshape(-1, 2, count)
        gradients *= slowness[:, None]
        total = entries.T @ slowness
        hessian = np.einsum("cn,can->an", total, self.squares)
        first, second = gradients[:, 0], gradients[:, 1]
        weighted = first * slowness
        hessian[0] -= np.einsum("kn,kn->n", weighted, first)
        hessian[1] -= np.einsum("kn,kn->n", weighted, second)
        hessian[2] -= np.einsum("kn,kn,kn->n", slowness, second, second)
        return gradients, np.einsum("cn,can->an", total, self.sides), hessian


def _newton_step(slope: Floats, hessian: Floats) -> Floats:
    """Return -H^-1 slope for each load; shapes (2, ..., n) and (3, n)."""
    (g1, g2), (h11, h12, h22) = slope, hessian
    step = np.empty_like(slope)
    step[0] = h12 * g2 - h22 * g1
    step[1] = h12 * g1 - h11 * g2
    step /= h11 * h22 - h12 * h12
    return np.asarray(step)


def cross(first: Floats, second: Floats) -> Floats:
    """Return cross products of columns; numpy's takes several times as long for few of them."""
    (a, b, c), (x, y, z) = first, second
    return np.asarray(np.stack([b * z - c * y, c * x - a * z, a * y - b * x]))


def _descended(entries: Floats, planes: _Planes, start: Floats) -> Floats:
    """Return the minima, shape (2, n), from places to start at; arrived loads are left out."""
    places = start.copy()
    where = np.arange(places.shape[1])
    place = places
    point = planes.at(place)
    speeds = point.speeds(entries)
    for _ in range(_ITERATIONS):
        total = speeds.sum(axis=0)
        _, slope, hessian = point.derivatives(entries, speeds)
        step = _newton_step(slope, hessian)
        far = -(slope * step).sum(axis=0) > _NEAR * total
        if not far.all():
            # One more step is exact to rounding: there is nothing to step back from.
            arrived = ~far
            places[:, where[arrived]] = (place + step)[:, arrived]
            if not far.any():
                break
            where, planes = where[far], planes.take(far)
            place, step, total = place[:, far], step[:, far], total[far]
        place, point, speeds = _backtrack(entries, planes, place, step, total)
        places[:, where] = place
    return np.asarray(places)


def _backtrack(
    entries: Floats, planes: _Planes, place: Floats, step: Floats, total: Floats
) -> tuple[Floats, _Point, Floats]:
    """Return places along the steps where D is no larger, the motions and the speeds there."""
    for _ in range(_HALVINGS):
        trial = place + step
        point = planes.at(trial)
        speeds = point.speeds(entries)
        worse = speeds.sum(axis=0) > (1.0 + _ROUNDING) * total
        if not worse.any():
            return trial, point, speeds
        step[:, worse] *= 0.5
    # Rounding: these cannot get any better.
    trial[:, worse] = place[:, worse]
    point = planes.at(trial)
    return trial, point, point.speeds(entries)
