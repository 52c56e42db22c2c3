# SPDX-License-Identifier: Apache-2.0
"""Make a page on which one drags a load or a push and sees what limit surfaces say to it."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from limit_surface_ros.errors import DataError
from limit_surface_ros.export.explorer import MOST_MODELS, explorer_page
from limit_surface_ros.files.atomic_write import write_atomically
from limit_surface_ros.files.surface_file import read_surface_model
from limit_surface_ros.tools.common.options import check_output
from limit_surface_ros.tools.common.program import program_parser, run_program
from limit_surface_ros.tools.common.same_point import About, require_one_point

if TYPE_CHECKING:
    from collections.abc import Sequence

EPILOG = """\
The page is one file that needs no network: open it in any browser. It shows for each model the
loads that friction can resist, how far out a load lies, the motion that it causes (and the fan of
9 of 10 real ones, of models that fit_surface --auto made), and whether a pusher on the outline
sticks or slides. Mouse, touch and arrow keys move load and push.

examples:
  explore_surface model.yaml
  explore_surface ellipsoid.yaml norms.yaml -o both.html
"""


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    top = program_parser("explore_surface", __doc__, EPILOG, "surface")
    top.add_argument(
        "models",
        nargs="+",
        type=Path,
        metavar="MODEL",
        help=f"model files (.yaml), up to {MOST_MODELS}",
    )
    top.add_argument(
        "--output",
        "-o",
        type=Path,
        default=Path("surface.html"),
        metavar="FILE",
        help="page to write, .html (default: %(default)s)",
    )
    return top


def run(options: argparse.Namespace) -> None:
    """Read, fill the page, write."""
    check_output(options.output, [".html"], options.models)
    models = [read_surface_model(path) for path in options.models]
    names = [model.name for model in models]
    for name in names:
        if names.count(name) > 1:
            raise DataError(
                f"two files hold a model named {name!r}: the page could not tell them apart"
            )
    require_one_point(
        [
            About(path, model.frame_id, model.reference_point)
            for path, model in zip(options.models, models, strict=True)
        ]
    )
    write_atomically(options.output, explorer_page(models))
    print(f"written     {options.output}")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program and return its exit code."""
    return run_program(parser(), run, argv)


if __name__ == "__main__":
    sys.exit(main())
