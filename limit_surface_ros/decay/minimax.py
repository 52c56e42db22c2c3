# SPDX-License-Identifier: Apache-2.0
"""Discrete linear minimax: the c that minimises max_i |(A c - b)_i|, with a certificate.

A primal-dual interior-point method with Mehrotra's predictor and corrector [1], on an orthonormal
basis of A's columns. The duals, projected orthogonally to the columns, prove a lower bound on
what any c can reach: for rho with A' rho = 0 and sum |rho| = 1, max |A c - b| >= |rho . b|.

[1] S. Mehrotra, On the implementation of a primal-dual interior point method, SIAM J. Optim. 2,
    575-601, 1992, doi 10.1137/0802028.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import linalg

from limit_surface_ros.errors import SolverError

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats

GAP_WANTED = 1e-8
GAP_CERTIFIED = 1e-6
MAX_ITERATIONS = 80
# Columns that add less than this to the span of the others are rounding noise.
RANK_TOLERANCE = 1e-13


@dataclass(frozen=True)
class MinimaxSolution:
    """Minimiser of the largest residual, and how good it provably is.

    Attributes:
        weights: c, shape (m,).
        value: max |A c - b|.
        lower_bound: No c gives less than this.
    """

    weights: Floats
    value: float
    lower_bound: float


@dataclass(frozen=True)
class OrthonormalBasis:
    """Columns of a matrix made orthonormal: matrix @ back = columns.

    Attributes:
        columns: Shape (n, rank).
        back: Shape (m, rank).
    """

    columns: Floats
    back: Floats


def orthonormal_basis(matrix: Floats) -> OrthonormalBasis:
    """Return an orthonormal basis of the columns' span, without directions that are noise."""
    norms = np.linalg.norm(matrix, axis=0)
    scale = np.where(norms > 0.0, norms, 1.0)
    columns, triangle, order = linalg.qr(matrix / scale, mode="economic", pivoting=True)
    sizes = np.abs(np.diag(triangle))
    rank = int(np.count_nonzero(sizes > RANK_TOLERANCE * sizes[0]))
    back = np.zeros((matrix.shape[1], rank))
    inverse = linalg.solve_triangular(triangle[:rank, :rank], np.eye(rank))
    back[order[:rank]] = inverse
    return OrthonormalBasis(columns[:, :rank], back / scale[:, np.newaxis])


def solve_minimax(matrix: Floats, target: Floats) -> MinimaxSolution:
    """Return the c that minimises max |matrix @ c - target|, certified.

    Args:
        matrix: Shape (n, m); columns may depend on each other.
        target: Shape (n,).

    Raises:
        SolverError: No step brings the value within 1e-6 (relative) of its lower bound.
    """
    basis = orthonormal_basis(matrix)
    columns = basis.columns
    scale = float(np.abs(target).max(initial=0.0))
    if scale == 0.0:
        return MinimaxSolution(np.zeros(matrix.shape[1]), 0.0, 0.0)
    b = target / scale
    state = _Iterate(columns, b)
    for _ in range(MAX_ITERATIONS):
        # Residuals at the level of rounding cannot be told from an exact fit.
        if state.best_value - state.best_bound <= GAP_WANTED * state.best_value + 1e-14:
            break
        if not state.step():
            break
    value, bound = state.best_value, state.best_bound
    if value - bound > GAP_CERTIFIED * value + 1e-12:
        raise SolverError(
            f"the minimax fit could not be certified: value {value * scale:g}, "
            f"proven lower bound {bound * scale:g}"
        )
    weights = basis.back @ state.best_weights * scale
    return MinimaxSolution(weights, value * scale, bound * scale)


class _Iterate:
    """Primal c and tau, their slacks tau -+ (Q c - b) > 0, and the slacks' duals."""

    def __init__(self, columns: Floats, target: Floats) -> None:
        self.columns = columns
        self.target = target
        self.weights = columns.T @ target
        residual = columns @ self.weights - target
        self.level = 1.1 * float(np.abs(residual).max()) + 1e-15
        self.best_weights, self.best_value, self.best_bound = self.weights, np.inf, 0.0
        self.slacks = np.stack([self.level - residual, self.level + residual])
        self.duals = 1.0 / self.slacks
        self.duals /= self.duals.sum()
        self._keep_best()

    def _keep_best(self) -> None:
        value = float(np.abs(self.columns @ self.weights - self.target).max())
        if value < self.best_value:
            self.best_value, self.best_weights = value, self.weights
        rho = self.duals[0] - self.duals[1]
        # Twice is enough to be orthogonal to working precision.
        for _ in range(2):
            rho = rho - self.columns @ (self.columns.T @ rho)
        size = float(np.abs(rho).sum())
        if size > 0.0:
            self.best_bound = max(self.best_bound, abs(float(rho @ self.target)) / size)

    def step(self) -> bool:
        """Take one predictor-corrector step; tell whether it made any headway."""
        ratios = self.duals / self.slacks
        total, tilt = ratios[0] + ratios[1], ratios[0] - ratios[1]
        rank = self.columns.shape[1]
        matrix = np.empty((rank + 1, rank + 1))
        scaled = self.columns * np.sqrt(total)[:, np.newaxis]
        matrix[:rank, :rank] = scaled.T @ scaled
        matrix[:rank, rank] = matrix[rank, :rank] = -(self.columns.T @ tilt)
        matrix[rank, rank] = total.sum()
        # Late systems are nearly singular: scaling and a damped diagonal keep them solvable.
        diagonal = 1.0 / np.sqrt(np.diag(matrix))
        matrix *= diagonal[:, np.newaxis] * diagonal
        matrix[np.diag_indices(rank + 1)] += 1e-15
        try:
            factor = linalg.cho_factor(matrix, overwrite_a=True, check_finite=False)
        except linalg.LinAlgError:
            return False

        gap = float((self.duals * self.slacks).mean())
        predictor = self._direction(factor, diagonal, ratios, -self.duals)
        primal, dual = self._lengths(predictor)
        ahead = (self.slacks + primal * predictor[1]) * (self.duals + dual * predictor[2])
        centring = (float(ahead.mean()) / gap) ** 3
        correction = (centring * gap - predictor[1] * predictor[2]) / self.slacks
        direction = self._direction(factor, diagonal, ratios, correction - self.duals)
        primal, dual = self._lengths(direction)
        if max(primal, dual) < 1e-8:
            return False
        self.weights = self.weights + primal * direction[0][:-1]
        self.level += primal * float(direction[0][-1])
        self.duals = self.duals + dual * direction[2]
        # Updated and not computed anew: a difference of nearly equal numbers may round to zero.
        self.slacks = self.slacks + primal * direction[1]
        self._keep_best()
        return True

    def _direction(
        self, factor: tuple[Floats, bool], diagonal: Floats, ratios: Floats, constant: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """Solve the Newton system for (c, tau); return it with the slacks' and duals' changes.

        `constant` is the duals' change if the slacks stayed as they are.
        """
        after = self.duals + constant
        side = np.append(-self.columns.T @ (after[0] - after[1]), float(after.sum()) - 1.0)
        unknowns = diagonal * linalg.cho_solve(factor, diagonal * side, check_finite=False)
        fitted = self.columns @ unknowns[:-1]
        slacks = np.stack([unknowns[-1] - fitted, unknowns[-1] + fitted])
        return unknowns, slacks, constant - ratios * slacks

    def _lengths(self, direction: tuple[Floats, Floats, Floats]) -> tuple[float, float]:
        """Return how far the slacks and the duals may go and stay above zero."""
        lengths = []
        for now, change in ((self.slacks, direction[1]), (self.duals, direction[2])):
            falling = change < 0.0
            limit = float((-now[falling] / change[falling]).min(initial=np.inf))
            lengths.append(min(1.0, 0.995 * limit))
        return lengths[0], lengths[1]
