# SPDX-License-Identifier: Apache-2.0
"""Diagnostics tell what the node sees: counts, ages, stale inputs, mismatched peers."""

from __future__ import annotations

import math

import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import TwistStamped, Vector3Stamped, WrenchStamped
from limit_surface_interfaces.srv import WrenchToTwist
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock

from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
from node_helpers import wrench_message


class Watch:
    """A node, a publisher of its wrenches, and what it says of itself."""

    def __init__(self, ros, client, path, **parameters):
        self._ros = ros
        parameters = {"diagnostics_period": 0.05, **parameters}
        self.node = ros.add(LimitSurfaceNode, files=[path], parameters=parameters)
        self.arrays = ros.listen(client, DiagnosticArray, "/diagnostics")
        self.twists = ros.listen(client, TwistStamped, "/limit_surface/predicted_twist")
        self.loads = client.create_publisher(WrenchStamped, "/limit_surface/wrench", 10)
        ros.matched(self.loads)
        ros.matched(self.node._twists)

    @property
    def status(self):
        return self.arrays[-1].status[0] if self.arrays else None

    @property
    def values(self):
        return {item.key: item.value for item in self.status.values} if self.status else {}

    def wait(self, condition):
        """Wait for diagnostics that fulfil a condition."""
        self._ros.wait(lambda: self.arrays and condition())


@pytest.fixture
def watch(ros, client_node, model_file):
    _, path = model_file()
    return lambda **parameters: Watch(ros, client_node, path, **parameters)


@pytest.fixture
def stranger():
    """Return a node of another process as far as DDS can tell: one has a single type a topic."""
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node("stranger", context=context)
    yield node
    node.destroy_node()
    context.try_shutdown()


def test_counts_ages_times_and_the_last_error_are_told(ros, client_node, watch):
    seen = watch()
    for wrench in ([9, 0, 0], [math.nan, 0, 0], [math.inf, 0, 0], [9, 0, 0]):
        seen.loads.publish(wrench_message(wrench))
    seen.loads.publish(wrench_message([9, 0, 0], frame="moon"))
    seen.wait(lambda: seen.values.get("refused wrench UNKNOWN_FRAME") == "1")
    assert "moon" in seen.values["last error"]
    call = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
    call(WrenchToTwist.Request(wrench=wrench_message([9, 0, 0])))
    call(WrenchToTwist.Request(wrench=wrench_message([0, 0, 0])))
    seen.wait(lambda: seen.values.get("accepted wrench") == "2")
    seen.wait(lambda: seen.values.get("refused wrench_to_twist ZERO_VECTOR") == "1")
    values = seen.values
    assert values["refused wrench NOT_FINITE"] == "2"
    assert values["accepted wrench_to_twist"] == "1"
    assert values["model"] == "box"
    assert float(values["input age wrench [s]"]) >= 0.0
    assert values["input age twist [s]"] == "none yet"
    assert values["mismatched peers"] == "0"
    assert "zero" in values["last error"]
    assert {"callback time mean [ms]", "callback time max [ms]"} <= set(values)
    assert seen.status.name == "limit_surface"


def test_diagnostics_come_once_a_second_by_default(ros, client_node, model_file):
    node = ros.add(LimitSurfaceNode, files=[model_file()[1]])
    assert node._diagnostics._timer.timer_period_ns == 10**9


def test_refused_input_is_a_warning_for_one_period(watch):
    seen = watch(input_timeout=0.0, diagnostics_period=0.2)
    seen.wait(lambda: seen.status.level == DiagnosticStatus.OK)
    before = len(seen.arrays)
    seen.loads.publish(wrench_message([math.nan, 0, 0]))

    def since():
        return [array.status[0] for array in seen.arrays[before:]]

    def warnings():
        return [status for status in since() if status.level == DiagnosticStatus.WARN]

    seen.wait(lambda: warnings() and since()[-1].level == DiagnosticStatus.OK)
    (warning,) = warnings()
    assert "refused" in warning.message


def test_an_input_that_stops_is_stale_and_the_next_good_one_recovers(ros, watch):
    seen = watch(input_timeout=0.2)
    seen.wait(lambda: seen.status.level == DiagnosticStatus.OK)
    seen.loads.publish(wrench_message([9, 0, 0]))
    ros.wait(lambda: len(seen.twists) == 1)
    seen.wait(lambda: seen.status.level == DiagnosticStatus.STALE)
    assert "wrench" in seen.status.message
    # A bad message does not make an input fresh.
    seen.loads.publish(wrench_message([math.nan, 0, 0]))
    ros.wait(lambda: seen.node.health.refused["wrench", "NOT_FINITE"] == 1)
    count = len(seen.arrays)
    seen.wait(lambda: len(seen.arrays) > count)
    assert seen.status.level == DiagnosticStatus.STALE
    assert len(seen.twists) == 1
    timer = seen.node.create_timer(0.02, lambda: seen.loads.publish(wrench_message([9, 0, 0])))
    seen.wait(lambda: seen.status.level == DiagnosticStatus.OK)
    ros.wait(lambda: len(seen.twists) > 1)
    timer.cancel()


def test_staleness_counts_in_simulated_time_also_when_it_jumps_back(ros, client_node, watch):
    seen = watch(input_timeout=5.0, use_sim_time=True)
    clock = client_node.create_publisher(Clock, "/clock", 10)
    ros.matched(clock)

    def set_time(second):
        message = Clock()
        message.clock.sec = second
        clock.publish(message)
        ros.wait(lambda: seen.node.get_clock().now().nanoseconds == second * 10**9)

    def fresh_status():
        count = len(seen.arrays)
        seen.wait(lambda: len(seen.arrays) > count + 1)
        return seen.status.level

    assert fresh_status() == DiagnosticStatus.WARN
    assert "/clock has not come yet" in seen.status.message
    set_time(1000)
    seen.loads.publish(wrench_message([9, 0, 0]))
    ros.wait(lambda: len(seen.twists) == 1)
    assert fresh_status() == DiagnosticStatus.OK
    set_time(1010)
    assert fresh_status() == DiagnosticStatus.STALE
    set_time(10)
    assert fresh_status() == DiagnosticStatus.OK
    seen.loads.publish(wrench_message([9, 0, 0]))
    ros.wait(lambda: len(seen.twists) == 2)
    assert fresh_status() == DiagnosticStatus.OK
    set_time(20)
    assert fresh_status() == DiagnosticStatus.STALE


@pytest.mark.parametrize(
    ("kind", "topic", "word"),
    [
        (TwistStamped, "predicted_twist", "ransient local subscription"),
        (Vector3Stamped, "predicted_twist", "Vector3Stamped"),
        (DiagnosticArray, "surface", "DiagnosticArray"),
    ],
)
def test_a_subscriber_that_gets_nothing_is_told_of_until_it_goes(
    stranger, watch, kind, topic, word
):
    seen = watch()
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    deaf = stranger.create_subscription(kind, f"/limit_surface/{topic}", lambda _: None, latched)
    told = f"/stranger cannot communicate on ~/{topic}"
    seen.wait(lambda: seen.status.message.startswith(told))
    assert seen.status.level == DiagnosticStatus.WARN
    assert seen.values["mismatched peers"] == "1"
    assert word in seen.status.message
    stranger.destroy_subscription(deaf)
    seen.wait(lambda: seen.values.get("mismatched peers") == "0")
    assert seen.status.level == DiagnosticStatus.OK


def test_a_second_node_of_the_same_name_is_told_of(stranger, watch):
    seen = watch()
    seen.wait(lambda: seen.values.get("duplicates") == "0")
    other = rclpy.create_node("limit_surface", context=stranger.context)
    try:
        seen.wait(lambda: seen.values.get("duplicates") == "1")
        assert seen.status.level == DiagnosticStatus.WARN
        assert "1 other node(s) named /limit_surface" in seen.status.message
    finally:
        other.destroy_node()
    seen.wait(lambda: seen.status.level == DiagnosticStatus.OK)


def test_a_publisher_that_is_not_heard_is_told_of(stranger, watch):
    seen = watch()
    stranger.create_publisher(Vector3Stamped, "/limit_surface/twist", 1)
    seen.wait(lambda: seen.values.get("mismatched peers") == "1")
    assert "Vector3Stamped" in seen.status.message


def test_topics_renamed_onto_each_other_are_still_told_apart(
    ros, client_node, stranger, model_file
):
    _, path = model_file()
    swap = ["~/wrench:=/limit_surface/twist", "~/twist:=/limit_surface/wrench"]
    ros.add(LimitSurfaceNode, files=[path], parameters={"diagnostics_period": 0.05}, remap=swap)
    arrays = ros.listen(client_node, DiagnosticArray, "/diagnostics")
    stranger.create_publisher(WrenchStamped, "/limit_surface/twist", 1)
    stranger.create_publisher(WrenchStamped, "/limit_surface/wrench", 1)
    ros.wait(lambda: arrays and "TwistStamped" in arrays[-1].status[0].message)
    message = arrays[-1].status[0].message
    assert "~/twist" in message
    assert "its type is geometry_msgs/msg/WrenchStamped" in message
