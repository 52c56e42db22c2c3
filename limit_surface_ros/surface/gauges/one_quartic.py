# SPDX-License-Identifier: Apache-2.0
"""A homogeneous polynomial of fourth order for a single load, in plain floats; see `one_twist`."""

from __future__ import annotations

from math import log, sqrt
from operator import mul
from typing import TYPE_CHECKING

from limit_surface_ros.surface.gauges.one_twist import newton_move

if TYPE_CHECKING:
    from collections.abc import Callable

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.gauges.one_load import Vector
    from limit_surface_ros.surface.gauges.one_twist import Newton


class OneQuartic:
    """The load factor P(f)^(1/4) of a surface P = 1."""

    def __init__(self, first: Floats, second: Floats) -> None:
        """Keep the derivatives of P.

        Args:
            first: The gradient is `first` times the monomials x^3, x^2 y, x^2 m, x y^2, x y m,
                x m^2, y^3, y^2 m, y m^2 and m^3, shape (3, 10).
            second: The Hessian is `second` times x^2, x y, x m, y^2, y m and m^2,
                shape (3, 3, 6).
        """
        self._gradient_rows: list[list[float]] = first.tolist()
        self._hessian_rows: list[list[float]] = [
            second[row, column].tolist() for row in range(3) for column in range(row, 3)
        ]

    def gradient(self, load: Vector) -> Vector:
        """Return the gradient of P."""
        x, y, m = load
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
        return gx, gy, gm

    def of_load(self, load: Vector) -> float:
        """Return the load factor."""
        x, y, m = load
        gx, gy, gm = self.gradient(load)
        return sqrt(sqrt(0.25 * (gx * x + gy * y + gm * m)))

    def in_plane(
        self, normal: Vector, first: Vector, second: Vector
    ) -> Callable[[float, float], Newton | None]:
        """Return log g, its gradient and Newton's move in a plane; see `one_twist.OneGauge`."""
        nx, ny, nm = normal
        ax, ay, am = first
        bx, by, bm = second
        rows = self._hessian_rows

        def newton(p: float, q: float) -> Newton | None:
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
            # g is the fourth root: its Hessian is that of P less 3/4 of the gradient's square.
            less = 0.75 / value
            move = newton_move(
                g1,
                g2,
                a1 * ax + a2 * ay + a3 * am - less * g1 * g1,
                a1 * bx + a2 * by + a3 * bm - less * g1 * g2,
                b1 * bx + b2 * by + b3 * bm - less * g2 * g2,
            )
            scale = 0.25 / value
            return None if move is None else (0.25 * log(value), (scale * g1, scale * g2), move)

        return newton
