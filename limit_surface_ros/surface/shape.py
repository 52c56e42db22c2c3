# SPDX-License-Identifier: Apache-2.0
"""Limit surfaces without their units: what surfaces that differ in weight alone have in common.

All vectors here are in scaled variables, load = wrench / (F0, F0, F0 rho) and motion =
twist * (1, 1, rho). Columns are arrays of shape (3, m), contiguous by component.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import DataError
from limit_surface_ros.surface.gauges.gauge import Turning
from limit_surface_ros.surface.gauges.jacobians import of_support
from limit_surface_ros.surface.gauges.scalar_jacobians import moved_point, support_hessian
from limit_surface_ros.surface.linalg import of_unit_length

if TYPE_CHECKING:
    from limit_surface_ros.checks import Bools, Floats
    from limit_surface_ros.surface.gauges.gauge import Gauge, ScalarGauge, Six, Vector
    from limit_surface_ros.surface.support.solvers import SupportSolver


_STILL = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Shape(ABC):
    """The three maps of a surface on scaled columns, with what they need: solvers and tables.

    The first three are what a kind must give; the rest makes it quicker. What the scalar maps do
    not take, for which they return None, goes to the maps of columns.
    """

    @abstractmethod
    def load_factors(self, loads: Floats) -> Floats:
        """Return the load factors (m,) of loads (3, m); 0 for a zero column."""

    @abstractmethod
    def motions(self, loads: Floats) -> Floats:
        """Return unit motions (3, m), outward normals where the rays of loads (3, m) leave.

        Args:
            loads: None is zero, and each is of size about one.
        """

    @abstractmethod
    def loads(self, motions: Floats) -> Floats:
        """Return the loads (3, m) on the surface with the most power for motions (3, m).

        Args:
            motions: None is zero, and each is of size about one.
        """

    def motions_and_load_factors(self, loads: Floats) -> tuple[Floats, Floats]:
        """Return what `motions` and `load_factors` do for loads of which none is zero."""
        return self.motions(loads), self.load_factors(loads)

    def load_factor_scalar(self, load: Vector) -> float | None:
        """Return the load factor of one load that is not zero."""
        found = self.load_factor_and_motion_scalar(load)
        return None if found is None else found[0]

    def load_factor_and_motion_scalar(self, _load: Vector) -> tuple[float, Vector] | None:
        """Return the load factor of one load that is not zero, and its motion, of any length."""
        return None

    def load_scalar(self, _motion: Vector) -> Vector | None:
        """Return the load on the surface with the most power for one motion, not zero."""
        return None

    def motions_turning(self, loads: Floats) -> tuple[Turning, Bools]:
        """Return load factors and motions, of any length, with how these turn with the loads.

        Args:
            loads: None is zero, and each is of size about one, shape (3, m).

        Returns:
            These, and whether the map has a derivative at each load (m,); where it has none the
            matrices are those of what is smooth there.

        Raises:
            DataError: The kind has no derivatives in closed form.
        """
        raise DataError("this kind of surface has no derivatives in closed form")

    def loads_turning(self, motions: Floats) -> tuple[Floats, Floats, Bools]:
        """Return the loads of maximum dissipation, their derivatives (6, m), and where smooth.

        Args:
            motions: None is zero, and each is of size about one, shape (3, m).

        Raises:
            DataError: The kind has no derivatives in closed form.
        """
        raise DataError("this kind of surface has no derivatives in closed form")

    def motion_turning_scalar(self, _load: Vector) -> tuple[float, Vector, Six] | None:
        """Return what `motions_turning` does for one load where the map is smooth."""
        return None

    def load_turning_scalar(self, _motion: Vector) -> tuple[Vector, Six] | None:
        """Return what `loads_turning` does for one motion where the map is smooth."""
        return None

    def expect(self, _count: float) -> None:  # noqa: B027, most shapes have nothing to make
        """Make now what pays if so many vectors come at once; see `support.tabulated`."""

    @property
    def gauge(self) -> Gauge | None:
        """The load factor with its first two derivatives, if they are known in closed form."""
        return None

    @property
    def columns_at_once(self) -> int:
        """Columns per block: a few dozen arrays of this length stay in the processor's cache."""
        return 10240


class GaugeShape(Shape):
    """A shape whose load factor is in closed form; loads of maximum dissipation are searched for.

    Args:
        gauge: The load factor.
        scalar: The same for one load.
    """

    def __init__(self, gauge: Gauge, scalar: ScalarGauge) -> None:
        """Keep the two."""
        self._gauge = gauge
        self._scalar = scalar

    @property
    @abstractmethod
    def solver(self) -> SupportSolver:
        """Finds the loads of maximum dissipation."""

    @property
    def gauge(self) -> Gauge:
        """The load factor with its first two derivatives."""
        return self._gauge

    def load_factors(self, loads: Floats) -> Floats:
        """Return load factors; see `Shape`."""
        return self._gauge.values(loads)

    def motions(self, loads: Floats) -> Floats:
        """Return unit motions; see `Shape`."""
        return self.motions_and_load_factors(loads)[0]

    def motions_and_load_factors(self, loads: Floats) -> tuple[Floats, Floats]:
        """Return unit motions and load factors; see `Shape`."""
        factors, normals = self._gauge.values_and_normals(loads)
        return of_unit_length(normals), factors

    def loads(self, motions: Floats) -> Floats:
        """Return the loads of maximum dissipation; see `Shape`."""
        return self.solver.solve(motions)[0]

    def motions_turning(self, loads: Floats) -> tuple[Turning, Bools]:
        """Return factors and motions with how these turn; see `Shape`."""
        turning = self._gauge.turning(loads)
        return turning, _is_smooth(turning)

    def loads_turning(self, motions: Floats) -> tuple[Floats, Floats, Bools]:
        """Return loads and their derivatives; see `Shape`."""
        return of_support(motions, self.loads(motions), self._gauge)

    def motion_turning_scalar(self, load: Vector) -> tuple[float, Vector, Six] | None:
        """Return the same for one load; see `Shape`."""
        return self._scalar.turning(load)

    def load_turning_scalar(self, motion: Vector) -> tuple[Vector, Six] | None:
        """Return the same for one motion; see `Shape`."""
        load = self.load_scalar(motion)
        return None if load is None else _of_support_scalar(self._scalar, motion, load)

    def load_factor_scalar(self, load: Vector) -> float | None:
        """Return the load factor of one load; see `Shape`."""
        return self._scalar.value(load)

    def load_factor_and_motion_scalar(self, load: Vector) -> tuple[float, Vector] | None:
        """Return load factor and motion of one load; see `Shape`."""
        return self._scalar.value_and_normal(load)

    def load_scalar(self, motion: Vector) -> Vector | None:
        """Return the load of maximum dissipation for one motion; see `Shape`."""
        return self.solver.solve_scalar(motion)

    def expect(self, count: float) -> None:
        """Make what pays if so many vectors come at once; see `Shape`."""
        self.solver.expect(count)


class DissipationShape(Shape):
    """A shape whose dissipation is in closed form; the motions of loads are searched for.

    The load of maximum dissipation is the gradient of D; at a kink, where the motion belongs to a
    facet, it is the facet's centre.

    Args:
        dissipation: D, the support function of the set of loads, as a gauge of motions.
        scalar: The same for one motion, if plain floats are quicker.
    """

    def __init__(self, dissipation: Gauge, scalar: ScalarGauge | None) -> None:
        """Keep the two."""
        self.dissipation = dissipation
        self._scalar = scalar

    @property
    @abstractmethod
    def solver(self) -> SupportSolver:
        """Finds the motions of D = 1 with the most power: that power is the load factor."""

    def loads(self, motions: Floats) -> Floats:
        """Return the loads of maximum dissipation; see `Shape`."""
        return self.dissipation.values_and_normals(motions)[1]

    def load_scalar(self, motion: Vector) -> Vector | None:
        """Return the load of maximum dissipation for one motion; see `Shape`."""
        found = None if self._scalar is None else self._scalar.value_and_normal(motion)
        return None if found is None else found[1]

    def motions(self, loads: Floats) -> Floats:
        """Return unit motions; see `Shape`."""
        return of_unit_length(self.solver.solve(loads)[0])

    def motions_and_load_factors(self, loads: Floats) -> tuple[Floats, Floats]:
        """Return unit motions and load factors; see `Shape`."""
        motions, factors = self.solver.solve(loads)
        return of_unit_length(motions), factors

    def load_factors(self, loads: Floats) -> Floats:
        """Return load factors; see `Shape`."""
        some = loads.any(axis=0)
        if some.all():
            return self.solver.solve(loads)[1]
        factors: Floats = some.astype(float)
        if some.any():
            factors[some] = self.solver.solve(loads[:, some])[1]
        return factors

    def load_factor_and_motion_scalar(self, load: Vector) -> tuple[float, Vector] | None:
        """Return load factor and motion of one load; see `Shape`."""
        motion = self.solver.solve_scalar(load)
        if motion is None:
            return None
        power = motion[0] * load[0] + motion[1] * load[1] + motion[2] * load[2]
        return power, motion

    def motions_turning(self, loads: Floats) -> tuple[Turning, Bools]:
        """Return factors and motions with how these turn; see `Shape`."""
        motions, factors = self.solver.solve(loads)
        free = ~(factors < np.inf)
        if free.any():
            # Nothing resists these motions, and they are the same for all loads nearby.
            return self._turning_of_free(loads, motions, factors, free)
        motions, matrices, whole = of_support(loads, motions, self.dissipation)
        factors = np.einsum("im,im->m", loads, motions)
        return Turning(factors, motions, matrices, None), whole

    def _turning_of_free(
        self, loads: Floats, motions: Floats, factors: Floats, free: Bools
    ) -> tuple[Turning, Bools]:
        matrices: Floats = np.zeros((6, loads.shape[1]))
        smooth = free.copy()
        held = np.flatnonzero(~free)
        if len(held):
            found, smooth[held] = self.motions_turning(loads.take(held, axis=1))
            matrices[:, held] = found.matrices
        return Turning(factors, motions, matrices, None), smooth

    def loads_turning(self, motions: Floats) -> tuple[Floats, Floats, Bools]:
        """Return loads and their derivatives; see `Shape`."""
        turning = self.dissipation.turning(motions)
        return turning.normals, turning.matrices, _is_smooth(turning)

    def motion_turning_scalar(self, load: Vector) -> tuple[float, Vector, Six] | None:
        """Return the same for one load; see `Shape`."""
        found = self.load_factor_and_motion_scalar(load)
        if found is None or self._scalar is None:
            return None
        turning = _of_support_scalar(self._scalar, load, found[1])
        return None if turning is None else (found[0], *turning)

    def load_turning_scalar(self, motion: Vector) -> tuple[Vector, Six] | None:
        """Return the same for one motion; see `Shape`."""
        found = None if self._scalar is None else self._scalar.turning(motion)
        return None if found is None else found[1:]

    def expect(self, count: float) -> None:
        """Make what pays if so many vectors come at once; see `Shape`."""
        self.solver.expect(count)


def _is_smooth(turning: Turning) -> Bools:
    """Tell at which points no term has a kink, shape (m,)."""
    if turning.kinks is None:
        return np.ones(len(turning.values), dtype=bool)
    return np.asarray(~turning.kinks.any(axis=0))


def _of_support_scalar(
    gauge: ScalarGauge, normal: Vector, point: Vector
) -> tuple[Vector, Six] | None:
    """Return what `of_support` does for one normal, None if it needs care."""
    found = gauge.turning(point)
    if found is None:
        return (point, _STILL) if gauge.is_vertex(point) else None
    matrix = support_hessian(normal, point, found[1], found[2])
    moved = None if matrix is None else moved_point(normal, point, found[1], matrix)
    if moved is None:
        return None if matrix is None else (point, matrix)
    found = gauge.turning(moved)
    if found is None:
        return None
    x, y, z = moved
    point = (x / found[0], y / found[0], z / found[0])
    matrix = support_hessian(normal, point, found[1], found[2])
    return None if matrix is None else (point, matrix)
