# SPDX-License-Identifier: Apache-2.0
"""A sample astray at the very start of a record, and steep starts, which are none."""

import numpy as np
import pytest
from scipy.special import erfcx

from limit_surface_ros.decay.fit import fit_decay
from limit_surface_ros.decay.outliers import neighbour_weights, starts_alone, stray_start
from limit_surface_ros.decay.targets import Record
from limit_surface_ros.tools.common.decay_input import of_record
from limit_surface_ros.tools.common.decay_report import doubts, report

TIMES = np.linspace(0.0, 6.0, 201)
LOAD = 3.0 * np.exp(-TIMES) + 2.0 * np.exp(-4.0 * TIMES)


@pytest.mark.parametrize(
    "starts", [[100.0], [-100.0], [5.0, 100.0], [5.0, -100.0], [100.0, -100.0]]
)
@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_first_samples_astray_count_for_nothing(starts, noise, capsys):
    values = LOAD + noise * np.random.default_rng(0).normal(size=len(LOAD))
    values[: len(starts)] = starts
    record = Record(TIMES, values)
    result = fit_decay(record, "auto", 6.0)
    astray = [time for time, start in zip(TIMES, starts, strict=False) if abs(start) == 100.0]
    np.testing.assert_array_equal(result.outliers, astray)
    assert np.abs(result.fit.sum(TIMES) - LOAD).max() <= max(3.0 * noise, 1e-10)
    assert result.fit.max_error <= max(5.0 * noise, 1e-10)
    given = of_record("record", record, None)
    assert doubts(result, given) == []
    report(result, given)
    assert "left out, at " + ", ".join(f"{time:g}" for time in astray) in capsys.readouterr().out


def test_an_offset_hides_no_stray_first_sample():
    values = 40.0 + LOAD
    values[0] = 140.0
    given = of_record("record", Record(TIMES, values), None, offset="auto")
    assert given.offset == pytest.approx(40.0, abs=0.1)
    result = fit_decay(given.target, 2, 6.0)
    np.testing.assert_array_equal(result.outliers, [0.0])


@pytest.mark.parametrize("samples", [20, 60, 201, 600])
@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_steep_starts_are_not_astray(samples, noise):
    index = np.arange(samples)
    times = index / (samples - 1.0)
    slow = np.exp(-3.0 * times)
    pulse = np.where(index < 3, 20.0 * (1.0 - index / 3.0), 0.0)
    powers = [erfcx(np.sqrt(rate * times)) for rate in (1.0, 30.0, 1000.0)]
    fast = [slow + size * 0.15**index for size in (20.0, -20.0, 3.0)]
    for clean in (*powers, np.exp(-4.0 * times**0.3), *fast, slow + pulse):
        values = clean + noise * np.random.default_rng(1).normal(size=samples)
        assert not stray_start(times, values, noise).any()


@pytest.mark.parametrize("samples", [20, 30])
def test_steep_starts_of_short_records_are_not_astray_where_noise_is_not_known(samples):
    index = np.arange(samples)
    times = index / (samples - 1.0)
    powers = [erfcx(np.sqrt(rate * times)) for rate in (1.0, 30.0, 1000.0)]
    fast = [np.exp(-3.0 * times) + size * 0.15**index for size in (20.0, -20.0, 3.0)]
    for seed in range(40):
        noise = 0.02 * np.random.default_rng(seed).normal(size=samples)
        for clean in (*powers, *fast):
            assert not stray_start(times, clean + noise, 0.0).any()


def test_a_long_first_step_may_have_hidden_anything():
    times = np.append(0.0, 0.03 * np.arange(20, 220))
    values = 3.0 * np.exp(-times) + 100.0 * np.exp(-20.0 * times)
    assert not stray_start(times, values, 0.0).any()


@pytest.mark.parametrize(("share", "astray"), [(-12.0, [0]), (12.0, []), (20.0, [0])])
def test_a_power_law_explains_a_first_sample_of_its_sign_and_size_alone(share, astray):
    values = erfcx(np.sqrt(1000.0 * TIMES))
    values[0] = share * values[1]
    np.testing.assert_array_equal(np.flatnonzero(stray_start(TIMES, values, 0.0)), astray)


def test_a_misfit_of_a_steep_start_is_no_outlier():
    residuals = 0.01 * np.random.default_rng(0).normal(size=40)
    residuals[:3] += [5.0, 2.0, 1.0]
    residuals[20] += 1.0
    weights = neighbour_weights(residuals, 0.01)
    np.testing.assert_array_equal(weights[:3], 1.0)
    assert weights[20] == 0.0


def test_a_first_sample_that_could_be_either_is_kept_with_a_warning():
    values = LOAD.copy()
    values[0] = 2.0 * LOAD[0]
    record = Record(TIMES, values)
    result = fit_decay(record, 3, 6.0)
    assert len(result.outliers) == 0
    assert any(
        "no other bears it out" in doubt for doubt in doubts(result, of_record("", record, None))
    )
    assert not starts_alone(TIMES, LOAD, 0.0)
