# SPDX-License-Identifier: Apache-2.0
"""What a fit returns: the surface, how it was found, and how good it is."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.errors import SolverError
from limit_surface_ros.fitting.search import descents
from limit_surface_ros.surface.measures import mean_angle, quantiles, velocity_error

if TYPE_CHECKING:
    from collections.abc import Mapping

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.fitting.objective import Objective
    from limit_surface_ros.fitting.search import Descent, Search
    from limit_surface_ros.surface.base import LimitSurface
    from limit_surface_ros.surface.pairs import Pairs

# A surface on whose scale the median of the fitted loads is further out or in has lost them.
_SOUND = 3.0


@dataclass(frozen=True)
class Errors:
    """How a surface does on pairs.

    Attributes:
        pairs: How many pairs.
        velocity: Quantiles 50, 95 and 100 % of |v - v^| of unit scaled twists, shape (3,).
        mean_angle: Mean angle between the twists [rad], in scaled variables.
    """

    pairs: int
    velocity: Floats
    mean_angle: float

    def summary(self) -> dict[str, Any]:
        """Return plain values for a model file."""
        return {
            "pairs": self.pairs,
            "velocity_error_50_95_100": [float(f"{value:.6g}") for value in self.velocity],
            "mean_angle_rad": float(f"{self.mean_angle:.6g}"),
        }


def errors_on(surface: LimitSurface, pairs: Pairs) -> Errors:
    """Measure a surface on pairs."""
    return Errors(
        pairs=len(pairs),
        velocity=quantiles(velocity_error(surface, pairs)),
        mean_angle=mean_angle(surface, pairs),
    )


@dataclass(frozen=True)
class FitResult:
    """A fitted surface and how it came about.

    Attributes:
        surface: The surface, in physical units.
        objective: What was minimised, in words.
        cost: Its value at the surface.
        start_costs: The costs that the starts led to, the best first.
        iterations: Steps of the best start.
        gradient_norm: Largest component of the gradient at the surface.
        converged: Whether the best start ended because nothing more was to be gained.
        wall_time: Time the fit took [s].
        training: Errors on the pairs that were fitted.
        held_out: Errors on pairs that were not, if there are any.
        details: What else there is to say, plain values.
    """

    surface: LimitSurface
    objective: str
    cost: float
    start_costs: tuple[float, ...]
    iterations: int
    gradient_norm: float
    converged: bool
    wall_time: float
    training: Errors
    held_out: Errors | None = None
    details: Mapping[str, Any] = field(default_factory=dict)

    def tested_on(self, pairs: Pairs) -> FitResult:
        """Return the result with errors on held-out pairs."""
        return replace(self, held_out=errors_on(self.surface, pairs))

    def summary(self) -> dict[str, Any]:
        """Return plain values for a model file."""
        values: dict[str, Any] = {
            "objective": self.objective,
            "cost": self.cost,
            "start_costs": [float(f"{cost:.6g}") for cost in self.start_costs],
            "iterations": self.iterations,
            "gradient_norm": float(f"{self.gradient_norm:.3g}"),
            "converged": self.converged,
            "wall_time_s": float(f"{self.wall_time:.3g}"),
            "training": self.training.summary(),
        }
        if self.held_out is not None:
            values["held_out"] = self.held_out.summary()
        return values | dict(self.details)


def solve(objective: Objective, name: str, pairs: Pairs, search: Search) -> FitResult:
    """Minimise an objective and return the best surface that did not collapse.

    With a heavy weight on motions the loads may count so little that the surface shrinks to
    nothing or grows without bound; such starts are passed over.

    Args:
        objective: What to minimise.
        name: What it is, in words.
        pairs: The pairs behind it, for the errors of the result.
        search: Starts, seed, where and how to run.

    Raises:
        SolverError: No start led to a surface that passes through the loads.
    """
    begin = time.perf_counter()
    found = descents(objective, search)
    best, surface = _first_sound(objective, found, pairs)
    return FitResult(
        surface=surface,
        objective=name,
        cost=best.cost,
        start_costs=tuple(each.cost for each in found),
        iterations=best.iterations,
        gradient_norm=best.gradient_norm,
        converged=best.converged,
        wall_time=time.perf_counter() - begin,
        training=errors_on(surface, pairs),
    )


def is_sound(surface: LimitSurface, pairs: Pairs) -> bool:
    """Tell whether a surface has the scale of the pairs' loads and has not collapsed."""
    middle = float(np.median(surface.load_factor(pairs.wrenches)))
    return 1.0 / _SOUND < middle < _SOUND


def _first_sound(
    objective: Objective, found: list[Descent], pairs: Pairs
) -> tuple[Descent, LimitSurface]:
    for descent in found:
        surface = objective.surface(descent.parameters)
        if is_sound(surface, pairs):
            return descent, surface
    raise SolverError(
        "every start lost the scale of the loads: lower the velocity weight or take fewer terms"
    )
