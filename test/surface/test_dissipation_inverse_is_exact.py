# SPDX-License-Identifier: Apache-2.0
"""The twist of a load is the one of most power for its dissipation, on facets and edges too."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from limit_surface_ros.surface import measures, sampling
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.scaling import Scaling

seeds = st.integers(0, 2**32 - 1)


def random_contacts(rng, count):
    return PointContacts(
        0.1 * rng.standard_normal((count, 2)), rng.uniform(0.1, 1, count), Scaling(0.1, count / 2)
    )


def random_dissipation(rng, terms, rank):
    roots = rng.standard_normal((terms, rank, 3))
    return Dissipation(np.swapaxes(roots, 1, 2) @ roots, Scaling(0.2, 3.0))


def assert_in_normal_cones(surface, loads):
    """The load on the surface has all the power that any load can have with its twist."""
    on_surface = loads / surface.load_factor(loads)[:, np.newaxis]
    twists = surface.twist_of_wrench(loads)
    power = (on_surface * twists).sum(axis=1)
    most = (surface.wrench_of_twist(twists) * twists).sum(axis=1)
    np.testing.assert_allclose(power, most, rtol=1e-12)
    probes = sampling.random_directions(300, 0) * surface.scaling.twist_unit
    limits = (surface.wrench_of_twist(probes) * probes).sum(axis=1)
    assert (on_surface @ probes.T <= limits * (1.0 + 1e-9) + 1e-12).all()


@given(seeds, st.integers(2, 12))
def test_motion_to_load_to_motion_is_the_identity_for_support_points(seed, count):
    contacts = random_contacts(np.random.default_rng(seed), count)
    pairs = sampling.random_motions(contacts, 50, seed)
    np.testing.assert_allclose(contacts.load_factor(pairs.wrenches), 1.0, rtol=1e-12)
    if count > 2:
        assert measures.angle_error(contacts, pairs).max() < 1e-8


@given(seeds, st.integers(2, 12))
def test_a_facet_gives_its_own_rotation(seed, count):
    contacts = random_contacts(np.random.default_rng(seed), count)
    pairs = sampling.facet_loads(contacts, 5, seed)
    assert measures.angle_error(contacts, pairs).max() < 1e-12
    assert measures.angle_error(contacts.dissipation(), pairs).max() < 1e-6


@settings(max_examples=12)
@given(seeds, st.integers(64, 1500), st.booleans(), st.sampled_from([0.0, 0.5, 20.0]))
def test_many_support_points_are_solved_as_exactly_as_few(seed, count, uneven, away):
    rng = np.random.default_rng(seed)
    limits = rng.uniform(0.1, 1.0, count) ** (20 if uneven else 1)
    points = 0.1 * rng.standard_normal((count, 2)) + 0.1 * away
    contacts = PointContacts(points, limits, Scaling(0.1, limits.sum()))
    pairs = sampling.random_motions(contacts, 70, seed)
    np.testing.assert_allclose(contacts.load_factor(pairs.wrenches), 1.0, rtol=1e-12)
    assert measures.angle_error(contacts, pairs).max() < 1e-8
    facets = sampling.facet_loads(contacts, 5, seed)
    assert measures.angle_error(contacts, facets).max() < 1e-10


@given(seeds, st.integers(1, 6), st.integers(1, 3))
def test_any_load_lies_in_the_normal_cone_of_its_twist(seed, terms, rank):
    rng = np.random.default_rng(seed)
    surface = random_dissipation(rng, terms, rank)
    loads = sampling.random_motions(surface, 40, rng).wrenches
    assert_in_normal_cones(surface, loads[np.abs(loads).max(axis=1) > 1e-6])
    if terms * rank >= 3:
        assert_in_normal_cones(surface, rng.standard_normal((40, 3)))


@pytest.mark.parametrize("outside", [0.0, 1e-13, 1e-10, 1e-7, 1e-4, 1e-2])
@pytest.mark.parametrize("count", [2, 3, 40, 300])
def test_loads_at_the_rim_of_a_facet_are_in_its_normal_cone(outside, count):
    rng = np.random.default_rng(count)
    contacts = random_contacts(rng, count)
    x, y = contacts.points.T
    turn = np.stack([y, -x, np.ones_like(x)], axis=1)
    angle = rng.uniform(0.0, 2.0 * np.pi, count)
    size = contacts.friction_limits * (1.0 + outside)
    fx, fy = size * np.cos(angle), size * np.sin(angle)
    rim = contacts.wrench_of_twist(turn) + np.stack([fx, fy, x * fy - y * fx], axis=1)
    assert_in_normal_cones(contacts, rim)


@pytest.mark.parametrize("rest", [0.0, 1e-9])
def test_in_batches_facets_and_what_is_beside_their_rims_are_told_apart(rest):
    rng = np.random.default_rng(17)
    contacts = random_contacts(rng, 3)
    # With matrices nearly of rank two there is no facet, and what would be one is not exact.
    forms = contacts.dissipation().matrices
    surface = Dissipation(forms + rest * np.eye(3), contacts.scaling)
    exact = contacts if rest == 0.0 else surface
    exact.prepare()
    x, y = np.repeat(contacts.points, 40, axis=0).T
    turn = np.stack([y, -x, np.ones_like(x)], axis=1)
    parts = np.tile([0.0, 0.5, 1.0 - 1e-9, 1.0, 1.0 + 1e-13, 1.0 + 1e-9, 1.0001, 1.1], 15)
    angle = rng.uniform(0.0, 2.0 * np.pi, 120)
    size = parts * np.repeat(contacts.friction_limits, 40)
    fx, fy = size * np.cos(angle), size * np.sin(angle)
    loads = contacts.wrench_of_twist(turn) + np.stack([fx, fy, x * fy - y * fx], axis=1)
    loads *= rng.choice([-1.0, 1.0], 120)[:, np.newaxis]
    assert_in_normal_cones(exact, loads)
    twists = exact.twist_of_wrench(loads)
    alone = np.array([exact.twist_of_wrench(load) for load in loads])
    np.testing.assert_allclose(twists, alone, atol=1e-9)
    if rest == 0.0:
        unit = turn / np.linalg.norm(turn / contacts.scaling.twist_unit, axis=1)[:, np.newaxis]
        across = np.abs(np.abs((twists * unit / contacts.scaling.twist_unit**2).sum(axis=1)) - 1.0)
        assert (across[parts <= 1.0] < 1e-14).all()


@pytest.mark.parametrize("count", [41, 101])
def test_a_line_of_points_pulled_across_is_solved_at_its_corners(count):
    x = np.linspace(-1.0, 1.0, count)
    line = PointContacts(np.stack([x, np.zeros(count)], axis=1), np.full(count, 1.0 / count))
    forces = np.linspace(-1.0, 1.0, 60)
    loads = np.stack([np.zeros(60), forces, 0.3 * np.ones(60)], axis=1)
    assert_in_normal_cones(line, loads)


def test_the_dissipation_of_points_gives_the_loads_of_the_points():
    contacts = random_contacts(np.random.default_rng(3), 5)
    twists = sampling.random_directions(1000, 4)
    np.testing.assert_allclose(
        contacts.dissipation().wrench_of_twist(twists),
        contacts.wrench_of_twist(twists),
        rtol=1e-11,
    )


def test_coincident_points_and_points_without_friction_are_as_one_and_none():
    merged = PointContacts([[0, 0], [1, 0], [0, 1]], [2, 1, 1])
    parts = PointContacts([[0, 0], [5, 5], [1, 0], [0, 0], [0, 1]], [1, 0, 1, 1, 1])
    facet = sampling.facet_loads(merged, 20, 5)
    np.testing.assert_allclose(parts.twist_of_wrench(facet.wrenches), facet.twists, atol=1e-14)
    assert parts.dissipation().matrices.shape == (4, 3, 3)
    rotated = parts.dissipation().twist_of_wrench(facet.wrenches)
    np.testing.assert_allclose(rotated, facet.twists, atol=1e-6)


def test_loads_far_from_one_newton_are_solved_alike():
    contacts = random_contacts(np.random.default_rng(8), 4)
    loads = np.random.default_rng(9).standard_normal((30, 3))
    for size in (1e-300, 1e-9, 1e9, 1e150):
        np.testing.assert_allclose(
            contacts.twist_of_wrench(size * loads), contacts.twist_of_wrench(loads), atol=1e-9
        )
        np.testing.assert_allclose(
            contacts.load_factor(size * loads), size * contacts.load_factor(loads), rtol=1e-12
        )


@pytest.mark.parametrize("rest", [1e-14, 1e-12, 1e-9, 1e-6, 1e-3])
def test_corners_that_are_a_little_round_are_solved_in_plain_floats(rest):
    # Matrices nearly of rank two: within what would be facets motions all but stay.
    rng = np.random.default_rng(7)
    roots = rng.standard_normal((3, 2, 3))
    forms = np.swapaxes(roots, 1, 2) @ roots
    sizes = np.trace(forms, axis1=1, axis2=2)[:, np.newaxis, np.newaxis]
    surface = Dissipation(forms + rest * sizes * np.eye(3))
    loads = rng.standard_normal((200, 3))
    factors, motions = zip(
        *map(surface.shape.load_factor_and_motion_scalar, loads.tolist()), strict=True
    )
    # None is left to the solver of columns, and each has all the power that there is.
    motions = np.array(motions)
    resisted = surface.shape.dissipation.values(motions.T)
    np.testing.assert_allclose((motions * loads).sum(axis=1) / resisted, factors, rtol=1e-12)
    np.testing.assert_allclose(factors, surface.load_factor(loads), rtol=1e-12)
    assert_in_normal_cones(surface, loads)
