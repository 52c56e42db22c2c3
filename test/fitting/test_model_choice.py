# SPDX-License-Identifier: Apache-2.0
"""Few, noisy pushes: regularised and chosen fits keep their promises."""

import numpy as np
import pytest

from limit_surface_ros.errors import DataError, RangeError
from limit_surface_ros.fitting.few_pushes.automatic import fit_automatically
from limit_surface_ros.fitting.few_pushes.cross_validation import choose_recipe, default_candidates
from limit_surface_ros.fitting.few_pushes.recipe import FitContext, Recipe
from limit_surface_ros.fitting.few_pushes.uncertainty import (
    bootstrap,
    stored_surfaces,
    surfaces_of,
    twist_spread,
)
from limit_surface_ros.fitting.search import Search
from limit_surface_ros.surface.convexity import is_convex
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.measures import mean_angle
from limit_surface_ros.surface.pairs import Pairs
from limit_surface_ros.surface.sampling import random_loads
from limit_surface_ros.surface.scaling import Scaling

TRIANGLE = PointContacts(
    np.array([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]]),
    np.array([2.0, 1.0, 1.5]),
    Scaling(0.08, 2.0),
)
PRESSURE = Recipe(terms=8, prior="pressure", prior_weight=5.0)
ELLIPSOID = Recipe("power_sum", 1)


def noisy_pushes(count: int, seed: int = 0, body=TRIANGLE) -> Pairs:
    pairs = random_loads(body, count, seed)
    rng = np.random.default_rng(seed + 100)
    loads = pairs.wrenches * (1.0 + 0.1 * rng.normal(size=(count, 1)))
    twists = pairs.twists + 0.1 * body.scaling.twist_unit * rng.normal(size=(count, 3))
    return Pairs(loads, twists)


def fitted(pushes: Pairs, recipe: Recipe, support=None):
    return FitContext(pushes, support=support).fit(recipe)[0]


def test_a_strong_prior_returns_the_support_points_and_a_weak_one_follows_the_pushes():
    pushes, test = noisy_pushes(12), random_loads(TRIANGLE, 300, 9)
    wrong = PointContacts(TRIANGLE.points + np.array([0.02, 0.0]), np.ones(3), TRIANGLE.scaling)
    known, led_astray, followed = (
        fitted(pushes, Recipe(prior="support", prior_weight=weight), points)
        for points, weight in ((TRIANGLE, 1e6), (wrong, 1e6), (wrong, 0.1))
    )
    assert np.degrees(mean_angle(known, test)) < 4.0
    assert mean_angle(followed, test) < mean_angle(led_astray, test)


def test_a_pressure_as_prior_helps_with_few_noisy_pushes():
    test = random_loads(TRIANGLE, 300, 9)
    free, ellipsoid, regularised = (
        np.mean([mean_angle(fitted(noisy_pushes(15, seed), each), test) for seed in range(4)])
        for each in (Recipe(), ELLIPSOID, PRESSURE)
    )
    assert regularised < 0.9 * free
    assert regularised < 0.9 * ellipsoid


def test_a_held_fit_is_convex_and_has_few_terms():
    for seed in range(3):
        surface = fitted(noisy_pushes(15, seed), PRESSURE)
        assert is_convex(surface)
        assert len(surface.matrices) <= 8


def test_units_do_not_matter():
    pushes, test = noisy_pushes(20), random_loads(TRIANGLE, 200, 9)
    newtons, millimetres = 1e3, 1e3
    wrenches = np.array([newtons, newtons, newtons * millimetres])
    twists = np.array([millimetres, millimetres, 1.0])
    other = Pairs(pushes.wrenches * wrenches, pushes.twists * twists)
    expected = fit_automatically(pushes)
    found = fit_automatically(other)
    assert found.objective == expected.objective
    turned = found.surface.twist_of_wrench(test.wrenches * wrenches) / twists
    turned /= np.linalg.norm(turned / expected.surface.scaling.twist_unit, axis=1, keepdims=True)
    np.testing.assert_allclose(
        turned, expected.surface.twist_of_wrench(test.wrenches), atol=1e-3 / 0.08
    )
    np.testing.assert_allclose(
        found.surface.load_factor(test.wrenches * wrenches),
        expected.surface.load_factor(test.wrenches),
        rtol=1e-3,
    )


def test_the_choice_predicts_better_than_an_ellipsoid_and_is_refitted_on_all():
    pushes, test = noisy_pushes(80), random_loads(TRIANGLE, 300, 9)
    candidates = [ELLIPSOID, PRESSURE]
    seen = []
    choice = choose_recipe(
        pushes, candidates=candidates, progress=lambda done, total: seen.append((done, total))
    )
    assert choice.recipe is PRESSURE
    assert choice.angles.shape == (2, 80)
    assert seen[-1] == (5, 5)
    np.testing.assert_array_equal(fitted(pushes, choice.recipe).matrices, choice.surface.matrices)
    assert mean_angle(choice.surface, test) < mean_angle(fitted(pushes, ELLIPSOID), test)


def test_friction_that_depends_on_direction_is_chosen_against_a_pressure():
    rng = np.random.default_rng(2)
    factors = rng.normal(size=(2, 3, 3))
    body = Dissipation(factors @ factors.transpose(0, 2, 1), Scaling(0.08, 2.0))
    pushes, test = noisy_pushes(40, body=body), random_loads(body, 300, 9)
    choice = choose_recipe(pushes)
    assert choice.recipe.prior != "pressure"
    assert mean_angle(choice.surface, test) < mean_angle(fitted(pushes, PRESSURE), test)


def test_a_recipe_that_is_trusted_more_is_not_displaced_by_a_lucky_one():
    pushes = noisy_pushes(16)
    twins = [Recipe("power_sum", 2), Recipe("power_sum", 2, prior_weight=3.0)]
    assert choose_recipe(pushes, candidates=twins).recipe is twins[0]


def test_a_bootstrap_is_surer_with_more_pushes_and_outlives_its_file():
    load = random_loads(TRIANGLE, 40, 5).wrenches
    few, many = (bootstrap(noisy_pushes(count), PRESSURE, 5) for count in (15, 120))
    assert twist_spread(many, load).mean() < twist_spread(few, load).mean()
    again = surfaces_of(stored_surfaces(few), few[0].scaling)
    np.testing.assert_array_equal(twist_spread(again, load), twist_spread(few, load))
    assert twist_spread(few, load[0]).shape == ()
    with pytest.raises(DataError, match="holds no surfaces"):
        surfaces_of({"kind": "dissipation"}, few[0].scaling)
    with pytest.raises(RangeError, match="at least 2 refits"):
        bootstrap(noisy_pushes(15), PRESSURE, 1)


def test_known_support_points_enter_the_candidates_first():
    assert default_candidates(True)[0].prior == "support"
    assert all(each.prior != "support" for each in default_candidates(False))


def test_given_support_points_are_used_unless_the_pushes_speak_against_them():
    pushes = noisy_pushes(25)
    assert choose_recipe(pushes, support=TRIANGLE).recipe.prior == "support"
    elsewhere = PointContacts(TRIANGLE.points + 0.1, np.ones(3), TRIANGLE.scaling)
    assert choose_recipe(pushes, support=elsewhere).recipe.prior != "support"


def test_the_many_support_points_of_a_patch_are_summed_up_in_eight_terms():
    grid = np.stack(np.meshgrid(np.linspace(-0.1, 0.1, 40), np.linspace(-0.05, 0.05, 30)), axis=-1)
    patch = PointContacts(grid.reshape(-1, 2), np.full(1200, 1e-3), Scaling(0.08, 1.2))
    surface = fitted(random_loads(patch, 30, 0), Recipe(prior="support", prior_weight=20.0), patch)
    assert len(surface.matrices) == 8
    assert np.degrees(mean_angle(surface, random_loads(patch, 300, 9))) < 3.0


def test_what_cannot_be_chosen_is_refused():
    pushes = noisy_pushes(20)
    with pytest.raises(DataError, match="support points"):
        fitted(pushes, Recipe(prior="support"))
    with pytest.raises(DataError, match=r"5 pushes are too few, .* at least 8"):
        choose_recipe(Pairs(pushes.wrenches[:5], pushes.twists[:5]))
    with pytest.raises(RangeError, match="folds"):
        choose_recipe(pushes, folds=1)
    with pytest.raises(RangeError, match=f"at most one for each of the {len(pushes)} pushes"):
        choose_recipe(pushes, folds=1000)
    with pytest.raises(RangeError, match="only dissipation"):
        Recipe("power_sum", prior="support")


def test_choice_and_bootstrap_tell_of_their_progress_as_one():
    seen = []
    search = Search(progress=lambda done, total: seen.append((done, total)))
    fit_automatically(noisy_pushes(15), folds=3, refits=4, search=search)
    assert seen == [(done, 7) for done in range(1, 8)]
