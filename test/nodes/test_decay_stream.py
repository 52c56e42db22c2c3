# SPDX-License-Identifier: Apache-2.0
"""The decay node publishes a falling wrench in node time, whatever the clock does."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from limit_surface_interfaces.msg import DecayForecast
from rclpy.parameter import Parameter

from decay_helpers import LATCHED, LOAD, SECOND, SUM, Bench, load_of, time_of, write_decay
from limit_surface_ros.decay.exponential_sum import ExponentialSum

START = 100 * SECOND
STEP = SECOND // 100


@pytest.fixture
def bench(ros, client_node, tmp_path):
    bench = Bench(ros, client_node, tmp_path, rate=100.0, stop_below=0.01)
    bench.tick(START)
    return bench


def stamps(messages):
    return [time_of(message) for message in messages]


def check_against_the_library(bench, start, x=SUM, load=LOAD):
    """Each wrench and value is the library's at the stamp that it carries."""
    assert len(bench.wrenches) == len(bench.values) > 0
    times = (np.array(stamps(bench.wrenches)) - start) * 1e-9
    loads = np.array([load_of(message) for message in bench.wrenches])
    expected = np.multiply.outer(x(times) / float(x(0.0)), np.array(load))
    np.testing.assert_allclose(loads, expected, rtol=0, atol=1e-9)
    values = [message.vector.x for message in bench.values]
    np.testing.assert_allclose(values, x(times), rtol=0, atol=1e-9)
    assert stamps(bench.values) == stamps(bench.wrenches)


def test_wrenches_equal_the_library_at_their_stamps_until_the_response_is_below_the_end(
    ros, bench
):
    bench.onset(START)
    end = SUM.time_to_level(0.01 * float(SUM(0.0)))
    bench.run(START, START + int((end + 1.0) * SECOND), 7 * STEP)
    count = int(end * 100.0) + 1
    ros.wait(lambda: len(bench.wrenches) >= count and len(bench.values) >= count)
    assert stamps(bench.wrenches) == [START + k * STEP for k in range(count)]
    check_against_the_library(bench, START)
    assert all(message.header.frame_id == "object" for message in bench.wrenches)
    assert not bench.node._stream.running


def test_each_onset_gives_one_forecast_that_late_subscribers_get_too(ros, client_node, bench):
    bench.onset(START)
    ros.wait(lambda: bench.forecasts)
    forecast = bench.forecasts[0]
    np.testing.assert_allclose(forecast.values, SUM(np.array(forecast.times)), atol=1e-12)
    assert forecast.times[0] == 0.0
    assert forecast.times[-1] == 10.0
    assert len(forecast.bounds) == len(forecast.times) == 201
    assert time_of(forecast) == START
    assert forecast.model == "soft"
    assert forecast.onset.force.y == LOAD[1]
    assert forecast.onset_value == float(SUM(0.0))
    assert (forecast.bound_from, forecast.bound_until) == (0.0, 6.0)
    assert forecast.end_time == pytest.approx(SUM.time_to_level(0.01 * float(SUM(0.0))))
    assert forecast.samples == 0

    late = ros.listen(client_node, DecayForecast, "/decay/forecast", LATCHED)
    ros.wait(lambda: late)
    assert late[0] == forecast
    bench.onset(START)
    ros.wait(lambda: len(bench.forecasts) == 2)


def test_a_new_onset_replaces_the_old_at_once(ros, bench):
    bench.onset(START)
    bench.tick(START + 10 * STEP)
    ros.wait(lambda: len(bench.values) == 11)
    second = START + 10 * STEP + STEP // 2
    bench.tick(second)
    bench.onset(second, load=(0.0, 0.0, 0.0, 0.0, 0.0, 7.0))
    bench.tick(second + 5 * STEP)
    ros.wait(lambda: len(bench.values) == 17)
    assert stamps(bench.wrenches)[11:] == [second + k * STEP for k in range(6)]
    assert bench.wrenches[11].wrench.torque.z == 7.0


def test_an_onset_in_the_future_waits(ros, bench):
    bench.onset(START + 50 * STEP)
    ros.wait(lambda: bench.forecasts)
    bench.run(START, START + 49 * STEP, 7 * STEP)
    bench.tick(START + 49 * STEP)
    assert bench.wrenches == []
    bench.tick(START + 52 * STEP)
    ros.wait(lambda: len(bench.values) == 3)
    assert stamps(bench.wrenches)[0] == START + 50 * STEP
    check_against_the_library(bench, START + 50 * STEP)


@pytest.mark.parametrize(
    ("stamp", "what"),
    [
        (START + 5 * SECOND, "onset in the future"),
        (START + SECOND // 2, None),
        (START - SECOND // 2, None),
        (START - 90 * SECOND, "onset over"),
    ],
)
def test_an_onset_that_is_far_from_now_is_taken_and_told_of(ros, bench, stamp, what):
    bench.onset(stamp)
    ros.wait(lambda: bench.forecasts)
    assert bench.node.health.reported == ({what: 1} if what else {})
    assert not bench.node.health.refused


def test_an_onset_in_the_past_starts_in_the_middle(ros, bench):
    past = START - 30 * STEP - STEP // 3
    bench.onset(past)
    bench.tick(START + 2 * STEP)
    ros.wait(lambda: len(bench.values) == 2)
    assert stamps(bench.wrenches) == [past + 31 * STEP, past + 32 * STEP]
    check_against_the_library(bench, past)


def test_an_onset_without_a_stamp_is_now(ros, bench):
    bench.onset(0)
    bench.tick(START + STEP)
    ros.wait(lambda: len(bench.values) == 2)
    assert stamps(bench.wrenches) == [START, START + STEP]
    assert time_of(bench.forecasts[0]) == START


def test_an_onset_without_a_stamp_is_refused_while_the_clock_has_not_come(
    ros, client_node, tmp_path
):
    bench = Bench(ros, client_node, tmp_path, rate=100.0)
    bench.onset(0)
    assert bench.refused["onset", "UNAVAILABLE"] == 1
    assert "until /clock comes" in bench.node.health.last_error
    # With a stamp it is waited for, and the clock's first tick begins it.
    bench.onset(START)
    bench.tick(START)
    bench.tick(START + STEP)
    ros.wait(lambda: len(bench.values) == 2)
    assert stamps(bench.wrenches) == [START, START + STEP]


@pytest.mark.parametrize(
    ("load", "code"),
    [
        ((0.0,) * 6, "ZERO_VECTOR"),
        ((math.nan, 0.0, 0.0, 0.0, 0.0, 0.0), "NOT_FINITE"),
        ((1.0, 0.0, 0.0, math.inf, 0.0, 0.0), "NOT_FINITE"),
        ((1e300, 0.0, 0.0, 0.0, 0.0, 0.0), "OUT_OF_RANGE"),
        ((5e-324, 0.0, 0.0, 0.0, 0.0, 0.0), "ZERO_VECTOR"),
    ],
)
def test_a_bad_onset_is_counted_and_the_running_one_goes_on(ros, bench, load, code):
    bench.onset(START)
    bench.onset(START + STEP, load=load)
    assert bench.refused["onset", code] == 1
    bench.tick(START + 3 * STEP)
    ros.wait(lambda: len(bench.values) == 4)
    check_against_the_library(bench, START)


def test_a_paused_clock_pauses_the_stream_and_loses_nothing(ros, bench):
    bench.onset(START)
    bench.tick(START + 4 * STEP)
    ros.wait(lambda: len(bench.values) == 5)
    for _ in range(20):
        bench.tick(START + 4 * STEP)
    assert len(bench.values) == 5
    bench.tick(START + 9 * STEP)
    ros.wait(lambda: len(bench.values) == 10)
    assert stamps(bench.values) == [START + k * STEP for k in range(10)]


def test_a_clock_that_jumps_back_takes_the_stream_with_it(ros, bench):
    bench.onset(START)
    bench.run(START, START + 20 * STEP, STEP)
    ros.wait(lambda: len(bench.values) == 21)
    bench.tick(START + 5 * STEP)
    bench.run(START + 5 * STEP, START + 10 * STEP, STEP)
    ros.wait(lambda: len(bench.values) == 27)
    assert stamps(bench.values)[21:] == [START + k * STEP for k in range(5, 11)]
    bench.tick(START - 20 * STEP)
    bench.tick(START - STEP)
    assert len(bench.values) == 27
    bench.tick(START + STEP)
    ros.wait(lambda: len(bench.values) == 29)
    assert stamps(bench.values)[27:] == [START, START + STEP]
    check_against_the_library(bench, START)


def test_a_stream_that_is_over_starts_again_when_the_clock_jumps_back_into_it(ros, bench):
    bench.onset(START)
    bench.tick(START + 60 * SECOND)
    ros.wait(lambda: not bench.node._stream.running)
    bench.wrenches.clear()
    bench.values.clear()
    bench.tick(START + 10 * STEP)
    bench.tick(START + 11 * STEP)
    ros.wait(lambda: len(bench.values) == 2)
    check_against_the_library(bench, START)


def test_rate_and_end_can_be_changed_while_an_onset_runs(ros, bench):
    bench.onset(START)
    bench.tick(START + 2 * STEP)
    ros.wait(lambda: len(bench.values) == 3)
    results = bench.node.set_parameters([Parameter("rate", value=200.0)])
    assert results[0].successful
    bench.tick(START + 4 * STEP)
    ros.wait(lambda: len(bench.values) >= 8)
    assert stamps(bench.values)[-1] - stamps(bench.values)[-2] == STEP // 2
    check_against_the_library(bench, START)
    assert bench.node.set_parameters([Parameter("stop_below", value=1.0)])[0].successful
    assert not bench.node._stream.running


def test_two_instances_under_two_namespaces_do_not_meet(ros, client_node, tmp_path):
    sums = {"left": SUM, "right": ExponentialSum([-3.0], [2.0])}
    benches = {}
    for side, x in sums.items():
        files = [write_decay(tmp_path, name=side, x=x)]
        benches[side] = Bench(ros, client_node, tmp_path, files=files, namespace=f"/{side}")
    for bench in benches.values():
        bench.tick(START)
    benches["right"].onset(START)
    for bench in benches.values():
        bench.tick(START + 3 * STEP)
    ros.wait(lambda: len(benches["right"].values) == 4)
    check_against_the_library(benches["right"], START, sums["right"])
    assert benches["left"].values == []
    assert benches["left"].forecasts == []
    assert benches["left"].node.health.accepted["onset"] == 0
