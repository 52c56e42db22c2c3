# SPDX-License-Identifier: Apache-2.0
"""One call from a response to a decay model: choose rates by a method, then fit coefficients."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from limit_surface_ros.checks import as_positive
from limit_surface_ros.decay.basis import as_rates
from limit_surface_ros.decay.coefficients import ResponseFit, fit_response
from limit_surface_ros.decay.delay.rates import dde_rates
from limit_surface_ros.decay.esprit import esprit_choices, esprit_rates
from limit_surface_ros.decay.neutral import neutral_rates
from limit_surface_ros.decay.noise import is_noisy
from limit_surface_ros.decay.polish import polished_rates
from limit_surface_ros.decay.rates import RateChoice
from limit_surface_ros.errors import LimitSurfaceError, RangeError, SolverError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.decay.coefficients import Criterion
    from limit_surface_ros.decay.targets import Target

METHODS = ("dde", "neutral", "esprit", "polished", "best")
Progress = Callable[[str], None]
# Starts with more than this times the error of the best are not worth polishing.
MOST_BEHIND = 2.0


@dataclass(frozen=True)
class DecayFit:
    """A fitted decay model and how it came about.

    Attributes:
        choice: The rates, their method and what the method chose.
        fit: The coefficients and their errors.
        seconds: Time it took [s].
    """

    choice: RateChoice
    fit: ResponseFit
    seconds: float


@dataclass(frozen=True)
class Options:
    """Choices that only some methods look at.

    Attributes:
        max_delay: Maximum delay of the delay system [s]; found by trial fits if None.
        degree: Degree of the kernel's polynomial pieces; a default of the construction if None.
        allow_unstable: Go on with responses that are not minimum-phase (method dde).
        tail_rates: Known complex rates of the response's tail (method neutral), or None.

    Raises:
        RangeError: A tail rate does not decay, or is not the one of its pair with Im >= 0.
    """

    max_delay: float | None = None
    degree: int | None = None
    allow_unstable: bool = False
    tail_rates: ArrayLike | None = None

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
    terms: int,
    end: float,
    method: str = "best",
    norm: str | Criterion = "inf",
    options: Options | None = None,
    progress: Progress | None = None,
) -> DecayFit:
    """Approximate a response on [0, end] by a sum of exponentials.

    Args:
        response: The response.
        terms: Number of real terms, a conjugate pair counting two; the fit may have fewer.
        end: End of the interval [s].
        method: How rates are chosen: "dde" (characteristic roots of the response's own delay
            system, the thesis), "neutral" (closed-form roots), "esprit" (from samples),
            "polished" (ESPRIT's rates, then moved to reduce the error unless the record is noisy),
            or "best" (the better of neutral and polished).
        norm: In which norm the coefficients are fitted, see `coefficient_fits`. Rates are always
            chosen by the infinity norm.
        options: Choices for single methods.
        progress: Called with a line of text when there is something to tell.

    Raises:
        RangeError: A number or a name is out of range.
        UnstableError: The method is dde and the response's delay system would be unstable.
        DataError: The response cannot support the method.
        SolverError: A result could not be certified.
    """
    span = as_positive("end", end)
    if terms < 1:
        raise RangeError(f"terms must be at least 1, got {terms}")
    if method not in METHODS:
        raise RangeError(f"method must be one of {', '.join(METHODS)}; got {method!r}")
    chosen = options or Options()
    tell = progress or (lambda line: None)
    start = time.perf_counter()
    choice = _choose(response, terms, span, method, chosen, tell)
    fit = fit_response(choice.rates, response, span, norm)
    return DecayFit(choice, fit, time.perf_counter() - start)


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
        return _best(response, terms, end, options, tell)
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
    response: Target, terms: int, end: float, options: Options, tell: Progress
) -> RateChoice:
    """Keep the best of the methods that need no kernel; one that fails does not spoil others."""
    choices: list[RateChoice] = []
    failure: LimitSurfaceError | None = None
    for method in ("polished", "neutral"):
        try:
            choices.append(_choose(response, terms, end, method, options, tell))
        except LimitSurfaceError as error:
            failure = error
            tell(f"{method}: {error}")
    if not choices:
        raise SolverError(f"no method found rates; the last said: {failure}")
    return min(choices, key=lambda choice: choice.error)
