# SPDX-License-Identifier: Apache-2.0
"""Limit surfaces that Goyal, Ruina and Papadopoulos (1991) and mechanics give in closed form."""

import numpy as np
import pytest

from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.scaling import Scaling


def test_a_single_point_resists_pulls_through_it_and_turns_freely():
    point = PointContacts([[1.0, 0.0]], [2.0])
    np.testing.assert_allclose(point.load_factor([[0, 2, 2], [0, 1, 1], [1, 0, 0]]), [1, 0.5, 0.5])
    assert point.load_factor([0.0, 0.0, 1e-3]) == np.inf
    turn = point.twist_of_wrench([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.3, 0.2, 1.0]])
    half = np.sqrt(0.5)
    np.testing.assert_allclose(turn, [[0, -half, half], [0, half, -half], [0, -half, half]])
    np.testing.assert_array_equal(point.wrench_of_twist([0.0, -1.0, 1.0]), [0.0, 0.0, 0.0])


def test_a_bar_on_two_points_has_four_facets():
    bar = PointContacts([[-1.0, 0.0], [1.0, 0.0]], [1.0, 1.0])
    # Turning about one end, the other slides with force 1 and moment 1 about the middle, and the
    # end at rest adds any force within its limit.
    for end in (-1.0, 1.0):
        for sense in (-1.0, 1.0):
            centre = sense * np.array([0.0, -end, 1.0])
            motion = sense * np.array([0.0, -end, 1.0]) / np.sqrt(2.0)
            for angle in np.linspace(0.0, 2.0 * np.pi, 7):
                fx, fy = 0.9 * np.cos(angle), 0.9 * np.sin(angle)
                load = centre + np.array([fx, fy, end * fy])
                np.testing.assert_allclose(bar.twist_of_wrench(load), motion, atol=1e-15)
                assert bar.load_factor(load) == pytest.approx(1.0, rel=1e-14)


def test_a_bar_pulled_across_may_turn_about_anything_beyond_its_ends():
    bar = PointContacts([[-1.0, 0.0], [1.0, 0.0]], [1.0, 1.0])
    twist = bar.twist_of_wrench([0.0, 5.0, 0.0])
    assert bar.load_factor([0.0, 5.0, 0.0]) == pytest.approx(2.5, rel=1e-14)
    assert twist[0] == pytest.approx(0.0, abs=1e-12)
    assert abs(twist[2]) <= twist[1] * (1.0 + 1e-12)


def test_a_ring_resists_pure_moment_with_its_radius():
    angle = 2.0 * np.pi * np.arange(720) / 720
    ring = PointContacts(
        0.3 * np.stack([np.cos(angle), np.sin(angle)], axis=1), np.full(720, 5.0 / 720)
    )
    np.testing.assert_allclose(ring.wrench_of_twist([0, 0, 1]), [0, 0, 1.5], atol=1e-12)
    pull = np.array([1.0, 2.0, 0.0])
    np.testing.assert_allclose(ring.wrench_of_twist(pull), pull * 5**0.5, atol=1e-12)
    np.testing.assert_allclose(ring.twist_of_wrench([0, 0, 2.0]), [0, 0, 1], atol=1e-12)


def test_weight_scales_the_loads_and_leaves_the_motions():
    light = PointContacts([[0.0, 0.1], [0.1, -0.1], [-0.1, -0.1]], [1, 2, 1.5], Scaling(0.1, 4.5))
    heavy = light.with_friction_force(9.0)
    loads = np.random.default_rng(1).standard_normal((20, 3))
    np.testing.assert_allclose(heavy.load_factor(loads), 0.5 * light.load_factor(loads))
    np.testing.assert_allclose(heavy.twist_of_wrench(loads), light.twist_of_wrench(loads))
    np.testing.assert_allclose(light.scaled(2.0).friction_limits, heavy.friction_limits)
