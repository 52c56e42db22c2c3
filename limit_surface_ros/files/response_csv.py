# SPDX-License-Identifier: Apache-2.0
"""Recorded responses in CSV: one row per sample, its time and the value that dies away.

The first column of times and the first column of numbers beside it are read, or those that are
named; see `csv_table` for what may stand above the rows, `csv_times` for how times are given.
Nothing is assumed between samples: fits are made on them, errors measured at them.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_positive, counted
from limit_surface_ros.decay.targets import Record
from limit_surface_ros.errors import DataError, FileError, RangeError
from limit_surface_ros.files import units
from limit_surface_ros.files.csv_table import listed, read_table
from limit_surface_ros.files.csv_times import find_times, read_times

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.files.csv_table import CsvOptions, CsvTable

# Rows that are looked at for columns that hold numbers.
_LOOKED_AT = 5


@dataclass(frozen=True)
class RecordedResponse:
    """A response read from a file.

    Attributes:
        record: Its samples.
        notes: What was guessed, skipped or left out, in one line each.
    """

    record: Record
    notes: tuple[str, ...] = ()


def read_response(
    path: str | Path,
    time_column: str | None = None,
    value_column: str | None = None,
    options: CsvOptions | None = None,
    *,
    time_unit: str | None = None,
    sample_rate: float | None = None,
) -> RecordedResponse:
    """Read a recorded response.

    Args:
        path: The file.
        time_column: Name of the column of times, with or without its unit, or its number from 1;
            the first column if not given.
        value_column: Name or number of the column of values; the first column of numbers beside
            the times if not given.
        options: How cells are written, and whether bad rows are left out.
        time_unit: Of the times, such as "ms"; what the file states, or s, if not given.
        sample_rate: Samples per second of a file without times [Hz].

    Raises:
        FileError: The file cannot be read, a column is missing, a cell is no finite number, or
            times do not rise or are in another unit; the message names file and line.
        DataError: The samples are no response: x(0) = 0.
        RangeError: The unit or the rate is none, or there are a rate and a column of times.
    """
    path = Path(path)
    rate = None if sample_rate is None else as_positive("--sample-rate", sample_rate)
    if rate is not None and (time_column is not None or time_unit is not None):
        raise RangeError("--sample-rate is for files without times: leave out what names times")
    asked = [name for name in (time_column, value_column) if name is not None]

    def are_names(cells: Sequence[str]) -> bool:
        return all(_place(cells, name) is not None for name in asked)

    table = read_table(path, options, are_names if asked else None)
    if not table.rows:
        raise FileError(f"{path}: holds no rows; rows of time and value are accepted")
    if rate is None:
        times, value = _times_and_value(table, time_column, value_column, time_unit)
    else:
        times, value = _even_times(table, value_column, rate)
    values = np.array([table.number(row, value) for row in range(len(table.rows))], dtype=float)
    if len(values) < 2:
        raise FileError(f"{path}: holds {counted(len(values), 'sample')}; at least 2 are needed")
    if value_column is None:
        _refuse_constant(table, value, values)
    unit = units.unit_of_cell(table.unit(value))
    table.notes.append(f"values are {table.title(value)}" + (f" in {unit}" if unit else ""))
    try:
        return RecordedResponse(Record(times - times[0], values), tuple(table.notes))
    except (DataError, RangeError) as error:
        raise DataError(f"{path}: {error}") from None


def _times_and_value(
    table: CsvTable, time_column: str | None, value_column: str | None, unit: str | None
) -> tuple[Floats, int]:
    """Return the times of the rows that are kept, and the column of values."""
    wanted = None if time_column is None else _column(table, time_column)
    found = find_times(table, wanted, unit)
    if value_column is not None:
        value = _column(table, value_column)
    elif table.width < 2:
        raise FileError(
            f"{table.path}: has no column 2: its one column is read as times; values at even "
            f"times need --sample-rate{_other_marks(table)}"
        )
    else:
        others = [column for column in range(table.width) if column not in found.columns]
        value = next((column for column in others if _is_numeric(table, column)), others[0])
    if table.drop_bad:
        # First, so that no row without a value stands for its time.
        held = [row for row in range(len(table.rows)) if table.number(row, value) is not None]
        table.keep(held, f"{table.title(value)} holds no number")
    times = read_times(table, found)
    table.notes.append(f"times are {found.in_words}")
    return times, value


def _other_marks(table: CsvTable) -> str:
    """Return what may stand between the cells of a table of one column, to end a message."""
    hint = table.form.hint(table.rows[-1][0]) if table.rows[-1] else ""
    return hint or f"; cells are read as separated {table.form.in_words}"


def _even_times(table: CsvTable, value_column: str | None, rate: float) -> tuple[Floats, int]:
    """Return the times of samples at a rate, and the column of values."""
    if value_column is None and table.width > 1:
        raise FileError(
            f"{table.path}: holds {table.width} columns: with --sample-rate name the one of "
            f"values, --value-column NAME or a number from 1 to {table.width}"
        )
    if table.drop_bad:
        raise RangeError("--drop-bad is not for --sample-rate: every row takes a place in time")
    value = 0 if value_column is None else _column(table, value_column)
    table.notes.append(f"times are those of {rate:g} samples per second")
    return np.arange(len(table.rows)) / rate, value


def _refuse_constant(table: CsvTable, value: int, values: Floats) -> None:
    """Refuse a constant that was not asked for, where other columns are the response."""
    if (values != values[0]).any():
        return
    others = [
        column
        for column in range(value + 1, table.width)
        if _is_numeric(table, column)
        and len({cells[column] for cells in table.rows if len(cells) > column}) > 1
    ]
    if others:
        columns = [
            str(column + 1) if table.names is None else table.names[column] for column in others
        ]
        raise FileError(
            f"{table.path}: {table.title(value)} is {values[0]:g} all the time; name another with "
            f"--value-column: {listed(columns)}"
        )


def _is_numeric(table: CsvTable, column: int) -> bool:
    """Tell whether the first rows hold a number in a column."""
    cells = [row[column] for row in table.rows[:_LOOKED_AT] if column < len(row)]
    return any(table.form.number(cell) is not None for cell in cells)


def _place(names: Sequence[str], wanted: str) -> int | None:
    """Return the column that has a name, if need be without its unit; None if not one has."""
    for called in (list(names), [units.split_unit(name, units.TIME)[0] for name in names]):
        if called.count(wanted) == 1:
            return called.index(wanted)
    return None


def _column(table: CsvTable, wanted: str) -> int:
    names = table.names
    place = None if names is None else _place(names, wanted)
    if place is not None:
        return place
    if wanted.isdecimal() and 1 <= int(wanted[:9]) <= table.width:
        return int(wanted) - 1
    if names is None:
        raise FileError(
            f"{table.path}: no line names the columns, so none is {wanted!r}; a number from 1 to "
            f"{table.width} is accepted, too"
        )
    found = "given twice" if wanted in names else "missing"
    raise FileError(f"{table.path}: column {wanted!r} is {found}; there are {listed(names)}")
