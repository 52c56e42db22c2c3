# SPDX-License-Identifier: Apache-2.0
"""Planar motion over time: its noise, how fast it is, where the body moves and where it rests."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.sample_noise import estimate_noise

if TYPE_CHECKING:
    from limit_surface_ros.checks import Bools, Floats

# Lines over pieces of this length [s] leave what is noise of a lower frequency; it counts if it is
# so many times the variance of the noise from sample to sample.
_PIECE, _SLOW_NOISE = 0.25, 1.5
# Slopes are taken over at most this [s], and over so many samples at least.
LONGEST_SLOPE, _FEWEST = 0.8, 4
# A body moves or rests if its speed is so many deviations above or below what noise makes of it.
_MOVES, _RESTS = 2.5, 1.5
# Without noise, numbers have that of rounding: [m], [rad], and [m/s], [rad/s] of twists.
LEAST_NOISE = np.array([1e-6, 1e-6, 1e-5])


@dataclass(frozen=True, eq=False)
class Motion:
    """Planar motion of a body as it was recorded.

    Attributes:
        times: Shape (n,), increasing [s].
        values: Shape (n, 3): poses (x, y, yaw) of the body in a fixed frame [m, m, rad], yaw
            without jumps, or twists (vx, vy, omega) in the body's frame [m/s, m/s, rad/s].
        are_poses: Which of the two.
        noise: Standard deviation of each column, shape (3,).
    """

    times: Floats
    values: Floats
    are_poses: bool
    noise: Floats

    @property
    def step(self) -> float:
        """The median distance of the samples [s]."""
        return float(np.median(np.diff(self.times)))


@dataclass(frozen=True, eq=False)
class Speeds:
    """How fast a body moves at each sample of its motion.

    Attributes:
        length: Over which slopes were taken [s]; 0 of twists.
        slopes: Shape (n, 3): of poses, in the fixed frame; of twists, those themselves.
        speed: Shape (n,): |(vx, vy)| + lever |omega| [m/s].
        deviation: Of the speed [m/s].
        acceleration: Shape (n,): change of the speed, less what noise can make of it [m/s^2].
        moving: Where the body moves for certain.
        resting: Where it rests by all appearance.
    """

    length: float
    slopes: Floats
    speed: Floats
    deviation: float
    acceleration: Floats
    moving: Bools
    resting: Bools


def motion_of(times: Floats, values: Floats, are_poses: bool) -> Motion:
    """Return a motion with its noise."""
    noise = np.array([_noise(times, column) for column in values.T])
    return Motion(times, values, are_poses, noise)


def _noise(times: Floats, values: Floats) -> float:
    """Return the noise of a column, that of frequencies below the sampling rate included."""
    fine = estimate_noise(times, values)
    count = max(8, round(_PIECE / float(np.median(np.diff(times)))))
    pieces = len(times) // count
    if fine == 0.0 or pieces == 0:
        return fine
    parts = values[: pieces * count].reshape(pieces, count)
    parts = parts - parts.mean(axis=1, keepdims=True)
    ramp = np.arange(count) - (count - 1) / 2.0
    left = parts - np.outer(parts @ ramp / (ramp @ ramp), ramp)
    variances = np.sum(left**2, axis=1) / (count - 2)
    # Where the body moves least evenly, its motion counts: only the quietest quarter is noise.
    quiet = np.argsort(variances)[: max(1, pieces // 4)]
    ratio = float(np.median(variances[quiet])) / fine**2
    if ratio <= _SLOW_NOISE:
        return fine
    still = left[quiet]
    lag = float(np.sum(still[:, 1:] * still[:, :-1]) / np.sum(still**2))
    lag = min(max(lag, 0.0), 0.95)
    return fine * math.sqrt(ratio) * (1.0 + lag) / (1.0 - lag)


def speeds_of(motion: Motion, min_speed: float, lever: float) -> Speeds:
    """Return how fast a body moves.

    Slopes of poses are taken over as long a time as their noise needs to tell half of the least
    speed; of samples that are alike, the deviation of a slope over L is noise sqrt(12 step / L^3).

    Args:
        motion: Of the body.
        min_speed: Slower, it may stick [m/s].
        lever: Turns angular speed into speed [m].
    """
    step, (sx, sy, turn) = motion.step, motion.noise
    if not motion.are_poses:
        deviation = math.hypot(math.hypot(sx, sy), lever * turn)
        speed = _speed(motion.values, lever)
        change = np.gradient(speed, motion.times) if len(speed) > 1 else np.zeros(len(speed))
        acceleration = np.abs(change) - 3.0 * deviation / step
        length, slopes = 0.0, motion.values
    else:
        edge = math.hypot(math.sqrt(2.0) * max(sx, sy), lever * turn)
        length = (12.0 * step * (edge / (min_speed / 2.0)) ** 2) ** (1.0 / 3.0)
        length = min(max(length, _FEWEST * step), max(LONGEST_SLOPE, _FEWEST * step))
        slopes = local_slopes(motion.times, motion.values, length / 2.0)
        deviation = edge * math.sqrt(12.0 * step / length**3)
        speed = _speed(slopes, lever)
        change = local_slopes(motion.times, speed[:, None], length / 2.0)[:, 0]
        # Neighbouring slopes share samples; that of slopes is no better than twice as uncertain.
        acceleration = np.abs(change) - 3.0 * 4.0 * deviation / length
    moving = speed > max(min_speed, _MOVES * deviation)
    resting = speed < max(min_speed / 2.0, _RESTS * deviation)
    return Speeds(length, slopes, speed, deviation, acceleration, moving, resting)


def _speed(rates: Floats, lever: float) -> Floats:
    return np.asarray(np.hypot(rates[:, 0], rates[:, 1]) + lever * np.abs(rates[:, 2]))


def local_slopes(times: Floats, values: Floats, half: float) -> Floats:
    """Return the slopes of straight lines through the samples around each.

    Args:
        times: Shape (n,), increasing [s].
        values: Shape (n, k).
        half: Samples no further away than this count [s].

    Returns:
        Shape (n, k); 0 where a sample is alone.
    """
    first = np.searchsorted(times, times - half * (1.0 + 1e-9))
    last = np.searchsorted(times, times + half * (1.0 + 1e-9), side="right")
    t, x = times - times[0], values - values[0]

    def sums(of: Floats) -> Floats:
        total = np.concatenate([np.zeros((1, of.shape[1])), np.cumsum(of, axis=0)])
        return np.asarray(total[last] - total[first])

    count = (last - first).astype(np.float64)
    t_sum, tt_sum = sums(t[:, None])[:, 0], sums((t * t)[:, None])[:, 0]
    spread = count * tt_sum - t_sum**2
    slopes = count[:, None] * sums(t[:, None] * x) - t_sum[:, None] * sums(x)
    alone = (last - first) < 2
    return np.where(alone[:, None], 0.0, slopes / np.where(alone, 1.0, spread)[:, None])


def stretches(mask: Bools) -> list[tuple[int, int]]:
    """Return (first, last + 1) of each run of true values."""
    steps = np.diff(np.concatenate([[0], mask.astype(np.int8), [0]]))
    starts, ends = np.flatnonzero(steps == 1), np.flatnonzero(steps == -1)
    return [(int(a), int(b)) for a, b in zip(starts, ends, strict=True)]
