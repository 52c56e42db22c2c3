# SPDX-License-Identifier: Apache-2.0
"""A polynomial is taken only with a proof that it is positive, and called convex only with one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from limit_surface_ros.errors import MatrixError
from limit_surface_ros.surface import sampling
from limit_surface_ros.surface.convexity import is_convex
from limit_surface_ros.surface.gauges.quartic import MONOMIALS, Quartic
from limit_surface_ros.surface.gauges.sum_of_squares import proves_convex, proves_positive
from limit_surface_ros.surface.kinds.polynomial import Polynomial

seeds = st.integers(0, 2**32 - 1)
SPHERE = np.array([1.0, 0, 0, 2, 0, 2, 0, 0, 0, 0, 1, 0, 2, 0, 1])
FLAT = np.array([1.0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1])


def fitted(values):
    """Coefficients of the quartic with values at points."""
    points = sampling.random_directions(60, 0)
    columns = np.prod(points[:, np.newaxis] ** MONOMIALS, axis=2)
    return np.linalg.lstsq(columns, values(points), rcond=None)[0]


def narrow_cone(depth, axis):
    """|f x a|^4 - depth (f.a)^4: negative within an angle of depth^(1/4) about the axis a."""
    axis = axis / np.linalg.norm(axis)
    return fitted(lambda f: (np.cross(f, axis) ** 2).sum(axis=1) ** 2 - depth * (f @ axis) ** 4)


@pytest.mark.parametrize("last", [-1e-3, -1e-8, -1e-12, 0.0])
def test_a_polynomial_that_is_negative_or_zero_on_one_axis_is_refused(last):
    coefficients = np.array([1.0, 0, 0, 2, 0, 2, 0, 0, 0, 0, last, 0, 2, 0, 1])
    with pytest.raises(MatrixError, match=r"must be positive: it is \S+ at the scaled load"):
        Polynomial(coefficients)


@given(seeds, st.floats(-7, -1))
def test_a_negative_cone_is_found_however_narrow(seed, exponent):
    axis = np.random.default_rng(seed).standard_normal(3)
    with pytest.raises(MatrixError, match="must be positive"):
        Polynomial(narrow_cone(10.0**exponent, axis))
    # The same depth above zero is a closed surface with a long spike.
    if exponent > -4.0:
        spike = Polynomial(narrow_cone(-(10.0**exponent), axis))
        assert np.isfinite(spike.wrench_of_twist(axis)).all()


@given(seeds)
def test_what_is_accepted_answers_with_numbers(seed):
    rng = np.random.default_rng(seed)
    try:
        polynomial = Polynomial(SPHERE + rng.uniform(0.0, 2.0) * rng.standard_normal(15))
    except MatrixError:
        return
    loads = sampling.random_directions(2000, seed)
    assert polynomial.value(loads).min() > 0.0
    twists = sampling.random_directions(30, seed)
    wrenches = polynomial.wrench_of_twist(twists)
    np.testing.assert_allclose(polynomial.load_factor(wrenches), 1.0, rtol=1e-9)


@given(seeds)
def test_the_certificate_of_positivity_agrees_with_a_dense_look(seed):
    rng = np.random.default_rng(seed)
    coefficients = SPHERE + rng.uniform(0.0, 3.0) * rng.standard_normal(15)
    quartic = Quartic(coefficients)
    points = sampling.random_directions(4000, seed).T
    lowest = quartic.lowest(points)
    value = quartic.polynomial(lowest[:, np.newaxis])[0]
    assert value <= quartic.polynomial(points).min() + 1e-12
    if abs(value) > 1e-6:
        assert proves_positive(quartic, 1e-9) == (value > 0.0)


@pytest.mark.parametrize(
    ("coefficients", "convex"),
    [
        (SPHERE, True),
        (FLAT, True),
        # x^4 + y^4 + m^4 + c x^2 y^2 is convex for c from 0 to 6.
        (FLAT + 6.0 * np.eye(15)[3], True),
        (FLAT + 6.0001 * np.eye(15)[3], False),
        (FLAT - 1e-3 * np.eye(15)[3], False),
        (FLAT - 1e-6 * np.eye(15)[3], False),
    ],
)
def test_convexity_is_decided_at_its_very_limit(coefficients, convex):
    assert proves_convex(Quartic(coefficients)) == convex
    found = is_convex(Polynomial(coefficients))
    assert found.convex == convex
    if convex:
        assert found.proved
        assert found.reason == "its Hessian is a sum of squares"
    else:
        assert found.dented_share > 0.0


@given(seeds)
def test_sums_of_fourth_powers_are_proved_convex_and_others_have_a_chord(seed):
    rng = np.random.default_rng(seed)
    forms = rng.standard_normal((3, 6))
    polynomial = Polynomial(fitted(lambda f: ((f @ forms) ** 4).sum(axis=1)))
    assert is_convex(polynomial).proved
    bent = Polynomial(SPHERE + rng.uniform(4.5, 9.0) * np.eye(15)[rng.choice([3, 5, 12])])
    convexity = is_convex(bent)
    assert not convexity.convex
    assert convexity.proved
    assert bent.load_factor(convexity.counter_example.mean(axis=0)) > 1.0


def test_a_dent_between_the_directions_that_are_looked_at_is_found():
    # A polynomial whose dent is a sliver: its certificate fails, and a descent finds the place.
    coefficients = FLAT + 6.0000001 * np.eye(15)[3]
    convexity = is_convex(Polynomial(coefficients))
    assert not convexity.convex
    assert convexity.dented_share < 1e-3
