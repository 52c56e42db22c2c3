# SPDX-License-Identifier: Apache-2.0
"""Draw a decay model: response and fit, error, rates in the complex plane, projection."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from limit_surface_ros.decay.examples import EXAMPLES, example
from limit_surface_ros.errors import FileError
from limit_surface_ros.files.decay_file import read_decay_model
from limit_surface_ros.plots.canvas import save_figure
from limit_surface_ros.plots.decay_view import PROJECTION, draw_decay
from limit_surface_ros.tools.common.csv_options import add_response_options, response_of_csv
from limit_surface_ros.tools.common.decay_input import after, without
from limit_surface_ros.tools.common.options import add_picture_options, check_picture
from limit_surface_ros.tools.common.program import program_parser, run_program

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.decay.targets import Target
    from limit_surface_ros.files.decay_file import DecayModel

EPILOG = f"""\
The projection goes {PROJECTION:g} times as far as the fit. The response is the one that the model
file names as its source, if that is an example or a file that is still there. A record
is drawn from the start that the model file states, less the offset that it states.

examples:
  plot_decay hockey_stick.yaml
  plot_decay relaxation.yaml --response relaxation.csv --output relaxation.svg
"""


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    top = program_parser("plot_decay", __doc__, EPILOG, "decay", "response")
    top.add_argument("model", type=Path, metavar="MODEL", help="model file (.yaml)")
    add_picture_options(top, "decay.png")
    top.add_argument(
        "--response",
        metavar="X",
        help=f"what the model stands for: an example ({', '.join(EXAMPLES)}) or a CSV file",
    )
    add_response_options(top.add_argument_group("a CSV file of --response"))
    return top


def response_of(model: DecayModel, options: argparse.Namespace) -> Target | None:
    """Return the response that the options or the model name; None if there is none.

    Raises:
        FileError: The options name neither an example nor a readable record.
    """
    name = options.response or str(model.fit.get("source", ""))
    if name in EXAMPLES:
        return example(name)
    path = Path(name)
    if path.is_file():
        record = response_of_csv(path, options).record
        return without(after(record, _stated(model, "start")), _stated(model, "offset"))
    if options.response:
        raise FileError(
            f"{path}: no such file, and no example has that name; examples are "
            f"{', '.join(EXAMPLES)}"
        )
    return None


def _stated(model: DecayModel, key: str) -> float:
    """Return a number that the model file states of its fit, 0 if it states none."""
    value = model.fit.get(key, 0.0)
    return float(value) if isinstance(value, (int, float)) else 0.0


def run(options: argparse.Namespace) -> None:
    """Read, draw, write."""
    check_picture(options, map(Path, filter(None, [options.model, options.response])))
    model = read_decay_model(options.model)
    figure = draw_decay(model, response_of(model, options))
    save_figure(figure, options.output, options.dpi)
    print(f"written     {options.output}")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program and return its exit code."""
    return run_program(parser(), run, argv)


if __name__ == "__main__":
    sys.exit(main())
