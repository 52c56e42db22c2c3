"""What fit_surface and fit_catalogue share: the options of a fit, and the fit of one input."""

from __future__ import annotations

import datetime
import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros import __version__
from limit_surface_ros.errors import RangeError
from limit_surface_ros.files.surface_file import SurfaceModel
from limit_surface_ros.fitting.multi_start import Search
from limit_surface_ros.fitting.power_sum import fit_power_sum
from limit_surface_ros.fitting.scaled_pairs import scaling_of_pairs
from limit_surface_ros.surface.power_sum import thesis_exponents
from limit_surface_ros.tools.training_data import (
    ACCEPTED,
    check_input,
    row_numbers,
    training_data_of_pushes,
)

if TYPE_CHECKING:
    import argparse
    from concurrent.futures import Executor
    from pathlib import Path

    from limit_surface_ros.fitting.multi_start import Progress
    from limit_surface_ros.fitting.result import FitResult
    from limit_surface_ros.tools.training_data import TrainingData


@dataclass(frozen=True)
class FittedModel:
    """A model ready to be written, and what is known of its fit."""

    model: SurfaceModel
    result: FitResult


def add_fit_options(parser: argparse.ArgumentParser) -> None:
    """Declare every option on which the fitted model depends, but for its name."""
    parser.add_argument("--frame-id", default="object", help="the model's frame (%(default)s)")

    data = parser.add_argument_group("data")
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

    fit = parser.add_argument_group("fit")
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


def available_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def fit_model(
    path: Path,
    name: str,
    options: argparse.Namespace,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> FittedModel:
    """Read an input and fit what the options ask for.

    Args:
        path: A contact file or recorded pushes.
        name: The model's name.
        options: What `add_fit_options` declares.
        executor: Where starts run; here and one by one if not given.
        progress: Called with (starts done, starts at most) after each.

    Raises:
        FileError: The input is absent or not valid.
        LimitSurfaceError: The data cannot support the fit, or an option is out of range.
    """
    data = read_input(path, options)
    result = fit(options, data, Search(options.starts, options.seed, executor, progress))
    model = SurfaceModel(
        name=name,
        surface=result.surface,
        frame_id=options.frame_id,
        normal_force=data.normal_force,
        fit=history(options, data, result),
    )
    return FittedModel(model, result)


def read_input(path: Path, options: argparse.Namespace) -> TrainingData:
    """Read or make the pairs that the input stands for."""
    suffix = check_input(path)
    rows = None if options.rows is None else row_numbers(options.rows)
    if suffix == ".csv":
        return training_data_of_pushes(path, rows)
    raise RangeError(f"{path}: {suffix or 'no suffix'} is not known; accepted is {ACCEPTED}")


def fit(options: argparse.Namespace, data: TrainingData, search: Search) -> FitResult:
    """Fit what the options ask for."""
    exponents = (
        thesis_exponents(options.terms)
        if options.family == "thesis"
        else np.full(max(options.terms, 0), 0.5)
    )
    length = options.characteristic_length or data.characteristic_length
    result = fit_power_sum(
        data.training,
        exponents,
        velocity_weight=0.0 if options.objective == "J1" else options.velocity_weight,
        scaling=scaling_of_pairs(data.training, length),
        search=search,
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
