# SPDX-License-Identifier: Apache-2.0
"""The options of a program that draws one picture, and the checks of them before the work."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from limit_surface_ros.plots.canvas import DPI, SUFFIXES
from limit_surface_ros.tools.given_options import check_ranges
from limit_surface_ros.tools.output_file import check_output

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterable

# Dots to the inch: fewer show nothing, more need gigabytes of memory.
FEWEST_DOTS, MOST_DOTS = 10, 1200


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
