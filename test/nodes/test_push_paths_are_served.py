# SPDX-License-Identifier: Apache-2.0
"""`~/simulate_push` and `~/simulate_pushes` answer as the library does, and say what is wrong."""

from __future__ import annotations

import threading
from array import array

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from geometry_msgs.msg import Point32, Pose, PoseStamped, TwistStamped, WrenchStamped
from limit_surface_interfaces.msg import ErrorCode
from limit_surface_interfaces.srv import SimulatePush, SimulatePushes
from nav_msgs.msg import Path
from rclpy.qos import DurabilityPolicy, QoSProfile
from visualization_msgs.msg import MarkerArray

from limit_surface_ros.files.surface_file import SurfaceModel, write_surface_model
from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.motion.rollout import simulate_push, simulate_pushes
from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling
from node_helpers import STAMP

CORNERS = [[-0.045, -0.056], [0.045, -0.056], [0.045, 0.056], [-0.045, 0.056]]
OUTLINE = Polygon(CORNERS)
SURFACE = PowerSum.norms([np.diag([1.0, 1.2, 2.0]), np.diag([0.5, 0.4, 3.0])], Scaling(0.05, 3.0))
ABOUT = (0.01, -0.005)
PATH = [[-0.06, 0.02], [-0.02, 0.03], [0.0, 0.05]]
TIP, FRICTION = 0.00475, 0.25


@pytest.fixture
def served(ros, client_node, tmp_path):
    path = tmp_path / "box.yaml"
    write_surface_model(SurfaceModel("box", SURFACE, reference_point=ABOUT, outline=OUTLINE), path)
    plain = tmp_path / "plain.yaml"
    write_surface_model(SurfaceModel("plain", SURFACE), plain)
    parameters = {"default_model": "box"}
    node = ros.add(LimitSurfaceNode, files=[path, plain], parameters=parameters)
    one = ros.client(client_node, SimulatePush, "/limit_surface/simulate_push")
    many = ros.client(client_node, SimulatePushes, "/limit_surface/simulate_pushes")
    return node, one, many


def asked_one(**changes):
    request = SimulatePush.Request(tip_radius=TIP, friction=FRICTION)
    request.header.frame_id, request.header.stamp = "table", STAMP
    request.start = Pose()
    for second, (x, y) in enumerate(PATH):
        pose = PoseStamped()
        pose.pose.position.x, pose.pose.position.y = x, y
        pose.header.stamp.sec = 100 + second
        request.tip_path.poses.append(pose)
    for name, value in changes.items():
        setattr(request, name, value)
    return request


def asked_many(starts, paths, **changes):
    request = SimulatePushes.Request(tip_radius=TIP, friction=FRICTION)
    request.header.frame_id = "table"
    request.poses = array("d", np.ravel(starts).tolist())
    request.tip_starts = array("d", paths[:, 0].ravel().tolist())
    request.tip_ends = array("d", paths[:, 1].ravel().tolist())
    for name, value in changes.items():
        setattr(request, name, value)
    return request


def random_paths(count):
    rng = np.random.default_rng(1)
    starts = np.stack([np.full(count, -0.06), rng.uniform(-0.07, 0.07, count)], axis=1)
    ways = rng.uniform([0.03, -0.01], [0.05, 0.01], (count, 2))
    return np.stack([starts, starts + ways], axis=1)


def pose_of(message):
    q = message.orientation
    return [message.position.x, message.position.y, 2.0 * np.arctan2(q.z, q.w)]


def test_one_push_is_answered_as_by_the_library(served):
    _, one, _ = served
    answer = one(asked_one())
    assert answer.error_code == ErrorCode.NONE, answer.error_msg
    expected = simulate_push(
        SURFACE, OUTLINE, TIP, FRICTION, [0, 0, 0], PATH, reference_point=ABOUT
    )
    np.testing.assert_allclose(pose_of(answer.end.pose), expected.end_pose, atol=1e-9)
    poses = [pose_of(stamped.pose) for stamped in answer.body_path.poses]
    np.testing.assert_allclose(poses, expected.poses, atol=1e-9)
    np.testing.assert_allclose(answer.path_lengths, expected.path_lengths, atol=1e-12)
    assert list(answer.modes) == [
        getattr(SimulatePush.Response, mode.name) for mode in expected.modes
    ]
    wrenches = np.reshape(answer.wrenches, (-1, 3))
    np.testing.assert_allclose(wrenches[:, :2], expected.wrenches[:, :2], atol=1e-12)
    # About the frame's origin, and no more about the reference point.
    fx, fy, tau = expected.wrenches.T
    np.testing.assert_allclose(wrenches[:, 2], tau + ABOUT[0] * fy - ABOUT[1] * fx, atol=1e-12)
    assert answer.touched
    assert answer.touched_at == pytest.approx(expected.touched_at)
    assert answer.left == (expected.left_at is not None)
    assert answer.body_path.header.frame_id == answer.end.header.frame_id == "table"
    # The tip's stamps rise by a second a corner: so do the body's.
    times = [
        pose.header.stamp.sec + 1e-9 * pose.header.stamp.nanosec for pose in answer.body_path.poses
    ]
    assert times[0] == 100.0
    assert times[-1] == pytest.approx(102.0)
    assert (np.diff(times) >= 0.0).all()


def test_a_path_without_stamps_has_that_of_the_request(served):
    _, one, _ = served
    request = asked_one()
    for pose in request.tip_path.poses:
        pose.header.stamp.sec = 0
    answer = one(request)
    assert all(pose.header.stamp == STAMP for pose in answer.body_path.poses)


def test_an_outline_with_the_request_stands_before_that_of_the_model(served):
    _, one, _ = served
    corners = [(-0.03, -0.05), (0.03, -0.05), (0.03, 0.05), (-0.03, 0.05)]
    request = asked_one(model="plain")
    request.outline.points = [Point32(x=x, y=y) for x, y in reversed(corners)]
    answer = one(request)
    expected = simulate_push(SURFACE, Polygon(corners), TIP, FRICTION, [0, 0, 0], PATH)
    np.testing.assert_allclose(pose_of(answer.end.pose), expected.end_pose, atol=1e-6)


def test_a_pusher_that_never_slips_and_a_path_of_no_length_are_answered(served):
    _, one, _ = served
    assert one(asked_one(friction=float("inf"))).error_code == ErrorCode.NONE
    request = asked_one()
    for pose in request.tip_path.poses:
        pose.pose.position.x, pose.pose.position.y = -0.2, 0.0
    answer = one(request)
    assert answer.error_code == ErrorCode.NONE
    assert not answer.touched
    np.testing.assert_array_equal(pose_of(answer.end.pose), [0, 0, 0])


def tilted(request):
    request.start.orientation.x, request.start.orientation.w = 0.5, 0.5


def crossing(request):
    for x, y in ((0.0, 0.0), (0.2, 0.2), (0.2, 0.0), (0.0, 0.1)):
        request.outline.points.append(Point32(x=x, y=y))


def two_vertices(request):
    request.outline.points = [Point32(x=0.0), Point32(x=1.0)]


def not_finite(request):
    request.tip_path.poses[1].pose.position.x = float("nan")


def other_frame(request):
    request.tip_path.poses[1].header.frame_id = "gripper"


def inside(request):
    request.tip_path.poses[0].pose.position.x = 0.0
    request.tip_path.poses[0].pose.position.y = 0.0


def one_pose(request):
    del request.tip_path.poses[1:]


def zero_quaternion(request):
    request.start.orientation.w = 0.0


def without_outline(request):
    request.model = "plain"


def set_to(name, value):
    def change(request):
        setattr(request, name, value)

    return change


@pytest.mark.parametrize(
    ("change", "code", "message"),
    [
        (crossing, "BAD_DATA", "cross"),
        (two_vertices, "BAD_DATA", "three"),
        (inside, "BAD_DATA", "within"),
        (without_outline, "BAD_DATA", "outline"),
        (one_pose, "BAD_SHAPE", "tip_path"),
        (not_finite, "NOT_FINITE", "tip_path"),
        (other_frame, "UNKNOWN_FRAME", "gripper"),
        (tilted, "OUT_OF_RANGE", "upright"),
        (zero_quaternion, "ZERO_VECTOR", "quaternion"),
        (set_to("model", "nobody"), "UNKNOWN_MODEL", "nobody"),
        (set_to("tip_radius", -0.1), "OUT_OF_RANGE", "tip_radius"),
        (set_to("friction", -0.1), "OUT_OF_RANGE", "friction"),
        (set_to("friction", float("nan")), "OUT_OF_RANGE", "friction"),
        (set_to("accuracy", -1e-5), "OUT_OF_RANGE", "accuracy"),
        (set_to("accuracy", 1e-10), "OUT_OF_RANGE", "accuracy"),
        (set_to("accuracy", float("nan")), "OUT_OF_RANGE", "accuracy"),
        (set_to("overlap", 7), "OUT_OF_RANGE", "overlap"),
    ],
)
def test_what_cannot_be_pushed_is_refused_with_its_code(served, change, code, message):
    _, one, _ = served
    request = asked_one()
    change(request)
    answer = one(request)
    assert answer.error_code == getattr(ErrorCode, code), answer.error_msg
    assert message in answer.error_msg
    assert not answer.body_path.poses
    # The node serves on.
    assert one(asked_one()).error_code == ErrorCode.NONE


def test_many_pushes_are_answered_as_by_the_library(served):
    _, _, many = served
    paths = random_paths(300)
    poses = np.zeros((300, 3))
    answer = many(asked_many(poses, paths))
    assert answer.error_code == ErrorCode.NONE, answer.error_msg
    expected = simulate_pushes(
        SURFACE, OUTLINE, TIP, FRICTION, poses, paths, reference_point=ABOUT
    )
    ends = np.reshape(answer.end_poses, (-1, 3))
    np.testing.assert_allclose(ends, expected.end_poses, atol=1e-12)
    kinds = SimulatePushes.Response
    found = np.array(answer.outcomes)
    np.testing.assert_array_equal(found == kinds.MISSES, np.isnan(expected.touched_at))
    np.testing.assert_array_equal(found == kinds.LEAVES, ~np.isnan(expected.left_at))
    assert {kinds.MISSES, kinds.TOUCHES, kinds.LEAVES} == set(found.tolist())
    assert answer.header.frame_id == "table"
    assert many(asked_many(np.zeros((0, 3)), np.zeros((0, 2, 2)))).error_code == ErrorCode.NONE


@pytest.mark.parametrize(
    ("changes", "code", "message"),
    [
        ({"poses": array("d", [0.0, 0.0])}, "BAD_SHAPE", "poses"),
        ({"tip_starts": array("d", [0.0])}, "BAD_SHAPE", "tip_starts"),
        ({"tip_ends": array("d", [0.0, 0.0])}, "BAD_SHAPE", "as many"),
        ({"poses": array("d", [0.0, 0.0, float("inf")])}, "NOT_FINITE", "poses"),
        ({"model": "plain"}, "BAD_DATA", "outline"),
        ({"overlap": 2}, "OUT_OF_RANGE", "overlap"),
    ],
)
def test_what_are_no_pushes_is_refused_with_its_code(served, changes, code, message):
    _, _, many = served
    answer = many(asked_many(np.zeros((2, 3)), random_paths(2), **changes))
    assert answer.error_code == getattr(ErrorCode, code), answer.error_msg
    assert message in answer.error_msg
    assert not len(answer.end_poses)


def test_topics_are_served_while_many_pushes_are_simulated(served, ros, client_node):
    node, _, many = served
    seen = ros.listen(client_node, TwistStamped, "/limit_surface/predicted_twist")
    publisher = client_node.create_publisher(WrenchStamped, "/limit_surface/wrench", 10)
    ros.matched(publisher)
    message = WrenchStamped()
    message.header.frame_id = "object"
    message.wrench.force.x = 5.0
    paths = random_paths(3000)
    answers = []

    def ask():
        answers.append(many(asked_many(np.zeros((3000, 3)), paths)))

    asking = threading.Thread(target=ask)
    asking.start()
    ros.wait(lambda: node.endpoints.under_way > 0)
    before_the_end = 0
    while node.endpoints.under_way:
        count = len(seen)
        publisher.publish(message)
        ros.wait(lambda count=count: len(seen) > count)
        before_the_end += node.endpoints.under_way
    asking.join()
    assert answers[0].error_code == ErrorCode.NONE
    assert before_the_end >= 3


def test_the_last_push_is_shown_also_to_who_looks_later(served, ros, client_node):
    _, one, _ = served
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    answer = one(asked_one())
    seen = ros.listen(client_node, MarkerArray, "/limit_surface/push", latched)
    paths = ros.listen(client_node, Path, "/limit_surface/push_path", latched)
    ros.wait(lambda: seen and paths)
    assert paths[0] == answer.body_path
    shown = seen[0].markers
    assert {marker.ns for marker in shown} == {"", "ghosts", "tip", "contacts", "forces"}
    assert all(marker.header.frame_id == "table" for marker in shown)
    ghosts = [marker for marker in shown if marker.ns == "ghosts"]
    first = np.array([(point.x, point.y) for point in ghosts[0].points])
    np.testing.assert_allclose(first[:4], OUTLINE.vertices, atol=1e-12)
    # A later push is shown at once.
    one(asked_one(friction=0.1))
    ros.wait(lambda: len(seen) > 1)
