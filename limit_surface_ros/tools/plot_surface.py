# SPDX-License-Identifier: Apache-2.0
"""Draw limit surfaces: in load space, and cut through its three planes."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import DataError
from limit_surface_ros.files.contact_file import read_contact
from limit_surface_ros.files.pushes_csv import read_pushes
from limit_surface_ros.files.surface_file import read_surface_model
from limit_surface_ros.files.yaml_reader import YAML_SUFFIXES
from limit_surface_ros.plots.canvas import save_figure
from limit_surface_ros.plots.surface_view import draw_surfaces
from limit_surface_ros.surface.sampling import facet_loads, random_motions
from limit_surface_ros.tools.common.csv_options import add_cell_options, cell_options
from limit_surface_ros.tools.common.options import add_picture_options, check_picture
from limit_surface_ros.tools.common.program import program_parser, run_program
from limit_surface_ros.tools.common.same_point import About, require_one_point

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.files.csv_table import CsvOptions
    from limit_surface_ros.surface.base import LimitSurface

# Loads that are simulated of a contact; of many points the facets are too small to be seen.
MOTIONS, FACET_LOADS, FEW_POINTS = 1200, 60, 12

EPILOG = """\
The upper row shows each surface in load space, the lower row their sections through the planes
tau_z = 0, f_y = 0 and f_x = 0, all of them over each other. Loads of --data are dots; in a section
those that lie near its plane.

examples:
  plot_surface model.yaml --data contact.yaml
  plot_surface ellipsoid.yaml norms.yaml --data pushes.csv --output both.png
"""


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    top = program_parser("plot_surface", __doc__, EPILOG, "surface", "contact", "pushes")
    top.add_argument(
        "models", nargs="+", type=Path, metavar="MODEL", help="model files (.yaml), up to four"
    )
    add_picture_options(top, "surface.png")
    top.add_argument(
        "--data",
        type=Path,
        metavar="FILE",
        help="recorded pushes (.csv), or a contact file (.yaml) of which loads are simulated",
    )
    add_cell_options(top.add_argument_group("a CSV file of --data"))
    return top


def loads_of(path: Path, cells: CsvOptions) -> tuple[Floats, About | None]:
    """Return the loads that data give: recorded ones, or those of a contact.

    Returns:
        Shape (n, 3), and what they are about, which recorded pushes do not state.

    Raises:
        FileError: The file is no valid one of its suffix.
    """
    if path.suffix.lower() not in YAML_SUFFIXES:
        return read_pushes(path, cells).pairs.wrenches, None
    contact = read_contact(path)
    loads = [random_motions(contact.surface, MOTIONS, 0).wrenches]
    if len(contact.surface.points) <= FEW_POINTS:
        loads.append(facet_loads(contact.surface, FACET_LOADS, 0).wrenches)
    return np.vstack(loads), About(path, contact.frame_id, contact.reference_point.tolist())


def run(options: argparse.Namespace) -> None:
    """Read, draw, write."""
    data = [] if options.data is None else [options.data]
    check_picture(options, [*options.models, *data])
    surfaces: dict[str, LimitSurface] = {}
    stated: list[About] = []
    for path in options.models:
        model = read_surface_model(path)
        if model.name in surfaces:
            raise DataError(f"{path}: another file holds a model named {model.name!r}, too")
        surfaces[model.name] = model.surface
        stated.append(About(path, model.frame_id, model.reference_point))
    loads = None
    if options.data is not None:
        loads, about = loads_of(options.data, cell_options(options))
        stated += [about] if about is not None else []
    require_one_point(stated)
    save_figure(draw_surfaces(surfaces, loads), options.output, options.dpi)
    print(f"written     {options.output}")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program and return its exit code."""
    return run_program(parser(), run, argv)


if __name__ == "__main__":
    sys.exit(main())
