"""Sums of powers of quadratic forms: H(f) = sum_i (f' A_i f)^p_i, with the surface H = 1."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from limit_surface_ros.checks import as_floats, as_vectors
from limit_surface_ros.errors import RangeError, ShapeError
from limit_surface_ros.surface.power_sum_inverse import power_sum_inverse
from limit_surface_ros.surface.power_sum_scale import log_scales
from limit_surface_ros.surface.quadratic_form import as_psd_matrices, root_of
from limit_surface_ros.surface.scaled_surface import ScaledSurface
from limit_surface_ros.surface.scaling import Scaling

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.gauge_inverse import Inverse

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
class PowerSum(ScaledSurface):
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
        """Return the same body under another weight; see `ScaledSurface`."""
        return replace(self, scaling=replace(self.scaling, friction_force=friction_force))

    def value(self, load: ArrayLike) -> Floats:
        """Return H: below 1 inside the surface, 1 on it.

        Args:
            load: Scaled loads, shape (..., 3).

        Returns:
            Shape (...).
        """
        columns = np.moveaxis(as_vectors("load", load), -1, 0)
        forms = self._forms(self._images(columns))
        return np.asarray(sum(q**p for q, p in zip(forms, self.exponents, strict=True)))[()]

    def gradient(self, load: ArrayLike) -> Floats:
        """Return the gradient of H; a term whose form is zero adds nothing to it.

        At such a load a term with exponent above 1/2 has gradient zero, one with exponent 1/2 has
        zero as the middle of its subdifferential.

        Args:
            load: Scaled loads, shape (..., 3).

        Returns:
            Shape (..., 3).
        """
        columns = np.moveaxis(as_vectors("load", load), -1, 0)
        images = self._images(columns)
        forms = self._forms(images)
        weights = [
            2.0 * p * _power(q, p - 1.0) for q, p in zip(forms, self.exponents, strict=True)
        ]
        return np.moveaxis(self._weighted_gradient(images, weights), 0, -1)

    def _load_factors(self, loads: Floats) -> Floats:
        forms = self._forms(self._images(loads))
        return np.exp(-log_scales(forms, self.exponents))

    def _twists(self, loads: Floats) -> Floats:
        images = self._images(loads)
        forms = self._forms(images)
        log_alpha = log_scales(forms, self.exponents)
        bounded = np.isfinite(log_alpha)
        if not bounded.all():
            raise RangeError(
                "this surface has no limit in the direction of a wrench: friction resists any "
                f"amount of it, scaled direction {loads[:, ~bounded][:, 0].tolist()}"
            )
        weights = [
            p * _power(q, p - 1.0) * np.exp(2.0 * (p - 1.0) * log_alpha)
            for q, p in zip(forms, self.exponents, strict=True)
        ]
        gradient = self._weighted_gradient(images, weights)
        gradient /= np.abs(gradient).max(axis=0)
        gradient /= np.sqrt((gradient * gradient).sum(axis=0))
        return gradient

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
        """Return R_i f, shape (k, 3, ...)."""
        return np.tensordot(self._roots, columns, axes=1)

    def _forms(self, images: Floats) -> Floats:
        """Return f' A_i f from the images R_i f, shape (k, ...)."""
        return np.asarray(np.einsum("kc...,kc...->k...", images, images))

    def _weighted_gradient(self, images: Floats, weights: list[Floats]) -> Floats:
        """Return sum_i w_i A_i f from the images R_i f."""
        total: Floats = np.zeros_like(images[0])
        for root, image, weight in zip(self._roots, images, weights, strict=True):
            total += np.tensordot(root.T, weight * image, axes=1)
        return total


def _power(base: Floats, exponent: float) -> Floats:
    """Return base^exponent, 0 where the base is 0 whatever the exponent."""
    return np.power(base, exponent, out=np.zeros_like(base), where=base > 0.0)
