# SPDX-License-Identifier: Apache-2.0
"""The table in a CSV file as loggers write it, and errors that name file, line and cause.

Above the rows there may be a preamble of any lines, then a line of names and a row of units.
Blank lines and lines that begin with `#` are skipped, but such a line may hold the names, too.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from limit_surface_ros.checks import LARGEST, counted
from limit_surface_ros.errors import FileError
from limit_surface_ros.files.csv_cells import CellFormat, guess_format, is_data
from limit_surface_ros.files.text_file import read_lines
from limit_surface_ros.files.units import unit_of_cell

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

_LONGEST_LIST = 300
# So many rows of one length are the data, and not a line of numbers in a preamble.
_ROWS_IN_A_ROW = 3


def listed(names: Sequence[str]) -> str:
    """Return names for an error, cut where they are too many."""
    text = ", ".join(names)
    return text if len(text) <= _LONGEST_LIST else f"{text[:_LONGEST_LIST]} ..."


@dataclass(frozen=True)
class CsvOptions:
    """What a user knows of a file; what is None is guessed.

    Attributes:
        delimiter: The character between cells; a space stands for any number of them.
        decimal: "." or ",".
        drop_bad: Whether rows without a number where one is needed are left out, and rows that
            repeat a time; otherwise they are refused.
    """

    delimiter: str | None = None
    decimal: str | None = None
    drop_bad: bool = False


@dataclass
class CsvTable:
    """The table in a file.

    Attributes:
        path: The file.
        form: How its cells are written.
        names: Of the columns; None where nothing names them.
        names_line: The number of the line that names them, or that of the first row.
        units: What the row of units says of each column; empty without one.
        rows: The cells of each row.
        lines: Of each row, the number of its line.
        drop_bad: Whether rows without a number are left out.
        notes: What was guessed, skipped or left out, for people to read.
        first_line: The first line with content.
        first_number: The number of that line.
        usual: How many cells most rows have.
    """

    path: Path
    form: CellFormat
    names: tuple[str, ...] | None
    names_line: int
    units: tuple[str, ...]
    rows: list[list[str]]
    lines: list[int]
    drop_bad: bool = False
    notes: list[str] = field(default_factory=list)
    first_line: str = ""
    first_number: int = 1
    usual: int = field(init=False)

    def __post_init__(self) -> None:
        """Find the usual length of the rows, which may lack the last columns, but all the same."""
        lengths = Counter(map(len, self.rows)).most_common(1)
        self.usual = lengths[0][0] if lengths else 0
        if self.names is not None and self.usual > len(self.names):
            # Rows that end in a mark have one more, empty cell.
            if all(not any(cells[len(self.names) :]) for cells in self.rows):
                self.rows = [cells[: len(self.names)] for cells in self.rows]
            self.usual = len(self.names)

    @property
    def width(self) -> int:
        """How many columns there are."""
        return len(self.names) if self.names is not None else self.usual

    def title(self, column: int) -> str:
        """Return how messages call a column."""
        if self.names is not None and column < len(self.names):
            return f"column {self.names[column]:.60}"
        return f"column {column + 1}"

    def unit(self, column: int) -> str:
        """Return what the row of units says of a column, "" where nothing does."""
        return self.units[column] if column < len(self.units) else ""

    def number(self, row: int, column: int) -> float | None:
        """Return a finite number of a row, or None where rows without one are left out.

        Raises:
            FileError: There is none, or one beyond 1e100, and such rows are not left out.
        """
        cells, place = self.rows[row], f"{self.path}: line {self.lines[row]}"
        if column >= len(cells) or len(cells) != self.usual:
            if self.drop_bad:
                return None
            raise FileError(f"{place}: {self._wrong_length(cells)}")
        cell = cells[column]
        value = self.form.number(cell)
        if value is None or not math.isfinite(value):
            if self.drop_bad:
                return None
            raise FileError(
                f"{place}: {self.title(column)}: {cell!r:.60} is no finite number"
                f"{self.form.hint(cell)}"
            )
        if abs(value) > LARGEST:
            raise FileError(
                f"{place}: {self.title(column)}: {cell:.60} is beyond {LARGEST:g} in size"
            )
        return value

    def _wrong_length(self, cells: Sequence[str]) -> str:
        message = f"has {counted(len(cells), 'cell')}, the columns are {self.width}"
        if self.form.delimiter == "," and len(cells) == 2 * self.width:
            return (
                f"{message}; decimal commas cannot be told from commas between cells: separate "
                "cells by semicolons"
            )
        return f"{message}; cells are read as separated {self.form.in_words}"

    def keep(self, kept: Sequence[int], why: str) -> None:
        """Leave out all rows but some, and note how many and why.

        Raises:
            FileError: None is left.
        """
        left_out = len(self.rows) - len(kept)
        if left_out:
            self.notes.append(f"{counted(left_out, 'row')} left out: {why}")
        if not kept:
            raise FileError(f"{self.path}: no row is left: {why}")
        self.rows = [self.rows[row] for row in kept]
        self.lines = [self.lines[row] for row in kept]


def read_table(
    path: str | Path,
    options: CsvOptions | None = None,
    are_names: Callable[[Sequence[str]], bool] | None = None,
) -> CsvTable:
    """Read the table of a file.

    Args:
        path: The file.
        options: What is known of it.
        are_names: Tells whether cells are the names asked for. The first line whose cells are is
            taken. If there is none, or this is not given, the table is where rows of numbers
            begin, and the line above them names its columns if it has as many cells.

    Raises:
        FileError: The file cannot be read or holds no rows; the message names file and line.
    """
    path, known = Path(path), options or CsvOptions()
    numbered = [
        (number, line) for number, line in enumerate(read_lines(path), start=1) if line.strip()
    ]
    plain = [(number, line) for number, line in numbered if not line.lstrip().startswith("#")]
    form = guess_format(path, plain, known.delimiter, known.decimal)
    cut = [(number, form.cells(line, f"{path}: line {number}")) for number, line in plain]
    comments = [
        (number, form.cells(line.lstrip().lstrip("#"), f"{path}: line {number}"))
        for number, line in numbered
        if line.lstrip().startswith("#") and not line.lstrip().lstrip("#").lstrip().startswith("{")
    ]
    found = None
    if are_names is not None:
        found = next((line for line in sorted(cut + comments) if are_names(line[1])), None)
    if found is None:
        found = _names_above_data(cut, comments, form)
    below = cut if found is None else [line for line in cut if line[0] > found[0]]
    if found is None and below and not is_data(below[0][1], form):
        # No row is of numbers: the first line was meant to name the columns.
        found, below = below[0], below[1:]
    units: tuple[str, ...] = ()
    if found is not None and below and not is_data(below[0][1], form):
        stated = [unit_of_cell(cell) for cell in below[0][1]]
        if all(unit is not None for unit in stated) and any(stated):
            units, below = tuple(unit or "" for unit in stated), below[1:]
    start = below[0][0] if below else 1
    table = CsvTable(
        path=path,
        form=form,
        names=None if found is None else tuple(found[1]),
        names_line=start if found is None else found[0],
        units=units,
        rows=[cells for _, cells in below],
        lines=[number for number, _ in below],
        drop_bad=known.drop_bad,
        first_line=numbered[0][1] if numbered else "",
        first_number=numbered[0][0] if numbered else 1,
    )
    _note_guesses(table, known, plain)
    return table


def _names_above_data(
    cut: Sequence[tuple[int, list[str]]],
    comments: Sequence[tuple[int, list[str]]],
    form: CellFormat,
) -> tuple[int, list[str]] | None:
    """Return the line above the first rows of numbers if it can name their columns."""
    data = [is_data(cells, form) for _, cells in cut]
    widths = [len(cells) for _, cells in cut]

    def begins(row: int) -> bool:
        last = min(row + _ROWS_IN_A_ROW, len(cut))
        return all(data[row:last]) and len(set(widths[row:last])) == 1

    first = next((row for row in range(len(cut)) if begins(row)), None)
    if first is None:
        first = next((row for row in range(len(cut)) if data[row]), None)
    if first is None:
        return None
    above = first - 1
    if above > 0 and all(unit_of_cell(cell) is not None for cell in cut[above][1]):
        above -= 1  # a row of units
    if above >= 0 and len(cut[above][1]) >= widths[first]:
        return cut[above]
    if above >= 0 and first == 1 and len(cut[above][1]) > 1:
        # Whatever stands over the rows, alone, was meant to name them.
        return cut[above]
    stated = [line for line in comments if line[0] < cut[first][0]]
    if stated and len(stated[-1][1]) == widths[first]:
        return stated[-1]
    return None


def _note_guesses(table: CsvTable, known: CsvOptions, plain: Sequence[tuple[int, str]]) -> None:
    guessed = known.delimiter is None or known.decimal is None
    if guessed and (table.form.delimiter, table.form.decimal) != (",", "."):
        table.notes.append(f"cells are read as separated {table.form.in_words}")
    skipped = sum(number < table.names_line for number, _ in plain)
    if skipped:
        what = "the names" if table.names is not None else "the first row"
        table.notes.append(
            f"{what} are in line {table.names_line}: {counted(skipped, 'line')} above skipped"
        )
    if any(table.units):
        table.notes.append(
            f"a row of units is read: {listed([unit or '-' for unit in table.units])}"
        )
