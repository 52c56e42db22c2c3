# SPDX-License-Identifier: Apache-2.0
"""The response that a decay program is to approximate: an example or a record."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_positive
from limit_surface_ros.decay.examples import EXAMPLES, example
from limit_surface_ros.decay.noise import resting_level
from limit_surface_ros.decay.targets import Record
from limit_surface_ros.errors import DataError, FileError, RangeError
from limit_surface_ros.files.bag_topic import read_topic
from limit_surface_ros.files.yaml_reader import YAML_SUFFIXES
from limit_surface_ros.tools.common.csv_options import add_response_options, response_of_csv
from limit_surface_ros.tools.common.training_data import is_bag

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
        start: Of the response within its record [s].
        offset: What has been taken away from the record's values.
        notes: How the record was read, in one line each.
    """

    def __init__(
        self,
        source: str,
        target: Target,
        end: float,
        horizon: float,
        start: float = 0.0,
        offset: float = 0.0,
    ) -> None:
        """Take what has been read."""
        self.source = source
        self.target = target
        self.end = end
        self.horizon = max(horizon, end)
        self.start = start
        self.offset = offset
        self.notes: tuple[str, ...] = ()

    @property
    def samples(self) -> int | None:
        """How many samples a record has on the interval; None for an example."""
        if not isinstance(self.target, Record):
            return None
        return int(np.count_nonzero(self.target.knots <= self.end))

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
    parser.add_argument(
        "--offset",
        metavar="X",
        help="what to take away from a record's values, such as a sensor's bias; `auto`: the "
        "constant at which the record ends; `free`: fit the constant to which it decays",
    )
    add_response_options(parser)
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
        RangeError: The end is not above 0, or the offset is no number.
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
    notes: tuple[str, ...] = ()
    if options.topic is not None:
        record = record_of_bag(path, options.topic, options.field)
    elif path.suffix.lower() in YAML_SUFFIXES:
        raise FileError(
            f"{path}: is YAML and no record; accepted are an example, a CSV file of times and "
            "values, and a bag (fit_surface fits contacts, plot_decay draws decay models)"
        )
    elif is_bag(path):
        raise FileError(f"{path}: is a bag: say which topic to read, with --topic")
    else:
        response = response_of_csv(path, options)
        record, notes = response.record, response.notes
    given = of_record(str(path), record, end, options.start, options.offset)
    given.notes = notes
    return given


def record_of_bag(path: Path, topic: str, field: str | None) -> Record:
    """Return a number of a topic's messages over time, from the first message on.

    Raises:
        MissingExtraError: rosbags is not installed.
        FileError: The bag, the topic or the field is absent.
        DataError: The samples are no response.
    """
    recorded = read_topic(path, topic, None if field is None else [field])
    return Record(recorded.times - recorded.times[0], recorded.values[:, 0])


def after(record: Record, start: float) -> Record:
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
    return Record(times - times[0], record.values[kept])


def without(record: Record, offset: float) -> Record:
    """Return a record whose values are smaller by an offset.

    Raises:
        DataError: Nothing is left at the onset.
    """
    return Record(record.knots, record.values - offset)


def of_record(
    source: str, whole: Record, end: float | None, start: float = 0.0, offset: str | None = None
) -> DecayInput:
    """Return a record as an input; the interval may not go beyond it.

    Args:
        source: Of the record, for messages and the model file.
        whole: The record.
        end: Of the interval [s], counted from `start`; the end of the record if not given.
        start: The onset within the record [s].
        offset: A number to take away from the values, or "auto"; "free" takes nothing away.

    Raises:
        FileError: The start or the end lies beyond the record.
        RangeError: The offset is no number.
        DataError: The record ends at no constant that could be taken away.
    """
    record = after(whole, start)
    last = float(record.knots[-1])
    if end is not None and end > last:
        raise FileError(f"{source}: the record ends at {last:g} s, before --end {end:g}")
    span = end or last
    # A constant that is fitted is no part of the input.
    if offset is None or offset == "free":
        return DecayInput(source, record, span, last, start)
    if offset == "auto":
        level = resting_level(record, span)
        if level is None:
            raise DataError(
                f"{source}: ends at no constant other than 0; give --offset a number, "
                "fit the constant with --offset free, or leave it"
            )
    else:
        level = _number("--offset", offset)
    return DecayInput(source, without(record, level), span, last, start, level)


def _number(name: str, text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise RangeError(f"{name} must be a number or auto, got {text!r}")
    return number
