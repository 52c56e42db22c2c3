# SPDX-License-Identifier: Apache-2.0
"""Limit surfaces: contact patches, the model family, its maps, and measures of error.

The kinds of surface and what they are made from and judged by are imported from here; the rest
from its own module.
"""

from limit_surface_ros.surface.base import LimitSurface
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.polynomial import Polynomial
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.pairs import Pairs
from limit_surface_ros.surface.scaling import Scaling

__all__ = [
    "Dissipation",
    "LimitSurface",
    "Pairs",
    "PointContacts",
    "Polynomial",
    "PowerSum",
    "Scaling",
]
