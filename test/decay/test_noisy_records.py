# SPDX-License-Identifier: Apache-2.0
"""Noisy records give the response behind them: its rates, its number of terms, its outliers."""

import numpy as np
import pytest

from limit_surface_ros.decay.fit import Options, fit_decay
from limit_surface_ros.decay.outliers import holds_strays, neighbour_weights, stand_out
from limit_surface_ros.decay.targets import Analytic, Record
from limit_surface_ros.errors import DataError, RangeError


def record(function, end=6.0, samples=600, noise=0.0, seed=0):
    times = np.linspace(0.0, end, samples)
    return Record(
        times, function(times) + noise * np.random.default_rng(seed).normal(size=samples)
    )


def rms(fit, function, end=6.0):
    times = np.linspace(0.0, end, 4001)
    return float(np.sqrt(np.mean((fit.fit.sum(times) - function(times)) ** 2)))


def test_three_outliers_of_600_are_named_and_count_for_nothing():
    clean = record(lambda t: np.exp(-2.0 * t), noise=1e-3)
    values = clean.values.copy()
    places = [50, 200, 400]
    values[places] += [2.0, -1.0, 5.0]
    fit = fit_decay(Record(clean.knots, values), "auto", 6.0)
    assert fit.choice.method == "least_squares"
    assert fit.fit.sum.terms == 1
    assert fit.fit.sum.rates[0].real == pytest.approx(-2.0, abs=0.005)
    np.testing.assert_array_equal(fit.outliers, clean.knots[places])
    times = np.linspace(0.0, 6.0, 4001)
    assert np.abs(fit.fit.sum(times) - np.exp(-2.0 * times)).max() < 1e-3
    assert fit.noise == pytest.approx(1e-3, rel=0.2)
    assert fit.fit.max_error < 5e-3


@pytest.mark.parametrize("stray", [0.0, 6.0])
def test_a_stray_sample_in_a_clean_record_counts_for_nothing(stray):
    clean = record(lambda t: np.exp(-t))
    values = clean.values.copy()
    values[250] = stray
    fit = fit_decay(Record(clean.knots, values), 1, 6.0)
    np.testing.assert_array_equal(fit.outliers, clean.knots[[250]])
    assert fit.fit.sum.rates[0] == pytest.approx(-1.0, abs=1e-9)


def test_no_clean_response_holds_stray_samples():
    times = np.linspace(0.0, 6.0, 601)
    for response in (
        np.exp(-times),
        np.cos(30.0 * times),
        np.where(times < 3.0, 1.0, 0.0),
        np.abs(2.0 * ((1.3 * times) % 1.0) - 1.0),
    ):
        assert not holds_strays(response, 0.0)


def test_the_last_sample_of_a_slope_does_not_stand_out():
    slope = np.exp(-np.linspace(0.0, 3.0, 101))
    assert not stand_out(slope, 0.0).any()
    slope[-1] = 1.0
    np.testing.assert_array_equal(np.flatnonzero(stand_out(slope, 0.0)), [100])


def test_outliers_spoil_a_fit_that_is_told_to_keep_them():
    clean = record(lambda t: np.exp(-2.0 * t), noise=1e-3)
    values = clean.values.copy()
    values[[50, 200, 400]] += [2.0, -1.0, 5.0]
    spoiled = Record(clean.knots, values)
    kept = fit_decay(spoiled, 2, 6.0, options=Options(robust=False))
    assert len(kept.outliers) == 0
    assert rms(kept, lambda t: np.exp(-2.0 * t)) > 20.0 * rms(
        fit_decay(spoiled, 2, 6.0), lambda t: np.exp(-2.0 * t)
    )


def test_a_steep_start_is_no_outlier():
    steep = record(lambda t: np.exp(-(t**0.3)), noise=0.01)
    fit = fit_decay(steep, 4, 6.0)
    assert abs(float(fit.fit.sum(0.0)) - 1.0) < 0.2
    assert len(fit.outliers) == 0


@pytest.mark.parametrize("seed", range(2))
def test_terms_that_die_within_a_step_do_not_follow_the_first_samples(seed):
    def held(t):
        return 8.0 * np.clip((3.5 - t) / 0.5, 0.0, 1.0)

    noisy = record(held, samples=300, noise=0.4, seed=seed)
    if seed:
        # A first gap that is longer than most.
        noisy = Record(np.delete(noisy.knots, [1, 2]), np.delete(noisy.values, [1, 2]))
    fit = fit_decay(noisy, 15, 6.0)
    start = np.linspace(0.0, 0.1, 1001)
    assert np.abs(fit.fit.sum(start) - 8.0).max() < 4.0 * fit.noise


@pytest.mark.parametrize("seed", range(2))
def test_more_terms_than_a_response_has_do_not_follow_noise_at_any_frequency(seed):
    rates, weights = np.array([-0.5, -3.0, -20.0]), np.array([0.4, 0.4, 0.2])

    def real(t):
        return np.exp(np.multiply.outer(t, rates)) @ weights

    fit = fit_decay(record(real, samples=2000, noise=0.01, seed=seed), 7, 6.0)
    assert not fit.fit.sum.rates.imag.any()
    assert rms(fit, real) < 0.01 * np.sqrt(14.0 / 2000.0)


def test_a_clean_sum_is_met_to_rounding_and_not_by_least_squares():
    rates, coefficients = [-0.4, -1.1, -3.0, -9.0, -25.0], [0.25, 0.3, 0.2, 0.15, 0.1]
    clean = record(lambda t: np.exp(np.multiply.outer(t, rates)) @ coefficients)
    fit = fit_decay(clean, 5, 6.0)
    assert fit.choice.method != "least_squares"
    assert fit.fit.max_error < 1e-10


@pytest.mark.parametrize(
    ("function", "terms"),
    [
        (lambda t: np.exp(-t), 1),
        (lambda t: 0.7 * np.exp(-0.5 * t) + 0.3 * np.exp(-8.0 * t), 2),
        (lambda t: np.exp(-0.7 * t) * np.cos(5.0 * t), 2),
        (lambda t: 0.6 * np.exp(-0.4 * t) + 0.4 * np.exp(-0.6 * t) * np.cos(30.0 * t), 3),
    ],
)
def test_the_number_of_terms_is_found(function, terms):
    for seed in range(3):
        fit = fit_decay(record(function, noise=0.01, seed=seed), "auto", 6.0)
        assert fit.fit.sum.terms == terms
        assert rms(fit, function) < 0.004
        assert [tried.terms for tried in fit.terms_tried][:2] == [1, 2]


def test_uneven_times_hide_no_oscillation():
    random = np.random.default_rng(3)
    times = np.sort(np.append(0.0, random.uniform(0.0, 6.0, 500)))
    times = times[(times < 2.0) | (times > 2.5)]
    values = np.exp(-0.5 * times) * np.cos(20.0 * times) + 0.02 * random.normal(size=len(times))
    rates = fit_decay(Record(times, values), "auto", float(times[-1])).fit.sum.rates
    assert abs(rates[0].imag - 20.0) < 0.1


def test_a_constant_is_fitted_where_it_is_asked_for():
    def creeping(t):
        return 5.0 + 2.0 * np.exp(-0.3 * t) + np.exp(-4.0 * t)

    fit = fit_decay(record(creeping, noise=0.02), 2, 6.0, options=Options(offset=True))
    assert fit.fit.sum.constant == pytest.approx(5.0, abs=0.1)
    assert fit.fit.sum.terms == 3
    assert rms(fit, creeping) < 0.01
    later = np.linspace(6.0, 60.0, 1001)
    assert np.abs(fit.fit.sum(later) - creeping(later)).max() <= fit.tail.error


def test_the_norm_that_is_asked_for_is_the_one_of_the_coefficients():
    noisy = record(lambda t: np.exp(-t), noise=0.02)
    fits = {norm: fit_decay(noisy, 2, 6.0, norm=norm).fit for norm in ("inf", "2", "1")}
    errors = {norm: noisy.values - fit.sum(noisy.knots) for norm, fit in fits.items()}
    for norm, order in (("inf", np.inf), ("2", 2), ("1", 1)):
        least = min(errors, key=lambda other: np.linalg.norm(errors[other], order))
        assert least == norm
        assert fits[norm].norm == norm


def test_growing_responses_are_refused():
    with pytest.raises(DataError, match="grows: it starts at 1 and is largest"):
        fit_decay(record(lambda t: np.exp(0.2 * t)), 3, 6.0)
    with pytest.raises(DataError, match="grows"):
        fit_decay(record(lambda t: np.exp(0.2 * t), noise=0.02), "auto", 6.0)


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        ({"terms": "many"}, RangeError),
        ({"terms": 0}, RangeError),
        ({"method": "neutral", "options": Options(offset=True)}, RangeError),
        ({"terms": 400}, DataError),
    ],
)
def test_what_cannot_be_fitted_is_refused(arguments, error):
    noisy = record(lambda t: np.exp(-t), noise=0.02)
    with pytest.raises(error):
        fit_decay(noisy, **({"terms": 2, "end": 6.0} | arguments))


def test_a_function_has_no_samples_for_least_squares():
    with pytest.raises(DataError, match="need samples"):
        fit_decay(Analytic(lambda t: np.exp(-t)), 2, 6.0, "least_squares")


def test_an_outlier_stands_alone_and_a_misfit_does_not():
    misfit = np.sin(np.linspace(0.0, 3.0, 300))
    assert (neighbour_weights(misfit, 0.01)[10:-10] == 1.0).all()
    misfit[150] += 10.0
    assert neighbour_weights(misfit, 0.01)[150] == 0.0
    steps = np.where(np.arange(300) < 150, 1.0, 0.0)
    assert not stand_out(steps, 1e-3).any()
    steps[200] = 0.5
    np.testing.assert_array_equal(np.flatnonzero(stand_out(steps, 1e-3)), [200])
