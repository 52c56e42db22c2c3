# SPDX-License-Identifier: Apache-2.0
"""Rates from samples alone: ESPRIT [1], the matrix pencil [2] of the dominant subspace.

The samples' Hankel matrix has the rank of the number of exponentials; its dominant left singular
vectors, shifted by one sample, give the rates as eigenvalues.

[1] R. Roy, T. Kailath, ESPRIT - estimation of signal parameters via rotational invariance
    techniques, IEEE Trans. Acoust., Speech, Signal Process. 37, 984-995, 1989,
    doi 10.1109/29.32276.
[2] Y. Hua, T. K. Sarkar, Matrix pencil method for estimating parameters of exponentially damped /
    undamped sinusoids in noise, IEEE Trans. Acoust., Speech, Signal Process. 38, 814-824, 1990,
    doi 10.1109/29.56027.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import linalg

from limit_surface_ros.checks import as_floats, as_positive
from limit_surface_ros.decay.noise import settling_time
from limit_surface_ros.decay.rates import RateChoice, judged, take
from limit_surface_ros.decay.targets import Record, uniform_times
from limit_surface_ros.errors import DataError, RangeError, ShapeError, SolverError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.basis import Complexes
    from limit_surface_ros.decay.targets import Target

SAMPLES = 1001
# Singular values below this fraction of the largest are rounding; rates made of them are noise.
RANK_TOLERANCE = 1e-13
# Windows tried, in settling times of the response, beside the whole interval.
WINDOWS = (2.0, 6.0)
# Rates that ESPRIT leaves undamped are given this much decay over the interval.
LEAST_DECAY = 1e-3
# A record is continued by its last value, which then decays so many times over its length.
CONTINUED_TO, CONTINUED_DECAYS = 1.4, 30.0


def esprit(values: ArrayLike, step: float, terms: int) -> Complexes:
    """Return the rates of exponentials that make up uniform samples.

    Args:
        values: Shape (n,), n >= 3.
        step: Distance of the samples [s].
        terms: Number of real terms; fewer are returned where the samples have not that rank.

    Returns:
        Shape (m,), one of each conjugate pair, slowest first [1/s].

    Raises:
        ShapeError: There are fewer than three samples, or fewer than twice the terms.
        NotFiniteError: A sample is NaN or infinite.
        RangeError: The step is not above 0, or terms is below 1.
    """
    x, dt = as_floats("values", values), as_positive("step", step)
    if terms < 1:
        raise RangeError(f"terms must be at least 1, got {terms}")
    if x.ndim != 1 or len(x) < max(3, 2 * terms):
        raise ShapeError(f"{terms} terms need at least {max(3, 2 * terms)} samples, got {x.shape}")
    return rates_of_subspace(signal_subspace(x, terms), terms, dt)


def signal_subspace(samples: Floats, most: int) -> Floats:
    """Return the dominant singular vectors of uniform samples' Hankel matrix, the largest first.

    Args:
        samples: Shape (n,), n >= 3.
        most: Most vectors that are returned; fewer where the samples have not that rank.
    """
    half = (len(samples) + 1) // 2
    # Square and real, the Hankel matrix is symmetric: its eigenvectors are the singular vectors.
    hankel = linalg.hankel(samples[:half], samples[half - 1 : 2 * half - 1])
    eigenvalues, vectors = linalg.eigh(hankel, check_finite=False)
    order = np.argsort(-np.abs(eigenvalues))
    sizes = np.abs(eigenvalues[order])
    rank = min(most, int(np.count_nonzero(sizes > RANK_TOLERANCE * sizes[0])), half - 1)
    subspace: Floats = vectors[:, order[:rank]]
    return subspace


def rates_of_subspace(subspace: Floats, terms: int, step: float) -> Complexes:
    """Return the rates [1/s] of the first vectors of a signal's subspace, slowest first."""
    vectors = subspace[:, :terms]
    shift, *_ = linalg.lstsq(vectors[:-1], vectors[1:], check_finite=False)
    multipliers = np.asarray(linalg.eigvals(shift), dtype=np.complex128)
    # A negative real multiplier changes sign with each sample: no function of time does that.
    usable = (multipliers.imag > 0.0) | ((multipliers.imag == 0.0) & (multipliers.real > 0.0))
    rates: Complexes = np.log(multipliers[usable]) / step
    return rates[np.argsort(-rates.real, kind="stable")]


def esprit_rates(
    response: Target, terms: int, end: float, window: float | None = None
) -> RateChoice:
    """Return ESPRIT's rates of a response, from the window that gives the least error.

    Args:
        response: The response.
        terms: Number of real terms.
        end: End of the interval on which the rates are judged [s].
        window: The response is sampled on [0, window] [s]; several are tried if not given.

    Raises:
        RangeError: A number is out of range.
        SolverError: No window gives usable rates.
    """
    windows = None if window is None else [as_positive("window", window)]
    return esprit_choices(response, terms, end, windows)[0]


def esprit_choices(
    response: Target, terms: int, end: float, windows: Sequence[float] | None = None
) -> list[RateChoice]:
    """Return ESPRIT's rates of a response from each of several windows, the best first.

    Raises:
        RangeError: A number is out of range.
        SolverError: No window gives usable rates.
    """
    if terms < 1:
        raise RangeError(f"terms must be at least 1, got {terms}")
    if windows is None:
        settled = settling_time(response, end)
        windows = sorted({min(factor * settled, end) for factor in WINDOWS} | {end})
    choices: list[RateChoice] = []
    for length in windows:
        times = _times(response, length, terms)
        rates = take(damped(esprit(response(times), float(times[1]), terms), end), terms)
        if len(rates):
            choices.append(judged(rates, response, end, "esprit", None, {"window": length}))
    if not choices:
        raise SolverError(f"ESPRIT found no usable rate with {terms} term(s) in this response")
    return sorted(choices, key=lambda choice: choice.error)


def continued_rates(response: Target, terms: int, end: float) -> Complexes:
    """Return ESPRIT's rates of a response that dies away soon after `end`, whatever it is there.

    Raises:
        SolverError: They are not usable.
    """
    times = np.linspace(0.0, CONTINUED_TO * end, max(SAMPLES, 8 * terms))
    after = np.maximum(times - end, 0.0) / end
    values = response(np.minimum(times, end)) * np.exp(-CONTINUED_DECAYS * after)
    rates = take(damped(esprit(values, float(times[1]), terms), end), terms)
    if not len(rates):
        raise SolverError(f"ESPRIT found no usable rate with {terms} term(s)")
    return rates


def damped(rates: Complexes, end: float) -> Complexes:
    """Return the rates with undamped or growing ones made to decay a little by `end`."""
    decay = np.minimum(rates.real, -LEAST_DECAY / end)
    result: Complexes = decay + 1j * rates.imag
    return result


def _times(response: Target, length: float, terms: int) -> Floats:
    """Return uniform times on [0, length]: a uniform record's own, thinned where they are many."""
    samples = max(SAMPLES, 8 * terms)
    if isinstance(response, Record) and response.step(length) is not None:
        own = response.knots[response.knots <= length]
        # Fewer make a Hankel matrix that has not the rank of the terms.
        if len(own) >= 2 * terms + 3:
            return own[:: max(1, len(own) // samples)]
    try:
        return uniform_times(length, samples, response.breakpoints[:12], stretch=2)
    except DataError:
        return np.linspace(0.0, length, samples)
