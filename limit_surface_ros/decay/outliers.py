# SPDX-License-Identifier: Apache-2.0
"""Outliers of a record: samples that stand out from their own neighbours.

A model that misses a response misses neighbouring samples alike, an outlier misses alone. So a
residual counts by how far it stands out from its neighbours' residuals, and never by its size
alone: weights by size (Tukey's) take the steep start of exp(-t^0.3) for an outlier.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from limit_surface_ros.sample_noise import estimate_noise

if TYPE_CHECKING:
    from limit_surface_ros.checks import Bools, Floats

# Samples in a running median.
WINDOW = 7
# A sample this many deviations from the running median is left out before any fit, beside as many
# times the spread of the medians around it.
HAMPEL, SPREADS = 6.5, 1.5
# Its weight falls from so many deviations of a residual on, and is 0 from twice as many.
HALF_GATE = 3.0
# A stray sample is so many times as far from its neighbours as they are from each other.
STRAY = 5.0
# A steep start has no neighbours before it.
EXEMPT = 3
# A first sample stands alone that is so many times as far from the line through the next two as
# those after it are from theirs: a term that falls to a twentieth within a step has no other.
ALONE, FOLLOWING = 20.0, 6
# It is doubtful if it is off by this part of the largest of the next samples, astray by so many.
DOUBTFUL, ASTRAY = 0.5, 10.0
# A power law to its next samples explains it that is cut off no later than this part of a step.
POWER_FROM = 1.0 / 400.0
# A longer first step, in parts of the second, may have hidden anything.
LONGEST_STEP = 1.5
_DEVIATION_OF_MEDIAN = 1.4826


def running_median(values: Floats) -> Floats:
    """Return the median of each sample and three neighbours on either side, shape (n,)."""
    if len(values) < WINDOW:
        return np.full(len(values), float(np.median(values)))
    padded = np.pad(values, WINDOW // 2, mode="reflect")
    medians: Floats = np.median(sliding_window_view(padded, WINDOW), axis=-1)
    return medians


def resting_median(values: Floats) -> float:
    """Return the median of the last tenth of values, about a constant to which they decay."""
    return float(np.median(values[-max(1, len(values) // 10) :]))


def stand_out(values: Floats, noise: float) -> Bools:
    """Mark samples that no smooth response holds, by Hampel's filter over seven samples.

    Args:
        values: Shape (n,).
        noise: Their standard deviation, in the same unit.
    """
    if len(values) < 2 * WINDOW:
        return np.zeros(len(values), dtype=bool)
    # The last samples have neighbours on one side only: there the record is taken to go on as
    # straight as it came, or the last of a slope would stand out from the median before it.
    last = values[-WINDOW:]
    slope = np.median(np.diff(last))
    ahead = np.median(last) + slope * (WINDOW // 2 + np.arange(1, WINDOW // 2 + 1))
    medians = running_median(np.append(values, ahead))[: len(values)]
    windows = sliding_window_view(np.pad(medians, WINDOW // 2, mode="edge"), WINDOW)
    spread = windows.max(axis=-1) - windows.min(axis=-1)
    marked: Bools = np.abs(values - medians) > HAMPEL * noise + SPREADS * spread
    marked[:EXEMPT] = False
    return marked


def holds_strays(values: Floats, noise: float) -> bool:
    """Tell whether samples stand out that neither a kink nor a jump of a response would explain.

    A stray sample is further from the two on either side than these are from each other, by far.
    One of the last two, which have no such neighbours, is further so from the four before them,
    and larger: a load that is gone with the last sample is none, no decaying one comes back.

    Args:
        values: Shape (n,).
        noise: Their standard deviation, in the same unit.
    """
    marked = stand_out(values, noise)
    inner = np.flatnonzero(marked[2:-2]) + 2
    around = values[inner[:, np.newaxis] + np.array([-2, -1, 1, 2])]
    away = np.abs(values[inner, np.newaxis] - around).min(axis=1)
    if (away > STRAY * (np.ptp(around, axis=1) + noise)).any():
        return True
    before, last = values[-6:-2], values[-2:][marked[-2:]]
    away = np.abs(last[:, np.newaxis] - before).min(axis=1)
    grown = np.abs(last) > np.abs(before).max()
    return bool((grown & (away > STRAY * (np.ptp(before) + noise))).any())


def starts_alone(times: Floats, values: Floats, noise: float) -> bool:
    """Tell whether the first sample is far from all that the next ones let expect of it.

    One sample does not tell a term that is gone with the second from a stray sample. A term that
    lives on for a few samples bends the record there, too, and so does any steep start.

    Args:
        times: Shape (n,), increasing [s].
        values: Shape (n,), less a constant to which they decay.
        noise: Their standard deviation, in the same unit.
    """
    return _excess(times, values, noise) > DOUBTFUL


def onset_size(times: Floats, values: Floats, noise: float) -> float:
    """Return |x| at the onset, of the samples after the first where that stands alone.

    Args:
        times: Shape (n,), increasing [s].
        values: Shape (n,).
        noise: Their standard deviation, in the same unit.
    """
    if starts_alone(times, values, noise):
        return float(np.abs(values[1 : FOLLOWING + 2]).max())
    return float(abs(values[0]))


def stray_start(times: Floats, values: Floats, noise: float) -> Bools:
    """Mark the first two samples where they are astray, shape (n,).

    The first is that stands alone and is ten times as far off as the next ones are large, unless
    these follow a power law, as erfcx(sqrt(t)) does, that comes from as high. The second is by
    the rule of all within a record; both are if they have opposite signs and are as large.

    Args:
        times: Shape (n,), increasing [s].
        values: Shape (n,), less a constant to which they decay.
        noise: Their standard deviation, in the same unit.
    """
    strays = np.zeros(len(values), dtype=bool)
    if len(values) < 2 * WINDOW:
        return strays
    around = values[[0, 2, 3, 4]]
    away = float(np.abs(values[1] - around).min())
    gate = max(HAMPEL * noise, STRAY * (float(np.ptp(around)) + noise))
    if away > gate:
        strays[1] = True
    elif _is_astray(times, values, noise):
        strays[0] = True
    elif values[0] * values[1] < 0.0 and _is_astray(times[1:], values[1:], noise):
        strays[:2] = np.abs(values[:2]) > ASTRAY * np.abs(values[2 : 2 + FOLLOWING]).max()
    return strays


def _is_astray(times: Floats, values: Floats, noise: float) -> bool:
    excess = _excess(times, values, noise, certain=True)
    if excess <= ASTRAY:
        return False
    one, two, four = values[[1, 2, 4]]
    if not (one > two > four > 0.0 or one < two < four < 0.0):
        return True
    power = np.log(one / two) / np.log((times[2] - times[0]) / (times[1] - times[0]))
    return bool(values[0] / one < 0.0 or excess > POWER_FROM**-power)


def _excess(times: Floats, values: Floats, noise: float, certain: bool = False) -> float:
    """Return how far the first sample is off, in parts of the next ones; 0 if it is not alone.

    Args:
        times: Shape (n,), increasing [s].
        values: Shape (n,).
        noise: Their standard deviation.
        certain: Whether noise may hide what would explain the sample.
    """
    if len(values) < 2 * WINDOW or times[1] - times[0] > LONGEST_STEP * (times[2] - times[1]):
        return 0.0
    t, x = times[: FOLLOWING + 2], values[: FOLLOWING + 2]
    if certain:
        # Of short records it is taken for nothing.
        noise = max(noise, estimate_noise(times[1:], values[1:]))
    steps = np.diff(t)
    ahead = x[1:-1] + (x[1:-1] - x[2:]) * steps[:-1] / steps[1:]
    off = np.abs(x[:-2] - ahead)
    # Noise of a sample and of the line through the next two.
    spread = noise * float(np.sqrt(6.0))
    bent = float(off[1:].max())
    bent = bent + spread if certain else max(0.0, bent - 1.5 * spread)
    if off[0] <= max(ALONE * bent, HAMPEL * spread):
        return 0.0
    return float(off[0]) / max(float(np.abs(x[1:]).max()), noise)


def neighbour_weights(residuals: Floats, noise: float) -> Floats:
    """Return the weights of samples by their residuals, 1 for most and 0 for outliers.

    Args:
        residuals: Sample minus model, shape (n,).
        noise: Standard deviation of the samples; the residuals' own is taken if it is larger.
    """
    size = np.abs(residuals - np.median(residuals))
    scale = max(_DEVIATION_OF_MEDIAN * float(np.median(size)), noise)
    if scale == 0.0:
        return np.ones(len(residuals))
    alone = np.minimum(np.abs(residuals), np.abs(residuals - running_median(residuals)))
    u = alone / (2.0 * HALF_GATE * scale)
    weights = np.where(u < 0.5, 1.0, np.maximum(1.0 - u**2, 0.0))
    weights[:EXEMPT] = 1.0
    return weights
