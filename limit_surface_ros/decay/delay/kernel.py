# SPDX-License-Identifier: Apache-2.0
"""The memory kernel f of a response: xdot(t) = int_0^t f(tau) x(t - tau) dtau (thesis 2.1).

With forward differences the samples obey a lower-triangular Toeplitz system, that is, f is the
quotient of two power series. Forward substitution keeps each sample's own digits, however small
the tail; for long records Newton's iteration with the FFT gives the quotient in O(n log n), to
the digits of the largest sample.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import fft

from limit_surface_ros.checks import as_floats
from limit_surface_ros.decay.targets import require_onset
from limit_surface_ros.errors import DataError, ShapeError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats

# Forward substitution costs one multiplication for each pair of a sample and a nonzero of x.
MOST_MULTIPLICATIONS = 2e7


@dataclass(frozen=True, eq=False)
class MemoryKernel:
    """Samples of a memory kernel; an impulse of strength c stands as c / step.

    Attributes:
        times: Shape (n,), uniform from 0 [s].
        values: Shape (n,), f [1/s^2].
        step: Distance of the times [s].
    """

    times: Floats
    values: Floats
    step: float


def memory_kernel(
    times: ArrayLike, values: ArrayLike, breakpoints: ArrayLike = ()
) -> MemoryKernel:
    """Return the memory kernel of a sampled response.

    Args:
        times: Shape (n,), uniform from 0 [s]; n >= 2.
        values: Shape (n,), x at those times, x(0) not 0.
        breakpoints: Times at which x has a kink [s]. They must be on the grid: a kink between
            two samples smears its impulse over both.

    Returns:
        The kernel at the first n - 1 times; the forward difference has no value at the last.

    Raises:
        ShapeError: Times and values are not two lists of one length, or hold a single sample.
        NotFiniteError: A number is NaN or infinite.
        DataError: The times are not uniform from 0, x(0) = 0, or a breakpoint is off the grid.
    """
    t, x = as_floats("times", times), as_floats("values", values)
    if t.ndim != 1 or t.shape != x.shape:
        raise ShapeError(f"times and values must have one shape (n,), got {t.shape} and {x.shape}")
    if len(t) < 2:
        raise ShapeError(f"a memory kernel needs at least 2 samples, got {len(t)}")
    step = float(t[-1] - t[0]) / (len(t) - 1)
    uneven = np.abs(t - t[0] - step * np.arange(len(t))) > 1e-3 * abs(step)
    if step <= 0.0 or t[0] != 0.0 or uneven.any():
        place = int(np.argmax(uneven)) if uneven.any() else 0
        raise DataError(
            f"the times must be uniform from 0: time {t[place]:g} at index {place}; "
            f"resample the response first"
        )
    require_onset(x[0])
    places = as_floats("breakpoints", breakpoints) / step
    off = np.abs(places - np.round(places)) > 1e-6 * len(t)
    if off.any():
        raise DataError(
            f"the breakpoint {float(places[off].flat[0] * step):g} s is not on the grid of step "
            f"{step:g} s; targets.uniform_times gives a grid that holds it"
        )
    quotient = divide_series(np.diff(x) / step, x[:-1])
    return MemoryKernel(t[:-1], quotient / step, step)


def divide_series(numerator: Floats, denominator: Floats) -> Floats:
    """Return the first n coefficients of numerator / denominator, both of shape (n,)."""
    count = len(numerator)
    support = int(np.flatnonzero(denominator)[-1]) + 1
    if count * support <= MOST_MULTIPLICATIONS:
        # Half of what starting a program that fits decays would take.
        from scipy import signal

        quotient: Floats = signal.lfilter([1.0], denominator[:support], numerator)
        return quotient
    return _product(_inverse_series(denominator), numerator, count)


def _inverse_series(series: Floats) -> Floats:
    """Newton's iteration g <- g (2 - series g), which doubles the number of right terms."""
    inverse = np.array([1.0 / series[0]])
    while len(inverse) < len(series):
        count = min(2 * len(inverse), len(series))
        rest = -_product(series[:count], inverse, count)
        rest[0] += 2.0
        inverse = _product(inverse, rest, count)
    return inverse


def _product(left: Floats, right: Floats, count: int) -> Floats:
    size = fft.next_fast_len(len(left) + len(right) - 1, real=True)
    product: Floats = fft.irfft(fft.rfft(left, size) * fft.rfft(right, size), size)
    return product[:count]
