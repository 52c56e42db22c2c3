# SPDX-License-Identifier: Apache-2.0
"""The steps of a window of pushes: exact slopes, and searches that may begin anywhere."""

import numpy as np

from limit_surface_ros.fitting.few_pushes.pressure import SmallContacts
from limit_surface_ros.fitting.few_pushes.window import (
    _LEAST_DAMPING,
    Window,
    _damped_step,
    _Errors,
)
from limit_surface_ros.fitting.motion_cost import SmoothSupportSolver
from limit_surface_ros.fitting.pairs import ScaledPairs, scale_pairs
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


def test_the_search_finds_the_same_motions_from_those_of_another_model():
    growth = np.random.default_rng(4).normal(size=37)
    contacts = SmallContacts.around([(1.5, 3)])
    loads = np.ascontiguousarray(noisy_pairs(20).wrenches.T)
    grown = contacts.speeds * np.exp(2.0 * growth)[:, None, None]
    cold, warm = SmoothSupportSolver(loads), SmoothSupportSolver(loads)
    cold.solve(grown)
    warm.solve(contacts.speeds)
    warm.solve(grown)
    np.testing.assert_allclose(warm.motions, cold.motions, atol=1e-8)


def learnt(window, pairs):
    """Return a window that has learnt pairs in their order."""
    for count, (load, motion) in enumerate(zip(pairs.wrenches, pairs.directions, strict=True), 1):
        window.learn(load, motion, count)
    return window


def test_a_fold_is_one_step_on_the_pushes_that_remain():
    window = learnt(Window(Dissipation(np.eye(3)[None], SCALING), 14, 1.0), noisy_pairs(14))
    fit, pairs = window._fit, window._pairs()
    left_out = np.array([0, 5, 13])
    remain = np.delete(np.arange(14), left_out)
    rest = ScaledPairs(pairs.wrenches[remain], pairs.directions[remain], SCALING)
    errors = _Errors(rest, fit.motions[:, remain])
    errors.cost(fit._matrices(fit._parameters))
    step = _damped_step(*fit._normal_equations(*errors.rows()), _LEAST_DAMPING)
    (limits,) = fit.limits_without(pairs, [left_out])
    np.testing.assert_allclose(limits, np.exp(fit._parameters + step), rtol=1e-6)
    assert np.abs(step).max() > 0.01


def test_a_window_that_begins_anew_keeps_the_last_pushes_and_the_contacts_of_the_other():
    prior, pairs = Dissipation(np.eye(3)[None], SCALING), noisy_pairs(9)
    window, other = learnt(Window(prior, 8, 1.0), pairs), learnt(Window(prior, 8, 0.5), pairs)
    window.begin_anew(other, 3)
    np.testing.assert_array_equal(window._pairs().wrenches, pairs.wrenches[-3:])
    np.testing.assert_array_equal(window.surface(6).matrices, other.surface(6).matrices)


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
    # Where limits hardly matter a step would lead anywhere.
    np.testing.assert_allclose(_damped_step(np.diag([1e-9, 1.0]), slope, 0.0), [-2.0, -2.0])
