"""The dissipation D(v) of a sliding body as a sum of norms, with its derivatives and facets.

Both the sums of quadratic-form norms and support points speak this one language to
`gauge_inverse`. All arrays are scaled columns.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from limit_surface_ros.surface.corners import Corners
from limit_surface_ros.surface.plane_minimum import Gauge

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats

# A term whose norm is smaller than this, relative to what it could be, is at its kink.
KINK = 1e-14


class DissipationTerms(Gauge, Protocol):
    """A sum of norms D(v) = sum_k |R_k v|, each smoothed to sqrt(|R_k v|^2 + (e size)^2)."""

    def gradient(self, twists: Floats) -> Floats:
        """Return the gradient (3, m) of D; a term at its kink adds nothing."""
        ...

    def corners(self) -> Corners | None:
        """Return the motions at which one term is at rest: facets of the set of loads."""
        ...


class FormTerms:
    """D(v) = sum_k sqrt(v' B_k v) with B_k = R_k' R_k."""

    def __init__(self, roots: Floats) -> None:
        """Keep the factors R_k, shape (k, 3, 3)."""
        self._roots = roots
        self._forms = np.swapaxes(roots, 1, 2) @ roots
        self._sizes = np.sqrt(np.trace(self._forms, axis1=1, axis2=2))

    def gradient(self, twists: Floats) -> Floats:
        """Return the gradient (3, m) of D; a term at its kink adds nothing."""
        length = np.sqrt((twists * twists).sum(axis=0))
        total: Floats = np.zeros_like(twists)
        for root, size in zip(self._roots, self._sizes, strict=True):
            image = root @ twists
            norm = np.sqrt((image * image).sum(axis=0))
            norm[norm <= KINK * size * length] = np.inf
            total += root.T @ (image / norm)
        return total

    def derivatives(self, twists: Floats, smoothing: Floats) -> tuple[Floats, Floats, Floats]:
        """Return D, its gradient and Hessian; see `Gauge`."""
        total: Floats = np.zeros(twists.shape[1])
        gradient: Floats = np.zeros_like(twists)
        hessian: Floats = np.zeros((3, 3, twists.shape[1]))
        for root, form, size in zip(self._roots, self._forms, self._sizes, strict=True):
            image = root @ twists
            norm = np.sqrt((image * image).sum(axis=0) + (size * smoothing) ** 2)
            total += norm
            norm[norm <= KINK * size * np.sqrt((twists * twists).sum(axis=0))] = np.inf
            pull = root.T @ (image / norm)
            gradient += pull
            hessian += (form[:, :, np.newaxis] - pull[:, np.newaxis] * pull) / norm
        return total, gradient, hessian

    def corners(self) -> Corners | None:
        """Return those of each term of rank two whose motion at rest is no other term's."""
        flat = np.abs(self._roots).any(axis=2).sum(axis=1) == 2
        roots = self._roots[flat][:, :2]
        kinks = np.cross(roots[:, 0], roots[:, 1])
        kinks /= np.linalg.norm(kinks, axis=1, keepdims=True)
        moving = np.linalg.norm(self._roots @ kinks.T, axis=1) > 1e-9 * self._sizes[:, np.newaxis]
        alone = moving.sum(axis=0) == len(self._roots) - 1
        kinks, roots = kinks[alone], roots[alone]
        _, gradients, hessians = self.derivatives(kinks.T, np.zeros(len(kinks)))
        return Corners.of_norms(kinks, roots, gradients, hessians)


class PointTerms:
    """D(v) = sum_k m_k |w_k|, w_k the velocity of support point k."""

    def __init__(self, points: Floats, limits: Floats) -> None:
        """Keep scaled points (n, 2) and limits (n,), coincident points as one."""
        points, place = np.unique(points[limits > 0.0], axis=0, return_inverse=True)
        limits = np.bincount(place.ravel(), weights=limits[limits > 0.0]).astype(np.float64)
        x, y = points.T
        ones = np.ones_like(x)
        self._limits = limits
        self._x, self._y = x[:, np.newaxis], y[:, np.newaxis]
        self._reach = np.maximum(np.hypot(x, y), 1.0)[:, np.newaxis]
        self._first_moments = limits * np.array([ones, x, y])
        self._second_moments = limits * np.array([ones, x, y, x * x, x * y, y * y])

    def gradient(self, twists: Floats) -> Floats:
        """Return the gradient (3, m) of D; a point at rest adds nothing."""
        wx, wy = self._velocities(twists)
        speed = np.sqrt(wx * wx + wy * wy)
        speed[speed <= KINK * self._reach * np.abs(twists).max(axis=0)] = np.inf
        wx /= speed
        wy /= speed
        return self._load(wx, wy)

    def derivatives(self, twists: Floats, smoothing: Floats) -> tuple[Floats, Floats, Floats]:
        """Return D, its gradient and Hessian; see `Gauge`."""
        ex, ey = self._velocities(twists)
        smooth = bool(smoothing.any())
        softness = np.square(self._reach * smoothing) if smooth else 0.0
        speed = np.sqrt(ex * ex + ey * ey + softness)
        total = self._limits @ speed
        speed[speed <= KINK * self._reach * np.abs(twists).max(axis=0)] = np.inf
        slowness = 1.0 / speed
        ex *= slowness
        ey *= slowness
        gradient = self._load(ex, ey)
        # The Hessian of a speed is [ey^2, -ex ey; -ex ey, ex^2] / speed where nothing is smoothed.
        across = self._second_moments @ (slowness * ex * ey)
        in_x = self._second_moments @ (slowness * ey * ey)
        in_y = self._second_moments @ (slowness * ex * ex)
        if smooth:
            rounding = self._second_moments @ (slowness**3 * softness)
            in_x += rounding
            in_y += rounding
        xx, xy, yy = in_x[0], -across[0], in_y[0]
        xt, yt = -in_x[2] - across[1], in_y[1] + across[2]
        tt = in_x[5] + 2.0 * across[4] + in_y[3]
        return total, gradient, np.array([[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]])

    def corners(self) -> Corners | None:
        """Return the rotations about each support point."""
        x, y = self._x[:, 0], self._y[:, 0]
        zeros, ones = np.zeros_like(x), np.ones_like(x)
        kinks = np.array([y, -x, ones]).T
        jacobians = np.array([[ones, zeros, -y], [zeros, ones, x]])
        _, gradients, hessians = self.derivatives(kinks.T, np.zeros(len(kinks)))
        roots = (self._limits * jacobians).transpose(2, 0, 1)
        return Corners.of_norms(kinks, roots, gradients, hessians)

    def _velocities(self, twists: Floats) -> tuple[Floats, Floats]:
        vx, vy, omega = twists
        return vx - omega * self._y, vy + omega * self._x

    def _load(self, ex: Floats, ey: Floats) -> Floats:
        """Return the load (3, m) of forces m_k (ex, ey), shape (n, m), at the points."""
        fx = self._first_moments @ ex
        fy = self._first_moments @ ey
        return np.array([fx[0], fy[0], fy[1] - fx[2]])
