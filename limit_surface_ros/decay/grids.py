# SPDX-License-Identifier: Apache-2.0
"""Where a response is met and its largest error is looked for.

Kinks belong into the grid. Of a record nothing is known but its samples, so that they are the
grid. Between two samples a sum may depart from the straight line as far as the samples themselves
depart from straight lines; a departure beyond that counts as error.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.decay.targets import PiecewiseLinear, Record

if TYPE_CHECKING:
    from limit_surface_ros.checks import Bools, Floats
    from limit_surface_ros.decay.exponential_sum import ExponentialSum
    from limit_surface_ros.decay.targets import Target

LEAST_POINTS, MOST_POINTS = 4_000, 40_000
# A steep response changes by this part of its onset within half a step of the grid. Times that
# resolve its start begin well before it has changed by a small part, and are so dense.
MUCH, SMALL, POINTS_A_DECADE = 1e-2, 1e-4, 40
# Where a first change is looked for, in parts of the interval, and on how many points.
FIRST_TIME, CHANGE_POINTS = 1e-16, 641
# Places at which the largest error is looked for between the points of the grid.
MOST_LOOKS = 200
# And between any two samples of a record, as parts of their distance.
LOOKS_BETWEEN = (0.03, 0.15, 0.38, 0.62, 0.85)


def fit_times(response: Target, end: float, fastest: float) -> Floats:
    """Return the times on [0, end] [s] at which a response is to be met.

    Of a record its samples; else the breakpoints and enough to resolve a rate of size `fastest`.
    """
    if isinstance(response, Record):
        return response.knots[response.knots <= end]
    count = int(np.clip(12.0 * end * fastest / np.pi, LEAST_POINTS, MOST_POINTS))
    inside = response.breakpoints[response.breakpoints < end]
    start = graded_start(response, end)
    return np.unique(np.concatenate([np.linspace(0.0, end, count), inside, start]))


def time_of_change(response: Target, end: float, part: float) -> float:
    """Return the first time [s] at which |x - x(0)| reaches a part of |x(0)|; at most `end`."""
    times = np.geomspace(FIRST_TIME * end, end, CHANGE_POINTS)
    onset = float(response(0.0))
    changed = np.flatnonzero(np.abs(response(times) - onset) >= part * abs(onset))
    return float(times[changed[0]]) if len(changed) else end


def is_steep(response: Target, end: float) -> bool:
    """Tell whether a function changes much before the second point of a uniform grid."""
    if isinstance(response, PiecewiseLinear):
        return False
    onset, soon = response(np.array([0.0, 0.5 * end / LEAST_POINTS]))
    return bool(abs(soon - onset) >= MUCH * abs(onset))


def graded_start(response: Target, end: float) -> Floats:
    """Return times that resolve a steep start on every scale [s]; none if it is not steep."""
    if not is_steep(response, end):
        return np.zeros(0)
    first = 0.1 * time_of_change(response, end, SMALL)
    count = round(POINTS_A_DECADE * float(np.log10(end / first))) + 1
    times: Floats = np.append(0.0, np.geomspace(first, end, count))
    return times


def largest_error(x: ExponentialSum, response: Target, start: float, end: float) -> float:
    """Return the largest |x - response| on [start, end] [s], of a record at its samples."""
    times = fit_times(response, end, float(np.abs(x.rates.imag).max()))
    times = times[times >= start]
    return highest_error(x, response, times, np.abs(x(times) - response(times)))


def highest_error(x: ExponentialSum, response: Target, times: Floats, errors: Floats) -> float:
    """Return the largest error between the times too, from a closer look at the highest ones."""
    highest = float(errors.max())
    if isinstance(response, Record):
        return max(highest, _overshoot(x, response, times))
    near = np.flatnonzero(errors >= 0.98 * highest)
    if len(near) > MOST_LOOKS:
        near = near[np.argsort(-errors[near])[:MOST_LOOKS]]
    before, after = times[np.maximum(near - 1, 0)], times[np.minimum(near + 1, len(times) - 1)]
    close = before[:, np.newaxis] + np.multiply.outer(after - before, np.linspace(0.0, 1.0, 33))
    return max(highest, error_at(x, response, close))


def error_at(x: ExponentialSum, response: Target, times: Floats) -> float:
    """Return the largest |x - response| at times [s] of any shape."""
    return float(np.abs(x(times) - response(times)).max())


def _overshoot(x: ExponentialSum, record: Record, times: Floats) -> float:
    """Return how far a sum departs from the lines between samples beyond their own curvature.

    Smooth functions depart from the line by an eighth of the samples' second difference, and no
    sum within their Nyquist frequency by more than about a quarter of it; others are aliases.
    """
    curvature = float(np.abs(np.diff(record(times), 2)).max(initial=0.0))
    # An alias departs between most samples: of very many some are enough.
    every = max(1, len(times) // LEAST_POINTS)
    before, gaps = times[:-1:every, np.newaxis], np.diff(times)[::every]
    between = before + np.multiply.outer(gaps, LOOKS_BETWEEN)
    return error_at(x, record, between) - curvature - error_at(x, record, times)


def peaks(errors: Floats) -> Bools:
    """Tell which of some numbers in a row, shape (n,), are no smaller than their neighbours."""
    rising = np.append(True, errors[1:] >= errors[:-1])
    falling = np.append(errors[:-1] >= errors[1:], True)
    found: Bools = rising & falling
    return found
