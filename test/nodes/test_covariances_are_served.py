# SPDX-License-Identifier: Apache-2.0
"""A model that knows how far bodies scatter says so over services and topics."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from geometry_msgs.msg import TwistWithCovarianceStamped, WrenchStamped
from limit_surface_interfaces.msg import ErrorCode
from limit_surface_interfaces.srv import WrenchToTwist

from limit_surface_ros.files.surface_file import SurfaceModel, write_surface_model
from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.dissipation_scatter import TwistScatter
from limit_surface_ros.surface.scaling import Scaling
from node_helpers import planar_twist, wrench_message

SCALING = Scaling(0.08, 5.0)
REFERENCE = (0.03, -0.02)
FACTORS = np.random.default_rng(4).normal(size=(3, 3, 3))
MATRICES = FACTORS @ FACTORS.transpose(0, 2, 1)


@pytest.fixture
def model():
    """A model with scatter, about a point off its frame's origin."""
    folds = tuple(MATRICES * scale for scale in (0.9, 1.0, 1.1))
    scatter = TwistScatter(MATRICES, folds, 0.1)
    return SurfaceModel(
        "body",
        Dissipation(MATRICES, SCALING),
        reference_point=REFERENCE,
        fit={"uncertainty": scatter.stored()},
    )


@pytest.fixture
def files(model, tmp_path):
    """Files of that model, and of one that knows no scatter."""
    paths = [tmp_path / "body.yaml", tmp_path / "plain.yaml"]
    write_surface_model(model, paths[0])
    write_surface_model(SurfaceModel("plain", model.surface), paths[1])
    return paths


def expected_covariance(model, wrench, probability=0.9):
    """Covariance at the origin of the frame, by moving vectors, and half-axes."""
    answer = model.uncertain.twist_with_covariance(wrench, probability)
    x, y = REFERENCE
    move = np.array([[1.0, 0.0, y], [0.0, 1.0, -x], [0.0, 0.0, 1.0]])
    six = np.zeros((6, 6))
    six[np.ix_([0, 1, 5], [0, 1, 5])] = move @ answer.covariance @ move.T
    return six.ravel(), answer.half_axes


def at_origin(wrench):
    fx, fy, tau = wrench
    x, y = REFERENCE
    return fx, fy, tau + x * fy - y * fx


@pytest.mark.parametrize(("asked", "probability"), [(0.0, 0.9), (0.5, 0.5)])
def test_a_twist_is_answered_with_its_covariance(
    ros, client_node, model, files, asked, probability
):
    ros.add(LimitSurfaceNode, files=files)
    call = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
    wrench = np.array([3.0, 1.0, 0.1])
    request = WrenchToTwist.Request(wrench=wrench_message(at_origin(wrench)), probability=asked)
    answer = call(request)
    assert answer.error_code == ErrorCode.NONE, answer.error_msg
    assert answer.has_covariance
    covariance, axes = expected_covariance(model, wrench, probability)
    np.testing.assert_allclose(answer.covariance, covariance, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(answer.half_axes, axes, rtol=1e-6)


def test_a_model_without_scatter_answers_none(ros, client_node, files):
    ros.add(LimitSurfaceNode, files=files)
    call = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
    answer = call(WrenchToTwist.Request(model="plain", wrench=wrench_message((3.0, 1.0, 0.1))))
    assert answer.error_code == ErrorCode.NONE
    assert not answer.has_covariance
    assert not any(answer.covariance)
    assert not any(answer.half_axes)


@pytest.mark.parametrize("name", ["body", "plain"])
@pytest.mark.parametrize("probability", [-0.1, 1.0, 7.0])
def test_what_is_no_probability_is_refused(ros, client_node, files, name, probability):
    ros.add(LimitSurfaceNode, files=files)
    call = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
    request = WrenchToTwist.Request(
        model=name, wrench=wrench_message((3.0, 1.0, 0.1)), probability=probability
    )
    answer = call(request)
    assert answer.error_code == ErrorCode.OUT_OF_RANGE
    assert "probability must be above 0 and below 1" in answer.error_msg


def test_a_stream_of_wrenches_has_covariances_beside_its_twists(ros, client_node, model, files):
    node = ros.add(LimitSurfaceNode, files=files[:1])
    received = ros.listen(
        client_node,
        TwistWithCovarianceStamped,
        "/limit_surface/predicted_twist_with_covariance",
    )
    loads = client_node.create_publisher(WrenchStamped, "/limit_surface/wrench", 10)
    ros.matched(loads)
    ros.matched(node._scattered)
    wrench = np.array([20.0, 1.0, 0.5])
    loads.publish(wrench_message(at_origin(wrench)))
    ros.wait(lambda: received)
    covariance, _ = expected_covariance(model, wrench)
    np.testing.assert_allclose(received[0].twist.covariance, covariance, rtol=1e-6, atol=1e-12)
    assert planar_twist(received[0].twist).any()
    loads.publish(wrench_message(at_origin(1e-3 * wrench)))
    ros.wait(lambda: len(received) > 1)
    assert not planar_twist(received[1].twist).any()
    assert not any(received[1].twist.covariance)
