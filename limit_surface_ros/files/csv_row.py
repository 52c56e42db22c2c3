# SPDX-License-Identifier: Apache-2.0
"""One line of a CSV file taken apart, or an error that names file and line."""

from __future__ import annotations

import csv
from typing import TYPE_CHECKING

from limit_surface_ros.errors import FileError

if TYPE_CHECKING:
    from pathlib import Path


def cells_of(path: Path, number: int, line: str) -> list[str]:
    """Return the cells of a line that is not blank, without the spaces around them.

    Args:
        path: Of the file, for the error.
        number: Of the line, from 1, for the error.
        line: The line.

    Raises:
        FileError: The line is no row of CSV, such as one with a cell that is far too long.
    """
    try:
        return [cell.strip() for cell in next(csv.reader([line]))]
    except csv.Error as error:
        raise FileError(f"{path}: line {number}: is not a row of CSV: {error}") from None
