"""The response that a decay program is to approximate: an example or a record."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from limit_surface_ros.checks import as_positive
from limit_surface_ros.decay.examples import EXAMPLES, example
from limit_surface_ros.decay.targets import PiecewiseLinear
from limit_surface_ros.errors import FileError
from limit_surface_ros.files.response_csv import read_response

if TYPE_CHECKING:
    import argparse

    from limit_surface_ros.decay.targets import Target

# The thesis fits its examples on [0, 6] and looks at them up to 19.
EXAMPLE_END, EXAMPLE_HORIZON = 6.0, 19.0


class DecayInput:
    """A response, the interval on which it is fitted, and how far it is known.

    Attributes:
        source: The example's name or the record's file, for the model file.
        target: The response.
        end: End of the fitted interval [s].
        horizon: Up to where errors beyond the interval are measured [s]; not below `end`.
    """

    def __init__(self, source: str, target: Target, end: float, horizon: float) -> None:
        """Take what has been read."""
        self.source = source
        self.target = target
        self.end = end
        self.horizon = max(horizon, end)


def add_input_options(parser: argparse.ArgumentParser) -> None:
    """Declare the input and the options that say how it is read."""
    parser.add_argument(
        "input",
        help=f"what to approximate: an example ({', '.join(EXAMPLES)}) or a CSV file with "
        "a column of times [s] and one of values",
    )
    parser.add_argument(
        "--end",
        type=float,
        metavar="S",
        help="end of the fitted interval [s]; default: the end of the record, for examples "
        f"{EXAMPLE_END:g}",
    )
    parser.add_argument("--time-column", metavar="NAME", help="default: the first column")
    parser.add_argument("--value-column", metavar="NAME", help="default: the second column")


def read_input(options: argparse.Namespace) -> DecayInput:
    """Return the response that the options name.

    Raises:
        FileError: The input is neither an example nor a readable record.
        DataError: The record is no response.
        RangeError: The end is not above 0.
    """
    end = None if options.end is None else as_positive("--end", options.end)
    if options.input in EXAMPLES:
        span = end or EXAMPLE_END
        return DecayInput(options.input, example(options.input), span, EXAMPLE_HORIZON)
    path = Path(options.input)
    if not path.exists():
        raise FileError(
            f"{path}: no such file, and no example has that name; examples are "
            f"{', '.join(EXAMPLES)}"
        )
    record = read_response(path, options.time_column, options.value_column)
    return of_record(str(path), record, end)


def of_record(source: str, record: PiecewiseLinear, end: float | None) -> DecayInput:
    """Return a record as an input; the interval may not go beyond it.

    Raises:
        FileError: The end lies beyond the record.
    """
    last = float(record.knots[-1])
    if end is not None and end > last:
        raise FileError(f"{source}: the record ends at {last:g} s, before --end {end:g}")
    return DecayInput(source, record, end or last, last)
