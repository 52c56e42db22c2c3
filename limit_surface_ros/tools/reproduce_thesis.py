# SPDX-License-Identifier: Apache-2.0
"""Rebuild the figures of the thesis's chapters 2 and 3 from scratch, and what lies beyond them."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from limit_surface_ros.errors import FileError, RangeError
from limit_surface_ros.fitting.search import process_pool
from limit_surface_ros.fitting.workers import available_cores
from limit_surface_ros.plots.canvas import new_figure
from limit_surface_ros.thesis.run import carry_out
from limit_surface_ros.thesis.settings import FULL, QUICK
from limit_surface_ros.thesis.store import Store
from limit_surface_ros.thesis.studies import STUDIES
from limit_surface_ros.tools.common.program import program_parser, progress_bar, run_program

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.thesis.findings import Study

EPILOG = """\
OUT/index.html shows every figure with what the text claims of it and what was measured; it needs
no other file. Beside it lie the pictures (PNG) and the numbers behind them (CSV), a folder for
each figure, and the fitted surfaces under OUT/models, which the nodes can serve.

What is finished is kept: the same command goes on where it was interrupted, and works out anew
only what was made with other settings or another version.

examples:
  reproduce_thesis out                  all figures, with the thesis's sizes
  reproduce_thesis out-quick --quick    a look in under a minute
  reproduce_thesis out --figures 3.9 3.10
"""


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    top = program_parser("reproduce_thesis", __doc__, EPILOG)
    top.add_argument("out", type=Path, metavar="OUT", help="folder to write; made if missing")
    top.add_argument("--quick", action="store_true", help="smaller sizes, under a minute")
    top.add_argument(
        "--figures",
        nargs="+",
        metavar="N",
        default=[],
        help="only these figures, such as 2.4 3.9; default: all",
    )
    top.add_argument(
        "--workers",
        type=int,
        default=available_cores(),
        help="processes for fits; the result does not depend on it (%(default)s)",
    )
    return top


def chosen(numbers: Sequence[str]) -> list[Study]:
    """Return the studies of these figures, or all.

    Raises:
        RangeError: There is no such figure.
    """
    known = {study.number: study for study in STUDIES}
    for number in numbers:
        if number not in known:
            raise RangeError(f"there is no figure {number}; there are {', '.join(known)}")
    return [study for study in STUDIES if not numbers or study.number in numbers]


def run(options: argparse.Namespace) -> None:
    """Carry out the studies and say where the page is."""
    studies = chosen(options.figures)
    with new_figure(1.0, 1.0):
        pass  # Say at once, and not after the first fit, if matplotlib is missing.
    try:
        options.out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"{options.out}: cannot be made: {error.strerror}") from None
    with process_pool(options.workers) as executor, progress_bar("steps") as progress:
        store = Store(options.out, QUICK if options.quick else FULL, executor)
        # Lines between the frames of a bar would tear it.
        tell = _keep_quiet if sys.stderr.isatty() else print
        page = carry_out(studies, store, progress, tell)
    print(f"written     {page}")


def _keep_quiet(line: str) -> None:
    """Say nothing: a bar is seen instead."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program and return its exit code."""
    return run_program(parser(), run, argv, "interrupted; the same command goes on from here")


if __name__ == "__main__":
    sys.exit(main())
