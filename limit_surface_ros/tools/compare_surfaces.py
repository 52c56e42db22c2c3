# SPDX-License-Identifier: Apache-2.0
"""Compare surfaces on data: model files, and kinds that are fitted on the spot.

Prints one row for each: its size, the quantiles of the error of motion |v - v^| of unit twists,
the mean angle, the quantiles of the error of load |f - f^| in parts of the loads' size, the spread
of the motions among the refits of a bootstrap where the model has one, and the time of its fit and
of its two maps. Data are a contact file, recorded pushes, or a bag; with rows held out, models are
judged on those alone.
"""

from __future__ import annotations

import argparse
import copy
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.checks import counted
from limit_surface_ros.errors import DataError, LimitSurfaceError, RangeError
from limit_surface_ros.files.surface_file import read_surface_model
from limit_surface_ros.fitting.few_pushes.bootstrap import surfaces_of, twist_spread
from limit_surface_ros.fitting.pairs import scaling_of_pairs
from limit_surface_ros.fitting.result import errors_on
from limit_surface_ros.fitting.search import Search, process_pool
from limit_surface_ros.fitting.workers import available_cores
from limit_surface_ros.plots.canvas import SUFFIXES, new_figure, save_figure
from limit_surface_ros.plots.distributions import draw_distributions
from limit_surface_ros.surface.measures import load_error, quantiles, velocity_error
from limit_surface_ros.tools.common.fit_options import (
    OF_AUTO,
    RANGES,
    add_fit_options,
    check_fit_options,
)
from limit_surface_ros.tools.common.options import check_output, named_path, refuse_unused
from limit_surface_ros.tools.common.program import program_parser, progress_bar, run_program
from limit_surface_ros.tools.common.same_point import About, require_one_point
from limit_surface_ros.tools.common.surface_fit import fit, read_input

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.files.surface_file import SurfaceModel
    from limit_surface_ros.surface.base import LimitSurface
    from limit_surface_ros.surface.pairs import Pairs
    from limit_surface_ros.tools.common.training_data import TrainingData

EXAMPLES = """examples:
  compare_surfaces contact.yaml --models a.yaml b.yaml
  compare_surfaces contact.yaml --fit thesis:1 thesis:3 norms:3 dissipation:3 polynomial
  compare_surfaces pushes.csv --rows 0-24 --fit thesis:1 convex auto --picture errors.png
"""
HEADINGS = (
    "model",
    "kind",
    "numbers",
    "v 50 %",
    "v 95 %",
    "v 100 %",
    "angle [deg]",
    "f 50 %",
    "f 95 %",
    "f 100 %",
    "spread [deg]",
    "fit [s]",
    "wrench->twist [us]",
    "twist->wrench [us]",
)
# What --fit takes: the options of fit_surface that each stands for.
FITS: dict[str, dict[str, object]] = {
    "thesis": {"kind": "power_sum", "family": "thesis"},
    "norms": {"kind": "power_sum", "family": "norms"},
    "dissipation": {"kind": "dissipation"},
    "polynomial": {"kind": "polynomial"},
    "convex": {"kind": "polynomial", "objective": "convex"},
    "second": {"kind": "power_sum", "objective": "second"},
    "exact": {"kind": "exact"},
    "auto": {"auto": True},
}
# Those of them that a number of terms may follow.
WITH_TERMS = ("thesis", "norms", "dissipation")


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    top = program_parser(
        "compare_surfaces", __doc__, EXAMPLES, "surface", "contact", "body", "pushes", "bag"
    )
    top.add_argument(
        "data", type=named_path, help="a contact file, recorded pushes, or a ROS 2 bag"
    )
    top.add_argument("--models", nargs="+", type=Path, default=[], help="model files")
    top.add_argument(
        "--fit",
        nargs="+",
        default=[],
        metavar="KIND[:TERMS]",
        help=f"kinds to fit: {', '.join(FITS)}; {', '.join(WITH_TERMS)} with a number of terms, "
        "such as norms:4",
    )
    top.add_argument("--picture", type=Path, help="write the errors' distributions to this file")
    top.add_argument("--workers", type=int, default=available_cores(), help="(%(default)s)")
    add_fit_options(top)
    return top


def options_of(options: argparse.Namespace, wanted: str) -> argparse.Namespace:
    """Return the options that a word such as norms:4 stands for.

    Raises:
        RangeError: There is no such kind, or the terms are no number or not for it.
    """
    kind, colon, terms = wanted.partition(":")
    least, most = RANGES["terms"]
    if colon and kind in FITS and kind not in WITH_TERMS:
        raise RangeError(f"--fit {kind} takes no number of terms; got {wanted!r}")
    if kind not in FITS or (colon and not (terms.isdecimal() and least <= int(terms) <= most)):
        raise RangeError(
            f"--fit takes {', '.join(FITS)}; {', '.join(WITH_TERMS)} with a number of terms from "
            f"{least} to {most}, such as norms:4; got {wanted!r}"
        )
    chosen = copy.copy(options)
    for key, value in FITS[kind].items():
        setattr(chosen, key, value)
    if colon:
        chosen.terms = int(terms)
    return chosen


def microseconds_each(function: Callable[[Floats], Floats], vectors: Floats) -> float:
    """Return the time of a map for one vector of many [us], the best of three runs."""
    times = []
    for _ in range(3):
        begin = time.perf_counter()
        function(vectors)
        times.append(time.perf_counter() - begin)
    return 1e6 * min(times) / len(vectors)


@dataclass(frozen=True)
class Compared:
    """A surface among those that are compared.

    Attributes:
        name: Of its row.
        surface: The surface.
        fit_time: What its fit took [s], if that is known.
        bootstrap: Its refits as `stored_surfaces` keeps them, if there are any.
    """

    name: str
    surface: LimitSurface
    fit_time: float | None
    bootstrap: Mapping[str, Any] | None

    def spread(self, wrenches: Floats) -> str:
        """Return the root mean square spread of the refits' twists [deg], in words.

        Raises:
            DataError: What is stored of the refits is no bootstrap.
        """
        if self.bootstrap is None:
            return "-"
        refits = surfaces_of(self.bootstrap, self.surface.scaling)
        return f"{np.degrees(np.sqrt(np.mean(twist_spread(refits, wrenches) ** 2))):.2f}"


def row_of(compared: Compared, test: Pairs) -> list[str]:
    """Return one row of the table."""
    surface = compared.surface
    errors = errors_on(surface, test)
    loads = quantiles(load_error(surface, test, scaling_of_pairs(test)))
    return [
        compared.name,
        surface.kind,
        str(surface.size),
        *(f"{value:.3f}" for value in errors.velocity),
        f"{np.degrees(errors.mean_angle):.2f}",
        *(f"{value:.3f}" for value in loads),
        compared.spread(test.wrenches),
        "-" if compared.fit_time is None else f"{compared.fit_time:.2f}",
        f"{microseconds_each(surface.twist_of_wrench, test.wrenches):.2f}",
        f"{microseconds_each(surface.wrench_of_twist, test.twists):.2f}",
    ]


def run(options: argparse.Namespace) -> None:
    """Read, fit, measure, print, draw."""
    if not options.models and not options.fit:
        raise RangeError("nothing to compare: give --models or --fit")
    check_fit_options(options)
    refuse_unused(parser(), options, ["auto"], "written --fit auto")
    if "auto" not in options.fit:
        refuse_unused(parser(), options, OF_AUTO, "for --fit auto")
    wanted = {word: options_of(options, word) for word in options.fit}
    if options.picture is not None:
        # Before the fits, and not after them, if the picture cannot be made.
        check_output(options.picture, SUFFIXES, [options.data, *options.models])
        with new_figure(1.0, 1.0):
            pass
    stored = {path: read_surface_model(path) for path in options.models}
    data = read_input(options.data, options)
    require_one_point(stated_points(options.data, data, stored))
    test = data.held_out or data.training
    stems = [path.stem for path in stored]
    surfaces = [
        Compared(
            path.stem if stems.count(path.stem) == 1 else str(path),
            model.surface,
            stated_time(model),
            model.fit.get("bootstrap"),
        )
        for path, model in stored.items()
    ]
    refusals: list[str] = []
    with process_pool(options.workers) as executor, progress_bar("fits") as progress:
        for done, (word, chosen) in enumerate(wanted.items(), start=1):
            try:
                result = fit(chosen, data, Search(options.starts, options.seed, executor))
                refits = result.details.get("bootstrap")
                surfaces.append(Compared(word, result.surface, result.wall_time, refits))
            except LimitSurfaceError as error:
                refusals.append(f"{word}: {error}")
            progress(done, len(wanted))
    if not surfaces:
        raise DataError(f"nothing to compare is left: {'; '.join(refusals)}")
    kept = "held out" if data.held_out is not None else "fitted"
    print(f"{options.data}: {counted(len(test), 'pair')}, {kept}")
    print_table([row_of(each, test) for each in surfaces])
    for refusal in refusals:
        print(f"left out: {refusal}")
    if options.picture is not None:
        draw(surfaces, test, options.picture)
        print(f"written     {options.picture}")


def stated_points(
    path: Path, data: TrainingData, stored: Mapping[Path, SurfaceModel]
) -> list[About]:
    """Return what data and models are about, as far as their files state it."""
    stated = [About(each, model.frame_id, model.reference_point) for each, model in stored.items()]
    if data.frame_id is not None:
        stated.insert(0, About(path, data.frame_id, data.reference_point))
    return stated


def stated_time(model: SurfaceModel) -> float | None:
    """Return what a model file states that its fit took [s]; what stands there may be anything."""
    value = model.fit.get("wall_time_s")
    return float(value) if isinstance(value, (int, float)) else None


def print_table(rows: list[list[str]]) -> None:
    """Print rows under the headings, aligned."""
    table = [list(HEADINGS), *rows]
    widths = [max(len(row[column]) for row in table) for column in range(len(HEADINGS))]
    for row in table:
        cells = [cell.ljust(width) for cell, width in zip(row, widths, strict=True)]
        print("  ".join(cells).rstrip())


def draw(surfaces: Sequence[Compared], test: Pairs, path: Path) -> None:
    """Draw the distributions of the errors of motion."""
    errors = {each.name: velocity_error(each.surface, test) for each in surfaces}
    with new_figure(7.0, 4.5) as figure:
        draw_distributions(figure.subplots(), errors, "error of motion |v - v^| of unit twists")
        save_figure(figure, path)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program and return its exit code."""
    return run_program(parser(), run, argv)


if __name__ == "__main__":
    sys.exit(main())
