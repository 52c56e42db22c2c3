# SPDX-License-Identifier: Apache-2.0
"""The options that say how a CSV file is written, for every program that reads one."""

from __future__ import annotations

from typing import TYPE_CHECKING

from limit_surface_ros.files.csv_cells import DELIMITERS, decimal_named, delimiter_named
from limit_surface_ros.files.csv_table import CsvOptions
from limit_surface_ros.files.response_csv import read_response
from limit_surface_ros.files.units import TIME

if TYPE_CHECKING:
    import argparse
    from pathlib import Path

    from limit_surface_ros.files.response_csv import RecordedResponse

# As attributes, for the refusal of options that do nothing.
OF_CELLS = ("delimiter", "decimal", "drop_bad")
OF_RESPONSES = ("time_column", "value_column", "time_unit", "sample_rate", *OF_CELLS)


def add_cell_options(parser: argparse._ActionsContainer) -> None:
    """Declare how cells of a CSV file are written, and what becomes of bad rows."""
    parser.add_argument(
        "--delimiter",
        metavar="X",
        help=f"between cells of a CSV file: {', '.join(DELIMITERS)} or one character; "
        "default: guessed, and printed",
    )
    parser.add_argument(
        "--decimal", metavar="X", help="decimal mark of a CSV file, . or ,; default: guessed"
    )
    parser.add_argument(
        "--drop-bad",
        action="store_true",
        help="leave rows of a CSV file out that have no number where one is needed, or repeat a "
        "time; default: refuse them",
    )


def add_response_options(parser: argparse._ActionsContainer) -> None:
    """Declare how a response stands in a CSV file."""
    parser.add_argument(
        "--time-column", metavar="NAME", help="or its number from 1; default: the first column"
    )
    parser.add_argument(
        "--value-column",
        metavar="NAME",
        help="or its number from 1; default: the first column of numbers beside the times",
    )
    parser.add_argument(
        "--time-unit",
        metavar="UNIT",
        help=f"of a CSV file's times: {', '.join(TIME)}; default: what the file states, or s",
    )
    parser.add_argument(
        "--sample-rate",
        type=float,
        metavar="HZ",
        help="of a CSV file that holds values alone, at even times",
    )
    add_cell_options(parser)


def cell_options(options: argparse.Namespace) -> CsvOptions:
    """Return what the options say of cells.

    Raises:
        RangeError: A mark is none.
    """
    return CsvOptions(
        None if options.delimiter is None else delimiter_named(options.delimiter),
        None if options.decimal is None else decimal_named(options.decimal),
        options.drop_bad,
    )


def response_of_csv(path: Path, options: argparse.Namespace) -> RecordedResponse:
    """Read a response as the options say.

    Raises:
        FileError: See `read_response`, also for the two below.
        DataError: The samples are no response.
        RangeError: An option is out of range.
    """
    return read_response(
        path,
        options.time_column,
        options.value_column,
        cell_options(options),
        time_unit=options.time_unit,
        sample_rate=options.sample_rate,
    )
