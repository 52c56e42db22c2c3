# SPDX-License-Identifier: Apache-2.0
"""A sample astray at the very end of a record, where it has no neighbours after it."""

import numpy as np
import pytest

from limit_surface_ros.decay.fit import fit_decay
from limit_surface_ros.decay.noise import noise_level
from limit_surface_ros.decay.outliers import holds_strays
from limit_surface_ros.decay.targets import Record

TIMES = np.linspace(0.0, 6.0, 201)
LOAD = 3.0 * np.exp(-TIMES) + 2.0 * np.exp(-4.0 * TIMES)


def strays(values):
    return holds_strays(values, noise_level(Record(TIMES[: len(values)], values)))


@pytest.mark.parametrize("ends", [[20.0], [0.5], [-20.0], [20.0, 20.0], [20.0, -20.0]])
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_last_samples_astray_count_for_nothing(ends, noise):
    values = LOAD + noise * np.random.default_rng(0).normal(size=len(LOAD))
    values[-len(ends) :] = ends
    fit = fit_decay(Record(TIMES, values), "auto", 6.0)
    np.testing.assert_array_equal(fit.outliers, TIMES[-len(ends) :])
    assert np.abs(fit.fit.sum(TIMES) - LOAD).max() <= max(2.0 * noise, 1e-10)
    assert fit.tail.envelope < 0.1


def test_a_load_that_is_gone_with_the_last_sample_is_no_stray():
    values = 8.0 * np.exp(-0.1 * TIMES)
    values[-1] = 0.0
    assert not strays(values)


@pytest.mark.parametrize("samples", np.arange(40, 201, 7))
def test_a_swing_that_is_cut_anywhere_holds_no_strays(samples):
    assert not strays((np.exp(-0.3 * TIMES) * np.cos(5.0 * TIMES + 0.3))[:samples])
