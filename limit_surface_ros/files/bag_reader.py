# SPDX-License-Identifier: Apache-2.0
"""Recorded bags of ROS 2 (sqlite3, MCAP, also compressed by zstd) and ROS 1, opened and listed.

Bags are read by rosbags (extra `bags`), without ROS. Whatever fails in it, or in what it reads by,
becomes an error of this package that names the remedy.
"""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from limit_surface_ros.errors import FileError, LimitSurfaceError, MissingExtraError
from limit_surface_ros.files.regular_file import check_regular

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

ACCEPTED = "the folder of a ROS 2 bag, or an .mcap, .db3 or .bag file"
BAG_SUFFIXES = (".mcap", ".db3", ".bag")
_STORED = (*BAG_SUFFIXES, ".zstd", ".yaml")
_LONGEST_REASON, _LONGEST_LIST = 200, 600


class Bag:
    """An open bag.

    Attributes:
        path: Its folder or file.
        types: The message type of each topic, by its name.
    """

    def __init__(self, path: Path, reader: Any) -> None:
        """Take an open reader of rosbags."""
        self.path = path
        self._reader = reader
        self.types: dict[str, str] = {
            str(connection.topic): str(connection.msgtype) for connection in reader.connections
        }

    def type_of(self, topic: str, accepted: Collection[str], what: str) -> tuple[str, str]:
        """Return the full name of a topic and its type.

        Args:
            topic: With or without the slash at its front.
            accepted: The types that are taken; any if there are none.
            what: The topic is of, as "wrenches", for the error.

        Raises:
            FileError: There is no such topic, or it is of another type; the message lists what
                there is and what is taken.
        """
        name = f"/{topic.lstrip('/')}"
        name = topic if topic in self.types and name not in self.types else name
        if name not in self.types:
            fit = [key for key, kind in self.types.items() if kind in accepted]
            hint = f"; of {what} there are {_listed(fit)}" if accepted else ""
            raise FileError(
                f"{self.path}: has no topic {name:.200}; there are {_listed(self.types)}{hint}"
            )
        kind = self.types[name]
        if accepted and kind not in accepted:
            raise FileError(
                f"{self.path}: topic {name:.200} is of type {kind:.100}; {what} are read of "
                f"{', '.join(accepted)}; there are "
                f"{_listed(f'{key} ({kind})' for key, kind in self.types.items())}"
            )
        return name, kind

    def messages(self, topic: str) -> Iterator[tuple[Any, int]]:
        """Yield the messages of a topic that is there, and when each was recorded [ns].

        Raises:
            FileError: A message cannot be read.
        """
        with errors_of_bag(self.path):
            found = [entry for entry in self._reader.connections if entry.topic == topic]
            for entry, stamp, raw in self._reader.messages(connections=found):
                yield self._reader.deserialize(raw, entry.msgtype), int(stamp)


@contextmanager
def open_bag(path: str | Path) -> Iterator[Bag]:
    """Open a bag inside the block.

    Args:
        path: Its folder, or a file of it.

    Raises:
        MissingExtraError: rosbags is not installed.
        FileError: It cannot be read as a bag.
    """
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise MissingExtraError("rosbags", "bags") from None
    path = Path(path)
    _check(path)
    with errors_of_bag(path):
        reader = AnyReader([path], default_typestore=get_typestore(Stores.ROS2_JAZZY))
        reader.open()
        try:
            bag = Bag(path, reader)
            yield bag
        finally:
            reader.close()


def _check(path: Path) -> None:
    """Refuse what is no bag by its name, and what only seems to be a file."""
    if not path.exists():
        raise FileError(f"{path}: no such bag")
    if not path.is_dir():
        check_regular(path)
        if path.suffix.lower() not in BAG_SUFFIXES:
            packed = "; unpack it, or give its folder" if path.suffix == ".zstd" else ""
            raise FileError(f"{path}: cannot be read as a bag; accepted are {ACCEPTED}{packed}")
        return
    try:
        for entry in path.iterdir():
            if entry.suffix.lower() in _STORED:
                check_regular(entry)
        known = (path / "metadata.yaml").is_file()
        stored = sorted(e.name for e in path.iterdir() if e.suffix.lower() in BAG_SUFFIXES)
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror or error}") from None
    if not known:
        remedy = f"accepted are {ACCEPTED}"
        if stored:
            remedy = f"`ros2 bag reindex {path}` writes it, or give the file {stored[0]} itself"
        raise FileError(
            f"{path}: cannot be read as a bag: the folder has no metadata.yaml; {remedy}"
        )


@contextmanager
def errors_of_bag(path: Path) -> Iterator[None]:
    """Turn whatever reading a bag raises inside the block into a FileError with the remedy."""
    try:
        yield
    except (LimitSurfaceError, GeneratorExit):
        raise
    # A damaged bag fails anywhere: in YAML, SQLite, decompression, CDR, or for want of memory.
    except Exception as error:
        text = " ".join(str(error).split()) or "no reason is given"
        reason = f"{type(error).__name__}: {text[:_LONGEST_REASON]}"
        raise FileError(
            f"{path}: cannot be read as a bag: {reason}; accepted are {ACCEPTED}. {_remedy(path)}"
        ) from None


def _remedy(path: Path) -> str:
    if path.suffix.lower() == ".bag":
        return f"If it was cut while it was recorded: `rosbag reindex {path.name}`"
    if path.is_dir():
        return (
            f"If it was cut while it was recorded: `ros2 bag reindex {path.name}`, or give the "
            ".mcap or .db3 file in it"
        )
    if path.suffix.lower() == ".mcap":
        return f"If it was cut while it was recorded: `mcap recover {path.name} -o whole.mcap`"
    return (
        f"If it was cut while it was recorded: `sqlite3 {path.name} .recover | sqlite3 whole.db3`"
    )


def _listed(names: Collection[str] | Iterator[str]) -> str:
    text = ", ".join(sorted(names)) or "none"
    return text if len(text) <= _LONGEST_LIST else f"{text[:_LONGEST_LIST]} ..."
