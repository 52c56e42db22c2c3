# SPDX-License-Identifier: Apache-2.0
"""Beyond the record: what is assumed of a response there, and how a fit is held to it.

A record says nothing of what comes after its end, and coefficients that are fitted on it alone may
leave terms that cancel there and nowhere else. The assumption is that the response never exceeds
its `envelope` afterwards, the largest value over the last tenth of the interval. A fitted sum is
held to the larger of that and its own error, and what it does in fact exceed nowhere is stated as
its `bound`, which is proven. So the sum departs from the response by at most bound + envelope.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.decay.outliers import stand_out
from limit_surface_ros.decay.targets import Record

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.basis import Complexes
    from limit_surface_ros.decay.exponential_sum import ExponentialSum
    from limit_surface_ros.decay.targets import Target

# The part of the interval over which the envelope is taken.
LAST_PART = 0.1
_FUNCTION_POINTS = 2001
# Times after the end at which a fit is held, in parts of it, and how many resolve a period.
_GRADED = np.concatenate([1.0 + np.geomspace(1e-3, 0.2, 12), np.geomspace(1.25, 9.0, 24)])
_EVEN_TO, _POINTS_A_RADIAN, _MOST_EVEN = 2.0, 1.5, 2000


@dataclass(frozen=True)
class Tail:
    """What is assumed of a response after the fitted interval, and what its model does there.

    Attributes:
        envelope: |response - constant| is assumed never to exceed this, in the unit of x.
        bound: |sum - constant| provably never does.
        assumption: The assumption in words.
    """

    envelope: float
    bound: float
    assumption: str

    @property
    def error(self) -> float:
        """Largest |sum - response| after the interval if the assumption holds."""
        return self.envelope + self.bound


def envelope_of(response: Target, end: float, noise: float = 0.0, constant: float = 0.0) -> float:
    """Return the largest |response - constant| over the last tenth of [0, end].

    Of a record, without the samples that stand out from their neighbours, and at least its noise.
    """
    if isinstance(response, Record):
        inside = response.knots <= end
        times, values = response.knots[inside], response.values[inside]
        late = times >= (1.0 - LAST_PART) * times[-1]
        kept = late & ~stand_out(values, noise)
        kept = kept if kept.any() else late
        return max(float(np.abs(values[kept] - constant).max()), noise)
    times = np.linspace((1.0 - LAST_PART) * end, end, _FUNCTION_POINTS)
    return float(np.abs(response(times) - constant).max())


def tail_of(x: ExponentialSum, end: float, envelope: float) -> Tail:
    """Return what a sum provably does after `end` beside what is assumed of the response."""
    bound = x.without_constant().supremum(end)
    level = f"{x.constant:.6g} +- " if x.constant else "+-"
    return Tail(
        envelope,
        bound,
        f"after {end:g} s the response stays within {level}{envelope:.6g}, its largest distance "
        f"over the last tenth of the record",
    )


def tail_weight(error: float, envelope: float) -> float:
    """Return the weight of a time after the end: the envelope there counts as the error before."""
    return 1.0 if envelope <= error else error / envelope


def tail_times(rates: Complexes, end: float) -> Floats:
    """Return times after the end [s] at which a sum of these rates is to be held."""
    fastest = float(np.abs(rates.imag).max(initial=0.0))
    count = int(np.clip(_POINTS_A_RADIAN * end * fastest, 2, _MOST_EVEN))
    even = np.linspace(1.0, _EVEN_TO, count + 1)[1:]
    times: Floats = np.unique(np.concatenate([_GRADED, even])) * end
    return times
