# SPDX-License-Identifier: Apache-2.0
"""Which surfaces are convex, with the reason; and where one that is not bends inward."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.surface.gauges.power_sum import PowerGauge
from limit_surface_ros.surface.kinds.polynomial import Polynomial
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.linalg import even_directions, root_of

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.base import LimitSurface
    from limit_surface_ros.surface.support.newton import Gauge

# Directions of load that are looked at where no theorem decides.
_DIRECTIONS = 20_000
# Keeps a gauge that does not bend at all from dividing zero by zero.
_TINY = np.finfo(np.float64).tiny
# Parts of them that fit the cache.
_BLOCKS = 6
# Curvature, relative to the largest at the same load, below which a surface bends inward.
_INWARD = -1e-9
# How far to either side the counter-example goes, halved until its middle is outside.
_REACH = 0.5


class NotConvexWarning(UserWarning):
    """A surface is not convex: a facet's or a dent's twists are of loads inside its hull."""


@dataclass(frozen=True, eq=False)
class Convexity:
    """What is known about the convexity of a surface.

    Attributes:
        convex: Whether no dent is known.
        proved: Whether that is certain: by a theorem, or by the counter-example.
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


def is_convex_by_construction(surface: LimitSurface) -> bool:
    """Tell whether a surface is convex whatever its coefficients are.

    Support points and dissipations are; a power sum is if every exponent is at least 1/2, for
    then each term is a convex function, or if it has but one; of a polynomial nothing is known
    without its coefficients.
    """
    if isinstance(surface, PowerSum):
        return len(surface.matrices) == 1 or bool(surface.exponents.min() >= 0.5)
    return surface.kind in ("dissipation", "point_contacts")


def is_convex(surface: LimitSurface) -> Convexity:
    """Tell whether a surface is convex, with a certificate or a counter-example.

    Where no theorem decides, the curvature of the gauge is looked at in 20 000 directions of
    load spread evenly over the sphere. If one bends inward, a chord that leaves the surface there
    is the counter-example; if none does, that is no proof and `proved` is false.
    """
    if is_convex_by_construction(surface):
        return Convexity(True, True, _theorem(surface), 0.0, None)
    # The surface is the same at f and -f: half the sphere stands for all of it.
    directions = even_directions(_DIRECTIONS)[_DIRECTIONS // 2 :]
    gauge = _gauge_of(surface)
    blocks = np.array_split(directions, _BLOCKS)
    relative = np.concatenate([_least_bend(_hessians(gauge, block)) for block in blocks])
    share = float((relative < _INWARD).mean())
    if share == 0.0:
        reason = f"no direction of {_DIRECTIONS} bends inward"
        return Convexity(True, False, reason, 0.0, None)
    worst = int(relative.argmin())
    hessian = _hessians(gauge, directions[worst : worst + 1])[:, :, 0]
    chord = _outer_chord(surface, directions[worst], np.linalg.eigh(hessian)[1][:, 0])
    return Convexity(
        False,
        chord is not None,
        f"it bends inward in {100.0 * share:.2g} % of the directions of load",
        share,
        chord,
    )


def warn_unless_convex(convexity: Convexity, name: str) -> None:
    """Warn, once for each name and place of call, if a surface is not convex.

    Args:
        convexity: What `is_convex` says of the surface.
        name: What to call it in the warning.
    """
    if not convexity.convex:
        warnings.warn(
            f"limit surface {name!r} is not convex: {convexity.reason}; there the wrench of the "
            "twist of a wrench is another one, that of maximum dissipation",
            NotConvexWarning,
            stacklevel=2,
        )


def _theorem(surface: LimitSurface) -> str:
    if not isinstance(surface, PowerSum):
        return "its dissipation is a sum of norms, so that its loads are a sum of convex sets"
    if len(surface.matrices) == 1:
        return "it is an ellipsoid"
    return "every exponent is at least 1/2, so that every term is convex"


def _gauge_of(surface: LimitSurface) -> Gauge:
    if isinstance(surface, PowerSum):
        return PowerGauge(np.array([root_of(m) for m in surface.matrices]), surface.exponents)
    if isinstance(surface, Polynomial):
        return surface
    raise TypeError(f"no gauge is known for a surface of kind {surface.kind!r}")


def _hessians(gauge: Gauge, directions: Floats) -> Floats:
    """Return the gauge's Hessians (3, 3, m) at directions (m, 3)."""
    columns = np.ascontiguousarray(directions.T)
    return gauge.derivatives(columns, np.zeros(len(directions)))[2]


def _least_bend(hessians: Floats) -> Floats:
    """Return the lower curvature over the larger, shape (m,), of Hessians (3, 3, m).

    A gauge does not bend along its load, so that one eigenvalue is zero and the other two follow
    from their sum and product: a hundred times as fast as an eigenvalue solver.
    """
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = hessians
    half = 0.5 * (xx + yy + zz)
    product = xx * yy - xy * xy + xx * zz - xz * xz + yy * zz - yz * yz
    larger = np.abs(half) + np.sqrt(np.maximum(half * half - product, 0.0))
    return np.asarray(np.where(half < 0.0, -1.0, product / np.maximum(larger * larger, _TINY)))


def _outer_chord(surface: LimitSurface, load: Floats, across: Floats) -> Floats | None:
    """Return the ends (2, 3) of a chord whose middle is outside, None if none is found."""
    reach = _REACH
    while reach > 1e-6:
        ends = (load + np.array([[reach], [-reach]]) * across) * surface.scaling.wrench_unit
        ends /= surface.load_factor(ends)[:, np.newaxis]
        if surface.load_factor(ends.mean(axis=0)) > 1.0 + 1e-12:
            return np.asarray(ends)
        reach *= 0.5
    return None
