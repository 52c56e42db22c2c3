# SPDX-License-Identifier: Apache-2.0
"""Messages to numbers and back: what comes in is checked here, at the boundary."""

from __future__ import annotations

import math
from array import array
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import LARGEST, SMALLEST, as_name
from limit_surface_ros.errors import (
    LimitSurfaceError,
    NotFiniteError,
    RangeError,
    ShapeError,
    SolverError,
    ZeroVectorError,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from builtin_interfaces.msg import Time
    from geometry_msgs.msg import Point, Twist, Vector3, Wrench
    from std_msgs.msg import Header

    from limit_surface_ros.checks import Floats

SECOND = 1_000_000_000
_WRENCH = ("force.x", "force.y", "force.z", "torque.x", "torque.y", "torque.z")
_TWIST = ("linear.x", "linear.y", "linear.z", "angular.x", "angular.y", "angular.z")


def wrench_components(wrench: Wrench) -> tuple[float, ...]:
    """Return (fx, fy, fz, tau_x, tau_y, tau_z) of a message.

    Raises:
        NotFiniteError: A component is NaN or infinite.
        RangeError: A component is larger than `LARGEST`.
    """
    force, torque = wrench.force, wrench.torque
    return _checked((force.x, force.y, force.z, torque.x, torque.y, torque.z), _WRENCH)


def twist_components(twist: Twist) -> tuple[float, ...]:
    """Return (vx, vy, vz, omega_x, omega_y, omega_z) of a message.

    Raises:
        NotFiniteError: A component is NaN or infinite.
        RangeError: A component is larger than `LARGEST`.
    """
    linear, angular = twist.linear, twist.angular
    return _checked((linear.x, linear.y, linear.z, angular.x, angular.y, angular.z), _TWIST)


def vector_components(name: str, vector: Vector3 | Point) -> tuple[float, ...]:
    """Return (x, y, z) of a message.

    Raises:
        NotFiniteError: A component is NaN or infinite.
        RangeError: A component is larger than `LARGEST`.
    """
    names = (f"{name}.x", f"{name}.y", f"{name}.z")
    return _checked((vector.x, vector.y, vector.z), names)


def checked_number(name: str, value: float) -> float:
    """Return a number of a message.

    Raises:
        NotFiniteError: It is NaN or infinite.
        RangeError: It is larger than `LARGEST`.
    """
    return _checked((value,), (name,))[0]


def _checked(values: tuple[float, ...], names: tuple[str, ...]) -> tuple[float, ...]:
    # One comparison for the usual case; NaN fails it.
    if sum(map(abs, values)) <= LARGEST:
        return values
    for name, value in zip(names, values, strict=True):
        if not math.isfinite(value):
            raise NotFiniteError(f"{name} must be finite, got {value}")
        if abs(value) > LARGEST:
            raise RangeError(f"{name} must be at most {LARGEST:g} in size, got {value:g}")
    return values


def copied_frame(frame: str) -> str:
    """Return a frame that each pose or wrench of an answer repeats; empty stays empty.

    Raises:
        RangeError: It is so long, or so strange, that the answer would be of gigabytes.
    """
    return as_name("frame_id", frame) if frame else frame


def fill_wrench(message: Wrench, wrench: Sequence[float]) -> None:
    """Write (fx, fy, tau_z) [N, N, N m] into a message."""
    message.force.x, message.force.y, message.torque.z = map(float, wrench)


def fill_twist(message: Twist, twist: Sequence[float]) -> None:
    """Write (vx, vy, omega_z) [m/s, m/s, rad/s] into a message."""
    message.linear.x, message.linear.y, message.angular.z = map(float, twist)


def rows_of(name: str, numbers: array[float], most: int) -> Floats:
    """Return a flat, row-major float64[] field as rows of three, without copying it.

    The numbers are not looked at: `checked_rows` does, slice by slice.

    Args:
        name: Name of the field.
        numbers: What it holds.
        most: Number of rows that are accepted.

    Raises:
        ShapeError: The length is no multiple of three.
        RangeError: Rows are too many.
    """
    flat = np.frombuffer(numbers, dtype=np.float64) if len(numbers) else np.empty(0)
    if flat.size % 3:
        raise ShapeError(
            f"{name} must hold 3 numbers a row, row after row; {flat.size} is no multiple of 3"
        )
    rows = flat.reshape(-1, 3)
    if len(rows) > most:
        raise RangeError(
            f"{name} holds {len(rows)} rows; at most {most} are accepted, see max_batch_rows"
        )
    return rows


def checked_rows(name: str, rows: Floats, first: int = 0) -> Floats:
    """Return rows of three whose numbers are good.

    Args:
        name: Name of the field.
        rows: Shape (n, 3), a part of the field's rows.
        first: Number of the first of them in the field.

    Raises:
        NotFiniteError: A number is NaN or infinite.
        RangeError: A row is beyond `LARGEST` or below `SMALLEST` in size.
        ZeroVectorError: A row is zero; all these errors name the first bad row.
    """
    x, y, turn = np.abs(rows).T
    # Column by column: numpy reduces short rows one by one.
    sizes = np.maximum(np.maximum(x, y), turn)
    # NaN fails both comparisons.
    fits = (sizes >= SMALLEST) & (sizes <= LARGEST)
    if not fits.all():
        row = int(np.argmin(fits))
        raise _bad_row(f"{name} row {first + row}", rows[row].tolist())
    return rows


def _bad_row(where: str, row: list[float]) -> LimitSurfaceError:
    """Return what is wrong with a row."""
    if not np.isfinite(row).all():
        return NotFiniteError(f"{where} must be finite, got {row}")
    if not any(row):
        return ZeroVectorError(f"{where} must not be zero: it has no direction")
    return RangeError(f"{where} must be within {SMALLEST:g} and {LARGEST:g} in size, got {row}")


def finite_rows(name: str, values: Floats, first: int = 0) -> Floats:
    """Return a part of an answer's rows or numbers, all of which are finite.

    Args:
        name: Name of the field.
        values: Shape (n, 3) or (n,).
        first: Number of the first of them in the field.

    Raises:
        SolverError: A number is NaN or infinite; the error names its row.
    """
    if not math.isfinite(values.sum()) and not np.isfinite(values).all():
        rows = np.isfinite(values).reshape(len(values), -1).all(axis=1)
        raise SolverError(f"no finite answer was found: {name} row {first + int(np.argmin(rows))}")
    return values


def flat_of(values: Floats) -> array[float]:
    """Return any array as a float64[] field, row after row.

    `array.array` is the one type that rclpy takes without looking at each element.
    """
    flat = array("d")
    flat.frombytes(np.ascontiguousarray(values, dtype=np.float64).view(np.uint8).data)
    return flat


def nanoseconds(stamp: Time) -> int:
    """Return a stamp in [ns] since time zero; 0 is a stamp that was not set.

    Raises:
        RangeError: The stamp is before time zero, or its fraction is not below a second.
    """
    if stamp.sec < 0 or stamp.nanosec >= SECOND:
        raise RangeError(
            f"a stamp must have sec >= 0 and nanosec < 1e9, got {stamp.sec} and {stamp.nanosec}"
        )
    return int(stamp.sec) * SECOND + int(stamp.nanosec)


def fill_stamp(stamp: Time, time: int) -> None:
    """Write a time [ns] into a stamp."""
    stamp.sec, stamp.nanosec = divmod(time, SECOND)


def fill_header(header: Header, asked: Header, frame: str) -> None:
    """Answers keep the stamp that they answer and stand in the model's frame."""
    header.stamp = asked.stamp
    header.frame_id = frame
