# SPDX-License-Identifier: Apache-2.0
"""Sums of powers of quadratic forms: H(f) = sum_i (f' A_i f)^p_i, with the surface H = 1."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from limit_surface_ros.checks import as_floats, as_vectors
from limit_surface_ros.errors import RangeError, ShapeError
from limit_surface_ros.surface.base import FileArray, LimitSurface
from limit_surface_ros.surface.gauges.power_scale import power_scale
from limit_surface_ros.surface.gauges.power_sum import PowerSumGauge
from limit_surface_ros.surface.kinds.ellipsoid import EllipsoidShape
from limit_surface_ros.surface.linalg import as_psd_matrices, null_space, of_unit_length, root_of
from limit_surface_ros.surface.scaling import Scaling
from limit_surface_ros.surface.shape import GaugeShape
from limit_surface_ros.surface.support.power_sum_solver import (
    gauge_of,
    is_norm,
    power_sum_solver,
    scalar_gauge_of,
)

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Bools, Floats
    from limit_surface_ros.surface.gauges.gauge import Six, Turning, Vector
    from limit_surface_ros.surface.support.solvers import SupportSolver

# Part of a motion along a load without limit, above which its power is infinite.
_FREE = 1e-12
# How much smaller than the smallest of its ellipsoids a surface may be.
_MOST_SHRINKAGE = 1e60


def thesis_exponents(terms: int) -> Floats:
    """Return the exponents of the family of n terms: 1, (n - 1)/n, ..., 1/n.

    That is 1 / 1, 1/2 / 1, 2/3, 1/3 / 1, 3/4, 2/4, 1/4 for one to four terms. From three terms on
    some exponents are below 1/2 and the surface need not be convex.

    Raises:
        RangeError: There is no term.
    """
    if terms < 1:
        raise RangeError(f"terms must be at least 1, got {terms}")
    return np.arange(terms, 0, -1) / terms


@dataclass(frozen=True, eq=False)
class PowerSum(LimitSurface):
    """The surface H(f) = sum_i (f' A_i f)^p_i = 1 in scaled variables.

    One term with exponent 1 is the ellipsoid of Howe and Cutkosky (1996),
    doi:10.1177/027836499601500603. With every exponent 1/2, H is a norm and the surface its unit
    sphere. The surface is convex if every exponent is at least 1/2.

    Attributes:
        matrices: A_i in scaled variables, positive semidefinite, shape (k, 3, 3).
        exponents: p_i in (0, 1], shape (k,).
        scaling: Characteristic length [m] and friction force [N].

    Raises:
        ShapeError: The shapes do not fit.
        NotFiniteError: A number is NaN or infinite.
        MatrixError: A matrix is zero, not symmetric or not positive semidefinite.
        RangeError: An exponent is outside (0, 1].
    """

    kind: ClassVar[str] = "power_sum"
    arrays: ClassVar[tuple[FileArray, ...]] = (
        FileArray("exponents", ("terms",)),
        FileArray("matrices", ("terms", 3, 3)),
    )

    matrices: Floats
    exponents: Floats
    scaling: Scaling = field(default_factory=Scaling)

    def __post_init__(self) -> None:
        """Check the arrays."""
        matrices = as_psd_matrices("matrix", self.matrices)
        exponents = as_floats("exponents", self.exponents).copy()
        if exponents.shape != (len(matrices),):
            raise ShapeError(
                f"exponents must have shape ({len(matrices)},), one for each matrix, "
                f"got {exponents.shape}"
            )
        if not ((exponents > 0.0) & (exponents <= 1.0)).all():
            raise RangeError(f"exponents must lie in (0, 1], got {exponents.tolist()}")
        forms = np.trace(matrices, axis1=1, axis2=2)[:, np.newaxis] / 3.0
        with np.errstate(over="ignore"):
            shrinkage = float(power_scale(exponents).load_factors(forms)[0] / np.sqrt(forms.max()))
        if not shrinkage <= _MOST_SHRINKAGE:
            raise RangeError(
                f"exponents {exponents.tolist()} are too small: together they make the surface "
                f"{shrinkage:.0e} times smaller than its ellipsoids, {_MOST_SHRINKAGE:.0e} is the "
                "most that numbers hold"
            )
        exponents.setflags(write=False)
        object.__setattr__(self, "matrices", matrices)
        object.__setattr__(self, "exponents", exponents)

    @classmethod
    def thesis(cls, matrices: ArrayLike, scaling: Scaling | None = None) -> PowerSum:
        """Return the n-term member of the thesis's family; see `thesis_exponents`.

        Args:
            matrices: One matrix per term in the order of falling exponents, shape (n, 3, 3).
            scaling: Characteristic length [m] and friction force [N]; one each if not given.
        """
        exponents = thesis_exponents(len(as_floats("matrices", matrices)))
        return cls(np.asarray(matrices), exponents, scaling or Scaling())

    @classmethod
    def norms(cls, matrices: ArrayLike, scaling: Scaling | None = None) -> PowerSum:
        """Return a sum of norms, sqrt(f' A_i f): always convex, its load factor is H itself.

        Args:
            matrices: Shape (n, 3, 3).
            scaling: Characteristic length [m] and friction force [N]; one each if not given.
        """
        array = as_floats("matrices", matrices)
        return cls(array, np.full(len(array), 0.5), scaling or Scaling())

    def value(self, load: ArrayLike) -> Floats:
        """Return H: below 1 inside the surface, 1 on it.

        Args:
            load: Scaled loads, shape (..., 3).

        Returns:
            Shape (...).
        """
        array = as_vectors("load", load)
        columns = array.reshape(-1, 3).T
        forms = self._terms.images_and_forms(columns)[1]
        values = (forms ** self.exponents[:, np.newaxis]).sum(axis=0)
        return np.asarray(values.reshape(array.shape[:-1]))[()]

    def gradient(self, load: ArrayLike) -> Floats:
        """Return the gradient of H; a term whose form is zero adds nothing to it.

        At such a load a term with exponent above 1/2 has gradient zero, one with exponent 1/2 has
        zero as the middle of its subdifferential.

        Args:
            load: Scaled loads, shape (..., 3).

        Returns:
            Shape (..., 3).
        """
        array = as_vectors("load", load)
        columns = array.reshape(-1, 3).T
        images, forms = self._terms.images_and_forms(columns)
        exponents = self.exponents[:, np.newaxis]
        weights = np.power(forms, exponents - 1.0, out=np.zeros_like(forms), where=forms > 0.0)
        images *= (2.0 * exponents * weights)[:, np.newaxis]
        gradient = np.einsum("kci,kcm->mi", self._roots, images)
        return np.asarray(gradient.reshape(array.shape))

    def gradient_twist(self, wrench: ArrayLike) -> Floats:
        """Direction of the gradient of H at the wrench itself; see `LimitSurface`."""
        if is_norm(self.exponents):
            return self.twist_of_wrench(wrench)
        # Refuses what is no wrench, and what nothing limits.
        self.twist_of_wrench(wrench)
        gradient = self.gradient(np.asarray(wrench, dtype=np.float64) / self.scaling.wrench_unit)
        length = np.linalg.norm(gradient, axis=-1, keepdims=True)
        return np.asarray(gradient / length * self.scaling.twist_unit)

    @property
    def size(self) -> int:
        """How many numbers define the shape: six for each symmetric matrix."""
        return 6 * len(self.matrices)

    @property
    def convex_because(self) -> str | None:
        """Why the surface is convex whatever its matrices are; None if they decide."""
        if len(self.matrices) == 1:
            return "it is an ellipsoid"
        if self.exponents.min() >= 0.5:
            return "every exponent is at least 1/2, so that every term is convex"
        return None

    @cached_property
    def may_have_corners(self) -> bool:
        """Whether a norm resists no load at all along some line; see `LimitSurface`."""
        ranks = self._roots.any(axis=2).sum(axis=1)
        return bool(((ranks < 3) & (self.exponents <= 0.5)).any())

    @cached_property
    def _roots(self) -> Floats:
        """The R_i with R_i' R_i = A_i: they keep twice the digits where a form is small."""
        return np.array([root_of(matrix) for matrix in self.matrices])

    @cached_property
    def _terms(self) -> PowerSumGauge:
        return PowerSumGauge(self._roots, self.exponents)

    def _new_shape(self) -> EllipsoidShape | _PowerSumShape:
        if len(self._roots) == 1 and len(null_space(self._roots)) == 0:
            return EllipsoidShape(self._roots[0])
        return _PowerSumShape(self._roots, self.exponents)


def _check_limited(loads: Floats, factors: Floats) -> None:
    if np.count_nonzero(factors) < len(factors):
        unlimited = loads[:, factors == 0.0][:, 0].tolist()
        raise RangeError(
            "this surface has no limit in the direction of a wrench: friction resists any "
            f"amount of it, scaled direction {unlimited}"
        )


class _PowerSumShape(GaugeShape):
    """The shape of sum_i |R_i f|^(2 p_i) = 1."""

    def __init__(self, roots: Floats, exponents: Floats) -> None:
        super().__init__(gauge_of(roots, exponents), scalar_gauge_of(roots, exponents))
        self._roots = roots
        self._exponents = exponents

    def motions_and_load_factors(self, loads: Floats) -> tuple[Floats, Floats]:
        """Return unit motions and load factors; see `Shape`.

        Raises:
            RangeError: Nothing limits a load.
        """
        factors, normals = self._gauge.values_and_normals(loads)
        _check_limited(loads, factors)
        return of_unit_length(normals), factors

    def motions_turning(self, loads: Floats) -> tuple[Turning, Bools]:
        """Return factors and motions with how these turn; see `Shape`.

        Raises:
            RangeError: Nothing limits a load.
        """
        if len(self._free):
            _check_limited(loads, self.load_factors(loads))
        return super().motions_turning(loads)

    def load_turning_scalar(self, motion: Vector) -> tuple[Vector, Six] | None:
        """Return the same for one motion; see `Shape`."""
        return None if len(self._free) else super().load_turning_scalar(motion)

    def load_factor_and_motion_scalar(self, load: Vector) -> tuple[float, Vector] | None:
        """Return load factor and motion of one load; see `Shape`."""
        found = self._scalar.value_and_normal(load)
        return found if found is not None and found[0] > 0.0 else None

    def loads(self, motions: Floats) -> Floats:
        """Return the loads of maximum dissipation; see `Shape`.

        Raises:
            RangeError: The power of a motion is infinite.
        """
        if len(self._free):
            powers = np.abs(self._free @ motions)
            infinite = (powers > _FREE * (np.abs(self._free) @ np.abs(motions))).any(axis=0)
            if infinite.any():
                raise RangeError(
                    "this surface has no limit to the load of a twist: the power of "
                    f"scaled twist {motions[:, infinite][:, 0].tolist()} is infinite"
                )
        return super().loads(motions)

    def load_scalar(self, motion: Vector) -> Vector | None:
        """Return the load of maximum dissipation for one motion; see `Shape`."""
        return None if len(self._free) else super().load_scalar(motion)

    @cached_property
    def _free(self) -> Floats:
        """Orthonormal loads that nothing limits, shape (q, 3)."""
        sizes = np.sqrt(np.square(self._roots).sum(axis=(1, 2), keepdims=True))
        return null_space(self._roots / sizes)

    @cached_property
    def solver(self) -> SupportSolver:
        """Finds the loads of maximum dissipation."""
        roots = self._roots
        if len(self._free):
            # A limit within one term keeps the answer at zero along what nothing limits.
            size = np.sqrt(np.square(roots[0]).sum())
            bounded = np.linalg.qr(np.concatenate([roots[0], size * self._free]))[1]
            roots = np.array([bounded, *roots[1:]])
        return power_sum_solver(roots, self._exponents)
