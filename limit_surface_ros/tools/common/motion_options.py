# SPDX-License-Identifier: Apache-2.0
"""What the programs share that draw a motion: where it begins, its film, how its end is told."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.plots.film import FILMS
from limit_surface_ros.tools.common.options import check_output, check_ranges, refuse_unused

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterable

    from limit_surface_ros.checks import Floats


def add_motion_options(parser: argparse.ArgumentParser, body: str) -> None:
    """Declare where a body begins, and the film of its motion.

    Args:
        parser: Where.
        body: What of the body is at the pose, for the help.
    """
    parser.add_argument(
        "--pose",
        type=float,
        nargs=3,
        default=[0.0, 0.0, 0.0],
        metavar=("X", "Y", "ANGLE"),
        help=f"where {body} begins [m, m, rad] (0 0 0)",
    )
    parser.add_argument(
        "--animate", type=Path, metavar="FILM", help=f"film to write too: {', '.join(FILMS)}"
    )
    parser.add_argument(
        "--seconds", type=float, default=4.0, help="length of the film [s] (%(default)g)"
    )


def check_film(
    parser: argparse.ArgumentParser, options: argparse.Namespace, inputs: Iterable[Path]
) -> None:
    """Refuse a film that could not be written after the work, and a length without one.

    Raises:
        FileError: See `check_output`.
        RangeError: The length is out of its range, or does nothing.
    """
    check_ranges(options, {"seconds": (0.1, 120.0)})
    if options.animate is not None:
        check_output(options.animate, FILMS, inputs)
    else:
        refuse_unused(parser, options, ["seconds"], "for --animate")


def pose_in_words(pose: Floats) -> str:
    """Return a pose x, y [m] and angle [rad], shape (3,), for people to read."""
    # Rounded to what is shown, and without the sign of zero.
    x, y = np.round(pose[:2], 6) + 0.0
    angle = round(math.degrees(pose[2]), 4) + 0.0
    return f"x {x:.6f} m, y {y:.6f} m, angle {angle:.4f} deg"
