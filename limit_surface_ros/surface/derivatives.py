# SPDX-License-Identifier: Apache-2.0
"""Derivatives of the maps of a surface: by the wrench, and by the twist."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_rows
from limit_surface_ros.surface.scaling import InScaledVariables, write_rows

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Bools, Floats


class Derivatives(InScaledVariables):
    """The derivatives of a surface's maps, in physical units."""

    def twist_jacobian(self, wrench: ArrayLike) -> tuple[Floats, Floats]:
        """Direction of the incipient motion, and its derivative by the wrench.

        Args:
            wrench: Shape (..., 3), (fx, fy, tau_z) in [N, N, N m], not zero.

        Returns:
            Twists as `twist_of_wrench` gives them, shape (..., 3), and Jacobians, shape
            (..., 3, 3), row i and column j the derivative of component i by wrench component j.
            Within a facet they are zero; at a kink those of what is smooth there.

        Raises:
            ShapeError: The last axis does not hold three components.
            NotFiniteError: A component is NaN or infinite.
            ZeroVectorError: A wrench is zero.
            DataError: The kind has no derivatives in closed form.

        Example:
            >>> import numpy as np
            >>> from limit_surface_ros.surface import PowerSum
            >>> twist, jacobian = PowerSum([np.eye(3)], [1.0]).twist_jacobian([2.0, 0.0, 0.0])
            >>> jacobian.round(12).tolist()
            [[0.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.5]]
        """
        _, twists, jacobians = self._twist_derivatives(wrench)
        return twists, jacobians

    def quadratic_twist(self, wrench: ArrayLike) -> tuple[Floats, Floats]:
        """Load factor times its gradient, and the derivative of that by the wrench.

        It is homogeneous of degree one. For an ellipsoid w'L w = 1 it is L w, as pusher-slider
        models write the motion of a body; for any other surface it is what stands in its place,
        and the inverse of D(v) times the load of maximum dissipation.

        Args:
            wrench: Shape (..., 3), (fx, fy, tau_z) in [N, N, N m], not zero.

        Returns:
            Twists, shape (..., 3), and symmetric Jacobians K with K w = the twist,
            shape (..., 3, 3).

        Raises:
            ShapeError: The last axis does not hold three components.
            NotFiniteError: A component is NaN or infinite.
            ZeroVectorError: A wrench is zero.
            DataError: The kind has no derivatives in closed form.
        """
        array = as_rows("wrench", wrench)
        factors, twists, jacobians = self._twist_derivatives(array)
        power = (twists * array).sum(axis=-1)
        gradients = twists * (factors / power)[..., np.newaxis]
        # g Hess g: what the unit twist's derivative is across it, made symmetric by Euler's
        # theorem, Hess g w = 0.
        unit = self.scaling.twist_unit
        length = np.sqrt((np.square(gradients / unit)).sum(axis=-1))
        across = jacobians * length[..., np.newaxis, np.newaxis]
        # What is missing along the twist follows from w' Hess g = 0.
        missing = np.einsum("...i,...ij->...j", array, across) / power[..., np.newaxis]
        hessians = across - twists[..., :, np.newaxis] * missing[..., np.newaxis, :]
        k = gradients[..., :, np.newaxis] * gradients[..., np.newaxis, :]
        k += factors[..., np.newaxis, np.newaxis] * hessians
        return gradients * factors[..., np.newaxis], 0.5 * (k + np.swapaxes(k, -1, -2))

    def wrench_jacobian(self, twist: ArrayLike) -> tuple[Floats, Floats]:
        """Load of maximum dissipation, and its derivative by the twist.

        Args:
            twist: Shape (..., 3), (vx, vy, omega_z) in [m/s, m/s, rad/s], not zero.

        Returns:
            Wrenches as `wrench_of_twist` gives them, shape (..., 3), and symmetric Jacobians,
            shape (..., 3, 3), which take the twist itself to zero.

        Raises:
            ShapeError: The last axis does not hold three components.
            NotFiniteError: A component is NaN or infinite.
            ZeroVectorError: A twist is zero.
            DataError: The kind has no derivatives in closed form.
        """
        array = as_rows("twist", twist)
        unit_in, unit_out = self.scaling.twist_unit, self.scaling.wrench_unit
        count = array.size // 3
        wrenches, jacobians = np.empty((count, 3)), np.empty((count, 3, 3))
        for block, columns, sizes in self._blocks("twist", array, unit_in):
            loads, derivatives, _ = self.shape.load_jacobians(columns)
            write_rows(loads, unit_out, wrenches[block])
            _write_jacobians(derivatives, unit_out, unit_in, sizes, jacobians[block])
        return wrenches.reshape(array.shape), jacobians.reshape(*array.shape, 3)

    def is_smooth_at(self, wrench: ArrayLike) -> Bools:
        """Whether `twist_of_wrench` has a derivative at wrenches (..., 3); shape (...)."""
        array = as_rows("wrench", wrench)
        smooth = np.empty(array.size // 3, dtype=bool)
        for block, columns, _ in self._blocks("wrench", array, self.scaling.wrench_unit):
            smooth[block] = self.shape.motion_jacobians(columns)[3]
        return smooth.reshape(array.shape[:-1])

    def _twist_derivatives(self, wrench: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """Return load factors (...), twists (..., 3) and their Jacobians (..., 3, 3)."""
        array = as_rows("wrench", wrench)
        unit_in, unit_out = self.scaling.wrench_unit, self.scaling.twist_unit
        count = array.size // 3
        factors, twists = np.empty(count), np.empty((count, 3))
        jacobians = np.empty((count, 3, 3))
        for block, columns, sizes in self._blocks("wrench", array, unit_in):
            found, motions, derivatives, _ = self.shape.motion_jacobians(columns)
            np.multiply(found, sizes, out=factors[block])
            write_rows(motions, unit_out, twists[block])
            _write_jacobians(derivatives, unit_out, unit_in, sizes, jacobians[block])
        shape = array.shape[:-1]
        return (
            factors.reshape(shape)[()],
            twists.reshape(array.shape),
            jacobians.reshape(*shape, 3, 3),
        )


def _write_jacobians(
    columns: Floats, unit_out: Floats, unit_in: Floats, sizes: Floats, out: Floats
) -> None:
    """Write scaled Jacobians (3, 3, m) at vectors of size one into (m, 3, 3), physical units."""
    columns *= np.multiply.outer(unit_out, 1.0 / unit_in)[:, :, np.newaxis]
    columns /= sizes
    out.transpose(1, 2, 0)[...] = columns
