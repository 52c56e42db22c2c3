# SPDX-License-Identifier: Apache-2.0
"""Polynomials and the second approximation: exact where they can be, convex where they must be."""

import numpy as np
import pytest

from limit_surface_ros.errors import DataError, RangeError
from limit_surface_ros.fitting.factors import factors_of_matrices, parameters_of
from limit_surface_ros.fitting.pairs import scale_pairs
from limit_surface_ros.fitting.polynomial import fit_polynomial
from limit_surface_ros.fitting.power_sum import PowerSumObjective, fit_power_sum
from limit_surface_ros.fitting.search import Search
from limit_surface_ros.fitting.second_approximation import (
    SecondObjective,
    fit_second_approximation,
)
from limit_surface_ros.fitting.simulation import simulated_pairs
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.power_sum import PowerSum, thesis_exponents
from limit_surface_ros.surface.sampling import random_loads, random_motions
from limit_surface_ros.surface.scaling import Scaling

SCALING = Scaling(0.15, 1.0)
TRIANGLE = PointContacts(
    np.array([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]]), np.full(3, 0.5), SCALING
)


@pytest.mark.parametrize("weight", [0.0, 0.7])
@pytest.mark.parametrize("convex", [False, True])
def test_a_polynomial_that_is_an_ellipsoid_is_found_exactly(weight, convex):
    if convex:
        pytest.importorskip("cvxpy", reason="the extra 'peers' is not installed")
    ellipsoid = PowerSum.thesis([[[2.0, 0.3, 0.1], [0.3, 1.0, -0.2], [0.1, -0.2, 3.0]]])
    pairs = random_loads(ellipsoid, 60, 0)
    result = fit_polynomial(pairs, velocity_weight=weight, convex=convex)
    test = random_loads(ellipsoid, 100, 1)
    np.testing.assert_allclose(result.surface.load_factor(test.wrenches), 1.0, atol=1e-4)
    assert result.tested_on(test).held_out.velocity[2] < 1e-3


def test_the_convex_polynomial_costs_more_and_is_convex():
    pytest.importorskip("cvxpy", reason="the extra 'peers' is not installed")
    pairs = simulated_pairs(TRIANGLE, 300, 20)
    plain, convex = (fit_polynomial(pairs, convex=each) for each in (False, True))
    assert plain.cost <= convex.cost * (1 + 1e-6)
    rng = np.random.default_rng(0)
    first, second = rng.normal(size=(2, 2000, 3))
    value = convex.surface.value
    assert (value((first + second) / 2) <= (value(first) + value(second)) / 2 + 1e-9).all()


def test_polynomials_need_fifteen_pairs_and_a_weight_that_is_not_negative():
    pairs = random_motions(TRIANGLE, 14, 0)
    with pytest.raises(DataError, match="14 pairs cannot determine 15 parameters"):
        fit_polynomial(pairs)
    with pytest.raises(RangeError, match="velocity_weight"):
        fit_polynomial(pairs, velocity_weight=-1.0)


@pytest.mark.parametrize("weight", [0.0, 1.0])
def test_the_projected_gradient_agrees_with_finite_differences(weight):
    pairs = scale_pairs(random_motions(TRIANGLE, 60, 0), SCALING)
    objective = SecondObjective(pairs.weighted(np.linspace(0.5, 2.0, 60)), weight)
    start = objective.start(np.random.default_rng(3))
    _, gradient = objective.cost_and_gradient(start)
    numeric = [
        (
            objective.cost_and_gradient(start + 1e-6 * unit)[0]
            - objective.cost_and_gradient(start - 1e-6 * unit)[0]
        )
        / 2e-6
        for unit in np.eye(6)
    ]
    np.testing.assert_allclose(gradient, numeric, rtol=1e-4, atol=1e-5 * np.abs(gradient).max())


@pytest.mark.parametrize("weight", [0.0, 1.0])
def test_the_second_approximation_is_positive_semidefinite_and_near_the_full_fit(weight):
    pairs = simulated_pairs(TRIANGLE, 300, 20)
    second = fit_second_approximation(
        pairs, velocity_weight=weight, scaling=SCALING, search=Search(8)
    )
    full = fit_power_sum(pairs, thesis_exponents(2), velocity_weight=weight, scaling=SCALING)
    assert np.linalg.eigvalsh(second.surface.matrices).min() >= -1e-12
    assert full.cost <= second.cost * 1.01 < 4 * full.cost


def test_a_part_of_the_pairs_stands_for_all_of_them():
    objective = SecondObjective(scale_pairs(simulated_pairs(TRIANGLE), SCALING), 1.0)
    start = objective.start(np.random.default_rng(0))
    whole, part = (each.cost_and_gradient(start)[0] for each in (objective, objective.coarse()))
    assert part == pytest.approx(whole, rel=0.3)


def test_what_is_told_of_the_end_of_a_second_approximation_is_of_the_surface_returned():
    pairs = simulated_pairs(TRIANGLE, 300, 20)
    found = fit_second_approximation(pairs, scaling=SCALING, search=Search(8))
    scaled = scale_pairs(pairs, SCALING)
    both = PowerSumObjective(scaled, thesis_exponents(2), 1.0)
    factors = parameters_of(factors_of_matrices(found.surface.matrices))
    assert both.cost(factors) == pytest.approx(found.cost, rel=1e-6)


def test_noise_is_of_the_size_that_is_asked_for():
    exact, noisy = (
        simulated_pairs(TRIANGLE, 4000, 0, load_noise=size, motion_noise=2 * size)
        for size in (0.0, 0.05)
    )
    size = np.sqrt(np.mean(exact.wrenches**2, axis=0))
    spread = (noisy.wrenches - exact.wrenches).std(axis=0)
    np.testing.assert_allclose(spread / size, 0.05, rtol=0.05)
    twists = (noisy.twists - exact.twists) / SCALING.twist_unit
    assert twists.std() == pytest.approx(0.1, rel=0.05)
    with pytest.raises(RangeError, match="noise"):
        simulated_pairs(TRIANGLE, 10, load_noise=-1.0)
