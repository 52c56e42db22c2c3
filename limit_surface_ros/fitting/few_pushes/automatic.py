# SPDX-License-Identifier: Apache-2.0
"""The fit that asks for no choice: a mixture of models, and how sure its twists are."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.fitting.few_pushes.bootstrap import bootstrap, stored_surfaces
from limit_surface_ros.fitting.few_pushes.calibration import calibrate
from limit_surface_ros.fitting.few_pushes.cross_validation import cross_validate
from limit_surface_ros.fitting.few_pushes.mixture import choose_mixture, usual_mixture
from limit_surface_ros.fitting.few_pushes.recipe import ROBUST_SCALE, VELOCITY_WEIGHT, FitContext
from limit_surface_ros.fitting.motion_cost import MotionCost
from limit_surface_ros.fitting.pairs import scale_pairs
from limit_surface_ros.fitting.result import FitResult, errors_on
from limit_surface_ros.fitting.search import Search
from limit_surface_ros.surface.measures import angle_error

if TYPE_CHECKING:
    from limit_surface_ros.fitting.few_pushes.cross_validation import Fold
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
    """Fit a mixture of dissipation models to recorded pushes, and how its twists scatter.

    The result's details hold the mean angle of every part and of the mixture on held-out pushes,
    under "uncertainty" what `surface.kinds.dissipation_scatter.scatter_of` reads, and under
    "calibration" which shares of the held-out pushes lie inside of which regions.

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
        SolverError: A part of the mixture does not pass through the loads.
    """
    search = search or Search()
    begin = time.perf_counter()
    usual = usual_mixture(support is not None)
    recipes = [recipe for recipe, _ in usual]
    scaled = scale_pairs(pairs, scaling)
    scaling = scaled.scaling
    held_out = cross_validate(
        pairs,
        recipes,
        folds=folds,
        scaling=scaling,
        support=support,
        seed=search.seed,
        executor=search.executor,
        progress=_from(search.progress, 0, folds + refits),
    )
    mixture = choose_mixture(held_out, usual)
    surface, parts = mixture.fit(FitContext(pairs, scaling, support, seed=search.seed))
    of_folds = [mixture.of_fold(fold, recipes) for fold in held_out]
    calibration = calibrate(surface, of_folds, [fold.held_out for fold in held_out])
    predicted = [
        angle_error(of_fold, fold.held_out)
        for of_fold, fold in zip(of_folds, held_out, strict=True)
    ]
    details: dict[str, Any] = {
        "cross_validation_mean_angle_deg": {
            str(recipe): _mean_angle(held_out, row)
            for row, recipe in enumerate(recipes)
            if all(fold.surfaces[row] is not None for fold in held_out)
        }
        | {"mixture": _degrees(float(np.concatenate(predicted).mean()))},
        "uncertainty": calibration.scatter.stored(),
        "calibration": calibration.summary(),
    }
    if refits:
        surfaces = bootstrap(
            pairs,
            mixture,
            refits,
            scaling=scaling,
            support=support,
            seed=search.seed,
            executor=search.executor,
            progress=_from(search.progress, folds, folds + refits),
        )
        details["bootstrap"] = stored_surfaces(surfaces)
    cost, _ = MotionCost(scaled, VELOCITY_WEIGHT, ROBUST_SCALE).of(surface.matrices)
    return FitResult(
        surface=surface,
        objective=str(mixture),
        cost=cost,
        start_costs=(cost,),
        iterations=sum(part.iterations for part in parts),
        gradient_norm=max(part.gradient_norm for part in parts),
        converged=all(part.converged for part in parts),
        wall_time=time.perf_counter() - begin,
        training=errors_on(surface, pairs),
        details=details,
    )


def _mean_angle(folds: list[Fold], row: int) -> float:
    """Return the mean angle [deg] of one recipe's fits on what the folds held out."""
    angles = []
    for fold in folds:
        surface = fold.surfaces[row]
        assert surface is not None
        angles.append(angle_error(surface, fold.held_out))
    return _degrees(float(np.concatenate(angles).mean()))


def _degrees(angle: float) -> float:
    return round(float(np.degrees(angle)), 3)


def _from(progress: Progress | None, before: int, total: int) -> Progress | None:
    """Return what tells of a part of the work: so much is done before it, of so much in all."""
    if progress is None:
        return None
    return lambda done, _: progress(before + done, total)
