# SPDX-License-Identifier: Apache-2.0
"""A surface as a MuJoCo model: a body on a few spheres that resists as the surface does."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.export.simulators import fit_spheres
from limit_surface_ros.export.texts import filled, identifier

if TYPE_CHECKING:
    from limit_surface_ros.surface.base import LimitSurface

# Standard gravity [m/s^2].
GRAVITY = 9.80665
# Friction coefficient that is assumed where no normal force is known.
_ASSUMED_FRICTION = 0.5
# Radius of the spheres in parts of the characteristic length; where they touch is all that counts.
_RADIUS = 0.05


def mujoco_model(
    surface: LimitSurface, name: str, title: str, normal_force: float | None, spheres: int
) -> str:
    """Return an MJCF file: the plane, and the body on its spheres.

    The centre of mass lies where the spheres carry their shares of the weight: with three that is
    certain, with more it is one of the ways in which they can share it, and the simulator may
    find another as the body moves.

    Args:
        surface: The body.
        name: Of the model and the body.
        title: The first line of the comment on top.
        normal_force: What presses the body down [N]; None assumes a friction coefficient of 0.5.
        spheres: How many.

    Raises:
        RangeError: The number of spheres is not 1 to 32.
    """
    fitted = fit_spheres(surface, spheres)
    total = float(fitted.limits.sum())
    weight = total / _ASSUMED_FRICTION if normal_force is None else normal_force
    friction = total / weight
    centre = fitted.limits @ fitted.points / total
    radius = _RADIUS * surface.scaling.characteristic_length
    # A thin plate of the radius of the contact, for want of a better guess.
    gyration = np.sqrt((fitted.limits @ np.square(fitted.points - centre)).sum() / total)
    mass = weight / GRAVITY
    around = max(float(mass * gyration**2), 1e-9 * mass)
    geoms = "\n".join(
        f'      <geom class="foot" pos="{x!r} {y!r} {radius!r}"/>'
        for x, y in fitted.points.tolist()
    )
    assumed = "" if normal_force is not None else " (assumed: the model states no normal force)"
    return filled(
        "mujoco.xml",
        {
            "TITLE": title,
            "AUDIT": str(fitted.audit),
            "NAME": identifier(name),
            "COUNT": str(len(fitted.points)),
            "RADIUS": repr(radius),
            "FRICTION": repr(friction),
            "TORSION": repr(friction * fitted.torsion_length),
            "MASS": repr(mass),
            "CENTRE": f"{float(centre[0])!r} {float(centre[1])!r} {radius!r}",
            "INERTIA": f"{0.5 * around!r} {0.5 * around!r} {around!r}",
            "WEIGHT": f"{weight:.6g}",
            "ASSUMED": assumed,
            "GEOMS": geoms,
        },
    )
