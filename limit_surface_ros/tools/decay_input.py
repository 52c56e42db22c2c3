"""The response that a decay program is to approximate: an example or a record."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_positive
from limit_surface_ros.decay.examples import EXAMPLES, example
from limit_surface_ros.decay.targets import PiecewiseLinear
from limit_surface_ros.errors import DataError, FileError
from limit_surface_ros.files.bag_reader import read_topic
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
        samples: How many samples a record has on the interval; None for an example.
    """

    def __init__(
        self, source: str, target: Target, end: float, horizon: float, samples: int | None = None
    ) -> None:
        """Take what has been read."""
        self.source = source
        self.target = target
        self.end = end
        self.horizon = max(horizon, end)
        self.samples = samples

    def require_samples_for(self, terms: int) -> None:
        """Refuse more terms than the samples can determine: each has a rate and a coefficient.

        Raises:
            DataError: The record has fewer samples than two for each term.
        """
        if self.samples is not None and self.samples < 2 * terms:
            raise DataError(
                f"{self.source}: {terms} terms need at least {2 * terms} samples on "
                f"[0, {self.end:g}] s, there are {self.samples}"
            )


def add_input_options(parser: argparse.ArgumentParser) -> None:
    """Declare the input and the options that say how it is read."""
    parser.add_argument(
        "input",
        help=f"what to approximate: an example ({', '.join(EXAMPLES)}), a CSV file with a column "
        "of times [s] and one of values, or a ROS 2 bag (needs --topic)",
    )
    parser.add_argument(
        "--end",
        type=float,
        metavar="S",
        help="end of the fitted interval [s]; default: the end of the record, for examples "
        f"{EXAMPLE_END:g}",
    )
    parser.add_argument(
        "--start",
        type=float,
        default=0.0,
        metavar="S",
        help="the onset, counted from the record's first sample [s]; what is before is left out",
    )
    parser.add_argument("--time-column", metavar="NAME", help="default: the first column")
    parser.add_argument("--value-column", metavar="NAME", help="default: the second column")
    parser.add_argument("--topic", metavar="NAME", help="of a bag")
    parser.add_argument(
        "--field",
        metavar="NAME",
        help="the number in the topic's messages, such as wrench.force.x; default: the only one",
    )


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
    if options.topic is not None:
        record = record_of_bag(path, options.topic, options.field)
    elif path.is_dir() or path.suffix in (".mcap", ".db3"):
        raise FileError(f"{path}: is a bag: say which topic to read, with --topic")
    else:
        record = read_response(path, options.time_column, options.value_column)
    return of_record(str(path), after(record, options.start), end)


def record_of_bag(path: Path, topic: str, field: str | None) -> PiecewiseLinear:
    """Return a number of a topic's messages over time, from the first message on.

    Raises:
        MissingExtraError: rosbags is not installed.
        FileError: The bag, the topic or the field is absent.
        DataError: The samples are no response.
    """
    recorded = read_topic(path, topic, None if field is None else [field])
    return PiecewiseLinear(recorded.times - recorded.times[0], recorded.values[:, 0])


def after(record: PiecewiseLinear, start: float) -> PiecewiseLinear:
    """Return what a record holds from `start` [s] on, its times counted from there.

    Raises:
        FileError: The start is negative, or fewer than two samples are left.
    """
    kept = record.knots >= start
    if not start >= 0.0 or np.count_nonzero(kept) < 2:
        raise FileError(
            f"--start {start:g} must be at least 0 and leave two samples of the record, "
            f"which ends at {record.knots[-1]:g} s"
        )
    times = record.knots[kept]
    return PiecewiseLinear(times - times[0], record.values[kept])


def of_record(source: str, record: PiecewiseLinear, end: float | None) -> DecayInput:
    """Return a record as an input; the interval may not go beyond it.

    Raises:
        FileError: The end lies beyond the record.
    """
    last = float(record.knots[-1])
    if end is not None and end > last:
        raise FileError(f"{source}: the record ends at {last:g} s, before --end {end:g}")
    span = end or last
    return DecayInput(source, record, span, last, int(np.count_nonzero(record.knots <= span)))
