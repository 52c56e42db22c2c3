# SPDX-License-Identifier: Apache-2.0
"""Measured wrenches and twists of one time meet, in whatever order they come."""

from __future__ import annotations

import pytest

from limit_surface_ros.nodes.limit_surface.measurement_pairs import MeasurementPairs

MS = 1_000_000


class Streams:
    """Pairs of named measurements, and how many twists were alone."""

    def __init__(self):
        self.alone = 0
        self.pairs = MeasurementPairs(self._count)
        self.found = []

    def _count(self):
        self.alone += 1

    def wrench(self, stamp, name):
        self.found += self.pairs.add_wrench(stamp, name)

    def twist(self, stamp, name):
        self.found += self.pairs.add_twist(stamp, name)


@pytest.mark.parametrize("delay", [0, 1, 7, 50])
@pytest.mark.parametrize("late", ["wrench", "twist"])
@pytest.mark.parametrize("period", [1, 33])
def test_either_may_come_later_than_the_other(delay, late, period):
    streams = Streams()
    for k in range(100 + delay):
        for kind in ("twist", "wrench"):
            number = k - delay if kind == late else k
            if 0 <= number < 100:
                getattr(streams, kind)(number * period * MS, number)
    assert streams.found == [(k * period * MS, k, k) for k in range(100)]
    assert streams.alone == 0


def test_many_twists_to_a_wrench_take_the_nearest():
    streams = Streams()
    for k in range(200):
        streams.twist(k * MS, k)
        if k % 10 == 0:
            streams.wrench(k * MS, k)
    assert [twist for _, _, twist in streams.found] == [*range(191)]
    assert all(abs(wrench - twist) <= 5 for _, wrench, twist in streams.found)


def test_of_equal_stamps_the_last_counts():
    streams = Streams()
    for k in range(50):
        streams.wrench(7, k)
        streams.twist(7, k)
    assert streams.found == [(7, k, k) for k in range(50)]


def test_what_comes_out_of_order_is_put_in_order():
    streams = Streams()
    for stamp in (10, 50, 30, 90, 70):
        streams.twist(stamp * MS, stamp)
    for stamp in (10, 9, 31, 30, 50, 90, 70):
        streams.wrench(stamp * MS, stamp)
    # Each has the nearest of those that came before the first that is later than it.
    found = [(twist, wrench) for _, wrench, twist in streams.found]
    assert found == [(10, 10), (30, 31), (50, 50), (70, 50), (90, 90)]


def test_a_hundred_of_a_kind_may_come_at_once_of_a_bag_played_fast():
    streams = Streams()
    for start in range(0, 1000, 100):
        for kind in ("twist", "wrench"):
            for k in range(start, start + 100):
                getattr(streams, kind)(100 * k * MS, k)
    assert streams.found == [(100 * k * MS, k, k) for k in range(1000)]


def test_twists_of_another_time_are_told_and_nothing_is_kept_for_ever():
    streams = Streams()
    streams.wrench(0, "early")
    for k in range(1, 5000):
        streams.twist(k * 21 * MS, k)
    assert streams.found == []
    assert streams.alone == 4499
    assert len(streams.pairs._twists) == 500
    # Of a clock that stands, too.
    for k in range(5000):
        streams.wrench(105_000 * MS, k)
    assert len(streams.pairs._wrenches) == 500


@pytest.mark.parametrize("first", ["twist", "wrench"])
def test_a_clock_that_is_turned_back_begins_anew(first):
    streams = Streams()
    kinds = [first, "twist" if first == "wrench" else "wrench"]
    for start in (1000, 3, 500):
        for k in range(10):
            for kind in kinds:
                getattr(streams, kind)((1000 * start + k) * MS, k)
    assert [twist for _, _, twist in streams.found] == 3 * [*range(10)]
    assert streams.alone == 0
