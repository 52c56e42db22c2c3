# SPDX-License-Identifier: Apache-2.0
"""A record fitted by least squares with free rates, as the other methods' results are given."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.decay.coefficients import ResponseFit, fit_response
from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.decay.free_rates import free_rates
from limit_surface_ros.decay.grids import largest_error
from limit_surface_ros.decay.rates import RateChoice
from limit_surface_ros.decay.tail import envelope_of
from limit_surface_ros.decay.targets import PiecewiseLinear, Record
from limit_surface_ros.decay.varpro import Samples
from limit_surface_ros.errors import DataError

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.coefficients import Criterion
    from limit_surface_ros.decay.free_rates import Tried
    from limit_surface_ros.decay.targets import Target

METHOD = "least_squares"
# A record without noise is fitted as if it had this much of its largest value.
LEAST_NOISE = 1e-9
# A slow relaxation may still creep by so many times what it did over the last tenth.
CREEP, LEAST_CREEP = 3.0, 2.0


@dataclass(frozen=True)
class LeastSquaresFit:
    """What `least_squares_fit` found.

    Attributes:
        choice: The rates, that of a constant among them.
        fit: The coefficients and their errors at the samples that are no outliers.
        envelope: What is assumed after the interval, in the unit of x.
        outliers: Shape (k,), times of outliers [s].
        terms_tried: The numbers of terms that were tried.
    """

    choice: RateChoice
    fit: ResponseFit
    envelope: float
    outliers: Floats
    terms_tried: tuple[Tried, ...]


def require_samples(response: Target) -> Record:
    """Return the samples of a record or of straight lines between knots.

    Raises:
        DataError: The response is a function, which has none.
    """
    if isinstance(response, PiecewiseLinear):
        return Record(response.knots, response.values)
    raise DataError("least squares need samples: the response is a function of time")


def least_squares_fit(
    record: Record,
    terms: int | None,
    end: float,
    norm: str | Criterion,
    noise: float,
    robust: bool,
    offset: bool,
    tell: Callable[[str], None],
) -> LeastSquaresFit:
    """Fit rates by least squares, and coefficients in the norm asked for.

    Args:
        record: The samples.
        terms: Number of real terms beside a constant; found by BIC if None.
        end: End of the interval [s].
        norm: "auto" and "2" keep the coefficients of the least squares, in which outliers count
            nothing and the sum is held after the end.
        noise: Standard deviation of a sample, in the unit of x.
        robust: Whether outliers are looked for.
        offset: Whether a constant is fitted.
        tell: Called with lines of progress.

    Raises:
        DataError: There are too few samples.
        SolverError: No fit was found.
    """
    inside = record.knots <= end
    times, values = record.knots[inside], record.values[inside]
    if len(times) < 4 or len(times) < 2 * (terms or 1):
        raise DataError(f"{terms or 1} terms need at least {max(4, 2 * (terms or 1))} samples")
    least = max(noise, LEAST_NOISE * float(np.abs(values).max()))
    assumed = _creep(values, least) if offset else max(envelope_of(record, end, noise), least)
    samples = Samples(times, values, np.ones(len(times)), least, assumed, offset)
    found = free_rates(samples, terms, robust, tell)
    rates, weights = found.fit.rates, found.fit.weights
    if offset:
        rates, weights = np.append(0.0j, rates), np.append(found.fit.constant, weights)
    x = ExponentialSum.from_weights(rates, weights)
    # A record begins at 0: where that sample counts for nothing, the sum stands in for it.
    kept = ~found.outliers
    starts = values if kept[0] else np.append(x(0.0), values[1:])
    kept[0] = True
    good = Record(times[kept], starts[kept])
    envelope = envelope_of(good, end, noise, x.constant)
    error = largest_error(x, good, 0.0, end)
    value = float(np.linalg.norm(found.weights * found.fit.residuals))
    fit = ResponseFit(x, "2", end, error, value, float("nan"))
    if norm not in ("auto", "2"):
        fit = replace(fit_response(rates, good, end, norm, envelope), end=end)
    parameters = {"noise": noise, "outliers": int(np.count_nonzero(found.outliers))}
    choice = RateChoice(rates, METHOD, error, None, parameters)
    return LeastSquaresFit(choice, fit, envelope, times[found.outliers], found.tried)


def _creep(values: Floats, noise: float) -> float:
    """Return how far a record is assumed to creep on from where it ends."""
    tenth = max(1, len(values) // 10)
    before, last = values[-2 * tenth : -tenth], values[-tenth:]
    step = abs(float(np.median(last)) - float(np.median(before)))
    return max(CREEP * step, LEAST_CREEP * noise)
