# SPDX-License-Identifier: Apache-2.0
"""The last push along a path in RViz: outlines on the way, the tip's path, contacts, forces."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from geometry_msgs.msg import Point
from nav_msgs.msg import Path
from visualization_msgs.msg import Marker, MarkerArray

from limit_surface_ros.motion.outcomes import ContactMode
from limit_surface_ros.nodes.limit_surface import markers

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.files.surface_file import SurfaceModel
    from limit_surface_ros.motion.outcomes import PushRun
    from limit_surface_ros.motion.outline import Outline
    from limit_surface_ros.nodes.models.model_node import ModelNode

OUTLINES, PATH = "push", "push_path"
GHOSTS, TIP, CONTACTS, FORCES = "ghosts", "tip", "contacts", "forces"
# Outlines on the way, the last one included.
COUNT = 8
# Of lines and contacts, and length of the largest force, in mean radii of the outline.
THICK, DOT, ARROW = 0.02, 0.06, 0.8
_COLORS = {
    ContactMode.STICK: markers.GREEN,
    ContactMode.SLIDE_LEFT: markers.BLUE,
    ContactMode.SLIDE_RIGHT: markers.VERMILION,
}


class Shown(NamedTuple):
    """A push, and what is needed to show it."""

    frame: str
    outline: Outline
    run: PushRun
    path: Path


class PushMarkers:
    """Publishes the last answer of `~/simulate_push` when there is somebody to see it.

    Args:
        node: The node.
    """

    def __init__(self, node: ModelNode[SurfaceModel]) -> None:
        """Advertise both topics."""
        self._node = node
        self._outlines = node.endpoints.add_output(MarkerArray, OUTLINES, latched=True)
        self._path = node.endpoints.add_output(Path, PATH, latched=True)
        self._last: Shown | None = None
        self._timer = node.create_timer(1.0, self._update)

    def show(self, outline: Outline, run: PushRun, path: Path) -> None:
        """Show a push; it is kept while nobody looks.

        Args:
            outline: Of the body.
            run: The push.
            path: Its path, as the service answers it.
        """
        self._last = Shown(path.header.frame_id, outline, run, path)
        self._update()

    def _update(self) -> None:
        watched = [
            output for output in (self._outlines, self._path) if output.get_subscription_count()
        ]
        if self._last is None or not watched:
            return
        try:
            self._outlines.publish(markers.array_of(push_markers(self._last)))
            self._path.publish(self._last.path)
        except Exception as error:
            # What cannot be shown must not end the node.
            self._node.report("push marker", f"nothing to show on ~/{OUTLINES}: {error}")
        # Both topics are latched: who comes later gets the same.
        self._last = None


def push_markers(shown: Shown) -> list[Marker]:
    """Return the markers of a push, in the frame of its path."""
    run, size = shown.run, shown.outline.mean_radius
    forget = Marker(action=Marker.DELETEALL)
    forget.header.frame_id = shown.frame
    found = [forget]
    lengths = np.linspace(0.0, run.path_lengths[-1], COUNT)
    corners = shown.outline.drawn()
    for number, pose in enumerate(run.poses_at(lengths)):
        c, s = np.cos(pose[2]), np.sin(pose[2])
        points = corners @ np.array([[c, s], [-s, c]]) + pose[:2]
        ghost = _line(shown, GHOSTS, np.concatenate([points, points[:1]]), markers.BLUE)
        ghost.id = number
        ghost.color.a = 0.2 + 0.8 * number / (COUNT - 1)
        found.append(ghost)
    found.append(_line(shown, TIP, run.tips, markers.ORANGE))
    pushing = [place for place, mode in enumerate(run.modes) if mode in _COLORS]
    if pushing:
        dots = _marker(shown, CONTACTS, Marker.SPHERE_LIST)
        dots.scale.x = dots.scale.y = dots.scale.z = DOT * size
        dots.points = _points(run.contacts[pushing])
        dots.colors = [markers.color_of(_COLORS[run.modes[place]]) for place in pushing]
        found += [dots, _forces(shown, np.array(pushing))]
    return found


def _forces(shown: Shown, places: Floats) -> Marker:
    """Return the forces at some places as lines from the contacts, the largest of one length."""
    run = shown.run
    c, s = np.cos(run.poses[places, 2]), np.sin(run.poses[places, 2])
    fx, fy = run.wrenches[places, :2].T
    forces = np.stack([c * fx - s * fy, s * fx + c * fy], axis=1)
    scale = ARROW * shown.outline.mean_radius / max(float(np.hypot(*forces.T).max()), 1e-300)
    ends = np.stack([run.contacts[places], run.contacts[places] + scale * forces], axis=1)
    lines = _marker(shown, FORCES, Marker.LINE_LIST)
    lines.scale.x = 0.5 * THICK * shown.outline.mean_radius
    lines.color = markers.color_of(markers.VERMILION)
    lines.points = _points(ends.reshape(-1, 2))
    return lines


def _line(
    shown: Shown, namespace: str, points: Floats, color: tuple[float, float, float]
) -> Marker:
    line = _marker(shown, namespace, Marker.LINE_STRIP)
    line.scale.x = THICK * shown.outline.mean_radius
    line.color = markers.color_of(color)
    line.points = _points(points)
    return line


def _marker(shown: Shown, namespace: str, kind: int) -> Marker:
    marker = Marker(ns=namespace, type=kind, action=Marker.ADD, frame_locked=True)
    marker.header.frame_id = shown.frame
    marker.pose.orientation.w = 1.0
    return marker


def _points(points: Floats) -> list[Point]:
    return [Point(x=x, y=y) for x, y in points.tolist()]
