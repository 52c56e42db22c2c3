# SPDX-License-Identifier: Apache-2.0
"""The `limit_surface` node: wrench to twist and twist to wrench over services and topics."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

from geometry_msgs.msg import TwistStamped, TwistWithCovarianceStamped, WrenchStamped
from limit_surface_interfaces.srv import (
    DescribeModel,
    ListModels,
    Push,
    TwistsToWrenches,
    TwistToWrench,
    WrenchesToTwists,
    WrenchToTwist,
)

from limit_surface_ros.files.surface_file import SurfaceModel, read_surface_model
from limit_surface_ros.motion.push import ContactMode, push
from limit_surface_ros.nodes.limit_surface import learning, push_services, surface_markers
from limit_surface_ros.nodes.limit_surface.push_markers import PushMarkers
from limit_surface_ros.nodes.limit_surface.surface_markers import SurfaceMarkers
from limit_surface_ros.nodes.messages import convert, frames, planar_input
from limit_surface_ros.nodes.messages.frames import Frames
from limit_surface_ros.nodes.messages.planar_input import (
    PlanarInput,
    covariance_at_origin,
    prepare_surface,
    rows_at_origin,
    twist_at_origin,
    wrench_at_origin,
)
from limit_surface_ros.nodes.models import model_info
from limit_surface_ros.nodes.models.model_host import model_settings
from limit_surface_ros.nodes.models.model_info import ModelList
from limit_surface_ros.nodes.models.model_node import COMMON_SETTINGS, ModelNode
from limit_surface_ros.nodes.serving import spin
from limit_surface_ros.nodes.serving.batches import Batches, empty_rows
from limit_surface_ros.nodes.serving.endpoints import STREAM_DEPTH, Service
from limit_surface_ros.nodes.serving.settings import Setting
from limit_surface_ros.surface.frames import power
from limit_surface_ros.surface.kinds.dissipation_scatter import region_quantile

if TYPE_CHECKING:
    from limit_surface_ros.surface.base import LimitSurface

NAME = "limit_surface"
HELP = """\
services of limit_surface:
  ~/wrench_to_twist, ~/wrenches_to_twists      motions that loads cause
  ~/twist_to_wrench, ~/twists_to_wrenches      loads that motions need
  ~/push, ~/simulate_push, ~/simulate_pushes   what pushes do to the body
  ~/linearise_push                             a push as a linear system, A and B
  ~/list_models, ~/describe_model, ~/reload    what is loaded
topics of limit_surface:
  ~/wrench -> ~/predicted_twist, ~/predicted_twist_with_covariance
  ~/twist -> ~/required_wrench
  ~/surface, ~/push, ~/push_path, /diagnostics
  with learn: ~/measured_wrench, ~/measured_twist; service ~/save_learnt
"""
# Of the region whose half-axes are answered, where a request asks for none.
PROBABILITY = 0.9
SETTINGS = (
    *model_settings("config/models", "limit surfaces"),
    Setting(
        "max_batch_rows",
        1_000_000,
        "Rows of a batch that are answered; others are served between its slices",
        minimum=1,
        maximum=10_000_000,
    ),
    *frames.SETTINGS,
    *learning.SETTINGS,
    *planar_input.SETTINGS,
    *surface_markers.SETTINGS,
)
MODES = {
    ContactMode.STICK: Push.Response.STICK,
    ContactMode.SLIDE_LEFT: Push.Response.SLIDE_LEFT,
    ContactMode.SLIDE_RIGHT: Push.Response.SLIDE_RIGHT,
    ContactMode.SEPARATE: Push.Response.SEPARATE,
}


class LimitSurfaceNode(ModelNode[SurfaceModel]):
    """Serves the two maps of limit surfaces.

    Attributes:
        input: Messages as its surfaces take them.
        batches: Runs what takes long.
        learner: Learns a model, None if the parameters do not ask for it.

    Args:
        buffer: What transforms are looked up in, in place of a tf2 buffer of the node's own.
        options: Passed on to `rclpy.node.Node`.

    Raises:
        LimitSurfaceError: A parameter or a model file is not accepted.
        ParameterException: A parameter has the wrong type or lies outside its range.
    """

    def __init__(self, *, buffer: Any = None, **options: Any) -> None:
        """Read the models and start serving."""
        # What describes the node asks for it before there is one.
        self.learner: learning.Learner | None = None
        super().__init__(NAME, SETTINGS, read_surface_model, prepare_surface, **options)
        self._list = ModelList(self._info)
        moved = Frames(self, self.values, buffer)
        self.input = PlanarInput(self.values, moved, self.report, self.host)
        self.batches = Batches(self.endpoints)
        self.markers = SurfaceMarkers(self, self._present)
        self.push_markers = PushMarkers(self)
        self._twists = self.endpoints.add_output(
            TwistStamped, "predicted_twist", depth=STREAM_DEPTH
        )
        self._scattered = self.endpoints.add_output(
            TwistWithCovarianceStamped, "predicted_twist_with_covariance", depth=STREAM_DEPTH
        )
        self._wrenches = self.endpoints.add_output(
            WrenchStamped, "required_wrench", depth=STREAM_DEPTH
        )
        for service in (*SERVICES, *push_services.SERVICES):
            self.endpoints.serve(service)
        self.endpoints.add_input(WrenchStamped, "wrench", self._predict)
        self.endpoints.add_input(TwistStamped, "twist", self._require)
        self.learner = self._learner()

    def describe(self) -> dict[str, str]:
        """Return what diagnostics say beside counts and times."""
        learner = self.learner.describe() if self.learner is not None else {}
        return super().describe() | learner

    def stand_in(self, default: str) -> str:
        """Return the prior of a default model that is going to be learnt."""
        return learning.prior_of(default, self.values)

    def destroy_node(self) -> None:
        """Stop learning, and the node."""
        if self.learner is not None:
            self.learner.close()
        super().destroy_node()

    def _learner(self) -> learning.Learner | None:
        if not self.values["learn"]:
            return None
        try:
            return learning.Learner(self)
        except Exception:
            super().destroy_node()
            raise

    def list_models(self, _: ListModels.Request, response: ListModels.Response) -> None:
        """Answer `~/list_models`."""
        response.models = self._list.infos(self.host.models, self.input.policy)

    def describe_model(
        self, request: DescribeModel.Request, response: DescribeModel.Response
    ) -> None:
        """Answer `~/describe_model`."""
        model = self.host.models[request.model]
        response.name = model.name
        response.summary = model_info.surface_summary(model, self.input.policy.frame_of(model))
        response.fit = model_info.provenance(model)

    def _info(self, model: SurfaceModel, is_default: bool) -> Any:
        return model_info.surface_info(model, is_default, self.input.policy.frame_of(model))

    def _present(self) -> tuple[SurfaceModel, LimitSurface, str]:
        model, policy = self.host.models[""], self.input.policy
        return model, policy.surface_of(model), policy.frame_of(model)

    async def _predict(self, message: WrenchStamped) -> None:
        model = self.host.models[""]
        surface, wrench, frame = await self.input.wrench(model, message)
        self.markers.note(model, surface, wrench, frame)
        answer = TwistStamped()
        slides = bool(surface.load_factor(wrench) >= 1.0)
        if slides:
            twist = surface.twist_of_wrench(wrench)
            convert.fill_twist(answer.twist, twist_at_origin(model, twist))
        convert.fill_header(answer.header, message.header, frame)
        self._twists.publish(answer)
        if model.uncertain is not None and self._scattered.get_subscription_count():
            scattered = TwistWithCovarianceStamped(header=answer.header)
            scattered.twist.twist = answer.twist
            if slides:
                covariance = model.uncertain.of_twist(wrench, twist).covariance
                scattered.twist.covariance = covariance_at_origin(model, covariance)
            self._scattered.publish(scattered)

    async def _require(self, message: TwistStamped) -> None:
        model = self.host.models[""]
        surface, twist, frame = await self.input.twist(model, message)
        answer = WrenchStamped()
        wrench = surface.wrench_of_twist(twist)
        convert.fill_wrench(answer.wrench, wrench_at_origin(model, wrench))
        convert.fill_header(answer.header, message.header, frame)
        self._wrenches.publish(answer)


async def wrench_to_twist(
    node: LimitSurfaceNode, request: WrenchToTwist.Request, response: WrenchToTwist.Response
) -> None:
    """Answer `~/wrench_to_twist`."""
    model = node.host.models[request.model]
    surface, wrench, frame = await node.input.wrench(model, request.wrench)
    node.markers.note(model, surface, wrench, frame)
    twist, factor = surface.twist_and_load_factor(wrench)
    convert.fill_twist(response.twist.twist, twist_at_origin(model, twist))
    limit = wrench_at_origin(model, wrench / factor)
    convert.fill_wrench(response.limit_wrench.wrench, limit)
    response.load_factor = float(factor)
    response.slides = bool(factor >= 1.0)
    if model.uncertain is not None:
        answer = model.uncertain.of_twist(wrench, twist, request.probability or PROBABILITY)
        response.has_covariance = True
        response.covariance = convert.finite_rows(
            "covariance", covariance_at_origin(model, answer.covariance)
        )
        response.half_axes = convert.finite_rows("half_axes", answer.half_axes)
    elif request.probability:
        region_quantile(request.probability)
    for stamped in (response.twist, response.limit_wrench):
        convert.fill_header(stamped.header, request.wrench.header, frame)


async def twist_to_wrench(
    node: LimitSurfaceNode, request: TwistToWrench.Request, response: TwistToWrench.Response
) -> None:
    """Answer `~/twist_to_wrench`."""
    model = node.host.models[request.model]
    surface, twist, frame = await node.input.twist(model, request.twist)
    wrench = surface.wrench_of_twist(twist)
    convert.fill_wrench(response.wrench.wrench, wrench_at_origin(model, wrench))
    response.power = float(wrench @ twist)
    convert.fill_header(response.wrench.header, request.twist.header, frame)


async def wrenches_to_twists(
    node: LimitSurfaceNode,
    request: WrenchesToTwists.Request,
    response: WrenchesToTwists.Response,
) -> None:
    """Answer `~/wrenches_to_twists`."""
    model, policy = node.host.models[request.model], node.input.policy
    rows = convert.rows_of("wrenches", request.wrenches, node.values["max_batch_rows"])
    there = await node.input.rows_matrix("wrench", model, request.header)
    back = rows_at_origin("twist", model)
    surface = policy.surface_of(model)
    flat_twists, twists = empty_rows(len(rows), 3)
    flat_factors, factors = empty_rows(len(rows), 1)

    def work(part: slice) -> None:
        wrenches = convert.checked_rows("wrenches", rows[part], part.start)
        wrenches = wrenches if there is None else wrenches @ there
        found, found_factors = surface.twist_and_load_factor(wrenches)
        found = found if back is None else found @ back
        twists[part] = convert.finite_rows("twists", found, part.start)
        factors[part] = convert.finite_rows("load_factors", found_factors, part.start)

    await node.batches.run("wrenches_to_twists", surface.shape, len(rows), work)
    response.twists, response.load_factors = flat_twists, flat_factors
    convert.fill_header(response.header, request.header, policy.frame_of(model))


async def twists_to_wrenches(
    node: LimitSurfaceNode,
    request: TwistsToWrenches.Request,
    response: TwistsToWrenches.Response,
) -> None:
    """Answer `~/twists_to_wrenches`."""
    model, policy = node.host.models[request.model], node.input.policy
    rows = convert.rows_of("twists", request.twists, node.values["max_batch_rows"])
    there = await node.input.rows_matrix("twist", model, request.header)
    back = rows_at_origin("wrench", model)
    surface = policy.surface_of(model)
    flat_wrenches, wrenches = empty_rows(len(rows), 3)
    flat_powers, powers = empty_rows(len(rows), 1)

    def work(part: slice) -> None:
        twists = convert.checked_rows("twists", rows[part], part.start)
        twists = twists if there is None else twists @ there
        found = surface.wrench_of_twist(twists)
        powers[part] = convert.finite_rows("powers", power(found, twists), part.start)
        found = found if back is None else found @ back
        wrenches[part] = convert.finite_rows("wrenches", found, part.start)

    await node.batches.run("twists_to_wrenches", surface.shape, len(rows), work)
    response.wrenches, response.powers = flat_wrenches, flat_powers
    convert.fill_header(response.header, request.header, policy.frame_of(model))


async def push_at_a_point(
    node: LimitSurfaceNode, request: Push.Request, response: Push.Response
) -> None:
    """Answer `~/push`."""
    model, policy = node.host.models[request.model], node.input.policy
    contact = await node.input.contact(model, request)
    pushed = push(policy.surface_of(model), *contact)
    convert.fill_twist(response.twist.twist, twist_at_origin(model, pushed.twist))
    convert.fill_wrench(response.wrench.wrench, wrench_at_origin(model, pushed.wrench))
    response.mode = MODES[pushed.mode]
    for stamped in (response.twist, response.wrench):
        convert.fill_header(stamped.header, request.header, policy.frame_of(model))


SERVICES = (
    Service(
        WrenchToTwist, "wrench_to_twist", wrench_to_twist, checked=("covariance", "half_axes")
    ),
    Service(TwistToWrench, "twist_to_wrench", twist_to_wrench),
    Service(
        WrenchesToTwists,
        "wrenches_to_twists",
        wrenches_to_twists,
        checked=("twists", "load_factors"),
    ),
    Service(
        TwistsToWrenches,
        "twists_to_wrenches",
        twists_to_wrenches,
        checked=("wrenches", "powers"),
    ),
    Service(Push, "push", push_at_a_point),
    # A normal force that no model file states is NaN there.
    Service(ListModels, "list_models", LimitSurfaceNode.list_models, checked=("models",)),
    Service(DescribeModel, "describe_model", LimitSurfaceNode.describe_model, long=True),
)


def main() -> int:
    """Run the node until SIGINT or SIGTERM; return the exit code."""
    tables = {NAME: [*SETTINGS, *COMMON_SETTINGS]}
    return spin.run(lambda: [LimitSurfaceNode()], tables, f"{__doc__}\n\n{HELP}", sys.argv)


if __name__ == "__main__":
    sys.exit(main())
