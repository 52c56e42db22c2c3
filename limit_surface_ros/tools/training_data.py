"""What a program fits or compares surfaces on: pairs, and what is known about them."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from limit_surface_ros.errors import DataError, FileError
from limit_surface_ros.files.pushes_csv import read_pushes

if TYPE_CHECKING:
    from collections.abc import Mapping

    from limit_surface_ros.surface.pairs import Pairs
    from limit_surface_ros.surface.protocol import LimitSurface

SUFFIXES = (".yaml", ".yml", ".csv")
ACCEPTED = "a contact file (.yaml, .yml) or recorded pushes (.csv)"


@dataclass(frozen=True)
class TrainingData:
    """Pairs to fit, pairs held out, and where they came from.

    Attributes:
        training: What the fit sees.
        held_out: What it does not, if there is any.
        characteristic_length: [m], if the source states it.
        exact: The surface that made the pairs, if they are simulated.
        prior: The surface of support points that the source states, if it does.
        normal_force: [N], if the source states it.
        about: For the model file.
    """

    training: Pairs
    held_out: Pairs | None = None
    characteristic_length: float | None = None
    exact: LimitSurface | None = None
    prior: LimitSurface | None = None
    normal_force: float | None = None
    about: Mapping[str, Any] = field(default_factory=dict)


def row_numbers(text: str) -> list[int]:
    """Read row numbers and ranges, such as "0,3,10-14".

    Raises:
        DataError: The text is no such list, or names a row twice.
    """
    numbers: list[int] = []
    for part in text.split(","):
        first, dash, last = part.strip().partition("-")
        try:
            numbers.extend(range(int(first), int(last if dash else first) + 1))
        except ValueError:
            raise DataError(f"rows must be like 0,3,10-14; got {text!r}") from None
    if len(set(numbers)) != len(numbers) or not numbers:
        raise DataError(f"rows must name at least one row, and each once; got {text!r}")
    return numbers


def training_data_of_pushes(path: Path, rows: list[int] | None) -> TrainingData:
    """Read recorded pushes; the rows that are not selected are held out.

    The first line's `rho_m` [m] gives the characteristic length where it stands.
    """
    pushes = read_pushes(path)
    training = pushes.pairs if rows is None else pushes.rows(rows)
    others = len(pushes.pairs) - len(training)
    return TrainingData(
        training=training,
        held_out=pushes.rest(rows) if rows is not None and others else None,
        characteristic_length=pushes.number("rho_m"),
        normal_force=pushes.number("normal_force_N"),
        about={"data": path.name, "rows": "all" if rows is None else rows},
    )


def check_input(path: Path) -> str:
    """Return the suffix of an input that exists.

    Raises:
        FileError: There is no such file.
    """
    if not path.exists():
        raise FileError(f"{path}: there is no such file; accepted is {ACCEPTED}")
    return path.suffix.lower()
