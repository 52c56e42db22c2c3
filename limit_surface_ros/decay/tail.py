# SPDX-License-Identifier: Apache-2.0
"""Beyond the record: what is assumed of a response there, and how a fit is held to it.

A record says nothing of what comes after its end, and coefficients that are fitted on it alone may
leave terms that cancel there and nowhere else. The assumption is that the response never exceeds
its `envelope` afterwards, the largest value over the last tenth of the interval, or over its last
swing if it still swings: a slow swing may just cross zero where a record ends. A fitted sum is
held to the larger of that and its own error, and what it does in fact exceed nowhere is stated as
its `bound`, which is proven. So the sum departs from the response by at most bound + envelope.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.decay.basis import count_terms
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
# A swing is larger than so many deviations of noise, and lasts at most so many times the one
# before it. It is past its peak if it has fallen below this part of it.
SWING, LONGEST_SWING, PAST = 4.0, 1.5, 0.8
# The errors of a fit are told apart down to this part of what is assumed after it.
LEAST_WEIGHT = 1e-9
# Times after the end at which a fit is held, in parts of it, and how many resolve a period.
_GRADED = np.concatenate([1.0 + np.geomspace(1e-3, 0.2, 12), np.geomspace(1.25, 9.0, 24)])
_GRADED_TO, _POINTS_A_DECADE = 9.0, 28
_EVEN_TO, _POINTS_A_RADIAN, _MOST_EVEN = 2.0, 1.5, 2000
# How many times are looked at between them.
_LOOKS_A_RADIAN, _MOST_LOOKS, _GRADED_LOOKS = 4.0, 20_000, 801


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
    """Return the largest |response - constant| over the last tenth of [0, end], or the last swing.

    Of a record, without the samples that stand out from their neighbours, and at least its noise.
    """
    if isinstance(response, Record):
        inside = response.knots <= end
        times, values = response.knots[inside], response.values[inside]
        kept = ~stand_out(values, noise)
        kept[-1] |= not kept[times >= (1.0 - LAST_PART) * times[-1]].any()
        times, values = times[kept], values[kept]
    else:
        times = np.linspace(0.0, end, _FUNCTION_POINTS)
        values = response(times)
    values = values - constant
    late = times >= min((1.0 - LAST_PART) * end, times[-1])
    return max(float(np.abs(values[late]).max()), _last_swing(times, values, noise), noise)


def _last_swing(times: Floats, values: Floats, noise: float) -> float:
    """Return the size of the swing that goes on at the end, at least the one before if it rises.

    It is 0 if none goes on: the values keep their sign, or have long ceased to change it.
    """
    sizes = np.abs(values)
    large = np.flatnonzero(sizes > max(SWING * noise, LEAST_WEIGHT * float(sizes.max())))
    changes = np.flatnonzero(np.diff(np.sign(values[large])))
    if len(changes) == 0:
        return 0.0
    before = int(large[changes[-2] + 1]) if len(changes) > 1 else 0
    last = int(large[changes[-1] + 1])
    # The first swing may have begun in its middle.
    duration = (times[last] - times[before]) * (1.0 if len(changes) > 1 else 2.0)
    if times[-1] - times[last] > LONGEST_SWING * duration:
        return 0.0
    size = float(sizes[last:].max())
    end = sizes[times >= times[-1] - 0.1 * duration]
    if float(end.max()) < PAST * size:
        return size
    return max(size, float(sizes[before:last].max()))


def tail_of(x: ExponentialSum, end: float, envelope: float) -> Tail:
    """Return what a sum provably does after `end` beside what is assumed of the response."""
    bound = x.without_constant().supremum(end)
    level = f"{x.constant:.6g} +- " if x.constant else "+-"
    return Tail(
        envelope,
        bound,
        f"after {end:g} s the response stays within {level}{envelope:.6g}, its largest distance "
        f"over the last tenth of the record, or its last swing",
    )


def tail_weight(error: float, envelope: float) -> float:
    """Return the weight of a time after the end: the envelope there counts as the error before."""
    return 1.0 if envelope <= error else max(error / envelope, LEAST_WEIGHT)


def tail_times(rates: Complexes, end: float) -> Floats:
    """Return times after the end [s] at which a sum of these rates is to be held.

    As many slow terms as there are may together rise like t^(terms - 1) exp(-a t), until each has
    decayed so many times, and are not small before each has decayed some twice as often.
    """
    fastest = float(np.abs(rates.imag).max(initial=0.0))
    count = int(np.clip(_POINTS_A_RADIAN * end * fastest, 2, _MOST_EVEN))
    even = np.linspace(1.0, _EVEN_TO, count + 1)[1:]
    last = _vanished(rates, end)
    later = np.zeros(0)
    if last > _GRADED_TO:
        count = 1 + int(np.ceil(_POINTS_A_DECADE * np.log10(last / _GRADED_TO)))
        later = np.geomspace(_GRADED_TO, last, count)
    times: Floats = np.unique(np.concatenate([_GRADED, even, later])) * end
    return times


def closer_tail_times(rates: Complexes, end: float) -> Floats:
    """Return times after the end [s] at which a held sum is looked at, until it is small.

    They resolve the fastest swing, unless that lasts for thousands of periods.
    """
    last = max(_vanished(rates, end), _EVEN_TO)
    fastest = float(np.abs(rates.imag).max(initial=0.0))
    count = int(np.clip(_LOOKS_A_RADIAN * end * fastest * (last - 1.0), 2, _MOST_LOOKS))
    graded = np.geomspace(1.0, last, _GRADED_LOOKS)
    times: Floats = np.union1d(graded, np.linspace(1.0, last, count + 1)) * end
    return times


def _vanished(rates: Complexes, end: float) -> float:
    """Return when all terms are small, however they cancel, in parts of the end."""
    decay = float(-rates.real[rates != 0.0].max(initial=-np.inf))
    return (2 * count_terms(rates) + 8) / (end * decay)
