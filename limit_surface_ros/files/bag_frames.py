# SPDX-License-Identifier: Apache-2.0
"""The tree of frames in a bag's /tf and /tf_static, and wrenches brought from frame to frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import FileError, FrameError, RangeError
from limit_surface_ros.files.bag_messages import TF_TYPES, transform_parts
from limit_surface_ros.files.bag_reader import errors_of_bag
from limit_surface_ros.files.bag_topic import stamp_of
from limit_surface_ros.surface.frames import RigidTransform

if TYPE_CHECKING:
    from limit_surface_ros.checks import Bools, Floats
    from limit_surface_ros.files.bag_reader import Bag

STATIC_TOPIC, _LONGEST_LIST = "/tf_static", 300
# Numbers beyond this are no transforms, and their products overflow.
_LARGEST = 1e12
ACCEPTED_TRANSFORM = "'x y z roll pitch yaw' or 'x y z qx qy qz qw' [m, rad]"


@dataclass(frozen=True, eq=False)
class MovingTransform:
    """Poses of a source frame in a target frame over time.

    Attributes:
        rotations: Shape (n, 3, 3).
        translations: Shape (n, 3) [m].
        known: Where they are, and not too far from a sample in time, shape (n,).
    """

    rotations: Floats
    translations: Floats
    known: Bools

    def __matmul__(self, first: MovingTransform) -> MovingTransform:
        """Return the transforms that apply `first` and then this one."""
        moved = np.einsum("nij,nj->ni", self.rotations, first.translations)
        return MovingTransform(
            self.rotations @ first.rotations,
            moved + self.translations,
            self.known & first.known,
        )

    @property
    def inverse(self) -> MovingTransform:
        """The transforms from target to source."""
        turned = np.swapaxes(self.rotations, 1, 2)
        return MovingTransform(
            turned, -np.einsum("nij,nj->ni", turned, self.translations), self.known
        )

    def wrenches(self, wrenches: Floats) -> Floats:
        """Return wrenches, shape (n, 6), one for each time, in the target frame."""
        forces = np.einsum("nij,nj->ni", self.rotations, wrenches[:, :3])
        torques = np.einsum("nij,nj->ni", self.rotations, wrenches[:, 3:])
        return np.hstack([forces, torques + np.cross(self.translations, forces)])

    @property
    def tilt(self) -> float:
        """Largest angle between the two frames' z axes [rad]."""
        upright = self.rotations[self.known, 2, 2]
        return float(np.arccos(np.clip(upright.min(), -1.0, 1.0))) if len(upright) else 0.0


def moving(times: Floats, poses: Floats, at: Floats, max_gap: float) -> MovingTransform:
    """Return poses between samples: positions on straight lines, orientations on arcs.

    Args:
        times: Of the samples, shape (m,), increasing [s].
        poses: x, y, z, qx, qy, qz, qw of each, shape (m, 7).
        at: Where to, shape (n,) [s].
        max_gap: Samples further apart do not tell what is between them [s].
    """
    turns = poses[:, 3:] / np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
    # Of q and -q, which are one orientation, that near the one before.
    flips = np.sum(turns[1:] * turns[:-1], axis=1) < 0.0
    signs = np.concatenate([[1.0], np.where(np.cumsum(flips) % 2 == 1, -1.0, 1.0)])
    turns = turns * signs[:, None]
    columns = np.hstack([poses[:, :3], turns])
    values = np.column_stack([np.interp(at, times, column) for column in columns.T])
    known = np.ones(len(at), dtype=bool)
    if len(times) > 1:
        after = np.clip(np.searchsorted(times, at), 1, len(times) - 1)
        outside = np.maximum(times[0] - at, at - times[-1])
        known = (times[after] - times[after - 1] <= max_gap) & (outside <= max_gap)
    return MovingTransform(_rotations(values[:, 3:]), values[:, :3], known)


def fixed(transform: RigidTransform, count: int) -> MovingTransform:
    """Return a transform that is the same all the time."""
    return MovingTransform(
        np.broadcast_to(transform.rotation, (count, 3, 3)),
        np.broadcast_to(transform.translation, (count, 3)),
        np.ones(count, dtype=bool),
    )


def _rotations(quaternions: Floats) -> Floats:
    x, y, z, w = (quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


class FrameTree:
    """The frames of a bag.

    Args:
        bag: An open bag.
        by_recording: Whether the times of the recording count, and not the stamps.
        start: The time from which times are counted [ns].

    Raises:
        FileError: A message cannot be read, or a transform has a zero quaternion.
    """

    def __init__(self, bag: Bag, by_recording: bool, start: int) -> None:
        """Read every topic of transforms."""
        rows: dict[str, list[tuple[int, tuple[float, ...]]]] = {}
        self._parents: dict[str, str] = {}
        self._static: set[str] = set()
        with errors_of_bag(bag.path):
            for topic, kind in bag.types.items():
                if kind not in TF_TYPES:
                    continue
                for message, recorded in bag.messages(topic):
                    for transform in message.transforms:
                        parent, child, pose = transform_parts(transform)
                        time = recorded if by_recording else stamp_of(transform) or recorded
                        if topic.endswith(STATIC_TOPIC):
                            self._static.add(child)
                        if self._parents.setdefault(child, parent) != parent:
                            raise FileError(
                                f"{bag.path}: frame {child[:40]!r} has two parents in /tf: "
                                f"{self._parents[child][:40]!r} and {parent[:40]!r}"
                            )
                        rows.setdefault(child, []).append((time, pose))
            self._poses = {child: _table(listed, start) for child, listed in rows.items()}
        for child, (_, poses) in self._poses.items():
            known = bool((np.abs(poses) <= _LARGEST).all())
            if not known or not (np.linalg.norm(poses[:, 3:], axis=1) > 1e-6).all():
                raise FileError(
                    f"{bag.path}: the transform of frame {child[:40]!r} in /tf has a zero "
                    "quaternion or a number that is not finite, or far too large"
                )

    @property
    def frames(self) -> list[str]:
        """The names of all frames."""
        return sorted({*self._parents, *self._parents.values()})

    @property
    def in_words(self) -> str:
        """The names of all frames for an error, cut where they are too many."""
        return ", ".join(self.frames)[:_LONGEST_LIST] or "none"

    def times_of(self, target: str, source: str) -> Floats:
        """Return the times of the samples of the moving edge between two frames that has most.

        Raises:
            FrameError: Nothing joins them.
        """
        edges = [e for e in self._edges(target, source) if e not in self._static]
        if not edges:
            return np.empty(0)
        return max((self._poses[edge][0] for edge in edges), key=len)

    def look_up(self, target: str, source: str, times: Floats, max_gap: float) -> MovingTransform:
        """Return the poses of a source frame in a target frame at times.

        Raises:
            FrameError: Nothing joins them.
        """
        self._edges(target, source)
        up, common = self._chain(source), set(self._chain(target))
        meeting = next(frame for frame in up if frame in common)
        return self._upwards(target, meeting, times, max_gap).inverse @ self._upwards(
            source, meeting, times, max_gap
        )

    def joins(self, target: str, source: str) -> bool:
        """Tell whether two frames are joined."""
        return bool(set(self._chain(target)) & set(self._chain(source)))

    def _edges(self, target: str, source: str) -> list[str]:
        """Return the children of the edges between two frames."""
        up, down = self._chain(source), self._chain(target)
        meeting = next((frame for frame in up if frame in down), None)
        if meeting is None:
            raise FrameError(
                f"no transform from frame {source!r:.60} to {target!r:.60} is in the bag's /tf or "
                f"/tf_static; frames there: {self.in_words}"
            )
        return up[: up.index(meeting)] + down[: down.index(meeting)]

    def _chain(self, frame: str) -> list[str]:
        chain = [frame]
        while chain[-1] in self._parents and self._parents[chain[-1]] not in chain:
            chain.append(self._parents[chain[-1]])
        return chain

    def _upwards(self, frame: str, top: str, times: Floats, max_gap: float) -> MovingTransform:
        total = fixed(RigidTransform(np.eye(3), np.zeros(3)), len(times))
        while frame != top:
            stamps, poses = self._poses[frame]
            gap = np.inf if frame in self._static or len(stamps) == 1 else max_gap
            total = moving(stamps, poses, times, gap) @ total
            frame = self._parents[frame]
        return total


def _table(rows: list[tuple[int, tuple[float, ...]]], start: int) -> tuple[Floats, Floats]:
    stamps = np.array([time for time, _ in rows], dtype=np.int64)
    poses = np.array([pose for _, pose in rows], dtype=np.float64)
    times, first = np.unique(stamps, return_index=True)
    return np.asarray((times - start) * 1e-9, dtype=np.float64), poses[first]


def transform_of_text(text: str) -> RigidTransform:
    """Return the transform that an option states: the pose of a sensor in the body's frame.

    Raises:
        RangeError: The text states none.
    """
    try:
        numbers = [float(word) for word in text.replace(",", " ").split()]
    except ValueError as error:
        raise RangeError(
            f"--wrench-transform {text!r:.80}: {error}; accepted is {ACCEPTED_TRANSFORM}"
        ) from None
    sized = len(numbers) in (6, 7) and bool(np.isfinite(numbers).all())
    if not sized or (len(numbers) == 7 and not any(numbers[3:])):
        raise RangeError(f"--wrench-transform {text!r:.80}: accepted is {ACCEPTED_TRANSFORM}")
    build = RigidTransform.from_euler if len(numbers) == 6 else RigidTransform.from_quaternion
    return build(numbers[:3], numbers[3:])
