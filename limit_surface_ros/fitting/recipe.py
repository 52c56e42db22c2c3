"""How to fit few, noisy pushes: kind, terms, weights, what it is held towards, and averaging.

Three means keep a fit of many parameters to few pushes from following their errors:

- it is held towards a simpler surface: the ellipsoid that fits the pushes, through pairs on it
  that count a little, or the surface of known support points, as a Gaussian prior on the factors;
- the error of motion is robust, see `direction_loss`;
- it is the mean of several members, each fitted to the pushes with random weights (the Bayesian
  bootstrap, Rubin 1981, doi:10.1214/aos/1176345338) from a start of its own, so that neither a
  single push nor a poor minimum decides.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from limit_surface_ros.errors import DataError, RangeError, SolverError
from limit_surface_ros.fitting.averaging import mean_surface
from limit_surface_ros.fitting.combined_objectives import HeldObjective
from limit_surface_ros.fitting.dissipation_direction_objective import (
    DissipationDirectionObjective,
)
from limit_surface_ros.fitting.multi_start import descend_from_seed
from limit_surface_ros.fitting.power_sum_objective import PowerSumObjective
from limit_surface_ros.fitting.scaled_pairs import ScaledPairs, check_support, scale_pairs
from limit_surface_ros.fitting.solve import is_sound
from limit_surface_ros.fitting.support_prior import support_factors
from limit_surface_ros.surface.power_sum import thesis_exponents
from limit_surface_ros.surface.sampling import random_loads

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from limit_surface_ros.fitting.multi_start import Descent
    from limit_surface_ros.fitting.objective import Objective
    from limit_surface_ros.surface.pairs import Pairs
    from limit_surface_ros.surface.point_contacts import PointContacts
    from limit_surface_ros.surface.protocol import LimitSurface
    from limit_surface_ros.surface.scaling import Scaling

Towards = Literal["nothing", "ellipsoid", "support"]

# Pushes fewer than an ellipsoid's parameters say nothing, whatever a fit is held towards.
FEWEST_PAIRS = 6
# Share of a term that keeps it smooth; see `dissipation_parameters`.
_FLOOR = 1e-3
# Pairs that stand for the ellipsoid.
_ELLIPSOID_PAIRS = 40
# Noisy pushes do not tell closer minima apart.
_PRECISION = 1e-6


@dataclass(frozen=True)
class Recipe:
    """One way to fit a surface.

    Attributes:
        kind: "power_sum" or "dissipation" (fitted on directions).
        terms: How many terms; of no meaning when held towards support points, which give one each.
        family: Exponents of a power sum: "norms" or "thesis".
        velocity_weight: Weight of the motions against the loads.
        robust_scale: Chord between unit motions beyond which its cost grows linearly; None
            squares all.
        towards: What the fit is held towards.
        strength: How much that counts: pushes' worth for the ellipsoid, inverse variance of the
            scaled factors for support points.
        members: How many fits are averaged; 1 is one fit to the pushes as they are.

    Raises:
        RangeError: The parts do not fit together.
    """

    kind: Literal["power_sum", "dissipation"] = "dissipation"
    terms: int = 3
    family: Literal["norms", "thesis"] = "norms"
    velocity_weight: float = 2.0
    robust_scale: float | None = 0.2
    towards: Towards = "nothing"
    strength: float = 1.0
    members: int = 1

    def __post_init__(self) -> None:
        """Check what belongs together."""
        if self.terms < 1 or self.members < 1:
            raise RangeError("a recipe needs at least one term and one member")
        if self.towards == "support" and self.kind != "dissipation":
            raise RangeError("only dissipation models can be held towards support points")
        if not self.velocity_weight >= 0.0 or not self.strength > 0.0:
            raise RangeError("velocity_weight must not be negative, strength must be above 0")

    def __str__(self) -> str:
        """Return the recipe in words."""
        words = [self.kind if self.kind == "dissipation" else f"{self.kind} ({self.family})"]
        if self.towards != "support":
            words.append(f"{self.terms} terms")
        words.append(f"velocity weight {self.velocity_weight:g}")
        if self.towards != "nothing":
            words.append(f"towards {self.towards} {self.strength:g}")
        if self.members > 1:
            words.append(f"mean of {self.members}")
        return ", ".join(words)


@dataclass(frozen=True)
class RecipeFit:
    """What a recipe made of pushes.

    Attributes:
        surface: The surface, in physical units.
        members: The surfaces of which it is the mean.
        descents: How each member was found.
    """

    surface: LimitSurface
    members: tuple[LimitSurface, ...]
    descents: tuple[Descent, ...]


def fit_recipe(
    pairs: Pairs,
    recipe: Recipe,
    *,
    scaling: Scaling | None = None,
    support: PointContacts | None = None,
    seed: int = 0,
    executor: Executor | None = None,
) -> RecipeFit:
    """Fit pushes by a recipe.

    Args:
        pairs: Recorded pushes.
        recipe: How to fit.
        scaling: Characteristic length and friction force; chosen from the pairs if not given.
        support: The known support points, for recipes held towards them; only the ratios of the
            friction limits count, their size is taken from the pushes.
        seed: Of weights and starts.
        executor: Where members are fitted; here and one by one if not given.

    Raises:
        DataError: The pushes cannot determine a surface, or support points are needed.
        SolverError: No member passes through the loads.
    """
    scaled = scale_pairs(pairs, scaling)
    check_support(scaled, FEWEST_PAIRS)
    tasks = [
        (_objective(scaled.weighted(weights), recipe, support), seed, index, _PRECISION)
        for index, weights in enumerate(_weights(len(scaled), recipe.members, seed))
    ]
    if executor is None:
        descents = [descend_from_seed(*task) for task in tasks]
    else:
        futures = [executor.submit(descend_from_seed, *task) for task in tasks]
        descents = [future.result() for future in futures]
    found = [
        (task[0].surface(descent.parameters), descent)
        for task, descent in zip(tasks, descents, strict=True)
    ]
    sound = [each for each in found if is_sound(each[0], pairs)]
    if not sound:
        raise SolverError(f"no fit by {recipe} passes through the loads")
    members = tuple(surface for surface, _ in sound)
    return RecipeFit(mean_surface(members), members, tuple(descent for _, descent in sound))


def _weights(pairs: int, members: int, seed: int) -> list[np.ndarray]:
    """Return each member's weights of the pairs, of mean 1."""
    if members == 1:
        return [np.ones(pairs)]
    drawn = np.random.default_rng([seed, members]).exponential(size=(members, pairs))
    return list(drawn / drawn.mean(axis=1, keepdims=True))


def _objective(pairs: ScaledPairs, recipe: Recipe, support: PointContacts | None) -> Objective:
    weight, robust = recipe.velocity_weight, recipe.robust_scale
    if recipe.towards == "support":
        if support is None:
            raise DataError("no support points are known that the fit could be held towards")
        centre = support_factors(support, pairs)
        terms = len(support.points)
        directions = DissipationDirectionObjective(pairs, terms, weight, robust, _FLOOR)
        return HeldObjective(directions, centre, recipe.strength)
    if recipe.towards == "ellipsoid":
        pairs = pairs.joined(_ellipsoid_pairs(pairs, weight, robust, recipe.strength))
    if recipe.kind == "dissipation":
        return DissipationDirectionObjective(pairs, recipe.terms, weight, robust, _FLOOR)
    exponents = (
        thesis_exponents(recipe.terms) if recipe.family == "thesis" else np.full(recipe.terms, 0.5)
    )
    return PowerSumObjective(pairs, exponents, weight, robust)


def _ellipsoid_pairs(
    pairs: ScaledPairs, weight: float, robust: float | None, strength: float
) -> ScaledPairs:
    """Return pairs spread over the ellipsoid that fits `pairs`, that count `strength` together."""
    objective = PowerSumObjective(pairs, np.array([0.5]), weight, robust)
    surface = objective.surface(descend_from_seed(objective, 0, 0).parameters)
    spread = scale_pairs(random_loads(surface, _ELLIPSOID_PAIRS, 0), pairs.scaling)
    return spread.weighted(np.full(_ELLIPSOID_PAIRS, strength / _ELLIPSOID_PAIRS))
