# SPDX-License-Identifier: Apache-2.0
"""What a program may write, looked at before the work: suffix, folder, and not its own input."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from limit_surface_ros.errors import FileError

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path


def check_output(output: Path, suffixes: Sequence[str], inputs: Iterable[Path] = ()) -> None:
    """Refuse an output that could not be written after the work, or that is an input.

    Args:
        output: The file to write.
        suffixes: Those that it may have, in small letters.
        inputs: What the program reads, which need not be there.

    Raises:
        FileError: The suffix is another, the folder is absent or not writable, something that is
            no regular file stands there, or it is one of the inputs, if only through a link.
    """
    if output.suffix.lower() not in suffixes:
        raise FileError(f"{output}: cannot be written: must end in {' or '.join(suffixes)}")
    try:
        # Where a link points, not the link, is what gets new content.
        target = output.resolve()
        if not target.parent.is_dir():
            raise FileError(f"{output}: its folder does not exist: make {target.parent} first")
        if target.exists() and not target.is_file():
            raise FileError(f"{output}: cannot be written: it is no regular file")
        if not os.access(target.parent, os.W_OK | os.X_OK):
            raise FileError(f"{output}: cannot be written: its folder is read-only")
        for source in inputs:
            if source.exists() and target.exists() and source.samefile(target):
                raise FileError(
                    f"{output}: is the input {source}, which would be lost: name another output"
                )
    except (OSError, RuntimeError) as error:
        # A name too long, no permission on the way, a loop of links.
        raise FileError(f"{output}: cannot be written: {error}") from None
