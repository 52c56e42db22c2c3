# SPDX-License-Identifier: Apache-2.0
"""Inputs in other frames are transformed with the lever arm, or refused with both frames named."""

from __future__ import annotations

import importlib.util
import math

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from geometry_msgs.msg import PoseStamped, TransformStamped
from limit_surface_interfaces.msg import ErrorCode
from limit_surface_interfaces.srv import (
    ListModels,
    PredictSlide,
    SimulatePush,
    TwistsToWrenches,
    TwistToWrench,
    WrenchesToTwists,
    WrenchToTwist,
)
from rclpy.parameter import Parameter
from std_msgs.msg import Header

from decay_helpers import Bench
from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
from limit_surface_ros.nodes.messages import convert
from node_helpers import STAMP, planar_twist, planar_wrench, twist_message, wrench_message

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


REFERENCE = (0.1, -0.2)


def at_reference(wrench):
    """A wrench at the origin of the model's frame, about the reference point, by hand."""
    fx, fy, tau = wrench
    return np.array([fx, fy, tau - (0.1 * fy - -0.2 * fx)])


def at_origin(twist):
    """A twist at the reference point, as it is at the origin of the model's frame, by hand."""
    vx, vy, omega = twist
    # v(0) = v(r) + omega x (0 - r)
    return np.array([vx + omega * -0.2, vy - omega * 0.1, omega])


@pytest.mark.parametrize("frame", ["object", "same"])
def test_loads_and_answers_act_at_the_origin_of_their_frame_the_models_own_included(serve, frame):
    model, _, forward, back = serve(
        {"static_transforms": ["object same 0 0 0 0 0 0"]}, reference_point=REFERENCE
    )
    force = np.array([2.0, 3.0, 0.1])
    answer = forward(wrench_message(force, frame=frame))
    twist, factor = model.surface.twist_and_load_factor(at_reference(force))
    np.testing.assert_allclose(planar_twist(answer.twist), at_origin(twist), rtol=1e-9)
    assert answer.load_factor == pytest.approx(float(factor))
    np.testing.assert_allclose(planar_wrench(answer.limit_wrench), force / factor, rtol=1e-9)
    needed = back(answer.twist)
    np.testing.assert_allclose(planar_wrench(needed.wrench), force / factor, rtol=1e-6)
    work = planar_wrench(needed.wrench) @ planar_twist(answer.twist)
    assert needed.power == pytest.approx(work, rel=1e-9)


@pytest.mark.parametrize("frame", ["", "object", "same", "tool"])
def test_the_rows_of_a_batch_act_where_single_ones_do(ros, client_node, serve, frame):
    transforms = ["object same 0 0 0 0 0 0", TOOL]
    _, _, forward, back = serve({"static_transforms": transforms}, reference_point=REFERENCE)
    many = ros.client(client_node, WrenchesToTwists, "/limit_surface/wrenches_to_twists")
    many_back = ros.client(client_node, TwistsToWrenches, "/limit_surface/twists_to_wrenches")
    rows = np.random.default_rng(3).normal(size=(5, 3)) * [3.0, 3.0, 0.1]
    header = Header(frame_id=frame, stamp=STAMP)
    there = many(WrenchesToTwists.Request(header=header, wrenches=convert.flat_of(rows)))
    needed = many_back(TwistsToWrenches.Request(header=header, twists=convert.flat_of(rows)))
    for answer in (there, needed):
        assert answer.error_code == ErrorCode.NONE, answer.error_msg
        assert answer.header == Header(frame_id="object", stamp=STAMP)
    for row, twist, factor, wrench, power in zip(
        rows,
        np.reshape(there.twists, (-1, 3)),
        there.load_factors,
        np.reshape(needed.wrenches, (-1, 3)),
        needed.powers,
        strict=True,
    ):
        one = forward(wrench_message(row, frame=frame or "object"))
        np.testing.assert_allclose(planar_twist(one.twist), twist, rtol=1e-9, atol=1e-12)
        assert one.load_factor == pytest.approx(factor)
        one = back(twist_message(row, frame=frame or "object"))
        np.testing.assert_allclose(planar_wrench(one.wrench), wrench, rtol=1e-9, atol=1e-12)
        assert one.power == pytest.approx(power)


def test_two_robots_and_a_perceived_object_need_no_other_files(ros, client_node, model_file):
    model, path = model_file()
    _, crate = model_file("crate", seed=1)
    parameters = {"frame_prefix": "left/", "frame_ids": ["crate=box_12"]}
    node = ros.add(LimitSurfaceNode, files=[path, crate], parameters=parameters)
    forward = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
    listed = ros.client(client_node, ListModels, "/limit_surface/list_models")

    def ask(name, frame):
        asked = WrenchToTwist.Request(model=name, wrench=wrench_message([9, 0, 0], frame=frame))
        return forward(asked)

    answer = ask("box", "left/object")
    assert answer.twist.header.frame_id == "left/object"
    np.testing.assert_allclose(
        planar_twist(answer.twist), model.surface.twist_of_wrench([9, 0, 0]), atol=1e-12
    )
    assert ask("box", "object").error_code == ErrorCode.UNKNOWN_FRAME
    assert ask("crate", "box_12").twist.header.frame_id == "box_12"
    frames = [info.frame_id for info in listed(ListModels.Request()).models]
    assert frames == ["left/object", "box_12"]
    node.set_parameters([Parameter("frame_prefix", value="right/")])
    assert ask("box", "right/object").error_code == ErrorCode.NONE
    frames = [info.frame_id for info in listed(ListModels.Request()).models]
    assert frames == ["right/object", "box_12"]
    for wrong in (["crate"], ["=a"], ["a="], ["a=b", "a=c"], ["a= b"], ["a=b\nc"]):
        assert not node.set_parameters([Parameter("frame_ids", value=wrong)])[0].successful


def test_frames_are_given_to_models_of_any_name_and_to_what_is_learnt_of_them(
    ros, client_node, model_file
):
    names = ["a=b", "Kiste groß 2", "box", "box_learnt"]
    paths = []
    for name in names:
        paths.append(model_file(name)[1])
    frames = ["a=b=one", "Kiste groß 2=two", "box=three", "bx=four"]
    node = ros.add(LimitSurfaceNode, files=paths, parameters={"frame_ids": frames})
    listed = ros.client(client_node, ListModels, "/limit_surface/list_models")
    served = {info.name: info.frame_id for info in listed(ListModels.Request()).models}
    assert served == dict(zip(names, ["one", "two", "three", "three"], strict=True))
    # One of no model that is loaded is told of.
    assert node.health.reported["frame of no model"] == 1


def test_a_slash_before_a_frame_is_said_to_be_the_matter(serve):
    _, _, forward, _ = serve({"static_transforms": [TOOL]})
    assert "no slash: 'object'?" in forward(wrench_message([1, 0, 0], frame="/object")).error_msg


def test_a_very_long_name_is_not_repeated_whole(serve):
    _, node, forward, _ = serve()
    answer = forward(wrench_message([1, 0, 0], frame="x" * 1_000_000))
    assert answer.error_code == ErrorCode.UNKNOWN_FRAME
    assert len(answer.error_msg) < 1000
    assert len(node.health.last_error) < 1000


def test_a_very_long_frame_of_a_path_is_not_repeated_whole(ros, client_node, serve):
    serve()
    call = ros.client(client_node, SimulatePush, "/limit_surface/simulate_push")
    asked = SimulatePush.Request()
    asked.header.frame_id = "x" * 1_000_000
    asked.tip_path.poses = [PoseStamped(), PoseStamped()]
    asked.tip_path.header.frame_id = "y" * 1_000_000
    answer = call(asked)
    assert answer.error_code == ErrorCode.UNKNOWN_FRAME
    assert len(answer.error_msg) < 1000


def test_a_frame_that_an_answer_repeats_is_not_a_megabyte_long(ros, client_node, serve, tmp_path):
    serve(outline=Polygon([(-0.1, -0.1), (0.1, -0.1), (0.0, 0.1)]))
    bench = Bench(ros, client_node, tmp_path, sim_time=False)
    long = "x" * 1_000_000
    pushed = SimulatePush.Request()
    pushed.header.frame_id = long
    pushed.tip_path.poses = [PoseStamped(), PoseStamped()]
    call = ros.client(client_node, SimulatePush, "/limit_surface/simulate_push")
    slid = PredictSlide.Request(points=100_000)
    slid.pose.header.frame_id = long
    for answer in (
        call(pushed),
        ros.client(client_node, PredictSlide, "/decay/predict_slide")(slid),
    ):
        assert answer.error_code == ErrorCode.OUT_OF_RANGE
        assert "frame_id must have at most 200 characters" in answer.error_msg
        assert len(answer.error_msg) < 1000
    bench.onset(bench.now, frame=long)
    assert bench.refused["onset", "OUT_OF_RANGE"] == 1


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
