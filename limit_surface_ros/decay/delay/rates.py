# SPDX-License-Identifier: Apache-2.0
"""Rates of the thesis: characteristic roots of the delay system built from the response.

The maximum delay T is the one choice that matters. Short delays put the roots far apart, and the
error is 0.0446 J T / N; but what the kernel holds beyond T is the least error that can be
reached. `dde_rates` tries delays and keeps the best.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.decay.delay.construction import delay_system
from limit_surface_ros.decay.delay.roots import first_roots, roots_in_box
from limit_surface_ros.decay.delay.stability import require_minimum_phase, require_stable
from limit_surface_ros.decay.noise import settling_time, smoothed
from limit_surface_ros.decay.rates import RateChoice, judged, take
from limit_surface_ros.errors import DataError, RangeError, SolverError, UnstableError

if TYPE_CHECKING:
    from limit_surface_ros.decay.basis import Complexes
    from limit_surface_ros.decay.delay.system import DelaySystem
    from limit_surface_ros.decay.targets import Target

# Maximum delays tried, in settling times of the response; then around the best of them.
FIRST_TRIALS = (1.5, 2.0, 2.5, 3.0, 3.5, 4.5, 6.0)
LATER_TRIALS = (0.9, 0.95, 1.05, 1.1)


def dde_rates(
    response: Target,
    terms: int,
    end: float,
    max_delay: float | None = None,
    degree: int | None = None,
    allow_unstable: bool = False,
) -> RateChoice:
    """Return characteristic roots of the response's delay system as rates.

    Args:
        response: The response.
        terms: Number of real terms, at least 1. Without a real root among the first, an odd
            number is reached with one term less.
        end: End of the interval on which the rates are judged [s].
        max_delay: T [s]; chosen from trial fits if not given.
        degree: Degree of the kernel's polynomial pieces.
        allow_unstable: Go on with a response that is not minimum-phase; its growing roots
            stay among the rates.

    Raises:
        RangeError: A number is out of range.
        UnstableError: The response is not minimum-phase, or its delay system is not stable.
        DataError: The kernel cannot be found.
        SolverError: Roots or fits could not be certified.
    """
    if terms < 1:
        raise RangeError(f"terms must be at least 1, got {terms}")
    quiet = smoothed(response, end)
    if not allow_unstable:
        require_minimum_phase(quiet, end)
    if max_delay is not None:
        system = delay_system(quiet, max_delay, degree)
        return _best_order(response, terms, end, system, allow_unstable)
    settled = settling_time(quiet, end)
    best: RateChoice | None = None
    failure: Exception | None = None
    tried: list[float] = []
    for factors in (FIRST_TRIALS, LATER_TRIALS):
        centre = settled if best is None else float(best.parameters["max_delay"])
        for factor in factors:
            # A delay beyond the fitted interval leaves the coefficients undetermined.
            delay = min(factor * centre, end)
            if any(abs(delay - other) < 1e-3 * delay for other in tried):
                continue
            tried.append(delay)
            try:
                system = delay_system(quiet, delay, degree)
                choice = _best_order(response, terms, end, system, allow_unstable)
            except (DataError, SolverError, UnstableError) as error:
                failure = error
                continue
            if best is None or choice.error < best.error:
                best = choice
        if best is None:
            assert failure is not None
            raise failure
    assert best is not None
    return best


def _best_order(
    response: Target, terms: int, end: float, system: DelaySystem, allow_unstable: bool
) -> RateChoice:
    """Return the better of the first roots by imaginary part and by real part."""
    if not allow_unstable:
        _require_stable(system, response)
    choices = []
    for order, roots in _selections(system, terms):
        rates = take(roots, terms)
        if len(rates) == 0:
            continue
        parameters: dict[str, float | int | str] = {"max_delay": system.max_delay, "order": order}
        choices.append(judged(rates, response, end, "dde", system, parameters))
    if not choices:
        raise SolverError(f"{terms} term(s) cannot hold any of the roots found")
    return min(choices, key=lambda choice: choice.error)


def _require_stable(system: DelaySystem, response: Target) -> None:
    """Refuse an unstable system, and tell whether the response or its kernel is the cause."""
    try:
        require_stable(system)
    except UnstableError as error:
        # `require_minimum_phase` has passed: the response's own kernel decays.
        raise DataError(
            f"{error}, though the response is minimum-phase: its kernel is not met well enough up "
            f"to the delay {system.max_delay:.4g} s (a steep start, or a memory that is longer). "
            "Give another maximum delay, or use a method that needs no kernel (best, esprit, "
            "neutral)"
        ) from None


def _selections(system: DelaySystem, terms: int) -> list[tuple[str, Complexes]]:
    """Return the roots in both orders: lowest frequency first, and slowest decay first.

    A real root has no frequency and comes first in the former, as in the thesis.
    """
    first = first_roots(system, terms // 2 + 2)
    # The slowest roots of the band that holds twice as many; the chain falls from there on.
    band = roots_in_box(
        system,
        (-30.0 / system.max_delay, float(first.real.max()) + 20.0 / system.max_delay),
        (0.0, 2.0 * float(first.imag.max()) + 7.0 / system.max_delay),
    )
    slowest = band[np.argsort(-band.real, kind="stable")]
    return [("lowest frequency", first), ("slowest decay", slowest)]
