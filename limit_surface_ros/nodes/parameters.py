# SPDX-License-Identifier: Apache-2.0
"""A table of settings as ROS parameters: described, validated when set, applied afterwards."""

from __future__ import annotations

import difflib
import traceback
from typing import TYPE_CHECKING, Any, Protocol

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import InvalidParameterTypeException
from rclpy.parameter import Parameter

from limit_surface_ros.errors import LimitSurfaceError, RangeError
from limit_surface_ros.nodes import answers

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable

    from rclpy.node import Node

    from limit_surface_ros.nodes.settings import Setting

    # Gets the values as they would be; raises to refuse them, returns what makes them count.
    Prepare = Callable[["Values"], Callable[[], None]]

# Of numbers without an upper bound; a descriptor's range has two ends.
_LARGEST = 1.0e300
_LARGEST_INTEGER = 2**53


class Values(Protocol):
    """Values of parameters by name."""

    def __getitem__(self, name: str, /) -> Any:
        """Return one."""
        ...


class Parameters:
    """The declared parameters of one node.

    A change goes in two steps: everybody concerned prepares it, which may refuse it, and only
    when nobody did, all of it is applied.

    Args:
        node: The node.
        table: Its settings.

    Raises:
        RangeError: A value given at start is not accepted.
        ParameterException: It has the wrong type or lies outside the declared range.
    """

    def __init__(self, node: Node, table: Iterable[Setting]) -> None:
        """Declare the table."""
        self._logger = node.get_logger()
        self._settings = {setting.name: setting for setting in table}
        self._concerned: list[tuple[frozenset[str], Prepare]] = []
        self._applied_next: list[Callable[[], None]] = []
        self._values: dict[str, Any] = {}
        for setting in self._settings.values():
            self._values[setting.name] = _plain(_declared(node, setting))
            setting.verify(self._values[setting.name])
        _warn_of_unknown(node, self._settings)
        node.add_on_set_parameters_callback(self._prepare)
        node.add_post_set_parameters_callback(self._apply)

    def __getitem__(self, name: str) -> Any:
        """Return the present value."""
        return self._values[name]

    def concern(self, names: Collection[str], prepare: Prepare) -> None:
        """Have `prepare` asked before any of `names` changes, and once now.

        Raises:
            LimitSurfaceError: The present values are refused.
        """
        prepare(self._values)()
        self._concerned.append((frozenset(names), prepare))

    def renew(self, names: Collection[str]) -> None:
        """Have the present values prepared and applied anew, all or none of them.

        Args:
            names: The parameters; what they name, such as files, may have changed.

        Raises:
            LimitSurfaceError: One is refused now; nothing is applied.
        """
        steps = [
            prepare(self._values)
            for concerned, prepare in self._concerned
            if not concerned.isdisjoint(names)
        ]
        for step in steps:
            step()

    def _prepare(self, parameters: list[Parameter]) -> SetParametersResult:
        # Other parts of a node (use_sim_time, QoS overrides) have parameters of their own.
        changed = {p.name: _plain(p.value) for p in parameters if p.name in self._settings}
        proposed = {**self._values, **changed}
        try:
            for name, value in changed.items():
                self._settings[name].verify(value)
            apply = [
                prepare(proposed)
                for names, prepare in self._concerned
                if not names.isdisjoint(changed)
            ]
        except Exception as error:
            if not isinstance(error, LimitSurfaceError):
                # A defect; whoever sets the parameter waits for an answer even so.
                self._logger.error("".join(traceback.format_exception(error)))
            return SetParametersResult(successful=False, reason=answers.sentence(error))
        self._applied_next = [lambda: self._values.update(changed), *apply]
        return SetParametersResult(successful=True)

    def _apply(self, parameters: list[Parameter]) -> None:
        apply, self._applied_next = self._applied_next, []
        for step in apply:
            step()


def describe(setting: Setting) -> ParameterDescriptor:
    """Return the descriptor that `ros2 param describe` shows."""
    descriptor = ParameterDescriptor(
        name=setting.name,
        description=setting.description,
        additional_constraints=setting.constraints,
        read_only=setting.read_only,
    )
    if setting.minimum is None and setting.maximum is None:
        return descriptor
    if isinstance(setting.default, float):
        lowest = -_LARGEST if setting.minimum is None else float(setting.minimum)
        highest = _LARGEST if setting.maximum is None else float(setting.maximum)
        descriptor.floating_point_range = [
            FloatingPointRange(from_value=lowest, to_value=highest, step=0.0)
        ]
    else:
        lowest_int = -_LARGEST_INTEGER if setting.minimum is None else int(setting.minimum)
        highest_int = _LARGEST_INTEGER if setting.maximum is None else int(setting.maximum)
        descriptor.integer_range = [
            IntegerRange(from_value=lowest_int, to_value=highest_int, step=1)
        ]
    return descriptor


def _declared(node: Node, setting: Setting) -> Any:
    """Declare one parameter and return its value.

    Raises:
        RangeError: A whole number was given for one with a point, which ROS takes for two types.
        ParameterException: The value has another wrong type or lies outside the range.
    """
    try:
        return _declare(node, setting)
    except InvalidParameterTypeException as error:
        given = node.handle.get_parameters(Parameter).get(setting.name)
        if isinstance(setting.default, float) and given is not None and type(given.value) is int:
            raise RangeError(
                f"{setting.name} must have a decimal point: write {given.value}.0"
            ) from error
        raise


def _declare(node: Node, setting: Setting) -> Any:
    if setting.default != []:
        return node.declare_parameter(setting.name, setting.default, describe(setting)).value
    # rclpy takes an empty list for one of bytes: declare the type, then set the value.
    texts = Parameter.Type.STRING_ARRAY
    declared = node.declare_parameter(setting.name, texts, describe(setting))
    if declared.type_ == Parameter.Type.NOT_SET:
        node.set_parameters([Parameter(setting.name, texts, [])])
    return node.get_parameter(setting.name).value


def _warn_of_unknown(node: Node, known: Iterable[str]) -> None:
    """Warn of values given at start that no parameter takes: most are misspelt."""
    # Parameters of QoS are declared when a topic is.
    given = [name for name in node.handle.get_parameters(Parameter) if "qos_overrides" not in name]
    for name in given:
        if node.has_parameter(name):
            continue
        sentence = f"parameter {name!r} is not known here and is ignored"
        like = difflib.get_close_matches(name, known, n=1, cutoff=0.75)
        meant = f"; did you mean {like[0]!r}?" if like else ""
        node.get_logger().warning(f"{sentence}{meant}")


def _plain(value: Any) -> Any:
    """Return array-valued parameters as lists."""
    return value if isinstance(value, (bool, int, float, str)) else list(value or [])
