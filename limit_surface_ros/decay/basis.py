# SPDX-License-Identifier: Apache-2.0
"""Rates of a sum of exponentials, and the real functions of time that they stand for.

One rate stands for each conjugate pair (Im lambda >= 0). A real rate is one real term, a pair is
two: exp(a t) cos(b t) and exp(a t) sin(b t).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from limit_surface_ros.errors import NotFiniteError, RangeError, ShapeError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from limit_surface_ros.checks import Bools, Floats

    Complexes: TypeAlias = NDArray[np.complex128]


def as_complexes(name: str, values: ArrayLike) -> Complexes:
    """Return `values` as a read-only complex array of shape (m,), m >= 1.

    Raises:
        ShapeError: The values are not a list of at least one number.
        NotFiniteError: A value is NaN or infinite.
    """
    try:
        array = np.array(values, dtype=np.complex128)
    except (TypeError, ValueError, OverflowError) as error:
        raise ShapeError(f"{name} must be a list of numbers: {error}") from None
    if array.ndim != 1 or array.size == 0:
        raise ShapeError(f"{name} must have shape (m,) with m >= 1, got {array.shape}")
    if not np.isfinite(array).all():
        place = int(np.flatnonzero(~np.isfinite(array))[0])
        raise NotFiniteError(f"{name} must be finite, got {array[place]} at index {place}")
    array.setflags(write=False)
    return array


def as_rates(rates: ArrayLike) -> Complexes:
    """Return `rates` as a read-only complex array, one rate of each conjugate pair.

    Args:
        rates: Shape (m,), complex rates [1/s] with Im >= 0.

    Raises:
        ShapeError: The rates are not a list of at least one number.
        NotFiniteError: A rate is NaN or infinite.
        RangeError: A rate has a negative imaginary part.
    """
    array = as_complexes("rates", rates)
    if (array.imag < 0.0).any():
        worst = array[array.imag < 0.0][0]
        raise RangeError(
            f"rates must hold one rate of each conjugate pair, the one with Im >= 0, got {worst}"
        )
    return array


def count_terms(rates: Complexes) -> int:
    """Return the number of real terms: one for each real rate, two for each pair."""
    return len(rates) + int(np.count_nonzero(rates.imag))


def constant_columns(rates: Complexes) -> Bools:
    """Mark the columns of `real_basis` that are constant, shape (terms,)."""
    marks: Bools = np.repeat(rates == 0.0, 2)[_used_columns(rates)]
    return marks


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


def _used_columns(rates: Complexes) -> Bools:
    """Mark which of the columns (real, imaginary) of each rate are terms, shape (2 m,)."""
    used = np.ones(2 * len(rates), dtype=bool)
    used[1::2] = rates.imag != 0.0
    return used
