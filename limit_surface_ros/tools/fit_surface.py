# SPDX-License-Identifier: Apache-2.0
"""Fit a limit surface to a contact or to recorded pushes, and write it as a model file."""

from __future__ import annotations

import argparse
import shlex
import sys
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import counted
from limit_surface_ros.errors import RangeError
from limit_surface_ros.files.surface_file import write_surface_model
from limit_surface_ros.files.yaml_reader import YAML_SUFFIXES
from limit_surface_ros.fitting.search import AGREEMENT, process_pool
from limit_surface_ros.fitting.workers import available_cores
from limit_surface_ros.plots.calibration_view import draw_calibration
from limit_surface_ros.plots.canvas import SUFFIXES, new_figure, save_figure
from limit_surface_ros.tools.common.fit_options import (
    add_fit_options,
    add_frame_option,
    check_fit_options,
    refuse_options_of_others,
)
from limit_surface_ros.tools.common.options import check_output, named_path, refuse_empty
from limit_surface_ros.tools.common.program import program_parser, progress_bar, run_program
from limit_surface_ros.tools.common.surface_fit import (
    CALIBRATION,
    HELD_OUT_CALIBRATION,
    fit_model,
)
from limit_surface_ros.tools.common.training_data import ACCEPTED, check_input

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.fitting.result import Errors, FitResult
    from limit_surface_ros.tools.common.surface_fit import FittedModel

EXAMPLES = """examples:
  fit_surface contact.yaml --terms 3 --output model.yaml
  fit_surface pushes.csv --terms 2 --objective J2 --velocity-weight 0.5 --output model.yaml
  fit_surface pushes.csv --rows 0-24 --auto --support --output model.yaml
  fit_surface contact.yaml --kind dissipation --terms 4 --output model.yaml
  fit_surface pushes.mcap --wrench-topic wrench --motion-topic pose --auto --output model.yaml
"""

# Costs closer than this differ by rounding.
NO_COST = 1e-12


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    top = program_parser("fit_surface", __doc__, EXAMPLES, "contact", "body", "pushes", "bag")
    top.add_argument("input", type=named_path, help=ACCEPTED)
    top.add_argument(
        "-o", "--output", type=Path, required=True, help="model file to write (.yaml)"
    )
    top.add_argument(
        "--name", help="the model's name; default: the contact's, or that of the output file"
    )
    add_frame_option(top)
    top.add_argument(
        "--picture",
        type=Path,
        help="picture of how many pushes the regions of --auto hold, "
        f"{', '.join(SUFFIXES)}; optional",
    )
    top.add_argument(
        "--workers",
        type=int,
        default=available_cores(),
        help="processes; the result does not depend on it (%(default)s)",
    )
    add_fit_options(top)
    return top


def report(fitted: FittedModel, output: Path) -> None:
    """Print what was dropped, what the model is, cost, errors and time."""
    result = fitted.result
    for note in fitted.model.fit.get("read", ()):
        print(f"read        {note}")
    for rule, count in fitted.model.fit.get("dropped", {}).items():
        if count:
            print(f"dropped     {count} of {fitted.model.fit['wrenches']} wrenches {rule}")
    model = fitted.model
    x, y = model.reference_point
    print(f"{'model':<11} {model.name}, {model.surface.kind}")
    print(f"{'about':<11} ({x:.4g}, {y:.4g}) m in frame {model.frame_id}")
    for label, text in fitted.description.lines():
        print(f"{label:<11} {text}")
    state = "converged" if result.converged else "not converged"
    print(f"objective   {result.objective}")
    print(f"cost        {result.cost:.6g}, {state} after {result.iterations} steps")
    print(f"starts      {starts_in_words(result)}")
    print_errors("training", result.training)
    if result.held_out is not None:
        print_errors("held out", result.held_out)
    for label, text in fitted.sureness:
        print(f"{label:<11} {text}")
    print(f"time        {result.wall_time:.2f} s")
    print(f"written     {output}")


def starts_in_words(result: FitResult) -> str:
    """Tell how many starts led to the best cost, and what the next best was."""
    costs, best = result.start_costs, result.start_costs[0]
    others = [cost for cost in costs if cost > best * (1.0 + AGREEMENT) + NO_COST]
    message = f"{len(costs) - len(others)} of {counted(len(costs), 'start')} agree"
    if others:
        message += f", the next best cost {min(others):.6g}"
    if result.cost > result.details.get("projected_cost", result.cost):
        # Of the second approximation alone, whose starts leave a matrix free to be indefinite.
        message += (
            f"; their best cost {best:.6g} is of a surface that is not closed, the cost above of "
            "the model, which is closed: --terms 2 without --objective second may fit better"
        )
    return message


def print_errors(label: str, errors: Errors) -> None:
    """Print one line of errors."""
    median, most, worst = errors.velocity
    print(
        f"{label:<11} {counted(errors.pairs, 'pair')}: mean angle "
        f"{np.degrees(errors.mean_angle):.2f} deg, "
        f"velocity error {median:.3f} / {most:.3f} / {worst:.3f} (50 / 95 / 100 %)"
    )


def run(options: argparse.Namespace) -> None:
    """Read, fit, write, report."""
    check_output(options.output, YAML_SUFFIXES, [options.input])
    if options.picture is not None:
        check_output(options.picture, SUFFIXES, [options.input])
        if not options.auto:
            raise RangeError("--picture is for --auto: other fits do not say how sure they are")
        with new_figure(1.0, 1.0):
            # Without matplotlib this ends here, and not after the fit.
            pass
    refuse_empty(options, ["name", "frame_id"])
    check_fit_options(options)
    refuse_options_of_others(parser(), options, [check_input(options.input)])
    parts = "fits" if options.auto else "starts"
    with process_pool(options.workers) as executor, progress_bar(parts) as progress:
        fitted = fit_model(
            options.input, options.name, options, options.output.stem, executor, progress
        )
    command = shlex.join(["fit_surface", *options.command])
    write_surface_model(fitted.model, options.output, header=f"Made by: {command}")
    if options.picture is not None:
        curves = {
            label: fitted.model.fit[key]
            for label, key in (
                ("cross-validation", CALIBRATION),
                ("held out", HELD_OUT_CALIBRATION),
            )
            if key in fitted.model.fit
        }
        save_figure(draw_calibration(curves), options.picture)
    report(fitted, options.output)
    for doubt in fitted.description.doubts:
        warnings.warn(f"{options.input}: {doubt}", stacklevel=2)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program and return its exit code."""
    top = parser()
    top.set_defaults(command=sys.argv[1:] if argv is None else list(argv))
    return run_program(top, run, argv)


if __name__ == "__main__":
    sys.exit(main())
