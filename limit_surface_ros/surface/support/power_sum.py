# SPDX-License-Identifier: Apache-2.0
"""The inverse of a sum of powers, twist to load, chosen by its exponents and ranks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.surface.gauges.norm_sum import FormTerms
from limit_surface_ros.surface.gauges.one_power_sum import OnePowerSum
from limit_surface_ros.surface.gauges.power_scale import power_scale
from limit_surface_ros.surface.gauges.power_sum import PowerGauge
from limit_surface_ros.surface.linalg import even_directions, root_of
from limit_surface_ros.surface.support.one_by_one import OneByOne
from limit_surface_ros.surface.support.solvers import (
    ConvexInverse,
    FramedInverse,
    PeakInverse,
    round_frame,
)
from limit_surface_ros.surface.support.tabulated import TabulatedInverse

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.support.solvers import Inverse

_CONVEX_STARTS = 200
_STARTS = 500
# Starts along the ridge that a term with a low exponent raises where its form is small.
_RIDGE_STARTS = 48
# A spike is the answer if nothing beats it by more than rounding.
_ROUNDING = 1e-12


class EllipsoidInverse:
    """The load of most power on one ellipsoid, f'A f = 1."""

    def __init__(self, root: Floats) -> None:
        """Keep the inverse of the factor R of A = R'R, shape (3, 3)."""
        self._inverse_root = np.linalg.inv(root)

    def solve(self, normals: Floats) -> tuple[Floats, Floats]:
        """Return the points (3, m) of most power for vectors (3, m), and that power (m,)."""
        sphere = self._inverse_root.T @ normals
        power = np.sqrt((sphere * sphere).sum(axis=0))
        return self._inverse_root @ (sphere / power), power

    def starts_of_one(self, normal: Floats) -> Floats:
        """Return the answer itself for one vector (3,), shape (1, 3)."""
        return np.asarray(self.solve(normal[:, np.newaxis])[0].T)


def power_sum_inverse(roots: Floats, exponents: Floats) -> Inverse:
    """Return the map from twists to loads of most power on sum_i |R_i f|^(2 p_i) = 1.

    Args:
        roots: R_i, of which some rise with any load, shape (k, 3, 3).
        exponents: p_i, shape (k,).
    """
    if len(roots) == 1:
        return EllipsoidInverse(roots[0])
    if (exponents == 0.5).all():
        norms = FormTerms(roots)
        climb = ConvexInverse(norms, even_directions(_CONVEX_STARTS).T, norms.corners())
        return TabulatedInverse(norms, OneByOne(climb, OnePowerSum(roots, exponents)))
    frame = round_frame(PowerGauge(roots, exponents))
    return FramedInverse(frame, _inverse_of_round(roots @ frame, exponents))


def _inverse_of_round(roots: Floats, exponents: Floats) -> Inverse:
    """Return the inverse for a surface about as wide in all directions."""
    gauge = PowerGauge(roots, exponents)
    if (exponents >= 0.5).all():
        climb = ConvexInverse(gauge, even_directions(_CONVEX_STARTS).T, gauge.corners())
        return TabulatedInverse(gauge, OneByOne(climb, OnePowerSum(roots, exponents)))
    peaks = PeakInverse(gauge, _starts(roots, exponents))
    climb_all = OneByOne(peaks, OnePowerSum(roots, exponents), several=True)
    summits = TabulatedInverse(gauge, climb_all, convex=False)
    ranks = np.abs(roots).any(axis=2).sum(axis=1)
    low = exponents <= 0.5
    spikes = [np.cross(root[0], root[1]) for root in roots[low & (ranks == 2)]]
    planes = [np.linalg.svd(root)[2][1:] for root in roots[low & (ranks == 1)]]
    if not spikes and not planes:
        return summits
    creases = [(plane, _within_plane(roots, exponents, plane)) for plane in planes]
    return SpikedInverse(summits, _on_surface(roots, exponents, spikes), creases)


class SpikedInverse:
    """Adds to an inverse the spikes and creases of a sum with low exponents.

    A load that a term of exponent below 1/2 does not see is a local answer for every twist, as
    sharp as a needle or a blade: no climb finds it, but its place is known.
    """

    def __init__(
        self, smooth: Inverse, spikes: Floats, creases: list[tuple[Floats, Inverse]]
    ) -> None:
        """Keep the parts.

        Args:
            smooth: The inverse for the surface off its spikes and creases.
            spikes: Points of the surface, shape (3, c); their opposites count as well.
            creases: Orthonormal bases (2, 3) of planes whose cut with the surface is a crease,
                with the inverse within each plane, in (3, m) with the last component zero.
        """
        self._smooth = smooth
        self._spikes = spikes
        self._creases = creases

    def solve(self, normals: Floats) -> tuple[Floats, Floats]:
        """Return the points (3, m) of most power for vectors (3, m), and that power (m,)."""
        points, power = self._smooth.solve(normals)
        for plane, inverse in self._creases:
            within = np.zeros_like(normals)
            within[:2] = plane @ normals
            size = np.abs(within).max(axis=0)
            columns = np.flatnonzero(size > _ROUNDING * np.abs(normals).max(axis=0))
            if len(columns) == 0:
                continue
            found, found_power = inverse.solve(within[:, columns] / size[columns])
            found_power *= size[columns]
            better = found_power >= power[columns] * (1.0 - _ROUNDING)
            points[:, columns[better]] = plane.T @ found[:2, better]
            power[columns[better]] = found_power[better]
        if self._spikes.shape[1]:
            powers = self._spikes.T @ normals
            best = np.abs(powers).argmax(axis=0)
            signed = powers[best, np.arange(len(best))]
            better = np.abs(signed) >= power * (1.0 - _ROUNDING)
            points[:, better] = (self._spikes[:, best] * np.sign(signed))[:, better]
            power = np.where(better, np.abs(signed), power)
        return points, power

    def starts_of_one(self, _normal: Floats) -> Floats:
        """Return no start: a spike may be the answer."""
        return np.empty((0, 3))


def _on_surface(roots: Floats, exponents: Floats, directions: list[Floats]) -> Floats:
    """Return the points (3, d) of the surface in the directions."""
    points = np.array(directions).reshape(-1, 3).T
    images = roots @ points
    forms = np.einsum("kcm,kcm->km", images, images)
    sizes = np.square(roots).sum(axis=(1, 2))[:, np.newaxis] * (points * points).sum(axis=0)
    forms[forms <= 1e-28 * sizes] = 0.0
    found: Floats = points / power_scale(exponents).load_factors(forms)
    return found


def _within_plane(roots: Floats, exponents: Floats, plane: Floats) -> Inverse:
    """Return the inverse for loads in a plane, whose third component any load makes worse."""
    forms = np.zeros((len(roots), 3, 3))
    cut = roots @ plane.T
    forms[:, :2, :2] = np.swapaxes(cut, 1, 2) @ cut
    limiting = np.trace(forms, axis1=1, axis2=2) > 1e-14 * np.square(roots).sum(axis=(1, 2))
    forms, exponents = forms[limiting], exponents[limiting]
    forms[:, 2, 2] = np.trace(forms, axis1=1, axis2=2)
    return power_sum_inverse(np.array([root_of(form) for form in forms]), exponents)


def _starts(roots: Floats, exponents: Floats) -> Floats:
    """Return directions (3, d) over half the sphere, and along the ridges of low exponents."""
    parts = [even_directions(2 * _STARTS)[_STARTS:]]
    angle = np.pi * np.arange(_RIDGE_STARTS) / _RIDGE_STARTS
    steepest = []
    for root in roots[exponents < 1.0]:
        _, _, axes = np.linalg.svd(root)
        parts += [np.outer(np.cos(angle), axes[1]) + np.outer(np.sin(angle), axes[2]), axes]
        steepest.append(axes[0])
    for index, first in enumerate(steepest):
        for second in steepest[:index]:
            crossing = np.cross(first, second)
            length = np.linalg.norm(crossing)
            if length > 1e-9:
                parts.append(crossing[np.newaxis] / length)
    starts: Floats = np.concatenate(parts).T
    return starts
