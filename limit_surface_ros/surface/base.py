# SPDX-License-Identifier: Apache-2.0
"""What all kinds of surface share: validation, scaled variables, one vector or many.

Wrenches are (fx, fy, tau_z) in [N, N, N m], applied *to* the body, about the model's reference
point and in its frame. Twists are (vx, vy, omega_z) in [m/s, m/s, rad/s] of the body at that
point. Their dot product is power.

A kind implements its three maps on *scaled columns*: arrays of shape (3, m), contiguous by
component, each column of size about one. This base takes what callers pass, of shape (..., 3) in
physical units, to such columns in blocks that fit the processor's cache, and back.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import fields
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

import numpy as np

from limit_surface_ros.checks import (
    as_directions,
    as_positive,
    as_rows,
    as_vectors,
    one_direction,
)
from limit_surface_ros.runtime import keep_scratch

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.gauges.one_load import Vector
    from limit_surface_ros.surface.scaling import Scaling

Self = TypeVar("Self", bound="LimitSurface")


class LimitSurface(ABC):
    """The boundary of the convex set of wrenches that dry friction can resist.

    Attributes:
        kind: Name of the kind, as model files give it.
        scaling: Characteristic length [m] and friction force [N] that make it dimensionless.
    """

    kind: ClassVar[str]
    scaling: Scaling
    # Every kind is a dataclass.
    __dataclass_fields__: ClassVar[dict[str, Any]]

    def __getstate__(self) -> dict[str, Any]:
        """Return what defines the surface: tables made on the way stay out of pickles."""
        return {each.name: self.__dict__[each.name] for each in fields(self)}

    @abstractmethod
    def with_friction_force(self: Self, friction_force: float) -> Self:
        """Return the same body under another weight.

        Args:
            friction_force: The new friction force scale F0 [N]; every limit grows with it.

        Raises:
            RangeError: The force is not a finite number above zero.
        """

    @abstractmethod
    def _load_factors(self, loads: Floats) -> Floats:
        """Map scaled loads (3, m) to load factors (m,); 0 for a zero column."""

    @abstractmethod
    def _twists(self, loads: Floats) -> Floats:
        """Map scaled loads (3, m), none zero, to unit scaled twists (3, m)."""

    @abstractmethod
    def _loads(self, twists: Floats) -> Floats:
        """Map scaled twists (3, m), none zero, to scaled loads (3, m) on the surface."""

    def _twists_and_load_factors(self, loads: Floats) -> tuple[Floats, Floats]:
        """Map scaled loads (3, m), none zero, to unit scaled twists (3, m) and factors (m,)."""
        return self._twists(loads), self._load_factors(loads)

    def _load_factor_of_one(self, _wrench: Vector) -> float | None:
        """Map one wrench in physical units; None leaves it to the map of many."""
        return None

    def _twist_of_one(self, _wrench: Vector) -> Vector | None:
        """Map one wrench to a twist, both in physical units; None leaves it to the map of many."""
        return None

    def _twist_and_load_factor_of_one(self, wrench: Vector) -> tuple[Vector, float] | None:
        """Map one wrench to both, in physical units; None leaves it to the map of many."""
        twist, factor = self._twist_of_one(wrench), self._load_factor_of_one(wrench)
        return None if twist is None or factor is None else (twist, factor)

    def _wrench_of_one(self, _twist: Vector) -> Vector | None:
        """Map one twist to a wrench, both in physical units; None leaves it to the map of many."""
        return None

    @property
    def _block_columns(self) -> int:
        """Columns per block: a few dozen arrays of this length stay in the processor's cache."""
        return 10240

    def scaled(self: Self, factor: float) -> Self:
        """Return the surface with every wrench on it multiplied by `factor`.

        The load factor of a wrench becomes 1 / factor times what it was, the twists stay.

        Raises:
            RangeError: The factor is not a finite number above zero.
        """
        factor = as_positive("factor", factor)
        return self.with_friction_force(self.scaling.friction_force * factor)

    def load_factor(self, wrench: ArrayLike) -> Floats:
        """How far out a wrench lies: the s with wrench / s on the surface.

        Below 1 the body sticks, from 1 on it slides; 0 for a zero wrench.

        Args:
            wrench: Shape (..., 3), (fx, fy, tau_z) in [N, N, N m].

        Returns:
            Shape (...).

        Raises:
            ShapeError: The last axis does not hold three components.
            NotFiniteError: A component is NaN or infinite.
        """
        one = one_direction(wrench)
        if one is not None:
            factor = self._load_factor_of_one(one)
            if factor is not None:
                scalar: Floats = np.float64(factor)
                return scalar
        array = as_rows("wrench", wrench)
        factors = np.empty(array.size // 3)
        unit = self.scaling.wrench_unit
        for block, columns, sizes in self._blocks("wrench", array, unit, zeros=True):
            np.multiply(self._load_factors(columns), sizes, out=factors[block])
        return factors.reshape(array.shape[:-1])[()]

    def twist_of_wrench(self, wrench: ArrayLike) -> Floats:
        """Direction of the incipient motion: the outward normal where the wrench's ray leaves.

        Args:
            wrench: Shape (..., 3), (fx, fy, tau_z) in [N, N, N m], not zero; only its direction
                matters.

        Returns:
            Shape (..., 3) twists (vx, vy, omega_z) of unit norm in scaled variables.

        Raises:
            ShapeError: The last axis does not hold three components.
            NotFiniteError: A component is NaN or infinite.
            ZeroVectorError: A wrench is zero.
        """
        one = one_direction(wrench)
        if one is not None:
            twist = self._twist_of_one(one)
            if twist is not None:
                return np.array(twist)
        unit_in, unit_out = self.scaling.wrench_unit, self.scaling.twist_unit
        return self._mapped("wrench", wrench, unit_in, self._twists, unit_out)

    def twist_and_load_factor(self, wrench: ArrayLike) -> tuple[Floats, Floats]:
        """Direction of the incipient motion and load factor, for less than both cost apart.

        Args:
            wrench: Shape (..., 3), (fx, fy, tau_z) in [N, N, N m], not zero.

        Returns:
            Twists as `twist_of_wrench` gives them, shape (..., 3), and load factors, shape (...).

        Raises:
            ShapeError: The last axis does not hold three components.
            NotFiniteError: A component is NaN or infinite.
            ZeroVectorError: A wrench is zero.
        """
        one = one_direction(wrench)
        if one is not None:
            found = self._twist_and_load_factor_of_one(one)
            if found is not None:
                return np.array(found[0]), np.float64(found[1])
        array = as_rows("wrench", wrench)
        twists, factors = np.empty((array.size // 3, 3)), np.empty(array.size // 3)
        for block, columns, sizes in self._blocks("wrench", array, self.scaling.wrench_unit):
            scaled_twists, scaled_factors = self._twists_and_load_factors(columns)
            np.multiply(scaled_factors, sizes, out=factors[block])
            _write(scaled_twists, self.scaling.twist_unit, twists[block])
        return twists.reshape(array.shape), factors.reshape(array.shape[:-1])[()]

    def wrench_of_twist(self, twist: ArrayLike) -> Floats:
        """Load of maximum dissipation: the wrench on the surface with the most power.

        Args:
            twist: Shape (..., 3), (vx, vy, omega_z) in [m/s, m/s, rad/s], not zero; only its
                direction matters.

        Returns:
            Shape (..., 3) wrenches (fx, fy, tau_z) on the surface, in [N, N, N m].

        Raises:
            ShapeError: The last axis does not hold three components.
            NotFiniteError: A component is NaN or infinite.
            ZeroVectorError: A twist is zero.
        """
        one = one_direction(twist)
        if one is not None:
            wrench = self._wrench_of_one(one)
            if wrench is not None:
                return np.array(wrench)
        unit_in, unit_out = self.scaling.twist_unit, self.scaling.wrench_unit
        return self._mapped("twist", twist, unit_in, self._loads, unit_out)

    def _mapped(
        self,
        name: str,
        vectors: ArrayLike,
        unit_in: Floats,
        kernel: Callable[[Floats], Floats],
        unit_out: Floats,
    ) -> Floats:
        """Map vectors (..., 3) through a kernel on scaled columns."""
        array = as_rows(name, vectors)
        result = np.empty((array.size // 3, 3))
        for block, columns, _ in self._blocks(name, array, unit_in):
            _write(kernel(columns), unit_out, result[block])
        return result.reshape(array.shape)

    def _blocks(
        self, name: str, array: Floats, unit: Floats, *, zeros: bool = False
    ) -> Iterator[tuple[slice, Floats, Floats]]:
        """Yield blocks of vectors (..., 3): a slice, scaled columns of size one, and their sizes.

        The size is taken out first, so that no load overflows or vanishes on the way. It also
        tells, for less than a look at each number costs, whether all is well with a vector.
        """
        rows = array.reshape(-1, 3)
        count = self._block_columns
        keep_scratch(len(rows))
        for start in range(0, len(rows), count):
            block = slice(start, start + count)
            columns = rows[block].T.copy()
            sizes = np.maximum.reduce(np.abs(columns))
            # NaN fails the comparison.
            if np.count_nonzero(sizes) < len(sizes) or not np.maximum.reduce(sizes) < np.inf:
                (as_vectors if zeros else as_directions)(name, array)
                sizes[sizes == 0.0] = 1.0
            columns /= sizes
            columns /= unit[:, np.newaxis]
            yield block, columns, sizes


def _write(columns: Floats, unit: Floats, rows: Floats) -> None:
    """Write scaled columns (3, m) into rows (m, 3), in physical units."""
    # Along the columns: numpy is slow along rows of three.
    np.multiply(columns, unit[:, np.newaxis], out=rows.T)
