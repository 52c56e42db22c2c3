# SPDX-License-Identifier: Apache-2.0
"""Impulses in a sampled memory kernel: discrete delays and their strengths.

A kink of the response puts an impulse into its kernel, which rises as 1 / step when the samples
get closer; everything else in the kernel stays. Forward differences spread the kernel on
(t_k - step, t_k] into sample k.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from limit_surface_ros.checks import as_positive

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.delay.kernel import MemoryKernel

# Samples on either side that show the background, and those next to an impulse that do not.
WINDOW, SKIPPED = 10, 3
# A peak of which less than this remains in sum is no impulse.
LEAST_NET = 1e-3


@dataclass(frozen=True, eq=False)
class Impulses:
    """Impulses of a memory kernel.

    Attributes:
        delays: Shape (k,), increasing [s].
        strengths: Shape (k,) [1/s].
    """

    delays: Floats
    strengths: Floats


def find_impulses(kernel: MemoryKernel, threshold: float = 0.02) -> Impulses:
    """Return the impulses of a sampled kernel, located between the samples.

    Args:
        kernel: At least 30 samples; impulses closer than 14 samples cannot be told apart.
        threshold: Impulses weaker than this fraction of the strongest are taken as noise.

    Raises:
        RangeError: The threshold is not a number above 0.
    """
    fraction = as_positive("threshold", threshold)
    values, step = kernel.values, kernel.step
    if len(values) < 3 * WINDOW:
        return Impulses(np.zeros(0), np.zeros(0))
    excess = _excess(values)
    peaks = np.flatnonzero(excess > max(fraction * float(excess.max()), 1e-9))
    found: list[tuple[float, float]] = []
    # The first sample holds nothing but the impulse at 0, which is x'(0) / x(0).
    if abs(values[0]) > 5.0 * float(np.abs(values[1 : WINDOW + 1]).max()):
        found.append((0.0, float(values[0] * step)))
    strongest = -1
    for cluster in np.split(peaks, np.flatnonzero(np.diff(peaks) > SKIPPED) + 1):
        if len(cluster) == 0 or cluster[0] <= SKIPPED:
            continue
        strongest = int(cluster[np.argmax(np.abs(values[cluster]))])
        found.append(_measure(kernel, strongest))
    weight = max((abs(strength) for _, strength in found), default=0.0)
    kept = [pair for pair in found if pair[1] and abs(pair[1]) >= fraction * weight]
    return Impulses(np.array([d for d, _ in kept]), np.array([c for _, c in kept]))


def _excess(values: Floats) -> Floats:
    """How far each sample stands out of its neighbours, beyond five times their own range."""
    reach = WINDOW + SKIPPED
    padded = np.pad(values[1:], (reach + 1, reach), mode="edge")
    windows = sliding_window_view(padded, 2 * reach + 1)
    sides = np.concatenate([windows[:, :WINDOW], windows[:, -WINDOW:]], axis=1)
    low, high = sides.min(axis=1), sides.max(axis=1)
    excess: Floats = np.abs(values - 0.5 * (low + high)) - 5.0 * (high - low)
    excess[0] = 0.0
    return excess


def _measure(kernel: MemoryKernel, peak: int) -> tuple[float, float]:
    """Return delay and strength of the impulse at a sample, above the background there."""
    values, step = kernel.values, kernel.step
    around = np.arange(-SKIPPED + 1, SKIPPED) + peak
    around = around[(around > 0) & (around < len(values))]
    before = np.arange(max(1, peak - WINDOW - SKIPPED), peak - SKIPPED + 1)
    after = np.arange(peak + SKIPPED, min(len(values), peak + SKIPPED + WINDOW))
    left = np.poly1d(np.polyfit(before - peak, values[before], min(2, len(before) - 1)))
    right = np.poly1d(np.polyfit(after - peak, values[after], min(2, len(after) - 1)))
    place = 0.0
    for _ in range(3):
        # Sample k holds the kernel on (k - 1, k]: the part right of the impulse is after it.
        share = np.clip(around - peak - place, 0.0, 1.0)
        background = (1.0 - share) * left(around - peak) + share * right(around - peak)
        excess = values[around] - background
        if abs(excess.sum()) <= LEAST_NET * np.abs(excess).sum():
            # Two kinks between two samples: their impulses cancel, and have no place.
            return peak * step, 0.0
        place = float(excess @ (around - peak) / excess.sum())
    return (peak + place) * step, float(excess.sum() * step)
