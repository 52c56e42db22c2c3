# SPDX-License-Identifier: Apache-2.0
"""What all kinds of surface share: validation, scaled variables, one vector or many.

Wrenches are (fx, fy, tau_z) in [N, N, N m], applied *to* the body, about the model's reference
point and in its frame. Twists are (vx, vy, omega_z) in [m/s, m/s, rad/s] of the body at that
point. Their dot product is power.

A surface is a shape and a scaling. The shape has the three maps on scaled columns, arrays (3, m)
of numbers of size about one. The base takes what callers pass, of shape (..., 3) in physical
units, to such columns in blocks that fit the processor's cache, and back.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, fields
from functools import cache, cached_property
from math import inf, sqrt
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
from limit_surface_ros.surface.scaling import Scaling

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Bools, Floats
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


class LimitSurface(ABC):
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
    scaling: Scaling
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
            _write(motions, self.scaling.twist_unit, twists[block])
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
            x, y, z = one[0], one[1], one[2] * self.scaling.characteristic_length
            if _SMALLEST < abs(x) + abs(y) + abs(z) < _LARGEST:
                load = self.shape.load_scalar((x, y, z))
                if load is not None:
                    force = self.scaling.friction_force
                    torque = force * self.scaling.characteristic_length * load[2]
                    return np.array((force * load[0], force * load[1], torque))
        unit_in, unit_out = self.scaling.twist_unit, self.scaling.wrench_unit
        return self._mapped("twist", twist, unit_in, self.shape.loads, unit_out)

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
        return np.asarray(twists * (factors / power)[..., np.newaxis])

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
            _write(loads, unit_out, wrenches[block])
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
            _write(motions, unit_out, twists[block])
            _write_jacobians(derivatives, unit_out, unit_in, sizes, jacobians[block])
        shape = array.shape[:-1]
        return (
            factors.reshape(shape)[()],
            twists.reshape(array.shape),
            jacobians.reshape(*shape, 3, 3),
        )

    def _one_load(self, wrench: Any) -> Vector | None:
        """Return a single, plainly valid wrench in scaled variables, None for anything else."""
        one = one_direction(wrench)
        if one is None:
            return None
        force = self.scaling.friction_force
        x, y = one[0] / force, one[1] / force
        z = one[2] / (force * self.scaling.characteristic_length)
        return (x, y, z) if _SMALLEST < abs(x) + abs(y) + abs(z) < _LARGEST else None

    def _twist_along(self, motion: Vector) -> Floats:
        """Return the twist of unit norm along a scaled motion."""
        x, y, z = motion
        length = sqrt(x * x + y * y + z * z)
        return np.array(
            (x / length, y / length, z / (length * self.scaling.characteristic_length))
        )

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
        self.shape.expect(len(rows))
        count = self.shape.columns_at_once
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


def _write_jacobians(
    columns: Floats, unit_out: Floats, unit_in: Floats, sizes: Floats, out: Floats
) -> None:
    """Write scaled Jacobians (3, 3, m) at vectors of size one into (m, 3, 3), physical units."""
    columns *= np.multiply.outer(unit_out, 1.0 / unit_in)[:, :, np.newaxis]
    columns /= sizes
    out.transpose(1, 2, 0)[...] = columns
