# SPDX-License-Identifier: Apache-2.0
"""Moving pictures: what films of pushes and slides share."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import FileError, MissingExtraError
from limit_surface_ros.files.atomic_write import write_atomically

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from matplotlib.figure import Figure

    from limit_surface_ros.checks import Floats

FILMS = (".gif", ".mp4")
# Pictures to the second, and dots to the inch.
RATE = 20
_DOTS = 90


def save_film(figure: Figure, show: Callable[[int], Any], count: int, path: str | Path) -> None:
    """Write a film as a GIF or an MP4, in one step.

    Args:
        figure: What is filmed.
        show: Draws the picture of a number from 0 on into the figure.
        count: Number of pictures, `RATE` to the second.
        path: The file; its suffix is one of `FILMS`.

    Raises:
        FileError: The suffix is another, the file cannot be written, or an MP4 is asked for
            without ffmpeg.
        MissingExtraError: matplotlib or pillow is not installed.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in FILMS:
        raise FileError(f"{path}: films end in {' or '.join(FILMS)}, got {path.suffix!r}")
    if suffix == ".mp4" and not shutil.which("ffmpeg"):
        raise FileError(f"{path}: an MP4 needs the program ffmpeg: install it, or take a .gif")
    try:
        from matplotlib.animation import FFMpegWriter, FuncAnimation, PillowWriter
    except ImportError:
        raise MissingExtraError("pillow", "plots") from None
    film = FuncAnimation(figure, show, frames=count, interval=1000.0 / RATE)
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / f"film{suffix}"
        writer = PillowWriter(fps=RATE) if suffix == ".gif" else FFMpegWriter(fps=RATE)
        film.save(made, writer=writer, dpi=_DOTS)
        write_atomically(path, made.read_bytes())


def outline_at(points: Floats, pose: Floats) -> Floats:
    """Return an outline at a pose as a closed polygon.

    Args:
        points: Of the outline in the body's frame, shape (n, 2) [m].
        pose: x, y [m] and heading [rad], shape (3,).

    Returns:
        Shape (n + 1, 2) [m].
    """
    c, s = np.cos(pose[2]), np.sin(pose[2])
    moved = points @ np.array([[c, s], [-s, c]]) + pose[:2]
    return np.concatenate([moved, moved[:1]])
