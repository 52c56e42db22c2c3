# SPDX-License-Identifier: Apache-2.0
"""Power sums for a single load, in plain floats: numpy's overhead on three numbers is the cost.

The same arithmetic as in `power_sum`, to the same rounding. A load that needs care (a term or all
of them do not see it) is left to that module: these functions then return None.
"""

from __future__ import annotations

from math import exp, log, sqrt
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from limit_surface_ros.surface.linalg import NULL_TOLERANCE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.checks import Floats

# Exponent, the form below which a unit load is one that the term does not see, and the elements
# of R_i row by row.
Term: TypeAlias = tuple[float, ...]
Vector: TypeAlias = tuple[float, float, float]

_STEPS = 60
# Squares of loads from 1e-75 to 1e75 N, beyond which numbers may run out.
_TINY = 1e-150
_HUGE = 1e150


def one_load_terms(roots: Floats, exponents: Floats, unit: Floats) -> list[Term]:
    """Return the terms for loads in physical units.

    Args:
        roots: R_i for scaled loads, shape (k, 3, 3).
        exponents: p_i, shape (k,).
        unit: The wrench unit, shape (3,).
    """
    rows = (roots / unit).reshape(-1, 9)
    least = NULL_TOLERANCE * np.square(rows).sum(axis=1)
    return [
        (p, small, *row)
        for p, small, row in zip(exponents.tolist(), least.tolist(), rows.tolist(), strict=True)
    ]


def gauge_of_one(terms: Sequence[Term], load: Vector) -> float | None:
    """Return the load factor of one load, None if a term does not see it."""
    x, y, z = load
    size = x * x + y * y + z * z
    if not _TINY < size < _HUGE:
        return None
    forms = []
    for _, least, a, b, c, d, e, f, g, h, i in terms:
        u = a * x + b * y + c * z
        v = d * x + e * y + f * z
        w = g * x + h * y + i * z
        q = u * u + v * v + w * w
        if not least * size < q:
            return None
        forms.append(q)
    t = log_scale_of_one(terms, forms)
    return None if t is None else exp(-t)


def norm_of_one(terms: Sequence[Term], load: Vector) -> float:
    """Return the sum of the terms' norms |R_i f|, whatever their exponents."""
    x, y, z = load
    total = 0.0
    for _, _, a, b, c, d, e, f, g, h, i in terms:
        u = a * x + b * y + c * z
        v = d * x + e * y + f * z
        w = g * x + h * y + i * z
        total += sqrt(u * u + v * v + w * w)
    return total


def norm_gradient_of_one(terms: Sequence[Term], load: Vector) -> Vector | None:
    """Return the gradient of the sum of the terms' norms |R_i f|, whatever their exponents."""
    x, y, z = load
    gx = gy = gz = 0.0
    size = x * x + y * y + z * z
    if not _TINY < size < _HUGE:
        return None
    for _, least, a, b, c, d, e, f, g, h, i in terms:
        u = a * x + b * y + c * z
        v = d * x + e * y + f * z
        w = g * x + h * y + i * z
        q = u * u + v * v + w * w
        if not least * size < q:
            return None
        s = 1.0 / sqrt(q)
        gx += s * (a * u + d * v + g * w)
        gy += s * (b * u + e * v + h * w)
        gz += s * (c * u + f * v + i * w)
    return gx, gy, gz


def normal_and_gauge_of_one(terms: Sequence[Term], load: Vector) -> tuple[Vector, float] | None:
    """Return the gradient of H, of any length, where the load's ray leaves the surface.

    Beside it goes the load factor.
    """
    x, y, z = load
    size = x * x + y * y + z * z
    if not _TINY < size < _HUGE:
        return None
    forms = []
    pulls = []
    for _, least, a, b, c, d, e, f, g, h, i in terms:
        u = a * x + b * y + c * z
        v = d * x + e * y + f * z
        w = g * x + h * y + i * z
        q = u * u + v * v + w * w
        if not least * size < q:
            return None
        forms.append(q)
        pulls.append((a * u + d * v + g * w, b * u + e * v + h * w, c * u + f * v + i * w))
    t = log_scale_of_one(terms, forms)
    if t is None:
        return None
    gx = gy = gz = 0.0
    for term, q, (px, py, pz) in zip(terms, forms, pulls, strict=True):
        p = term[0]
        s = p * exp(p * (log(q) + 2.0 * t)) / q
        gx += s * px
        gy += s * py
        gz += s * pz
    return (gx, gy, gz), exp(-t)


def log_scale_of_one(terms: Sequence[Term], forms: list[float]) -> float | None:
    """Return t with sum_i exp(p_i (log q_i + 2 t)) = 1; see `power_sum_scale.log_scales`."""
    t = -log(sum(map(sqrt, forms)))
    slopes = [(2.0 * term[0], term[0] * log(q)) for term, q in zip(terms, forms, strict=True)]
    for _ in range(_STEPS):
        value = rise = 0.0
        for slope, offset in slopes:
            part = exp(slope * t + offset)
            value += part
            rise += slope * part
        step = log(value) * value / rise
        t -= step
        if -1e-9 < step < 1e-9:
            return t
    return None
