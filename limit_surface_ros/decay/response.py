# SPDX-License-Identifier: Apache-2.0
"""One onset's response: a decay model scaled to an onset, and corrected by what is measured.

Measurements come and predictions go as fractions of the onset, x(t) / x(0) with the x(0) of the
model as it was fitted, so that a response of another amplitude than the onset's is learnt too.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_floats
from limit_surface_ros.decay.estimation import ResponseEstimator
from limit_surface_ros.errors import NoOnsetError, RangeError

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.estimation import EstimationOptions, Verdict
    from limit_surface_ros.decay.exponential_sum import ExponentialSum
    from limit_surface_ros.decay.families import Learnt

# x(0) below this share of the sum of |c| is rounding and no value to scale by.
SMALLEST_START = 1e-12
# A measurement of so many onsets is of something else, and its squares are beyond numbers.
LARGEST_FRACTION = 1e12


def onset_value(x: ExponentialSum) -> float:
    """Return x(0), by which a response is scaled to its onset.

    Raises:
        NoOnsetError: x(0) is zero, so that x(t) / x(0) has no meaning.
    """
    if not abs(x.start) > SMALLEST_START * x.size:
        raise NoOnsetError(
            f"the decay model starts at x(0) = {x.start:g}: it cannot be scaled to an onset"
        )
    return x.start


class Response:
    """How one load dies away after its onset.

    Args:
        model: The decay model as it was fitted.
        max_error: Its largest error, in the unit of x.
        options: How far measurements are trusted over it; `noise` as a fraction of the onset.
        stated: What is stated of the model's error at times [s], shape (n,), infinite where
            nothing is; `max_error` everywhere if None.

    Attributes:
        start: x(0) of the model as it was fitted.

    Raises:
        NoOnsetError: x(0) is zero.
    """

    def __init__(
        self,
        model: ExponentialSum,
        max_error: float,
        options: EstimationOptions,
        stated: Callable[[Floats], Floats] | None = None,
    ) -> None:
        """Start with the model as it was fitted."""
        self.start = onset_value(model)
        self._model = model
        self._max_error = max_error
        self._stated = stated or (lambda times: np.full(times.shape, max_error))
        # A sample departs from any sum of these exponentials by noise and by the fit's error.
        noise = math.hypot(options.noise * abs(self.start), max_error)
        self._options = replace(options, noise=noise, model_error=max_error)
        self.forget()

    @property
    def x(self) -> Learnt:
        """The response as it is known now."""
        return self._estimator.learnt

    @property
    def verdict(self) -> Verdict:
        """What the measurements say of the model."""
        return self._estimator.verdict

    @property
    def samples(self) -> int:
        """Number of measurements that count in it."""
        return self._estimator.accepted

    @property
    def outliers(self) -> int:
        """Number of measurements that were refused for being too far from their prediction."""
        return self._estimator.outliers

    @property
    def residual(self) -> float:
        """Last measured fraction minus its prediction; NaN before the first."""
        return self._estimator.residual / self.start

    @property
    def noise(self) -> float:
        """Standard deviation of a measurement, in the unit of x, the fit's error included."""
        return self._options.noise

    @property
    def known_until(self) -> float:
        """Time [s] after which nothing is stated because the model itself does not fit."""
        verdict = self.verdict
        if not self.samples or (verdict.fits and verdict.family == "amplitude"):
            return math.inf
        if not verdict.followed:
            return self._estimator.seen
        return self._options.span_factor * self._estimator.seen

    def fractions(self, times: ArrayLike) -> Floats:
        """Return what is left of the onset at given times [s], each >= 0."""
        fractions: Floats = self.x(as_floats("times", times)) / self.start
        return fractions

    def bounds(self, times: ArrayLike) -> Floats:
        """Return the largest error that is to be expected at given times, in the unit of x.

        What is stated of the model, and after corrections four standard deviations of the
        estimate, and the distance to other families that measurements do not rule out. Infinite
        where nothing is known: where nothing is stated; where the model itself does not fit, after
        `span_factor` times the time that was seen; and where no family follows, after that time.

        Args:
            times: Shape (n,) [s], each >= 0.
        """
        t = as_floats("times", times)
        if not self.samples:
            return self._stated(t)
        amplitude = max(1.0, abs(self.verdict.amplitude))
        open_now = self._estimator.bounds(t)
        if math.isinf(self.known_until):
            return amplitude * self._stated(t) + open_now
        bounds = amplitude * self._max_error + open_now
        return np.where(t <= self.known_until, bounds, math.inf)

    def time_to_fraction(self, fraction: float) -> float:
        """Return the time [s] from which on no more than a fraction of the onset is left."""
        return self.x.time_to_level(fraction * abs(self.start))

    def learn(self, time: float, fraction: float) -> bool:
        """Correct the response by a measurement; False if it is an outlier.

        Args:
            time: Time after the onset [s], later than that of the measurement before.
            fraction: What was left of the onset.

        Raises:
            NotFiniteError: A number is NaN or infinite.
            RangeError: The time is before the onset or not after that of the measurement before,
                or the fraction is larger than `LARGEST_FRACTION`.
        """
        if abs(fraction) > LARGEST_FRACTION:
            raise RangeError(
                f"a measurement is {fraction:.3g} times the onset; at most {LARGEST_FRACTION:g} "
                "times is accepted"
            )
        return self._estimator.add(time, fraction * self.start)

    def forget(self) -> None:
        """Return to the model as it was fitted, as when time itself was set back."""
        self._estimator = ResponseEstimator(self._model, self._options)
