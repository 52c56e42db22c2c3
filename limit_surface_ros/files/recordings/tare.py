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
# The lower quartile of the size of a difference of two samples of unit noise.
_QUARTER = 0.4506
# Slow noise of a sensor is no more than so many times that which its fine noise leaves of a level.
_SLOWEST = 5.0
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
    pieces = _pieces(times, wrenches, rests)
    count = len(pieces.middles)
    if count < 2:
        return None
    if count > _MOST_PIECES:
        pieces = pieces.take(np.linspace(0, count - 1, _MOST_PIECES).astype(np.intp))
    near = pieces.owners[1:] == pieces.owners[:-1]
    steps = _steps(pieces)[near]
    # Of levels, those of a noise slower than the pieces included. The steps of loads that rise
    # and fall are among them: the smallest quarter is noise, if it is not far beyond that.
    fine = noise / np.sqrt(max(pieces.usual, 1.0))
    slow = np.quantile(steps, 0.25, axis=0) / _QUARTER if len(steps) else fine
    deviation = np.clip(slow, fine, _SLOWEST * fine)
    size = np.abs(pieces.levels[:, parts]).max()
    tolerance = np.maximum(_DEVIATIONS * deviation[parts], 1e-9 * max(size, 1e-300))
    count = len(pieces.middles)
    # Halves of a piece have twice the variance of the whole, and their difference twice that.
    flat = (np.abs(pieces.changes[:, parts]) <= 2.0 * tolerance).all(axis=1)
    # One flat piece may be the turn of a load: its neighbour must be of the same level, too.
    with_next = near & flat[1:] & flat[:-1] & (_steps(pieces)[:, parts] <= tolerance).all(axis=1)
    held = np.append(with_next, False) | np.insert(with_next, 0, False)
    pieces = pieces.take(np.flatnonzero(held))
    if len(pieces.middles) < _FEWEST_RESTS:
        return None
    group = pieces.take(_largest_group(pieces.middles, pieces.levels[:, parts], tolerance))
    told = len(set(group.owners.tolist()))
    if told < _FEWEST_RESTS or len(group.middles) < _SHARE * count:
        return None
    return _of_group(group, told, parts, tolerance)


@dataclass(frozen=True, eq=False)
class _Pieces:
    """Pieces of rests: when, their levels, how these change inside, and the rest of each."""

    middles: Floats
    levels: Floats
    changes: Floats
    owners: Places
    usual: float

    def take(self, which: Places) -> _Pieces:
        return _Pieces(
            self.middles[which],
            self.levels[which],
            self.changes[which],
            self.owners[which],
            self.usual,
        )


def _steps(pieces: _Pieces) -> Floats:
    """Return how far each level is from that before, shape (n - 1, 6)."""
    return np.asarray(np.abs(np.diff(pieces.levels, axis=0)))


def _pieces(times: Floats, wrenches: Floats, rests: list[tuple[float, float]]) -> _Pieces:
    """Cut rests into pieces."""
    middles, levels, changes, owners, counts = [], [], [], [], []
    for owner, (start, end) in enumerate(rests):
        count = int((end - start - 2.0 * _MARGIN) / _PIECE)
        bounds = start + _MARGIN + _PIECE * np.arange(count + 1)
        places = np.searchsorted(times, bounds)
        for k in range(count):
            part = wrenches[places[k] : places[k + 1]]
            half = len(part) // 2
            if len(part):
                middles.append(0.5 * (bounds[k] + bounds[k + 1]))
                levels.append(part.mean(axis=0))
                ends = (
                    part[len(part) - half :].mean(axis=0) - part[:half].mean(axis=0)
                    if half
                    else 0.0
                )
                changes.append(np.zeros(6) + ends)
                owners.append(owner)
                counts.append(len(part))
    return _Pieces(
        np.array(middles),
        np.array(levels).reshape(-1, 6),
        np.array(changes).reshape(-1, 6),
        np.array(owners, dtype=np.intp),
        float(np.median(counts)) if counts else 0.0,
    )


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


def _of_group(group: _Pieces, told: int, parts: list[int], tolerance: Floats) -> Tare | None:
    """Return the bias of a group: one level, or one every few seconds if it drifts.

    Levels that are linked but differ within so short a time are loads that come and go: None.
    """
    middles, levels = group.middles, group.levels
    spread = np.ptp(levels[:, parts], axis=0)
    if (spread <= _DRIFTS * tolerance).all():
        level = np.median(levels, axis=0)
        return Tare(middles[:1], level[None], told, np.zeros(6))
    cells = np.floor((middles - middles[0]) / _EVERY).astype(np.intp)
    places, values = [], []
    for cell in np.unique(cells):
        part = cells == cell
        if (np.ptp(levels[part][:, parts], axis=0) > _DRIFTS * tolerance).any():
            return None
        places.append(float(np.median(middles[part])))
        values.append(np.median(levels[part], axis=0))
    table = np.array(values)
    return Tare(np.array(places), table, told, np.ptp(table, axis=0))
