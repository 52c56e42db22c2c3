# SPDX-License-Identifier: Apache-2.0
"""Sums of exponentials: what a decay model is, and all that a program that uses one needs.

A sum stands for x(t) = Re sum_k c_k exp(lambda_k t), t >= 0, with one rate of each conjugate pair
(Im lambda_k >= 0). A real rate is one real term, a pair is two: exp(a t) cos(b t) and
exp(a t) sin(b t). This module imports numpy only, so that a node may load it at start-up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from limit_surface_ros.checks import as_floats
from limit_surface_ros.decay.level_search import LevelSearch
from limit_surface_ros.errors import NotFiniteError, RangeError, ShapeError, UnstableError
from limit_surface_ros.scratch import keep_scratch

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from limit_surface_ros.checks import Bools, Floats

    Complexes: TypeAlias = NDArray[np.complex128]

# exp(-VANISHED) is zero in double precision.
VANISHED = 800.0
# Exponentials that are evaluated at a time.
BLOCK = 1 << 15


def as_rates(rates: ArrayLike) -> Complexes:
    """Return `rates` as a read-only complex array, one rate of each conjugate pair.

    Args:
        rates: Shape (m,), complex rates [1/s] with Im >= 0.

    Raises:
        ShapeError: The rates are not a list of at least one number.
        NotFiniteError: A rate is NaN or infinite.
        RangeError: A rate has a negative imaginary part.
    """
    array = _as_complexes("rates", rates)
    if (array.imag < 0.0).any():
        worst = array[array.imag < 0.0][0]
        raise RangeError(
            f"rates must hold one rate of each conjugate pair, the one with Im >= 0, got {worst}"
        )
    return array


def count_terms(rates: Complexes) -> int:
    """Return the number of real terms: one for each real rate, two for each pair."""
    return len(rates) + int(np.count_nonzero(rates.imag))


def real_basis(rates: Complexes, times: Floats) -> Floats:
    """Return the real terms at the given times.

    Args:
        rates: Shape (m,), as `as_rates` returns them.
        times: Shape (n,) [s].

    Returns:
        Shape (n, count_terms(rates)): for each rate in turn Re exp(lambda t) and, if it is
        complex, -Im exp(lambda t). The weights of such a pair are the real and imaginary part of
        its coefficient.
    """
    waves = np.exp(np.multiply.outer(times, rates))
    columns = np.empty((len(times), 2 * len(rates)))
    columns[:, 0::2] = waves.real
    columns[:, 1::2] = -waves.imag
    return columns[:, _used_columns(rates)]


def coefficients_of_weights(rates: Complexes, weights: Floats) -> Complexes:
    """Return the complex coefficients (m,) that weights (terms,) of `real_basis` stand for."""
    columns = np.zeros(2 * len(rates))
    columns[_used_columns(rates)] = weights
    return columns[0::2] + 1j * columns[1::2]


def weights_of_coefficients(rates: Complexes, coefficients: Complexes) -> Floats:
    """Return the weights (terms,) of `real_basis` that complex coefficients (m,) stand for."""
    columns = np.empty(2 * len(rates))
    columns[0::2] = coefficients.real
    columns[1::2] = coefficients.imag
    return columns[_used_columns(rates)]


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
        coefficients = _as_complexes("coefficients", self.coefficients)
        if rates.shape != coefficients.shape:
            raise ShapeError(
                f"each rate needs one coefficient, got {len(rates)} rates and "
                f"{len(coefficients)} coefficients"
            )
        crooked = (rates.imag == 0.0) & (coefficients.imag != 0.0)
        if crooked.any():
            place = int(np.flatnonzero(crooked)[0])
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
        """Largest real part of the rates [1/s]; below 0 if x decays."""
        return float(self.rates.real.max())

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
            RangeError: The order is negative.
        """
        if order < 0:
            raise RangeError(f"order must be at least 0, got {order}")
        return ExponentialSum(self.rates, self.coefficients * self.rates**order)

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
            (the level is 0 and x is not).

        Raises:
            RangeError: The level is negative or not a finite number.
            UnstableError: A rate does not decay, so that no time can be named.
        """
        height = float(as_floats("level", level))
        if height < 0.0:
            raise RangeError(f"level must be at least 0, got {height}")
        self._require_decay()
        if not self.coefficients.any():
            return 0.0
        if height == 0.0:
            return math.inf
        return self._level_search.last_excess(height) or 0.0

    @cached_property
    def _level_search(self) -> LevelSearch:
        return LevelSearch(self)

    def truncated(self, terms: int) -> ExponentialSum:
        """Return a sum of at most `terms` real terms, those with the largest coefficients.

        Dropping terms changes x nowhere by more than the sum of their |c|; a fit of the kept
        rates' coefficients anew gives less.

        Args:
            terms: Number of real terms to keep, at least 1; pairs are kept or dropped whole.

        Raises:
            RangeError: The number is below 1, or too small for any rate of this sum.
        """
        if terms < 1:
            raise RangeError(f"terms must be at least 1, got {terms}")
        sizes = np.where(self.rates.imag == 0.0, 1, 2)
        kept: list[int] = []
        room = terms
        for index in np.argsort(-np.abs(self.coefficients), kind="stable"):
            if sizes[index] <= room:
                kept.append(int(index))
                room -= int(sizes[index])
        if not kept:
            raise RangeError("one term cannot hold a conjugate pair: keep at least 2")
        chosen = np.sort(kept)
        return ExponentialSum(self.rates[chosen], self.coefficients[chosen])

    def _at(self, times: Floats) -> Floats:
        flat = times.reshape(-1)
        keep_scratch(flat.size)
        values = np.empty(flat.shape)
        slowest = self.slowest_rate
        # All is zero by then; at 1e308 s, exp would make NaN of an infinite phase.
        last = VANISHED / -slowest if slowest < 0.0 else math.inf
        # In blocks: the waves of a million times at once would be a gigabyte.
        step = max(1, BLOCK // len(self.rates))
        for start in range(0, len(flat), step):
            block = np.minimum(flat[start : start + step], last)
            waves = np.exp(np.multiply.outer(block, self.rates))
            values[start : start + step] = (waves @ self.coefficients).real
        return values.reshape(times.shape)

    def _require_decay(self) -> None:
        if not self.slowest_rate < 0.0:
            raise UnstableError(
                f"the sum does not decay: its right-most rate has the real part "
                f"{self.slowest_rate:g}, which must be below 0"
            )


def _used_columns(rates: Complexes) -> Bools:
    """Mark which of the columns (real, imaginary) of each rate are terms, shape (2 m,)."""
    used = np.ones(2 * len(rates), dtype=bool)
    used[1::2] = rates.imag != 0.0
    return used


def _as_complexes(name: str, values: ArrayLike) -> Complexes:
    try:
        array = np.array(values, dtype=np.complex128)
    except (TypeError, ValueError) as error:
        raise ShapeError(f"{name} must be a list of numbers: {error}") from None
    if array.ndim != 1 or array.size == 0:
        raise ShapeError(f"{name} must have shape (m,) with m >= 1, got {array.shape}")
    if not np.isfinite(array).all():
        place = int(np.flatnonzero(~np.isfinite(array))[0])
        raise NotFiniteError(f"{name} must be finite, got {array[place]} at index {place}")
    array.setflags(write=False)
    return array


def _as_times(times: ArrayLike) -> Floats:
    array = as_floats("times", times)
    if (array < 0.0).any():
        raise RangeError(f"times must be at least 0, got {float(array.min())}")
    return array
