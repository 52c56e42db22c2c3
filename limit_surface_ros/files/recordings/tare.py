# SPDX-License-Identifier: Apache-2.0
"""The bias of a force sensor from the rests of the body, in the sensor's own frame.

A body that rests need not be unloaded: a pusher may lean on it, with another load after each push.
What recurs at many rests is the sensor's bias. It may drift.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.sample_noise import estimate_noise

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats, Places

# Rests are cut into pieces of this length [s], whose levels are one if they agree within so many
# deviations, and lie no further apart than this in time [s].
_PIECE, _DEVIATIONS, _APART = 0.05, 4.0, 12.0
# The largest group of equal levels is the bias if it holds at least so many rests and this share
# of all pieces.
_FEWEST_RESTS, _SHARE = 3, 0.15
# A bias whose levels spread over more than so many tolerances drifts; it is then taken every so
# many seconds.
_DRIFTS, _EVERY = 3.0, 5.0
_MOST_PIECES = 3000
# Rests shorter than this [s], at both ends less a margin, are none.
_MARGIN = 0.02


@dataclass(frozen=True, eq=False)
class Tare:
    """The bias of a sensor.

    Attributes:
        times: When it is given, shape (k,) [s].
        levels: Then, shape (k, 6); between these times it is interpolated.
        rests: How many rests told it.
        drift: Largest change of each component over the recording, shape (6,).
    """

    times: Floats
    levels: Floats
    rests: int
    drift: Floats

    @property
    def mean(self) -> Floats:
        """The mean bias, shape (6,)."""
        return np.asarray(self.levels.mean(axis=0))

    def at(self, times: Floats) -> Floats:
        """Return the bias at times, shape (n, 6)."""
        return np.column_stack([np.interp(times, self.times, level) for level in self.levels.T])


def find_tare(
    times: Floats, wrenches: Floats, rests: list[tuple[float, float]], parts: list[int]
) -> Tare | None:
    """Find the bias.

    Args:
        times: Of the wrenches, on the clock of the rests, shape (n,), increasing [s].
        wrenches: Shape (n, 6).
        rests: Start and end of each rest [s].
        parts: The components whose levels must agree.

    Returns:
        The bias, or None where no level recurs.
    """
    noise = np.array([estimate_noise(times, column) for column in wrenches.T])
    middles, levels, owners, counts = _pieces(times, wrenches, rests)
    if len(middles) < 2:
        return None
    if len(middles) > _MOST_PIECES:
        some = np.linspace(0, len(middles) - 1, _MOST_PIECES).astype(np.intp)
        middles, levels, owners = middles[some], levels[some], owners[some]
    near = owners[1:] == owners[:-1]
    steps = np.abs(np.diff(levels, axis=0))[near]
    slow = 1.4826 * np.median(steps, axis=0) / np.sqrt(2.0) if len(steps) else np.zeros(6)
    # Of levels, those of a noise slower than the pieces included.
    deviation = np.maximum(noise / np.sqrt(max(counts, 1.0)), slow)
    size = np.abs(levels[:, parts]).max()
    tolerance = np.maximum(_DEVIATIONS * deviation[parts], 1e-9 * max(size, 1e-300))
    group = _largest_group(middles, levels[:, parts], tolerance)
    told = len(set(owners[group].tolist()))
    if told < _FEWEST_RESTS or len(group) < _SHARE * len(middles):
        return None
    return _of_group(middles[group], levels[group], told, parts, tolerance)


def _pieces(
    times: Floats, wrenches: Floats, rests: list[tuple[float, float]]
) -> tuple[Floats, Floats, Floats, float]:
    """Return the middle, the level and the rest of each piece, and how many samples most hold."""
    middles, levels, owners, counts = [], [], [], []
    for owner, (start, end) in enumerate(rests):
        count = int((end - start - 2.0 * _MARGIN) / _PIECE)
        bounds = start + _MARGIN + _PIECE * np.arange(count + 1)
        places = np.searchsorted(times, bounds)
        for k in range(count):
            part = wrenches[places[k] : places[k + 1]]
            if len(part):
                middles.append(0.5 * (bounds[k] + bounds[k + 1]))
                levels.append(part.mean(axis=0))
                owners.append(owner)
                counts.append(len(part))
    usual = float(np.median(counts)) if counts else 0.0
    return np.array(middles), np.array(levels).reshape(-1, 6), np.array(owners), usual


def _largest_group(middles: Floats, levels: Floats, tolerance: Floats) -> Places:
    """Return the pieces of the largest group whose levels are linked."""
    owner = np.arange(len(middles))

    def root(k: int) -> int:
        while owner[k] != k:
            owner[k] = owner[owner[k]]
            k = int(owner[k])
        return k

    for k in range(len(middles)):
        last = int(np.searchsorted(middles, middles[k] + _APART, side="right"))
        near = np.abs(levels[k + 1 : last] - levels[k]) <= tolerance
        for other in k + 1 + np.flatnonzero(near.all(axis=1)):
            a, b = root(k), root(int(other))
            owner[max(a, b)] = min(a, b)
    roots = np.array([root(k) for k in range(len(middles))])
    names, counts = np.unique(roots, return_counts=True)
    return np.flatnonzero(roots == names[int(np.argmax(counts))])


def _of_group(
    middles: Floats, levels: Floats, told: int, parts: list[int], tolerance: Floats
) -> Tare:
    """Return the bias of a group: one level, or one every few seconds if it drifts."""
    spread = np.ptp(levels[:, parts], axis=0)
    if (spread <= _DRIFTS * tolerance).all():
        level = np.median(levels, axis=0)
        return Tare(middles[:1], level[None], told, np.zeros(6))
    cells = np.floor((middles - middles[0]) / _EVERY).astype(np.intp)
    places, values = [], []
    for cell in np.unique(cells):
        part = cells == cell
        places.append(float(np.median(middles[part])))
        values.append(np.median(levels[part], axis=0))
    table = np.array(values)
    return Tare(np.array(places), table, told, np.ptp(table, axis=0))
