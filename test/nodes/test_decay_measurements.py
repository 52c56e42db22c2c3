# SPDX-License-Identifier: Apache-2.0
"""Measurements correct the decay node's forecast; bad ones are refused and spoil nothing."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from decay_helpers import LOAD, SECOND, SUM, Bench, load_of, time_of

START = 50 * SECOND
STEP = SECOND // 100


@pytest.fixture
def bench(ros, client_node, tmp_path):
    bench = Bench(ros, client_node, tmp_path, rate=100.0, forecast_period=0.1)
    bench.tick(START)
    bench.onset(START)
    return bench


def measured(time, factor=1.2, noise=0.0, rng=None):
    """Return the load of `factor` times the model, with noise as a fraction of the onset."""
    fraction = factor * float(SUM((time - START) * 1e-9)) / float(SUM(0.0))
    if rng is not None:
        fraction += noise * rng.normal()
    return fraction * np.array(LOAD)


def measure_a_second(bench, factor=1.2, noise=0.01, seed=0):
    rng = np.random.default_rng(seed)
    for block in range(START, START + SECOND, 10 * STEP):
        times = range(block, block + 10 * STEP, STEP)
        bench.tick(times[-1])
        bench.measure(*((time, measured(time, factor, noise, rng)) for time in times))
    bench.tick(START + SECOND + 20 * STEP)


@pytest.mark.parametrize("factor", [0.8, 1.2])
def test_a_second_of_noisy_measurements_puts_a_model_20_percent_off_right(ros, bench, factor):
    ros.wait(lambda: bench.forecasts)
    measure_a_second(bench, factor)
    ros.wait(lambda: bench.forecasts[-1].samples >= 95)
    first, last = bench.forecasts[0], bench.forecasts[-1]
    truth = factor * SUM(np.array(last.times))
    ahead = np.array(last.times) >= 1.0
    error = np.abs(np.array(last.values) - truth)
    uncorrected = np.abs(np.array(first.values) - truth)
    assert error.max() < 0.1 * uncorrected.max()
    assert error[ahead].max() < 0.2 * uncorrected[ahead].max()
    assert (error <= np.array(last.bounds)).all()
    assert 8 <= len(bench.forecasts) <= 12
    assert len({time_of(forecast) for forecast in bench.forecasts}) == 1


def test_the_falling_wrench_follows_the_corrections(ros, bench):
    measure_a_second(bench)
    time = START + SECOND + 20 * STEP
    ros.wait(lambda: bench.wrenches and time_of(bench.wrenches[-1]) == time)
    np.testing.assert_allclose(load_of(bench.wrenches[-1]), measured(time), atol=0.02)


def test_diagnostics_tell_residual_and_outliers(bench):
    measure_a_second(bench, factor=1.0, noise=0.0)
    bench.measure((START + SECOND, (500.0, 0.0, 0.0, 0.0, 0.0, 0.0)))
    told = bench.node.describe()
    assert told["measurements"] == "100"
    assert told["outliers"] == "1"
    assert float(told["residual"].split()[0]) > 10.0
    assert float(told["off_axis"].split()[0]) > 10.0
    assert bench.node.health.reported["outlier"] == 1


def test_outliers_and_gaps_are_survived(ros, bench):
    rng = np.random.default_rng(3)
    wild = 0
    for block in (0, 10, 20, 60, 70, 80, 90):
        times = [START + k * STEP for k in range(block, block + 10)]
        loads = [measured(time, 1.2, 0.01, rng) for time in times]
        if block:
            loads[4], wild = 100.0 * loads[4], wild + 1
        bench.tick(times[-1])
        bench.measure(*zip(times, loads, strict=True))
    bench.tick(START + 2 * SECOND)
    ros.wait(lambda: bench.forecasts[-1].samples == 70 - wild)
    last = bench.forecasts[-1]
    np.testing.assert_allclose(last.values, 1.2 * SUM(np.array(last.times)), atol=0.05)


@pytest.mark.parametrize(
    ("late", "load", "code"),
    [
        (STEP, (math.nan, 0.0, 0.0, 0.0, 0.0, 0.0), "NOT_FINITE"),
        (STEP, (0.0, 0.0, 0.0, 0.0, -math.inf, 0.0), "NOT_FINITE"),
        (STEP, (1e200, 0.0, 0.0, 0.0, 0.0, 0.0), "OUT_OF_RANGE"),
        (0, LOAD, "OUT_OF_RANGE"),
        (-STEP, LOAD, "OUT_OF_RANGE"),
        (5 * SECOND, LOAD, "OUT_OF_RANGE"),
    ],
    ids=["nan", "infinite", "huge", "same stamp", "out of order", "far ahead"],
)
def test_bad_measurements_are_refused_and_change_nothing(bench, late, load, code):
    bench.tick(START + 3 * STEP)
    bench.measure((START + 2 * STEP, measured(START + 2 * STEP)))
    before = bench.node.onset.response.x
    bench.measure((START + 2 * STEP + late, load))
    assert bench.refused["measurement", code] == 1
    assert bench.node.onset.response.x is before
    bench.measure((START + 3 * STEP, measured(START + 3 * STEP)))
    assert bench.node.onset.response.samples == 2


def test_a_measurement_in_an_unknown_frame_is_refused_with_both_named(bench):
    bench.measure((START, LOAD), frame="moon")
    assert bench.refused["measurement", "UNKNOWN_FRAME"] == 1
    assert "moon" in bench.node.health.last_error
    assert "object" in bench.node.health.last_error


def test_measurements_outside_an_onset_are_passed_over(ros, client_node, tmp_path):
    bench = Bench(ros, client_node, tmp_path)
    bench.tick(START)
    bench.measure((START, LOAD))
    bench.onset(START + SECOND)
    bench.measure((START + STEP, LOAD))
    assert bench.node.onset.response.samples == 0
    assert not bench.refused


def test_a_clock_that_jumps_back_forgets_what_has_not_happened_yet(ros, bench):
    measure_a_second(bench)
    ros.wait(lambda: bench.forecasts[-1].samples)
    bench.tick(START + 10 * STEP)
    ros.wait(lambda: not bench.forecasts[-1].samples)
    bench.measure((START + 10 * STEP, measured(START + 10 * STEP)))
    assert bench.node.onset.response.samples == 1
    assert not bench.refused
