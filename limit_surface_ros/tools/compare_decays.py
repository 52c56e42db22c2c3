# SPDX-License-Identifier: Apache-2.0
"""Compare methods of approximating a decaying response, each with several numbers of terms.

Prints one row for each method and number of terms: the error on the fitted interval and beyond
it, the right-most rate and the time it took. A method that cannot be used says why.
"""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

from limit_surface_ros.decay.fit import METHODS, fit_decay
from limit_surface_ros.decay.targets import Record
from limit_surface_ros.errors import LimitSurfaceError, RangeError
from limit_surface_ros.tools.common.decay_fit import add_method_options, beyond, method_options
from limit_surface_ros.tools.common.decay_input import add_input_options, read_input
from limit_surface_ros.tools.common.program import program_parser, progress_bar, run_program

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.decay.fit import Options
    from limit_surface_ros.tools.common.decay_input import DecayInput

EXAMPLES = """examples:
  compare_decays f1 --end 19
  compare_decays f3 --methods dde esprit --terms 9 31
  compare_decays relaxation.csv --value-column force --terms 5 9
"""
HEADINGS = ("method", "terms", "error", "beyond", "right-most [1/s]", "time [s]")


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    top = program_parser("compare_decays", __doc__, EXAMPLES, "response", "bag")
    add_input_options(top)
    top.add_argument(
        "--methods",
        nargs="+",
        choices=METHODS,
        help="default: all; least_squares of records alone, which have samples",
    )
    top.add_argument(
        "-n", "--terms", nargs="+", type=int, default=[5, 9, 15], help="default: 5 9 15"
    )
    add_method_options(top)
    return top


def compare(chosen: Options, given: DecayInput, method: str, terms: int) -> list[str]:
    """Return one row of the table.

    Raises:
        LimitSurfaceError: The method cannot be used on this response.
    """
    given.require_samples_for(terms)
    result = fit_decay(given.target, terms, given.end, method, options=chosen)
    x, after = result.fit.sum, beyond(result, given)
    return [
        method,
        str(x.terms),
        f"{result.fit.max_error:.3e}",
        "" if after is None else f"{after:.1e}",
        f"{x.slowest_rate:.3g}",
        f"{result.seconds:.2f}",
    ]


def run(options: argparse.Namespace) -> None:
    """Fit by each method with each number of terms, and print the table."""
    if min(options.terms) < 1:
        raise RangeError(f"--terms must be at least 1 each, got {min(options.terms)}")
    chosen = method_options(options)
    given = read_input(options)
    usable = [m for m in METHODS if m != "least_squares" or isinstance(given.target, Record)]
    pairs = [(method, terms) for terms in options.terms for method in options.methods or usable]
    rows: list[list[str]] = []
    refusals: dict[str, str] = {}
    with progress_bar("fits") as progress:
        for done, (method, terms) in enumerate(pairs, start=1):
            try:
                rows.append(compare(chosen, given, method, terms))
            except LimitSurfaceError as error:
                refusals[method] = str(error)
                rows.append([method, str(terms), "refused", "", "", ""])
            progress(done, len(pairs))
    print(f"{given.source}, fitted on [0, {given.end:g}] s, largest errors")
    for note in given.notes:
        print(note)
    for row in (HEADINGS, ["---"] * len(HEADINGS), *rows):
        print(f"| {' | '.join(row)} |")
    for method, reason in refusals.items():
        print(f"{method}: {reason}")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program and return its exit code."""
    return run_program(parser(), run, argv)


if __name__ == "__main__":
    sys.exit(main())
