# SPDX-License-Identifier: Apache-2.0
"""Checks of a command line that argparse does not make: numbers, and options without effect."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from limit_surface_ros.errors import RangeError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping


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
