# SPDX-License-Identifier: Apache-2.0
"""Tell what recorded pushes hold, and what speaks against them, before anything is fitted."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import counted
from limit_surface_ros.errors import FileError
from limit_surface_ros.files.pushes_csv import read_pushes
from limit_surface_ros.fitting.description import coverage_of
from limit_surface_ros.fitting.pairs import scaling_of_pairs
from limit_surface_ros.fitting.plausibility import doubts_of_pairs, lengths_of
from limit_surface_ros.plots.canvas import DPI, SUFFIXES, save_figure
from limit_surface_ros.plots.pushes_view import draw_pushes
from limit_surface_ros.tools.common.bag_options import (
    OF_BAGS,
    add_bag_options,
    corrections_in_words,
    pushes_of_bag,
)
from limit_surface_ros.tools.common.csv_options import OF_CELLS, add_cell_options, cell_options
from limit_surface_ros.tools.common.options import check_output, named_path, refuse_unused
from limit_surface_ros.tools.common.program import program_parser, run_program
from limit_surface_ros.tools.common.training_data import BAG, PUSHES, check_input

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.files.recordings.pushes import RecordedPushes
    from limit_surface_ros.surface.pairs import Pairs

EPILOG = """\
It prints how the file was read, what was found and corrected (noise, late stamps, bias), which
motions and loads the pushes cover, and each doubt in one sentence. The exit code is 1 where units,
axes or signs cannot be those of a body, so that a fit would be wrong.

examples:
  check_pushes pushes.csv --output pushes.png
  check_pushes bag_folder --wrench-topic /wrench --motion-topic /pose
  check_pushes bag.mcap --wrench-topic /ft --motion-topic /tf --body box --fixed table
"""
DOUBTFUL = 1
_LABEL = 11
# Where nothing tells the body's size.
_USUAL_LENGTH = 0.05


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    top = program_parser("check_pushes", __doc__, EPILOG, "pushes", "bag")
    top.add_argument("input", type=named_path, help="recorded pushes (.csv), or a bag")
    top.add_argument(
        "-o", "--output", type=Path, help=f"picture to write: {', '.join(SUFFIXES)}; optional"
    )
    add_cell_options(top.add_argument_group("CSV files"))
    add_bag_options(top)
    return top


def line(label: str, text: str) -> None:
    """Print one line of the report."""
    print(f"{label:<{_LABEL}} {text}")


def of_bag(recorded: RecordedPushes) -> None:
    """Print what a bag held and what was corrected in it."""
    for note in recorded.notes:
        line("read", note)
    line("frame", f"{recorded.frame_id}, the body's, which a model gets")
    for rule, count in recorded.dropped.items():
        if count:
            line("dropped", f"{count} of {recorded.samples} wrenches {rule}")
    line("rests", f"{len(recorded.rests)}, {100.0 * recorded.resting:.0f} % of the time")
    for text in corrections_in_words(recorded):
        line("corrected" if "taken away" in text or ": corrected" in text else "found", text)
    deviations = np.degrees(np.quantile(recorded.deviations, [0.5, 0.95]))
    half, most = deviations
    line("directions", f"known to {half:.2g} deg (half of the pairs), {most:.2g} deg (95 %)")


def of_pairs(pairs: Pairs, stated: float | None) -> float:
    """Print what pairs cover and which length they show; return the length [m]."""
    known = lengths_of(pairs.wrenches, pairs.twists)
    forces = np.linalg.norm(pairs.wrenches[:, :2], axis=1)
    line("pairs", counted(len(pairs), "pair"))
    line("forces", f"{forces.min():.3g} to {forces.max():.3g} N")
    line("moments", f"up to {np.abs(pairs.wrenches[:, 2]).max():.3g} N m")
    line(
        "length",
        f"{known.of_loads:.3g} m by loads, {known.of_motions:.3g} m by motions"
        + ("" if stated is None else f", {stated:.3g} m as stated"),
    )
    shown = known.of_motions if known.possible else stated or _USUAL_LENGTH
    line("coverage", str(coverage_of(pairs, scaling_of_pairs(pairs, shown))))
    return shown


def run(options: argparse.Namespace) -> int:
    """Read, print, draw."""
    if options.output is not None:
        check_output(options.output, SUFFIXES, [options.input])
    kind = check_input(options.input)
    recorded, stated = None, None
    if kind == BAG:
        refuse_unused(parser(), options, OF_CELLS, f"for {PUSHES}")
        recorded = pushes_of_bag(options.input, options)
        pairs = recorded.pairs
        of_bag(recorded)
    elif kind == PUSHES:
        refuse_unused(parser(), options, OF_BAGS, f"for {BAG}")
        pushes = read_pushes(options.input, cell_options(options))
        pairs, stated = pushes.pairs, pushes.number("rho_m")
        for note in pushes.notes:
            line("read", note)
    else:
        raise FileError(f"{options.input}: is {kind}; recorded pushes are accepted, CSV or a bag")
    length = of_pairs(pairs, stated)
    doubts = doubts_of_pairs(pairs, stated)
    for doubt in doubts:
        line("wrong" if doubt.grave else "doubt", doubt.text)
    for text in coverage_of(pairs, scaling_of_pairs(pairs, length)).doubts():
        line("doubt", text)
    if options.output is not None:
        save_figure(draw_pushes(pairs, length, recorded), options.output, DPI)
        line("written", str(options.output))
    if not any(doubt.grave for doubt in doubts):
        line("verdict", "nothing speaks against units, axes, signs and bias")
        return 0
    return DOUBTFUL


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program and return its exit code."""
    return run_program(parser(), run, argv, "interrupted")


if __name__ == "__main__":
    sys.exit(main())
