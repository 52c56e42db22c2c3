# SPDX-License-Identifier: Apache-2.0
"""An inverse that takes few vectors one by one, in plain floats: numpy is slow with few."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.surface.gauges.one_twist import most_power_of_one

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.gauges.one_twist import OneGauge
    from limit_surface_ros.surface.support.solvers import Inverse

# Vectors up to which one after the other is the quicker way: with one peak, and with several.
_FEW, _FEW_WITH_SEVERAL = 24, 8


class OneByOne:
    """Solves few vectors in plain floats, many by another inverse."""

    def __init__(self, inverse: Inverse, gauge: OneGauge, *, several: bool = False) -> None:
        """Keep the inverse, which also solves what does not go smoothly alone.

        Args:
            inverse: Of the surface g = 1.
            gauge: g for one load.
            several: Whether a vector has several starts.
        """
        self._inverse = inverse
        self._gauge = gauge
        self._few = _FEW_WITH_SEVERAL if several else _FEW

    def solve(self, normals: Floats) -> tuple[Floats, Floats]:
        """Return the points (3, m) of most power for vectors (3, m), and that power (m,)."""
        if normals.shape[1] > self._few:
            return self._inverse.solve(normals)
        points: Floats = np.empty_like(normals)
        for column, normal in enumerate(normals.T):
            starts = self.starts_of_one(normal).tolist()
            x, y, z = normal.tolist()
            found = most_power_of_one(self._gauge, (x, y, z), starts)
            if found is None:
                points[:, [column]] = self._inverse.solve(normal[:, np.newaxis])[0]
            else:
                points[:, column] = found
        return points, (normals * points).sum(axis=0)

    def starts_of_one(self, normal: Floats) -> Floats:
        """Return points (s, 3) that lead smoothly to the answer for one vector (3,), if any do."""
        return self._inverse.starts_of_one(normal)
