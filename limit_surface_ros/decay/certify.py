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
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.exponential_sum import ExponentialSum
    from limit_surface_ros.decay.targets import Target

# An error is proven if no more than this part of it is left open.
TOLERANCE = 1e-3
MOST_POINTS = 300_000
# Parts into which an interval is cut.
PARTS = 4
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
    while True:
        values, aims = x(times), response(times)
        errors = values - aims
        found = float(np.abs(errors).max())
        if shape is None:
            return LargestError(found, float("inf"), len(times))
        bounds = _bounds(x, times, values, aims, shape)
        proven = float(bounds.max())
        open_cells = np.flatnonzero(bounds > (1.0 + tolerance) * found)
        if len(open_cells) == 0 or len(times) > MOST_POINTS:
            return LargestError(found, max(proven, found), len(times))
        shares = np.arange(1, PARTS) / PARTS
        gaps = times[open_cells + 1] - times[open_cells]
        more = times[open_cells, np.newaxis] + np.multiply.outer(gaps, shares)
        following = np.unique(np.concatenate([times, more.reshape(-1)]))
        if len(following) == len(times):
            return LargestError(found, max(proven, found), len(times))
        times = following


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
