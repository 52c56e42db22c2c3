# SPDX-License-Identifier: Apache-2.0
"""Mirror symmetry of a contact: which axes through the reference point mirror its loads."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.surface.sampling import random_directions

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.kinds.point_contacts import PointContacts

# What a mirror about an axis does to (vx, vy, omega) and to (fx, fy, tau): a turn and a moment
# change their sense, and so does the component across the axis.
MIRRORS: dict[str, Floats] = {"x": np.array([1.0, -1.0, -1.0]), "y": np.array([-1.0, 1.0, -1.0])}
# Relative difference of dissipation below which two motions are mirror images: more than cells of
# a patch differ by, less than any body that is built to differ.
_ALIKE = 1e-3
_MOTIONS = 100


def mirror_axes(contacts: PointContacts) -> tuple[str, ...]:
    """Return the axes about which the limit surface is its own mirror image.

    Args:
        contacts: A body's contact; the mirrors pass its reference point.

    Returns:
        Of "x" and "y" those about which the body is symmetric, the one along which its friction
        spreads more first.
    """
    twists = random_directions(_MOTIONS, 0) * contacts.scaling.twist_unit
    power = np.sum(contacts.wrench_of_twist(twists) * twists, axis=1)
    axes = []
    for axis, mirror in MIRRORS.items():
        images = twists * mirror
        mirrored = np.sum(contacts.wrench_of_twist(images) * images, axis=1)
        if (np.abs(mirrored - power) <= _ALIKE * power.max()).all():
            axes.append(axis)
    spread = dict(zip(MIRRORS, contacts.friction_limits @ contacts.points**2, strict=True))
    return tuple(sorted(axes, key=lambda axis: -float(spread[axis])))
