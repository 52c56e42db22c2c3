# SPDX-License-Identifier: Apache-2.0
"""Load factors of sums of powers are alike by square roots and by logarithms, and solve H = 1."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from limit_surface_ros.surface.gauges.power_scale import (
    LogarithmicScale,
    QuadraticScale,
    power_scale,
)

# Exponents of the quadratic equation, also ones that come more than once or are left out.
halves = st.lists(st.sampled_from([0.5, 1.0]), min_size=1, max_size=5)


def forms_of(seed, terms):
    """Forms over many orders of magnitude, a tenth of them zero, but never all of a column."""
    rng = np.random.default_rng(seed)
    forms = 10.0 ** rng.uniform(-12, 6, (terms, 200))
    forms[rng.random(forms.shape) < 0.1] = 0.0
    forms[0, ~forms.any(axis=0)] = 1.0
    return forms


@given(exponents=halves, seed=st.integers(0, 2**32 - 1))
def test_a_quadratic_gives_the_load_factor_that_logarithms_give(exponents, seed):
    exponents = np.array(exponents)
    forms = forms_of(seed, len(exponents))
    factors, weights = QuadraticScale(exponents).load_factors_and_weights(forms)
    expected, expected_weights = LogarithmicScale(exponents).load_factors_and_weights(forms)
    np.testing.assert_allclose(factors, expected, rtol=1e-12)
    # The terms' parts in the power of the load.
    parts, expected_parts = weights * forms, expected_weights * forms
    np.testing.assert_allclose(
        parts / parts.sum(axis=0), expected_parts / expected_parts.sum(axis=0), atol=1e-11
    )


@pytest.mark.parametrize("scale", [QuadraticScale, LogarithmicScale])
@given(exponents=halves, seed=st.integers(0, 2**32 - 1))
def test_a_load_divided_by_its_factor_is_on_the_surface(scale, exponents, seed):
    exponents = np.array(exponents)
    forms = forms_of(seed, len(exponents))
    factors = scale(exponents).load_factors(forms)
    parts = (forms / factors**2) ** exponents[:, np.newaxis]
    np.testing.assert_allclose(parts.sum(axis=0), 1.0, rtol=1e-12)


@pytest.mark.parametrize("exponents", [[1.0, 2 / 3, 1 / 3], [0.5, 0.5], [1.0], [0.9, 0.4]])
def test_a_load_in_the_null_space_of_all_terms_has_the_factor_zero(exponents):
    forms = np.zeros((len(exponents), 3))
    forms[:, 1] = 1.0
    factors = power_scale(np.array(exponents)).load_factors(forms)
    np.testing.assert_array_equal(factors == 0.0, [True, False, True])


@pytest.mark.parametrize(
    ("exponents", "kind"),
    [
        ([1.0], QuadraticScale),
        ([0.5, 0.5, 1.0], QuadraticScale),
        ([1.0, 2 / 3, 1 / 3], LogarithmicScale),
        ([1e-20, 1.0], LogarithmicScale),
    ],
)
def test_ones_and_halves_need_no_logarithms(exponents, kind):
    assert isinstance(power_scale(np.array(exponents)), kind)
