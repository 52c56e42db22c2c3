# SPDX-License-Identifier: Apache-2.0
"""Pairs of a wrench and the twist that it causes: what surfaces are fitted to and judged by."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from limit_surface_ros.checks import as_directions
from limit_surface_ros.errors import ShapeError

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats


@dataclass(frozen=True)
class Pairs:
    """Loads on a limit surface and the motions they cause, in physical units.

    Attributes:
        wrenches: Shape (n, 3), (fx, fy, tau_z) in [N, N, N m].
        twists: Shape (n, 3), (vx, vy, omega_z) in [m/s, m/s, rad/s]; only directions matter.

    Raises:
        ShapeError: The two do not hold the same number of rows of three.
        NotFiniteError: A component is NaN or infinite.
        ZeroVectorError: A wrench or a twist is zero.
    """

    wrenches: Floats
    twists: Floats

    def __post_init__(self) -> None:
        """Check both arrays and that they belong together."""
        wrenches = as_directions("wrench", self.wrenches)
        twists = as_directions("twist", self.twists)
        if wrenches.ndim != 2 or wrenches.shape != twists.shape:
            raise ShapeError(
                f"pairs need wrenches and twists of one shape (n, 3), "
                f"got {wrenches.shape} and {twists.shape}"
            )
        object.__setattr__(self, "wrenches", wrenches)
        object.__setattr__(self, "twists", twists)

    def __len__(self) -> int:
        """Return the number of pairs."""
        return len(self.wrenches)
