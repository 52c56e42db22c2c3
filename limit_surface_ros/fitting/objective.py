# SPDX-License-Identifier: Apache-2.0
"""What a fit minimises: an objective builds the problem, `multi_start` solves it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    import numpy as np

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.protocol import LimitSurface


class Objective(Protocol):
    """A cost with its gradient over free parameters, and the surface that they stand for.

    Objectives are picklable, so that starts can run in other processes. They may hold work
    arrays: one objective serves one thread at a time.
    """

    @property
    def size(self) -> int:
        """Number of parameters."""
        ...

    def cost_and_gradient(self, parameters: Floats) -> tuple[float, Floats]:
        """Return the cost and its gradient, shape (size,)."""
        ...

    def start(self, rng: np.random.Generator) -> Floats:
        """Return random parameters from which a descent may begin, shape (size,)."""
        ...

    def start_near(self, parameters: Floats, rng: np.random.Generator) -> Floats:
        """Return a start for which one or two terms of `parameters` are changed, shape (size,)."""
        ...

    def coarse(self) -> Objective | None:
        """Return the same problem on a part of the pairs, None where they are few anyway.

        Its cost approximates the whole one, so that the curvature found on it holds.
        """
        ...

    def surface(self, parameters: Floats) -> LimitSurface:
        """Return the surface of `parameters`."""
        ...
