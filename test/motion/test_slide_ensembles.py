# SPDX-License-Identifier: Apache-2.0
"""What is uncertain of surface and inertia spreads the end of a slide, and is told as it is."""

import numpy as np
import pytest
from motion_helpers import dissipation_surface, random_inertia

from limit_surface_ros.errors import RangeError, ShapeError
from limit_surface_ros.motion.sliding.ensemble import slide_spread
from limit_surface_ros.motion.sliding.inertia import Inertia
from limit_surface_ros.motion.sliding.slide import slide
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.scaling import Scaling

SHOVE = (0.8, 0.2, 12.0)


def perturbed(surface, rng, share):
    """Return a surface whose roots are off by a share."""
    roots = np.array([np.linalg.cholesky(form).T for form in surface.matrices])
    roots = roots * (1.0 + share * rng.normal(size=roots.shape))
    return Dissipation(np.swapaxes(roots, 1, 2) @ roots, surface.scaling)


def test_members_slide_as_alone_and_quantiles_are_theirs():
    rng = np.random.default_rng(0)
    surface, inertia = dissipation_surface(rng), random_inertia(rng, 0.5, 2.0)
    members = [perturbed(surface, rng, 0.05) for _ in range(40)]
    found = slide_spread(members, inertia, SHOVE)
    for row in range(0, 40, 8):
        alone = slide(members[row], inertia, SHOVE)
        assert found.times[row] == pytest.approx(alone.time, rel=1e-6)
        np.testing.assert_allclose(found.poses[row], alone.pose, atol=1e-6)
    low, middle, high = found.time_quantiles
    assert low < middle < high
    assert ((found.times >= low) & (found.times <= high)).mean() == pytest.approx(0.9, abs=0.05)
    np.testing.assert_allclose(found.pose_quantiles[1], np.median(found.poses, axis=0))
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)), found.poses.std(axis=0, ddof=1))


def test_friction_that_is_uncertain_spreads_a_straight_slide_as_its_inverse():
    surface, inertia = Dissipation(np.eye(3)[np.newaxis], Scaling(0.05, 1.0)), Inertia(1.0, 1e-3)
    factors = np.linspace(0.9, 1.1, 21)
    found = slide_spread([surface.scaled(each) for each in factors], inertia, (1.0, 0.0, 0.0))
    np.testing.assert_allclose(found.times, 1.0 / factors, rtol=1e-7)
    np.testing.assert_allclose(found.poses[:, 0], 0.5 / factors, rtol=1e-7)


def test_inertias_and_twists_may_be_what_is_uncertain():
    surface = Dissipation(np.eye(3)[np.newaxis], Scaling(0.05, 1.0))
    masses = [Inertia(mass, 1e-3) for mass in (0.9, 1.0, 1.1)]
    found = slide_spread(surface, masses, np.outer([1.0, 2.0, 3.0], [1.0, 0.0, 0.0]))
    np.testing.assert_allclose(found.times, [0.9, 2.0, 3.3], rtol=1e-7)


@pytest.mark.parametrize(
    ("surfaces", "twists", "error"),
    [(1, SHOVE, RangeError), (3, [SHOVE] * 2, ShapeError), (2, [[SHOVE]], ShapeError)],
)
def test_members_that_do_not_fit_are_refused(surfaces, twists, error):
    surface = Dissipation(np.eye(3)[np.newaxis])
    with pytest.raises(error):
        slide_spread([surface] * surfaces, Inertia(1.0, 1.0), twists)
