"""Fit a limit surface to a contact or to recorded pushes, and write it as a model file."""

from __future__ import annotations

import argparse
import datetime
import os
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros import __version__
from limit_surface_ros.errors import RangeError
from limit_surface_ros.files.surface_file import SurfaceModel, write_surface_model
from limit_surface_ros.fitting.multi_start import Search, process_pool
from limit_surface_ros.fitting.power_sum import fit_power_sum
from limit_surface_ros.fitting.scaled_pairs import scaling_of_pairs
from limit_surface_ros.surface.power_sum import thesis_exponents
from limit_surface_ros.tools.program import run_program
from limit_surface_ros.tools.progress import progress_bar
from limit_surface_ros.tools.training_data import (
    ACCEPTED,
    check_input,
    row_numbers,
    training_data_of_pushes,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.fitting.result import Errors, FitResult
    from limit_surface_ros.tools.training_data import TrainingData

EXAMPLES = """examples:
  fit_surface contact.yaml --terms 3 --output model.yaml
  fit_surface pushes.csv --terms 2 --objective J2 --velocity-weight 0.5 --output model.yaml
  fit_surface pushes.csv --rows 0-24 --family norms --output model.yaml
"""


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    top = argparse.ArgumentParser(
        prog="fit_surface",
        description=__doc__,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    top.add_argument("input", type=Path, help=ACCEPTED)
    top.add_argument(
        "-o", "--output", type=Path, required=True, help="model file to write (.yaml)"
    )
    top.add_argument("--name", help="the model's name; default: that of the output file")
    top.add_argument("--frame-id", default="object", help="the model's frame (%(default)s)")

    data = top.add_argument_group("data")
    data.add_argument(
        "--rows", help="rows of a CSV to fit, such as 0,3,10-14; others are held out"
    )
    data.add_argument(
        "--characteristic-length",
        type=float,
        metavar="M",
        help="makes moments and rotations comparable [m]; default: what the data state, or the "
        "ratio of moments to forces in them",
    )

    fit = top.add_argument_group("fit")
    fit.add_argument("--terms", type=int, default=3, help="terms of the model (%(default)s)")
    fit.add_argument(
        "--family",
        choices=["thesis", "norms"],
        default="thesis",
        help="exponents 1, (n-1)/n, ..., 1/n, or 1/2 for every term, which is always convex "
        "(%(default)s)",
    )
    fit.add_argument(
        "--objective",
        choices=["J1", "J2"],
        default="J2",
        help="J1 fits loads, J2 loads and motions (%(default)s)",
    )
    fit.add_argument(
        "--velocity-weight",
        type=float,
        default=1.0,
        metavar="W",
        help="weight of the motions in J2 (%(default)s)",
    )
    fit.add_argument("--starts", type=int, default=8, help="random starts at most (%(default)s)")
    fit.add_argument("--seed", type=int, default=0, help="of all that is random (%(default)s)")
    fit.add_argument(
        "--workers",
        type=int,
        default=available_cores(),
        help="processes; the result does not depend on it (%(default)s)",
    )
    return top


def available_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def read_input(options: argparse.Namespace) -> TrainingData:
    """Read or make the pairs that the input stands for."""
    suffix = check_input(options.input)
    rows = None if options.rows is None else row_numbers(options.rows)
    if suffix == ".csv":
        return training_data_of_pushes(options.input, rows)
    raise RangeError(
        f"{options.input}: {suffix or 'no suffix'} is not known; accepted is {ACCEPTED}"
    )


def fit(options: argparse.Namespace, data: TrainingData) -> FitResult:
    """Fit what the options ask for."""
    exponents = (
        thesis_exponents(options.terms)
        if options.family == "thesis"
        else np.full(max(options.terms, 0), 0.5)
    )
    length = options.characteristic_length or data.characteristic_length
    with process_pool(options.workers) as executor, progress_bar("starts") as progress:
        result = fit_power_sum(
            data.training,
            exponents,
            velocity_weight=0.0 if options.objective == "J1" else options.velocity_weight,
            scaling=scaling_of_pairs(data.training, length),
            search=Search(options.starts, options.seed, executor, progress),
        )
    return result if data.held_out is None else result.tested_on(data.held_out)


def history(options: argparse.Namespace, data: TrainingData, result: FitResult) -> dict[str, Any]:
    """Return how the model came about, for its file."""
    return {
        **data.about,
        **result.summary(),
        "seed": options.seed,
        "date": datetime.datetime.now(datetime.timezone.utc).date().isoformat(),
        "version": __version__,
    }


def report(result: FitResult, output: Path) -> None:
    """Print cost, errors and time."""
    state = "converged" if result.converged else "not converged"
    print(f"objective   {result.objective}")
    print(f"cost        {result.cost:.6g}, {state} after {result.iterations} steps")
    print(f"starts      {', '.join(f'{cost:.6g}' for cost in result.start_costs)}")
    print_errors("training", result.training)
    if result.held_out is not None:
        print_errors("held out", result.held_out)
    print(f"time        {result.wall_time:.2f} s")
    print(f"written     {output}")


def print_errors(label: str, errors: Errors) -> None:
    """Print one line of errors."""
    median, most, worst = errors.velocity
    print(
        f"{label:<11} {errors.pairs} pairs: mean angle {np.degrees(errors.mean_angle):.2f} deg, "
        f"velocity error {median:.3f} / {most:.3f} / {worst:.3f} (50 / 95 / 100 %)"
    )


def run(options: argparse.Namespace) -> None:
    """Read, fit, write, report."""
    data = read_input(options)
    result = fit(options, data)
    model = SurfaceModel(
        name=options.name or options.output.stem,
        surface=result.surface,
        frame_id=options.frame_id,
        normal_force=data.normal_force,
        fit=history(options, data, result),
    )
    command = shlex.join(["fit_surface", *options.command])
    write_surface_model(model, options.output, header=f"Made by: {command}")
    report(result, options.output)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program and return its exit code."""
    top = parser()
    top.set_defaults(command=sys.argv[1:] if argv is None else list(argv))
    return run_program(top, run, argv)


if __name__ == "__main__":
    sys.exit(main())
