# SPDX-License-Identifier: Apache-2.0
"""From a bag of a measured force relaxation to a decay node that predicts the next one."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")
pytest.importorskip("rosbags", reason="rosbags is not installed: extra bags")

from limit_surface_interfaces.srv import PredictStop
from rosbags import rosbag2, typesys

from decay_helpers import SECOND, SURFACE, Bench, load_message, load_of, stamp_of, time_of
from limit_surface_ros.tools import fit_decay
from node_helpers import wrench_message

RECORDED = 500 * SECOND
ONSET = RECORDED + SECOND  # the gripper holds for a second and then lets go
STEP = SECOND // 100
HELD = np.array([8.0, -3.0, 0.5, 0.02, 0.0, 0.4])
WRENCH = "geometry_msgs/msg/WrenchStamped"
NOISE = 0.002


def relaxation(seconds):
    """Return what is left of the force: fast and slow creep of the contact."""
    return 0.75 * np.exp(-3.0 * seconds) + 0.25 * np.exp(-0.6 * seconds)


def write_bag(folder):
    """Record the wrench at 100 Hz, as ros2 bag does."""
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    types, rng = store.types, np.random.default_rng(0)
    vector = types["geometry_msgs/msg/Vector3"]
    with rosbag2.Writer(folder, version=9) as writer:
        topic = writer.add_connection("/wrist/wrench", WRENCH, typestore=store)
        for k in range(601):
            time = RECORDED + k * STEP
            left = relaxation(max(time - ONSET, 0) * 1e-9) + NOISE * rng.normal()
            numbers = left * HELD
            stamp = stamp_of(time)
            header = types["std_msgs/msg/Header"](
                types["builtin_interfaces/msg/Time"](stamp.sec, stamp.nanosec), "tool"
            )
            wrench = types["geometry_msgs/msg/Wrench"](vector(*numbers[:3]), vector(*numbers[3:]))
            data = store.serialize_cdr(types[WRENCH](header, wrench), WRENCH)
            writer.write(topic, time + SECOND // 1000, data)
    return folder


@pytest.fixture
def model_path(tmp_path):
    bag, path = write_bag(tmp_path / "bag"), tmp_path / "contact.yaml"
    chosen = ["--topic", "/wrist/wrench", "--field", "wrench.force.x", "--start", "1"]
    fit = ["--terms", "2", "--method", "esprit", "--norm", "2", "-o", str(path)]
    assert fit_decay.main([str(bag), *chosen, *fit]) == 0
    return path


def test_a_recorded_relaxation_predicts_the_next_one(ros, client_node, tmp_path, model_path):
    bench = Bench(ros, client_node, tmp_path, files=[model_path], stop_below=0.02)
    start = 10 * SECOND
    bench.tick(start)
    load = -0.5 * HELD
    bench.onset(start, load, "tool")
    bench.tick(start + 50 * STEP)
    bench.tick(start + 140 * STEP)
    ros.wait(lambda: len(bench.wrenches) == 141)
    times = (np.array([time_of(message) for message in bench.wrenches]) - start) * 1e-9
    loads = np.array([load_of(message) for message in bench.wrenches])
    truth = np.multiply.outer(relaxation(times), load)
    assert np.abs(loads - truth).max() < 0.01 * np.abs(load).max()
    assert bench.forecasts[0].model == "contact"
    assert bench.forecasts[0].header == load_message(start, frame="tool").header


def test_the_stop_of_a_push_is_that_of_the_true_relaxation(ros, client_node, tmp_path, model_path):
    Bench(ros, client_node, tmp_path, sim_time=False, files=[model_path])
    stop = ros.client(client_node, PredictStop, "/decay/predict_stop")
    answer = stop(PredictStop.Request(wrench=wrench_message([5.0, 1.0, 0.05])))
    factor = float(SURFACE.surface.load_factor([5.0, 1.0, 0.05]))
    times = np.linspace(0.0, 5.0, 500_001)
    expected = times[np.argmax(factor * relaxation(times) < 1.0)]
    assert answer.holds_from == pytest.approx(expected, abs=0.01)
    assert answer.earliest_holds_from < expected < answer.latest_holds_from
