"""Settings of a node: name, default, what is accepted and what it means, in one row each.

ROS-free: `parameters` turns rows into declared parameters with descriptors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from limit_surface_ros.errors import LimitSurfaceError, RangeError

if TYPE_CHECKING:
    from collections.abc import Callable


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
            raise RangeError(f"{self.name} must be {self.constraints}; got {value!r}")
        if self.check is not None:
            try:
                self.check(value)
            except LimitSurfaceError as error:
                raise RangeError(f"{self.name}: {error}") from error
