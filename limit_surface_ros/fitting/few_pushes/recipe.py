# SPDX-License-Identifier: Apache-2.0
"""How to fit few, noisy pushes: kind, terms, weights and prior.

Two means keep a fit of many parameters to few pushes from following their errors: the error of
motion is robust, see `motion_cost`, and the fit is regularised by a prior, a simpler surface of
the same pushes, which is

- the pressure that fits them best, on contacts spread over wherever the body may stand, summed up
  in a few; or that on known support points; as a Gaussian prior on the factors of the terms;
- or the ellipsoid that fits them, through pairs on it that count a little.

Isotropic friction under some pressure is a prior and no constraint: with more pushes, or a smaller
prior weight, every matrix of the dissipation model is free.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from limit_surface_ros.checks import counted
from limit_surface_ros.errors import DataError, RangeError, SolverError
from limit_surface_ros.fitting.dissipation import (
    DirectionObjective,
)
from limit_surface_ros.fitting.factors import (
    factors_of_matrices,
    floored_parameters,
    parameters_of,
)
from limit_surface_ros.fitting.few_pushes.pressure import SmallContacts, fit_pressure
from limit_surface_ros.fitting.objective import RegularisedObjective
from limit_surface_ros.fitting.pairs import ScaledPairs, check_support, scale_pairs
from limit_surface_ros.fitting.power_sum import PowerSumObjective
from limit_surface_ros.fitting.result import is_sound
from limit_surface_ros.fitting.search import descend, descend_from_seed
from limit_surface_ros.surface.pairs import Pairs
from limit_surface_ros.surface.sampling import random_loads

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.fitting.objective import Objective
    from limit_surface_ros.fitting.search import Descent
    from limit_surface_ros.surface.base import LimitSurface
    from limit_surface_ros.surface.kinds.point_contacts import PointContacts
    from limit_surface_ros.surface.scaling import Scaling

Prior = Literal["none", "ellipsoid", "pressure", "support"]

# Pushes fewer than an ellipsoid's parameters say nothing, whatever the prior.
FEWEST_PAIRS = 6
# Chord between unit motions beyond which its cost grows linearly.
ROBUST_SCALE = 0.2
# Weight of the motions against the loads.
VELOCITY_WEIGHT = 2.0
# Share of a term that keeps it smooth; see `factors`.
_FLOOR = 1e-3
# Terms that sum up known support points, where there are more of them: those of a patch are many.
_MOST_KNOWN = 8
# Share of the loads' second moment that a start has along every direction.
_THINNEST = 1e-6
# Pairs that stand for the ellipsoid.
_ELLIPSOID_PAIRS = 40
# How much the usual pressure counts: little where nothing is known, much at known points.
_ENTROPY_WEIGHT = {"pressure": 0.05, "support": 30.0}
# Relative gain of a step below which a fit ends: noisy pushes do not tell closer minima apart, but
# power sums descend slowly at first.
_PRECISION = {"power_sum": 1e-6, "dissipation": 1e-4}


@dataclass(frozen=True)
class Recipe:
    """One way to fit a surface.

    Attributes:
        kind: "power_sum" of norms, or "dissipation", fitted on directions.
        terms: How many terms at most; with known support points there is one for each of them, or
            eight that stand for them all where they are more.
        velocity_weight: Weight of the motions against the loads.
        prior: The simpler surface of the same pushes that regularises the fit.
        prior_weight: How much that counts: pushes' worth for the ellipsoid, for the others the
            inverse variance of the scaled factors of a term, for each term.

    Raises:
        RangeError: The parts do not fit together.
    """

    kind: Literal["power_sum", "dissipation"] = "dissipation"
    terms: int = 3
    velocity_weight: float = VELOCITY_WEIGHT
    prior: Prior = "none"
    prior_weight: float = 1.0

    def __post_init__(self) -> None:
        """Check what belongs together."""
        if self.terms < 1:
            raise RangeError("a recipe needs at least one term")
        if self.prior in _ENTROPY_WEIGHT and self.kind != "dissipation":
            raise RangeError("only dissipation models can have a pressure as their prior")
        if not self.velocity_weight >= 0.0 or not self.prior_weight > 0.0:
            raise RangeError("velocity_weight must not be negative, prior_weight must be above 0")

    def __str__(self) -> str:
        """Return the recipe in words."""
        words: list[str] = [self.kind if self.kind == "dissipation" else "power_sum (norms)"]
        if self.prior != "support":
            words.append(counted(self.terms, "term"))
        words.append(f"velocity weight {self.velocity_weight:g}")
        if self.prior != "none":
            words.append(f"prior {self.prior}, prior weight {self.prior_weight:g}")
        return ", ".join(words)


@dataclass(frozen=True)
class FitContext:
    """Pushes, and the intermediate results that several recipes share.

    Attributes:
        pairs: Recorded pushes.
        scaling: Characteristic length and friction force; chosen from the pairs if not given.
        support: The known support points, for recipes whose prior they are; only the ratios of the
            friction limits count, their size is taken from the pushes.
        weights: How much each push counts, shape (n,); 1 each if not given.
        seed: Of random starts.
    """

    pairs: Pairs
    scaling: Scaling | None = None
    support: PointContacts | None = None
    weights: Floats | None = None
    seed: int = 0
    _pressures: dict[tuple[str, float], SmallContacts] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    @cached_property
    def scaled(self) -> ScaledPairs:
        """The pushes in scaled variables, with their weights.

        Raises:
            DataError: They cannot determine a surface.
        """
        scaled = scale_pairs(self.pairs, self.scaling)
        check_pushes(scaled, FEWEST_PAIRS)
        return scaled if self.weights is None else scaled.weighted(self.weights)

    def fit(self, recipe: Recipe) -> tuple[LimitSurface, Descent]:
        """Fit the pushes by a recipe; return the surface and how it was found.

        Raises:
            DataError: The pushes cannot determine a surface, or support points are needed.
            SolverError: The surface does not pass through the loads.
        """
        objective = self._objective(recipe)
        if recipe.kind == "power_sum" and recipe.terms == 1:
            descent = _ellipsoid(objective, self.scaled)
        else:
            descent = descend_from_seed(objective, self.seed, 0, _PRECISION[recipe.kind])
        surface = objective.surface(descent.parameters)
        if not is_sound(surface, self.pairs):
            raise SolverError(f"the fit by {recipe} does not pass through the loads")
        return surface, descent

    def pressure(self, prior: Prior, velocity_weight: float) -> SmallContacts:
        """Return the contacts that carry the body, by the pushes and what is known before.

        Args:
            prior: "pressure", from contacts all over, or "support", from the known points.
            velocity_weight: Weight of the motions against the loads.

        Raises:
            DataError: Support points are needed, and none are known.
        """
        known = self._pressures.get((prior, velocity_weight))
        if known is not None:
            return known
        if prior == "pressure":
            usual = SmallContacts.on_a_disc(self.scaled)
        elif self.support is not None:
            usual = SmallContacts.at(self.support, self.scaled)
        else:
            raise DataError("no support points are known that the prior could be made of")
        found = fit_pressure(
            self.scaled, usual, _ENTROPY_WEIGHT[prior], velocity_weight, ROBUST_SCALE
        ).loaded()
        self._pressures[prior, velocity_weight] = found
        return found

    def _objective(self, recipe: Recipe) -> Objective:
        pairs, weight = self.scaled, recipe.velocity_weight
        if recipe.prior in _ENTROPY_WEIGHT:
            contacts = self.pressure(recipe.prior, weight)
            contacts = contacts.merged(recipe.terms if recipe.prior == "pressure" else _MOST_KNOWN)
            matrices = contacts.matrices
            free = DirectionObjective(pairs, len(matrices), weight, ROBUST_SCALE, _FLOOR)
            centre = floored_parameters(matrices, _FLOOR)
            return RegularisedObjective(free, centre, recipe.prior_weight * len(matrices))
        if recipe.prior == "ellipsoid":
            pairs = pairs.joined(_ellipsoid_pairs(pairs, weight, recipe.prior_weight))
        if recipe.kind == "dissipation":
            return DirectionObjective(pairs, recipe.terms, weight, ROBUST_SCALE, _FLOOR)
        return PowerSumObjective(pairs, np.full(recipe.terms, 0.5), weight, ROBUST_SCALE)


def check_pushes(pairs: ScaledPairs, fewest: int) -> None:
    """Refuse pushes that say nothing, whatever the prior.

    Raises:
        DataError: They are fewer than `fewest`, or see `check_support`.
    """
    if len(pairs) < fewest:
        raise DataError(
            f"{len(pairs)} pushes are too few, even for a regularised fit: "
            f"at least {fewest} are needed"
        )
    check_support(pairs, 0)


def _ellipsoid(objective: Objective, pairs: ScaledPairs) -> Descent:
    """Return the best descent of one norm's, from starts that the loads themselves suggest.

    The cost has several minima, and one random start in ten ends in a bad one. Loads that are
    spread evenly over an ellipsoid f' A f = 1 have the second moment inv(A) / 3; one-sided or few
    ones have another, for which its diagonal, and that with equal forces, stand in.
    """
    moment = 3.0 * pairs.wrenches.T @ (pairs.wrenches * pairs.weights[:, None])
    moment /= pairs.weights.sum()
    own = np.diag(moment)
    force = 0.5 * (own[0] + own[1])
    sizes = np.array([force, force, max(float(own[2]), _THINNEST * force)])
    round_ones = (np.diag(np.maximum(own, _THINNEST * own.max())), np.diag(sizes))
    starts = [
        np.linalg.inv(each)
        for each in (moment + _THINNEST * np.trace(moment) * np.eye(3), *round_ones)
    ]
    found = [
        descend(objective, parameters_of(factors_of_matrices(each[None])), _PRECISION["power_sum"])
        for each in starts
    ]
    return min(found, key=lambda each: each.cost)


def _ellipsoid_pairs(pairs: ScaledPairs, weight: float, prior_weight: float) -> ScaledPairs:
    """Return pairs spread over the ellipsoid that fits `pairs`, with `prior_weight` in all."""
    objective = PowerSumObjective(pairs, np.array([0.5]), weight, ROBUST_SCALE)
    surface = objective.surface(_ellipsoid(objective, pairs).parameters)
    spread = scale_pairs(random_loads(surface, _ELLIPSOID_PAIRS, 0), pairs.scaling)
    return spread.weighted(np.full(_ELLIPSOID_PAIRS, prior_weight / _ELLIPSOID_PAIRS))
