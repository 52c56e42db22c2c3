# SPDX-License-Identifier: Apache-2.0
"""The ROS-free parts of the nodes: settings refuse what they should, health counts."""

from __future__ import annotations

import math

import pytest

from limit_surface_ros.errors import RangeError, ShapeError
from limit_surface_ros.nodes.serving.diagnostics import CallbackTimes, Health, InputAge
from limit_surface_ros.nodes.serving.settings import Setting


def refuse(value):
    raise ShapeError(f"{value} has no shape")


@pytest.mark.parametrize(
    ("setting", "value", "told"),
    [
        (Setting("rate", 1.0, "", minimum=0.5), 0.1, "rate must be at least 0.5"),
        (Setting("rate", 1.0, "", maximum=2.0), 3.0, "rate must be at most 2.0"),
        (Setting("rate", 1.0, "", minimum=0.0), math.nan, "rate must be finite"),
        (Setting("rates", [1.0], ""), [1.0, math.inf], "rates must be finite"),
        (Setting("rates", [1.0], "", minimum=0.0), [1.0, -1.0], "at least 0.0"),
        (Setting("mode", "a", "", choices=("a", "b")), "c", "one of a, b; got 'c'"),
        (Setting("shape", "a", "", check=refuse), "b", "shape: b has no shape"),
    ],
)
def test_a_setting_says_what_it_does_not_accept(setting, value, told):
    with pytest.raises(RangeError, match=told):
        setting.verify(value)
    setting = Setting("free", value, "")
    if not (isinstance(value, float) and math.isnan(value)) and value != [1.0, math.inf]:
        setting.verify(value)


def test_the_age_of_an_input_survives_a_clock_that_jumps_back():
    age = InputAge()
    assert age.seconds(10) is None
    age.last = 5_000_000_000
    assert age.seconds(7_000_000_000) == pytest.approx(2.0)
    assert age.seconds(1_000_000_000) == 0.0
    assert age.seconds(2_500_000_000) == pytest.approx(1.5)


def test_an_input_is_stale_only_after_it_came_once_and_was_silent_too_long():
    health = Health(inputs={"wrench": InputAge(), "twist": InputAge(last=0)})
    assert health.stale(400_000_000, 0.5) == []
    assert health.stale(600_000_000, 0.5) == ["twist"]
    assert health.stale(600_000_000, 0.0) == []


def test_callback_times_have_mean_and_maximum():
    times = CallbackTimes()
    assert times.mean == 0.0
    for seconds in (0.1, 0.3):
        times.add(seconds)
    assert times.mean == pytest.approx(0.2)
    assert times.longest == 0.3


def test_refusals_are_counted_by_place_and_code():
    health = Health()
    health.refuse("wrench", "NOT_FINITE", "force.x is NaN")
    health.refuse("wrench", "NOT_FINITE", "force.y is NaN")
    assert health.refused["wrench", "NOT_FINITE"] == health.news["wrench", "NOT_FINITE"] == 2
    assert health.news_in_words().startswith("2 inputs refused (2 on wrench: NOT_FINITE)")
    assert health.last_error == "wrench: force.y is NaN"
    health.restart_window()
    assert not health.news
    assert health.refused["wrench", "NOT_FINITE"] == 2
