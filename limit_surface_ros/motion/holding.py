# SPDX-License-Identifier: Apache-2.0
"""From when on friction can hold a body whose load dies away by a decay model.

A wrench of load factor s dies away as w(t) = w(0) x(t) / x(0). Friction is alike in both
directions, so that the load factor is then s |x(t) / x(0)|, and friction can hold the body while
that is at most 1. A body that something moves slowly, at a speed that has no momentum to speak
of, rests from then on. One with mass that the load set moving does not: it is fastest then, and
comes to rest later. `motion.sliding` tells when.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_number
from limit_surface_ros.decay.response import onset_value
from limit_surface_ros.errors import RangeError

if TYPE_CHECKING:
    from limit_surface_ros.decay.exponential_sum import ExponentialSum

# Level of a load factor so small that its inverse overflows.
_LARGEST = float(np.finfo(np.float64).max)


@dataclass(frozen=True)
class Holding:
    """From when on friction can hold a body for good; times in [s] after the onset.

    Attributes:
        time: The load factor is at most 1 from then on; 0 if it always is.
        earliest: The same if the response is smaller than the model by the error bound.
        latest: The same if it is larger; infinity if the bound reaches the level, so that nothing
            is known.
        slides: Whether the load factor at the onset is at least 1.
    """

    time: float
    earliest: float
    latest: float
    slides: bool


def holds_from(x: ExponentialSum, load_factor: float, max_error: float = 0.0) -> Holding:
    """Return from when on friction can hold a body whose load dies away with x(t) / x(0).

    That is the last time at which |x(t) / x(0)| is above 1 / load_factor: a load that swings back
    above it moves the body again. No body rests for good before, whatever its mass, if the load
    turns with it; how much later one with mass does, `motion.sliding.slide` tells.

    Args:
        x: The decay model.
        load_factor: s of the wrench at the onset. Up to 1 the push moves nothing, unless the
            response rises above its start later.
        max_error: Bound of |x - response|, in the unit of x.

    Raises:
        NoOnsetError: x(0) is zero.
        NotFiniteError: The load factor or the error is NaN or infinite.
        RangeError: The load factor or the error is negative.
        UnstableError: x does not decay, so that friction never holds the body for good.

    Example:
        >>> from limit_surface_ros.decay.exponential_sum import ExponentialSum
        >>> round(holds_from(ExponentialSum([-1.0], [1.0]), 3.0).time, 6)
        1.098612
    """
    factor = as_number("load factor", load_factor)
    error = as_number("max_error", max_error)
    if factor < 0.0 or error < 0.0:
        raise RangeError(
            f"load factor and max_error must be at least 0, got {factor:g} and {error:g}"
        )
    start = abs(onset_value(x))
    level = min(start / factor, _LARGEST) if factor else _LARGEST
    return Holding(
        time=x.time_to_level(level),
        earliest=x.time_to_level(min(level + error, _LARGEST)),
        latest=x.time_to_level(level - error) if level > error else math.inf,
        slides=factor >= 1.0,
    )
