# SPDX-License-Identifier: Apache-2.0
"""Each method of choosing rates keeps its promise against the thesis and its peers."""

import contextlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from limit_surface_ros.decay import examples
from limit_surface_ros.decay.coefficients import fit_response
from limit_surface_ros.decay.delay.construction import delay_system
from limit_surface_ros.decay.delay.roots import first_roots
from limit_surface_ros.decay.esprit import esprit
from limit_surface_ros.decay.fit import Options, fit_decay
from limit_surface_ros.decay.grids import largest_error
from limit_surface_ros.decay.neutral import neutral_rates, neutral_roots
from limit_surface_ros.decay.rates import predicted_error, take
from limit_surface_ros.decay.targets import PiecewiseLinear, Record
from limit_surface_ros.errors import LimitSurfaceError, RangeError, ShapeError, UnstableError

END = 19.0


@pytest.mark.parametrize(("terms", "goal"), [(9, 1.5e-2), (15, 8.7e-3), (31, 4.2e-3)])
def test_the_delay_chosen_automatically_beats_that_of_the_thesis(terms, goal):
    result = fit_decay(examples.hockey_stick(), terms, END, "dde")
    assert result.fit.max_error <= goal
    assert result.fit.sum.terms <= terms
    assert result.choice.system is not None
    value, slope = result.choice.system.characteristic_and_derivative(result.choice.rates)
    assert np.abs(value / slope).max() < 1e-10


@pytest.mark.parametrize(("terms", "goal"), [(9, 6.4e-3), (15, 3.6e-3)])
def test_best_beats_the_published_peers_on_the_hockey_stick(terms, goal):
    result = fit_decay(examples.hockey_stick(), terms, END, "best")
    assert result.fit.max_error <= goal
    assert result.fit.sum.slowest_rate < 0.0


@pytest.mark.parametrize("name", ["f2", "f3", "gaussian", "power_law", "tail"])
def test_best_is_never_worse_than_esprit_with_refitted_coefficients(name):
    response = examples.example(name)
    best = fit_decay(response, 9, END, "best")
    peer = fit_decay(response, 9, END, "esprit")
    assert best.fit.max_error <= peer.fit.max_error


def test_polishing_never_makes_worse_and_says_how_far_it_is():
    lines = []
    response = examples.four_impulses()
    polished = fit_decay(response, 9, END, "polished", progress=lines.append)
    esprit_fit = fit_decay(response, 9, END, "esprit")
    assert polished.fit.max_error < esprit_fit.fit.max_error
    assert any("polished" in line for line in lines)


@pytest.mark.parametrize("max_delay", [3.0, 6.0])
def test_the_error_is_predicted_before_the_fit(max_delay):
    response = examples.hockey_stick()
    rates = take(first_roots(delay_system(response, max_delay), 32), 61)
    error = fit_response(rates, response, END).max_error
    terms = 2 * len(rates) - int(np.count_nonzero(rates.imag == 0.0))
    assert error == pytest.approx(predicted_error(1.0, max_delay, terms), rel=0.15)


@given(st.integers(min_value=0, max_value=2**32 - 1))
@settings(max_examples=20, deadline=None)
def test_esprit_recovers_the_rates_of_a_sum_from_its_samples(seed):
    rng = np.random.default_rng(seed)
    rates = np.array([-0.5, -1.0 + 3.0j, -0.3 + 7.0j]) * rng.uniform(0.7, 1.3)
    t = np.linspace(0.0, 6.0, 301)
    coefficients = rng.uniform(0.5, 2.0, 3)
    x = (np.exp(np.outer(t, rates)) @ coefficients).real
    found = esprit(x, t[1], 5)
    np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(rates), rtol=0, atol=1e-7)


def test_esprit_stops_at_the_rank_of_the_samples():
    t = np.linspace(0.0, 6.0, 301)
    found = esprit(np.exp(-t), t[1], 20)
    np.testing.assert_allclose(found, [-1.0], atol=1e-10)


@pytest.mark.parametrize(("terms", "sign"), [(7, 1.0), (8, -1.0)])
def test_neutral_roots_obey_their_equation(terms, sign):
    rates = neutral_roots(terms, 1.5, 1.2)
    np.testing.assert_allclose(np.exp(rates * 1.2), sign * np.exp(-1.5 * 1.2), rtol=1e-12)
    assert len(rates) + np.count_nonzero(rates.imag) == terms


def test_known_tail_rates_help_the_neutral_choice():
    response = examples.kink_with_tail()
    plain = neutral_rates(response, 15, END)
    helped = neutral_rates(response, 15, END, [-0.5])
    assert helped.error < 0.6 * plain.error
    assert -0.5 in helped.rates


def test_a_response_that_is_not_minimum_phase_is_refused_or_gone_on_with_when_told():
    response = examples.undershoot()
    with pytest.raises(UnstableError, match="not minimum-phase"):
        fit_decay(response, 9, 6.0, "dde")
    options = Options(max_delay=3.0, allow_unstable=True)
    forced = fit_decay(response, 9, 6.0, "dde", options=options)
    assert forced.fit.sum.slowest_rate > 0.0
    assert fit_decay(response, 9, 6.0, "best").fit.sum.slowest_rate < 0.0


@pytest.mark.parametrize("method", ["dde", "neutral", "best"])
def test_noise_does_not_make_the_fit_blow_up_beyond_the_interval(method):
    rng = np.random.default_rng(1)
    times = np.linspace(0.0, 6.0, 601)
    clean = examples.hockey_stick()
    noisy = PiecewiseLinear(times, clean(times) + 0.01 * rng.normal(size=len(times)))
    result = fit_decay(noisy, 15, 6.0, method, norm="2")
    assert largest_error(result.fit.sum, clean, 0.0, 6.0) < 0.05
    assert np.abs(result.fit.sum(np.linspace(6.0, 60.0, 2000))).max() < 0.05


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda f: fit_decay(f, 0, 6.0), RangeError, "terms"),
        (lambda f: fit_decay(f, 5, -1.0), RangeError, "end"),
        (lambda f: fit_decay(f, 5, 6.0, "magic"), RangeError, "one of dde, neutral"),
        (lambda f: fit_decay(f, 5, 6.0, "neutral", norm="max"), RangeError, "norm"),
        (lambda f: neutral_rates(f, 1, 6.0, [-0.5]), RangeError, "leave none"),
        (lambda f: neutral_roots(3, -1.0, 1.0), RangeError, "damping"),
        (lambda f: esprit([1.0, 0.5], 0.1, 1), ShapeError, "at least 3 samples"),
    ],
)
def test_bad_requests_are_refused_with_the_reason(call, error, message):
    with pytest.raises(error, match=message):
        call(examples.hockey_stick())


@pytest.mark.parametrize("terms", [1, 5])
@pytest.mark.parametrize("method", ["dde", "neutral", "esprit"])
def test_a_response_that_nothing_suits_gives_a_fit_or_a_reason_but_no_warning(method, terms):
    almost_a_step = PiecewiseLinear([0.0, 0.5, 0.5001, 5.0], [1.0, 1.0, 0.0, 0.0])
    with contextlib.suppress(LimitSurfaceError):
        result = fit_decay(almost_a_step, terms, 5.0, method)
        assert result.fit.max_error < 1.0
        assert result.fit.sum.slowest_rate < 0.0


def test_rates_that_only_the_samples_of_a_record_agree_with_are_no_fit():
    times = np.linspace(0.0, 4.0, 41)
    record = Record(times, np.exp(-times))
    # The samples cannot tell a frequency from the same less one turn a sample.
    alias = fit_response(np.array([-1.0 + 2.0j * np.pi / 0.1]), record, 4.0)
    true = fit_response(np.array([-1.0 + 0.0j]), record, 4.0)
    assert true.max_error < 1e-14
    assert alias.max_error > 0.3


def test_records_whose_samples_are_not_uniform_are_met_at_them_too():
    rng = np.random.default_rng(3)
    times = np.append(0.0, np.sort(rng.uniform(0.0, 4.0, 150)))
    record = Record(times, 2.0 * np.exp(-times) - np.exp(-3.0 * times))
    result = fit_decay(record, 2, 4.0, "polished")
    assert result.fit.max_error < 1e-9
    np.testing.assert_allclose(np.sort(result.choice.rates.real), [-3.0, -1.0], rtol=1e-6)


def test_the_best_is_best_in_the_norm_that_is_asked_for():
    times = np.linspace(0.0, 6.0, 301)
    record = Record(times, examples.four_impulses()(times))
    best = fit_decay(record, 7, 6.0, "best", "2").fit
    assert best.norm == "2"
    for method in ("polished", "neutral"):
        other = fit_decay(record, 7, 6.0, method, "2").fit
        assert best.grid_error <= other.grid_error * (1.0 + 1e-9)


def test_auto_ends_when_more_terms_no_longer_lower_the_error():
    times = np.linspace(0.0, 6.0, 201)
    values = 3.0 * np.exp(-times) + 2.0 * np.exp(-4.0 * times)
    # A sample that is off by 1 leaves an error of a half, however many terms there are.
    values[100] += 1.0
    lines = []
    fit = fit_decay(
        Record(times, values), "auto", 6.0, options=Options(robust=False), progress=lines.append
    )
    assert fit.fit.max_error == pytest.approx(0.5, abs=0.01)
    assert sum(line.startswith("esprit:") for line in lines) < 10
