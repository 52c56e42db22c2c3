# SPDX-License-Identifier: Apache-2.0
"""Homogeneous polynomials P of fourth order, and the gauge P^(1/4)."""

from __future__ import annotations

from fractions import Fraction
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.surface.gauges.gauge import Turning
from limit_surface_ros.surface.gauges.jacobians import six_of

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats

# Exponents (i, j, k) of fx^i fy^j m^k in the order of the coefficients: x^4, x^3 y, x^3 m,
# x^2 y^2, x^2 y m, x^2 m^2, x y^3, x y^2 m, x y m^2, x m^3, y^4, y^3 m, y^2 m^2, y m^3, m^4.
MONOMIALS = np.array([(i, j, 4 - i - j) for i in range(4, -1, -1) for j in range(4 - i, -1, -1)])
_PLACES = {tuple(powers): place for place, powers in enumerate(MONOMIALS.tolist())}
# The same for the second derivatives: x^2, x y, x m, y^2, y m, m^2.
_QUADRATICS = [(2, 0, 0), (1, 1, 0), (1, 0, 1), (0, 2, 0), (0, 1, 1), (0, 0, 2)]
# And for the first derivatives: the above times x, the last three times y, the last times m.
_CUBICS = [
    *((i + 1, j, k) for i, j, k in _QUADRATICS),
    *((i, j + 1, k) for i, j, k in _QUADRATICS[3:]),
    (0, 0, 3),
]
# For each of the 81 entries of a symmetric tensor of fourth order its monomial.
_MONOMIAL_OF_ENTRY = np.array(
    [_PLACES[tuple(axes.count(axis) for axis in range(3))] for axes in product(range(3), repeat=4)]
)
_ENTRIES_OF_MONOMIAL = np.bincount(_MONOMIAL_OF_ENTRY)
# Descents to the lowest value on the sphere, and their steps.
_DESCENTS = 20
_STEPS = 400


class Quartic:
    """The gauge P^(1/4) of a polynomial that is positive but at zero.

    Attributes:
        first: The gradient of P is `first` times the monomials x^3, x^2 y, x^2 m, x y^2, x y m,
            x m^2, y^3, y^2 m, y m^2 and m^3, shape (3, 10).
        second: The Hessian of P is `second` times x^2, x y, x m, y^2, y m and m^2, shape
            (3, 3, 6).
    """

    def __init__(self, coefficients: Floats) -> None:
        """Differentiate P twice.

        Args:
            coefficients: In the order of `MONOMIALS`, shape (15,).
        """
        self._coefficients = coefficients
        self.second = _second_derivatives(coefficients)
        self.first = _first_derivatives(self.second)
        # Its six rows of symmetric matrices, shape (6, 6).
        self._second_rows = six_of(np.moveaxis(self.second, 2, 0))

    def in_frame(self, frame: Floats) -> Quartic:
        """Return the polynomial of y with f = F y."""
        tensor = self.tensor
        for _ in range(4):
            # Each turn takes the first axis into the frame and puts it last.
            tensor = np.tensordot(tensor, frame, axes=(0, 0))
        sums = np.bincount(_MONOMIAL_OF_ENTRY, weights=tensor.ravel())
        return Quartic(sums.astype(np.float64))

    @property
    def tensor(self) -> Floats:
        """The symmetric T with P(f) = T_ijkl f_i f_j f_k f_l, shape (3, 3, 3, 3)."""
        entries = (self._coefficients / _ENTRIES_OF_MONOMIAL)[_MONOMIAL_OF_ENTRY]
        return np.asarray(entries.reshape(3, 3, 3, 3))

    def polynomial(self, loads: Floats) -> Floats:
        """Return P (m,) at loads (3, m)."""
        return _by_euler(loads, self.gradient(loads))

    def gradient(self, loads: Floats) -> Floats:
        """Return the gradient (3, m) of P at loads (3, m)."""
        return self._gradient(loads, _quadratics(loads))

    def _gradient(self, loads: Floats, quadratics: Floats) -> Floats:
        x, y, m = loads
        cubics = np.empty((10, loads.shape[1]))
        np.multiply(quadratics, x, out=cubics[:6])
        np.multiply(quadratics[3:], y, out=cubics[6:9])
        np.multiply(quadratics[5], m, out=cubics[9])
        return np.asarray(self.first @ cubics)

    def hessian(self, loads: Floats) -> Floats:
        """Return the Hessian (3, 3, m) of P at loads (3, m)."""
        hessian: Floats = self.second.reshape(9, 6) @ _quadratics(loads)
        return hessian.reshape(3, 3, -1)

    def exact_curvature(self, load: Floats, along: Floats) -> Fraction:
        """Return v' (Hessian of P at f) v of a load f (3,) and a direction v (3,), not rounded."""
        f, v = ([Fraction(x) for x in each.tolist()] for each in (load, along))
        total = Fraction(0)
        for coefficient, powers in zip(
            self._coefficients.tolist(), MONOMIALS.tolist(), strict=True
        ):
            for i, j in product(range(3), repeat=2):
                left = list(powers)
                factor = left[i]
                left[i] -= 1
                factor *= left[j]
                left[j] -= 1
                if factor:
                    part = Fraction(coefficient) * factor * v[i] * v[j]
                    total += part * f[0] ** left[0] * f[1] ** left[1] * f[2] ** left[2]
        return total

    def lowest(self, loads: Floats) -> Floats:
        """Return the unit load (3,) of the lowest P that descents from loads (3, m) lead to."""
        values = self.polynomial(loads)
        points = loads[:, np.argsort(values)[:_DESCENTS]]
        # Less than a step of 1 / curvature, so that each lowers P on the sphere.
        shift = 12.0 * np.abs(self._coefficients).sum() or 1.0
        for _ in range(_STEPS):
            points = shift * points - self.gradient(points)
            points /= np.sqrt((points * points).sum(axis=0))
        return np.asarray(points[:, self.polynomial(points).argmin()])

    def values(self, loads: Floats) -> Floats:
        """Return P^(1/4) (m,)."""
        return self.values_and_normals(loads)[0]

    def values_and_normals(self, loads: Floats) -> tuple[Floats, Floats]:
        """Return P^(1/4) (m,) and the gradient of P (3, m)."""
        gradient = self.gradient(loads)
        return np.sqrt(np.sqrt(_by_euler(loads, gradient))), gradient

    def turning(self, loads: Floats, _null: float = 0.0) -> Turning:
        """Return P^(1/4) with the gradient and the Hessian of P; see `Gauge`."""
        quadratics = _quadratics(loads)
        gradient = self._gradient(loads, quadratics)
        value = np.sqrt(np.sqrt(_by_euler(loads, gradient)))
        return Turning(value, gradient, self._second_rows @ quadratics, None)

    def derivatives(self, loads: Floats, _smoothing: Floats) -> tuple[Floats, Floats, Floats]:
        """Return P^(1/4) with its gradient and Hessian; see `Gauge`. There are no kinks."""
        gradient = self.gradient(loads)
        value = _by_euler(loads, gradient)
        gauge = np.sqrt(np.sqrt(value))
        factor = 0.25 * gauge / value
        outer = gradient[:, np.newaxis] * gradient
        hessian = factor * (self.hessian(loads) - 0.75 / value * outer)
        return gauge, factor * gradient, hessian


def _by_euler(loads: Floats, gradient: Floats) -> Floats:
    """Return P (m,) from loads (3, m) and its gradient (3, m): g.f = 4 P."""
    return np.asarray(0.25 * np.einsum("im,im->m", gradient, loads))


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
