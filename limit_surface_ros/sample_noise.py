# SPDX-License-Identifier: Apache-2.0
"""The noise of recorded samples, taken from their divided differences."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_floats
from limit_surface_ros.errors import DataError, ShapeError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats

ORDERS = (2, 3, 4)
# Turns the median of absolute values into a standard deviation, for normal noise.
_DEVIATION_OF_MEDIAN = 1.4826
# Values that change no more often than that are held, and not rounded.
_FEWEST_STEPS = 10
# Rounded values stay on so many levels at least, once in so many samples, and are multiples of a
# step to this part of it.
_FEWEST_LEVELS, _OFTEN, _OFF_STEP = 5, 8, 1e-3


def estimate_noise(times: ArrayLike, values: ArrayLike) -> float:
    """Return the standard deviation of the noise of samples of a smooth function.

    Differences of order m = 2, 3 and 4 over m + 1 neighbours, with weights that are scaled to the
    unit norm, hold the noise at its own size and of the function only what bends over so short a
    span. Each order can only over-estimate the noise by that, so the least of the three is taken;
    outliers do not move a median. Differences of order 2 are those of Gasser, Sroka and
    Jennen-Steinmetz, Biometrika 73, 625-633, 1986, doi 10.1093/biomet/73.3.625.

    Args:
        times: Shape (n,), increasing, at any distances.
        values: Shape (n,).

    Returns:
        The deviation in the unit of `values`; 0 for fewer than 6 samples. Of values that are
        rounded to steps, many of them equal to the one before, at least the step over sqrt(12).

    Raises:
        ShapeError: The two are not lists of one length.
        NotFiniteError: A number is NaN or infinite.
        DataError: The times do not increase.

    Examples:
        >>> times = np.linspace(0.0, 1.0, 1000)
        >>> noise = 0.01 * np.random.default_rng(0).standard_normal(1000)
        >>> round(estimate_noise(times, np.sin(5.0 * times) + noise), 3)
        0.01
    """
    t, x = as_floats("times", times), as_floats("values", values)
    if t.ndim != 1 or t.shape != x.shape:
        raise ShapeError(f"times and values must have one shape (n,), got {t.shape} and {x.shape}")
    if not (np.diff(t) > 0.0).all():
        raise DataError("the times must increase")
    if len(t) < ORDERS[-1] + 2:
        return 0.0
    least = min(_noise_of_order(t, x, order) for order in ORDERS)
    return max(least, _rounding_noise(x))


def _noise_of_order(times: Floats, values: Floats, order: int) -> float:
    count = len(times) - order
    stamps = np.stack([times[i : i + count] for i in range(order + 1)])
    # In units of their own span: products of distances of nanoseconds would underflow.
    stamps = (stamps - stamps[0]) / (stamps[-1] - stamps[0])
    weights = np.ones_like(stamps)
    for i in range(order + 1):
        for j in range(order + 1):
            if i != j:
                weights[i] /= stamps[i] - stamps[j]
    weights /= np.linalg.norm(weights, axis=0)
    differences = sum(weights[i] * values[i : i + count] for i in range(order + 1))
    return float(_DEVIATION_OF_MEDIAN * np.median(np.abs(differences)))


def _rounding_noise(values: Floats) -> float:
    """Return the noise that rounding makes; 0 if the values do not look rounded.

    Rounded values are multiples of one step, or most of their levels are held, and they stay on
    many levels for two samples or more. A response stays on the few levels on which it is
    constant; where it runs straight, up and down, it takes levels again but stays on none.
    """
    stays = np.diff(values) == 0.0
    held = np.unique(values[1:][stays])
    changes, often = np.count_nonzero(~stays), _OFTEN * np.count_nonzero(stays) >= len(values)
    if changes < _FEWEST_STEPS or len(held) < _FEWEST_LEVELS or not often:
        return 0.0
    levels = np.unique(values)
    step = float(np.diff(levels).min())
    multiples = (levels - levels[0]) / step
    on_steps = float(np.abs(multiples - np.round(multiples)).max()) < _OFF_STEP
    return step / math.sqrt(12.0) if on_steps or 2 * len(held) >= len(levels) else 0.0
