# SPDX-License-Identifier: Apache-2.0
"""Free rates by least squares, with the coefficients solved inside: variable projection [1, 2].

For given rates the best coefficients are a linear problem, so that only the rates are searched. A
rate is -a + ib; the search goes over log a and, of a pair, b by the method of Levenberg and
Marquardt. All rows are in units of the noise:

- the samples;
- times after the record, where the sum may not leave [-envelope, envelope]: each is drawn to the
  nearer end of that interval if it is outside;
- each coefficient, held weakly: rates that nearly coincide then need no coefficients that cancel.
  It is held the more the fewer samples a term lives on: terms that die away within a step could
  follow the noise of the first samples, and would cancel there and not between them.

[1] G. H. Golub, V. Pereyra, The differentiation of pseudo-inverses and nonlinear least squares
    problems whose variables separate, SIAM J. Numer. Anal. 10, 413-432, 1973,
    doi 10.1137/0710036.
[2] L. Kaufman, A variable projection method for solving separable nonlinear least squares
    problems, BIT 15, 49-57, 1975, doi 10.1007/BF01932995.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import linalg

from limit_surface_ros.decay.basis import coefficients_of_weights, count_terms, real_basis

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.basis import Complexes

# Times after the record, in parts of its end, and the rows' weight in parts of 1 / envelope.
TAIL_TIMES = np.geomspace(1.004, 5.0, 24)
TAIL_WEIGHT = 4.0
# A coefficient of so many times the largest sample counts as much as one deviation of noise; of a
# term that dies away within a step, one of this part of it does.
LARGE_COEFFICIENT, SHORT_LIVED = 30.0, 1.0 / 3.0
# Decays are kept between so many over the record, and so many over the first step.
LEAST_DECAYS, MOST_DECAYS = 0.4, 3.0
# Samples that tell on how many a term lives.
FIRST_SAMPLES = 256
MOST_CHANGE = 1.5
# The search ends with a step that lowers the sum of squares by less than this part.
LEAST_GAIN = 1e-7
FIRST_DAMPING = 1e-2
# A pivot of the triangle below this part of the largest is no column of its own.
RANK_TOLERANCE = 1e-12


@dataclass(frozen=True, eq=False)
class Samples:
    """Weighted samples and what is assumed after them.

    Attributes:
        times: Shape (n,), from 0 [s].
        values: Shape (n,).
        weights: Shape (n,), roots of the weights, 0 for an outlier.
        noise: Standard deviation of a sample of weight 1, above 0.
        envelope: What |x|, less its constant, never exceeds after the last time; above 0.
        offset: Whether a constant is fitted beside the exponentials.
        least_decays: Rates are kept left of this many decays over the record.
        misfit: By how much the residuals exceed the noise, at least 1: what comes after the last
            time is weighed against them.
    """

    times: Floats
    values: Floats
    weights: Floats
    noise: float
    envelope: float
    offset: bool = False
    misfit: float = 1.0
    least_decays: float = LEAST_DECAYS

    @property
    def end(self) -> float:
        """Last time [s]."""
        return float(self.times[-1])


@dataclass(frozen=True, eq=False)
class FreeFit:
    """Rates with their least-squares coefficients.

    Attributes:
        rates: Shape (m,), one of each conjugate pair [1/s]; the constant's is not among them.
        weights: Shape (terms,), of `real_basis`.
        constant: What the sum decays to.
        cost: Sum of all squares, in units of the noise.
        residuals: Samples minus sum, without weights, shape (n,).
    """

    rates: Complexes
    weights: Floats
    constant: float
    cost: float
    residuals: Floats

    @property
    def terms(self) -> int:
        """Number of real terms beside the constant."""
        return count_terms(self.rates)


class VariableProjection:
    """Searches rates for one set of weighted samples."""

    def __init__(self, samples: Samples) -> None:
        """Prepare the rows that do not depend on the rates."""
        self.samples = samples
        self._row_weights = samples.weights / samples.noise
        self._target = samples.values * self._row_weights
        self._tail = TAIL_TIMES * samples.end
        self._allowed = TAIL_WEIGHT * samples.misfit
        self._tail_weight = self._allowed / samples.envelope
        steps = np.diff(samples.times)
        self._largest = float(np.abs(samples.values).max())
        self._first = samples.times[samples.weights > 0.0][1 : FIRST_SAMPLES + 1]
        self._decays = samples.least_decays / samples.end, MOST_DECAYS / float(steps[0])
        self._highest = np.pi / float(np.median(steps))

    def within_bounds(self, rates: Complexes) -> Complexes:
        """Return rates moved to where the samples can tell them."""
        decays = np.clip(-rates.real, *self._decays)
        bounded: Complexes = -decays + 1j * np.minimum(np.abs(rates.imag), self._highest)
        return bounded

    def project(self, rates: Complexes) -> Projection:
        """Solve for the coefficients on given rates."""
        samples, terms = self.samples, count_terms(rates)
        count, columns = len(samples.times), terms + samples.offset
        rows = np.zeros((count + len(self._tail) + terms, columns))
        rows[:count, :terms] = real_basis(rates, samples.times) * self._row_weights[:, np.newaxis]
        if samples.offset:
            rows[:count, terms] = self._row_weights
        tail = real_basis(rates, self._tail) * self._tail_weight
        rows[count : count + len(tail), :terms] = tail
        rows[count + len(tail) :, :terms] = np.diag(self._ridge(rates))
        basis, triangle, order = linalg.qr(rows, mode="economic", pivoting=True)
        sizes = np.abs(np.diag(triangle))
        rank = int(np.count_nonzero(sizes > RANK_TOLERANCE * sizes[0]))
        basis = basis[:, :rank]
        target = np.zeros(len(rows))
        target[:count] = self._target
        # Outside the envelope a sum is drawn to its nearer edge, which moves with the solution.
        inner = basis[count : count + len(tail)]
        for _ in range(3):
            ends = inner @ (basis.T @ target)
            target[count : count + len(tail)] = np.clip(ends, -self._allowed, self._allowed)
        projected = basis.T @ target
        solution = np.zeros(columns)
        solution[order[:rank]] = linalg.solve_triangular(triangle[:rank, :rank], projected)
        return Projection(rates, solution, basis, target - basis @ projected)

    def _ridge(self, rates: Complexes) -> Floats:
        """Return the weights of the coefficients' own rows, shape (terms,)."""
        columns = np.where(rates.imag == 0.0, 1, 2)
        # All terms live on the first sample; a decay a at the step h on 1 / (a h) others.
        others = np.exp(np.multiply.outer(rates.real, self._first)).sum(axis=1)
        shares = 1.0 / (SHORT_LIVED * np.maximum(others, 1.0))
        return (1.0 / LARGE_COEFFICIENT + np.repeat(shares, columns)) / self._largest

    def improve(self, start: Projection, steps: int) -> Projection:
        """Move the rates to lower the sum of squares, by at most so many steps."""
        point, damping = start, FIRST_DAMPING
        for _ in range(steps):
            jacobian = self._jacobian(point)
            normal = jacobian.T @ jacobian
            gradient = jacobian.T @ point.residual
            if not normal.any():
                return point
            scale = np.sqrt(np.diag(normal) + 1e-12 * float(np.trace(normal)))
            normal /= np.multiply.outer(scale, scale)
            for _ in range(8):
                damped = normal + damping * np.eye(len(scale))
                change = linalg.solve(damped, gradient / scale, assume_a="pos") / scale
                trial = self.project(self._moved(point.rates, change))
                if trial.cost < point.cost:
                    break
                damping *= 5.0
            else:
                return point
            gain = point.cost - trial.cost
            point, damping = trial, max(0.2 * damping, 1e-9)
            if gain <= LEAST_GAIN * point.cost:
                break
        return point

    def result(self, point: Projection) -> FreeFit:
        """Return what a point stands for, with the samples' residuals."""
        samples, terms = self.samples, count_terms(point.rates)
        weights = point.solution[:terms]
        constant = float(point.solution[terms]) if samples.offset else 0.0
        fitted = real_basis(point.rates, samples.times) @ weights + constant
        return FreeFit(point.rates, weights, constant, point.cost, samples.values - fitted)

    def _jacobian(self, point: Projection) -> Floats:
        """Return how the projected residuals fall with log a and b (Kaufman's short form)."""
        rates, count = point.rates, len(self.samples.times)
        coefficients = coefficients_of_weights(rates, point.solution[: count_terms(rates)])
        pairs = rates.imag > 0.0
        times = np.append(self.samples.times, self._tail)
        row_weights = np.append(self._row_weights, np.full(len(self._tail), self._tail_weight))
        waves = np.exp(np.multiply.outer(times, rates)) * coefficients
        slopes = np.concatenate([waves.real * rates.real, -waves.imag[:, pairs]], axis=1)
        rows = np.zeros((len(point.residual), slopes.shape[1]))
        rows[: count + len(self._tail)] = slopes * (times * row_weights)[:, np.newaxis]
        rows -= point.basis @ (point.basis.T @ rows)
        return rows

    def _moved(self, rates: Complexes, change: Floats) -> Complexes:
        logs = np.clip(change[: len(rates)], -MOST_CHANGE, MOST_CHANGE)
        decays = -rates.real * np.exp(logs)
        frequencies = rates.imag.copy()
        pairs = frequencies > 0.0
        frequencies[pairs] += change[len(rates) :]
        # A pair stays one: at the frequency 0 one of its terms would vanish.
        frequencies[pairs] = np.maximum(np.abs(frequencies[pairs]), 1e-6 / self.samples.end)
        return self.within_bounds(-decays + 1j * frequencies)


@dataclass(frozen=True, eq=False)
class Projection:
    """Rates with the coefficients solved.

    Attributes:
        rates: Shape (m,) [1/s].
        solution: Shape (columns,), the weights and, last, the constant.
        basis: Shape (rows, rank), orthonormal, spans the weighted rows' columns.
        residual: Shape (rows,), weighted.
    """

    rates: Complexes
    solution: Floats
    basis: Floats
    residual: Floats

    @property
    def cost(self) -> float:
        """Sum of the squares of all rows."""
        return float(self.residual @ self.residual)
