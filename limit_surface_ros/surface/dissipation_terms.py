"""The dissipation D(v) of a sliding body as a sum of norms, with its derivatives and facets.

Both the sums of quadratic-form norms and support points speak this one language to
`dissipation_inverse`. All arrays are scaled columns.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from limit_surface_ros.surface.plane_minimum import Gauge

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats

# A term whose norm is smaller than this, relative to what it could be, is at its kink.
KINK = 1e-14
# Relative width of the rim that counts as part of a facet.
_RIM = 1e-12
_NO_POWER = 1e-100
# Curvature below which a dissipation counts as flat beside a kink.
_FLAT = 1e-3


class DissipationTerms(Gauge, Protocol):
    """A sum of norms D(v) = sum_k |R_k v|, each smoothed to sqrt(|R_k v|^2 + (e size)^2)."""

    def gradient(self, twists: Floats) -> Floats:
        """Return the gradient (3, m) of D; a term at its kink adds nothing."""
        ...

    def facets(self) -> Facets:
        """Return the facets of the set of loads."""
        ...


@dataclass(frozen=True)
class Facets:
    """Flat parts of the set of loads, one pair for each norm with one motion at rest.

    At its kink v_k the norm gives any load of an ellipse, R_k' y with |y| <= 1, beside the load
    c_k of all other terms.

    Attributes:
        twists: v_k, scaled so that D(v_k) = 1, shape (q, 3).
        inverses: G_k with G_k R_k' = 1, shape (q, 2, 3).
        centres: G_k c_k, shape (q, 2).
        bends: G_k H_k G_k' with the Hessian H_k of all other terms, shape (q, 2, 2).
    """

    twists: Floats
    inverses: Floats
    centres: Floats
    bends: Floats

    @classmethod
    def of_terms(cls, kinks: Floats, roots: Floats, terms: DissipationTerms) -> Facets:
        """Return the facets of `terms` at the twists `kinks` (q, 3) of norms R_k (q, 2, 3)."""
        loads = terms.gradient(kinks.T).T
        twists = kinks / (loads * kinks).sum(axis=1)[:, np.newaxis]
        inverses = np.asarray(np.linalg.pinv(roots), dtype=np.float64).transpose(0, 2, 1)
        hessians = np.moveaxis(terms.derivatives(twists.T, np.zeros(len(twists)))[2], -1, 0)
        return cls(
            twists,
            inverses,
            np.einsum("qij,qj->qi", inverses, loads),
            inverses @ hessians @ np.swapaxes(inverses, 1, 2),
        )

    def __len__(self) -> int:
        """Return the number of pairs of facets."""
        return len(self.twists)

    def nearest(self, loads: Floats) -> tuple[Floats, Floats]:
        """Return how far loads lie from their nearest facet, and the twist to expect there.

        Args:
            loads: Of any size, shape (3, m).

        Returns:
            Distances (m,) from the facet's centre in its own radii, at most 1 for a load on it;
            and twists (3, m): exact on the facet, of second order in the distance beyond.
        """
        factors = self.twists @ loads
        # A load without power is infinitely far: a large number will do, and no warning.
        factors[np.abs(factors) < _NO_POWER] = _NO_POWER
        first = (self.inverses[:, 0] @ loads) / factors - self.centres[:, :1]
        second = (self.inverses[:, 1] @ loads) / factors - self.centres[:, 1:]
        squares = first * first + second * second
        which = squares.argmin(axis=0)
        columns = np.arange(loads.shape[1])
        distance = np.sqrt(squares[which, columns])
        # A load on the rim has the facet's motion in its normal cone, too.
        distance[distance <= 1.0 + _RIM] = 1.0
        q = np.array([first[which, columns], second[which, columns]])
        # |y| - q.y + y'My/2 in y = R_k (v - v_k) is least near y along q, this far out:
        bend = np.einsum("im,mij,jm->m", q, self.bends[which], q) + _FLAT * distance**2
        y = q * np.maximum((distance - 1.0) * distance / bend, 0.0)
        move = np.einsum("mij,im->jm", self.inverses[which], y)
        kink = self.twists[which].T
        power = factors[which, columns]
        twists = np.sign(power) * (kink + move - kink * ((loads * move).sum(axis=0) / power))
        return distance, twists


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

    def facets(self) -> Facets:
        """Return the facets: of each term of rank two whose motion at rest is no other term's."""
        flat = np.abs(self._roots).any(axis=2).sum(axis=1) == 2
        roots = self._roots[flat][:, :2]
        kinks = np.cross(roots[:, 0], roots[:, 1])
        kinks /= np.linalg.norm(kinks, axis=1, keepdims=True)
        moving = np.linalg.norm(self._roots @ kinks.T, axis=1) > 1e-9 * self._sizes[:, np.newaxis]
        alone = moving.sum(axis=0) == len(self._roots) - 1
        return Facets.of_terms(kinks[alone], roots[alone], self)


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

    def facets(self) -> Facets:
        """Return the facets: one pair for each support point, turned about."""
        x, y = self._x[:, 0], self._y[:, 0]
        zeros, ones = np.zeros_like(x), np.ones_like(x)
        kinks = np.array([y, -x, ones]).T
        jacobians = np.array([[ones, zeros, -y], [zeros, ones, x]])
        return Facets.of_terms(kinks, (self._limits * jacobians).transpose(2, 0, 1), self)

    def _velocities(self, twists: Floats) -> tuple[Floats, Floats]:
        vx, vy, omega = twists
        return vx - omega * self._y, vy + omega * self._x

    def _load(self, ex: Floats, ey: Floats) -> Floats:
        """Return the load (3, m) of forces m_k (ex, ey), shape (n, m), at the points."""
        fx = self._first_moments @ ex
        fy = self._first_moments @ ey
        return np.array([fx[0], fy[0], fy[1] - fx[2]])
