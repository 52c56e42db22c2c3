# SPDX-License-Identifier: Apache-2.0
"""Free rates: the largest error made smaller by moving rates and coefficients together.

Sequential linear programming: each step linearises the sum in its rates, solves a minimax problem
and refits the coefficients. A trust region keeps the steps where the linearisation holds; it
needs no constraints, only more rows, since a minimax solution whose value is below tau
keeps |tau d / rho| below tau, that is, |d| below rho.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.decay.basis import coefficients_of_weights, count_terms, real_basis
from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.decay.grids import fit_times, peaks
from limit_surface_ros.decay.minimax import solve_minimax
from limit_surface_ros.decay.rates import RateChoice, judged
from limit_surface_ros.decay.tail import tail_times, tail_weight
from limit_surface_ros.errors import SolverError

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.basis import Complexes
    from limit_surface_ros.decay.targets import Target

# The radius of the trust region is in parts of the rates' mobility, without a unit: of a step at
# first, at most, and at least.
FIRST_RADIUS, MOST_RADIUS, LEAST_RADIUS = 0.3, 1.0, 1e-5
# How it changes after a step that gained more than `GOOD` of what the linearisation promised, at
# least `FAIR`, or less, and after one that could not be solved.
GOOD, FAIR = 0.6, 0.2
WIDENED, NARROWED, HALTED = 2.0, 0.4, 0.25
# A step that promises less than this part of the error is not worth taking.
LEAST_HOPE = 1e-4
# The mobility of a rate that is not damped, over the interval.
LEAST_MOBILITY = 5.7
MOST_STEPS = 100
# Polishing ends when this many steps in a row gained less than this part of the error.
STALL, LEAST_GAIN = 6, 1e-3
# An error of this part of the response cannot be made smaller.
ROUNDING = 1e-14
# Rates are kept left of this many decays over the interval, unless the caller says otherwise.
LEAST_DECAYS = 0.4
# Most refits of the coefficients until no point of the fine grid is worse than those seen, by this
# part; peaks are seen from these parts of the largest error on, in refits and in steps.
ROUNDS, AGREEMENT = 8, 2e-3
PEAK_OF_REFIT, PEAK_OF_STEP = 0.7, 0.3


@dataclass(frozen=True, eq=False)
class _Point:
    """Rates, their weights, the largest weighted error, and the largest before the end."""

    rates: Complexes
    weights: Floats
    error: float
    before: float


def polished_rates(
    response: Target,
    end: float,
    start: RateChoice,
    progress: Callable[[int, float], None] | None = None,
    envelope: float | None = None,
    least_decays: float = LEAST_DECAYS,
) -> RateChoice:
    """Return rates near those of another choice with a smaller largest error on [0, end].

    Args:
        response: The response.
        end: End of the interval [s].
        start: Rates to start from; the result is never worse.
        progress: Called after each step with its number and the error so far.
        envelope: After the end the sum is held to this, or to its error if that is larger; it is
            free there if None.
        least_decays: Rates are kept left of this many decays over the interval.

    Raises:
        SolverError: Not even the start could be fitted.
    """
    problem = _Problem(response, end, start.rates, envelope, least_decays)
    if envelope is not None:
        problem.weights[problem.within :] = tail_weight(start.error, envelope)
    point = problem.balanced(problem.fitted(start.rates))
    radius, stalled, steps = FIRST_RADIUS, 0, 0
    while steps < MOST_STEPS and radius > LEAST_RADIUS and stalled < STALL:
        steps += 1
        try:
            trial, predicted = problem.step(point, radius)
        except SolverError:
            radius *= HALTED
            continue
        gain, hope = point.error - trial.error, point.error - predicted
        if hope <= LEAST_HOPE * point.error or point.error <= ROUNDING * problem.scale:
            break
        if gain > 0.0:
            stalled = 0 if gain > LEAST_GAIN * point.error else stalled + 1
        if gain > GOOD * hope:
            radius = min(WIDENED * radius, MOST_RADIUS)
        elif gain <= FAIR * hope:
            radius *= NARROWED
        if gain > 0.0:
            point = problem.balanced(trial)
        if progress is not None:
            progress(steps, point.error)
    parameters = {**start.parameters, "start": start.method, "steps": steps}
    choice = judged(point.rates, response, end, "polished", None, parameters, envelope)
    if choice.error < start.error:
        return choice
    return RateChoice(start.rates, "polished", start.error, start.system, parameters)


class _Problem:
    """A response on a fine grid, of which each step sees the points that matter.

    `seen` are those that the present step fits, to which its refits add the worst.
    """

    def __init__(
        self,
        response: Target,
        end: float,
        rates: Complexes,
        envelope: float | None,
        least_decays: float,
    ) -> None:
        fastest = float(np.abs(rates.imag).max())
        self.times = fit_times(response, end, fastest)
        self.target = response(self.times)
        self.scale = float(np.abs(self.target).max())
        self.envelope, self.within = envelope, len(self.times)
        # Rows after the end are weighed so that the envelope there counts as the error before.
        self.weights = np.ones(self.within)
        if envelope is not None:
            tail = tail_times(rates, end)
            self.times = np.append(self.times, tail)
            self.target = np.append(self.target, np.zeros(len(tail)))
            self.weights = np.ones(len(self.times))
        self.least_decay = least_decays / end
        # How far a rate may move in a step of radius 1 [1/s]: about as far as it is damped.
        self.least_mobility = LEAST_MOBILITY / end
        self.base = np.zeros(len(self.times), dtype=bool)
        self.base[:: max(1, len(self.times) // max(300, 6 * count_terms(rates)))] = True
        self.seen = self.base

    def fitted(self, rates: Complexes) -> _Point:
        """Return the rates with minimax coefficients, refitted until the fine grid agrees."""
        basis = real_basis(rates, self.times)
        for _ in range(ROUNDS):
            weights = self.weights[self.seen]
            rows = basis[self.seen] * weights[:, np.newaxis]
            solution = solve_minimax(rows, self.target[self.seen] * weights)
            errors = np.abs(basis @ solution.weights - self.target)
            before = float(errors[: self.within].max())
            errors *= self.weights
            worst = float(errors.max())
            if worst <= (1.0 + AGREEMENT) * solution.value:
                break
            self.seen |= peaks(errors) & (errors > PEAK_OF_REFIT * solution.value)
        return _Point(rates, solution.weights, worst, before)

    def balanced(self, point: _Point) -> _Point:
        """Weigh times after the end anew by a point's error, and return the point so judged."""
        if self.envelope is None:
            return point
        weight = tail_weight(point.before, self.envelope)
        if weight == self.weights[-1]:
            return point
        self.weights[self.within :] = weight
        return self.fitted(point.rates)

    def step(self, point: _Point, radius: float) -> tuple[_Point, float]:
        """Return the point after one linear program, and the error that it predicts.

        Args:
            point: Where the sum is linearised.
            radius: How far a rate may move, in parts of its mobility.
        """
        x = ExponentialSum.from_weights(point.rates, point.weights)
        errors = (self.target - x(self.times)) * self.weights
        high = peaks(np.abs(errors)) & (np.abs(errors) > PEAK_OF_STEP * point.error)
        seen = self.base | high | np.roll(high, 2) | np.roll(high, -2)
        self.seen = seen
        times = self.times[seen]
        basis = real_basis(point.rates, times)
        # d/d(lambda) of Re c exp(lambda t) is Re (c t exp(lambda t) dlambda).
        coefficients = coefficients_of_weights(point.rates, point.weights)
        waves = np.exp(np.multiply.outer(times, point.rates)) * times[:, np.newaxis] * coefficients
        is_pair = point.rates.imag != 0.0
        tangents = np.concatenate([waves.real, -waves.imag[:, is_pair]], axis=1)
        tangents *= self.weights[seen, np.newaxis]
        basis *= self.weights[seen, np.newaxis]
        mobility = self.least_mobility + np.abs(point.rates.real)
        reach = radius * np.concatenate([mobility, mobility[is_pair]])
        # In units of its reach each change of a rate is a row that weighs as much as the error.
        terms, moves = basis.shape[1], tangents.shape[1]
        matrix = np.zeros((len(times) + moves, terms + moves))
        matrix[: len(times), :terms] = basis
        matrix[: len(times), terms:] = tangents * reach
        matrix[len(times) :, terms:] = point.error * np.eye(moves)
        target = np.concatenate([errors[seen], np.zeros(moves)])
        solution = solve_minimax(matrix, target)
        change = solution.weights[terms:] * reach
        rates = point.rates + change[: len(point.rates)]
        rates[is_pair] += 1j * change[len(point.rates) :]
        rates = np.minimum(rates.real, -self.least_decay) + 1j * np.abs(rates.imag)
        return self.fitted(rates), solution.value
