# SPDX-License-Identifier: Apache-2.0
"""A body that slides: what is prepared once and used for each slide."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import DataError
from limit_surface_ros.motion.sliding.friction import NormFriction, friction_of
from limit_surface_ros.motion.sliding.inertia import Inertia
from limit_surface_ros.motion.sliding.rest import null_space

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.surface.base import LimitSurface


class SlidingBody:
    """A body on its surface, with its inertia.

    Args:
        surface: Its limit surface.
        inertia: Mass, moment of inertia and centre of mass.

    Attributes:
        surface: Its limit surface.
        inertia: Mass, moment of inertia and centre of mass.
        root: R with R'R the inertia matrix, an upper triangle, shape (3, 3).
        friction: Under the body.
        creases: Terms that may rest while the body moves, each with the largest |R_k q| of a
            twist of unit energy norm.
        largest: About the largest dissipation of such a twist [W].

    Raises:
        TypeError: The inertia is not an `Inertia`.
        DataError: A motion that nothing resists would never end.
    """

    def __init__(self, surface: LimitSurface, inertia: Inertia) -> None:
        """Prepare friction and inertia."""
        if not isinstance(inertia, Inertia):
            raise TypeError(
                f"inertia must be an Inertia(mass, moment), got {type(inertia).__name__}"
            )
        self.surface, self.inertia = surface, inertia
        self.friction = friction_of(surface)
        self.root = np.linalg.cholesky(inertia.matrix).T
        self.creases: list[tuple[int, float]] = []
        if isinstance(self.friction, NormFriction):
            roots = self.friction.roots / surface.scaling.friction_force
            free = null_space((roots * surface.scaling.twist_unit).reshape(-1, 3))
            if free.shape[1]:
                motion = (free[:, 0] * surface.scaling.twist_unit).round(9).tolist()
                raise DataError(
                    f"nothing resists the motion (vx, vy, omega) along {motion}: a body that "
                    "slides so never comes to rest"
                )
            sizes = np.linalg.norm(
                self.friction.roots @ np.linalg.inv(self.root), 2, axis=(1, 2)
            ).tolist()
            self.creases = [
                (term, sizes[term]) for term in np.flatnonzero(self.friction.ranks < 3).tolist()
            ]
        self.largest = self.friction.largest(self.root)

    def energy_norm(self, twist: ArrayLike) -> float:
        """Return sqrt(q'Mq) of a twist q."""
        return float(np.linalg.norm(self.root @ twist))
