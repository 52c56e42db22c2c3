# SPDX-License-Identifier: Apache-2.0
"""Units that columns of recordings are given in, and how much of the SI unit each is."""

from __future__ import annotations

import math
import re
from types import MappingProxyType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

_POUND_FORCE, _INCH, _FOOT = 4.4482216152605, 0.0254, 0.3048

TIME = MappingProxyType(
    {
        "s": 1.0,
        "sec": 1.0,
        "second": 1.0,
        "seconds": 1.0,
        "ms": 1e-3,
        "us": 1e-6,
        "ns": 1e-9,
        "min": 60.0,
        "h": 3600.0,
    }
)
FORCE = MappingProxyType(
    {
        "N": 1.0,
        "mN": 1e-3,
        "kN": 1e3,
        "gf": 9.80665e-3,
        "kgf": 9.80665,
        "lbf": _POUND_FORCE,
    }
)
TORQUE = MappingProxyType(
    {
        "Nm": 1.0,
        "Ncm": 1e-2,
        "Nmm": 1e-3,
        "mNm": 1e-3,
        "kNm": 1e3,
        "lbfin": _POUND_FORCE * _INCH,
        "lbfft": _POUND_FORCE * _FOOT,
    }
)
SPEED = MappingProxyType({"m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3, "in/s": _INCH})
TURNING = MappingProxyType(
    {
        "rad/s": 1.0,
        "mrad/s": 1e-3,
        "deg/s": math.pi / 180.0,
        "rpm": math.pi / 30.0,
    }
)
_BRACKETED = re.compile(r"^(?P<name>.*?)\s*[\[(]\s*(?P<unit>[^\[\]()]*?)\s*[\])]$")
_BARE_UNITS = frozenset(
    unit for units in (TIME, FORCE, TORQUE, SPEED, TURNING) for unit in units
) | {"V", "mV", "Volt", "Volts", "A", "K", "degC", "C", "mm", "m", "cm", "um", "rad", "deg", "-"}


def plain(unit: str) -> str:
    """Return a unit without the ways to write a product or a micro: "N·m" and "N m" as "Nm"."""
    text = unit.strip().replace("µ", "u").replace("μ", "u").replace("°", "deg")
    return re.sub(r"[\s*·.]", "", text)


def split_unit(name: str, units: Mapping[str, float]) -> tuple[str, str | None]:
    """Return a column's name and the unit that it states, None where it states none.

    Args:
        name: As "t [ms]", "t (ms)", "t_ms" or "vx_mm_s".
        units: Those that may follow the name without brackets, after an underscore.
    """
    bracketed = _BRACKETED.match(name)
    if bracketed is not None:
        return bracketed["name"], bracketed["unit"]
    for unit in sorted(units, key=len, reverse=True):
        ending = f"_{unit.replace('/', '_')}"
        if name.endswith(ending) and len(name) > len(ending):
            return name.removesuffix(ending), unit
    return name, None


def unit_of_cell(cell: str) -> str | None:
    """Return the unit that a cell of a row of units states, "" of an empty one; None: no unit."""
    text = cell.strip()
    if not text:
        return ""
    bracketed = _BRACKETED.match(text)
    if bracketed is not None and not bracketed["name"]:
        return bracketed["unit"]
    return text if plain(text) in _BARE_UNITS else None
