# SPDX-License-Identifier: Apache-2.0
"""How late the stamps of the wrenches are beside those of the motion.

The load of a sliding body is a function of the direction of its twist. A general odd function of
it, and a constant for the sensor's bias, are fitted to the loads as they would be for each delay;
the true delay leaves least. Changes of direction tell it. Where pushes keep their direction the
least is flat, and the delay does no harm. When loads begin and end is not used: they lead the
slip, and stay after it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats

LARGEST_DELAY, _STEP = 0.5, 0.01
# Loads of so long a motion count as one independent sample [s]; the interval is that of three
# deviations of three components.
_INDEPENDENT, _DEVIATIONS, _PARTS = 0.5, 3.0, 3
# Less motion [s], or fewer samples, tell nothing.
_LEAST_MOTION, _FEWEST = 3.0, 60
# Directions are no better known than this [rad]: the body is no such function exactly.
_SCATTER, _DEGREE = 0.02, 5
# What is left of loads that are explained to the last digit.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class ClockOffset:
    """How late wrenches are stamped.

    Attributes:
        delay: [s]; above 0 if wrenches are stamped later than the motion they belong to.
        low: Lower end of the interval of delays that the recording allows [s].
        high: Its upper end [s].
        applied: Whether the wrenches' times were corrected by it.
    """

    delay: float
    low: float
    high: float
    applied: bool


def find_delay(
    wrench_times: Floats,
    wrenches: Floats,
    times: Floats,
    twists: Floats,
    deviations: Floats,
    lever: float,
) -> ClockOffset | None:
    """Estimate the delay of the wrenches.

    Args:
        wrench_times: Shape (n,), increasing [s].
        wrenches: Shape (n, 3), in the body's frame.
        times: Shape (m,), within runs, at even distances of 10 ms inside each [s].
        twists: Shape (m, 3), at those times.
        deviations: Of their directions, shape (m,) [rad].
        lever: Turns angular speed into speed [m].

    Returns:
        The delay, applied if 0 is outside its interval; None where there is too little motion.
    """
    within = (times > wrench_times[0] + LARGEST_DELAY) & (times < wrench_times[-1] - LARGEST_DELAY)
    times, twists = times[within], twists[within]
    weights = 1.0 / np.hypot(deviations[within], _SCATTER)[:, None]
    moved = len(times) * _STEP
    if len(times) < _FEWEST or moved < _LEAST_MOTION:
        return None
    basis = np.linalg.qr(weights * _functions(twists * np.array([1.0, 1.0, lever])))[0]
    totals = np.concatenate(
        [np.zeros((1, 3)), np.cumsum(wrenches / np.array([1.0, 1.0, lever]), axis=0)]
    )

    def cost(delay: float) -> float:
        low = np.searchsorted(wrench_times, times + delay - 0.5 * _STEP)
        high = np.maximum(np.searchsorted(wrench_times, times + delay + 0.5 * _STEP), low + 1)
        high = np.minimum(high, len(wrench_times))
        low = np.minimum(low, high - 1)
        loads = weights * (totals[high] - totals[low]) / (high - low)[:, None]
        power = float(np.sum(loads**2))
        return max(power - float(np.sum((basis.T @ loads) ** 2)), _ROUNDING * power)

    most = round(LARGEST_DELAY / _STEP)
    delays = _STEP * np.arange(-most, most + 1)
    costs = np.array([cost(delay) for delay in delays])
    least = int(np.argmin(costs))
    limit = costs[least] * (1.0 + _DEVIATIONS**2 / (_PARTS * moved / _INDEPENDENT))
    allowed = delays[costs <= limit]
    delay = float(delays[least])
    if 0 < least < len(delays) - 1:
        before, at, after = costs[least - 1 : least + 2]
        curve = before - 2.0 * at + after
        if curve > 0.0:
            delay += 0.5 * _STEP * float((before - after) / curve)
    low, high = float(allowed[0]) - 0.5 * _STEP, float(allowed[-1]) + 0.5 * _STEP
    return ClockOffset(delay, low, high, not low <= 0.0 <= high)


def _functions(scaled: Floats) -> Floats:
    """Return odd functions of unit twists and a constant, shape (m, 25)."""
    v = scaled / np.maximum(np.linalg.norm(scaled, axis=1, keepdims=True), 1e-300)
    x, y, w = v.T
    # On the unit sphere those of degree 5 span those of degree 1 and 3, too.
    powers = [
        x**i * y**j * w ** (_DEGREE - i - j)
        for i in range(_DEGREE + 1)
        for j in range(_DEGREE + 1 - i)
    ]
    return np.column_stack([np.ones(len(v)), *powers, v * np.abs(v)])
