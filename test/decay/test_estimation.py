# SPDX-License-Identifier: Apache-2.0
"""Samples correct a model's coefficients, and nothing that comes in can spoil them for good."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from limit_surface_ros.decay.basis import real_basis
from limit_surface_ros.decay.estimation import CoefficientEstimator, EstimationOptions
from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.errors import NotFiniteError, RangeError

seeds = st.integers(min_value=0, max_value=2**32 - 1)
# Five rates whose coefficients partly cancel, as fits of kinked responses give them.
MODEL = ExponentialSum([-1.2, -2.0 + 6.0j, -2.4 + 13.0j], [1.4, -0.3 + 0.2j, -0.1 - 0.05j])
NOISE = 0.01
HORIZON = np.linspace(0.0, 4.0, 401)


def scaled(model, factor):
    return ExponentialSum(model.rates, factor * model.coefficients)


def run(estimator, response, times, rng, noise=NOISE):
    for t in times:
        estimator.add(t, float(response(t)) + noise * rng.normal())


def largest_error(x, response):
    return float(np.abs(x(HORIZON) - response(HORIZON)).max())


@given(seeds, st.sampled_from([0.8, 1.2]), st.floats(min_value=50.0, max_value=500.0))
@settings(max_examples=25, deadline=None)
def test_a_model_20_percent_off_is_put_right_within_the_first_second(seed, factor, rate):
    response = scaled(MODEL, factor)
    estimator = CoefficientEstimator(MODEL, EstimationOptions(noise=NOISE))
    run(estimator, response, np.arange(0.0, 1.0, 1.0 / rate), np.random.default_rng(seed))
    assert largest_error(estimator.x, response) < 0.2 * largest_error(MODEL, response)
    assert estimator.outliers <= 0.02 * rate


@given(seeds)
@settings(max_examples=20, deadline=None)
def test_a_change_of_shape_is_learnt_too(seed):
    rng = np.random.default_rng(seed)
    departure = 0.15 * (rng.normal(size=3) + 1j * rng.normal(size=3) * [0, 1, 1])
    response = ExponentialSum(MODEL.rates, MODEL.coefficients + departure)
    estimator = CoefficientEstimator(MODEL, EstimationOptions(noise=NOISE, forgetting=1.0))
    run(estimator, response, np.arange(0.0, 2.0, 0.005), rng)
    assert largest_error(estimator.x, response) < 0.5 * largest_error(MODEL, response)


@given(seeds)
@settings(max_examples=15, deadline=None)
def test_without_forgetting_the_estimate_is_the_regularised_least_squares_one(seed):
    rng = np.random.default_rng(seed)
    options = EstimationOptions(noise=0.03, forgetting=1.0, gate=1e6)
    times = np.sort(rng.uniform(0.0, 3.0, 40))
    values = 1.3 * MODEL(times) + 0.03 * rng.normal(size=40)
    estimator = CoefficientEstimator(MODEL, options)
    for t, y in zip(times, values, strict=True):
        assert estimator.add(t, y)
    weights = MODEL.weights
    peak = np.abs(MODEL(np.linspace(0.0, 5.0, 4001))).max()
    prior = (0.1 * peak) ** 2 / len(weights) * np.eye(len(weights))
    prior += 0.25 * np.outer(weights, weights)
    rows = real_basis(MODEL.rates, times) / 0.03
    information = rows.T @ rows + np.linalg.inv(prior)
    change = np.linalg.solve(information, rows.T @ (values - MODEL(times)) / 0.03)
    np.testing.assert_allclose(estimator.x.weights, weights + change, rtol=1e-3, atol=1e-4)
    at = np.linspace(0.0, 2.0, 7)
    covariance = np.linalg.inv(information)
    columns = real_basis(MODEL.rates, at)
    expected = np.sqrt(np.einsum("ij,jk,ik->i", columns, covariance, columns))
    np.testing.assert_allclose(estimator.spread(at), expected, rtol=1e-3)


def test_the_spread_tells_the_error_of_the_estimate():
    rng = np.random.default_rng(3)
    ratios = []
    for _ in range(100):
        response = scaled(MODEL, 1.0 + 0.2 * rng.normal())
        estimator = CoefficientEstimator(MODEL, EstimationOptions(noise=NOISE, forgetting=1.0))
        run(estimator, response, np.arange(0.0, 0.5, 0.02), rng)
        at = np.array([0.3, 1.0])
        ratios.append((estimator.x(at) - response(at)) / estimator.spread(at))
    assert 0.3 < np.sqrt(np.mean(np.square(ratios))) < 1.2


def test_outliers_are_gated_and_the_estimate_holds():
    rng = np.random.default_rng(5)
    response = scaled(MODEL, 1.2)
    estimator = CoefficientEstimator(MODEL, EstimationOptions(noise=NOISE))
    wild = 0
    for k, t in enumerate(np.arange(0.0, 1.0, 0.005)):
        spoilt = k % 7 == 3
        wild += spoilt
        value = float(response(t)) + NOISE * rng.normal() + spoilt * rng.choice([-40.0, 40.0])
        assert estimator.add(t, value) is not spoilt
    assert estimator.outliers == wild
    assert largest_error(estimator.x, response) < 0.04


def test_a_response_that_changes_for_good_is_followed_after_a_row_of_outliers():
    options = EstimationOptions(noise=NOISE, change_after=10)
    estimator = CoefficientEstimator(MODEL, options)
    rng = np.random.default_rng(6)
    run(estimator, MODEL, np.arange(0.0, 0.5, 0.005), rng)
    changed = scaled(MODEL, 1.6)
    run(estimator, changed, np.arange(0.5, 1.2, 0.005), rng)
    assert estimator.outliers >= 10
    assert largest_error(estimator.x, changed) < 0.1 * largest_error(MODEL, changed)


def test_a_gap_keeps_what_was_learnt():
    rng = np.random.default_rng(7)
    response = scaled(MODEL, 0.8)
    estimator = CoefficientEstimator(MODEL, EstimationOptions(noise=NOISE))
    run(estimator, response, np.arange(0.0, 0.4, 0.005), rng)
    before = largest_error(estimator.x, response)
    run(estimator, response, np.arange(2.0, 2.4, 0.005), rng)
    assert largest_error(estimator.x, response) < max(2.0 * before, 0.03)


def test_thousands_of_samples_of_nothing_leave_the_doubt_bounded_and_the_model_whole():
    options = EstimationOptions(noise=NOISE, forgetting=0.9)
    estimator = CoefficientEstimator(MODEL, options)
    at = np.linspace(0.0, 2.0, 9)
    prior_spread = estimator.spread(at)
    rng = np.random.default_rng(8)
    for t in 20.0 + np.arange(20_000) * 0.01:
        estimator.add(t, NOISE * rng.normal())
    assert (estimator.spread(at) <= prior_spread * (1.0 + 1e-9)).all()
    np.testing.assert_allclose(estimator.x(at), MODEL(at), atol=1e-3)


def test_terms_that_samples_cannot_tell_apart_stay_finite():
    twins = ExponentialSum([-1.0, -1.0 - 1e-9, -1.0 + 1e-9], [1e6, -5e5, -5e5 + 1.0])
    estimator = CoefficientEstimator(twins, EstimationOptions(noise=NOISE))
    rng = np.random.default_rng(9)
    run(estimator, ExponentialSum([-1.0], [1.2]), np.arange(0.0, 1.0, 0.01), rng)
    t = np.linspace(0.0, 2.0, 50)
    np.testing.assert_allclose(estimator.x(t), 1.2 * np.exp(-t), atol=0.05)


@pytest.mark.parametrize("late", [0.1, 0.2, 0.05])
def test_samples_out_of_order_are_refused_and_change_nothing(late):
    estimator = CoefficientEstimator(MODEL, EstimationOptions(noise=NOISE))
    estimator.add(0.1, 1.1)
    estimator.add(0.2, 1.0)
    before = estimator.x
    with pytest.raises(RangeError, match="order of time"):
        estimator.add(late, 5.0)
    assert estimator.x is before
    assert estimator.accepted == 2


@pytest.mark.parametrize(
    ("time", "value", "error"),
    [
        (math.nan, 1.0, NotFiniteError),
        (0.1, math.inf, NotFiniteError),
        (0.1, math.nan, NotFiniteError),
        (-0.1, 1.0, RangeError),
    ],
)
def test_bad_samples_are_refused_and_change_nothing(time, value, error):
    estimator = CoefficientEstimator(MODEL, EstimationOptions(noise=NOISE))
    with pytest.raises(error, match="sample"):
        estimator.add(time, value)
    assert estimator.x is MODEL
    assert estimator.add(0.1, float(MODEL(0.1)))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("noise", 0.0),
        ("noise", math.nan),
        ("forgetting", 0.0),
        ("forgetting", 1.1),
        ("forgetting", math.nan),
        ("amplitude_spread", -1.0),
        ("shape_spread", 0.0),
        ("gate", 0.0),
        ("change_after", 0),
    ],
)
def test_bad_options_are_refused_by_name(name, value):
    with pytest.raises(RangeError, match=name):
        EstimationOptions(**{"noise": NOISE, name: value})


def test_a_model_of_zero_is_refused():
    with pytest.raises(RangeError, match="zero"):
        CoefficientEstimator(ExponentialSum([-1.0], [0.0]), EstimationOptions(noise=NOISE))
