# SPDX-License-Identifier: Apache-2.0
"""Module texts: templates that come with the package, filled with numbers bit by bit."""

from __future__ import annotations

import re
from importlib.resources import files
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from limit_surface_ros.checks import Floats


def template(name: str) -> str:
    """Return the text of a template of this package."""
    return (files("limit_surface_ros.export") / "templates" / name).read_text(encoding="utf-8")


def filled(name: str, values: Mapping[str, str]) -> str:
    """Return a template with each @KEY@ replaced; a key that is left over is a defect."""
    text = template(name)
    for key, value in values.items():
        text = text.replace(f"@{key}@", value)
    left = re.search(r"@[A-Z_]+@", text)
    if left:
        raise KeyError(f"template {name} has no value for {left[0]}")
    return text


def identifier(name: str) -> str:
    """Return a name as C++, Python and JavaScript take it: letters, digits and underscores."""
    cleaned = re.sub(r"\W", "_", name, flags=re.ASCII) or "surface"
    return f"_{cleaned}" if cleaned[0].isdigit() else cleaned


def nested(array: Floats, opening: str = "[", closing: str = "]") -> str:
    """Return an array as nested brackets of numbers that read back to the same bits."""
    if array.ndim == 0:
        return repr(float(array))
    inner = ", ".join(nested(each, opening, closing) for each in array)
    return f"{opening}{inner}{closing}"
