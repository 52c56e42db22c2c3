# SPDX-License-Identifier: Apache-2.0
"""Files written in one step: readers see the old file or the new one, never a part."""

from __future__ import annotations

import contextlib
import os
import re
import secrets
from pathlib import Path

from limit_surface_ros.errors import FileError

# Characters of the name, of up to four bytes each, in that of the part: file systems take 255.
_MOST = 50
# A part so much older than the file that has just been written belongs to a write that was killed
# [s]: none takes so long.
_ABANDONED = 600.0


def write_atomically(path: str | Path, content: str | bytes) -> None:
    """Write a file in one step: whoever reads sees all of it or what was there before.

    A write that is killed leaves its part in the folder, a hidden file; a later one of the same
    file removes it.

    Args:
        path: The file, in a folder that exists.
        content: Text, which is written as UTF-8, or bytes.

    Raises:
        FileError: The folder is absent or not writable, the disk is full, or something that is no
            regular file stands at the path.
    """
    part: Path | None = None
    try:
        target = _target(path)
        # Named before it is there, so that an interrupt at any moment finds what to take away.
        part = target.with_name(f".{target.name[:_MOST]}.{secrets.token_hex(8)}")
        with part.open("xb") as stream:
            stream.write(content.encode() if isinstance(content, str) else content)
            stream.flush()
            os.fsync(stream.fileno())
        part.replace(target)
        _remove_abandoned(target)
    except FileError:
        raise
    except (OSError, RuntimeError, ValueError) as error:
        raise _unwritable(path, error) from None
    finally:
        if part is not None:
            # A file system that has become read-only refuses even where there is nothing.
            with contextlib.suppress(OSError):
                part.unlink()


def check_writable(path: str | Path) -> Path:
    """Return where `write_atomically` would write; for those who write long after they were told.

    Raises:
        FileError: The folder is absent or not writable, or something that is no regular file
            stands at the path.
    """
    try:
        target = _target(path)
        if not target.parent.is_dir():
            raise FileError(f"{path}: its folder does not exist: make {target.parent} first")
        if not os.access(target.parent, os.W_OK | os.X_OK):
            raise FileError(f"{path}: cannot be written: its folder is read-only")
    except FileError:
        raise
    except (OSError, RuntimeError, ValueError) as error:
        # A name too long or with a NUL in it, no permission on the way, a loop of links.
        raise _unwritable(path, error) from None
    return target


def _remove_abandoned(target: Path) -> None:
    """Remove the parts that killed writes of a file, which has just been written, have left."""
    part = re.compile(rf"\.{re.escape(target.name[:_MOST])}\.[0-9a-f]{{16}}")
    # What is written stays written, even where nobody may list the folder or remove from it.
    with contextlib.suppress(OSError), os.scandir(target.parent) as entries:
        # By the clock of the file system, which may not be this machine's.
        oldest = target.stat().st_mtime - _ABANDONED
        for entry in entries:
            if part.fullmatch(entry.name) and entry.stat(follow_symlinks=False).st_mtime < oldest:
                Path(entry.path).unlink(missing_ok=True)


def _target(path: str | Path) -> Path:
    """Return where a link points: that, and not the link, gets new content."""
    target = Path(path).resolve()
    if target.exists() and not target.is_file():
        raise FileError(f"{path}: cannot be written: it is no regular file")
    return target


def _unwritable(path: str | Path, error: Exception) -> FileError:
    return FileError(f"{path}: cannot be written: {getattr(error, 'strerror', None) or error}")
