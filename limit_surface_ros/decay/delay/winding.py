# SPDX-License-Identifier: Apache-2.0
"""The argument principle: how many zeros an analytic function has inside a closed path.

A real function (h(conj z) = conj h(z)) needs only the upper half of a path that is symmetric about
the real axis: the phase turns by as much again on the lower half.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import SolverError

if TYPE_CHECKING:
    from collections.abc import Callable

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.basis import Complexes

# Between two samples the phase may turn by this much [rad], and the modulus change by this factor.
MOST_TURN, MOST_CHANGE = 0.7, 3.0
MOST_SAMPLES = 200_000


def turn(function: Callable[[Complexes], Complexes], corners: Complexes, step: float) -> float:
    """Return by how much the phase of a function turns along a polygon [rad].

    The path is sampled anew wherever the phase turns by more than 0.7 rad or the modulus changes
    by more than a factor of three from one sample to the next.

    Args:
        function: Analytic near the path; takes and returns shape (n,).
        corners: Shape (k,), the polygon's corners in order.
        step: Distance of the first samples.

    Raises:
        SolverError: A zero lies on the path, or so close that it cannot be told.
    """
    length = float(np.abs(np.diff(corners)).sum())
    if length > 0.2 * MOST_SAMPLES * step:
        raise SolverError(
            f"a path of length {length:g} around the roots is too long to follow in steps of "
            f"{step:g}: the system is too stiff for this box"
        )
    legs = [
        np.linspace(start, end, max(2, int(np.ceil(abs(end - start) / step)) + 1))[:-1]
        for start, end in pairwise(corners)
    ]
    points = np.append(np.concatenate(legs), corners[-1])
    values = function(points)
    smallest = 1e-9 * float(np.abs(np.diff(corners)).max())
    while True:
        with np.errstate(divide="ignore", invalid="ignore"):
            quotients = values[1:] / values[:-1]
        turns: Floats = np.angle(quotients)
        changes = np.abs(quotients)
        calm = (np.abs(turns) <= MOST_TURN) & (changes <= MOST_CHANGE)
        calm &= changes >= 1.0 / MOST_CHANGE
        coarse = np.flatnonzero(~calm)
        if len(coarse) == 0:
            return float(turns.sum())
        gaps = np.abs(points[coarse + 1] - points[coarse])
        if float(gaps.min()) < smallest or len(points) > MOST_SAMPLES:
            place = points[coarse[int(np.argmin(gaps))]]
            raise SolverError(f"a zero lies on the path of the argument principle, near {place:g}")
        middles = 0.5 * (points[coarse] + points[coarse + 1])
        points = np.insert(points, coarse + 1, middles)
        values = np.insert(values, coarse + 1, function(middles))


def count_zeros(
    function: Callable[[Complexes], Complexes],
    real: tuple[float, float],
    imag: tuple[float, float],
    step: float,
) -> int:
    """Return the number of zeros of a real analytic function in a box, with multiplicity.

    Args:
        function: Takes and returns shape (n,); function(conj z) = conj function(z).
        real: Left and right edge.
        imag: Lower and upper edge. A lower edge of 0 stands for the box that is symmetric
            about the real axis: real zeros count once, complex ones twice.
        step: Distance of the first samples on the path.

    Raises:
        SolverError: A zero lies on the box's edge, or the phase does not add up.
    """
    (left, right), (low, high) = real, imag
    upper = [complex(right, low), complex(right, high), complex(left, high), complex(left, low)]
    if low == 0.0:
        turns = turn(function, np.array(upper), step) / np.pi
    else:
        turns = turn(function, np.array([*upper, upper[0]]), step) / (2.0 * np.pi)
    count = round(turns)
    if abs(turns - count) > 0.01 or count < 0:
        raise SolverError(f"the phase turns {turns:.3f} times around the box: no whole number")
    return count
