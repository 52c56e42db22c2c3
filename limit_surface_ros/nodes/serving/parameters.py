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

from limit_surface_ros.errors import LimitSurfaceError, RangeError, UnavailableError, shortened
from limit_surface_ros.nodes.serving import answers
from limit_surface_ros.nodes.serving.settings import Setting

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable

    from rcl_interfaces.msg import Parameter as ParameterMessage
    from rcl_interfaces.srv import SetParameters, SetParametersAtomically
    from rclpy.node import Node

    # Gets the values as they would be; raises to refuse them, returns what makes them count.
    Prepare = Callable[["Values"], Callable[[], None]]

LOCKED = "locked"
SETTINGS = (
    Setting(
        LOCKED,
        False,
        "Whether the node refuses every change of a parameter and ~/reload",
        read_only=True,
    ),
)
_LOCKED_MESSAGE = (
    f"this node is locked: it was started with {LOCKED}:=true and takes no changes and no reload"
)
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

    A change goes in two steps: all who depend on it prepare it, which may refuse it, and only when
    nobody did, all of it is applied. Parameters that are prepared together may come in one request
    in any order, as from `ros2 param load`: they are set at once.

    Attributes:
        version: Another number after each change.

    Args:
        node: The node.
        table: Its settings, which include `SETTINGS`.

    Raises:
        RangeError: A value given at start is not accepted.
        ParameterException: It has the wrong type or lies outside the declared range.
    """

    def __init__(self, node: Node, table: Iterable[Setting]) -> None:
        """Declare the table."""
        self._node = node
        self._logger = node.get_logger()
        self._settings = {setting.name: setting for setting in table}
        self._dependents: list[tuple[frozenset[str], Prepare]] = []
        self._sets: list[frozenset[str]] = []
        self._applied_next: list[Callable[[], None]] = []
        self._values: dict[str, Any] = {}
        self.version = 0
        for setting in self._settings.values():
            self._values[setting.name] = _plain(_declared(node, setting))
            setting.verify(self._values[setting.name])
        _warn_of_unknown(node, self._settings)
        self._locked = bool(self._values[LOCKED])
        # Values of another type than the parameter's: rclpy would refuse them in its own words.
        self._mistyped: dict[str, Any] = {}
        node.add_pre_set_parameters_callback(self._fit_types)
        node.add_on_set_parameters_callback(self._prepare)
        node.add_post_set_parameters_callback(self._apply)
        for service in node.services:
            if service.service_name.endswith("/set_parameters"):
                service.callback = self._set
            elif service.service_name.endswith("/set_parameters_atomically"):
                service.callback = self._set_atomically

    def __getitem__(self, name: str) -> Any:
        """Return the present value."""
        return self._values[name]

    def on_change(
        self, names: Collection[str], prepare: Prepare, *, as_a_set: bool = False
    ) -> None:
        """Have `prepare` asked before any of `names` changes, and once now.

        Args:
            names: The parameters.
            prepare: Gets the values as they would be; raises to refuse them, returns what makes
                them count.
            as_a_set: Whether those of them that come in one request are set at once.

        Raises:
            LimitSurfaceError: The present values are refused.
        """
        prepare(self._values)()
        self._dependents.append((frozenset(names), prepare))
        if as_a_set:
            self._sets.append(frozenset(names))

    def reapply(self, names: Collection[str]) -> Callable[[], None]:
        """Have the present values prepared anew; may be called in a thread of its own.

        Args:
            names: The parameters; what they name, such as files, may have changed.

        Returns:
            What makes all of them count.

        Raises:
            LimitSurfaceError: One is refused now.
            UnavailableError: The node is locked.
        """
        if self._locked:
            raise UnavailableError(_LOCKED_MESSAGE)
        steps = [
            prepare(dict(self._values))
            for dependent, prepare in self._dependents
            if not dependent.isdisjoint(names)
        ]

        def apply() -> None:
            for step in steps:
                step()

        return apply

    def _set(
        self, request: SetParameters.Request, response: SetParameters.Response
    ) -> SetParameters.Response:
        """Set parameters one by one, but those that depend on each other at once."""
        results: dict[int, SetParametersResult] = {}
        together: dict[str | frozenset[str], list[tuple[int, Parameter]]] = {}
        # Whom somebody may have meant is looked for where few are asked for: it takes a while.
        known = self._settings if len(request.parameters) <= len(self._settings) else ()
        for place, message in enumerate(request.parameters):
            try:
                parameter = self._understood(message, known)
            except RangeError as error:
                results[place] = SetParametersResult(successful=False, reason=str(error))
                continue
            name = parameter.name
            key = next((names for names in self._sets if name in names), name)
            together.setdefault(key, []).append((place, parameter))
        for group in together.values():
            result = self._node.set_parameters_atomically([parameter for _, parameter in group])
            results |= {place: result for place, _ in group}
        response.results = [results[place] for place in range(len(request.parameters))]
        return response

    def _set_atomically(
        self,
        request: SetParametersAtomically.Request,
        response: SetParametersAtomically.Response,
    ) -> SetParametersAtomically.Response:
        """Set all parameters or none."""
        try:
            given = [self._understood(each, self._settings) for each in request.parameters]
        except RangeError as error:
            response.result = SetParametersResult(successful=False, reason=str(error))
        else:
            response.result = self._node.set_parameters_atomically(given)
        return response

    def _understood(self, message: ParameterMessage, known: Iterable[str]) -> Parameter:
        """Return a parameter of this node from its message; rclpy answers nothing to some.

        Args:
            message: The message.
            known: Names among which to look for the one that was meant.

        Raises:
            RangeError: The node has none of that name, or the value is of no known type.
        """
        if not self._node.has_parameter(message.name):
            raise RangeError(_unknown(message.name, known))
        try:
            return Parameter.from_parameter_msg(message)
        except ValueError as error:
            raise RangeError(f"{message.name}: {error}") from None

    def _fit_types(self, parameters: list[Parameter]) -> list[Parameter]:
        """Take whole numbers where others are wanted, and a text where a list of them is.

        The text is refused in `_prepare`, in words that say how to write a list.
        """
        self._mistyped = {}
        return [self._fitted(parameter) for parameter in parameters]

    def _fitted(self, parameter: Parameter) -> Parameter:
        setting = self._settings.get(parameter.name)
        if setting is None:
            return parameter
        if isinstance(setting.default, float) and type(parameter.value) is int:
            return Parameter(parameter.name, value=float(parameter.value))
        if isinstance(setting.default, list) and isinstance(parameter.value, str):
            self._mistyped[parameter.name] = parameter.value
            return Parameter(parameter.name, value=[parameter.value])
        return parameter

    def _prepare(self, parameters: list[Parameter]) -> SetParametersResult:
        # Other parts of a node (use_sim_time, QoS overrides) have parameters of their own.
        changed = {p.name: _plain(p.value) for p in parameters if p.name in self._settings}
        proposed = {**self._values, **changed}
        try:
            # What is declared later, such as the QoS of a topic, is no change.
            if self._locked and any(self._node.has_parameter(p.name) for p in parameters):
                raise UnavailableError(_LOCKED_MESSAGE)
            for name, value in changed.items():
                if name in self._mistyped:
                    raise _no_list(name, value[0])
                self._settings[name].verify(value)
            apply = [
                prepare(proposed)
                for names, prepare in self._dependents
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
        self.version += 1
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
        RangeError: A text was given for a list of texts.
        ParameterException: The value has another wrong type or lies outside the range.
    """
    try:
        return _declare(node, setting)
    except InvalidParameterTypeException:
        given = _given_at_start(node, setting.name)
        if isinstance(setting.default, float) and type(given) is int:
            descriptor = describe(setting)
            value = float(given)
            return node.declare_parameter(
                setting.name, value, descriptor, ignore_override=True
            ).value
        if isinstance(setting.default, list) and isinstance(given, str):
            raise _no_list(setting.name, given) from None
        raise


def _given_at_start(node: Node, name: str) -> Any:
    """Return a value of whatever type that was given for a parameter."""
    node.declare_parameter(name, descriptor=ParameterDescriptor(dynamic_typing=True))
    value = node.get_parameter(name).value
    node.undeclare_parameter(name)
    return value


def _no_list(name: str, text: str) -> RangeError:
    shown = shortened(text)
    return RangeError(f"{name} must be a list of texts: write ['{shown}'] in place of {shown}")


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
        node.get_logger().warning(_unknown(name, known, " and is ignored"))


def _unknown(name: str, known: Iterable[str], and_so: str = "") -> str:
    """Return that no parameter has a name, with the one that may have been meant."""
    shown = shortened(name)
    like = difflib.get_close_matches(shown, known, n=1, cutoff=0.75)
    meant = f"; did you mean {like[0]!r}?" if like else ""
    return f"parameter {shown!r} is not known here{and_so}{meant}"


def _plain(value: Any) -> Any:
    """Return array-valued parameters as lists."""
    return value if isinstance(value, (bool, int, float, str)) else list(value or [])
