# SPDX-License-Identifier: Apache-2.0
"""What every limit surface can do, whatever its kind.

Wrenches are (fx, fy, tau_z) in [N, N, N m], applied *to* the body, about the model's reference
point and in its frame. Twists are (vx, vy, omega_z) in [m/s, m/s, rad/s] of the body at that
point. Their dot product is power.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.scaling import Scaling


@runtime_checkable
class LimitSurface(Protocol):
    """The boundary of the convex set of wrenches that dry friction can resist."""

    @property
    def kind(self) -> str:
        """Name of the kind, as model files give it."""
        ...

    @property
    def scaling(self) -> Scaling:
        """Characteristic length [m] and friction force [N] that make the model dimensionless."""
        ...

    def load_factor(self, wrench: ArrayLike) -> Floats:
        """How far out a wrench lies: the s with wrench / s on the surface.

        Below 1 the body sticks, from 1 on it slides; 0 for a zero wrench.

        Args:
            wrench: Shape (..., 3).

        Returns:
            Shape (...).
        """
        ...

    def twist_of_wrench(self, wrench: ArrayLike) -> Floats:
        """Direction of the incipient motion: the outward normal where the wrench's ray leaves.

        Args:
            wrench: Shape (..., 3), not zero; only its direction matters.

        Returns:
            Shape (..., 3) twists of unit norm in scaled variables, that is with
            vx^2 + vy^2 + (rho omega)^2 = 1.
        """
        ...

    def twist_and_load_factor(self, wrench: ArrayLike) -> tuple[Floats, Floats]:
        """Both of the above, at the cost of one where a kind finds them together.

        Args:
            wrench: Shape (..., 3), not zero.

        Returns:
            Twists, shape (..., 3), and load factors, shape (...).
        """
        ...

    def wrench_of_twist(self, twist: ArrayLike) -> Floats:
        """Load of maximum dissipation: the wrench on the surface with the most power.

        Args:
            twist: Shape (..., 3), not zero; only its direction matters.

        Returns:
            Shape (..., 3) wrenches on the surface.
        """
        ...
