# SPDX-License-Identifier: Apache-2.0
"""What fits to a part of the pushes make of the others: k-fold cross-validation of recipes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import DataError, LimitSurfaceError, RangeError
from limit_surface_ros.fitting.few_pushes.recipe import FEWEST_PAIRS, FitContext, check_pushes
from limit_surface_ros.fitting.pairs import scale_pairs

if TYPE_CHECKING:
    from collections.abc import Sequence
    from concurrent.futures import Executor

    from limit_surface_ros.fitting.few_pushes.recipe import Recipe
    from limit_surface_ros.fitting.search import Progress
    from limit_surface_ros.surface.base import LimitSurface
    from limit_surface_ros.surface.kinds.point_contacts import PointContacts
    from limit_surface_ros.surface.pairs import Pairs
    from limit_surface_ros.surface.scaling import Scaling


@dataclass(frozen=True)
class Fold:
    """A part of the pushes that was held out.

    Attributes:
        held_out: The pushes of the part.
        surfaces: What each recipe made of all others; None where a fit failed.
    """

    held_out: Pairs
    surfaces: tuple[LimitSurface | None, ...]


def cross_validate(
    pairs: Pairs,
    recipes: Sequence[Recipe],
    *,
    folds: int = 5,
    scaling: Scaling | None = None,
    support: PointContacts | None = None,
    seed: int = 0,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> list[Fold]:
    """Fit every recipe to all pushes but a fold, for each of the folds.

    Args:
        pairs: Recorded pushes.
        recipes: What to fit.
        folds: k; each push is held out once.
        scaling: Characteristic length and friction force; chosen from all pairs if not given.
        support: Known support points, if there are any.
        seed: Of folds and starts.
        executor: Where folds are fitted; here and one by one if not given.
        progress: Called with (folds done, folds in all).

    Raises:
        DataError: The pushes cannot determine a surface.
        RangeError: There are fewer than two folds, or more of them than pushes.
    """
    count = len(pairs)
    if folds < 2:
        raise RangeError(f"folds must be at least 2, got {folds}")
    scaled = scale_pairs(pairs, scaling)
    check_pushes(scaled, FEWEST_PAIRS + 2)
    if folds > count:
        raise RangeError(f"folds must be at most one for each of the {count} pushes, got {folds}")
    parts = np.array_split(np.random.default_rng(seed).permutation(count), folds)
    tasks = []
    for part in parts:
        seen = np.setdiff1d(np.arange(count), part)
        training = pairs.take(seen)
        tasks.append((FitContext(training, scaled.scaling, support, seed=seed), tuple(recipes)))
    if executor is None:
        found = (fit_each(*task) for task in tasks)
    else:
        futures = [executor.submit(fit_each, *task) for task in tasks]
        found = (future.result() for future in futures)
    done: list[Fold] = []
    reasons: list[str] = []
    for part, (surfaces, refused) in zip(parts, found, strict=True):
        done.append(Fold(pairs.take(part), surfaces))
        reasons += refused
        if progress is not None:
            progress(len(done), folds)
    if all(None in row for row in zip(*(fold.surfaces for fold in done), strict=True)):
        raise DataError(f"nothing could be fitted to every fold of the pushes: {reasons[0]}")
    return done


def fit_each(
    context: FitContext, recipes: Sequence[Recipe]
) -> tuple[tuple[LimitSurface | None, ...], list[str]]:
    """Return the surface of each recipe, None where the pushes do not support it, and why not."""
    surfaces: list[LimitSurface | None] = []
    reasons: list[str] = []
    for recipe in recipes:
        try:
            surfaces.append(context.fit(recipe)[0])
        except LimitSurfaceError as error:
            surfaces.append(None)
            reasons.append(str(error))
    return tuple(surfaces), reasons
