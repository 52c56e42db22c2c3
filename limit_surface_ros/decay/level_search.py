# SPDX-License-Identifier: Apache-2.0
"""The last time at which the size of a decaying sum of exponentials exceeds a level.

Intervals are cut into cells, and a cell is passed over only where a bound on the second derivative
proves that |x| cannot exceed the level inside it. What depends on no level is kept for the next.
"""

from __future__ import annotations

from cmath import exp
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from limit_surface_ros.bracket import root_bracket

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.exponential_sum import ExponentialSum

# Cells into which an interval is cut at each level of the search.
_CELLS = 128
# Intervals whose cells are kept, a few kilobytes each.
_KEPT = 256
# Part of the whole interval to which a time is found.
_RESOLUTION = 1e-15
# Phase in a cell from which on a term is as good as vanished in the next.
_FASTEST = 1e100


class LevelSearch:
    """Searches one sum, whose rates all decay and whose coefficients are not all zero."""

    def __init__(self, x: ExponentialSum) -> None:
        """Keep the sum."""
        self._x = x
        # Times, each twice the one before, and sum |c| exp(Re lambda t), as far as asked for.
        self._envelope: list[tuple[float, float]] = []
        # Cells of the intervals that levels led to: alike levels lead to the same ones.
        self._known: dict[tuple[float, float], _Cells] = {}

    def last_excess(self, level: float) -> float | None:
        """Return the last time [s] at which |x| exceeds a level above 0, None if it never does."""
        end = self._time_of_envelope(level)
        return self._last_within(0.0, end, level, end * _RESOLUTION)

    def _time_of_envelope(self, level: float) -> float:
        """Return a time from which on sum |c| exp(Re lambda t), and so |x|, is below a level."""
        for end, height in self._envelope:
            if height <= level:
                return end
        sizes, speeds = np.abs(self._x.coefficients), self._x.rates.real
        while True:
            if self._envelope:
                end = 2.0 * self._envelope[-1][0]
            else:
                end = 1.0 / float(np.abs(speeds).max())
            height = float(sizes @ np.exp(speeds * end))
            self._envelope.append((end, height))
            if height <= level:
                return end

    def _last_within(
        self, start: float, end: float, level: float, resolution: float
    ) -> float | None:
        """Return the last time in [start, end] at which |x| exceeds a level, if there is one."""
        cells = self._cells(start, end)
        width = (end - start) / _CELLS
        for cell in np.flatnonzero(cells.highest > level)[::-1].tolist():
            left, right = cells.times[cell : cell + 2].tolist()
            if width <= resolution or not left < 0.5 * (left + right) < right:
                return float(right if cells.values[cell] > level else left)
            if cells.values[cell] > level >= cells.values[cell + 1]:
                slope = sum((c * rate * exp(rate * left)).real for rate, c in self._pairs)
                # Steeper than the curvature can undo, x falls through the level once.
                if abs(slope) * width > cells.bends[cell]:
                    return root_bracket(
                        lambda t: level - abs(self._at_one(t)), left, right, resolution
                    )[1]
            found = self._last_within(left, right, level, resolution)
            if found is not None:
                return found
        return None

    def _cells(self, start: float, end: float) -> _Cells:
        known = self._known.get((start, end))
        if known is None:
            known = self._cells_anew(start, end)
            if len(self._known) == _KEPT:
                self._known.clear()
            self._known[start, end] = known
        return known

    def _cells_anew(self, start: float, end: float) -> _Cells:
        times = np.linspace(start, end, _CELLS + 1)
        width = (end - start) / _CELLS
        values = np.abs(self._x(times))
        # In units of the width, so that no square of a rate runs out of numbers.
        phases = np.minimum(np.abs(self._x.rates) * width, _FASTEST)
        bends = np.exp(np.multiply.outer(times[:-1], self._x.rates.real)) @ (
            np.abs(self._x.coefficients) * phases**2
        )
        highest = np.maximum(values[:-1], values[1:]) + bends / 8.0
        return _Cells(times, values, bends, highest)

    def _at_one(self, time: float) -> float:
        """Return x at one time, by plain numbers: numpy's overhead is most of the cost there."""
        return sum((c * exp(rate * time)).real for rate, c in self._pairs)

    @cached_property
    def _pairs(self) -> list[tuple[complex, complex]]:
        return list(zip(self._x.rates.tolist(), self._x.coefficients.tolist(), strict=True))


class _Cells(NamedTuple):
    """What is known of |x| in the cells of an interval.

    Attributes:
        times: Their ends, shape (n + 1,).
        values: |x| there.
        bends: Bound of |x''| times the square of the width within each, shape (n,).
        highest: Bound of |x| within each, shape (n,).
    """

    times: Floats
    values: Floats
    bends: Floats
    highest: Floats
