# SPDX-License-Identifier: Apache-2.0
"""The second approximation of the thesis (3.14): one matrix by least squares inside the other.

H(f) = f' A f + sqrt(f' B f), with B = L L' free and A the symmetric matrix that solves
f_k' A f_k = 1 - sqrt(f_k' B f_k) in the sense of least squares. J1 or J2 is then a function of B
alone: variable projection (Golub and Pereyra 2003, doi:10.1088/0266-5611/19/2/201).

A need not come out positive semidefinite. Where it does not, its negative part is dropped and both
matrices are polished together, so that what is returned is always a closed surface.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_number
from limit_surface_ros.errors import RangeError, SolverError
from limit_surface_ros.fitting.factors import (
    PARAMETERS_PER_MATRIX,
    factors_of,
    factors_of_matrices,
    matrices_of,
    parameter_gradient,
    parameters_of,
)
from limit_surface_ros.fitting.motion_cost import direction_loss
from limit_surface_ros.fitting.pairs import check_support, scale_pairs
from limit_surface_ros.fitting.power_sum import PowerSumObjective
from limit_surface_ros.fitting.result import FitResult, errors_on, is_sound
from limit_surface_ros.fitting.search import Search, descend, descents
from limit_surface_ros.surface.kinds.power_sum import PowerSum, thesis_exponents

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.fitting.pairs import ScaledPairs
    from limit_surface_ros.surface.pairs import Pairs
    from limit_surface_ros.surface.scaling import Scaling

_ROWS, _COLUMNS = np.triu_indices(3)
_TWICE = np.where(_ROWS == _COLUMNS, 1.0, 2.0)
_LEAST = 1e-12


class SecondObjective:
    """J1 or J2 as a function of B alone."""

    def __init__(self, pairs: ScaledPairs, velocity_weight: float) -> None:
        """Hold the pairs and the least-squares problem of A.

        Args:
            pairs: What to fit.
            velocity_weight: w; 0 gives J1.
        """
        self._pairs = pairs
        self._velocity_weight = velocity_weight
        loads = pairs.wrenches
        self._monomials = loads[:, _ROWS] * loads[:, _COLUMNS] * _TWICE
        shares = np.sqrt(pairs.weights)
        self._inverse = np.linalg.pinv(shares[:, None] * self._monomials) * shares

    @property
    def size(self) -> int:
        """Number of parameters: those of B."""
        return PARAMETERS_PER_MATRIX

    def inner_matrix(self, matrix: Floats) -> Floats:
        """Return the A that goes with B, symmetric, shape (3, 3)."""
        loads = self._pairs.wrenches
        roots = np.sqrt(np.maximum(np.einsum("nc,cd,nd->n", loads, matrix, loads), _LEAST))
        return _symmetric(self._inverse @ (1.0 - roots))

    def cost_and_gradient(self, parameters: Floats) -> tuple[float, Floats]:
        """Return the cost and its gradient, shape (6,)."""
        loads, directions = self._pairs.wrenches, self._pairs.directions
        weights = self._pairs.weights
        factors = factors_of(parameters)
        products = loads @ matrices_of(factors)[0]
        roots = np.sqrt(np.maximum(np.einsum("nc,nc->n", products, loads), _LEAST))
        inner = self._inverse @ (1.0 - roots)
        residual = self._monomials @ inner + roots - 1.0
        gradient = 2.0 * loads @ _symmetric(inner) + products / roots[:, None]
        norms = np.maximum(np.linalg.norm(gradient, axis=1), _LEAST)
        units = gradient / norms[:, None]
        cosines = np.einsum("nc,nc->n", units, directions)
        loss, slope = direction_loss(cosines, None)
        weighted = weights * residual
        cost = weighted @ residual + self._velocity_weight * (weights @ loss)
        slope *= self._velocity_weight * weights / norms
        by_normals = slope[:, None] * (directions - cosines[:, None] * units)
        # A depends on the roots: the chain rule brings the gradient by A back to them.
        by_inner = self._monomials.T @ (2.0 * weighted)
        outer = 2.0 * by_normals.T @ loads
        by_inner += 0.5 * (outer + outer.T)[_ROWS, _COLUMNS] * _TWICE
        by_roots = 2.0 * weighted - by_inner @ self._inverse
        by_roots -= np.einsum("nc,nc->n", by_normals, products) / roots**2
        by_matrix = (
            (0.5 * by_roots / roots)[:, None] * loads + by_normals / roots[:, None]
        ).T @ loads
        return float(cost), parameter_gradient(by_matrix[None], factors)

    def start(self, rng: np.random.Generator) -> Floats:
        """Return a random B that takes half of H on average."""
        terms = PowerSumObjective(self._pairs, np.array([1.0, 0.5]), 0.0).start(rng)
        return terms[PARAMETERS_PER_MATRIX:]

    def start_near(self, parameters: Floats, rng: np.random.Generator) -> Floats:
        """Return another random B: it is the only term."""
        return self.start(rng)

    def coarse(self) -> SecondObjective | None:
        """Return the same fit to a part of the pairs, if they are very many."""
        part = self._pairs.coarse(self.size)
        return None if part is None else SecondObjective(part, self._velocity_weight)

    def surface(self, parameters: Floats) -> PowerSum:
        """Return the surface with the negative part of A dropped."""
        outer = matrices_of(factors_of(parameters))[0]
        values, vectors = np.linalg.eigh(self.inner_matrix(outer))
        kept = (vectors * np.maximum(values, 1e-9 * np.abs(values).max())) @ vectors.T
        return PowerSum.thesis(np.stack([kept, outer]), self._pairs.scaling)


def fit_second_approximation(
    pairs: Pairs,
    *,
    velocity_weight: float = 1.0,
    scaling: Scaling | None = None,
    search: Search | None = None,
) -> FitResult:
    """Fit two terms by the second approximation.

    Start costs are those of the projected problem. The result's details give the best of them,
    and the least eigenvalue of A as least squares had it.

    Args:
        pairs: Loads on the surface and the motions they cause, 12 at least.
        velocity_weight: w; 0 is J1 of the thesis and 1 its J2.
        scaling: Characteristic length and friction force; chosen from the pairs if not given.
        search: Starts, seed, where and how to run.

    Raises:
        RangeError: The weight is negative.
        DataError: The pairs cannot determine such a surface.
        SolverError: The surface does not pass through the loads.
    """
    weight = as_number("velocity_weight", velocity_weight)
    if weight < 0.0:
        raise RangeError(f"velocity_weight must not be negative, got {weight}")
    begin = time.perf_counter()
    scaled = scale_pairs(pairs, scaling)
    check_support(scaled, 2 * PARAMETERS_PER_MATRIX)
    objective = SecondObjective(scaled, weight)
    found = descents(objective, search or Search())
    best = found[0]
    outer = matrices_of(factors_of(best.parameters))[0]
    least = float(np.linalg.eigvalsh(objective.inner_matrix(outer))[0])
    surface, end, iterations = objective.surface(best.parameters), best, best.iterations
    if least < 0.0:
        both = PowerSumObjective(scaled, thesis_exponents(2), weight)
        end = descend(both, parameters_of(factors_of_matrices(surface.matrices)))
        surface, iterations = both.surface(end.parameters), iterations + end.iterations
    if not is_sound(surface, pairs):
        raise SolverError("the second approximation does not pass through the loads")
    return FitResult(
        surface=surface,
        objective=f"second approximation, velocity weight {weight:g}",
        cost=end.cost,
        start_costs=tuple(each.cost for each in found),
        iterations=iterations,
        gradient_norm=end.gradient_norm,
        converged=end.converged,
        wall_time=time.perf_counter() - begin,
        training=errors_on(surface, pairs),
        details={"projected_cost": best.cost, "least_eigenvalue_of_A": least},
    )


def _symmetric(entries: Floats) -> Floats:
    matrix = np.zeros((3, 3))
    matrix[_ROWS, _COLUMNS] = entries
    matrix[_COLUMNS, _ROWS] = entries
    return matrix
