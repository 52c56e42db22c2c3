# SPDX-License-Identifier: Apache-2.0
"""Contact patches: shape and pressure, apart from the weight and the friction that scale them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_floats, as_positive
from limit_surface_ros.errors import GeometryError, RangeError, ShapeError
from limit_surface_ros.surface.contact.pressure import uniform
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.scaling import Scaling

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.contact.pressure import Pressure
    from limit_surface_ros.surface.contact.shapes import Cells


@dataclass(frozen=True, eq=False)
class ContactPatch:
    """Where a body presses on the ground, and with what share of its weight.

    Attributes:
        points: Points of contact [m], shape (n, 2).
        shares: Share of the normal force that each carries, adding up to 1, shape (n,).
        centroid: Centroid of the shape [m], shape (2,): the usual reference point.
    """

    points: Floats
    shares: Floats
    centroid: Floats

    @classmethod
    def of_shape(cls, cells: Cells, pressure: Pressure = uniform) -> ContactPatch:
        """Return the patch of a shape under a pressure distribution.

        Args:
            cells: The shape; see `surface.contact.shapes`.
            pressure: Relative pressures of the cells; see `surface.contact.pressure`.

        Raises:
            ShapeError: The pressure does not give one number for each cell.
            RangeError: A pressure is negative.
            GeometryError: No cell carries any pressure.
        """
        pressures = as_floats("pressure", pressure(cells))
        if pressures.shape != cells.sizes.shape:
            raise ShapeError(
                f"a pressure must give one number for each of {len(cells.sizes)} cells, "
                f"got shape {pressures.shape}"
            )
        if not (pressures >= 0.0).all():
            raise RangeError(f"a pressure must not be negative, got {pressures.min()}")
        forces = cells.sizes * pressures
        if not forces.any():
            raise GeometryError("the patch carries no load: its pressure is 0 everywhere")
        return cls(cells.points, forces / forces.sum(), cells.centroid)

    @property
    def centre_of_pressure(self) -> Floats:
        """Centre of the normal force [m], shape (2,)."""
        return np.asarray(self.shares @ self.points)

    def surface(
        self,
        friction_coefficient: float,
        normal_force: float,
        reference_point: ArrayLike | None = None,
    ) -> PointContacts:
        """Return the limit surface under a weight.

        Its friction force scale is mu N and its characteristic length the mean distance of the
        pressure from the reference point, so that another weight is `with_friction_force`.

        Args:
            friction_coefficient: mu.
            normal_force: N [N].
            reference_point: About which moments are taken [m]; the centroid if not given.

        Raises:
            RangeError: The coefficient or the force is not a finite number above zero.
            ShapeError: The reference point is no pair of numbers.
        """
        mu = as_positive("friction_coefficient", friction_coefficient)
        force = as_positive("normal_force", normal_force)
        chosen = self.centroid if reference_point is None else reference_point
        reference = as_floats("reference_point", chosen)
        if reference.shape != (2,):
            raise ShapeError(f"reference_point must be two numbers, got shape {reference.shape}")
        points = self.points - reference
        limits = mu * force * self.shares
        return PointContacts(points, limits, natural_scaling(points, limits))


def natural_scaling(points: ArrayLike, friction_limits: ArrayLike) -> Scaling:
    """Return the scales of support points: total friction, and its mean arm.

    With them the largest force and the moment of a pure rotation are both 1. A body on one point
    at the reference has no arm; its characteristic length is 1 m.

    Args:
        points: Support points about the reference point [m], shape (n, 2).
        friction_limits: Friction that each point can give [N], shape (n,).
    """
    limits = as_floats("friction_limits", friction_limits)
    arms = np.linalg.norm(as_floats("points", points), axis=-1)
    total = float(limits.sum())
    arm = float(limits @ arms) / as_positive("total friction", total)
    return Scaling(arm if arm > 0.0 else 1.0, total)
