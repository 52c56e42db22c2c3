# SPDX-License-Identifier: Apache-2.0
"""Windows over which a push is averaged: as short as its turning needs and its noise allows."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from limit_surface_ros.checks import Floats

    # Returns the mean twist between two times, and its covariance.
    MeanTwist = Callable[[float, float], tuple[Floats, Floats]]

# A window is halved if its halves' directions differ by so many deviations and so much [rad], if
# those of the halves are known to within so much [rad], and it is longer than this twice [s].
_DEVIATIONS, _DIFFERENCE, _SURE, _SHORTEST = 2.5, 0.03, 0.05, 0.16


@dataclass(frozen=True, eq=False)
class Window:
    """A part of a push.

    Attributes:
        start: [s].
        end: [s].
        twist: Mean over it, shape (3,).
        speed: Of the mean twist, |(vx, vy)| + lever |omega| [m/s].
        deviation: Of the twist's direction in scaled variables [rad].
        acceleration: Change of the speed between its halves, less what noise can make of it
            [m/s^2].
    """

    start: float
    end: float
    twist: Floats
    speed: float
    deviation: float
    acceleration: float


def windows_of(
    start: float, end: float, mean: MeanTwist, length: float, lever: float
) -> list[Window]:
    """Cut a part of a run into windows.

    Args:
        start: Of the part [s].
        end: Of the part [s].
        mean: Returns the mean twist between two times in it, and its covariance.
        length: About that of each window, before any is halved [s].
        lever: Turns angular speed into speed [m].
    """
    count = max(1, round((end - start) / length))
    ends = np.linspace(start, end, count + 1)
    found: list[Window] = []
    for low, high in pairwise(ends):
        _halved(float(low), float(high), mean, lever, found)
    return found


def _halved(low: float, high: float, mean: MeanTwist, lever: float, found: list[Window]) -> None:
    middle = 0.5 * (low + high)
    halves = [mean(low, middle), mean(middle, high)]
    scale = np.array([1.0, 1.0, lever])
    sizes = [float(np.linalg.norm(twist * scale)) for twist, _ in halves]
    sure = [direction_deviation(*half, lever) for half in halves]
    first, second = (
        half[0] * scale / max(s, 1e-300) for half, s in zip(halves, sizes, strict=True)
    )
    difference = float(np.linalg.norm(first - second))
    apart = difference > max(_DEVIATIONS * math.hypot(*sure), _DIFFERENCE)
    if apart and max(sure) < _SURE and high - low >= 2.0 * _SHORTEST:
        _halved(low, middle, mean, lever, found)
        _halved(middle, high, mean, lever, found)
        return
    twist, covariance = mean(low, high)
    change = abs(sizes[1] - sizes[0])
    doubt = sum(float(np.trace(scale * c * scale[:, None])) for _, c in halves) ** 0.5
    acceleration = max(0.0, change - 3.0 * doubt) / max(middle - low, 1e-9)
    deviation = direction_deviation(twist, covariance, lever)
    speed = math.hypot(twist[0], twist[1]) + lever * abs(float(twist[2]))
    found.append(Window(low, high, twist, speed, deviation, acceleration))


def direction_deviation(vector: Floats, covariance: Floats, lever: float) -> float:
    """Return the standard deviation of a twist's direction in scaled variables [rad]."""
    scale = np.array([1.0, 1.0, lever])
    scaled = scale * vector
    size = float(np.linalg.norm(scaled))
    if size == 0.0:
        return float("inf")
    unit = scaled / size
    across = np.eye(3) - np.outer(unit, unit)
    spread = across @ (scale[:, None] * covariance * scale) @ across
    return float(np.sqrt(max(np.trace(spread), 0.0)) / size)
