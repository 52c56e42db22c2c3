# SPDX-License-Identifier: Apache-2.0
"""Homogeneous polynomials of fourth order: the model of Zhou et al., the peer of the other kinds.

J. Zhou, R. Paolini, J. A. Bagnell and M. T. Mason, "A convex polynomial force-motion model for
planar sliding", ICRA 2016, doi:10.1109/ICRA.2016.7487155.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from math import sqrt
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from limit_surface_ros.checks import as_floats, as_vectors
from limit_surface_ros.errors import MatrixError, ShapeError
from limit_surface_ros.surface.base import LimitSurface
from limit_surface_ros.surface.gauges.one_quartic import OneQuartic
from limit_surface_ros.surface.gauges.one_twist import wrench_of_one
from limit_surface_ros.surface.linalg import even_directions, of_unit_length
from limit_surface_ros.surface.scaling import Scaling
from limit_surface_ros.surface.support.solvers import (
    ConvexInverse,
    FramedInverse,
    PeakInverse,
    round_frame,
)
from limit_surface_ros.surface.support.tabulated import TabulatedInverse

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.gauges.one_load import Vector
    from limit_surface_ros.surface.support.solvers import Inverse

# Exponents (i, j, k) of fx^i fy^j m^k in the order of the coefficients: x^4, x^3 y, x^3 m,
# x^2 y^2, x^2 y m, x^2 m^2, x y^3, x y^2 m, x y m^2, x m^3, y^4, y^3 m, y^2 m^2, y m^3, m^4.
MONOMIALS = np.array([(i, j, 4 - i - j) for i in range(4, -1, -1) for j in range(4 - i, -1, -1)])
# The same for the second derivatives: x^2, x y, x m, y^2, y m, m^2.
_QUADRATICS = [(2, 0, 0), (1, 1, 0), (1, 0, 1), (0, 2, 0), (0, 1, 1), (0, 0, 2)]
# And for the first derivatives: the above times x, the last three times y, the last times m.
_CUBICS = [
    *((i + 1, j, k) for i, j, k in _QUADRATICS),
    *((i, j + 1, k) for i, j, k in _QUADRATICS[3:]),
    (0, 0, 3),
]
_CHECKED_DIRECTIONS = 2000
# Wrenches between these are safe in plain floats.
_SMALLEST, _LARGEST = 1e-100, 1e100
_STARTS = 500


@dataclass(frozen=True, eq=False)
class Polynomial(LimitSurface):
    """The surface P(f) = 1 of a polynomial that is homogeneous of degree four.

    Attributes:
        coefficients: In the order of `MONOMIALS`, for scaled loads, shape (15,).
        scaling: Characteristic length [m] and friction force [N].

    Raises:
        ShapeError: There are not 15 coefficients.
        NotFiniteError: A coefficient is NaN or infinite.
        MatrixError: The polynomial is not positive, so that the surface is not closed.
    """

    kind: ClassVar[str] = "polynomial"

    coefficients: Floats
    scaling: Scaling = field(default_factory=Scaling)
    _first: Floats = field(init=False, repr=False)
    _second: Floats = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Check the coefficients and differentiate twice."""
        coefficients = as_floats("coefficients", self.coefficients).copy()
        if coefficients.shape != (15,):
            raise ShapeError(f"coefficients must have shape (15,), got {coefficients.shape}")
        coefficients.setflags(write=False)
        object.__setattr__(self, "coefficients", coefficients)
        second = _second_derivatives(coefficients)
        object.__setattr__(self, "_second", second)
        object.__setattr__(self, "_first", _first_derivatives(second))
        directions = even_directions(_CHECKED_DIRECTIONS)
        values = self.value(directions)
        if not values.min() > 0.0:
            raise MatrixError(
                "the polynomial must be positive: it is "
                f"{values.min():.6g} at the scaled load {directions[values.argmin()].tolist()}"
            )

    def with_friction_force(self, friction_force: float) -> Polynomial:
        """Return the same body under another weight; see `LimitSurface`."""
        return replace(self, scaling=replace(self.scaling, friction_force=friction_force))

    def value(self, load: ArrayLike) -> Floats:
        """Return P at scaled loads (..., 3): below 1 inside the surface, 1 on it; shape (...)."""
        array = as_vectors("load", load)
        columns = array.reshape(-1, 3).T
        values = (self._gradient(columns) * columns).sum(axis=0) / 4.0
        return np.asarray(values.reshape(array.shape[:-1]))[()]

    def gradient(self, load: ArrayLike) -> Floats:
        """Return the gradient of P at scaled loads (..., 3); shape (..., 3)."""
        array = as_vectors("load", load)
        return np.asarray(self._gradient(array.reshape(-1, 3).T).T.reshape(array.shape))

    def values(self, loads: Floats) -> Floats:
        """Return the gauge P^(1/4) (m,) of scaled loads (3, m); see `plane_minimum.Gauge`."""
        return self._load_factors(loads)

    def values_and_normals(self, loads: Floats) -> tuple[Floats, Floats]:
        """Return the gauge P^(1/4) (m,) of scaled loads (3, m) and the gradient of P (3, m)."""
        gradient = self._gradient(loads)
        return _gauge(loads, gradient), gradient

    def derivatives(self, loads: Floats, _smoothing: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the gauge P^(1/4) of scaled loads (3, m); see `plane_minimum.Gauge`."""
        gradient, hessian = self._gradient(loads), self._hessian(loads)
        value = (gradient * loads).sum(axis=0) / 4.0
        gauge = value**0.25
        outer = gradient[:, np.newaxis] * gradient
        factor = 0.25 * gauge / value
        return gauge, factor * gradient, factor * (hessian - 0.75 / value * outer)

    def _load_factors(self, loads: Floats) -> Floats:
        return _gauge(loads, self._gradient(loads))

    def _twists(self, loads: Floats) -> Floats:
        return of_unit_length(self._gradient(loads))

    def _loads(self, twists: Floats) -> Floats:
        return self._inverse.solve(twists)[0]

    @cached_property
    def _one_gauge(self) -> OneQuartic:
        return OneQuartic(self._first, self._second)

    def _load_factor_of_one(self, wrench: Vector) -> float | None:
        found = self._twist_and_load_factor_of_one(wrench)
        return None if found is None else found[1]

    def _twist_of_one(self, wrench: Vector) -> Vector | None:
        found = self._twist_and_load_factor_of_one(wrench)
        return None if found is None else found[0]

    def _twist_and_load_factor_of_one(self, wrench: Vector) -> tuple[Vector, float] | None:
        rho, force = self.scaling.characteristic_length, self.scaling.friction_force
        x, y, m = wrench[0], wrench[1], wrench[2] / rho
        size = abs(x) + abs(y) + abs(m)
        if not _SMALLEST < size < _LARGEST:
            return None
        load = (x / size, y / size, m / size)
        gx, gy, gm = self._one_gauge.gradient(load)
        factor = sqrt(sqrt(0.25 * (gx * load[0] + gy * load[1] + gm * load[2])))
        length = sqrt(gx * gx + gy * gy + gm * gm)
        return (gx / length, gy / length, gm / (length * rho)), factor * (size / force)

    def _wrench_of_one(self, twist: Vector) -> Vector | None:
        return wrench_of_one(self._one_gauge, self._inverse, self.scaling, twist)

    @cached_property
    def _inverse(self) -> Inverse:
        frame = round_frame(self)
        round_surface = _Framed(self, frame)
        directions = even_directions(2 * _STARTS).T
        curvatures = np.linalg.eigvalsh(
            np.moveaxis(round_surface.derivatives(directions, np.zeros(2 * _STARTS))[2], -1, 0)
        )
        # The gauge is flat along the ray; any curvature below that bends inward.
        if curvatures[:, 0].min() > -1e-9 * curvatures[:, -1].max():
            climb = ConvexInverse(round_surface, directions)
            return FramedInverse(frame, TabulatedInverse(round_surface, climb))
        peaks = PeakInverse(round_surface, directions[:, _STARTS:])
        return FramedInverse(frame, TabulatedInverse(round_surface, peaks, convex=False))

    def _gradient(self, loads: Floats) -> Floats:
        """Return the gradient (3, m) at scaled loads (3, m)."""
        x, y, m = loads
        quadratics = _quadratics(loads)
        cubics = np.empty((10, loads.shape[1]))
        np.multiply(quadratics, x, out=cubics[:6])
        np.multiply(quadratics[3:], y, out=cubics[6:9])
        np.multiply(quadratics[5], m, out=cubics[9])
        return np.asarray(self._first @ cubics)

    def _hessian(self, loads: Floats) -> Floats:
        """Return the Hessian (3, 3, m) at scaled loads (3, m)."""
        hessian: Floats = self._second.reshape(9, 6) @ _quadratics(loads)
        return hessian.reshape(3, 3, -1)


class _Framed:
    """The gauge of a polynomial in other axes, f = F y."""

    def __init__(self, polynomial: Polynomial, frame: Floats) -> None:
        self._polynomial = polynomial
        self._frame = frame

    def values(self, points: Floats) -> Floats:
        return self._polynomial.values(self._frame @ points)

    def values_and_normals(self, points: Floats) -> tuple[Floats, Floats]:
        values, normals = self._polynomial.values_and_normals(self._frame @ points)
        return values, self._frame.T @ normals

    def derivatives(self, points: Floats, smoothing: Floats) -> tuple[Floats, Floats, Floats]:
        gauge, gradient, hessian = self._polynomial.derivatives(self._frame @ points, smoothing)
        turned = np.einsum("ai,abm,bj->ijm", self._frame, hessian, self._frame)
        return gauge, self._frame.T @ gradient, turned


def _gauge(loads: Floats, gradient: Floats) -> Floats:
    """Return P^(1/4) (m,) from loads (3, m) and the gradient of P, by Euler's theorem."""
    values = 0.25 * np.einsum("im,im->m", gradient, loads)
    return np.asarray(np.sqrt(np.sqrt(values)))


def _second_derivatives(coefficients: Floats) -> Floats:
    """Return C (3, 3, 6) with the Hessian C q for the quadratic monomials q."""
    second: Floats = np.zeros((3, 3, 6))
    places = {powers: place for place, powers in enumerate(_QUADRATICS)}
    for coefficient, powers in zip(coefficients, MONOMIALS, strict=True):
        for i in range(3):
            for j in range(3):
                left = powers.copy()
                factor = coefficient * left[i]
                left[i] -= 1
                factor *= left[j]
                left[j] -= 1
                if factor != 0.0:
                    second[i, j, places[left[0], left[1], left[2]]] += factor
    return second


def _first_derivatives(second: Floats) -> Floats:
    """Return C (3, 10) with the gradient C q for the cubic monomials q of `_CUBICS`."""
    first: Floats = np.zeros((3, 10))
    places = {powers: place for place, powers in enumerate(_CUBICS)}
    for place, (x, y, m) in enumerate(_QUADRATICS):
        # A homogeneous cubic, as each component of the gradient, is f . (its gradient) / 3.
        for j, raised in enumerate([(x + 1, y, m), (x, y + 1, m), (x, y, m + 1)]):
            first[:, places[raised]] += second[:, j, place] / 3.0
    return first


def _quadratics(loads: Floats) -> Floats:
    """Return the monomials of `_QUADRATICS` (6, m) of loads (3, m)."""
    x, y, m = loads
    return np.array([x * x, x * y, x * m, y * y, y * m, m * m])
