# SPDX-License-Identifier: Apache-2.0
"""Where a body presses on the ground, from recorded pushes: friction limits of many contacts.

    J = (motion_cost) + strength sum_k (m_k log(m_k / n_k) - m_k + n_k)

The contacts stay where they are and only their friction limits m_k are fitted, as logarithms, so
that none is negative. Of the many pressures that a few pushes allow, the relative entropy to the
usual limits n_k takes the one that assumes the least (Jaynes 1957,
doi:10.1103/PhysRev.106.620). There is one start, the usual limits, and no chance in it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.fitting.bfgs import minimise
from limit_surface_ros.fitting.few_pushes.small_contacts import SmallContacts
from limit_surface_ros.fitting.motion_cost import MotionCost

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.fitting.pairs import ScaledPairs

# Noisy pushes do not tell closer pressures apart.
_PRECISION = 1e-3
_MOST_ITERATIONS = 200
# Pairs that show where a body stands; more only cost time.
_MOST_PAIRS = 200


class PressureObjective:
    """The cost of friction limits, over their logarithms."""

    def __init__(
        self,
        pairs: ScaledPairs,
        usual: SmallContacts,
        strength: float,
        velocity_weight: float,
        robust_scale: float | None,
    ) -> None:
        """Hold the pairs and the contacts.

        Args:
            pairs: What to fit.
            usual: Contacts with the limits n_k, all above zero.
            strength: How much the entropy counts against one push.
            velocity_weight: w of `motion_cost`.
            robust_scale: See `direction_loss`.
        """
        self._usual = usual
        self._speeds = usual.speeds
        self._strength = strength
        self._cost = MotionCost(pairs, velocity_weight, robust_scale)

    def cost_and_gradient(self, parameters: Floats) -> tuple[float, Floats]:
        """Return the cost and its gradient, shape (k,)."""
        limits = np.exp(parameters)
        cost, by_matrices = self._cost.of(self._speeds * (limits**2)[:, None, None])
        slope = 2.0 * limits * np.einsum("kij,kij->k", by_matrices, self._speeds)
        surprise = np.log(limits / self._usual.limits)
        cost += self._strength * float(limits @ surprise - limits.sum() + self._usual.limits.sum())
        return cost, limits * (slope + self._strength * surprise)


def fit_pressure(
    pairs: ScaledPairs,
    usual: SmallContacts,
    strength: float,
    velocity_weight: float,
    robust_scale: float | None,
) -> SmallContacts:
    """Return the contacts with fitted limits; arguments as of `PressureObjective`."""
    stride = -(-len(pairs) // _MOST_PAIRS)
    objective = PressureObjective(
        pairs.every(stride), usual, strength, velocity_weight, robust_scale
    )
    start = np.log(usual.limits)
    found = minimise(objective.cost_and_gradient, start, _PRECISION, _MOST_ITERATIONS)
    return SmallContacts(usual.points, np.exp(found.parameters), usual.radii)
