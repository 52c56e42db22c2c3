# SPDX-License-Identifier: Apache-2.0
"""Implicit steps, for motions that are stiff: near rest under a load that creeps past friction.

This module alone of `sliding` imports scipy.integrate, and is imported when it is needed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scipy.integrate import LSODA

from limit_surface_ros.errors import SolverError
from limit_surface_ros.motion.sliding.dormand_prince import DormandPrince

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.motion.sliding.dormand_prince import Slope

_RELATIVE = 1e-12


class Implicit(DormandPrince):
    """The same as `DormandPrince`, by the multistep methods of LSODA."""

    def __init__(self, function: Slope, y: Sequence[float], scale: Sequence[float]) -> None:
        """Begin at a place."""
        super().__init__(function, y, scale)
        self._solver = LSODA(
            lambda _, place: function(place.tolist()),
            0.0,
            self.y,
            1e300,
            rtol=_RELATIVE,
            atol=list(scale),
        )

    @property
    def stiff(self) -> bool:
        """Never: implicit steps are not held back."""
        return False

    def step(self) -> None:
        """Advance by one step.

        Raises:
            SolverError: No step is small enough.
        """
        message = self._solver.step()
        if self._solver.status == "failed":
            raise SolverError(f"the integration of a slide failed: {message}")
        self._start = self._solver.t_old
        self.width = self._solver.t - self._start
        self._set(self._solver.y.tolist())

    def redo(self, width: float) -> None:
        """Go back to a part of the last step; no step may follow."""
        self._set(self._solver.dense_output()(self._start + width).tolist())

    def _set(self, y: list[float]) -> None:
        self.y = y
        self.slope = self._function(y)
        self.evaluations = self._solver.nfev
