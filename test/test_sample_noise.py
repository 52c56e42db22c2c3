# SPDX-License-Identifier: Apache-2.0
"""The noise of samples is found whatever function they are samples of."""

import numpy as np
import pytest

from limit_surface_ros.errors import DataError, NotFiniteError, ShapeError
from limit_surface_ros.sample_noise import estimate_noise


def uneven_times(count=400):
    return np.cumsum(np.random.default_rng(0).uniform(0.2, 1.8, count)) / count


def test_a_cubic_at_uneven_times_has_none():
    times = uneven_times()
    assert estimate_noise(times, 3.0 - times + 2.0 * times**2 - 5.0 * times**3) < 1e-14


@pytest.mark.parametrize("sigma", [0.01, 0.03, 1.0])
@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e6])
def test_noise_is_found_on_a_wave_in_any_unit_of_time(sigma, scale):
    times = uneven_times(1000)
    noisy = np.sin(9.0 * times) + sigma * np.random.default_rng(1).standard_normal(1000)
    assert estimate_noise(scale * times, noisy) == pytest.approx(sigma, rel=0.1)


def test_outliers_and_kinks_do_not_count_as_noise():
    times = np.linspace(0.0, 1.0, 600)
    values = np.maximum(0.0, 1.0 - 2.0 * times) + 0.01 * np.random.default_rng(2).normal(size=600)
    values[[50, 51, 200, 400]] += 30.0
    assert estimate_noise(times, values) == pytest.approx(0.01, rel=0.1)


def test_rounded_values_have_the_noise_of_rounding():
    times = np.linspace(0.0, 1.0, 2000)
    values = np.round(0.05 * times, 3)
    assert estimate_noise(times, values) == pytest.approx(1e-3 / np.sqrt(12.0), rel=1e-6)
    # A steep start takes each level once, the slow end stays on most.
    decaying = np.round(8.0 * np.exp(-6.0 * times[::7]), 1)
    assert estimate_noise(times[::7], decaying) == pytest.approx(0.1 / np.sqrt(12.0), rel=1e-6)
    zigzag = np.abs(np.arange(2000) % 100 - 50.0)
    assert estimate_noise(times, zigzag) < 1e-12
    held = np.where(times < 0.3, 0.01, 1.0)
    assert estimate_noise(times, held) < 1e-14
    assert estimate_noise(times, np.full(2000, 3.0)) < 1e-14


def test_what_are_no_samples_is_refused():
    assert estimate_noise([0.0, 1.0], [3.0, 1.0]) == 0.0
    with pytest.raises(ShapeError):
        estimate_noise([0.0, 1.0], [1.0])
    with pytest.raises(DataError):
        estimate_noise([0.0, 1.0, 1.0], [1.0, 1.0, 1.0])
    with pytest.raises(NotFiniteError):
        estimate_noise([0.0, 1.0], [1.0, float("nan")])
