# SPDX-License-Identifier: Apache-2.0
"""The `limit_surface` node: wrench to twist and twist to wrench over services and topics."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from geometry_msgs.msg import TwistStamped, WrenchStamped
from limit_surface_interfaces.srv import (
    ListModels,
    Push,
    TwistsToWrenches,
    TwistToWrench,
    WrenchesToTwists,
    WrenchToTwist,
)

from limit_surface_ros.files.surface_file import SurfaceModel, read_surface_model
from limit_surface_ros.motion.push import push
from limit_surface_ros.nodes import convert, frames, planar_inputs, surface_markers
from limit_surface_ros.nodes.model_host import model_settings
from limit_surface_ros.nodes.model_info import Listing, model_info
from limit_surface_ros.nodes.model_node import ModelNode
from limit_surface_ros.nodes.planar_inputs import PlanarInputs
from limit_surface_ros.nodes.settings import Setting
from limit_surface_ros.nodes.surface_markers import SurfaceMarkers
from limit_surface_ros.surface.frames import power

if TYPE_CHECKING:
    from std_msgs.msg import Header

    from limit_surface_ros.surface.base import LimitSurface

NAME = "limit_surface"
SETTINGS = (
    *model_settings("config/models", "limit surfaces"),
    Setting(
        "max_batch_rows",
        1_000_000,
        "Rows of a batch that are answered at once; nothing else is answered meanwhile",
        minimum=1,
        maximum=1_000_000_000,
    ),
    *frames.SETTINGS,
    *planar_inputs.SETTINGS,
    *surface_markers.SETTINGS,
)


class LimitSurfaceNode(ModelNode[SurfaceModel]):
    """Serves the two maps of limit surfaces.

    Args:
        options: Passed on to `rclpy.node.Node`.

    Raises:
        LimitSurfaceError: A parameter or a model file is not accepted.
        ParameterException: A parameter has the wrong type or lies outside its range.
    """

    def __init__(self, **options: Any) -> None:
        """Read the models and start serving."""
        super().__init__(NAME, SETTINGS, read_surface_model, **options)
        self._listing = Listing(model_info)
        self._inputs = PlanarInputs(self.values, frames.Frames(self, self.values), self.report)
        self._markers = SurfaceMarkers(self, self._present)
        self._twists = self.add_output(TwistStamped, "predicted_twist")
        self._wrenches = self.add_output(WrenchStamped, "required_wrench")
        self.add_service(WrenchToTwist, "wrench_to_twist", self._wrench_to_twist)
        self.add_service(TwistToWrench, "twist_to_wrench", self._twist_to_wrench)
        self.add_service(WrenchesToTwists, "wrenches_to_twists", self._wrenches_to_twists)
        self.add_service(TwistsToWrenches, "twists_to_wrenches", self._twists_to_wrenches)
        self.add_service(Push, "push", self._push)
        self.add_service(ListModels, "list_models", self._list_models)
        self.add_input(WrenchStamped, "wrench", self._predict)
        self.add_input(TwistStamped, "twist", self._require)

    def _present(self) -> tuple[SurfaceModel, LimitSurface]:
        model = self.models[""]
        return model, self._inputs.surface(model)

    def _wrench_to_twist(
        self, request: WrenchToTwist.Request, response: WrenchToTwist.Response
    ) -> None:
        model = self.models[request.model]
        load = self._inputs.wrench(model, request.wrench)
        surface = load.surface
        self._markers.note(model, surface, load.vector)
        twist, factor = surface.twist_and_load_factor(load.vector)
        convert.fill_twist(response.twist.twist, twist)
        convert.fill_wrench(response.limit_wrench.wrench, load.vector / factor)
        response.load_factor = float(factor)
        response.slides = bool(factor >= 1.0)
        for stamped in (response.twist, response.limit_wrench):
            _head(stamped.header, request.wrench.header, model)

    def _twist_to_wrench(
        self, request: TwistToWrench.Request, response: TwistToWrench.Response
    ) -> None:
        model = self.models[request.model]
        motion = self._inputs.twist(model, request.twist)
        wrench = motion.surface.wrench_of_twist(motion.vector)
        convert.fill_wrench(response.wrench.wrench, wrench)
        response.power = float(wrench @ motion.vector)
        _head(response.wrench.header, request.twist.header, model)

    def _wrenches_to_twists(
        self, request: WrenchesToTwists.Request, response: WrenchesToTwists.Response
    ) -> None:
        surface = self._inputs.surface(self.models[request.model])
        wrenches = convert.rows_of("wrenches", request.wrenches, self.values["max_batch_rows"])
        twists, factors = surface.twist_and_load_factor(wrenches)
        response.twists, response.load_factors = convert.flat_of(twists), convert.flat_of(factors)

    def _twists_to_wrenches(
        self, request: TwistsToWrenches.Request, response: TwistsToWrenches.Response
    ) -> None:
        surface = self._inputs.surface(self.models[request.model])
        twists = convert.rows_of("twists", request.twists, self.values["max_batch_rows"])
        wrenches = surface.wrench_of_twist(twists)
        response.wrenches = convert.flat_of(wrenches)
        response.powers = convert.flat_of(power(wrenches, twists))

    def _push(self, request: Push.Request, response: Push.Response) -> None:
        model = self.models[request.model]
        contact = self._inputs.contact(model, request)
        pushed = push(self._inputs.surface(model), *contact)
        convert.fill_twist(response.twist.twist, pushed.twist)
        convert.fill_wrench(response.wrench.wrench, pushed.wrench)
        response.mode = pushed.mode.value
        for stamped in (response.twist, response.wrench):
            _head(stamped.header, request.contact.header, model)

    def _list_models(self, _: ListModels.Request, response: ListModels.Response) -> None:
        response.models = self._listing.of(self.models.models)

    def _predict(self, message: WrenchStamped) -> None:
        model = self.models[""]
        load = self._inputs.wrench(model, message)
        self._markers.note(model, load.surface, load.vector)
        answer = TwistStamped()
        if load.surface.load_factor(load.vector) >= 1.0:
            convert.fill_twist(answer.twist, load.surface.twist_of_wrench(load.vector))
        _head(answer.header, message.header, model)
        self._twists.publish(answer)

    def _require(self, message: TwistStamped) -> None:
        model = self.models[""]
        motion = self._inputs.twist(model, message)
        answer = WrenchStamped()
        convert.fill_wrench(answer.wrench, motion.surface.wrench_of_twist(motion.vector))
        _head(answer.header, message.header, model)
        self._wrenches.publish(answer)


def _head(header: Header, asked: Header, model: SurfaceModel) -> None:
    """Answers keep the stamp that they answer and stand in the model's frame."""
    header.stamp = asked.stamp
    header.frame_id = model.frame_id
