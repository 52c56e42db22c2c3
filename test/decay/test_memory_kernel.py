# SPDX-License-Identifier: Apache-2.0
"""The memory kernel is found to the last digit, its impulses too, and bad records are refused."""

from decimal import Decimal, localcontext

import numpy as np
import pytest

from limit_surface_ros.decay import examples
from limit_surface_ros.decay.delay.closed_kernel import ClosedKernel
from limit_surface_ros.decay.delay.construction import delay_system, system_of_kernel
from limit_surface_ros.decay.delay.impulses import find_impulses
from limit_surface_ros.decay.delay.kernel import divide_series, memory_kernel
from limit_surface_ros.decay.noise import noise_level, smoothed
from limit_surface_ros.decay.targets import Analytic, PiecewiseLinear, uniform_times
from limit_surface_ros.errors import DataError, NotFiniteError, RangeError, ShapeError


def kernel_of(response, samples, end=6.0):
    times = np.linspace(0.0, end, samples)
    return memory_kernel(times, response(times))


def quotient_in_40_digits(numerator, denominator):
    """Forward substitution on the samples as they are, in decimal arithmetic."""
    support = int(np.flatnonzero(denominator)[-1]) + 1
    with localcontext() as context:
        context.prec = 40
        x = [Decimal(float(value)) for value in denominator[:support]]
        quotient = []
        for n, value in enumerate(numerator):
            rest = Decimal(float(value))
            for k in range(1, min(n, support - 1) + 1):
                rest -= x[k] * quotient[n - k]
            quotient.append(rest / x[0])
        return np.array([float(value) for value in quotient])


def test_two_thousand_samples_agree_with_forty_digits_also_in_the_tail():
    times = np.linspace(0.0, 6.0, 2000)
    x = examples.hockey_stick()(times)
    kernel = memory_kernel(times, x)
    exact = quotient_in_40_digits(np.diff(x) / times[1], x[:-1]) / kernel.step
    errors = np.abs(kernel.values - exact)
    assert errors.max() <= 1e-12
    assert errors[times[:-1] > 5.0].max() <= 1e-15


def test_long_records_agree_with_forward_substitution():
    count = 6000
    times = np.linspace(0.0, 6.0, count)
    x = np.exp(-times) * (1.0 + 0.1 * np.cos(3.0 * times))
    xdot = np.diff(x, append=x[-1])
    short = divide_series(xdot[:3000], x[:3000])
    np.testing.assert_allclose(divide_series(xdot, x)[:3000], short, rtol=0, atol=1e-12)


def test_closed_and_sampled_kernel_agree_more_the_finer_the_samples():
    response = examples.hockey_stick()
    exact = ClosedKernel(response, 6.0)
    errors = []
    for samples in (1201, 2401, 4801):
        kernel = kernel_of(response, samples)
        clear = np.abs(kernel.times[:, np.newaxis] - exact.edges).min(axis=1) > 0.02
        errors.append(np.abs(exact(kernel.times) - kernel.values)[clear].max())
    assert errors[0] < 0.03
    assert errors[1] / errors[0] == pytest.approx(0.5, abs=0.03)
    assert errors[2] / errors[1] == pytest.approx(0.5, abs=0.03)


def test_the_closed_kernel_of_the_hockey_stick_is_minus_exp_on_the_first_cell():
    kernel = ClosedKernel(examples.hockey_stick(), 3.0)
    t = np.linspace(0.0, 0.999, 50)
    np.testing.assert_allclose(kernel(t), -np.exp(t), rtol=1e-13)
    np.testing.assert_array_equal(kernel.impulses.strengths, [-1.0, 1.0])
    np.testing.assert_array_equal(kernel.edges, [0.0, 1.0, 2.0, 3.0])


@pytest.mark.parametrize("samples", [1000, 1333, 2000, 2401])
@pytest.mark.parametrize(
    ("response", "delays", "strengths"),
    [
        (examples.hockey_stick(), [0.0, 1.0], [-1.0, 1.0]),
        (examples.four_impulses(), [0.0, 0.5, 1.0, 1.5], [-1.0, 0.4, 0.2, 0.4]),
        (examples.three_impulses(), [0.0, 1.0, 1.5], [-0.2, -1.4, 1.6]),
    ],
)
def test_impulses_are_found_to_a_thousandth(samples, response, delays, strengths):
    found = find_impulses(kernel_of(response, samples))
    np.testing.assert_allclose(found.delays, delays, atol=1e-3)
    np.testing.assert_allclose(found.strengths, strengths, rtol=1e-3)


def test_a_smooth_response_has_the_impulse_of_its_first_slope_and_no_other():
    found = find_impulses(kernel_of(Analytic(lambda t: 1.0 / (1.0 + t) ** 2), 2001))
    np.testing.assert_allclose(found.delays, [0.0])
    np.testing.assert_allclose(found.strengths, [-2.0], rtol=0.01)
    assert len(find_impulses(kernel_of(examples.gaussian(), 2001)).delays) == 0


def test_a_system_from_samples_is_that_of_the_closed_form():
    response = examples.hockey_stick()
    kernel = kernel_of(response, 2001)
    sampled = system_of_kernel(kernel, find_impulses(kernel), degree=5)
    assert sampled.pieces.residual < 1e-4
    exact = delay_system(response, 6.0)
    rates = np.array([0.0, 0.5 + 3.0j, -1.0 + 5.0j])
    np.testing.assert_allclose(
        sampled.characteristic(rates), exact.characteristic(rates), rtol=0, atol=0.05
    )


def test_an_exact_kernel_leaves_the_characteristic_function_x0_over_transform():
    # h(s) = x(0) / X(s) but for what the cut at T leaves out, which is small where Re s > 0.
    system = delay_system(examples.hockey_stick(), 8.0)
    s = np.array([0.5, 1.0 + 2.0j, 0.2 + 7.0j])
    transform = (s - 1.0 + np.exp(-s)) / s**2
    np.testing.assert_allclose(system.characteristic(s) * transform, 1.0, atol=1e-5)


def test_the_printed_polynomials_miss_the_kernel_by_what_their_rounding_costs():
    kernel = ClosedKernel(examples.hockey_stick(), 6.0)
    printed = examples.printed_system().pieces
    worst = [
        np.abs(printed(t) - kernel(t)).max()
        for t in (cell + np.linspace(0.01, 0.99, 99) for cell in range(6))
    ]
    np.testing.assert_array_less(worst, [0.013, 0.013, 0.013, 0.013, 0.2, 0.8])
    assert worst[5] > 0.5


def test_noise_is_told_from_shape():
    times = np.sort(np.random.default_rng(0).uniform(0.0, 6.0, 600))
    times[0] = 0.0
    clean = examples.hockey_stick()(times)
    noise = 0.01 * np.random.default_rng(1).normal(size=600)
    assert noise_level(PiecewiseLinear(times, clean)) < 1e-12
    assert noise_level(PiecewiseLinear(times, clean + noise)) == pytest.approx(0.01, rel=0.15)
    quiet = smoothed(PiecewiseLinear(times, clean + noise), 6.0)
    assert len(quiet.knots) <= 37
    assert np.abs(quiet(times) - clean).max() < 0.06


def test_kinks_can_be_put_on_the_grid():
    times = uniform_times(6.0, 2000, [1.0, 1.5])
    assert np.abs(times - 1.0).min() < 1e-12
    assert np.abs(times - 1.5).min() < 1e-12
    assert 2000 <= len(times) <= 8000
    with pytest.raises(DataError, match="no uniform grid"):
        uniform_times(6.0, 100, [np.sqrt(2.0), np.e, np.pi])


UNIFORM = np.linspace(0.0, 1.0, 11)


@pytest.mark.parametrize(
    ("times", "values", "error", "message"),
    [
        (UNIFORM, 1.0 - UNIFORM[::-1], DataError, "x\\(0\\) must not be zero"),
        ([0.0], [1.0], ShapeError, "at least 2 samples"),
        (UNIFORM**2, 1.0 - UNIFORM, DataError, "uniform from 0"),
        (UNIFORM + 1.0, 1.0 - UNIFORM, DataError, "uniform from 0"),
        (UNIFORM, [1.0] * 5, ShapeError, "one shape"),
        (UNIFORM, [1.0] * 10 + [np.nan], NotFiniteError, "index \\(10,\\)"),
    ],
)
def test_bad_records_are_refused_with_the_reason(times, values, error, message):
    with pytest.raises(error, match=message):
        memory_kernel(times, values)


def test_a_breakpoint_off_the_grid_is_refused():
    with pytest.raises(DataError, match=r"0\.55 s is not on the grid"):
        memory_kernel(UNIFORM, 1.0 - 0.5 * UNIFORM, breakpoints=[0.55])


@pytest.mark.parametrize(
    ("build", "error", "message"),
    [
        (lambda: PiecewiseLinear([0.0, 1.0], [0.0, 1.0]), DataError, "zero"),
        (lambda: PiecewiseLinear([0.5, 1.0], [1.0, 0.0]), DataError, "start at 0"),
        (lambda: PiecewiseLinear([0.0, 1.0, 1.0], [1.0, 0.5, 0.0]), DataError, "index 2"),
        (lambda: PiecewiseLinear([0.0], [1.0]), ShapeError, "n >= 2"),
        (lambda: Analytic(lambda t: 0.0 * t), DataError, "zero"),
        (lambda: Analytic(np.cos, [-1.0]), RangeError, "above 0"),
        (lambda: examples.example("f9"), RangeError, "f1, f2"),
    ],
)
def test_bad_responses_are_refused_with_the_reason(build, error, message):
    with pytest.raises(error, match=message):
        build()
