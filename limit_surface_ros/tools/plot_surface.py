"""Draw limit surfaces: in load space, and cut through its three planes."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from limit_surface_ros.errors import DataError
from limit_surface_ros.files.pushes_csv import read_pushes
from limit_surface_ros.files.surface_file import read_surface_model
from limit_surface_ros.plots.canvas import SUFFIXES, save_figure
from limit_surface_ros.plots.surface_view import draw_surfaces
from limit_surface_ros.tools.program import run_program

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.surface.protocol import LimitSurface

EPILOG = """\
The upper row shows each surface in load space, the lower row their sections through the planes
tau_z = 0, f_y = 0 and f_x = 0, all of them over each other. Loads of --data are dots; in a section
those that lie near its plane.

examples:
  plot_surface model.yaml
  plot_surface ellipsoid.yaml norms.yaml --data pushes.csv --output both.png
"""


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    top = argparse.ArgumentParser(
        prog="plot_surface",
        description=__doc__,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    top.add_argument(
        "models", nargs="+", type=Path, metavar="MODEL", help="model files (.yaml), up to four"
    )
    top.add_argument(
        "-o",
        "--output",
        type=Path,
        default=Path("surface.png"),
        help=f"picture to write: {', '.join(SUFFIXES)} (%(default)s)",
    )
    top.add_argument(
        "--data", type=Path, metavar="FILE", help="recorded pushes (.csv) to draw with them"
    )
    return top


def run(options: argparse.Namespace) -> None:
    """Read, draw, write."""
    surfaces: dict[str, LimitSurface] = {}
    for path in options.models:
        model = read_surface_model(path)
        if model.name in surfaces:
            raise DataError(f"{path}: another file holds a model named {model.name!r}, too")
        surfaces[model.name] = model.surface
    loads = None if options.data is None else read_pushes(options.data).pairs.wrenches
    save_figure(draw_surfaces(surfaces, loads), options.output)
    print(f"written     {options.output}")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program and return its exit code."""
    return run_program(parser(), run, argv)


if __name__ == "__main__":
    sys.exit(main())
