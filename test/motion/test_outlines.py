# SPDX-License-Identifier: Apache-2.0
"""Outlines: nearest points, first touches of round tips, and what is refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from limit_surface_ros.errors import GeometryError, NotFiniteError, RangeError, ShapeError
from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.motion.round_outlines import Ellipse, SmoothCurve
from push_helpers import BUTTERFLY, RECTANGLE

ELLIPSE = Ellipse([0.0525, 0.0785], [0.01, -0.02], 0.4)
KIDNEY = SmoothCurve([[0.06, 0.0], [0.04, 0.05], [-0.05, 0.04], [-0.02, 0.0], [-0.05, -0.04]])
OUTLINES = {
    "rectangle": RECTANGLE,
    "butterfly": BUTTERFLY,
    "ellipse": ELLIPSE,
    "curve": KIDNEY,
}
seeds = st.integers(0, 2**32 - 1)


def fine(outline):
    """Return very many points of an outline (n, 2)."""
    if isinstance(outline, Ellipse):
        angles = np.linspace(0, 2 * np.pi, 40000)
        c, s = np.cos(outline.angle), np.sin(outline.angle)
        own = np.stack([np.cos(angles), np.sin(angles)], axis=1) * outline.semi_axes
        return own @ np.array([[c, s], [-s, c]]) + outline.centre
    if isinstance(outline, SmoothCurve):
        return outline._curve(np.linspace(0, outline._end, 40000))
    corners = outline.vertices
    share = np.linspace(0, 1, 8000)[:, np.newaxis]
    ends = np.roll(corners, -1, axis=0)
    return np.concatenate([a + share * (b - a) for a, b in zip(corners, ends, strict=True)])


@pytest.mark.parametrize("name", OUTLINES)
def test_nearest_points_are_those_of_brute_force(name):
    outline, rng = OUTLINES[name], np.random.default_rng(0)
    dots = fine(outline)
    points = rng.uniform(-0.12, 0.12, (100, 2))
    near = outline.nearest(points)
    away = np.linalg.norm(points[:, np.newaxis] - dots, axis=2).min(axis=1)
    np.testing.assert_allclose(np.abs(near.distances), away, atol=2e-6)
    np.testing.assert_allclose(
        near.points + near.normals * near.distances[:, np.newaxis], points, atol=1e-9
    )
    np.testing.assert_allclose(np.linalg.norm(near.normals, axis=1), 1.0, atol=1e-12)
    # Within by the number of crossings of a ray.
    a, b = dots, np.roll(dots, -1, axis=0)
    for point, distance in zip(points, near.distances, strict=True):
        spans = (a[:, 1] > point[1]) != (b[:, 1] > point[1])
        x = a[spans, 0] + (point[1] - a[spans, 1]) / (b[spans, 1] - a[spans, 1]) * (
            b[spans, 0] - a[spans, 0]
        )
        assert (np.count_nonzero(x > point[0]) % 2 == 1) == (distance < 0.0)


@pytest.mark.parametrize("name", OUTLINES)
@given(seed=seeds)
def test_a_first_touch_is_a_touch_and_nothing_is_touched_before(name, seed):
    outline, rng = OUTLINES[name], np.random.default_rng(seed)
    angles = rng.uniform(-np.pi, np.pi, 20)
    starts = 0.3 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    headings = rng.uniform(-0.08, 0.08, (20, 2)) - starts
    headings /= np.linalg.norm(headings, axis=1, keepdims=True)
    radius = np.full(20, rng.choice([0.0, 0.005, 0.03]))
    moved = outline.first_touch(starts, headings, radius)
    hits = moved < np.inf
    ends = starts + np.where(hits, moved, 0.6)[:, np.newaxis] * headings
    np.testing.assert_allclose(outline.nearest(ends[hits]).distances, radius[hits], atol=1e-9)
    for share in np.linspace(0.0, 0.9999, 60):
        gap = outline.nearest(starts + share * (ends - starts)).distances - radius
        assert gap.min() > -1e-7


def test_the_normal_turns_steadily_around_a_vertex():
    angles = np.linspace(-3.14, -np.pi / 2, 200)
    tips = RECTANGLE.vertices[0] + 0.005 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    normals = RECTANGLE.nearest(tips).normals
    np.testing.assert_allclose(np.arctan2(*normals.T[::-1]), angles, atol=1e-9)


def test_vertices_may_come_either_way_round_and_twice():
    turned = Polygon(RECTANGLE.vertices[::-1])
    doubled = Polygon(np.repeat(RECTANGLE.vertices, 2, axis=0))
    points = np.random.default_rng(1).uniform(-0.1, 0.1, (50, 2))
    for other in (turned, doubled):
        np.testing.assert_allclose(
            other.nearest(points).distances, RECTANGLE.nearest(points).distances, atol=1e-15
        )
    assert RECTANGLE.is_convex
    assert not BUTTERFLY.is_convex
    assert not KIDNEY.is_convex


def test_a_tip_in_an_inward_vertex_touches_two_edges():
    notch = np.array([[0.0, 0.01 + 0.005 * np.hypot(0.05, 0.03) / 0.05]])
    counts = BUTTERFLY.touch_counts(notch, np.array([0.005]), 1e-9)
    assert counts[0] == 2
    places = BUTTERFLY.touched(notch[0], 0.005, 1e-9)
    for foot, normal in places:
        np.testing.assert_allclose(foot + 0.005 * normal, notch[0], atol=1e-12)
    beside = np.array([[0.02, 0.05]])
    assert BUTTERFLY.touch_counts(beside, BUTTERFLY.nearest(beside).distances, 1e-9)[0] == 1


@pytest.mark.parametrize(
    ("vertices", "error", "message"),
    [
        ([[0, 0], [1, 0]], GeometryError, "three"),
        ([[0, 0], [1, 0], [2, 0]], GeometryError, "area"),
        ([[0, 0], [2, 2], [2, 0], [0, 1]], GeometryError, "cross"),
        ([[0, 0], [1, 0], [0.5, 0], [0.5, 1]], GeometryError, "cross"),
        ([[0, 0], [1, 0], [1, float("nan")]], NotFiniteError, "vertices"),
        ([0, 1, 2], ShapeError, "vertices"),
        ([[0, 0], [1e12, 0], [0, 1e12]], RangeError, "lengths"),
        (np.random.default_rng(0).uniform(size=(3000, 2)), RangeError, "2000"),
    ],
)
def test_what_is_no_outline_is_refused(vertices, error, message):
    for make in (Polygon, SmoothCurve):
        with pytest.raises(error, match=message):
            make(vertices)


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        (([0.1],), ShapeError),
        (([0.1, 0.0],), RangeError),
        (([0.1, -0.1],), RangeError),
        (([0.1, 1e12],), RangeError),
        (([0.1, 0.1], [0.0]), ShapeError),
        (([0.1, 0.1], [0.0, 0.0], float("nan")), NotFiniteError),
    ],
)
def test_what_is_no_ellipse_is_refused(arguments, error):
    with pytest.raises(error):
        Ellipse(*arguments)
