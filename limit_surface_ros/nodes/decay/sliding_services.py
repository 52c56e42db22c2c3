# SPDX-License-Identifier: Apache-2.0
"""Services on bodies that slide and grasps that slip: what the decay node makes of `motion`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from geometry_msgs.msg import PoseStamped
from limit_surface_interfaces.msg import NormalForce
from limit_surface_interfaces.srv import (
    PredictSlide,
    PredictSlip,
    PredictStop,
    RequiredNormalForce,
)

from limit_surface_ros.decay.response import onset_value
from limit_surface_ros.errors import RangeError
from limit_surface_ros.motion.holding import holds_from
from limit_surface_ros.motion.sliding.body import SlidingBody
from limit_surface_ros.motion.sliding.inertia import Inertia
from limit_surface_ros.motion.sliding.load import Load
from limit_surface_ros.motion.sliding.slide import bracket_stages, slide_stages
from limit_surface_ros.motion.slip import (
    LARGEST_EXPONENT,
    load_factors,
    predict_slip,
    required_share,
)
from limit_surface_ros.nodes.messages import convert
from limit_surface_ros.nodes.messages.convert import SECOND, nanoseconds
from limit_surface_ros.nodes.messages.planar_input import twist_at_origin
from limit_surface_ros.nodes.serving.batches import in_turns
from limit_surface_ros.nodes.serving.endpoints import Service
from limit_surface_ros.nodes.serving.settings import Setting

if TYPE_CHECKING:
    from geometry_msgs.msg import InertiaStamped, WrenchStamped

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.files.decay_file import DecayModel
    from limit_surface_ros.files.surface_file import SurfaceModel
    from limit_surface_ros.motion.sliding.result import Slide
    from limit_surface_ros.surface.base import LimitSurface

SETTINGS = (
    Setting(
        "grip_surface",
        "",
        "Limit surface of the contact that ~/held_wrench loads; empty: default_surface",
    ),
    Setting(
        "grip_margin",
        1.0,
        "By which wrenches of ~/held_wrench are multiplied before the normal force is worked out",
        minimum=1e-3,
        maximum=1e3,
    ),
    Setting(
        "contact_exponent",
        0.0,
        "Exponent with which the radius of that contact grows with the normal force: 0 of a rigid "
        "one, 1/3 of an elastic sphere",
        minimum=0.0,
        maximum=LARGEST_EXPONENT,
    ),
)
# Time within which a body must rest if none is asked for [s].
LONGEST = 3600.0
MOST_POINTS = 100_000
# Largest cosine of a tilt: the body slides in the plane of the frame of its path.
_LEVEL = 1e-3


class Start(NamedTuple):
    """Where a slide begins.

    Attributes:
        place: x, y of the surface's frame [m] in the frame of the path, and its heading [rad].
        height: Its z there [m].
        time: [ns].
        frame: Of the path.
    """

    place: tuple[float, float, float]
    height: float
    time: int
    frame: str


async def _inertia_of(node: Any, model: SurfaceModel, stamped: InertiaStamped) -> Inertia:
    """Return an inertia about a model's reference point.

    Raises:
        NotFiniteError: A number is NaN or infinite.
        RangeError: Mass or moment is not above 0.
        FrameError: No transform to the model's frame is known.
    """
    given = stamped.inertia
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    tensor = [convert.checked_number(f"inertia.{name}", getattr(given, name)) for name in names]
    mass = convert.checked_number("inertia.m", given.m)
    centre = convert.vector_components("inertia.com", given.com)
    transform = await node.input.transform(model, stamped.header)
    xx, xy, xz, yy, yz, zz = tensor
    full = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    up = transform.rotation[2]
    return Inertia(mass, float(up @ full @ up), transform.point(centre)[:2])


def _start_of(node: Any, model: SurfaceModel, stamped: PoseStamped) -> Start:
    """Return where a slide begins.

    Raises:
        NotFiniteError: A number is NaN or infinite.
        RangeError: The body is not level there, or the stamp is before time zero.
    """
    x, y, z = convert.vector_components("pose.position", stamped.pose.position)
    turned = stamped.pose.orientation
    quaternion = np.array(
        [
            convert.checked_number(f"pose.orientation.{name}", getattr(turned, name))
            for name in "xyzw"
        ]
    )
    size = float(np.linalg.norm(quaternion))
    i, j, k, w = (quaternion / size).tolist() if size else (0.0, 0.0, 0.0, 1.0)
    if math.hypot(i, j) > _LEVEL:
        raise RangeError(
            "pose.orientation must turn about z alone: the body slides in the plane of x and y"
        )
    time = nanoseconds(stamped.header.stamp) or int(node.get_clock().now().nanoseconds)
    frame = convert.copied_frame(stamped.header.frame_id) or node.input.policy.frame_of(model)
    return Start((x, y, 2.0 * math.atan2(k, w)), z, time, frame)


def _load_of(wrench: Floats, decay: DecayModel, in_world: bool) -> Load | None:
    return Load(wrench, decay.sum, in_world) if wrench.any() else None


async def predict_slide(
    node: Any, request: PredictSlide.Request, response: PredictSlide.Response
) -> None:
    """Answer `~/predict_slide`."""
    model, decay = node.surfaces.models[request.surface], node.host.models[request.model]
    horizon = convert.checked_number("horizon", request.horizon) or LONGEST
    points = request.points or node.values["forecast_points"]
    if not 2 <= points <= MOST_POINTS:
        raise RangeError(f"points must be from 2 to {MOST_POINTS}, got {points}")
    start = _start_of(node, model, request.pose)
    inertia = await _inertia_of(node, model, request.inertia)
    twist = np.zeros(3)
    if request.twist.header.frame_id or any(convert.twist_components(request.twist.twist)):
        twist = (await node.input.twist(model, request.twist)).vector
    surface, wrench = node.input.policy.surface_of(model), np.zeros(3)
    if request.wrench.header.frame_id or any(convert.wrench_components(request.wrench.wrench)):
        surface, wrench, _ = await node.input.wrench(model, request.wrench)
    load = _load_of(wrench, decay, request.load_in_world)
    body = SlidingBody(surface, inertia)
    # In the axes of the surface's frame as it is at the start.
    place = (*model.reference_point, 0.0)
    found: Slide = await in_turns(
        node.endpoints, slide_stages(body, twist, load, place, horizon=horizon)
    )
    earliest = latest = found.time
    if load is not None:
        earliest, latest = await in_turns(
            node.endpoints,
            bracket_stages(body, twist, load, decay.max_error, place, horizon=horizon),
        )
    response.stop_time = found.time
    response.earliest_stop_time, response.latest_stop_time = earliest, latest
    _fill_path(response, found, model, start, points)
    direction = response.final_direction
    convert.fill_twist(direction.twist, twist_at_origin(model, found.final_direction))
    convert.fill_stamp(direction.header.stamp, start.time + round(found.time * SECOND))
    direction.header.frame_id = node.input.policy.frame_of(model)
    response.rests = convert.flat_of(found.rests)
    response.energy_residual = found.energy_residual


def _fill_path(
    response: PredictSlide.Response, found: Slide, model: SurfaceModel, start: Start, points: int
) -> None:
    times = np.linspace(0.0, found.time, points)
    poses, twists = found.path.at(times)
    twists[-1] = 0.0
    rx, ry = model.reference_point
    x0, y0, heading0 = start.place
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    # Of the frame's origin, in its axes at the start.
    x, y = poses[:, 0] - c * rx + s * ry, poses[:, 1] - s * rx - c * ry
    c0, s0 = math.cos(heading0), math.sin(heading0)
    rows = zip(
        times.tolist(),
        (x0 + c0 * x - s0 * y).tolist(),
        (y0 + s0 * x + c0 * y).tolist(),
        (0.5 * (heading0 + poses[:, 2])).tolist(),
        strict=True,
    )
    path = response.path
    path.header.frame_id = start.frame
    convert.fill_stamp(path.header.stamp, start.time)
    for time, px, py, half in rows:
        stamped = PoseStamped()
        stamped.header.frame_id = start.frame
        convert.fill_stamp(stamped.header.stamp, start.time + round(time * SECOND))
        position, turn = stamped.pose.position, stamped.pose.orientation
        position.x, position.y, position.z = px, py, start.height
        turn.z, turn.w = math.sin(half), math.cos(half)
        path.poses.append(stamped)
    response.final_pose = path.poses[-1]
    response.times = convert.flat_of(times)
    twists[:, 0] += twists[:, 2] * ry
    twists[:, 1] -= twists[:, 2] * rx
    response.twists = convert.flat_of(twists)


async def predict_stop(
    node: Any, request: PredictStop.Request, response: PredictStop.Response
) -> None:
    """Answer `~/predict_stop`."""
    decay, model = node.host.models[request.model], node.surfaces.models[request.surface]
    surface, wrench, frame = await node.input.wrench(model, request.wrench)
    twist, load_factor = surface.twist_and_load_factor(wrench)
    factor = float(load_factor)
    held = holds_from(decay.sum, factor, decay.max_error)
    last = held.time
    if request.inertia.inertia.m != 0.0:
        inertia = await _inertia_of(node, model, request.inertia)
        body, load = SlidingBody(surface, inertia), Load(wrench, decay.sum, request.load_in_world)
        rest = (0.0, 0.0, 0.0)
        found = await in_turns(node.endpoints, slide_stages(body, rest, load, horizon=LONGEST))
        bracket = bracket_stages(body, rest, load, decay.max_error, horizon=LONGEST)
        earliest, latest = await in_turns(node.endpoints, bracket)
        response.has_stop_time, response.stop_time = True, found.time
        response.earliest_stop_time, response.latest_stop_time = earliest, latest
        last = max(found.time, last)
    # A load that goes to a constant may never let the body rest.
    end = max(node.values["horizon"], last if math.isfinite(last) else 0.0)
    times = np.linspace(0.0, end, node.values["forecast_points"])
    response.slides = held.slides
    response.load_factor = factor
    response.holds_from = held.time
    response.earliest_holds_from, response.latest_holds_from = held.earliest, held.latest
    convert.fill_twist(response.twist.twist, twist_at_origin(model, twist))
    convert.fill_header(response.twist.header, request.wrench.header, frame)
    response.times = convert.flat_of(times)
    response.load_factors = convert.flat_of(factor * decay.sum(times) / onset_value(decay.sum))


def _normal_force_of(model: SurfaceModel, surface: LimitSurface) -> float | None:
    """Return the normal force at which a surface stands [N]; None if its model states none."""
    if model.normal_force is None:
        return None
    ratio = surface.scaling.friction_force / model.surface.scaling.friction_force
    return model.normal_force * ratio


async def predict_slip_of_a_grasp(
    node: Any, request: PredictSlip.Request, response: PredictSlip.Response
) -> None:
    """Answer `~/predict_slip`."""
    decay, model = node.host.models[request.model], node.surfaces.models[request.surface]
    margin = convert.checked_number("margin", request.margin) or 1.0
    exponent = convert.checked_number("contact_exponent", request.contact_exponent)
    surface, wrench, _ = await node.input.wrench(model, request.wrench)
    found = predict_slip(surface, decay.sum, wrench, exponent, margin, decay.max_error)
    response.slips, response.slip_time = found.slips, found.time
    response.earliest_slip_time, response.latest_slip_time = found.earliest, found.latest
    response.required_share, response.load_factor = found.share, found.load_factor
    normal_force = _normal_force_of(model, surface)
    response.required_normal_force = found.share * normal_force if normal_force else 0.0
    times = np.linspace(0.0, node.values["horizon"], node.values["forecast_points"])
    shares = decay.sum(times) / onset_value(decay.sum)
    factors = np.full(len(times), np.inf if wrench.any() else 0.0)
    pressing = shares > 0.0
    factors[pressing] = load_factors(surface, margin * wrench, shares[pressing], exponent)
    response.times, response.load_factors = convert.flat_of(times), convert.flat_of(factors)


async def required_normal_force(
    node: Any,
    request: RequiredNormalForce.Request,
    response: RequiredNormalForce.Response,
) -> None:
    """Answer `~/required_normal_force`."""
    margin = convert.checked_number("margin", request.margin) or 1.0
    exponent = convert.checked_number("contact_exponent", request.contact_exponent)
    response.required = await _required(node, request.surface, request.wrench, margin, exponent)


async def on_held_wrench(node: Any, stamped: WrenchStamped) -> NormalForce:
    """Return what a wrench of `~/held_wrench` asks for."""
    values = node.values
    return await _required(
        node, values["grip_surface"], stamped, values["grip_margin"], values["contact_exponent"]
    )


async def _required(
    node: Any, name: str, stamped: WrenchStamped, margin: float, exponent: float
) -> NormalForce:
    model = node.surfaces.models[name]
    surface, wrench, frame = await node.input.wrench(model, stamped)
    normal_force = _normal_force_of(model, surface)
    if normal_force is None:
        raise RangeError(
            f"model {model.name!r} states no normal_force, so that no force can be given: "
            "state it in the model's file"
        )
    found = required_share(surface, wrench, exponent, margin)
    message = NormalForce(
        surface=model.name,
        normal_force=found.share * normal_force,
        load_factor=found.load_factor,
        torsional_share=found.torsional_share,
        margin=margin,
        contact_exponent=exponent,
    )
    convert.fill_header(message.header, stamped.header, frame)
    return message


SERVICES = (
    Service(
        PredictSlide,
        "predict_slide",
        predict_slide,
        unbounded=("earliest_stop_time", "latest_stop_time"),
    ),
    Service(
        PredictStop,
        "predict_stop",
        predict_stop,
        unbounded=(
            "holds_from",
            "earliest_holds_from",
            "latest_holds_from",
            "earliest_stop_time",
            "latest_stop_time",
        ),
    ),
    Service(
        PredictSlip,
        "predict_slip",
        predict_slip_of_a_grasp,
        unbounded=("slip_time", "earliest_slip_time", "latest_slip_time", "load_factors"),
    ),
    Service(RequiredNormalForce, "required_normal_force", required_normal_force),
)
