# SPDX-License-Identifier: Apache-2.0
"""Certificates of stability: of a delay system, and of the system a response would give."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_positive
from limit_surface_ros.decay.delay.roots import count_roots
from limit_surface_ros.decay.delay.winding import turn
from limit_surface_ros.decay.targets import PiecewiseLinear
from limit_surface_ros.errors import DataError, SolverError, UnstableError

if TYPE_CHECKING:
    from limit_surface_ros.decay.basis import Complexes
    from limit_surface_ros.decay.delay.system import DelaySystem
    from limit_surface_ros.decay.targets import Target

# Knots on which the transform of a response is computed.
TRANSFORM_KNOTS = 2001


def count_unstable_roots(system: DelaySystem, margin: float = 0.0) -> int:
    """Return the number of roots with Re lambda > -margin, pairs twice, by the argument principle.

    All of them lie within `system.root_bound(-margin)`, so that one box holds them: 0 is a
    certificate of stability.

    Args:
        system: The delay system.
        margin: At least 0 [1/s].

    Raises:
        SolverError: A root lies on the line Re lambda = -margin.
    """
    reach = system.root_bound(-margin) * 1.001 + 1e-6 / (system.max_delay or 1.0)
    return count_roots(system, (-margin, reach), (0.0, reach))


def require_stable(system: DelaySystem) -> None:
    """Refuse a system with growing solutions.

    Raises:
        UnstableError: It has; the error tells how many roots are to the right of the axis.
    """
    try:
        count = count_unstable_roots(system)
    except SolverError as error:
        raise UnstableError(f"the delay system is at the border of stability: {error}") from None
    if count:
        raise UnstableError(
            f"the delay system is unstable: {count} of its roots have a positive real part"
        )


def count_growing_modes(response: Target, end: float) -> int:
    """Return the number of zeros of a response's Laplace transform in the right half plane.

    Each is a pole of the memory kernel's transform x(0) / X: the kernel then grows, and so do
    solutions of the delay system built from it. 0 means that the response is minimum-phase; a
    response that falls monotonically to zero always is.

    Args:
        response: The response.
        end: From where on it is taken as zero [s].

    Raises:
        RangeError: The end is not above 0.
        DataError: The response has not decayed by then, or its integral is zero.
    """
    span = as_positive("end", end)
    knots = np.unique(
        np.concatenate([np.linspace(0.0, span, TRANSFORM_KNOTS), response.breakpoints])
    )
    if isinstance(response, PiecewiseLinear) and len(response.knots) < TRANSFORM_KNOTS:
        knots = np.unique(np.concatenate([response.knots, [span]]))
    knots = knots[knots <= span]
    values = response(knots) / response(0.0)
    last = float(values[-1])
    if abs(last) > 0.5:
        raise DataError(f"the response has not decayed by {span:g} s: it still is {last:.2g} x(0)")
    if (np.diff(values) <= 0.0).all() and last >= 0.0:
        return 0
    slopes = np.append(np.diff(values) / np.diff(knots), 0.0)
    jumps = np.append(slopes[0], np.diff(slopes))

    def transform(s: Complexes) -> Complexes:
        waves = np.exp(np.multiply.outer(-s, knots))
        result: Complexes = (1.0 - last * waves[:, -1] + (waves @ jumps) / s) / s
        return result

    # Above `highest` s X(s) / x(0) stays in the disc of radius below 1 about 1.
    highest = 1j * float(np.abs(jumps).sum()) / (0.9 - abs(last))
    lowest = 1e-3j / span
    try:
        phase = turn(transform, np.array([lowest, highest]), 0.5 / span)
    except SolverError:
        raise DataError(
            "the response's transform has a zero on the imaginary axis: its kernel does not decay"
        ) from None
    # Over the axis and the half circle, on which X falls as 1 / s; what is left beyond `highest`
    # is the way to the phase -pi / 2.
    rest = -0.5 * np.pi - float(np.angle(transform(np.array([highest])))[0])
    rest = (rest + np.pi) % (2.0 * np.pi) - np.pi
    return round(-(phase + rest + 0.5 * np.pi) / np.pi)


def require_minimum_phase(response: Target, end: float) -> None:
    """Refuse a response whose delay system would be unstable.

    Raises:
        UnstableError: The response is not minimum-phase.
        DataError: The response has not decayed by `end`.
    """
    count = count_growing_modes(response, end)
    if count:
        raise UnstableError(
            f"the response is not minimum-phase: its Laplace transform has {count} zero(s) in "
            f"the right half plane, so its memory kernel grows and its delay system is unstable. "
            f"Use a method that needs no kernel (esprit, neutral), or allow unstable systems"
        )
