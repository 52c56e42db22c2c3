# SPDX-License-Identifier: Apache-2.0
"""Pairs drawn from a surface lie on it, and the measures of error measure what they say."""

import numpy as np
import pytest

from limit_surface_ros.errors import DataError, RangeError
from limit_surface_ros.surface import measures, sampling
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.pairs import Pairs
from limit_surface_ros.surface.scaling import Scaling

TRIANGLE = np.array([[-40, -40], [-40, 80], [80, -40]]) / 150
BALL = PowerSum.thesis([np.eye(3)], Scaling(characteristic_length=0.2, friction_force=3.0))


def test_motions_are_uniform_unit_twists_in_scaled_variables():
    pairs = sampling.random_motions(BALL, 4000, rng=1)
    scaled = pairs.twists / BALL.scaling.twist_unit
    np.testing.assert_allclose(np.linalg.norm(scaled, axis=1), 1.0, rtol=1e-14)
    assert abs(scaled.mean(axis=0)).max() < 0.05
    np.testing.assert_allclose((scaled**2).mean(axis=0), 1 / 3, atol=0.02)


def test_loads_of_a_ball_are_parallel_to_their_motions():
    pairs = sampling.random_loads(BALL, 50, rng=2)
    np.testing.assert_allclose(
        pairs.wrenches / BALL.scaling.wrench_unit, pairs.twists / BALL.scaling.twist_unit
    )


def test_the_same_seed_draws_the_same_pairs():
    first, second = (sampling.random_motions(BALL, 5, rng=7) for _ in range(2))
    np.testing.assert_array_equal(first.wrenches, second.wrenches)


def test_facet_twists_turn_about_their_support_point():
    contacts = PointContacts(TRIANGLE, np.full(3, 0.5), Scaling(0.1, 2.0))
    pairs = sampling.facet_loads(contacts, per_facet=10, rng=3)
    assert len(pairs) == 60
    points = np.repeat(TRIANGLE, 20, axis=0)
    vx, vy, omega = pairs.twists.T
    np.testing.assert_allclose(vx, omega * points[:, 1], atol=1e-15)
    np.testing.assert_allclose(vy, -omega * points[:, 0], atol=1e-15)


def test_facet_loads_have_the_power_of_their_facet():
    contacts = PointContacts(TRIANGLE, np.array([0.5, 1.0, 2.0]))
    pairs = sampling.facet_loads(contacts, per_facet=200, rng=3)
    power = (pairs.wrenches * pairs.twists).sum(axis=1)
    dissipation = (contacts.wrench_of_twist(pairs.twists) * pairs.twists).sum(axis=1)
    np.testing.assert_allclose(power, dissipation, rtol=1e-13)


def test_facet_loads_fill_the_friction_limit_of_the_point_at_rest():
    limits = np.array([0.5, 1.0, 2.0])
    contacts = PointContacts(TRIANGLE, limits)
    pairs = sampling.facet_loads(contacts, per_facet=500, rng=3)
    rest = pairs.wrenches - contacts.wrench_of_twist(pairs.twists)
    size = np.hypot(rest[:, 0], rest[:, 1]).reshape(3, -1) / limits[:, np.newaxis]
    assert (size <= 1.0 + 1e-12).all()
    np.testing.assert_allclose(size.mean(axis=1), 0.5, atol=0.03)


@pytest.mark.parametrize("draw", [sampling.random_motions, sampling.random_loads])
def test_drawing_no_pairs_is_refused(draw):
    with pytest.raises(RangeError, match="at least 1, got 0"):
        draw(BALL, 0)


def test_a_surface_has_no_error_against_itself():
    pairs = sampling.random_loads(BALL, 100, rng=4)
    assert measures.velocity_error(BALL, pairs).max() < 1e-14
    assert measures.load_error(BALL, pairs).max() < 1e-14
    assert measures.force_error(BALL, BALL, sampling.random_directions(100, 5)).max() < 1e-14


def test_opposite_twists_are_two_apart_and_at_angle_pi():
    pairs = sampling.random_loads(BALL, 20, rng=4)
    opposite = Pairs(pairs.wrenches, -pairs.twists)
    np.testing.assert_allclose(measures.velocity_error(BALL, opposite), 2.0)
    assert measures.mean_angle(BALL, opposite) == pytest.approx(np.pi)


def test_velocity_error_does_not_depend_on_speed_or_weight():
    pairs = sampling.random_motions(BALL, 20, rng=4)
    turned = Pairs(np.roll(pairs.wrenches, 1, axis=0), 100.0 * pairs.twists)
    np.testing.assert_allclose(
        measures.velocity_error(BALL, turned),
        measures.velocity_error(BALL.with_friction_force(77.0), turned),
    )


def test_force_error_of_a_body_twice_as_heavy_is_the_difference_of_the_limits():
    errors = measures.force_error(BALL, BALL.scaled(2.0), sampling.random_directions(50, 6))
    np.testing.assert_allclose(errors, 1.0)


def test_quantiles_default_to_median_95_percent_and_largest():
    np.testing.assert_allclose(measures.quantiles(np.arange(101.0)), [50.0, 95.0, 100.0])
    with pytest.raises(DataError, match="at least one"):
        measures.quantiles([])


def test_the_empirical_distribution_rises_to_one():
    values, shares = measures.empirical_distribution([3.0, 1.0, 2.0, 2.0])
    np.testing.assert_array_equal(values, [1.0, 2.0, 2.0, 3.0])
    np.testing.assert_array_equal(shares, [0.25, 0.5, 0.75, 1.0])


def test_velocity_error_takes_the_gradient_at_the_load_itself():
    rng = np.random.default_rng(8)
    roots = rng.standard_normal((3, 3, 3))
    surface = PowerSum.thesis(np.swapaxes(roots, 1, 2) @ roots, Scaling(0.1, 2.0))
    pairs = sampling.random_motions(BALL, 50, rng=9)
    gradient = surface.gradient(pairs.wrenches / surface.scaling.wrench_unit)
    gradient /= np.linalg.norm(gradient, axis=1, keepdims=True)
    measured = pairs.twists / surface.scaling.twist_unit
    measured /= np.linalg.norm(measured, axis=1, keepdims=True)
    expected = np.linalg.norm(measured - gradient, axis=1)
    np.testing.assert_allclose(measures.velocity_error(surface, pairs), expected, rtol=1e-12)
    # Off the surface that is another direction than the motion which the model predicts.
    assert np.abs(measures.direction_error(surface, pairs) - expected).max() > 1e-3
    on_surface = Pairs(pairs.wrenches / surface.load_factor(pairs.wrenches)[:, None], pairs.twists)
    np.testing.assert_allclose(
        measures.velocity_error(surface, on_surface),
        measures.direction_error(surface, pairs),
        rtol=1e-9,
    )


def test_velocity_and_direction_are_one_where_the_gradient_is_the_same_along_a_ray():
    pairs = sampling.random_motions(BALL, 50, rng=9)
    for surface in (BALL, PointContacts(TRIANGLE, np.full(3, 0.5))):
        np.testing.assert_array_equal(
            measures.velocity_error(surface, pairs), measures.direction_error(surface, pairs)
        )
