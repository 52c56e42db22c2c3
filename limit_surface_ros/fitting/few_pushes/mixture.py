# SPDX-License-Identifier: Apache-2.0
"""Mixtures of dissipation models: a fit of few pushes that needs no choice among them.

Dissipations add: D = sum_j w_j D_j is the Minkowski average of the sets of loads, a dissipation
model again, of the terms w_j^2 B_k. An ellipsoid f' A f <= 1 is the single term inv(A).

Choosing one model of few pushes costs accuracy, for the best of several on held-out pushes is
mostly the luckiest. An average with weights that are nearly fixed loses nothing to the best of
them. They leave the usual weights only as far as the pushes pay for it: what is least is

    sum_i rho(|v_i - v^_i|) + 0.3 sum_j w_j log(w_j / u_j)

over the pushes, each held out once, with the relative entropy to the usual weights u. So with two
dozen pushes the usual weights stay, and with thousands the best model takes all.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import DataError, SolverError
from limit_surface_ros.fitting.few_pushes.recipe import ROBUST_SCALE, Recipe
from limit_surface_ros.fitting.motion_cost import direction_loss
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.measures import angle_error

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.fitting.few_pushes.cross_validation import Fold
    from limit_surface_ros.fitting.few_pushes.recipe import FitContext
    from limit_surface_ros.fitting.search import Descent
    from limit_surface_ros.surface.base import LimitSurface

# Terms that sum up a pressure: with more, predictions are no better and maps slower.
_TERMS = 8
# Smallest eigenvalue of an ellipsoid in parts of its largest.
_FLATTEST = 1e-4
# How much the relative entropy to the usual weights counts against the loss of all pushes.
_ENTROPY_WEIGHT = 0.3
# Shares of the way from the usual weights to one model alone that are tried.
_WAYS = (0.25, 0.5, 0.75, 1.0)
_ROUNDS = 3

PRESSURE = Recipe(terms=_TERMS, prior="pressure", prior_weight=5.0)
THREE_TERMS = Recipe(terms=3, prior="ellipsoid", prior_weight=2.0)
ELLIPSOID = Recipe("power_sum", 1)
SUPPORT = Recipe(prior="support", prior_weight=20.0)


def usual_mixture(with_support: bool) -> list[tuple[Recipe, float]]:
    """Return the recipes that are mixed, with their usual weights.

    Args:
        with_support: Whether support points are known.
    """
    if with_support:
        return [(SUPPORT, 0.7), (PRESSURE, 0.2), (THREE_TERMS, 0.07), (ELLIPSOID, 0.03)]
    return [(PRESSURE, 0.8), (THREE_TERMS, 0.15), (ELLIPSOID, 0.05)]


def mixed(parts: Iterable[tuple[float, LimitSurface]]) -> Dissipation:
    """Return the Minkowski average of surfaces of one scaling.

    Args:
        parts: Weights above zero, of a sum of 1, and `Dissipation` models or ellipsoids, which are
            power sums of one term.

    Raises:
        DataError: There is none, or one is of another kind or scaling.

    Example:
        >>> import numpy as np
        >>> one, three = (Dissipation(r**2 * np.eye(3)[None]) for r in (1.0, 3.0))
        >>> float(mixed([(0.5, one), (0.5, three)]).load_factor([2.0, 0.0, 0.0]))
        1.0
    """
    given = list(parts)
    if not given:
        raise DataError("a mixture needs at least one surface")
    scaling = given[0][1].scaling
    if any(surface.scaling != scaling for _, surface in given):
        raise DataError("surfaces of a mixture must have one scaling")
    matrices = [weight**2 * as_dissipation(surface) for weight, surface in given]
    return Dissipation(np.concatenate(matrices), scaling)


def as_dissipation(surface: LimitSurface) -> Floats:
    """Return the matrices of the dissipation model that a surface is, shape (k, 3, 3).

    Raises:
        DataError: It is neither a dissipation model nor an ellipsoid.
    """
    if isinstance(surface, Dissipation):
        return surface.matrices
    if isinstance(surface, PowerSum) and len(surface.matrices) == 1:
        values, axes = np.linalg.eigh(surface.matrices)
        # A direction of load that no push had would have no limit at all.
        bounded = np.maximum(values, _FLATTEST * values.max())
        return np.asarray((axes / bounded[:, None]) @ axes.transpose(0, 2, 1))
    raise DataError(f"a {surface.kind} is not the sum of dissipations that a mixture takes")


@dataclass(frozen=True)
class Mixture:
    """Recipes and how much each counts.

    Attributes:
        parts: Recipes with their weights, above zero and of a sum of 1.
    """

    parts: tuple[tuple[Recipe, float], ...]

    def fit(self, context: FitContext) -> tuple[Dissipation, list[Descent]]:
        """Fit every part to the pushes of a context; return the mixture and how parts were found.

        A part that does not pass through the loads is left out, as long as another does.

        Raises:
            DataError: The pushes cannot determine a surface, or support points are needed.
            SolverError: No part passes through the loads.
        """
        found: list[tuple[float, LimitSurface, Descent]] = []
        failed = SolverError("a mixture without parts")
        for recipe, weight in self.parts:
            try:
                found.append((weight, *context.fit(recipe)))
            except SolverError as error:
                failed = error
        if not found:
            raise failed
        total = sum(weight for weight, _, _ in found)
        surface = mixed((weight / total, surface) for weight, surface, _ in found)
        return surface, [descent for _, _, descent in found]

    def of_fold(self, fold: Fold, recipes: Sequence[Recipe]) -> Dissipation:
        """Return the mixture of what the recipes made of a fold."""
        made = dict(zip(recipes, fold.surfaces, strict=True))
        surfaces = ((weight, made[recipe]) for recipe, weight in self.parts)
        return mixed((weight, each) for weight, each in surfaces if each is not None)

    def __str__(self) -> str:
        """Return the mixture in words."""
        if len(self.parts) == 1:
            return str(self.parts[0][0])
        return "mixture of " + "; ".join(f"{weight:.2g} {recipe}" for recipe, weight in self.parts)


def choose_mixture(folds: Sequence[Fold], usual: Sequence[tuple[Recipe, float]]) -> Mixture:
    """Return the weights that the held-out pushes pay for, beginning from the usual ones.

    Recipes that could not be fitted to every fold are left out.

    Args:
        folds: Of a cross-validation of the recipes.
        usual: Recipes and usual weights, in the order of the folds' surfaces.
    """
    recipes = [recipe for recipe, _ in usual]
    sound = np.array(
        [all(fold.surfaces[row] is not None for fold in folds) for row in range(len(usual))]
    )
    prior = np.array([weight for _, weight in usual]) * sound
    prior /= prior.sum()

    def mixture(weights: Floats) -> Mixture:
        pairs = zip(recipes, weights.tolist(), strict=True)
        return Mixture(tuple((recipe, weight) for recipe, weight in pairs if weight > 0.0))

    def cost(weights: Floats) -> float:
        loss = 0.0
        for fold in folds:
            surface = mixture(weights).of_fold(fold, recipes)
            cosines = np.cos(angle_error(surface, fold.held_out))
            loss += float(direction_loss(cosines, ROBUST_SCALE)[0].sum())
        used = weights > 0.0
        surprise = weights[used] @ np.log(weights[used] / prior[used])
        return loss + _ENTROPY_WEIGHT * float(surprise)

    best, least = prior, cost(prior)
    for _ in range(_ROUNDS):
        tried = [(cost(weights), weights) for weights in _others(best, sound)]
        lowest, weights = min(tried, key=lambda each: each[0], default=(least, best))
        if not lowest < least:
            break
        best, least = weights, lowest
    return mixture(best)


def _others(weights: Floats, sound: Floats) -> Iterator[Floats]:
    """Yield weights on the way to each model alone, and those without each of the models."""
    for row in np.flatnonzero(sound):
        alone = np.eye(len(weights))[row]
        for way in _WAYS:
            if weights[row] < 1.0:
                yield (1.0 - way) * weights + way * alone
        if 0.0 < weights[row] < 1.0:
            without = weights * (1.0 - alone)
            yield without / without.sum()
