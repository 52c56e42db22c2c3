# SPDX-License-Identifier: Apache-2.0
"""The services of the limit_surface node answer as the library does, or say why not."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from ament_index_python.packages import get_package_share_directory
from limit_surface_interfaces.msg import ErrorCode
from limit_surface_interfaces.srv import ListModels, TwistToWrench, WrenchToTwist

from limit_surface_ros.files.surface_file import read_surface_model
from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
from node_helpers import STAMP, planar_twist, planar_wrench, twist_message, wrench_message


@pytest.fixture
def served(ros, client_node, model_file):
    """A node with one model, and its two clients."""
    model, path = model_file(terms=2)
    node = ros.add(LimitSurfaceNode, files=[path])
    forward = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
    back = ros.client(client_node, TwistToWrench, "/limit_surface/twist_to_wrench")
    return node, model, forward, back


def test_answers_equal_the_library(served):
    _, model, forward, back = served
    rng = np.random.default_rng(1)
    for wrench in rng.normal(size=(20, 3)) * [3.0, 3.0, 0.1]:
        answer = forward(WrenchToTwist.Request(wrench=wrench_message(wrench)))
        assert answer.error_code == ErrorCode.NONE
        assert answer.error_msg == ""
        factor = float(model.surface.load_factor(wrench))
        expected = model.surface.twist_of_wrench(wrench)
        assert answer.load_factor == pytest.approx(factor, rel=1e-12)
        assert answer.slides == (factor >= 1.0)
        np.testing.assert_allclose(planar_twist(answer.twist), expected, atol=1e-12)
        np.testing.assert_allclose(planar_wrench(answer.limit_wrench), wrench / factor, rtol=1e-12)
        twist = answer.twist
        needed = back(TwistToWrench.Request(twist=twist))
        load = model.surface.wrench_of_twist(expected)
        np.testing.assert_allclose(planar_wrench(needed.wrench), load, rtol=1e-9, atol=1e-12)
        assert needed.power == pytest.approx(load @ expected, rel=1e-9)


def test_answers_keep_the_stamp_and_stand_in_the_models_frame(served):
    _, model, forward, back = served
    answer = forward(WrenchToTwist.Request(wrench=wrench_message([5, 0, 0])))
    needed = back(TwistToWrench.Request(twist=twist_message([1, 0, 0])))
    for stamped in (answer.twist, answer.limit_wrench, needed.wrench):
        assert stamped.header.stamp == STAMP
        assert stamped.header.frame_id == model.frame_id


@pytest.mark.parametrize(
    ("wrench", "code"),
    [
        ([math.nan, 0, 0], ErrorCode.NOT_FINITE),
        ([0, math.inf, 0], ErrorCode.NOT_FINITE),
        ([0, 0, -math.inf], ErrorCode.NOT_FINITE),
        ([0, 0, 0], ErrorCode.ZERO_VECTOR),
        ([1e308, 0, 0], ErrorCode.OUT_OF_RANGE),
        ([5e-324, 0, 0], ErrorCode.OUT_OF_RANGE),
    ],
)
def test_bad_numbers_get_a_code_and_a_sentence_and_the_node_goes_on(served, wrench, code):
    _, _, forward, back = served
    for answer in (
        forward(WrenchToTwist.Request(wrench=wrench_message(wrench))),
        back(TwistToWrench.Request(twist=twist_message(wrench))),
    ):
        assert answer.error_code == code
        assert len(answer.error_msg.split()) > 3
    good = forward(WrenchToTwist.Request(wrench=wrench_message([5, 0, 0])))
    assert good.error_code == ErrorCode.NONE


def test_nan_in_a_component_that_is_not_used_is_refused_too(served):
    _, _, forward, _ = served
    wrench = wrench_message([1, 0, 0])
    wrench.wrench.torque.x = math.nan
    answer = forward(WrenchToTwist.Request(wrench=wrench))
    assert answer.error_code == ErrorCode.NOT_FINITE
    assert "torque.x" in answer.error_msg


def test_an_unknown_model_is_named_beside_those_that_are_loaded(served):
    _, model, forward, back = served
    for answer in (
        forward(WrenchToTwist.Request(model="sofa", wrench=wrench_message([1, 0, 0]))),
        back(TwistToWrench.Request(model="sofa", twist=twist_message([1, 0, 0]))),
    ):
        assert answer.error_code == ErrorCode.UNKNOWN_MODEL
        assert "sofa" in answer.error_msg
        assert model.name in answer.error_msg


def test_an_unknown_frame_is_refused_with_both_frames_named(served):
    _, _, forward, back = served
    for answer in (
        forward(WrenchToTwist.Request(wrench=wrench_message([1, 0, 0], frame="moon"))),
        back(TwistToWrench.Request(twist=twist_message([1, 0, 0], frame="moon"))),
    ):
        assert answer.error_code == ErrorCode.UNKNOWN_FRAME
        assert "moon" in answer.error_msg
        assert "object" in answer.error_msg


def test_an_empty_frame_is_refused(served):
    _, _, forward, _ = served
    answer = forward(WrenchToTwist.Request(wrench=wrench_message([1, 0, 0], frame="")))
    assert answer.error_code == ErrorCode.UNKNOWN_FRAME
    assert "assume_model_frame" in answer.error_msg


def test_two_nodes_under_two_namespaces_do_not_meet(ros, client_node, model_file):
    models = {}
    for seed, namespace in enumerate(("left", "right")):
        models[namespace], path = model_file(name=namespace, seed=seed)
        ros.add(LimitSurfaceNode, files=[path], namespace=namespace)
    wrench = [1.0, -2.0, 0.05]
    for namespace, model in models.items():
        name = f"/{namespace}/limit_surface/wrench_to_twist"
        call = ros.client(client_node, WrenchToTwist, name)
        answer = call(WrenchToTwist.Request(wrench=wrench_message(wrench)))
        np.testing.assert_allclose(
            planar_twist(answer.twist), model.surface.twist_of_wrench(wrench), atol=1e-12
        )
        other = ({*models} - {namespace}).pop()
        refused = call(WrenchToTwist.Request(model=other, wrench=wrench_message(wrench)))
        assert refused.error_code == ErrorCode.UNKNOWN_MODEL


def test_the_shipped_default_model_answers_within_1e_9_of_the_library(ros, client_node):
    ros.add(LimitSurfaceNode)
    listed = ros.client(client_node, ListModels, "/limit_surface/list_models")
    default = listed(ListModels.Request()).models[0]
    assert default.is_default
    shared = Path(get_package_share_directory("limit_surface_ros"))
    model = read_surface_model(shared / "config" / "models" / f"{default.name}.yaml")
    call = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
    rng = np.random.default_rng(2)
    for wrench in rng.normal(size=(50, 3)) * [1.0, 1.0, 0.1]:
        answer = call(WrenchToTwist.Request(wrench=wrench_message(wrench, frame=default.frame_id)))
        expected = model.surface.twist_of_wrench(wrench)
        np.testing.assert_allclose(planar_twist(answer.twist), expected, rtol=1e-9, atol=1e-9)
        assert answer.load_factor == pytest.approx(model.surface.load_factor(wrench), rel=1e-9)
