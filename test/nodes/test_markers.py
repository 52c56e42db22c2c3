# SPDX-License-Identifier: Apache-2.0
"""What RViz shows is where the mathematics says it is (`nodes.limit_surface.markers`)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

pytest.importorskip("visualization_msgs", reason="the messages are not installed")

from visualization_msgs.msg import Marker

from limit_surface_ros.files.surface_file import SurfaceModel
from limit_surface_ros.nodes.limit_surface import markers
from limit_surface_ros.nodes.limit_surface.markers import Canvas
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling

SURFACE = PowerSum.norms([np.diag([1.0, 2.0, 0.5])], Scaling(0.05, 4.0))
MODEL = SurfaceModel("box", SURFACE, frame_id="box", reference_point=(0.1, -0.2))
CANVAS = Canvas(MODEL, 0.02, MODEL.frame_id)


def rows(marker):
    return np.array([[p.x, p.y, p.z] for p in marker.points])


def test_every_marker_stands_at_the_reference_point_in_the_models_frame():
    made = [
        markers.surface_marker(CANVAS, SURFACE),
        markers.contact_marker(CANVAS),
        *markers.load_markers(CANVAS, np.ones(3), np.ones(3), np.array([1.0, 0.0, 3.0])),
    ]
    for marker in made:
        assert marker.header.frame_id == "box"
        assert marker.header.stamp.sec == 0
        assert (marker.pose.position.x, marker.pose.position.y) == (0.1, -0.2)
        assert marker.pose.orientation.w == 1.0
    assert len({marker.ns for marker in made}) == len(made)


def test_the_mesh_lies_on_the_surface_in_load_space():
    marker = markers.surface_marker(CANVAS, SURFACE)
    assert marker.type == Marker.TRIANGLE_LIST
    assert len(marker.points) == len(marker.colors)
    assert len(marker.points) % 3 == 0
    wrenches = rows(marker) * [50.0, 50.0, 50.0 * 0.05]
    np.testing.assert_allclose(SURFACE.load_factor(wrenches), 1.0, rtol=1e-9)


def test_arrows_end_at_the_wrench_in_load_space():
    arrow = markers.wrench_marker(CANVAS, np.array([3.0, -1.0, 0.1]))
    np.testing.assert_allclose(rows(arrow), [[0, 0, 0], [0.06, -0.02, 0.04]], atol=1e-15)
    assert arrow.type == Marker.ARROW


def test_the_arc_runs_about_the_centre_of_rotation_the_way_the_body_turns():
    twist = np.array([0.03, 0.04, -1.0])
    path = rows(markers.arc_marker(CANVAS, twist))
    centre, points = path[0, :2], path[1:, :2]
    np.testing.assert_allclose(centre, [0.04, -0.03])
    np.testing.assert_allclose(np.linalg.norm(points - centre, axis=1), 0.05)
    np.testing.assert_allclose(points[0], 0.0, atol=1e-15)
    # It leaves the reference point in the direction of the reference point's velocity.
    first = points[1] - points[0]
    assert first @ twist[:2] == pytest.approx(np.hypot(*first) * 0.05, rel=2e-3)


def test_a_turn_about_the_reference_point_is_an_arc_around_it_and_no_arrow():
    twist = np.array([0.0, 0.0, 20.0])
    path = rows(markers.arc_marker(CANVAS, twist))
    np.testing.assert_allclose(np.hypot(*path[1:, :2].T), 0.025)
    assert markers.motion_marker(CANVAS, twist).action == Marker.DELETE


def test_a_straight_motion_is_an_arrow_and_no_arc():
    twist = np.array([0.0, 1.0, 1e-9])
    assert markers.arc_marker(CANVAS, twist).action == Marker.DELETE
    np.testing.assert_allclose(rows(markers.motion_marker(CANVAS, twist))[1], [0, 0.05, 0])


def test_a_body_that_sticks_shows_no_motion():
    still = np.zeros(3)
    assert markers.motion_marker(CANVAS, still).action == Marker.DELETE
    assert markers.arc_marker(CANVAS, still).action == Marker.DELETE


def test_the_cone_is_a_fan_to_the_border_of_the_region():
    twists = np.array([[1.0, 0.1, 3.0], [0.9, 0.3, -2.0], [0.8, -0.2, 1.0]])
    corners = rows(markers.cone_marker(CANVAS, twists)).reshape(-1, 3, 3)
    # Once for each side from which it may be seen.
    assert len(corners) == 2 * len(twists)
    ends = 0.05 * twists[:, :2]
    for triangle, number in zip(corners[:3], range(3), strict=True):
        np.testing.assert_allclose(triangle[0], 0.0)
        np.testing.assert_allclose(triangle[1:, :2], [ends[number], ends[(number + 1) % 3]])
    assert not corners[:, :, 2].any()
    assert markers.cone_marker(CANVAS, np.empty((0, 3))).action == Marker.DELETE


def test_contacts_are_shown_where_they_are_known():
    points = np.array([[0.0, 0.1], [0.2, 0.0]])
    known = SurfaceModel("feet", PointContacts(points, [1.0, 3.0]))
    marker = markers.contact_marker(Canvas.of(known))
    np.testing.assert_allclose(rows(marker)[:, :2], points)
    # The foot that carries more is the redder.
    assert marker.colors[1].r > marker.colors[0].r
    assert markers.contact_marker(CANVAS).action == Marker.DELETE


def test_without_a_scale_the_surface_is_about_as_large_as_the_body():
    automatic = Canvas.of(MODEL)
    drawn = automatic.load(np.array([SURFACE.scaling.friction_force, 0.0, 0.0]))
    assert drawn[0] == pytest.approx(SURFACE.scaling.characteristic_length)


def test_the_rviz_configuration_shows_what_the_node_publishes():
    path = Path(__file__).parents[2] / "config" / "limit_surface.rviz"
    manager = yaml.safe_load(path.read_text())["Visualization Manager"]
    (display, _) = [d for d in manager["Displays"] if d["Class"].endswith("MarkerArray")]
    assert display["Topic"]["Value"] == "/limit_surface/surface"
    assert display["Topic"]["Durability Policy"] == "Transient Local"
    shown = {markers.SURFACE, markers.CONTACT, *markers.OF_A_LOAD}
    assert set(display["Namespaces"]) == shown
