# SPDX-License-Identifier: Apache-2.0
"""Few, noisy pushes: regularised and chosen fits keep their promises."""

import numpy as np
import pytest

from limit_surface_ros.errors import DataError, RangeError
from limit_surface_ros.fitting.few_pushes.automatic import fit_automatically
from limit_surface_ros.fitting.few_pushes.bootstrap import (
    bootstrap,
    stored_surfaces,
    surfaces_of,
    twist_spread,
)
from limit_surface_ros.fitting.few_pushes.cross_validation import cross_validate
from limit_surface_ros.fitting.few_pushes.mixture import (
    Mixture,
    choose_mixture,
    mixed,
    usual_mixture,
)
from limit_surface_ros.fitting.few_pushes.recipe import ROBUST_SCALE, FitContext, Recipe
from limit_surface_ros.fitting.power_sum import PowerSumObjective
from limit_surface_ros.fitting.search import Search, descend_from_seed
from limit_surface_ros.surface.contact import shapes
from limit_surface_ros.surface.contact.patch import ContactPatch
from limit_surface_ros.surface.convexity import is_convex
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.power_sum import PowerSum
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
ALONE = Mixture(((PRESSURE, 1.0),))


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


def test_a_mixture_predicts_better_than_an_ellipsoid_and_is_refitted_on_all():
    pushes, test = noisy_pushes(60), random_loads(TRIANGLE, 300, 9)
    seen = []
    search = Search(progress=lambda done, total: seen.append((done, total)))
    result = fit_automatically(pushes, search=search)
    assert seen[-1] == (5, 5)
    assert result.objective.startswith("mixture of ")
    assert mean_angle(result.surface, test) < mean_angle(fitted(pushes, ELLIPSOID), test)
    angles = result.details["cross_validation_mean_angle_deg"]
    assert angles["mixture"] < angles[str(ELLIPSOID)]


def test_friction_that_depends_on_direction_does_not_follow_a_pressure():
    rng = np.random.default_rng(2)
    factors = rng.normal(size=(2, 3, 3))
    body = Dissipation(factors @ factors.transpose(0, 2, 1), Scaling(0.08, 2.0))
    pushes, test = noisy_pushes(40, body=body), random_loads(body, 300, 9)
    surface = fit_automatically(pushes).surface
    assert mean_angle(surface, test) < mean_angle(fitted(pushes, PRESSURE), test)


def test_dissipations_of_a_mixture_add():
    one, three = (Dissipation(r**2 * np.eye(3)[None], Scaling(0.1, 2.0)) for r in (1.0, 3.0))
    two = mixed([(0.5, one), (0.5, three)])
    loads = random_loads(one, 20, 0).wrenches
    np.testing.assert_allclose(two.load_factor(loads), one.load_factor(loads) / 2.0)
    body = TRIANGLE.dissipation()
    twice = mixed([(0.3, body), (0.7, body)])
    loads = random_loads(TRIANGLE, 50, 1).wrenches
    np.testing.assert_allclose(twice.load_factor(loads), 1.0, rtol=1e-7)
    with pytest.raises(DataError, match="one scaling"):
        mixed([(0.5, one), (0.5, body)])
    with pytest.raises(DataError, match="is not the sum of dissipations"):
        mixed([(1.0, PowerSum(np.stack([np.eye(3)] * 2), [0.5, 0.5]))])


def test_an_ellipsoid_enters_a_mixture_as_one_term():
    matrix = np.diag([1.0, 0.5, 2.0])
    ellipsoid = PowerSum(matrix[None], [0.5], Scaling(0.1, 2.0))
    alone = mixed([(1.0, ellipsoid)])
    pairs = random_loads(ellipsoid, 50, 0)
    np.testing.assert_allclose(alone.load_factor(pairs.wrenches), 1.0)
    assert mean_angle(alone, pairs) < 1e-6


def test_usual_weights_stay_with_few_pushes_and_the_best_model_takes_all_of_many():
    usual = usual_mixture(False)
    recipes = [recipe for recipe, _ in usual]
    few, many = noisy_pushes(16), random_loads(TRIANGLE, 1200, 3)
    weights = dict(choose_mixture(cross_validate(few, recipes, folds=4), usual).parts)
    assert weights.get(recipes[0], 0.0) > 0.35
    exact = dict(choose_mixture(cross_validate(many, recipes, folds=3), usual).parts)
    assert exact.get(ELLIPSOID, 0.0) < 0.02


@pytest.mark.parametrize("seed", range(6))
def test_an_ellipsoid_ends_in_the_best_minimum_of_twenty_starts(seed):
    body = ContactPatch.of_shape(shapes.rectangle([0.12, 0.03 + 0.02 * seed], 60)).surface(1, 1)
    pushes = noisy_pushes(12 + 4 * seed, seed, body)
    one_sided = pushes.twists[:, 0] > -0.3 if seed % 2 else slice(None)
    context = FitContext(Pairs(pushes.wrenches[one_sided], pushes.twists[one_sided]))
    found = context.fit(ELLIPSOID)[1]
    objective = PowerSumObjective(context.scaled, np.array([0.5]), 2.0, ROBUST_SCALE)
    others = [descend_from_seed(objective, 1, index).cost for index in range(20)]
    assert found.cost <= 1.01 * min(others)


def test_a_bootstrap_is_surer_with_more_pushes_and_outlives_its_file():
    load = random_loads(TRIANGLE, 40, 5).wrenches
    few, many = (bootstrap(noisy_pushes(count), ALONE, 5) for count in (15, 120))
    assert twist_spread(many, load).mean() < twist_spread(few, load).mean()
    again = surfaces_of(stored_surfaces(few), few[0].scaling)
    np.testing.assert_array_equal(twist_spread(again, load), twist_spread(few, load))
    assert twist_spread(few, load[0]).shape == ()
    with pytest.raises(DataError, match="holds no surfaces"):
        surfaces_of({"kind": "dissipation"}, few[0].scaling)
    with pytest.raises(RangeError, match="at least 2 refits"):
        bootstrap(noisy_pushes(15), ALONE, 1)


def test_known_support_points_join_the_mixture_first():
    assert usual_mixture(True)[0][0].prior == "support"
    assert all(recipe.prior != "support" for recipe, _ in usual_mixture(False))


def test_given_support_points_count_unless_the_pushes_speak_against_them():
    pushes = noisy_pushes(25)
    elsewhere = PointContacts(TRIANGLE.points + 0.1, np.ones(3), TRIANGLE.scaling)
    usual = usual_mixture(True)
    recipes = [recipe for recipe, _ in usual]
    known, wrong = (
        dict(choose_mixture(cross_validate(pushes, recipes, support=points), usual).parts)
        for points in (TRIANGLE, elsewhere)
    )
    assert known[recipes[0]] > 0.5
    assert wrong.get(recipes[0], 0.0) < 0.2


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
        fit_automatically(Pairs(pushes.wrenches[:5], pushes.twists[:5]))
    with pytest.raises(RangeError, match="folds"):
        fit_automatically(pushes, folds=1)
    with pytest.raises(RangeError, match=f"at most one for each of the {len(pushes)} pushes"):
        fit_automatically(pushes, folds=1000)
    with pytest.raises(RangeError, match="only dissipation"):
        Recipe("power_sum", prior="support")


def test_choice_and_bootstrap_tell_of_their_progress_as_one():
    seen = []
    search = Search(progress=lambda done, total: seen.append((done, total)))
    fit_automatically(noisy_pushes(15), folds=3, refits=4, search=search)
    assert seen == [(done, 7) for done in range(1, 8)]
