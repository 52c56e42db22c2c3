# SPDX-License-Identifier: Apache-2.0
"""Rates in closed form: roots of the neutral equation x(t) = eps x(t - L), times tail rates.

A response that ends after its support obeys x(t) = eps x(t - L) there for any small eps and any L
beyond the support. The roots are (ln eps + 2 pi i k) / L, a damped Fourier series, and with
eps < 0 those between. The best eps equals the error that is reached.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from scipy import optimize

from limit_surface_ros.checks import as_positive
from limit_surface_ros.decay.basis import as_rates, count_terms
from limit_surface_ros.decay.coefficients import fit_response
from limit_surface_ros.decay.delay.system import DelaySystem
from limit_surface_ros.decay.noise import settling_time, smoothed
from limit_surface_ros.decay.rates import RateChoice, judged, predicted_error
from limit_surface_ros.decay.targets import largest_slope_jump
from limit_surface_ros.errors import RangeError, SolverError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.basis import Complexes
    from limit_surface_ros.decay.targets import Target

FIRST_LENGTHS = (1.05, 1.2, 1.4, 1.7)
MOST_TRIALS = 30
# However little the response decays on the interval, its model decays by this.
LEAST_DECAY = 1e-3


def neutral_roots(terms: int, damping: float, length: float) -> Complexes:
    """Return the first roots of x(t) = +- exp(-damping length) x(t - length).

    Args:
        terms: Number of real terms; odd numbers take the plus sign and have a real root, even
            ones the minus sign.
        damping: a > 0 [1/s], the roots' real part is -a.
        length: L > 0 [s].

    Raises:
        RangeError: A number is out of range.
    """
    if terms < 1:
        raise RangeError(f"terms must be at least 1, got {terms}")
    decay, period = as_positive("damping", damping), as_positive("length", length)
    shift = 0.0 if terms % 2 else 0.5
    frequencies = 2.0 * np.pi * (np.arange((terms + 1) // 2) + shift) / period
    rates: Complexes = np.array(-decay + 1j * frequencies, dtype=np.complex128)
    return rates


def neutral_system(terms: int, damping: float, length: float) -> DelaySystem:
    """Return the neutral delay system xdot(t) = +- exp(-damping length) xdot(t - length).

    Its roots are those of `neutral_roots`, without end, and 0: a constant has no derivative.

    Args:
        terms: Number of real terms, whose parity decides the sign.
        damping: a > 0 [1/s].
        length: L > 0 [s].

    Raises:
        RangeError: A number is out of range.
    """
    decay, period = as_positive("damping", damping), as_positive("length", length)
    sign = 1.0 if terms % 2 else -1.0
    strength = sign * math.exp(-decay * period)
    none = np.zeros(0)
    return DelaySystem(none, none, None, np.array([period]), np.array([strength]))


def neutral_rates(
    response: Target, terms: int, end: float, tail_rates: ArrayLike | None = None
) -> RateChoice:
    """Return neutral roots whose length and damping suit a response, beside known tail rates.

    Args:
        response: The response.
        terms: Number of real terms, those of the tail included.
        end: End of the interval on which the rates are judged [s].
        tail_rates: Shape (m,), complex rates of the response's own tail (Im >= 0), if known.

    Raises:
        ShapeError: The tail rates are no list of numbers.
        RangeError: A number is out of range, or the tail rates leave no term.
        SolverError: A fit could not be certified.
    """
    tail = np.zeros(0, dtype=np.complex128) if tail_rates is None else as_rates(tail_rates)
    free = terms - count_terms(tail)
    if free < 1:
        raise RangeError(f"{terms} terms leave none beside {count_terms(tail)} of the tail")
    support = settling_time(response, end)
    if len(tail) and len(response.breakpoints):
        support = min(support, float(response.breakpoints[-1]))

    def rates_of(point: Floats) -> Complexes:
        damping, length = np.exp(point)
        damping = max(float(damping), LEAST_DECAY / end)
        return np.append(tail, neutral_roots(free, damping, float(length)))

    def error_of(point: Floats) -> float:
        try:
            return fit_response(rates_of(point), response, end).max_error
        except SolverError:
            return math.inf

    jump = largest_slope_jump(smoothed(response, end))
    starts = []
    for factor in FIRST_LENGTHS:
        length = factor * support
        expected = predicted_error(jump, length, free) if jump else 1e-3
        damping = -np.log(np.clip(expected, 1e-9, 0.3)) / length
        starts.append(np.log([damping, length]))
    best = min(starts, key=error_of)
    simplex = best + np.array([[0.0, 0.0], [0.12, 0.0], [0.0, 0.06]])
    result = optimize.minimize(
        error_of,
        best,
        method="Nelder-Mead",
        options={"initial_simplex": simplex, "maxfev": MOST_TRIALS, "xatol": 1e-3, "fatol": 0.0},
    )
    damping, length = (float(value) for value in np.exp(result.x))
    parameters = {"damping": damping, "length": length}
    decay = max(damping, LEAST_DECAY / end)
    # With tail rates, or a feedback that vanishes, they are the roots of no neutral equation.
    neutral = len(tail) == 0 and math.exp(-decay * length) > 0.0
    system = neutral_system(free, decay, length) if neutral else None
    return judged(rates_of(result.x), response, end, "neutral", system, parameters)
