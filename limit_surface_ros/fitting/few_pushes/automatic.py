# SPDX-License-Identifier: Apache-2.0
"""The fit that asks for no choice: a recipe by cross-validation, refitted on all pushes."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.fitting.few_pushes.cross_validation import choose_recipe
from limit_surface_ros.fitting.few_pushes.uncertainty import bootstrap, stored_surfaces
from limit_surface_ros.fitting.result import FitResult, errors_on
from limit_surface_ros.fitting.search import Search

if TYPE_CHECKING:
    from limit_surface_ros.fitting.search import Progress
    from limit_surface_ros.surface.kinds.point_contacts import PointContacts
    from limit_surface_ros.surface.pairs import Pairs
    from limit_surface_ros.surface.scaling import Scaling


def fit_automatically(
    pairs: Pairs,
    *,
    scaling: Scaling | None = None,
    support: PointContacts | None = None,
    folds: int = 5,
    refits: int = 0,
    search: Search | None = None,
) -> FitResult:
    """Choose a recipe by cross-validation, refit it on all pushes, and say what was chosen.

    Args:
        pairs: Recorded pushes.
        scaling: Characteristic length and friction force; chosen from the pairs if not given.
        support: Known support points, if there are any.
        folds: Of the cross-validation.
        refits: Of a bootstrap whose surfaces go into the result's details; 0 for none.
        search: Seed, where to run, and progress.

    Raises:
        DataError: The pushes cannot determine a surface.
        RangeError: There are fewer than two folds, or one refit.
    """
    search = search or Search()
    begin = time.perf_counter()
    choice = choose_recipe(
        pairs,
        folds=folds,
        scaling=scaling,
        support=support,
        seed=search.seed,
        executor=search.executor,
        progress=_from(search.progress, 0, folds + refits),
    )
    descent = choice.descent
    details: dict[str, Any] = {
        "cross_validation_mean_angle_deg": {
            str(recipe): round(float(np.degrees(angle)), 3)
            for recipe, angle in zip(choice.candidates, choice.angles.mean(axis=1), strict=True)
            if np.isfinite(angle)
        }
    }
    if refits:
        surfaces = bootstrap(
            pairs,
            choice.recipe,
            refits,
            scaling=choice.surface.scaling,
            support=support,
            seed=search.seed,
            executor=search.executor,
            progress=_from(search.progress, folds, folds + refits),
        )
        details["bootstrap"] = stored_surfaces(surfaces)
    return FitResult(
        surface=choice.surface,
        objective=str(choice.recipe),
        cost=descent.cost,
        start_costs=(descent.cost,),
        iterations=descent.iterations,
        gradient_norm=descent.gradient_norm,
        converged=descent.converged,
        wall_time=time.perf_counter() - begin,
        training=errors_on(choice.surface, pairs),
        details=details,
    )


def _from(progress: Progress | None, before: int, total: int) -> Progress | None:
    """Return what tells of a part of the work: so much is done before it, of so much in all."""
    if progress is None:
        return None
    return lambda done, _: progress(before + done, total)
