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
_DEVIATION_OF_MEDIAN = 1.4826


def running_median(values: Floats) -> Floats:
    """Return the median of each sample and three neighbours on either side, shape (n,)."""
    if len(values) < WINDOW:
        return np.full(len(values), float(np.median(values)))
    padded = np.pad(values, WINDOW // 2, mode="reflect")
    medians: Floats = np.median(sliding_window_view(padded, WINDOW), axis=-1)
    return medians


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
