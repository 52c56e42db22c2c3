# SPDX-License-Identifier: Apache-2.0
"""The places where a solver without its guards would answer wrong, and nothing would say so."""

import numpy as np
import pytest

from limit_surface_ros.errors import RangeError
from limit_surface_ros.surface import sampling
from limit_surface_ros.surface.convexity import is_convex
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.polynomial import Polynomial
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.linalg import even_directions, null_space, root_of
from limit_surface_ros.surface.scaling import Scaling


def most_power(surface, twists, probes):
    """The power of wrench_of_twist, one by one and all at once, over that of the best probe."""
    probes = probes / surface.load_factor(probes)[:, np.newaxis]
    best = np.abs(twists @ probes.T).max(axis=1)
    alone = np.array([surface.wrench_of_twist(twist) for twist in twists])
    return [
        (loads * twists).sum(axis=1) / best for loads in (alone, surface.wrench_of_twist(twists))
    ]


@pytest.mark.parametrize("exponent", [0.2, 0.35, 0.5])
@pytest.mark.parametrize("seed", range(3))
def test_a_spike_is_the_answer_where_nothing_beats_it(exponent, seed):
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((2, 3))
    spike = np.cross(root[0], root[1])
    surface = PowerSum([np.eye(3), 4.0 * root.T @ root], [1.0, exponent])
    twists = sampling.random_directions(60, seed)
    for share in most_power(surface, twists, np.array([spike, *even_directions(3000)])):
        assert (share >= 1.0 - 1e-9).all()
    # Along the spike itself the answer is its point, not one beside it.
    point = spike / surface.load_factor(spike)
    np.testing.assert_allclose(surface.wrench_of_twist(spike), point, atol=1e-9)


@pytest.mark.parametrize("exponent", [0.2, 0.35])
@pytest.mark.parametrize("seed", range(3))
def test_a_crease_is_the_answer_where_nothing_beats_it(exponent, seed):
    rng = np.random.default_rng(seed)
    normal = rng.standard_normal(3)
    plane = np.linalg.svd(normal[np.newaxis])[2][1:]
    angle = np.linspace(0.0, np.pi, 2000)
    crease = np.outer(np.cos(angle), plane[0]) + np.outer(np.sin(angle), plane[1])
    surface = PowerSum([np.eye(3), 4.0 * np.outer(normal, normal)], [1.0, exponent])
    twists = sampling.random_directions(60, seed)
    for share in most_power(surface, twists, crease):
        assert (share >= 1.0 - 1e-9).all()


@pytest.mark.parametrize("prepared", [False, True])
def test_of_two_sheets_of_a_dented_polynomial_the_better_one_is_answered(prepared):
    # x^4 + y^4 + m^4 + 12 x^2 y^2 bends inward between the axes of x and y, which are alike: the
    # answer jumps from one to the other where the components of a twist are equal.
    surface = Polynomial([1, 0, 0, 12, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1])
    if prepared:
        surface.prepare()
    more = 10.0 ** np.linspace(-9, -1, 60)
    ones = np.ones(60)
    turn = 0.3 * np.cos(np.arange(60.0))
    for twists in ([ones + more, ones, turn], [ones, ones + more, turn]):
        larger = twists[0] > twists[1]
        many = np.abs(surface.wrench_of_twist(np.transpose(twists)))
        alone = np.abs([surface.wrench_of_twist(twist) for twist in np.transpose(twists)])
        for loads in (many, alone):
            np.testing.assert_array_equal(loads[:, 0] > loads[:, 1], larger)


@pytest.mark.parametrize("place", [(0.0, 0.0), (0.3, -0.2), (5.0, 40.0)])
def test_only_a_load_with_a_moment_about_the_one_support_turns_the_body(place):
    surface = PointContacts([place], [2.0], Scaling(0.05, 1.0))
    x, y = place
    rng = np.random.default_rng(0)
    forces = rng.standard_normal((300, 2))
    through = np.column_stack([forces, x * forces[:, 1] - y * forces[:, 0]])
    expected = np.linalg.norm(forces, axis=1) / 2.0
    np.testing.assert_allclose(surface.load_factor(through), expected, rtol=1e-12)
    alone = [surface.load_factor(load) for load in through[:40]]
    np.testing.assert_allclose(alone, expected[:40], rtol=1e-12)
    beside = through + np.array([0.0, 0.0, 1e-6])
    assert np.isinf(surface.load_factor(beside)).all()
    turning = np.array([y, -x, 1.0])
    turning /= np.linalg.norm(turning / surface.scaling.twist_unit)
    np.testing.assert_allclose(surface.twist_of_wrench(beside), [turning] * 300, atol=1e-9)


def test_only_a_twist_along_an_unlimited_load_has_infinite_power():
    free = np.array([1.0, 2.0, -3.0]) / np.sqrt(14.0)
    surface = PowerSum([np.eye(3) - np.outer(free, free)] * 2, [1.0, 0.5])
    across = np.cross(free, np.random.default_rng(0).standard_normal((100, 3)))
    wrenches = surface.wrench_of_twist(across)
    np.testing.assert_allclose(surface.load_factor(wrenches), 1.0, rtol=1e-12)
    np.testing.assert_allclose(wrenches @ free, 0.0, atol=1e-12)
    with pytest.raises(RangeError, match="infinite"):
        surface.wrench_of_twist(across + 1e-9 * free)


def test_a_flat_place_is_no_dent_and_a_shallow_dent_is_one():
    # x^4 + y^4 + m^4 has no curvature at its axes; a little x^2 y^2 less makes none either.
    flat = np.array([1.0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1])
    assert is_convex(Polynomial(flat)).convex
    dented = flat.copy()
    dented[3] = -1e-3
    convexity = is_convex(Polynomial(dented))
    assert not convexity.convex
    assert 0.012 < convexity.dented_share < 0.02


@pytest.mark.parametrize("count", [30, 250])
def test_a_motion_close_by_a_support_point_is_found_among_many(count):
    rng = np.random.default_rng(count)
    points = rng.uniform(-0.05, 0.05, (count, 2))
    surface = PointContacts(points, rng.uniform(0.5, 1.5, count) / count, Scaling(0.05, 1.0))
    which = rng.integers(0, count, 150)
    # From far beyond a facet's rim down to the support point itself.
    away = 10.0 ** rng.uniform(-9, -2, (150, 1)) * rng.standard_normal((150, 2))
    away[:20] = 0.0
    x, y = (points[which] + 0.01 * away).T
    twists = np.column_stack([y, -x, np.ones(150)]) * rng.choice([-1.0, 1.0], (150, 1))
    found = surface.twist_of_wrench(surface.wrench_of_twist(twists))
    found /= np.abs(found[:, 2:])
    np.testing.assert_allclose(found, twists, atol=2e-9)


def test_the_root_of_a_form_keeps_what_is_small_beside_other_units():
    root = np.array([[1.0, 0.2, 1e-9], [0.0, 1.0, -3e-10], [0.0, 0.0, 2e-10]])
    found = root_of(root.T @ root)
    assert np.abs(found).any(axis=1).all()
    np.testing.assert_allclose(np.abs(np.linalg.det(found)), 2e-10, rtol=1e-6)
    assert len(null_space(found[np.newaxis])) == 0
    assert len(null_space(np.array([root_of(np.diag([1.0, 1e-18, 0.0]))]))) == 1


def test_norms_that_share_a_null_space_are_no_corner_of_one():
    # Two support points in one place are one; as matrices they stay two terms.
    form = np.array([[1.0, 0, 0], [0, 1.0, 0], [0, 0, 0]])
    third = np.array([[1.0, 0, -0.5], [0, 1.0, 0.8], [-0.5, 0.8, 0.89]])
    twice = Dissipation([form, form, third])
    once = Dissipation([4.0 * form, third])
    loads = sampling.random_directions(400, 0)
    np.testing.assert_allclose(twice.load_factor(loads), once.load_factor(loads), rtol=1e-8)


@pytest.mark.parametrize("seed", [306, 1458])
def test_a_kink_that_draws_the_search_in_is_not_taken_for_the_answer(seed):
    # Of one of these motions each, Newton's method alone ends 6e-5 off, beside a support point.
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 6))
    points = rng.uniform(-0.05, 0.05, (count, 2))
    surface = PointContacts(points, rng.uniform(0.1, 1.5, count), Scaling(0.05, 1.0))
    which = rng.integers(0, count, 100)
    away = 10.0 ** rng.uniform(-12, -2, (100, 1)) * rng.standard_normal((100, 2))
    x, y = (points[which] + 0.01 * away).T
    twists = np.column_stack([y, -x, np.ones(100)])
    found = surface.twist_of_wrench(surface.wrench_of_twist(twists))
    found /= np.abs(found[:, 2:])
    np.testing.assert_allclose(found, twists, atol=2e-9)


@pytest.mark.parametrize("seed", range(4))
def test_loads_on_the_rim_of_a_facet_turn_the_body_about_its_support_point(seed):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-0.05, 0.05, (3, 2))
    limits = rng.uniform(0.1, 1.5, 3)
    surface = PointContacts(points, limits, Scaling(0.05, 1.0))
    x, y = np.repeat(points, 10, axis=0).T
    about = np.column_stack([y, -x, np.ones(30)])
    angle = rng.uniform(0.0, 2.0 * np.pi, 30)
    fx, fy = np.repeat(limits, 10) * (np.cos(angle), np.sin(angle))
    loads = surface.wrench_of_twist(about) + np.column_stack([fx, fy, x * fy - y * fx])
    for found in (
        surface.twist_of_wrench(loads),
        np.array([surface.twist_of_wrench(load) for load in loads]),
    ):
        np.testing.assert_allclose(found / found[:, 2:], about, atol=1e-12)


def test_a_corner_between_flat_faces_is_met_from_beside_it():
    # |v| + |omega|: the loads are a disc times an interval. Beside its corner nothing is curved.
    surface = Dissipation([np.diag([1.0, 1.0, 0.0]), np.diag([0.0, 0.0, 1.0])])
    loads = sampling.random_directions(100, 0)
    expected = np.maximum(np.hypot(loads[:, 0], loads[:, 1]), np.abs(loads[:, 2]))
    np.testing.assert_allclose(surface.load_factor(loads), expected, rtol=1e-12)
    alone = [surface.load_factor(load) for load in loads]
    np.testing.assert_allclose(alone, expected, rtol=1e-12)


def test_a_load_beside_a_null_space_keeps_the_little_that_a_term_adds():
    surface = PowerSum([np.eye(3), np.diag([1.0, 4.0, 0.0])], [1.0, 0.2])
    away = 10.0 ** np.linspace(-11, -1, 30)
    loads = np.column_stack([away, away, np.ones(30)])
    alone = np.array([surface.load_factor(load) for load in loads])
    for factors in (surface.load_factor(loads), alone):
        terms = (1.0 + 2.0 * away**2) / factors**2 + (5.0 * away**2 / factors**2) ** 0.2
        np.testing.assert_allclose(terms, 1.0, rtol=1e-13)


@pytest.mark.parametrize("exponent", [0.2, 0.3, 0.45])
def test_rounding_on_a_straight_side_is_no_dent(exponent):
    # One form alone makes a cylinder, whatever its exponents: straight in one direction.
    root = np.random.default_rng(0).standard_normal((2, 3))
    assert is_convex(PowerSum([root.T @ root] * 2, [exponent, 1.0])).convex
