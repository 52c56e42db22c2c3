# SPDX-License-Identifier: Apache-2.0
"""Which surfaces are convex, with the reason; and where one that is not bends inward."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.surface.gauges.quartic import Quartic
from limit_surface_ros.surface.gauges.sum_of_squares import lowest_curvature
from limit_surface_ros.surface.linalg import even_directions

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.base import LimitSurface
    from limit_surface_ros.surface.gauges.gauge import Gauge

# Directions of load that are looked at where no theorem decides.
_DIRECTIONS = 20_000
# Keeps a gauge without curvature from dividing zero by zero.
_TINY = np.finfo(np.float64).tiny
# Of these, where descents to the lowest curvature of a polynomial start.
_DESCENTS = 300
# Parts of them that fit the cache.
_BLOCKS = 6
# Curvature, relative to the largest at the same load, below which a surface bends inward.
_INWARD = -1e-9
# Part by which the middle of a chord is outside if that is not rounding.
_OUTSIDE = 2e-15
# How far to either side counter-examples go: a dent of curvature -c is about sqrt(c) wide.
_REACHES = 0.5 * 0.8 ** np.arange(64)


class NotConvexWarning(UserWarning):
    """A surface is not convex: where it bends inward its two maps are not inverse."""


@dataclass(frozen=True, eq=False)
class Convexity:
    """What is known about the convexity of a surface.

    Attributes:
        convex: Whether no dent is known.
        proved: Whether that is certain: by a theorem, by the counter-example, or for a polynomial
            by a curvature that is negative in exact arithmetic.
        reason: In words.
        dented_share: Share of the directions of load in which the surface bends inward.
        counter_example: Two wrenches on the surface whose mean lies outside it, shape (2, 3);
            None if there is none.
    """

    convex: bool
    proved: bool
    reason: str
    dented_share: float
    counter_example: Floats | None


def is_convex(surface: LimitSurface) -> Convexity:
    """Tell whether a surface is convex, with a certificate or a counter-example.

    Where no theorem decides, the curvature of the gauge is looked at in 20 000 directions of load
    spread evenly over the sphere, and for a polynomial where it is lowest. If one is negative, a
    chord that leaves the surface there is the counter-example; if none is, that is no proof and
    `proved` is false. Of a kind that does not give its curvature, chords alone are looked at.
    """
    theorem = surface.convex_because
    if theorem is not None:
        return Convexity(True, True, theorem, 0.0, None)
    # The surface is the same at f and -f: half the sphere stands for all of it.
    directions = even_directions(_DIRECTIONS)[_DIRECTIONS // 2 :]
    gauge = surface.shape.gauge
    if gauge is None:
        return _by_chords(surface, directions)
    blocks = np.array_split(directions, _BLOCKS)
    relative = np.concatenate([_least_curvature(_hessians(gauge, block)) for block in blocks])
    share = float((relative < _INWARD).mean())
    worst = directions[relative.argmin()]
    across, certain = None, False
    if isinstance(gauge, Quartic):
        value, load, along = lowest_curvature(gauge, directions[:: len(directions) // _DESCENTS].T)
        if value < 0.0:
            worst, across = load, along
            certain = gauge.exact_curvature(load, along) < 0
            # A dent that lies between the directions.
            share = share or 0.5 / _DIRECTIONS
    if share == 0.0:
        reason = f"no direction of {_DIRECTIONS} has a negative curvature"
        return Convexity(True, False, reason, 0.0, None)
    if across is None:
        hessian = _hessians(gauge, worst[np.newaxis])[:, :, 0]
        across = np.linalg.eigh(hessian)[1][:, 0]
    chord = _outer_chord(surface, worst, across)
    reason = f"it bends inward in {100.0 * share:.2g} % of the directions of load"
    return Convexity(False, certain or chord is not None, reason, share, chord)


def _by_chords(surface: LimitSurface, directions: Floats) -> Convexity:
    """Tell by chords between points of the surface whether one leaves it."""
    points = directions * surface.scaling.wrench_unit
    points /= surface.load_factor(points)[:, np.newaxis]
    ends = np.concatenate([points, -points])
    others = np.random.default_rng(0).permutation(len(ends))
    chords = np.array([ends, ends[others]])
    factors = surface.load_factor(chords.mean(axis=0))
    outside = factors > 1.0 + _OUTSIDE
    if not outside.any():
        reason = f"no chord of {len(factors)} leaves the surface"
        return Convexity(True, False, reason, 0.0, None)
    share = float(outside.mean())
    reason = f"{100.0 * share:.2g} % of its chords leave it"
    return Convexity(False, True, reason, share, np.asarray(chords[:, factors.argmax()]))


def warn_unless_convex(convexity: Convexity, name: str) -> None:
    """Warn, once for each name and place of call, if a surface is not convex.

    Args:
        convexity: What `is_convex` says of the surface.
        name: What to call it in the warning.
    """
    if not convexity.convex:
        warnings.warn(
            f"limit surface {name!r} is not convex: {convexity.reason}; in those directions "
            "twist_to_wrench(wrench_to_twist(w)) returns another wrench: the one of maximum "
            "dissipation",
            NotConvexWarning,
            stacklevel=2,
        )


def _hessians(gauge: Gauge, directions: Floats) -> Floats:
    """Return the gauge's Hessians (3, 3, m) at directions (m, 3)."""
    columns = np.ascontiguousarray(directions.T)
    return gauge.derivatives(columns, np.zeros(len(directions)))[2]


def _least_curvature(hessians: Floats) -> Floats:
    """Return the lower curvature over the larger, shape (m,), of Hessians (3, 3, m).

    A gauge is linear along its load, so that one eigenvalue is zero and the other two follow
    from their sum and product: a hundred times as fast as an eigenvalue solver.
    """
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = hessians
    half = 0.5 * (xx + yy + zz)
    product = xx * yy - xy * xy + xx * zz - xz * xz + yy * zz - yz * yz
    larger = np.abs(half) + np.sqrt(np.maximum(half * half - product, 0.0))
    return np.asarray(np.where(half < 0.0, -1.0, product / np.maximum(larger * larger, _TINY)))


def _outer_chord(surface: LimitSurface, load: Floats, across: Floats) -> Floats | None:
    """Return the ends (2, 3) of the chord whose middle is farthest out, None if none is out."""
    steps = _REACHES[:, np.newaxis] * across
    ends = np.array([load + steps, load - steps]) * surface.scaling.wrench_unit
    ends /= surface.load_factor(ends)[..., np.newaxis]
    factors = surface.load_factor(ends.mean(axis=0))
    best = int(factors.argmax())
    return np.asarray(ends[:, best]) if factors[best] > 1.0 + _OUTSIDE else None
