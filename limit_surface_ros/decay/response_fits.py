# SPDX-License-Identifier: Apache-2.0
"""Fits of a whole response, and of a record at its samples.

An optimum on a grid is better there than between its points: with 61 pairs on 2000 points the
error off the grid is a tenth larger, on 500 points four times as large. Kinks belong into the
grid, and points are added where the error is found to be largest until both agree.

Of a record nothing is known but its samples, so that they are the grid. Between them a fit may
bend as the samples do; what it strays from straight lines beyond that counts as error.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_positive
from limit_surface_ros.decay.coefficients import NORMS, solve
from limit_surface_ros.decay.exponential_sum import ExponentialSum, as_rates, real_basis
from limit_surface_ros.decay.targets import Record
from limit_surface_ros.errors import RangeError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.coefficients import Criterion
    from limit_surface_ros.decay.exponential_sum import Complexes
    from limit_surface_ros.decay.targets import Target

LEAST_POINTS, MOST_POINTS = 4_000, 40_000
ROUNDS = 8
# Places at which the largest error is looked for between the points of the grid.
MOST_LOOKS = 200
# And between any two samples of a record, as parts of their distance.
LOOKS_BETWEEN = (0.03, 0.15, 0.38, 0.62, 0.85)


@dataclass(frozen=True)
class ResponseFit:
    """A sum fitted to a response on [0, end].

    Attributes:
        sum: The fitted sum.
        norm: The norm or the criterion's name.
        end: End of the fitted interval [s].
        max_error: Largest |sum - x| on [0, end], found on a grid many times finer than the fit's;
            of a record at its samples, or what the sum strays between them if that is more.
        grid_error: Value of the norm on the fit's grid.
        lower_bound: No coefficients on these rates give a smaller value there; NaN if not known.
    """

    sum: ExponentialSum
    norm: str
    end: float
    max_error: float
    grid_error: float
    lower_bound: float


def fit_times(response: Target, end: float, fastest: float) -> Floats:
    """Return the times on [0, end] [s] at which a response is to be met.

    Of a record its samples; else the breakpoints and enough to resolve a rate of size `fastest`.
    """
    if isinstance(response, Record):
        return response.knots[response.knots <= end]
    count = int(np.clip(12.0 * end * fastest / np.pi, LEAST_POINTS, MOST_POINTS))
    inside = response.breakpoints[response.breakpoints < end]
    return np.unique(np.concatenate([np.linspace(0.0, end, count), inside]))


def largest_error(x: ExponentialSum, response: Target, start: float, end: float) -> float:
    """Return the largest |x - response| on [start, end] [s], of a record at its samples."""
    times = fit_times(response, end, float(np.abs(x.rates.imag).max()))
    times = times[times >= start]
    return _highest(x, response, times, np.abs(x(times) - response(times)))


def _highest(x: ExponentialSum, response: Target, times: Floats, errors: Floats) -> float:
    """Return the largest error between the times too, from a closer look at the highest ones."""
    highest = float(errors.max())
    if isinstance(response, Record):
        return max(highest, _straying(x, response, times))
    near = np.flatnonzero(errors >= 0.98 * highest)
    if len(near) > MOST_LOOKS:
        near = near[np.argsort(-errors[near])[:MOST_LOOKS]]
    before, after = times[np.maximum(near - 1, 0)], times[np.minimum(near + 1, len(times) - 1)]
    close = before[:, np.newaxis] + np.multiply.outer(after - before, np.linspace(0.0, 1.0, 33))
    return max(highest, _error_at(x, response, close))


def _error_at(x: ExponentialSum, response: Target, times: Floats) -> float:
    return float(np.abs(x(times) - response(times)).max())


def _straying(x: ExponentialSum, record: Record, times: Floats) -> float:
    """Return what a sum strays from straight lines between samples beyond what these bend.

    Smooth functions depart from the line by an eighth of the samples' second difference, and no
    sum within their Nyquist frequency by more than about a quarter of it; others are aliases.
    """
    bend = float(np.abs(np.diff(record(times), 2)).max(initial=0.0))
    # An alias strays between most samples: of very many some are enough.
    every = max(1, len(times) // LEAST_POINTS)
    before, gaps = times[:-1:every, np.newaxis], np.diff(times)[::every]
    between = before + np.multiply.outer(gaps, LOOKS_BETWEEN)
    return _error_at(x, record, between) - bend - _error_at(x, record, times)


def fit_response(
    rates: ArrayLike,
    response: Target,
    end: float,
    norm: str | Criterion = "inf",
) -> ResponseFit:
    """Fit the coefficients of exponentials with the given rates to a response on [0, end].

    Args:
        rates: Shape (m,), complex [1/s], one of each conjugate pair (Im >= 0).
        response: The response, with its breakpoints.
        end: End of the interval [s].
        norm: As in `coefficient_fits.fit_coefficients`.

    Raises:
        ShapeError: The rates are no list of numbers.
        NotFiniteError: A rate or the response is NaN or infinite.
        RangeError: A rate has Im < 0, the end is not above 0, or the norm is not known.
        SolverError: The solution could not be certified.
    """
    lambdas = as_rates(rates)
    span = as_positive("end", end)
    if not callable(norm) and norm not in NORMS:
        raise RangeError(f"norm must be one of {', '.join(NORMS)} or a function, got {norm!r}")
    fit = _fitted(lambdas, response, span, norm)
    if not isinstance(response, Record):
        return fit
    if fit.max_error > _error_at(fit.sum, response, fit_times(response, span, 0.0)):
        # Few samples leave the sum free between them: let straight lines hold it there.
        held = _fitted(lambdas, response.lines, span, norm)
        error = largest_error(held.sum, response, 0.0, span)
        if error < fit.max_error:
            return replace(held, max_error=error)
    return fit


def _fitted(rates: Complexes, response: Target, end: float, norm: str | Criterion) -> ResponseFit:
    times = fit_times(response, end, float(np.abs(rates.imag).max()))
    basis, target = real_basis(rates, times), response(times)
    if norm == "inf":
        weights, value, bound = exchange(basis, target, response, times)
    else:
        weights, value, bound = solve(basis, target, norm)
    name = norm if isinstance(norm, str) else getattr(norm, "__name__", "criterion")
    x = ExponentialSum.from_weights(rates, weights)
    error = _highest(x, response, times, np.abs(basis @ weights - target))
    return ResponseFit(x, name, end, error, value, bound)


def exchange(
    basis: Floats, target: Floats, response: Target, times: Floats
) -> tuple[Floats, float, float]:
    """Minimise the largest error on all times by solving on few of them, adding the worst."""
    count, terms = basis.shape
    stride = max(1, count // max(400, 10 * terms))
    chosen = np.zeros(count, dtype=bool)
    chosen[::stride] = True
    chosen[-1] = True
    if len(response.breakpoints) < terms + 20:
        kinks = np.isin(times, response.breakpoints)
        chosen |= kinks | np.roll(kinks, 1) | np.roll(kinks, -1)
    for _ in range(ROUNDS):
        weights, value, bound = solve(basis[chosen], target[chosen], "inf")
        errors = np.abs(basis @ weights - target)
        worst = float(errors.max())
        if worst <= value * (1.0 + 1e-4) + 1e-14:
            break
        peaks = np.append(True, errors[1:] >= errors[:-1]) & np.append(
            errors[:-1] >= errors[1:], True
        )
        chosen |= peaks & (errors > value)
    return weights, value, bound
