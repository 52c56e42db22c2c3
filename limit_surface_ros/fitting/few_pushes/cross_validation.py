# SPDX-License-Identifier: Apache-2.0
"""Which recipe for few, noisy pushes: k-fold cross-validation, then a refit on all of them.

A careless choice loses more than it gains: with two dozen pushes the best of many recipes on
held-out folds is often the luckiest. So there are few candidates, ordered by how much they are
trusted beforehand, and a candidate displaces one before it only when it is better by more than one
and a half standard errors of the difference over the same pushes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import DataError, LimitSurfaceError, RangeError
from limit_surface_ros.fitting.few_pushes.recipe import (
    FEWEST_PAIRS,
    FitContext,
    Recipe,
    check_pushes,
)
from limit_surface_ros.fitting.pairs import scale_pairs
from limit_surface_ros.surface.measures import angle_error
from limit_surface_ros.surface.pairs import Pairs

if TYPE_CHECKING:
    from collections.abc import Sequence
    from concurrent.futures import Executor

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.fitting.search import Descent, Progress
    from limit_surface_ros.surface.base import LimitSurface
    from limit_surface_ros.surface.kinds.point_contacts import PointContacts
    from limit_surface_ros.surface.scaling import Scaling

# Terms that sum up a pressure: with more, predictions are no better and maps slower.
_TERMS = 8
# Standard errors by which a candidate must be better than one that is trusted more.
_MARGIN = 1.5


def default_candidates(with_support: bool) -> list[Recipe]:
    """Return the recipes that `choose_recipe` compares, the most trusted first.

    Args:
        with_support: Whether support points are known.
    """
    candidates = [
        Recipe(terms=_TERMS, prior="pressure", prior_weight=5.0),
        Recipe(terms=3, prior="ellipsoid", prior_weight=2.0),
        Recipe("power_sum", 3, velocity_weight=0.5, prior="ellipsoid", prior_weight=2.0),
        Recipe("power_sum", 1),
    ]
    if with_support:
        candidates.insert(0, Recipe(prior="support", prior_weight=20.0))
    return candidates


@dataclass(frozen=True)
class Choice:
    """The outcome of a cross-validation.

    Attributes:
        recipe: The one that was chosen.
        surface: What it makes of all pushes.
        descent: How that was found.
        candidates: All that were compared.
        angles: Angle [rad] between each push's twist and what each candidate, fitted without the
            push's fold, predicts; shape (candidates, n), infinite where a fit failed.
    """

    recipe: Recipe
    surface: LimitSurface
    descent: Descent
    candidates: tuple[Recipe, ...]
    angles: Floats


def choose_recipe(
    pairs: Pairs,
    *,
    candidates: Sequence[Recipe] | None = None,
    folds: int = 5,
    scaling: Scaling | None = None,
    support: PointContacts | None = None,
    seed: int = 0,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Choice:
    """Choose a recipe by cross-validation and refit it on all pushes.

    Args:
        pairs: Recorded pushes.
        candidates: Recipes, the most trusted first; `default_candidates` if not given.
        folds: k; each push is held out once.
        scaling: Characteristic length and friction force; chosen from the pairs if not given.
        support: Known support points, if there are any.
        seed: Of folds and starts.
        executor: Where folds are fitted; here and one by one if not given.
        progress: Called with (folds done, folds in all).

    Raises:
        DataError: The pushes cannot determine a surface.
        RangeError: There are fewer than two folds, or more of them than pushes.
    """
    count = len(pairs)
    recipes = tuple(candidates or default_candidates(support is not None))
    if folds < 2:
        raise RangeError(f"folds must be at least 2, got {folds}")
    scaled = scale_pairs(pairs, scaling)
    check_pushes(scaled, FEWEST_PAIRS + 2)
    if folds > count:
        raise RangeError(f"folds must be at most one for each of the {count} pushes, got {folds}")
    scaling = scaled.scaling
    parts = np.array_split(np.random.default_rng(seed).permutation(count), folds)
    tasks = []
    for part in parts:
        seen = np.setdiff1d(np.arange(count), part)
        training = pairs.take(seen)
        held_out = pairs.take(part)
        tasks.append((FitContext(training, scaling, support, seed=seed), held_out, recipes))
    if executor is None:
        found = (_angles(*task) for task in tasks)
    else:
        futures = [executor.submit(_angles, *task) for task in tasks]
        found = (future.result() for future in futures)
    angles = np.full((len(recipes), count), np.inf)
    for done, (part, of_part) in enumerate(zip(parts, found, strict=True), start=1):
        angles[:, part] = of_part
        if progress is not None:
            progress(done, folds)
    if not np.isfinite(angles).all(axis=1).any():
        raise DataError("no candidate could be fitted to every fold: give more pushes")
    recipe = recipes[_chosen(angles)]
    surface, descent = FitContext(pairs, scaling, support, seed=seed).fit(recipe)
    return Choice(recipe, surface, descent, recipes, angles)


def _angles(context: FitContext, held_out: Pairs, recipes: Sequence[Recipe]) -> Floats:
    """Return the errors [rad] of each recipe's fit on held-out pushes, shape (recipes, n)."""
    angles = np.full((len(recipes), len(held_out)), np.inf)
    for row, recipe in enumerate(recipes):
        try:
            angles[row] = angle_error(context.fit(recipe)[0], held_out)
        except LimitSurfaceError:
            # A candidate that a fold cannot support stays infinitely bad.
            continue
    return angles


def _chosen(angles: Floats) -> int:
    """Return the row that wins against those before it by a clear margin."""
    sound = np.flatnonzero(np.isfinite(angles).all(axis=1))
    chosen = int(sound[0])
    for row in sound[1:]:
        gains = angles[chosen] - angles[row]
        if gains.mean() > _MARGIN * gains.std(ddof=1) / np.sqrt(gains.size):
            chosen = int(row)
    return chosen
