# SPDX-License-Identifier: Apache-2.0
"""A push obeys the quasi-static conditions, and agrees with brute force over all motions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from limit_surface_ros.errors import RangeError, ShapeError, ZeroVectorError
from limit_surface_ros.motion.push import ContactMode, motion_cone, push
from limit_surface_ros.surface.contact.patch import ContactPatch
from limit_surface_ros.surface.contact.shapes import rectangle
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling

seeds = st.integers(0, 2**32 - 1)
SQUARE = ContactPatch.of_shape(rectangle([0.1, 0.1], 100)).surface(0.3, 10.0)
TRIPOD = PointContacts([[0.05, 0.0], [-0.03, 0.04], [-0.03, -0.05]], [1, 2, 1], Scaling(0.05, 4))
ELLIPSOID = PowerSum.thesis([np.diag([1.0, 1.0, 1.0])], Scaling(0.04, 3.0))


def contact_velocity(twist, point):
    return np.array([twist[0] - twist[2] * point[1], twist[1] + twist[2] * point[0]])


@pytest.mark.parametrize("surface", [SQUARE, TRIPOD, ELLIPSOID], ids=lambda s: s.kind)
@given(seed=seeds)
def test_every_push_obeys_the_quasi_static_conditions(surface, seed):
    rng = np.random.default_rng(seed)
    point, mu = 0.05 * rng.standard_normal(2), rng.uniform(0.0, 1.0)
    angle, heading = rng.uniform(0, 2 * np.pi), rng.uniform(-1.5, 1.5)
    normal = np.array([np.cos(angle), np.sin(angle)])
    left = np.array([-normal[1], normal[0]])
    velocity = 0.1 * np.array([np.cos(angle + heading), np.sin(angle + heading)])
    result = push(surface, point, normal, mu, velocity)
    # The wrench is that of a force through the contact, on the surface and in the cone.
    force = result.wrench[:2]
    assert result.wrench[2] == pytest.approx(point[0] * force[1] - point[1] * force[0], abs=1e-9)
    assert surface.load_factor(result.wrench) == pytest.approx(1.0, rel=1e-9)
    assert abs(force @ left) <= mu * (force @ normal) * (1 + 1e-9) + 1e-9
    # The twist has all the power that any load can have with it.
    most = surface.wrench_of_twist(result.twist) @ result.twist
    assert result.wrench @ result.twist == pytest.approx(most, rel=1e-7)
    # The body keeps up with the pusher, but for slip along the face against which force stands.
    slip = velocity - contact_velocity(result.twist, point)
    assert slip @ normal == pytest.approx(0.0, abs=1e-9)
    if result.mode is ContactMode.STICK:
        assert slip @ left == pytest.approx(0.0, abs=1e-8)
    else:
        side = 1.0 if result.mode is ContactMode.SLIDE_LEFT else -1.0
        assert side * (slip @ left) > 0.0
        assert side * (force @ left) == pytest.approx(mu * (force @ normal), abs=1e-9)


@pytest.mark.parametrize("surface", [SQUARE, TRIPOD], ids=lambda s: s.kind)
def test_a_sticking_push_is_the_motion_of_least_dissipation(surface):
    point = np.array([-0.05, 0.013])
    for heading in np.linspace(-0.5, 0.5, 9):
        velocity = np.array([np.cos(heading), np.sin(heading)])
        result = push(surface, point, [1.0, 0.0], 50.0, velocity)
        assert result.mode is ContactMode.STICK
        turn = np.array([point[1], -point[0], 1.0])
        rates = np.linspace(-40.0, 40.0, 40001)
        motions = np.array([*velocity, 0.0]) + rates[:, np.newaxis] * turn
        powers = (surface.wrench_of_twist(motions) * motions).sum(axis=1)
        assert result.wrench @ result.twist <= powers.min() * (1 + 1e-7)
        assert result.twist[2] == pytest.approx(rates[powers.argmin()], abs=4e-3)


def test_a_push_through_the_centre_of_friction_goes_straight():
    result = push(SQUARE, [-0.05, 0.0], [1.0, 0.0], 0.3, [0.02, 0.0])
    np.testing.assert_allclose(result.twist, [0.02, 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(result.wrench, [3.0, 0.0, 0.0], atol=1e-9)


@given(seed=seeds)
def test_a_body_that_turns_freely_about_its_one_support_is_pushed_with_the_force_it_needs(seed):
    rng = np.random.default_rng(seed)
    support = PointContacts([[0.0, 0.0]], [1.0])
    velocity = [0.1, rng.uniform(-0.05, 0.05)]
    result = push(support, 0.05 * rng.standard_normal(2), [1.0, 0.0], 0.8, velocity)
    needed = support.wrench_of_twist(result.twist)
    assert result.wrench @ result.twist == pytest.approx(needed @ result.twist, rel=1e-7)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("arm", "velocity"), [(0.5, (3.0, 4.0)), (1.0, (5.0, 12.0))])
def test_a_push_whose_turning_rate_ends_the_range_that_is_searched_is_found(arm, velocity, side):
    # Of unit friction for translations and turns alike: the rate is known, and the characteristic
    # length makes it the first that is tried, whose moment about the contact is zero.
    along, across = velocity[0], side * velocity[1]
    rate = -arm * across / (1.0 + arm**2)
    length = np.hypot(along, across) / abs(rate)
    surface = Dissipation([np.diag([1.0, 1.0, 1.0 / length**2])], Scaling(length, 1.0))
    result = push(surface, [-arm, 0.0], [1.0, 0.0], 50.0, [along, across])
    assert result.mode is ContactMode.STICK
    assert result.twist[2] == pytest.approx(rate, rel=1e-9)


def test_a_pusher_that_moves_away_leaves():
    result = push(SQUARE, [-0.05, 0.0], [1.0, 0.0], 0.3, [-0.02, 0.1])
    assert result.mode is ContactMode.SEPARATE
    assert not result.twist.any()
    assert not result.wrench.any()


def test_without_friction_the_pusher_slides_whichever_way_it_moves():
    modes = [push(SQUARE, [-0.05, 0.0], [1, 0], 0.0, [1.0, side]).mode for side in (1.0, -1.0)]
    assert modes == [ContactMode.SLIDE_LEFT, ContactMode.SLIDE_RIGHT]


def test_the_motion_cone_holds_the_sticking_velocities():
    cone = motion_cone(ELLIPSOID, [-0.05, 0.01], [1.0, 0.0], 0.4)
    inside = cone.velocities.sum(axis=0)
    assert push(ELLIPSOID, [-0.05, 0.01], [1, 0], 0.4, inside).mode is ContactMode.STICK
    outside = 1.1 * cone.velocities[1] - 0.1 * cone.velocities[0]
    assert push(ELLIPSOID, [-0.05, 0.01], [1, 0], 0.4, outside).mode is ContactMode.SLIDE_LEFT


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        (([0, 0, 0], [1, 0], 0.3, [1, 0]), ShapeError, "point"),
        (([0, 0], [0, 0], 0.3, [1, 0]), ZeroVectorError, "normal"),
        (([0, 0], [1, 0], -0.1, [1, 0]), RangeError, "friction"),
        (([0, 0], [1, 0], float("nan"), [1, 0]), RangeError, "friction"),
        (([0, 0], [1, 0], 0.3, [1]), ShapeError, "velocity"),
    ],
)
def test_what_is_no_push_is_refused(arguments, error, message):
    with pytest.raises(error, match=message):
        push(SQUARE, *arguments)
