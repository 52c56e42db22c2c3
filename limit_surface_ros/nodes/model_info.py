"""A surface model as `~/list_models` tells of it."""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING

import yaml
from limit_surface_interfaces.msg import ModelInfo

from limit_surface_ros.files.yaml_reader import plain
from limit_surface_ros.surface.convexity import is_convex

if TYPE_CHECKING:
    from limit_surface_ros.files.surface_file import SurfaceModel
    from limit_surface_ros.surface.protocol import LimitSurface

# What counts the terms of a kind, by the attribute that holds them.
_TERMS = ("matrices", "points", "coefficients")


# Where no theorem decides, thousands of directions are looked at: once for each surface.
@functools.lru_cache(maxsize=64)
def _is_convex(surface: LimitSurface) -> bool:
    return is_convex(surface).convex


def model_info(model: SurfaceModel, is_default: bool) -> ModelInfo:
    """Return the message for one model."""
    surface, scaling = model.surface, model.surface.scaling
    terms = next(len(getattr(surface, key)) for key in _TERMS if hasattr(surface, key))
    return ModelInfo(
        name=model.name,
        kind=surface.kind,
        terms=terms,
        frame_id=model.frame_id,
        reference_point=list(model.reference_point),
        characteristic_length=scaling.characteristic_length,
        friction_force=scaling.friction_force,
        normal_force=math.nan if model.normal_force is None else model.normal_force,
        is_default=is_default,
        convex=_is_convex(surface),
        fit=yaml.safe_dump(plain(dict(model.fit)), sort_keys=False) if model.fit else "",
    )
