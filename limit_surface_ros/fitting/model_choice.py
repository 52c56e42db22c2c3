"""Which recipe for few, noisy pushes: k-fold cross-validation, then a refit on all of them.

A careless choice loses more than it gains: with two dozen pushes the best of many recipes on
held-out folds is often the luckiest. So there are few candidates, ordered by how much they are
trusted beforehand, and a candidate displaces one before it only when it is better by more than two
standard errors of the difference over the same pushes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import DataError, LimitSurfaceError, RangeError
from limit_surface_ros.fitting.recipe import FEWEST_PAIRS, Recipe, RecipeFit, fit_recipe
from limit_surface_ros.fitting.scaled_pairs import check_support, scale_pairs
from limit_surface_ros.surface.measures import angle_error
from limit_surface_ros.surface.pairs import Pairs

if TYPE_CHECKING:
    from collections.abc import Sequence
    from concurrent.futures import Executor

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.fitting.multi_start import Progress
    from limit_surface_ros.surface.point_contacts import PointContacts
    from limit_surface_ros.surface.scaling import Scaling

# Pairs from which on a single fit is determined well enough, and averaging costs more than it
# gives.
_MANY_PAIRS = 300
MEMBERS = 8
# Members of a mean while candidates are compared: enough to rank them, a third of the time.
_MEMBERS_COMPARED = 3
# Standard errors by which a candidate must be better than one that is trusted more.
_MARGIN = 2.0


def default_candidates(pairs: int, with_support: bool) -> list[Recipe]:
    """Return the recipes that `choose_recipe` compares, the most trusted first.

    Args:
        pairs: How many pushes there are.
        with_support: Whether support points are known.
    """
    mean = Recipe(members=1 if pairs >= _MANY_PAIRS else MEMBERS)
    held = replace(mean, towards="ellipsoid")
    candidates = [
        replace(held, strength=2.0),
        replace(held, strength=8.0),
        replace(held, velocity_weight=0.5, strength=2.0),
        replace(held, terms=2, strength=2.0),
        replace(held, terms=4, strength=2.0),
        replace(held, kind="power_sum", strength=2.0),
        replace(mean, kind="power_sum", terms=1),
    ]
    if with_support:
        known = replace(mean, towards="support")
        candidates = [
            replace(known, strength=strength) for strength in (10.0, 30.0, 100.0, 3.0)
        ] + candidates
    return candidates


@dataclass(frozen=True)
class Choice:
    """The outcome of a cross-validation.

    Attributes:
        recipe: The one that was chosen.
        fit: It, fitted to all pushes.
        candidates: All that were compared.
        angles: Angle [rad] between each push's twist and what each candidate, fitted without the
            push's fold, predicts; shape (candidates, n), infinite where a fit failed.
    """

    recipe: Recipe
    fit: RecipeFit
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
        seed: Of folds, weights and starts.
        executor: Where fits run; here and one by one if not given.
        progress: Called with (fits done, fits in all).

    Raises:
        DataError: The pushes cannot determine a surface.
        RangeError: There are fewer than two folds, or more of them than pushes.
    """
    count = len(pairs)
    recipes = list(candidates or default_candidates(count, support is not None))
    if folds < 2:
        raise RangeError(f"folds must be at least 2, got {folds}")
    scaled = scale_pairs(pairs, scaling)
    check_support(scaled, FEWEST_PAIRS + 2)
    if folds > count:
        raise RangeError(f"folds must be at most one for each of the {count} pushes, got {folds}")
    scaling = scaled.scaling
    parts = np.array_split(np.random.default_rng(seed).permutation(count), folds)
    angles = np.full((len(recipes), count), np.inf)
    for row, recipe in enumerate(recipes):
        compared = replace(recipe, members=min(recipe.members, _MEMBERS_COMPARED))
        for done, part in enumerate(parts):
            seen = np.setdiff1d(np.arange(count), part)
            held_out = Pairs(pairs.wrenches[part], pairs.twists[part])
            training = Pairs(pairs.wrenches[seen], pairs.twists[seen])
            try:
                fit = fit_recipe(
                    training,
                    compared,
                    scaling=scaling,
                    support=support,
                    seed=seed,
                    executor=executor,
                )
                angles[row, part] = angle_error(fit.surface, held_out)
            except LimitSurfaceError:
                # A candidate that a fold cannot support stays infinitely bad.
                pass
            if progress is not None:
                progress(row * len(parts) + done + 1, len(recipes) * len(parts))
    if not np.isfinite(angles).all(axis=1).any():
        raise DataError("no candidate could be fitted to every fold: give more pushes")
    recipe = recipes[_chosen(angles)]
    fit = fit_recipe(pairs, recipe, scaling=scaling, support=support, seed=seed, executor=executor)
    return Choice(recipe, fit, tuple(recipes), angles)


def _chosen(angles: Floats) -> int:
    """Return the row that wins against those before it by a clear margin."""
    sound = np.flatnonzero(np.isfinite(angles).all(axis=1))
    chosen = int(sound[0])
    for row in sound[1:]:
        gains = angles[chosen] - angles[row]
        if gains.mean() > _MARGIN * gains.std(ddof=1) / np.sqrt(gains.size):
            chosen = int(row)
    return chosen
