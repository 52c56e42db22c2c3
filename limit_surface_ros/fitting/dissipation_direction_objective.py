"""Dissipation models fitted on directions: the model's motion of each load against the pair's.

    J = sum_k m_k (log(s_k)^2 + w rho(|v_k - v^_k|))

s_k is the load factor of f_k and v^_k the unit motion of it. The load factor's logarithm fixes
the scale; it goes to infinity when the surface shrinks to nothing or grows without bound. The
motion is found by `smooth_inverse`; its change with the model follows from the condition that D be
least, so that the gradient costs no more than a Newton step: with u from the adjoint,

    dJ/dB_i = sum_k dJ/dD v v' / (2 s_i) + u v' / s_i - (u' B_i v) v v' / (2 s_i^3).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.fitting.cholesky import PARAMETERS_PER_MATRIX, one_drawn_anew
from limit_surface_ros.fitting.direction_loss import direction_loss
from limit_surface_ros.fitting.dissipation_parameters import (
    floored_gradient,
    floored_matrices,
    random_factors,
)
from limit_surface_ros.fitting.smooth_inverse import SmoothInverse
from limit_surface_ros.surface.dissipation import Dissipation

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.fitting.scaled_pairs import ScaledPairs


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
            velocity_weight: w.
            robust_scale: See `direction_loss`.
            floor: Above zero; see `dissipation_parameters`.
        """
        self._arguments = (pairs, terms, velocity_weight, robust_scale, floor)
        self._pairs = pairs
        self._terms = terms
        self._velocity_weight = velocity_weight
        self._robust_scale = robust_scale
        self._floor = floor
        self._loads = np.ascontiguousarray(pairs.wrenches.T)
        self._directions = np.ascontiguousarray(pairs.directions.T)
        self._inverse = SmoothInverse(self._loads)

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
        inverse, weights = self._inverse, self._pairs.weights
        inverse.solve(matrices)
        motions, speeds = inverse.motions, inverse.speeds
        norms = np.sqrt(np.einsum("cn,cn->n", motions, motions))
        units = motions / norms
        cosines = np.einsum("cn,cn->n", units, self._directions)
        loss, slope = direction_loss(cosines, self._robust_scale)
        log_factors = -np.log(inverse.dissipation)
        cost = weights @ (log_factors**2 + self._velocity_weight * loss)
        slope *= self._velocity_weight * weights / norms
        pull = inverse.adjoint(slope * (self._directions - cosines * units))
        products = (matrices.reshape(-1, 3) @ motions).reshape(-1, 3, motions.shape[1])
        along = np.einsum("kcn,cn->kn", products, pull)
        bends = (-weights * log_factors / inverse.dissipation - 0.5 * along / speeds**2) / speeds
        weighted = bends[:, None] * motions + pull / speeds[:, None]
        gradient = weighted.reshape(-1, motions.shape[1]) @ motions.T
        return float(cost), floored_gradient(gradient.reshape(-1, 3, 3), factors, self._floor)

    def start(self, rng: np.random.Generator) -> Floats:
        """Return random terms that together resist loads of the pairs' size."""
        return random_factors(self._loads, self._terms, rng)

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
