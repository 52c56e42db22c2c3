# SPDX-License-Identifier: Apache-2.0
"""Bodies of any size, anywhere, on any supports: answers are right, infinite only if truly so."""

import numpy as np
import pytest

from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.scaling import Scaling

TRIANGLE = np.array([[-0.4, -0.4], [-0.4, 0.8], [0.8, -0.4]])
LIMITS = np.array([0.5, 0.7, 0.6])


def turned_about(points, distance=0.0):
    """Twists that turn about points, or a distance beside them."""
    x, y = points.T + distance
    return np.column_stack([y, -x, np.ones(len(points))])


def unit_twists(surface, twists):
    return twists / np.linalg.norm(twists / surface.scaling.twist_unit, axis=-1, keepdims=True)


@pytest.mark.parametrize("kind", ["points", "dissipation"])
@pytest.mark.parametrize("size", [1e-9, 1e-6, 1.0, 1e6, 1e9])
@pytest.mark.parametrize("rho", ["own", 1.0])
def test_a_body_of_any_size_moves_as_its_likeness_of_one_metre(kind, size, rho):
    likeness = PointContacts(TRIANGLE, LIMITS)
    own = Scaling(size if rho == "own" else rho, 1.0)
    body = PointContacts(size * TRIANGLE, LIMITS, own)
    if kind == "dissipation":
        body = body.dissipation()
    wrenches = np.random.default_rng(0).standard_normal((60, 3))
    factors = likeness.load_factor(wrenches)
    sized = wrenches * [1.0, 1.0, size]
    np.testing.assert_allclose(body.load_factor(sized), factors, rtol=1e-9)
    alone = [body.load_factor(wrench) for wrench in sized[:9]]
    np.testing.assert_allclose(alone, factors[:9], rtol=1e-9)
    twists = body.twist_of_wrench(sized) * [1.0, 1.0, size]
    expected = likeness.twist_of_wrench(wrenches)
    twists /= np.linalg.norm(twists, axis=1, keepdims=True)
    np.testing.assert_allclose(twists, expected, atol=1e-6)


@pytest.mark.parametrize("away", [(1e3, -4e2), (0.0, 1e3), (-30.0, 7.0)])
@pytest.mark.parametrize("kind", ["points", "dissipation"])
def test_a_reference_point_far_away_changes_nothing(away, kind):
    near = PointContacts(0.1 * TRIANGLE, LIMITS, Scaling(0.05, 1.0))
    far = PointContacts(0.1 * TRIANGLE + away, LIMITS, Scaling(0.05, 1.0))
    if kind == "dissipation":
        far = far.dissipation()
    wrenches = np.random.default_rng(0).standard_normal((80, 3)) * [1.0, 1.0, 0.1]
    moved = wrenches.copy()
    moved[:, 2] += away[0] * wrenches[:, 1] - away[1] * wrenches[:, 0]
    # A moment about a point so far away has lost as many digits as the distance has.
    rtol = 1e-16 * np.hypot(*away) / 0.05 * 1e3
    rtol = max(rtol, 1e-10) if kind == "points" else 1e-4
    factors = near.load_factor(wrenches)
    np.testing.assert_allclose(far.load_factor(moved), factors, rtol=rtol)
    np.testing.assert_allclose([far.load_factor(w) for w in moved[:9]], factors[:9], rtol=rtol)


@pytest.mark.parametrize("ratio", [1e-3, 1e-7, 1e-12])
@pytest.mark.parametrize("kind", ["points", "dissipation"])
def test_a_second_support_however_weak_limits_every_load(ratio, kind):
    points = np.array([[0.03, -0.02], [-0.05, 0.06]])
    surface = PointContacts(points, [1.0, ratio], Scaling(0.05, 1.0))
    if kind == "dissipation":
        surface = surface.dissipation()
    arm = points[1] - points[0]
    # A pure moment about the strong support is held by the weak one alone.
    moment = np.array([0.0, 0.0, ratio * np.hypot(*arm)])
    np.testing.assert_allclose(surface.load_factor(moment), 1.0, rtol=1e-6)
    np.testing.assert_allclose(surface.load_factor([moment, 3.0 * moment]), [1.0, 3.0], rtol=1e-6)
    wrenches = np.random.default_rng(0).standard_normal((50, 3)) * [1.0, 1.0, 0.1]
    factors = surface.load_factor(wrenches)
    assert np.isfinite(factors).all()
    # Most loads turn the body about the strong support: both supports give their limits.
    turning = unit_twists(surface, turned_about(points[:1])[0])
    power = (surface.wrench_of_twist(turning) * turning).sum()
    lower = np.abs(wrenches @ turning) / power
    assert (factors >= lower * (1.0 - 1e-9)).all()
    np.testing.assert_allclose(np.median(factors / lower), 1.0, rtol=1e-6)


@pytest.mark.parametrize("place", [(0.0, 0.0), (0.3, -0.2), (12.0, 900.0)])
def test_one_support_pushed_on_the_spot_follows_the_force(place):
    surface = PointContacts([place], [2.0], Scaling(0.05, 1.0))
    x, y = place
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    forces = np.column_stack([np.cos(angle), np.sin(angle)])
    wrenches = np.column_stack([forces, x * forces[:, 1] - y * forces[:, 0]])
    for factors in (
        surface.load_factor(wrenches),
        np.array([surface.load_factor(w) for w in wrenches]),
    ):
        np.testing.assert_allclose(factors, 0.5, rtol=1e-12)
    velocities = surface.twist_of_wrench(wrenches) @ np.array([[1, 0], [0, 1], [-y, x]])
    along = velocities / np.linalg.norm(velocities, axis=1, keepdims=True)
    np.testing.assert_allclose(along, forces, atol=1e-9)


def test_supports_in_one_line_and_in_one_place_hold_what_they_can():
    line = PointContacts([[-0.1, 0.0], [0.0, 0.0], [0.1, 0.0]], [1.0, 1.0, 1.0], Scaling(0.1, 1.0))
    np.testing.assert_allclose(line.load_factor([[3.0, 0, 0], [0, 3.0, 0], [0, 0, 0.2]]), 1.0)
    one_place = PointContacts([[0.1, 0.2]] * 3, [1.0, 1.0, 1.0], Scaling(0.1, 1.0))
    assert one_place.load_factor([3.0, 0.0, -0.6]) == pytest.approx(1.0, rel=1e-12)
    assert one_place.load_factor([3.0, 0.0, -0.5]) == np.inf


def test_a_motion_that_no_term_resists_is_free_and_no_other_is():
    form = np.diag([1.0, 1.0, 0.0])
    assert Dissipation([form]).load_factor([0.0, 0.0, 1e-3]) == np.inf
    for least in (1e-6, 1e-12, 1e-20):
        surface = Dissipation([np.diag([1.0, 1.0, least])])
        np.testing.assert_allclose(
            surface.load_factor([0.0, 0.0, 1.0]), 1.0 / np.sqrt(least), rtol=1e-9
        )
