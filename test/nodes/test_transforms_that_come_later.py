# SPDX-License-Identifier: Apache-2.0
"""What is stamped before its transform is there waits for it, and holds up nothing else."""

from __future__ import annotations

import importlib.util
import threading
import time

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TransformStamped, TwistStamped, WrenchStamped
from limit_surface_interfaces.msg import ErrorCode
from limit_surface_interfaces.srv import WrenchesToTwists, WrenchToTwist
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Header
from transform_helpers import Buffer

from decay_helpers import stamp_of, time_of
from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
from node_helpers import handled, planar_twist, wrench_message
from process_helpers import WAIT

SECOND = 1_000_000_000
LOAD = np.array([9.0, 3.0, 0.1])
# So long that no test ends because of it.
PATIENT = {"transform_timeout": 60.0}


class Moving:
    """A node whose tool moves, and what is asked of it and comes back."""

    def __init__(self, ros, client, model_file, **parameters):
        self.ros = ros
        self.model, path = model_file()
        self.buffer = Buffer()
        self.node = ros.add(
            lambda **options: LimitSurfaceNode(buffer=self.buffer, **options),
            files=[path],
            parameters=parameters,
        )
        self.answers = ros.listen(client, TwistStamped, "/limit_surface/predicted_twist", 1000)
        self._loads = client.create_publisher(WrenchStamped, "/limit_surface/wrench", 1000)
        ros.matched(self._loads)
        ros.matched(self.node._twists)
        self._client = client.create_client(WrenchToTwist, "/limit_surface/wrench_to_twist")
        assert self._client.wait_for_service(timeout_sec=WAIT)

    def publish(self, stamp, frame="tool"):
        """Send a load; wait until the node has it."""
        before = self.seen
        self._loads.publish(wrench_message(LOAD, frame=frame, stamp=stamp_of(stamp)))
        self.ros.wait(lambda: self.seen > before)

    def ask(self, stamp, frame="tool"):
        """Call the service and return the future."""
        message = wrench_message(LOAD, frame=frame, stamp=stamp_of(stamp))
        return self._client.call_async(WrenchToTwist.Request(wrench=message))

    def come(self, stamp, x):
        """Have a transform come, in the node's own thread, as from /tf."""
        done = threading.Event()

        def take():
            self.buffer.set_transform(stamp, x)
            done.set()

        self.ros.executor.create_task(take)
        assert done.wait(WAIT)

    @property
    def seen(self):
        """Loads that wait, were answered or refused."""
        return self.node.input.frames.waiting + handled(self.node.health, "wrench")

    def expected(self, x):
        """The twist of the load with the tool at a place."""
        fx, fy, tau = LOAD
        return self.model.surface.twist_of_wrench([fx, fy, tau + x * fy])


@pytest.fixture
def moving(ros, client_node, model_file):
    return lambda **parameters: Moving(ros, client_node, model_file, **parameters)


def test_loads_wait_for_the_transform_at_their_stamp_and_are_answered_in_order(moving):
    bench = moving(**PATIENT)
    bench.come(10 * SECOND, 0.1)
    stamps = [10 * SECOND + step * SECOND // 10 for step in range(1, 10)]
    for stamp in stamps:
        bench.publish(stamp)
    assert bench.node.input.frames.waiting == len(stamps)
    assert not bench.answers
    bench.come(11 * SECOND, 0.3)
    bench.ros.wait(lambda: len(bench.answers) == len(stamps))
    assert [time_of(answer) for answer in bench.answers] == stamps
    for step, answer in enumerate(bench.answers, 1):
        np.testing.assert_allclose(
            planar_twist(answer), bench.expected(0.1 + 0.02 * step), rtol=1e-9, atol=1e-12
        )
    assert not bench.node.health.refused
    assert not bench.node.input.frames.waiting


def test_a_service_waits_and_topics_and_other_calls_are_served_meanwhile(moving):
    bench = moving(**PATIENT)
    bench.come(10 * SECOND, 0.1)
    waiting = bench.ask(12 * SECOND)
    bench.ros.wait(lambda: bench.node.input.frames.waiting == 1)
    other = bench.ask(10 * SECOND)
    assert bench.ros.done(other, WAIT)
    np.testing.assert_allclose(planar_twist(other.result().twist), bench.expected(0.1), rtol=1e-9)
    bench.publish(10 * SECOND)
    bench.ros.wait(lambda: len(bench.answers) == 1)
    assert not waiting.done()
    bench.come(12 * SECOND, 0.5)
    assert bench.ros.done(waiting, WAIT)
    assert waiting.result().error_code == ErrorCode.NONE
    np.testing.assert_allclose(
        planar_twist(waiting.result().twist), bench.expected(0.5), rtol=1e-9
    )


def test_a_batch_waits_too(ros, client_node, moving):
    bench = moving(**PATIENT)
    bench.come(10 * SECOND, 0.1)
    many = client_node.create_client(WrenchesToTwists, "/limit_surface/wrenches_to_twists")
    assert many.wait_for_service(timeout_sec=WAIT)
    header = Header(frame_id="tool", stamp=stamp_of(11 * SECOND))
    answer = many.call_async(WrenchesToTwists.Request(header=header, wrenches=LOAD.tolist()))
    ros.wait(lambda: bench.node.input.frames.waiting == 1)
    bench.come(11 * SECOND, 0.2)
    assert ros.done(answer, WAIT)
    np.testing.assert_allclose(answer.result().twists, bench.expected(0.2), rtol=1e-9)


@pytest.mark.parametrize(
    ("frame", "code"),
    [("tool", ErrorCode.TRANSFORM_TOO_NEW), ("moon", ErrorCode.UNKNOWN_FRAME)],
)
def test_what_was_waited_for_in_vain_is_refused_with_its_code_and_counted(moving, frame, code):
    bench = moving(transform_timeout=0.05)
    bench.come(10 * SECOND, 0.1)
    answer = bench.ask(12 * SECOND, frame=frame)
    assert bench.ros.done(answer, WAIT)
    assert answer.result().error_code == code
    assert repr(frame) in answer.result().error_msg
    bench.publish(12 * SECOND, frame=frame)
    name = {ErrorCode.TRANSFORM_TOO_NEW: "TRANSFORM_TOO_NEW"}.get(code, "UNKNOWN_FRAME")
    bench.ros.wait(lambda: bench.node.health.refused["wrench", name] == 1)
    assert not bench.node.input.frames.waiting
    assert not bench.answers


def test_without_a_timeout_nothing_is_waited_for(moving):
    bench = moving(transform_timeout=0.0)
    bench.come(10 * SECOND, 0.1)
    answer = bench.ask(12 * SECOND)
    assert bench.ros.done(answer, WAIT)
    assert answer.result().error_code == ErrorCode.TRANSFORM_TOO_NEW


def test_what_is_older_than_all_that_is_remembered_is_refused_at_once(moving):
    bench = moving(**PATIENT)
    bench.come(10 * SECOND, 0.1)
    answer = bench.ask(9 * SECOND)
    assert bench.ros.done(answer, WAIT)
    assert answer.result().error_code == ErrorCode.TRANSFORM_TOO_OLD


def test_within_the_tolerance_the_newest_transform_is_taken(moving):
    bench = moving(transform_tolerance=1.0, transform_timeout=0.05)
    bench.come(10 * SECOND, 0.1)
    bench.publish(11 * SECOND)
    bench.ros.wait(lambda: len(bench.answers) == 1)
    np.testing.assert_allclose(planar_twist(bench.answers[0]), bench.expected(0.1), rtol=1e-9)
    assert time_of(bench.answers[0]) == 11 * SECOND
    bench.publish(11 * SECOND + 1)
    bench.ros.wait(lambda: bench.node.health.refused["wrench", "TRANSFORM_TOO_NEW"] == 1)
    bench.node.set_parameters([Parameter("transform_tolerance", value=2)])
    bench.publish(11 * SECOND + 1)
    bench.ros.wait(lambda: len(bench.answers) == 2)


def test_of_more_than_the_queue_holds_the_oldest_is_refused(moving, monkeypatch):
    monkeypatch.setattr("limit_surface_ros.nodes.serving.endpoints.MOST_WAITING", 3)
    bench = moving(**PATIENT)
    bench.come(10 * SECOND, 0.1)
    for step in range(1, 6):
        bench.publish(10 * SECOND + step)
    bench.ros.wait(lambda: bench.node.health.refused["wrench", "UNAVAILABLE"] == 2)
    bench.come(11 * SECOND, 0.1)
    bench.ros.wait(lambda: len(bench.answers) == 3)
    assert [time_of(answer) - 10 * SECOND for answer in bench.answers] == [3, 4, 5]


def test_diagnostics_name_what_is_refused_before_they_say_that_nothing_comes(
    ros, client_node, moving
):
    bench = moving(transform_timeout=0.02, diagnostics_period=0.2, input_timeout=0.05)
    arrays = ros.listen(client_node, DiagnosticArray, "/diagnostics")
    bench.come(10 * SECOND, 0.1)
    bench.publish(10 * SECOND)
    timer = bench.node.create_timer(
        0.02, lambda: bench._loads.publish(wrench_message(LOAD, "tool", stamp_of(99 * SECOND)))
    )

    def told():
        messages = [array.status[0].message for array in arrays]
        return [text for text in messages if "TRANSFORM_TOO_NEW" in text and "no input" in text]

    ros.wait(told)
    for message in told():
        assert message.index("TRANSFORM_TOO_NEW") < message.index("no input")
    timer.cancel()


@pytest.mark.parametrize(
    ("rotation", "x", "reason"),
    [
        ((0.0, 0.0, 0.0, 0.0), 0.1, "quaternion must not be zero"),
        ((0.0, float("nan"), 0.0, 1.0), 0.1, "quaternion must be finite"),
        ((0.0, 0.0, 0.0, 1.0), 1e300, "translation must be at most 1e+100 m"),
        ((0.0, 0.0, 0.0, 1.0), float("inf"), "translation must be finite"),
    ],
)
def test_of_a_transform_that_cannot_be_used_the_message_names_the_transform(
    moving, rotation, x, reason
):
    bench = moving()
    bench.buffer.rotation = rotation
    bench.come(10 * SECOND, x)
    answer = bench.ask(10 * SECOND)
    assert bench.ros.done(answer, WAIT)
    assert answer.result().error_code == ErrorCode.UNKNOWN_FRAME
    said = answer.result().error_msg
    assert "transform from frame 'tool' to the model's frame 'object' cannot be used" in said
    assert reason in said
    assert "wrench" not in said
    bench.publish(10 * SECOND)
    # It counts as waiting for a moment, before it is refused.
    bench.ros.wait(lambda: bench.node.health.refused["wrench", "UNKNOWN_FRAME"] == 1)
    # The next one that is in order is used, and needs no unit length.
    bench.buffer.rotation = (0.0, 0.0, 0.0, -7e-5)
    bench.come(11 * SECOND, 0.1)
    answer = bench.ask(11 * SECOND)
    assert bench.ros.done(answer, WAIT)
    twist = planar_twist(answer.result().twist)
    np.testing.assert_allclose(twist, bench.expected(0.1), rtol=1e-9)


def test_what_waits_is_refused_when_the_clock_jumps_back(ros, client_node, moving):
    bench = moving(use_sim_time=True, **PATIENT)
    clock = client_node.create_publisher(Clock, "/clock", 1)
    ros.matched(clock)

    def tick(time):
        clock.publish(Clock(clock=stamp_of(time)))
        ros.wait(lambda: bench.node.get_clock().now().nanoseconds == time)

    tick(100 * SECOND)
    bench.come(100 * SECOND, 0.1)
    bench.publish(101 * SECOND)
    waiting = bench.ask(101 * SECOND)
    ros.wait(lambda: bench.node.input.frames.waiting == 2)
    tick(90 * SECOND)
    assert ros.done(waiting, WAIT)
    assert waiting.result().error_code == ErrorCode.TRANSFORM_TOO_NEW
    ros.wait(lambda: bench.node.health.refused["wrench", "TRANSFORM_TOO_NEW"] == 1)
    assert not bench.node.input.frames.waiting
    # Without a stamp it is the newest transform.
    latest = bench.ask(0)
    assert ros.done(latest, WAIT)
    twist = planar_twist(latest.result().twist)
    np.testing.assert_allclose(twist, bench.expected(0.1), rtol=1e-9)


@pytest.mark.skipif(
    importlib.util.find_spec("tf2_ros") is None, reason="tf2_ros is not installed (no wheel of it)"
)
def test_live_wrenches_of_a_moving_frame_are_all_answered_by_tf2(ros, client_node, model_file):
    import tf2_ros

    _, path = model_file()
    node = ros.add(LimitSurfaceNode, files=[path], parameters={"transform_timeout": 5.0})
    broadcaster = tf2_ros.TransformBroadcaster(client_node)

    def broadcast():
        pose = TransformStamped()
        pose.header.stamp = client_node.get_clock().now().to_msg()
        pose.header.frame_id, pose.child_frame_id = "object", "tool"
        pose.transform.rotation.w = 1.0
        broadcaster.sendTransform(pose)

    client_node.create_timer(1 / 30, broadcast)
    ros.wait(lambda: client_node.count_subscribers("/tf"))
    time.sleep(0.2)
    answers = ros.listen(client_node, TwistStamped, "/limit_surface/predicted_twist", 1000)
    loads = client_node.create_publisher(WrenchStamped, "/limit_surface/wrench", 1000)
    ros.matched(loads)
    ros.matched(node._twists)
    for _ in range(200):
        now = client_node.get_clock().now().to_msg()
        loads.publish(wrench_message(LOAD, frame="tool", stamp=now))
        time.sleep(0.005)
    ros.wait(lambda: len(answers) == 200)
    assert not node.health.refused
