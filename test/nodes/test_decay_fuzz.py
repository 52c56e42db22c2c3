# SPDX-License-Identifier: Apache-2.0
"""Whatever comes in, the decay node answers with a code and goes on."""

from __future__ import annotations

import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from limit_surface_interfaces.msg import ErrorCode
from limit_surface_interfaces.srv import EvaluateDecay, PredictStop, TimeToLevel

from decay_helpers import SECOND, Bench, load_message

CODES = {getattr(ErrorCode, name) for name in dir(type(ErrorCode)) if name.isupper()}
HARD = [0.0, -0.0, 1e308, -1e308, 5e-324, -1.0, 1e-200, float("nan"), float("inf"), -float("inf")]
numbers = st.one_of(st.sampled_from(HARD), st.floats(), st.floats(-10.0, 10.0))
names = st.one_of(st.sampled_from(["", "soft", "box"]), st.text(max_size=30), st.just("x" * 5000))
loads = st.one_of(
    st.lists(numbers, min_size=6, max_size=6), st.lists(st.floats(-9, 9), min_size=6, max_size=6)
)
stamps = st.one_of(
    st.just(0), st.integers(0, 2**31 * SECOND - 1), st.integers(9 * SECOND, 12 * SECOND)
)
frames = st.one_of(st.just("object"), st.text(st.characters(codec="utf-8"), max_size=20))
fuzz = settings(
    max_examples=40,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
    derandomize=True,
)


def writable(name):
    return name.encode("utf-8", "ignore").decode().replace("\0", "")


@pytest.fixture
def bench(ros, client_node, tmp_path):
    bench = Bench(ros, client_node, tmp_path, rate=50.0)
    bench.tick(10 * SECOND)
    return bench


def test_every_service_answers_every_request_with_a_code(ros, client_node, bench):
    evaluate = ros.client(client_node, EvaluateDecay, "/decay/evaluate")
    time_to_level = ros.client(client_node, TimeToLevel, "/decay/time_to_level")
    stop = ros.client(client_node, PredictStop, "/decay/predict_stop")

    @fuzz
    @given(names, names, st.lists(numbers, max_size=20), numbers, loads, stamps, frames)
    def ask(model, surface, times, level, load, stamp, frame):
        model, surface = writable(model), writable(surface)
        wrench = load_message(stamp, load, writable(frame))
        for answer in (
            evaluate(EvaluateDecay.Request(model=model, times=times)),
            time_to_level(TimeToLevel.Request(model=model, level=level)),
            stop(PredictStop.Request(model=model, surface=surface, wrench=wrench)),
        ):
            assert answer.error_code in CODES
            assert answer.error_code != ErrorCode.INTERNAL, answer.error_msg
            assert bool(answer.error_msg) == (answer.error_code != ErrorCode.NONE)

    ask()


def test_onsets_and_measurements_of_any_kind_never_break_the_stream(ros, bench):
    @fuzz
    @given(loads, stamps, frames, st.lists(st.tuples(stamps, loads), max_size=8))
    def feed(load, stamp, frame, samples):
        bench.onset(stamp, load, writable(frame))
        bench.measure(*samples, frame=writable(frame))

    feed()
    assert not [key for key in bench.refused if key[1] == "INTERNAL"], bench.node.health.last_error
    bench.values.clear()
    bench.onset(10 * SECOND)
    bench.tick(11 * SECOND)
    ros.wait(lambda: len(bench.values) == 51)
