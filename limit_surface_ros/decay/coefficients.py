# SPDX-License-Identifier: Apache-2.0
"""Coefficients of a sum of exponentials on fixed rates, in the norm of the analyst's choice.

The rates stay as they are: more terms need a new linear fit and nothing else. Samples are fitted
by `fit_coefficients`, a whole response by `fit_response`. An optimum on a grid is better there
than between its points: with 61 pairs on 2000 points the error off the grid is a tenth larger, on
500 points four times as large. So points are added where the error is found to be largest until
both agree.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from scipy import optimize

from limit_surface_ros.checks import as_floats, as_positive
from limit_surface_ros.decay.basis import as_rates, constant_columns, real_basis
from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.decay.grids import error_at, fit_times, highest_error, largest_error, peaks
from limit_surface_ros.decay.minimax import orthonormal_basis, solve_minimax
from limit_surface_ros.decay.tail import (
    LEAST_WEIGHT,
    closer_tail_times,
    tail_times,
    tail_weight,
)
from limit_surface_ros.decay.targets import Record
from limit_surface_ros.errors import RangeError, ShapeError, SolverError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.basis import Complexes
    from limit_surface_ros.decay.targets import Target

Criterion: TypeAlias = Callable[["Floats"], float]
NORMS = ("inf", "2", "1")
# Rounds of adding the worst times of a grid to those that are fitted.
MOST_EXCHANGES = 8
# A sum is held after the end if it is there so many times as large as it may be.
OVER = 1.01
# Most rounds until the weight of what comes after is found, and most that a round trusts its
# secant; and most rounds of adding times after the end at which the sum is larger than it may be.
HOLDING_ROUNDS, MOST_POWER = 16, 0.9
TAIL_EXCHANGES = 4
BISECTIONS = 12


@dataclass(frozen=True)
class CoefficientFit:
    """Coefficients fitted to samples.

    Attributes:
        sum: The fitted sum.
        norm: "inf", "2", "1" or the criterion's name.
        value: Value of the weighted norm, or the criterion, at the fit.
        lower_bound: No coefficients give a smaller value; NaN for a criterion of one's own.
        max_error: Largest |sum - x| on the samples, without weights.
    """

    sum: ExponentialSum
    norm: str
    value: float
    lower_bound: float
    max_error: float


@dataclass(frozen=True)
class ResponseFit:
    """A sum fitted to a response on [0, end].

    Attributes:
        sum: The fitted sum.
        norm: The norm or the criterion's name.
        end: End of the fitted interval [s].
        max_error: Largest |sum - x| on [0, end], found on a grid many times finer than the fit's;
            of a record at its samples, or how far the sum departs from the lines between them if
            that is more.
        grid_error: Value of the norm on the fit's grid.
        lower_bound: No coefficients on these rates give a smaller value there; NaN if not known.
    """

    sum: ExponentialSum
    norm: str
    end: float
    max_error: float
    grid_error: float
    lower_bound: float


def fit_coefficients(
    rates: ArrayLike,
    times: ArrayLike,
    values: ArrayLike,
    norm: str | Criterion = "inf",
    weights: ArrayLike | None = None,
) -> CoefficientFit:
    """Fit the coefficients of exponentials with the given rates to samples.

    Args:
        rates: Shape (m,), complex [1/s], one of each conjugate pair (Im >= 0).
        times: Shape (n,), >= 0 [s].
        values: Shape (n,), x at the times.
        norm: "inf" (largest error, certified by a dual bound), "2", "1", or a function of the
            weighted errors, shape (n,), that returns what is to be made small. Such a function
            should be smooth; its minimum is sought from the 2-norm's fit and may be local.
        weights: Shape (n,), above 0, by which the errors are multiplied; 1 if not given.

    Raises:
        ShapeError: The arrays do not belong together.
        NotFiniteError: A number is NaN or infinite.
        RangeError: A rate has Im < 0, a time is negative, a weight is not above 0, or the norm is
            not known.
        SolverError: The solution could not be certified.
    """
    lambdas = as_rates(rates)
    t, x = as_floats("times", times), as_floats("values", values)
    if t.ndim != 1 or t.shape != x.shape or len(t) == 0:
        raise ShapeError(f"times and values must have one shape (n,), got {t.shape} and {x.shape}")
    if (t < 0.0).any():
        raise RangeError(f"times must be at least 0, got {float(t.min())}")
    w = np.ones(len(t)) if weights is None else as_floats("weights", weights)
    if w.shape != t.shape or not (w > 0.0).all():
        raise RangeError("weights must hold one number above 0 for each sample")
    basis = real_basis(lambdas, t)
    solution, value, bound = solve(basis * w[:, np.newaxis], x * w, norm)
    name = norm if isinstance(norm, str) else getattr(norm, "__name__", "criterion")
    error = float(np.abs(basis @ solution - x).max())
    return CoefficientFit(
        ExponentialSum.from_weights(lambdas, solution), name, value, bound, error
    )


def solve(matrix: Floats, target: Floats, norm: str | Criterion) -> tuple[Floats, float, float]:
    """Return c that makes matrix @ c - target small, its value and a lower bound on any value.

    Raises:
        RangeError: The norm is not known.
        SolverError: The solution could not be certified.
    """
    if callable(norm):
        return _minimise(matrix, target, norm)
    if norm == "inf":
        best = solve_minimax(matrix, target)
        return best.weights, best.value, best.lower_bound
    if norm == "2":
        solution = _least_squares(matrix, target)
        value = float(np.linalg.norm(matrix @ solution - target))
        return solution, value, value
    if norm == "1":
        return _least_absolute(matrix, target)
    raise RangeError(f"norm must be one of {', '.join(NORMS)} or a function, got {norm!r}")


def _least_squares(matrix: Floats, target: Floats) -> Floats:
    basis = orthonormal_basis(matrix)
    solution: Floats = basis.back @ (basis.columns.T @ target)
    return solution


def _least_absolute(matrix: Floats, target: Floats) -> tuple[Floats, float, float]:
    """Solve the dual, max b'y with Q'y = 0 and |y| <= 1; its multipliers are the coefficients."""
    basis = orthonormal_basis(matrix)
    scale = float(np.abs(target).max(initial=0.0)) or 1.0
    rank = basis.columns.shape[1]
    result = optimize.linprog(
        -target / scale,
        A_eq=basis.columns.T,
        b_eq=np.zeros(rank),
        bounds=(-1.0, 1.0),
        method="highs",
    )
    if result.x is None:
        raise SolverError(f"the fit in the 1-norm failed: {result.message}")
    solution = basis.back @ (-result.eqlin.marginals * scale)
    value = float(np.abs(matrix @ solution - target).sum())
    # The dual made feasible exactly proves the bound whatever the solver's tolerances.
    dual = result.x - basis.columns @ (basis.columns.T @ result.x)
    bound = float(dual @ target) / max(1.0, float(np.abs(dual).max()))
    if value - bound > 1e-6 * value + 1e-10 * scale * len(target):
        raise SolverError(f"the 1-norm could not be certified: value {value:g}, bound {bound:g}")
    return solution, value, bound


def _minimise(matrix: Floats, target: Floats, criterion: Criterion) -> tuple[Floats, float, float]:
    basis = orthonormal_basis(matrix)
    columns = basis.columns

    def value_of(c: Floats) -> float:
        value = float(criterion(columns @ c - target))
        if not math.isfinite(value):
            raise RangeError(f"the criterion must return a finite number, got {value}")
        return value

    result = optimize.minimize(value_of, columns.T @ target, method="BFGS")
    return basis.back @ result.x, float(result.fun), math.nan


def fit_response(
    rates: ArrayLike,
    response: Target,
    end: float,
    norm: str | Criterion = "inf",
    envelope: float | None = None,
) -> ResponseFit:
    """Fit the coefficients of exponentials with the given rates to a response on [0, end].

    Args:
        rates: Shape (m,), complex [1/s], one of each conjugate pair (Im >= 0).
        response: The response, with its breakpoints.
        end: End of the interval [s].
        norm: As in `fit_coefficients`.
        envelope: After the end the sum, less its constant, is held to this, or to its error if
            that is larger; it is free there if None. A sum that stays there by itself is not
            changed.

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
    if envelope is not None and _leaves(fit, envelope):
        fit = _held(fit, lambdas, response, norm, envelope)
        return replace(fit, max_error=largest_error(fit.sum, response, 0.0, span))
    if not isinstance(response, Record):
        return fit
    if fit.max_error > error_at(fit.sum, response, fit_times(response, span, 0.0)):
        # Few samples leave the sum free between them: let straight lines hold it there.
        held = _fitted(lambdas, response.lines, span, norm)
        error = largest_error(held.sum, response, 0.0, span)
        if error < fit.max_error and (envelope is None or not _leaves(held, envelope)):
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
    error = highest_error(x, response, times, np.abs(basis @ weights - target))
    return ResponseFit(x, name, end, error, value, bound)


def _leaves(fit: ResponseFit, envelope: float) -> bool:
    """Tell whether a sum is larger after the end than both the envelope and its own error."""
    x = fit.sum.without_constant()
    return x.settles and x.supremum(fit.end) > OVER * max(envelope, fit.max_error)


def _held(
    free: ResponseFit,
    rates: Complexes,
    response: Target,
    norm: str | Criterion,
    envelope: float,
) -> ResponseFit:
    """Return a fit whose sum does not leave the envelope after the end.

    In the infinity norm times after the end are rows beside the errors. In any other norm the
    coefficients lie between those and the free ones, as near to these as the supremum permits,
    which is a convex function of them.
    """
    times, after = fit_times(response, free.end, 0.0), tail_times(rates, free.end)
    if not isinstance(response, Record):
        times = fit_times(response, free.end, float(np.abs(rates.imag).max()))
    basis, target = real_basis(rates, times), response(times)
    tail = _tail_basis(rates, after)
    closer = closer_tail_times(rates, free.end)
    closer_tail = _tail_basis(rates, closer)
    level = free.max_error
    for _ in range(TAIL_EXCHANGES):
        held, value, bound = _balanced(
            partial(_weighted, basis, target, response, times, tail), level, envelope
        )
        sizes = np.abs(closer_tail @ held)
        over = peaks(sizes) & (sizes > OVER * max(envelope, value))
        if not over.any():
            break
        # Between the times at which it is held a fast swing may still be larger.
        tail, level = np.concatenate([tail, closer_tail[over]]), value
    error = float(np.abs(basis @ held - target).max())
    x = ExponentialSum.from_weights(rates, held)
    if norm == "inf":
        return replace(free, sum=x, grid_error=value, lower_bound=bound)
    limit = OVER * max(envelope, error, x.without_constant().supremum(free.end))
    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        share = 0.5 * (low + high)
        x = ExponentialSum.from_weights(rates, (1.0 - share) * free.sum.weights + share * held)
        inside = x.without_constant().supremum(free.end) <= limit
        low, high = (low, share) if inside else (share, high)
    weights = (1.0 - high) * free.sum.weights + high * held
    value = norm_of(basis @ weights - target, norm)
    return replace(free, sum=ExponentialSum.from_weights(rates, weights), grid_error=value)


def _tail_basis(rates: Complexes, times: Floats) -> Floats:
    """Return the terms after the end, where a constant is not held, shape (n, terms)."""
    basis = real_basis(rates, times)
    basis[:, constant_columns(rates)] = 0.0
    return basis


def _weighted(
    basis: Floats, target: Floats, response: Target, times: Floats, tail: Floats, weight: float
) -> tuple[Floats, float, float]:
    """Minimise the largest error and the tail, which counts so much."""
    return exchange(basis, target, response, times, tail * weight)


def _balanced(
    solve_with: Callable[[float], tuple[Floats, float, float]], free_error: float, envelope: float
) -> tuple[Floats, float, float]:
    """Return the fit that weighs times after the end so that the envelope counts as its error.

    The weight is a fixed point, which a secant in logarithms approaches from the free fit. A few
    plain rounds do not: terms that nearly cancel meet a record to rounding, and the error that
    holds them is then many times, up to twelve digits, the one to start from.
    """
    weight = tail_weight(free_error, envelope)
    before: tuple[float, float] | None = None
    for _ in range(HOLDING_ROUNDS):
        found = solve_with(weight)
        value = found[1]
        wanted = tail_weight(value, envelope)
        if max(weight, wanted) <= OVER * min(weight, wanted):
            break
        # How the value answers to the weight, as a power of it: more than it never is.
        power = 0.0
        if before is not None and before[0] != weight and min(value, before[1]) > 0.0:
            power = math.log(value / before[1]) / math.log(weight / before[0])
        before = (weight, value)
        step = (wanted / weight) ** (1.0 / (1.0 - min(max(power, 0.0), MOST_POWER)))
        weight = min(max(weight * step, LEAST_WEIGHT), 1.0)
    return found


def norm_of(errors: Floats, norm: str | Criterion) -> float:
    """Return the value of a norm, or of a criterion, of errors of shape (n,)."""
    if callable(norm):
        return float(norm(errors))
    return float(np.linalg.norm(errors, {"inf": np.inf, "2": 2, "1": 1}[norm]))


def exchange(
    basis: Floats,
    target: Floats,
    response: Target,
    times: Floats,
    rows: Floats | None = None,
) -> tuple[Floats, float, float]:
    """Minimise the largest error on all times by solving on few of them, adding the worst.

    Args:
        basis: Shape (n, terms), the terms at the times.
        target: Shape (n,).
        response: Whose breakpoints are among the first times.
        times: Shape (n,) [s].
        rows: Shape (k, terms), further rows whose target is 0; none if None.
    """
    more = np.zeros((0, basis.shape[1])) if rows is None else rows
    count, terms = basis.shape
    stride = max(1, count // max(400, 10 * terms))
    chosen = np.zeros(count, dtype=bool)
    chosen[::stride] = True
    chosen[-1] = True
    if len(response.breakpoints) < terms + 20:
        kinks = np.isin(times, response.breakpoints)
        chosen |= kinks | np.roll(kinks, 1) | np.roll(kinks, -1)
    for _ in range(MOST_EXCHANGES):
        matrix = np.concatenate([basis[chosen], more])
        aims = np.append(target[chosen], np.zeros(len(more)))
        weights, value, bound = solve(matrix, aims, "inf")
        errors = np.abs(basis @ weights - target)
        worst = float(errors.max())
        if worst <= value * (1.0 + 1e-4) + 1e-14:
            break
        chosen |= peaks(errors) & (errors > value)
    return weights, value, bound
