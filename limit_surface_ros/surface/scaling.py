# SPDX-License-Identifier: Apache-2.0
"""Scaled variables: wrench / (F0, F0, F0 rho) and twist * (1, 1, rho).

In them forces and moments, and translations and rotations, weigh alike; directions are unit
vectors and angles between motions are measured in them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_positive

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats


@dataclass(frozen=True)
class Scaling:
    """Units in which a model is dimensionless.

    Attributes:
        characteristic_length: rho [m].
        friction_force: F0 [N].

    Raises:
        RangeError: A scale is not a finite number above zero.
    """

    characteristic_length: float = 1.0
    friction_force: float = 1.0

    def __post_init__(self) -> None:
        """Check the two scales."""
        rho = as_positive("characteristic_length", self.characteristic_length)
        force = as_positive("friction_force", self.friction_force)
        object.__setattr__(self, "characteristic_length", rho)
        object.__setattr__(self, "friction_force", force)

    @cached_property
    def wrench_unit(self) -> Floats:
        """(F0, F0, F0 rho) in [N, N, N m], shape (3,)."""
        force = self.friction_force
        return np.array([force, force, force * self.characteristic_length])

    @cached_property
    def twist_unit(self) -> Floats:
        """(1, 1, 1 / rho) in [m/s, m/s, rad/s], shape (3,)."""
        return np.array([1.0, 1.0, 1.0 / self.characteristic_length])
