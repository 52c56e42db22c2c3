# SPDX-License-Identifier: Apache-2.0
"""Recorded pushes in CSV: one row per push, the wrench that acted and the twist that it caused.

An optional first line `# {...}` holds a JSON object about the recording (`rho_m`,
`normal_force_N`, `support_points_m_body_frame`, `support_loads_N` and whatever else); see
`csv_table` for what else may stand above the rows. A line names the columns, in any order:
`fx_N, fy_N, tau_Nm` the wrench on the body, `vx, vy, omega` its twist, of which only the direction
matters; other columns are ignored. Names may state other units, as `tau [N mm]`, and so may a row
of units below them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.checks import LARGEST, SMALLEST
from limit_surface_ros.errors import DataError, FileError
from limit_surface_ros.files import units
from limit_surface_ros.files.csv_table import listed, read_table
from limit_surface_ros.files.regular_file import json_object
from limit_surface_ros.surface.pairs import Pairs

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.files.csv_table import CsvOptions, CsvTable

WRENCH_COLUMNS = ("fx_N", "fy_N", "tau_Nm")
TWIST_COLUMNS = ("vx", "vy", "omega")
COLUMNS = WRENCH_COLUMNS + TWIST_COLUMNS
# What else loggers call the columns, in small letters and without units.
_ALIASES = {
    "fx_N": ("fx", "force_x", "force.x"),
    "fy_N": ("fy", "force_y", "force.y"),
    "tau_Nm": ("tau", "tau_z", "tz", "mz", "torque_z", "torque.z"),
    "vx": ("vx", "v_x", "linear.x"),
    "vy": ("vy", "v_y", "linear.y"),
    "omega": ("omega", "omega_z", "wz", "angular.z"),
}
_UNITS = {
    "fx_N": units.FORCE,
    "fy_N": units.FORCE,
    "tau_Nm": units.TORQUE,
    "vx": units.SPEED,
    "vy": units.SPEED,
    "omega": units.TURNING,
}


@dataclass(frozen=True)
class Pushes:
    """A file of recorded pushes.

    Attributes:
        path: Where they were read.
        pairs: One wrench and twist per row.
        about: The JSON object of the first line, empty if there is none.
        notes: What was guessed, skipped, converted or left out, in one line each.
    """

    path: Path
    pairs: Pairs
    about: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

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
        return self.pairs.take(chosen)

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


def read_pushes(path: str | Path, options: CsvOptions | None = None) -> Pushes:
    """Read recorded pushes.

    Args:
        path: The file.
        options: How cells are written, and whether bad rows are left out.

    Raises:
        FileError: The file is absent or unreadable, a column is missing, or a row is not what it
            must be; the message names file and line.
    """
    path = Path(path)
    table = read_table(path, options, _are_names)
    if not table.rows and table.names is None:
        raise FileError(f"{path}: is empty; a line of column names and rows are accepted")
    columns = [_column(table, name) for name in COLUMNS]
    if not table.rows:
        raise FileError(f"{path}: line {table.names_line}: no rows follow the column names")
    factors = [_factor(table, name, column) for name, column in zip(COLUMNS, columns, strict=True)]
    rows = [_row(table, row, columns) for row in range(len(table.rows))]
    kept = [row for row, values in enumerate(rows) if values is not None]
    table.keep(kept, "they are no push")
    values = np.array([rows[row] for row in kept]) * factors
    return Pushes(path, Pairs(values[:, :3], values[:, 3:]), _about(table), tuple(table.notes))


def _about(table: CsvTable) -> dict[str, Any]:
    """Return the JSON object in the first line, if that is a comment that holds one."""
    text = table.first_line.strip()
    if not text.startswith("#") or not text.removeprefix("#").strip().startswith("{"):
        return {}
    place = f"{table.path}: line {table.first_number}"
    return json_object(text.removeprefix("#").strip(), place)


def _are_names(cells: Sequence[str]) -> bool:
    return all(_places(cells, name) for name in COLUMNS)


def _places(names: Sequence[str], wanted: str) -> list[int]:
    """Return the columns that hold what is wanted: those of that very name, or those like it."""
    exact = [place for place, name in enumerate(names) if name == wanted]
    if exact:
        return exact
    found = []
    for place, name in enumerate(names):
        bare = units.split_unit(name, _UNITS[wanted])[0].strip().lower()
        if any(bare == alias or bare.endswith(f".{alias}") for alias in _ALIASES[wanted]):
            found.append(place)
    return found


def _column(table: CsvTable, name: str) -> int:
    names = table.names or ()
    places = _places(names, name)
    if len(places) != 1:
        found = "is given twice" if places else "is missing"
        got = f"got {listed(names)}" if names else "no line names the columns"
        raise FileError(
            f"{table.path}: line {table.names_line}: column {name} {found}; needed are "
            f"{', '.join(COLUMNS)}, {got}; cells are read as separated {table.form.in_words}"
        )
    return places[0]


def _factor(table: CsvTable, wanted: str, column: int) -> float:
    """Return what a column's numbers are multiplied by to be in the SI unit."""
    known = _UNITS[wanted]
    name = (table.names or ())[column]
    in_name = None if name == wanted else units.split_unit(name, known)[1]
    below = table.unit(column)
    stated = in_name or below
    if not stated:
        return 1.0
    if in_name and below and units.plain(in_name) != units.plain(below):
        raise FileError(
            f"{table.path}: {table.title(column)} is in {in_name!r:.60} by its name and in "
            f"{below!r:.60} by the row of units"
        )
    factor = known.get(units.plain(stated))
    if factor is None:
        raise FileError(
            f"{table.path}: {table.title(column)} is in {stated!r:.60}; accepted are "
            f"{', '.join(known)}"
        )
    if factor != 1.0:
        table.notes.append(f"{table.title(column)} is in {stated}")
    return factor


def _row(table: CsvTable, row: int, columns: Sequence[int]) -> list[float] | None:
    """Return the six numbers of a row in the order of COLUMNS; None of one that is left out."""
    values = []
    for column in columns:
        value = table.number(row, column)
        if value is None:
            return None
        values.append(value)
    for what, part in (("wrench", values[:3]), ("twist", values[3:])):
        if max(map(abs, part)) >= SMALLEST:
            continue
        if table.drop_bad:
            return None
        message = f"is below {SMALLEST:g} in size, too small for a direction"
        if not any(part):
            message = "is zero: it has no direction; --drop-bad leaves such rows out"
        raise FileError(f"{table.path}: line {table.lines[row]}: the {what} {message}")
    return values
