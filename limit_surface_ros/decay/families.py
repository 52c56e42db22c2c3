# SPDX-License-Identifier: Apache-2.0
"""Families of responses near a decay model m(t): what measurements may say of it.

| family | response |
|---|---|
| amplitude | A m(t) |
| rate | A m(s t) |
| delay | A m(s (t - d)), and A m(0) before d |
| extra decay | A exp(-a t) m(s t) |
| weights | sum of exponentials of the rates s lambda with coefficients of their own |

Each has normal priors on its numbers. This module imports numpy only, so that a node may load it
at start-up.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from limit_surface_ros.decay.basis import coefficients_of_weights, count_terms
from limit_surface_ros.decay.exponential_sum import ExponentialSum

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.basis import Complexes

# Prior deviations: of the amplitude (about 1), of log s, of d and a over the model's own times,
# and of coefficients over |m(0)| and the largest.
AMPLITUDE_SPREAD, RATE_SPREAD, DELAY_SPREAD, DECAY_SPREAD, WEIGHT_SPREAD = 3.0, 0.7, 0.3, 0.7, 0.5
# The jump of the slope may be so many deviations of the delay away.
DELAY_REACH = 3.5
# log s stays within this, and d within so many prior deviations.
MOST_RATE_CHANGE, MOST_DELAY = 3.0, 10.0


@dataclass(frozen=True)
class Learnt:
    """A response that was learnt: a sum of exponentials, which begins after a delay.

    Attributes:
        sum: x(t) for t >= delay.
        delay: Before it x stays at its value there [s].
    """

    sum: ExponentialSum
    delay: float = 0.0

    def __call__(self, times: Floats) -> Floats:
        """Return x at times [s] of any shape, each >= 0."""
        return self.sum(np.maximum(times, max(self.delay, 0.0)))

    def time_to_level(self, level: float) -> float:
        """Return the time [s] from which on |x| stays at or below a level for good."""
        time = self.sum.time_to_level(level)
        return 0.0 if time < self.delay else time


class Family:
    """Amplitude alone, and what the other families share.

    Args:
        model: m, as it was fitted; not zero everywhere.
    """

    name: ClassVar[str] = "amplitude"

    def __init__(self, model: ExponentialSum) -> None:
        """Set the priors."""
        self.rates: Complexes = model.rates
        self.coefficients: Complexes = model.coefficients
        self._constant = model.rates == 0.0
        self.mean: Floats
        self.spread: Floats
        self.mean, self.spread = self._prior(model)

    def _prior(self, model: ExponentialSum) -> tuple[Floats, Floats]:
        return np.ones(1), np.array([AMPLITUDE_SPREAD])

    def bounded(self, numbers: Floats) -> Floats:
        """Return the numbers moved to where the family has a meaning."""
        return numbers

    def values(self, times: Floats, numbers: Floats) -> tuple[Floats, Floats]:
        """Return the response and its slopes in the numbers, shapes (n,) and (n, numbers)."""
        shape, _ = self._model(times)
        return numbers[0] * shape, shape[:, np.newaxis]

    def learnt(self, numbers: Floats) -> Learnt:
        """Return the response that the numbers stand for."""
        return Learnt(ExponentialSum(self.rates, numbers[0] * self.coefficients))

    def rate(self, numbers: Floats) -> float:
        """Return the factor s on the model's rates."""
        return 1.0

    def delay(self, numbers: Floats) -> float:
        """Return the delay d [s]."""
        return 0.0

    def spread_at(self, times: Floats, numbers: Floats, root: Floats) -> Floats:
        """Return the standard deviation of the response at times, shape (n,).

        Args:
            times: Shape (n,) [s].
            numbers: The family's numbers.
            root: Upper triangular R with R'R their information.
        """
        _, slopes = self.values(times, numbers)
        spread: Floats = np.sqrt((np.linalg.solve(root.T, slopes.T) ** 2).sum(axis=0))
        return spread

    def _model(self, times: Floats) -> tuple[Floats, Floats]:
        """Return m and its derivative at times, each shape (n,)."""
        waves = np.exp(np.multiply.outer(times, self.rates)) * self.coefficients
        return waves.real.sum(axis=1), (waves * self.rates).real.sum(axis=1)


class RateFamily(Family):
    """A m(s t); numbers A and log s."""

    name = "rate"

    def rate(self, numbers: Floats) -> float:
        """Return the factor s on the model's rates."""
        return float(np.exp(numbers[1]))

    def _prior(self, model: ExponentialSum) -> tuple[Floats, Floats]:
        return np.array([1.0, 0.0]), np.array([AMPLITUDE_SPREAD, RATE_SPREAD])

    def bounded(self, numbers: Floats) -> Floats:
        """Keep log s within what can be told."""
        kept: Floats = numbers.copy()
        kept[1] = np.clip(kept[1], -MOST_RATE_CHANGE, MOST_RATE_CHANGE)
        return kept

    def values(self, times: Floats, numbers: Floats) -> tuple[Floats, Floats]:
        """Return the response and its slopes in the numbers."""
        amplitude, speed = numbers[0], np.exp(numbers[1])
        shape, slope = self._model(speed * times)
        values: Floats = amplitude * shape
        return values, np.stack([shape, amplitude * speed * times * slope], axis=1)

    def learnt(self, numbers: Floats) -> Learnt:
        """Return the response that the numbers stand for."""
        rates = self.rates * np.exp(numbers[1])
        return Learnt(ExponentialSum(rates, numbers[0] * self.coefficients))


class DelayFamily(RateFamily):
    """A m(s (t - d)), and A m(0) before d; numbers A, log s and d."""

    name = "delay"

    def delay(self, numbers: Floats) -> float:
        """Return the delay d [s]."""
        return float(numbers[2])

    def _prior(self, model: ExponentialSum) -> tuple[Floats, Floats]:
        fastest = float(np.abs(model.rates).max()) or 1.0
        spread = np.array([AMPLITUDE_SPREAD, RATE_SPREAD, DELAY_SPREAD / fastest])
        return np.array([1.0, 0.0, 0.0]), spread

    def bounded(self, numbers: Floats) -> Floats:
        """Keep log s and the delay within what can be told."""
        kept = super().bounded(numbers)
        most = MOST_DELAY * self.spread[2]
        kept[2] = np.clip(kept[2], -most, most)
        return kept

    def values(self, times: Floats, numbers: Floats) -> tuple[Floats, Floats]:
        """Return the response and its slopes in the numbers."""
        amplitude, speed, delay = numbers[0], np.exp(numbers[1]), numbers[2]
        late = np.maximum(times - delay, 0.0)
        shape, slope = self._model(speed * late)
        slope = amplitude * speed * slope
        slopes = np.stack([shape, late * slope, np.where(late > 0.0, -slope, 0.0)], axis=1)
        values: Floats = amplitude * shape
        return values, slopes

    def spread_at(self, times: Floats, numbers: Floats, root: Floats) -> Floats:
        """Return the standard deviation, near the delay too, where slopes jump."""
        spread = super().spread_at(times, numbers, root)
        deviation = float(np.linalg.norm(np.linalg.solve(root.T, [0.0, 0.0, 1.0])))
        values, _ = self.values(times, numbers)
        for share in (-DELAY_REACH, DELAY_REACH):
            moved, _ = self.values(times, numbers + np.array([0.0, 0.0, share * deviation]))
            spread = np.maximum(spread, np.abs(moved - values) / DELAY_REACH)
        return spread

    def learnt(self, numbers: Floats) -> Learnt:
        """Return the response that the numbers stand for."""
        rates, delay = self.rates * np.exp(numbers[1]), float(numbers[2])
        coefficients = numbers[0] * self.coefficients * np.exp(-rates * delay)
        coefficients = np.where(rates.imag == 0.0, coefficients.real, coefficients)
        return Learnt(ExponentialSum(rates, coefficients), delay)


class DecayFamily(RateFamily):
    """A exp(-a t) m(s t); numbers A, log s and a."""

    name = "extra decay"

    def _prior(self, model: ExponentialSum) -> tuple[Floats, Floats]:
        moving = model.rates[model.rates != 0.0]
        # Of a constant alone any decay is one more than it had.
        slowest = float(-moving.real.max()) if len(moving) else 1.0
        self._least = -0.9 * slowest if not self._constant.any() else 0.0
        spread = np.array([AMPLITUDE_SPREAD, RATE_SPREAD, DECAY_SPREAD * slowest])
        return np.array([1.0, 0.0, 0.0]), spread

    def bounded(self, numbers: Floats) -> Floats:
        """Keep the response decaying."""
        kept = super().bounded(numbers)
        kept[2] = max(kept[2], self._least * np.exp(kept[1]))
        return kept

    def values(self, times: Floats, numbers: Floats) -> tuple[Floats, Floats]:
        """Return the response and its slopes in the numbers."""
        amplitude, speed, decay = numbers[0], np.exp(numbers[1]), numbers[2]
        # In one exponential: the decay alone may overflow where the product does not.
        waves = np.exp(np.multiply.outer(times, speed * self.rates - decay)) * self.coefficients
        shape = waves.real.sum(axis=1)
        slope = amplitude * speed * times * (waves * self.rates).real.sum(axis=1)
        values: Floats = amplitude * shape
        return values, np.stack([shape, slope, -times * values], axis=1)

    def learnt(self, numbers: Floats) -> Learnt:
        """Return the response that the numbers stand for."""
        rates = self.rates * np.exp(numbers[1]) - numbers[2]
        return Learnt(ExponentialSum(rates, numbers[0] * self.coefficients))


class WeightsFamily(Family):
    """Coefficients of their own on the rates s lambda; numbers: the weights and log s."""

    name = "weights"

    def rate(self, numbers: Floats) -> float:
        """Return the factor s on the model's rates."""
        return float(np.exp(numbers[-1]))

    def _prior(self, model: ExponentialSum) -> tuple[Floats, Floats]:
        weights = model.weights
        spread = WEIGHT_SPREAD * (abs(model.start) + float(np.abs(weights).max()))
        self._terms = count_terms(model.rates)
        spreads = np.append(np.full(self._terms, spread), RATE_SPREAD)
        return np.append(weights, 0.0), spreads

    def bounded(self, numbers: Floats) -> Floats:
        """Keep log s within what can be told."""
        kept: Floats = numbers.copy()
        kept[-1] = np.clip(kept[-1], -MOST_RATE_CHANGE, MOST_RATE_CHANGE)
        return kept

    def values(self, times: Floats, numbers: Floats) -> tuple[Floats, Floats]:
        """Return the response and its slopes in the numbers."""
        rates = self.rates * np.exp(numbers[-1])
        waves = np.exp(np.multiply.outer(times, rates))
        columns = np.empty((len(times), 2 * len(rates)))
        columns[:, 0::2], columns[:, 1::2] = waves.real, -waves.imag
        used = np.ones(2 * len(rates), dtype=bool)
        used[1::2] = rates.imag != 0.0
        columns = columns[:, used]
        coefficients = coefficients_of_weights(rates, numbers[:-1])
        speed = times * (waves @ (coefficients * rates)).real
        values: Floats = columns @ numbers[:-1]
        return values, np.column_stack([columns, speed])

    def learnt(self, numbers: Floats) -> Learnt:
        """Return the response that the numbers stand for."""
        return Learnt(ExponentialSum.from_weights(self.rates * np.exp(numbers[-1]), numbers[:-1]))


# In the order of preference among those that fit alike.
FAMILIES = (Family, RateFamily, DelayFamily, DecayFamily, WeightsFamily)
