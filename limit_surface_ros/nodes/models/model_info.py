# SPDX-License-Identifier: Apache-2.0
"""Models as `~/list_models` and `~/describe_model` tell of them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np
import yaml
from limit_surface_interfaces.msg import DecayInfo, ModelInfo

from limit_surface_ros.files.model_set import Model
from limit_surface_ros.files.yaml_reader import plain

if TYPE_CHECKING:
    from collections.abc import Callable

    from limit_surface_ros.files.decay_file import DecayModel
    from limit_surface_ros.files.model_set import ModelSet
    from limit_surface_ros.files.surface_file import SurfaceModel

Info = TypeVar("Info", ModelInfo, DecayInfo)


class ModelList(Generic[Model, Info]):
    """The list of the models that are served, made anew when others are.

    Args:
        describe: Makes the message for a model, told whether it is the default.
    """

    def __init__(self, describe: Callable[[Model, bool], Info]) -> None:
        """List nothing yet."""
        self._describe = describe
        self._made_from: tuple[Any, ...] = ()
        self._infos: list[Info] = []

    def infos(self, models: ModelSet[Model], policy: object = None) -> list[Info]:
        """Return the messages of the models, the default's first.

        Args:
            models: The models.
            policy: What else the messages depend on.
        """
        made_from = (models, policy)
        if not self._made_from or any(
            now is not then for now, then in zip(made_from, self._made_from, strict=True)
        ):
            infos = [self._describe(model, model.name == models.default) for model in models]
            self._infos = sorted(infos, key=lambda info: not info.is_default)
            self._made_from = made_from
        return self._infos


def surface_info(model: SurfaceModel, is_default: bool, frame: str) -> ModelInfo:
    """Return the message for one limit surface that is served in a frame."""
    surface, scaling = model.surface, model.surface.scaling
    return ModelInfo(
        name=model.name,
        kind=surface.kind,
        terms=surface.terms,
        frame_id=frame,
        reference_point=list(model.reference_point),
        characteristic_length=scaling.characteristic_length,
        friction_force=scaling.friction_force,
        normal_force=math.nan if model.normal_force is None else model.normal_force,
        is_default=is_default,
        convex=model.convexity.convex,
    )


def surface_summary(model: SurfaceModel, frame: str) -> str:
    """Return what a person would check of one limit surface, as lines of YAML."""
    surface, scaling = model.surface, model.surface.scaling
    limits = surface.wrench_of_twist(np.concatenate([np.eye(3), -np.eye(3)[:2]]))
    x, y = model.reference_point
    lines = [
        f"kind: {surface.kind}",
        f"terms: {surface.terms}",
        f"frame: {frame}",
        f"reference_point: [{x:.6g}, {y:.6g}]  # [m] in the frame",
        f"characteristic_length: {scaling.characteristic_length:.6g}  # rho [m]",
        f"friction_force: {scaling.friction_force:.6g}  # F0, the scale of forces [N]",
        f"limit_along_x: [{limits[3, 0]:.6g}, {limits[0, 0]:.6g}]  # [N]",
        f"limit_along_y: [{limits[4, 1]:.6g}, {limits[1, 1]:.6g}]  # [N]",
        f"largest_moment: {limits[2, 2]:.6g}  # about the reference point [N m]",
        "normal_force: "
        + (
            "null  # not stated"
            if model.normal_force is None
            else f"{model.normal_force:.6g}  # [N]"
        ),
        f"convex: {str(model.convexity.convex).lower()}",
    ]
    return "\n".join(lines)


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
    )


def decay_summary(model: DecayModel) -> str:
    """Return what a person would check of one decay model, as lines of YAML."""
    sum_ = model.sum
    lines = [
        "kind: exponential_sum",
        f"terms: {sum_.terms}",
        f"onset_value: {sum_.start:.6g}",
        f"slowest_rate: {sum_.slowest_rate:.6g}  # [1/s]",
        f"max_error: {model.max_error:.6g}",
        f"time_span: [{model.time_span[0]:.6g}, {model.time_span[1]:.6g}]  # [s]",
    ]
    return "\n".join(lines)


def provenance(model: SurfaceModel | DecayModel) -> str:
    """Return how a model came about as YAML; nothing for nothing."""
    if not model.fit:
        return ""
    return str(yaml.safe_dump(plain(dict(model.fit)), sort_keys=False))
