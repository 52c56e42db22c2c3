# SPDX-License-Identifier: Apache-2.0
"""How the cells of a CSV file are written: what separates them, and their decimal mark."""

from __future__ import annotations

import csv
import math
import re
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

from limit_surface_ros.errors import FileError, RangeError

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

# By the names that options take, the most usual first: of equally good guesses the first is taken.
DELIMITERS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " ", "bar": "|"}
DECIMALS = (".", ",")
_SPOKEN = {",": "commas", ";": "semicolons", "\t": "tabs", " ": "spaces", "|": "bars"}
_LOOKED_AT, _LONGEST_LOOKED_AT = 200, 10_000
_IN_NO_NUMBER, _MOST = (";", "\t"), 0.6
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?", re.ASCII)
_NO_NUMBER = {"nan", "inf", "infinity"}
# A day and a time of it, or a time alone; see `csv_times`.
MOMENT = re.compile(
    r"(?:(?P<day>\d{4}[-/]\d{2}[-/]\d{2})[T ])?(?P<clock>\d{1,2}:\d{2}:\d{2})"
    r"(?:[.,](?P<part>\d+))?\s*(?P<zone>Z|[+-]\d{2}:?\d{2})?",
    re.ASCII,
)


@dataclass(frozen=True)
class CellFormat:
    """How cells are written.

    Attributes:
        delimiter: The character between cells; a space stands for any number of them.
        decimal: "." or ",".
    """

    delimiter: str = ","
    decimal: str = "."

    def cells(self, line: str, place: str) -> list[str]:
        """Return the cells of a line, without the spaces around them.

        Args:
            line: The line.
            place: Where it stands, for the error, as "pushes.csv: line 3".

        Raises:
            FileError: The line is no row of CSV, such as one with a cell that is far too long.
        """
        if self.delimiter == " ":
            return line.split()
        try:
            row = next(csv.reader([line], delimiter=self.delimiter, skipinitialspace=True), [])
        except csv.Error as error:
            raise FileError(f"{place}: is not a row of CSV: {error}") from None
        return [cell.strip() for cell in row]

    def number(self, cell: str) -> float | None:
        """Return the number in a cell, NaN where it says so, None where it holds none."""
        text = cell
        if self.decimal == ",":
            if "." in cell:
                return None
            text = cell.replace(",", ".", 1)
        if _NUMBER.fullmatch(text) is None:
            return math.nan if text.lower().lstrip("+-") in _NO_NUMBER else None
        return float(text.replace("d", "e").replace("D", "e"))

    @property
    def in_words(self) -> str:
        """How cells are written, as in "by semicolons, with decimal commas"."""
        marks = ", with decimal commas" if self.decimal == "," else ""
        return f"by {_SPOKEN.get(self.delimiter, repr(self.delimiter))}{marks}"

    def hint(self, cell: str) -> str:
        """Return what may be the matter with a cell that holds no number, to end a message."""
        if not cell or cell.lower() in _NO_NUMBER:
            return "; --drop-bad leaves such rows out"
        swapped = CellFormat(self.delimiter, "," if self.decimal == "." else ".")
        if swapped.number(cell) is not None:
            return f"; is its {swapped.decimal!r} a decimal mark? --decimal {swapped.decimal!r}"
        for name, character in DELIMITERS.items():
            other = CellFormat(character, self.decimal)
            parts = cell.split(character)
            apart = character != self.delimiter and len(parts) > 1 and character != self.decimal
            if apart and all(other.number(part.strip()) is not None for part in parts):
                return (
                    f"; cells are read as separated {self.in_words}: --delimiter {name} reads "
                    f"{_SPOKEN[character]}"
                )
        if re.fullmatch(r"[+-]?\d{1,3}([.,' ]\d{3})+([.,]\d+)?", cell):
            return "; marks between thousands are not read"
        if re.search(r"\d:\d\d", cell):
            return "; dates and times are read as in 2026-02-28T23:59:59.5, or 23:59:59.5 alone"
        if re.match(r"[+-]?[\d.,]+\s*[A-Za-z\[(%°]", cell):
            return "; a unit belongs into the name of the column, as in 'fx [N]'"
        return ""


def delimiter_named(text: str) -> str:
    """Return the character that an option names, as "tab", ";" or "semicolon".

    Raises:
        RangeError: It is neither a name nor one character that can stand between cells.
    """
    if text in DELIMITERS:
        return DELIMITERS[text]
    if text == "\\t":
        return "\t"
    if len(text) != 1 or text.isalnum() or text in ".\"'+-#\n\r\x00":
        raise RangeError(
            f"--delimiter must be {', '.join(DELIMITERS)} or one character, got {text!r}"
        )
    return text


def decimal_named(text: str) -> str:
    """Return the decimal mark that an option names.

    Raises:
        RangeError: It is neither a point nor a comma.
    """
    marks = {".": ".", ",": ",", "point": ".", "comma": ","}
    if text not in marks:
        raise RangeError(f"--decimal must be '.' or ',', got {text!r}")
    return marks[text]


def is_data(cells: Sequence[str], form: CellFormat) -> bool:
    """Tell whether cells are a row of data: at least half of those with content are numbers."""
    return 2 * _numeric_share(cells, form) >= 1.0


def _numeric_share(cells: Iterable[str], form: CellFormat) -> float:
    full = [cell for cell in cells if cell]
    if not full:
        return 0.0
    numeric = sum(
        form.number(cell) is not None or MOMENT.fullmatch(cell) is not None for cell in full
    )
    return numeric / len(full)


def guess_format(
    path: Path,
    lines: Sequence[tuple[int, str]],
    delimiter: str | None = None,
    decimal: str | None = None,
) -> CellFormat:
    """Return how the cells of most lines read as numbers, in rows of one length.

    Args:
        path: Of the file, for errors.
        lines: Those with content that are no comments, with their numbers.
        delimiter: The character between cells, if it is known.
        decimal: The decimal mark, if it is known.

    Raises:
        RangeError: Both are known and the same.
    """
    if delimiter is not None and delimiter == decimal:
        raise RangeError(f"--delimiter and --decimal cannot both be {delimiter!r}")
    some = [line for line in lines if len(line[1]) <= _LONGEST_LOOKED_AT]
    some = some[:: max(1, len(some) // _LOOKED_AT)]
    best, best_score = CellFormat(delimiter or ",", decimal or "."), (0.0, 0.0)
    if best.delimiter == best.decimal:
        best = CellFormat(";", ",") if delimiter is None else CellFormat(",", ".")
    for mark in DECIMALS if decimal is None else (decimal,):
        for between in DELIMITERS.values() if delimiter is None else (delimiter,):
            if between == mark:
                continue
            form = CellFormat(between, mark)
            score = _score(path, some, form)
            if score > best_score:
                best, best_score = form, score
    if delimiter is None and best.delimiter not in _IN_NO_NUMBER:
        # A mark that stands equally often in most lines separates cells, numbers or not.
        for between in _IN_NO_NUMBER:
            if _even_rows(path, some, between) > _MOST * len(some):
                forms = [CellFormat(between, mark) for mark in DECIMALS if decimal in (None, mark)]
                return max(forms, key=lambda form: _score(path, some, form))
    return best


def _even_rows(path: Path, lines: Sequence[tuple[int, str]], delimiter: str) -> int:
    """Return how many lines have the usual number of cells; 0 if that is one."""
    form = CellFormat(delimiter)
    counts = Counter(len(form.cells(line, f"{path}: line {number}")) for number, line in lines)
    usual, rows = counts.most_common(1)[0] if counts else (1, 0)
    return rows if usual > 1 else 0


def _score(path: Path, lines: Sequence[tuple[int, str]], form: CellFormat) -> tuple[float, float]:
    """Return the share of cells that are numbers in rows of the usual length, and that length."""
    shares: list[tuple[int, float]] = []
    for number, line in lines:
        cells = form.cells(line, f"{path}: line {number}")
        if is_data(cells, form):
            shares.append((len(cells), _numeric_share(cells, form)))
    if not shares:
        return 0.0, 0.0
    usual = Counter(count for count, _ in shares).most_common(1)[0][0]
    total = sum(share for count, share in shares if count == usual)
    return round(total / len(lines), 6), float(usual)
