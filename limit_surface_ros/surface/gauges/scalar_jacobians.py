# SPDX-License-Identifier: Apache-2.0
"""The formulas of `jacobians` once more, for a single vector in plain floats."""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING

from limit_surface_ros.surface.gauges.jacobians import FACET, FLAT, PARALLEL, ROUNDED

if TYPE_CHECKING:
    from typing import TypeAlias

    from limit_surface_ros.surface.gauges.gauge import Six, Vector

    # Row after row.
    Nine: TypeAlias = tuple[float, ...]


def product(six: Six, vector: Vector) -> Vector:
    """Return K x for symmetric K."""
    xx, xy, xz, yy, yz, zz = six
    x, y, z = vector
    return xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z


def without_turning(six: Six, point: Vector, normal: Vector) -> Six:
    """Return K such that K x is along N; see `jacobians.without_turning`."""
    a, b, c = normal
    along = point[0] * a + point[1] * b + point[2] * c
    x, y, z = product(six, point)
    x, y, z = x / along, y / along, z / along
    xx, xy, xz, yy, yz, zz = six
    return (
        xx - 2.0 * x * a,
        xy - (x * b + y * a),
        xz - (x * c + z * a),
        yy - 2.0 * y * b,
        yz - (y * c + z * b),
        zz - 2.0 * z * c,
    )


def direction_jacobian(normal: Vector, six: Six) -> tuple[Vector, Nine]:
    """Return u = N / |N| and its derivative (1 - u u') K / |N|."""
    x, y, z = normal
    length = sqrt(x * x + y * y + z * z)
    x, y, z = x / length, y / length, z / length
    xx, xy, xz, yy, yz, zz = (entry / length for entry in six)
    a, b, c = xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z
    return (x, y, z), (
        xx - x * a,
        xy - x * b,
        xz - x * c,
        xy - y * a,
        yy - y * b,
        yz - y * c,
        xz - z * a,
        yz - z * b,
        zz - z * c,
    )


def support_hessian(normal: Vector, point: Vector, gauge_normal: Vector, six: Six) -> Six | None:
    """Return the Hessian of a support function, None if the surface is flat or has a kink there.

    See `jacobians.support_hessians`.
    """
    x, y, z = normal
    p, q, r = point
    power = x * p + y * q + z * r
    size = gauge_normal[0] * p + gauge_normal[1] * q + gauge_normal[2] * r
    square = x * x + y * y + z * z
    k = power / size
    u, v, w = k * gauge_normal[0] - x, k * gauge_normal[1] - y, k * gauge_normal[2] - z
    if u * u + v * v + w * w > PARALLEL * square:
        return None
    a, b, c, d, e, f = six
    first_x, first_y, first_z = y * c - z * b, y * e - z * d, y * f - z * e
    second_x, second_y, second_z = z * a - x * c, z * b - x * e, z * c - x * f
    third_x, third_y = x * b - y * a, x * d - y * b
    xx, xy, xz = y * first_z - z * first_y, z * first_x - x * first_z, x * first_y - y * first_x
    yy, yz = z * second_x - x * second_z, x * second_y - y * second_x
    zz = x * third_y - y * third_x
    minors = 0.5 * (a * xx + d * yy + f * zz) + b * xy + c * xz + e * yz
    trace = xx + yy + zz
    if not minors * square > FLAT * trace * trace:
        return None
    factor = size / (power * minors)
    if trace * factor * power <= FACET * (p * p + q * q + r * r):
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    return xx * factor, xy * factor, xz * factor, yy * factor, yz * factor, zz * factor


def moved_point(normal: Vector, point: Vector, gauge_normal: Vector, six: Six) -> Vector | None:
    """Return where a support point belongs that is not as exact as it can be, None if it is.

    Args:
        normal: n.
        point: x, all but the support point of n.
        gauge_normal: N of the gauge there.
        six: What `support_hessian` makes of them.
    """
    x, y, z = normal
    p, q, r = point
    a, b, c = gauge_normal
    k = (x * p + y * q + z * r) / (a * p + b * q + c * r)
    off = (k * a - x, k * b - y, k * c - z)
    if product_of(off, off) <= ROUNDED * product_of(normal, normal):
        return None
    u, v, w = product(six, off)
    return p - u, q - v, r - w


def product_of(first: Vector, second: Vector) -> float:
    """Return a.b."""
    return first[0] * second[0] + first[1] * second[1] + first[2] * second[2]
