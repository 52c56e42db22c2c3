# SPDX-License-Identifier: Apache-2.0
"""The steps of a window of pushes: exact slopes, and searches that may begin anywhere."""

import numpy as np

from limit_surface_ros.fitting.few_pushes.pressure import SmallContacts
from limit_surface_ros.fitting.few_pushes.window import Window, _damped_step, _Errors
from limit_surface_ros.fitting.motion_cost import SmoothSupportSolver
from limit_surface_ros.fitting.pairs import scale_pairs
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.pairs import Pairs
from limit_surface_ros.surface.sampling import random_loads
from limit_surface_ros.surface.scaling import Scaling

SCALING = Scaling(0.08, 5.0)
BODY = PointContacts([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]], [2.0, 1.0, 1.5], SCALING)
TWISTS = np.random.default_rng(5).normal(size=(20, 3))


def noisy_pairs(count):
    pairs = random_loads(BODY, count, 1)
    noise = 0.2 * SCALING.twist_unit * np.random.default_rng(2).normal(size=(count, 3))
    return scale_pairs(Pairs(pairs.wrenches, pairs.twists + noise), SCALING)


def test_slopes_agree_with_finite_differences():
    rng = np.random.default_rng(3)
    contacts = SmallContacts.around([(1.5, 2)])
    start = rng.normal(size=len(contacts.limits))
    pairs = noisy_pairs(12).weighted(rng.exponential(size=12))
    errors = _Errors(pairs, np.ones((3, 12)))

    def cost(parameters):
        return errors.cost(contacts.speeds * np.exp(2.0 * parameters)[:, None, None])

    cost(start)
    rows, residuals = errors.rows()
    step = 1e-6 * np.eye(len(start))
    numeric = [(cost(start + each) - cost(start - each)) / 2e-6 for each in step]
    np.testing.assert_allclose(2.0 * rows @ residuals, numeric, rtol=1e-5, atol=1e-6)


def test_the_search_finds_the_same_motions_from_where_a_step_leads():
    growth = np.random.default_rng(4).normal(size=37)
    contacts = SmallContacts.around([(1.5, 3)])
    loads = np.ascontiguousarray(noisy_pairs(20).wrenches.T)

    def grown(step):
        return contacts.speeds * np.exp(2.0 * step)[:, None, None]

    def solver():
        found = SmoothSupportSolver(loads)
        found.solve(contacts.speeds)
        assert found.gradients.shape == (37, 2, 20)
        return found

    cold, warm = SmoothSupportSolver(loads), solver()
    cold.solve(grown(growth))
    warm.begin_further(np.expm1(growth))
    warm.solve(grown(growth))
    np.testing.assert_allclose(warm.motions, cold.motions, atol=1e-8)
    # Of a small step, all but a hundredth is foreseen.
    solved, foreseen = solver(), solver()
    before = solved._place
    solved.solve(grown(1e-4 * growth))
    foreseen.begin_further(np.expm1(1e-4 * growth))
    change = np.abs(solved._place - before).max()
    assert change > 1e-6
    assert np.abs(solved._place - foreseen._place).max() < 0.01 * change


def test_asking_for_motions_changes_nothing_of_what_is_learnt():
    pairs = noisy_pairs(14)
    prior = Dissipation(np.eye(3)[None], SCALING)
    asked, silent = Window(prior, 8, 1.0), Window(prior, 8, 1.0)
    for count, (load, motion) in enumerate(zip(pairs.wrenches, pairs.directions, strict=True), 1):
        asked.motion(load)
        asked.learn(load, motion, count)
        silent.learn(load, motion, count)
    np.testing.assert_allclose(
        asked.surface(8).twist_of_wrench(BODY.wrench_of_twist(TWISTS)),
        silent.surface(8).twist_of_wrench(BODY.wrench_of_twist(TWISTS)),
        rtol=1e-6,
        atol=1e-8,
    )


def test_no_step_is_taken_where_the_matrix_is_not_positive_definite():
    slope = np.array([1.0, 2.0])
    assert not _damped_step(np.diag([1.0, -3.0]), slope, 0.1).any()
    np.testing.assert_allclose(_damped_step(np.diag([1.0, 3.0]), slope, 1.0), [-0.5, -0.5])
