# SPDX-License-Identifier: Apache-2.0
"""The shape of one ellipsoid, f'A f = 1: all maps and their derivatives are in closed form."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.surface.gauges.gauge import Turning
from limit_surface_ros.surface.gauges.jacobians import six_of
from limit_surface_ros.surface.gauges.norm_sum import NormSum
from limit_surface_ros.surface.gauges.scalar import NormSumScalar
from limit_surface_ros.surface.shape import GaugeShape
from limit_surface_ros.surface.support.power_sum_solver import Ellipsoid

if TYPE_CHECKING:
    from limit_surface_ros.checks import Bools, Floats
    from limit_surface_ros.surface.gauges.gauge import Six, Vector


class EllipsoidShape(GaugeShape):
    """The shape of |R f| = 1, which limits every load."""

    def __init__(self, root: Floats) -> None:
        """Keep R, shape (3, 3), and its inverse."""
        super().__init__(NormSum(root[np.newaxis]), NormSumScalar(root[np.newaxis]))
        form = root.T @ root
        inverse_root = np.linalg.inv(root)
        self._solver = Ellipsoid(root)
        self._form = form
        self._six = six_of(form[np.newaxis])
        self._inverse_root = inverse_root
        # B = inv(A) less B v v' B / v'B v is [v] A [v]' / (det(A) v'B v), which cancels nothing:
        # the six entries of that by those of v v'.
        a, b, c, d, e, f = (self._six[:, 0] / np.linalg.det(root) ** 2).tolist()
        self._turned: Six = (a, b, c, d, e, f)
        self._crossed = np.array(
            [
                [0.0, 0.0, 0.0, f, -2.0 * e, d],
                [0.0, -f, e, 0.0, c, -b],
                [0.0, e, -d, -c, b, 0.0],
                [f, 0.0, -2.0 * c, 0.0, 0.0, a],
                [-e, c, b, 0.0, -a, 0.0],
                [d, -2.0 * b, 0.0, a, 0.0, 0.0],
            ]
        )

    @property
    def solver(self) -> Ellipsoid:
        """Finds the loads of maximum dissipation."""
        return self._solver

    def motions_turning(self, loads: Floats) -> tuple[Turning, Bools]:
        """Return factors and motions, A f, with how these turn; see `Shape`."""
        normals = self._form.dot(loads)
        values = np.sqrt(np.einsum("im,im->m", normals, loads))
        matrices = np.broadcast_to(self._six, (6, loads.shape[1]))
        return Turning(values, normals, matrices, None), np.ones(loads.shape[1], dtype=bool)

    def loads_turning(self, motions: Floats) -> tuple[Floats, Floats, Bools]:
        """Return loads f = B v / D, D^2 = v'B v, and their derivatives; see `Shape`."""
        sphere = self._inverse_root.T.dot(motions)
        slowness = 1.0 / np.sqrt(np.einsum("im,im->m", sphere, sphere))
        sphere *= slowness
        loads = self._inverse_root.dot(sphere)
        x, y, z = motions
        matrices = self._crossed.dot(np.array([x * x, x * y, x * z, y * y, y * z, z * z]))
        slowness *= slowness * slowness
        matrices *= slowness
        return loads, matrices, np.ones(motions.shape[1], dtype=bool)

    def load_turning_scalar(self, motion: Vector) -> tuple[Vector, Six] | None:
        """Return the same for one motion; see `Shape`."""
        load = self._solver.solve_scalar(motion)
        if load is None:
            return None
        x, y, z = motion
        power = load[0] * x + load[1] * y + load[2] * z
        s = 1.0 / (power * power * power)
        a, b, c, d, e, f = self._turned
        u, v, w = s * x, s * y, s * z
        return load, (
            v * (y * f - 2.0 * z * e) + w * z * d,
            u * (z * e - y * f) + w * (y * c - z * b),
            u * (y * e - z * d) + v * (z * b - y * c),
            u * (x * f - 2.0 * z * c) + w * z * a,
            u * (y * c + z * b - x * e) - v * z * a,
            u * (x * d - 2.0 * y * b) + v * y * a,
        )
