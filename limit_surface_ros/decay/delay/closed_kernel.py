# SPDX-License-Identifier: Apache-2.0
"""The memory kernel of a piecewise linear response in closed form.

With x(0) = x0, first slope s0 and slope jumps J_k at a_k, and beta = -s0 / x0, the Laplace
transform of f is s - x0 / X(s) = s - s^2 / ((s - beta)(1 + E)), E = sum_k (J_k / x0)
exp(-s a_k) / (s - beta). Expanding 1 / (1 + E) gives impulses -beta at 0 and J_k / x0 at a_k,
and behind each sum d of breakpoints a cell exp(beta u) polynomial(u), u = t - d.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.decay.delay.impulses import Impulses
from limit_surface_ros.errors import DataError

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.targets import PiecewiseLinear

# Delays that agree to this many decimals [s] are one.
DELAY_DIGITS = 12
MOST_DELAYS = 2000
MOST_ROUNDING = 1e-6


class ClosedKernel:
    """The exact memory kernel of a piecewise linear response on [0, max_delay].

    Args:
        response: It must end at 0, or its kernel does not decay.
        max_delay: Up to where the kernel is expanded [s].

    Attributes:
        impulses: At 0 and at each breakpoint up to `max_delay`.
        edges: Sums of breakpoints in [0, max_delay], where the kernel or a derivative jumps [s].

    Raises:
        DataError: The response has too many kinks for this expansion (use `memory_kernel`), or
            `max_delay` is so large that its alternating terms leave no digits.
    """

    def __init__(self, response: PiecewiseLinear, max_delay: float) -> None:
        """Expand the kernel once; evaluating it is cheap."""
        onset = float(response.values[0])
        self._beta = -float(response.slopes[0]) / onset
        near = response.breakpoints <= max_delay
        kinks = response.breakpoints[near]
        strengths = response.slope_jumps[near] / onset
        self._terms = _powers(kinks, strengths, max_delay)
        self.impulses = (
            Impulses(np.append(0.0, kinks), np.append(-self._beta, strengths))
            if self._beta
            else Impulses(kinks, strengths)
        )
        inside = {d for terms in self._terms for d in terms if d < max_delay}
        self.edges: Floats = np.array([*sorted(inside), max_delay])
        self._require_digits(max_delay)

    def __call__(self, times: Floats) -> Floats:
        """Return the kernel without its impulses at times [s] of any shape."""
        return self._sum(np.asarray(times, dtype=np.float64), absolute=False)

    def _sum(self, times: Floats, absolute: bool) -> Floats:
        total = np.zeros_like(times)
        for order, terms in enumerate(self._terms):
            for delay, weight in terms.items():
                u = np.maximum(times - delay, 0.0)
                shape = np.where(times >= delay, self._cell(order, u), 0.0)
                sign = -1.0 if order % 2 == 0 else 1.0
                total += np.abs(weight * shape) if absolute else sign * weight * shape
        return total

    def _cell(self, order: int, u: Floats) -> Floats:
        """Inverse transform of s^2 / (s - beta)^(order + 1) without its impulse."""
        beta = self._beta
        # The three terms are those of the binomial s^2 = ((s - beta) + beta)^2.
        shape = beta**2 * _power(u, order)
        if order >= 1:
            shape = shape + 2.0 * beta * _power(u, order - 1)
        if order >= 2:
            shape = shape + _power(u, order - 2)
        cell: Floats = np.exp(beta * u) * shape
        return cell

    def _require_digits(self, max_delay: float) -> None:
        times = np.linspace(0.0, max_delay, 200)
        size = max(1.0, float(np.abs(self(times)).max()))
        rounding = float(self._sum(times, absolute=True).max()) * np.finfo(float).eps
        if rounding > MOST_ROUNDING * size:
            raise DataError(
                f"the closed-form kernel loses its digits before {max_delay:g} s: "
                f"take a smaller maximum delay or the sampled kernel"
            )


def _power(u: Floats, order: int) -> Floats:
    """Return u^order / order!."""
    result = np.ones_like(u)
    for k in range(1, order + 1):
        result = result * u / k
    return result


def _powers(kinks: Floats, strengths: Floats, max_delay: float) -> list[dict[float, float]]:
    """Return the terms of (sum_k strength_k z^kink_k)^m for m = 0, 1, ... as delay: weight."""
    powers: list[dict[float, float]] = [{0.0: 1.0}]
    count = 1
    while True:
        following: dict[float, float] = {}
        for delay, weight in powers[-1].items():
            for kink, strength in zip(kinks.tolist(), strengths.tolist(), strict=True):
                moved = round(delay + kink, DELAY_DIGITS)
                if moved <= max_delay:
                    following[moved] = following.get(moved, 0.0) + weight * strength
        if not following:
            return powers
        powers.append(following)
        count += len(following)
        if count > MOST_DELAYS:
            raise DataError(
                f"{len(kinks)} kinks give too many delays up to {max_delay:g} s for the closed "
                f"form: take memory_kernel on samples"
            )
