# SPDX-License-Identifier: Apache-2.0
"""Times in a table: seconds, other units, ROS stamps, seconds and nanoseconds, dates.

They are counted from the first. Differences are taken exactly, before anything is rounded: times
since 1970 in nanoseconds have more digits than a float.
"""

from __future__ import annotations

import datetime
import re
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import LARGEST
from limit_surface_ros.errors import FileError, RangeError
from limit_surface_ros.files import units
from limit_surface_ros.files.csv_cells import MOMENT

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.files.csv_table import CsvTable

# Longer and shorter recordings are no decays that were recorded: the unit is another.
LONGEST, SHORTEST = 366 * 86400.0, 1e-6
_DAY, _LONGEST_CELL = 86400, 60
# Seconds since 1970 of the years 2001 to 2100.
_THIS_CENTURY = 978307200.0, 4102444800.0
# Columns that hold nanoseconds since 1970, as rostopic of ROS 1 writes them.
_NANOSECONDS = re.compile(r"^%time$|header[./]stamp$")
_SECOND_PART = re.compile(r"^(?P<stem>.*?)(secs?|seconds)$")
_NANOSECOND_PARTS = ("nanosec", "nanosecs", "nsec", "nsecs", "nanoseconds")
_NANOSECONDS_OF_A_SECOND = 10**9


@dataclass(frozen=True)
class TimeColumns:
    """Where a table's times stand.

    Attributes:
        columns: One, or that of seconds and that of nanoseconds.
        seconds: How long the unit of the first is [s].
        in_words: What the times are, for people to read.
        stated: Whether the file or the user states the unit.
    """

    columns: tuple[int, ...]
    seconds: Decimal
    in_words: str
    stated: bool


def find_times(table: CsvTable, wanted: int | None, unit: str | None = None) -> TimeColumns:
    """Return where the times of a table stand.

    Args:
        table: The table.
        wanted: The column that the user names; the first, or a stamp's two, if not given.
        unit: The unit that the user states, one of `units.TIME`.

    Raises:
        FileError: The unit that the file states is none.
        RangeError: The unit that the user states is none.
    """
    if unit is not None and unit not in units.TIME:
        raise RangeError(f"--time-unit must be {', '.join(units.TIME)}, got {unit!r}")
    column = 0 if wanted is None else wanted
    if unit is None:
        pair = _stamp_of_two(table, column)
        if pair is not None:
            return TimeColumns(pair, Decimal(1), "seconds and nanoseconds of a stamp", True)
    name = "" if table.names is None else table.names[column]
    bare, stated = units.split_unit(name, units.TIME)
    if stated is not None and units.plain(stated) not in units.TIME:
        raise FileError(
            f"{table.path}: times are in {stated!r:.60} by the column's name {name!r:.60}; "
            f"accepted are {', '.join(units.TIME)}"
        )
    below = table.unit(column)
    if unit is None and stated is None and below:
        if units.plain(below) not in units.TIME:
            raise FileError(
                f"{table.path}: times are in {below!r:.60} by the row of units; accepted are "
                f"{', '.join(units.TIME)}"
            )
        stated = below
    if unit is None and stated is None and _NANOSECONDS.search(bare) is not None:
        stated = "ns"
    chosen = unit or units.plain(stated or "s")
    words = f"{table.title(column)} in {chosen}"
    return TimeColumns((column,), Decimal(repr(units.TIME[chosen])), words, bool(unit or stated))


def _stamp_of_two(table: CsvTable, column: int) -> tuple[int, int] | None:
    """Return the columns of seconds and nanoseconds, if the times are given so."""
    if table.names is not None:
        second = _SECOND_PART.match(table.names[column].lower())
        if second is None:
            return None
        lowered = [name.lower() for name in table.names]
        for part in _NANOSECOND_PARTS:
            if second["stem"] + part in lowered:
                return column, lowered.index(second["stem"] + part)
        return None
    # As `ros2 topic echo --csv` writes a header: seconds, nanoseconds, and the name of a frame.
    if column != 0 or table.usual < 4:
        return None
    for cells in table.rows[:20]:
        if len(cells) < 4 or not cells[0].isdecimal() or not cells[1].isdecimal():
            return None
        of_second = int(cells[1]) < _NANOSECONDS_OF_A_SECOND if len(cells[1]) < 10 else False
        if not of_second or (cells[2] and table.form.number(cells[2]) is not None):
            return None
    return 0, 1


def read_times(table: CsvTable, found: TimeColumns) -> Floats:
    """Return the times of all rows, counted from the first, and leave out rows without one.

    Args:
        table: The table, of whose rows those without a time and those that repeat one are left
            out if it is told to.
        found: Where they stand.

    Returns:
        Shape (n,), increasing from 0 [s].

    Raises:
        FileError: A row has no time, times do not rise, or all of them span so much or so little
            that they are in another unit.
    """
    moments = [_moment(table, row, found) for row in range(len(table.rows))]
    kept = [row for row, moment in enumerate(moments) if moment is not None]
    table.keep(kept, "they hold no time")
    exact = [moment for moment in moments if moment is not None]
    rising = [0]
    for row in range(1, len(exact)):
        last = rising[-1]
        if exact[row] > exact[last]:
            rising.append(row)
        elif exact[row] < exact[last] or not table.drop_bad:
            _refuse_order(table, found, row, last, exact[row] == exact[last])
    table.keep(rising, "they repeat a time")
    first = exact[0]
    times = np.array([float(exact[row] - first) for row in rising])
    _check_span(table, found, times, float(first))
    return times


def _moment(table: CsvTable, row: int, found: TimeColumns) -> Decimal | None:
    """Return the time in a row [s]; None where it has none and may be left out."""
    cells = table.rows[row]
    if len(cells) > found.columns[0]:
        date = MOMENT.fullmatch(cells[found.columns[0]])
        if date is not None:
            return _seconds_of_date(table, row, date)
    parts = []
    for column in found.columns:
        if table.number(row, column) is None:
            return None
        try:
            text = cells[column].replace(",", ".").lower().replace("d", "e")
            parts.append(Decimal(text))
        except InvalidOperation:
            raise FileError(
                f"{table.path}: line {table.lines[row]}: {cells[column]!r:.60} is no time"
            ) from None
    if len(parts) == 2:
        return parts[0] + parts[1] / _NANOSECONDS_OF_A_SECOND
    return parts[0] * found.seconds


def _seconds_of_date(table: CsvTable, row: int, date: re.Match[str]) -> Decimal:
    """Return the seconds of a date and time since the year 1, or of a time since midnight."""
    try:
        day = (date["day"] or "0001-01-01").replace("/", "-")
        moment = datetime.datetime.fromisoformat(f"{day}T{date['clock']:0>8}")
    except ValueError as error:
        raise FileError(f"{table.path}: line {table.lines[row]}: {error}") from None
    zone = (date["zone"] or "Z").replace("Z", "+0000").replace(":", "")
    away = (60 * int(zone[1:3]) + int(zone[3:5])) * (-60 if zone[0] == "-" else 60)
    whole = moment.toordinal() * _DAY + moment.hour * 3600 + moment.minute * 60 + moment.second
    return Decimal(whole - away) + Decimal(f"0.{date['part'] or 0}")


def _refuse_order(table: CsvTable, found: TimeColumns, row: int, last: int, equal: bool) -> None:
    """Raise the error of a time that does not rise."""
    column = found.columns[0]
    now, before = table.rows[row][column][:_LONGEST_CELL], table.rows[last][column]
    before = f"{before[:_LONGEST_CELL]} of line {table.lines[last]}"
    place = f"{table.path}: line {table.lines[row]}"
    if equal:
        raise FileError(
            f"{place}: the times must increase: {now} stands in line {table.lines[last]}, too; "
            "--drop-bad keeps the first of equal times"
        )
    hint = ""
    if table.form.delimiter == "," and table.form.decimal == ".":
        hint = "; are there decimal commas? Then separate cells by semicolons, or --decimal ','"
    raise FileError(f"{place}: the times must increase: {now} is before {before}{hint}")


def _check_span(table: CsvTable, found: TimeColumns, times: Floats, first: float) -> None:
    """Refuse times that are in another unit by all appearance."""
    span = float(times[-1])
    since_1970 = _unit_since_1970(first) if not found.stated else None
    if since_1970 is not None:
        raise FileError(
            f"{table.path}: the times are, by all appearance, {since_1970} since 1970: say so in "
            f"the name of their column, as in 't [{since_1970}]', or with "
            f"--time-unit {since_1970}; as seconds they span {_in_words(span)}"
        )
    if len(times) < 2 or SHORTEST <= span <= LONGEST:
        return
    as_read = "" if not found.stated else f" as {found.in_words}"
    likely = _likely_unit(span / float(found.seconds), span > LONGEST)
    raise FileError(
        f"{table.path}: the times span {_in_words(span)}{as_read}: are they in {likely}? "
        f"Say so in the name of their column, as in 't [{likely}]', or with --time-unit {likely}"
    )


def _unit_since_1970(time: float) -> str | None:
    """Return the unit in which a time is one of this century since 1970, None if in none."""
    for unit in ("ms", "us", "ns"):
        if _THIS_CENTURY[0] < time * units.TIME[unit] < _THIS_CENTURY[1]:
            return unit
    return None


def _likely_unit(span: float, too_long: bool) -> str:
    """Return the unit in which a span of a number is nearest to some seconds."""
    ranked: Sequence[str] = ("ms", "us", "ns") if too_long else ("s", "ms", "us")
    if not 0.0 < span < LARGEST:
        return ranked[-1]
    return min(ranked, key=lambda unit: abs(np.log10(span * units.TIME[unit] / 5.0)))


def _in_words(span: float) -> str:
    if span > LONGEST:
        return f"{span / LONGEST:.3g} years"
    if span > SHORTEST:
        return f"{span:.4g} s"
    return f"{span * 1e9:.3g} ns"
