# SPDX-License-Identifier: Apache-2.0
"""Models as `~/list_models` tells of them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import yaml
from limit_surface_interfaces.msg import DecayInfo, ModelInfo

from limit_surface_ros.files.model_set import Model
from limit_surface_ros.files.yaml_reader import plain

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from limit_surface_ros.files.decay_file import DecayModel
    from limit_surface_ros.files.model_set import ModelSet
    from limit_surface_ros.files.surface_file import SurfaceModel

Info = TypeVar("Info", ModelInfo, DecayInfo)


class Listing(Generic[Model, Info]):
    """The list of the models that are served, made anew when others are.

    Args:
        describe: Makes the message for a model, told whether it is the default.
    """

    def __init__(self, describe: Callable[[Model, bool], Info]) -> None:
        """List nothing yet."""
        self._describe = describe
        self._models: ModelSet[Model] | None = None
        self._infos: list[Info] = []

    def of(self, models: ModelSet[Model]) -> list[Info]:
        """Return the messages of the models, the default's first."""
        if models is not self._models:
            infos = [self._describe(model, model.name == models.default) for model in models]
            self._infos = sorted(infos, key=lambda info: not info.is_default)
            self._models = models
        return self._infos


def model_info(model: SurfaceModel, is_default: bool) -> ModelInfo:
    """Return the message for one limit surface."""
    surface, scaling = model.surface, model.surface.scaling
    return ModelInfo(
        name=model.name,
        kind=surface.kind,
        terms=surface.terms,
        frame_id=model.frame_id,
        reference_point=list(model.reference_point),
        characteristic_length=scaling.characteristic_length,
        friction_force=scaling.friction_force,
        normal_force=math.nan if model.normal_force is None else model.normal_force,
        is_default=is_default,
        convex=model.convexity.convex,
        fit=_text(model.fit),
    )


def decay_info(model: DecayModel, is_default: bool) -> DecayInfo:
    """Return the message for one decay model."""
    return DecayInfo(
        name=model.name,
        terms=model.sum.terms,
        onset_value=model.sum.start,
        slowest_rate=model.sum.slowest_rate,
        bound=model.max_error,
        bound_from=model.time_span[0],
        bound_until=model.time_span[1],
        is_default=is_default,
        fit=_text(model.fit),
    )


def _text(fit: Mapping[str, Any]) -> str:
    """Return how a model came about as YAML; nothing for nothing."""
    return yaml.safe_dump(plain(dict(fit)), sort_keys=False) if fit else ""
