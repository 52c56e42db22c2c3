# SPDX-License-Identifier: Apache-2.0
"""Derivatives of the maps of a surface: by the wrench, and by the twist."""

from __future__ import annotations

import itertools
from abc import abstractmethod
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.checks import as_rows
from limit_surface_ros.surface.gauges import scalar_jacobians
from limit_surface_ros.surface.gauges.jacobians import (
    ENTRIES,
    direction_jacobians,
    gradients_and_hessians,
)
from limit_surface_ros.surface.scaling import InScaledVariables, write_rows

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Bools, Floats
    from limit_surface_ros.surface.gauges.gauge import Vector

# How far beside a vector its map is looked at for a rim, and by how much it then moves.
_BESIDE, _MOVED = 1e-7, 1e-10


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
        scaling = self.scaling
        one = self._one_load(wrench)
        found = None if one is None else self.shape.motion_turning_scalar(one)
        if found is not None:
            unit, derivatives = scalar_jacobians.direction_jacobian(found[1], found[2])
            jacobian = np.array(derivatives).reshape(3, 3)
            jacobian *= scaling.twist_by_wrench_unit
            return self._twist_along(unit), jacobian
        array = as_rows("wrench", wrench)
        twists, jacobians = np.empty((array.size // 3, 3)), np.empty((array.size // 3, 3, 3))
        for block, columns, sizes in self._blocks("wrench", array, scaling.wrench_unit):
            turning, _ = self.shape.motions_turning(columns)
            units, of_block = direction_jacobians(
                turning.normals, turning.matrices, sizes, scaling.twist_by_wrench_unit
            )
            write_rows(units, scaling.twist_unit, twists[block])
            jacobians[block].transpose(1, 2, 0)[...] = of_block
        return twists.reshape(array.shape), jacobians.reshape(*array.shape, 3)

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
        unit = 1.0 / self.scaling.wrench_unit
        twists, jacobians = np.empty((array.size // 3, 3)), np.empty((array.size // 3, 3, 3))
        for block, columns, sizes in self._blocks("wrench", array, self.scaling.wrench_unit):
            turning, _ = self.shape.motions_turning(columns)
            gradients, matrices = gradients_and_hessians(columns, turning)
            gradients *= sizes
            write_rows(gradients, unit, twists[block])
            _write_symmetric(matrices, np.multiply.outer(unit, unit), jacobians[block])
        return twists.reshape(array.shape), jacobians.reshape(*array.shape, 3)

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
        scaling = self.scaling
        one = self._one_motion(twist)
        found = None if one is None else self.shape.load_turning_scalar(one)
        if found is not None:
            load, (xx, xy, xz, yy, yz, zz) = found
            jacobian = np.array((xx, xy, xz, xy, yy, yz, xz, yz, zz)).reshape(3, 3)
            jacobian *= scaling.wrench_by_twist_unit
            return self._wrench_of(load), jacobian
        array = as_rows("twist", twist)
        wrenches, jacobians = np.empty((array.size // 3, 3)), np.empty((array.size // 3, 3, 3))
        for block, columns, sizes in self._blocks("twist", array, scaling.twist_unit):
            loads, matrices, _ = self.shape.loads_turning(columns)
            write_rows(loads, scaling.wrench_unit, wrenches[block])
            _write_symmetric(matrices / sizes, scaling.wrench_by_twist_unit, jacobians[block])
        return wrenches.reshape(array.shape), jacobians.reshape(*array.shape, 3)

    def is_smooth_at(self, wrench: ArrayLike) -> Bools:
        """Whether `twist_of_wrench` has a derivative at wrenches (..., 3); shape (...).

        It has none at loads in the null space of a term, and at the rims of facets, where the
        Jacobian is that of the inside.
        """
        array = as_rows("wrench", wrench)
        smooth = np.empty(array.size // 3, dtype=bool)
        for block, columns, _ in self._blocks("wrench", array, self.scaling.wrench_unit):
            turning, whole = self.shape.motions_turning(columns)
            still = ~turning.matrices.any(axis=0)
            smooth[block] = whole & ~_at_rims(self.shape.motions, columns, still & whole)
        return smooth.reshape(array.shape[:-1])

    def wrench_is_smooth_at(self, twist: ArrayLike) -> Bools:
        """Whether `wrench_of_twist` has a derivative at twists (..., 3); shape (...).

        It has none at rotations about support points, and at the rims of what stays at a corner.
        """
        array = as_rows("twist", twist)
        smooth = np.empty(array.size // 3, dtype=bool)
        for block, columns, _ in self._blocks("twist", array, self.scaling.twist_unit):
            _, matrices, whole = self.shape.loads_turning(columns)
            still = ~matrices.any(axis=0)
            smooth[block] = whole & ~_at_rims(self.shape.loads, columns, still & whole)
        return smooth.reshape(array.shape[:-1])

    @abstractmethod
    def _one_load(self, wrench: Any) -> Vector | None:
        """Return a single, plainly valid wrench in scaled variables, None for anything else."""

    @abstractmethod
    def _one_motion(self, twist: Any) -> Vector | None:
        """Return a single, plainly valid twist in scaled variables, None for anything else."""

    @abstractmethod
    def _twist_along(self, motion: Vector) -> Floats:
        """Return the twist of unit norm along a scaled motion."""

    @abstractmethod
    def _wrench_of(self, load: Vector) -> Floats:
        """Return the wrench of a scaled load."""


def _at_rims(kernel: Callable[[Floats], Floats], columns: Floats, still: Bools) -> Bools:
    """Tell where a map that stands still at some columns (3, m) does not do so beside them."""
    rims = np.zeros_like(still)
    at = np.flatnonzero(still)
    if len(at):
        here = columns.take(at, axis=1)
        answers = kernel(here)
        reach = _BESIDE * np.abs(here).max(axis=0)
        for axis, sign in itertools.product(range(3), (1.0, -1.0)):
            near = here.copy()
            near[axis] += sign * reach
            away = np.abs(kernel(near) - answers).max(axis=0)
            rims[at] |= away > _MOVED * np.abs(answers).max(axis=0)
    return rims


def _write_symmetric(six: Floats, units: Floats, out: Floats) -> None:
    """Write symmetric matrices in six rows (6, m) times their units (3, 3) into (m, 3, 3)."""
    matrices = six[ENTRIES]
    matrices *= units[:, :, np.newaxis]
    out.transpose(1, 2, 0)[...] = matrices
