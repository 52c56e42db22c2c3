# SPDX-License-Identifier: Apache-2.0
"""Sums of norms as gauges: of matrices, and of the velocities of support points.

As the dissipation of a body they are gauges of motions, as a power sum with every exponent 1/2
they are gauges of loads. All arrays are scaled columns.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.surface.gauges.corners import Corners
from limit_surface_ros.surface.gauges.gauge import Turning
from limit_surface_ros.surface.gauges.jacobians import (
    ENTRIES,
    six_of,
    sum_of_terms,
    take_outer,
)
from limit_surface_ros.surface.linalg import squared_lengths

if TYPE_CHECKING:
    from collections.abc import Iterator

    from limit_surface_ros.checks import Floats, Places

# A term whose norm is smaller than this, relative to what it could be, is at its kink.
KINK = 1e-14
# Two zeros of norms closer than this, in parts of a norm's size, are one.
_APART = 1e-9
# Part of a norm's larger sizes that its least one is of a corner that is only a little round.
_ROUND = 1e-2
# Elements of one array of points by motions, of which several stay in the processor's cache.
_ELEMENTS = 2**14


class NormSum:
    """The sum of |R_k x| for matrices R_k."""

    def __init__(self, roots: Floats) -> None:
        """Keep the R_k, shape (k, 3, 3)."""
        self._roots = roots
        self._forms = np.swapaxes(roots, 1, 2) @ roots
        self._sizes = np.sqrt(np.trace(self._forms, axis1=1, axis2=2))
        self._stacked_roots = roots.reshape(-1, 3)
        # A matrix of full rank, as `root_of` tells it, has no kink.
        self._has_kinks = not np.abs(roots).any(axis=2).all()
        self._least = KINK * self._sizes[:, np.newaxis]
        # All that takes points to the gradients' parts, component by component, and the forms.
        self._stacked_forms = self._forms.swapaxes(0, 1).reshape(-1, 3)
        self._six = six_of(self._forms)

    def values_and_normals(self, points: Floats) -> tuple[Floats, Floats]:
        """Return the sum (m,) and its gradient (3, m); a norm at its kink is zero in both."""
        images = self._stacked_roots.dot(points).reshape(-1, 3, points.shape[1])
        norms = np.sqrt(np.einsum("kcm,kcm->km", images, images))
        if self._has_kinks:
            null = norms <= self._least * np.sqrt(squared_lengths(points))
            if null.any():
                norms[null] = 0.0
                values = np.add.reduce(norms)
                norms[null] = np.inf
                return values, self._normals(images, norms)
        return np.add.reduce(norms), self._normals(images, norms)

    def _normals(self, images: Floats, norms: Floats) -> Floats:
        images /= norms[:, np.newaxis]
        return np.asarray(self._stacked_roots.T.dot(images.reshape(-1, images.shape[2])))

    def values(self, points: Floats) -> Floats:
        """Return the sum (m,)."""
        images = self._stacked_roots.dot(points).reshape(-1, 3, points.shape[1])
        norms = np.sqrt(np.einsum("kcm,kcm->km", images, images))
        if self._has_kinks:
            norms[norms <= self._least * np.sqrt(squared_lengths(points))] = 0.0
        return np.asarray(np.add.reduce(norms))

    def derivatives(self, points: Floats, smoothing: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the sum, its gradient and Hessian; see `Gauge`."""
        total: Floats = np.zeros(points.shape[1])
        gradient: Floats = np.zeros_like(points)
        hessian: Floats = np.zeros((3, 3, points.shape[1]))
        lengths = np.sqrt(squared_lengths(points))
        for root, form, size in zip(self._roots, self._forms, self._sizes, strict=True):
            image = root @ points
            norm = np.sqrt((image * image).sum(axis=0) + (size * smoothing) ** 2)
            total += norm
            norm[norm <= KINK * size * lengths] = np.inf
            part = root.T @ (image / norm)
            gradient += part
            hessian += (form[:, :, np.newaxis] - part[:, np.newaxis] * part) / norm
        return total, gradient, hessian

    def turning(self, points: Floats, null: float = KINK) -> Turning:
        """Return values, gradients and Hessians; see `Gauge`."""
        columns = points.shape[1]
        images = self._stacked_roots.dot(points).reshape(-1, 3, columns)
        norms = np.sqrt(np.einsum("kcm,kcm->km", images, images))
        values, kinks = None, None
        if self._has_kinks:
            at_kink = norms <= null * np.outer(self._sizes, np.sqrt(squared_lengths(points)))
            if at_kink.any():
                norms[at_kink] = 0.0
                values = np.add.reduce(norms)
                norms[at_kink] = np.inf
                kinks = (self._six / np.square(self._sizes)).dot(at_kink)
        if values is None:
            values = np.add.reduce(norms)
        weights = np.divide(1.0, norms, out=norms)
        # In the place of the images, which have served.
        parts = self._stacked_forms.dot(points, out=images.reshape(-1, columns))
        parts = parts.reshape(3, -1, columns)
        parts *= weights
        matrices = self._six.dot(weights)
        normals = sum_of_terms(parts)
        parts *= np.sqrt(weights, out=weights)
        take_outer(matrices, parts)
        return Turning(values, normals, matrices, kinks)

    def corners(self) -> Corners | None:
        """Return where each norm of rank two, or nearly so, is least and no other is zero."""
        if len(self._roots) == 1:
            return None
        _, singular, axes = np.linalg.svd(self._roots)
        flat = np.flatnonzero(
            (singular[:, 1] > _APART * singular[:, 0]) & (singular[:, 2] < _ROUND * singular[:, 1])
        )
        exact = np.abs(self._roots[flat]).any(axis=2).sum(axis=1) == 2
        widths = np.where(exact, 0.0, singular[flat, 2])
        roots = singular[flat, :2, np.newaxis] * axes[flat, :2]
        kinks = axes[flat, 2]
        norms = np.linalg.norm(self._roots @ kinks.T, axis=1)
        norms[flat, np.arange(len(flat))] = 0.0
        alone = (norms > _APART * self._sizes[:, np.newaxis]).sum(axis=0) == len(self._roots) - 1
        gradients: Floats = np.zeros((3, len(flat)))
        hessians: Floats = np.zeros((3, 3, len(flat)))
        for place in np.flatnonzero(alone):
            rest = NormSum(np.delete(self._roots, flat[place], axis=0))
            _, gradient, hessian = rest.derivatives(kinks[place][:, np.newaxis], np.zeros(1))
            gradients[:, place], hessians[:, :, place] = gradient[:, 0], hessian[:, :, 0]
        return Corners.of_norms(
            kinks[alone], roots[alone], gradients[:, alone], hessians[:, :, alone], widths[alone]
        )


class PointNormSum:
    """The dissipation sum_k m_k |w_k|, w_k the velocity of support point k."""

    def __init__(self, points: Floats, limits: Floats) -> None:
        """Keep scaled points (n, 2) and limits (n,), coincident points as one."""
        points, place = np.unique(points[limits > 0.0], axis=0, return_inverse=True)
        limits = np.bincount(place.ravel(), weights=limits[limits > 0.0]).astype(np.float64)
        x, y = points.T
        ones = np.ones_like(x)
        self.points = points
        self.limits = limits
        self._x, self._y = x[:, np.newaxis], y[:, np.newaxis]
        self._reach = max(1.0, float(np.hypot(x, y).max()))
        zeros = np.zeros_like(x)
        # Velocities of the points, (2, n, 3) @ twist, and the load of unit forces at them.
        self._jacobians = np.array([[ones, zeros, -y], [zeros, ones, x]]).transpose(0, 2, 1).copy()
        self._unit_loads = limits * np.array([[ones, zeros], [zeros, ones], [-y, x]])
        # The six entries of each point's Hessian by its velocity's ey^2, ex^2 and ex ey / speed.
        self._turns = limits * np.array(
            [
                [ones, zeros, -y, zeros, zeros, y * y],
                [zeros, zeros, zeros, ones, x, x * x],
                [zeros, -ones, -x, zeros, y, 2.0 * x * y],
            ]
        ).transpose(1, 0, 2)

    def _loads(self, part: slice, twists: Floats) -> Floats:
        """Return what some of the points add to the gradient."""
        columns = twists.shape[1]
        velocities = self._jacobians[:, part].reshape(-1, 3) @ twists
        velocities = velocities.reshape(2, -1, columns)
        velocities /= self._speeds(velocities[0], velocities[1], twists)
        unit_loads = self._unit_loads[:, :, part].reshape(3, -1)
        return np.asarray(unit_loads @ velocities.reshape(-1, columns))

    def values_and_normals(self, twists: Floats) -> tuple[Floats, Floats]:
        """Return D (m,) and its gradient (3, m); a point at rest adds nothing."""
        parts = (self._loads(part, twists) for part in self._parts(twists.shape[1]))
        gradient = next(parts)
        for each in parts:
            gradient += each
        return np.einsum("im,im->m", gradient, twists), gradient

    def values(self, twists: Floats) -> Floats:
        """Return D (m,)."""
        total: Floats = np.zeros(twists.shape[1])
        for part in self._parts(twists.shape[1]):
            wx, wy = self._velocities(twists, part)
            wx *= wx
            wy *= wy
            wx += wy
            total += self.limits[part] @ np.sqrt(wx, out=wx)
        return total

    def derivatives(self, twists: Floats, smoothing: Floats) -> tuple[Floats, Floats, Floats]:
        """Return D, its gradient and Hessian; see `Gauge`."""
        columns = twists.shape[1]
        softness = np.square(self._reach * smoothing) if smoothing.any() else None
        total: Floats = np.zeros(columns)
        gradient: Floats = np.zeros_like(twists)
        hessian: Floats = np.zeros((6, columns))
        for part in self._parts(columns):
            velocities = (self._jacobians[:, part].reshape(-1, 3) @ twists).reshape(2, -1, columns)
            ex, ey = velocities
            speeds = self._speeds(ex, ey, twists, softness)
            total += self.limits[part] @ np.where(speeds < np.inf, speeds, 0.0)
            slowness = np.divide(1.0, speeds, out=speeds)
            velocities *= slowness
            gradient += self._unit_loads[:, :, part].reshape(3, -1) @ velocities.reshape(
                -1, columns
            )
            weights = _turning_weights(ex, ey, slowness)
            if softness is not None:
                weights[:2] += slowness**3 * softness
            hessian += self._turns[:, :, part].reshape(6, -1) @ weights.reshape(-1, columns)
        return total, gradient, hessian[ENTRIES]

    def turning(self, twists: Floats, null: float = KINK) -> Turning:
        """Return D, its gradient and its Hessian; see `Gauge`."""
        columns = twists.shape[1]
        gradient: Floats = np.zeros_like(twists)
        hessian: Floats = np.zeros((6, columns))
        kinks: Floats | None = None
        for part in self._parts(columns):
            velocities = (self._jacobians[:, part].reshape(-1, 3) @ twists).reshape(2, -1, columns)
            ex, ey = velocities
            speeds = self._speeds(ex, ey, twists, null=null)
            at_rest = np.isinf(speeds)
            if at_rest.any():
                found = self._forms_at_rest(part) @ at_rest
                kinks = found if kinks is None else kinks + found
            slowness = np.divide(1.0, speeds, out=speeds)
            velocities *= slowness
            gradient += self._unit_loads[:, :, part].reshape(3, -1) @ velocities.reshape(
                -1, columns
            )
            weights = _turning_weights(ex, ey, slowness)
            hessian += self._turns[:, :, part].reshape(6, -1) @ weights.reshape(-1, columns)
        return Turning(np.einsum("im,im->m", gradient, twists), gradient, hessian, kinks)

    def _forms_at_rest(self, part: slice) -> Floats:
        """Return J_k'J_k of some points, divided by their traces, as six rows (6, k)."""
        forms = self._turns[:, 0, part] + self._turns[:, 1, part]
        return np.asarray(forms / (forms[0] + forms[3] + forms[5]))

    def roots(self) -> Floats:
        """Return R_k with |R_k v| = m_k |w_k|, shape (n, 3, 3); the last row of each is zero."""
        roots = np.zeros((len(self.limits), 3, 3))
        roots[:, :2] = self.limits[:, np.newaxis, np.newaxis] * self._jacobians.swapaxes(0, 1)
        return roots

    def corners(self) -> Corners | None:
        """Return the rotations about each support point."""
        return self.corners_of(np.arange(len(self.limits)))

    def corners_of(self, which: Places) -> Corners | None:
        """Return the rotations about some of the support points: each costs a sum over all."""
        x, y = self.points[which].T
        kinks = np.array([y, -x, np.ones_like(x)]).T
        _, gradients, hessians = self.derivatives(kinks.T, np.zeros(len(kinks)))
        return Corners.of_norms(kinks, self.roots()[which, :2], gradients, hessians)

    def _parts(self, columns: int) -> Iterator[slice]:
        """Yield slices of points, so short that arrays of them by motions stay in the cache."""
        count = max(1, _ELEMENTS // max(columns, 1))
        for start in range(0, len(self.limits), count):
            yield slice(start, start + count)

    def _velocities(self, twists: Floats, part: slice) -> tuple[Floats, Floats]:
        vx, vy, omega = twists
        return vx - omega * self._y[part], vy + omega * self._x[part]

    def _speeds(
        self,
        wx: Floats,
        wy: Floats,
        twists: Floats,
        softness: Floats | None = None,
        null: float = KINK,
    ) -> Floats:
        """Return speeds, infinite for points at rest so that they add nothing."""
        speed = wx * wx
        speed += wy * wy
        if softness is not None:
            speed += softness
        size = np.abs(twists)
        least = null * self._reach
        # The least of all speeds is cheaper than one bound for each, and is most often enough.
        if speed.min(initial=np.inf) <= (least * size.max(initial=0.0)) ** 2:
            speed[speed <= np.square(least * size.max(axis=0))] = np.inf
        return np.sqrt(speed, out=speed)


def _turning_weights(ex: Floats, ey: Floats, slowness: Floats) -> Floats:
    """Return ey^2, ex^2 and ex ey times the slowness, shape (3, ...).

    A speed's Hessian by its velocity is [ey^2, -ex ey; -ex ey, ex^2] / speed, (ex, ey) of unit
    length, if nothing is smoothed.
    """
    weights = np.empty((3, *ex.shape))
    np.multiply(ey, ey, out=weights[0])
    np.multiply(ex, ex, out=weights[1])
    np.multiply(ex, ey, out=weights[2])
    weights *= slowness
    return weights
