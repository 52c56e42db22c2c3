# SPDX-License-Identifier: Apache-2.0
"""`~/linearise_push` answers as the library does, and says what is wrong."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from geometry_msgs.msg import Point32
from limit_surface_interfaces.msg import ErrorCode
from limit_surface_interfaces.srv import LinearisePush, Push

from limit_surface_ros.files.surface_file import SurfaceModel, write_surface_model
from limit_surface_ros.motion.linear_push import linearise_push
from limit_surface_ros.motion.outcomes import MODES
from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.nodes.limit_surface import push_services
from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling
from node_helpers import STAMP, planar_twist

CORNERS = [[-0.045, -0.056], [0.045, -0.056], [0.045, 0.056], [-0.045, 0.056]]
SURFACE = PowerSum.norms([np.diag([1.0, 1.2, 2.0]), np.diag([0.5, 0.4, 3.0])], Scaling(0.05, 3.0))
ABOUT = (0.01, -0.005)
POSE, CONTACT, FRICTION = (0.2, 0.1, 0.7), (-0.045, 0.02), 0.25


@pytest.fixture
def served(ros, client_node, tmp_path):
    path, plain = tmp_path / "box.yaml", tmp_path / "plain.yaml"
    outline = Polygon(CORNERS)
    write_surface_model(SurfaceModel("box", SURFACE, reference_point=ABOUT, outline=outline), path)
    write_surface_model(SurfaceModel("plain", SURFACE), plain)
    ros.add(LimitSurfaceNode, files=[path, plain], parameters={"default_model": "box"})
    return ros.client(client_node, LinearisePush, "/limit_surface/linearise_push")


def asked(given, kind=LinearisePush.Request.VELOCITY, **changes):
    request = LinearisePush.Request(friction=FRICTION, kind=kind, input=given)
    request.header.frame_id, request.header.stamp = "table", STAMP
    request.pose.position.x, request.pose.position.y, angle = POSE
    request.pose.orientation.z, request.pose.orientation.w = (
        math.sin(angle / 2),
        math.cos(angle / 2),
    )
    request.contact.x, request.contact.y = CONTACT
    for name, value in changes.items():
        setattr(request, name, value)
    return request


@pytest.mark.parametrize(
    ("kind", "given"),
    [
        ("velocity", [0.05, 0.0]),
        ("velocity", [0.05, 0.06]),
        ("velocity", [0.05, -0.09]),
        ("velocity", [-0.05, 0.01]),
        ("force", [2.0, 0.3, 0.0]),
    ],
)
def test_answers_equal_the_library(served, kind, given):
    number = getattr(LinearisePush.Request, kind.upper())
    answer = served(asked(given, number))
    assert answer.error_code == ErrorCode.NONE, answer.error_msg
    expected = linearise_push(
        SURFACE, Polygon(CORNERS), FRICTION, POSE, CONTACT, given, kind=kind, reference_point=ABOUT
    )
    np.testing.assert_allclose(answer.a, expected.a.ravel(), atol=1e-12)
    np.testing.assert_allclose(answer.b, expected.b.ravel(), atol=1e-12)
    np.testing.assert_allclose(answer.rates, expected.rates, atol=1e-12)
    np.testing.assert_allclose(planar_twist(answer.twist), expected.twists, atol=1e-12)
    assert [answer.turn_right, answer.turn_left] == pytest.approx(expected.margins.tolist())
    assert answer.mode == getattr(LinearisePush.Response, MODES[int(expected.modes)].name)
    assert answer.smooth
    assert answer.twist.header.frame_id == "object"
    assert answer.twist.header.stamp == STAMP


def test_the_twist_is_that_of_the_push_service(served, ros, client_node):
    push = ros.client(client_node, Push, "/limit_surface/push")
    request = Push.Request(friction=FRICTION)
    request.contact.x, request.contact.y = CONTACT
    request.normal.x, request.velocity.x, request.velocity.y = 1.0, 0.05, 0.02
    one, other = push(request), served(asked([0.05, 0.02]))
    assert one.mode == other.mode
    np.testing.assert_allclose(planar_twist(one.twist), planar_twist(other.twist), atol=1e-12)


def test_a_request_may_bring_its_own_outline(served):
    outline = [Point32(x=x, y=y) for x, y in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))]
    request = asked([0.05, 0.0], model="plain")
    request.outline.points = outline
    request.contact.x = -0.5
    answer = served(request)
    expected = linearise_push(
        SURFACE,
        Polygon(np.array([[p.x, p.y] for p in outline])),
        FRICTION,
        POSE,
        [-0.5, 0.02],
        [0.05, 0.0],
    )
    assert answer.error_code == ErrorCode.NONE
    np.testing.assert_allclose(answer.a, expected.a.ravel(), atol=1e-12)


@pytest.mark.parametrize(
    ("given", "changes", "code", "told"),
    [
        ([0.05], {}, ErrorCode.BAD_SHAPE, "inputs"),
        ([0.05, math.nan], {}, ErrorCode.NOT_FINITE, "input"),
        ([0.05, 0.0], {"kind": 2}, ErrorCode.OUT_OF_RANGE, "kind"),
        ([0.05, 0.0], {"friction": -1.0}, ErrorCode.OUT_OF_RANGE, "friction"),
        ([0.05, 0.0], {"model": "plain"}, ErrorCode.BAD_DATA, "outline"),
        ([0.05, 0.0], {"model": "nothing"}, ErrorCode.UNKNOWN_MODEL, "nothing"),
    ],
)
def test_what_is_wrong_is_told(served, given, changes, code, told):
    answer = served(asked(given, **changes))
    assert answer.error_code == code
    assert told in answer.error_msg


def test_a_pose_that_leans_is_refused(served):
    request = asked([0.05, 0.0])
    request.pose.orientation.x = 0.5
    answer = served(request)
    assert answer.error_code == ErrorCode.OUT_OF_RANGE
    assert "pose must be upright" in answer.error_msg


@pytest.mark.parametrize("name", ["a", "b", "rates", "twists", "margins"])
def test_numbers_that_are_not_finite_are_refused(served, monkeypatch, name):
    def broken(*given, **settings):
        found = linearise_push(*given, **settings)
        getattr(found, name)[...] = math.nan
        return found

    monkeypatch.setattr(push_services, "linearise_push", broken)
    answer = served(asked([0.05, 0.0]))
    assert answer.error_code == ErrorCode.NO_CONVERGENCE
    assert "finite" in answer.error_msg
