# SPDX-License-Identifier: Apache-2.0
"""Loads of feet: statics where it determines them, springs where not, refusal where it tips."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from limit_surface_ros.errors import GeometryError, RangeError, ShapeError
from limit_surface_ros.surface.contact.statics import support_loads

SQUARE = [[-1, -1], [1, -1], [1, 1], [-1, 1]]


def test_three_feet_are_statics():
    found = support_loads([[0.16, 0.0], [-0.08, 0.13], [-0.07, -0.12]], 30.0, [0.01, 0.0])
    assert found.method == "statics"
    assert found.loads.sum() == pytest.approx(30.0)
    matrix = np.array([[1, 1, 1], [0.16, -0.08, -0.07], [0.0, 0.13, -0.12]])
    np.testing.assert_allclose(found.loads, 30.0 * np.linalg.solve(matrix, [1, 0.01, 0.0]))


def test_one_and_two_feet_carry_what_is_above_them():
    assert support_loads([[0.1, 0.2]], 4.0, [0.1, 0.2]).loads.tolist() == [4.0]
    np.testing.assert_allclose(
        support_loads([[0, 0], [1, 1]], 4.0, [0.25, 0.25]).loads, [3.0, 1.0]
    )


def test_four_equal_feet_take_the_loads_of_least_norm():
    found = support_loads(SQUARE, 4.0, [0.5, 0.2])
    assert "least norm" in found.method
    arms = np.array(SQUARE).T
    balance = np.vstack([np.ones(4), arms])
    np.testing.assert_allclose(found.loads, np.linalg.pinv(balance) @ [4.0, 2.0, 0.8])


@given(seed=st.integers(0, 10_000), feet=st.integers(4, 9))
@settings(max_examples=60, deadline=None)
def test_springs_hold_the_least_energy_of_all_loads_in_balance(seed, feet):
    rng = np.random.default_rng(seed)
    points, stiffnesses = rng.normal(size=(feet, 2)), rng.uniform(0.2, 5.0, feet)
    centre = rng.dirichlet(np.full(feet, 0.4)) @ points
    loads = support_loads(points, 1.0, centre, stiffnesses).loads
    assert (loads >= 0.0).all()
    assert loads.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(loads @ points, centre, atol=1e-7)
    energy = np.sum(loads**2 / stiffnesses)
    other = minimize(
        lambda f: np.sum(f**2 / stiffnesses),
        np.full(feet, 1.0 / feet),
        jac=lambda f: 2.0 * f / stiffnesses,
        bounds=[(0.0, None)] * feet,
        constraints={
            "type": "eq",
            "fun": lambda f: np.array([f.sum() - 1.0, *(f @ points - centre)]),
        },
        method="SLSQP",
    )
    if other.success:
        assert energy <= other.fun * (1.0 + 1e-5)


@pytest.mark.parametrize("centre", [[1.01, 0.0], [5.0, 5.0], [-1.0, 1.2]])
def test_a_body_that_would_tip_over_is_refused(centre):
    with pytest.raises(GeometryError, match="would tip over"):
        support_loads(SQUARE, 4.0, centre)
    with pytest.raises(GeometryError, match="would tip over"):
        support_loads(SQUARE[:2], 4.0, centre)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        (([[0, 0, 0]], 1.0, [0, 0]), ShapeError, "points must have shape"),
        ((SQUARE, 1.0, [0, 0, 0]), ShapeError, "centre_of_mass must be two"),
        ((SQUARE, 0.0, [0, 0]), RangeError, "normal_force"),
        ((SQUARE, 1.0, [0, 0], [1, 1, 1]), ShapeError, "stiffnesses must be 4"),
        ((SQUARE, 1.0, [0, 0], [1, 1, 1, 0]), RangeError, "above 0"),
    ],
)
def test_what_is_no_body_on_feet_is_refused(arguments, error, message):
    with pytest.raises(error, match=message):
        support_loads(*arguments)
