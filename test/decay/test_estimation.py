# SPDX-License-Identifier: Apache-2.0
"""Samples say what a response is: of which family, how sure, and when it is of none."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from limit_surface_ros.decay.estimation import EstimationOptions, ResponseEstimator
from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.decay.families import FAMILIES
from limit_surface_ros.errors import NotFiniteError, RangeError

seeds = st.integers(min_value=0, max_value=2**32 - 1)
NOISE = 0.01
OPTIONS = EstimationOptions(noise=NOISE)
HORIZON = np.linspace(0.0, 10.0, 401)
ONE = ExponentialSum([-1.0], [1.0])
TWO = ExponentialSum([-0.5, -3.0], [0.6, 0.4])
PAIR = ExponentialSum([-0.5 + 4.0j], [1.0])
# Five rates whose coefficients partly cancel, as fits of kinked responses give them.
KINKED = ExponentialSum([-1.2, -2.0 + 6.0j, -2.4 + 13.0j], [1.4, -0.3 + 0.2j, -0.1 - 0.05j])


def faster(model, speed, amplitude=1.0):
    return ExponentialSum(speed * model.rates, amplitude * model.coefficients)


def late(model, delay):
    return lambda t: model(np.maximum(np.asarray(t) - delay, 0.0))


def seen(model, response, seed=0, count=100, step=0.01, options=OPTIONS):
    random = np.random.default_rng(seed)
    estimator = ResponseEstimator(model, options)
    for t in step * np.arange(count):
        estimator.add(t, float(response(t)) + NOISE * random.normal())
    return estimator


def share_of_bound(estimator, response):
    errors = np.abs(estimator.learnt(HORIZON) - response(HORIZON))
    return float((errors / estimator.bounds(HORIZON)).max())


IN_A_FAMILY = [
    ("one term", ONE, ONE, "amplitude"),
    ("two terms", TWO, TWO, "amplitude"),
    ("pair", PAIR, PAIR, "amplitude"),
    ("kinked", KINKED, KINKED, "amplitude"),
    ("larger", TWO, faster(TWO, 1.0, 1.3), "amplitude"),
    ("5 % slow", ONE, faster(ONE, 0.95), "rate"),
    ("20 % slow", ONE, faster(ONE, 0.8), "rate"),
    ("half as fast", ONE, faster(ONE, 0.5), "rate"),
    ("50 % fast", ONE, faster(ONE, 1.5), "rate"),
    ("both 20 % slow", TWO, faster(TWO, 0.8), "rate"),
    ("both 30 % fast", TWO, faster(TWO, 1.3), "rate"),
    ("another frequency", PAIR, ExponentialSum([-0.5 + 4.4j], [1.0]), "extra decay"),
    ("late", TWO, late(TWO, 0.08), "delay"),
    ("late, one term", ONE, late(ONE, 0.08), "delay"),
    ("other weights", TWO, ExponentialSum([-0.5, -3.0], [0.3, 0.7]), None),
]


@pytest.mark.parametrize(
    ("model", "response", "family"),
    [case[1:] for case in IN_A_FAMILY],
    ids=[case[0] for case in IN_A_FAMILY],
)
def test_the_error_is_within_the_bound_for_every_response_of_a_family(model, response, family):
    for seed in range(4):
        estimator = seen(model, response, seed)
        assert estimator.verdict.fits, estimator.verdict
        assert family is None or estimator.verdict.family == family
        assert share_of_bound(estimator, response) <= 1.0
        assert estimator.outliers <= 3


def test_rate_delay_and_amplitude_are_named():
    assert seen(ONE, faster(ONE, 0.8)).verdict.rate == pytest.approx(0.8, abs=0.05)
    assert seen(TWO, late(TWO, 0.08)).verdict.delay == pytest.approx(0.08, abs=0.03)
    assert seen(TWO, faster(TWO, 1.0, 1.3)).verdict.amplitude == pytest.approx(1.3, abs=0.02)


def test_a_reversed_sign_is_told():
    verdict = seen(TWO, faster(TWO, 1.0, -1.0)).verdict
    assert verdict.reversed
    assert verdict.amplitude == pytest.approx(-1.0, abs=0.02)
    assert not seen(TWO, TWO).verdict.reversed
    assert not seen(ONE, lambda t: 0.0 * np.asarray(t)).verdict.reversed


@pytest.mark.parametrize("seed", range(5))
def test_a_response_of_no_family_is_told_and_its_bound_is_wide(seed):
    def gaussian(t):
        return np.exp(-(np.asarray(t) ** 2))

    estimator = seen(ONE, gaussian, seed)
    assert not estimator.verdict.fits
    assert "no family" in estimator.verdict.reason
    assert share_of_bound(estimator, gaussian) <= 1.0


@pytest.mark.parametrize("seed", range(5))
def test_a_straight_line_is_told_from_an_exponential_before_it_ends(seed):
    def line(t):
        return np.maximum(1.0 - np.asarray(t) / 2.5, 0.0)

    assert share_of_bound(seen(ONE, line, seed), line) <= 1.0


@pytest.mark.parametrize("model", [TWO, KINKED], ids=["two terms", "kinked"])
def test_a_line_that_weights_of_their_own_follow_stays_within_its_bound(model):
    for seed in range(200, 210):
        estimator = seen(model, lambda t: model.start * (1.0 - np.asarray(t) / 2.5), seed)
        times = np.linspace(0.0, 3.0, 121)
        errors = np.abs(estimator.learnt(times) - model.start * (1.0 - times / 2.5))
        assert (errors <= estimator.bounds(times)).all()


@pytest.mark.parametrize("model", [ONE, TWO], ids=["one term", "two terms"])
def test_of_a_response_that_no_family_follows_nothing_is_stated_after_the_last_sample(model):
    for seed in range(210, 215):
        estimator = seen(model, lambda t: np.exp(0.3 * np.asarray(t)), seed)
        assert not estimator.verdict.followed
        is_seen = estimator.seen >= HORIZON
        before, after = HORIZON[is_seen], HORIZON[~is_seen]
        assert np.isinf(estimator.bounds(after)).all()
        errors = np.abs(estimator.learnt(before) - np.exp(0.3 * before))
        assert (errors <= estimator.bounds(before)).all()


def test_a_response_that_has_not_begun_to_fall_may_stay_as_large_as_it_is():
    for seed in range(215, 220):
        estimator = seen(ONE, lambda t: np.ones_like(t), seed)
        times = np.linspace(0.0, 3.0, 121)
        assert (np.abs(estimator.learnt(times) - 1.0) <= estimator.bounds(times)).all()


def test_weights_of_their_own_still_state_a_bound_that_is_of_use():
    other = ExponentialSum([-0.5, -3.0], [0.3, 0.7])
    for seed in range(4):
        estimator = seen(TWO, other, seed)
        times = np.linspace(0.0, 1.3, 50)
        assert (estimator.bounds(times) < 0.2).all()


def test_what_the_model_itself_may_be_off_is_no_misfit():
    options = EstimationOptions(noise=0.02, model_error=0.02)
    wavy = seen(TWO, lambda t: TWO(t) + 0.02 * np.sin(7.0 * np.asarray(t)), options=options)
    assert wavy.verdict.fits
    blind = EstimationOptions(noise=0.01)
    wavy = seen(TWO, lambda t: TWO(t) + 0.02 * np.sin(7.0 * np.asarray(t)), options=blind)
    assert not wavy.verdict.fits


def test_noise_that_is_larger_than_stated_is_told_as_such():
    verdict = seen(ONE, ONE, options=EstimationOptions(noise=NOISE / 4.0, gate=50.0)).verdict
    assert not verdict.fits
    assert "noisier than is stated" in verdict.reason
    assert verdict.chi2_per_sample == pytest.approx(16.0, rel=0.4)


def test_bounds_know_of_all_families_between_the_samples_at_which_all_are_fitted():
    estimator = seen(TWO, faster(TWO, 0.8), count=33)
    learnt = estimator.learnt(HORIZON)
    estimator.bounds(HORIZON)
    assert {fit.samples for fit in estimator._fits} == {33}
    np.testing.assert_array_equal(estimator.learnt(HORIZON), learnt)


def test_without_samples_nothing_is_corrected():
    estimator = ResponseEstimator(TWO, OPTIONS)
    assert estimator.learnt.sum is TWO
    assert estimator.verdict.fits
    assert math.isnan(estimator.residual)


def test_the_bound_tells_the_error_of_the_estimate():
    random = np.random.default_rng(3)
    shares = []
    for seed in range(40):
        response = faster(TWO, np.exp(0.2 * random.normal()), 1.0 + 0.2 * random.normal())
        estimator = seen(TWO, response, seed, count=50, step=0.02)
        shares.append(share_of_bound(estimator, response))
    assert np.max(shares) <= 1.0
    assert np.median(shares) > 0.03


def test_outliers_are_gated_and_the_estimate_holds():
    random = np.random.default_rng(5)
    response = faster(KINKED, 1.0, 1.2)
    estimator, wild = ResponseEstimator(KINKED, OPTIONS), 0
    for k, t in enumerate(np.arange(0.0, 1.0, 0.005)):
        spoilt = k % 7 == 3
        wild += spoilt
        value = float(response(t)) + NOISE * random.normal()
        assert estimator.add(t, value + spoilt * random.choice([-40.0, 40.0])) is not spoilt
    assert estimator.outliers == wild
    assert (estimator.bounds(np.array([1e99, 1e308])) < 1.0).all()
    assert np.abs(estimator.learnt(HORIZON) - response(HORIZON)).max() < 0.05


def test_a_response_that_changes_for_good_is_told_and_then_followed():
    estimator = ResponseEstimator(TWO, OPTIONS)
    random = np.random.default_rng(6)
    changed = faster(TWO, 1.0, 2.5)
    for t in np.arange(0.0, 0.5, 0.005):
        estimator.add(t, float(TWO(t)) + NOISE * random.normal())
    told = False
    for t in np.arange(0.5, 1.2, 0.005):
        estimator.add(t, float(changed(t)) + NOISE * random.normal())
        told |= "has changed" in estimator.verdict.reason
    assert told
    assert estimator.verdict.fits
    times = np.linspace(0.5, 3.0, 50)
    assert np.abs(estimator.learnt(times) - changed(times)).max() < 0.1


def test_a_gap_keeps_what_was_learnt():
    random = np.random.default_rng(7)
    response = faster(KINKED, 1.0, 0.8)
    estimator = ResponseEstimator(KINKED, OPTIONS)
    for t in np.append(np.arange(0.0, 0.4, 0.005), np.arange(2.0, 2.4, 0.005)):
        estimator.add(t, float(response(t)) + NOISE * random.normal())
    assert np.abs(estimator.learnt(HORIZON) - response(HORIZON)).max() < 0.03


def test_thousands_of_samples_of_nothing_spoil_nothing_and_need_no_memory():
    estimator = seen(KINKED, faster(KINKED, 1.0, 1.2), count=200)
    random = np.random.default_rng(8)
    for t in 20.0 + np.arange(3000) * 0.01:
        estimator.add(t, NOISE * random.normal())
    assert len(estimator._times) <= 401
    # The first samples are thinned out, not forgotten.
    assert estimator._times[0] < 1.0
    assert np.isfinite(estimator.learnt(HORIZON)).all()
    assert np.abs(estimator.learnt(HORIZON) - 1.2 * KINKED(HORIZON)).max() < 0.5


def test_terms_that_samples_cannot_tell_apart_stay_finite():
    twins = ExponentialSum([-1.0, -1.0 - 1e-9, -1.0 + 1e-9], [1e6, -5e5, -5e5 + 1.0])
    estimator = seen(twins, faster(ONE, 1.0, 1.2))
    t = np.linspace(0.0, 2.0, 50)
    np.testing.assert_allclose(estimator.learnt(t), 1.2 * np.exp(-t), atol=0.05)


@given(seeds)
@settings(max_examples=25, deadline=None)
def test_slopes_of_every_family_are_those_of_differences(seed):
    random = np.random.default_rng(seed)
    times = random.uniform(0.1, 3.0, 8)
    for family in FAMILIES:
        made = family(KINKED)
        numbers = made.bounded(made.mean + 0.2 * made.spread * random.normal(size=len(made.mean)))
        values, slopes = made.values(times, numbers)
        np.testing.assert_allclose(made.learnt(numbers)(times), values, atol=1e-12)
        for k in range(len(numbers)):
            step = np.zeros(len(numbers))
            step[k] = 1e-6
            ahead, behind = (made.values(times, numbers + sign * step)[0] for sign in (1, -1))
            np.testing.assert_allclose(slopes[:, k], (ahead - behind) / 2e-6, atol=1e-6)


@pytest.mark.parametrize("late_by", [0.1, 0.2, 0.05])
def test_samples_out_of_order_are_refused_and_change_nothing(late_by):
    estimator = ResponseEstimator(ONE, OPTIONS)
    estimator.add(0.1, 1.1)
    estimator.add(0.2, 1.0)
    before = estimator.learnt
    with pytest.raises(RangeError, match="order of time"):
        estimator.add(late_by, 5.0)
    assert estimator.learnt is before
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
    estimator = ResponseEstimator(ONE, OPTIONS)
    with pytest.raises(error, match="sample"):
        estimator.add(time, value)
    assert estimator.learnt.sum is ONE
    assert estimator.add(0.1, float(ONE(0.1)))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("noise", 0.0),
        ("noise", math.nan),
        ("forgetting", 0.0),
        ("forgetting", 1.1),
        ("forgetting", math.nan),
        ("gate", 0.0),
        ("change_after", 0),
        ("span_factor", 0.5),
        ("span_factor", math.nan),
    ],
)
def test_bad_options_are_refused_by_name(name, value):
    with pytest.raises(RangeError, match=name):
        EstimationOptions(**{"noise": NOISE, name: value})


def test_a_model_of_zero_is_refused():
    with pytest.raises(RangeError, match="zero"):
        ResponseEstimator(ExponentialSum([-1.0], [0.0]), OPTIONS)
