# SPDX-License-Identifier: Apache-2.0
"""After the record no model exceeds what it states, and an honest assumption bounds its error."""

import numpy as np
import pytest

from limit_surface_ros.decay.coefficients import fit_response
from limit_surface_ros.decay.fit import Options, fit_decay
from limit_surface_ros.decay.tail import envelope_of
from limit_surface_ros.decay.targets import PiecewiseLinear, Record
from limit_surface_ros.files.decay_file import DecayModel


def held(t):
    """8 N for 3 s, then released within half a second."""
    return 8.0 * np.clip((3.5 - t) / 0.5, 0.0, 1.0)


def kinky(t):
    """A record that still stands at 0.3 when it ends."""
    return np.interp(t, [0.0, 1.0, 1.7, 3.1, 6.0], [1.0, 0.6, 0.75, 0.2, 0.3])


def record(function, end, noise=0.0, seed=0, samples=None):
    times = np.linspace(0.0, end, samples or round(100.0 * end) + 1)
    random = np.random.default_rng(seed)
    return Record(times, function(times) + noise * random.normal(size=len(times)))


def highest_after(x, end):
    return float(np.abs(x(np.linspace(end, 10.0 * end, 100_001))).max())


def test_a_held_and_released_load_is_met_and_stays_away():
    fit = fit_decay(record(held, 6.0), 15, 6.0)
    assert fit.fit.max_error <= 0.18
    assert highest_after(fit.fit.sum, 6.0) <= fit.tail.bound <= 0.2
    assert fit.tail.envelope == 0.0
    assert "after 6 s" in fit.tail.assumption


def test_a_free_tail_explodes_where_a_bounded_one_does_not():
    cut = record(held, 3.3)
    free = fit_decay(cut, 5, 3.3, options=Options(bounded=False))
    assert free.tail is None
    bounded = fit_decay(cut, 5, 3.3)
    assert highest_after(bounded.fit.sum, 3.3) <= bounded.tail.bound < 9.0
    assert highest_after(free.fit.sum, 3.3) > 100.0
    assert bounded.fit.max_error < 1.1 * free.fit.max_error


@pytest.mark.parametrize(("function", "end"), [(held, 6.0), (held, 3.3), (kinky, 6.0)])
@pytest.mark.parametrize("method", ["neutral", "esprit", "polished", "least_squares"])
def test_no_method_exceeds_what_it_states(function, end, method):
    fit = fit_decay(record(function, end), 7, end, method)
    assert highest_after(fit.fit.sum, end) <= fit.tail.bound
    # Least squares weigh what comes after against the misfit; the others allow no more.
    most = 3.0 if method == "least_squares" else 1.05
    assert fit.tail.bound <= most * max(fit.tail.envelope, fit.fit.max_error)


@pytest.mark.parametrize("norm", ["inf", "2", "1", lambda e: float(np.sum(e**4) ** 0.25)])
def test_every_norm_is_held(norm):
    cut = record(held, 3.3)
    fit = fit_decay(cut, 7, 3.3, "esprit", norm)
    assert highest_after(fit.fit.sum, 3.3) <= fit.tail.bound
    assert fit.tail.bound <= 1.05 * max(fit.tail.envelope, fit.fit.max_error)


def test_a_sum_that_stays_by_itself_is_not_changed():
    stick = PiecewiseLinear(np.array([0.0, 1.0]), np.array([1.0, 0.0]))
    rates = [-4.0, -3.2 + 4.4j, -1.1 + 10.0j]
    free = fit_response(rates, stick, 19.0)
    bounded = fit_response(rates, stick, 19.0, envelope=0.0)
    np.testing.assert_array_equal(free.sum.coefficients, bounded.sum.coefficients)


@pytest.mark.parametrize("noise", [0.0, 0.01, 0.05])
def test_the_error_after_a_noisy_record_is_within_what_is_stated(noise):
    responses = [
        lambda t: 0.5 * np.exp(-0.4 * t) + 0.5 * np.exp(-3.0 * t),
        lambda t: 1.0 / (1.0 + t) ** 2,
        lambda t: np.exp(-0.7 * t) * np.cos(5.0 * t),
    ]
    later = np.linspace(6.0, 30.0, 5001)
    for seed, response in enumerate(responses):
        noisy = record(response, 6.0, noise, seed, samples=200)
        fit = fit_decay(noisy, 3, 6.0)
        assert np.abs(fit.fit.sum(later) - response(later)).max() <= fit.tail.error


def test_the_envelope_is_the_largest_value_of_the_last_tenth_but_for_outliers():
    times = np.linspace(0.0, 10.0, 201)
    values = np.exp(-0.1 * times)
    assert envelope_of(Record(times, values), 10.0) == pytest.approx(np.exp(-0.9))
    values = values.copy()
    values[195] = 7.0
    assert envelope_of(Record(times, values), 10.0) == pytest.approx(np.exp(-0.9))
    # A sample that is all that is known of the last tenth counts, however far it stands out.
    alone = Record(np.append(times, 15.0), np.append(np.exp(-0.1 * times), 7.0))
    assert envelope_of(alone, 15.0) == 7.0


@pytest.mark.parametrize("end", [2.1, *np.linspace(2.5, 9.5, 15)])
def test_a_swing_that_crosses_zero_where_the_record_ends_is_expected_to_go_on(end):
    def swing(t):
        return np.exp(-0.15 * t) * np.cos(2.0 * t + 0.4)

    later = float(np.abs(swing(np.linspace(end, 4.0 * end, 20_001))).max())
    assert later <= envelope_of(record(swing, end, 0.01), end, 0.01) <= 2.0 * later + 0.05


def test_an_undershoot_that_has_died_away_is_no_swing():
    times = np.linspace(0.0, 6.0, 601)
    undershoot = Record(times, np.exp(-times) * (1.0 - 1.5 * times))
    assert envelope_of(undershoot, 6.0) == pytest.approx(abs(undershoot.values[540]))


def arch(t):
    """A quarter of a cosine, whose slow terms cancel to a millionth of it."""
    return np.cos(np.pi * t / 12.0)


@pytest.mark.parametrize("function", [lambda t: 1.0 - t / 6.0, lambda t: 1.0 - t / 7.0, arch])
@pytest.mark.parametrize("terms", [5, 9, 11])
def test_slow_terms_that_cancel_on_the_record_are_held_for_as_long_as_they_last(function, terms):
    fit = fit_decay(record(function, 6.0, samples=200), terms, 6.0)
    beyond = np.concatenate([np.linspace(6.0, 60.0, 2000), np.geomspace(60.0, 1e6, 20_000)])
    assert np.abs(fit.fit.sum(beyond)).max() <= fit.tail.bound
    assert fit.tail.bound <= 1.05 * max(fit.tail.envelope, fit.fit.max_error)
    assert fit.fit.max_error < 0.02


@pytest.mark.parametrize("rates", [[-1e-3, -1e-3 + 0.02j, -1e-3 + 0.04j], [-0.01 + 9.0j, -0.5]])
def test_coefficients_alone_are_held_however_far_terms_cancel(rates):
    line = record(lambda t: 1.0 - t / 7.0, 6.0, samples=100)
    envelope = envelope_of(line, 6.0)
    free = fit_response(rates, line, 6.0)
    fit = fit_response(rates, line, 6.0, envelope=envelope)
    most = max(envelope, fit.max_error)
    assert fit.sum.supremum(6.0) <= 1.05 * most
    assert free.max_error <= fit.max_error


def test_a_model_states_its_bounds_where_something_is_known():
    fit = fit_decay(record(kinky, 6.0), 5, 6.0)
    model = DecayModel("k", fit.fit.sum, (0.0, 6.0), "inf", fit.fit.max_error, tail=fit.tail)
    bounds = model.bounds([0.0, 6.0, 6.1, 1e6])
    np.testing.assert_array_equal(bounds[:2], model.max_error)
    np.testing.assert_array_equal(bounds[2:], max(fit.tail.error, model.max_error))
    silent = DecayModel("k", fit.fit.sum, (1.0, 6.0), "inf", 0.1)
    np.testing.assert_array_equal(silent.bounds([0.5, 3.0, 7.0]), [np.inf, 0.1, np.inf])
