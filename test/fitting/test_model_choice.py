"""Few, noisy pushes: held, averaged and chosen fits keep their promises."""

import numpy as np
import pytest

from limit_surface_ros.errors import DataError, RangeError, ShapeError
from limit_surface_ros.fitting.averaging import mean_surface
from limit_surface_ros.fitting.bootstrap import (
    bootstrap,
    stored_surfaces,
    surfaces_of,
    twist_spread,
)
from limit_surface_ros.fitting.model_choice import choose_recipe, default_candidates
from limit_surface_ros.fitting.recipe import Recipe, fit_recipe
from limit_surface_ros.surface.dissipation import Dissipation
from limit_surface_ros.surface.measures import mean_angle
from limit_surface_ros.surface.pairs import Pairs
from limit_surface_ros.surface.point_contacts import PointContacts
from limit_surface_ros.surface.power_sum import PowerSum, thesis_exponents
from limit_surface_ros.surface.sampling import random_directions, random_loads
from limit_surface_ros.surface.scaling import Scaling

TRIANGLE = PointContacts(
    np.array([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]]),
    np.array([2.0, 1.0, 1.5]),
    Scaling(0.08, 2.0),
)


def noisy_pushes(count: int, seed: int = 0) -> Pairs:
    pairs = random_loads(TRIANGLE, count, seed)
    rng = np.random.default_rng(seed + 100)
    loads = pairs.wrenches * (1.0 + 0.1 * rng.normal(size=(count, 1)))
    twists = pairs.twists + 0.1 * TRIANGLE.scaling.twist_unit * rng.normal(size=(count, 3))
    return Pairs(loads, twists)


def random_psd(terms: int, seed: int) -> np.ndarray:
    factors = np.random.default_rng(seed).normal(size=(terms, 3, 3))
    return factors @ factors.transpose(0, 2, 1)


def test_the_mean_of_dissipation_models_has_the_mean_of_their_loads():
    members = [Dissipation(random_psd(2, seed)) for seed in range(3)]
    twists = random_directions(50, 0)
    loads = [each.wrench_of_twist(twists) for each in members]
    np.testing.assert_allclose(
        mean_surface(members).wrench_of_twist(twists), np.mean(loads, axis=0)
    )


def test_the_mean_of_power_sums_has_the_mean_of_their_values():
    members = [PowerSum(random_psd(3, seed), thesis_exponents(3)) for seed in range(4)]
    loads = random_directions(50, 0)
    values = [each.value(loads) for each in members]
    np.testing.assert_allclose(mean_surface(members).value(loads), np.mean(values, axis=0))


def test_a_mean_of_different_kinds_is_refused():
    with pytest.raises(ShapeError, match="one scaling"):
        mean_surface([PowerSum(random_psd(1, 0), [0.5]), Dissipation(random_psd(1, 0))])
    with pytest.raises(ShapeError, match="one scaling"):
        mean_surface([])


def test_a_strong_prior_returns_the_support_points_and_a_weak_one_follows_the_pushes():
    pushes, test = noisy_pushes(12), random_loads(TRIANGLE, 300, 9)
    wrong = PointContacts(TRIANGLE.points + np.array([0.02, 0.0]), np.ones(3), TRIANGLE.scaling)
    known, led_astray, followed = (
        fit_recipe(pushes, Recipe(towards="support", strength=strength), support=points).surface
        for points, strength in ((TRIANGLE, 1e6), (wrong, 1e6), (wrong, 0.1))
    )
    assert np.degrees(mean_angle(known, test)) < 4.0
    assert mean_angle(followed, test) < mean_angle(led_astray, test)


def test_averaging_helps_with_few_noisy_pushes():
    test = random_loads(TRIANGLE, 300, 9)
    single, mean = (
        np.mean(
            [
                mean_angle(fit_recipe(noisy_pushes(20, seed), recipe).surface, test)
                for seed in range(4)
            ]
        )
        for recipe in (Recipe(), Recipe(members=6, towards="ellipsoid"))
    )
    assert mean < single


def test_the_choice_predicts_better_than_an_ellipsoid_and_is_refitted_on_all():
    pushes, test = noisy_pushes(80), random_loads(TRIANGLE, 300, 9)
    candidates = [Recipe("power_sum", 1), Recipe(members=3, towards="ellipsoid")]
    seen = []
    choice = choose_recipe(
        pushes, candidates=candidates, progress=lambda done, total: seen.append((done, total))
    )
    assert choice.recipe is candidates[1]
    assert choice.angles.shape == (2, 80)
    assert seen[-1] == (10, 10)
    again = fit_recipe(pushes, choice.recipe).surface
    np.testing.assert_array_equal(again.matrices, choice.fit.surface.matrices)
    ellipsoid = fit_recipe(pushes, candidates[0]).surface
    assert mean_angle(choice.fit.surface, test) < mean_angle(ellipsoid, test)


def test_a_recipe_that_is_trusted_more_is_not_displaced_by_a_lucky_one():
    pushes = noisy_pushes(16)
    twins = [Recipe("power_sum", 2), Recipe("power_sum", 2, strength=3.0)]
    assert choose_recipe(pushes, candidates=twins).recipe is twins[0]


def test_a_bootstrap_is_surer_with_more_pushes_and_outlives_its_file():
    load = random_loads(TRIANGLE, 40, 5).wrenches
    recipe = Recipe(terms=2)
    few, many = (bootstrap(noisy_pushes(count), recipe, 5) for count in (15, 120))
    assert twist_spread(many, load).mean() < twist_spread(few, load).mean()
    again = surfaces_of(stored_surfaces(few), few[0].scaling)
    np.testing.assert_array_equal(twist_spread(again, load), twist_spread(few, load))
    assert twist_spread(few, load[0]).shape == ()
    with pytest.raises(DataError, match="holds no surfaces"):
        surfaces_of({"kind": "dissipation"}, few[0].scaling)
    with pytest.raises(RangeError, match="at least 2 refits"):
        bootstrap(noisy_pushes(15), recipe, 1)


def test_known_support_points_enter_the_candidates_first():
    assert default_candidates(25, True)[0].towards == "support"
    assert all(each.towards != "support" for each in default_candidates(25, False))


def test_what_cannot_be_chosen_is_refused():
    pushes = noisy_pushes(20)
    with pytest.raises(DataError, match="support points"):
        fit_recipe(pushes, Recipe(towards="support"))
    with pytest.raises(DataError, match="5 pairs cannot determine"):
        choose_recipe(Pairs(pushes.wrenches[:5], pushes.twists[:5]))
    with pytest.raises(RangeError, match="folds"):
        choose_recipe(pushes, folds=1)
    with pytest.raises(RangeError, match=f"at most one for each of the {len(pushes)} pushes"):
        choose_recipe(pushes, folds=1000)
    with pytest.raises(RangeError, match="only dissipation"):
        Recipe("power_sum", towards="support")
