# SPDX-License-Identifier: Apache-2.0
"""Support points: the exact limit surface of a body on finitely many contacts."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from limit_surface_ros.checks import as_floats
from limit_surface_ros.errors import GeometryError, RangeError, ShapeError
from limit_surface_ros.surface.base import FileArray, LimitSurface
from limit_surface_ros.surface.gauges.norm_sum import PointNormSum
from limit_surface_ros.surface.gauges.scalar import NormSumScalar
from limit_surface_ros.surface.kinds.dissipation import SUM_OF_CONVEX_SETS, Dissipation
from limit_surface_ros.surface.scaling import Scaling
from limit_surface_ros.surface.shape import DissipationShape
from limit_surface_ros.surface.support.dissipation_solver import FEW_TERMS, points_solver

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.support.solvers import SupportSolver


@dataclass(frozen=True, eq=False)
class PointContacts(LimitSurface):
    """The limit surface of support points with isotropic Coulomb friction.

    A point p_k that moves with w_k resists with m_k w_k / |w_k|; a point at rest resists with any
    force up to m_k, which makes a facet of the surface. See Goyal, Ruina and Papadopoulos (1991),
    doi:10.1016/0043-1648(91)90104-3.

    Attributes:
        points: Support points about the reference point [m], shape (n, 2).
        friction_limits: Friction each point can give, mu_k N_k [N], shape (n,).
        scaling: Characteristic length [m] and friction force [N].

    Raises:
        ShapeError: The shapes do not fit.
        NotFiniteError: A number is NaN or infinite.
        RangeError: A friction limit is negative.
        GeometryError: There is no point, or no point carries any friction.
    """

    kind: ClassVar[str] = "point_contacts"
    arrays: ClassVar[tuple[FileArray, ...]] = (
        FileArray("points", (None, 2)),
        FileArray("friction_limits", ("points",), at_least=0.0),
    )
    wrench_is_closed: ClassVar[bool] = True

    points: Floats
    friction_limits: Floats
    scaling: Scaling = field(default_factory=Scaling)

    def __post_init__(self) -> None:
        """Check the arrays."""
        points = as_floats("points", self.points).copy()
        limits = as_floats("friction_limits", self.friction_limits).copy()
        if points.size == 0:
            raise GeometryError("a body needs at least one support point, got none")
        if points.ndim != 2 or points.shape[1] != 2:
            raise ShapeError(f"points must have shape (n, 2), got {points.shape}")
        if limits.shape != (len(points),):
            raise ShapeError(
                f"friction_limits must have shape ({len(points)},), one for each point, "
                f"got {limits.shape}"
            )
        if not (limits >= 0.0).all():
            raise RangeError(f"friction_limits must not be negative, got {limits.min()}")
        if not limits.any():
            raise GeometryError("no support point carries friction: every limit is 0")
        for array in (points, limits):
            array.setflags(write=False)
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "friction_limits", limits)

    @property
    def size(self) -> int:
        """How many numbers define the shape: two coordinates and a limit for each point."""
        return 3 * len(self.points)

    @property
    def convex_because(self) -> str:
        """Why the surface is convex whatever its points are."""
        return SUM_OF_CONVEX_SETS

    @property
    def contact_points(self) -> tuple[Floats, Floats]:
        """The support points (n, 2) [m] and their friction limits (n,) [N]."""
        return self.points, self.friction_limits

    def dissipation(self) -> Dissipation:
        """Return the same surface as a `Dissipation` with one matrix of rank two per point."""
        return Dissipation(self.scaled_forms, self.scaling)

    @property
    def scaled_forms(self) -> Floats:
        """The matrices m_k^2 J_k' J_k with w_k = J_k v, in scaled variables, shape (k, 3, 3)."""
        sliding = self.friction_limits > 0.0
        limits = self.friction_limits[sliding] / self.scaling.friction_force
        x, y = self.points[sliding].T / self.scaling.characteristic_length
        zeros, ones = np.zeros_like(x), np.ones_like(x)
        forms = np.array([[ones, zeros, -y], [zeros, ones, x], [-y, x, x * x + y * y]])
        return np.asarray(np.moveaxis(forms * limits**2, -1, 0))

    def _under(self, scaling: Scaling, factor: float) -> dict[str, Any]:
        limits = self.friction_limits * factor
        limits.setflags(write=False)
        return {"points": self.points, "friction_limits": limits, "scaling": scaling}

    def _new_shape(self) -> _PointsShape:
        points = self.points / self.scaling.characteristic_length
        return _PointsShape(
            PointNormSum(points, self.friction_limits / self.scaling.friction_force)
        )


class _PointsShape(DissipationShape):
    """The shape of support points."""

    def __init__(self, gauge: PointNormSum) -> None:
        few = len(gauge.limits) <= FEW_TERMS
        super().__init__(gauge, NormSumScalar(gauge.roots()) if few else None)
        self._points = gauge

    @cached_property
    def solver(self) -> SupportSolver:
        """Finds the motions of loads."""
        return points_solver(self._points)
