# SPDX-License-Identifier: Apache-2.0
"""Pairs of a wrench and the twist that it causes: what surfaces are fitted to and judged by."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_directions, as_floats
from limit_surface_ros.errors import RangeError, ShapeError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats


@dataclass(frozen=True)
class Pairs:
    """Loads on a limit surface and the motions they cause, in physical units.

    Attributes:
        wrenches: Shape (n, 3), (fx, fy, tau_z) in [N, N, N m].
        twists: Shape (n, 3), (vx, vy, omega_z) in [m/s, m/s, rad/s]; only directions matter.
        weights: How much each pair counts in a fit, shape (n,); 1 each if not given. Errors count
            pairs alike.

    Raises:
        ShapeError: The two do not hold the same number of rows of three, or the weights another.
        NotFiniteError: A component or a weight is NaN or infinite.
        ZeroVectorError: A wrench or a twist is zero.
        RangeError: A weight is not above zero.
    """

    wrenches: Floats
    twists: Floats
    weights: Floats = field(default_factory=lambda: np.empty(0))

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
        weights = as_floats("weights", self.weights)
        if not weights.size:
            weights = np.ones(len(wrenches))
        if weights.shape != (len(wrenches),):
            raise ShapeError(f"weights must have shape ({len(wrenches)},), got {weights.shape}")
        if not (weights > 0.0).all():
            raise RangeError(f"weights must be above 0, got {weights.min():g}")
        object.__setattr__(self, "weights", weights)

    def take(self, rows: ArrayLike) -> Pairs:
        """Return the pairs of some rows, given by their numbers or by a mask, with their weights.

        Raises:
            IndexError: There is no such row.
        """
        chosen = np.asarray(rows)
        return Pairs(self.wrenches[chosen], self.twists[chosen], self.weights[chosen])

    def __len__(self) -> int:
        """Return the number of pairs."""
        return len(self.wrenches)
