# SPDX-License-Identifier: Apache-2.0
"""Topics of recorded ROS 2 bags (sqlite3 and mcap), as times and numbers.

Bags are read by rosbags (extra `bags`), without ROS. A message with a header counts at the
header's stamp, another at the time when it was recorded.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.errors import FileError, MissingExtraError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from limit_surface_ros.checks import Floats

ACCEPTED = "the folder of a ROS 2 bag, or an .mcap or .db3 file"
WRENCH_FIELDS = tuple(
    f"wrench.{part}.{axis}" for part in ("force", "torque") for axis in ("x", "y", "z")
)
TWIST_FIELDS = tuple(
    f"twist.{part}.{axis}" for part in ("linear", "angular") for axis in ("x", "y", "z")
)


@dataclass(frozen=True, eq=False)
class TopicRecord:
    """What a bag holds of a topic.

    Attributes:
        message_type: Such as "geometry_msgs/msg/WrenchStamped".
        frame_id: Of the first message's header; empty without one.
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
        path: The bag: its folder, or an .mcap file.
        topic: Name of the topic, with or without the slash at its front.
        fields: Dotted names of numbers in the message, such as "wrench.force.x". If not given,
            the message must hold one number.

    Raises:
        MissingExtraError: rosbags is not installed.
        FileError: The bag cannot be read, has not that topic or no message on it, or the message
            has not such a field; the message lists what there is.
    """
    try:
        from rosbags.highlevel import AnyReader, AnyReaderError
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise MissingExtraError("rosbags", "bags") from None
    path = Path(path)
    if not path.exists():
        raise FileError(f"{path}: no such bag")
    if path.is_dir() and not (path / "metadata.yaml").is_file():
        raise FileError(
            f"{path}: cannot be read as a bag: the folder has no metadata.yaml; "
            f"accepted are {ACCEPTED}"
        )
    name = f"/{topic.lstrip('/')}"
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
            found = [entry for entry in reader.connections if entry.topic == name]
            if not found:
                topics = ", ".join(sorted({entry.topic for entry in reader.connections}))
                raise FileError(f"{path}: has no topic {name}; there are {topics or 'none'}")
            messages = [
                (reader.deserialize(raw, entry.msgtype), stamp)
                for entry, stamp, raw in reader.messages(connections=found)
            ]
    except (AnyReaderError, OSError, KeyError) as error:
        reason = str(error).splitlines()[0]
        raise FileError(
            f"{path}: cannot be read as a bag: {reason}; accepted are {ACCEPTED}"
        ) from None
    if not messages:
        raise FileError(f"{path}: has no message on {name}")
    first = messages[0][0]
    chosen = _check_fields(path, name, first, fields)
    times = np.array([_time(message, stamp) for message, stamp in messages])
    values = np.array([[_number(message, field) for field in chosen] for message, _ in messages])
    order = np.argsort(times, kind="stable")
    header = getattr(first, "header", None)
    frame_id = "" if header is None else str(header.frame_id)
    return TopicRecord(found[0].msgtype, frame_id, times[order], values[order])


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


def _time(message: Any, stamp: int) -> float:
    header = getattr(message, "header", None)
    if header is None:
        return stamp * 1e-9
    return float(header.stamp.sec) + float(header.stamp.nanosec) * 1e-9
