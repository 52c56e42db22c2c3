# SPDX-License-Identifier: Apache-2.0
"""Dissipation models: D(v) = sum_k sqrt(v' B_k v), with the wrench its gradient."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from limit_surface_ros.surface.base import FileArray, LimitSurface
from limit_surface_ros.surface.gauges.norm_sum import NormSum
from limit_surface_ros.surface.gauges.scalar import NormSumScalar
from limit_surface_ros.surface.linalg import as_psd_matrices, root_of
from limit_surface_ros.surface.scaling import Scaling
from limit_surface_ros.surface.shape import DissipationShape
from limit_surface_ros.surface.support.dissipation_solver import FEW_TERMS, dissipation_solver

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.support.solvers import SupportSolver

SUM_OF_CONVEX_SETS = (
    "its dissipation is a sum of norms, so that its loads are a sum of convex sets"
)


@dataclass(frozen=True, eq=False)
class Dissipation(LimitSurface):
    """The surface whose loads are the gradients of D(v) = sum_k sqrt(v' B_k v).

    D is the power that a unit of scaled motion costs, the support function of the set of loads:
    a sum of k ellipsoids, always convex. k support points are exactly k terms of rank two, each
    making two facets. A motion that no term resists (a single support point turns freely) makes
    the load factor of any load along it infinite, and the twist that motion.

    Attributes:
        matrices: B_k in scaled variables, positive semidefinite, shape (k, 3, 3).
        scaling: Characteristic length [m] and friction force [N].

    Raises:
        ShapeError: The shape is not (k, 3, 3).
        NotFiniteError: An element is NaN or infinite.
        MatrixError: A matrix is zero, not symmetric or not positive semidefinite.
    """

    kind: ClassVar[str] = "dissipation"
    arrays: ClassVar[tuple[FileArray, ...]] = (FileArray("matrices", ("terms", 3, 3)),)
    wrench_is_closed: ClassVar[bool] = True

    matrices: Floats
    scaling: Scaling = field(default_factory=Scaling)

    def __post_init__(self) -> None:
        """Check the matrices."""
        object.__setattr__(self, "matrices", as_psd_matrices("matrix", self.matrices))

    @property
    def size(self) -> int:
        """How many numbers define the shape: six for each symmetric matrix."""
        return 6 * len(self.matrices)

    @property
    def convex_because(self) -> str:
        """Why the surface is convex whatever its matrices are."""
        return SUM_OF_CONVEX_SETS

    @property
    def scaled_forms(self) -> Floats:
        """The B_k in scaled variables, shape (k, 3, 3)."""
        return self.matrices

    def _new_shape(self) -> _NormSumShape:
        return _NormSumShape(np.array([root_of(matrix) for matrix in self.matrices]))


class _NormSumShape(DissipationShape):
    """The shape of a sum of |R_k v|."""

    def __init__(self, roots: Floats) -> None:
        scalar = NormSumScalar(roots) if len(roots) <= FEW_TERMS else None
        super().__init__(NormSum(roots), scalar)
        self._roots = roots

    @cached_property
    def solver(self) -> SupportSolver:
        """Finds the motions of loads."""
        return dissipation_solver(self._roots)
