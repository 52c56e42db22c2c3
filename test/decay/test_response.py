# SPDX-License-Identifier: Apache-2.0
"""A response is scaled to its onset, corrected in fractions of it, and says how sure it is."""

import math

import numpy as np
import pytest

from limit_surface_ros.decay.estimation import EstimationOptions
from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.decay.response import Response
from limit_surface_ros.errors import NoOnsetError, RangeError

MODEL = ExponentialSum([-1.0, -2.0 + 5.0j], [-3.0, 0.5 + 0.2j])
OPTIONS = EstimationOptions(noise=0.01)
TIMES = np.linspace(0.0, 3.0, 61)


def test_fractions_start_at_one_whatever_the_models_amplitude_and_sign():
    response = Response(MODEL, 0.0, OPTIONS)
    assert response.start == -2.5
    np.testing.assert_allclose(response.fractions(TIMES), MODEL(TIMES) / -2.5, rtol=1e-15)
    assert float(response.fractions(0.0)) == 1.0


def test_what_is_left_stays_below_a_fraction_from_the_time_that_is_named():
    response = Response(MODEL, 0.0, OPTIONS)
    end = response.time_to_fraction(0.1)
    assert (np.abs(response.fractions(end + TIMES)) <= 0.1 + 1e-12).all()
    assert abs(float(response.fractions(end))) == pytest.approx(0.1, abs=1e-9)


def test_corrections_of_the_amplitude_beat_the_model_as_it_was_fitted():
    rng = np.random.default_rng(4)
    response = Response(MODEL, 0.0, OPTIONS)
    for t in np.arange(0.0, 1.0, 0.01):
        assert response.learn(t, 1.2 * float(MODEL(t)) / -2.5 + 0.01 * rng.normal())
    truth = 1.2 * MODEL(TIMES) / -2.5
    error = np.abs(response.fractions(TIMES) - truth)
    assert error.max() < 0.1 * np.abs(MODEL(TIMES) / -2.5 - truth).max()
    assert (error * 2.5 <= response.bounds(TIMES)).all()
    assert response.samples == 100
    assert abs(response.residual) < 0.05


def test_bounds_are_the_fits_until_something_is_measured():
    response = Response(MODEL, 0.02, OPTIONS)
    np.testing.assert_array_equal(response.bounds(TIMES), 0.02)
    response.learn(0.0, 1.0)
    assert (response.bounds(TIMES) > 0.02).all()
    assert math.isfinite(response.residual)


def test_the_fits_error_counts_as_noise_of_each_sample():
    rough, fine = Response(MODEL, 0.5, OPTIONS), Response(MODEL, 0.0, OPTIONS)
    for response in (rough, fine):
        response.learn(0.0, 1.1)
    assert float(fine.fractions(0.0)) > float(rough.fractions(0.0)) > 1.0


def test_forgetting_returns_to_the_model_and_to_any_time():
    response = Response(MODEL, 0.0, OPTIONS)
    response.learn(2.0, 0.2)
    with pytest.raises(RangeError, match="order"):
        response.learn(1.0, 0.3)
    response.forget()
    assert response.samples == 0
    assert response.x.sum is MODEL
    assert response.learn(1.0, float(MODEL(1.0)) / -2.5)


def test_a_model_that_starts_at_zero_has_no_response_to_an_onset():
    with pytest.raises(NoOnsetError):
        Response(ExponentialSum([-1.0, -2.0], [1.0, -1.0]), 0.0, OPTIONS)


def test_bounds_end_where_nothing_is_known():
    random = np.random.default_rng(1)
    late = np.array([0.5, 2.9, 3.1, 50.0])

    def stated(times):
        return np.where(times <= 10.0, 0.02, math.inf)

    fitting = Response(MODEL, 0.02, OPTIONS, stated)
    np.testing.assert_array_equal(fitting.bounds(late), [0.02, 0.02, 0.02, math.inf])
    other = Response(MODEL, 0.02, OPTIONS, stated)
    for t in np.arange(0.0, 1.001, 0.01):
        fitting.learn(t, float(MODEL(t)) / -2.5 + 0.01 * random.normal())
        other.learn(t, float(MODEL(0.6 * t)) / -2.5 + 0.01 * random.normal())
    # The model fits: it holds as far as it is stated to. It does not: nor does what it states.
    np.testing.assert_array_equal(np.isfinite(fitting.bounds(late)), [True, True, True, False])
    assert fitting.known_until == math.inf
    assert other.verdict.family != "amplitude"
    assert other.known_until == pytest.approx(3.0)
    np.testing.assert_array_equal(np.isfinite(other.bounds(late)), [True, True, False, False])
