# SPDX-License-Identifier: Apache-2.0
"""Where a body presses on the ground, from recorded pushes: friction limits of many contacts.

    J = (motion_cost) + entropy_weight sum_k (m_k log(m_k / n_k) - m_k + n_k)

The contacts stay where they are and only their friction limits m_k are fitted, as logarithms, so
that none is negative. Of the many pressures that a few pushes allow, the relative entropy to the
usual limits n_k takes the one that assumes the least (Jaynes 1957,
doi:10.1103/PhysRev.106.620). There is one start, the usual limits, and no chance in it.

A contact at (x, y) of friction limit m and radius c makes the term m sqrt(wx^2 + wy^2 + (c w)^2),
with (wx, wy) = (vx - y w, vy + x w) its velocity: three speeds instead of the two of a point, so
that the load of a motion is smooth.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.fitting.bfgs import minimise
from limit_surface_ros.fitting.motion_cost import MotionCost

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.checks import Bools, Floats, Places
    from limit_surface_ros.fitting.pairs import ScaledPairs
    from limit_surface_ros.surface.kinds.point_contacts import PointContacts

# Rings of the disc of candidates, and its radius in lever arms of the loads: beyond where a body
# stands for all but the oddest pushes, with some dozen contacts inside of one lever arm.
_RINGS = 6
_REACH = 4.0
# Radius of a contact of the disc, in parts of the distance between rings.
_OVERLAP = 0.5
# Radius of a contact at a known support point, in parts of how far the points spread.
_KNOWN_SIZE = 0.1
# Smallest radius, in characteristic lengths: keeps a single point's resistance to turning.
_SMALLEST = 1e-3
# Share of the largest friction limit below which a contact is left out.
_NEGLIGIBLE = 1e-3
# Noisy pushes do not tell closer pressures apart.
_PRECISION = 1e-3
_MOST_ITERATIONS = 200
# Pairs that show where a body stands; more only cost time.
_MOST_PAIRS = 200


@dataclass(frozen=True)
class SmallContacts:
    """Contacts in scaled variables.

    Attributes:
        points: Shape (k, 2), in characteristic lengths.
        limits: Friction limits, not negative, shape (k,), in parts of the friction force scale.
        radii: Shape (k,), in characteristic lengths.
    """

    points: Floats
    limits: Floats
    radii: Floats

    @classmethod
    def on_a_disc(cls, pairs: ScaledPairs) -> SmallContacts:
        """Return equal contacts that cover wherever the body of these pushes may stand.

        The loads' line of action passes the centre of friction at their lever arm; so centre and
        radius follow from the loads alone, wherever the reference point is and in any unit.
        """
        forces, moments, weights = pairs.wrenches[:, :2], pairs.wrenches[:, 2], pairs.weights
        arms = np.stack([forces[:, 1], -forces[:, 0]], axis=1)
        roots = np.sqrt(weights)
        centre = np.linalg.lstsq(arms * roots[:, None], moments * roots, rcond=None)[0]
        lever = np.sqrt((weights @ (moments - arms @ centre) ** 2) / (weights @ (arms**2)).sum())
        radius = max(_REACH * float(lever), _RINGS * _SMALLEST)
        points = centre + radius * _rings(_RINGS)
        spacing = radius / _RINGS
        count = len(points)
        even = cls(points, np.ones(count), np.full(count, _OVERLAP * spacing))
        return even.with_loads_of(pairs)

    @classmethod
    def around(cls, discs: Sequence[tuple[float, int]]) -> SmallContacts:
        """Return contacts of unit limits on discs about the reference point.

        Args:
            discs: Radius, in characteristic lengths, and number of rings of each.
        """
        points = [radius * _rings(rings) for radius, rings in discs]
        radii = [
            np.full(len(each), _OVERLAP * radius / rings)
            for each, (radius, rings) in zip(points, discs, strict=True)
        ]
        whole = np.concatenate(points)
        return cls(whole, np.ones(len(whole)), np.concatenate(radii))

    @classmethod
    def at(cls, support: PointContacts, pairs: ScaledPairs) -> SmallContacts:
        """Return contacts at known support points; only the ratios of their limits count."""
        pressing = support.friction_limits > 0.0
        points = support.points[pressing] / pairs.scaling.characteristic_length
        away = points - points.mean(axis=0)
        radius = max(_KNOWN_SIZE * float(np.sqrt(np.mean(np.sum(away**2, axis=1)))), _SMALLEST)
        limits = support.friction_limits[pressing] / support.friction_limits.sum()
        return cls(points, limits, np.full(len(points), radius)).with_loads_of(pairs)

    @property
    def speeds(self) -> Floats:
        """C_k with a contact's speed sqrt(v' C_k v), shape (k, 3, 3)."""
        x, y = self.points.T
        zeros, ones = np.zeros_like(x), np.ones_like(x)
        turning = x * x + y * y + self.radii**2
        forms = np.array([[ones, zeros, -y], [zeros, ones, x], [-y, x, turning]])
        return np.asarray(np.moveaxis(forms, -1, 0))

    @property
    def matrices(self) -> Floats:
        """B_k = m_k^2 C_k of the dissipation model that the contacts make, shape (k, 3, 3)."""
        return np.asarray(self.speeds * (self.limits**2)[:, None, None])

    def with_loads_of(self, pairs: ScaledPairs) -> SmallContacts:
        """Return them with limits so large that loads of the pairs' motions have their size."""
        products = np.einsum("kij,nj->kni", self.speeds, pairs.directions)
        speeds = np.sqrt(np.einsum("kni,ni->kn", products, pairs.directions))
        loads = np.einsum("k,kni->ni", self.limits, products / speeds[:, :, None])
        size = np.median(np.linalg.norm(pairs.wrenches, axis=1))
        ratio = float(size / np.median(np.linalg.norm(loads, axis=1)))
        return SmallContacts(self.points, ratio * self.limits, self.radii)

    def loaded(self) -> SmallContacts:
        """Return those whose friction counts."""
        return self.take(self.carrying())

    def carrying(self) -> Bools:
        """Return which contacts' friction counts, shape (k,)."""
        return np.asarray(self.limits > _NEGLIGIBLE * self.limits.max())

    def take(self, which: Bools) -> SmallContacts:
        """Return some of them."""
        return SmallContacts(self.points[which], self.limits[which], self.radii[which])

    def merged(self, count: int) -> SmallContacts:
        """Return at most `count` contacts that stand for them all; see `groups`."""
        return self.summed(self.groups(count))

    def groups(self, count: int) -> Places:
        """Return which of at most `count` groups each contact belongs to, shape (k,).

        Those become one group first that widen the least (Ward 1963,
        doi:10.1080/01621459.1963.10500845).
        """
        points, limits = self.points.copy(), self.limits.copy()
        members = np.arange(len(limits))
        kept = np.ones(len(limits), dtype=bool)
        away = points[:, None] - points
        shared = np.multiply.outer(limits, limits) / np.add.outer(limits, limits)
        widening = shared * np.einsum("ijc,ijc->ij", away, away)
        np.fill_diagonal(widening, np.inf)
        for _ in range(len(limits) - max(count, 1)):
            first, second = divmod(int(widening.argmin()), len(limits))
            both = [first, second]
            total = limits[both].sum()
            points[first] = limits[both] @ points[both] / total
            limits[first] = total
            members[members == second] = first
            kept[second] = False
            # Only what is about these two changes: a patch has a thousand contacts.
            away = points[first] - points
            row = limits[first] * limits / (limits[first] + limits) * np.sum(away**2, axis=1)
            row[~kept] = row[first] = np.inf
            widening[first], widening[:, first] = row, row
            widening[second], widening[:, second] = np.inf, np.inf
        return np.asarray(np.searchsorted(np.flatnonzero(kept), members))

    def summed(self, groups: Places) -> SmallContacts:
        """Return one contact for each group, at its centre of friction and with its moment.

        So total, centre and spread of the friction stay.
        """
        count = int(groups.max()) + 1

        def total(values: Floats) -> Floats:
            return np.asarray(np.bincount(groups, self.limits * values, count))

        limits = total(np.ones(len(groups)))
        points = np.stack([total(axis) / limits for axis in self.points.T], axis=1)
        away = self.points - points[groups]
        moments = total(self.radii**2 + np.sum(away**2, axis=1))
        return SmallContacts(points, limits, np.sqrt(moments / limits))


def _rings(count: int) -> Floats:
    """Return a centre and so many rings of 6, 12, 18 ... points around it in the unit disc."""
    points = [np.zeros((1, 2))]
    for ring in range(1, count + 1):
        angles = 2.0 * np.pi * (np.arange(6 * ring) + 0.5 * (ring % 2)) / (6 * ring)
        points.append(ring / count * np.stack([np.cos(angles), np.sin(angles)], axis=1))
    return np.concatenate(points)


class PressureObjective:
    """The cost of friction limits, over their logarithms."""

    def __init__(
        self,
        pairs: ScaledPairs,
        usual: SmallContacts,
        entropy_weight: float,
        velocity_weight: float,
        robust_scale: float | None,
    ) -> None:
        """Hold the pairs and the contacts.

        Args:
            pairs: What to fit.
            usual: Contacts with the limits n_k, all above zero.
            entropy_weight: How much the entropy counts against one push.
            velocity_weight: w of `motion_cost`.
            robust_scale: See `motion_cost`.
        """
        self._usual = usual
        self._speeds = usual.speeds
        self._entropy_weight = entropy_weight
        self._cost = MotionCost(pairs, velocity_weight, robust_scale)

    def cost_and_gradient(self, parameters: Floats) -> tuple[float, Floats]:
        """Return the cost and its gradient, shape (k,)."""
        limits = np.exp(parameters)
        cost, by_matrices = self._cost.of(self._speeds * (limits**2)[:, None, None])
        slope = 2.0 * limits * np.einsum("kij,kij->k", by_matrices, self._speeds)
        surprise = np.log(limits / self._usual.limits)
        cost += self._entropy_weight * float(
            limits @ surprise - limits.sum() + self._usual.limits.sum()
        )
        return cost, limits * (slope + self._entropy_weight * surprise)


def fit_pressure(
    pairs: ScaledPairs,
    usual: SmallContacts,
    entropy_weight: float,
    velocity_weight: float,
    robust_scale: float | None,
) -> SmallContacts:
    """Return the contacts with fitted limits; arguments as of `PressureObjective`."""
    stride = -(-len(pairs) // _MOST_PAIRS)
    objective = PressureObjective(
        pairs.every(stride), usual, entropy_weight, velocity_weight, robust_scale
    )
    start = np.log(usual.limits)
    found = minimise(objective.cost_and_gradient, start, _PRECISION, _MOST_ITERATIONS)
    return SmallContacts(usual.points, np.exp(found.parameters), usual.radii)
