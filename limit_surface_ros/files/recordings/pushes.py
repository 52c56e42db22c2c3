# SPDX-License-Identifier: Apache-2.0
"""From a recording of wrenches and motion to pairs: clocks, bias, runs, windows, weights."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from limit_surface_ros.checks import as_positive
from limit_surface_ros.errors import DataError
from limit_surface_ros.files.recordings.arcs import Span, TwistCurve, fit_curves
from limit_surface_ros.files.recordings.clocks import ClockOffset, find_delay
from limit_surface_ros.files.recordings.motion import motion_of, speeds_of, stretches
from limit_surface_ros.files.recordings.runs import pieces_of, runs_of
from limit_surface_ros.files.recordings.tare import find_tare
from limit_surface_ros.files.recordings.windows import direction_deviation, windows_of
from limit_surface_ros.sample_noise import estimate_noise
from limit_surface_ros.surface.pairs import Pairs

if TYPE_CHECKING:
    from limit_surface_ros.checks import Bools, Floats
    from limit_surface_ros.files.recordings.motion import Motion, Speeds
    from limit_surface_ros.files.recordings.tare import Tare
    from limit_surface_ros.files.recordings.windows import Window

IN_PLANE = [0, 1, 5]
# Real pushes scatter by so much [rad] however well they are measured: no pair weighs more.
_SCATTER = 0.02
# Delays are told by twists at such distances inside a run [s], such a margin from its ends; how
# certain they are is looked at for every so many.
_CLOCK_STEP, _CLOCK_MARGIN, _CLOCK_STRIDE = 0.01, 0.05, 10
_LEAST_REST, _FEWEST = 0.1, 8
# A motion whose direction is less certain than this [rad] may be none.
_UNSURE = 0.3
# Takes wrenches, shape (n, 6), in the sensor's frame at times, shape (n,), to the body's frame.
ToBody: TypeAlias = Callable[["Floats", "Floats"], "Floats"]


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


@dataclass(frozen=True)
class Corrections:
    """What is corrected before pushes are looked for.

    Attributes:
        tare: Whether the sensor's bias is taken away that rests tell.
        clock_offset: How late wrenches are stamped [s]; estimated if it is None.
    """

    tare: bool = True
    clock_offset: float | None = None


@dataclass(frozen=True, eq=False)
class Recording:
    """Wrenches and the motion of a body over time.

    Attributes:
        wrench_times: Shape (n,), increasing [s].
        wrenches: Shape (n, 6), force and torque on the body in the sensor's frame [N, N m].
        motion_times: Shape (m,), increasing [s].
        motions: Shape (m, 3), poses (x, y, yaw) in a fixed frame, or twists in the body's frame.
        are_poses: Which of the two.
        to_body: Takes wrenches to the body's frame; they are in it if this is None.
    """

    wrench_times: Floats
    wrenches: Floats
    motion_times: Floats
    motions: Floats
    are_poses: bool
    to_body: ToBody | None = None


@dataclass(frozen=True, eq=False)
class RecordedPushes:
    """Pushes found in a recording.

    Attributes:
        pairs: One pair for each window of a push, with its weight.
        deviations: Of each pair's directions, twist and wrench together, shape (n,) [rad].
        windows: Start and end of each, shape (n, 2) [s].
        samples: How many wrenches the recording holds.
        dropped: How many of them each rule dropped, in the rules' order.
        pose_noise: Deviation of x, y [m] and yaw [rad], or of the twist's parts, shape (3,).
        wrench_noise: Deviation of fx, fy [N] and tau_z [N m], shape (3,).
        clock_offset: How late wrenches are stamped, if that could be told.
        tare: The sensor's bias, if rests told it.
        rests: Start and end of each rest of the body, shape (k, 2) [s].
        recording: That they were found in.
        frame_id: The body's frame, if the recording names it.
        notes: How it was read, in one line each.
    """

    pairs: Pairs
    deviations: Floats
    windows: Floats
    samples: int
    dropped: dict[str, int]
    pose_noise: Floats
    wrench_noise: Floats
    clock_offset: ClockOffset | None = None
    tare: Tare | None = None
    rests: Floats = field(default_factory=lambda: np.empty((0, 2)))
    recording: Recording | None = None
    frame_id: str | None = None
    notes: tuple[str, ...] = field(default=())

    @property
    def resting(self) -> float:
        """Share of the recording's time in which the body rests."""
        if self.recording is None:
            return 0.0
        span = float(np.ptp(self.recording.motion_times))
        return float(np.sum(self.rests[:, 1] - self.rests[:, 0])) / max(span, 1e-9)


def find_pushes(
    recording: Recording,
    selection: Selection | None = None,
    corrections: Corrections | None = None,
) -> RecordedPushes:
    """Find the quasi-static pushes of a recording.

    Args:
        recording: Of wrenches and motion, numbers that are not finite among the wrenches left out.
        selection: What counts as a push.
        corrections: What is corrected first.

    Raises:
        DataError: There are fewer than two motions or wrenches, or no part is a quasi-static push.
    """
    rules, how = selection or Selection(), corrections or Corrections()
    for what, count in (
        ("wrench", len(recording.wrench_times)),
        ("motion", len(recording.motion_times)),
    ):
        if count < 2:
            raise DataError(f"the recording holds {count} {what} samples, at least 2 are needed")
    recorded = len(recording.wrench_times)
    finite = np.isfinite(recording.wrenches).all(axis=1)
    if np.count_nonzero(finite) < _FEWEST:
        raise DataError("the wrenches hold hardly a finite number")
    recording = replace(
        recording,
        wrench_times=recording.wrench_times[finite],
        wrenches=recording.wrenches[finite],
    )
    motion = motion_of(recording.motion_times, recording.motions, recording.are_poses)
    speeds = speeds_of(motion, rules.min_speed, rules.lever)
    spans = runs_of(motion, speeds, rules.lever, rules.max_gap)
    runs = _curves(motion, spans, rules)
    times = recording.wrench_times
    offset = _clock(recording, runs, how, rules)
    if offset is not None and offset.applied:
        times = times - offset.delay
    rests = _rests(motion, speeds, spans)
    parts = IN_PLANE if recording.to_body is None else list(range(6))
    tare = find_tare(times, recording.wrenches, rests, parts) if how.tare else None
    wrenches = recording.wrenches if tare is None else recording.wrenches - tare.at(times)
    loads = _planar(recording, times, wrenches)
    noise = np.array([estimate_noise(times, column) for column in loads.T])
    unread = recorded - len(times)
    found = _Selected(rules, motion, speeds, runs, times, loads, noise, unread)
    return RecordedPushes(
        pairs=found.pairs(),
        deviations=found.deviations,
        windows=np.array([[window.start, window.end] for window, _ in found.windows]),
        samples=recorded,
        dropped=found.dropped,
        pose_noise=motion.noise,
        wrench_noise=noise,
        clock_offset=offset,
        tare=tare,
        rests=np.array(rests).reshape(-1, 2),
        recording=recording,
    )


def _planar(recording: Recording, times: Floats, wrenches: Floats) -> Floats:
    if recording.to_body is not None:
        wrenches = recording.to_body(times, wrenches)
    return np.asarray(wrenches[:, IN_PLANE])


@dataclass(frozen=True, eq=False)
class _Run:
    """A part of a run in which the mean twist of any interval is known."""

    start: float
    end: float
    mean: Callable[[float, float], tuple[Floats, Floats]]
    at: Callable[[Floats], Floats]


def _curves(motion: Motion, spans: list[Span], rules: Selection) -> list[_Run]:
    if not motion.are_poses:
        return [_Run(s.start, s.end, _MeanOfTwists(motion), _interpolated(motion)) for s in spans]
    pieces = [piece for span in spans for piece in pieces_of(span)]
    by_span = {
        curve.span: curve
        for curve in fit_curves(motion, [piece for piece, _, _ in pieces], rules.lever)
    }
    return [
        _of_curve(by_span[piece], start, end)
        for piece, start, end in pieces
        if piece in by_span and end > start
    ]


def _of_curve(curve: TwistCurve, start: float, end: float) -> _Run:
    return _Run(start, end, curve.mean, curve.at)


class _MeanOfTwists:
    """Mean of measured twists over intervals, taken as straight lines between the samples."""

    def __init__(self, motion: Motion) -> None:
        self._motion = motion
        steps = np.diff(motion.times)[:, None]
        areas = 0.5 * steps * (motion.values[1:] + motion.values[:-1])
        self._total = np.concatenate([np.zeros((1, 3)), np.cumsum(areas, axis=0)])

    def __call__(self, start: float, end: float) -> tuple[Floats, Floats]:
        times = self._motion.times
        ends = np.array([start, end])
        after = np.clip(np.searchsorted(times, ends), 1, len(times) - 1)
        lower = times[after - 1]
        share = (ends - lower)[:, None]
        low, at = self._motion.values[after - 1], _interpolated(self._motion)(ends)
        totals = self._total[after - 1] + 0.5 * share * (low + at)
        count = max(1.0, (end - start) / self._motion.step)
        covariance = np.diag(self._motion.noise**2) / count
        return (totals[1] - totals[0]) / (end - start), covariance


def _interpolated(motion: Motion) -> Callable[[Floats], Floats]:
    def at(times: Floats) -> Floats:
        return np.column_stack([np.interp(times, motion.times, c) for c in motion.values.T])

    return at


def _clock(
    recording: Recording, runs: list[_Run], how: Corrections, rules: Selection
) -> ClockOffset | None:
    if how.clock_offset is not None:
        delay = how.clock_offset
        return ClockOffset(delay, delay, delay, True)
    times, twists, deviations = [], [], []
    for run in runs:
        inside = np.arange(run.start + _CLOCK_MARGIN, run.end - _CLOCK_MARGIN, _CLOCK_STEP)
        if len(inside) > 1:
            times.append(inside)
            twists.append(run.at(inside))
            some = inside[::_CLOCK_STRIDE]
            doubts = [
                direction_deviation(*run.mean(t, t + _CLOCK_STEP), rules.lever) for t in some
            ]
            deviations.append(np.interp(inside, some, doubts))
    if not times:
        return None
    return find_delay(
        recording.wrench_times,
        _planar(recording, recording.wrench_times, recording.wrenches),
        np.concatenate(times),
        np.concatenate(twists),
        np.concatenate(deviations),
        rules.lever,
    )


def _rests(motion: Motion, speeds: Speeds, spans: list[Span]) -> list[tuple[float, float]]:
    """Return the intervals in which the body rests: slow by its slopes, outside of all runs."""
    resting = speeds.resting.copy()
    # Noise lifts single slopes above the bound: such gaps, in which nothing moves, are filled.
    longest = max(speeds.length, _LEAST_REST)
    for first, last in stretches(~speeds.resting):
        short = motion.times[last - 1] - motion.times[first] <= longest
        if short and first > 0 and not speeds.moving[first:last].any():
            resting[first:last] = True
    rests = []
    for first, last in stretches(resting):
        low, high = float(motion.times[first]), float(motion.times[last - 1])
        for span in spans:
            if span.end <= low or span.start >= high:
                continue
            if span.start - low >= _LEAST_REST:
                rests.append((low, span.start))
            low = max(low, span.end)
        if high - low >= _LEAST_REST:
            rests.append((low, high))
    return rests


class _Selected:
    """The windows that every rule lets through, and how many wrenches each rule dropped."""

    def __init__(
        self,
        rules: Selection,
        motion: Motion,
        speeds: Speeds,
        runs: list[_Run],
        times: Floats,
        loads: Floats,
        noise: Floats,
        not_finite: int,
    ) -> None:
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

    def _kept(self, motion: Motion, speeds: Speeds, runs: list[_Run]) -> Bools:
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
