# SPDX-License-Identifier: Apache-2.0
"""Sums of powers of quadratic forms: H(f) = sum_i (f' A_i f)^p_i, with the surface H = 1."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from math import sqrt
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from limit_surface_ros.checks import as_floats, as_vectors
from limit_surface_ros.errors import RangeError, ShapeError
from limit_surface_ros.surface.base import LimitSurface
from limit_surface_ros.surface.gauges.one_load import (
    gauge_of_one,
    norm_gradient_of_one,
    normal_and_gauge_of_one,
    one_load_terms,
)
from limit_surface_ros.surface.gauges.one_power_sum import OnePowerSum
from limit_surface_ros.surface.gauges.one_twist import wrench_of_one
from limit_surface_ros.surface.gauges.power_scale import PowerScale, power_scale
from limit_surface_ros.surface.linalg import (
    NULL_TOLERANCE,
    as_psd_matrices,
    of_unit_length,
    root_of,
    squared_lengths,
)
from limit_surface_ros.surface.scaling import Scaling
from limit_surface_ros.surface.support.power_sum import power_sum_inverse

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.gauges.one_load import Term, Vector
    from limit_surface_ros.surface.support.solvers import Inverse

# Part of a twist along a load without limit, above which its power is infinite.
_FREE = 1e-12
# Relative eigenvalue below which nothing limits a load.
_NO_LIMIT = 1e-15


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

    matrices: Floats
    exponents: Floats
    scaling: Scaling = field(default_factory=Scaling)
    _roots: Floats = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Check the arrays and factor the matrices."""
        matrices = as_psd_matrices("matrix", self.matrices)
        exponents = as_floats("exponents", self.exponents).copy()
        if exponents.shape != (len(matrices),):
            raise ShapeError(
                f"exponents must have shape ({len(matrices)},), one for each matrix, "
                f"got {exponents.shape}"
            )
        if not ((exponents > 0.0) & (exponents <= 1.0)).all():
            raise RangeError(f"exponents must lie in (0, 1], got {exponents.tolist()}")
        exponents.setflags(write=False)
        object.__setattr__(self, "matrices", matrices)
        object.__setattr__(self, "exponents", exponents)
        object.__setattr__(self, "_roots", np.array([root_of(matrix) for matrix in matrices]))

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

    def with_friction_force(self, friction_force: float) -> PowerSum:
        """Return the same body under another weight; see `LimitSurface`."""
        return replace(self, scaling=replace(self.scaling, friction_force=friction_force))

    def value(self, load: ArrayLike) -> Floats:
        """Return H: below 1 inside the surface, 1 on it.

        Args:
            load: Scaled loads, shape (..., 3).

        Returns:
            Shape (...).
        """
        array = as_vectors("load", load)
        columns = array.reshape(-1, 3).T
        forms = self._forms(self._images(columns), columns)
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
        images = self._images(columns)
        forms = self._forms(images, columns)
        exponents = self.exponents[:, np.newaxis]
        weights = np.power(forms, exponents - 1.0, out=np.zeros_like(forms), where=forms > 0.0)
        images *= (2.0 * exponents * weights)[:, np.newaxis]
        gradient = self._stacked_roots.T @ images.reshape(-1, images.shape[2])
        return np.asarray(gradient.T.reshape(array.shape))

    @cached_property
    def _one_load_terms(self) -> list[Term]:
        return one_load_terms(self._roots, self.exponents, self.scaling.wrench_unit)

    @cached_property
    def _is_norm(self) -> bool:
        """Whether the load factor is the plain sum of |R_i f|."""
        return len(self.matrices) == 1 or bool((self.exponents == 0.5).all())

    @cached_property
    def _scale(self) -> PowerScale:
        return power_scale(self.exponents)

    @cached_property
    def _stacked_roots(self) -> Floats:
        """The R_i above each other, shape (3 k, 3)."""
        return self._roots.reshape(-1, 3)

    def _load_factor_of_one(self, wrench: Vector) -> float | None:
        if self._is_norm:
            found = self._twist_and_load_factor_of_one(wrench)
            return None if found is None else found[1]
        return gauge_of_one(self._one_load_terms, wrench)

    def _twist_of_one(self, wrench: Vector) -> Vector | None:
        found = self._twist_and_load_factor_of_one(wrench)
        return None if found is None else found[0]

    def _twist_and_load_factor_of_one(self, wrench: Vector) -> tuple[Vector, float] | None:
        # The terms take physical wrenches, so that the normal comes as a physical twist.
        if self._is_norm:
            gradient = norm_gradient_of_one(self._one_load_terms, wrench)
            if gradient is None:
                return None
            x, y, z = gradient
            factor = x * wrench[0] + y * wrench[1] + z * wrench[2]
        else:
            found = normal_and_gauge_of_one(self._one_load_terms, wrench)
            if found is None:
                return None
            (x, y, z), factor = found
        turn = z * self.scaling.characteristic_length
        length = sqrt(x * x + y * y + turn * turn)
        return (x / length, y / length, z / length), factor

    @cached_property
    def _one_gauge(self) -> OnePowerSum:
        return OnePowerSum(self._roots, self.exponents)

    def _wrench_of_one(self, twist: Vector) -> Vector | None:
        if len(self._free):
            return None
        return wrench_of_one(self._one_gauge, self._inverse, self.scaling, twist)

    def _load_factors(self, loads: Floats) -> Floats:
        forms = self._forms(self._images(loads), loads)
        if self._is_norm:
            return np.asarray(np.sqrt(forms).sum(axis=0))
        return self._scale.load_factors(forms)

    def _twists(self, loads: Floats) -> Floats:
        return self._twists_and_load_factors(loads)[0]

    def _twists_and_load_factors(self, loads: Floats) -> tuple[Floats, Floats]:
        images = self._images(loads)
        forms = self._forms(images, loads)
        seen = np.count_nonzero(forms) == forms.size
        if not seen and not forms.any(axis=0).all():
            unlimited = loads[:, ~forms.any(axis=0)][:, 0].tolist()
            raise RangeError(
                "this surface has no limit in the direction of a wrench: friction resists any "
                f"amount of it, scaled direction {unlimited}"
            )
        if self._is_norm:
            norms = np.sqrt(forms)
            factors = np.add.reduce(norms)
            if not seen:
                # A term that does not see the load adds nothing to its normal.
                norms[norms == 0.0] = np.inf
            images /= norms[:, np.newaxis]
        else:
            factors, weights = self._scale.load_factors_and_weights(forms)
            images *= weights[:, np.newaxis]
        normals = self._stacked_roots.T.dot(images.reshape(-1, images.shape[2]))
        return of_unit_length(normals), factors

    def _loads(self, twists: Floats) -> Floats:
        if len(self._free):
            unlimited = np.abs(self._free @ twists).max(axis=0) > _FREE * np.abs(twists).max(
                axis=0
            )
            if unlimited.any():
                raise RangeError(
                    "this surface has no limit to the load of a twist: the power of "
                    f"scaled twist {twists[:, unlimited][:, 0].tolist()} is infinite"
                )
        return self._inverse.solve(twists)[0]

    @cached_property
    def _free(self) -> Floats:
        """Orthonormal loads that nothing limits, shape (q, 3)."""
        size, vectors = np.linalg.eigh(sum(m / np.trace(m) for m in self.matrices))
        free: Floats = vectors[:, size <= _NO_LIMIT * size[-1]].T
        return free

    @cached_property
    def _inverse(self) -> Inverse:
        roots = self._roots
        if len(self._free):
            # A limit within one term keeps the answer at zero along what nothing limits.
            bounded = self.matrices[0] + np.trace(self.matrices[0]) * self._free.T @ self._free
            roots = np.array([root_of(bounded), *roots[1:]])
        return power_sum_inverse(roots, self.exponents)

    def _images(self, columns: Floats) -> Floats:
        """Return R_i f, shape (k, 3, m), of columns (3, m)."""
        images: Floats = self._stacked_roots.dot(columns)
        return images.reshape(-1, 3, columns.shape[1])

    @cached_property
    def _blind(self) -> Floats | None:
        """Forms of unit loads that count as zero, shape (k, 1); None if all matrices see all."""
        if np.abs(self._roots).any(axis=2).all():
            return None
        sizes: Floats = np.square(self._roots).sum(axis=(1, 2))[:, np.newaxis]
        return NULL_TOLERANCE * sizes

    def _forms(self, images: Floats, loads: Floats) -> Floats:
        """Return f' A_i f, shape (k, m), from the images R_i f and the loads f."""
        forms: Floats = np.einsum("kcm,kcm->km", images, images)
        if self._blind is not None:
            forms[forms <= self._blind * squared_lengths(loads)] = 0.0
        return forms
