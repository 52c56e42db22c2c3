# SPDX-License-Identifier: Apache-2.0
"""Load factors of sums of powers are alike by polynomials and by logarithms, and solve H = 1."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from limit_surface_ros.surface.gauges.power_scale import (
    LogarithmicScale,
    PolynomialScale,
    power_scale,
)

# Whole parts of 1/2, 1/3 and 1/4, also ones that come more than once or are left out.
powers = st.integers(1, 4).flatmap(
    lambda n: st.tuples(st.just(n), st.lists(st.integers(1, n), min_size=1, max_size=5))
)


def forms_of(seed, terms):
    """Forms over many orders of magnitude, a tenth of them zero, but never all of a column."""
    rng = np.random.default_rng(seed)
    forms = 10.0 ** rng.uniform(-12, 6, (terms, 200))
    forms[rng.random(forms.shape) < 0.1] = 0.0
    forms[0, ~forms.any(axis=0)] = 1.0
    return forms


@given(case=powers, seed=st.integers(0, 2**32 - 1))
def test_a_polynomial_gives_the_load_factor_that_logarithms_give(case, seed):
    degree, whole = case
    exponents = np.array(whole) / degree
    forms = forms_of(seed, len(whole))
    factors, weights = PolynomialScale(degree, whole).load_factors_and_weights(forms)
    expected, expected_weights = LogarithmicScale(exponents).load_factors_and_weights(forms)
    np.testing.assert_allclose(factors, expected, rtol=1e-12)
    # The terms' parts in the power of the load.
    parts, expected_parts = weights * forms, expected_weights * forms
    np.testing.assert_allclose(
        parts / parts.sum(axis=0), expected_parts / expected_parts.sum(axis=0), atol=1e-11
    )


@given(case=powers, seed=st.integers(0, 2**32 - 1))
def test_a_load_divided_by_its_factor_is_on_the_surface(case, seed):
    degree, whole = case
    exponents = np.array(whole)[:, np.newaxis] / degree
    forms = forms_of(seed, len(whole))
    factors = PolynomialScale(degree, whole).load_factors(forms)
    np.testing.assert_allclose(((forms / factors**2) ** exponents).sum(axis=0), 1.0, rtol=1e-12)


@pytest.mark.parametrize("exponents", [[1.0, 2 / 3, 1 / 3], [0.5, 0.5], [1.0], [0.9, 0.4]])
def test_a_load_that_no_term_sees_has_the_factor_zero(exponents):
    forms = np.zeros((len(exponents), 3))
    forms[:, 1] = 1.0
    factors = power_scale(np.array(exponents)).load_factors(forms)
    np.testing.assert_array_equal(factors == 0.0, [True, False, True])


@pytest.mark.parametrize(
    ("exponents", "kind"),
    [
        ([1.0], PolynomialScale),
        ([1.0, 0.75, 0.5, 0.25], PolynomialScale),
        (np.arange(3, 0, -1) / 3, PolynomialScale),
        ([0.5, 0.5, 1.0], PolynomialScale),
        ([0.9, 0.7], LogarithmicScale),
        (np.arange(5, 0, -1) / 5, LogarithmicScale),
        ([1e-20, 1.0], LogarithmicScale),
    ],
)
def test_whole_parts_of_small_numbers_need_no_logarithms(exponents, kind):
    assert isinstance(power_scale(np.array(exponents)), kind)
