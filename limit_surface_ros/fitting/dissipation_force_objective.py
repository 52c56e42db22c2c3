# SPDX-License-Identifier: Apache-2.0
"""Dissipation models fitted on forces: the model's load at each motion against the pair's.

    J = sum_k m_k |grad D(v_k) - f_k|^2,   D(v) = sum_i sqrt(v' B_i v)

With s_i = sqrt(v' B_i v) and the residual r = grad D(v) - f,

    dJ/dB_i = sum_k m_k (2 r v' / s_i - (r' B_i v) v v' / s_i^3).

Where several pairs share one motion the load is no function of it: they lie on a facet. Of these
only the power is known, and m_k (D(v_k) - f_k . v_k)^2 takes the place of their residual.
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
from limit_surface_ros.surface.kinds.dissipation import Dissipation

if TYPE_CHECKING:
    from limit_surface_ros.checks import Bools, Floats
    from limit_surface_ros.fitting.pairs import ScaledPairs

# Keeps a term finite where it does not move at all.
_SLOWEST = 1e-9
# Decimals to which two unit motions agree that are one.
_SAME_MOTION = 9


class DissipationForceObjective:
    """The error of load at the pairs' motions, for a number of terms."""

    def __init__(self, pairs: ScaledPairs, terms: int, floor: float = 0.0) -> None:
        """Hold the pairs, one column each.

        Args:
            pairs: What to fit.
            terms: How many terms.
            floor: See `dissipation_parameters`.
        """
        self._pairs = pairs
        self._terms = terms
        self._floor = floor
        self._loads = np.ascontiguousarray(pairs.wrenches.T)
        self._motions = np.ascontiguousarray(pairs.directions.T)
        self._powers = np.einsum("cn,cn->n", self._loads, self._motions)
        facet = on_facets(pairs.directions)
        self._of_load = np.where(facet, 0.0, pairs.weights)
        self._of_power = np.where(facet, pairs.weights, 0.0)

    def __reduce__(self) -> tuple[Any, ...]:
        """Travel to other processes without what follows from the pairs."""
        return type(self), (self._pairs, self._terms, self._floor)

    @property
    def size(self) -> int:
        """Number of parameters: six for each term."""
        return PARAMETERS_PER_MATRIX * self._terms

    def cost_and_gradient(self, parameters: Floats) -> tuple[float, Floats]:
        """Return the cost and its gradient, shape (6 k,)."""
        matrices, factors = floored_matrices(parameters, self._floor)
        motions = self._motions
        count = motions.shape[1]
        products = (matrices.reshape(-1, 3) @ motions).reshape(-1, 3, count)
        speeds = np.sqrt(np.maximum(np.einsum("kcn,cn->kn", products, motions), _SLOWEST**2))
        residual = (products / speeds[:, None]).sum(axis=0)
        residual -= self._loads
        excess = speeds.sum(axis=0) - self._powers
        cost = self._of_load @ np.einsum("cn,cn->n", residual, residual)
        cost += self._of_power @ excess**2
        residual *= self._of_load
        excess *= self._of_power
        along = np.einsum("kcn,cn->kn", products, residual)
        bends = excess / speeds - along / speeds**3
        products = np.multiply(bends[:, None], motions, out=products)
        products += (2.0 / speeds)[:, None] * residual
        gradient = products.reshape(-1, count) @ motions.T
        return float(cost), floored_gradient(gradient.reshape(-1, 3, 3), factors, self._floor)

    def start(self, rng: np.random.Generator) -> Floats:
        """Return random terms that together resist loads of the pairs' size."""
        return random_factors(self._loads, self._terms, rng)

    def start_near(self, parameters: Floats, rng: np.random.Generator) -> Floats:
        """Return `parameters` with one term drawn anew."""
        return one_drawn_anew(parameters, self.start(rng), rng)

    def coarse(self) -> DissipationForceObjective | None:
        """Return the same fit to a part of the pairs, if they are very many."""
        part = self._pairs.coarse(self.size)
        return None if part is None else DissipationForceObjective(part, self._terms, self._floor)

    def surface(self, parameters: Floats) -> Dissipation:
        """Return the dissipation model of `parameters`."""
        matrices, _ = floored_matrices(parameters, self._floor)
        return Dissipation(matrices, self._pairs.scaling)


def on_facets(directions: Floats) -> Bools:
    """Tell which pairs share their motion with another, shape (n,)."""
    _, group, sizes = np.unique(
        np.round(directions, _SAME_MOTION), axis=0, return_inverse=True, return_counts=True
    )
    return np.asarray(sizes[group.ravel()] > 1)
