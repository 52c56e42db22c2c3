# SPDX-License-Identifier: Apache-2.0
"""Approximate a decaying response by a sum of exponentials, and write it as a decay model.

The rates come from the response's own delay differential equation (method dde), from closed
formulas, from the samples, or from a search; the coefficients are optimal on them in the norm
asked for.
"""

from __future__ import annotations

import argparse
import datetime
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros import __version__
from limit_surface_ros.checks import counted
from limit_surface_ros.decay.coefficients import NORMS
from limit_surface_ros.decay.delay.words import system_in_words
from limit_surface_ros.decay.examples import EXAMPLES as RESPONSES
from limit_surface_ros.decay.fit import AUTO, METHODS, Options, fit_decay
from limit_surface_ros.decay.grids import largest_error
from limit_surface_ros.decay.noise import resting_level
from limit_surface_ros.decay.targets import PiecewiseLinear, Record
from limit_surface_ros.errors import RangeError
from limit_surface_ros.files.decay_file import DecayModel, write_decay_model
from limit_surface_ros.files.yaml_reader import YAML_SUFFIXES
from limit_surface_ros.tools.common.csv_options import OF_RESPONSES
from limit_surface_ros.tools.common.decay_input import add_input_options, read_input
from limit_surface_ros.tools.common.options import check_output, refuse_empty, refuse_unused
from limit_surface_ros.tools.common.program import program_parser, run_program
from limit_surface_ros.tools.common.training_data import is_bag

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.decay.certify import LargestError
    from limit_surface_ros.decay.fit import DecayFit
    from limit_surface_ros.tools.common.decay_input import DecayInput

EXAMPLES = """methods:
  dde       characteristic roots of the response's own delay system (the thesis); its maximum
            delay is found by trial fits unless --max-delay gives it
  neutral   roots of x(t) = eps x(t - L), in closed form, beside --tail-rate if given
  esprit    rates of the samples by ESPRIT, coefficients refitted
  polished  those of esprit, moved to make the largest error smaller
  least_squares
            free rates of a record's samples; outliers count for nothing, and with --offset free a
            constant is fitted beside the terms
  best      least_squares for a record that is noisy or holds stray samples, or --offset free, else
            the better of neutral and polished

After the interval the response is assumed to stay within its largest value over the last tenth of
it, or over its last swing. Every fit is held to that there, or to its error if that is larger, and
what it provably never exceeds is printed and written beside the assumption.

Records: a fit is made on the samples and its error measured there; only how far the sum departs
from lines between samples beyond the record's own curvature is counted too. Methods that need a
function (the kernel of dde, the samples of esprit from a record that is not uniform) take straight
lines.

examples:
  fit_decay f1 --terms 9 --output hockey_stick.yaml
  fit_decay f1 --terms 15 --method dde --max-delay 6 --output thesis.yaml
  fit_decay relaxation.csv --value-column force --terms 7 --norm 2 --output relaxation.yaml
  fit_decay noisy.csv --terms auto --offset free --output creep.yaml
  fit_decay bag_folder --topic /wrench --field wrench.force.x --start 1.5 --terms 5 \\
      --output relaxation.yaml
"""

# Parts of the onset from which on a fit is doubted: what is left at the end, and the error.
MOST_LEFT, LARGE_ERROR = 0.9, 0.5
# `--offset free`: the constant is fitted beside the terms.
FREE = "free"
# A proven error is stated if it is at most so many times the one found.
PROVEN = 1.02
# Outliers whose times are printed, and written.
MOST_SHOWN, MOST_WRITTEN = 8, 1000


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    top = program_parser("fit_decay", __doc__, EXAMPLES, "response", "bag")
    add_input_options(top)
    top.add_argument(
        "-n",
        "--terms",
        type=number_of_terms,
        required=True,
        help="number of real terms, a conjugate pair counting two; `auto`: as many as a noisy "
        "record holds by BIC, else the fewest with an error below a thousandth of the onset",
    )
    top.add_argument("-o", "--output", type=Path, help="model file to write (.yaml)")
    top.add_argument("--name", help="the model's name; default: that of the output file")
    top.add_argument("--method", choices=METHODS, default="best", help="default: %(default)s")
    top.add_argument(
        "--norm",
        choices=(AUTO, *NORMS),
        default=AUTO,
        help="of the coefficients' fit; auto: 2 after least_squares, else inf",
    )
    add_method_options(top)
    top.add_argument(
        "--show-system",
        action="store_true",
        help="print the delay system of the rates: its impulses, its pieces (also as monomials), "
        "its characteristic equation and its roots (dde)",
    )
    return top


def number_of_terms(text: str) -> int | str:
    """Return a number of terms, or "auto"."""
    return AUTO if text == AUTO else int(text)


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


def show_progress(line: str) -> None:
    """Write a line of progress to standard error, on a terminal over the line before."""
    if sys.stderr.isatty():
        print(f"\r\033[K{line}", end="", file=sys.stderr, flush=True)
    else:
        print(line, file=sys.stderr, flush=True)


def end_progress() -> None:
    """Clear the line of progress."""
    if sys.stderr.isatty():
        print("\r\033[K", end="", file=sys.stderr, flush=True)


def beyond(result: DecayFit, given: DecayInput) -> float | None:
    """Return the largest error beyond the fitted interval; None where nothing is known there."""
    if given.horizon <= given.end:
        return None
    return largest_error(result.fit.sum, given.target, given.end, given.horizon)


def doubts(result: DecayFit, given: DecayInput) -> list[str]:
    """Return why the fit may be no model of a decaying response, in one line each."""
    fit, found = result.fit, []
    onset = abs(float(given.target(0.0)))
    left = abs(float(fit.sum(given.end))) / abs(float(fit.sum(0.0)) or onset)
    if left > MOST_LEFT:
        found.append(
            f"the fitted sum does not decay: at {given.end:g} s it is {left:.3g} times its onset"
        )
    if fit.max_error > LARGE_ERROR * onset:
        found.append(
            f"the error is {fit.max_error / onset:.3g} times the onset: "
            "too few terms, or no decaying response"
        )
    level = None
    if isinstance(given.target, Record):
        level = resting_level(given.target, given.end)
    if level is not None:
        found.append(
            f"the record ends at about {level:.3g}: is that an offset, such as a sensor's bias? "
            "Then take it away with --offset auto; a load does not die away to it"
        )
    return found


def between(result: DecayFit, given: DecayInput) -> float | None:
    """Return how far the sum is from lines between samples but outliers; None for an example."""
    if not isinstance(given.target, Record):
        return None
    times = given.target.knots
    kept = ~np.isin(times, result.outliers)
    lines = PiecewiseLinear(times[kept], given.target.values[kept])
    return largest_error(result.fit.sum, lines, 0.0, given.end)


def report(result: DecayFit, given: DecayInput) -> None:
    """Print the summary of a fit."""
    fit, choice = result.fit, result.choice
    chosen = ", ".join(
        f"{key} {value:.4g}" if isinstance(value, float) else f"{key} {value}"
        for key, value in choice.parameters.items()
    )
    after = beyond(result, given)
    slowest = fit.sum.rates[int(np.argmax(fit.sum.rates.real))]
    where = "" if given.samples is None else f"at the {given.samples} samples "
    proof = "" if result.largest is None else f"; {proof_in_words(result.largest)}"
    rows = [
        ("response", given.source + (f" less {given.offset:.6g}" if given.offset else "")),
        *(("read", note) for note in given.notes),
        ("method", choice.method + (f" ({chosen})" if chosen else "")),
        ("terms", f"{fit.sum.terms} real ({len(fit.sum.rates)} rates)"),
        ("error", f"{fit.max_error:.4e} {where}on [0, {given.end:g}] s{proof}"),
    ]
    lines = between(result, given)
    if lines is not None:
        rows.append(("between", f"up to {lines:.4e} from the straight lines between samples"))
    if np.isfinite(fit.lower_bound):
        gap = (fit.grid_error - fit.lower_bound) / max(fit.grid_error, 1e-300)
        rows.append(
            (
                "optimal",
                f"{fit.norm}-norm {fit.grid_error:.4e} on the fit's grid; other coefficients "
                f"would lower it by {max(gap, 0.0):.1e} of itself at most",
            )
        )
    if result.noise:
        rows.append(("noise", f"{result.noise:.3g}, the standard deviation of a sample"))
    if len(result.outliers):
        rows.append(("outliers", outliers_in_words(result)))
    if result.terms_tried:
        rows.append(("tried", tried_in_words(result)))
    if fit.sum.constant:
        rows.append(("constant", f"{fit.sum.constant:.6g}, to which the sum decays"))
    if after is not None:
        rows.append(("beyond", f"{after:.4e} on [{given.end:g}, {given.horizon:g}] s"))
    if result.tail is not None:
        rows.append(("assumed", result.tail.assumption))
        rows.append(
            (
                "bound",
                f"the sum stays within {result.tail.bound:.4g} there, so that its error is at "
                f"most {result.tail.error:.4g}",
            )
        )
    rows.append(("right-most", f"{slowest.real:.4g} {slowest.imag:+.4g}i 1/s"))
    rows.append(("time", f"{result.seconds:.2f} s"))
    for label, value in rows:
        print(f"{label:<11} {value}")


def proof_in_words(largest: LargestError) -> str:
    """Return how far the largest error that was found is also proven."""
    if np.isfinite(largest.proven):
        return f"proven to be at most {largest.proven:.4e}"
    return f"found on {largest.points} points and refined near the highest, not proven"


def outliers_in_words(result: DecayFit) -> str:
    """Return how many samples were taken as outliers, and when the first of them were."""
    shown = ", ".join(f"{time:.6g}" for time in result.outliers[:MOST_SHOWN])
    more = ", ..." if len(result.outliers) > MOST_SHOWN else ""
    return f"{counted(len(result.outliers), 'sample')} left out, at {shown}{more} s"


def tried_in_words(result: DecayFit) -> str:
    """Return the numbers of terms that were compared, with their criterion."""
    least = min(tried.bic for tried in result.terms_tried)
    return "BIC above the least: " + ", ".join(
        f"{tried.terms} terms {tried.bic - least:.1f}" for tried in result.terms_tried
    )


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
    if len(result.outliers):
        values["outlier_times"] = result.outliers[:MOST_WRITTEN].tolist()
    if result.terms_tried:
        values["terms_tried"] = [tried.terms for tried in result.terms_tried]
        values["bic"] = [tried.bic for tried in result.terms_tried]
    after = beyond(result, given)
    if after is not None:
        values["error_beyond"] = after
        values["beyond_until"] = given.horizon
    return values


def stated_error(result: DecayFit) -> float:
    """Return the error for the model file: the proven one where it is close to the one found."""
    found, largest = result.fit.max_error, result.largest
    if largest is not None and largest.proven <= PROVEN * found:
        return max(found, largest.proven)
    return found


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


def refuse_options_of_others(options: argparse.Namespace) -> None:
    """Refuse what is for another input or method than the one asked for.

    Raises:
        RangeError: An option would do nothing.
    """
    top = parser()
    if options.input in RESPONSES:
        refuse_unused(top, options, ["start", "offset"], "for a record")
    if not is_bag(Path(options.input)):
        refuse_unused(top, options, ["topic", "field"], "for a bag")
    if options.input in RESPONSES or is_bag(Path(options.input)):
        refuse_unused(top, options, OF_RESPONSES, "for a CSV file")
    if options.method != "dde":
        of_dde = ["max_delay", "degree", "allow_unstable", "show_system"]
        refuse_unused(top, options, of_dde, "for --method dde")
    if options.method not in ("least_squares", "best"):
        refuse_unused(top, options, ["keep_outliers"], "for --method least_squares or best")
        if options.offset == FREE:
            raise RangeError("--offset free is for --method least_squares or best")
    if options.method not in ("neutral", "best"):
        refuse_unused(top, options, ["tail_rate"], "for --method neutral or best")


def run(options: argparse.Namespace) -> None:
    """Read, fit, write, report."""
    if options.output is not None:
        check_output(options.output, YAML_SUFFIXES, [Path(options.input)])
    refuse_empty(options, ["name"])
    refuse_options_of_others(options)
    chosen = method_options(options)
    given = read_input(options)
    given.require_samples_for(1 if options.terms == AUTO else options.terms)
    result = fit_decay(
        given.target,
        options.terms,
        given.end,
        options.method,
        options.norm,
        chosen,
        show_progress,
    )
    end_progress()
    # Before the report: a sum that is no decay model, and so not written, is told first.
    model = None
    if options.output is not None:
        model = model_of(result, given, options.name or options.output.stem)
    report(result, given)
    if options.show_system and result.choice.system is not None:
        print(system_in_words(result.choice.system, result.choice.rates))
    for doubt in doubts(result, given):
        print(f"fit_decay: warning: {doubt}", file=sys.stderr)
    if model is not None:
        command = shlex.join(["fit_decay", *options.command])
        write_decay_model(model, options.output, header=f"Made by: {command}")
        print(f"{'written':<11} {options.output}")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program and return its exit code."""
    top = parser()
    top.set_defaults(command=sys.argv[1:] if argv is None else list(argv))
    return run_program(top, run, argv)


if __name__ == "__main__":
    sys.exit(main())
