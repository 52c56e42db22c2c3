# SPDX-License-Identifier: Apache-2.0
"""Module texts: templates that come with the package, filled with numbers bit by bit."""

from __future__ import annotations

import re
from importlib.resources import files
from typing import TYPE_CHECKING

from limit_surface_ros.errors import shortened

if TYPE_CHECKING:
    from collections.abc import Mapping

    from limit_surface_ros.checks import Floats


# Characters that mean something to one of the targets within a comment or a docstring.
_SPEAKING = "\\\"'*<>"
_LONGEST_COMMENT = 300


def template(name: str) -> str:
    """Return the text of a template of this package."""
    return (files("limit_surface_ros.export") / "templates" / name).read_text(encoding="utf-8")


def filled(name: str, values: Mapping[str, str]) -> str:
    """Return a template with each @KEY@ replaced; a key that is left over is a defect."""

    def value(key: re.Match[str]) -> str:
        if key[1] not in values:
            raise KeyError(f"template {name} has no value for {key[0]}")
        return values[key[1]]

    # In one pass: what a value holds is no key.
    return re.sub(r"@([A-Z_]+)@", value, template(name))


def comment(text: str) -> str:
    """Return a text that no comment or docstring of any target ends or continues at."""
    return "".join(
        character if character.isprintable() and character not in _SPEAKING else "_"
        for character in shortened(text, _LONGEST_COMMENT)
    )


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
