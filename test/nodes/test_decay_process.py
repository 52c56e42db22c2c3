# SPDX-License-Identifier: Apache-2.0
"""The decay program and the program with both nodes: start, stream in wall time, end cleanly."""

from __future__ import annotations

import signal

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from geometry_msgs.msg import WrenchStamped
from limit_surface_interfaces.msg import ErrorCode
from limit_surface_interfaces.srv import EvaluateDecay, PredictStop, WrenchToTwist
from rclpy.qos import QoSProfile

from decay_helpers import LOAD, SECOND, Bench, load_message, load_of, time_of, write_decay
from limit_surface_ros.decay.exponential_sum import ExponentialSum
from node_helpers import Program, planar_twist, wrench_message

SLOW = ExponentialSum([-0.05], [2.0])


@pytest.mark.parametrize("rate", [100.0, 1000.0])
def test_stamps_in_wall_time_follow_each_other_at_the_rate_and_never_run_ahead(
    ros, client_node, tmp_path, rate
):
    files = [write_decay(tmp_path, x=SLOW)]
    bench = Bench(ros, client_node, tmp_path, sim_time=False, files=files, rate=rate)
    bench.onset(0)
    count = int(rate)
    ros.wait(lambda: len(bench.wrenches) >= count)
    stamps = np.array([time_of(message) for message in bench.wrenches[:count]])
    # A message that is stamped later has not been published yet.
    assert stamps[-1] <= bench.now
    np.testing.assert_array_equal(np.diff(stamps), round(SECOND / rate))
    start = time_of(bench.forecasts[0])
    times = (stamps - start) * 1e-9
    loads = np.array([load_of(message) for message in bench.wrenches[:count]])
    expected = np.multiply.outer(np.exp(-0.05 * times), LOAD)
    np.testing.assert_allclose(loads, expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("number", "executor"), [(signal.SIGINT, "single_threaded"), (signal.SIGTERM, "events")]
)
def test_the_program_streams_to_other_processes_until_a_signal_ends_it_cleanly(
    ros, client_node, tmp_path, number, executor
):
    path = write_decay(tmp_path, x=SLOW)
    arguments = ["-p", f"model_files:=['{path}']", "-p", f"executor:={executor}"]
    with Program("decay_node", "--ros-args", *arguments) as program:
        wrenches = ros.listen(client_node, WrenchStamped, "/decay/wrench", QoSProfile(depth=1000))
        onsets = client_node.create_publisher(WrenchStamped, "/decay/onset", 10)
        ros.matched(onsets)
        onsets.publish(load_message(0))
        ros.wait(lambda: len(wrenches) >= 20)
        code, output = program.end(number)
    assert code == 0, output
    assert "Traceback" not in output
    assert "terminate" not in output


@pytest.mark.parametrize(
    ("broken", "told"),
    [
        ("surface_files:=['/nowhere/box.yaml']", "/nowhere/box.yaml"),
        ("default_surface:=sofa", "sofa"),
        ("rate:=0.0", "rate"),
        ("forgetting:=2.0", "forgetting"),
    ],
)
def test_a_bad_parameter_at_start_is_told_in_one_line(tmp_path, broken, told):
    with Program("decay_node", "--ros-args", "-p", broken) as program:
        code, output = program.ended()
    assert code == 1
    assert told in output
    assert "Traceback" not in output


@pytest.mark.parametrize("executor", ["single_threaded", "events"])
def test_both_nodes_serve_in_one_process_and_end_cleanly(ros, client_node, executor):
    given = "--ros-args", "-p", f"executor:={executor}"
    with Program("force_motion_nodes", *given) as program:
        forward = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
        evaluate = ros.client(client_node, EvaluateDecay, "/decay/evaluate")
        stop = ros.client(client_node, PredictStop, "/decay/predict_stop")
        load = wrench_message([9.0, 2.0, 0.1])
        moved = forward(WrenchToTwist.Request(wrench=load))
        assert moved.error_code == ErrorCode.NONE, moved.error_msg
        assert evaluate(EvaluateDecay.Request(times=[0.0])).error_code == ErrorCode.NONE
        stopped = stop(PredictStop.Request(wrench=load))
        assert stopped.error_code == ErrorCode.NONE, stopped.error_msg
        assert stopped.load_factor == pytest.approx(moved.load_factor, rel=1e-12)
        # One of the nodes may have its table of support points before the other has.
        expected = pytest.approx(planar_twist(moved.twist), rel=1e-12)
        assert planar_twist(stopped.twist) == expected
        code, output = program.end()
    assert code == 0, output
    assert "Traceback" not in output


def test_topics_of_both_nodes_are_renamed_apart_by_the_rules_of_the_launch_file(ros, client_node):
    rules = "-r", "limit_surface:~/wrench:=/ft", "-r", "decay:~/onset:=/lost"
    with Program("force_motion_nodes", "--ros-args", "-r", "__ns:=/left", *rules) as program:

        def topics():
            return {name for name, _ in client_node.get_topic_names_and_types()}

        kept = {"/left/limit_surface/twist", "/left/decay/wrench", "/left/decay/measurement"}
        ros.wait(lambda: {"/ft", "/lost"} | kept <= topics())
        assert not {"/left/limit_surface/wrench", "/left/decay/onset"} & topics()
        assert program.end()[0] == 0
