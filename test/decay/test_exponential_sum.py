# SPDX-License-Identifier: Apache-2.0
"""Sums of exponentials evaluate, differentiate, integrate and cross levels as they promise."""

import math
import subprocess
import sys
import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from limit_surface_ros.decay.basis import real_basis
from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.errors import NotFiniteError, RangeError, ShapeError, UnstableError

seeds = st.integers(min_value=0, max_value=2**32 - 1)


def random_sum(seed, most=6):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, most + 1))
    pair = rng.random(count) < 0.6
    rates = -rng.uniform(0.2, 4.0, count) + 1j * np.where(pair, rng.uniform(0.3, 20.0, count), 0.0)
    coefficients = rng.normal(size=count) + 1j * np.where(pair, rng.normal(size=count), 0.0)
    return ExponentialSum(rates, coefficients)


def test_a_pair_is_a_damped_cosine_and_sine():
    x = ExponentialSum([-2.0 + 3.0j], [0.5 - 0.25j])
    t = np.linspace(0.0, 3.0, 50)
    expected = np.exp(-2.0 * t) * (0.5 * np.cos(3.0 * t) + 0.25 * np.sin(3.0 * t))
    np.testing.assert_allclose(x(t), expected, rtol=0, atol=1e-15)
    assert x.terms == 2


@given(seeds)
@settings(max_examples=30, deadline=None)
def test_weights_of_the_real_basis_give_the_same_function(seed):
    x = random_sum(seed)
    t = np.linspace(0.0, 5.0, 40)
    np.testing.assert_allclose(real_basis(x.rates, t) @ x.weights, x(t), rtol=0, atol=1e-12)
    again = ExponentialSum.from_weights(x.rates, x.weights)
    np.testing.assert_array_equal(again.coefficients, x.coefficients)


@given(seeds)
@settings(max_examples=30, deadline=None)
def test_derivative_agrees_with_finite_differences(seed):
    x = random_sum(seed)
    t = np.linspace(0.1, 3.0, 20)
    step = 1e-6
    slope = (x(t + step) - x(t - step)) / (2.0 * step)
    np.testing.assert_allclose(x.derivative()(t), slope, rtol=1e-5, atol=1e-5)


@given(seeds)
@settings(max_examples=30, deadline=None)
def test_integral_of_the_derivative_is_the_rise(seed):
    x = random_sum(seed)
    t = np.linspace(0.0, 3.0, 20)
    np.testing.assert_allclose(x.derivative().integral(t), x(t) - x(0.0), rtol=0, atol=1e-12)
    assert x.total_integral() == pytest.approx(float(x.integral(300.0)), abs=1e-12)


def test_integral_of_a_constant_and_of_a_nearly_constant_term_keep_their_digits():
    assert float(ExponentialSum([0.0], [2.0]).integral(3.0)) == 6.0
    assert float(ExponentialSum([-1e-14], [2.0]).integral(3.0)) == pytest.approx(6.0, rel=1e-13)


def test_time_to_level_of_one_exponential_is_its_logarithm():
    x = ExponentialSum([-0.7], [3.0])
    assert x.time_to_level(0.3) == pytest.approx(math.log(10.0) / 0.7, abs=1e-12)
    assert x.time_to_level(3.0) == pytest.approx(0.0, abs=1e-14)
    assert x.time_to_level(5.0) == 0.0
    assert x.time_to_level(0.0) == math.inf


@given(seeds, st.floats(min_value=1e-4, max_value=0.8))
@settings(max_examples=40, deadline=None)
def test_after_time_to_level_the_level_is_never_exceeded_and_just_before_it_is(seed, fraction):
    x = random_sum(seed)
    level = fraction * float(np.abs(x.coefficients).sum())
    time = x.time_to_level(level)
    later = time + np.linspace(1e-9, 40.0, 20001)
    assert np.abs(x(later)).max() <= level * (1.0 + 1e-9)
    if time > 0.0:
        assert np.abs(x(time)) == pytest.approx(level, rel=1e-8)


@pytest.mark.parametrize("rate", [1e-300, 1e-170, 1.0, 1e160, 1e300])
def test_time_to_level_knows_no_unit_of_time(rate):
    alone = ExponentialSum([-rate], [1.0]).time_to_level(0.1)
    assert alone * rate == pytest.approx(math.log(10.0))
    beside_a_faster = ExponentialSum([-1e5 * rate, -rate], [1.0, 1.0]).time_to_level(0.1)
    assert beside_a_faster * rate == pytest.approx(math.log(10.0))


def test_time_to_level_sees_a_late_return_that_a_first_crossing_misses():
    # x falls through zero at once and comes back below it: |x| is above the level again.
    x = ExponentialSum([-1.0 + 2.0j], [1.0])
    t = np.linspace(0.0, 20.0, 2000001)
    above = t[np.abs(x(t)) > 0.05]
    first_below = t[np.argmax(np.abs(x(t)) <= 0.05)]
    assert x.time_to_level(0.05) == pytest.approx(above[-1], abs=2e-5)
    assert x.time_to_level(0.05) > first_below + 0.5


def test_a_sum_that_does_not_decay_has_no_time_to_level():
    with pytest.raises(UnstableError, match="does not decay"):
        ExponentialSum([0.1], [1.0]).time_to_level(0.5)


def test_truncation_keeps_the_largest_terms_and_whole_pairs():
    x = ExponentialSum([-1.0, -2.0 + 1.0j, -3.0], [1.0, 2.0 + 1.0j, 0.5])
    kept = x.truncated(3)
    np.testing.assert_array_equal(kept.rates, [-1.0, -2.0 + 1.0j])
    t = np.linspace(0.0, 5.0, 100)
    assert np.abs(kept(t) - x(t)).max() <= 0.5
    assert x.truncated(2).terms == 2
    np.testing.assert_array_equal(x.truncated(1).rates, [-1.0])
    with pytest.raises(RangeError, match="conjugate pair"):
        ExponentialSum([-2.0 + 1.0j], [1.0]).truncated(1)


def test_one_time_gives_one_value_and_many_keep_their_shape():
    x = ExponentialSum([-1.0], [1.0])
    assert x(0.5).shape == ()
    assert x(np.zeros((2, 3))).shape == (2, 3)


@given(seeds, st.sampled_from([1e4, 1e100, 1e300, 1.7e308]))
@settings(max_examples=20, deadline=None)
def test_a_sum_that_decays_is_zero_at_the_end_of_time(seed, time):
    assert float(random_sum(seed)(time)) == 0.0


def test_a_million_times_need_no_more_memory_than_their_values():
    x = random_sum(5, most=6)
    t = np.linspace(0.0, 5.0, 1_000_001)
    tracemalloc.start()
    values = x(t)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 3 * values.nbytes
    some = t[::99_991]
    one_by_one = [float(x(time)) for time in some]
    np.testing.assert_allclose(values[::99_991], one_by_one, rtol=0, atol=1e-13)


@pytest.mark.parametrize(
    ("rates", "coefficients", "error", "message"),
    [
        ([], [], ShapeError, "m >= 1"),
        ([-1.0], [1.0, 2.0], ShapeError, "1 rates and 2 coefficients"),
        ([math.nan], [1.0], NotFiniteError, "rates must be finite"),
        ([-1.0], [math.inf], NotFiniteError, "coefficients must be finite"),
        ([-1.0 - 1.0j], [1.0], RangeError, "Im >= 0"),
        ([-1.0], [1.0 + 1.0j], RangeError, "must be real"),
        (["x"], [1.0], ShapeError, "list of numbers"),
    ],
)
def test_bad_sums_are_refused_with_the_reason(rates, coefficients, error, message):
    with pytest.raises(error, match=message):
        ExponentialSum(rates, coefficients)


@pytest.mark.parametrize(
    ("time", "error"), [(-0.1, RangeError), (math.nan, NotFiniteError), ("soon", ShapeError)]
)
def test_bad_times_are_refused(time, error):
    with pytest.raises(error, match="times"):
        ExponentialSum([-1.0], [1.0])(time)


def test_a_sum_cannot_be_changed():
    x = ExponentialSum([-1.0], [1.0])
    with pytest.raises(ValueError, match="read-only"):
        x.rates[0] = 1.0
    with pytest.raises(AttributeError):
        x.rates = np.array([1.0])


def test_importing_a_sum_imports_no_scipy():
    program = (
        "import sys, limit_surface_ros.decay.exponential_sum; "
        "sys.exit(any(name.startswith('scipy') for name in sys.modules))"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def test_a_rate_of_zero_is_a_constant():
    x = ExponentialSum([0.0, -1.0, -2.0 + 3.0j], [0.25, 1.0, 0.5 - 0.25j])
    t = np.linspace(0.0, 9.0, 91)
    expected = 0.25 + np.exp(-t) + (0.5 - 0.25j) * np.exp((-2.0 + 3.0j) * t)
    np.testing.assert_allclose(x(t), expected.real, rtol=1e-14)
    assert (x.constant, x.settles, x.terms) == (0.25, True, 4)
    assert not ExponentialSum([0.0, 2.0j], [1.0, 1.0]).settles
    np.testing.assert_allclose(x.without_constant()(t), x(t) - 0.25, atol=1e-15)
    assert float(x(1e308)) == 0.25


def test_levels_above_a_constant_are_reached_and_others_never():
    x = ExponentialSum([0.0, -1.0], [0.25, 1.0])
    assert x.time_to_level(0.5) == pytest.approx(np.log(4.0), rel=1e-12)
    assert x.time_to_level(0.25) == np.inf
    assert x.time_to_level(0.1) == np.inf
    assert x.time_to_level(1.5) == 0.0
    # From below, through zero: |x| was last above 0.5 at ln 2.
    assert ExponentialSum([0.0, -1.0], [0.25, -1.5]).time_to_level(0.5) == pytest.approx(
        np.log(2.0), rel=1e-12
    )


@pytest.mark.parametrize(
    ("rates", "coefficients", "start", "supremum"),
    [
        ([-1.0, -2.0], [1.0, -1.0], 0.0, 0.25),
        ([-1.0, -2.0], [1.0, -1.0], 1.0, np.exp(-1.0) - np.exp(-2.0)),
        ([-1.0], [-2.0], 3.0, 2.0 * np.exp(-3.0)),
        ([0.0, -1.0], [-0.5, 1.0], 2.0, 0.5),
        ([0.0], [0.0], 2.0, 0.0),
    ],
)
def test_suprema_are_proven_to_a_thousandth(rates, coefficients, start, supremum):
    found = ExponentialSum(rates, coefficients).supremum(start)
    assert supremum * (1.0 - 1e-15) <= found <= supremum * 1.0011


@given(st.integers(0, 10_000))
def test_no_value_is_above_the_supremum(seed):
    random = np.random.default_rng(seed)
    real = -(10.0 ** random.uniform(-2.0, 2.0, 4))
    rates = real + 1j * np.where(random.uniform(size=4) < 0.5, 0.0, 10.0 * random.uniform(size=4))
    coefficients = random.normal(size=4) + 1j * random.normal(size=4) * (rates.imag > 0.0)
    x = ExponentialSum(rates, coefficients)
    start = random.uniform(0.0, 2.0)
    times = start + np.append(np.linspace(0.0, 1.0, 5000), np.geomspace(1.0, 1e3, 5000))
    highest = np.abs(x(times)).max()
    found = x.supremum(start)
    assert highest <= found <= 1.0011 * highest + 1e-3 * found


def test_a_supremum_needs_a_sum_that_settles():
    with pytest.raises(UnstableError):
        ExponentialSum([0.1], [1.0]).supremum()
    with pytest.raises(RangeError):
        ExponentialSum([-0.1], [1.0]).supremum(-1.0)


@pytest.mark.parametrize("others", [[], [-0.5], [-1.1 + 2.9e6j]])
def test_levels_of_fast_oscillations_are_found_without_looking_at_each(others):
    x = ExponentialSum([-1.0 + 3e6j, *others], [1.0] + [-0.3] * len(others))
    time = x.time_to_level(0.01)
    near = time + np.linspace(-1e-5, 1e-5, 2001)
    assert np.abs(x(near[:1001])).max() > 0.01 * (1.0 - 1e-4)
    assert np.abs(x(near[1001:])).max() <= 0.01 * (1.0 + 1e-9)
