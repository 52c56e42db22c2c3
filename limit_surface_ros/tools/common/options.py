# SPDX-License-Identifier: Apache-2.0
"""Options that programs share, and checks of them before the work: what argparse leaves undone."""

from __future__ import annotations

import argparse
import contextlib
from pathlib import Path
from typing import TYPE_CHECKING

from limit_surface_ros.errors import FileError, RangeError
from limit_surface_ros.files.atomic_write import check_writable
from limit_surface_ros.plots.canvas import DPI, SUFFIXES

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

# Dots to the inch: fewer show nothing, more need gigabytes of memory.
FEWEST_DOTS, MOST_DOTS = 10, 1200


def refuse_unused(
    parser: argparse.ArgumentParser,
    options: argparse.Namespace,
    names: Iterable[str],
    belongs_to: str,
) -> None:
    """Refuse options that were given though they do nothing here.

    Args:
        parser: Knows what the options are where they are not given.
        options: What it read.
        names: Of the options, as attributes.
        belongs_to: What the options are for, for the error.

    Raises:
        RangeError: One of them is not its default.
    """
    for name in names:
        if getattr(options, name) != parser.get_default(name):
            raise RangeError(f"{flag(name)} does nothing here: it is {belongs_to}")


def refuse_empty(options: argparse.Namespace, names: Iterable[str]) -> None:
    """Refuse texts that were given and are empty.

    Raises:
        RangeError: One of them is.
    """
    for name in names:
        value = getattr(options, name)
        if value is not None and not value.strip():
            raise RangeError(f"{flag(name)} must not be empty")


def check_ranges(options: argparse.Namespace, ranges: Mapping[str, tuple[float, float]]) -> None:
    """Refuse numbers that are out of their ranges; None, which is not given, is in all of them.

    Args:
        options: What the parser read.
        ranges: The least and the largest that each option takes, by its attribute.

    Raises:
        RangeError: One of them is out of its range, or no number.
    """
    for name, (least, most) in ranges.items():
        value = getattr(options, name)
        # NaN fails this.
        if value is not None and not least <= value <= most:
            raise RangeError(f"{flag(name)} must be from {least:.7g} to {most:.7g}, got {value}")


def named_path(text: str) -> Path:
    """Return a path that is given on the command line.

    Raises:
        ArgumentTypeError: It is empty, which would stand for the present folder.
    """
    if not text:
        raise argparse.ArgumentTypeError("an empty name is no file")
    return Path(text)


def flag(name: str) -> str:
    """Return an option as it is typed, of its attribute."""
    return f"--{name.replace('_', '-')}"


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
    target = check_writable(output)
    for source in inputs:
        if same_file(source, target):
            raise FileError(
                f"{output}: is the input {source}, which would be lost: name another output"
            )


def same_file(first: Path, second: Path) -> bool:
    """Tell whether two names are of one file, if only through a link."""
    with contextlib.suppress(OSError, ValueError):
        return first.samefile(second)
    return False


def add_picture_options(parser: argparse.ArgumentParser, default: str) -> None:
    """Declare where the picture goes, `default` if not given, and how fine it is."""
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        default=Path(default),
        help=f"picture to write: {', '.join(SUFFIXES)} (%(default)s)",
    )
    parser.add_argument(
        "--dpi",
        type=float,
        default=DPI,
        help=f"dots to the inch of a PNG, {FEWEST_DOTS} to {MOST_DOTS} (%(default)g)",
    )


def check_picture(options: argparse.Namespace, inputs: Iterable[Path]) -> None:
    """Refuse a picture that could not be written after the work.

    Raises:
        FileError: See `check_output`.
        RangeError: The dots to the inch are too few or too many.
    """
    check_output(options.output, SUFFIXES, inputs)
    check_ranges(options, {"dpi": (FEWEST_DOTS, MOST_DOTS)})
