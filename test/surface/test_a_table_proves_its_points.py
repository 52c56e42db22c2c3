# SPDX-License-Identifier: Apache-2.0
"""Batches that pay for a table are answered from it, as exactly as one by one."""

import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from limit_surface_ros.surface import sampling
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.polynomial import Polynomial
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling
from limit_surface_ros.surface.support.solvers import SupportSolver
from limit_surface_ros.surface.support.table import SupportTable
from limit_surface_ros.surface.support.tabulated import Tabulated

# More than enough to meet most cells of a table.
MANY = 30_000
FEW = 300


def matrices(rng, terms, ranks=(3,)):
    """Random matrices (terms, 3, 3) of condition numbers up to some thousands."""
    roots = rng.standard_normal((terms, 3, 3)) * 10.0 ** rng.uniform(-1, 1, (terms, 1, 3))
    for root in roots:
        root[: 3 - rng.choice(ranks)] = 0.0
    return np.swapaxes(roots, 1, 2) @ roots


def surface_of(kind, seed):
    rng = np.random.default_rng(seed)
    scaling = Scaling(0.1, 5.0)
    if kind == "norms":
        return PowerSum.norms(matrices(rng, 4, (2, 3)), scaling)
    if kind == "powers":
        return PowerSum(matrices(rng, 3), rng.uniform(0.5, 1.0, 3), scaling)
    if kind == "low powers":
        return PowerSum(
            matrices(rng, 3), [rng.uniform(0.15, 0.5), *rng.uniform(0.2, 1, 2)], scaling
        )
    if kind == "dissipation":
        return Dissipation(matrices(rng, 4, (2, 3)), scaling)
    if kind == "points":
        return PointContacts(0.1 * rng.standard_normal((5, 2)), rng.uniform(1, 2, 5), scaling)
    if kind == "many points":
        return PointContacts(0.1 * rng.standard_normal((80, 2)), rng.uniform(1, 2, 80), scaling)
    if kind == "bent polynomial":
        return Polynomial([1, 0, 0, 9, 0, 1, 0, 0, 0, 0, 8, 0, 9, 0, 1], scaling)
    return Polynomial([1, 0, 0, 1 / 3, 0, 1, 0, 0, 0, 0, 2, 0, 1, 0, 3], scaling)


def prepared(surface):
    surface.prepare()
    return surface


def inverse_map(surface):
    """The map that needs a search, from vectors (n, 3) to vectors (n, 3)."""
    if surface.kind in ("dissipation", "point_contacts"):
        return surface.twist_of_wrench
    return surface.wrench_of_twist


BENT = ["low powers", "bent polynomial"]
KINDS = ["norms", "powers", "dissipation", "points", "many points", "polynomial", *BENT]


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=2, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_many_vectors_are_answered_as_few_are(kind, seed):
    surface = surface_of(kind, seed)
    rng = np.random.default_rng(seed)
    vectors = rng.standard_normal((MANY, 3)) / [1.0, 1.0, 0.1]
    # A surface that was not prepared has no table.
    few = inverse_map(surface_of(kind, seed))(vectors[-FEW:])
    many = inverse_map(prepared(surface))(vectors)[-FEW:]
    np.testing.assert_allclose(many, few, atol=1e-9 * np.abs(few).max())


@pytest.mark.parametrize("kind", BENT)
@pytest.mark.parametrize("seed", [1, 2])
def test_where_sheets_of_a_bent_surface_meet_the_better_one_is_answered(kind, seed):
    surface = surface_of(kind, seed)
    rng = np.random.default_rng(seed)
    vectors = rng.standard_normal((MANY, 3)) / [1.0, 1.0, 0.1]
    surface.prepare()
    # Twists along the way between loads that differ much are where the answer jumps.
    ends = vectors[:60].reshape(2, 30, 1, 3)
    share = np.linspace(0.0, 1.0, 400)[:, np.newaxis]
    way = ((1.0 - share) * ends[0] + share * ends[1]).reshape(-1, 3)
    power = (surface.wrench_of_twist(way) * way).sum(axis=1)
    best = (surface_of(kind, seed).wrench_of_twist(way[::4]) * way[::4]).sum(axis=1)
    assert (power[::4] >= best * (1.0 - 1e-12)).all()


@pytest.mark.parametrize("kind", KINDS)
def test_single_vectors_are_answered_after_a_batch_as_before(kind):
    surface, fresh = prepared(surface_of(kind, 7)), surface_of(kind, 7)
    vectors = np.random.default_rng(7).standard_normal((FEW // 3, 3)) / [1.0, 1.0, 0.1]
    for vector in vectors:
        one, pair = inverse_map(surface)(vector), inverse_map(surface)([vector, vector])
        expected = inverse_map(fresh)(vector)
        np.testing.assert_allclose(one, expected, atol=1e-9 * np.abs(expected).max())
        np.testing.assert_allclose(pair[1], expected, atol=1e-9 * np.abs(expected).max())


def test_a_corner_of_a_dissipation_model_is_answered_alone_after_a_batch():
    points = PointContacts([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]], [0.5, 0.5, 0.5])
    surface = prepared(points.dissipation())
    facet = surface.wrench_of_twist([-0.04, 0.04, 1.0])
    np.testing.assert_allclose(
        surface.twist_of_wrench([facet, facet])[0], points.twist_of_wrench(facet), atol=1e-9
    )


@settings(max_examples=4, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_the_twist_of_a_wrench_from_the_table_is_the_twist_asked_for(seed):
    # Of full rank: at a corner a wrench has many twists.
    surface = prepared(PowerSum.norms(matrices(np.random.default_rng(seed), 4)))
    twists = sampling.random_directions(MANY, seed)
    wrenches = surface.wrench_of_twist(twists)
    np.testing.assert_allclose(surface.load_factor(wrenches), 1.0, atol=1e-12)
    back = surface.twist_of_wrench(wrenches)
    assert np.linalg.norm(np.cross(twists, back), axis=1).max() < 1e-8


def test_opposite_vectors_have_opposite_answers():
    surface = prepared(surface_of("norms", 3))
    twists = np.random.default_rng(0).standard_normal((MANY, 3))
    twists[:100, 2] = 0.0
    wrenches = surface.wrench_of_twist(twists)
    np.testing.assert_allclose(surface.wrench_of_twist(-twists), -wrenches, atol=1e-9)


def test_a_facet_gives_its_one_twist_to_all_of_its_loads():
    surface = PointContacts([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]], [0.5, 0.5, 0.5])
    surface.prepare()
    facet = sampling.facet_loads(surface, MANY // 6, 0)
    twists = surface.twist_of_wrench(facet.wrenches)
    assert np.abs(twists - facet.twists).max() < 1e-9


@pytest.mark.parametrize("size", [1e-60, 1e-20, 1e20, 1e60])
def test_numbers_beyond_single_precision_are_solved_without_a_warning(size):
    rng = np.random.default_rng(5)
    usual = matrices(rng, 3)
    twists = rng.standard_normal((MANY, 3))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        wrenches = prepared(PowerSum.norms(usual * size)).wrench_of_twist(twists)
    expected = prepared(PowerSum.norms(usual)).wrench_of_twist(twists)
    np.testing.assert_allclose(wrenches * np.sqrt(size), expected, rtol=1e-8, atol=1e-9)


class Counted(SupportSolver):
    """A solver that counts the vectors it is asked for."""

    def __init__(self, solver):
        self.solver = solver
        self.asked = 0

    def solve(self, normals):
        self.asked += normals.shape[1]
        return self.solver.solve(normals)


def counted_solver():
    """A solver, and the same with a table that can be made from it."""
    tabulated = surface_of("norms", 1).shape.solver
    assert isinstance(tabulated, Tabulated)
    counted = Counted(tabulated._solver)
    return counted, Tabulated(tabulated._gauge, counted)


def test_no_table_is_made_because_of_what_was_asked_before():
    counted, tabulated = counted_solver()
    vectors = np.random.default_rng(0).standard_normal((3, 1000))
    tabulated.expect(1000)
    for _ in range(27):
        tabulated.solve(vectors)
    assert counted.asked == 27 * 1000


@pytest.mark.parametrize("count", [50_000, np.inf])
def test_a_table_that_is_expected_to_pay_spares_the_search(count):
    counted, tabulated = counted_solver()
    tabulated.expect(count)
    spent = counted.asked
    assert 20_000 < spent < 50_000
    for _ in range(10):
        tabulated.solve(np.random.default_rng(0).standard_normal((3, 1000)))
    tabulated.expect(count)
    assert counted.asked - spent < 1000


@pytest.mark.parametrize("kind", ["norms", "powers", "dissipation", "points", "polynomial"])
def test_a_single_vector_is_read_from_the_table_without_a_search(kind):
    tabulated = surface_of(kind, 1).shape.solver
    while not isinstance(tabulated, Tabulated):
        tabulated = tabulated._solver
    counted = Counted(tabulated._solver)
    read = Tabulated(tabulated._gauge, counted, scalar=tabulated._scalar)
    read.expect(np.inf)
    spent = counted.asked
    normals = np.random.default_rng(0).standard_normal((400, 3))
    points = [read.solve_scalar(tuple(normal)) for normal in normals.tolist()]
    assert counted.asked == spent
    certain = np.array([point is not None for point in points])
    # Corners have cones of normals in which nothing can be read.
    assert certain.mean() > (0.3 if kind == "points" else 0.8)
    exact, _ = counted.solve(normals[certain].T)
    found = np.array([point for point in points if point is not None]).T
    np.testing.assert_allclose(found, exact, atol=1e-9 * np.abs(exact).max())


def test_one_large_batch_makes_the_table_that_it_is_answered_from():
    surface = surface_of("norms", 1)
    twists = np.random.default_rng(0).standard_normal((50_000, 3))
    wrenches = surface.wrench_of_twist(twists)
    assert surface.shape.solver._table is not None
    few = surface_of("norms", 1).wrench_of_twist(twists[:FEW])
    np.testing.assert_allclose(wrenches[:FEW], few, atol=1e-9 * np.abs(few).max())


def test_a_cell_that_two_sheets_share_is_not_read():
    surface = prepared(surface_of("low powers", 1))
    tabulated = surface.shape.solver._solver
    ticks = np.linspace(-1.0, 1.0, 161)
    a, b = np.meshgrid(ticks, ticks, indexing="ij")
    normals = np.array([a, b, 0.5 * (1.0 - a * a - b * b)])
    points = tabulated._solver.solve(normals.reshape(3, -1))[0].reshape(normals.shape)
    # Within a cell of one sheet, points differ by little.
    cells = np.lib.stride_tricks.sliding_window_view(points, (3, 3), axis=(1, 2))[:, ::2, ::2]
    spread = np.ptp(cells, axis=(3, 4)).max(axis=0).ravel() / np.abs(points).max()
    assert (spread > 0.5).any()
    assert (spread[tabulated._table._useful] < 0.5).all()


def test_a_point_that_the_table_cannot_prove_is_not_certain():
    surface = PointContacts([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]], [0.5, 0.5, 0.5])
    tabulated = surface.shape.solver._solver
    assert isinstance(tabulated, Tabulated)
    solver = tabulated._solver
    table = SupportTable(tabulated._gauge, solver)
    loads = np.random.default_rng(0).standard_normal((3, 5000))
    points, certain = table.points(loads)
    exact = solver.solve(loads)[0]
    assert 0.01 < certain.mean() < 0.9
    np.testing.assert_allclose(points[:, certain], exact[:, certain], rtol=1e-7, atol=1e-9)
