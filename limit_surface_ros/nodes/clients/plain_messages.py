# SPDX-License-Identifier: Apache-2.0
"""Messages of any type to plain values and back, as `ros2` does it, where there is no `ros2`."""

from __future__ import annotations

import importlib
import re
from array import array
from typing import TYPE_CHECKING, Any

import yaml

from limit_surface_ros.errors import RangeError, shortened

if TYPE_CHECKING:
    from collections.abc import Mapping

# Numbers of an array that are shown: as many as a covariance has.
_SHOWN = 36


def type_of(name: str) -> Any:
    """Return the class of an interface, such as geometry_msgs/msg/Wrench.

    Raises:
        RangeError: Its package is not installed here.
    """
    package, kind, item = name.split("/")
    try:
        return getattr(importlib.import_module(f"{package}.{kind}"), item)
    except (ImportError, AttributeError):
        raise RangeError(f"{name} is not installed here") from None


def fill(message: Any, values: Mapping[str, Any]) -> None:
    """Set the fields of a message that a mapping names.

    Raises:
        RangeError: There is no such field, or a value is not of its sort.
    """
    fields = message.get_fields_and_field_types()
    if not isinstance(values, dict):
        raise RangeError(f"fields are a mapping such as {{{next(iter(fields), 'x')}: ...}}")
    for name, value in values.items():
        if name not in fields:
            raise RangeError(
                f"{type(message).__name__} has no field {shortened(str(name))}; it has "
                f"{', '.join(fields) or 'none'}"
            )
        current = getattr(message, name)
        if hasattr(current, "get_fields_and_field_types"):
            fill(current, value)
            continue
        try:
            setattr(message, name, _converted(current, value, fields[name]))
        except RangeError:
            raise
        except (AssertionError, TypeError, ValueError, OverflowError):
            raise RangeError(
                f"{name} must be of the type {fields[name]}, got {shortened(repr(value))}"
            ) from None


def _converted(current: Any, value: Any, kind: str) -> Any:
    """Return a value as what stands in a field now: what is wrong in a message ends a program."""
    if isinstance(current, array):
        return array(current.typecode, value)
    if isinstance(current, list) and isinstance(value, list):
        element = re.match(r"sequence<(\w+)/(\w+)", kind)
        if element:
            return [_filled("{}/msg/{}".format(*element.groups()), each) for each in value]
        if not all(isinstance(each, str) for each in value):
            raise TypeError
        return value
    if isinstance(current, float) and type(value) is int:
        return float(value)
    if type(value) is not type(current):
        raise TypeError
    if type(value) is int:
        bits = int(kind.lstrip("uint") or 8)
        lowest = 0 if kind.startswith(("u", "b", "o")) else -(2 ** (bits - 1))
        if not lowest <= value < lowest + 2**bits:
            raise OverflowError
    return value


def _filled(name: str, values: Mapping[str, Any]) -> Any:
    """Return a message of a type, with the fields set that a mapping names."""
    message = type_of(name)()
    fill(message, values)
    return message


def plain(message: Any) -> Any:
    """Return a message as mappings, lists, texts and numbers; of a long array a part."""
    if hasattr(message, "get_fields_and_field_types"):
        return {
            name: plain(getattr(message, name)) for name in message.get_fields_and_field_types()
        }
    if isinstance(message, (str, bool, int)):
        return message
    if isinstance(message, float):
        return float(f"{message:.7g}")
    if isinstance(message, bytes) and len(message) == 1:
        return message[0]
    values = [plain(each) for each in message[:_SHOWN]]
    if len(message) > _SHOWN:
        values.append(f"... {len(message)} in all")
    return values


def text_of(message: Any) -> str:
    """Return a message as YAML, texts of several lines as such."""
    return str(
        yaml.dump(plain(message), Dumper=_Readable, sort_keys=False, default_flow_style=None)
    ).rstrip()


class _Readable(yaml.SafeDumper):
    """Writes texts of several lines line by line."""


def _text(dumper: _Readable, text: str) -> yaml.ScalarNode:
    """Represent a text."""
    return dumper.represent_scalar(
        "tag:yaml.org,2002:str", text, style="|" if "\n" in text else None
    )


_Readable.add_representer(str, _text)
