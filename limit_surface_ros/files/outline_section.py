# SPDX-License-Identifier: Apache-2.0
"""The key `outline` of model and contact files: the side of the body that pushers touch.

In the frame `frame_id`, one of
- `kind: polygon` with `vertices` (n x 2) [m], convex or not, either way round;
- `kind: rectangle` with `size` [m], `kind: disc` with `radius` [m], `kind: ellipse` with
  `semi_axes` [m], each with `centre` [m] and `angle` [rad] if they are not zero;
- `kind: curve` with `points` (n x 2) [m] that a smooth closed curve goes through.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.errors import LimitSurfaceError
from limit_surface_ros.files.section import place_errors
from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.motion.round_outlines import Ellipse, SmoothCurve

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.files.section import Section
    from limit_surface_ros.motion.outline import Outline

# Shapes of contacts whose rim is the outline of a body as well.
SHAPES = ("polygon", "rectangle", "disc", "ring", "ellipse")


def read_outline(section: Section, key: str = "outline") -> Outline:
    """Read the outline under a key.

    Raises:
        FileError: It is none; the message names file, key, what was found and what is accepted.
    """
    described = section.section(key)
    described.choice("kind", ["polygon", "rectangle", "disc", "ellipse", "curve"])
    outline: Outline = place_errors(section, key, lambda: _made(described))
    described.finish()
    return outline


def outline_of_shape(section: Section) -> Outline | None:
    """Return the outline of a body whose contact has the shape that a section describes.

    None for shapes whose rim is no outline: lines, bitmaps, and boundaries of too many vertices.
    """
    if section.values.get("kind") not in SHAPES:
        return None
    try:
        return _made(section)
    except LimitSurfaceError:
        return None


def _made(section: Section) -> Outline:
    kind = section.values["kind"]
    if kind == "curve":
        return SmoothCurve(section.array("points", (None, 2)))
    centre, angle = section.array("centre", (2,), np.zeros(2)), section.number("angle", 0.0)
    if kind == "polygon":
        return Polygon(_placed(section.array("vertices", (None, 2)), centre, angle))
    if kind == "rectangle":
        half = 0.5 * section.array("size", (2,))
        corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
        return Polygon(_placed(half * corners, centre, angle))
    if kind == "ellipse":
        return Ellipse(section.array("semi_axes", (2,)), centre, angle)
    radius = section.number("outer_radius" if kind == "ring" else "radius", above=0.0)
    return Ellipse([radius, radius], centre)


def _placed(points: Floats, centre: Floats, angle: float) -> Floats:
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(points @ np.array([[c, s], [-s, c]]) + centre)


def outline_values(outline: Outline) -> dict[str, Any]:
    """Return what a file says of an outline; read back it is the same bit for bit.

    A polygon's vertices are written counterclockwise.
    """
    if isinstance(outline, Ellipse):
        values: dict[str, Any] = {"kind": "ellipse", "semi_axes": outline.semi_axes}
        return values | {"centre": outline.centre, "angle": outline.angle}
    if isinstance(outline, SmoothCurve):
        return {"kind": "curve", "points": outline.points}
    return {"kind": "polygon", "vertices": outline.drawn()}
