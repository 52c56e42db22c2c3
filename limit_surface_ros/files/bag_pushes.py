# SPDX-License-Identifier: Apache-2.0
"""Pushes in ROS 2 bags: a topic of wrenches and one of motions, synchronised, quasi-static parts.

The wrench topic holds WrenchStamped in the body's frame, about the reference point: the load on
the body. The motion topic holds TwistStamped in the same frame, or PoseStamped of the body in a
fixed frame, which is differentiated. Each rule of `Selection` is an option, and what it drops is
counted.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_positive
from limit_surface_ros.errors import DataError, FileError
from limit_surface_ros.files.bag_reader import TWIST_FIELDS, WRENCH_FIELDS, read_topic
from limit_surface_ros.surface.pairs import Pairs

if TYPE_CHECKING:
    from pathlib import Path

    from limit_surface_ros.checks import Bools, Floats
    from limit_surface_ros.files.bag_reader import TopicRecord

POSE_FIELDS = tuple(f"pose.position.{axis}" for axis in "xy") + tuple(
    f"pose.orientation.{axis}" for axis in "xyzw"
)
_PLANAR_WRENCH = [WRENCH_FIELDS[i] for i in (0, 1, 5)]
_PLANAR_TWIST = [TWIST_FIELDS[i] for i in (0, 1, 5)]


@dataclass(frozen=True)
class Selection:
    """Which parts of a recording are quasi-static pushes.

    Speed is |(vx, vy)| + |omega| times the lever: about that of the body's edge.

    Attributes:
        max_gap: A wrench counts only between two motion samples no further apart than this [s].
        min_speed: Slower, the body may stick [m/s].
        max_speed: Faster, inertia may count [m/s].
        max_acceleration: A larger change of speed is not quasi-static [m/s^2].
        min_force: A smaller force does not push [N].
        window: Pushes are averaged over windows of this length [s]; what is left of a push that is
            shorter than half of it is dropped.
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
class BagPushes:
    """Pushes found in a bag.

    Attributes:
        pairs: One pair for each window of a push.
        samples: How many wrenches the bag holds.
        dropped: How many of them each rule dropped, in the rules' order.
    """

    pairs: Pairs
    samples: int
    dropped: dict[str, int]


def read_bag_pushes(
    path: str | Path, wrench_topic: str, motion_topic: str, selection: Selection | None = None
) -> BagPushes:
    """Read pushes from a bag.

    Args:
        path: The bag: its folder, or an .mcap file.
        wrench_topic: Of WrenchStamped.
        motion_topic: Of TwistStamped or PoseStamped.
        selection: What counts as a push.

    Raises:
        MissingExtraError: rosbags is not installed.
        FileError: The bag cannot be read, a topic is not there or of another type, or the frames
            do not fit.
        DataError: No part of the recording is a quasi-static push.
    """
    rules = selection or Selection()
    wrenches = read_topic(path, wrench_topic, _PLANAR_WRENCH)
    motion = _read_motion(path, motion_topic)
    _check_frames(path, wrenches, motion)
    times, twists = _twists(motion)
    if len(times) < 2:
        raise DataError(
            f"{path}: {motion_topic} holds {len(times)} motions, at least 2 are needed"
        )
    return _select(path, wrenches, times, twists, rules)


def _read_motion(path: str | Path, topic: str) -> TopicRecord:
    try:
        return read_topic(path, topic, _PLANAR_TWIST)
    except FileError:
        # Not twists: poses, or the error that names what is wrong with either.
        return read_topic(path, topic, POSE_FIELDS)


def _check_frames(path: str | Path, wrenches: TopicRecord, motion: TopicRecord) -> None:
    """Twists must share the wrenches' frame, poses must not."""
    of_pose = motion.values.shape[1] == len(POSE_FIELDS)
    if of_pose == (wrenches.frame_id == motion.frame_id) and wrenches.frame_id:
        wanted = "another frame than" if of_pose else "the frame of"
        raise FileError(
            f"{path}: motions are given in frame {motion.frame_id!r}; they must be in {wanted} "
            f"the wrenches, {wrenches.frame_id!r}, which must be the body's"
        )


def _twists(motion: TopicRecord) -> tuple[Floats, Floats]:
    """Return times and planar twists in the body's frame, shape (n, 3)."""
    times, first = np.unique(motion.times, return_index=True)
    values = motion.values[first]
    if values.shape[1] == len(_PLANAR_TWIST):
        return times, values
    x, y, z, w = values[:, 2:].T
    yaw = np.unwrap(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))
    steps = np.diff(times)
    middle = 0.5 * (yaw[1:] + yaw[:-1])
    vx, vy = (np.diff(values[:, :2], axis=0) / steps[:, None]).T
    cos, sin = np.cos(middle), np.sin(middle)
    twists = np.column_stack([cos * vx + sin * vy, cos * vy - sin * vx, np.diff(yaw) / steps])
    return 0.5 * (times[1:] + times[:-1]), twists


def _select(
    path: str | Path, wrenches: TopicRecord, times: Floats, twists: Floats, rules: Selection
) -> BagPushes:
    """Keep the wrenches that every rule lets through and average them over windows."""
    after = np.clip(np.searchsorted(times, wrenches.times), 1, len(times) - 1)
    gaps = times[after] - times[after - 1]
    inside = (wrenches.times >= times[0]) & (wrenches.times <= times[-1])
    at = np.column_stack([np.interp(wrenches.times, times, column) for column in twists.T])
    edge_speed = np.linalg.norm(twists[:, :2], axis=1) + rules.lever * np.abs(twists[:, 2])
    speed = np.interp(wrenches.times, times, edge_speed)
    change = np.interp(wrenches.times, times, np.abs(np.gradient(edge_speed, times)))
    force = np.linalg.norm(wrenches.values[:, :2], axis=1)
    lets_through = {
        "without motions near them": inside & (gaps <= rules.max_gap),
        "with a number that is not finite": np.isfinite(wrenches.values).all(axis=1)
        & np.isfinite(at).all(axis=1),
        "with too small a force": force >= rules.min_force,
        "too slow": speed >= rules.min_speed,
        "too fast": speed <= rules.max_speed,
        "accelerating": change <= rules.max_acceleration,
    }
    kept = np.ones(len(force), dtype=bool)
    dropped: dict[str, int] = {}
    for rule, passed in lets_through.items():
        dropped[rule] = int(np.count_nonzero(kept & ~passed))
        kept &= passed
    windows = _windows(wrenches.times, kept, rules)
    used = sum(len(window) for window in windows)
    dropped["in pushes too short"] = int(np.count_nonzero(kept)) - used
    if not windows:
        told = ", ".join(f"{count} {rule}" for rule, count in dropped.items() if count)
        raise DataError(f"{path}: no part is a quasi-static push; of {len(kept)} wrenches {told}")
    mean_wrenches = np.array([wrenches.values[window].mean(axis=0) for window in windows])
    mean_twists = np.array([at[window].mean(axis=0) for window in windows])
    return BagPushes(Pairs(mean_wrenches, mean_twists), len(kept), dropped)


def _windows(times: Floats, kept: Bools, rules: Selection) -> list[list[int]]:
    """Return the samples of each window: neighbours that are kept, without gaps between them."""
    windows: list[list[int]] = []
    current: list[int] = []

    def close() -> None:
        if current and times[current[-1]] - times[current[0]] >= 0.5 * rules.window:
            windows.append(list(current))
        current.clear()

    for index in np.flatnonzero(kept):
        broken = current and (
            index != current[-1] + 1 or times[index] - times[current[-1]] > rules.max_gap
        )
        if broken or (current and times[index] - times[current[0]] > rules.window):
            close()
        current.append(int(index))
    close()
    return windows
