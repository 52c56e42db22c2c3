# SPDX-License-Identifier: Apache-2.0
"""Typed access to a mapping of a YAML file: values of the kind asked for, or an error.

A `Section` knows the file and the keys that lead to it, so that each error names the file, the
key, what was found and what is accepted.
"""

from __future__ import annotations

import math
import re
import reprlib
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.checks import LARGEST, as_name
from limit_surface_ros.errors import FileError, LimitSurfaceError, RangeError, shortened

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping
    from pathlib import Path

    from limit_surface_ros.checks import Floats

_REQUIRED: Any = object()
# What a message shows of a value, which may be of any depth and length.
_shown = reprlib.repr
# Numbers that YAML 1.1 takes for texts, as it wants a point and a sign: 1e-3, 2.5e6.
_POWER_OF_TEN = re.compile(r"[-+]?[0-9]+(\.[0-9]*)?[eE][-+]?[0-9]+")
# Texts that begin with a number, and what is the matter with them.
_NOT_QUITE = (
    (re.compile(r"[-+]?[0-9]+,[0-9]+"), "write it with a decimal point"),
    (
        re.compile(r"[-+.0-9]*[0-9][-+.0-9eE]*\s*[^\W\d]+.*", re.DOTALL),
        "write the number alone: lengths are metres, forces newtons, angles radians",
    ),
)


class Section:
    """A mapping in a YAML file: typed access to its keys, errors that say where.

    Args:
        path: The file, for errors.
        values: The mapping.
        prefix: Keys of the enclosing sections, joined by dots.
    """

    def __init__(self, path: Path, values: Mapping[str, Any], prefix: str = "") -> None:
        """Start with none of the keys asked for."""
        self.path = path
        self.values = values
        self._prefix = prefix
        self._known: list[str] = []

    def __contains__(self, key: str) -> bool:
        """Tell whether the key is given and not null."""
        return self.values.get(key) is not None

    def error(self, key: str, message: str) -> FileError:
        """Return the error that places `message` at `key` of this file."""
        return FileError(f"{self.path}: {shortened(self._prefix + key)}: {message}")

    def _get(self, key: str, default: Any, accepted: str = "") -> Any:
        """Return a value, or the default; `accepted` says in words what is, for the error."""
        self._known.append(key)
        value = self.values.get(key)
        if value is not None:
            return value
        if default is _REQUIRED:
            raise self.error(key, f"missing; it must be {accepted}" if accepted else "missing")
        return default

    def text(self, key: str, default: Any = _REQUIRED) -> Any:
        """Return a text that is not empty, or the default as it is."""
        accepted = "a text that is not empty"
        value = self._get(key, default, accepted)
        if value is default:
            return default
        if not isinstance(value, str) or not value.strip():
            raise self.error(key, f"must be {accepted}, got {_shown(value)}")
        return value

    def name(self, key: str, default: Any = _REQUIRED) -> Any:
        """Return a text that can name something (`checks.as_name`), or the default as it is."""
        value = self.text(key, default)
        if value is not default:
            try:
                as_name(key, value)
            except RangeError as error:
                raise self.error(key, str(error).removeprefix(f"{key} ")) from None
        return value

    def choice(self, key: str, accepted: Collection[Any], default: Any = _REQUIRED) -> Any:
        """Return one of the accepted values."""
        listed = f"one of {', '.join(str(option) for option in accepted)}"
        value = self._get(key, default, listed)
        # True == 1 in Python, but a schema of `true` is a mistake.
        if value not in accepted or isinstance(value, bool):
            raise self.error(key, f"must be {listed}; got {_shown(value)}")
        return value

    def number(
        self,
        key: str,
        default: Any = _REQUIRED,
        *,
        above: float = -math.inf,
        at_least: float = -math.inf,
        at_most: float = math.inf,
    ) -> Any:
        """Return a finite float within the bounds, or the default as it is."""
        bounds = [f"above {above}"] * (above > -math.inf)
        bounds += [f"at least {at_least}"] * (at_least > -math.inf)
        bounds += [f"at most {at_most}"] * (at_most < math.inf)
        accepted = " and ".join(bounds)
        value = self._get(key, default, f"a number {accepted}".rstrip())
        if value is default:
            return default
        number = self._finite(key, value)
        if not (number > above and at_least <= number <= at_most):
            raise self.error(key, f"must be {accepted}, got {number}")
        return number

    def integer(
        self,
        key: str,
        default: Any = _REQUIRED,
        *,
        at_least: int = 0,
        at_most: int | None = None,
    ) -> Any:
        """Return a whole number within the bounds, or the default as it is."""
        accepted = f"a whole number from {at_least} {'on' if at_most is None else f'to {at_most}'}"
        value = self._get(key, default, accepted)
        if value is default:
            return default
        if isinstance(value, str) and _POWER_OF_TEN.fullmatch(value):
            number = float(value)
            value = int(number) if number.is_integer() else value
        whole = isinstance(value, int) and not isinstance(value, bool)
        if not whole or value < at_least or (at_most is not None and value > at_most):
            raise self.error(key, f"must be {accepted}, got {_shown(value)}")
        return value

    def array(
        self,
        key: str,
        shape: tuple[int | None, ...],
        default: Any = _REQUIRED,
        *,
        at_least: float = -math.inf,
    ) -> Any:
        """Return a float64 array of that shape; None stands for any length above zero.

        Raises:
            FileError: The key is missing, no array of finite numbers, of another shape, or a
                number is below `at_least`; the message gives its place.
        """
        wanted = " x ".join("n" if length is None else str(length) for length in shape)
        value = self._get(key, default, f"an array of {wanted} numbers")
        if value is default:
            return default
        array = self._nested_floats(key, value, len(shape) + 1)
        fits = array.ndim == len(shape) and all(
            given > 0 if length is None else given == length
            for given, length in zip(array.shape, shape, strict=True)
        )
        if not fits:
            given = " x ".join(map(str, array.shape)) or "a single number"
            raise self.error(key, f"must be an array of {wanted} numbers, got {given}")
        for place in np.argwhere(array < at_least)[:1].tolist():
            index = "".join(f"[{i}]" for i in place)
            raise self.error(
                f"{key}{index}", f"must be at least {at_least}, got {array[tuple(place)]}"
            )
        return array

    def section(self, key: str, default: Any = _REQUIRED) -> Section:
        """Return the mapping under a key."""
        accepted = "a mapping of keys to values"
        value = self._get(key, default, accepted)
        if not isinstance(value, dict):
            raise self.error(key, f"must be {accepted}, got {_shown(value)}")
        return Section(self.path, value, f"{self._prefix}{key}.")

    def sections(self, key: str) -> list[Section]:
        """Return the mappings in the list under a key."""
        accepted = "a list of mappings"
        value = self._get(key, _REQUIRED, accepted)
        if not isinstance(value, list) or not value:
            raise self.error(key, f"must be {accepted}, got {_shown(value)}")
        for i, item in enumerate(value):
            if not isinstance(item, dict):
                raise self.error(f"{key}[{i}]", f"must be a mapping, got {_shown(item)}")
        return [
            Section(self.path, item, f"{self._prefix}{key}[{i}].") for i, item in enumerate(value)
        ]

    def raw(self, key: str, default: Any = _REQUIRED) -> Any:
        """Return what stands under a key, whatever it is."""
        return self._get(key, default)

    def finish(self) -> None:
        """Refuse keys that nobody asked for: most are misspelt.

        Raises:
            FileError: A key is unknown; the error lists those that are accepted here.
        """
        unknown = [key for key in self.values if key not in self._known]
        if unknown:
            accepted = ", ".join(dict.fromkeys(self._known))
            raise self.error(str(unknown[0]), f"is not known here; accepted are {accepted}")

    def _nested_floats(self, key: str, value: Any, levels: int) -> Floats:
        """Return nested lists of numbers as an array; deeper than `levels` they are no numbers."""
        if levels and isinstance(value, list):
            parts = [
                self._nested_floats(f"{key}[{i}]", item, levels - 1)
                for i, item in enumerate(value)
            ]
            if len({part.shape for part in parts}) > 1:
                raise self.error(key, "its rows must have one length")
            return np.array(parts)
        return np.array(self._finite(key, value))

    def _finite(self, key: str, value: Any) -> float:
        if isinstance(value, str):
            value = self._number_of(key, value)
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.error(key, f"must be a number, got {_shown(value)}")
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise self.error(key, f"must be finite, got {_shown(value)}")
        if abs(number) > LARGEST:
            raise self.error(key, f"must be at most {LARGEST:g} in size, got {_shown(value)}")
        return number

    def _number_of(self, key: str, text: str) -> float:
        """Return the number that a text is but for YAML 1.1; refuse others with their cause."""
        if _POWER_OF_TEN.fullmatch(text):
            return float(text)
        try:
            number = float(text)
        except ValueError:
            hint = next((hint for form, hint in _NOT_QUITE if form.fullmatch(text)), "")
            message = f"must be a number, got {_shown(text)}" + (f"; {hint}" if hint else "")
            raise self.error(key, message) from None
        raise self.error(key, f"{_shown(text)} is text; write it as the number {number!r}")


def place_errors(section: Section, key: str, build: Callable[[], Any]) -> Any:
    """Call `build` and turn the package's errors into one that names file and key."""
    try:
        return build()
    except FileError:
        raise
    except LimitSurfaceError as error:
        raise section.error(key, str(error)) from error
