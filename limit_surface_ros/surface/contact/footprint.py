# SPDX-License-Identifier: Apache-2.0
"""Where solid shapes touch the ground: what is lowest of them, as cells of areas or as points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_positive
from limit_surface_ros.errors import GeometryError, MissingExtraError
from limit_surface_ros.surface.contact import shapes

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.contact.shapes import Cells

# Height above the lowest point, in parts of the body's extent, that still touches the ground.
_TOUCHING = 1e-3
# Sine of the angle up to which a cylinder stands on its end, or lies on its side.
_UPRIGHT = 1e-3
# Corners that stand for a circle where areas are joined.
_CIRCLE = 256


@dataclass(frozen=True, eq=False)
class Footprint:
    """The contact of a body with the ground.

    Attributes:
        cells: Of the area that it stands on; None if it stands on points.
        points: Support points [m], shape (n, 2); empty if it stands on an area.
    """

    cells: Cells | None
    points: Floats


@dataclass(frozen=True, eq=False)
class Ground:
    """One solid shape, as the ground knows it.

    Attributes:
        corners: Points whose hull has the shape's lowest part [m], shape (n, 3).
        triangles: Faces, as numbers of corners, shape (k, 3).
        disc: Centre (x, y, z) and radius of a flat round end, if it has one below.
    """

    corners: Floats
    triangles: Any
    disc: Floats | None = None

    @classmethod
    def box(cls, size: Floats, pose: Floats) -> Ground:
        """Return a box of that size [m] about the origin of its pose, shape (4, 4)."""
        half = 0.5 * np.array([as_positive("box size", float(length)) for length in size])
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        faces = [
            [0, 1, 3, 2],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 3, 7, 6],
            [0, 2, 6, 4],
            [1, 3, 7, 5],
        ]
        quads = np.array([[int(corner) for corner in face] for face in faces])
        triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
        return cls(_moved(signs * half, pose), triangles)

    @classmethod
    def cylinder(cls, radius: float, length: float, pose: Floats) -> Ground:
        """Return a cylinder [m] about the z axis of its pose."""
        half = 0.5 * as_positive("cylinder length", float(length))
        radius = as_positive("cylinder radius", float(radius))
        axis = pose[:3, 2]
        none = np.empty((0, 3), dtype=np.int64)
        tilt = float(np.hypot(axis[0], axis[1]))
        ends = pose[:3, 3] + np.outer([half, -half], axis)
        if tilt < _UPRIGHT:
            low = ends[ends[:, 2].argmin()]
            return cls(low[None], none, np.append(low, radius))
        # The lowest of a rim is below its centre, along the projection of the vertical on it.
        down = np.array([0.0, 0.0, -1.0]) + axis[2] * axis
        rims = ends + radius * down / np.linalg.norm(down)
        return cls(rims, none)

    @classmethod
    def sphere(cls, radius: float, pose: Floats) -> Ground:
        """Return a sphere [m] about the origin of its pose."""
        down = np.array([0.0, 0.0, as_positive("sphere radius", float(radius))])
        return cls((pose[:3, 3] - down)[None], np.empty((0, 3), dtype=np.int64))

    @classmethod
    def mesh(cls, triangles: Floats, pose: Floats) -> Ground:
        """Return a mesh of triangles [m], shape (n, 3, 3), in its pose."""
        corners = _moved(triangles.reshape(-1, 3), pose)
        return cls(corners, np.arange(len(corners)).reshape(-1, 3))


def ground_contact(bodies: Sequence[Ground], count: int = shapes.DEFAULT_COUNT) -> Footprint:
    """Return where shapes that are one rigid body touch a ground that is level.

    Args:
        bodies: The shapes, in one frame whose z axis points up.
        count: About how many cells an area is cut into.

    Raises:
        GeometryError: The body stands on areas and on single points or edges at a time, or there
            is no shape.
        MissingExtraError: Areas must be joined, or are a mesh's, and shapely is not installed.
    """
    if not bodies:
        raise GeometryError("a body without a shape touches nothing")
    corners = np.concatenate([body.corners for body in bodies])
    floor = float(corners[:, 2].min())
    wide = (
        max(2.0 * float(body.disc[3]) for body in bodies if body.disc is not None)
        if any(body.disc is not None for body in bodies)
        else 0.0
    )
    extent = max(float(np.ptp(corners, axis=0).max()), wide)
    level = floor + _TOUCHING * extent
    discs = [body.disc for body in bodies if body.disc is not None and body.disc[2] <= level]
    faces: list[Floats] = []
    loose: list[Floats] = []
    for body in bodies:
        low = body.corners[:, 2] <= level
        if body.disc is not None or not low.any():
            continue
        flat = body.triangles[low[body.triangles].all(axis=1)] if len(body.triangles) else []
        found = body.corners[np.asarray(flat, dtype=np.int64)][..., :2].reshape(-1, 3, 2)
        across = found[:, 1:] - found[:, :1]
        areas = np.abs(np.linalg.det(across))
        real = found[areas > 1e-12 * extent**2]
        if len(real):
            faces.append(real)
        else:
            loose.append(np.unique(np.round(body.corners[low, :2], 12), axis=0))
    if (discs or faces) and loose:
        raise GeometryError(
            "the body stands on areas and on points or edges at a time: describe its contact in a "
            "contact file"
        )
    if loose:
        return Footprint(None, np.concatenate(loose))
    return Footprint(_cells(discs, faces, count), np.empty((0, 2)))


def _cells(discs: Sequence[Floats], faces: Sequence[Floats], count: int) -> Cells:
    """Return cells of the union of discs (x, y, z, radius) and triangles, shape (n, 3, 2) each."""
    if len(discs) == 1 and not faces:
        x, y, _, radius = discs[0]
        return shapes.disc(float(radius), count).placed([x, y])
    if len(faces) == 1 and not discs:
        box = _as_rectangle(faces[0])
        if box is not None:
            size, centre, angle = box
            return shapes.rectangle(size, count).placed(centre, angle)
    try:
        import shapely
    except ImportError:
        raise MissingExtraError("shapely", "shapes") from None
    round_ones = [
        shapely.Point(x, y).buffer(radius, quad_segs=_CIRCLE // 4) for x, y, _, radius in discs
    ]
    triangles = [shapely.polygons(each) for each in faces]
    union = shapely.union_all([*round_ones, *np.concatenate([np.empty(0, object), *triangles])])
    parts = [each for each in shapely.get_parts(union) if each.area > 0.0]
    total = sum(part.area for part in parts)
    cut = [
        shapes.polygon(
            shapely.get_coordinates(part.exterior),
            [shapely.get_coordinates(hole) for hole in part.interiors],
            max(1, round(count * part.area / total)),
        )
        for part in parts
    ]
    whole = shapes.Cells(
        np.concatenate([each.points for each in cut]), np.concatenate([each.sizes for each in cut])
    )
    corners = shapely.get_coordinates(union)
    reach = float(np.linalg.norm(corners - whole.centroid, axis=1).max())
    return shapes.Cells(whole.points, whole.sizes, reach)


def _as_rectangle(triangles: Floats) -> tuple[Floats, Floats, float] | None:
    """Return size, centre and angle of two triangles that make a rectangle, None for others."""
    corners = np.unique(np.round(triangles.reshape(-1, 2), 12), axis=0)
    if len(triangles) != 2 or len(corners) != 4:
        return None
    centre = corners.mean(axis=0)
    away = corners - centre
    order = np.argsort(np.arctan2(away[:, 1], away[:, 0]))
    sides = np.roll(corners[order], -1, axis=0) - corners[order]
    size = np.linalg.norm(sides[:2], axis=1)
    if abs(float(sides[0] @ sides[1])) > 1e-9 * float(size.prod()):
        return None
    if np.abs(sides[0] + sides[2]).max() > 1e-9 * size.max():
        return None
    angle = float(np.arctan2(sides[0, 1], sides[0, 0]))
    # Of the four ways to name it, the one that is turned least.
    quarter = round(angle / (0.5 * np.pi))
    turned = angle - quarter * 0.5 * np.pi
    return (
        (size if quarter % 2 == 0 else size[::-1]),
        centre,
        0.0 if abs(turned) < 1e-12 else turned,
    )


def _moved(points: Floats, pose: Floats) -> Floats:
    """Return points, shape (n, 3), in the frame that the pose, shape (4, 4), is given in."""
    return np.asarray(points @ pose[:3, :3].T + pose[:3, 3])
