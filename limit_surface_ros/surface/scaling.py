# SPDX-License-Identifier: Apache-2.0
"""Scaled variables: wrench / (F0, F0, F0 rho) and twist * (1, 1, rho).

In them forces and moments, and translations and rotations, weigh alike; directions are unit
vectors and angles between motions are measured in them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import (
    as_directions,
    as_positive,
    as_rows,
    as_vectors,
)
from limit_surface_ros.errors import RangeError
from limit_surface_ros.runtime import keep_scratch

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.shape import Shape


# Scales that are accepted: products of two of them are numbers.
_LEAST, _MOST = 1e-100, 1e100
# Scales between which fourth powers of what is divided by two of them are numbers, too.
_NEAR_ONE = 1e-20, 1e20


@dataclass(frozen=True)
class Scaling:
    """Units in which a model is dimensionless.

    Attributes:
        characteristic_length: rho [m].
        friction_force: F0 [N].

    Raises:
        RangeError: A scale is not a number from 1e-100 to 1e100.
    """

    characteristic_length: float = 1.0
    friction_force: float = 1.0

    def __post_init__(self) -> None:
        """Check the two scales."""
        rho = as_positive("characteristic_length", self.characteristic_length)
        force = as_positive("friction_force", self.friction_force)
        for name, scale in (("characteristic_length", rho), ("friction_force", force)):
            if not _LEAST <= scale <= _MOST:
                raise RangeError(f"{name} must lie between 1e-100 and 1e100, got {scale:g}")
        object.__setattr__(self, "characteristic_length", rho)
        object.__setattr__(self, "friction_force", force)

    @cached_property
    def is_far_from_one(self) -> bool:
        """Whether what is divided by a unit may need its size taken out once more."""
        scales = self.characteristic_length, self.friction_force
        low, high = _NEAR_ONE
        return not all(low <= scale <= high for scale in scales)

    @cached_property
    def wrench_unit(self) -> Floats:
        """(F0, F0, F0 rho) in [N, N, N m], shape (3,)."""
        force = self.friction_force
        return _kept([force, force, force * self.characteristic_length])

    @cached_property
    def twist_unit(self) -> Floats:
        """(1, 1, 1 / rho) in [m/s, m/s, rad/s], shape (3,)."""
        return _kept([1.0, 1.0, 1.0 / self.characteristic_length])

    @cached_property
    def twist_by_wrench_unit(self) -> Floats:
        """Of derivatives of twists by wrenches, shape (3, 3)."""
        return _kept(np.multiply.outer(self.twist_unit, 1.0 / self.wrench_unit))

    @cached_property
    def wrench_by_twist_unit(self) -> Floats:
        """Of derivatives of wrenches by twists, shape (3, 3)."""
        return _kept(np.multiply.outer(self.wrench_unit, 1.0 / self.twist_unit))


def _kept(values: ArrayLike) -> Floats:
    """Return an array that nobody can write to: all surfaces of a scaling share it."""
    array = np.array(values)
    array.setflags(write=False)
    return array


class InScaledVariables(ABC):
    """A shape and its scaling: vectors in physical units go to the shape and back in blocks.

    Attributes:
        scaling: Characteristic length [m] and friction force [N].
    """

    scaling: Scaling

    @cached_property
    @abstractmethod
    def shape(self) -> Shape:
        """The surface in scaled variables."""

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
            write_rows(kernel(columns), unit_out, result[block])
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
            if self.scaling.is_far_from_one:
                again = np.maximum.reduce(np.abs(columns))
                again[again == 0.0] = 1.0
                columns /= again
                sizes *= again
            yield block, columns, sizes


def write_rows(columns: Floats, unit: Floats, rows: Floats) -> None:
    """Write scaled columns (3, m) into rows (m, 3), in physical units."""
    # Along the columns: numpy is slow along rows of three.
    np.multiply(columns, unit[:, np.newaxis], out=rows.T)
