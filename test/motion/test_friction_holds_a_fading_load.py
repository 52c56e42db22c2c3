# SPDX-License-Identifier: Apache-2.0
"""Friction holds a body from the last time on at which its load factor is above 1."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from motion_helpers import dissipation_surface, random_inertia

from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.errors import NoOnsetError, NotFiniteError, RangeError, UnstableError
from limit_surface_ros.motion.holding import holds_from
from limit_surface_ros.motion.sliding.load import Load
from limit_surface_ros.motion.sliding.slide import slide

seeds = st.integers(min_value=0, max_value=2**32 - 1)
GRID = 400_001
# Where a maximum of |x| only grazes the level, the last crossing hangs on rounding.
GRAZING = 1e-7


def random_sum(seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 7))
    pair = rng.random(count) < 0.6
    rates = -rng.uniform(0.3, 4.0, count) + 1j * np.where(pair, rng.uniform(0.3, 20.0, count), 0.0)
    coefficients = rng.normal(size=count) + 1j * np.where(pair, rng.normal(size=count), 0.0)
    return ExponentialSum(rates, coefficients)


def brute_force_stop(x, load_factor):
    """Return the last time above rest, by a fine grid over all times that matter and bisection.

    None where the answer hangs on less than `GRAZING`.
    """
    level = abs(float(x(0.0))) / load_factor
    end = math.log(1.0 + np.abs(x.coefficients).sum() / level) / -x.slowest_rate
    times = np.linspace(0.0, end, GRID)
    heights = np.abs(x(times))
    peaks = heights[1:-1][(heights[1:-1] > heights[:-2]) & (heights[1:-1] > heights[2:])]
    if (np.abs(peaks / level - 1.0) < max(GRAZING, 4000.0 * times[1] ** 2)).any():
        return None
    above = np.flatnonzero(heights > level)
    if not len(above):
        return 0.0
    left, right = times[above[-1]], times[above[-1] + 1]
    for _ in range(60):
        middle = 0.5 * (left + right)
        left, right = (middle, right) if abs(float(x(middle))) > level else (left, middle)
    return 0.5 * (left + right)


@given(seeds, st.floats(min_value=1.01, max_value=50.0))
@settings(max_examples=60, deadline=None)
def test_stop_time_is_that_of_brute_force_to_a_microsecond(seed, load_factor):
    x = random_sum(seed)
    assume(abs(float(x(0.0))) > 0.05 * np.abs(x.coefficients).sum())
    expected = brute_force_stop(x, load_factor)
    assume(expected is not None)
    assert holds_from(x, load_factor).time == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("load_factor", [1.5, 4.0, 1e3, 1e9])
def test_one_exponential_stops_after_the_logarithm_of_the_load_factor(load_factor):
    x = ExponentialSum([-0.7], [-3.0])
    stop = holds_from(x, load_factor)
    assert stop.time == pytest.approx(math.log(load_factor) / 0.7, abs=1e-12)
    assert stop.slides


@pytest.mark.parametrize("load_factor", [0.0, 1e-320, 0.3, 1.0 - 1e-12])
def test_a_push_below_the_limit_never_moves_the_body(load_factor):
    stop = holds_from(ExponentialSum([-1.0], [2.0]), load_factor)
    assert (stop.time, stop.earliest, stop.slides) == (0.0, 0.0, False)


def test_a_response_that_rises_later_moves_a_body_that_the_onset_left_at_rest():
    rising = ExponentialSum([-1.0, -4.0], [3.0, -2.0])
    stop = holds_from(rising, 0.9)
    assert not stop.slides
    assert stop.time > 0.5


def test_a_reversed_load_moves_the_body_back():
    x = ExponentialSum([-0.5 + 5.0j], [1.0])
    stop = holds_from(x, 1.5)
    # The first half swing, at pi / 5, is at exp(-0.31) = 0.73 > 1 / 1.5 in the other direction.
    assert stop.time > math.pi / 5.0
    assert float(x(stop.time)) == pytest.approx(-1.0 / 1.5, abs=1e-9)


@given(seeds, st.floats(min_value=1.2, max_value=20.0), st.floats(min_value=-1.0, max_value=1.0))
@settings(max_examples=30, deadline=None)
def test_any_response_within_the_error_bound_stops_between_earliest_and_latest(
    seed, factor, where
):
    x = random_sum(seed)
    assume(abs(float(x(0.0))) > 0.05 * np.abs(x.coefficients).sum())
    error = 0.01 * abs(float(x(0.0)))
    stop = holds_from(x, factor, error)
    level = abs(float(x(0.0))) / factor
    times = np.linspace(0.0, stop.time + 5.0, 20001)
    response = x(times) + where * error * np.cos(3.0 * times)
    above = times[np.abs(response) > level]
    last = above[-1] if len(above) else 0.0
    step = times[1]
    assert stop.earliest - step <= last <= stop.latest + step


def test_an_error_as_large_as_the_level_leaves_the_end_open():
    assert holds_from(ExponentialSum([-1.0], [1.0]), 4.0, 0.25).latest == math.inf


@pytest.mark.parametrize("coefficients", [[1.0, -1.0], [1.0, -1.0 + 1e-14]])
def test_a_response_that_starts_at_zero_cannot_be_scaled_to_an_onset(coefficients):
    with pytest.raises(NoOnsetError, match="starts at"):
        holds_from(ExponentialSum([-1.0, -2.0], coefficients), 2.0)


@pytest.mark.parametrize(
    ("load_factor", "max_error", "error"),
    [
        (-1.0, 0.0, RangeError),
        (2.0, -0.1, RangeError),
        (math.nan, 0.0, NotFiniteError),
        (2.0, math.inf, NotFiniteError),
    ],
)
def test_bad_numbers_are_refused(load_factor, max_error, error):
    with pytest.raises(error):
        holds_from(ExponentialSum([-1.0], [1.0]), load_factor, max_error)


def test_a_load_that_does_not_die_away_never_lets_the_body_rest():
    assert holds_from(ExponentialSum([0.0], [1.0]), 2.0).time == math.inf
    with pytest.raises(UnstableError, match="does not decay"):
        holds_from(ExponentialSum([0.1], [1.0]), 2.0)


@pytest.mark.parametrize("seed", range(20))
def test_no_body_with_mass_rests_for_good_before_friction_holds_it(seed):
    rng = np.random.default_rng(seed)
    surface, inertia = dissipation_surface(rng), random_inertia(rng, 0.3, 3.0, 0.02)
    x = ExponentialSum([-0.7, -0.5 + 6.0j], [0.4, 0.6 * rng.uniform(0.0, 1.0)])
    wrench = rng.normal(size=3) * [1.0, 1.0, 0.05]
    wrench *= rng.uniform(1.1, 6.0) / float(surface.load_factor(wrench))
    held = holds_from(x, float(surface.load_factor(wrench)))
    stop = slide(surface, inertia, (0.0, 0.0, 0.0), Load(wrench, x))
    assert held.time <= stop.time * (1.0 + 1e-9)
