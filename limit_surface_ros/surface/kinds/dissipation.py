# SPDX-License-Identifier: Apache-2.0
"""Dissipation models: D(v) = sum_k sqrt(v' B_k v), with the wrench its gradient."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, ClassVar

from limit_surface_ros.surface.kinds.dissipation_surface import DissipationSurface
from limit_surface_ros.surface.linalg import as_psd_matrices
from limit_surface_ros.surface.scaling import Scaling

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats


@dataclass(frozen=True, eq=False)
class Dissipation(DissipationSurface):
    """The surface whose loads are the gradients of D(v) = sum_k sqrt(v' B_k v).

    D is the power that a unit of scaled motion costs, the support function of the set of loads:
    a sum of k ellipsoids, always convex. k support points are exactly k terms of rank two, each
    making two facets.

    Attributes:
        matrices: B_k in scaled variables, positive semidefinite, shape (k, 3, 3).
        scaling: Characteristic length [m] and friction force [N].

    Raises:
        ShapeError: The shape is not (k, 3, 3).
        NotFiniteError: An element is NaN or infinite.
        MatrixError: A matrix is zero, not symmetric or not positive semidefinite.
    """

    kind: ClassVar[str] = "dissipation"

    matrices: Floats
    scaling: Scaling = field(default_factory=Scaling)

    def __post_init__(self) -> None:
        """Check the matrices."""
        object.__setattr__(self, "matrices", as_psd_matrices("matrix", self.matrices))

    @property
    def scaled_forms(self) -> Floats:
        """The B_k in scaled variables, shape (k, 3, 3)."""
        return self.matrices

    def with_friction_force(self, friction_force: float) -> Dissipation:
        """Return the same body under another weight; see `LimitSurface`."""
        return replace(self, scaling=replace(self.scaling, friction_force=friction_force))
