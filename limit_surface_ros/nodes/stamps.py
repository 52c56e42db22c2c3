# SPDX-License-Identifier: Apache-2.0
"""Stamps of messages as integer nanoseconds, and back."""

from __future__ import annotations

from typing import TYPE_CHECKING

from limit_surface_ros.errors import RangeError

if TYPE_CHECKING:
    from builtin_interfaces.msg import Time

SECOND = 1_000_000_000


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
