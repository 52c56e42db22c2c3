# SPDX-License-Identifier: Apache-2.0
"""Friction on a sliding body, in physical units: the wrench, the dissipation, its curvature.

A body with twist q loses the power D(q) = q.f, where f(q), the gradient of D, is what
`wrench_of_twist` returns; the friction on the body is -f. Kinds whose dissipation is a sum of
norms, D(q) = sum_k |R_k q|, have all of this in closed form, and creases where R_k q = 0.
"""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING, Protocol

import numpy as np

from limit_surface_ros.surface.linalg import root_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import TypeAlias

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.base import LimitSurface

    # Wrench f of a twist (vx, vy, omega) and the rate of the scaled time there [1/s].
    Law: TypeAlias = Callable[[float, float, float], tuple[float, float, float, float]]

# Pivots below this part of the largest are rounding: the term has no such rank.
RANK_TOLERANCE = 1e-13
# Terms from which on numpy is quicker than plain floats.
_MANY = 16
# Part of a twist by which it is moved for a difference.
_DIFFERENCE = 1e-6
# Directions among which the largest dissipation is looked for.
_DIRECTIONS = 64
_TINY = 1e-300
# Digits in which two terms must agree, but for their size, to be one.
_SAME_DIGITS = 12


class Friction(Protocol):
    """What a slide asks of the friction under a body."""

    def law(self, root: Floats) -> Law:
        """Return the wrench of a twist, with the rate of the scaled time, in plain floats.

        Args:
            root: R with R'R the inertia matrix, shape (3, 3).
        """
        ...

    def wrenches(self, twists: Floats) -> Floats:
        """Map twists (n, 3), none zero, to wrenches (n, 3)."""
        ...

    def curvature(self, twist: Floats) -> Floats:
        """Return the Hessian of the dissipation at a twist, shape (3, 3)."""
        ...

    def expansion(self, twist: Floats, rounding: float = 0.0) -> tuple[float, Floats, Floats]:
        """Return the dissipation at a twist, its gradient and its Hessian."""
        ...

    def largest(self, root: Floats) -> float:
        """Return about the largest dissipation of a twist of unit energy norm."""
        ...


class NormFriction:
    """Friction whose dissipation is a sum of norms, D(q) = sum_k |R_k q|.

    Attributes:
        roots: R_k, upper triangles whose rows are zero beyond the rank, shape (k, 3, 3).
        ranks: Of the R_k, shape (k,).
    """

    def __init__(self, roots: Floats) -> None:
        """Take the roots."""
        self.roots = roots
        self.ranks = roots.any(axis=2).sum(axis=1)

    @classmethod
    def of_forms(cls, forms: Floats, unit: Floats) -> NormFriction:
        """Return the friction of scaled forms B_k, shape (k, 3, 3).

        Args:
            forms: Positive semidefinite.
            unit: What a physical twist is multiplied by, shape (3,), friction force included.
        """
        roots = np.array([_triangle(root_of(form)) for form in forms]) * unit
        return cls(_merged(roots))

    @classmethod
    def of_points(cls, points: Floats, limits: Floats) -> NormFriction:
        """Return the friction of support points, shape (n, 2), with their limits [N], (n,)."""
        points, limits = points[limits > 0.0], limits[limits > 0.0]
        roots = np.zeros((len(points), 3, 3))
        roots[:, 0, 0] = roots[:, 1, 1] = limits
        roots[:, 0, 2] = -limits * points[:, 1]
        roots[:, 1, 2] = limits * points[:, 0]
        return cls(_merged(roots))

    def without(self, terms: Sequence[int]) -> NormFriction:
        """Return the friction of all terms but some."""
        return NormFriction(np.delete(self.roots, list(terms), axis=0))

    def law(self, root: Floats) -> Law:
        """Return the wrench of a twist, with the rate of the scaled time, in plain floats.

        The rate is sum_k trace(M^-1 R_k'R_k) / |R_k q|, by which the time is stretched so that
        the Lipschitz constant of the motion is at most about 1, near creases and rest as well.

        Args:
            root: R with R'R the inertia matrix M, shape (3, 3).
        """
        weights = np.square(self.roots @ np.linalg.inv(root)).sum(axis=(1, 2))
        if len(self.roots) >= _MANY:
            return self._law_of_many(weights)
        terms = [
            (*r[0], *r[1][1:], r[2][2], weight)
            for r, weight in zip(self.roots.tolist(), weights.tolist(), strict=True)
        ]

        def law(x: float, y: float, z: float) -> tuple[float, float, float, float]:
            fx = fy = fz = rate = 0.0
            for a, b, c, d, e, f, weight in terms:
                u = a * x + b * y + c * z
                v = d * y + e * z
                w = f * z
                inverse = 1.0 / (sqrt(u * u + v * v + w * w) + _TINY)
                rate += weight * inverse
                u *= inverse
                v *= inverse
                fx += a * u
                fy += b * u + d * v
                fz += c * u + e * v + f * w * inverse
            return fx, fy, fz, rate

        return law

    def _law_of_many(self, weights: Floats) -> Law:
        stacked = np.ascontiguousarray(self.roots.transpose(1, 0, 2)).reshape(-1, 3)
        count = len(self.roots)

        def law(x: float, y: float, z: float) -> tuple[float, float, float, float]:
            images = (stacked @ (x, y, z)).reshape(3, count)
            inverses = 1.0 / (np.sqrt(np.einsum("ik,ik->k", images, images)) + _TINY)
            rate = float(weights @ inverses)
            fx, fy, fz = ((images * inverses).reshape(-1) @ stacked).tolist()
            return fx, fy, fz, rate

        return law

    def wrenches(self, twists: Floats) -> Floats:
        """Map twists (n, 3), none zero, to wrenches (n, 3)."""
        images = np.einsum("kij,nj->nki", self.roots, twists)
        images /= np.linalg.norm(images, axis=2, keepdims=True) + _TINY
        return np.asarray(np.einsum("kij,nki->nj", self.roots, images))

    def sizes(self, twist: Floats) -> Floats:
        """Return |R_k q| of a twist q, shape (k,)."""
        return np.asarray(np.linalg.norm(self.roots @ twist, axis=1))

    def curvature(self, twist: Floats) -> Floats:
        """Return the Hessian of the dissipation at a twist, shape (3, 3)."""
        return self.expansion(twist)[2]

    def expansion(self, twist: Floats, rounding: float = 0.0) -> tuple[float, Floats, Floats]:
        """Return the dissipation at a twist, its gradient and its Hessian.

        Args:
            twist: Shape (3,).
            rounding: d of sqrt(|R_k q|^2 + d^2 |R_k|^2), which takes the place of each norm.
        """
        images = self.roots @ twist
        squares = np.einsum("ki,ki->k", images, images)
        if rounding:
            squares = squares + rounding**2 * np.square(self.roots).sum(axis=(1, 2))
        sizes = np.sqrt(squares) + _TINY
        along = np.einsum("kij,ki->kj", self.roots, images / sizes[:, np.newaxis])
        hessian = np.einsum("kij,kil,k->jl", self.roots, self.roots, 1.0 / sizes)
        hessian -= np.einsum("kj,kl,k->jl", along, along, 1.0 / sizes)
        return float(sizes.sum()), along.sum(axis=0), hessian

    def largest(self, root: Floats) -> float:
        """Return about the largest dissipation of a twist of unit energy norm."""
        return float(np.linalg.norm(self.roots @ np.linalg.inv(root), 2, axis=(1, 2)).sum())


class MapFriction:
    """Friction by the surface's own `wrench_of_twist`, for kinds with no closed form."""

    def __init__(self, surface: LimitSurface) -> None:
        """Take the surface."""
        self._surface = surface

    def law(self, root: Floats) -> Law:
        """Return the wrench of a twist, with the rate of the scaled time; see `Friction`.

        The rate is the largest dissipation over the energy norm.
        """
        largest, wrench_of_twist = self.largest(root), self._surface.wrench_of_twist
        (a, b, c), (_, d, e), (_, _, f) = root.tolist()

        def law(x: float, y: float, z: float) -> tuple[float, float, float, float]:
            fx, fy, fz = wrench_of_twist((x, y, z)).tolist()
            u, v, w = a * x + b * y + c * z, d * y + e * z, f * z
            return fx, fy, fz, largest / (sqrt(u * u + v * v + w * w) + _TINY)

        return law

    def wrenches(self, twists: Floats) -> Floats:
        """Map twists (n, 3), none zero, to wrenches (n, 3)."""
        return self._surface.wrench_of_twist(twists)

    def curvature(self, twist: Floats) -> Floats:
        """Return the Hessian of the dissipation at a twist, by central differences."""
        unit = self._surface.scaling.twist_unit
        steps = _DIFFERENCE * np.linalg.norm(twist / unit) * np.diag(unit)
        differences = self.wrenches(twist + steps) - self.wrenches(twist - steps)
        hessian = differences / (2.0 * np.diag(steps)[:, np.newaxis])
        return np.asarray(0.5 * (hessian + hessian.T))

    def expansion(self, twist: Floats, rounding: float = 0.0) -> tuple[float, Floats, Floats]:
        """Return the dissipation at a twist, its gradient and its Hessian; it has no creases."""
        wrench = self.wrenches(twist[np.newaxis])[0]
        return float(wrench @ twist), wrench, self.curvature(twist)

    def largest(self, root: Floats) -> float:
        """Return about the largest dissipation of a twist of unit energy norm."""
        turns = np.arange(_DIRECTIONS) + 0.5
        height = 1.0 - turns / _DIRECTIONS
        angle = np.pi * (1.0 + sqrt(5.0)) * turns
        radius = np.sqrt(1.0 - height**2)
        units = np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)
        twists = units @ np.linalg.inv(root).T
        return float(np.einsum("ni,ni->n", self.wrenches(twists), twists).max())


def friction_of(surface: LimitSurface) -> NormFriction | MapFriction:
    """Return the friction of a surface, in closed form where its dissipation is a sum of norms."""
    if surface.contact_points is not None:
        return NormFriction.of_points(*surface.contact_points)
    forms = surface.scaled_forms
    if forms is None:
        return MapFriction(surface)
    scaling = surface.scaling
    return NormFriction.of_forms(forms, scaling.friction_force / scaling.twist_unit)


def _triangle(root: Floats) -> Floats:
    """Return the upper triangle with the same R'R, without rows that are rounding."""
    rows = root[np.square(root).max(axis=1) > RANK_TOLERANCE * np.square(root).max()]
    triangle = np.zeros((3, 3))
    triangle[: len(rows)] = np.linalg.qr(rows, mode="r")
    return triangle


def _merged(roots: Floats) -> Floats:
    """Return the roots with those of one shape added up: points in one place rest together."""
    merged: dict[bytes, Floats] = {}
    for root in roots:
        form = root.T @ root
        # Adding 0 makes one zero of both.
        key = (np.round(form / np.trace(form), _SAME_DIGITS) + 0.0).tobytes()
        other = merged.get(key)
        share = 0.0 if other is None else float(np.linalg.norm(root) / np.linalg.norm(other))
        merged[key] = root if other is None else other * (1.0 + share)
    return np.array(list(merged.values()))
