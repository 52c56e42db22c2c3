# SPDX-License-Identifier: Apache-2.0
"""One family of responses fitted to samples by Gauss-Newton's method, its evidence and its tests.

The evidence is chi^2 + prior + log det (information) - log det (prior information). Residuals are
tested against the stated noise: for their size, for what hangs together from one to the next, and
for slow waves.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.decay.families import RATE_SPREAD

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.families import Family

# Tests of the residuals: so many deviations are too many, from so many samples on.
MOST_DEVIATIONS, LEAST_TESTED = 4.0, 8
# A misfit is smooth, noise is not: the sum of squares of so many slow waves of the residuals,
# which noise makes larger than this once in a hundred thousand times, and larger than what is
# doubtful once in a hundred. What a family could follow itself is no part of them; this share of a
# wave keeps what is left of it apart from rounding.
SLOW_WAVES, MOST_SLOW, DOUBTFUL, LEAST_LEFT = 4, 28.5, 13.3, 0.02
# Rates that are by more than this prior deviation off the model's are not near it.
MOST_RATE_DEVIATION = 3.0


class FamilyFit:
    """One family's numbers, and what they leave of the samples.

    Attributes:
        numbers: Of the family.
        root: Upper triangular root of their information.
        evidence: The smaller, the likelier is the family; infinite if it cannot be fitted.
        chi2: Sum of the squares of the residuals, in deviations.
        samples: That were seen.
        after: Of these, the ones after the delay, which tell how it goes on.

    Args:
        family: The family.
        systematic: How many deviations all residuals may be off alike.
    """

    def __init__(self, family: Family, systematic: float) -> None:
        """Begin from the family's means."""
        self.family = family
        self.systematic = systematic
        self.numbers = family.mean
        self.root = np.diag(1.0 / family.spread)
        self.evidence = 0.0
        self.chi2 = 0.0
        self.freedom = 1
        self.linked = 0.0
        self.slow = 0.0
        self.samples = 0
        self.after = 0

    def update(self, times: Floats, values: Floats, deviations: Floats, steps: int) -> None:
        """Move the numbers by so many steps of Gauss and Newton, and judge them."""
        family = self.family
        prior = 1.0 / family.spread
        numbers, objective = self.numbers, math.inf

        def residuals(numbers: Floats) -> tuple[Floats, Floats, Floats, float]:
            """Return errors, how far the numbers are from their means, slopes and objective."""
            fitted, slopes = family.values(times, numbers)
            errors, away = (values - fitted) / deviations, (family.mean - numbers) * prior
            return errors, away, slopes, float(errors @ errors + away @ away)

        for _ in range(steps + 1):
            errors, away, slopes, total = residuals(numbers)
            if not total <= objective:
                # Half the way back, once; the next sample brings another step.
                numbers = family.bounded(0.5 * (numbers + self.numbers))
                errors, away, slopes, total = residuals(numbers)
                if not total <= objective:
                    break
            rows = np.concatenate([slopes / deviations[:, np.newaxis], np.diag(prior)])
            information = rows.T @ rows
            self.numbers, objective = numbers, total
            self._judge(information, errors, away, prior, rows[: len(times)])
            self.after = int(np.count_nonzero(times > family.delay(numbers)))
            step = np.linalg.solve(information, rows.T @ np.concatenate([errors, away]))
            numbers = family.bounded(numbers + step)
            if float(np.abs(step * prior).max()) < 1e-6:
                break

    def _judge(
        self, information: Floats, errors: Floats, away: Floats, prior: Floats, slopes: Floats
    ) -> None:
        self.root = np.linalg.cholesky(information).T
        self.chi2 = float(errors @ errors)
        self.freedom = max(1, len(errors) - len(prior))
        self.linked = float(errors[1:] @ errors[:-1]) / math.sqrt(max(1, len(errors) - 1))
        occam = 2.0 * float(np.log(np.diag(self.root)).sum() - np.log(prior).sum())
        self.evidence = self.chi2 + float(away @ away) + occam
        self.samples = len(errors)
        self.slow = self._slow(errors, slopes)

    def _slow(self, errors: Floats, slopes: Floats) -> float:
        """Return the sum of squares of the residuals' slow waves, in units of what noise makes."""
        count = len(errors)
        turns = np.multiply.outer(np.arange(count) + 0.5, np.arange(1, SLOW_WAVES + 1)) / count
        waves = math.sqrt(2.0 / count) * np.cos(np.pi * turns)
        followed = np.linalg.solve(self.root.T, slopes.T @ waves)
        left = (1.0 + LEAST_LEFT) * np.eye(SLOW_WAVES) - followed.T @ followed
        sizes = waves.T @ errors
        return float(sizes @ np.linalg.solve(left, sizes))

    @property
    def excess(self) -> float:
        """How many deviations chi^2 is too large (Wilson and Hilferty's cube root)."""
        share = 2.0 / (9.0 * self.freedom)
        root = float((self.chi2 / self.freedom) ** (1.0 / 3.0))
        return (root - 1.0 + share) / math.sqrt(share)

    @property
    def passes(self) -> bool:
        """Whether the residuals are what noise would be."""
        if self.samples < LEAST_TESTED:
            return True
        return self.excess <= MOST_DEVIATIONS and self.is_near and not self.is_smooth()

    @property
    def is_near(self) -> bool:
        """Whether the rates are near those of the model."""
        return abs(math.log(self.family.rate(self.numbers))) <= MOST_RATE_DEVIATION * RATE_SPREAD

    @property
    def is_doubtful(self) -> bool:
        """Whether noise would hardly make such residuals, or the response has hardly begun."""
        if self.samples < LEAST_TESTED:
            return False
        return self.after < LEAST_TESTED or self.is_smooth(most=DOUBTFUL)

    def is_smooth(self, noise: float = 1.0, most: float = MOST_SLOW) -> bool:
        """Tell whether residuals hang together as no noise of so many times the stated does."""
        alike = math.sqrt(self.samples) * self.systematic
        most_slow = (math.sqrt(most) * noise + alike) ** 2
        most_linked = MOST_DEVIATIONS * noise**2 + alike * self.systematic
        return self.slow > most_slow or self.linked > most_linked

    def at(self, times: Floats) -> tuple[Floats, Floats]:
        """Return the response and its standard deviation at times, each shape (n,)."""
        fitted, _ = self.family.values(times, self.numbers)
        inflated = math.sqrt(max(1.0, self.chi2 / self.freedom))
        return fitted, inflated * self.family.spread_at(times, self.numbers, self.root)
