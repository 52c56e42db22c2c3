# SPDX-License-Identifier: Apache-2.0
"""From a recording of wrenches and motion to pairs: clocks, bias, runs, windows, weights."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from limit_surface_ros.errors import DataError
from limit_surface_ros.files.recordings.arcs import Span, TwistCurve, fit_curves
from limit_surface_ros.files.recordings.clocks import ClockOffset, find_delay
from limit_surface_ros.files.recordings.motion import motion_of, speeds_of, stretches
from limit_surface_ros.files.recordings.runs import pieces_of, runs_of
from limit_surface_ros.files.recordings.selection import Run, Selected, Selection
from limit_surface_ros.files.recordings.tare import find_tare
from limit_surface_ros.files.recordings.windows import direction_deviation
from limit_surface_ros.sample_noise import estimate_noise
from limit_surface_ros.surface.pairs import Pairs

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.files.recordings.motion import Motion, Speeds
    from limit_surface_ros.files.recordings.tare import Tare

IN_PLANE = [0, 1, 5]
# Delays are told by twists at such distances inside a run [s], such a margin from its ends; how
# certain they are is looked at for every so many.
_CLOCK_STEP, _CLOCK_MARGIN, _CLOCK_STRIDE = 0.01, 0.05, 10
_LEAST_REST, _FEWEST = 0.1, 8
# Numbers beyond this are of no recording, and their squares and products overflow.
LARGEST_SAMPLE = 1e12
# Takes wrenches, shape (n, 6), in the sensor's frame at times, shape (n,), to the body's frame.
ToBody: TypeAlias = Callable[["Floats", "Floats"], "Floats"]


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

    Examples:
        >>> from limit_surface_ros.files.recordings.simulation import (
        ...     RecordingPlan,
        ...     simulate_recording,
        ... )
        >>> from limit_surface_ros.surface.kinds.point_contacts import PointContacts
        >>> feet = [[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]]
        >>> plan = RecordingPlan(pushes=12, pose_noise=1e-4, yaw_noise=1e-3, delay=0.1)
        >>> recording = simulate_recording(PointContacts(feet, [1.4, 1.4, 1.4]), plan).recording
        >>> found = find_pushes(recording)
        >>> len(found.pairs) > 40, round(found.clock_offset.delay, 1)
        (True, 0.1)
    """
    rules, how = selection or Selection(), corrections or Corrections()
    for what, count in (
        ("wrench", len(recording.wrench_times)),
        ("motion", len(recording.motion_times)),
    ):
        if count < 2:
            raise DataError(f"the recording holds {count} {what} samples, at least 2 are needed")
    recorded = len(recording.wrench_times)
    # NaN fails this, too.
    finite = (np.abs(recording.wrenches) <= LARGEST_SAMPLE).all(axis=1)
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
    found = Selected(rules, motion, speeds, runs, times, loads, noise, unread)
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


def _curves(motion: Motion, spans: list[Span], rules: Selection) -> list[Run]:
    if not motion.are_poses:
        return [Run(s.start, s.end, _MeanOfTwists(motion), _interpolated(motion)) for s in spans]
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


def _of_curve(curve: TwistCurve, start: float, end: float) -> Run:
    return Run(start, end, curve.mean, curve.at)


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
    recording: Recording, runs: list[Run], how: Corrections, rules: Selection
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
