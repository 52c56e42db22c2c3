# SPDX-License-Identifier: Apache-2.0
"""What a smooth dissipation model costs at recorded pushes, and how that changes with it.

    J = sum_k m_k (log(s_k)^2 + w rho(|v_k - v^_k|))

s_k is the load factor of f_k and v^_k the unit motion of it. The load factor's logarithm fixes
the scale; it goes to infinity when the surface shrinks to nothing or grows without bound. The
motion is found by `smooth_inverse`; its change with the model follows from the condition that D be
least, so that the gradient costs no more than a Newton step: with u from the adjoint,

    dJ/dB_i = sum_k dJ/dD v v' / (2 s_i) + u v' / s_i - (u' B_i v) v v' / (2 s_i^3).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.fitting.direction_loss import direction_loss
from limit_surface_ros.fitting.smooth_inverse import SmoothInverse

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.fitting.pairs import ScaledPairs


class MotionCost:
    """The error of motion and of load factor at the pairs' loads."""

    def __init__(
        self, pairs: ScaledPairs, velocity_weight: float, robust_scale: float | None
    ) -> None:
        """Hold the pairs and the planes of their loads.

        Args:
            pairs: What to fit.
            velocity_weight: w.
            robust_scale: See `direction_loss`.
        """
        self._weights = pairs.weights
        self._velocity_weight = velocity_weight
        self._robust_scale = robust_scale
        self._directions = np.ascontiguousarray(pairs.directions.T)
        self._inverse = SmoothInverse(np.ascontiguousarray(pairs.wrenches.T))

    def of(self, matrices: Floats) -> tuple[float, Floats]:
        """Return the cost of a model, and its gradient by the model's matrices.

        Args:
            matrices: B_i, positive definite, shape (k, 3, 3).

        Returns:
            J, and G with dJ = sum G_ij dB_ij, shape (k, 3, 3), not symmetric.
        """
        inverse, weights = self._inverse, self._weights
        inverse.solve(matrices)
        motions, speeds = inverse.motions, inverse.speeds
        norms = np.sqrt(np.einsum("cn,cn->n", motions, motions))
        units = motions / norms
        cosines = np.einsum("cn,cn->n", units, self._directions)
        loss, slope = direction_loss(cosines, self._robust_scale)
        log_factors = -np.log(inverse.dissipation)
        cost = weights @ (log_factors**2 + self._velocity_weight * loss)
        slope *= self._velocity_weight * weights / norms
        pull = inverse.adjoint(slope * (self._directions - cosines * units))
        products = (matrices.reshape(-1, 3) @ motions).reshape(-1, 3, motions.shape[1])
        along = np.einsum("kcn,cn->kn", products, pull)
        bends = (-weights * log_factors / inverse.dissipation - 0.5 * along / speeds**2) / speeds
        weighted = bends[:, None] * motions + pull / speeds[:, None]
        gradient = weighted.reshape(-1, motions.shape[1]) @ motions.T
        return float(cost), gradient.reshape(-1, 3, 3)
