# SPDX-License-Identifier: Apache-2.0
"""What every reader opens files with: regular files only, and never more than a limit.

A name may stand for a pipe that nobody writes to, for /dev/zero, or for a file that still grows:
neither may hold a program, nor fill the memory.
"""

from __future__ import annotations

import json
import os
import stat
from pathlib import Path
from typing import Any

from limit_surface_ros.errors import FileError

# Opened in this way, a pipe that took the file's place since it was looked at holds nobody.
_FLAGS = os.O_RDONLY | os.O_CLOEXEC | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0)


def check_regular(path: str | Path) -> os.stat_result:
    """Return the status of a regular file, for readers that open it by its name themselves.

    Raises:
        FileError: The file is absent, not to be looked at, or a folder, a pipe or a device.
    """
    try:
        status = Path(path).stat()
    except (OSError, ValueError) as error:  # a NUL character in the name is a ValueError
        raise _unreadable(path, getattr(error, "strerror", None) or error) from None
    _require_regular(path, status)
    return status


def read_bytes(path: str | Path, most: int, what: str = "a model") -> bytes:
    """Return the content of a regular file of at most so many bytes.

    Args:
        path: The file.
        most: Its size at most [bytes]; no more is ever read.
        what: What it is read as, for the error.

    Raises:
        FileError: The file is absent, unreadable, no regular file, or larger.
    """
    check_regular(path)
    try:
        with os.fdopen(os.open(path, _FLAGS), "rb") as stream:
            status = os.fstat(stream.fileno())
            _require_regular(path, status)
            # The files of /proc state no size, and others may grow meanwhile.
            content = b"" if status.st_size > most else stream.read(most + 1)
    except OSError as error:
        raise _unreadable(path, error.strerror or error) from None
    size = max(status.st_size, len(content))
    if size > most:
        raise FileError(f"{path}: has {size} bytes; at most {most} are read as {what}")
    return content


def read_text(path: str | Path, most: int, what: str = "a model") -> str:
    """Return the text of a regular file in UTF-8, with or without a mark of the byte order.

    Args:
        path: The file.
        most: Its size at most [bytes]; no more is ever read.
        what: What it is read as, for the error.

    Raises:
        FileError: The file is absent, unreadable, no regular file, larger, or no UTF-8 text.
    """
    content = read_bytes(path, most, what)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileError(f"{path}: is not UTF-8 text: {error}") from None


def json_object(text: str, place: str) -> dict[str, Any]:
    """Return the JSON object that a text holds.

    Args:
        text: The text.
        place: Where it stands, for the error, such as "pushes.csv: line 1".

    Raises:
        FileError: The text is no JSON, nested too deep, or holds something else than an object.
    """
    try:
        values = json.loads(text)
    except ValueError as error:
        raise FileError(f"{place}: is not a JSON object: {error}") from None
    except RecursionError:
        raise FileError(f"{place}: is not a JSON object: it is nested too deep") from None
    if not isinstance(values, dict):
        found = f"{type(values).__name__} at its top level"
        raise FileError(f"{place}: is not a JSON object: holds {found}")
    return values


def _require_regular(path: str | Path, status: os.stat_result) -> None:
    if stat.S_ISDIR(status.st_mode):
        raise _unreadable(path, "Is a directory")
    if not stat.S_ISREG(status.st_mode):
        raise _unreadable(path, "it is no regular file")


def _unreadable(path: str | Path, reason: object) -> FileError:
    return FileError(f"{path}: cannot be read: {reason}")
