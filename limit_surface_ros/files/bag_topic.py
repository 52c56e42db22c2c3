# SPDX-License-Identifier: Apache-2.0
"""Numbers of a topic of a bag over time.

A message with a header counts at the header's stamp, another at the time when it was recorded.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.errors import FileError
from limit_surface_ros.files.bag_reader import errors_of_bag, open_bag

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from limit_surface_ros.checks import Floats


# Of a frame.
LONGEST_NAME = 120


@dataclass(frozen=True, eq=False)
class TopicRecord:
    """What a bag holds of a topic.

    Attributes:
        message_type: Such as "geometry_msgs/msg/WrenchStamped".
        frame_id: Of all messages' headers; empty without one.
        times: Shape (n,), in order [s]; since the epoch, or since the simulation's start.
        values: Shape (n, k), one column for each field asked for.
    """

    message_type: str
    frame_id: str
    times: Floats
    values: Floats


def read_topic(path: str | Path, topic: str, fields: Sequence[str] | None = None) -> TopicRecord:
    """Read fields of a topic's messages.

    Args:
        path: The bag: its folder, or a file of it.
        topic: Name of the topic, with or without the slash at its front.
        fields: Dotted names of numbers in the message, such as "wrench.force.x". If not given,
            the message must hold one number.

    Raises:
        MissingExtraError: rosbags is not installed.
        FileError: The bag cannot be read, has not that topic or no message on it, the message
            has not such a field, or messages are in several frames; the error lists what there is.
    """
    path = Path(path)
    with open_bag(path) as bag:
        name, kind = bag.type_of(topic, (), "")
        messages = list(bag.messages(name))
        if not messages:
            raise FileError(f"{path}: has no message on {name}")
        first = messages[0][0]
        chosen = _check_fields(path, name, first, fields)
        stamps = [stamp_of(message) or 0 for message, _ in messages]
        if not all(stamps):
            # There are none, or not all were filled in: the times of the recording count.
            stamps = [recorded for _, recorded in messages]
        rows = [[_number(message, field) for field in chosen] for message, _ in messages]
        frames = {frame_of(message) for message, _ in messages}
        if len(frames) > 1:
            listed = ", ".join(sorted(repr(frame)[:60] for frame in frames)[:5])
            raise FileError(
                f"{path}: messages on {name} are in {len(frames)} frames, {listed}: numbers in "
                "different frames are no record of one thing"
            )
        frame_id = frames.pop()
    with errors_of_bag(path):
        times = np.array([stamp * 1e-9 for stamp in stamps])
        order = np.argsort(times, kind="stable")
        return TopicRecord(kind, frame_id, times[order], np.array(rows)[order])


def stamp_of(message: Any) -> int | None:
    """Return the stamp in a message's header [ns], None without a header."""
    header = getattr(message, "header", None)
    if header is None:
        return None
    return int(header.stamp.sec) * 10**9 + int(header.stamp.nanosec)


def frame_of(message: Any) -> str:
    """Return the frame in a message's header without the slash of ROS 1, "" without a header."""
    header = getattr(message, "header", None)
    # Longer names are damage.
    return "" if header is None else str(header.frame_id).lstrip("/")[:LONGEST_NAME]


def _check_fields(
    path: Path, topic: str, message: Any, fields: Sequence[str] | None
) -> Sequence[str]:
    """Return the fields asked for, or the only one there is."""
    known = [name for name in _number_fields(message) if not name.startswith("header.")]
    if fields is None:
        if len(known) != 1:
            raise FileError(
                f"{path}: messages on {topic} hold {len(known)} numbers; name one: "
                f"{', '.join(known)}"
            )
        return known
    for field in fields:
        if field not in known:
            raise FileError(
                f"{path}: messages on {topic} have no number {field!r}; there are "
                f"{', '.join(known)}"
            )
    return fields


def _number_fields(message: Any, prefix: str = "") -> Iterator[str]:
    """Yield the dotted names of all numbers in a message, those in arrays left out."""
    for entry in dataclasses.fields(message):
        value = getattr(message, entry.name)
        if dataclasses.is_dataclass(value):
            yield from _number_fields(value, f"{prefix}{entry.name}.")
        elif isinstance(value, (int, float)) and type(value) is not bool:
            yield f"{prefix}{entry.name}"


def _number(message: Any, field: str) -> float:
    for part in field.split("."):
        message = getattr(message, part)
    return float(message)
