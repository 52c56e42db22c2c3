# SPDX-License-Identifier: Apache-2.0
"""Objectives made of others: their sum, and one that is held near known parameters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.fitting.objective import Objective
    from limit_surface_ros.surface.protocol import LimitSurface


@dataclass(frozen=True)
class SumOfObjectives:
    """Two costs of the same parameters; the first makes starts and surfaces."""

    first: Objective
    second: Objective

    @property
    def size(self) -> int:
        """Number of parameters."""
        return self.first.size

    def cost_and_gradient(self, parameters: Floats) -> tuple[float, Floats]:
        """Return the sum of the costs and its gradient."""
        first, first_gradient = self.first.cost_and_gradient(parameters)
        second, second_gradient = self.second.cost_and_gradient(parameters)
        return first + second, first_gradient + second_gradient

    def start(self, rng: np.random.Generator) -> Floats:
        """Return a start of the first objective."""
        return self.first.start(rng)

    def start_near(self, parameters: Floats, rng: np.random.Generator) -> Floats:
        """Return a start of the first objective near `parameters`."""
        return self.first.start_near(parameters, rng)

    def coarse(self) -> SumOfObjectives | None:
        """Return the sum on a part of the pairs, if both have one."""
        first, second = self.first.coarse(), self.second.coarse()
        return None if first is None or second is None else SumOfObjectives(first, second)

    def surface(self, parameters: Floats) -> LimitSurface:
        """Return the first objective's surface."""
        return self.first.surface(parameters)


@dataclass(frozen=True)
class HeldObjective:
    """A cost plus `strength` |q - centre|^2: a Gaussian prior about known parameters.

    There is one start, the centre itself.
    """

    objective: Objective
    centre: Floats
    strength: float

    @property
    def size(self) -> int:
        """Number of parameters."""
        return self.objective.size

    def cost_and_gradient(self, parameters: Floats) -> tuple[float, Floats]:
        """Return the cost and its gradient."""
        cost, gradient = self.objective.cost_and_gradient(parameters)
        away = parameters - self.centre
        return (
            cost + self.strength * float(away @ away),
            gradient + 2.0 * self.strength * away,
        )

    def start(self, rng: np.random.Generator) -> Floats:
        """Return the centre."""
        return self.centre

    def start_near(self, parameters: Floats, rng: np.random.Generator) -> Floats:
        """Return the centre."""
        return self.centre

    def coarse(self) -> HeldObjective | None:
        """Return the held objective on a part of the pairs, if there is one."""
        part = self.objective.coarse()
        return None if part is None else HeldObjective(part, self.centre, self.strength)

    def surface(self, parameters: Floats) -> LimitSurface:
        """Return the surface of `parameters`."""
        return self.objective.surface(parameters)
