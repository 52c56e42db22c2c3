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

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
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
        response = solver.adjoint(slope * (self._directions - cosines * units))
        products = (matrices.reshape(-1, 3) @ motions).reshape(-1, 3, motions.shape[1])
        along = np.einsum("kcn,cn->kn", products, response)
        curvatures = (
            -weights * log_factors / solver.dissipation - 0.5 * along / speeds**2
        ) / speeds
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
        first = np.cross(units, least, axis=0)
        first /= np.linalg.norm(first, axis=0)
        second = np.cross(units, first, axis=0)
        base = loads / np.einsum("cn,cn->n", loads, loads)
        self.frame = np.stack([base, first, second])
        # Row ij of the products turns the entries of B into v_i' B v_j.
        sides = np.einsum("icn,jdn->ijcdn", self.frame, self.frame)[_ROWS, _COLUMNS]
        symmetric = sides + sides.swapaxes(1, 2)
        symmetric[:, range(3), range(3)] *= 0.5
        self._lift = np.ascontiguousarray(
            symmetric[:, _ROWS, _COLUMNS].transpose(1, 0, 2).reshape(6, 6 * count)
        )
        self._place = np.zeros((2, count))
        self._hessian = np.zeros((3, count))

    def begin_at(self, motions: Floats) -> None:
        """Look for the motions of the first loads at known ones, shape (3, m)."""
        count = motions.shape[1]
        across = self.frame[1:, :, :count]
        self._place[:, :count] = np.einsum("zcn,cn->zn", across, motions)

    def solve(self, matrices: Floats) -> None:
        """Find the motions under the model with these matrices, shape (k, 3, 3)."""
        forms = (matrices[:, _ROWS, _COLUMNS] @ self._lift).reshape(len(matrices), 6, -1)
        _descend(forms, self._place)
        self.speeds = _speeds(forms, self._place)
        self.dissipation = self.speeds.sum(axis=0)
        self._hessian = np.stack(_derivatives(forms, self._place, self.speeds)[1])
        base, first, second = self.frame
        self.motions = base + self._place[0] * first + self._place[1] * second

    def adjoint(self, slope: Floats) -> Floats:
        """Return u with dJ = u . d(grad D) for a cost whose gradient by the motion is `slope`.

        From the condition that D be least: d(grad D) + H dv vanishes in the plane.

        Args:
            slope: dJ/dv, shape (3, n).

        Returns:
            Shape (3, n).
        """
        p1 = np.einsum("cn,cn->n", slope, self.frame[1])
        p2 = np.einsum("cn,cn->n", slope, self.frame[2])
        h11, h12, h22 = self._hessian
        determinant = h11 * h22 - h12 * h12
        u1 = (h12 * p2 - h22 * p1) / determinant
        u2 = (h12 * p1 - h11 * p2) / determinant
        return np.asarray(u1 * self.frame[1] + u2 * self.frame[2])

    def response(self, changes: Floats) -> Floats:
        """Return how the motions change with changes of grad D at them.

        Args:
            changes: Shape (k, 3, n), k changes at every load.

        Returns:
            Shape (k, 3, n): -(z1 z2) H^-1 (z1 . change, z2 . change)'.
        """
        p1 = np.einsum("kcn,cn->kn", changes, self.frame[1])
        p2 = np.einsum("kcn,cn->kn", changes, self.frame[2])
        h11, h12, h22 = self._hessian
        determinant = h11 * h22 - h12 * h12
        y1, y2 = (h12 * p2 - h22 * p1) / determinant, (h12 * p1 - h11 * p2) / determinant
        return np.asarray(y1[:, None] * self.frame[1] + y2[:, None] * self.frame[2])


def _descend(forms: Floats, places: Floats) -> None:
    """Move `places`, shape (2, n), to the minima; loads that have arrived are left out."""
    where = np.arange(places.shape[1])
    place = places.copy()
    speeds = _speeds(forms, place)
    for _ in range(_ITERATIONS):
        total = speeds.sum(axis=0)
        (g1, g2), (h11, h12, h22) = _derivatives(forms, place, speeds)
        determinant = h11 * h22 - h12 * h12
        step = np.stack([h12 * g2 - h22 * g1, h12 * g1 - h11 * g2]) / determinant
        far = -(g1 * step[0] + g2 * step[1]) > _NEAR * total
        place, speeds = _backtrack(forms, place, step, total)
        places[:, where] = place
        if not far.any():
            return
        if not far.all():
            where, forms = where[far], forms[:, :, far]
            place, speeds = place[:, far], speeds[:, far]


def _backtrack(forms: Floats, place: Floats, step: Floats, total: Floats) -> tuple[Floats, Floats]:
    """Return places along the steps where D is no larger, and the speeds there."""
    for _ in range(_HALVINGS):
        trial = place + step
        speeds = _speeds(forms, trial)
        worse = speeds.sum(axis=0) > (1.0 + _ROUNDING) * total
        if not worse.any():
            return trial, speeds
        step[:, worse] *= 0.5
    # Rounding: these cannot get any better.
    trial[:, worse] = place[:, worse]
    return trial, _speeds(forms, trial)


def _speeds(forms: Floats, place: Floats) -> Floats:
    c00, c01, c02, c11, c12, c22 = forms.swapaxes(0, 1)
    y1, y2 = place
    squares = c00 + y1 * (2.0 * c01 + y1 * c11) + y2 * (2.0 * (c02 + y1 * c12) + y2 * c22)
    return np.asarray(np.sqrt(np.maximum(squares, 1e-300)))


def _derivatives(
    forms: Floats, place: Floats, speeds: Floats
) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats, Floats]]:
    """Return gradient and Hessian of D in the plane."""
    _, c01, c02, c11, c12, c22 = forms.swapaxes(0, 1)
    y1, y2 = place
    g1 = (c01 + y1 * c11 + y2 * c12) / speeds
    g2 = (c02 + y1 * c12 + y2 * c22) / speeds
    h11 = ((c11 - g1 * g1) / speeds).sum(axis=0)
    h12 = ((c12 - g1 * g2) / speeds).sum(axis=0)
    h22 = ((c22 - g2 * g2) / speeds).sum(axis=0)
    return (g1.sum(axis=0), g2.sum(axis=0)), (h11, h12, h22)
