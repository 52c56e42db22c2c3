# SPDX-License-Identifier: Apache-2.0
"""What leaves a node: errors as a code and a sentence, and numbers that are finite."""

from __future__ import annotations

import math
from functools import cache
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np
from limit_surface_interfaces.msg import ErrorCode

from limit_surface_ros.errors import LimitSurfaceError, SolverError, shortened

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

# Most characters of a sentence, which may hold names that came in.
LONGEST_SENTENCE = 2000
_FLOATS = ("double", "float")
# Division by zero and overflow of plain floats, and matrices that rounding has spoilt.
_ARITHMETIC = (ArithmeticError, np.linalg.LinAlgError)


def code_name(error: Exception) -> str:
    """Return the name of the constant of `ErrorCode` that stands for an error.

    Arithmetic that broke off, as numbers near 1e100 make it, found no answer: NO_CONVERGENCE. What
    else the package did not raise on purpose is a defect of it: INTERNAL.
    """
    if isinstance(error, LimitSurfaceError):
        return error.code
    return SolverError.code if isinstance(error, _ARITHMETIC) else LimitSurfaceError.code


def error_code(error: Exception) -> int:
    """Return the number of the error's code."""
    return int(getattr(ErrorCode, code_name(error)))


def sentence(error: Exception) -> str:
    """Return what a person should read."""
    if isinstance(error, LimitSurfaceError):
        return shortened(str(error), LONGEST_SENTENCE)
    if isinstance(error, _ARITHMETIC):
        return (
            f"no answer was found ({shortened(str(error))}): the numbers asked for are beyond "
            "what this model can be computed for"
        )
    message = f"defect of limit_surface_ros, please report it: {type(error).__name__}: {error}"
    return shortened(message, LONGEST_SENTENCE)


class FiniteCheck:
    """Looks at every number of a message before it leaves.

    Args:
        message_type: Type of the messages.
        unbounded: Fields that may be infinite, by their dotted names: "forever" is an answer.
        checked: Fields that were looked at when they were filled, slice by slice.
    """

    def __init__(
        self,
        message_type: Any,
        unbounded: tuple[str, ...] = (),
        checked: tuple[str, ...] = (),
    ) -> None:
        """Find the fields that hold numbers."""
        numbers, arrays = _float_fields(message_type)
        self._lists = [name for name in _list_fields(message_type) if name not in checked]
        self._names = [name for name in numbers if name not in unbounded]
        self._arrays = [name for name in arrays if name not in (*unbounded, *checked)]
        self._unbounded = [name for name in unbounded if name in numbers]
        self._unbounded_arrays = [name for name in unbounded if name in arrays]
        self._numbers = _getter(self._names)

    def __call__(self, message: Any) -> None:
        """Pass a message.

        Raises:
            SolverError: A number is NaN or infinite; the error names its field.
        """
        values = self._numbers(message)
        # NaN fails the comparison, and so does a sum that overflows: then each is looked at.
        if not abs(sum(values)) < math.inf:
            for name, value in zip(self._names, values, strict=True):
                if not math.isfinite(value):
                    raise _not_finite(name, value)
        for name in self._arrays:
            array = np.asarray(attrgetter(name)(message), dtype=np.float64)
            if not abs(array.sum()) < math.inf and not np.isfinite(array).all():
                place = int(np.argmin(np.isfinite(array)))
                raise _not_finite(f"{name}[{place}]", float(array[place]))
        for name in self._lists:
            for place, one in enumerate(attrgetter(name)(message)):
                try:
                    _check_of(type(one))(one)
                except SolverError as error:
                    raise SolverError(f"{name}[{place}]: {error}") from None
        for name in self._unbounded:
            if math.isnan(attrgetter(name)(message)):
                raise _not_finite(name, math.nan)
        for name in self._unbounded_arrays:
            if np.isnan(np.asarray(attrgetter(name)(message), dtype=np.float64)).any():
                raise _not_finite(name, math.nan)


def _not_finite(name: str, value: float) -> SolverError:
    return SolverError(
        f"no finite answer was found: {name} would be {value}; the numbers asked for are beyond "
        "what this model can be computed for"
    )


def _getter(names: list[str]) -> Callable[[Any], tuple[float, ...]]:
    if len(names) > 1:
        return attrgetter(*names)
    return lambda message: tuple(attrgetter(name)(message) for name in names)


@cache
def _float_fields(message_type: Any) -> tuple[list[str], list[str]]:
    """Return the dotted names of a message's numbers and of its arrays of numbers."""
    numbers: list[str] = []
    arrays: list[str] = []
    for name, kind, inner in _fields(message_type):
        if kind in _FLOATS:
            numbers.append(name)
        elif kind.startswith(tuple(f"sequence<{one}" for one in _FLOATS)) or kind.startswith(
            tuple(f"{one}[" for one in _FLOATS)
        ):
            arrays.append(name)
        elif inner is not None:
            below_numbers, below_arrays = _float_fields(inner)
            numbers += [f"{name}.{below}" for below in below_numbers]
            arrays += [f"{name}.{below}" for below in below_arrays]
    return numbers, arrays


@cache
def _check_of(message_type: Any) -> FiniteCheck:
    return FiniteCheck(message_type)


@cache
def _list_fields(message_type: Any) -> list[str]:
    """Return the dotted names of a message's lists of messages."""
    lists: list[str] = []
    for name, kind, inner in _fields(message_type):
        if inner is not None:
            lists += [f"{name}.{below}" for below in _list_fields(inner)]
        elif "/" in kind:
            lists.append(name)
    return lists


def _fields(message_type: Any) -> Iterator[tuple[str, str, Any]]:
    """Yield name, type and, if it is one message, class of each field."""
    example = message_type()
    for name, kind in message_type.get_fields_and_field_types().items():
        value = getattr(example, name)
        nested = hasattr(value, "get_fields_and_field_types")
        yield name, kind, type(value) if nested else None
