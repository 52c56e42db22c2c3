# SPDX-License-Identifier: Apache-2.0
"""Dissipation models fitted on directions: the model's motion of each load against the pair's.

The cost is that of `motion_cost`, over the parameters of `dissipation_parameters`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.fitting.cholesky import PARAMETERS_PER_MATRIX, one_drawn_anew
from limit_surface_ros.fitting.dissipation_parameters import (
    floored_gradient,
    floored_matrices,
    random_factors,
)
from limit_surface_ros.fitting.motion_cost import MotionCost
from limit_surface_ros.surface.kinds.dissipation import Dissipation

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.fitting.pairs import ScaledPairs


class DissipationDirectionObjective:
    """The error of motion and of load factor at the pairs' loads, for a number of terms."""

    def __init__(
        self,
        pairs: ScaledPairs,
        terms: int,
        velocity_weight: float,
        robust_scale: float | None = None,
        floor: float = 1e-3,
    ) -> None:
        """Hold the pairs and the planes of their loads.

        Args:
            pairs: What to fit.
            terms: How many terms.
            velocity_weight: w of `motion_cost`.
            robust_scale: See `direction_loss`.
            floor: Above zero; see `dissipation_parameters`.
        """
        self._arguments = (pairs, terms, velocity_weight, robust_scale, floor)
        self._pairs = pairs
        self._terms = terms
        self._floor = floor
        self._cost = MotionCost(pairs, velocity_weight, robust_scale)

    def __reduce__(self) -> tuple[Any, ...]:
        """Travel to other processes without what follows from the pairs."""
        return type(self), self._arguments

    @property
    def size(self) -> int:
        """Number of parameters: six for each term."""
        return PARAMETERS_PER_MATRIX * self._terms

    def cost_and_gradient(self, parameters: Floats) -> tuple[float, Floats]:
        """Return the cost and its gradient, shape (6 k,)."""
        matrices, factors = floored_matrices(parameters, self._floor)
        cost, gradient = self._cost.of(matrices)
        return cost, floored_gradient(gradient, factors, self._floor)

    def start(self, rng: np.random.Generator) -> Floats:
        """Return random terms that together resist loads of the pairs' size."""
        return random_factors(np.asarray(self._pairs.wrenches.T), self._terms, rng)

    def start_near(self, parameters: Floats, rng: np.random.Generator) -> Floats:
        """Return `parameters` with one term drawn anew."""
        return one_drawn_anew(parameters, self.start(rng), rng)

    def coarse(self) -> DissipationDirectionObjective | None:
        """Return the same fit to a part of the pairs, if they are very many."""
        part = self._pairs.coarse(self.size)
        return None if part is None else DissipationDirectionObjective(part, *self._arguments[1:])

    def surface(self, parameters: Floats) -> Dissipation:
        """Return the dissipation model of `parameters`."""
        matrices, _ = floored_matrices(parameters, self._floor)
        return Dissipation(matrices, self._pairs.scaling)
