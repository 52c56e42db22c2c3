# SPDX-License-Identifier: Apache-2.0
"""Which parts of a recording are quasi-static pushes, and the pairs that they give."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_positive
from limit_surface_ros.errors import DataError
from limit_surface_ros.files.recordings.motion import stretches
from limit_surface_ros.files.recordings.windows import windows_of
from limit_surface_ros.surface.pairs import Pairs

if TYPE_CHECKING:
    from limit_surface_ros.checks import Bools, Floats
    from limit_surface_ros.files.recordings.motion import Motion, Speeds
    from limit_surface_ros.files.recordings.windows import Window

# Real pushes scatter by so much [rad] however well they are measured: no pair weighs more.
_SCATTER = 0.02
# A motion whose direction is less certain than this [rad] may be none.
_UNSURE = 0.3


@dataclass(frozen=True)
class Selection:
    """Which parts of a recording are quasi-static pushes, and how they are made comparable.

    Speed is |(vx, vy)| + |omega| times the lever: about that of the body's edge.

    Attributes:
        max_gap: A wrench counts only between two motion samples no further apart than this [s].
        min_speed: Slower, the body may stick [m/s].
        max_speed: Faster, inertia may count [m/s].
        max_acceleration: A larger change of speed is not quasi-static [m/s^2].
        min_force: A smaller force does not push [N].
        window: Pushes are averaged over windows of about this length [s], halved where the motion
            turns; what is left of a push that is shorter than half of it is dropped.
        lever: Turns angular speed into speed [m].
    """

    max_gap: float = 0.1
    min_speed: float = 0.002
    max_speed: float = 0.1
    max_acceleration: float = 0.5
    min_force: float = 0.1
    window: float = 0.5
    lever: float = 0.05

    def __post_init__(self) -> None:
        """Check that every rule is a number above zero."""
        for name, value in vars(self).items():
            as_positive(name, value)


@dataclass(frozen=True, eq=False)
class Run:
    """A part of a run in which the mean twist of any interval is known."""

    start: float
    end: float
    mean: Callable[[float, float], tuple[Floats, Floats]]
    at: Callable[[Floats], Floats]


class Selected:
    """The windows that every rule lets through, and how many wrenches each rule dropped."""

    def __init__(
        self,
        rules: Selection,
        motion: Motion,
        speeds: Speeds,
        runs: list[Run],
        times: Floats,
        loads: Floats,
        noise: Floats,
        not_finite: int,
    ) -> None:
        """Select; see the attributes of `RecordedPushes` for what is given.

        Args:
            rules: What counts as a push.
            motion: Of the body.
            speeds: How fast it is.
            runs: When it moves.
            times: Of the wrenches, on the clock of the motion [s].
            loads: In the body's frame, (fx, fy, tau_z), one for each time.
            noise: Of these three.
            not_finite: How many wrenches were left out before.

        Raises:
            DataError: No part is a quasi-static push.
        """
        self._rules, self._times, self._loads, self._noise = rules, times, loads, noise
        self.dropped = {"with a number that is not finite": not_finite}
        kept = self._kept(motion, speeds, runs)
        self.windows: list[tuple[Window, tuple[int, int]]] = []
        short = fast = 0
        for first, last in self._parts(kept):
            for run in runs:
                low, high = (
                    max(run.start, float(times[first])),
                    min(run.end, float(times[last - 1])),
                )
                if high <= low:
                    continue
                inside = np.searchsorted(times, [low, high])
                if high - low < 0.5 * rules.window:
                    short += int(inside[1] - inside[0])
                    continue
                for window in windows_of(low, high, run.mean, rules.window, rules.lever):
                    part = np.searchsorted(times, [window.start, window.end])
                    count = int(part[1] - part[0])
                    if window.deviation > _UNSURE or window.speed < rules.min_speed:
                        self.dropped["too slow"] += count
                    elif window.acceleration > rules.max_acceleration:
                        fast += count
                    elif count:
                        self.windows.append((window, (int(part[0]), int(part[1]))))
        self.dropped["accelerating"] += fast
        self.dropped["in pushes too short"] = short
        if not self.windows:
            told = ", ".join(f"{count} {rule}" for rule, count in self.dropped.items() if count)
            count = len(times) + not_finite
            slip = ""
            if self.dropped["too fast"] > count / 10 and rules.max_speed < 1.0:
                usual = float(np.median(speeds.speed[speeds.moving]))
                if rules.min_speed < 1e-3 * usual < rules.max_speed:
                    slip = f"; the usual speed is {usual:.3g} m/s: are positions in millimetres?"
            raise DataError(f"no part is a quasi-static push; of {count} wrenches {told}{slip}")

    def _kept(self, motion: Motion, speeds: Speeds, runs: list[Run]) -> Bools:
        """Return which wrenches the rules for single samples let through, and count the others."""
        rules, times = self._rules, self._times
        after = np.clip(np.searchsorted(motion.times, times), 1, len(motion.times) - 1)
        gaps = motion.times[after] - motion.times[after - 1]
        inside = (times >= motion.times[0]) & (times <= motion.times[-1])
        speed = np.interp(times, motion.times, speeds.speed)
        change = np.interp(times, motion.times, speeds.acceleration)
        moving = np.zeros(len(times), dtype=bool)
        for run in runs:
            low, high = np.searchsorted(times, [run.start, run.end])
            moving[low : high + 1] = True
        lets_through = {
            "without motions near them": inside & (gaps <= rules.max_gap),
            "with too small a force": self._force() >= rules.min_force,
            "too slow": moving,
            "too fast": speed - 2.5 * speeds.deviation <= rules.max_speed,
            "accelerating": change <= rules.max_acceleration,
        }
        kept = np.ones(len(times), dtype=bool)
        for rule, passed in lets_through.items():
            self.dropped[rule] = int(np.count_nonzero(kept & ~passed))
            kept &= passed
        return kept

    def _force(self) -> Floats:
        """Return the size of the force, over as many samples as its noise needs."""
        noise = math.hypot(self._noise[0], self._noise[1])
        count = math.ceil((4.0 * noise / self._rules.min_force) ** 2)
        forces = self._loads[:, :2]
        if count > 1:
            count = min(count, len(forces))
            share = np.ones(count) / count
            forces = np.column_stack([np.convolve(f, share, mode="same") for f in forces.T])
        return np.asarray(np.linalg.norm(forces, axis=1))

    def _parts(self, kept: Bools) -> list[tuple[int, int]]:
        """Return the stretches of wrenches that are kept, without gaps between them."""
        broken = np.concatenate([[False], np.diff(self._times) > self._rules.max_gap])
        parts = []
        for first, last in stretches(kept):
            cuts = [first, *(first + np.flatnonzero(broken[first:last])), last]
            parts += [(int(a), int(b)) for a, b in pairwise(cuts) if b > a]
        return parts

    def pairs(self) -> Pairs:
        """Return the pairs, each with a weight that its noise leaves it."""
        scale = np.array([1.0, 1.0, 1.0 / self._rules.lever])
        twists = np.array([window.twist for window, _ in self.windows])
        wrenches = np.array([self._loads[a:b].mean(axis=0) for _, (a, b) in self.windows])
        counts = np.array([b - a for _, (a, b) in self.windows])
        sizes = np.linalg.norm(wrenches * scale, axis=1)
        of_wrench = (
            np.linalg.norm(self._noise * scale) / np.sqrt(counts) / np.maximum(sizes, 1e-300)
        )
        of_twist = np.array([window.deviation for window, _ in self.windows])
        self.deviations = np.hypot(of_twist, of_wrench)
        weights = 1.0 / (self.deviations**2 + _SCATTER**2)
        return Pairs(wrenches, twists, weights / weights.mean())
