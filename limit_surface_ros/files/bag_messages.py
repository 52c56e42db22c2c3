# SPDX-License-Identifier: Apache-2.0
"""Wrenches, poses, twists and transforms in a bag's messages, with every message's frame.

Quaternions of any norm but zero are orientations; their yaw needs no unit norm.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from limit_surface_ros.errors import FileError
from limit_surface_ros.files.bag_reader import errors_of_bag
from limit_surface_ros.files.bag_topic import LONGEST_NAME, frame_of, stamp_of

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.files.bag_reader import Bag

# (frame, child's frame, numbers) of a message.
Parts: TypeAlias = tuple[str, str, tuple[float, ...]]
_ZERO_NORM, _UNIT_WITHIN, _UPRIGHT = 1e-6, 1e-2, np.cos(np.radians(5.0))
_MOST_FRAMES = 5


@dataclass(eq=False)
class Samples:
    """Messages of a topic as numbers.

    Attributes:
        topic: Its name.
        kind: Its type.
        stamps: In the headers, shape (n,) [ns]; 0 without one.
        recorded: When each was recorded, shape (n,) [ns].
        values: Shape (n, k).
        frame: That of all headers, "" without one.
        child: The frame that poses are of, where messages name it.
        notes: What people should know, one line each.
    """

    topic: str
    kind: str
    stamps: Any
    recorded: Any
    values: Floats
    frame: str
    child: str
    notes: list[str] = field(default_factory=list)

    def keep(self, kept: Any) -> None:
        """Keep some messages, given by a mask or an order."""
        self.stamps, self.recorded = self.stamps[kept], self.recorded[kept]
        self.values = self.values[kept]


def _child(message: Any) -> str:
    return str(getattr(message, "child_frame_id", "")).lstrip("/")[:LONGEST_NAME]


def _wrench(message: Any) -> Parts:
    load = getattr(message, "wrench", message)
    return frame_of(message), "", (*_vector(load.force), *_vector(load.torque))


def _twist(message: Any) -> Parts:
    motion = message
    while hasattr(motion, "twist"):
        motion = motion.twist
    return frame_of(message), "", (*_vector(motion.linear), *_vector(motion.angular))


def _pose(message: Any) -> Parts:
    pose = message
    while hasattr(pose, "pose"):
        pose = pose.pose
    turn = pose.orientation
    numbers = (*_vector(pose.position), turn.x, turn.y, turn.z, turn.w)
    return frame_of(message), _child(message), numbers


def _planar_pose(message: Any) -> Parts:
    half = 0.5 * float(message.theta)
    return "", "", (message.x, message.y, 0.0, 0.0, 0.0, float(np.sin(half)), float(np.cos(half)))


def transform_parts(message: Any) -> Parts:
    """Return the frames and the pose of a TransformStamped."""
    moved, turn = message.transform.translation, message.transform.rotation
    numbers = (*_vector(moved), turn.x, turn.y, turn.z, turn.w)
    return frame_of(message), _child(message), numbers


def _vector(vector: Any) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z


_GEOMETRY, _TF = "geometry_msgs/msg/", "tf2_msgs/msg/TFMessage"
TF_TYPES = (_TF, "tf/msg/tfMessage")
WRENCHES: dict[str, Callable[[Any], Parts]] = {
    f"{_GEOMETRY}WrenchStamped": _wrench,
    f"{_GEOMETRY}Wrench": _wrench,
}
TWISTS: dict[str, Callable[[Any], Parts]] = {
    f"{_GEOMETRY}TwistStamped": _twist,
    f"{_GEOMETRY}TwistWithCovarianceStamped": _twist,
    f"{_GEOMETRY}Twist": _twist,
}
POSES: dict[str, Callable[[Any], Parts]] = {
    f"{_GEOMETRY}PoseStamped": _pose,
    f"{_GEOMETRY}PoseWithCovarianceStamped": _pose,
    f"{_GEOMETRY}Pose": _pose,
    f"{_GEOMETRY}Pose2D": _planar_pose,
    f"{_GEOMETRY}TransformStamped": transform_parts,
    "nav_msgs/msg/Odometry": _pose,
}
# In the order in which messages list them; of TFMessage the transforms joining two frames.
MOTIONS = (*POSES, *TF_TYPES, *TWISTS)


def read_samples(
    bag: Bag, topic: str, readers: dict[str, Callable[[Any], Parts]], what: str
) -> Samples:
    """Read a topic.

    Args:
        bag: An open bag.
        topic: With or without the slash at its front.
        readers: What takes the parts out of a message of each type.
        what: The topic is of, for errors.

    Raises:
        FileError: The topic is absent, empty, of another type, or its messages are in more than
            one frame.
    """
    name, kind = bag.type_of(topic, tuple(readers), what)
    parts_of = readers[kind]
    stamps, recorded, rows = [], [], []
    frames: Counter[tuple[str, str]] = Counter()
    with errors_of_bag(bag.path):
        for message, time in bag.messages(name):
            frame, child, numbers = parts_of(message)
            stamps.append(stamp_of(message) or 0)
            recorded.append(time)
            rows.append([float(number) for number in numbers])
            frames[frame, child] += 1
        values = np.array(rows)
        times = np.array(stamps, dtype=np.int64), np.array(recorded, dtype=np.int64)
    if not rows:
        raise FileError(f"{bag.path}: has no message on {name}")
    if len(frames) > 1:
        raise FileError(
            f"{bag.path}: messages on {name} are in more than one frame, of which one must be "
            f"chosen before they are recorded: {counts_in_words(frames)}"
        )
    (frame, child) = next(iter(frames))
    return Samples(name, kind, *times, values, frame, child)


def counts_in_words(frames: Counter[tuple[str, str]]) -> str:
    """Return frames with how many messages are in each, the most frequent first."""
    parts = []
    for (frame, child), count in frames.most_common(_MOST_FRAMES):
        of = f" of {child[:40]!r}" if child else ""
        parts.append(f"{frame[:40]!r}{of} ({count})")
    more = len(frames) - len(parts)
    return ", ".join(parts) + (f" and {more} more" if more > 0 else "")


def planar_poses(samples: Samples, path: Any) -> Floats:
    """Return (x, y, yaw) of poses, shape (n, 3), yaw without jumps, and note what is odd of them.

    Raises:
        FileError: A quaternion is zero: it is no orientation.
    """
    x, y, z, w = samples.values[:, 3:7].T
    norms = np.sqrt(x * x + y * y + z * z + w * w)
    zero = int(np.count_nonzero(norms < _ZERO_NORM))
    if zero:
        raise FileError(
            f"{path}: {zero} of {len(norms)} messages on {samples.topic} have a zero quaternion, "
            "which is no orientation: fill the orientation in where the poses are made"
        )
    odd = np.abs(norms - 1.0) > _UNIT_WITHIN
    if odd.any():
        samples.notes.append(
            f"{np.count_nonzero(odd)} of {len(norms)} quaternions on {samples.topic} have norms "
            f"from {norms.min():.3g} to {norms.max():.3g} and not 1; their yaw is read "
            "all the same"
        )
    upright = (w * w + z * z - x * x - y * y) / norms**2
    if (upright < _UPRIGHT).any():
        tilt = np.degrees(np.arccos(np.clip(upright.min(), -1.0, 1.0)))
        samples.notes.append(
            f"the body's z axis on {samples.topic} is tilted by up to {tilt:.1f} deg against that "
            "of the fixed frame: motion in the plane alone is read"
        )
    yaw = np.arctan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
    return np.column_stack([samples.values[:, :2], np.unwrap(yaw)])
