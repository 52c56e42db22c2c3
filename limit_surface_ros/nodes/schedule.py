# SPDX-License-Identifier: Apache-2.0
"""When a steady stream is due: stamps start + k / rate, counted and not added up. ROS-free.

A timer that fires late, or a simulated clock that ticks coarsely, delays messages but neither
loses them nor shifts the stamps of those that follow.
"""

from __future__ import annotations

import math

# What has been due for longer was missed: a stalled process does not flood its listeners [ns].
LONGEST_DELAY = 1_000_000_000


class Schedule:
    """Stamps of one stream, in integer nanoseconds.

    Args:
        start: Time of the first stamp [ns].
        rate: Stamps a second [Hz].
        now: Present time [ns]; stamps before it are not due any more.
    """

    def __init__(self, start: int, rate: float, now: int) -> None:
        """Begin at the first stamp that is not past."""
        self._start = start
        self._rate = rate
        self.restart(now)

    def restart(self, now: int) -> None:
        """Go on from the first stamp that is not before `now` [ns]: the clock has jumped."""
        elapsed = now - self._start
        self._next = max(0, math.ceil(elapsed * 1e-9 * self._rate))
        # Rounding may have taken a stamp that is due just now for one that is past.
        if self._next > 0 and self._offset(self._next - 1) >= elapsed:
            self._next -= 1

    @property
    def next_offset(self) -> int:
        """Time from the start to the stamp that is due next [ns]."""
        return self._offset(self._next)

    @property
    def next_stamp(self) -> int:
        """The stamp that is due next [ns]."""
        return self._start + self.next_offset

    def due(self, now: int) -> list[int]:
        """Return the times from the start to all stamps that have come due [ns], each once."""
        if now - self.next_stamp > LONGEST_DELAY:
            self.restart(now)
        offsets: list[int] = []
        while self.next_stamp <= now:
            offsets.append(self.next_offset)
            self._next += 1
        return offsets

    def _offset(self, index: int) -> int:
        return round(index * 1e9 / self._rate)
