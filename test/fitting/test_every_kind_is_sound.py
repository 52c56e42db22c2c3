# SPDX-License-Identifier: Apache-2.0
"""No fit depends on the units of its data, collapses, or leaves the positive semidefinite cone."""

import numpy as np
import pytest

from limit_surface_ros.fitting.dissipation import fit_dissipation
from limit_surface_ros.fitting.polynomial import fit_polynomial
from limit_surface_ros.fitting.power_sum import fit_power_sum
from limit_surface_ros.fitting.search import Search
from limit_surface_ros.fitting.second_approximation import fit_second_approximation
from limit_surface_ros.fitting.simulation import simulated_pairs
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.power_sum import thesis_exponents
from limit_surface_ros.surface.pairs import Pairs
from limit_surface_ros.surface.scaling import Scaling

TRIANGLE = PointContacts(
    np.array([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]]), np.full(3, 0.5), Scaling(0.15, 1.0)
)
SEARCH = Search(4)


def convex_polynomial(pairs):
    pytest.importorskip("cvxpy", reason="the extra 'peers' is not installed")
    return fit_polynomial(pairs, velocity_weight=1.0, convex=True)


def power_sum(exponents, weight):
    return lambda pairs: fit_power_sum(pairs, exponents, velocity_weight=weight, search=SEARCH)


def dissipation(fitted_on):
    return lambda pairs: fit_dissipation(pairs, 2, fitted_on=fitted_on, search=SEARCH)


def second(weight):
    return lambda pairs: fit_second_approximation(pairs, velocity_weight=weight, search=SEARCH)


FITS = {
    "ellipsoid, J1": power_sum([1.0], 0.0),
    "3 terms, J1": power_sum(thesis_exponents(3), 0.0),
    "3 terms, J2": power_sum(thesis_exponents(3), 1.0),
    "3 norms, J2": power_sum([0.5] * 3, 1.0),
    "second, J1": second(0.0),
    "second, J2": second(1.0),
    "dissipation, forces": dissipation("forces"),
    "dissipation, directions": dissipation("directions"),
    "dissipation, both": dissipation("both"),
    "polynomial": fit_polynomial,
    "convex polynomial": convex_polynomial,
}


@pytest.mark.parametrize("noise", [0.0, 0.1])
@pytest.mark.parametrize("name", FITS)
def test_newtons_or_millinewtons_metres_or_millimetres_give_one_sound_surface(name, noise):
    pairs = simulated_pairs(TRIANGLE, 150, 10, load_noise=noise, motion_noise=noise)
    surface = FITS[name](pairs).surface
    factors = surface.load_factor(pairs.wrenches)
    assert 0.7 < np.median(factors) < 1.3
    if hasattr(surface, "matrices"):
        assert np.linalg.eigvalsh(surface.matrices).min() >= -1e-12
    for force, length in ((1e3, 1.0), (1.0, 1e3), (1e3, 1e3)):
        unit = np.array([force, force, force * length])
        same = Pairs(pairs.wrenches * unit, pairs.twists * [length, length, 1.0])
        in_other_units = FITS[name](same).surface.load_factor(same.wrenches)
        np.testing.assert_allclose(in_other_units, factors, rtol=1e-6)
