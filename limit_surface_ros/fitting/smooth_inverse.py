# SPDX-License-Identifier: Apache-2.0
"""Motions of loads under a smooth dissipation model, and how they change with the model.

The motion of a load f is where D is least on the plane f . v = 1. With a basis (z1, z2) of the
directions in that plane and v = v0 + y1 z1 + y2 z2, each term is the root of a quadratic in y, and
D(y) a smooth convex function of two variables: Newton's method with backtracking, all loads at
once, warm-started where the model has changed a little.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats

_ITERATIONS = 60
_HALVINGS = 40
# Newton decrement, relative to D, below which one more step is exact to rounding.
_NEAR = 1e-9
# Relative rise of D that is rounding and none to step back from.
_ROUNDING = 1e-13
# Positions of the six distinct entries of a symmetric 3x3 matrix.
_ROWS, _COLUMNS = np.triu_indices(3)


class SmoothInverse:
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

    def solve(self, matrices: Floats) -> None:
        """Find the motions under the model with these matrices, shape (k, 3, 3)."""
        forms = (matrices[:, _ROWS, _COLUMNS] @ self._lift).reshape(len(matrices), 6, -1)
        _descend(forms, self._place)
        self.speeds = _speeds(forms, self._place)
        self.dissipation = self.speeds.sum(axis=0)
        self._hessian = np.stack(_derivatives(forms, self._place, self.speeds)[1])
        base, first, second = self.frame
        self.motions = base + self._place[0] * first + self._place[1] * second

    def adjoint(self, pull: Floats) -> Floats:
        """Return u with dJ = u . d(grad D) for a cost whose slope along the motion is `pull`.

        From the condition that D be least: d(grad D) + H dv vanishes in the plane.

        Args:
            pull: dJ/dv, shape (3, n).

        Returns:
            Shape (3, n).
        """
        p1 = np.einsum("cn,cn->n", pull, self.frame[1])
        p2 = np.einsum("cn,cn->n", pull, self.frame[2])
        h11, h12, h22 = self._hessian
        determinant = h11 * h22 - h12 * h12
        u1 = (h12 * p2 - h22 * p1) / determinant
        u2 = (h12 * p1 - h11 * p2) / determinant
        return np.asarray(u1 * self.frame[1] + u2 * self.frame[2])


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
