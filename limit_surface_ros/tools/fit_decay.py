# SPDX-License-Identifier: Apache-2.0
"""Approximate a decaying response by a sum of exponentials, and write it as a decay model.

The rates come from the response's own delay differential equation (method dde), from closed
formulas, from the samples, or from a search; the coefficients are optimal on them in the norm
asked for.
"""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from limit_surface_ros.decay.coefficients import NORMS
from limit_surface_ros.decay.delay.words import system_in_words
from limit_surface_ros.decay.examples import EXAMPLES as RESPONSES
from limit_surface_ros.decay.fit import AUTO, METHODS, fit_decay
from limit_surface_ros.errors import RangeError
from limit_surface_ros.files.decay_file import write_decay_model
from limit_surface_ros.files.yaml_reader import YAML_SUFFIXES
from limit_surface_ros.tools.common.csv_options import OF_RESPONSES
from limit_surface_ros.tools.common.decay_fit import (
    FREE,
    add_method_options,
    method_options,
    model_of,
)
from limit_surface_ros.tools.common.decay_input import add_input_options, read_input
from limit_surface_ros.tools.common.decay_report import doubts, report
from limit_surface_ros.tools.common.options import check_output, refuse_empty, refuse_unused
from limit_surface_ros.tools.common.program import program_parser, run_program
from limit_surface_ros.tools.common.training_data import is_bag

if TYPE_CHECKING:
    from collections.abc import Sequence


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
from lines between samples beyond the record's own curvature is counted too. What a response does
between two samples no record tells: a kink there may be missed by more than `max_error`. How far
the sum is from straight lines is printed as `between` and written as `error_between`. Methods that
need a function (the kernel of dde, the samples of esprit from a record that is not uniform) take
straight lines.

examples:
  fit_decay f1 --terms 9 --output hockey_stick.yaml
  fit_decay f1 --terms 15 --method dde --max-delay 6 --output thesis.yaml
  fit_decay relaxation.csv --value-column force --terms 7 --norm 2 --output relaxation.yaml
  fit_decay noisy.csv --terms auto --offset free --output creep.yaml
  fit_decay bag_folder --topic /wrench --field wrench.force.x --start 1.5 --terms 5 \\
      --output relaxation.yaml
"""


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
