# SPDX-License-Identifier: Apache-2.0
"""Markers for RViz: pure functions from surfaces, loads and motions to messages.

Loads are drawn in load space, x and y the force, z the moment over the characteristic length, with
so many metres to the newton; motions and contacts where they are. All stand at the model's
reference point, in its frame, with a zero stamp, so that RViz takes the latest transform.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from limit_surface_ros.export.mesh import mesh_of

if TYPE_CHECKING:
    from collections.abc import Iterable

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.files.surface_file import SurfaceModel
    from limit_surface_ros.surface.base import LimitSurface

# The palette of Okabe and Ito, told apart with any kind of colour vision.
BLUE = (0.0, 0.447, 0.698)
VERMILION = (0.835, 0.369, 0.0)
GREEN = (0.0, 0.620, 0.451)
ORANGE = (0.902, 0.624, 0.0)
# Each marker is known by its namespace; the number within it is always 0.
SURFACE, WRENCH, LIMIT, MOTION, ARC, CONE, CONTACT = (
    "surface",
    "wrench",
    "limit_wrench",
    "motion",
    "arc",
    "cone",
    "contact",
)
OF_A_LOAD = (WRENCH, LIMIT, MOTION, ARC, CONE)
# The surface is drawn about this many characteristic lengths wide if no scale is given.
AUTOMATIC_WIDTH = 2.0
# A centre of rotation farther than this many characteristic lengths is drawn as a straight path.
STRAIGHT = 20.0
_CELLS = 12
_CONE_OPACITY = 0.35
_NO_TWISTS = np.empty((0, 3))
_ARC_POINTS = 48


@dataclass(frozen=True)
class Canvas:
    """Where and how large things are drawn.

    Attributes:
        model: The model, whose frame and reference point they stand in.
        metres_per_newton: Size of loads.
        frame: In which the model is served.
    """

    model: SurfaceModel
    metres_per_newton: float
    frame: str

    @classmethod
    def of(cls, model: SurfaceModel, metres_per_newton: float = 0.0, frame: str = "") -> Canvas:
        """Return a canvas; 0 metres to the newton: the surface about as large as the body.

        An empty frame is the one of the model's file.
        """
        scaling = model.surface.scaling
        automatic = 0.5 * AUTOMATIC_WIDTH * scaling.characteristic_length / scaling.friction_force
        return cls(model, metres_per_newton or automatic, frame or model.frame_id)

    @property
    def length(self) -> float:
        """Characteristic length of the model [m]."""
        return self.model.surface.scaling.characteristic_length

    def load(self, wrench: Floats) -> Floats:
        """Return where wrenches (..., 3) are drawn, about the reference point [m]."""
        return np.asarray(wrench * (self.metres_per_newton / np.array([1.0, 1.0, self.length])))

    def marker(self, namespace: str, kind: int, color: tuple[float, float, float]) -> Marker:
        """Return a marker at the reference point without content."""
        marker = Marker(ns=namespace, type=kind, action=Marker.ADD, frame_locked=True)
        marker.header.frame_id = self.frame
        marker.pose.position.x, marker.pose.position.y = self.model.reference_point
        marker.pose.orientation.w = 1.0
        marker.color = color_of(color)
        return marker


def surface_marker(canvas: Canvas, surface: LimitSurface) -> Marker:
    """Return the limit surface as a triangle mesh, shaded by how its cells face."""
    mesh = mesh_of(surface, _CELLS)
    corners = canvas.load(mesh.vertices)[mesh.triangles]
    marker = canvas.marker(SURFACE, Marker.TRIANGLE_LIST, BLUE)
    marker.scale.x = marker.scale.y = marker.scale.z = 1.0
    marker.points = points_of(corners.reshape(-1, 3))
    marker.colors = [_shaded(brightness) for brightness in _brightness(corners) for _ in range(3)]
    return marker


def wrench_marker(canvas: Canvas, wrench: Floats) -> Marker:
    """Return a wrench as an arrow in load space."""
    return _load_arrow(canvas, WRENCH, wrench, VERMILION)


def limit_marker(canvas: Canvas, wrench: Floats) -> Marker:
    """Return the wrench of the same direction on the surface as an arrow in load space."""
    return _load_arrow(canvas, LIMIT, wrench, GREEN)


def motion_marker(canvas: Canvas, twist: Floats) -> Marker:
    """Return the motion of the reference point as an arrow, one characteristic length at most."""
    end = np.array([twist[0], twist[1], 0.0]) * canvas.length
    if not np.hypot(end[0], end[1]) > 1e-6 * canvas.length:
        return removal(canvas, MOTION)
    return _arrow(canvas, MOTION, end, ORANGE)


def arc_marker(canvas: Canvas, twist: Floats) -> Marker:
    """Return the path about the centre of rotation, from the reference point on.

    Its centre is drawn as the first point of the line. A rotation about the reference point itself
    is drawn half a characteristic length around it.
    """
    vx, vy, omega = (float(component) for component in twist)
    if omega == 0.0 or math.hypot(vx, vy) > STRAIGHT * canvas.length * abs(omega):
        return removal(canvas, ARC)
    centre = np.array([-vy, vx]) / omega
    radius = max(float(np.hypot(*centre)), 0.5 * canvas.length)
    start = math.atan2(-centre[1], -centre[0]) if centre.any() else 0.0
    turn = math.copysign(min(1.5 * math.pi, 2.0 * canvas.length / radius), omega)
    angle = start + np.linspace(0.0, turn, _ARC_POINTS)
    path = np.zeros((_ARC_POINTS + 1, 3))
    path[0, :2] = centre
    path[1:, 0] = centre[0] + radius * np.cos(angle)
    path[1:, 1] = centre[1] + radius * np.sin(angle)
    marker = canvas.marker(ARC, Marker.LINE_STRIP, ORANGE)
    marker.scale.x = 0.02 * canvas.length
    marker.points = points_of(path)
    return marker


def cone_marker(canvas: Canvas, twists: Floats) -> Marker:
    """Return the fan that the arrow of a motion lies in at a probability.

    Args:
        canvas: Where to draw.
        twists: Around the region of the motion, shape (n, 3); n of 0: none is known.
    """
    if not len(twists):
        return removal(canvas, CONE)
    ends = np.zeros((len(twists), 3))
    ends[:, :2] = canvas.length * twists[:, :2]
    marker = canvas.marker(CONE, Marker.TRIANGLE_LIST, ORANGE)
    marker.color.a = _CONE_OPACITY
    marker.scale.x = marker.scale.y = marker.scale.z = 1.0
    corners = np.stack([np.zeros_like(ends), ends, np.roll(ends, -1, axis=0)], axis=1)
    # A triangle is seen from one side alone.
    both = np.concatenate([corners, corners[:, ::-1]])
    marker.points = points_of(both.reshape(-1, 3))
    return marker


def contact_marker(canvas: Canvas) -> Marker:
    """Return the points of contact, the larger and the redder the more friction they can give.

    Only a surface of support points knows its contact.
    """
    contact = canvas.model.surface.contact_points
    if contact is None:
        return removal(canvas, CONTACT)
    points, limits = contact
    marker = canvas.marker(CONTACT, Marker.SPHERE_LIST, VERMILION)
    share = limits / limits.max()
    size = 0.5 * canvas.length / math.sqrt(len(share))
    marker.scale.x = marker.scale.y = marker.scale.z = max(0.02 * canvas.length, size)
    marker.points = points_of(np.column_stack([points, np.zeros(len(share))]))
    marker.colors = [
        color_of(tuple(s * a + (1.0 - s) * b for a, b in zip(VERMILION, BLUE, strict=True)))
        for s in share
    ]
    return marker


def load_markers(
    canvas: Canvas,
    wrench: Floats,
    limit_wrench: Floats,
    twist: Floats,
    region: Floats = _NO_TWISTS,
) -> list[Marker]:
    """Return the markers of a load: itself, its limit, and the motion that it causes.

    Args:
        canvas: Where to draw.
        wrench: Shape (3,), [N, N, N m].
        limit_wrench: The wrench of the same direction on the surface, shape (3,).
        twist: Of unit norm in scaled variables, shape (3,); zero if the body sticks.
        region: Twists around the region that it lies in, shape (n, 3); none if that is not known.
    """
    return [
        wrench_marker(canvas, wrench),
        limit_marker(canvas, limit_wrench),
        motion_marker(canvas, twist),
        arc_marker(canvas, twist),
        cone_marker(canvas, region),
    ]


def removal(canvas: Canvas, namespace: str) -> Marker:
    """Return what takes a marker away."""
    marker = canvas.marker(namespace, Marker.ARROW, BLUE)
    marker.action = Marker.DELETE
    return marker


def array_of(markers: Iterable[Marker]) -> MarkerArray:
    """Return markers as one message."""
    return MarkerArray(markers=list(markers))


def points_of(rows: Floats) -> list[Point]:
    """Return positions (n, 3) as messages."""
    return [Point(x=x, y=y, z=z) for x, y, z in rows.tolist()]


def _load_arrow(
    canvas: Canvas, namespace: str, wrench: Floats, color: tuple[float, float, float]
) -> Marker:
    end = canvas.load(wrench)
    return _arrow(canvas, namespace, end, color) if end.any() else removal(canvas, namespace)


def _arrow(
    canvas: Canvas, namespace: str, end: Floats, color: tuple[float, float, float]
) -> Marker:
    marker = canvas.marker(namespace, Marker.ARROW, color)
    marker.scale.x, marker.scale.y = 0.03 * canvas.length, 0.07 * canvas.length
    marker.points = points_of(np.stack([np.zeros(3), end]))
    return marker


def _brightness(corners: Floats) -> list[float]:
    """Return how each triangle (m, 3, 3) faces a light from above, from 0 to 1."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    light = np.array([0.3, -0.5, 0.8])
    values: list[float] = (0.5 + 0.5 * normals @ (light / np.linalg.norm(light))).tolist()
    return values


def _shaded(brightness: float) -> ColorRGBA:
    share = 0.4 + 0.6 * brightness
    return ColorRGBA(r=share * BLUE[0], g=share * BLUE[1], b=share * BLUE[2], a=0.7)


def color_of(rgb: Iterable[float]) -> ColorRGBA:
    """Return an opaque colour of three numbers from 0 to 1."""
    red, green, blue = rgb
    return ColorRGBA(r=red, g=green, b=blue, a=1.0)
