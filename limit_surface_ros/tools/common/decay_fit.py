# SPDX-License-Identifier: Apache-2.0
"""The fit of a decay as options ask for it, and the model that it makes."""

from __future__ import annotations

import datetime
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros import __version__
from limit_surface_ros.decay.fit import Options
from limit_surface_ros.decay.grids import largest_error
from limit_surface_ros.decay.targets import PiecewiseLinear, Record
from limit_surface_ros.files.decay_file import DecayModel

if TYPE_CHECKING:
    import argparse

    from limit_surface_ros.decay.fit import DecayFit
    from limit_surface_ros.tools.common.decay_input import DecayInput

# `--offset free`: the constant is fitted beside the terms.
FREE = "free"
# A proven error is stated if it is at most so many times the one found.
_PROVEN = 1.02
# Outliers whose times are written.
_MOST_WRITTEN = 1000


def add_method_options(top: argparse.ArgumentParser) -> None:
    """Declare the options of single methods."""
    top.add_argument("--max-delay", type=float, metavar="S", help="of the delay system [s] (dde)")
    top.add_argument("--degree", type=int, help="of the kernel's polynomial pieces (dde)")
    top.add_argument(
        "--allow-unstable",
        action="store_true",
        help="go on with a response that is not minimum-phase (dde)",
    )
    top.add_argument(
        "--tail-rate",
        type=complex,
        action="append",
        metavar="RATE",
        help="a known rate of the tail [1/s], as --tail-rate=-0.4+2j; may be repeated (neutral)",
    )
    top.add_argument(
        "--keep-outliers",
        action="store_true",
        help="count samples that stand out from their neighbours like all others (least_squares)",
    )
    top.add_argument(
        "--free-tail",
        action="store_true",
        help="do not hold the sum after the interval, where it may then do anything",
    )


def method_options(options: argparse.Namespace) -> Options:
    """Return the options of single methods as the library takes them."""
    return Options(
        options.max_delay,
        options.degree,
        options.allow_unstable,
        options.tail_rate,
        robust=not options.keep_outliers,
        offset=options.offset == FREE,
        bounded=not options.free_tail,
    )


def between(result: DecayFit, given: DecayInput) -> float | None:
    """Return how far the sum is from lines between samples but outliers; None for an example."""
    if not isinstance(given.target, Record):
        return None
    times = given.target.knots
    kept, values = ~np.isin(times, result.outliers), given.target.values
    if not kept[0]:
        # Before the first sample that counts, the sum begins at its own value.
        kept[0], values = True, np.append(result.fit.sum(0.0), values[1:])
    lines = PiecewiseLinear(times[kept], values[kept])
    return largest_error(result.fit.sum, lines, 0.0, given.end)


def beyond(result: DecayFit, given: DecayInput) -> float | None:
    """Return the largest error beyond the fitted interval; None where nothing is known there."""
    if given.horizon <= given.end:
        return None
    return largest_error(result.fit.sum, given.target, given.end, given.horizon)


def stated_error(result: DecayFit) -> float:
    """Return the error for the model file: the proven one where it is close to the one found."""
    found, largest = result.fit.max_error, result.largest
    if largest is not None and largest.proven <= _PROVEN * found:
        return max(found, largest.proven)
    return found


def provenance(result: DecayFit, given: DecayInput) -> dict[str, Any]:
    """Return how the model came about, for its file."""
    fit, choice = result.fit, result.choice
    values: dict[str, Any] = {
        "source": given.source,
        "method": choice.method,
        **choice.parameters,
        "terms": fit.sum.terms,
        "norm_value": fit.grid_error,
        **({"lower_bound": fit.lower_bound} if np.isfinite(fit.lower_bound) else {}),
        "date": datetime.datetime.now(datetime.timezone.utc).date().isoformat(),
        "version": __version__,
    }
    if given.start:
        values["start"] = given.start
    if given.offset:
        values["offset"] = given.offset
    if result.largest is not None and np.isfinite(result.largest.proven):
        values["error_proven"] = result.largest.proven
    elif result.largest is not None:
        values["error_found_on"] = result.largest.points
    lines = between(result, given)
    if lines is not None:
        values["error_between"] = lines
    if len(result.outliers):
        values["outlier_times"] = result.outliers[:_MOST_WRITTEN].tolist()
    if result.terms_tried:
        values["terms_tried"] = [tried.terms for tried in result.terms_tried]
        values["bic"] = [tried.bic for tried in result.terms_tried]
    after = beyond(result, given)
    if after is not None:
        values["error_beyond"] = after
        values["beyond_until"] = given.horizon
    return values


def model_of(result: DecayFit, given: DecayInput, name: str) -> DecayModel:
    """Return the fit as a decay model.

    Raises:
        RangeError: The fitted sum does not decay.
    """
    return DecayModel(
        name=name,
        sum=result.fit.sum,
        time_span=(0.0, given.end),
        norm=result.fit.norm,
        max_error=stated_error(result),
        system=result.choice.system,
        tail=result.tail,
        noise=result.noise,
        fit=provenance(result, given),
    )
