# SPDX-License-Identifier: Apache-2.0
"""Levels of a decaying sum of exponentials: when |x| stays below one, and its supremum.

Intervals are cut into cells, and a cell is passed over only where a bound on the second derivative
proves that |x| cannot exceed the level inside it. What depends on no level is kept for the next.
"""

from __future__ import annotations

from cmath import exp
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from limit_surface_ros.bracket import root_bracket
from limit_surface_ros.errors import SolverError

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.basis import Complexes

# exp(-VANISHED) is zero in double precision.
VANISHED = 800.0
# Cells into which an interval is cut at each level of the search.
_CELLS = 128
# Intervals whose cells are kept, a few kilobytes each.
_KEPT = 256
# Intervals that one search may look at, some 20 microseconds each.
_MOST_INTERVALS = 20_000
# Part of the whole interval to which a time is found.
_RESOLUTION = 1e-15
# Part of a level that counts as none, as rounding leaves more of it.
_EXACT = 4e-16
# Phase in a cell from which on a term is as good as vanished in the next.
_FASTEST = 1e100
# A supremum is proven to this part of itself, unless that takes more cells than this.
_SUPREMUM_TOLERANCE = 1e-3
_MOST_CELLS = 1_000_000
# Cells, times rates, that are looked at in one piece.
_BLOCK = 1 << 18


class LevelSearch:
    """Searches one sum of decaying exponentials and a constant, not all of it zero.

    Args:
        rates: Shape (m,), each 0 or with a real part below 0 [1/s].
        coefficients: Shape (m,), in the unit of x.
    """

    def __init__(self, rates: Complexes, coefficients: Complexes) -> None:
        """Split the constant from what decays."""
        constant = rates == 0.0
        self._rates, self._coefficients = rates[~constant], coefficients[~constant]
        self._constant = float(coefficients[constant].real.sum())
        self._sizes = np.abs(self._coefficients)
        self._pairs: list[tuple[complex, complex]] = list(
            zip(self._rates.tolist(), self._coefficients.tolist(), strict=True)
        )
        # Times, each twice the one before, and sum |c| exp(Re lambda t), as far as asked for.
        self._envelope: list[tuple[float, float]] = []
        self._searched = 0
        # Cells of the intervals that levels led to: alike levels lead to the same ones.
        self._known: dict[tuple[float, float], _Cells] = {}

    def last_excess(self, level: float) -> float | None:
        """Return the last time [s] at which |x| exceeds a level, None if it never does.

        Args:
            level: Above the size of the constant, to which |x| comes in the end.
        """
        if not self._sizes.any():
            return None
        end = self._time_of_envelope(level - abs(self._constant))
        self._searched = 0
        return self._last_within(0.0, end, level, end * _RESOLUTION)

    def supremum(self, start: float) -> float:
        """Return a number that |x| never exceeds from `start` [s] on.

        It is proven, and not above the supremum by more than a thousandth of it unless the terms
        cancel so far that this cannot be told.
        """
        if not self._sizes.any():
            return abs(self._constant)
        constant, enough = abs(self._constant), 1.0 + _SUPREMUM_TOLERANCE
        end = start + 1.0 / float(-self._rates.real.max())
        best = max(constant, float(np.abs(self._at(_even(start, end))).max()))
        while constant + self._envelope_at(end) > enough * best:
            end = start + 2.0 * (end - start)
            best = max(best, float(np.abs(self._at(_even(start, end))).max()))
        lefts = _even(start, end)[:-1]
        width = (end - start) / len(lefts)
        proven, spent = constant + self._envelope_at(end), 0
        while len(lefts):
            cells = [self._look(part, width) for part in _parts(lefts, len(self._rates))]
            values = np.concatenate([values for values, _ in cells])
            highest = np.concatenate([highest for _, highest in cells])
            best = max(best, float(values.max()))
            spent += len(lefts)
            open_cells = highest > enough * best
            proven = max(proven, float(highest[~open_cells].max(initial=0.0)))
            if spent > _MOST_CELLS or not (lefts + width > lefts).all():
                return max(proven, best, float(highest[open_cells].max(initial=0.0)))
            width *= 0.25
            lefts = np.add.outer(lefts[open_cells], width * np.arange(4)).reshape(-1)
        return max(proven, best)

    def _look(self, lefts: Floats, width: float) -> tuple[Floats, Floats]:
        """Return the larger |x| at both ends of cells, and a bound of |x| within."""
        ends = np.maximum(np.abs(self._at(lefts)), np.abs(self._at(lefts + width)))
        envelopes = np.exp(np.multiply.outer(lefts, self._rates.real)) * self._sizes
        phases = np.minimum(np.abs(self._rates) * width, _FASTEST)
        # The envelope itself is the better bound where the phase turns far within a cell.
        within = np.minimum(
            ends + envelopes @ phases**2 / 8.0, abs(self._constant) + envelopes.sum(axis=1)
        )
        return ends, np.maximum(ends, within)

    def _at(self, times: Floats) -> Floats:
        """Return x at times [s], shape (n,)."""
        # All but the constant is zero by then, where an infinite phase would make it NaN.
        last = VANISHED / float(-self._rates.real.max())
        waves = np.exp(np.multiply.outer(np.minimum(times, last), self._rates))
        values: Floats = (waves @ self._coefficients).real + self._constant
        return values

    def _envelope_at(self, time: float) -> float:
        """Return sum |c| exp(Re lambda t), without the constant."""
        return float(self._sizes @ np.exp(self._rates.real * time))

    def _time_of_envelope(self, level: float) -> float:
        """Return a time from which on the envelope is at or below a level above 0."""
        for end, height in self._envelope:
            if height <= level:
                return end
        while True:
            if self._envelope:
                end = 2.0 * self._envelope[-1][0]
            else:
                end = 1.0 / float(np.abs(self._rates.real).max())
            height = self._envelope_at(end)
            self._envelope.append((end, height))
            if height <= level:
                return end

    def _last_within(
        self, start: float, end: float, level: float, resolution: float
    ) -> float | None:
        """Return the last time in [start, end] at which |x| exceeds a level, if there is one."""
        self._searched += 1
        if self._searched > _MOST_INTERVALS:
            raise SolverError(
                f"the last time at which |x| exceeds {level:g} could not be told on "
                f"{_MOST_INTERVALS} intervals: the sum oscillates too fast for its decay"
            )
        cells = self._cells(start, end)
        width = (end - start) / _CELLS
        for cell in np.flatnonzero(cells.highest > level)[::-1].tolist():
            left, right = cells.times[cell : cell + 2].tolist()
            if width <= resolution or not left < 0.5 * (left + right) < right:
                return float(right if cells.values[cell] > level else left)
            if cells.values[cell] > level >= cells.values[cell + 1]:
                slope = sum((c * rate * exp(rate * left)).real for rate, c in self._pairs)
                # Steeper than the curvature can undo, x falls through the level once.
                if abs(slope) * width > cells.curvatures[cell]:
                    return root_bracket(
                        lambda t: level - abs(self._at_one(t)),
                        left,
                        right,
                        resolution,
                        _EXACT * level,
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
        values = np.abs(self._at(times))
        # In units of the width, so that no square of a rate runs out of numbers.
        phases = np.minimum(np.abs(self._rates) * width, _FASTEST)
        envelopes = np.exp(np.multiply.outer(times[:-1], self._rates.real)) * self._sizes
        curvatures = envelopes @ phases**2
        ends = np.maximum(values[:-1], values[1:])
        # The envelope is the better bound where the phase turns far within a cell.
        within = np.minimum(ends + curvatures / 8.0, abs(self._constant) + envelopes.sum(axis=1))
        highest = np.maximum(ends, within)
        return _Cells(times, values, curvatures, highest)

    def _at_one(self, time: float) -> float:
        """Return x at one time, by plain numbers: numpy's overhead is most of the cost there."""
        return self._constant + sum((c * exp(rate * time)).real for rate, c in self._pairs)


class _Cells(NamedTuple):
    """What is known of |x| in the cells of an interval.

    Attributes:
        times: Their ends, shape (n + 1,).
        values: |x| there.
        curvatures: Bound of |x''| times the square of the width within each, shape (n,).
        highest: Bound of |x| within each, shape (n,).
    """

    times: Floats
    values: Floats
    curvatures: Floats
    highest: Floats


def _even(start: float, end: float) -> Floats:
    return np.linspace(start, end, _CELLS + 1)


def _parts(lefts: Floats, rates: int) -> list[Floats]:
    """Return cells in pieces whose waves are not too many at a time."""
    size = max(1, _BLOCK // rates)
    return [lefts[start : start + size] for start in range(0, len(lefts), size)]
