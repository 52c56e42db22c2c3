# SPDX-License-Identifier: Apache-2.0
"""Noisy records: how noisy they are, and the piecewise linear response behind them.

A memory kernel differentiates, so that noise of 1 % in the samples drowns it. A linear spline of
few cells, fitted to all samples, has a kernel that can be trusted, in closed form.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.decay.outliers import onset_size
from limit_surface_ros.decay.targets import PiecewiseLinear, Record
from limit_surface_ros.sample_noise import estimate_noise

if TYPE_CHECKING:
    from limit_surface_ros.decay.targets import Target

# Fewer samples cannot tell noise from shape.
LEAST_SAMPLES = 60
# Noise below this part of the onset is left alone.
TOLERATED = 5e-4
CELLS_TO_SETTLE, MOST_CELLS = 4, 36
# A record ends at a constant whose last two tenths have means that differ by no more than this
# part of it; smaller ones than this part of the onset do not count.
SAME_LEVEL, LEAST_LEVEL = 0.01, 0.01


def noise_level(response: Target) -> float:
    """Return the standard deviation of a record's noise, in the unit of x; 0 if it has none.

    A smooth or piecewise linear response leaves next to nothing in the divided differences from
    which it is taken, see `estimate_noise`.
    """
    if not isinstance(response, PiecewiseLinear) or len(response.knots) < LEAST_SAMPLES:
        return 0.0
    return estimate_noise(response.knots, response.values)


def is_noisy(response: Target) -> bool:
    """Tell whether a record's noise is more than its kernel or a polished fit could stand."""
    noise = noise_level(response)
    if not noise or not isinstance(response, PiecewiseLinear):
        return False
    return noise > TOLERATED * onset_size(response.knots, response.values, noise)


def settling_time(response: Target, end: float) -> float:
    """Return the time [s] from which on |x| stays below 1 % of its largest value, or its noise."""
    times = np.linspace(0.0, end, 4001)
    sizes = np.abs(response(times))
    level = max(0.01 * float(sizes.max()), 5.0 * noise_level(response))
    above = np.flatnonzero(sizes > level)
    return float(times[min(above[-1] + 1, len(times) - 1)]) if len(above) else end


def resting_level(record: Record, end: float) -> float | None:
    """Return the constant other than 0 at which a record on [0, end] ends; None if it does not.

    Such a constant is an offset, as a sensor's bias, and no part of a response that decays.
    """
    values = record.values[record.knots <= end]
    tenth = len(values) // 10
    if tenth < 2:
        return None
    before, last = values[-2 * tenth : -tenth], values[-tenth:]
    level, noise = float(last.mean()), noise_level(record)
    # Means of noise, and the spread of as many numbers of it.
    mean_noise, spread = noise / np.sqrt(tenth), 2.0 * SAME_LEVEL * abs(level) + 8.0 * noise
    stays = (
        abs(float(before.mean()) - level) <= SAME_LEVEL * abs(level) + 3.0 * mean_noise
        and float(np.ptp(last)) <= spread
    )
    onset = onset_size(record.knots[: len(values)], values, noise)
    fell = max(LEAST_LEVEL * onset, 5.0 * mean_noise) < abs(level) < 0.9 * onset
    return level if stays and fell else None


def smoothed(response: Target, end: float) -> Target:
    """Return a noisy record on [0, end] as a linear spline of few cells; others as they are."""
    if not isinstance(response, PiecewiseLinear) or not is_noisy(response):
        return response
    cell = max(settling_time(response, end) / CELLS_TO_SETTLE, end / MOST_CELLS)
    knots = np.linspace(0.0, end, max(2, round(end / cell) + 1))
    times = response.knots[response.knots <= end]
    # Each column is the hat function of one knot.
    hats = np.maximum(0.0, 1.0 - np.abs(times[:, np.newaxis] - knots) / knots[1])
    values, *_ = np.linalg.lstsq(hats, response.values[: len(times)], rcond=None)
    return PiecewiseLinear(knots, values)
