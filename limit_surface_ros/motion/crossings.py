# SPDX-License-Identifier: Apache-2.0
"""The first time at which a sum of exponentials exceeds a level, certified.

Time is cut into cells from the left, and a cell is passed over only where a bound on the second
derivative proves that x cannot exceed the level inside it. A crossing is taken from a cell only
where the slope is steeper than the curvature can undo, so that it is the only one there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.bracket import root_bracket

if TYPE_CHECKING:
    from limit_surface_ros.decay.exponential_sum import ExponentialSum

# Cells into which an interval is cut.
_CELLS = 64
# Part of the sum of |c| that counts as rounding: a level as near to the constant as this is
# reached by terms that swing across it and not by those that only creep up to it.
_ROUNDING = 4e-15
# Doublings of the first interval after which the rest of time begins.
_DOUBLINGS = 200
# Depth of a search below which a cell is too narrow to hold anything but a touch.
_DEPTH = 7


def first_above(x: ExponentialSum, level: float, start: float = 0.0) -> float | None:
    """Return the first time from `start` on at which x exceeds a level; None if it never does.

    A maximum that touches the level to within rounding (a few 1e-15 of the sum of |c|) counts as
    not exceeding it, and so does a creep up to a constant that is the level.

    Args:
        x: Its rates but 0 decay.
        level: In the unit of x, of either sign.
        start: At least 0 [s].

    Example:
        >>> from limit_surface_ros.decay.exponential_sum import ExponentialSum
        >>> rising = ExponentialSum([0.0, -1.0], [1.0, -1.0])
        >>> round(first_above(rising, 0.5), 12) == round(float(np.log(2.0)), 12)
        True
        >>> first_above(rising, 1.0) is None
        True
    """
    level = level + _ROUNDING * x.size
    moving = x.rates != 0.0
    rates, coefficients = x.rates[moving], x.coefficients[moving]
    constant = x.constant
    if float(x(start)) > level:
        return start
    if not coefficients.any():
        return None
    sizes, speeds = np.abs(coefficients), rates.real
    gap = abs(level - constant)
    left, width = start, 1.0 / float(np.abs(rates).max())
    for _ in range(_DOUBLINGS):
        # From here on x is on the constant's side of the level.
        if float(sizes @ np.exp(speeds * left)) < gap:
            return left if constant > level else None
        search = _Search(x, rates, coefficients, level)
        found = search.within(left, left + width, _DEPTH)
        if found is not None:
            return found
        left, width = left + width, 2.0 * width
    return None


class _Search:
    """Looks for the first crossing of one level within an interval."""

    def __init__(
        self, x: ExponentialSum, rates: np.ndarray, coefficients: np.ndarray, level: float
    ) -> None:
        self._x = x
        self._rates = rates
        self._sizes = np.abs(coefficients) * np.abs(rates) ** 2
        self._slope = x.derivative()
        self._level = level

    def within(self, left: float, right: float, depth: int) -> float | None:
        """Return the first time in an interval at which x exceeds the level, if there is one."""
        times = np.linspace(left, right, _CELLS + 1)
        width = (right - left) / _CELLS
        values = self._x(times) - self._level
        curvatures = np.exp(np.multiply.outer(times[:-1], self._rates.real)) @ self._sizes
        highest = np.maximum(values[:-1], values[1:]) + curvatures * width**2 / 8.0
        for cell in np.flatnonzero(highest > 0.0).tolist():
            begin, end = float(times[cell]), float(times[cell + 1])
            if values[cell] > 0.0:
                return begin
            slope = float(self._slope(begin))
            # Steeper than the curvature can undo, x rises through the level once, if at all.
            monotone = abs(slope) > curvatures[cell] * width
            if values[cell + 1] > 0.0 and monotone:
                return root_bracket(self._excess, begin, end, 1e-15 * end)[1]
            if values[cell + 1] <= 0.0 and monotone:
                continue
            if depth == 0 or not begin < 0.5 * (begin + end) < end:
                if values[cell + 1] > 0.0:
                    return end
                continue
            found = self.within(begin, end, depth - 1)
            if found is not None:
                return found
        return None

    def _excess(self, time: float) -> float:
        return float(self._x(time)) - self._level
