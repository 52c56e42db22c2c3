# SPDX-License-Identifier: Apache-2.0
"""The running onset answers as it is known now, says when no model fits, and becomes a model."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from limit_surface_interfaces.msg import ErrorCode, TimeLeft
from limit_surface_interfaces.srv import EvaluateDecay, FitRunning, TimeToLevel
from rclpy.qos import QoSProfile

from decay_helpers import (
    LATCHED,
    LOAD,
    SECOND,
    Bench,
    DecayForecast,
    WrenchStamped,
    load_message,
    time_of,
    write_decay,
)
from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.decay.tail import Tail
from limit_surface_ros.files.decay_file import DecayModel, read_decay_model, write_decay_model
from node_helpers import Program

START = 50 * SECOND
STEP = SECOND // 100
FADING = ExponentialSum([-0.7], [2.0])
AT = [0.0, 0.5, 1.0, 2.0]
RESPONSES = {
    "as fitted": lambda t: np.exp(-0.7 * t),
    "slower": lambda t: np.exp(-0.35 * t),
    "late": lambda t: np.exp(-0.7 * np.maximum(t - 0.2, 0.0)),
    "reversed": lambda t: -np.exp(-0.7 * t),
    "of no family": lambda t: np.exp(-(t**2)),
}


def samples(name, start, noise=0.01):
    """Return a second of measurements of a response, (time [ns], load)."""
    random = np.random.default_rng(3)
    response = RESPONSES[name]
    return [
        (start + k * STEP, (float(response(k * 0.01)) + noise * random.normal()) * np.array(LOAD))
        for k in range(101)
    ]


@pytest.fixture
def bench(ros, client_node, tmp_path):
    folder = tmp_path / "learnt"
    folder.mkdir()
    files = [write_decay(tmp_path, "fading", FADING, 0.001)]
    bench = Bench(
        ros, client_node, tmp_path, files=files, learnt_folder=str(folder), forecast_period=0.0
    )
    bench.folder = folder
    bench.left = ros.listen(client_node, TimeLeft, "/decay/time_left", QoSProfile(depth=1000))
    ros.wait(lambda: bench.node.count_subscribers("/decay/time_left"))
    bench.tick(START)
    return bench


@pytest.fixture
def measured(bench):
    def measure(name):
        bench.onset(START)
        bench.tick(START + SECOND)
        bench.measure(*samples(name, START))
        bench.tick(START + SECOND + STEP)
        bench.ros.wait(lambda: bench.forecasts[-1].samples >= 90)
        return bench.forecasts[-1]

    return measure


@pytest.fixture
def evaluate(ros, client_node, bench):
    return ros.client(client_node, EvaluateDecay, "/decay/evaluate")


@pytest.fixture
def fit_running(ros, client_node, bench):
    return ros.client(client_node, FitRunning, "/decay/fit_running")


def test_the_running_onset_answers_as_measurements_have_corrected_it(
    ros, client_node, bench, evaluate, measured
):
    measured("slower")
    answer = evaluate(EvaluateDecay.Request(running=True, times=AT))
    assert answer.error_code == ErrorCode.NONE, answer.error_msg
    truth = 2.0 * np.exp(-0.35 * np.array(AT))
    assert (np.abs(np.array(answer.values) - truth) <= np.array(answer.bounds)).all()
    assert max(answer.bounds[:3]) < 0.1
    fitted = evaluate(EvaluateDecay.Request(times=AT))
    np.testing.assert_allclose(fitted.values, FADING(np.array(AT)))
    np.testing.assert_array_equal(fitted.bounds, 0.001)
    time_to_level = ros.client(client_node, TimeToLevel, "/decay/time_to_level")
    running = time_to_level(TimeToLevel.Request(running=True, level=0.5))
    assert running.reached
    assert running.time == pytest.approx(math.log(4.0) / 0.35, rel=0.1)
    assert time_to_level(TimeToLevel.Request(level=0.5)).time == pytest.approx(math.log(4.0) / 0.7)


@pytest.mark.parametrize(
    ("name", "family"),
    [("as fitted", "amplitude"), ("slower", "rate"), ("late", "delay"), ("reversed", "amplitude")],
)
def test_a_forecast_says_which_response_follows_the_measurements(bench, measured, name, family):
    forecast = measured(name)
    assert forecast.fits, forecast.reason
    assert forecast.family == family
    assert forecast.reversed == (name == "reversed")
    assert forecast.amplitude == pytest.approx(-1.0 if name == "reversed" else 1.0, abs=0.1)
    assert forecast.rate == pytest.approx(0.5 if name == "slower" else 1.0, abs=0.1)
    assert forecast.delay == pytest.approx(0.2 if name == "late" else 0.0, abs=0.05)
    assert ("sign reversed" in bench.node.health.reported) == (name == "reversed")
    known = np.isfinite(forecast.bounds)
    times = np.array(forecast.times)
    if family == "amplitude":
        assert forecast.known_until == math.inf
        np.testing.assert_array_equal(known, times <= 6.0)
    else:
        assert forecast.known_until == pytest.approx(3.0, abs=0.1)
        np.testing.assert_array_equal(known, times <= forecast.known_until)
    errors = np.abs(np.array(forecast.values) - 2.0 * RESPONSES[name](times))
    assert (errors[known] <= np.array(forecast.bounds)[known]).all()


def test_a_response_of_no_family_is_told(ros, client_node, bench, evaluate, measured):
    forecast = measured("of no family")
    assert not forecast.fits
    assert "no family" in forecast.reason
    assert bench.node.health.reported["model does not fit"] >= 1
    assert "no family" in bench.node.describe()["verdict"]
    answer = evaluate(EvaluateDecay.Request(running=True, times=[1.0, 2.0]))
    truth = 2.0 * np.exp(-np.array([1.0, 4.0]))
    assert (np.abs(np.array(answer.values) - truth) <= np.array(answer.bounds)).all()


def test_the_time_that_is_left_runs_down_to_the_end(ros, bench):
    bench.onset(START)
    bench.run(START, START + SECOND)
    ros.wait(lambda: bench.left and time_of(bench.left[-1]) == START + SECOND)
    last = bench.left[-1]
    assert last.header.frame_id == "object"
    end = math.log(100.0) / 0.7
    assert last.end_time == pytest.approx(end, rel=1e-6)
    assert last.time_left == pytest.approx(end - 1.0, rel=1e-6)
    assert last.fraction == pytest.approx(math.exp(-0.7), rel=1e-6)
    assert last.fits


def test_what_was_learnt_becomes_a_model_file(bench, fit_running, measured):
    measured("slower")
    answer = fit_running(FitRunning.Request(name="slow"))
    assert answer.error_code == ErrorCode.NONE, answer.error_msg
    assert answer.path == str(bench.folder / "slow.yaml")
    assert answer.family == "rate"
    assert answer.rate == pytest.approx(0.5, abs=0.1)
    model = read_decay_model(answer.path)
    assert model.name == "slow"
    assert model.max_error == answer.max_error
    times = np.linspace(*model.time_span, 200)
    assert np.abs(model.sum(times) - 2.0 * np.exp(-0.35 * times)).max() <= model.max_error
    assert model.fit["model"] == "fading"
    again = fit_running(FitRunning.Request(name="slow"))
    assert again.error_code == ErrorCode.BAD_FILE
    assert "replace" in again.error_msg
    assert fit_running(FitRunning.Request(name="slow", replace=True)).error_code == 0


@pytest.mark.parametrize(
    "name", ["", "../out", "a/b", ".hidden", "x" * 101, "sp ace", "name.yaml", "\u00e9"]
)
def test_names_that_could_lead_elsewhere_are_refused(bench, fit_running, measured, name):
    measured("as fitted")
    answer = fit_running(FitRunning.Request(name=name))
    assert answer.error_code == ErrorCode.OUT_OF_RANGE
    assert not list(bench.folder.iterdir())


def test_nothing_is_written_of_what_was_not_learnt(bench, evaluate, fit_running, measured):
    assert fit_running(FitRunning.Request(name="early")).error_code == ErrorCode.UNAVAILABLE
    refused = evaluate(EvaluateDecay.Request(running=True, times=AT))
    assert refused.error_code == ErrorCode.UNAVAILABLE
    assert "no onset" in refused.error_msg
    bench.onset(START)
    few = fit_running(FitRunning.Request(name="few"))
    assert few.error_code == ErrorCode.BAD_DATA
    assert "0 measurements" in few.error_msg
    measured("of no family")
    unlike = fit_running(FitRunning.Request(name="unlike"))
    assert unlike.error_code == ErrorCode.BAD_DATA
    assert "no family" in unlike.error_msg
    assert not list(bench.folder.iterdir())


def test_without_a_folder_no_model_is_written(ros, client_node, tmp_path):
    bench = Bench(ros, client_node, tmp_path)
    bench.tick(START)
    bench.onset(START)
    answer = ros.client(client_node, FitRunning, "/decay/fit_running")(
        FitRunning.Request(name="learnt")
    )
    assert answer.error_code == ErrorCode.UNAVAILABLE
    assert "learnt_folder" in answer.error_msg


@pytest.mark.parametrize(
    ("request_", "code"),
    [
        ({"model": "other"}, ErrorCode.OUT_OF_RANGE),
        ({"times": [-1.0]}, ErrorCode.OUT_OF_RANGE),
        ({"times": [math.nan]}, ErrorCode.NOT_FINITE),
        ({"times": [0.0] * 10_001}, ErrorCode.OUT_OF_RANGE),
    ],
)
def test_bad_requests_for_the_running_onset_are_refused(bench, evaluate, request_, code):
    bench.onset(START)
    answer = evaluate(EvaluateDecay.Request(running=True, **{"times": AT, **request_}))
    assert answer.error_code == code
    assert not len(answer.values)


def test_bounds_after_the_time_span_are_those_of_the_tail(ros, client_node, tmp_path):
    tail = Tail(0.05, 0.02, "after 6 s it stays small")
    path = tmp_path / "tailed.yaml"
    write_decay_model(DecayModel("tailed", FADING, (0.0, 6.0), "inf", 0.01, tail=tail), path)
    files = [path, write_decay(tmp_path, "silent", FADING, 0.01)]
    bench = Bench(ros, client_node, tmp_path, files=files, horizon=10.0)
    evaluate = ros.client(client_node, EvaluateDecay, "/decay/evaluate")
    at = [1.0, 6.0, 6.1, 1000.0]
    for name, after in (("tailed", 0.07), ("silent", math.inf)):
        answer = evaluate(EvaluateDecay.Request(model=name, times=at))
        np.testing.assert_allclose(answer.bounds, [0.01, 0.01, after, after], rtol=1e-12)
    bench.tick(START)
    bench.onset(START)
    ros.wait(lambda: bench.forecasts)
    forecast = bench.forecasts[-1]
    late = np.array(forecast.times) > 6.0
    np.testing.assert_allclose(np.array(forecast.bounds)[late], 0.07, rtol=1e-12)


def test_a_program_learns_answers_and_writes_whatever_the_response(ros, client_node, tmp_path):
    folder = tmp_path / "learnt"
    folder.mkdir()
    path = write_decay(tmp_path, "fading", FADING, 0.001)
    arguments = ["-p", f"model_files:=['{path}']", "-p", f"learnt_folder:={folder}"]
    # Running for half a minute, so that a busy machine has not come to its end meanwhile.
    arguments += ["-p", "stop_below:=1.0e-12"]
    known = {}
    with Program("decay_node", "--ros-args", *arguments) as program:
        forecasts = ros.listen(client_node, DecayForecast, "/decay/forecast", LATCHED)
        left = ros.listen(client_node, TimeLeft, "/decay/time_left", QoSProfile(depth=1000))
        onsets = client_node.create_publisher(WrenchStamped, "/decay/onset", 10)
        measurements = client_node.create_publisher(WrenchStamped, "/decay/measurement", 1000)
        ros.matched(onsets)
        ros.matched(measurements)
        evaluate = ros.client(client_node, EvaluateDecay, "/decay/evaluate")
        fit_running = ros.client(client_node, FitRunning, "/decay/fit_running")
        for name in RESPONSES:
            start = client_node.get_clock().now().nanoseconds - SECOND
            stamp = load_message(start).header.stamp
            forecasts.clear()
            left.clear()
            onsets.publish(load_message(start))
            ros.wait(lambda stamp=stamp: forecasts and forecasts[-1].header.stamp == stamp)
            for time, load in samples(name, start):
                measurements.publish(load_message(time, load))
            ros.wait(lambda: forecasts[-1].samples >= 90 and left)
            answer = evaluate(EvaluateDecay.Request(running=True, times=[1.0]))
            written = fit_running(FitRunning.Request(name=name.replace(" ", "_")))
            known[name] = forecasts[-1], answer, written
        code, output = program.end()
    assert code == 0, output
    for name, (forecast, answer, written) in known.items():
        fits = name != "of no family"
        assert forecast.fits == fits, (name, forecast.reason)
        assert forecast.reversed == (name == "reversed")
        assert abs(answer.values[0] - 2.0 * float(RESPONSES[name](1.0))) <= answer.bounds[0], name
        assert (written.error_code == ErrorCode.NONE) == fits
        assert (folder / f"{name.replace(' ', '_')}.yaml").exists() == fits
