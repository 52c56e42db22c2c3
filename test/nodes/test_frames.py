# SPDX-License-Identifier: Apache-2.0
"""Inputs in other frames are transformed with the lever arm, or refused with both frames named."""

from __future__ import annotations

import importlib.util
import math

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from geometry_msgs.msg import TransformStamped
from limit_surface_interfaces.msg import ErrorCode
from limit_surface_interfaces.srv import TwistToWrench, WrenchToTwist
from rclpy.parameter import Parameter

from limit_surface_ros.nodes.surface_node import LimitSurfaceNode
from node_helpers import planar_twist, planar_wrench, twist_message, wrench_message

TOOL = "object tool 0.1 0.02 0.3 0 0 0.5"


@pytest.fixture
def serve(ros, client_node, model_file):
    """Return a function that starts a node and returns model, node and its two clients."""

    def start(parameters=None, **fields):
        model, path = model_file(**fields)
        node = ros.add(LimitSurfaceNode, files=[path], parameters=parameters)
        forward = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
        back = ros.client(client_node, TwistToWrench, "/limit_surface/twist_to_wrench")
        return (
            model,
            node,
            lambda message: forward(WrenchToTwist.Request(wrench=message)),
            lambda message: back(TwistToWrench.Request(twist=message)),
        )

    return start


def in_object(wrench):
    """The wrench of the tool's frame about the object's origin, by hand."""
    fx, fy, tau = wrench
    cosine, sine = math.cos(0.5), math.sin(0.5)
    gx, gy = cosine * fx - sine * fy, sine * fx + cosine * fy
    return np.array([gx, gy, tau + 0.1 * gy - 0.02 * gx])


def test_a_wrench_at_the_tool_turns_the_object_by_its_lever_arm(serve):
    model, _, forward, _ = serve({"static_transforms": [TOOL]})
    answer = forward(wrench_message([2.0, 3.0, 0.1], frame="tool"))
    assert answer.error_code == ErrorCode.NONE
    moved = in_object([2.0, 3.0, 0.1])
    np.testing.assert_allclose(
        planar_twist(answer.twist), model.surface.twist_of_wrench(moved), atol=1e-12
    )
    assert answer.load_factor == pytest.approx(model.surface.load_factor(moved))
    assert answer.twist.header.frame_id == answer.limit_wrench.header.frame_id == "object"


def test_a_twist_at_the_tool_is_moved_to_the_object(serve):
    model, _, _, back = serve({"static_transforms": [TOOL]})
    wrench, twist = [2.0, 3.0, 0.1], np.array([0.3, -0.2, 1.5])
    answer = back(twist_message(twist, frame="tool"))
    cosine, sine = math.cos(0.5), math.sin(0.5)
    moved = [
        cosine * twist[0] - sine * twist[1] + 0.02 * twist[2],
        sine * twist[0] + cosine * twist[1] - 0.1 * twist[2],
        twist[2],
    ]
    assert in_object(wrench) @ moved == pytest.approx(np.dot(wrench, twist))
    np.testing.assert_allclose(
        planar_wrench(answer.wrench), model.surface.wrench_of_twist(moved), rtol=1e-9
    )


def test_other_frames_are_moved_to_the_models_reference_point(serve):
    model, _, forward, _ = serve(
        {"static_transforms": ["object same 0 0 0 0 0 0"]}, reference_point=(0.1, -0.2)
    )
    force = np.array([2.0, 3.0, 0.1])
    own = forward(wrench_message(force))
    np.testing.assert_allclose(
        planar_twist(own.twist), model.surface.twist_of_wrench(force), atol=1e-12
    )
    other = forward(wrench_message(force, frame="same"))
    moved = [2.0, 3.0, 0.1 - (0.1 * 3.0 - -0.2 * 2.0)]
    np.testing.assert_allclose(
        planar_twist(other.twist), model.surface.twist_of_wrench(moved), atol=1e-12
    )


def test_a_frame_without_a_transform_is_refused_with_both_named(serve):
    _, node, forward, _ = serve({"static_transforms": [TOOL]})
    answer = forward(wrench_message([1, 0, 0], frame="moon"))
    assert answer.error_code == ErrorCode.UNKNOWN_FRAME
    assert "'moon'" in answer.error_msg
    assert "'object'" in answer.error_msg
    node.set_parameters([Parameter("static_transforms", value=[TOOL, "tool moon 1 0 0 0 0 0"])])
    assert forward(wrench_message([1, 0, 0], frame="moon")).error_code == ErrorCode.NONE


def test_an_empty_frame_is_taken_for_the_models_only_if_asked(serve):
    model, node, forward, _ = serve()
    assert forward(wrench_message([9, 0, 0], frame="")).error_code == ErrorCode.UNKNOWN_FRAME
    node.set_parameters([Parameter("assume_model_frame", value=True)])
    answer = forward(wrench_message([9, 0, 0], frame=""))
    np.testing.assert_allclose(
        planar_twist(answer.twist), model.surface.twist_of_wrench([9, 0, 0]), atol=1e-12
    )


def test_what_is_outside_the_plane_is_reported_when_it_is_not_small(serve):
    _, node, forward, _ = serve()
    message = wrench_message([10.0, 0.0, 0.0])
    message.wrench.force.z = 0.5
    assert forward(message).error_code == ErrorCode.NONE
    assert not node.health.reported
    message.wrench.force.z = -8.0
    assert forward(message).error_code == ErrorCode.NONE
    assert node.health.reported["out-of-plane wrench"] == 1


def test_pressing_harder_widens_the_surface(serve):
    model, node, forward, back = serve({"normal_force_from": "wrench"}, normal_force=10.0)
    message = wrench_message([3.0, 1.0, 0.1])
    factor = float(model.surface.load_factor([3.0, 1.0, 0.1]))
    for pressed in (5.0, 10.0, 40.0):
        message.wrench.force.z = -pressed
        answer = forward(message)
        assert answer.load_factor == pytest.approx(factor * 10.0 / pressed)
    assert not node.health.reported
    message.wrench.force.z = 0.0
    lifted = forward(message)
    assert lifted.error_code == ErrorCode.OUT_OF_RANGE
    assert "force.z" in lifted.error_msg
    # No wrench presses here: the model's own normal force counts.
    twist = [0.1, 0.2, 1.0]
    np.testing.assert_allclose(
        planar_wrench(back(twist_message(twist)).wrench), model.surface.wrench_of_twist(twist)
    )


def test_the_normal_force_can_be_a_parameter(serve):
    model, node, forward, back = serve(
        {"normal_force_from": "parameter", "normal_force": 20.0}, normal_force=10.0
    )
    wrench, twist = [3.0, 1.0, 0.1], [0.1, 0.2, 1.0]
    expected = float(model.surface.load_factor(wrench))
    assert forward(wrench_message(wrench)).load_factor == pytest.approx(expected / 2.0)
    np.testing.assert_allclose(
        planar_wrench(back(twist_message(twist)).wrench), 2 * model.surface.wrench_of_twist(twist)
    )
    node.set_parameters([Parameter("normal_force", value=5.0)])
    assert forward(wrench_message(wrench)).load_factor == pytest.approx(expected * 2.0)


def test_a_model_without_a_normal_force_cannot_be_scaled(serve):
    _, _, forward, _ = serve({"normal_force_from": "parameter"})
    answer = forward(wrench_message([3.0, 1.0, 0.1]))
    assert answer.error_code == ErrorCode.OUT_OF_RANGE
    assert "normal_force" in answer.error_msg


@pytest.mark.skipif(
    importlib.util.find_spec("tf2_ros") is None, reason="tf2_ros is not installed (no wheel of it)"
)
@pytest.mark.parametrize("known", [(10, 20), (15,)])
def test_tf2_is_asked_at_the_stamp_of_the_message(ros, client_node, serve, known):
    import tf2_ros

    model, _, forward, _ = serve()
    broadcaster = tf2_ros.TransformBroadcaster(client_node)
    for second in known:
        pose = TransformStamped()
        pose.header.stamp.sec = second
        pose.header.frame_id, pose.child_frame_id = "object", "tool"
        pose.transform.translation.x = 0.1 * second
        pose.transform.rotation.w = 1.0
        broadcaster.sendTransform(pose)

    def ask(second):
        message = wrench_message([2.0, 3.0, 0.1], frame="tool")
        message.header.stamp.sec, message.header.stamp.nanosec = second, 0
        return forward(message)

    ros.wait(lambda: ask(15).error_code == ErrorCode.NONE)
    np.testing.assert_allclose(
        planar_twist(ask(15).twist),
        model.surface.twist_of_wrench([2.0, 3.0, 0.1 + 1.5 * 3.0]),
        atol=1e-9,
    )
    assert ask(5).error_code == ErrorCode.TRANSFORM_TOO_OLD
    assert ask(25).error_code == ErrorCode.TRANSFORM_TOO_NEW
