# SPDX-License-Identifier: Apache-2.0
"""Text as loggers and spreadsheets write it: UTF-8, UTF-16 or Latin-1."""

from __future__ import annotations

import codecs
from typing import TYPE_CHECKING

from limit_surface_ros.errors import FileError
from limit_surface_ros.files.regular_file import read_bytes

if TYPE_CHECKING:
    from pathlib import Path

LARGEST_TEXT = 2**28
_BYTE_ORDER_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
# How files begin that people take for text.
_KNOWN_BINARIES = (
    (b"PK\x03\x04", "a zip archive, as .xlsx workbooks are: export the sheet as CSV"),
    (b"\x1f\x8b", "compressed by gzip: unpack it first"),
    (b"MATLAB 5.0", "a MATLAB file: write its columns with writematrix or writetable"),
    (b"\x89HDF", "an HDF5 file: write its columns as CSV"),
    (b"TDSm", "a TDMS file of LabVIEW: export it as text"),
    (b"SQLite format 3\x00", "an SQLite database: a bag's file must end in .db3"),
    (b"\x89MCAP", "an MCAP recording: a bag's file must end in .mcap"),
    (b"#ROSBAG", "a ROS 1 bag: its file must end in .bag"),
)
_LOOKED_AT = 4096


def read_lines(path: Path, what: str = "a CSV file") -> list[str]:
    """Return the lines of a text file.

    A byte order mark decides the encoding; without one it is UTF-8, UTF-16 where every other byte
    is 0, and Latin-1 (as Windows extends it) where the bytes are no UTF-8.

    Args:
        path: The file.
        what: The kind of file that is accepted, for errors.

    Raises:
        FileError: The file is absent, no regular file, too large, or holds no text.
    """
    content = read_bytes(path, LARGEST_TEXT, what)
    for start, kind in _KNOWN_BINARIES:
        if content.startswith(start):
            raise FileError(f"{path}: is {kind}")
    text = _decoded(content)
    if text is None or "\x00" in text:
        raise FileError(f"{path}: holds bytes that are no text; {what} is accepted")
    return text.splitlines()


def _decoded(content: bytes) -> str | None:
    for mark, encoding in _BYTE_ORDER_MARKS:
        if content.startswith(mark):
            return _tried(content, encoding)
    part = content[:_LOOKED_AT]
    if len(part) >= 4 and len(content) % 2 == 0:
        if 4 * part[1::2].count(0) > len(part):
            return _tried(content, "utf-16-le")
        if 4 * part[0::2].count(0) > len(part):
            return _tried(content, "utf-16-be")
    text = _tried(content, "utf-8")
    return content.decode("cp1252", errors="replace") if text is None else text


def _tried(content: bytes, encoding: str) -> str | None:
    try:
        return content.decode(encoding)
    except UnicodeDecodeError:
        return None
