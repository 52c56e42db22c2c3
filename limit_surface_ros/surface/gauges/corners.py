# SPDX-License-Identifier: Apache-2.0
"""Corners of a surface, where many normals meet, and the nearest one to a given normal."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from limit_surface_ros.checks import Bools, Floats, Places

# Relative width of the rim that counts as part of a cone of normals.
RIM = 1e-12
_NO_POWER = 1e-60
# Elements of one array of normals by corners, of which several stay in the processor's cache.
_ELEMENTS = 2**14
# Curvature below which a surface counts as flat beside a corner.
FLAT = 1e-3
_STEPS = 30


@dataclass(frozen=True)
class Corners:
    """Opposite points x_k and -x_k where one norm |R_k x| of a convex sum is all but zero.

    There that norm has any gradient R_k' y with |y| <= 1 beside the gradient c_k of the rest, so
    that the normals at x_k fill a cone over an ellipse. For a dissipation, x_k is the rotation
    about a support point and the ellipse is a facet of the set of loads.

    Where the norm is not quite zero, as with a matrix that is nearly of rank two, the corner is
    round: beside it the norm is sqrt(|y|^2 + width^2) in y = R_k (x - x_k).

    Attributes:
        points: x_k, scaled so that c_k.x_k = 1, shape (q, 3).
        inverses: G_k with G_k R_k' = 1, shape (q, 2, 3).
        centres: G_k c_k, shape (q, 2).
        curvatures: G_k H_k G_k' with the Hessian H_k of the rest, shape (q, 2, 2).
        widths: |R_k x_k|, shape (q,).
    """

    points: Floats
    inverses: Floats
    centres: Floats
    curvatures: Floats
    widths: Floats

    @classmethod
    def of_norms(
        cls,
        points: Floats,
        roots: Floats,
        gradients: Floats,
        hessians: Floats,
        widths: Floats | None = None,
    ) -> Corners | None:
        """Return the corners of a sum at the zeros of its norms, None if there are none.

        Args:
            points: Zeros of the norms, shape (q, 3).
            roots: R_k of these norms, shape (q, 2, 3).
            gradients: Gradients of the rest at the points, shape (3, q).
            hessians: Hessians of the rest at the points, shape (3, 3, q).
            widths: The norms at the points, shape (q,); all zero if not given.
        """
        if len(points) == 0:
            return None
        inverses = np.asarray(np.linalg.pinv(roots), dtype=np.float64).transpose(0, 2, 1)
        powers = (gradients.T * points).sum(axis=1)
        return cls(
            points / powers[:, np.newaxis],
            inverses,
            np.einsum("qij,jq->qi", inverses, gradients),
            inverses @ np.moveaxis(hessians, -1, 0) @ np.swapaxes(inverses, 1, 2),
            np.zeros(len(points)) if widths is None else widths / powers,
        )

    def within(self, normals: Floats) -> tuple[Bools, Places]:
        """Tell which normals (3, m) lie within the cone of a sharp corner, and of which one.

        Without a quotient: in |G_k n - c_k (n.x_k)| <= n.x_k all is linear in the normal, and one
        product serves all corners. `nearest` costs three times as much.
        """
        count, columns = len(self.points), normals.shape[1]
        parts = self._linear.dot(normals).reshape(3, count, columns)
        np.square(parts, out=parts)
        room = parts[2]
        room -= parts[0]
        room -= parts[1]
        # The rim belongs to the cone; no two cones meet but there.
        which = room.argmax(axis=0)
        inside = np.maximum.reduce(room) >= 0.0
        return inside, which

    @cached_property
    def _linear(self) -> Floats:
        """The rows of G_k - c_k x_k', by component, and of x_k, shape (3 q, 3)."""
        rows = self.inverses - self.centres[:, :, np.newaxis] * self.points[:, np.newaxis]
        # Nothing is within the cone of a corner that is round.
        along = np.where(self.widths > 0.0, 0.0, 1.0 + RIM)[:, np.newaxis] * self.points
        return np.concatenate([rows[:, 0], rows[:, 1], along])

    def nearest(self, normals: Floats) -> tuple[Floats, Floats]:
        """Return how far normals lie from their nearest corner's cone, and the point to expect.

        Args:
            normals: Of any size, shape (3, m).

        Returns:
            Distances (m,) from the axis of the cone in its own radii, at most 1 within it; and
            points (3, m), not scaled: exact within the cone, of second order beyond, and about
            round corners, of which none is within the cone.
        """
        distance, points, which = self._cones(normals)
        wide = self.widths[which] > 0.0
        beyond = np.flatnonzero((distance > 1.0) | wide)
        if len(beyond):
            points[:, beyond] += self._offsets(
                which[beyond], normals.take(beyond, axis=1), distance[beyond]
            )
            distance[wide] = np.maximum(distance[wide], 1.0 + 2.0 * RIM)
        return distance, points

    def _cones(self, normals: Floats) -> tuple[Floats, Floats, Places]:
        """Return distances as in `nearest`, the corners themselves (3, m), and which they are."""
        distance: Floats = np.empty(normals.shape[1])
        points: Floats = np.empty_like(normals)
        which: Places = np.empty(normals.shape[1], dtype=np.intp)
        count = max(1, _ELEMENTS // len(self.points))
        for start in range(0, len(which), count):
            block = slice(start, start + count)
            columns = normals[:, block]
            powers = self.points @ columns
            # A normal without power is infinitely far: a large number will do, and no warning.
            powers[np.abs(powers) < _NO_POWER] = _NO_POWER
            np.divide(1.0, powers, out=powers)
            squares = self.inverses[:, 0] @ columns
            second = self.inverses[:, 1] @ columns
            for arms, centre in ((squares, self.centres[:, :1]), (second, self.centres[:, 1:])):
                arms *= powers
                arms -= centre
                arms *= arms
            squares += second
            nearest = squares.argmin(axis=0)
            chosen = nearest, np.arange(len(nearest))
            np.sqrt(squares[chosen], out=distance[block])
            points[:, block] = self.points.T.take(nearest, axis=1) * np.sign(powers[chosen])
            which[block] = nearest
        # The rim belongs to the cone.
        distance[distance <= 1.0 + RIM] = 1.0
        return distance, points, which

    def _offsets(self, which: Places, normals: Floats, distance: Floats) -> Floats:
        """Return the steps (3, m) from corners to the points to expect beyond their cones.

        To second order the gauge beside a corner is |y| - q.y + y'My/2 in y = R_k (x - x_k), which
        is least near y along q; see `reach` for the way.
        """
        corners = self.points.T.take(which, axis=1)
        powers = (corners * normals).sum(axis=0)
        powers[np.abs(powers) < _NO_POWER] = _NO_POWER
        normals = normals / powers
        inverses = np.moveaxis(self.inverses, 0, -1).take(which, axis=2)
        q = (inverses * normals).sum(axis=1) - self.centres.T.take(which, axis=1)
        matrices = np.moveaxis(self.curvatures, 0, -1).take(which, axis=2)
        square = (q * q).sum(axis=0)
        square[square == 0.0] = _NO_POWER
        curvature = ((matrices * q).sum(axis=1) * q).sum(axis=0) / square + FLAT
        lengths = np.sqrt(square)
        y = (distance - 1.0) / curvature
        widths = self.widths.take(which)
        for column in np.flatnonzero(widths):
            y[column] = reach(
                float(lengths[column]), float(curvature[column]), float(widths[column])
            )
        y = q * (y / lengths)
        steps = (inverses * y[:, np.newaxis]).sum(axis=0)
        steps -= corners * (normals * steps).sum(axis=0)
        return np.asarray(steps * np.sign(powers))


def reach(distance: float, curvature: float, width: float) -> float:
    """Return the t above 0 with t / sqrt(t^2 + width^2) + curvature t = distance.

    That is how far from a round corner the gradient of norm and rest is the one wanted.
    """
    # Newton's method rises to the root of a concave function from any place below.
    t = max(0.0, (distance - 1.0) / curvature)
    for _ in range(_STEPS):
        norm = sqrt(t * t + width * width)
        step = (distance - t / norm - curvature * t) / (width * width / norm**3 + curvature)
        t += step
        if step <= 1e-3 * t:
            break
    return t
