# SPDX-License-Identifier: Apache-2.0
"""Services of the `limit_surface` node that push bodies by their outlines."""

from __future__ import annotations

from array import array
from typing import TYPE_CHECKING, Any

import numpy as np
from geometry_msgs.msg import PoseStamped
from limit_surface_interfaces.srv import LinearisePush, SimulatePush, SimulatePushes

from limit_surface_ros.checks import as_floats
from limit_surface_ros.errors import DataError, FrameError, RangeError, ShapeError, shortened
from limit_surface_ros.motion.linear_push import INPUTS, linearise_push
from limit_surface_ros.motion.outcomes import MODES
from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.motion.rollout import DEFAULT_ACCURACY, OVERLAPS, Pushing
from limit_surface_ros.nodes.messages import convert
from limit_surface_ros.nodes.messages.planar_input import wrench_at_origin
from limit_surface_ros.nodes.serving.batches import in_turns
from limit_surface_ros.nodes.serving.endpoints import Service
from limit_surface_ros.surface.frames import RigidTransform

if TYPE_CHECKING:
    from geometry_msgs.msg import Pose
    from nav_msgs.msg import Path

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.files.surface_file import SurfaceModel
    from limit_surface_ros.motion.outline import Outline

# Poses of a path that are accepted: each starts a step anew.
MOST_POSES = 1000
# Pushes of a batch that are accepted.
MOST_PUSHES = 100_000
# Accuracy that is still answered [m]: each thousandth costs ten times as long.
FINEST = 1e-9
# How far the z axis of a pose may lean, as a cosine.
UPRIGHT = 0.999
# What `Push`, `SimulatePush` and the core call the modes.
_NUMBERS = {mode: getattr(SimulatePush.Response, mode.name) for mode in MODES}


async def simulate_one(
    node: Any, request: SimulatePush.Request, response: SimulatePush.Response
) -> None:
    """Answer `~/simulate_push`."""
    model = node.host.models[request.model]
    tips, stamps = _tips(request)
    frame = convert.copied_frame(request.header.frame_id)
    outline = outline_of(model, request)
    stages = _pushing(node, model, outline, request).along(
        _planar_pose("start", request.start), tips
    )
    run = await in_turns(node.endpoints, stages)
    first = convert.nanoseconds(request.header.stamp)
    if stamps is None:
        times = np.zeros(len(run.path_lengths))
    else:
        first = int(stamps[0])
        lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(tips, axis=0).T))])
        times = np.interp(run.path_lengths, lengths, (stamps - stamps[0]).astype(np.float64))
    response.body_path.header = request.header
    for pose, later in zip(run.poses.tolist(), times.tolist(), strict=True):
        stamped = PoseStamped()
        stamped.header.frame_id = frame
        convert.fill_stamp(stamped.header.stamp, first + round(later))
        _fill_pose(stamped.pose, pose)
        response.body_path.poses.append(stamped)
    response.end = response.body_path.poses[-1]
    response.path_lengths = convert.flat_of(run.path_lengths)
    response.modes = array("B", [_NUMBERS[mode] for mode in run.modes])
    response.wrenches = convert.flat_of(
        np.array([wrench_at_origin(model, wrench) for wrench in run.wrenches])
    )
    response.touched = run.touched_at is not None
    response.touched_at = run.touched_at or 0.0
    response.left = run.left_at is not None
    response.left_at = run.left_at or 0.0
    response.estimated_error = run.error
    node.push_markers.show(outline, run, response.body_path)


async def simulate_many(
    node: Any, request: SimulatePushes.Request, response: SimulatePushes.Response
) -> None:
    """Answer `~/simulate_pushes`, in steps between which others have their turns."""
    model = node.host.models[request.model]
    poses = _rows("poses", request.poses, 3)
    starts, ends = (_rows(name, getattr(request, name), 2) for name in ("tip_starts", "tip_ends"))
    if not len(poses) == len(starts) == len(ends):
        raise ShapeError(
            "poses, tip_starts and tip_ends must be as many, "
            f"got {len(poses)}, {len(starts)} and {len(ends)}"
        )
    pushing = _pushing(node, model, outline_of(model, request), request)
    stages = pushing.along_each(poses, np.stack([starts, ends], axis=1))
    # Each begun keeps its poses and contacts: of several long ones, one at a time.
    runs = await node.batches.run_stages(len(poses), stages)
    answer = SimulatePushes.Response
    outcomes = np.where(np.isnan(runs.left_at), answer.TOUCHES, answer.LEAVES)
    outcomes = np.where(np.isnan(runs.touched_at), answer.MISSES, outcomes)
    response.header = request.header
    response.end_poses = convert.flat_of(runs.end_poses)
    response.outcomes = array("B", outcomes.astype(np.uint8).tobytes())
    response.estimated_errors = convert.flat_of(runs.errors)


def linearise(node: Any, request: LinearisePush.Request, response: LinearisePush.Response) -> None:
    """Answer `~/linearise_push`."""
    model, policy = node.host.models[request.model], node.input.policy
    kinds = tuple(INPUTS)
    if not 0 <= request.kind < len(kinds):
        raise RangeError(f"kind must be VELOCITY (0) or FORCE (1), got {request.kind}")
    found = linearise_push(
        policy.surface_of(model),
        outline_of(model, request),
        request.friction,
        _planar_pose("pose", request.pose),
        convert.vector_components("contact", request.contact)[:2],
        _rows("input", request.input, 1)[:, 0],
        kind=kinds[request.kind],
        reference_point=model.reference_point,
    )
    response.mode = _NUMBERS[MODES[int(found.modes)]]
    response.rates = found.rates
    response.a, response.b = found.a.ravel(), convert.flat_of(found.b)
    response.turn_right, response.turn_left = found.margins.tolist()
    response.smooth = bool(found.smooth)
    convert.fill_twist(response.twist.twist, found.twists)
    convert.fill_header(response.twist.header, request.header, policy.frame_of(model))


def _pushing(node: Any, model: SurfaceModel, outline: Outline, request: Any) -> Pushing:
    """Return the body and the tip of a request."""
    return Pushing(
        node.input.policy.surface_of(model),
        outline,
        request.tip_radius,
        request.friction,
        _accuracy(request.accuracy),
        _overlap(request.overlap),
        model.reference_point,
    )


def _accuracy(asked: float) -> float:
    """Return the accuracy that is asked for, or the usual one.

    Raises:
        RangeError: It would take the node too long.
    """
    if 0.0 < asked < FINEST:
        raise RangeError(f"accuracy must be {FINEST:g} m or more, or 0, got {asked}")
    return asked or DEFAULT_ACCURACY


def outline_of(model: SurfaceModel, request: Any) -> Outline:
    """Return the outline that a request gives, or that of its model.

    Raises:
        OutlineError: The request's crosses itself or encloses nothing.
        NotFiniteError: A coordinate is NaN or infinite.
        RangeError: There are too many vertices.
        DataError: Neither gives one.
    """
    points = request.outline.points
    if points:
        return Polygon([(point.x, point.y) for point in points])
    if model.outline is None:
        raise DataError(
            f"model {shortened(repr(model.name))} has no outline: give one with the request, or "
            "in its file"
        )
    return model.outline


def _overlap(number: int) -> str:
    if not 0 <= number < len(OVERLAPS):
        raise RangeError(f"overlap must be KEEP (0) or PUSH_OUT (1), got {number}")
    return OVERLAPS[number]


def _planar_pose(name: str, pose: Pose) -> Floats:
    """Return x, y and the angle of an upright pose."""
    place = convert.vector_components(f"{name}.position", pose.position)
    q = pose.orientation
    turned = RigidTransform.from_quaternion(place, (q.x, q.y, q.z, q.w)).rotation
    if turned[2, 2] < UPRIGHT:
        raise RangeError(
            f"{name} must be upright: the z axes of its frame and the header's must agree"
        )
    return np.array([place[0], place[1], np.arctan2(turned[1, 0], turned[0, 0])])


def _fill_pose(message: Pose, pose: list[float]) -> None:
    message.position.x, message.position.y = pose[0], pose[1]
    message.orientation.z, message.orientation.w = np.sin(pose[2] / 2), np.cos(pose[2] / 2)


def _tips(request: SimulatePush.Request) -> tuple[Floats, Any]:
    """Return the path of the tip (m, 2), and the times along it (m,) [ns], None if none rise."""
    path: Path = request.tip_path
    frame = request.header.frame_id
    if not 2 <= len(path.poses) <= MOST_POSES:
        raise ShapeError(f"tip_path must have 2 to {MOST_POSES} poses, got {len(path.poses)}")
    for header in (path.header, *(pose.header for pose in path.poses)):
        if header.frame_id not in ("", frame):
            raise FrameError(
                f"tip_path is in frame {shortened(repr(header.frame_id))}, and the request in "
                f"{shortened(repr(frame))}: give both in one that stands still"
            )
    places = as_floats(
        "tip_path", [(pose.pose.position.x, pose.pose.position.y) for pose in path.poses]
    )
    stamps = np.array([convert.nanoseconds(pose.header.stamp) for pose in path.poses])
    rises = bool((np.diff(stamps) >= 0).all()) and stamps[-1] > stamps[0]
    return places, stamps if rises else None


def _rows(name: str, numbers: array[float], columns: int) -> Floats:
    """Return a flat field as rows of finite numbers."""
    flat = as_floats(name, np.frombuffer(numbers, dtype=np.float64) if len(numbers) else [])
    if flat.size % columns:
        raise ShapeError(f"{name} must hold {columns} numbers a row, got {flat.size} in all")
    rows = flat.reshape(-1, columns)
    if len(rows) > MOST_PUSHES:
        raise RangeError(f"{name} holds {len(rows)} rows; at most {MOST_PUSHES} are accepted")
    return rows


SERVICES = (
    Service(LinearisePush, "linearise_push", linearise),
    Service(SimulatePush, "simulate_push", simulate_one),
    Service(SimulatePushes, "simulate_pushes", simulate_many),
)
