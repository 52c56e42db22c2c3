# SPDX-License-Identifier: Apache-2.0
"""When a body moves: runs of its motion, their ends made precise, long ones cut into pieces."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.files.recordings.arcs import Span
from limit_surface_ros.files.recordings.motion import stretches

if TYPE_CHECKING:
    from limit_surface_ros.checks import Bools, Floats
    from limit_surface_ros.files.recordings.motion import Motion, Speeds

# A rest tells where a run begins by its last so many seconds.
_LOOK_BACK = 0.4
# Runs are fitted in pieces of at most this length [s], which overlap by that.
_LONGEST, _OVERLAP = 4.0, 0.5
_PLACES, _FEWEST = 41, 4


def runs_of(motion: Motion, speeds: Speeds, lever: float, max_gap: float) -> list[Span]:
    """Return the runs in which a body moves.

    Args:
        motion: Of the body.
        speeds: See `speeds_of`.
        lever: Turns angular speed into speed [m].
        max_gap: Samples further apart end a run [s].
    """
    times = motion.times
    after_gap = np.concatenate([[False], np.diff(times) > max_gap])
    runs = []
    for first, last in stretches(speeds.moving):
        cuts = [first, *(first + np.flatnonzero(after_gap[first:last])), last]
        for a, b in pairwise(cuts):
            if b - a >= 2:
                runs.append((int(a), int(b)))
    if not motion.are_poses:
        return [_bare(float(times[a]), float(times[b - 1])) for a, b in runs]
    return [
        _sharpened(motion, speeds, lever, a, b, _reach(times, runs, k, after_gap))
        for k, (a, b) in enumerate(runs)
    ]


def pieces_of(span: Span) -> list[tuple[Span, float, float]]:
    """Return pieces of a run that are short enough to be fitted, and which part of each counts."""
    length = span.end - span.start
    count = max(1, int(np.ceil(length / _LONGEST)))
    if count == 1:
        return [(span, span.start, span.end)]
    ends = np.linspace(span.start, span.end, count + 1)
    pieces = []
    for k in range(count):
        start = span.start if k == 0 else float(ends[k]) - _OVERLAP
        end = span.end if k == count - 1 else float(ends[k + 1]) + _OVERLAP
        piece = Span(
            start,
            end,
            span.before if k == 0 else start,
            span.after if k == count - 1 else end,
        )
        pieces.append((piece, float(ends[k]), float(ends[k + 1])))
    return pieces


def _bare(start: float, end: float) -> Span:
    return Span(start, end, start, end)


def _reach(
    times: Floats, runs: list[tuple[int, int]], which: int, after_gap: Bools
) -> tuple[int, int]:
    """Return the samples up to which nothing but a run and its rests lies."""
    first, last = runs[which]
    low = runs[which - 1][1] if which > 0 else 0
    high = runs[which + 1][0] if which + 1 < len(runs) else len(times)
    gaps_below = np.flatnonzero(after_gap[low : first + 1])
    gaps_above = np.flatnonzero(after_gap[last:high])
    if len(gaps_below):
        low += int(gaps_below[-1])
    if len(gaps_above):
        high = last + int(gaps_above[0])
    return low, high


def _sharpened(
    motion: Motion, speeds: Speeds, lever: float, first: int, last: int, reach: tuple[int, int]
) -> Span:
    """Return a run whose ends lie where straight lines through rest and motion meet.

    The slopes by which a run is found reach over as much time as the noise demands, so that it
    seems to begin before the body moves.
    """
    times = motion.times
    start, end = float(times[first]), float(times[last - 1])
    scale = np.array([1.0, 1.0, lever])
    direction = speeds.slopes[first:last].mean(axis=0) * scale
    size = float(np.linalg.norm(direction))
    if size == 0.0:
        return _bare(start, end)
    along = (motion.values * scale) @ (direction / size)
    pad = max(speeds.length, 4.0 * motion.step)
    before, after = start, end
    low, high = reach
    inside = (max(low, int(np.searchsorted(times, start - 0.6 * pad - 0.1))), last)
    stop = min(last, int(np.searchsorted(times, start + pad + 0.1)))
    nearby = int(np.searchsorted(times, times[first] - pad))
    if speeds.resting[max(low, nearby) : first].any() and stop - inside[0] > _FEWEST:
        start = _hinge(times[inside[0] : stop], along[inside[0] : stop])
        before = max(start - _LOOK_BACK, float(times[low]))
    begin = max(first, int(np.searchsorted(times, end - pad - 0.1)))
    top = min(high, int(np.searchsorted(times, end + 0.6 * pad + 0.1)))
    nearby = int(np.searchsorted(times, times[last - 1] + pad))
    if speeds.resting[last : min(high, nearby + 1)].any() and top - begin > _FEWEST:
        end = -_hinge(-times[begin:top][::-1], along[begin:top][::-1])
        after = min(end + _LOOK_BACK, float(times[high - 1]))
    if not start < end:
        return _bare(float(times[first]), float(times[last - 1]))
    return Span(start, end, min(before, start), max(after, end))


def _hinge(times: Floats, values: Floats) -> float:
    """Return the time up to which values are constant and from which they follow a line."""
    places = np.linspace(times[0], times[-1], _PLACES)[1:-1]
    ramps = np.maximum(0.0, times[:, None] - places)
    ramps -= ramps.mean(axis=0)
    centred = values - values.mean()
    # What a ramp explains of the values; the best explains most.
    explained = (centred @ ramps) ** 2 / np.maximum(np.sum(ramps**2, axis=0), 1e-300)
    return float(places[int(np.argmax(explained))])
