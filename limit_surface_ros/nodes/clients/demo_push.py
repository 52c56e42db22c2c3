# SPDX-License-Identifier: Apache-2.0
"""The part of the demonstration that pushes the body along a path and asks twice for its end."""

from __future__ import annotations

import math
from array import array
from typing import TYPE_CHECKING, Any

from geometry_msgs.msg import Point32, PoseStamped
from limit_surface_interfaces.srv import SimulatePush, SimulatePushes

if TYPE_CHECKING:
    from limit_surface_ros.nodes.clients.service_client import ServiceClient

# The body of the default model: a right triangle about its centroid [m].
CORNERS = ((-0.04, -0.04), (0.08, -0.04), (-0.04, 0.08))
TIP, FRICTION = 0.005, 0.3
START, END = (-0.05, 0.02), (0.01, 0.03)
TOLERANCE = 1e-9
HEADING = f"{'path [mm]':>9}{'x [mm]':>10}{'y [mm]':>10}{'angle [deg]':>13}  tip"
_MODES = {
    SimulatePush.Response.STICK: "sticks",
    SimulatePush.Response.SLIDE_LEFT: "slides left",
    SimulatePush.Response.SLIDE_RIGHT: "slides right",
    SimulatePush.Response.SEPARATE: "does not push",
}


def show(client: ServiceClient, namespace: str, frame: str) -> bool:
    """Push the body along a path; print its way and whether both services agree on its end.

    Args:
        client: Calls services.
        namespace: The surface node's namespace.
        frame: Frame of the path.

    Raises:
        RuntimeError: A service answered with an error.
        TimeoutError: A service is silent.
    """
    prefix = f"{namespace}/limit_surface"
    one = SimulatePush.Request(tip_radius=TIP, friction=FRICTION)
    many = SimulatePushes.Request(tip_radius=TIP, friction=FRICTION)
    for request in (one, many):
        request.header.frame_id = frame
        request.outline.points = [Point32(x=x, y=y) for x, y in CORNERS]
    for x, y in (START, END):
        pose = PoseStamped()
        pose.pose.position.x, pose.pose.position.y = x, y
        one.tip_path.poses.append(pose)
    many.poses = array("d", [0.0, 0.0, 0.0])
    many.tip_starts, many.tip_ends = array("d", START), array("d", END)
    answer = _ask(client, SimulatePush, f"{prefix}/simulate_push", one)
    print(f"\na tip pushes it along a path of {1e3 * answer.path_lengths[-1]:.1f} mm\n")
    print(HEADING)
    for stamped, length, mode in zip(
        answer.body_path.poses, answer.path_lengths, answer.modes, strict=True
    ):
        x, y, angle = _planar(stamped)
        print(
            f"{1e3 * length:>9.2f}{1e3 * x:>10.3f}{1e3 * y:>10.3f}{math.degrees(angle):>13.3f}"
            f"  {_MODES[mode]}"
        )
    ends = _ask(client, SimulatePushes, f"{prefix}/simulate_pushes", many).end_poses
    apart = max(abs(a - b) for a, b in zip(_planar(answer.end), ends, strict=True))
    print(f"\nit ends where the batch of pushes says, within {apart:.0e}")
    return apart < TOLERANCE and answer.touched


def _planar(stamped: PoseStamped) -> tuple[float, float, float]:
    q, p = stamped.pose.orientation, stamped.pose.position
    return p.x, p.y, 2.0 * math.atan2(q.z, q.w)


def _ask(client: ServiceClient, service_type: Any, name: str, request: Any) -> Any:
    answer = client.call(service_type, name, request)
    if answer.error_code:
        raise RuntimeError(f"{name} answered with error {answer.error_code}: {answer.error_msg}")
    return answer
