# SPDX-License-Identifier: Apache-2.0
"""Support points of sums of powers: the solver for their exponents and ranks."""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.surface.gauges.norm_sum import NormSum
from limit_surface_ros.surface.gauges.power_scale import power_scale
from limit_surface_ros.surface.gauges.power_sum import PowerSumGauge
from limit_surface_ros.surface.gauges.scalar import NormSumScalar, PowerSumScalar
from limit_surface_ros.surface.linalg import NULL_TOLERANCE, even_directions, root_of
from limit_surface_ros.surface.support.small_batch import SmallBatch
from limit_surface_ros.surface.support.solvers import (
    ConvexNewton,
    InFrame,
    PeakSearch,
    SupportSolver,
    round_frame,
)
from limit_surface_ros.surface.support.tabulated import Tabulated

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.gauges.gauge import ScalarGauge, Vector

_CONVEX_STARTS = 200
_STARTS = 500
# Starts along the ridge that a term with a low exponent raises where its form is small.
_RIDGE_STARTS = 48
# A spike is the answer if nothing beats it by more than rounding.
_ROUNDING = 1e-12
# Vectors up to which several climbs each, one after another, are quicker than all at once.
_FEW_WITH_PEAKS = 8


def is_norm(exponents: Floats) -> bool:
    """Tell whether the load factor of a power sum is the plain sum of |R_i f|."""
    return len(exponents) == 1 or bool((exponents == 0.5).all())


def gauge_of(roots: Floats, exponents: Floats) -> NormSum | PowerSumGauge:
    """Return the load factor of sum_i |R_i f|^(2 p_i) as a gauge."""
    return NormSum(roots) if is_norm(exponents) else PowerSumGauge(roots, exponents)


def scalar_gauge_of(roots: Floats, exponents: Floats) -> ScalarGauge:
    """Return the same for one load at a time."""
    return NormSumScalar(roots) if is_norm(exponents) else PowerSumScalar(roots, exponents)


def power_sum_solver(roots: Floats, exponents: Floats) -> SupportSolver:
    """Return the solver for the loads of maximum dissipation on sum_i |R_i f|^(2 p_i) = 1.

    Args:
        roots: R_i, of which some rise with any load, shape (k, 3, 3).
        exponents: p_i, shape (k,).
    """
    if len(roots) == 1:
        return Ellipsoid(roots[0])
    if is_norm(exponents):
        return _convex_solver(NormSum(roots), NormSumScalar(roots))
    frame = round_frame(PowerSumGauge(roots, exponents))
    roots = roots @ frame
    gauge, scalar = PowerSumGauge(roots, exponents), PowerSumScalar(roots, exponents)
    if (exponents >= 0.5).all():
        return InFrame(frame, _convex_solver(gauge, scalar))
    search = PeakSearch(gauge, _starts(roots, exponents))
    peaks = SmallBatch(search, scalar, few=_FEW_WITH_PEAKS)
    tabulated = Tabulated(gauge, peaks, scalar=scalar, convex=False)
    return InFrame(frame, _with_spikes(tabulated, roots, exponents))


def _convex_solver(gauge: NormSum | PowerSumGauge, scalar: ScalarGauge) -> SupportSolver:
    corners = gauge.corners()
    newton = ConvexNewton(gauge, even_directions(_CONVEX_STARTS).T, corners)
    small = SmallBatch(newton, scalar, corners)
    return Tabulated(gauge, small, scalar=scalar, corners=corners)


class Ellipsoid(SupportSolver):
    """Support points of one ellipsoid, f'A f = 1."""

    def __init__(self, root: Floats) -> None:
        """Keep the inverse of the factor R of A = R'R, shape (3, 3)."""
        self._inverse_root = np.linalg.inv(root)
        self._inverse: list[list[float]] = (self._inverse_root @ self._inverse_root.T).tolist()

    def solve(self, normals: Floats) -> tuple[Floats, Floats]:
        """Return support points and powers; see `SupportSolver`."""
        sphere = self._inverse_root.T @ normals
        power = np.sqrt((sphere * sphere).sum(axis=0))
        return self._inverse_root @ (sphere / power), power

    def solve_scalar(self, normal: Vector) -> Vector | None:
        """Return one support point in plain floats; see `SupportSolver`."""
        x, y, z = normal
        px, py, pz = (a * x + b * y + c * z for a, b, c in self._inverse)
        square = px * x + py * y + pz * z
        if not square > 0.0:
            return None
        power = sqrt(square)
        return px / power, py / power, pz / power


def _with_spikes(smooth: SupportSolver, roots: Floats, exponents: Floats) -> SupportSolver:
    """Return a solver of a sum in which the null spaces of terms of low exponent count too."""
    ranks = np.abs(roots).any(axis=2).sum(axis=1)
    low = exponents <= 0.5
    spikes = [np.cross(root[0], root[1]) for root in roots[low & (ranks == 2)]]
    planes = [np.linalg.svd(root)[2][1:] for root in roots[low & (ranks == 1)]]
    if not spikes and not planes:
        return smooth
    creases = [(plane, _within_plane(roots, exponents, plane)) for plane in planes]
    return WithSpikes(smooth, _on_surface(roots, exponents, spikes), creases)


class WithSpikes(SupportSolver):
    """Adds to a solver the spikes and creases of a sum with low exponents.

    A load in the null space of a term of exponent below 1/2 is a local answer for every twist, as
    sharp as a needle or a blade: no climb finds it, but its place is known.
    """

    def __init__(
        self, smooth: SupportSolver, spikes: Floats, creases: list[tuple[Floats, SupportSolver]]
    ) -> None:
        """Keep the parts.

        Args:
            smooth: The solver for the surface off its spikes and creases.
            spikes: Points of the surface, shape (3, c); their opposites count as well.
            creases: Orthonormal bases (2, 3) of planes whose cut with the surface is a crease,
                with the solver within each plane, in (3, m) with the last component zero.
        """
        self._smooth = smooth
        self._spikes = spikes
        self._creases = creases

    def solve(self, normals: Floats) -> tuple[Floats, Floats]:
        """Return support points and powers; see `SupportSolver`."""
        points, power = self._smooth.solve(normals)
        for plane, solver in self._creases:
            within = np.zeros_like(normals)
            within[:2] = plane @ normals
            size = np.abs(within).max(axis=0)
            columns = np.flatnonzero(size > _ROUNDING * np.abs(normals).max(axis=0))
            if len(columns) == 0:
                continue
            found, found_power = solver.solve(within[:, columns] / size[columns])
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

    def expect(self, count: float) -> None:
        """Make what pays if so many normals come; see `SupportSolver`."""
        self._smooth.expect(count)
        for _, solver in self._creases:
            solver.expect(count)


def _on_surface(roots: Floats, exponents: Floats, directions: list[Floats]) -> Floats:
    """Return the points (3, d) of the surface in the directions."""
    points = np.array(directions).reshape(-1, 3).T
    images = roots @ points
    forms = np.einsum("kcm,kcm->km", images, images)
    sizes = np.square(roots).sum(axis=(1, 2))[:, np.newaxis] * (points * points).sum(axis=0)
    forms[forms <= NULL_TOLERANCE * sizes] = 0.0
    found: Floats = points / power_scale(exponents).load_factors(forms)
    return found


def _within_plane(roots: Floats, exponents: Floats, plane: Floats) -> SupportSolver:
    """Return the solver for loads in a plane; a third component only adds to every form."""
    forms = np.zeros((len(roots), 3, 3))
    cut = roots @ plane.T
    forms[:, :2, :2] = np.swapaxes(cut, 1, 2) @ cut
    limiting = np.trace(forms, axis1=1, axis2=2) > 1e-14 * np.square(roots).sum(axis=(1, 2))
    forms, exponents = forms[limiting], exponents[limiting]
    forms[:, 2, 2] = np.trace(forms, axis1=1, axis2=2)
    return power_sum_solver(np.array([root_of(form) for form in forms]), exponents)


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
