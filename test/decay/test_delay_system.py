# SPDX-License-Identifier: Apache-2.0
"""Delay systems evaluate their characteristic function without a singularity, however given."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from limit_surface_ros.decay import examples
from limit_surface_ros.decay.delay.construction import delay_system
from limit_surface_ros.decay.delay.pieces import PiecewisePolynomial
from limit_surface_ros.decay.delay.roots import first_roots
from limit_surface_ros.decay.delay.system import (
    DelaySystem,
    from_quasi_polynomial,
    quasi_polynomial,
)
from limit_surface_ros.decay.neutral import neutral_system
from limit_surface_ros.errors import DataError, RangeError, ShapeError

seeds = st.integers(min_value=0, max_value=2**32 - 1)


def random_system(seed):
    rng = np.random.default_rng(seed)
    edges = np.concatenate(([0.0], np.cumsum(rng.uniform(0.3, 1.5, 3))))
    pieces = PiecewisePolynomial(edges, rng.normal(size=(3, 6)))
    return DelaySystem(edges[:2], rng.normal(size=2), pieces)


@given(seeds)
@settings(max_examples=10, deadline=None)
def test_characteristic_function_agrees_with_adaptive_quadrature(seed):
    system = random_system(seed)
    rates = np.array([0.0, 1e-8, 0.3 + 2.0j, -2.0 + 0.5j, -1.5 + 30.0j])
    values = system.characteristic(rates)
    for rate, value in zip(rates, values, strict=True):
        integral = 0.0
        for left, right in zip(system.pieces.edges[:-1], system.pieces.edges[1:], strict=True):
            middle, half = 0.5 * (left + right), 0.5 * (right - left)
            for part in (1.0, 1.0j):
                real, _ = quad(
                    lambda u, m=middle, h=half, p=part, r=rate: (
                        (system.pieces(m + h * u) * np.exp(-r * (m + h * u)) * h / p).real
                    ),
                    -1.0,
                    1.0,
                    epsabs=1e-12,
                    limit=200,
                )
                integral += part * real
        discrete = system.strengths @ np.exp(-rate * system.delays)
        assert value == pytest.approx(rate - discrete - integral, rel=1e-9, abs=1e-9)


@given(seeds)
@settings(max_examples=20, deadline=None)
def test_derivative_of_the_characteristic_function_agrees_with_differences(seed):
    system = random_system(seed)
    rates = np.array([0.0, 0.4 + 1.0j, -1.0 + 7.0j])
    step = 1e-6
    slope = system.characteristic_and_derivative(rates)[1]
    ahead, behind = system.characteristic(rates + step), system.characteristic(rates - step)
    np.testing.assert_allclose(slope, (ahead - behind) / (2.0 * step), rtol=1e-6, atol=1e-6)


def test_printed_polynomials_are_read_in_powers_of_t():
    pieces = PiecewisePolynomial.from_monomials(
        [0.0, 1.0, 3.0], [[1.0, -2.0, 0.5], [0.0, 1.0, 4.0]]
    )
    np.testing.assert_allclose(pieces([0.5, 2.5]), [0.25 - 1.0 + 0.5, 6.5], rtol=1e-14)
    np.testing.assert_array_equal(pieces([3.5]), [0.0])


def test_a_printed_characteristic_equation_gives_back_its_system():
    rng = np.random.default_rng(3)
    degree, cells, width = 3, 4, 0.5
    monomials = rng.normal(size=(cells, degree + 1))
    pieces = PiecewisePolynomial.from_monomials(width * np.arange(cells + 1), monomials)
    polynomials = [np.polynomial.Polynomial(row[::-1]) for row in monomials]
    rows = np.zeros((cells + 1, degree + 2))
    rows[:2, 0] = [-1.0, 0.7]
    for k in range(cells + 1):
        for m in range(degree + 1):
            after = polynomials[k].deriv(m)(k * width) if k < cells else 0.0
            before = polynomials[k - 1].deriv(m)(k * width) if k > 0 else 0.0
            rows[k, 1 + m] = after - before
    system = from_quasi_polynomial(rows, width)
    np.testing.assert_allclose(system.pieces.coefficients, pieces.coefficients, atol=1e-12)
    np.testing.assert_array_equal(system.delays, [0.0, width])
    np.testing.assert_array_equal(system.strengths, [-1.0, 0.7])


def test_a_printed_equation_whose_pieces_do_not_end_is_refused():
    with pytest.raises(DataError, match="do not end"):
        from_quasi_polynomial([[0.0, 1.0, 2.0], [0.0, -1.0, 0.0]])


@given(seeds)
@settings(max_examples=20, deadline=None)
def test_the_right_side_never_exceeds_the_bound_on_roots(seed):
    system = random_system(seed)
    rng = np.random.default_rng(seed)
    rates = rng.uniform(-1.0, 3.0, 50) + 1j * rng.uniform(-40.0, 40.0, 50)
    feedback = rates - system.characteristic(rates)
    assert np.abs(feedback).max() <= system.root_bound(-1.0) * (1.0 + 1e-12)


def test_samples_on_a_jump_do_not_spoil_the_pieces():
    t = np.linspace(0.0, 2.0, 401)
    y = np.where(t < 1.0, t**2, 5.0 - t)
    y[200] = 1e6
    pieces = PiecewisePolynomial.from_samples(t, y, [0.0, 1.0, 2.0], 2)
    np.testing.assert_allclose(pieces([0.25, 1.5]), [0.0625, 3.5], rtol=1e-12)
    assert pieces.residual < 1e-12


@pytest.mark.parametrize(
    ("build", "error", "message"),
    [
        (lambda: DelaySystem([1.0], [1.0, 2.0]), ShapeError, "one shape"),
        (lambda: DelaySystem([-1.0], [1.0]), RangeError, "at least 0"),
        (lambda: DelaySystem([1.0], [0.0]), RangeError, "needs a feedback"),
        (lambda: PiecewisePolynomial([1.0, 0.5], [[1.0]]), RangeError, "increase"),
        (lambda: PiecewisePolynomial([0.0, 1.0], [[1.0], [2.0]]), ShapeError, "1 rows"),
        (
            lambda: PiecewisePolynomial.from_samples([0.1, 0.2], [1.0, 1.0], [0.0, 1.0], 5),
            DataError,
            "degree 5 needs at least 6",
        ),
    ],
)
def test_bad_systems_are_refused_with_the_reason(build, error, message):
    with pytest.raises(error, match=message):
        build()


def test_the_printed_equation_and_polynomials_come_back():
    delays, rows = quasi_polynomial(examples.thesis_system())
    np.testing.assert_allclose(delays, np.arange(7.0))
    np.testing.assert_allclose(rows, examples.THESIS_EQUATION, atol=1e-9)
    monomials = examples.printed_system().pieces.monomials()
    np.testing.assert_allclose(monomials, examples.THESIS_POLYNOMIALS, atol=1e-9)


def test_the_equation_has_the_roots_of_the_system():
    system = delay_system(examples.four_impulses(), 3.0, degree=3)
    delays, rows = quasi_polynomial(system)
    for root in first_roots(system, 4):
        powers = root ** np.arange(rows.shape[1] - 1.0, -1.0, -1.0)
        right = (np.exp(-delays * root) * (rows @ powers)).sum()
        assert abs(right / root ** rows.shape[1] - 1.0) < 1e-6


def test_a_neutral_system_is_not_printed_as_what_it_is_not():
    with pytest.raises(DataError, match="neutral"):
        quasi_polynomial(neutral_system(5, 1.0, 1.0))
