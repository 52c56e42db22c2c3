# SPDX-License-Identifier: Apache-2.0
"""Models in units far from newtons and metres answer alike; scales without limits are refused."""

import numpy as np
import pytest

from limit_surface_ros.errors import RangeError
from limit_surface_ros.motion.push import pushes
from limit_surface_ros.surface import Dissipation, PointContacts, Polynomial, PowerSum, Scaling

ROOTS = np.random.default_rng(1).standard_normal((3, 3, 3))
FORMS = np.swapaxes(ROOTS, 1, 2) @ ROOTS
FEET = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, -0.3]])
QUARTIC = [1, 0, 0, 2.2, 0.1, 2, 0, -0.05, 0, 0, 1.1, 0, 2, 0, 0.8]
KINDS = {
    "powers": lambda scaling: PowerSum.thesis(FORMS, scaling),
    "norms": lambda scaling: PowerSum.norms(FORMS, scaling),
    "dissipation": lambda scaling: Dissipation(FORMS, scaling),
    "polynomial": lambda scaling: Polynomial(QUARTIC, scaling),
    "points": lambda scaling: PointContacts(
        FEET * scaling.characteristic_length, np.full(3, scaling.friction_force), scaling
    ),
}


@pytest.mark.parametrize("scaling", [Scaling(1e-100), Scaling(1e90), Scaling(1.0, 1e-75)])
@pytest.mark.parametrize("kind", KINDS)
def test_maps_and_pushes_are_alike_in_any_unit(kind, scaling):
    usual, far = KINDS[kind](Scaling()), KINDS[kind](scaling)
    vectors = np.random.default_rng(2).standard_normal((60, 3))
    wrenches, twists = vectors * scaling.wrench_unit, vectors * scaling.twist_unit
    for found, right, tolerance in (
        (far.twist_of_wrench(wrenches) / scaling.twist_unit, usual.twist_of_wrench(vectors), 1e-9),
        (far.wrench_of_twist(twists) / scaling.wrench_unit, usual.wrench_of_twist(vectors), 1e-9),
        (far.load_factor(wrenches), usual.load_factor(vectors), 1e-12),
    ):
        np.testing.assert_allclose(found, right, atol=tolerance)
    rest = np.tile([1.0, 0.0], (60, 1)), 0.5, np.tile([1.0, 0.3], (60, 1))
    found = pushes(far, vectors[:, :2] * scaling.characteristic_length, *rest)
    np.testing.assert_allclose(
        found.twists / scaling.twist_unit, pushes(usual, vectors[:, :2], *rest).twists, atol=1e-9
    )


@pytest.mark.parametrize("scale", [1e-101, 1e101])
def test_scales_of_which_products_are_no_numbers_are_refused(scale):
    with pytest.raises(RangeError, match="characteristic_length must lie between"):
        Scaling(scale)
    with pytest.raises(RangeError, match="friction_force must lie between"):
        Scaling(1.0, scale)
    with pytest.raises(RangeError, match="friction_force must lie between"):
        PowerSum.norms(FORMS).with_friction_force(scale)
    with pytest.raises(RangeError, match="largest coefficient"):
        Polynomial(scale * np.array(QUARTIC))
