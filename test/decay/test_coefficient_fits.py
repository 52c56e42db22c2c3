# SPDX-License-Identifier: Apache-2.0
"""Coefficients are optimal in the norm asked for, and a dual bound proves it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from limit_surface_ros.decay import examples
from limit_surface_ros.decay.basis import real_basis
from limit_surface_ros.decay.coefficients import fit_coefficients, fit_response
from limit_surface_ros.decay.delay.construction import system_of_kernel
from limit_surface_ros.decay.delay.impulses import find_impulses
from limit_surface_ros.decay.delay.kernel import memory_kernel
from limit_surface_ros.decay.delay.roots import first_roots
from limit_surface_ros.decay.grids import largest_error
from limit_surface_ros.decay.minimax import solve_minimax
from limit_surface_ros.errors import RangeError, ShapeError

seeds = st.integers(min_value=0, max_value=2**32 - 1)
TIMES = np.linspace(0.0, 6.0, 2000)
HOCKEY = examples.hockey_stick()(TIMES)


@pytest.fixture(scope="module")
def thesis_roots():
    return first_roots(examples.thesis_system(), 62)


@pytest.fixture(scope="module")
def accurate_roots():
    kernel = memory_kernel(TIMES, HOCKEY)
    return first_roots(system_of_kernel(kernel, find_impulses(kernel), degree=5), 61)


@pytest.mark.parametrize(
    ("count", "terms", "error"), [(5, 9, 2.8196e-2), (8, 15, 1.6145e-2), (62, 123, 2.0123e-3)]
)
def test_the_figures_of_the_thesis_are_met_to_the_digit(thesis_roots, count, terms, error):
    fit = fit_coefficients(thesis_roots[:count], TIMES, HOCKEY)
    assert fit.sum.terms == terms
    assert fit.value == pytest.approx(error, rel=3e-5)
    assert fit.value - fit.lower_bound <= 1e-6 * fit.value
    assert np.abs(fit.sum(TIMES) - HOCKEY).max() == pytest.approx(fit.max_error, rel=1e-9)


@pytest.mark.parametrize(("count", "error"), [(4, 2.526e-2), (7, 1.510e-2), (61, 1.953e-3)])
def test_the_accurate_kernel_does_better_with_one_term_less(accurate_roots, count, error):
    fit = fit_coefficients(accurate_roots[:count], TIMES, HOCKEY)
    assert fit.value == pytest.approx(error, rel=5e-4)


@given(seeds)
@settings(max_examples=25, deadline=None)
def test_minimax_agrees_with_a_linear_program_and_brackets_it(seed):
    rng = np.random.default_rng(seed)
    count, columns = int(rng.integers(5, 60)), int(rng.integers(1, 5))
    matrix, target = rng.normal(size=(count, columns)), rng.normal(size=count)
    ones = np.ones((count, 1))
    program = linprog(
        np.append(np.zeros(columns), 1.0),
        A_ub=np.block([[matrix, -ones], [-matrix, -ones]]),
        b_ub=np.append(target, -target),
        bounds=[(None, None)] * (columns + 1),
    )
    best = solve_minimax(matrix, target)
    assert best.value == pytest.approx(program.fun, rel=1e-6)
    assert best.lower_bound <= program.fun * (1.0 + 1e-9)
    assert best.value - best.lower_bound <= 1e-6 * best.value
    assert np.abs(matrix @ best.weights - target).max() == pytest.approx(best.value, rel=1e-9)


def test_minimax_survives_dependent_columns_and_an_exact_fit():
    rng = np.random.default_rng(0)
    matrix = rng.normal(size=(40, 3))
    target = rng.normal(size=40)
    doubled = np.hstack([matrix, matrix[:, :2]])
    best = solve_minimax(matrix, target).value
    assert solve_minimax(doubled, target).value == pytest.approx(best, rel=1e-7)
    assert solve_minimax(matrix, matrix @ [1.0, 2.0, 3.0]).value < 1e-12
    assert solve_minimax(matrix, np.zeros(40)).value == 0.0


@given(seeds)
@settings(max_examples=15, deadline=None)
def test_no_nearby_coefficients_are_better_in_the_norm_asked_for(seed):
    rng = np.random.default_rng(seed)
    rates = np.array([-1.0, -0.5 + 2.0j, -1.5 + 4.0j])
    t = np.linspace(0.0, 4.0, 80)
    x = np.exp(-t) + 0.1 * rng.normal(size=80)
    w = rng.uniform(0.5, 2.0, 80)
    basis = real_basis(rates, t)
    norms = {
        "inf": lambda e: np.abs(e).max(),
        "2": np.linalg.norm,
        "1": lambda e: np.abs(e).sum(),
    }
    for name, norm in norms.items():
        fit = fit_coefficients(rates, t, x, name, w)
        c = fit.sum.weights
        assert norm(w * (basis @ c - x)) == pytest.approx(fit.value, rel=1e-6)
        assert fit.lower_bound <= fit.value * (1.0 + 1e-9)
        for _ in range(10):
            other = c + 10.0 ** rng.uniform(-4, 0) * rng.normal(size=len(c))
            assert norm(w * (basis @ other - x)) >= fit.value * (1.0 - 1e-6)


def test_a_criterion_of_the_analysts_own_is_minimised():
    rates = np.array([-1.0, -0.5 + 2.0j])
    t = np.linspace(0.0, 4.0, 80)
    x = 1.0 / (1.0 + t)

    def sum_of_squares(errors):
        return float(errors @ errors)

    ours = fit_coefficients(rates, t, x, sum_of_squares)
    squares = fit_coefficients(rates, t, x, "2")
    assert ours.norm == "sum_of_squares"
    np.testing.assert_allclose(ours.sum.weights, squares.sum.weights, rtol=1e-4)
    fourth = fit_coefficients(rates, t, x, lambda errors: float((errors**4).sum()) * 1e6)
    assert squares.max_error > fourth.max_error > fit_coefficients(rates, t, x).max_error


def test_more_terms_never_fit_worse(thesis_roots):
    errors = [
        fit_coefficients(thesis_roots[:count], TIMES[::4], HOCKEY[::4]).value
        for count in (2, 4, 8, 16)
    ]
    assert (np.diff(errors) < 0.0).all()


def test_the_error_reported_holds_between_the_points_of_the_grid(thesis_roots):
    response = examples.hockey_stick()
    fit = fit_response(thesis_roots[:20], response, 6.0)
    dense = np.append(np.linspace(0.0, 6.0, 100_001), 1.0)
    true = np.abs(fit.sum(dense) - response(dense)).max()
    assert true == pytest.approx(fit.max_error, rel=0.002)
    assert fit.lower_bound <= true
    assert true <= fit.lower_bound * 1.01


def test_the_error_beyond_the_interval_is_measured_too(thesis_roots):
    response = examples.hockey_stick()
    fit = fit_response(thesis_roots[:5], response, 6.0)
    assert largest_error(fit.sum, response, 6.0, 19.0) == pytest.approx(2.2e-2, rel=0.05)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        (([-1.0], [0.0, 1.0], [1.0]), ShapeError, "one shape"),
        (([-1.0], [-1.0, 1.0], [1.0, 1.0]), RangeError, "at least 0"),
        (([-1.0], [0.0, 1.0], [1.0, 1.0], "max"), RangeError, "one of inf, 2, 1"),
        (([-1.0], [0.0, 1.0], [1.0, 1.0], "2", [1.0, 0.0]), RangeError, "weights"),
        (([-1.0], [0.0, 1.0], [1.0, 1.0], lambda e: np.nan), RangeError, "finite number"),
    ],
)
def test_bad_fits_are_refused_with_the_reason(arguments, error, message):
    with pytest.raises(error, match=message):
        fit_coefficients(*arguments)
