# SPDX-License-Identifier: Apache-2.0
"""What samples of a response say of its decay model, while they come in.

Several families of responses near the model (`families`) are fitted to the samples from where they
were, with normal priors (`family_fit`). The evidence of each chooses among them: Occam's razor of
Laplace's approximation [1]. Residuals are tested against the stated noise, so that a
response of no family is told and not believed: nothing is stated then of what comes. Weights of
their own follow much that is no sum of the model's exponentials, so that where nothing less
follows the samples, bounds leave room for a polynomial beside them.

At most 400 samples are kept: of more, every other one of the older half is dropped.

This module imports numpy only, so that a node may load it at start-up.

[1] D. J. C. MacKay, Bayesian interpolation, Neural Computation 4, 415-447, 1992,
    doi 10.1162/neco.1992.4.3.415.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from statistics import median
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_number, as_positive
from limit_surface_ros.decay.families import FAMILIES, WEIGHT_SPREAD, Learnt
from limit_surface_ros.decay.family_fit import FamilyFit
from limit_surface_ros.errors import RangeError

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.exponential_sum import ExponentialSum

MOST_SAMPLES = 400
# All families are fitted at each of the first samples, and then at each tenth.
FIRST, EVERY = 5, 10
FIRST_STEPS, STEPS = 4, 2
# Families whose evidence differs by less than this fit alike.
ALIKE = 4.0
# A family within so much of the best widens the bounds.
CREDIBLE = 12.0
# Terms of the polynomial that weights leave room for, and the latest of its time over that seen.
POLYNOMIAL_TERMS, FARTHEST = 3, 1e6
# Deviations in a bound, and the last samples that a bound is not below if nothing fits.
BOUND_DEVIATIONS, LAST_SAMPLES = 4.0, 20
NOISY = "the measurements are noisier than is stated"
# Time [s] after which bounds are those of then.
LATEST = 1e100
# Residuals before a sample that show whether it stands alone.
NEIGHBOURS = 5


@dataclass(frozen=True)
class EstimationOptions:
    """How far samples are trusted over the model.

    Attributes:
        noise: Standard deviation of a sample, in the unit of x.
        forgetting: Weight of a sample relative to the one after it, in (0, 1].
        gate: A sample further than so many standard deviations from its prediction, and from what
            its neighbours are off theirs, is an outlier.
        change_after: After so many samples in a row beyond the gate the response has changed: what
            was learnt before them is dropped.
        span_factor: Where the model itself does not fit, bounds are stated up to so many times the
            time that was seen, at least 1.
        model_error: Largest error of the model itself, in the unit of x, by which all samples may
            be off alike.

    Raises:
        RangeError: A number is outside its range.
    """

    noise: float
    forgetting: float = 0.999
    gate: float = 5.0
    change_after: int = 10
    span_factor: float = 3.0
    model_error: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        for name in ("noise", "gate"):
            as_positive(name, getattr(self, name))
        if not 0.0 < self.forgetting <= 1.0:
            raise RangeError(f"forgetting must be above 0 and at most 1, got {self.forgetting}")
        if self.change_after < 1:
            raise RangeError(f"change_after must be at least 1, got {self.change_after}")
        if not self.span_factor >= 1.0:
            raise RangeError(f"span_factor must be at least 1, got {self.span_factor}")
        if not 0.0 <= self.model_error < math.inf:
            raise RangeError(f"model_error must be finite and at least 0, got {self.model_error}")


@dataclass(frozen=True)
class Verdict:
    """What the samples say of the model.

    Attributes:
        fits: Whether a family fits them within the stated noise; True while there are few.
        family: Name of the family that was chosen, see `families`.
        amplitude: Factor on the model at the onset.
        rate: Factor s on its rates.
        delay: Delay d [s].
        reversed: Whether the response has the other sign, as of a sensor that is mounted the other
            way round.
        chi2_per_sample: Mean square of the residuals in units of the noise; NaN without samples.
        reason: Why nothing fits, in words; empty if something does.
        followed: Whether a family follows them, if with more noise than is stated. Nothing is
            known of what comes if none does.
    """

    fits: bool = True
    family: str = "amplitude"
    amplitude: float = 1.0
    rate: float = 1.0
    delay: float = 0.0
    reversed: bool = False
    chi2_per_sample: float = math.nan
    reason: str = ""
    followed: bool = True


class ResponseEstimator:
    """What is known of one response, and how sure it is; its memory does not grow.

    Args:
        model: The model that was fitted offline.
        options: How far samples are trusted.

    Attributes:
        accepted: Number of samples that count.
        outliers: Number of samples that were refused for standing out.
        residual: Last sample minus its prediction, in the unit of x; NaN before the first.
        seen: Time of the last sample that counts [s].

    Raises:
        RangeError: The model is zero everywhere.

    Example:
        >>> from limit_surface_ros.decay.exponential_sum import ExponentialSum
        >>> model = ExponentialSum([-1.0], [1.0])
        >>> estimator = ResponseEstimator(model, EstimationOptions(noise=0.01))
        >>> for time in np.arange(0.0, 1.0, 0.02):
        ...     _ = estimator.add(time, 1.2 * float(model(0.5 * time)))
        >>> estimator.verdict.family, round(estimator.verdict.rate, 2)
        ('rate', 0.5)
    """

    def __init__(self, model: ExponentialSum, options: EstimationOptions) -> None:
        """Start at the model."""
        if not model.coefficients.any():
            raise RangeError("a decay model that is zero has no size to judge its corrections by")
        self.accepted = 0
        self.outliers = 0
        self.residual = math.nan
        self.seen = 0.0
        self._model = model
        self._options = options
        self._last_time = -math.inf
        self._beyond: list[tuple[float, float]] = []
        self._residuals: deque[float] = deque(maxlen=NEIGHBOURS)
        self._changed = False
        self._learnt: Learnt | None = Learnt(model)
        self._restart()

    @property
    def learnt(self) -> Learnt:
        """The response of the chosen family; the model's own until a sample counts."""
        if self._learnt is None:
            self._learnt = self._best.family.learnt(self._best.numbers)
        return self._learnt

    @property
    def verdict(self) -> Verdict:
        """What the samples say of the model."""
        best = self._best
        if not self.accepted:
            return Verdict()
        reason = self._reason(best)
        learnt = self.learnt
        amplitude = float(best.numbers[0])
        if best.family.name == "weights":
            amplitude = learnt.sum.start / (self._model.start or math.nan)
        spread = 1.0 / float(best.root[0, 0]) if len(best.numbers) == 1 else self._spread(best)
        return Verdict(
            fits=not reason,
            family=best.family.name,
            amplitude=amplitude,
            rate=best.family.rate(best.numbers),
            delay=learnt.delay,
            reversed=amplitude < -BOUND_DEVIATIONS * spread,
            chi2_per_sample=best.chi2 / max(1, best.samples),
            reason=reason,
            followed=reason in ("", NOISY),
        )

    def add(self, time: float, value: float) -> bool:
        """Take a sample in.

        Args:
            time: Time after the onset [s], later than that of the sample before.
            value: The response, in the unit of x.

        Returns:
            False if the sample is an outlier, which counts for nothing.

        Raises:
            NotFiniteError: A number is NaN or infinite.
            RangeError: The time is before the onset or not after that of the sample before.
        """
        t = as_number("time of a sample", time)
        y = as_number("value of a sample", value)
        if t < 0.0:
            raise RangeError(f"a sample's time must be at least 0, got {t:g} s before the onset")
        if not t > self._last_time:
            raise RangeError(
                f"samples must come in the order of time: got {t:g} s after {self._last_time:g} s"
            )
        self._last_time = t
        predicted, spread = self._best.at(np.array([t]))
        self.residual = y - float(predicted[0])
        noise, gate = self._options.noise, self._options.gate
        beyond = abs(self.residual) > gate * math.hypot(noise, float(spread[0]))
        shared = median(self._residuals) if len(self._residuals) == NEIGHBOURS else 0.0
        alone = beyond and abs(self.residual - shared) > gate * noise
        self._residuals.append(self.residual)
        self._beyond = [*self._beyond, (t, y)] if beyond else []
        if len(self._beyond) >= self._options.change_after:
            self.outliers += alone
            self._begin_anew()
            return not alone
        if alone:
            self.outliers += 1
            return False
        self._keep(t, y)
        self.accepted += 1
        self._fit()
        return True

    def bounds(self, times: Floats) -> Floats:
        """Return what the response is expected to differ from `learnt` by at most, shape (n,).

        Four standard deviations of the mixture of all families, and the distance to each that
        is credible; where nothing fits, or hardly, at least the largest of the last samples.
        Infinite after the last sample where no family follows the samples.
        """
        # What is left later is the constant; products with later times would overflow.
        times = np.minimum(times, LATEST)
        centre = self.learnt(times)
        self._catch_up()
        fits = [fit for fit in self._fits if fit.samples == self._best.samples] or [self._best]
        least = min(fit.evidence for fit in fits)
        weights = np.array([math.exp(-0.5 * (fit.evidence - least)) for fit in fits])
        weights /= weights.sum()
        results = [fit.at(times) for fit in fits]
        mean = sum(w * values for w, (values, _) in zip(weights, results, strict=True))
        variance = sum(
            w * (spread**2 + (values - mean) ** 2)
            for w, (values, spread) in zip(weights, results, strict=True)
        )
        bounds: Floats = np.abs(mean - centre) + BOUND_DEVIATIONS * np.sqrt(variance)
        for fit, (values, spread) in zip(fits, results, strict=True):
            if fit.evidence - least <= CREDIBLE and fit.passes:
                bounds = np.maximum(bounds, np.abs(values - centre) + spread)
        if self._reason(self._best) or self._best.is_doubtful:
            last = float(np.abs(self._values[-LAST_SAMPLES:]).max())
            bounds = np.maximum(bounds, last + BOUND_DEVIATIONS * self._options.noise)
        if self._best.family.name == "weights" and len(self._times):
            bounds = np.maximum(bounds, self._room(times))
        if not self.verdict.followed:
            off = float(np.abs(self._values - self.learnt(self._times)).max())
            bounds = np.maximum(bounds, off + BOUND_DEVIATIONS * self._options.noise)
            bounds = np.where(times <= self.seen, bounds, math.inf)
        return bounds

    def _catch_up(self) -> None:
        """Fit the families that have not seen the last samples; the chosen one stays as it is.

        They are fitted at each tenth sample only, and bounds need all of them.
        """
        self._update([fit for fit in self._fits if fit.samples != self._best.samples], STEPS)

    def _update(self, fits: list[FamilyFit], steps: int) -> None:
        """Fit families to the samples; one that cannot be fitted is the least likely."""
        deviations = self._deviations()
        for fit in fits:
            try:
                fit.update(self._times, self._values, deviations, steps)
            except np.linalg.LinAlgError:
                fit.evidence = math.inf

    def _room(self, times: Floats) -> Floats:
        """Return the bound that a polynomial beside the chosen family asks for, shape (n,)."""
        best, mine = self._best, self._best.family
        fitted, slopes = mine.values(self._times, best.numbers)
        deviations = self._deviations()
        size = WEIGHT_SPREAD * float(np.abs(self._values).max() + self._options.noise)
        spreads = np.append(mine.spread, np.full(POLYNOMIAL_TERMS, size))
        rows = np.hstack([slopes, self._polynomial(self._times)]) * spreads
        errors = (self._values - fitted) / deviations
        rows /= deviations[:, np.newaxis]
        away = np.append((mine.mean - best.numbers) / mine.spread, np.zeros(POLYNOMIAL_TERMS))
        information = rows.T @ rows + np.eye(len(spreads))
        root = np.linalg.cholesky(information)
        move = np.linalg.solve(information, rows.T @ errors + away)
        _, later = mine.values(times, best.numbers)
        ahead = np.hstack([later, self._polynomial(times)]) * spreads
        spread = np.linalg.norm(np.linalg.solve(root, ahead.T), axis=0)
        room: Floats = np.abs(ahead @ move) + BOUND_DEVIATIONS * spread
        return room

    def _polynomial(self, times: Floats) -> Floats:
        """Return Legendre's polynomials over the time that was seen, shape (n, terms)."""
        first = float(self._times[0])
        span = max(self.seen - first, 1e-300)
        scaled = np.minimum((times - first) / span, FARTHEST)
        basis = np.polynomial.legendre.legvander(2.0 * scaled - 1.0, POLYNOMIAL_TERMS - 1)
        return np.asarray(basis, dtype=np.float64)

    def _deviations(self) -> Floats:
        deviations: Floats = self._options.noise * self._options.forgetting ** (-0.5 * self._ages)
        return deviations

    def _reason(self, best: FamilyFit) -> str:
        if self._changed:
            return "the response has changed, and what was learnt before no longer holds"
        if best.passes:
            return ""
        # Larger noise alone leaves residuals as independent as before.
        if not best.is_near or best.is_smooth(max(1.0, math.sqrt(best.chi2 / best.samples))):
            return "no family of responses near the model follows the measurements"
        return NOISY

    def _spread(self, fit: FamilyFit) -> float:
        """Return the standard deviation of the first number."""
        unit = np.zeros(len(fit.numbers))
        unit[0] = 1.0
        return float(np.linalg.norm(np.linalg.solve(fit.root.T, unit)))

    def _restart(self) -> None:
        systematic = self._options.model_error / self._options.noise
        self._fits = [FamilyFit(family(self._model), systematic) for family in FAMILIES]
        self._best = self._fits[0]
        self._times, self._values = np.zeros(0), np.zeros(0)
        self._ages = np.zeros(0)

    def _begin_anew(self) -> None:
        """Drop all samples but those in a row that the fit before could not have predicted."""
        samples, self._beyond = self._beyond, []
        self._restart()
        self._changed = True
        for t, y in samples:
            self._keep(t, y)
        self.accepted += 1
        self._fit()

    def _keep(self, t: float, y: float) -> None:
        if len(self._times) >= MOST_SAMPLES:
            half = MOST_SAMPLES // 2
            kept = np.append(np.arange(0, half, 2), np.arange(half, MOST_SAMPLES))
            self._times, self._values = self._times[kept], self._values[kept]
            self._ages = self._ages[kept]
        self._times, self._values = np.append(self._times, t), np.append(self._values, y)
        self._ages = np.append(self._ages + 1.0, 0.0)
        self.seen = t

    def _fit(self) -> None:
        count = len(self._times)
        self._learnt = None
        if count > FIRST and self.accepted % EVERY:
            self._best.update(self._times, self._values, self._deviations(), STEPS - 1)
            return
        self._update(self._fits, FIRST_STEPS if count <= 2 * EVERY else STEPS)
        least = min(fit.evidence for fit in self._fits)
        self._best = next(fit for fit in self._fits if fit.evidence <= least + ALIKE)
        if self._changed and count >= 5 * self._options.change_after and self._best.passes:
            self._changed = False
