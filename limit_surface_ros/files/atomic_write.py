# SPDX-License-Identifier: Apache-2.0
"""Files written in one step: readers see the old file or the new one, never a part."""

from __future__ import annotations

import os
import secrets
from pathlib import Path

from limit_surface_ros.errors import FileError


def write_atomically(path: str | Path, content: str | bytes) -> None:
    """Write a file in one step: whoever reads sees all of it or what was there before.

    Args:
        path: The file, in a folder that exists.
        content: Text, which is written as UTF-8, or bytes.

    Raises:
        FileError: The folder is absent or not writable, the disk is full, or something that is no
            regular file stands at the path.
    """
    part: Path | None = None
    try:
        # Where a link points, not the link, is what gets new content.
        target = Path(path).resolve()
        if target.exists() and not target.is_file():
            raise FileError(f"{path}: cannot be written: it is no regular file")
        # Named before it is there, so that an interrupt at any moment finds what to take away.
        part = target.with_name(f".{target.name}.{secrets.token_hex(8)}")
        with part.open("xb") as stream:
            stream.write(content.encode() if isinstance(content, str) else content)
            stream.flush()
            os.fsync(stream.fileno())
        part.replace(target)
    except OSError as error:
        raise FileError(f"{path}: cannot be written: {error.strerror or error}") from None
    finally:
        if part is not None:
            part.unlink(missing_ok=True)
