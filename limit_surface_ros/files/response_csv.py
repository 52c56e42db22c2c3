# SPDX-License-Identifier: Apache-2.0
"""Recorded responses in CSV: one row per sample, its time and the value that dies away.

A first line may name the columns; without names the first column is the time and the second the
value. Columns are separated by commas. Times are seconds, or what the name of their column states,
as `t [ms]` or `time_us`, and are counted from the first. Blank lines and lines that begin with `#`
are skipped. Nothing is assumed between samples: fits are made on them, errors measured at them.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.decay.targets import LARGEST, Record
from limit_surface_ros.errors import DataError, FileError, RangeError
from limit_surface_ros.files.csv_row import cells_of

if TYPE_CHECKING:
    from collections.abc import Sequence


_SECONDS = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
# "t [ms]", "t (ms)", "t_ms"; of units without brackets only those that are known.
_UNIT = re.compile(
    rf"[\[(]\s*(?P<bracketed>[^\])]*?)\s*[\])]\s*$|_(?P<suffix>{'|'.join(_SECONDS)})$"
)


def read_response(
    path: str | Path, time_column: str | None = None, value_column: str | None = None
) -> Record:
    """Read a recorded response.

    Args:
        path: The file.
        time_column: Name of the column of times [s]; the first column if not given.
        value_column: Name of the column of values; the second column if not given.

    Raises:
        FileError: The file cannot be read, a column is missing, or a cell is no finite number; the
            message names file and line.
        DataError: The samples are no response: times that do not increase, x(0) = 0.
    """
    path = Path(path)
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError as error:
        raise FileError(f"{path}: is not UTF-8 text: {error}") from None
    rows = [
        (number, cells_of(path, number, line))
        for number, line in enumerate(lines, start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not rows:
        raise FileError(f"{path}: holds no rows; rows of time and value are accepted")
    names = rows[0][1] if not all(_is_number(cell) for cell in rows[0][1]) else None
    columns = (
        _column(path, names, time_column, 0),
        _column(path, names, value_column, 1),
    )
    unit = 1.0 if names is None else _seconds(path, names[columns[0]])
    samples = np.array(
        [_sample(path, number, cells, columns) for number, cells in rows[names is not None :]]
    )
    if len(samples) < 2:
        raise FileError(f"{path}: holds {len(samples)} samples; at least 2 are needed")
    try:
        return Record(unit * (samples[:, 0] - samples[0, 0]), samples[:, 1])
    except (DataError, RangeError) as error:
        raise DataError(f"{path}: {error}") from None


def _seconds(path: Path, name: str) -> float:
    """Return how many seconds the unit has that the name of the column of times states."""
    stated = _UNIT.search(name)
    if stated is None:
        return 1.0
    unit = stated["bracketed"] or stated["suffix"]
    if unit not in _SECONDS:
        raise FileError(
            f"{path}: times are in {unit!r} by the column's name {name!r}; accepted are "
            f"{', '.join(_SECONDS)}"
        )
    return _SECONDS[unit]


def _column(path: Path, names: Sequence[str] | None, wanted: str | None, default: int) -> int:
    if wanted is None:
        return default
    if names is None:
        raise FileError(f"{path}: names no columns in its first line, so none is {wanted!r}")
    if names.count(wanted) != 1:
        found = "missing" if wanted not in names else "given twice"
        raise FileError(f"{path}: column {wanted!r} is {found}; there are {', '.join(names)}")
    return names.index(wanted)


def _sample(path: Path, line: int, cells: Sequence[str], columns: Sequence[int]) -> list[float]:
    numbers = []
    for column in columns:
        if column >= len(cells):
            raise FileError(
                f"{path}: line {line}: has no column {column + 1}; cells are separated by commas"
            )
        number = float(cells[column]) if _is_number(cells[column]) else math.nan
        if not math.isfinite(number):
            hint = "; cells are separated by commas" if set(cells[column]) & set(";\t ") else ""
            raise FileError(f"{path}: line {line}: {cells[column]!r} is no finite number{hint}")
        if abs(number) > LARGEST:
            raise FileError(f"{path}: line {line}: {cells[column]} is beyond {LARGEST:g}")
        numbers.append(number)
    return numbers


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
