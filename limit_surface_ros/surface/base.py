# SPDX-License-Identifier: Apache-2.0
"""What all kinds of surface share: validation, scaled variables, one vector or many.

Wrenches are (fx, fy, tau_z) in [N, N, N m], applied *to* the body, about the model's reference
point and in its frame. Twists are (vx, vy, omega_z) in [m/s, m/s, rad/s] of the body at that
point. Their dot product is power.

A surface is a shape and a scaling. The shape has the three maps on scaled columns, arrays (3, m)
of numbers of size about one. What callers pass, of shape (..., 3) in physical units, goes to such
columns and back in blocks that fit the processor's cache (`surface.scaling`). The derivatives of
the maps are in `surface.derivatives`.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, fields
from functools import cache, cached_property
from math import inf, sqrt
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

import numpy as np

from limit_surface_ros.checks import as_positive, as_rows, one_direction
from limit_surface_ros.surface.derivatives import Derivatives
from limit_surface_ros.surface.scaling import Scaling, write_rows

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.gauges.gauge import Vector
    from limit_surface_ros.surface.shape import Shape

Self = TypeVar("Self", bound="LimitSurface")

# Sizes of a scaled vector between which its fourth powers are numbers, for the scalar maps.
_SMALLEST, _LARGEST = 1e-70, 1e70


@dataclass(frozen=True)
class FileArray:
    """An array of numbers that defines a surface: an attribute of it, and a key of its file.

    Attributes:
        key: The name.
        shape: Lengths of the axes. A name stands for the length of an array before this one, or
            else for a whole number under that key of the file; None for any length.
        at_least: Least number allowed in it, if there is one.
    """

    key: str
    shape: tuple[int | str | None, ...]
    at_least: float = -inf


@cache
def _field_names(kind: type[LimitSurface]) -> tuple[str, ...]:
    return tuple(each.name for each in fields(kind))


class LimitSurface(Derivatives):
    """The boundary of the convex set of wrenches that dry friction can resist.

    A kind is a frozen dataclass whose fields are its `arrays` and `scaling`; what it says of
    itself here is all that files, nodes, pictures and programs know of it.

    Attributes:
        kind: Name of the kind, as model files give it.
        arrays: The arrays that define a surface of this kind, in the order of its file.
        wrench_is_closed: Whether `wrench_of_twist` is in closed form and `twist_of_wrench` is the
            one that has to search; the other way round if not.
        scaling: Characteristic length [m] and friction force [N] that make it dimensionless.
    """

    kind: ClassVar[str]
    arrays: ClassVar[tuple[FileArray, ...]] = ()
    wrench_is_closed: ClassVar[bool] = False
    # Every kind is a dataclass.
    __dataclass_fields__: ClassVar[dict[str, Any]]

    @abstractmethod
    def _new_shape(self) -> Shape:
        """Return the surface in scaled variables; it does not depend on the friction force."""

    @classmethod
    def of_arrays(cls: type[Self], arrays: Mapping[str, Any], scaling: Scaling) -> Self:
        """Return the surface of this kind that some arrays define.

        Args:
            arrays: By the keys of `arrays`.
            scaling: Characteristic length [m] and friction force [N].
        """
        constructor: Any = cls
        surface: Self = constructor(**arrays, scaling=scaling)
        return surface

    @property
    def terms(self) -> int:
        """How many terms, points or coefficients define the surface."""
        return len(getattr(self, self.arrays[0].key)) if self.arrays else 1

    @property
    def size(self) -> int:
        """How many numbers define the shape."""
        return sum(np.size(getattr(self, array.key)) for array in self.arrays)

    @property
    def convex_because(self) -> str | None:
        """Why the surface is convex whatever its numbers are; None if they decide."""
        return None

    @property
    def may_have_corners(self) -> bool:
        """Whether a load factor in closed form may have corners, whose twists fill a cone."""
        return False

    @property
    def scaled_forms(self) -> Floats | None:
        """The B_k (k, 3, 3) of a dissipation sum_k sqrt(v' B_k v), if the surface has one."""
        return None

    @property
    def contact_points(self) -> tuple[Floats, Floats] | None:
        """Points of contact (n, 2) [m] and their friction limits (n,) [N], if they are known."""
        return None

    @cached_property
    def shape(self) -> Shape:
        """The surface in scaled variables, shared with the same body under other weights."""
        return self._new_shape()

    def __getstate__(self) -> dict[str, Any]:
        """Return what defines the surface: tables made on the way stay out of pickles."""
        return {name: self.__dict__[name] for name in _field_names(type(self))}

    def scaled(self: Self, factor: float) -> Self:
        """Return the surface with every wrench on it multiplied by `factor`.

        The load factor of a wrench becomes 1 / factor times what it was, the twists stay. The two
        surfaces share their shape, so that this costs next to nothing.

        Raises:
            RangeError: The factor is not a finite number above zero, or makes the friction force
                none.
        """
        factor = as_positive("factor", factor)
        return self._rescaled(self.scaling.friction_force * factor, factor)

    def with_friction_force(self: Self, friction_force: float) -> Self:
        """Return the same body under another weight; see `scaled`.

        Args:
            friction_force: The new friction force scale F0 [N]; every limit grows with it.

        Raises:
            RangeError: The force is not a finite number above zero.
        """
        force = as_positive("friction_force", friction_force)
        return self._rescaled(force, force / self.scaling.friction_force)

    def _rescaled(self: Self, force: float, factor: float) -> Self:
        scaling = Scaling(self.scaling.characteristic_length, force)
        # The numbers were checked when this surface was made.
        rescaled = object.__new__(type(self))
        rescaled.__dict__.update(self._under(scaling, factor), shape=self.shape)
        return rescaled

    def _under(self, scaling: Scaling, _factor: float) -> dict[str, Any]:
        """Return the fields of the same body under a weight that is larger by a factor."""
        state = self.__getstate__()
        state["scaling"] = scaling
        return state

    def prepare(self) -> None:
        """Make what large batches are answered from, and what a first call would have to make.

        That takes from a millisecond to about a second, once for all weights of a body, and may be
        done in another thread meanwhile calls are answered. Calls never do it because of what was
        asked before; one call with so many vectors that it pays within that call does.
        """
        self.shape.expect(inf)
        for vector in ([1.0, 0.0, 0.0], [[0.0, 1.0, 0.0]]):
            unit = np.asarray(vector)
            self.load_factor(unit)
            if not self.wrench_is_closed:
                self.wrench_of_twist(unit)

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
        one = self._one_load(wrench)
        if one is not None:
            factor = self.shape.load_factor_scalar(one)
            if factor is not None:
                scalar: Floats = np.float64(factor)
                return scalar
        array = as_rows("wrench", wrench)
        factors = np.empty(array.size // 3)
        unit = self.scaling.wrench_unit
        for block, columns, sizes in self._blocks("wrench", array, unit, zeros=True):
            np.multiply(self.shape.load_factors(columns), sizes, out=factors[block])
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
        one = self._one_load(wrench)
        if one is not None:
            found = self.shape.load_factor_and_motion_scalar(one)
            if found is not None:
                return self._twist_along(found[1])
        unit_in, unit_out = self.scaling.wrench_unit, self.scaling.twist_unit
        return self._mapped("wrench", wrench, unit_in, self.shape.motions, unit_out)

    def gradient_twist(self, wrench: ArrayLike) -> Floats:
        """Direction of the gradient, at the wrench itself, of the function that defines a kind.

        For all kinds but power sums of mixed exponents this is `twist_of_wrench`; for those it is
        so on the surface alone.

        Args:
            wrench: Shape (..., 3), (fx, fy, tau_z) in [N, N, N m], not zero.

        Returns:
            Shape (..., 3) twists (vx, vy, omega_z) of unit norm in scaled variables.
        """
        return self.twist_of_wrench(wrench)

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
        one = self._one_load(wrench)
        if one is not None:
            found = self.shape.load_factor_and_motion_scalar(one)
            if found is not None:
                return self._twist_along(found[1]), np.float64(found[0])
        array = as_rows("wrench", wrench)
        twists, factors = np.empty((array.size // 3, 3)), np.empty(array.size // 3)
        for block, columns, sizes in self._blocks("wrench", array, self.scaling.wrench_unit):
            motions, scaled_factors = self.shape.motions_and_load_factors(columns)
            np.multiply(scaled_factors, sizes, out=factors[block])
            write_rows(motions, self.scaling.twist_unit, twists[block])
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
        one = self._one_motion(twist)
        load = None if one is None else self.shape.load_scalar(one)
        if load is not None:
            return self._wrench_of(load)
        unit_in, unit_out = self.scaling.twist_unit, self.scaling.wrench_unit
        return self._mapped("twist", twist, unit_in, self.shape.loads, unit_out)

    def load_factor_gradient(self, wrench: ArrayLike) -> Floats:
        """Derivative of the load factor by the wrench.

        Args:
            wrench: Shape (..., 3), (fx, fy, tau_z) in [N, N, N m], not zero.

        Returns:
            Shape (..., 3) in [1/N, 1/N, 1/(N m)]; along the twist that the wrench causes.

        Raises:
            ShapeError: The last axis does not hold three components.
            NotFiniteError: A component is NaN or infinite.
            ZeroVectorError: A wrench is zero.
        """
        array = as_rows("wrench", wrench)
        twists, factors = self.twist_and_load_factor(array)
        power = (twists * array).sum(axis=-1)
        # A load that nothing holds has no limit for all loads nearby.
        known = factors < inf
        scale = np.divide(factors, power, out=np.zeros_like(power), where=known)
        return np.asarray(twists * scale[..., np.newaxis])

    def _one_load(self, wrench: Any) -> Vector | None:
        """Return a single, plainly valid wrench in scaled variables, None for anything else."""
        one = one_direction(wrench)
        if one is None:
            return None
        force = self.scaling.friction_force
        x, y = one[0] / force, one[1] / force
        z = one[2] / (force * self.scaling.characteristic_length)
        return (x, y, z) if _SMALLEST < abs(x) + abs(y) + abs(z) < _LARGEST else None

    def _one_motion(self, twist: Any) -> Vector | None:
        """Return a single, plainly valid twist in scaled variables, None for anything else."""
        one = one_direction(twist)
        if one is None:
            return None
        x, y, z = one[0], one[1], one[2] * self.scaling.characteristic_length
        return (x, y, z) if _SMALLEST < abs(x) + abs(y) + abs(z) < _LARGEST else None

    def _wrench_of(self, load: Vector) -> Floats:
        """Return the wrench of a scaled load."""
        force = self.scaling.friction_force
        torque = force * self.scaling.characteristic_length * load[2]
        return np.array((force * load[0], force * load[1], torque))

    def _twist_along(self, motion: Vector) -> Floats:
        """Return the twist of unit norm along a scaled motion."""
        x, y, z = motion
        length = sqrt(x * x + y * y + z * z)
        return np.array(
            (x / length, y / length, z / (length * self.scaling.characteristic_length))
        )
