# SPDX-License-Identifier: Apache-2.0
"""The largest error of a sum on an interval, proven from what is known of the response's shape.

Between two points a < b at the distance h the sum lies within M of its chord, with
M = min(h^2 / 8 sum |c| |lambda|^2 exp(Re lambda a), 2 sum |c| exp(Re lambda a)). Of the response

- that is linear there, nothing is to be added: |error| <= its values at both ends + M;
- that is convex, it is known to lie below its chord and above the neighbouring chords prolonged:
  the gap between them is added;
- that is monotone, it lies between its values at both ends.

Intervals whose bound exceeds the largest error seen are cut until none does.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from limit_surface_ros.decay.grids import fit_times
from limit_surface_ros.decay.targets import Analytic, PiecewiseLinear, Record

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.exponential_sum import ExponentialSum
    from limit_surface_ros.decay.targets import Target

# An error is proven if no more than this part of it is left open.
TOLERANCE = 1e-3
MOST_POINTS = 1_500_000
# Parts into which an interval is cut at most.
MOST_PARTS = 64
# Points, times rates, that are looked at in one piece.
_BLOCK = 1 << 18


class LargestError(NamedTuple):
    """The largest |sum - response| on an interval.

    Attributes:
        found: The largest that was seen.
        proven: None is larger than this; infinity if nothing is known of the response's shape.
        points: Number of points that were looked at.
    """

    found: float
    proven: float
    points: int


def certified_error(
    x: ExponentialSum, response: Target, end: float, tolerance: float = TOLERANCE
) -> LargestError:
    """Return the largest error of a sum on [0, end], and what it provably is at most.

    Args:
        x: The sum.
        response: Straight lines between knots, or a function that says that it is monotone or
            convex; of others, and of records, nothing is proven.
        end: End of the interval [s].
        tolerance: Part of the error up to which `proven` may exceed `found`; it exceeds it by
            more where too many points would be needed.
    """
    times = fit_times(response, end, float(np.abs(x.rates.imag).max()))
    shape = _shape(response)
    values, aims = x(times), response(times)
    while True:
        errors = np.abs(values - aims)
        found = float(errors.max())
        if shape is None:
            return LargestError(found, float("inf"), len(times))
        bounds = _bounds(x, times, values, aims, shape)
        if found == 0.0:
            return LargestError(found, float(bounds.max()), len(times))
        seen = np.maximum(errors[:-1], errors[1:])
        parts = _parts(bounds, seen, found, tolerance, max(0, MOST_POINTS - len(times)))
        more = _cuts(times, parts)
        places = np.repeat(np.arange(1, len(times)), parts - 1)
        new = (times[places - 1] < more) & (more < times[places])
        if not new.any():
            return LargestError(found, max(float(bounds.max()), found), len(times))
        more, places = more[new], places[new]
        times = np.insert(times, places, more)
        values, aims = np.insert(values, places, x(more)), np.insert(aims, places, response(more))


def _parts(
    bounds: Floats, seen: Floats, found: float, tolerance: float, most: int
) -> NDArray[np.intp]:
    """Return into how many parts each interval is to be cut, at most so many more in all.

    Those whose bound is too large are cut into as many as bring it down if what is open shrinks
    with the width; where that takes too many, they are allowed more.
    """
    while True:
        allowed = (1.0 + tolerance) * found
        parts = np.ones(len(bounds), dtype=np.intp)
        large = bounds > allowed
        needed = np.ceil((bounds[large] - seen[large]) / (allowed - seen[large]))
        parts[large] = np.clip(needed, 2, MOST_PARTS)
        if parts.sum() - len(parts) <= most:
            return parts
        tolerance *= 2.0


def _cuts(times: Floats, parts: NDArray[np.intp]) -> Floats:
    """Return the times that cut each interval into so many even parts, in order."""
    counts = parts - 1
    firsts = np.repeat(np.cumsum(counts) - counts, counts)
    shares = (np.arange(len(firsts)) - firsts + 1.0) / np.repeat(parts, counts)
    cuts: Floats = np.repeat(times[:-1], counts) + shares * np.repeat(np.diff(times), counts)
    return cuts


def _shape(response: Target) -> str | None:
    if isinstance(response, Record):
        return None
    if isinstance(response, PiecewiseLinear):
        return "linear"
    return response.shape if isinstance(response, Analytic) and response.shape else None


def _bounds(x: ExponentialSum, times: Floats, values: Floats, aims: Floats, shape: str) -> Floats:
    """Return a bound of the error between each two neighbouring times, shape (n - 1,)."""
    margins = _margins(x, times)
    if shape == "monotone":
        low = np.minimum(values[:-1], values[1:]) - margins
        high = np.maximum(values[:-1], values[1:]) + margins
        least, most = np.minimum(aims[:-1], aims[1:]), np.maximum(aims[:-1], aims[1:])
        monotone: Floats = np.maximum(high - least, most - low)
        return monotone
    errors = np.abs(values - aims)
    bounds: Floats = np.maximum(errors[:-1], errors[1:]) + margins
    if shape == "convex":
        bounds += _convex_gaps(times, aims)
    return bounds


def _margins(x: ExponentialSum, times: Floats) -> Floats:
    """Return how far the sum may be from its chord between each two times, shape (n - 1,)."""
    sizes, speeds = np.abs(x.coefficients), np.abs(x.rates)
    margins = np.empty(len(times) - 1)
    step = max(1, _BLOCK // len(sizes))
    for start in range(0, len(margins), step):
        block = slice(start, min(start + step, len(margins)))
        left = times[block]
        width = times[block.start + 1 : block.stop + 1] - left
        envelopes = np.exp(np.multiply.outer(left, x.rates.real)) * sizes
        curved = (envelopes @ speeds**2) * width**2 / 8.0
        margins[block] = np.minimum(curved, 2.0 * envelopes.sum(axis=1))
    return margins


def _convex_gaps(times: Floats, aims: Floats) -> Floats:
    """Return how far a convex function may lie below its chord in each interval."""
    widths = np.diff(times)
    slopes = np.diff(aims) / widths
    # How much steeper each chord is than the one before it, and the one after than it.
    before = np.append(np.inf, np.maximum(np.diff(slopes), 0.0))
    after = np.append(np.maximum(np.diff(slopes), 0.0), np.inf)
    # Both chords prolonged lie before * (t - a) and after * (b - t) below; they meet in between.
    with np.errstate(invalid="ignore"):
        meet = np.where(
            np.isinf(before),
            after,
            np.where(np.isinf(after), before, before * after / np.maximum(before + after, 1e-300)),
        )
    gaps: Floats = np.where(np.isinf(meet), 0.0, meet) * widths
    return gaps
