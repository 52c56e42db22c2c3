# SPDX-License-Identifier: Apache-2.0
"""The gauges once more, for a single vector in plain floats: on three numbers numpy's calls cost.

The same arithmetic as in `norm_sum`, `power_sum` and `quartic`, to the same rounding. A vector
that needs care, as one in the null space of a term, is left to these: the answer is then None.
"""

from __future__ import annotations

from math import exp, log, sqrt
from operator import mul
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.surface.gauges.jacobians import six_of
from limit_surface_ros.surface.gauges.scalar_jacobians import without_turning
from limit_surface_ros.surface.linalg import NULL_TOLERANCE

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import TypeAlias

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.gauges.gauge import PlaneStep, Six, Vector

    # The square of a norm below which a unit vector is in its null space, and R row by row.
    Norm: TypeAlias = tuple[float, ...]
    # q0, b1, b2, a11, a12 and a22: in a plane |R f|^2 is q0 + 2 b.x + x'a x.
    PlaneForm: TypeAlias = tuple[float, float, float, float, float, float]

# Newton's method needs three to seven steps for a scale.
_STEPS = 60
# A form below this, beside a corner, has lost digits as a sum of products in the plane, and so
# would the point: solvers of columns, which take the form from its root, keep them.
_SMALL = 1e-6


class NormSumScalar:
    """The sum of norms |R_k f|."""

    def __init__(self, roots: Floats) -> None:
        """Keep the R_k, shape (k, 3, 3)."""
        self._norms = _norms(roots)
        self._forms = _forms(roots)
        self._vertices = _vertices(self._norms, roots)

    def value(self, point: Vector) -> float:
        """Return the sum; the norm of a point in its null space is exactly zero."""
        x, y, z = point
        total = 0.0
        size = x * x + y * y + z * z
        for least, a, b, c, d, e, f, g, h, i in self._norms:
            u = a * x + b * y + c * z
            v = d * x + e * y + f * z
            w = g * x + h * y + i * z
            q = u * u + v * v + w * w
            if q > least * size:
                total += sqrt(q)
        return total

    def value_and_normal(self, point: Vector) -> tuple[float, Vector] | None:
        """Return the sum and its gradient."""
        x, y, z = point
        gx = gy = gz = 0.0
        size = x * x + y * y + z * z
        for least, a, b, c, d, e, f, g, h, i in self._norms:
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
        return gx * x + gy * y + gz * z, (gx, gy, gz)

    def turning(self, point: Vector) -> tuple[float, Vector, Six] | None:
        """Return the sum, its gradient and its Hessian."""
        x, y, z = point
        gx = gy = gz = xx = xy = xz = yy = yz = zz = 0.0
        size = x * x + y * y + z * z
        for (least, a, b, c, d, e, f, g, h, i), (axx, axy, axz, ayy, ayz, azz) in zip(
            self._norms, self._forms, strict=True
        ):
            u = a * x + b * y + c * z
            v = d * x + e * y + f * z
            w = g * x + h * y + i * z
            q = u * u + v * v + w * w
            if not least * size < q:
                return None
            s = 1.0 / sqrt(q)
            px = s * (a * u + d * v + g * w)
            py = s * (b * u + e * v + h * w)
            pz = s * (c * u + f * v + i * w)
            gx += px
            gy += py
            gz += pz
            xx += s * (axx - px * px)
            xy += s * (axy - px * py)
            xz += s * (axz - px * pz)
            yy += s * (ayy - py * py)
            yz += s * (ayz - py * pz)
            zz += s * (azz - pz * pz)
        return gx * x + gy * y + gz * z, (gx, gy, gz), (xx, xy, xz, yy, yz, zz)

    def is_vertex(self, point: Vector) -> bool:
        """Tell whether the norm of a matrix of rank two is zero; see `ScalarGauge`."""
        return _is_null(self._vertices, point)

    def in_plane(
        self, normal: Vector, first: Vector, second: Vector
    ) -> Callable[[float, float], PlaneStep | None]:
        """Return the sum's logarithm in a plane; see `ScalarGauge`."""
        forms = [(norm, *_in_plane(norm, normal, first, second)) for norm in self._norms]

        def step(p: float, q: float) -> PlaneStep | None:
            gauge = g1 = g2 = h11 = h12 = h22 = 0.0
            for term, q0, b1, b2, a11, a12, a22 in forms:
                c1, c2 = b1 + a11 * p + a12 * q, b2 + a12 * p + a22 * q
                value = q0 + p * (b1 + c1) + q * (b2 + c2)
                if not value > _SMALL * (q0 + a11 * p * p + a22 * q * q):
                    value, c1, c2 = _by_root(term, normal, first, second, p, q)
                    if value == 0.0:
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
            return None if move is None else (log(gauge), move)

        return step


class PowerSumScalar:
    """The load factor of sum_i |R_i f|^(2 p_i) = 1."""

    def __init__(self, roots: Floats, exponents: Floats) -> None:
        """Keep R_i, shape (k, 3, 3), and p_i, shape (k,)."""
        self._norms = _norms(roots)
        self._forms_of_terms = _forms(roots)
        self._vertices = _vertices(
            [norm for norm, p in zip(self._norms, exponents, strict=True) if p < 1.0],
            roots[exponents < 1.0],
        )
        self._exponents: list[float] = exponents.tolist()

    def value(self, point: Vector) -> float | None:
        """Return the load factor."""
        forms = self._forms(point)
        t = None if forms is None else self._log_scale(forms)
        return None if t is None else exp(-t)

    def value_and_normal(self, point: Vector) -> tuple[float, Vector] | None:
        """Return the load factor, and a vector along its gradient."""
        forms = self._forms(point)
        t = None if forms is None else self._log_scale(forms)
        if forms is None or t is None:
            return None
        x, y, z = point
        gx = gy = gz = 0.0
        for (_, a, b, c, d, e, f, g, h, i), form, p in zip(
            self._norms, forms, self._exponents, strict=True
        ):
            s = p * exp(p * (log(form) + 2.0 * t)) / form
            u = s * (a * x + b * y + c * z)
            v = s * (d * x + e * y + f * z)
            w = s * (g * x + h * y + i * z)
            gx += a * u + d * v + g * w
            gy += b * u + e * v + h * w
            gz += c * u + f * v + i * w
        return exp(-t), (gx, gy, gz)

    def turning(self, point: Vector) -> tuple[float, Vector, Six] | None:
        """Return the load factor with a normal and how it turns; see `PowerSumGauge.turning`."""
        values = self._forms(point)
        t = None if values is None else self._log_scale(values)
        if values is None or t is None:
            return None
        x, y, z = point
        gx = gy = gz = xx = xy = xz = yy = yz = zz = 0.0
        for (axx, axy, axz, ayy, ayz, azz), value, p in zip(
            self._forms_of_terms, values, self._exponents, strict=True
        ):
            s = p * exp(p * (log(value) + 2.0 * t)) / value
            px = axx * x + axy * y + axz * z
            py = axy * x + ayy * y + ayz * z
            pz = axz * x + ayz * y + azz * z
            gx += s * px
            gy += s * py
            gz += s * pz
            r = (2.0 - 2.0 * p) / value
            xx += s * (axx - r * px * px)
            xy += s * (axy - r * px * py)
            xz += s * (axz - r * px * pz)
            yy += s * (ayy - r * py * py)
            yz += s * (ayz - r * py * pz)
            zz += s * (azz - r * pz * pz)
        normal = (gx, gy, gz)
        return exp(-t), normal, without_turning((xx, xy, xz, yy, yz, zz), point, normal)

    def is_vertex(self, point: Vector) -> bool:
        """Tell whether a rooted form of rank two is zero; see `ScalarGauge`."""
        return _is_null(self._vertices, point)

    def in_plane(
        self, normal: Vector, first: Vector, second: Vector
    ) -> Callable[[float, float], PlaneStep | None]:
        """Return the load factor's logarithm in a plane; see `ScalarGauge`.

        By the same implicit differentiation as in `PowerSumGauge.derivatives`.
        """
        forms = [_in_plane(norm, normal, first, second) for norm in self._norms]

        def step(p: float, q: float) -> PlaneStep | None:
            values = []
            for q0, b1, b2, a11, a12, a22 in forms:
                value = q0 + p * (2.0 * b1 + a11 * p + 2.0 * a12 * q) + q * (2.0 * b2 + a22 * q)
                if not value > _SMALL * (q0 + a11 * p * p + a22 * q * q):
                    return None
                values.append(value)
            t = self._log_scale(values)
            if t is None:
                return None
            total = second_total = g1 = g2 = m1 = m2 = k11 = k12 = k22 = 0.0
            for exponent, value, (_, b1, b2, a11, a12, a22) in zip(
                self._exponents, values, forms, strict=True
            ):
                share = 2.0 * exponent * exp(exponent * (log(value) + 2.0 * t))
                weight = share / value
                c1, c2 = b1 + a11 * p + a12 * q, b2 + a12 * p + a22 * q
                curvature = (2.0 * exponent - 2.0) / value
                total += share
                second_total += 2.0 * exponent * share
                g1 += weight * c1
                g2 += weight * c2
                m1 += 2.0 * exponent * weight * c1
                m2 += 2.0 * exponent * weight * c2
                k11 += weight * (a11 + curvature * c1 * c1)
                k12 += weight * (a12 + curvature * c1 * c2)
                k22 += weight * (a22 + curvature * c2 * c2)
            g1 /= total
            g2 /= total
            both = second_total / total + 1.0
            h11 = (k11 - 2.0 * m1 * g1) / total + both * g1 * g1
            h12 = (k12 - m1 * g2 - m2 * g1) / total + both * g1 * g2
            h22 = (k22 - 2.0 * m2 * g2) / total + both * g2 * g2
            move = _newton_move(g1, g2, h11, h12, h22)
            return None if move is None else (-t, move)

        return step

    def _forms(self, point: Vector) -> list[float] | None:
        """Return |R_i f|^2, None if f is in the null space of one."""
        x, y, z = point
        size = x * x + y * y + z * z
        forms = []
        for least, a, b, c, d, e, f, g, h, i in self._norms:
            u = a * x + b * y + c * z
            v = d * x + e * y + f * z
            w = g * x + h * y + i * z
            q = u * u + v * v + w * w
            if not least * size < q:
                return None
            forms.append(q)
        return forms

    def _log_scale(self, forms: list[float]) -> float | None:
        """Return t with sum_i exp(p_i (log q_i + 2 t)) = 1; see `power_scale.LogarithmicScale`."""
        t = -log(sum(map(sqrt, forms)))
        slopes = [(2.0 * p, p * log(q)) for p, q in zip(self._exponents, forms, strict=True)]
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


class QuarticScalar:
    """The load factor P(f)^(1/4) of a polynomial of fourth order; see `quartic.Quartic`."""

    def __init__(self, first: Floats, second: Floats) -> None:
        """Keep the derivatives of P as `Quartic` has them, shapes (3, 10) and (3, 3, 6)."""
        self._gradient_rows: list[list[float]] = first.tolist()
        self._hessian_rows: list[list[float]] = [
            second[row, column].tolist() for row in range(3) for column in range(row, 3)
        ]

    def value(self, point: Vector) -> float:
        """Return the load factor."""
        return self.value_and_normal(point)[0]

    def turning(self, point: Vector) -> tuple[float, Vector, Six]:
        """Return the load factor, the gradient and the Hessian of P; see `ScalarGauge`."""
        value, normal = self.value_and_normal(point)
        size = abs(point[0]) + abs(point[1]) + abs(point[2])
        x, y, m = point[0] / size, point[1] / size, point[2] / size
        squares = (x * x, x * y, x * m, y * y, y * m, m * m)
        xx, xy, xm, yy, ym, mm = (sum(map(mul, row, squares)) / size for row in self._hessian_rows)
        return value, normal, (xx, xy, xm, yy, ym, mm)

    def is_vertex(self, _point: Vector) -> bool:
        """Tell that there is no kink; see `ScalarGauge`."""
        return False

    def value_and_normal(self, point: Vector) -> tuple[float, Vector]:
        """Return the load factor, and the gradient of P at the point over its size."""
        size = abs(point[0]) + abs(point[1]) + abs(point[2])
        x, y, m = point[0] / size, point[1] / size, point[2] / size
        xx, yy, mm = x * x, y * y, m * m
        cubics = (
            xx * x,
            xx * y,
            xx * m,
            x * yy,
            x * y * m,
            x * mm,
            yy * y,
            yy * m,
            y * mm,
            mm * m,
        )
        gx, gy, gm = (sum(map(mul, row, cubics)) for row in self._gradient_rows)
        return size * sqrt(sqrt(0.25 * (gx * x + gy * y + gm * m))), (gx, gy, gm)

    def in_plane(
        self, normal: Vector, first: Vector, second: Vector
    ) -> Callable[[float, float], PlaneStep | None]:
        """Return the load factor's logarithm in a plane; see `ScalarGauge`."""
        nx, ny, nm = normal
        ax, ay, am = first
        bx, by, bm = second
        rows = self._hessian_rows

        def step(p: float, q: float) -> PlaneStep | None:
            x, y, m = nx + p * ax + q * bx, ny + p * ay + q * by, nm + p * am + q * bm
            squares = (x * x, x * y, x * m, y * y, y * m, m * m)
            xx, xy, xm, yy, ym, mm = (sum(map(mul, row, squares)) for row in rows)
            # The Hessian times the load, and the plane's axes: by Euler's theorem the first is
            # three times the gradient, and that times the load four times the value.
            a1, a2, a3 = (
                xx * ax + xy * ay + xm * am,
                xy * ax + yy * ay + ym * am,
                xm * ax + ym * ay + mm * am,
            )
            b1, b2, b3 = (
                xx * bx + xy * by + xm * bm,
                xy * bx + yy * by + ym * bm,
                xm * bx + ym * by + mm * bm,
            )
            g1, g2 = (a1 * x + a2 * y + a3 * m) / 3.0, (b1 * x + b2 * y + b3 * m) / 3.0
            value = (
                x * (xx * x + 2.0 * (xy * y + xm * m)) + y * (yy * y + 2.0 * ym * m) + mm * m * m
            ) / 12.0
            if not value > 0.0:
                return None
            # The Hessian of the fourth root is, but for a factor, that of P less 3/4 g g' / P.
            correction = 0.75 / value
            move = _newton_move(
                g1,
                g2,
                a1 * ax + a2 * ay + a3 * am - correction * g1 * g1,
                a1 * bx + a2 * by + a3 * bm - correction * g1 * g2,
                b1 * bx + b2 * by + b3 * bm - correction * g2 * g2,
            )
            return None if move is None else (0.25 * log(value), move)

        return step


def _norms(roots: Floats) -> list[Norm]:
    rows = roots.reshape(-1, 9)
    least = NULL_TOLERANCE * np.square(rows).sum(axis=1)
    return [(small, *row) for small, row in zip(least.tolist(), rows.tolist(), strict=True)]


def _forms(roots: Floats) -> list[Six]:
    """Return R'R of each."""
    rows = six_of(np.swapaxes(roots, 1, 2) @ roots).T.tolist()
    return [(xx, xy, xz, yy, yz, zz) for xx, xy, xz, yy, yz, zz in rows]


def _vertices(norms: list[Norm], roots: Floats) -> list[Norm]:
    """Return those of rank two."""
    ranks = np.abs(roots).any(axis=2).sum(axis=1)
    return [norm for norm, rank in zip(norms, ranks, strict=True) if rank == 2]


def _is_null(norms: list[Norm], point: Vector) -> bool:
    """Tell whether one of some norms is zero, but for rounding."""
    x, y, z = point
    size = x * x + y * y + z * z
    for least, a, b, c, d, e, f, g, h, i in norms:
        u = a * x + b * y + c * z
        v = d * x + e * y + f * z
        w = g * x + h * y + i * z
        if u * u + v * v + w * w <= least * size:
            return True
    return False


def _in_plane(norm: Norm, normal: Vector, first: Vector, second: Vector) -> PlaneForm:
    """Return the square of a norm in the plane n + p e1 + q e2."""
    _, a, b, c, d, e, f, g, h, i = norm
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


def _by_root(
    norm: Norm, normal: Vector, first: Vector, second: Vector, p: float, q: float
) -> tuple[float, float, float]:
    """Return the square of a norm in a plane, and half its derivatives by p and q.

    From the images of the vectors, which keep the digits of a small norm. A square that is zero
    but for rounding is exactly that.
    """
    least, a, b, c, d, e, f, g, h, i = norm
    x, y, z = (n + p * r + q * s for n, r, s in zip(normal, first, second, strict=True))
    u, v, w = a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z
    value = u * u + v * v + w * w
    if not least * (x * x + y * y + z * z) < value:
        return 0.0, 0.0, 0.0
    x, y, z = first
    along = u * (a * x + b * y + c * z) + v * (d * x + e * y + f * z) + w * (g * x + h * y + i * z)
    x, y, z = second
    across = (
        u * (a * x + b * y + c * z) + v * (d * x + e * y + f * z) + w * (g * x + h * y + i * z)
    )
    return value, along, across


def _newton_move(
    g1: float, g2: float, h11: float, h12: float, h22: float
) -> tuple[float, float] | None:
    """Return the move to the minimum for a gradient and a Hessian, None if that is near flat."""
    determinant = h11 * h22 - h12 * h12
    if not (determinant > 1e-10 * (h11 + h22) ** 2 and h11 > 0.0):
        return None
    return (h12 * g2 - h22 * g1) / determinant, (h12 * g1 - h11 * g2) / determinant
