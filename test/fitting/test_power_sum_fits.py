# SPDX-License-Identifier: Apache-2.0
"""Fits of power sums reach the known minima and do not depend on units or workers."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from limit_surface_ros.errors import DataError, RangeError
from limit_surface_ros.fitting.pairs import ScaledPairs, scale_pairs
from limit_surface_ros.fitting.power_sum import PowerSumObjective, fit_power_sum
from limit_surface_ros.fitting.search import Search, descents, process_pool
from limit_surface_ros.fitting.simulation import simulated_pairs
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.power_sum import PowerSum, thesis_exponents
from limit_surface_ros.surface.measures import quantiles, velocity_error
from limit_surface_ros.surface.pairs import Pairs
from limit_surface_ros.surface.sampling import facet_loads, random_loads, random_motions
from limit_surface_ros.surface.scaling import Scaling

SCALING = Scaling(0.15, 1.0)
TRIANGLE = PointContacts(
    np.array([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]]), np.full(3, 0.5), SCALING
)


def triangle_pairs(motions: int, per_facet: int, seed: int = 0) -> Pairs:
    sliding = random_motions(TRIANGLE, motions, seed)
    facets = facet_loads(TRIANGLE, per_facet, seed + 1)
    return Pairs(
        np.concatenate([sliding.wrenches, facets.wrenches]),
        np.concatenate([sliding.twists, facets.twists]),
    )


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    exponents=st.lists(st.floats(0.1, 1.0), min_size=1, max_size=4),
    weight=st.sampled_from([0.0, 0.3, 1.0, 20.0]),
    robust=st.sampled_from([None, 0.1, 1.0]),
)
def test_gradient_agrees_with_finite_differences(seed, exponents, weight, robust):
    pairs = scale_pairs(triangle_pairs(40, 3), SCALING)
    pairs = pairs.weighted(np.random.default_rng(seed).exponential(size=len(pairs)))
    objective = PowerSumObjective(pairs, np.array(exponents), weight, robust)
    start = objective.start(np.random.default_rng(seed))
    cost, gradient = objective.cost_and_gradient(start)
    assert cost == pytest.approx(objective.cost(start), rel=1e-12)
    step = 1e-6
    numeric = [
        (objective.cost(start + step * unit) - objective.cost(start - step * unit)) / (2 * step)
        for unit in np.eye(objective.size)
    ]
    np.testing.assert_allclose(gradient, numeric, rtol=2e-5, atol=2e-5 * np.abs(gradient).max())


def test_a_surface_of_the_family_is_found_again():
    rng = np.random.default_rng(5)
    factors = np.tril(rng.normal(size=(2, 3, 3))) + 1.5 * np.eye(3)
    truth = PowerSum.thesis(factors @ factors.transpose(0, 2, 1), SCALING)
    result = fit_power_sum(random_loads(truth, 300, 1), thesis_exponents(2), scaling=SCALING)
    assert result.converged
    assert result.cost < 1e-2
    assert quantiles(velocity_error(result.surface, random_loads(truth, 300, 2)))[2] < 0.05


@pytest.mark.parametrize(("terms", "most"), [(1, 0.40), (2, 0.20), (3, 0.16), (4, 0.15)])
def test_j2_meets_the_triangle_as_well_as_known(terms, most):
    result = fit_power_sum(
        triangle_pairs(700, 50), thesis_exponents(terms), scaling=SCALING, search=Search(12)
    ).tested_on(random_motions(TRIANGLE, 1000, 7))
    assert result.held_out is not None
    assert result.held_out.velocity[1] < most


def test_more_weight_on_motions_gives_better_motions_and_worse_loads():
    pairs = triangle_pairs(500, 30)
    light, heavy = (
        fit_power_sum(pairs, [0.5, 0.5], velocity_weight=weight, scaling=SCALING)
        for weight in (0.0, 5.0)
    )
    assert heavy.training.mean_angle < light.training.mean_angle
    spread = [np.std(fit.surface.load_factor(pairs.wrenches)) for fit in (light, heavy)]
    assert spread[0] < spread[1]


@pytest.mark.parametrize("scaling", [None, SCALING])
@pytest.mark.parametrize("weight", [0.0, 1.0])
def test_units_of_the_data_do_not_matter(scaling, weight):
    pairs = triangle_pairs(150, 10)
    # Newtons to millinewtons and metres to millimetres.
    in_small_units = Pairs(pairs.wrenches * [1e3, 1e3, 1e6], pairs.twists * [1e3, 1e3, 1.0])
    small_scaling = scaling and Scaling(
        scaling.characteristic_length * 1e3, scaling.friction_force * 1e3
    )
    first = fit_power_sum(
        pairs, thesis_exponents(2), velocity_weight=weight, scaling=scaling
    ).surface
    second = fit_power_sum(
        in_small_units, thesis_exponents(2), velocity_weight=weight, scaling=small_scaling
    ).surface
    test = random_motions(TRIANGLE, 200, 3)
    in_small = second.load_factor(test.wrenches * [1e3, 1e3, 1e6])
    np.testing.assert_allclose(first.load_factor(test.wrenches), in_small, rtol=1e-3)


def test_workers_do_not_change_the_result():
    pairs = triangle_pairs(150, 10)
    alone = fit_power_sum(pairs, thesis_exponents(3), search=Search(6, seed=4))
    with process_pool(2) as executor:
        shared = fit_power_sum(
            pairs, thesis_exponents(3), search=Search(6, seed=4, executor=executor)
        )
    assert alone.start_costs == shared.start_costs
    np.testing.assert_array_equal(alone.surface.matrices, shared.surface.matrices)


def test_starts_end_early_when_all_random_ones_and_those_near_the_best_agree():
    seen = []
    result = fit_power_sum(
        triangle_pairs(150, 10),
        [1.0],
        search=Search(20, progress=lambda done, total: seen.append((done, total))),
    )
    assert 10 < len(result.start_costs) < 20
    assert seen[-1] == (len(result.start_costs), 20)
    np.testing.assert_allclose(result.start_costs, result.cost, rtol=1e-3)


def test_many_starts_that_agree_on_a_worse_minimum_do_not_end_the_search():
    # Of three terms some six random starts in seven end in a minimum that costs 13 % more.
    result = fit_power_sum(
        simulated_pairs(TRIANGLE), thesis_exponents(3), scaling=SCALING, search=Search(32)
    )
    assert sum(cost > 1.1 * result.cost for cost in result.start_costs) > 4
    assert result.cost == pytest.approx(26.2332, rel=1e-4)


@pytest.mark.parametrize("exponents", [(1.0, 2 / 3, 1 / 3), (0.5, 0.5, 0.5)])
def test_a_start_near_known_terms_keeps_the_others(exponents):
    objective = PowerSumObjective(
        scale_pairs(triangle_pairs(40, 3), SCALING), np.array(exponents), 1.0
    )
    known = np.arange(18.0)
    kept, exchanged = set(), 0
    for seed in range(40):
        near = objective.start_near(known, np.random.default_rng(seed)).reshape(3, 6)
        same = (near == known.reshape(3, 6)).all(axis=1)
        kept.add(int(same.sum()))
        exchanged += bool(np.isin(near, known).all())
    assert kept == ({1, 2} if len(set(exponents)) > 1 else {2})
    assert 10 < exchanged < 30 if len(set(exponents)) > 1 else exchanged == 0


@pytest.mark.parametrize("weight", [0.0, 1.0])
def test_pairs_in_blocks_cost_what_they_cost_apart(weight):
    pairs = scale_pairs(random_motions(TRIANGLE, 7000, 0), SCALING)
    parts = [
        ScaledPairs(pairs.wrenches[part], pairs.directions[part], SCALING)
        for part in (slice(0, 2500), slice(2500, 4600), slice(4600, None))
    ]
    whole, *apart = (
        PowerSumObjective(each, thesis_exponents(2), weight) for each in (pairs, *parts)
    )
    start = whole.start(np.random.default_rng(0))
    cost, gradient = whole.cost_and_gradient(start)
    costs, gradients = zip(*(each.cost_and_gradient(start) for each in apart), strict=True)
    assert cost == pytest.approx(sum(costs), rel=1e-12)
    np.testing.assert_allclose(gradient, sum(gradients), rtol=1e-9)


def test_matrices_are_positive_semidefinite_and_loads_keep_their_scale():
    pairs = triangle_pairs(30, 2)
    for weight in (0.0, 1.0, 1e4):
        surface = fit_power_sum(pairs, thesis_exponents(3), velocity_weight=weight).surface
        assert np.linalg.eigvalsh(surface.matrices).min() >= -1e-12
        assert 1 / 3 < np.median(surface.load_factor(pairs.wrenches)) < 3


def test_pairs_that_cannot_determine_a_surface_are_refused():
    pairs = triangle_pairs(40, 1)
    with pytest.raises(DataError, match="17 pairs cannot determine 18 parameters"):
        fit_power_sum(Pairs(pairs.wrenches[:17], pairs.twists[:17]), thesis_exponents(3))
    same = np.tile(pairs.twists[:1], (40, 1))
    with pytest.raises(DataError, match="one direction"):
        fit_power_sum(Pairs(pairs.wrenches[:40], same), thesis_exponents(2))
    flat = pairs.wrenches * [1.0, 1.0, 0.0]
    with pytest.raises(DataError, match="all moments are zero"):
        fit_power_sum(Pairs(flat, pairs.twists), thesis_exponents(2))
    with pytest.raises(DataError, match="no load has a moment"):
        fit_power_sum(Pairs(flat, pairs.twists), thesis_exponents(2), scaling=SCALING)


@pytest.mark.parametrize("exponents", [[0.0], [1.5, 1.0], [-1.0]])
def test_exponents_out_of_range_are_refused(exponents):
    with pytest.raises(RangeError, match=r"\(0, 1\]"):
        fit_power_sum(triangle_pairs(40, 1), exponents)


def test_a_negative_weight_or_no_start_is_refused():
    with pytest.raises(RangeError, match="velocity_weight"):
        fit_power_sum(triangle_pairs(40, 1), [1.0], velocity_weight=-1.0)
    with pytest.raises(RangeError, match="starts"):
        Search(0)


@pytest.mark.parametrize("size", [1e-9, 1e-7, 1e7])
def test_loads_far_from_a_given_scaling_keep_their_digits(size):
    pairs = triangle_pairs(150, 10)
    usual = scale_pairs(pairs, SCALING).wrenches
    found = scale_pairs(Pairs(pairs.wrenches * size, pairs.twists), SCALING).wrenches
    np.testing.assert_allclose(found / size, usual, atol=1e-8)


class Pitted:
    """An objective that some starts leave with a cost that is no number."""

    size = 1

    def cost_and_gradient(self, parameters):
        cost = np.nan if parameters[0] < 0.0 else 1.0 + parameters[0] ** 2
        return cost, 2.0 * parameters

    def start(self, rng):
        return rng.normal(size=1)

    def start_near(self, parameters, rng):
        return rng.normal(size=1)

    def coarse(self):
        return None


def test_a_cost_that_is_no_number_comes_last():
    costs = [each.cost for each in descents(Pitted(), Search(12))]
    assert np.isfinite(costs[0])
    assert not np.isnan(costs).any()
    assert costs == sorted(costs)
    assert np.isinf(costs[-1])
