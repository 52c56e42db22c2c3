# SPDX-License-Identifier: Apache-2.0
"""Fitted surfaces on disk, keyed by what they were made with: a run can be resumed."""

from __future__ import annotations

import hashlib
import json
import warnings
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from limit_surface_ros import __version__
from limit_surface_ros.errors import FileError
from limit_surface_ros.files.surface_file import (
    SurfaceModel,
    read_surface_model,
    write_surface_model,
)
from limit_surface_ros.surface.convexity import NotConvexWarning

if TYPE_CHECKING:
    from collections.abc import Callable
    from concurrent.futures import Executor

    from limit_surface_ros.thesis.settings import Settings


@dataclass(frozen=True)
class Store:
    """A folder of finished figures and fitted surfaces.

    Attributes:
        folder: Where everything goes.
        settings: How much work goes into the figures.
        executor: Where the starts of a fit run; None: in this process.
        on_fit: Called with the name of each fit that is done or was there.
    """

    folder: Path
    settings: Settings
    executor: Executor | None = None
    on_fit: Callable[[str], None] = field(default=lambda name: None)

    def surface(self, name: str, fit: Callable[[], SurfaceModel]) -> SurfaceModel:
        """Return a fitted surface from its file, or fit it and write the file.

        Args:
            name: Of the model and its file under `models/`.
            fit: Makes the model if it is not there, or was made with other settings.
        """
        path = self.folder / "models" / f"{name}.yaml"
        key = self.key(name)
        model = _read_if_there(path)
        if model is None or model.fit.get("key") != key:
            made = fit()
            model = SurfaceModel(name, made.surface, fit={**made.fit, "key": key})
            path.parent.mkdir(parents=True, exist_ok=True)
            write_surface_model(model, path)
        self.on_fit(name)
        return model

    def key(self, name: str) -> str:
        """Return what changes whenever the result may: name, settings, version."""
        parameters = json.dumps([name, asdict(self.settings), __version__])
        return hashlib.sha256(parameters.encode()).hexdigest()[:16]


def _read_if_there(path: Path) -> SurfaceModel | None:
    try:
        with warnings.catch_warnings():
            # Some of the thesis's fits are not convex; that is a finding here and no surprise.
            warnings.simplefilter("ignore", NotConvexWarning)
            return read_surface_model(path)
    except FileError:
        return None
