# SPDX-License-Identifier: Apache-2.0
"""Recordings of pushes as a laboratory would make them, of a body that is known.

They show what a sensor, a tracker and a way to push are good for before anything is bought or
recorded, and test what reads real ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.files.recordings.pushes import IN_PLANE, Recording

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.base import LimitSurface

# True motion and load are known at so many times a second.
_FINE = 2000.0
# How long a load takes to rise before the slip, and to go after it, and the speed to change [s].
_LOADING, _UNLOADING, _RAMP = 0.15, 0.1, 0.1
_LEANING_LOAD = 0.8


@dataclass(frozen=True)
class RecordingPlan:
    """How pushes are made and recorded.

    Attributes:
        pushes: How many.
        moving: How long the body moves in each [s].
        resting: How long it rests between two [s].
        leaning: How long the pusher leans on the body after each [s].
        speeds: Least and most of the body's edge [m/s].
        wander: How far the direction of the twist wanders to both sides in a push [rad].
        lever: Turns angular speed into speed [m].
        wrench_rate: Wrenches a second [Hz].
        pose_rate: Poses a second [Hz].
        wrench_noise: Deviation of a force [N]; that of the moment is this times the lever.
        pose_noise: Deviation of a position [m].
        yaw_noise: Deviation of a yaw [rad].
        rounded: Whether poses are rounded to steps of these sizes, instead of noise.
        jitter: Time over which the poses' noise is correlated [s].
        lost: Share of the poses that are lost.
        bias: Of the sensor: fx, fy, tau_z [N, N, N m].
        drift: Change of that over the recording.
        delay: How late wrenches are stamped [s].
    """

    pushes: int = 30
    moving: float = 1.7
    resting: float = 0.8
    leaning: float = 0.0
    speeds: tuple[float, float] = (0.007, 0.045)
    wander: float = 0.4
    lever: float = 0.05
    wrench_rate: float = 500.0
    pose_rate: float = 100.0
    wrench_noise: float = 0.05
    pose_noise: float = 0.0
    yaw_noise: float = 0.0
    rounded: bool = False
    jitter: float = 0.0
    lost: float = 0.0
    bias: tuple[float, float, float] = (0.0, 0.0, 0.0)
    drift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    delay: float = 0.0


@dataclass(frozen=True, eq=False)
class SimulatedRecording:
    """A recording, and what truly happened.

    Attributes:
        recording: As it was recorded, with a constant vertical force of 9 N.
        times: Shape (n,) [s].
        twists: True twists in the body's frame, shape (n, 3).
        wrenches: True loads on the body, shape (n, 3).
    """

    recording: Recording
    times: Floats
    twists: Floats
    wrenches: Floats

    def means(self, windows: Floats) -> tuple[Floats, Floats]:
        """Return true mean twists and loads over windows of shape (k, 2), both of shape (k, 3)."""
        first, last = np.searchsorted(self.times, windows.T)
        parts = [slice(a, max(b, a + 1)) for a, b in zip(first, last, strict=True)]
        return (
            np.array([self.twists[part].mean(axis=0) for part in parts]),
            np.array([self.wrenches[part].mean(axis=0) for part in parts]),
        )


def simulate_recording(
    surface: LimitSurface, plan: RecordingPlan | None = None, seed: int = 0
) -> SimulatedRecording:
    """Return a recording of a body that is pushed around.

    Args:
        surface: Of the body.
        plan: How it is pushed and recorded.
        seed: Of all that is random.
    """
    how, rng = plan or RecordingPlan(), np.random.default_rng(seed)
    cycle = how.resting + how.moving + how.leaning
    times = np.arange(int(how.pushes * cycle * _FINE)) / _FINE
    twists, loads = np.zeros((len(times), 3)), np.zeros((len(times), 3))
    for push in range(how.pushes):
        _add_push(surface, how, rng, times - (push * cycle + 0.5 * how.resting), twists, loads)
    poses = _poses_of(times, twists)
    return SimulatedRecording(_recorded(how, rng, times, poses, loads), times, twists, loads)


def _smooth_step(x: Floats) -> Floats:
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


def _add_push(
    surface: LimitSurface,
    how: RecordingPlan,
    rng: np.random.Generator,
    since: Floats,
    twists: Floats,
    loads: Floats,
) -> None:
    """Add the twists and loads of one push, at times since it began to slip."""
    main = rng.normal(size=3)
    main /= np.linalg.norm(main)
    aside = np.cross(main, rng.normal(size=3))
    aside /= np.linalg.norm(aside)
    phase, period = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(1.5, 2.5)
    speed = rng.uniform(*how.speeds)
    moving = (since >= 0.0) & (since <= how.moving)
    u = since[moving]
    angle = how.wander * np.sin(2.0 * np.pi * u / period + phase)
    directions = np.cos(angle)[:, None] * main + np.sin(angle)[:, None] * aside
    directions[:, 2] /= how.lever
    ramps = _smooth_step(u / _RAMP) * _smooth_step((how.moving - u) / _RAMP)
    twists[moving] = directions * (speed * ramps)[:, None]
    loads[moving] = surface.wrench_of_twist(directions)
    first, last = loads[moving][0], loads[moving][-1]
    before = (since >= -_LOADING) & (since < 0.0)
    loads[before] = first * _smooth_step(1.0 + since[before] / _LOADING)[:, None]
    leaning = (since > how.moving) & (since <= how.moving + how.leaning)
    loads[leaning] = _LEANING_LOAD * last
    left = since - how.moving - how.leaning
    going = (left > 0.0) & (left <= _UNLOADING)
    share = _LEANING_LOAD if how.leaning else 1.0
    loads[going] = share * last * (1.0 - _smooth_step(left[going] / _UNLOADING))[:, None]


def _poses_of(times: Floats, twists: Floats) -> Floats:
    """Return x, y and yaw by integration, from (0, 0, 0.3)."""

    def integral(rates: Floats) -> Floats:
        steps = 0.5 * (rates[1:] + rates[:-1]) * np.diff(times)
        return np.concatenate([[0.0], np.cumsum(steps)])

    yaw = 0.3 + integral(twists[:, 2])
    cos, sin = np.cos(yaw), np.sin(yaw)
    x = integral(cos * twists[:, 0] - sin * twists[:, 1])
    y = integral(sin * twists[:, 0] + cos * twists[:, 1])
    return np.column_stack([x, y, yaw])


def _recorded(
    how: RecordingPlan, rng: np.random.Generator, times: Floats, poses: Floats, loads: Floats
) -> Recording:
    wrench_times = np.arange(0.0, times[-1], 1.0 / how.wrench_rate)
    sampled = np.column_stack([np.interp(wrench_times, times, column) for column in loads.T])
    scale = np.array([1.0, 1.0, how.lever])
    sampled += how.wrench_noise * scale * rng.normal(size=sampled.shape)
    sampled += np.array(how.bias) + np.outer(wrench_times / times[-1], how.drift)
    wrenches = np.zeros((len(sampled), 6))
    wrenches[:, IN_PLANE] = sampled
    wrenches[:, 2] = 9.0
    pose_times = np.arange(0.0, times[-1], 1.0 / how.pose_rate)
    motions = np.column_stack([np.interp(pose_times, times, column) for column in poses.T])
    sizes = np.array([how.pose_noise, how.pose_noise, how.yaw_noise])
    if how.rounded:
        motions = np.round(motions / sizes) * sizes
    else:
        motions += sizes * _noise(how, rng, motions.shape)
    kept = rng.random(len(pose_times)) >= how.lost
    return Recording(wrench_times + how.delay, wrenches, pose_times[kept], motions[kept], True)


def _noise(how: RecordingPlan, rng: np.random.Generator, shape: tuple[int, ...]) -> Floats:
    """Return noise of unit deviation, of one sample with the next as far as the jitter says."""
    noise = rng.normal(size=shape)
    if how.jitter > 0.0:
        kept = float(np.exp(-1.0 / (how.pose_rate * how.jitter)))
        for row in range(1, len(noise)):
            noise[row] = kept * noise[row - 1] + np.sqrt(1.0 - kept**2) * noise[row]
    return noise
