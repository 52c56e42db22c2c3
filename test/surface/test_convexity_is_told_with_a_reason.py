# SPDX-License-Identifier: Apache-2.0
"""Convexity: theorems where they hold, counter-examples that can be checked, one warning."""

import warnings

import numpy as np
import pytest

from limit_surface_ros.surface.convexity import NotConvexWarning, is_convex, warn_unless_convex
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.polynomial import Polynomial
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling

SPHERE = [1, 0, 0, 2, 0, 2, 0, 0, 0, 0, 1, 0, 2, 0, 1]
# x^4 + y^4 + m^4 + 12 x^2 y^2: a cross in the plane of the two forces.
CROSS = [1, 0, 0, 12, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1]
FLAT_AND_STEEP = [np.diag([1.0, 1.0, 1.0]), np.diag([10.0, 0.01, 10.0])]


@pytest.mark.parametrize(
    "surface",
    [
        PowerSum(FLAT_AND_STEEP, [1.0, 0.5]),
        PowerSum([np.eye(3)], [0.2]),
        Dissipation([np.eye(3)]),
        PointContacts([[0, 0], [1, 0]], [1, 1]),
    ],
    ids=lambda surface: surface.kind,
)
def test_what_is_convex_by_construction_is_proved(surface):
    convexity = is_convex(surface)
    assert convexity.convex
    assert convexity.proved
    assert convexity.dented_share == 0.0
    assert convexity.counter_example is None


@pytest.mark.parametrize(
    "surface",
    [PowerSum(FLAT_AND_STEEP, [1.0, 0.2], Scaling(0.1, 7.0)), Polynomial(CROSS)],
    ids=lambda surface: surface.kind,
)
def test_a_dent_is_shown_by_a_chord_that_leaves_the_surface(surface):
    convexity = is_convex(surface)
    assert not convexity.convex
    assert convexity.proved
    assert 0.0 < convexity.dented_share < 1.0
    first, second = convexity.counter_example
    np.testing.assert_allclose(surface.load_factor([first, second]), 1.0, rtol=1e-9)
    assert surface.load_factor((first + second) / 2) > 1.0


def test_a_surface_without_dents_but_without_a_theorem_is_not_called_proved():
    # Two balls are one, but no theorem on exponents says so.
    convexity = is_convex(PowerSum([np.eye(3), np.eye(3)], [1.0, 0.3]))
    assert convexity.convex
    assert not convexity.proved


def test_a_dented_model_warns_with_its_share_and_a_convex_one_does_not():
    with pytest.warns(NotConvexWarning, match=r"'box' is not convex: .* % of the directions"):
        warn_unless_convex(is_convex(Polynomial(CROSS)), "box")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_unless_convex(is_convex(Polynomial(SPHERE)), "ball")


@pytest.mark.parametrize("depth", [1e-5, 1e-6, 1e-7])
def test_a_shallow_dent_is_proved(depth):
    # x^4 + y^4 + m^4 is flat along its axes, and less a little of x^2 y^2 bends inward there.
    surface = Polynomial([1, 0, 0, -depth, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1], Scaling(0.1, 3.0))
    convexity = is_convex(surface)
    assert not convexity.convex
    assert convexity.proved
    if depth > 2e-7:
        # The middle of a chord is out by about depth^2 / 16, more than rounding.
        middle = convexity.counter_example.mean(axis=0)
        assert 1e-2 * depth**2 < surface.load_factor(middle) - 1.0 < depth**2
