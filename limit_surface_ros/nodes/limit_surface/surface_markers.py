# SPDX-License-Identifier: Apache-2.0
"""What the `limit_surface` node shows in RViz, made and sent only while somebody looks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from visualization_msgs.msg import Marker, MarkerArray

from limit_surface_ros.nodes.limit_surface import markers
from limit_surface_ros.nodes.serving.settings import Setting

if TYPE_CHECKING:
    from collections.abc import Callable

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.files.surface_file import SurfaceModel
    from limit_surface_ros.nodes.models.model_node import ModelNode
    from limit_surface_ros.nodes.serving.parameters import Values
    from limit_surface_ros.surface.base import LimitSurface

TOPIC = "surface"
SETTINGS = (
    Setting(
        "marker_scale",
        0.0,
        "Size of loads in the markers on ~/surface: metres to the newton, moments divided by the "
        "characteristic length first [m/N]; 0: the surface about as large as the body",
        minimum=0.0,
        maximum=1e6,
    ),
    Setting(
        "marker_rate",
        10.0,
        "How often ~/surface is brought up to date at most [Hz]",
        minimum=0.1,
        maximum=100.0,
    ),
)


class Load(NamedTuple):
    """The last load that the node was asked about.

    Attributes:
        model: The model that answered.
        surface: Its surface at the normal force of that load.
        wrench: About the model's reference point, shape (3,), [N, N, N m].
        frame: In which the model is served.
    """

    model: SurfaceModel
    surface: LimitSurface
    wrench: Floats
    frame: str


class SurfaceMarkers:
    """Publishes `~/surface` when there is somebody to see it and something new to be seen.

    Args:
        node: The node.
        present: Gives the default model, its surface at the present normal force, and its frame.
    """

    def __init__(
        self,
        node: ModelNode[SurfaceModel],
        present: Callable[[], tuple[SurfaceModel, LimitSurface, str]],
    ) -> None:
        """Advertise the topic and look after it."""
        self._node = node
        self._present = present
        self._output = node.endpoints.add_output(MarkerArray, TOPIC, latched=True)
        self._load: Load | None = None
        self._load_is_new = False
        self._seen: Any = None
        self._watchers = 0
        self._timer = node.create_timer(1.0, self._update)
        node.values.on_change(["marker_rate"], self._prepare_timer)

    def note(self, model: SurfaceModel, surface: LimitSurface, wrench: Floats, frame: str) -> None:
        """Remember the last load; it costs nothing while nobody looks."""
        self._load = Load(model, surface, wrench, frame)
        self._load_is_new = True

    def _update(self) -> None:
        watchers = self._output.get_subscription_count()
        joined, self._watchers = watchers > self._watchers, watchers
        if not watchers:
            return
        if self._load is not None and all(
            model is not self._load.model for model in self._node.host.models
        ):
            # What a model answered that is no longer served says nothing about the present ones.
            self._load = None
        try:
            model, surface, frame = self._present()
            if self._load is not None:
                model, surface, frame = self._load.model, self._load.surface, self._load.frame
            canvas = markers.Canvas.of(model, self._node.values["marker_scale"], frame)
            shown = (model, surface.scaling, canvas)
            if joined or shown != self._seen:
                self._output.publish(markers.array_of(self._everything(canvas, surface)))
                self._seen = shown
            elif self._load_is_new:
                self._output.publish(markers.array_of(self._load_markers(canvas)))
            self._load_is_new = False
        except Exception as error:
            # What cannot be shown must not end the node.
            self._node.report("surface marker", f"nothing to show on ~/{TOPIC}: {error}")

    def _everything(self, canvas: markers.Canvas, surface: LimitSurface) -> list[Marker]:
        forget = Marker(action=Marker.DELETEALL)
        forget.header.frame_id = canvas.frame
        return [
            forget,
            markers.surface_marker(canvas, surface),
            markers.contact_marker(canvas),
            *self._load_markers(canvas),
        ]

    def _load_markers(self, canvas: markers.Canvas) -> list[Marker]:
        if self._load is None:
            return []
        model, surface, wrench, _ = self._load
        if not wrench.any():
            return [markers.removal(canvas, name) for name in markers.OF_A_LOAD]
        factor = float(surface.load_factor(wrench))
        slides = factor >= 1.0
        twist = surface.twist_of_wrench(wrench) if slides else np.zeros(3)
        known = slides and model.uncertain is not None
        region = model.uncertain.border(wrench) if known else np.empty((0, 3))
        return markers.load_markers(canvas, wrench, wrench / factor, twist, region)

    def _prepare_timer(self, values: Values) -> Callable[[], None]:
        period = round(1e9 / values["marker_rate"])

        def apply() -> None:
            self._timer.timer_period_ns = period

        return apply
