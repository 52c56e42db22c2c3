# SPDX-License-Identifier: Apache-2.0
"""The gauge of a power sum for a single load, in plain floats; see `one_twist`."""

from __future__ import annotations

from functools import partial
from math import exp, log, sqrt
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.surface.gauges.one_load import (
    gauge_of_one,
    log_scale_of_one,
    norm_of_one,
    one_load_terms,
)
from limit_surface_ros.surface.gauges.one_twist import newton_move

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import TypeAlias

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.gauges.one_load import Term, Vector
    from limit_surface_ros.surface.gauges.one_twist import Newton

    # q0, b1, b2, a11, a12 and a22: in the plane a form is q0 + 2 b.x + x'a x.
    Form: TypeAlias = tuple[float, float, float, float, float, float]

# A form below this would make its term's curvature lose its digits: a corner is near.
_SMALL = 1e-9


class OnePowerSum:
    """The load factor of sum_i |R_i f|^(2 p_i) = 1."""

    def __init__(self, roots: Floats, exponents: Floats) -> None:
        """Keep R_i, shape (k, 3, 3), and p_i, shape (k,)."""
        self._terms = one_load_terms(roots, exponents, np.ones(3))
        self._norms = bool((exponents == 0.5).all())

    def of_load(self, load: Vector) -> float | None:
        """Return g of a load; None if a term does not see it."""
        return norm_of_one(self._terms, load) if self._norms else gauge_of_one(self._terms, load)

    def in_plane(
        self, normal: Vector, first: Vector, second: Vector
    ) -> Callable[[float, float], Newton | None]:
        """Return log g, its gradient and Newton's move in a plane; see `one_twist.OneGauge`."""
        forms = [_in_plane(term, normal, first, second) for term in self._terms]
        return (
            partial(_norms_newton, forms) if self._norms else partial(_newton, self._terms, forms)
        )


def _in_plane(term: Term, normal: Vector, first: Vector, second: Vector) -> Form:
    """Return a term's form in the plane."""
    _, _, a, b, c, d, e, f, g, h, i = term
    x, y, z = normal
    n0, n1, n2 = a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z
    x, y, z = first
    p0, p1, p2 = a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z
    x, y, z = second
    q0, q1, q2 = a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z
    return (
        n0 * n0 + n1 * n1 + n2 * n2,
        n0 * p0 + n1 * p1 + n2 * p2,
        n0 * q0 + n1 * q1 + n2 * q2,
        p0 * p0 + p1 * p1 + p2 * p2,
        p0 * q0 + p1 * q1 + p2 * q2,
        q0 * q0 + q1 * q1 + q2 * q2,
    )


def _value(form: Form, p: float, q: float) -> float:
    q0, b1, b2, a11, a12, a22 = form
    return q0 + p * (2.0 * b1 + a11 * p + 2.0 * a12 * q) + q * (2.0 * b2 + a22 * q)


def _norms_newton(forms: list[Form], p: float, q: float) -> Newton | None:
    """Return what `_newton` does where all exponents are 1/2, so that g is a sum of roots."""
    gauge = g1 = g2 = h11 = h12 = h22 = 0.0
    for q0, b1, b2, a11, a12, a22 in forms:
        c1, c2 = b1 + a11 * p + a12 * q, b2 + a12 * p + a22 * q
        value = q0 + p * (b1 + c1) + q * (b2 + c2)
        if not value > _SMALL * (q0 + a11 * p * p + a22 * q * q):
            return None
        norm = sqrt(value)
        gauge += norm
        weight = 1.0 / norm
        c1 *= weight
        c2 *= weight
        g1 += c1
        g2 += c2
        h11 += weight * (a11 - c1 * c1)
        h12 += weight * (a12 - c1 * c2)
        h22 += weight * (a22 - c2 * c2)
    move = newton_move(g1, g2, h11, h12, h22)
    return None if move is None else (log(gauge), (g1 / gauge, g2 / gauge), move)


def _newton(terms: Sequence[Term], forms: list[Form], p: float, q: float) -> Newton | None:
    """Return log g, its gradient, and Newton's move for g; see `PowerGauge`."""
    values = [_value(form, p, q) for form in forms]
    for value, form in zip(values, forms, strict=True):
        if not value > _SMALL * (form[0] + form[3] * p * p + form[5] * q * q):
            return None
    t = log_scale_of_one(terms, values)
    if t is None:
        return None
    total = second_total = g1 = g2 = m1 = m2 = k11 = k12 = k22 = 0.0
    for term, value, (_, b1, b2, a11, a12, a22) in zip(terms, values, forms, strict=True):
        exponent = term[0]
        share = 2.0 * exponent * exp(exponent * (log(value) + 2.0 * t))
        weight = share / value
        c1, c2 = b1 + a11 * p + a12 * q, b2 + a12 * p + a22 * q
        bend = (2.0 * exponent - 2.0) / value
        total += share
        second_total += 2.0 * exponent * share
        g1 += weight * c1
        g2 += weight * c2
        m1 += 2.0 * exponent * weight * c1
        m2 += 2.0 * exponent * weight * c2
        k11 += weight * (a11 + bend * c1 * c1)
        k12 += weight * (a12 + bend * c1 * c2)
        k22 += weight * (a22 + bend * c2 * c2)
    g1 /= total
    g2 /= total
    both = second_total / total + 1.0
    h11 = (k11 - 2.0 * m1 * g1) / total + both * g1 * g1
    h12 = (k12 - m1 * g2 - m2 * g1) / total + both * g1 * g2
    h22 = (k22 - 2.0 * m2 * g2) / total + both * g2 * g2
    move = newton_move(g1, g2, h11, h12, h22)
    return None if move is None else (-t, (g1, g2), move)
