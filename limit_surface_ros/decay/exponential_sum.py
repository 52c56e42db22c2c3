# SPDX-License-Identifier: Apache-2.0
"""Sums of exponentials: what a decay model is, and all that a program that uses one needs.

A sum stands for x(t) = Re sum_k c_k exp(lambda_k t), t >= 0, with one rate of each conjugate pair
(Im lambda_k >= 0). A real rate is one real term, a pair is two: exp(a t) cos(b t) and
exp(a t) sin(b t). A rate of 0 is a constant, to which the rest decays. This module imports numpy
only, so that a node may load it at start-up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NoReturn

import numpy as np

from limit_surface_ros.checks import as_count, as_floats, as_number
from limit_surface_ros.decay.basis import (
    as_complexes,
    as_rates,
    coefficients_of_weights,
    count_terms,
    weights_of_coefficients,
)
from limit_surface_ros.decay.levels import VANISHED, LevelSearch
from limit_surface_ros.errors import RangeError, ShapeError, UnstableError
from limit_surface_ros.runtime import keep_scratch

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats, as_count
    from limit_surface_ros.decay.basis import Complexes

# Exponentials that are evaluated at a time.
BLOCK = 1 << 15


@dataclass(frozen=True, eq=False)
class ExponentialSum:
    """The function x(t) = Re sum_k c_k exp(lambda_k t) of t >= 0; immutable.

    Attributes:
        rates: Shape (m,), complex lambda_k [1/s], one of each conjugate pair (Im >= 0).
        coefficients: Shape (m,), complex c_k in the unit of x; real where the rate is real. The
            two conjugate exponentials of a pair have the coefficients c/2 and conj(c)/2.

    Raises:
        ShapeError: The two are not lists of one length, at least one.
        NotFiniteError: A number is NaN or infinite.
        RangeError: A rate has Im < 0, or a real rate has a coefficient that is not real.

    Example:
        >>> x = ExponentialSum(rates=[-1.0, -2.0 + 3.0j], coefficients=[0.5, 0.5])
        >>> float(x(0.0)), x.terms
        (1.0, 3)
    """

    rates: Complexes
    coefficients: Complexes

    def __post_init__(self) -> None:
        """Check both arrays and that they belong together, and make them read-only."""
        rates = as_rates(self.rates)
        coefficients = as_complexes("coefficients", self.coefficients)
        if rates.shape != coefficients.shape:
            raise ShapeError(
                f"each rate needs one coefficient, got {len(rates)} rates and "
                f"{len(coefficients)} coefficients"
            )
        not_real = (rates.imag == 0.0) & (coefficients.imag != 0.0)
        if not_real.any():
            place = int(np.flatnonzero(not_real)[0])
            raise RangeError(
                f"the coefficient of a real rate must be real, got {coefficients[place]} "
                f"for the rate {rates[place].real} at index {place}"
            )
        object.__setattr__(self, "rates", rates)
        object.__setattr__(self, "coefficients", coefficients)

    @classmethod
    def from_weights(cls, rates: Complexes, weights: Floats) -> ExponentialSum:
        """Return the sum of the columns of `real_basis(rates, ...)` with these weights."""
        return cls(rates, coefficients_of_weights(rates, weights))

    @property
    def weights(self) -> Floats:
        """Weights of the columns of `real_basis(rates, ...)`, shape (terms,)."""
        return weights_of_coefficients(self.rates, self.coefficients)

    @property
    def terms(self) -> int:
        """Number of real terms: one for each real rate, two for each pair."""
        return count_terms(self.rates)

    @property
    def slowest_rate(self) -> float:
        """Largest real part of the rates [1/s]; below 0 if x decays to zero."""
        return float(self.rates.real.max())

    @cached_property
    def constant(self) -> float:
        """Coefficient of the rate 0, in the unit of x: what is left when all else has decayed."""
        return float(self.coefficients.real[self.rates == 0.0].sum())

    @cached_property
    def settles(self) -> bool:
        """Whether all rates but 0 decay, so that x goes to its constant."""
        return bool((self.rates.real[self.rates != 0.0] < 0.0).all())

    def without_constant(self) -> ExponentialSum:
        """Return what decays to the constant, x less its value at infinity."""
        kept = self.rates != 0.0
        if not kept.any():
            return ExponentialSum.from_weights(np.array([-1.0 + 0.0j]), np.zeros(1))
        return ExponentialSum(self.rates[kept], self.coefficients[kept])

    @cached_property
    def start(self) -> float:
        """x(0), in the unit of x."""
        return float(self.coefficients.real.sum())

    @cached_property
    def size(self) -> float:
        """Sum of the |c|, above which |x| never is, in the unit of x."""
        return float(np.abs(self.coefficients).sum())

    def __call__(self, times: ArrayLike) -> Floats:
        """Return x at one time or many.

        Args:
            times: Any shape [s], each >= 0.

        Returns:
            The shape of `times`, in the unit of x.

        Raises:
            ShapeError: The times are no numbers.
            NotFiniteError: A time is NaN or infinite.
            RangeError: A time is negative.
        """
        return self._at(_as_times(times))

    def derivative(self, order: int = 1) -> ExponentialSum:
        """Return the derivative of x of the given order, again a sum of exponentials.

        Raises:
            RangeError: The order is negative or no whole number.
        """
        times = as_count("order", order, 0)
        return ExponentialSum(self.rates, self.coefficients * self.rates**times)

    def integral(self, times: ArrayLike) -> Floats:
        """Return the integral of x from 0 to each time, in the unit of x times [s].

        Args:
            times: Any shape [s], each >= 0.

        Raises:
            ShapeError: The times are no numbers.
            NotFiniteError: A time is NaN or infinite.
            RangeError: A time is negative.
        """
        t = _as_times(times)[..., np.newaxis]
        still = self.rates == 0.0
        rates = np.where(still, 1.0, self.rates)
        # expm1 keeps the digits that exp(lambda t) - 1 loses when lambda t is small.
        primitives = np.where(still, t, np.expm1(np.where(still, 0.0, rates * t)) / rates)
        total: Floats = (primitives @ self.coefficients).real
        return total

    def total_integral(self) -> float:
        """Return the integral of x from 0 to infinity, in the unit of x times [s].

        Raises:
            UnstableError: A rate does not decay, so that there is no such integral.
        """
        self._require_decay()
        return float(-(self.coefficients / self.rates).real.sum())

    def time_to_level(self, level: float) -> float:
        """Return the time from which on |x| stays at or below a level for good.

        The answer is safe for oscillating sums: an interval is passed over only where a bound on
        the second derivative proves that |x| cannot exceed the level inside it.

        Args:
            level: At least 0, in the unit of x.

        Returns:
            Time [s]; 0 if |x| never exceeds the level, infinity if no time is late enough
            (the level is not above the size of the constant, and x is not zero).

        Raises:
            RangeError: The level is negative or not a finite number.
            UnstableError: A rate other than 0 does not decay, so that no time can be named.
            SolverError: The sum oscillates too fast for its decay to be searched.
        """
        height = as_number("level", level)
        if height < 0.0:
            raise RangeError(f"level must be at least 0, got {height}")
        self._require_settling()
        if not self.coefficients.any():
            return 0.0
        if height <= abs(self.constant):
            return math.inf
        return self._levels.last_excess(height) or 0.0

    def supremum(self, start: float = 0.0) -> float:
        """Return a number that |x| provably never exceeds from `start` on.

        Args:
            start: At least 0 [s].

        Returns:
            At most a thousandth above the supremum, in the unit of x, unless terms of opposite
            sign cancel so far that this cannot be proven in a million steps.

        Raises:
            RangeError: The start is negative or not a finite number.
            UnstableError: A rate other than 0 does not decay.

        Example:
            >>> round(ExponentialSum([-1.0, -2.0], [1.0, -1.0]).supremum(), 3)
            0.25
        """
        since = as_number("start", start)
        if since < 0.0:
            raise RangeError(f"start must be at least 0, got {since}")
        self._require_settling()
        return self._levels.supremum(since)

    @cached_property
    def _levels(self) -> LevelSearch:
        return LevelSearch(self.rates, self.coefficients)

    def truncated(self, terms: int) -> ExponentialSum:
        """Return a sum of at most `terms` real terms, those with the largest coefficients.

        Dropping terms changes x nowhere by more than the sum of their |c|; a fit of the kept
        rates' coefficients anew gives less.

        Args:
            terms: Number of real terms to keep, at least 1; pairs are kept or dropped whole.

        Raises:
            RangeError: The number is no whole one, below 1, or too small for any rate of this sum.
        """
        most = as_count("terms", terms)
        sizes = np.where(self.rates.imag == 0.0, 1, 2)
        kept: list[int] = []
        remaining = most
        for index in np.argsort(-np.abs(self.coefficients), kind="stable"):
            if sizes[index] <= remaining:
                kept.append(int(index))
                remaining -= int(sizes[index])
        if not kept:
            raise RangeError("one term cannot hold a conjugate pair: keep at least 2")
        chosen = np.sort(kept)
        return ExponentialSum(self.rates[chosen], self.coefficients[chosen])

    def _at(self, times: Floats) -> Floats:
        flat = times.reshape(-1)
        keep_scratch(flat.size)
        values = np.empty(flat.shape)
        slowest = float(self.rates.real[self.rates != 0.0].max(initial=-math.inf))
        # All but a constant is zero by then; at 1e308 s, an infinite phase would make it NaN.
        last = VANISHED / -slowest if slowest < 0.0 else math.inf
        # In blocks: the waves of a million times at once would be a gigabyte.
        step = max(1, BLOCK // len(self.rates))
        for start in range(0, len(flat), step):
            block = np.minimum(flat[start : start + step], last)
            waves = np.exp(np.multiply.outer(block, self.rates))
            values[start : start + step] = (waves @ self.coefficients).real
        return values.reshape(times.shape)

    def _require_settling(self) -> None:
        if not self.settles:
            self._refuse_growth()

    def _require_decay(self) -> None:
        if not self.slowest_rate < 0.0:
            self._refuse_growth()

    def _refuse_growth(self) -> NoReturn:
        raise UnstableError(
            f"the sum does not decay: its right-most rate has the real part "
            f"{self.slowest_rate:g}, which must be below 0"
        )


def _as_times(times: ArrayLike) -> Floats:
    array = as_floats("times", times)
    if (array < 0.0).any():
        raise RangeError(f"times must be at least 0, got {float(array.min())}")
    return array
