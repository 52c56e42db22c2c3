# SPDX-License-Identifier: Apache-2.0
"""From a response to the delay system that has it as a solution: thesis 2.1 to 2.3 in one call."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_positive
from limit_surface_ros.decay.delay.closed_kernel import ClosedKernel
from limit_surface_ros.decay.delay.impulses import find_impulses
from limit_surface_ros.decay.delay.kernel import memory_kernel
from limit_surface_ros.decay.delay.pieces import PiecewisePolynomial
from limit_surface_ros.decay.delay.system import DelaySystem
from limit_surface_ros.decay.targets import PiecewiseLinear, in_unit_of, uniform_times
from limit_surface_ros.errors import DataError, RangeError

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.delay.impulses import Impulses
    from limit_surface_ros.decay.delay.kernel import MemoryKernel
    from limit_surface_ros.decay.targets import Target

# The closed form is for responses drawn by hand; recorded samples have more knots.
MOST_KNOTS = 40
# A uniform grid is looked for that holds this many kinks.
MOST_KINKS = 12
# Beyond this degree the closed kernel's cells are met to rounding.
CLOSED_DEGREE = 15
SAMPLES = 2401
MOST_CELLS = 60
# Polynomials of higher degree are not determined by the samples of a cell to any digit.
MOST_DEGREE = 30


def delay_system(
    response: Target, max_delay: float, degree: int | None = None, samples: int = SAMPLES
) -> DelaySystem:
    """Return the delay system of a response, its memory cut off at the maximum delay.

    The kernel is taken in closed form where the response has few knots, else from samples. Whether
    the system is stable is for `stability.require_minimum_phase` to tell beforehand.

    Args:
        response: The response.
        max_delay: T [s], up to which the kernel is kept.
        degree: Degree of the polynomial pieces; by default 15 for the closed form, else 5.
        samples: Number of samples on [0, T] if the kernel is sampled.

    Raises:
        RangeError: The maximum delay is not above 0 or the degree is not within 0 to 30.
        DataError: The kernel cannot be found on these samples.
    """
    span = as_positive("max_delay", max_delay)
    if degree is not None and not 0 <= degree <= MOST_DEGREE:
        raise RangeError(f"degree must be a whole number from 0 to {MOST_DEGREE}, got {degree}")
    # In a unit of about the delay, a power of two, so that no time scale is better than another.
    unit = 2.0 ** round(math.log2(span))
    scaled = in_unit_of(response, unit)
    return _delay_system(scaled, span / unit, degree, samples).in_unit_of(1.0 / unit)


def _delay_system(response: Target, span: float, degree: int | None, samples: int) -> DelaySystem:
    if isinstance(response, PiecewiseLinear) and len(response.knots) <= MOST_KNOTS:
        try:
            kernel = ClosedKernel(response, span)
        except DataError:
            pass
        else:
            order = CLOSED_DEGREE if degree is None else degree
            pieces = PiecewisePolynomial.from_function(kernel, kernel.edges, order)
            return DelaySystem(kernel.impulses.delays, kernel.impulses.strengths, pieces)
    # On the grid a kink gives one clean impulse, but a grid that holds all kinks may not exist.
    try:
        times = uniform_times(span, samples, response.breakpoints[:MOST_KINKS])
    except DataError:
        times = np.linspace(0.0, span, samples)
    sampled = memory_kernel(times, response(times))
    return system_of_kernel(sampled, find_impulses(sampled), 5 if degree is None else degree)


def system_of_kernel(
    kernel: MemoryKernel, impulses: Impulses, degree: int, cell: float | None = None
) -> DelaySystem:
    """Return the delay system of a sampled kernel: its impulses, and polynomials for the rest.

    Args:
        kernel: The kernel up to the maximum delay.
        impulses: Its impulses; sums of their delays become edges, where the kernel may jump.
        degree: Degree of each polynomial.
        cell: Longest cell [s]; a sixth of the maximum delay if not given.

    Raises:
        RangeError: The degree is negative or the cell is not above 0.
        DataError: A cell holds too few samples for the degree.
    """
    span = float(kernel.times[-1] + kernel.step)
    longest = span / 6.0 if cell is None else as_positive("cell", cell)
    if degree < 0:
        raise RangeError(f"degree must be at least 0, got {degree}")
    shortest = (degree + 6) * kernel.step
    edges = _cut(_sums(impulses.delays, span, shortest), longest)
    pieces = PiecewisePolynomial.from_samples(
        kernel.times, kernel.values, edges, degree, spread=2.0 * kernel.step
    )
    return DelaySystem(impulses.delays, impulses.strengths, pieces)


def _sums(delays: Floats, end: float, shortest: float) -> Floats:
    """Return 0, the sums of delays below `end`, and `end`, none closer than `shortest`."""
    steps = delays[delays > 0.0]
    sums = np.zeros(1)
    while True:
        grown = np.unique(np.round(np.append(sums, np.add.outer(sums, steps)), 9))
        # The impulses are known to a small part of a sample, and so are their sums.
        grown = grown[np.append(True, np.diff(grown) > shortest)]
        grown = grown[grown < end - shortest]
        if len(grown) == len(sums) or len(grown) > MOST_CELLS:
            return np.append(grown[:MOST_CELLS], end)
        sums = grown


def _cut(edges: Floats, longest: float) -> Floats:
    """Cut cells into equal parts none of which is longer than `longest`."""
    parts = [
        np.linspace(left, right, int(np.ceil((right - left) / longest - 1e-9)) + 1)[:-1]
        for left, right in pairwise(edges)
    ]
    return np.append(np.concatenate(parts), edges[-1])
