# SPDX-License-Identifier: Apache-2.0
"""The push service answers as the library's push does, in any known frame."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from geometry_msgs.msg import Point, Vector3
from limit_surface_interfaces.msg import ErrorCode
from limit_surface_interfaces.srv import Push

from limit_surface_ros.motion.push import ContactMode, push
from limit_surface_ros.nodes.limit_surface_node import MODES, LimitSurfaceNode
from node_helpers import STAMP, planar_twist, planar_wrench

YAW = 0.5


def request(point, normal, friction, velocity, frame="object"):
    asked = Push.Request(
        normal=Vector3(x=float(normal[0]), y=float(normal[1])),
        velocity=Vector3(x=float(velocity[0]), y=float(velocity[1])),
        friction=float(friction),
    )
    asked.header.frame_id = frame
    asked.header.stamp = STAMP
    asked.contact = Point(x=float(point[0]), y=float(point[1]))
    return asked


@pytest.fixture
def pushed(ros, client_node, model_file):
    model, path = model_file(terms=2)
    transforms = [f"object table 0.3 -0.1 0 0 0 {YAW}"]
    ros.add(LimitSurfaceNode, files=[path], parameters={"static_transforms": transforms})
    return model.surface, ros.client(client_node, Push, "/limit_surface/push")


@pytest.mark.parametrize(
    "velocity", [[0.1, 0.0], [0.1, 0.3], [0.1, -0.3], [-0.1, 0.1], [0.1, 0.02]]
)
def test_answers_equal_the_library(pushed, velocity):
    surface, call = pushed
    contact = ([-0.05, 0.01], [1.0, 0.0], 0.3, velocity)
    answer = call(request(*contact))
    assert answer.error_code == ErrorCode.NONE
    expected = push(surface, *contact)
    assert answer.mode == MODES[expected.mode]
    np.testing.assert_allclose(planar_twist(answer.twist), expected.twist, atol=1e-12)
    np.testing.assert_allclose(planar_wrench(answer.wrench), expected.wrench, atol=1e-12)
    assert answer.twist.header.frame_id == "object"
    assert answer.wrench.header.stamp == STAMP


def test_modes_are_named_in_the_interface():
    for mode in ContactMode:
        assert getattr(Push.Response, mode.name) == MODES[mode]
    assert len(set(MODES.values())) == len(ContactMode)


def test_a_push_in_another_frame_is_the_same_push(pushed):
    surface, call = pushed
    point, normal, velocity = [-0.05, 0.01], [1.0, 0.0], [0.1, 0.02]
    turn = np.array([[math.cos(YAW), math.sin(YAW)], [-math.sin(YAW), math.cos(YAW)]])
    seen = turn @ (np.array(point) - [0.3, -0.1]), turn @ normal, 0.3, turn @ velocity
    answer = call(request(*seen, frame="table"))
    expected = push(surface, point, normal, 0.3, velocity)
    assert answer.mode == MODES[expected.mode]
    np.testing.assert_allclose(planar_twist(answer.twist), expected.twist, atol=1e-9)


@pytest.mark.parametrize(
    ("spoiled", "code"),
    [
        (request([math.nan, 0], [1, 0], 0.3, [1, 0]), ErrorCode.NOT_FINITE),
        (request([0, 0], [1, 0], math.nan, [1, 0]), ErrorCode.OUT_OF_RANGE),
        (request([0, 0], [1, 0], -0.1, [1, 0]), ErrorCode.OUT_OF_RANGE),
        (request([0, 0], [1, 0], 0.1, [1e300, 0]), ErrorCode.OUT_OF_RANGE),
        (request([0, 0], [0, 0], 0.3, [1, 0]), ErrorCode.ZERO_VECTOR),
        (request([0, 0], [1, 0], 0.3, [1, 0], frame="moon"), ErrorCode.UNKNOWN_FRAME),
    ],
)
def test_what_is_no_push_gets_a_code_and_a_sentence(pushed, spoiled, code):
    answer = pushed[1](spoiled)
    assert answer.error_code == code
    assert answer.error_msg


def test_a_refused_number_is_named_as_in_the_request(pushed):
    assert "friction" in pushed[1](request([0, 0], [1, 0], -0.1, [1, 0])).error_msg
