# SPDX-License-Identifier: Apache-2.0
"""The kinds of limit surface: the one place that knows them all.

A kind declares itself on its class (see `surface.base.LimitSurface`): files, nodes, pictures and
programs ask the surface, and never which kind it is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from limit_surface_ros.errors import RangeError
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.polynomial import Polynomial
from limit_surface_ros.surface.kinds.power_sum import PowerSum

if TYPE_CHECKING:
    from limit_surface_ros.surface.base import LimitSurface

Kind = TypeVar("Kind", bound="type[LimitSurface]")

# By the name that model files give.
KINDS: dict[str, type[LimitSurface]] = {}


def register(kind: Kind) -> Kind:
    """Make a kind known to model files, and so to nodes and programs; also as a decorator.

    Args:
        kind: The class.

    Raises:
        RangeError: Another class has its name.
    """
    if KINDS.setdefault(kind.kind, kind) is not kind:
        raise RangeError(f"there is a kind {kind.kind!r} already: {KINDS[kind.kind].__name__}")
    return kind


for _kind in (PowerSum, Dissipation, PointContacts, Polynomial):
    register(_kind)
