# SPDX-License-Identifier: Apache-2.0
"""The load of most power for a single twist, in plain floats.

Newton's method as in `plane_minimum`. Whatever does not go smoothly is left to that module: the
functions then return None.
"""

from __future__ import annotations

from math import hypot, sqrt
from typing import TYPE_CHECKING, Protocol

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from typing import TypeAlias

    from limit_surface_ros.surface.gauges.one_load import Vector
    from limit_surface_ros.surface.scaling import Scaling
    from limit_surface_ros.surface.support.solvers import Inverse

    # Height, gradient and Newton's move at a place in a plane.
    Newton: TypeAlias = tuple[float, tuple[float, float], tuple[float, float]]

_STEPS = 30
_LAST_STEP = 1e-8
_TARGET = 1e-14
# A larger sine before a last step may come from a kink that drew Newton's method in.
_PARALLEL = 1e-6
# Twists between these are safe in plain floats.
_SMALLEST, _LARGEST = 1e-100, 1e100


class OneGauge(Protocol):
    """A gauge g of scaled loads, for one load at a time."""

    def of_load(self, load: Vector) -> float | None:
        """Return g of a load; None if the load needs care."""
        ...

    def in_plane(
        self, normal: Vector, first: Vector, second: Vector
    ) -> Callable[[float, float], Newton | None]:
        """Return a function of the p and q of a load n + p e1 + q e2.

        It returns log g, its gradient, and Newton's move for g; None if the load needs care.

        Args:
            normal: n, a unit vector.
            first: e1, a unit vector across n.
            second: e2, a unit vector across both.
        """
        ...


def wrench_of_one(
    gauge: OneGauge, inverse: Inverse, scaling: Scaling, twist: Vector
) -> Vector | None:
    """Map one twist to a wrench, both in physical units.

    Args:
        gauge: Of the surface g = 1.
        inverse: Of the same surface, which knows where to start.
        scaling: Of the surface.
        twist: Not zero.
    """
    rho, force = scaling.characteristic_length, scaling.friction_force
    x, y, z = twist[0], twist[1], twist[2] * rho
    size = abs(x) + abs(y) + abs(z)
    if not _SMALLEST < size < _LARGEST:
        return None
    scaled = (x / size, y / size, z / size)
    starts = inverse.starts_of_one(np.array(scaled)).tolist()
    load = most_power_of_one(gauge, scaled, starts)
    if load is None:
        return None
    return force * load[0], force * load[1], force * rho * load[2]


def most_power_of_one(gauge: OneGauge, twist: Vector, starts: Iterable[Vector]) -> Vector | None:
    """Return the load on the surface with the most power of those that the starts lead to.

    Args:
        gauge: Of the surface g = 1.
        twist: Scaled, not zero.
        starts: Scaled loads with power above zero.

    Returns:
        The load; None if there is no start or one does not lead anywhere.
    """
    best = None
    most = 0.0
    for start in starts:
        load = _climb(gauge, twist, start)
        if load is None:
            return None
        power = load[0] * twist[0] + load[1] * twist[1] + load[2] * twist[2]
        if power > most:
            best, most = load, power
    return best


def _climb(gauge: OneGauge, twist: Vector, start: Vector) -> Vector | None:
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
    newton = gauge.in_plane((nx, ny, nz), first, second)
    previous = float("inf")
    step_p = step_q = 0.0
    for _ in range(_STEPS):
        found = newton(p, q)
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
            size = gauge.of_load(load)
            return None if size is None else (load[0] / size, load[1] / size, load[2] / size)
    return None


def newton_move(
    g1: float, g2: float, h11: float, h12: float, h22: float
) -> tuple[float, float] | None:
    """Return the move to the minimum for a gradient and a Hessian, None if that is near flat."""
    determinant = h11 * h22 - h12 * h12
    if not (determinant > 1e-10 * (h11 + h22) ** 2 and h11 > 0.0):
        return None
    return (h12 * g2 - h22 * g1) / determinant, (h12 * g1 - h11 * g2) / determinant
