# SPDX-License-Identifier: Apache-2.0
"""Recorded pushes in CSV: one row per push, the wrench that acted and the twist that it caused.

An optional first line `# {...}` holds a JSON object about the recording (`rho_m`,
`normal_force_N`, `support_points_m_body_frame`, `support_loads_N` and whatever else); blank lines
and further lines that begin with `#` are skipped. Then a line of column names, in any order:
`fx_N, fy_N, tau_Nm` the wrench on the body, `vx, vy, omega` its twist, of which only the direction
matters; other columns are ignored.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.checks import LARGEST, SMALLEST
from limit_surface_ros.errors import DataError, FileError
from limit_surface_ros.files.csv_row import cells_of
from limit_surface_ros.surface.pairs import Pairs

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from limit_surface_ros.checks import Floats

WRENCH_COLUMNS = ("fx_N", "fy_N", "tau_Nm")
TWIST_COLUMNS = ("vx", "vy", "omega")
COLUMNS = WRENCH_COLUMNS + TWIST_COLUMNS
_BY_COMMAS = "; columns are separated by commas"


@dataclass(frozen=True)
class Pushes:
    """A file of recorded pushes.

    Attributes:
        path: Where they were read.
        pairs: One wrench and twist per row.
        about: The JSON object of the first line, empty if there is none.
    """

    path: Path
    pairs: Pairs
    about: Mapping[str, Any] = field(default_factory=dict)

    def rows(self, numbers: Sequence[int]) -> Pairs:
        """Return the pairs of the rows with these numbers, from 0, in that order.

        Raises:
            DataError: There is no such row, or none is asked for.
        """
        if len(numbers) == 0:
            raise DataError(f"{self.path}: no rows are selected")
        for number in numbers:
            if not 0 <= number < len(self.pairs):
                raise DataError(
                    f"{self.path}: there is no row {number}; rows are 0 to {len(self.pairs) - 1}"
                )
        chosen = np.asarray(numbers, dtype=int)
        return Pairs(self.pairs.wrenches[chosen], self.pairs.twists[chosen])

    def rest(self, numbers: Sequence[int]) -> Pairs:
        """Return the pairs of all other rows."""
        chosen = set(numbers)
        return self.rows([i for i in range(len(self.pairs)) if i not in chosen])

    def number(self, key: str) -> float | None:
        """Return a number above zero that the first line gives, or None where it gives none.

        Raises:
            FileError: What it gives is not a finite number above zero.
        """
        value = self.about.get(key)
        if value is None:
            return None
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not is_number or not 0.0 < value <= LARGEST:
            raise FileError(
                f"{self.path}: line 1: {key} must be a number above 0, at most {LARGEST:g}, "
                f"got {value!r:.60}"
            )
        return float(value)

    def support(self) -> tuple[Floats, Floats] | None:
        """Return support points [m], shape (n, 2), and their loads [N], (n,), if they are given.

        Raises:
            FileError: What the first line gives are not as many points as loads.
        """
        points = self.about.get("support_points_m_body_frame")
        loads = self.about.get("support_loads_N")
        if points is None or loads is None:
            return None
        try:
            places, forces = np.array(points, dtype=float), np.array(loads, dtype=float)
        except (TypeError, ValueError, OverflowError):
            places, forces = np.empty(0), np.empty(0)
        sound = places.ndim == 2 and places.shape == (forces.size, 2) and forces.size > 0
        # NaN fails this.
        known = (np.abs(places) <= LARGEST).all() and (forces <= LARGEST).all()
        if not sound or not known or not (forces > 0.0).all():
            raise FileError(
                f"{self.path}: line 1: support_points_m_body_frame must be points [x, y] and "
                "support_loads_N one load above 0 for each"
            )
        return places, forces


def read_pushes(path: str | Path) -> Pushes:
    """Read recorded pushes.

    Raises:
        FileError: The file is absent or unreadable, a column is missing, or a row is not what it
            must be; the message names file and line.
    """
    path = Path(path)
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError as error:
        raise FileError(f"{path}: is not UTF-8 text: {error}") from None
    numbered = [(number, line) for number, line in enumerate(lines, start=1) if line.strip()]
    if not numbered:
        raise FileError(f"{path}: is empty; a line of column names and rows are accepted")
    about = _about(path, numbered[0])
    rows = [(number, line) for number, line in numbered if not line.lstrip().startswith("#")]
    if not rows:
        raise FileError(f"{path}: has no line of column names; needed are {', '.join(COLUMNS)}")
    columns = _columns(path, *rows[0])
    if len(rows) == 1:
        raise FileError(f"{path}: line {rows[0][0]}: no rows follow the column names")
    table = np.array([_row(path, number, line, columns) for number, line in rows[1:]])
    return Pushes(path, Pairs(table[:, :3], table[:, 3:]), about)


def _about(path: Path, first: tuple[int, str]) -> dict[str, Any]:
    """Return the JSON object in the first line, if that is a comment that holds one."""
    number, line = first
    text = line.strip().removeprefix("#").strip()
    if not line.lstrip().startswith("#") or not text.startswith("{"):
        return {}
    try:
        about = json.loads(text)
    except ValueError as error:
        raise FileError(f"{path}: line {number}: is not a JSON object: {error}") from None
    return dict(about)


def _columns(path: Path, number: int, line: str) -> list[str]:
    names = cells_of(path, number, line)
    for name in COLUMNS:
        if names.count(name) != 1:
            found = "is missing" if name not in names else "is given twice"
            hint = "" if len(names) > 1 else _BY_COMMAS
            raise FileError(
                f"{path}: line {number}: column {name} {found}; needed are "
                f"{', '.join(COLUMNS)}, got {', '.join(names)}{hint}"
            )
    return names


def _row(path: Path, number: int, line: str, columns: list[str]) -> list[float]:
    """Return the six numbers of a row in the order of COLUMNS."""
    place = f"{path}: line {number}"
    cells = cells_of(path, number, line)
    if len(cells) != len(columns):
        hint = "" if len(cells) > 1 else _BY_COMMAS
        raise FileError(f"{place}: has {len(cells)} cells, the columns are {len(columns)}{hint}")
    values = []
    for name in COLUMNS:
        cell = cells[columns.index(name)]
        try:
            value = float(cell)
        except ValueError:
            raise FileError(f"{place}: column {name}: {cell!r} is not a number") from None
        if not math.isfinite(value):
            raise FileError(f"{place}: column {name}: must be finite, got {cell}")
        if abs(value) > LARGEST:
            raise FileError(
                f"{place}: column {name}: must be at most {LARGEST:g} in size, got {cell}"
            )
        values.append(value)
    for what, part in (("wrench", values[:3]), ("twist", values[3:])):
        if not any(part):
            raise FileError(f"{place}: the {what} is zero: it has no direction")
        if max(map(abs, part)) < SMALLEST:
            raise FileError(
                f"{place}: the {what} is below {SMALLEST:g} in size, too small for a direction"
            )
    return values
