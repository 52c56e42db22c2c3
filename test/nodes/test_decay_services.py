# SPDX-License-Identifier: Apache-2.0
"""The services of the decay node answer as the library does, or say why not."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from limit_surface_interfaces.msg import ErrorCode
from limit_surface_interfaces.srv import EvaluateDecay, ListDecays, PredictStop, TimeToLevel
from std_srvs.srv import Trigger

from decay_helpers import SUM, SURFACE, Bench, write_decay
from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.motion.holding import holds_from
from node_helpers import STAMP, planar_twist, wrench_message

FADING = ExponentialSum([-0.7], [2.0])
MAX_ERROR = 0.02


@pytest.fixture
def bench(ros, client_node, tmp_path):
    files = [
        write_decay(tmp_path, "kinked", SUM, MAX_ERROR, (0.0, 4.0)),
        write_decay(tmp_path, "fading", FADING),
        write_decay(tmp_path, "late", ExponentialSum([-1.0, -2.0], [1.0, -1.0])),
    ]
    return Bench(ros, client_node, tmp_path, sim_time=False, files=files)


@pytest.fixture
def evaluate(ros, client_node, bench):
    return ros.client(client_node, EvaluateDecay, "/decay/evaluate")


@pytest.fixture
def time_to_level(ros, client_node, bench):
    return ros.client(client_node, TimeToLevel, "/decay/time_to_level")


@pytest.fixture
def stop(ros, client_node, bench):
    return ros.client(client_node, PredictStop, "/decay/predict_stop")


def test_models_are_listed_with_what_tells_them_apart(ros, client_node, bench):
    listed = ros.client(client_node, ListDecays, "/decay/list_models")(ListDecays.Request())
    assert listed.error_code == ErrorCode.NONE
    assert [model.name for model in listed.models] == ["kinked", "fading", "late"]
    assert [model.is_default for model in listed.models] == [True, False, False]
    kinked, fading = listed.models[:2]
    assert (kinked.terms, kinked.bound, kinked.bound_until) == (SUM.terms, MAX_ERROR, 4.0)
    assert (fading.onset_value, fading.slowest_rate) == (2.0, -0.7)


def test_values_equal_the_library_in_any_order(evaluate):
    times = [3.0, 0.0, 0.5, 0.5, 1e6]
    answer = evaluate(EvaluateDecay.Request(times=times))
    np.testing.assert_allclose(answer.values, SUM(times), rtol=0, atol=1e-12)
    assert (answer.bound, answer.bound_from, answer.bound_until) == (MAX_ERROR, 0.0, 4.0)
    assert (answer.error_code, answer.error_msg) == (ErrorCode.NONE, "")
    other = evaluate(EvaluateDecay.Request(model="fading", times=times))
    np.testing.assert_allclose(other.values, FADING(times), rtol=0, atol=1e-12)


def test_no_times_have_no_values_and_a_million_have_a_million(evaluate):
    assert len(evaluate(EvaluateDecay.Request()).values) == 0
    times = np.linspace(0.0, 5.0, 1_000_000)
    answer = evaluate(EvaluateDecay.Request(times=times))
    np.testing.assert_allclose(answer.values, SUM(times), rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("times", "code"),
    [
        ([0.0, math.nan], ErrorCode.NOT_FINITE),
        ([math.inf], ErrorCode.NOT_FINITE),
        ([1.0, -1e-9], ErrorCode.OUT_OF_RANGE),
    ],
)
def test_bad_times_get_a_code_and_the_node_goes_on(evaluate, times, code):
    answer = evaluate(EvaluateDecay.Request(times=times))
    assert answer.error_code == code
    assert len(answer.error_msg.split()) > 3
    assert len(answer.values) == 0
    assert evaluate(EvaluateDecay.Request(times=[0.0])).error_code == ErrorCode.NONE


def test_time_to_level_is_the_librarys(time_to_level):
    answer = time_to_level(TimeToLevel.Request(level=0.1))
    assert answer.reached
    assert answer.time == SUM.time_to_level(0.1)
    above = time_to_level(TimeToLevel.Request(model="fading", level=5.0))
    assert (above.reached, above.time) == (True, 0.0)


def test_a_level_that_is_never_reached_is_an_answer(time_to_level):
    answer = time_to_level(TimeToLevel.Request(level=0.0))
    assert answer.error_code == ErrorCode.NONE
    assert (answer.reached, answer.time) == (False, math.inf)


@pytest.mark.parametrize(
    ("level", "code"),
    [
        (-1.0, ErrorCode.OUT_OF_RANGE),
        (math.nan, ErrorCode.NOT_FINITE),
        (math.inf, ErrorCode.NOT_FINITE),
    ],
)
def test_bad_levels_get_a_code(time_to_level, level, code):
    answer = time_to_level(TimeToLevel.Request(level=level))
    assert answer.error_code == code
    assert not answer.reached


@pytest.mark.parametrize("level", [5e-324, 1e-300, 1e-12, 1e300])
def test_any_level_is_answered(time_to_level, level):
    answer = time_to_level(TimeToLevel.Request(level=level))
    assert answer.error_code == ErrorCode.NONE
    assert answer.reached
    assert abs(float(SUM(answer.time))) <= level * (1.0 + 1e-6) + 5e-324


def test_the_stop_of_one_exponential_is_the_closed_form(stop):
    wrench = np.array([6.0, 3.0, 0.2])
    factor = float(SURFACE.surface.load_factor(wrench))
    answer = stop(PredictStop.Request(model="fading", wrench=wrench_message(wrench)))
    assert answer.error_code == ErrorCode.NONE
    assert answer.slides
    assert answer.load_factor == pytest.approx(factor, rel=1e-12)
    assert answer.holds_from == pytest.approx(math.log(factor) / 0.7, abs=1e-9)
    np.testing.assert_allclose(
        planar_twist(answer.twist), SURFACE.surface.twist_of_wrench(wrench), atol=1e-12
    )
    assert answer.twist.header.stamp == STAMP
    assert answer.twist.header.frame_id == "object"
    times = np.array(answer.times)
    np.testing.assert_allclose(answer.load_factors, factor * np.exp(-0.7 * times), rtol=1e-12)
    slides = np.array(answer.load_factors) > 1.0
    assert (slides == (times < answer.holds_from)).all()


def test_the_stop_of_a_fitted_model_comes_with_its_error_bound(stop):
    wrench = [6.0, 3.0, 0.2]
    answer = stop(PredictStop.Request(surface="box", wrench=wrench_message(wrench)))
    expected = holds_from(SUM, float(SURFACE.surface.load_factor(wrench)), MAX_ERROR)
    assert answer.holds_from == expected.time
    assert answer.earliest_holds_from == expected.earliest < answer.holds_from
    assert answer.latest_holds_from == expected.latest > answer.holds_from


def test_a_push_below_the_limit_stops_at_once(stop):
    answer = stop(PredictStop.Request(wrench=wrench_message([0.1, 0.0, 0.0])))
    assert (answer.error_code, answer.slides, answer.holds_from) == (ErrorCode.NONE, False, 0.0)


@pytest.mark.parametrize(
    ("fields", "code"),
    [
        ({"wrench": wrench_message([math.nan, 0, 0])}, ErrorCode.NOT_FINITE),
        ({"wrench": wrench_message([0, 0, 0])}, ErrorCode.ZERO_VECTOR),
        ({"wrench": wrench_message([9, 0, 0], frame="moon")}, ErrorCode.UNKNOWN_FRAME),
        ({"model": "sofa"}, ErrorCode.UNKNOWN_MODEL),
        ({"surface": "sofa"}, ErrorCode.UNKNOWN_MODEL),
        ({"model": "late"}, ErrorCode.BAD_MODEL),
    ],
    ids=["nan", "zero", "frame", "model", "surface", "starts at zero"],
)
def test_what_cannot_be_predicted_gets_a_code_and_a_sentence(stop, fields, code):
    request = PredictStop.Request(**{"wrench": wrench_message([9.0, 0.0, 0.0]), **fields})
    answer = stop(request)
    assert answer.error_code == code
    assert len(answer.error_msg.split()) > 3
    assert not answer.slides
    assert stop(PredictStop.Request(wrench=request.wrench, model="fading")) is not None


@pytest.mark.parametrize("broken", ["kinked.yaml", "surface.yaml"])
def test_reload_swaps_decay_models_and_surfaces_together_or_neither(
    ros, client_node, bench, evaluate, tmp_path, broken
):
    reload = ros.client(client_node, Trigger, "/decay/reload")
    write_decay(tmp_path, "fading", ExponentialSum([-9.0], [3.0]))
    good = (tmp_path / broken).read_text()
    (tmp_path / broken).write_text(good[: len(good) // 2])
    refused = reload(Trigger.Request())
    assert not refused.success
    assert broken in refused.message
    before = evaluate(EvaluateDecay.Request(model="fading", times=[1.0]))
    assert before.values[0] == pytest.approx(float(FADING(1.0)))
    (tmp_path / broken).write_text(good)
    done = reload(Trigger.Request())
    assert done.success, done.message
    after = evaluate(EvaluateDecay.Request(model="fading", times=[1.0]))
    assert after.values[0] == pytest.approx(3.0 * math.exp(-9.0))


def test_an_unknown_surface_is_named_with_those_that_are_loaded(stop):
    answer = stop(PredictStop.Request(wrench=wrench_message([9, 0, 0]), surface="sofa"))
    assert answer.error_code == ErrorCode.UNKNOWN_MODEL
    assert answer.error_msg == f"no surface 'sofa' is loaded; loaded are {SURFACE.name}"
