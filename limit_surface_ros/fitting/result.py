# SPDX-License-Identifier: Apache-2.0
"""What a fit returns: the surface, how it was found, and how good it is."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from limit_surface_ros.surface.measures import mean_angle, quantiles, velocity_error

if TYPE_CHECKING:
    from collections.abc import Mapping

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.pairs import Pairs
    from limit_surface_ros.surface.protocol import LimitSurface


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
