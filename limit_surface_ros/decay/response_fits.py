"""Fits of a whole response, and not only of its samples.

An optimum on a grid is better there than between its points: with 61 pairs on 2000 points the
error off the grid is a tenth larger, on 500 points four times as large. Kinks belong into the
grid, and points are added where the error is found to be largest until both agree.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_positive
from limit_surface_ros.decay.coefficient_fits import NORMS, solve
from limit_surface_ros.decay.exponential_sum import ExponentialSum, as_rates, real_basis
from limit_surface_ros.errors import RangeError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.coefficient_fits import Criterion
    from limit_surface_ros.decay.targets import Target

LEAST_POINTS, MOST_POINTS = 4_000, 40_000
ROUNDS = 8
# Places at which the largest error is looked for between the points of the grid.
MOST_LOOKS = 200


@dataclass(frozen=True)
class ResponseFit:
    """A sum fitted to a response on [0, end].

    Attributes:
        sum: The fitted sum.
        norm: The norm or the criterion's name.
        end: End of the fitted interval [s].
        max_error: Largest |sum - x| on [0, end], found on a grid many times finer than the fit's.
        grid_error: Value of the norm on the fit's grid.
        lower_bound: No coefficients on these rates give a smaller value there; NaN if not known.
    """

    sum: ExponentialSum
    norm: str
    end: float
    max_error: float
    grid_error: float
    lower_bound: float


def fine_times(response: Target, end: float, fastest: float) -> Floats:
    """Return times on [0, end], breakpoints included, that resolve a rate of size `fastest`."""
    count = int(np.clip(12.0 * end * fastest / np.pi, LEAST_POINTS, MOST_POINTS))
    inside = response.breakpoints[response.breakpoints < end]
    return np.unique(np.concatenate([np.linspace(0.0, end, count), inside]))


def largest_error(x: ExponentialSum, response: Target, start: float, end: float) -> float:
    """Return the largest |x - response| on [start, end] [s], on a fine grid with breakpoints."""
    times = fine_times(response, end, float(np.abs(x.rates.imag).max()))
    times = times[times >= start]
    return _highest(x, response, times, np.abs(x(times) - response(times)))


def _highest(x: ExponentialSum, response: Target, times: Floats, errors: Floats) -> float:
    """Return the largest error between the times too, from a closer look at the highest ones."""
    highest = float(errors.max())
    near = np.flatnonzero(errors >= 0.98 * highest)
    if len(near) > MOST_LOOKS:
        near = near[np.argsort(-errors[near])[:MOST_LOOKS]]
    before, after = times[np.maximum(near - 1, 0)], times[np.minimum(near + 1, len(times) - 1)]
    close = before[:, np.newaxis] + np.multiply.outer(after - before, np.linspace(0.0, 1.0, 33))
    return max(highest, float(np.abs(x(close) - response(close)).max()))


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
    times = fine_times(response, span, float(np.abs(lambdas.imag).max()))
    basis, target = real_basis(lambdas, times), response(times)
    if norm == "inf":
        weights, value, bound = exchange(basis, target, response, times)
    else:
        weights, value, bound = solve(basis, target, norm)
    name = norm if isinstance(norm, str) else getattr(norm, "__name__", "criterion")
    x = ExponentialSum.from_weights(lambdas, weights)
    error = _highest(x, response, times, np.abs(basis @ weights - target))
    return ResponseFit(x, name, span, error, value, bound)


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
