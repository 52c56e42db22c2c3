# SPDX-License-Identifier: Apache-2.0
"""YAML files to checked values, and back: the one reader and writer of all model files.

A `Section` is a mapping of a YAML file that knows where it stands, so that each error names the
file, the key, what was found and what is accepted. PyYAML reads `1e-3` as text and accepts `.nan`;
both are caught here.
"""

from __future__ import annotations

import math
import reprlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

from limit_surface_ros.checks import LARGEST
from limit_surface_ros.errors import FileError, LimitSurfaceError
from limit_surface_ros.files.atomic_write import write_atomically
from limit_surface_ros.files.regular_file import read_text

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping

    from limit_surface_ros.checks import Floats

# How the names of YAML files may end, in small letters.
YAML_SUFFIXES = (".yaml", ".yml")
# No model is larger: a matrix takes some 200 bytes.
MAX_BYTES = 16 * 2**20
MAX_DEPTH = 100
_TOO_DEEP = f"is nested deeper than {MAX_DEPTH} levels"
# Characters up to which a text cannot be nested deep enough to do harm.
SHALLOW_LENGTH = 10_000

_REQUIRED: Any = object()
# What a message shows of a value, which may be of any depth and length.
_shown = reprlib.repr
# libyaml reads about ten times as fast and is there on every common platform.
_SafeLoader: type[yaml.SafeLoader] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class _Loader(_SafeLoader):  # type: ignore[misc, valid-type]
    """PyYAML's safe loader, but a key given twice is an error and not a silent loss."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Build a mapping and refuse duplicate keys."""
        keys = [self.construct_object(key, deep=True) for key, _ in node.value]
        for i, key in enumerate(keys):
            if key in keys[:i]:
                raise yaml.MarkedYAMLError(
                    problem=f"key {key!r} is given twice", problem_mark=node.value[i][0].start_mark
                )
        mapping: dict[Any, Any] = super().construct_mapping(node, deep)
        return mapping

    def construct_decimal(self, node: yaml.ScalarNode) -> float:
        """Build a number; refuse 1:30 and 010, of base 60 and 8 in YAML 1.1."""
        whole = node.tag.endswith(":int")
        digits = node.value.lstrip("+-")
        octal = whole and digits[0] == "0" and digits[1:2].isdigit()
        if octal or ":" in digits:
            base = 8 if octal else 60
            raise yaml.MarkedYAMLError(
                problem=f"{node.value} is of base {base} in YAML 1.1; write a decimal number, "
                "or a text in quotes",
                problem_mark=node.start_mark,
            )
        number: float = (self.construct_yaml_int if whole else self.construct_yaml_float)(node)
        return number


for _kind in ("int", "float"):
    _Loader.add_constructor(f"tag:yaml.org,2002:{_kind}", _Loader.construct_decimal)


class _Dumper(yaml.SafeDumper):
    """PyYAML's safe dumper, but a row of scalars stands on one line and mappings never do."""


def _represent_list(dumper: yaml.SafeDumper, values: list[Any]) -> yaml.Node:
    row = not any(isinstance(value, (list, dict)) for value in values)
    return dumper.represent_sequence("tag:yaml.org,2002:seq", values, flow_style=row)


_Dumper.add_representer(list, _represent_list)


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
        return FileError(f"{self.path}: {self._prefix}{key}: {message}")

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
            accepted = ", ".join(self._known)
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
            try:
                number = float(value)
            except ValueError:
                pass
            else:
                raise self.error(
                    key, f"{value!r} is text in YAML 1.1; write it as the number {number!r}"
                )
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.error(key, f"must be a number, got {_shown(value)}")
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise self.error(key, f"must be finite, got {value}")
        if abs(number) > LARGEST:
            raise self.error(key, f"must be at most {LARGEST:g} in size, got {value}")
        return number


def _check_depth(text: str) -> None:
    """Refuse what is nested so deep that building it would overflow the C stack of libyaml."""
    depth = 0
    for event in yaml.parse(text, Loader=_SafeLoader):
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
            if depth > MAX_DEPTH:
                raise yaml.MarkedYAMLError(problem=_TOO_DEEP)
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1


def _told(error: yaml.MarkedYAMLError) -> str:
    """Return what is wrong and where."""
    # libyaml has a limit of its own since PyYAML 6.0.4, and may meet it first: it looks ahead.
    if "nesting depth" in str(error.problem):
        return _TOO_DEEP
    mark = error.problem_mark
    where = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
    return f"{where}{error.problem or error}"


def read_yaml(path: str | Path) -> Section:
    """Read a YAML file whose top level is a mapping.

    Raises:
        FileError: The file is absent, unreadable, no YAML, or no mapping.
    """
    path = Path(path)
    text = read_text(path, MAX_BYTES)
    try:
        if len(text) > SHALLOW_LENGTH:
            _check_depth(text)
        # _Loader is a safe loader: it builds plain Python values only.
        values = yaml.load(text, Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        raise FileError(f"{path}: {_told(error)}") from None
    except (yaml.YAMLError, ValueError) as error:
        raise FileError(f"{path}: is not YAML: {error}") from None
    except (LookupError, AttributeError, TypeError):
        # PyYAML builds what a tag names without a look at what stands there.
        raise FileError(
            f"{path}: a tag such as !!bool stands before what is none; accepted are values "
            "without tags"
        ) from None
    if not isinstance(values, dict):
        kind = "is empty" if values is None else f"holds {type(values).__name__} at its top level"
        raise FileError(f"{path}: {kind}; a mapping of keys to values is accepted")
    return Section(path, values)


def place_errors(section: Section, key: str, build: Callable[[], Any]) -> Any:
    """Call `build` and turn the package's errors into one that names file and key."""
    try:
        return build()
    except FileError:
        raise
    except LimitSurfaceError as error:
        raise section.error(key, str(error)) from error


def plain(value: Any) -> Any:
    """Return `value` with numpy arrays, numpy numbers and tuples as plain lists and numbers."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    return value


def write_yaml(path: str | Path, values: Mapping[str, Any], header: str = "") -> None:
    """Write a mapping to a YAML file, atomically; floats come back bit for bit.

    Args:
        path: The file, in a folder that exists.
        values: Keys in the order in which they are written; numpy arrays are welcome.
        header: Lines of a comment at the top, without the `#`.

    Raises:
        FileError: The file cannot be written.
    """
    comment = "".join(f"# {line}".rstrip() + "\n" for line in header.splitlines())
    body = yaml.dump(
        plain(dict(values)),
        Dumper=_Dumper,
        sort_keys=False,
        default_flow_style=False,
        width=99,
        allow_unicode=True,
    )
    write_atomically(path, comment + body)
