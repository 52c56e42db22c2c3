# SPDX-License-Identifier: Apache-2.0
"""What methods of choosing rates share: their result, and how good rates are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.decay.basis import as_rates
from limit_surface_ros.decay.coefficients import fit_response

if TYPE_CHECKING:
    from limit_surface_ros.decay.basis import Complexes
    from limit_surface_ros.decay.delay.system import DelaySystem
    from limit_surface_ros.decay.targets import Target

# 0.28017 / (2 pi): Bernstein's constant of the approximation of |x|, and the density of rates.
BERNSTEIN_RATE_CONSTANT = 0.28017 / (2.0 * np.pi)


@dataclass(frozen=True, eq=False)
class RateChoice:
    """Rates for a sum of exponentials, and where they come from.

    Attributes:
        rates: Shape (m,), one of each conjugate pair, Re < 0 unless growth was allowed [1/s].
        method: Name of the method.
        error: Largest error on [0, end] with coefficients fitted in the infinity norm.
        system: The delay system whose roots they are, if any.
        parameters: What the method chose, by name.
    """

    rates: Complexes
    method: str
    error: float
    system: DelaySystem | None = None
    parameters: Mapping[str, float | int | str] = field(default_factory=dict)


def judged(
    rates: Complexes,
    response: Target,
    end: float,
    method: str,
    system: DelaySystem | None = None,
    parameters: Mapping[str, float | int | str] | None = None,
    envelope: float | None = None,
) -> RateChoice:
    """Return the rates with the error that they reach on [0, end], see `fit_response`."""
    checked = as_rates(rates)
    error = fit_response(checked, response, end, envelope=envelope).max_error
    return RateChoice(checked, method, error, system, parameters or {})


def take(rates: Complexes, terms: int) -> Complexes:
    """Return the first rates that together make at most `terms` real terms.

    A pair that no longer fits is passed over for a later real rate, so that an odd number is
    reached where there is a real rate.
    """
    kept = []
    remaining = terms
    for rate in rates:
        size = 1 if rate.imag == 0.0 else 2
        if size <= remaining:
            kept.append(rate)
            remaining -= size
    return np.array(kept, dtype=np.complex128)


def predicted_error(slope_jump: float, max_delay: float, terms: int) -> float:
    """Return the error that N terms of any basis of density T / 2 pi reach: 0.0446 J T / N.

    A response with a kink of slope jump J is met by N real exponential terms whose frequencies
    have the spacing 2 pi / T as |x| is by polynomials: Bernstein's constant over the number
    of terms for each unit of time.

    Args:
        slope_jump: Largest jump J of the slope, in the unit of x per [s].
        max_delay: T [s].
        terms: N.
    """
    return BERNSTEIN_RATE_CONSTANT * abs(slope_jump) * max_delay / terms
