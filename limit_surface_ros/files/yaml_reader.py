# SPDX-License-Identifier: Apache-2.0
"""YAML files to mappings, and back: the one reader and writer of all model files.

What a file holds may be there by accident or on purpose: it is looked at before anything is built,
so that neither depth nor aliases nor keys cost more than the file is long.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

from limit_surface_ros.errors import FileError, shortened
from limit_surface_ros.files.atomic_write import write_atomically
from limit_surface_ros.files.regular_file import read_text
from limit_surface_ros.files.section import Section

if TYPE_CHECKING:
    from collections.abc import Hashable, Mapping

# How the names of YAML files may end, in small letters.
YAML_SUFFIXES = (".yaml", ".yml")
# No model is larger: a matrix takes some 200 bytes.
MAX_BYTES = 16 * 2**20
MAX_DEPTH = 100
# Values that all aliases of a file may stand for together.
MAX_REPEATED = 1_000_000
# Digits of a whole number: Python itself reads a longer one in quadratic time.
MAX_DIGITS = 1000
_TOO_DEEP = f"is nested deeper than {MAX_DEPTH} levels"

# libyaml reads about ten times as fast and is there on every common platform.
_SafeLoader: type[yaml.SafeLoader] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def _refusal(part: Any, problem: str) -> yaml.MarkedYAMLError:
    """Return the error that places a problem where an event or a node of a text begins."""
    return yaml.MarkedYAMLError(problem=problem, problem_mark=part.start_mark)


class _Loader(_SafeLoader):  # type: ignore[misc, valid-type]
    """PyYAML's safe loader, but a key given twice is an error and not a silent loss."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Build a mapping and refuse duplicate keys."""
        seen: set[Hashable] = set()
        for place, _ in node.value:
            key = self.construct_object(place, deep=True)
            problem = ""
            if isinstance(key, (list, dict, set)):
                problem = "a key must be a text"
            elif isinstance(key, int) and abs(key) >= 2**63:
                # Such numbers can be chosen so that a dictionary of them is built in hours.
                problem = "a key must be a text, and not a number of that size"
            elif key in seen:
                problem = f"key {shortened(repr(key))} is given twice"
            if problem:
                raise _refusal(place, problem)
            seen.add(key)
        mapping: dict[Any, Any] = super().construct_mapping(node, deep)
        return mapping

    def construct_decimal(self, node: yaml.ScalarNode) -> float:
        """Build a number; refuse 1:30 and 010, of base 60 and 8 in YAML 1.1."""
        whole = node.tag.endswith(":int")
        digits = node.value.lstrip("+-")
        if len(digits) > MAX_DIGITS:
            raise _refusal(
                node, f"a number of {len(digits)} digits; at most {MAX_DIGITS} are read"
            )
        octal = whole and digits[0] == "0" and digits[1:2].isdigit()
        if octal or ":" in digits:
            base = 8 if octal else 60
            raise _refusal(
                node,
                f"{node.value} is of base {base} in YAML 1.1; write a decimal number, or a text "
                "in quotes",
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


class _Open:
    """A list or mapping of a text that has begun and not ended yet."""

    def __init__(self, anchor: str | None) -> None:
        """Start with no value in it."""
        self.anchor = anchor
        self.values = 1


def _check_structure(text: str) -> None:
    """Refuse what would overflow the stack, refer to itself, or grow as it is built."""
    opened = [_Open(None)]
    sizes: dict[str, int] = {}
    repeated = 0
    for event in yaml.parse(text, Loader=_SafeLoader):
        if isinstance(event, yaml.CollectionStartEvent):
            opened.append(_Open(event.anchor))
            if len(opened) > MAX_DEPTH + 1:
                raise yaml.MarkedYAMLError(problem=_TOO_DEEP)
        elif isinstance(event, yaml.CollectionEndEvent):
            ended = opened.pop()
            opened[-1].values += ended.values
            if ended.anchor:
                sizes[ended.anchor] = ended.values
        elif isinstance(event, yaml.AliasEvent):
            name = str(event.anchor)
            if any(each.anchor == name for each in opened):
                raise _refusal(event, f"*{shortened(name)} refers to what it is a part of")
            # Of an anchor that is not there the reader tells.
            size = sizes.get(name, 1)
            opened[-1].values += size
            repeated += size
            if repeated > MAX_REPEATED:
                raise _refusal(event, f"aliases stand for more than {MAX_REPEATED} values")
        elif isinstance(event, yaml.ScalarEvent):
            opened[-1].values += 1


def _told(error: yaml.MarkedYAMLError, text: str) -> str:
    """Return what is wrong and where."""
    # libyaml has a limit of its own since PyYAML 6.0.4, and may meet it first: it looks ahead.
    if "nesting depth" in str(error.problem):
        return _TOO_DEEP
    mark = error.problem_mark
    if mark is None:
        return str(error.problem or error)
    line = text.splitlines()[mark.line : mark.line + 1]
    tab = bool(line) and line[0][mark.column : mark.column + 1] == "\t"
    hint = "; a tab stands there, and YAML wants spaces" if tab else ""
    return f"line {mark.line + 1}, column {mark.column + 1}: {error.problem or error}{hint}"


def read_yaml(path: str | Path) -> Section:
    """Read a YAML file whose top level is a mapping.

    Raises:
        FileError: The file is absent, unreadable, no YAML, or no mapping.
    """
    path = Path(path)
    text = read_text(path, MAX_BYTES)
    try:
        _check_structure(text)
        # _Loader is a safe loader: it builds plain Python values only.
        values = yaml.load(text, Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        raise FileError(f"{path}: {_told(error, text)}") from None
    except RecursionError:
        raise FileError(f"{path}: {_TOO_DEEP}") from None
    except (yaml.YAMLError, ValueError, ArithmeticError) as error:
        raise FileError(f"{path}: is not YAML: {shortened(str(error))}") from None
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
