# SPDX-License-Identifier: Apache-2.0
"""The topics of the limit_surface node: each good input is answered, with its stamp."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from builtin_interfaces.msg import Time
from geometry_msgs.msg import TwistStamped, WrenchStamped
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter

from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
from node_helpers import STAMP, planar_twist, planar_wrench, twist_message, wrench_message
from process_helpers import WAIT


@pytest.fixture
def streams(ros, client_node, model_file):
    """A node with one model, publishers of its inputs and what it answers."""
    model, path = model_file(terms=2)
    node = ros.add(LimitSurfaceNode, files=[path])
    twists = ros.listen(client_node, TwistStamped, "/limit_surface/predicted_twist")
    wrenches = ros.listen(client_node, WrenchStamped, "/limit_surface/required_wrench")
    loads = client_node.create_publisher(WrenchStamped, "/limit_surface/wrench", 10)
    motions = client_node.create_publisher(TwistStamped, "/limit_surface/twist", 10)
    ros.matched(loads)
    ros.matched(motions)
    ros.matched(node._twists)
    ros.matched(node._wrenches)
    return model, loads, motions, twists, wrenches


def test_a_sliding_load_is_answered_with_the_librarys_twist(ros, streams):
    model, loads, _, twists, _ = streams
    wrench = 3.0 * model.surface.wrench_of_twist([1.0, 0.5, 4.0])
    loads.publish(wrench_message(wrench))
    ros.wait(lambda: twists)
    np.testing.assert_allclose(
        planar_twist(twists[0]), model.surface.twist_of_wrench(wrench), atol=1e-12
    )
    assert twists[0].header.stamp == STAMP
    assert twists[0].header.frame_id == model.frame_id


@pytest.mark.parametrize("share", [0.0, 0.5, 0.999])
def test_a_load_inside_moves_nothing(ros, streams, share):
    model, loads, _, twists, _ = streams
    loads.publish(wrench_message(share * model.surface.wrench_of_twist([1.0, 0.5, 4.0])))
    ros.wait(lambda: twists)
    assert not planar_twist(twists[0]).any()


def test_a_motion_is_answered_with_the_load_that_it_needs(ros, streams):
    model, _, motions, _, wrenches = streams
    twist = [0.1, -0.2, 3.0]
    motions.publish(twist_message(twist))
    ros.wait(lambda: wrenches)
    np.testing.assert_allclose(
        planar_wrench(wrenches[0]), model.surface.wrench_of_twist(twist), rtol=1e-12
    )
    assert wrenches[0].header.stamp == STAMP


def test_bad_input_is_never_passed_on_and_the_next_good_one_is_answered(ros, streams):
    model, loads, motions, twists, wrenches = streams
    for wrench in ([math.nan, 0, 0], [math.inf, 0, 0], [1e200, 0, 0]):
        loads.publish(wrench_message(wrench))
    loads.publish(wrench_message([1, 0, 0], frame="moon"))
    loads.publish(wrench_message([9.0, 0.0, 0.0]))
    motions.publish(twist_message([0.0, 0.0, 0.0]))
    motions.publish(twist_message([0.0, math.nan, 0.0]))
    motions.publish(twist_message([0.0, 0.0, 1.0]))
    ros.wait(lambda: twists and wrenches)
    # Messages of one publisher come in order: what stands first is the answer to the good one.
    np.testing.assert_allclose(
        planar_twist(twists[0]), model.surface.twist_of_wrench([9.0, 0.0, 0.0]), atol=1e-12
    )
    np.testing.assert_allclose(
        planar_wrench(wrenches[0]), model.surface.wrench_of_twist([0, 0, 1.0]), rtol=1e-12
    )
    assert len(twists) == len(wrenches) == 1


def test_names_can_be_remapped(ros, client_node, model_file):
    model, path = model_file()
    node = ros.add(
        LimitSurfaceNode,
        files=[path],
        remap=["~/wrench:=/sensor/wrench", "~/predicted_twist:=/motion", "__node:=pusher"],
    )
    assert node.get_name() == "pusher"
    twists = ros.listen(client_node, TwistStamped, "/motion")
    loads = client_node.create_publisher(WrenchStamped, "/sensor/wrench", 10)
    ros.matched(loads)
    ros.matched(node._twists)
    loads.publish(wrench_message([9.0, 0.0, 0.0]))
    ros.wait(lambda: twists)
    np.testing.assert_allclose(
        planar_twist(twists[0]), model.surface.twist_of_wrench([9.0, 0.0, 0.0]), atol=1e-12
    )


def test_messages_that_wait_are_taken_in_one_turn_and_in_order(ros, client_node, model_file):
    _, path = model_file()
    reliable = "qos_overrides./limit_surface/wrench.subscription.reliability"
    node = LimitSurfaceNode(
        context=ros.context,
        parameter_overrides=[
            Parameter("model_files", value=[str(path)]),
            Parameter(reliable, value="reliable"),
        ],
    )
    executor = SingleThreadedExecutor(context=ros.context)
    executor.add_node(node)
    twists = ros.listen(client_node, TwistStamped, "/limit_surface/predicted_twist")
    loads = client_node.create_publisher(WrenchStamped, "/limit_surface/wrench", 10)
    ros.matched(loads)
    ros.matched(node._twists)
    for second in range(8):
        loads.publish(wrench_message([9.0, 0.0, 0.0], stamp=Time(sec=second)))
    assert loads.wait_for_all_acked(Duration(seconds=WAIT))
    while not node.health.accepted["wrench"]:
        executor.spin_once(timeout_sec=WAIT)
    assert node.health.accepted["wrench"] == 8
    ros.wait(lambda: len(twists) == 8)
    assert [twist.header.stamp.sec for twist in twists] == list(range(8))
    executor.shutdown()
    node.destroy_node()
