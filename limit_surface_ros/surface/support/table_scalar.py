# SPDX-License-Identifier: Apache-2.0
"""A table of support points once more, for a single normal in plain floats.

The same arithmetic as in `table`, where numpy's calls on three numbers would cost most.
"""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING

from limit_surface_ros.surface.support.table import CELLS, MORE, NEAR, STEP_ERROR, STEPS

if TYPE_CHECKING:
    from limit_surface_ros.surface.gauges.gauge import ScalarGauge, Vector
    from limit_surface_ros.surface.support.table import SupportTable


class TableScalar:
    """Reads a table for one normal at a time."""

    def __init__(self, table: SupportTable, gauge: ScalarGauge) -> None:
        """Keep the table, and the gauge of its surface."""
        self._table = table
        self._gauge = gauge

    def point(self, normal: Vector) -> Vector | None:
        """Return the support point for a normal that is not zero, None if it is not certain."""
        x, y, z = normal
        # A normal below the equator has the place of its opposite.
        sign = 1.0 if z >= 0.0 else -1.0
        reach = sign * sqrt(x * x + y * y + z * z) + z
        a, b = x / reach, y / reach
        along, across = 0.5 * CELLS * (a + 1.0), 0.5 * CELLS * (b + 1.0)
        row, column = min(int(along), CELLS - 1), min(int(across), CELLS - 1)
        cell = self._table.cell(row * CELLS + column)
        if cell is None:
            return None
        coefficients, last_step = cell
        h, h_a, h_b, h_aa, h_ab, h_bb = _read(
            coefficients, 2.0 * (along - row) - 1.0, 2.0 * (across - column) - 1.0
        )
        lift = 2.0 / (1.0 + a * a + b * b)
        z = lift * (h - a * h_a - b * h_b)
        x, y = h_a + a * z, h_b + b * z
        before = 0.0
        for _ in range(STEPS):
            found = self._gauge.value_and_normal((x, y, z))
            if found is None:
                return None
            value, (p, q, r) = found
            reach = sqrt(p * p + q * q + r * r) + r
            if not reach > 0.0:
                return None
            da, db = a - p / reach, b - q / reach
            # To the surface, and along its curvature.
            x, y, z = x / value, y / value, z / value
            rise_a, rise_b = h_aa * da + h_ab * db, h_ab * da + h_bb * db
            rise = -lift * (a * rise_a + b * rise_b + z * (a * da + b * db))
            x += rise_a + a * rise + z * da
            y += rise_b + b * rise + z * db
            z += rise
            away = max(abs(da), abs(db))
            # The step before may have left so little that this one leaves nothing.
            if away <= last_step or (away <= NEAR and MORE * away * away <= STEP_ERROR * before):
                return sign * x, sign * y, sign * z
            before = away
        return None


def _read(c: list[float], x: float, y: float) -> tuple[float, float, float, float, float, float]:
    """Return h, h_a, h_b, h_aa, h_ab and h_bb at a place in a cell.

    Args:
        c: The derivatives of h in the cell's middle, as the table has them.
        x: From -1 to 1.
        y: From -1 to 1.
    """
    # Powers over their factorials: a sum of them has its derivatives by later coefficients.
    x2, y2 = x * x / 2.0, y * y / 2.0
    x3, y3 = x * x2 / 3.0, y * y2 / 3.0
    x4, y4 = x * x3 / 4.0, y * y3 / 4.0
    x5, y5 = x * x4 / 5.0, y * y4 / 5.0
    # For each power of x the sums over powers of y, and their first and second derivatives.
    s0 = c[0] + c[1] * y + c[2] * y2 + c[3] * y3 + c[4] * y4 + c[5] * y5
    s1 = c[6] + c[7] * y + c[8] * y2 + c[9] * y3 + c[10] * y4
    s2 = c[11] + c[12] * y + c[13] * y2 + c[14] * y3
    s3 = c[15] + c[16] * y + c[17] * y2
    s4 = c[18] + c[19] * y
    t0 = c[1] + c[2] * y + c[3] * y2 + c[4] * y3 + c[5] * y4
    t1 = c[7] + c[8] * y + c[9] * y2 + c[10] * y3
    t2 = c[12] + c[13] * y + c[14] * y2
    t3 = c[16] + c[17] * y
    u0 = c[2] + c[3] * y + c[4] * y2 + c[5] * y3
    u1 = c[8] + c[9] * y + c[10] * y2
    u2 = c[13] + c[14] * y
    return (
        s0 + s1 * x + s2 * x2 + s3 * x3 + s4 * x4 + c[20] * x5,
        CELLS * (s1 + s2 * x + s3 * x2 + s4 * x3 + c[20] * x4),
        CELLS * (t0 + t1 * x + t2 * x2 + t3 * x3 + c[19] * x4),
        CELLS**2 * (s2 + s3 * x + s4 * x2 + c[20] * x3),
        CELLS**2 * (t1 + t2 * x + t3 * x2 + c[19] * x3),
        CELLS**2 * (u0 + u1 * x + u2 * x2 + c[17] * x3),
    )
