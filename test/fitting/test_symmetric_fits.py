# SPDX-License-Identifier: Apache-2.0
"""A symmetric body's model is its own mirror image, to rounding, whatever the kind."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from limit_surface_ros.errors import RangeError
from limit_surface_ros.fitting.dissipation import ForceObjective, fit_dissipation
from limit_surface_ros.fitting.pairs import scale_pairs
from limit_surface_ros.fitting.polynomial import fit_polynomial
from limit_surface_ros.fitting.power_sum import fit_power_sum
from limit_surface_ros.fitting.search import Search
from limit_surface_ros.fitting.simulation import simulated_pairs
from limit_surface_ros.fitting.symmetric import images_of_terms, symmetric
from limit_surface_ros.surface.contact import shapes
from limit_surface_ros.surface.contact.patch import ContactPatch
from limit_surface_ros.surface.contact.symmetry import MIRRORS, mirror_axes
from limit_surface_ros.surface.kinds.power_sum import thesis_exponents
from limit_surface_ros.surface.measures import mean_angle
from limit_surface_ros.surface.sampling import random_directions, random_motions

BOX = ContactPatch.of_shape(shapes.rectangle([0.12, 0.07], 400)).surface(0.35, 3.924)
# An isosceles triangle that points along x: symmetric about x alone.
ARROW = ContactPatch.of_shape(
    shapes.polygon([[0.1, 0.0], [-0.05, 0.04], [-0.05, -0.04]], count=400)
).surface(0.35, 3.924)
FEW = Search(starts=4)
FITS = {
    "dissipation": lambda pairs, axes: fit_dissipation(pairs, 6, search=FEW, symmetry=axes),
    "norms": lambda pairs, axes: fit_power_sum(pairs, [0.5] * 3, search=FEW, symmetry=axes),
    "thesis": lambda pairs, axes: fit_power_sum(
        pairs, thesis_exponents(2), search=FEW, symmetry=axes
    ),
    "polynomial": lambda pairs, axes: fit_polynomial(pairs, symmetry=axes),
}


@pytest.mark.parametrize("kind", FITS)
@pytest.mark.parametrize(("body", "axes"), [(BOX, ("x", "y")), (ARROW, ("x",))])
def test_a_fit_is_as_symmetric_as_its_body(kind, body, axes):
    assert mirror_axes(body) == axes
    surface = FITS[kind](simulated_pairs(body, 500), axes).surface
    wrenches = random_directions(100, 3) * body.scaling.wrench_unit
    twists = surface.twist_of_wrench(wrenches) / surface.scaling.twist_unit
    for axis in axes:
        mirror = MIRRORS[axis]
        mirrored = surface.twist_of_wrench(wrenches * mirror) / surface.scaling.twist_unit
        np.testing.assert_allclose(mirrored, twists * mirror, atol=1e-9)
    # A straight push along an axis of symmetry does not drift.
    straight = surface.twist_of_wrench([1.0, 0.0, 0.0]) / surface.scaling.twist_unit
    np.testing.assert_allclose(straight, [1.0, 0.0, 0.0], atol=1e-9)


def test_symmetry_costs_a_box_hardly_any_accuracy():
    pairs, test = simulated_pairs(BOX, 1000), random_motions(BOX, 500, 1)
    free, held = (
        mean_angle(fit_dissipation(pairs, 6, search=Search(8), symmetry=axes).surface, test)
        for axes in ((), ("x", "y"))
    )
    assert held < 1.2 * free


@given(
    terms=st.integers(1, 12),
    axes=st.sampled_from([(), ("x",), ("y",), ("x", "y"), ("y", "x")]),
    alike=st.booleans(),
)
@settings(max_examples=60, deadline=None)
def test_every_number_of_terms_is_made_up_of_whole_orbits(terms, axes, alike):
    images = images_of_terms(terms, axes, alike=alike)
    assert images.shape[0] == 6 * terms
    assert np.linalg.matrix_rank(images) == images.shape[1]
    objective = symmetric(ForceObjective(scale_pairs(random_motions(BOX, 20, 0)), terms), images)
    parameters = objective.start(np.random.default_rng(0))
    surface = objective.surface(parameters)
    twists = random_directions(20, 1) * surface.scaling.twist_unit
    power = np.sum(surface.wrench_of_twist(twists) * twists, axis=1)
    for axis in axes:
        images_of_twists = twists * MIRRORS[axis]
        mirrored = np.sum(surface.wrench_of_twist(images_of_twists) * images_of_twists, axis=1)
        np.testing.assert_allclose(mirrored, power, rtol=1e-9)
    # The gradient against differences of the cost, along one direction.
    along = np.random.default_rng(1).normal(size=parameters.size)
    _, gradient = objective.cost_and_gradient(parameters)
    step = 1e-6
    ahead, behind = (
        objective.cost_and_gradient(parameters + sign * step * along)[0] for sign in (1, -1)
    )
    assert (ahead - behind) / (2 * step) == pytest.approx(gradient @ along, rel=1e-4, abs=1e-7)


def test_an_unknown_axis_is_refused():
    with pytest.raises(RangeError, match="symmetry is about x, y or both, got z"):
        fit_dissipation(random_motions(BOX, 40, 0), 2, symmetry=["z"])
