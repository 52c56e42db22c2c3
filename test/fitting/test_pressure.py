# SPDX-License-Identifier: Apache-2.0
"""Where a body presses on the ground, found from its pushes alone."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from limit_surface_ros.fitting.few_pushes.pressure import (
    PressureObjective,
    SmallContacts,
    fit_pressure,
)
from limit_surface_ros.fitting.pairs import ScaledPairs, scale_pairs
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.measures import mean_angle
from limit_surface_ros.surface.pairs import Pairs
from limit_surface_ros.surface.sampling import random_loads
from limit_surface_ros.surface.scaling import Scaling

BODY = PointContacts(
    np.array([[-0.03, -0.04], [-0.05, 0.08], [0.09, -0.02]]),
    np.array([2.0, 1.0, 3.0]),
    Scaling(0.08, 2.0),
)
CENTRE = BODY.friction_limits @ BODY.points / BODY.friction_limits.sum()


def fitted(pairs: ScaledPairs) -> SmallContacts:
    return fit_pressure(pairs, SmallContacts.on_a_disc(pairs), 0.05, 2.0, 0.2)


def centre_of(contacts: SmallContacts) -> np.ndarray:
    return contacts.limits @ contacts.points / contacts.limits.sum()


def test_the_centre_of_pressure_and_the_total_friction_are_recovered():
    contacts = fitted(scale_pairs(random_loads(BODY, 60, 0), BODY.scaling))
    np.testing.assert_allclose(0.08 * centre_of(contacts), CENTRE, atol=2e-3)
    total = 2.0 * contacts.limits.sum()
    np.testing.assert_allclose(total, BODY.friction_limits.sum(), rtol=0.03)


def test_motions_are_predicted_from_few_exact_pushes():
    contacts = fitted(scale_pairs(random_loads(BODY, 40, 0), BODY.scaling)).loaded()
    surface = Dissipation(contacts.matrices, BODY.scaling)
    assert np.degrees(mean_angle(surface, random_loads(BODY, 300, 1))) < 8.0


def test_friction_limits_are_never_negative():
    rng = np.random.default_rng(0)
    pairs = Pairs(rng.normal(size=(20, 3)), rng.normal(size=(20, 3)))
    contacts = fitted(scale_pairs(pairs))
    assert (contacts.limits >= 0.0).all()
    assert np.isfinite(contacts.limits).all()


def test_the_disc_of_candidates_moves_with_the_body_and_covers_it():
    far = PointContacts(BODY.points + np.array([0.5, -0.2]), BODY.friction_limits, BODY.scaling)
    for body in (BODY, far):
        disc = SmallContacts.on_a_disc(scale_pairs(random_loads(body, 200, 0), body.scaling))
        away = np.linalg.norm(disc.points[:, None] - body.points / 0.08, axis=2)
        assert (away.min(axis=0) < 2.5 * disc.radii[0]).all()


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_gradient_agrees_with_finite_differences(seed):
    rng = np.random.default_rng(seed)
    pairs = scale_pairs(random_loads(BODY, 30, rng), BODY.scaling)
    pairs = pairs.weighted(rng.exponential(size=30))
    usual = SmallContacts(rng.normal(size=(6, 2)), rng.uniform(0.1, 1.0, 6), np.full(6, 0.4))
    objective = PressureObjective(pairs, usual, 0.7, 1.3, 0.2)
    here = np.log(usual.limits) + 0.3 * rng.normal(size=6)
    _, gradient = objective.cost_and_gradient(here)
    step = 1e-5
    numeric = [
        (
            objective.cost_and_gradient(here + step * unit)[0]
            - objective.cost_and_gradient(here - step * unit)[0]
        )
        / (2 * step)
        for unit in np.eye(6)
    ]
    np.testing.assert_allclose(gradient, numeric, rtol=1e-3, atol=1e-3 * np.abs(gradient).max())


def test_merged_contacts_keep_total_centre_and_spread_of_the_friction():
    rng = np.random.default_rng(1)
    contacts = SmallContacts(rng.normal(size=(30, 2)), rng.uniform(size=30), np.full(30, 0.1))
    few = contacts.merged(5)
    assert len(few.limits) == 5
    np.testing.assert_allclose(few.limits.sum(), contacts.limits.sum())
    np.testing.assert_allclose(centre_of(few), centre_of(contacts))

    def spread(each: SmallContacts) -> float:
        return float(each.limits @ (each.radii**2 + (each.points**2).sum(axis=1)))

    np.testing.assert_allclose(spread(few), spread(contacts))
    assert len(contacts.merged(40).limits) == 30


def test_near_contacts_are_merged_before_far_ones():
    points = np.array([[0.0, 0.0], [0.1, 0.0], [5.0, 0.0]])
    few = SmallContacts(points, np.ones(3), np.full(3, 0.01)).merged(2)
    np.testing.assert_allclose(np.sort(few.points[:, 0]), [0.05, 5.0])


@pytest.mark.parametrize("size", [1.0, 40.0])
def test_known_points_are_scaled_to_the_pushes_and_those_without_load_left_out(size):
    known = PointContacts(
        np.vstack([BODY.points, [[0.3, 0.3]]]),
        size * np.append(BODY.friction_limits, 0.0),
        BODY.scaling,
    )
    contacts = SmallContacts.at(known, scale_pairs(random_loads(BODY, 100, 0), BODY.scaling))
    np.testing.assert_allclose(contacts.points, BODY.points / 0.08)
    np.testing.assert_allclose(contacts.limits, BODY.friction_limits / 2.0, rtol=0.1)


def test_many_equal_contacts_all_carry():
    grid = np.stack(np.meshgrid(np.arange(40.0), np.arange(30.0)), axis=-1).reshape(-1, 2)
    contacts = SmallContacts(grid, np.append(np.ones(1199), 1e-6), np.full(1200, 0.5))
    assert len(contacts.loaded().limits) == 1199
