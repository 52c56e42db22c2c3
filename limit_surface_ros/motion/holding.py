# SPDX-License-Identifier: Apache-2.0
"""When a body that was set sliding comes to rest: a load that dies away by a decay model.

A wrench of load factor s dies away as w(t) = w(0) x(t) / x(0). Friction is alike in both
directions, so that the load factor is then s |x(t) / x(0)|, and the body slides while that is
above 1, backwards where x has changed its sign.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_floats
from limit_surface_ros.decay.response import onset_value
from limit_surface_ros.errors import RangeError

if TYPE_CHECKING:
    from limit_surface_ros.decay.exponential_sum import ExponentialSum

# Level of rest of a load factor so small that its inverse overflows.
_LARGEST = float(np.finfo(np.float64).max)


@dataclass(frozen=True)
class Stop:
    """When a body that was pushed comes to rest for good; times in [s] after the onset.

    Attributes:
        time: The load factor is at most 1 from then on; 0 if the push does not move the body.
        earliest: The same if the response is smaller than the model by the error bound.
        latest: The same if it is larger; infinity if the bound reaches the level of rest, so
            that nothing is known.
        slides: Whether the load factor at the onset is at least 1.
    """

    time: float
    earliest: float
    latest: float
    slides: bool


def predict_stop(x: ExponentialSum, load_factor: float, max_error: float = 0.0) -> Stop:
    """Return when a body comes to rest whose load dies away with x(t) / x(0).

    It rests for good from the last time on at which |x(t) / x(0)| is above 1 / load_factor: a
    load that swings back above it moves the body again.

    Args:
        x: The decay model.
        load_factor: s of the wrench at the onset. Up to 1 the push moves nothing, unless the
            response rises above its start later.
        max_error: Bound of |x - response|, in the unit of x.

    Raises:
        NoOnsetError: x(0) is zero.
        NotFiniteError: The load factor or the error is NaN or infinite.
        RangeError: The load factor or the error is negative.
        UnstableError: x does not decay, so that sliding never ends.
    """
    factor = float(as_floats("load factor", load_factor))
    error = float(as_floats("max_error", max_error))
    if factor < 0.0 or error < 0.0:
        raise RangeError(
            f"load factor and max_error must be at least 0, got {factor:g} and {error:g}"
        )
    start = abs(onset_value(x))
    level = min(start / factor, _LARGEST) if factor else _LARGEST
    return Stop(
        time=x.time_to_level(level),
        earliest=x.time_to_level(min(level + error, _LARGEST)),
        latest=x.time_to_level(level - error) if level > error else math.inf,
        slides=factor >= 1.0,
    )
