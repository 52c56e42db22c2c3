"""The load of most power of a power sum for a single twist, in plain floats.

Newton's method as in `plane_minimum`, with what is constant in the plane worked out beforehand.
Whatever does not go smoothly is left to that module: the functions then return None.
"""

from __future__ import annotations

from math import exp, hypot, log, sqrt
from typing import TYPE_CHECKING

from limit_surface_ros.surface.one_load import gauge_of_one, log_scale_of_one, norm_of_one

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from typing import TypeAlias

    from limit_surface_ros.surface.one_load import Term, Vector

    # q0, b1, b2, a11, a12 and a22: in the plane a form is q0 + 2 b.x + x'a x.
    Form: TypeAlias = tuple[float, float, float, float, float, float]
    Newton: TypeAlias = tuple[float, tuple[float, float], tuple[float, float]]

_STEPS = 30
# A form below this would make its term's curvature lose its digits: a corner is near.
_SMALL = 1e-9
_LAST_STEP = 1e-8
_TARGET = 1e-14
# A larger sine before a last step may come from a kink that drew Newton's method in.
_PARALLEL = 1e-6


def most_power_of_one(
    terms: Sequence[Term], twist: Vector, starts: Iterable[Vector]
) -> Vector | None:
    """Return the load on the surface with the most power of those that the starts lead to.

    Args:
        terms: Of scaled loads; see `one_load.one_load_terms`.
        twist: Scaled, not zero.
        starts: Scaled loads with power above zero.

    Returns:
        The load; None if there is no start or one does not lead anywhere.
    """
    best = None
    most = 0.0
    for start in starts:
        load = _climb(terms, twist, start)
        if load is None:
            return None
        power = load[0] * twist[0] + load[1] * twist[1] + load[2] * twist[2]
        if power > most:
            best, most = load, power
    return best


def _climb(terms: Sequence[Term], twist: Vector, start: Vector) -> Vector | None:
    """Minimise log g over the plane through n with normal n = twist / |twist|."""
    length = sqrt(twist[0] ** 2 + twist[1] ** 2 + twist[2] ** 2)
    nx, ny, nz = twist[0] / length, twist[1] / length, twist[2] / length
    sign = 1.0 if nz >= 0.0 else -1.0
    a = -1.0 / (sign + nz)
    b = nx * ny * a
    first = (1.0 + sign * nx * nx * a, sign * b, -sign * nx)
    second = (b, sign + ny * ny * a, -ny)
    along = start[0] * nx + start[1] * ny + start[2] * nz
    p = (start[0] * first[0] + start[1] * first[1] + start[2] * first[2]) / along
    q = (start[0] * second[0] + start[1] * second[1] + start[2] * second[2]) / along
    forms = [_in_plane(term, (nx, ny, nz), first, second) for term in terms]
    norms = all(term[0] == 0.5 for term in terms)
    previous = float("inf")
    step_p = step_q = 0.0
    for _ in range(_STEPS):
        found = _norms_newton(forms, p, q) if norms else _newton(terms, forms, p, q)
        if found is None:
            return None
        height, gradient, move = found
        if height > previous + 1e-15:
            step_p, step_q = 0.5 * step_p, 0.5 * step_q
            p -= step_p
            q -= step_q
            continue
        previous = height
        step_p, step_q = move
        sine = hypot(*gradient) / abs(1.0 - p * gradient[0] - q * gradient[1])
        step = hypot(*move) / sqrt(1.0 + p * p + q * q)
        if step <= _LAST_STEP and sine > _PARALLEL:
            return None
        if sine > _TARGET:
            p += step_p
            q += step_q
        if sine <= _TARGET or step <= _LAST_STEP:
            load = (
                nx + p * first[0] + q * second[0],
                ny + p * first[1] + q * second[1],
                nz + p * first[2] + q * second[2],
            )
            gauge = norm_of_one(terms, load) if norms else gauge_of_one(terms, load)
            return None if gauge is None else (load[0] / gauge, load[1] / gauge, load[2] / gauge)
    return None


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
    move = _newton_move(g1, g2, h11, h12, h22)
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
    move = _newton_move(g1, g2, h11, h12, h22)
    return None if move is None else (-t, (g1, g2), move)


def _newton_move(
    g1: float, g2: float, h11: float, h12: float, h22: float
) -> tuple[float, float] | None:
    """Return the move to the minimum for a gradient and a Hessian, None if that is near flat."""
    determinant = h11 * h22 - h12 * h12
    if not (determinant > 1e-10 * (h11 + h22) ** 2 and h11 > 0.0):
        return None
    return (h12 * g2 - h22 * g1) / determinant, (h12 * g1 - h11 * g2) / determinant
