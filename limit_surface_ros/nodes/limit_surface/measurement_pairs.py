# SPDX-License-Identifier: Apache-2.0
"""Which measured wrench belongs to which measured twist: by their stamps, whichever comes first.

Between two topics there is no order: a twist may be here before the wrench of its time, or long
after it. So a twist waits until a wrench of its time or of a later one has come.
"""

from __future__ import annotations

from bisect import bisect_right, insort
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

# Measurements of both kinds whose stamps differ by no more are of one time [ns].
SAME_TIME = 20_000_000
# A stamp that is further behind the newest of its stream comes from a clock that was turned back,
# of a bag that begins anew, say [ns].
_TURNED_BACK = 2_000_000_000
# Measurements of a kind that are kept for those that still come: half a second of 1 kHz. They are
# counted, for a bag may be played at any speed, and a node takes a hundred of a kind in a turn.
_KEPT = 500


class _Stamped(NamedTuple):
    """A value and its stamp [ns]."""

    stamp: int
    value: Any


class MeasurementPairs:
    """Pairs two streams of stamped values.

    Args:
        alone: Called for each twist that has no wrench of its time.
    """

    def __init__(self, alone: Callable[[], object]) -> None:
        """Know nothing yet."""
        self._alone = alone
        self._wrenches: list[_Stamped] = []
        # Those that wait, in the order of their stamps.
        self._twists: list[_Stamped] = []
        self._newest_twist = 0

    def add_wrench(self, stamp: int, wrench: Any) -> list[tuple[int, Any, Any]]:
        """Take a wrench; return stamp [ns], wrench and twist of the twists that waited for it."""
        if self._wrenches and stamp < self._wrenches[-1].stamp - _TURNED_BACK:
            self._wrenches.clear()
        insort(self._wrenches, _Stamped(stamp, wrench), key=_stamp)
        del self._wrenches[:-_KEPT]
        return [*self._ready()]

    def add_twist(self, stamp: int, twist: Any) -> list[tuple[int, Any, Any]]:
        """Take a twist; return the same of it, if its wrench is here already, and of others."""
        if stamp < self._newest_twist - _TURNED_BACK:
            for _ in self._twists:
                self._alone()
            self._twists.clear()
            # The clock of the wrenches may have been turned back already, or not yet.
            later = bisect_right(self._wrenches, stamp + _TURNED_BACK, key=_stamp)
            del self._wrenches[later:]
            self._newest_twist = stamp
        self._newest_twist = max(self._newest_twist, stamp)
        insort(self._twists, _Stamped(stamp, twist), key=_stamp)
        return [*self._ready()]

    def _ready(self) -> Iterator[tuple[int, Any, Any]]:
        """Yield the pairs of twists that need not wait any longer, and tell of those alone."""
        last = self._wrenches[-1].stamp if self._wrenches else -1
        while self._twists:
            stamp, twist = self._twists[0]
            if last < stamp and len(self._twists) <= _KEPT:
                return
            del self._twists[0]
            wrench = self._nearest(stamp)
            if wrench is None:
                self._alone()
            else:
                yield stamp, wrench, twist

    def _nearest(self, stamp: int) -> Any:
        """Return the wrench nearest to a stamp [ns], None if it is of another time."""
        # Of equal stamps the one that came last.
        place = bisect_right(self._wrenches, stamp, key=_stamp)
        near = self._wrenches[max(place - 1, 0) : place + 1]
        best = min(near, key=lambda each: abs(each.stamp - stamp), default=None)
        return best.value if best and abs(best.stamp - stamp) <= SAME_TIME else None


def _stamp(stamped: _Stamped) -> int:
    return stamped.stamp
