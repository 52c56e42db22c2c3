# SPDX-License-Identifier: Apache-2.0
"""Validation at the boundary: each check returns clean float64 numbers or raises.

Each public function of the package checks its arguments once, here; inside, types are trusted.
Comparisons are written so that NaN fails them.
"""

from __future__ import annotations

import operator
import sys
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from limit_surface_ros.errors import (
    LONGEST_NAME,
    NotFiniteError,
    RangeError,
    ShapeError,
    ZeroVectorError,
    shortened,
)

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import ArrayLike, NDArray

    Floats: TypeAlias = NDArray[np.float64]
    Complexes: TypeAlias = NDArray[np.complex128]
    Bools: TypeAlias = NDArray[np.bool_]
    Places: TypeAlias = NDArray[np.intp]

# Components larger than this, or vectors smaller, are refused: their products would overflow.
LARGEST = 1.0e100
SMALLEST = 1.0e-100
_REAL = (float, int)
# Whole numbers of Python have no infinity, and are compared with this exactly.
_LARGEST_FLOAT = sys.float_info.max


def counted(count: int, noun: str) -> str:
    """Return a count with its noun, "1 pair", "2 pairs" or "2 pushes", for messages."""
    ending = "es" if noun.endswith(("s", "sh", "ch", "x")) else "s"
    return f"{count} {noun}" if count == 1 else f"{count} {noun}{ending}"


def as_floats(name: str, values: ArrayLike) -> Floats:
    """Return `values` as a finite float64 array of any shape.

    Args:
        name: What the values are, for the error.
        values: Any nested sequence of numbers.

    Raises:
        ShapeError: The values are ragged or no numbers.
        NotFiniteError: A value is NaN or infinite; the error gives the first one's place.
    """
    array = _as_numbers(name, values)
    if not np.isfinite(array).all():
        place = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        where = f" at index {place}" if place else ""
        raise NotFiniteError(f"{name} must be finite, got {array[place]}{where}")
    return array


def as_number(name: str, value: ArrayLike) -> float:
    """Return `value` as a finite float.

    Raises:
        ShapeError: The value is no number, or more than one.
        NotFiniteError: The value is NaN or infinite.
    """
    array = as_floats(name, value)
    if array.ndim:
        raise ShapeError(f"{name} must be one number, got shape {array.shape}")
    return float(array)


def as_count(name: str, value: int, least: int = 1) -> int:
    """Return `value` as a whole number that is at least `least`.

    Raises:
        RangeError: The value is no whole number, or less.
    """
    try:
        number = operator.index(value)
    except TypeError:
        raise RangeError(f"{name} must be a whole number, got {shortened(repr(value))}") from None
    if number < least:
        raise RangeError(f"{name} must be at least {least}, got {number}")
    return number


def as_vector(name: str, values: ArrayLike) -> Floats:
    """Return `values` as a finite float64 array of shape (3,).

    Raises:
        ShapeError: They are no three numbers.
        NotFiniteError: A component is NaN or infinite.
    """
    array = as_vectors(name, values)
    if array.ndim != 1:
        raise ShapeError(f"{name} must have shape (3,), got {array.shape}")
    return array


def as_coordinates(name: str, values: ArrayLike) -> Floats:
    """Return `values` as `as_floats` does, and refuse what squares and products would overflow of.

    Raises:
        ShapeError: They are no numbers.
        NotFiniteError: One is NaN or infinite.
        RangeError: One is beyond `LARGEST` in size.
    """
    array = as_floats(name, values)
    if array.size and float(np.abs(array).max()) > LARGEST:
        raise RangeError(f"{name} must be at most {LARGEST:g} in size")
    return array


def as_vectors(name: str, values: ArrayLike) -> Floats:
    """Return `values` as a finite float64 array of shape (..., 3).

    Args:
        name: What one vector is, "wrench" or "twist", for the error.
        values: One vector of three components, or many in the leading axes.

    Raises:
        ShapeError: The last axis does not hold three components.
        NotFiniteError: A component is NaN or infinite.
    """
    return as_floats(name, as_rows(name, values))


def as_rows(name: str, values: ArrayLike) -> Floats:
    """Return `values` as a float64 array of shape (..., 3), whose numbers are not checked.

    Callers that compute the norm of each vector check them by it, and call `as_vectors` or
    `as_directions` for the error.

    Raises:
        ShapeError: The last axis does not hold three components, or no numbers.
    """
    array = _as_numbers(name, values)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise ShapeError(f"{name} must have shape (..., 3), got {array.shape}")
    return array


def _as_numbers(name: str, values: ArrayLike) -> Floats:
    # Of these numpy would make numbers: real parts, or years since 1970.
    if isinstance(values, np.ndarray) and values.dtype.kind in "cmM":
        raise ShapeError(f"{name} must be an array of real numbers, got {values.dtype}")
    try:
        return np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise ShapeError(f"{name} must be an array of numbers: {error}") from None


def one_direction(values: Any) -> tuple[float, float, float] | None:
    """Return one valid vector as three floats, or None if it is anything else.

    The fast path for one vector: what it returns None for, callers give to `as_directions`, which
    converts it or raises.
    """
    if type(values) is np.ndarray:
        if values.shape != (3,):
            return None
        values = values.tolist()
    elif type(values) not in (list, tuple) or len(values) != 3:
        return None
    x, y, z = values
    if not (type(x) in _REAL and type(y) in _REAL and type(z) in _REAL):
        return None
    return (x, y, z) if 0.0 < abs(x) + abs(y) + abs(z) <= _LARGEST_FLOAT else None


def as_directions(name: str, values: ArrayLike) -> Floats:
    """Return `values` as `as_vectors` does, and refuse vectors that are zero.

    Raises:
        ShapeError: The last axis does not hold three components.
        NotFiniteError: A component is NaN or infinite.
        ZeroVectorError: A vector is zero; the error gives the first one's place.
    """
    array = as_vectors(name, values)
    zero = ~array.any(axis=-1)
    if zero.any():
        place = tuple(int(i) for i in np.argwhere(zero)[0])
        where = f" at index {place}" if place else ""
        raise ZeroVectorError(f"{name} must not be zero: it has no direction{where}")
    return array


def as_positive(name: str, value: float) -> float:
    """Return `value` as a finite float above zero.

    Raises:
        RangeError: The value is not a number above zero, or not finite.
    """
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        given = shortened(repr(value))
        raise RangeError(f"{name} must be a number above 0, got {given}") from None
    if not 0.0 < number < float("inf"):
        raise RangeError(f"{name} must be a finite number above 0, got {number}")
    return number


def as_name(what: str, text: str) -> str:
    """Return `text` if it can name something in requests, lists, logs and headers.

    Raises:
        RangeError: It is empty, is longer than `LONGEST_NAME`, or holds line breaks or other
            characters that cannot be printed.
    """
    if not text.strip():
        raise RangeError(f"{what} must not be empty")
    if len(text) > LONGEST_NAME or not text.isprintable():
        raise RangeError(
            f"{what} must have at most {LONGEST_NAME} characters, all of which can be printed, "
            f"got {shortened(repr(text))}"
        )
    return text


def check_utf_8(arguments: Iterable[str]) -> None:
    """Refuse arguments of a program that ROS 2 cannot take.

    Raises:
        RangeError: One holds bytes that are no UTF-8, as names of files may.
    """
    for each in arguments:
        try:
            each.encode()
        except UnicodeEncodeError:
            raise RangeError(
                f"argument {shortened(each)!r} is not UTF-8, and ROS 2 takes no other: give the "
                "file or folder another name"
            ) from None
