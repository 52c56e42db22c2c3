# SPDX-License-Identifier: Apache-2.0
"""Settings of a node: name, default, what is accepted and what it means, in one row each.

ROS-free: `parameters` turns rows into declared parameters with descriptors.
"""

from __future__ import annotations

import math
import textwrap
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from limit_surface_ros.errors import LimitSurfaceError, RangeError, shortened

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable


@dataclass(frozen=True)
class Setting:
    """One row of a node's parameter table.

    Attributes:
        name: Name of the parameter.
        default: Default value; its type is the parameter's. An empty list is one of texts.
        description: What it means, with its unit in [brackets].
        minimum: Smallest number that is accepted.
        maximum: Largest number that is accepted.
        choices: Texts that are accepted; empty: any.
        read_only: Whether it can be set at start only.
        check: Raises one of the package's errors if a value of the right type is not accepted.
    """

    name: str
    default: Any
    description: str
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()
    read_only: bool = False
    check: Callable[[Any], object] | None = None

    @property
    def constraints(self) -> str:
        """What is accepted beyond a range, for people."""
        return f"one of {', '.join(self.choices)}" if self.choices else ""

    @property
    def accepted(self) -> str:
        """What is accepted, for people; empty: anything of the default's type."""
        lowest = "" if self.minimum is None else f"from {self.minimum:g}"
        highest = "" if self.maximum is None else f"to {self.maximum:g}"
        at_start = "at start only" if self.read_only else ""
        span = " ".join(part for part in (lowest, highest) if part)
        return "; ".join(part for part in (span, self.constraints, at_start) if part)

    @property
    def written(self) -> str:
        """The default as it is written on a command line."""
        texts = self.default if isinstance(self.default, list) else None
        if texts is not None:
            return "[" + ", ".join(f"'{text}'" for text in texts) + "]"
        if isinstance(self.default, bool):
            return str(self.default).lower()
        return str(self.default) or "''"

    def verify(self, value: Any) -> None:
        """Check a value.

        Raises:
            RangeError: The value, or a number in it, is not accepted; the error names the setting.
        """
        for number in value if isinstance(value, (list, tuple)) else [value]:
            if isinstance(number, float) and not math.isfinite(number):
                raise RangeError(f"{self.name} must be finite, got {number}")
            if self.minimum is not None and number < self.minimum:
                raise RangeError(f"{self.name} must be at least {self.minimum}, got {number}")
            if self.maximum is not None and number > self.maximum:
                raise RangeError(f"{self.name} must be at most {self.maximum}, got {number}")
        if self.choices and value not in self.choices:
            raise RangeError(
                f"{self.name} must be {self.constraints}; got {shortened(repr(value))}"
            )
        if self.check is not None:
            try:
                self.check(value)
            except LimitSurfaceError as error:
                raise RangeError(f"{self.name}: {error}") from error


def help_of(node: str, table: Iterable[Setting]) -> str:
    """Return a node's parameters for `--help`: name, default, meaning and what is accepted."""
    lines = [f"parameters of {node}, with their defaults:"]
    for setting in table:
        lines.append(f"  {setting.name} := {setting.written}")
        accepted = f" ({setting.accepted})" if setting.accepted else ""
        meaning = f"{setting.description}{accepted}"
        lines += textwrap.wrap(
            meaning, 92, initial_indent=" " * 6, subsequent_indent=" " * 6, break_on_hyphens=False
        )
    return "\n".join(lines)
