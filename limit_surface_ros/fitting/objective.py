# SPDX-License-Identifier: Apache-2.0
"""What a fit minimises: an objective builds the problem, `search` solves it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    import numpy as np

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.base import LimitSurface


class Objective(Protocol):
    """A cost with its gradient over free parameters, and the surface that they stand for.

    Objectives are picklable, so that starts can run in other processes. They may hold work
    arrays: one objective serves one thread at a time.
    """

    @property
    def size(self) -> int:
        """Number of parameters."""
        ...

    def cost_and_gradient(self, parameters: Floats) -> tuple[float, Floats]:
        """Return the cost and its gradient, shape (size,)."""
        ...

    def start(self, rng: np.random.Generator) -> Floats:
        """Return random parameters from which a descent may begin, shape (size,)."""
        ...

    def start_near(self, parameters: Floats, rng: np.random.Generator) -> Floats:
        """Return a start for which one or two terms of `parameters` are changed, shape (size,)."""
        ...

    def coarse(self) -> Objective | None:
        """Return the same problem on a part of the pairs, None where they are few anyway.

        Its cost approximates the whole one, so that the curvature found on it holds.
        """
        ...

    def surface(self, parameters: Floats) -> LimitSurface:
        """Return the surface of `parameters`."""
        ...


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
class RegularisedObjective:
    """A cost plus `prior_weight` |q - centre|^2: a Gaussian prior about known parameters.

    There is one start, the centre itself.
    """

    objective: Objective
    centre: Floats
    prior_weight: float

    @property
    def size(self) -> int:
        """Number of parameters."""
        return self.objective.size

    def cost_and_gradient(self, parameters: Floats) -> tuple[float, Floats]:
        """Return the cost and its gradient."""
        cost, gradient = self.objective.cost_and_gradient(parameters)
        away = parameters - self.centre
        return (
            cost + self.prior_weight * float(away @ away),
            gradient + 2.0 * self.prior_weight * away,
        )

    def start(self, rng: np.random.Generator) -> Floats:
        """Return the centre."""
        return self.centre

    def start_near(self, parameters: Floats, rng: np.random.Generator) -> Floats:
        """Return the centre."""
        return self.centre

    def coarse(self) -> RegularisedObjective | None:
        """Return the regularised objective on a part of the pairs, if there is one."""
        part = self.objective.coarse()
        return None if part is None else RegularisedObjective(part, self.centre, self.prior_weight)

    def surface(self, parameters: Floats) -> LimitSurface:
        """Return the surface of `parameters`."""
        return self.objective.surface(parameters)
