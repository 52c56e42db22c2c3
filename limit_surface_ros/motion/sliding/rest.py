# SPDX-License-Identifier: Apache-2.0
"""How a body leaves rest and how it comes to rest.

From rest under a load w outside the limit surface it moves with the acceleration
a = argmin a'Ma / 2 - w.a + D(a), a strictly convex problem (Moreau's projection of w on the set of
wrenches that friction can resist, in the metric of M^-1). It comes to rest as q = (T - t) g with
M g = f(g) - w. See S. Goyal, A. Ruina and J. Papadopoulos, Wear 143, 1991,
doi:10.1016/0043-1648(91)90105-3.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import SolverError
from limit_surface_ros.motion.sliding.friction import NormFriction

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.motion.sliding.friction import Friction

_STEPS = 60
# Gradients, in parts of the wrench, with which Newton's method ends and which are good enough.
_EXACT, _ACCEPTED = 1e-14, 1e-9
# Least part of a step of Newton's method.
_LEAST_SHARE = 1e-4
# By how much creases are rounded off, in parts of the acceleration.
_ROUNDINGS = [10.0**-power for power in range(2, 12)]
# Excess of a resting term's force over its limit that is rounding.
LIMIT_TOLERANCE = 1e-9


def null_space(rows: Floats) -> Floats:
    """Return an orthonormal basis of the twists that rows (n, 3) map to zero, shape (3, d)."""
    # Of a triangle: the left vectors of many rows would be a huge matrix.
    _, sizes, vectors = np.linalg.svd(np.linalg.qr(rows, mode="r"))
    rank = int((sizes > 1e-12 * sizes[0]).sum())
    return np.asarray(vectors[rank:].T)


def acceleration(friction: Friction, matrix: Floats, wrench: Floats, start: Floats) -> Floats:
    """Return a = argmin a'Ma / 2 - w.a + D(a), shape (3,) [m/s^2, m/s^2, rad/s^2].

    Args:
        friction: D.
        matrix: M, shape (3, 3).
        wrench: w, outside the limit surface, shape (3,).
        start: A twist along which w has more power than friction, shape (3,).

    Raises:
        SolverError: Newton's method came to no solution.
    """
    problem = _Problem(friction, matrix, wrench, np.eye(3))
    found = problem.minimum(start)
    if found is None and isinstance(friction, NormFriction):
        found = _on_a_crease(friction, matrix, wrench, start)
    if found is None and isinstance(friction, NormFriction):
        found = problem.minimum_by_rounding(start)
    if found is None:
        raise SolverError("the first acceleration of a body from rest was not found")
    return found


class _Problem:
    """The minimum of a'Ma / 2 - w.a + D(a) within the span of a basis (3, d)."""

    def __init__(self, friction: Friction, matrix: Floats, wrench: Floats, basis: Floats) -> None:
        self._friction, self._basis = friction, basis
        self._matrix = basis.T @ matrix @ basis
        self._wrench = basis.T @ wrench
        self._units = 1.0 / np.sqrt(np.diag(self._matrix))
        self._size = float(np.linalg.norm(self._wrench * self._units))
        self._into = np.linalg.solve(self._matrix, basis.T @ matrix)

    def minimum(self, start: Floats) -> Floats | None:
        """Return it by Newton's method from a twist; None where that ends at a crease."""
        u = self._into @ start
        power = self._friction.expansion(self._basis @ u)[0]
        gain = float(self._wrench @ u) - power
        if not gain > 0.0:
            return None
        u, residual = self._newton(u * (gain / float(u @ self._matrix @ u)), 0.0)
        return np.asarray(self._basis @ u) if residual <= _ACCEPTED else None

    def minimum_by_rounding(self, start: Floats) -> Floats | None:
        """Return it by rounding off the creases less and less."""
        u = self._into @ start
        u *= float(self._wrench @ u) / float(u @ self._matrix @ u)
        size = float(np.linalg.norm(self._basis @ u))
        for rounding in _ROUNDINGS:
            u, _ = self._newton(u, rounding * size)
        u, residual = self._newton(u, 0.0)
        return np.asarray(self._basis @ u) if residual <= _ACCEPTED else None

    def _newton(self, u: Floats, rounding: float) -> tuple[Floats, float]:
        """Return where Newton's method ends, and the residual there in parts of the wrench."""
        height, gradient, hessian = self._expansion(u, rounding)
        residual = self._residual(gradient)
        for _ in range(_STEPS):
            if residual <= _EXACT:
                break
            try:
                move = np.linalg.solve(hessian, -gradient)
            except np.linalg.LinAlgError:
                # Beside a crease its curvature drowns the inertia.
                break
            slope, share = float(gradient @ move), 1.0
            # Where rounding hides what is to be gained, the gradient tells.
            hidden = -slope <= 1e-11 * abs(height)
            while share > _LEAST_SHARE:
                following = u + share * move
                if following.any():
                    found = self._expansion(following, rounding)
                    lower = self._residual(found[1])
                    if found[0] <= height + 1e-4 * share * slope and not hidden:
                        break
                    if hidden and lower < residual * (1.0 - 0.1 * share):
                        break
                share *= 0.5
            else:
                break
            u, residual = following, lower
            height, gradient, hessian = found
        return u, residual

    def _expansion(self, u: Floats, rounding: float) -> tuple[float, Floats, Floats]:
        power, force, curvature = self._friction.expansion(self._basis @ u, rounding)
        inertia = self._matrix @ u
        return (
            float(0.5 * inertia @ u - self._wrench @ u) + power,
            inertia - self._wrench + self._basis.T @ force,
            self._matrix + self._basis.T @ curvature @ self._basis,
        )

    def _residual(self, gradient: Floats) -> float:
        return float(np.linalg.norm(gradient * self._units)) / self._size


def _on_a_crease(
    friction: NormFriction, matrix: Floats, wrench: Floats, start: Floats
) -> Floats | None:
    """Return the minimum if it lies on a crease: a term's own motion is zero in it."""
    for term in np.flatnonzero(friction.ranks < 3).tolist():
        rows = friction.roots[term][: friction.ranks[term]]
        basis = null_space(rows)
        rest = friction.without([term])
        if not len(rest.roots):
            continue
        if basis.shape[1] == 1:
            z = basis[:, 0]
            power = float(z @ wrench)
            gain = abs(power) - float(rest.sizes(z).sum())
            if gain <= 0.0:
                continue
            a = np.copysign(gain, power) / float(z @ matrix @ z) * z
        else:
            found = _Problem(rest, matrix, wrench, basis).minimum(start)
            if found is None:
                continue
            a = found
        force = np.linalg.lstsq(
            rows.T, wrench - matrix @ a - rest.wrenches(a[np.newaxis])[0], rcond=None
        )[0]
        if float(np.linalg.norm(force)) <= 1.0 + LIMIT_TOLERANCE:
            return np.asarray(a)
    return None


def final_direction(friction: Friction, matrix: Floats, wrench: Floats, start: Floats) -> Floats:
    """Return the direction in which a body comes to rest, of unit energy norm, shape (3,).

    The flow of directions, n' = -M^-1 (f(n) - w) + (n.(f(n) - w)) n, is followed to its end by
    implicit Euler steps that grow as it settles, in the end Newton's.

    Args:
        friction: f.
        matrix: M, shape (3, 3).
        wrench: w, the load that is left, inside the limit surface, shape (3,).
        start: A twist shortly before rest, shape (3,).
    """
    inverse = np.linalg.inv(matrix)

    def flow(n: Floats) -> tuple[Floats, Floats, float]:
        net = friction.wrenches(n[np.newaxis])[0] - wrench
        slowing = float(n @ net)
        return slowing * n - inverse @ net, net, slowing

    n = start / np.sqrt(float(start @ matrix @ start))
    rate, net, slowing = flow(n)
    first, first_speed = n, float(np.sqrt(rate @ matrix @ rate))
    speed, width = first_speed, 1.0 / max(abs(slowing), 1e-300)
    for _ in range(_STEPS):
        if speed <= 1e-14 * abs(slowing):
            break
        hessian = friction.curvature(n)
        jacobian = slowing * np.eye(3) - inverse @ hessian + np.outer(n, net)
        try:
            move = np.linalg.solve(np.eye(3) / width - jacobian, rate)
        except np.linalg.LinAlgError:
            break
        # A step turns the direction by a tenth at most, so that it follows the flow.
        turn = float(np.sqrt(move @ matrix @ move))
        move *= min(1.0, 0.1 / turn) if turn else 1.0
        following = n + move
        following /= np.sqrt(float(following @ matrix @ following))
        rate, net, slowing = flow(following)
        before, speed = speed, float(np.sqrt(rate @ matrix @ rate))
        if not np.isfinite(speed) or not slowing > 0.0:
            return np.asarray(first)
        n = following
        width *= min(4.0, max(0.25, 2.0 * before / max(speed, 1e-300)))
    return np.asarray(n if speed <= max(1e-7 * slowing, 1e-3 * first_speed) else first)
