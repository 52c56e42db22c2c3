# SPDX-License-Identifier: Apache-2.0
"""One look for all pictures: colours that everybody can tell apart, and files that come out alike.

Figures are made without matplotlib's global state, so a program that uses the library keeps its
own. matplotlib is an optional extra and is imported when the first figure is made.
"""

from __future__ import annotations

import io
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from limit_surface_ros.errors import FileError, MissingExtraError
from limit_surface_ros.files.atomic_write import write_atomically

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.figure import Figure

# The palette of Okabe and Ito (2008), told apart with any kind of colour vision, but
# for yellow: it is too light for a thin line on white.
BLACK = "#000000"
BLUE = "#0072B2"
VERMILION = "#D55E00"
GREEN = "#009E73"
PURPLE = "#CC79A7"
SKY = "#56B4E9"
ORANGE = "#E69F00"
GREY = "#777777"
CYCLE = (BLUE, VERMILION, GREEN, PURPLE, SKY, ORANGE, BLACK)
# Told apart by more than colour, also on a grey printer.
DASHES: tuple[Any, ...] = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 1)), (0, (8, 3)))

DPI = 150.0
SUFFIXES = (".png", ".svg", ".pdf")

_STYLE: Any = {
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.labelsize": 9,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": 10,
    "figure.constrained_layout.use": True,
    "figure.facecolor": "white",
    "figure.titlesize": 11,
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.6,
    "legend.fontsize": 8,
    "legend.framealpha": 0.85,
    "lines.linewidth": 1.6,
    "svg.hashsalt": "limit_surface_ros",
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
}
# Without these, the same picture drawn on two days or by two versions would differ.
_METADATA: dict[str, dict[str, Any]] = {
    ".png": {"Software": None},
    ".svg": {"Date": None, "Creator": None},
    ".pdf": {"CreationDate": None, "Producer": None, "Creator": None},
}


@contextmanager
def new_figure(width: float, height: float) -> Iterator[Figure]:
    """Give an empty figure to draw on, in the package's look, which holds inside the block.

    Args:
        width: [inch]; 6.5 suits a page, 150 dots to the inch.
        height: [inch].

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    try:
        from cycler import cycler
        from matplotlib import rc_context
        from matplotlib.figure import Figure
    except ImportError:
        raise MissingExtraError("matplotlib", "plots") from None
    with rc_context({**_STYLE, "axes.prop_cycle": cycler(color=CYCLE)}):
        yield Figure(figsize=(width, height))


def save_figure(figure: Figure, path: str | Path, dpi: float = DPI) -> None:
    """Write a figure in one step, by its suffix as PNG, SVG or PDF; the same picture, same bytes.

    Args:
        figure: The figure.
        path: Where to write it.
        dpi: Dots to the inch of a PNG.

    Raises:
        FileError: The suffix is another, or the file cannot be written.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise FileError(f"{path}: pictures end in {', '.join(SUFFIXES)}, got {path.suffix!r}")
    from matplotlib import rc_context

    stream = io.BytesIO()
    with rc_context(_STYLE):
        figure.savefig(stream, format=suffix[1:], dpi=dpi, metadata=_METADATA[suffix])
    write_atomically(path, stream.getvalue())


def line_style(index: int) -> dict[str, Any]:
    """Return the colour and dashes of the index-th curve of a picture, as plot() takes them.

    The first 49 curves differ in one or the other.
    """
    again, place = divmod(index, len(CYCLE))
    return {"color": CYCLE[place], "linestyle": DASHES[(place + again) % len(DASHES)]}
