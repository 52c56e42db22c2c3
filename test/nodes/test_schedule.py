# SPDX-License-Identifier: Apache-2.0
"""Stamps of a stream neither drift nor repeat, however late or coarsely time comes in."""

from hypothesis import given, settings
from hypothesis import strategies as st

from limit_surface_ros.nodes.decay.onset_stream import LONGEST_DELAY, Schedule

START = 1_700_000_000_000_000_000
SECOND = 1_000_000_000


@given(
    st.floats(min_value=0.1, max_value=5000.0),
    st.lists(st.integers(min_value=0, max_value=LONGEST_DELAY), min_size=1, max_size=30),
)
@settings(max_examples=60, deadline=None)
def test_every_stamp_is_due_once_whatever_the_steps_of_the_clock(rate, steps):
    schedule = Schedule(START, rate, START)
    now, offsets = START, []
    for step in steps:
        now += step
        offsets += schedule.due(now)
        assert schedule.next_stamp > now
    assert offsets == [round(k * 1e9 / rate) for k in range(len(offsets))]
    assert not offsets or START + offsets[-1] <= now


def test_an_hour_at_a_kilohertz_does_not_drift():
    schedule = Schedule(START, 1000.0, START + 3600 * SECOND - 1)
    assert schedule.due(START + 3600 * SECOND) == [3600 * SECOND]


def test_a_start_in_the_past_begins_in_the_middle_and_one_in_the_future_waits():
    assert Schedule(START, 10.0, START + SECOND // 4).next_offset == 3 * SECOND // 10
    waiting = Schedule(START, 10.0, START - 5 * SECOND)
    assert waiting.due(START - 1) == []
    assert waiting.next_stamp == START
    assert waiting.due(START) == [0]


def test_after_a_long_stall_what_was_missed_is_left_out():
    schedule = Schedule(START, 100.0, START)
    now = START + 5 * SECOND
    assert schedule.due(now) == [5 * SECOND]
    assert schedule.due(now + SECOND // 100) == [5 * SECOND + SECOND // 100]


def test_after_a_jump_back_stamps_go_back_too():
    schedule = Schedule(START, 10.0, START)
    schedule.due(START + SECOND)
    assert schedule.due(START + SECOND // 2) == []
    schedule.restart(START + SECOND // 2)
    assert schedule.due(START + SECOND // 2) == [SECOND // 2]
    schedule.restart(START - SECOND)
    assert schedule.next_stamp == START


@given(st.floats(min_value=0.1, max_value=5000.0), st.integers(min_value=0, max_value=10**6))
@settings(max_examples=100, deadline=None)
def test_a_schedule_that_begins_on_a_stamp_begins_with_it(rate, index):
    now = START + round(index * 1e9 / rate)
    assert Schedule(START, rate, now).next_stamp == now
