# SPDX-License-Identifier: Apache-2.0
"""The promise of ~/surface: shown to whoever looks, up to date, and not made for nobody."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from geometry_msgs.msg import WrenchStamped
from limit_surface_interfaces.srv import WrenchToTwist
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_srvs.srv import Trigger
from visualization_msgs.msg import Marker, MarkerArray

from limit_surface_ros.nodes.limit_surface import markers
from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
from node_helpers import wrench_message

LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
FAST = {"marker_rate": 50.0}


def shown(messages, namespace):
    """Return the last marker of a namespace; None if it was taken away or never there."""
    for message in reversed(messages):
        for marker in message.markers:
            if marker.ns == namespace:
                return marker if marker.action == Marker.ADD else None
            if marker.action == Marker.DELETEALL and not any(
                other.ns == namespace for other in message.markers
            ):
                return None
    return None


@pytest.fixture
def meshes(monkeypatch):
    """Count the meshes that are made."""
    made = []
    real = markers.surface_marker

    def counted(canvas, surface):
        made.append(canvas.model.name)
        return real(canvas, surface)

    monkeypatch.setattr(markers, "surface_marker", counted)
    return made


def test_nothing_is_made_while_nobody_looks(ros, client_node, model_file, meshes):
    model, path = model_file()
    node = ros.add(LimitSurfaceNode, files=[path], parameters=FAST)
    call = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
    ticks = []
    node.create_timer(0.02, lambda: ticks.append(1))
    call(WrenchToTwist.Request(wrench=wrench_message([1, 0, 0])))
    ros.wait(lambda: len(ticks) >= 10)
    assert meshes == []
    messages = ros.listen(client_node, MarkerArray, "/limit_surface/surface", LATCHED)
    ros.wait(lambda: shown(messages, "surface") is not None)
    assert meshes == [model.name]


def test_who_joins_late_sees_the_surface_and_the_last_load(ros, client_node, model_file):
    model, path = model_file()
    ros.add(LimitSurfaceNode, files=[path], parameters=FAST)
    call = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
    wrench = np.array([8.0, 2.0, 0.3])
    call(WrenchToTwist.Request(wrench=wrench_message(wrench)))
    messages = ros.listen(client_node, MarkerArray, "/limit_surface/surface", LATCHED)
    ros.wait(lambda: shown(messages, "wrench") is not None)
    canvas = markers.Canvas.of(model)
    tip = shown(messages, "wrench").points[1]
    np.testing.assert_allclose([tip.x, tip.y, tip.z], canvas.load(wrench), rtol=1e-12)
    limit = wrench / model.surface.load_factor(wrench)
    tip = shown(messages, "limit_wrench").points[1]
    np.testing.assert_allclose([tip.x, tip.y, tip.z], canvas.load(limit), rtol=1e-12)
    assert shown(messages, "motion") is not None
    assert shown(messages, "surface").header.frame_id == model.frame_id


def test_loads_on_the_topic_move_the_arrows_and_leave_the_mesh(
    ros, client_node, model_file, meshes
):
    model, path = model_file()
    ros.add(LimitSurfaceNode, files=[path], parameters=FAST)
    messages = ros.listen(client_node, MarkerArray, "/limit_surface/surface", LATCHED)
    ros.wait(lambda: shown(messages, "surface") is not None)
    publisher = client_node.create_publisher(WrenchStamped, "/limit_surface/wrench", 10)
    ros.matched(publisher)
    inside = 0.5 * np.array([1.0, 0.0, 0.0]) / model.surface.load_factor([1.0, 0.0, 0.0])
    for wrench, slides in (([9, 0, 0], True), (inside, False), ([0, 9, 0], True)):
        before = len(messages)
        publisher.publish(wrench_message(wrench))
        ros.wait(lambda before=before: len(messages) > before)
        assert shown(messages, "wrench") is not None
        assert (shown(messages, "motion") is not None) == slides
    assert meshes == [model.name]


def test_a_zero_load_takes_the_arrows_away(ros, client_node, model_file):
    _, path = model_file()
    ros.add(LimitSurfaceNode, files=[path], parameters=FAST)
    messages = ros.listen(client_node, MarkerArray, "/limit_surface/surface", LATCHED)
    publisher = client_node.create_publisher(WrenchStamped, "/limit_surface/wrench", 10)
    ros.matched(publisher)
    publisher.publish(wrench_message([9, 0, 0]))
    ros.wait(lambda: shown(messages, "wrench") is not None)
    publisher.publish(wrench_message([0, 0, 0]))
    ros.wait(lambda: shown(messages, "wrench") is None)
    assert shown(messages, "surface") is not None


def test_reloaded_models_are_shown_and_old_loads_forgotten(ros, client_node, model_file, meshes):
    _, path = model_file()
    ros.add(LimitSurfaceNode, files=[path], parameters=FAST)
    messages = ros.listen(client_node, MarkerArray, "/limit_surface/surface", LATCHED)
    call = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
    call(WrenchToTwist.Request(wrench=wrench_message([9, 0, 0])))
    ros.wait(lambda: shown(messages, "wrench") is not None)
    first = shown(messages, "surface").points[0]
    model_file(seed=5)
    reload_models = ros.client(client_node, Trigger, "/limit_surface/reload")
    assert reload_models(Trigger.Request()).success
    ros.wait(lambda: shown(messages, "wrench") is None)
    assert shown(messages, "surface").points[0] != first


def test_the_scale_is_a_parameter(ros, client_node, model_file):
    from rclpy.parameter import Parameter

    _, path = model_file()
    node = ros.add(LimitSurfaceNode, files=[path], parameters={**FAST, "marker_scale": 0.01})
    messages = ros.listen(client_node, MarkerArray, "/limit_surface/surface", LATCHED)
    ros.wait(lambda: shown(messages, "surface") is not None)
    small = shown(messages, "surface").points[0]
    (result,) = node.set_parameters([Parameter("marker_scale", value=0.02)])
    assert result.successful
    ros.wait(lambda: shown(messages, "surface").points[0] != small)
    large = shown(messages, "surface").points[0]
    np.testing.assert_allclose([large.x, large.y], [2 * small.x, 2 * small.y], atol=1e-12)
