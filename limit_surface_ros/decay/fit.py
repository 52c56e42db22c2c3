# SPDX-License-Identifier: Apache-2.0
"""From a response to a sum of exponentials in one call, by any of the methods.

The sum is held to what is assumed of the response after the interval (`tail`), whatever the
method and the norm. Records whose noise is more than a fit of the largest error could stand are
fitted by least squares with free rates (`free_rates`).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_positive
from limit_surface_ros.decay.basis import as_rates
from limit_surface_ros.decay.certify import LargestError, certified_error
from limit_surface_ros.decay.coefficients import ResponseFit, fit_response, norm_of
from limit_surface_ros.decay.delay.rates import dde_rates
from limit_surface_ros.decay.esprit import continued_rates, esprit_choices, esprit_rates
from limit_surface_ros.decay.grids import fit_times, is_steep
from limit_surface_ros.decay.least_squares import least_squares_fit, require_samples
from limit_surface_ros.decay.neutral import neutral_rates
from limit_surface_ros.decay.noise import LEAST_SAMPLES, is_noisy, noise_level
from limit_surface_ros.decay.outliers import (
    holds_strays,
    resting_median,
    running_median,
    stray_start,
)
from limit_surface_ros.decay.polish import LEAST_DECAYS, polished_rates
from limit_surface_ros.decay.rates import RateChoice
from limit_surface_ros.decay.steep import steep_rates
from limit_surface_ros.decay.tail import Tail, envelope_of, tail_of
from limit_surface_ros.decay.targets import PiecewiseLinear, Record
from limit_surface_ros.errors import DataError, LimitSurfaceError, RangeError, SolverError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.coefficients import Criterion
    from limit_surface_ros.decay.free_rates import Tried
    from limit_surface_ros.decay.targets import Target

METHODS = ("dde", "neutral", "esprit", "polished", "least_squares", "best")
AUTO = "auto"
Progress = Callable[[str], None]
# Starts with more than this times the error of the best are not worth polishing.
MOST_BEHIND = 2.0
# A response grows that is largest at its end, so many times as large as at its onset.
GROWN, GROWTH_POINTS = 1.2, 501
# Without noise `auto` takes the fewest terms whose error is below this part of the onset.
AUTO_ERROR, MOST_AUTO = 1e-3, 15
# It seeks no further when as many more terms lowered the error to no less than this part.
AUTO_PATIENCE, AUTO_GAIN = 4, 0.9


@dataclass(frozen=True)
class DecayFit:
    """A fitted decay model and how it came about.

    Attributes:
        choice: The rates, their method and what the method chose.
        fit: The coefficients and their errors.
        seconds: Time it took [s].
        largest: The largest error on the interval, found and proven; None for a record, whose
            samples are all that is known of it.
        tail: What is assumed after the interval, and what the sum does there; None if it was left
            free or does not decay.
        noise: Standard deviation of the record's noise, in the unit of x; 0 if it has none.
        outliers: Shape (k,), times [s] of the samples that were taken as outliers.
        terms_tried: The numbers of terms that were compared, if there were several.
    """

    choice: RateChoice
    fit: ResponseFit
    seconds: float
    largest: LargestError | None = None
    tail: Tail | None = None
    noise: float = 0.0
    outliers: Floats = field(default_factory=lambda: np.zeros(0))
    terms_tried: tuple[Tried, ...] = ()


@dataclass(frozen=True)
class Options:
    """Choices beside terms, method and norm, most of which only some methods look at.

    Attributes:
        max_delay: Maximum delay of the delay system [s]; found by trial fits if None.
        degree: Degree of the kernel's polynomial pieces; a default of the construction if None.
        allow_unstable: Go on with responses that are not minimum-phase (method dde).
        tail_rates: Known complex rates of the response's tail (method neutral), or None.
        robust: Look for outliers (method least_squares).
        offset: Fit a constant to which the response decays (method least_squares).
        bounded: Hold the sum after the interval to what is assumed of the response there.

    Raises:
        RangeError: A tail rate does not decay, or is not the one of its pair with Im >= 0.
    """

    max_delay: float | None = None
    degree: int | None = None
    allow_unstable: bool = False
    tail_rates: ArrayLike | None = None
    robust: bool = True
    offset: bool = False
    bounded: bool = True

    def __post_init__(self) -> None:
        """Check the tail rates, which some methods look at late or never."""
        if self.tail_rates is None:
            return
        rates = as_rates(self.tail_rates)
        if (rates.real >= 0.0).any():
            raise RangeError(
                "tail rates must have a real part below 0, as -0.4+2j, got "
                f"{rates[rates.real >= 0.0][0]:g}"
            )


def fit_decay(
    response: Target,
    terms: int | str,
    end: float,
    method: str = "best",
    norm: str | Criterion = AUTO,
    options: Options | None = None,
    progress: Progress | None = None,
) -> DecayFit:
    """Approximate a response on [0, end] by a sum of exponentials.

    Args:
        response: The response.
        terms: Number of real terms, a conjugate pair counting two; the fit may have fewer. A
            constant (`Options.offset`) is beside them. "auto": as many as the record holds by
            BIC if it is noisy, else the fewest with an error below a thousandth of the onset.
        end: End of the interval [s].
        method: How rates are chosen: "dde" (characteristic roots of the response's own delay
            system, the thesis), "neutral" (closed-form roots), "esprit" (from samples),
            "polished" (ESPRIT's rates, then moved to reduce the error unless the record is noisy),
            "least_squares" (free rates, of samples alone), or "best": least_squares if the record
            is noisy or holds stray samples, or an offset is asked for, else the better of neutral
            and polished.
        norm: In which norm the coefficients are fitted, see `fit_coefficients`; "auto": the
            2-norm after least_squares, else the infinity norm. Rates are chosen by the 2-norm in
            least_squares and else by the infinity norm.
        options: Further choices.
        progress: Called with a line of text when there is something to tell.

    Raises:
        RangeError: A number or a name is out of range.
        UnstableError: The method is dde and the response's delay system would be unstable.
        DataError: The response grows, or cannot support the method.
        SolverError: A result could not be certified.

    Example:
        >>> from limit_surface_ros.decay.examples import exponential
        >>> fit = fit_decay(exponential(), "auto", 6.0)
        >>> fit.fit.sum.terms, round(fit.tail.envelope, 4)
        (1, 0.0045)
    """
    span = as_positive("end", end)
    if terms != AUTO and (isinstance(terms, str) or terms < 1):
        raise RangeError(f"terms must be at least 1, or {AUTO!r}, got {terms!r}")
    if method not in METHODS:
        raise RangeError(f"method must be one of {', '.join(METHODS)}; got {method!r}")
    chosen = options or Options()
    if not (chosen.offset or chosen.allow_unstable):
        refuse_growth(response, span)
    tell = progress or (lambda line: None)
    start = time.perf_counter()
    noise = noise_level(response)
    strays = (
        chosen.robust
        and isinstance(response, Record)
        and _holds_strays(response, noise, chosen.offset)
    )
    by_samples = method == "least_squares" or (
        method == "best" and (chosen.offset or strays or is_noisy(response))
    )
    if by_samples:
        found = least_squares_fit(
            require_samples(response),
            None if isinstance(terms, str) else terms,
            span,
            norm,
            noise,
            robust=chosen.robust,
            offset=chosen.offset,
            tell=tell,
        )
        return DecayFit(
            found.choice,
            found.fit,
            time.perf_counter() - start,
            None,
            tail_of(found.fit.sum, span, found.envelope),
            noise,
            found.outliers,
            found.terms_tried,
        )
    if chosen.offset:
        raise RangeError("an offset is fitted by the methods least_squares and best alone")
    envelope = envelope_of(response, span, noise) if chosen.bounded else None
    used = "inf" if norm == AUTO else norm
    if isinstance(terms, str):
        choice, fit = _fewest(response, span, method, used, chosen, envelope, tell)
    else:
        choice, fit = _fitted(response, terms, span, method, used, chosen, envelope, tell)
    largest = None
    if not isinstance(response, Record):
        largest = certified_error(fit.sum, response, span)
        fit = replace(fit, max_error=max(fit.max_error, largest.found))
    tail = None
    if envelope is not None and fit.sum.settles:
        tail = tail_of(fit.sum, span, envelope)
    return DecayFit(choice, fit, time.perf_counter() - start, largest, tail, noise)


def _holds_strays(record: Record, noise: float, offset: bool) -> bool:
    """Tell whether samples stand out, at the start of a record too."""
    level = resting_median(record.values) if offset else 0.0
    starts = stray_start(record.knots, record.values - level, noise)
    return bool(starts.any()) or holds_strays(record.values, noise)


def refuse_growth(response: Target, end: float) -> None:
    """Refuse a response that is largest at the end of the interval, and larger than its onset.

    Raises:
        DataError: It grows.
    """
    if isinstance(response, PiecewiseLinear) and len(response.knots) >= LEAST_SAMPLES:
        # Without outliers, which may be larger than all else.
        sizes = running_median(np.abs(response.values[response.knots <= end]))
    else:
        sizes = np.abs(response(np.linspace(0.0, end, GROWTH_POINTS)))
    last = max(1, len(sizes) // 10)
    onset = max(float(sizes[0]), abs(float(response(0.0))))
    highest = float(sizes[-last:].max())
    if highest > GROWN * onset and highest > float(sizes[:-last].max(initial=0.0)):
        raise DataError(
            f"the response grows: it starts at {float(response(0.0)):.4g} and is largest, "
            f"{highest:.4g}, at the end of [0, {end:g}] s. A decay model dies away: does the "
            "record run backwards, or begin before its onset? If it rises to a plateau, fit the "
            "constant (an offset that is free)"
        )


def _fewest(
    response: Target,
    end: float,
    method: str,
    norm: str | Criterion,
    options: Options,
    envelope: float | None,
    tell: Progress,
) -> tuple[RateChoice, ResponseFit]:
    """Fit with more and more terms until the error is small, or more no longer lower it."""
    failure: LimitSurfaceError | None = None
    best: tuple[RateChoice, ResponseFit] | None = None
    least: list[float] = []
    for terms in range(1, MOST_AUTO + 1):
        # Samples carry so many terms; the few knots of a response that is known anywhere do not.
        if isinstance(response, Record) and len(response.knots) < 2 * terms:
            break
        try:
            found = _fitted(response, terms, end, method, norm, options, envelope, tell)
        except LimitSurfaceError as error:
            failure = error
            continue
        if best is None or found[1].max_error < best[1].max_error:
            best = found
        if found[1].max_error <= AUTO_ERROR * abs(float(response(0.0))):
            break
        least.append(best[1].max_error)
        if len(least) > AUTO_PATIENCE and least[-1] > AUTO_GAIN * least[-1 - AUTO_PATIENCE]:
            break
    if best is None:
        raise failure or SolverError("the response has too few samples for one term")
    return best


def _fitted(
    response: Target,
    terms: int,
    end: float,
    method: str,
    norm: str | Criterion,
    options: Options,
    envelope: float | None,
    tell: Progress,
) -> tuple[RateChoice, ResponseFit]:
    if method == "best":
        choice = _best(response, terms, end, norm, options, tell)
    else:
        choice = _choose(response, terms, end, method, options, tell)
    free = fit_response(choice.rates, response, end, norm)
    if envelope is None:
        return choice, free
    fit = fit_response(choice.rates, response, end, norm, envelope)
    held = fit.sum is not free.sum and not np.array_equal(fit.sum.weights, free.sum.weights)
    if held and method in ("polished", "best"):
        # On rates that were chosen without a thought of what comes after, holding costs much.
        choice = _polished_within(response, terms, end, choice, envelope, tell)
        fit = fit_response(choice.rates, response, end, norm, envelope)
    return choice, fit


def _polished_within(
    response: Target, terms: int, end: float, choice: RateChoice, envelope: float, tell: Progress
) -> RateChoice:
    """Polish rates with the sum held after the end, from those of two or three starts.

    Rates that hardly decay meet a record by terms that cancel there and nowhere else.
    """
    starts = [choice.rates]
    least = -LEAST_DECAYS / end
    if float(choice.rates.real.max()) > least:
        starts.append(np.minimum(choice.rates.real, least) + 1j * choice.rates.imag)
    try:
        starts.append(continued_rates(response, terms, end))
    except SolverError as error:
        tell(f"continued record: {error}")
    choices = []
    for rates in starts:
        try:
            reached = fit_response(rates, response, end, envelope=envelope).max_error
            start = RateChoice(rates, choice.method, reached, None, choice.parameters)
            choices.append(polished_rates(response, end, start, envelope=envelope))
        except SolverError as failure:
            tell(f"held after the end: {failure}")
            continue
        tell(f"held after the end: error {choices[-1].error:.4g}")
    if not choices:
        raise SolverError("the sum could not be held after the end")
    return min(choices, key=lambda choice: choice.error)


def _choose(
    response: Target, terms: int, end: float, method: str, options: Options, tell: Progress
) -> RateChoice:
    if method == "dde":
        choice = dde_rates(
            response, terms, end, options.max_delay, options.degree, options.allow_unstable
        )
    elif method == "neutral":
        choice = neutral_rates(response, terms, end, options.tail_rates)
    elif method == "esprit":
        choice = esprit_rates(response, terms, end)
    elif method == "polished":
        choice = _polished(response, terms, end, tell)
    else:
        choice = steep_rates(response, terms, end)
    tell(f"{method}: {len(choice.rates)} rates, error {choice.error:.4g}")
    return choice


def _polished(response: Target, terms: int, end: float, tell: Progress) -> RateChoice:
    """Polish ESPRIT's rates of each window: the best start need not lead to the best end.

    The largest error of a noisy record is its worst outlier, which polishing would chase.
    """
    starts = esprit_choices(response, terms, end)
    best = starts[0]
    tell(f"esprit: {len(best.rates)} rates, error {best.error:.4g}")
    if is_noisy(response):
        return best

    def each_step(step: int, error: float) -> None:
        if step % 10 == 0:
            tell(f"polishing: step {step}, error {error:.4g}")

    promising = [start for start in starts if start.error <= MOST_BEHIND * starts[0].error]
    for number, start in enumerate(promising, start=1):
        choice = polished_rates(response, end, start, each_step)
        tell(f"polished {number} of {len(promising)}: error {choice.error:.4g}")
        best = min(best, choice, key=lambda choice: choice.error)
    return best


def _best(
    response: Target,
    terms: int,
    end: float,
    norm: str | Criterion,
    options: Options,
    tell: Progress,
) -> RateChoice:
    """Keep the best of the methods that need no kernel; one that fails does not spoil others.

    The best is that whose coefficients are best in the norm that is asked for.
    """
    choices: list[RateChoice] = []
    failure: LimitSurfaceError | None = None
    methods = ("polished", "neutral", *(("steep",) if is_steep(response, end) else ()))
    for method in methods:
        try:
            choices.append(_choose(response, terms, end, method, options, tell))
        except LimitSurfaceError as error:
            failure = error
            tell(f"{method}: {error}")
    if not choices:
        raise SolverError(f"no method found rates; the last said: {failure}")
    if norm == "inf":
        return min(choices, key=lambda choice: choice.error)
    # On the same times for all, so that their values compare.
    fastest = max(float(np.abs(choice.rates.imag).max()) for choice in choices)
    times = fit_times(response, end, fastest)

    def value(choice: RateChoice) -> float:
        fit = fit_response(choice.rates, response, end, norm)
        return norm_of(fit.sum(times) - response(times), norm)

    return min(choices, key=value)
