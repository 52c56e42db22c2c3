# SPDX-License-Identifier: Apache-2.0
"""Dissipation models are fitted on forces and on directions, with exact gradients."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from limit_surface_ros.errors import DataError, RangeError
from limit_surface_ros.fitting.dissipation import (
    DirectionObjective,
    ForceObjective,
    fit_dissipation,
)
from limit_surface_ros.fitting.motion_cost import SmoothSupportSolver
from limit_surface_ros.fitting.objective import RegularisedObjective, SumOfObjectives
from limit_surface_ros.fitting.pairs import scale_pairs
from limit_surface_ros.fitting.search import Search
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.measures import load_error, velocity_error
from limit_surface_ros.surface.pairs import Pairs
from limit_surface_ros.surface.sampling import facet_loads, random_loads, random_motions
from limit_surface_ros.surface.scaling import Scaling

SCALING = Scaling(0.15, 1.0)
TRIANGLE = PointContacts(
    np.array([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]]), np.full(3, 0.5), SCALING
)


def triangle_pairs(motions: int, per_facet: int) -> Pairs:
    sliding, facets = random_motions(TRIANGLE, motions, 0), facet_loads(TRIANGLE, per_facet, 1)
    return Pairs(
        np.concatenate([sliding.wrenches, facets.wrenches]),
        np.concatenate([sliding.twists, facets.twists]),
    )


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    terms=st.integers(1, 4),
    kind=st.sampled_from(["forces", "directions", "both", "regularised"]),
    robust=st.sampled_from([None, 0.2]),
)
def test_gradients_agree_with_finite_differences(seed, terms, kind, robust):
    rng = np.random.default_rng(seed)
    pairs = scale_pairs(triangle_pairs(30, 2), SCALING)
    pairs = pairs.weighted(rng.exponential(size=len(pairs)))
    forces = ForceObjective(pairs, terms, floor=0.01)
    directions = DirectionObjective(pairs, terms, 1.3, robust, floor=0.01)
    start = directions.start(rng)
    objective = {
        "forces": forces,
        "directions": directions,
        "both": SumOfObjectives(directions, forces),
        "regularised": RegularisedObjective(directions, start + 0.1, 3.0),
    }[kind]
    _, gradient = objective.cost_and_gradient(start)
    step = 1e-6
    numeric = [
        (
            objective.cost_and_gradient(start + step * unit)[0]
            - objective.cost_and_gradient(start - step * unit)[0]
        )
        / (2 * step)
        for unit in np.eye(objective.size)
    ]
    np.testing.assert_allclose(gradient, numeric, rtol=1e-4, atol=1e-4 * np.abs(gradient).max())


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_smooth_inverse_finds_the_motions_of_the_surface(seed):
    rng = np.random.default_rng(seed)
    factors = np.tril(rng.normal(size=(3, 3, 3)))
    matrices = factors @ factors.transpose(0, 2, 1) + 1e-3 * np.eye(3)
    loads = rng.normal(size=(50, 3))
    inverse = SmoothSupportSolver(np.ascontiguousarray(loads.T))
    inverse.solve(matrices)
    found = inverse.motions / np.linalg.norm(inverse.motions, axis=0)
    surface = Dissipation(matrices)
    np.testing.assert_allclose(found.T, surface.twist_of_wrench(loads), atol=1e-6)
    np.testing.assert_allclose(1.0 / inverse.dissipation, surface.load_factor(loads), rtol=1e-9)


def test_three_terms_on_forces_are_three_support_points_exactly():
    test = random_motions(TRIANGLE, 1000, 7)
    surface = fit_dissipation(triangle_pairs(500, 20), 3, scaling=SCALING).surface
    assert load_error(surface, test).max() < 1e-4
    assert np.quantile(velocity_error(surface, test), 0.99) < 1e-3


def test_fitted_on_directions_motions_are_better_and_loads_no_worse_than_known():
    pairs, test = triangle_pairs(300, 20), random_motions(TRIANGLE, 1000, 7)
    on_forces = fit_dissipation(pairs, 2, scaling=SCALING).tested_on(test)
    on_directions = fit_dissipation(
        pairs, 2, fitted_on="directions", scaling=SCALING, search=Search(2)
    ).tested_on(test)
    assert on_directions.held_out.mean_angle < on_forces.held_out.mean_angle
    assert 0.5 < np.median(on_directions.surface.load_factor(pairs.wrenches)) < 2


@pytest.mark.parametrize("fitted_on", ["forces", "directions"])
def test_units_of_the_data_do_not_matter(fitted_on):
    pairs = random_loads(TRIANGLE, 60, 2)
    in_small_units = Pairs(pairs.wrenches * [1e3, 1e3, 1e6], pairs.twists * [1e3, 1e3, 1.0])
    first, second = (
        fit_dissipation(each, 2, fitted_on=fitted_on, search=Search(2)).surface
        for each in (pairs, in_small_units)
    )
    np.testing.assert_allclose(first.matrices, second.matrices, rtol=1e-3, atol=1e-4)


def test_what_cannot_be_fitted_is_refused():
    pairs = triangle_pairs(10, 1)
    with pytest.raises(DataError, match="16 pairs cannot determine 18 parameters"):
        fit_dissipation(pairs, 3)
    with pytest.raises(RangeError, match="fitted_on must be one of forces"):
        fit_dissipation(pairs, 2, fitted_on="nothing")
    with pytest.raises(RangeError, match="must be above 0"):
        fit_dissipation(pairs, 2, fitted_on="directions", floor=0.0)
    with pytest.raises(RangeError, match="terms"):
        fit_dissipation(pairs, 0)
