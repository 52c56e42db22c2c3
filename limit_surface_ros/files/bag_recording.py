# SPDX-License-Identifier: Apache-2.0
"""The recording in a bag: wrenches and motion of a body, on one clock and in the body's frame.

The load on the body is read of `bag_messages.WRENCHES`, its motion of `bag_messages.MOTIONS`:
poses in a fixed frame, or twists in the body's frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import DataError, FileError, FrameError, RangeError
from limit_surface_ros.files.bag_frames import FrameTree, MovingTransform, fixed, moving
from limit_surface_ros.files.bag_messages import (
    MOTIONS,
    POSES,
    TF_TYPES,
    TWISTS,
    WRENCHES,
    Samples,
    planar_poses,
    read_samples,
)
from limit_surface_ros.files.bag_reader import open_bag
from limit_surface_ros.files.recordings.pushes import LARGEST_SAMPLE, Recording
from limit_surface_ros.files.recordings.selection import Selection

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.files.bag_reader import Bag
    from limit_surface_ros.files.recordings.pushes import ToBody
    from limit_surface_ros.surface.frames import RigidTransform

# The body's frame where nothing names it, as in model files.
DEFAULT_BODY = "object"
STAMPS = ("auto", "header", "recorded")
# Stamps of the two topics share at least this part of the shorter recording, or their clocks are
# not one; a sensor's z axis is that of the body within the angle.
_SHARED, _ALONG = 0.1, np.radians(5.0)


@dataclass(frozen=True)
class BagFrames:
    """What a user knows of the frames in a bag, and of its clocks.

    Attributes:
        body: The body's frame; where it is None, that of the twists, that which messages name as
            their child, or "object".
        fixed: In which poses of the body are looked for in /tf.
        wrench_transform: Pose of the wrenches' frame in the body's; /tf is then not looked at.
        stamps: "header", or "recorded" for the times of the recording; "auto" takes these where
            headers have no stamps, or those of the two topics are of different clocks.
    """

    body: str | None = None
    fixed: str | None = None
    wrench_transform: RigidTransform | None = None
    stamps: str = "auto"

    def __post_init__(self) -> None:
        """Check the clock."""
        if self.stamps not in STAMPS:
            raise RangeError(f"stamps must be {', '.join(STAMPS)}, got {self.stamps!r}")


@dataclass(frozen=True, eq=False)
class BagRecording:
    """The recording in a bag.

    Attributes:
        recording: As arrays.
        frame_id: The body's frame.
        notes: How it was read, in one line each.
    """

    recording: Recording
    frame_id: str
    notes: tuple[str, ...]


def read_bag_recording(
    path: str | Path,
    wrench_topic: str,
    motion_topic: str,
    max_gap: float = Selection.max_gap,
    frames: BagFrames | None = None,
) -> BagRecording:
    """Read wrenches and motion from a bag.

    Args:
        path: The bag: its folder, or a file of it.
        wrench_topic: Of wrenches.
        motion_topic: Of motions.
        max_gap: Transforms further apart do not tell what is between them [s].
        frames: What is known of frames and clocks.

    Raises:
        MissingExtraError: rosbags is not installed.
        FileError: The bag cannot be read, a topic is not there or of another type, or the frames
            do not fit.
        DataError: There are fewer than two motions, or the clocks do not meet.
    """
    known, path = frames or BagFrames(), Path(path)
    with open_bag(path) as bag:
        return _Reading(bag, known, max_gap).read(wrench_topic, motion_topic)


class _Reading:
    """One bag as it is read."""

    def __init__(self, bag: Bag, known: BagFrames, max_gap: float) -> None:
        self._bag, self._known, self._max_gap = bag, known, max_gap
        self._path, self.notes = bag.path, list[str]()
        self._tree: FrameTree | None = None
        self._start, self._by_recording = 0, False

    def read(self, wrench_topic: str, motion_topic: str) -> BagRecording:
        wrenches = read_samples(self._bag, wrench_topic, WRENCHES, "wrenches")
        name, kind = self._bag.type_of(motion_topic, MOTIONS, "motions")
        if kind in TF_TYPES:
            times, poses = self._of_tf(name, wrenches)
            recording = self._of_poses(wrenches, times, poses, self._known.body or "", "")
        else:
            readers = TWISTS if kind in TWISTS else POSES
            motion = read_samples(self._bag, name, readers, "motions")
            self._choose_clock(wrenches, motion)
            times = self._clean(motion)
            if len(times) < 2:
                raise DataError(
                    f"{self._path}: {name} holds {len(times)} motions, at least 2 are needed"
                )
            if kind in TWISTS:
                recording = self._of_twists(wrenches, times, motion)
            else:
                recording = self._of_poses(wrenches, times, motion, motion.child, motion.frame)
        self._check_overlap(recording)
        return BagRecording(recording, self._body, tuple(self.notes + wrenches.notes))

    def _of_twists(self, wrenches: Samples, times: Floats, motion: Samples) -> Recording:
        """Twists are in the body's frame."""
        body = self._known.body or motion.frame or wrenches.frame or DEFAULT_BODY
        if motion.frame not in ("", body):
            raise FileError(
                f"{self._path}: motions are given in frame {motion.frame!r}; twists must be in "
                f"the body's frame, {body!r}"
            )
        foreign = wrenches.frame not in ("", body) and self._known.wrench_transform is None
        if foreign and not self._frames().joins(body, wrenches.frame):
            raise FileError(
                f"{self._path}: motions are given in frame {motion.frame!r}; they must be in the "
                f"frame of the wrenches, {wrenches.frame!r}, which must be the body's"
                f"{self._ways(wrenches.frame)}"
            )
        self._body = body
        to_body, wrench_times = self._bring(wrenches, None)
        planar = motion.values[:, [0, 1, 5]]
        return Recording(wrench_times, wrenches.values, times, planar, False, to_body)

    def _of_poses(
        self, wrenches: Samples, times: Floats, poses: Samples, child: str, frame: str
    ) -> Recording:
        """Poses of the body are in a fixed frame."""
        sensor = wrenches.frame
        if frame and frame == sensor and self._known.wrench_transform is None:
            raise FileError(
                f"{self._path}: motions are given in frame {frame!r}; they must be in another "
                f"frame than the wrenches, {sensor!r}, which must be the body's"
            )
        if self._known.body and child and child != self._known.body:
            raise FileError(
                f"{self._path}: {poses.topic} gives poses of frame {child!r}, and --body says "
                f"{self._known.body!r}"
            )
        self._body = self._known.body or child or DEFAULT_BODY
        planar = planar_poses(poses, self._path)
        self.notes += poses.notes
        route = None
        joined = sensor not in ("", self._body) and self._known.wrench_transform is None
        if joined and not self._frames().joins(self._body, sensor):
            if not (frame and self._frames().joins(frame, sensor)):
                raise FileError(
                    f"{self._path}: wrenches are in frame {sensor!r} and the body's frame is "
                    f"{self._body!r}: nothing in /tf or /tf_static joins them{self._ways(sensor)}"
                )
            route = frame, times, poses.values
        to_body, wrench_times = self._bring(wrenches, route)
        return Recording(wrench_times, wrenches.values, times, planar, True, to_body)

    def _of_tf(self, topic: str, wrenches: Samples) -> tuple[Floats, Samples]:
        """Return the poses of the body in the fixed frame that /tf gives."""
        body, frame = self._known.body, self._known.fixed
        self._by_recording = self._known.stamps == "recorded"
        self._start = int((wrenches.recorded if self._by_recording else wrenches.stamps).min())
        if self._start == 0 and self._known.stamps == "auto":
            self._by_recording, self._start = True, int(wrenches.recorded.min())
            self.notes.append("wrenches have no stamps: the times of the recording are taken")
        tree = self._frames()
        if body is None or frame is None:
            raise FileError(
                f"{self._path}: {topic} holds transforms: say of which frame with --body, and in "
                f"which with --fixed; frames there: {tree.in_words}"
            )
        try:
            times = tree.times_of(frame, body)
            if len(times) < 2:
                raise DataError(
                    f"{self._path}: /tf holds {len(times)} poses of {body!r} in {frame!r}, at "
                    "least 2 are needed"
                )
            placed = tree.look_up(frame, body, times, self._max_gap)
        except FrameError as error:
            raise FileError(f"{self._path}: {error}") from None
        times = times[placed.known]
        x, y = placed.translations[placed.known, :2].T
        rotations = placed.rotations[placed.known]
        half = 0.5 * np.unwrap(np.arctan2(rotations[:, 1, 0], rotations[:, 0, 0]))
        zeros = np.zeros(len(times))
        values = np.column_stack([x, y, zeros, zeros, zeros, np.sin(half), np.cos(half)])
        stamps = np.zeros(len(times), dtype=np.int64)
        return times, Samples(topic, "", stamps, stamps, values, frame, body)

    def _choose_clock(self, wrenches: Samples, motion: Samples) -> None:
        """Decide whether stamps or the times of the recording count."""
        how = self._known.stamps
        if how == "auto":
            how = "header"
            missing = [s.topic for s in (wrenches, motion) if not s.stamps.all()]
            if missing:
                how = "recorded"
                self.notes.append(
                    f"messages on {' and '.join(missing)} have no stamps: the times of the "
                    "recording are taken"
                )
            elif not _meet(wrenches.stamps, motion.stamps) and _meet(
                wrenches.recorded, motion.recorded
            ):
                how = "recorded"
                apart = 1e-9 * float(np.median(wrenches.stamps) - np.median(motion.stamps))
                self.notes.append(
                    f"the clocks of {wrenches.topic} and {motion.topic} are {apart:.6g} s apart: "
                    "the times of the recording are taken"
                )
        self._by_recording = how == "recorded"
        self._start = int(min(self._ticks(wrenches).min(), self._ticks(motion).min()))

    def _ticks(self, samples: Samples) -> Floats:
        ticks: Floats = samples.recorded if self._by_recording else samples.stamps
        return ticks

    def _clean(self, samples: Samples) -> Floats:
        """Sort samples, leave out those that are not finite or repeat a time; return times [s]."""
        finite = (np.abs(samples.values) <= LARGEST_SAMPLE).all(axis=1)
        if not finite.all():
            left = int(np.count_nonzero(~finite))
            self.notes.append(f"{left} messages on {samples.topic} are not finite: left out")
            samples.keep(finite)
        _, first = np.unique(self._ticks(samples), return_index=True)
        repeated = len(samples.values) - len(first)
        if repeated:
            self.notes.append(f"{repeated} messages on {samples.topic} repeat a time: left out")
        samples.keep(first)
        return np.asarray((self._ticks(samples) - self._start) * 1e-9)

    def _frames(self) -> FrameTree:
        if self._tree is None:
            self._tree = FrameTree(self._bag, self._by_recording, self._start)
        return self._tree

    def _bring(
        self, wrenches: Samples, route: tuple[str, Floats, Floats] | None
    ) -> tuple[ToBody | None, Floats]:
        """Return what takes wrenches to the body's frame, and their times."""
        _, first = np.unique(self._ticks(wrenches), return_index=True)
        wrenches.keep(first)
        times = np.asarray((self._ticks(wrenches) - self._start) * 1e-9)
        given = self._known.wrench_transform
        if given is not None:
            self.notes.append("wrenches are brought to the body's frame by the transform given")
            return lambda at, values: fixed(given, len(at)).wrenches(values), times
        sensor = wrenches.frame
        if sensor in ("", self._body):
            if not sensor:
                self.notes.append(
                    f"wrenches name no frame: they are taken as those in the body's, "
                    f"{self._body!r}"
                )
            return None, times

        def transforms(at: Floats) -> MovingTransform:
            tree = self._frames()
            if route is None:
                return tree.look_up(self._body, sensor, at, self._max_gap)
            frame, pose_times, poses = route
            placed = moving(pose_times, poses, at, self._max_gap)
            return placed.inverse @ tree.look_up(frame, sensor, at, self._max_gap)

        found = transforms(times)
        self._note_transforms(sensor, found)
        wrenches.keep(found.known)
        return lambda at, values: transforms(at).wrenches(values), times[found.known]

    def _note_transforms(self, sensor: str, found: MovingTransform) -> None:
        unknown = int(np.count_nonzero(~found.known))
        if unknown == len(found.known):
            raise DataError(
                f"{self._path}: no wrench in frame {sensor!r} has a transform near it in time"
            )
        self.notes.append(
            f"wrenches are brought from frame {sensor!r} to the body's, {self._body!r}, by the "
            "bag's transforms"
        )
        if unknown:
            self.notes.append(f"{unknown} wrenches have no transform near them: left out")
        if found.tilt > _ALONG:
            self.notes.append(
                f"frame {sensor!r} is tilted by up to {np.degrees(found.tilt):.0f} deg against "
                "the body's plane: the weight of a tool behind the sensor is not known and not "
                "taken away"
            )

    def _ways(self, sensor: str) -> str:
        """Return what helps where wrenches are in a foreign frame, to end a message."""
        frames = self._frames().in_words
        return (
            f"; frames in /tf: {frames}. Say --body {sensor} if that is the body's frame, or give "
            "its pose in the body's with --wrench-transform 'x y z roll pitch yaw'"
        )

    def _check_overlap(self, recording: Recording) -> None:
        first, last = recording.wrench_times, recording.motion_times
        if not len(first) or first[0] > last[-1] or last[0] > first[-1]:
            apart = float(np.median(first) - np.median(last)) if len(first) else 0.0
            raise DataError(
                f"{self._path}: wrenches and motions never meet in time, they are {apart:.6g} s "
                "apart: are their clocks different? --stamps recorded takes the times at which "
                "they were recorded"
            )


def _meet(first: Floats, second: Floats) -> bool:
    """Tell whether two lists of times are of one clock by all appearance."""
    shared = min(first.max(), second.max()) - max(first.min(), second.min())
    shorter = min(np.ptp(first), np.ptp(second))
    return bool(shared >= _SHARED * shorter)
