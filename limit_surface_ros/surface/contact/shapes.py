# SPDX-License-Identifier: Apache-2.0
"""Shapes of contact as cells: points with areas, by which integrals over the shape become sums.

Every function returns `Cells` of about `count` cells, each a point with an area (for a line a
length). Discs, rings, ellipses and rectangles place them by the Gauss rule of two points in each
direction, whose sums are exact for polynomials of third degree on every block of four cells; so
areas and centres are exact whatever the count, and smooth pressures are to its square. A polygon's
and a line's cells are at their centroids.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_floats, as_positive
from limit_surface_ros.errors import GeometryError, MissingExtraError, RangeError, ShapeError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats

# Loads of 1000 cells of a disc are within 3e-5 of the friction limit at half of all motions and
# 2e-3 at all, where the centre of rotation is next to a cell; those of 10 000 within 1e-7 and 2e-4
# (bench_exactness.py). The moment of a pure turn is within 3e-5 for every pressure here.
DEFAULT_COUNT = 1000
# Lengths of bodies [m]: beyond them squares and areas leave the range of numbers.
SHORTEST, LONGEST = 1e-9, 1e9
# Offset of the two points of the Gauss rule from the middle of an interval of length 1.
_GAUSS = 0.5 / np.sqrt(3.0)
# Boxes over a polygon's bounding box, in parts of its cells: more for slivers, but not any number.
_MOST_BOXES = 100
# Coordinates of a centroid that are smaller, in parts of the reach, are rounding of zero.
_ZERO = 1e-12


@dataclass(frozen=True)
class Cells:
    """A shape cut into cells.

    Attributes:
        points: Centroids of the cells [m], shape (n, 2).
        sizes: Areas [m^2] or lengths [m] of the cells, shape (n,).
        reach: Distance [m] from the centroid to the farthest point of the shape; that of the
            farthest cell if not given.
    """

    points: Floats
    sizes: Floats
    reach: float = 0.0

    def __post_init__(self) -> None:
        """Fill in the reach."""
        if not self.reach > 0.0:
            arms = np.linalg.norm(self.points - self.centroid, axis=1)
            object.__setattr__(self, "reach", float(arms.max(initial=0.0)))

    @property
    def centroid(self) -> Floats:
        """Centroid of the shape [m], shape (2,); a coordinate that is rounding of zero is 0."""
        centroid = np.asarray(self.sizes @ self.points / self.sizes.sum())
        size = max(self.reach, float(np.abs(self.points).max(initial=0.0)))
        return np.where(np.abs(centroid) < _ZERO * size, 0.0, centroid)

    def placed(self, centre: ArrayLike = (0.0, 0.0), angle: float = 0.0) -> Cells:
        """Return the shape turned by `angle` [rad] about its origin, and then moved to `centre`.

        Raises:
            ShapeError: The centre is no pair.
        """
        offset = as_floats("centre", centre)
        if offset.shape != (2,):
            raise ShapeError(f"centre must have shape (2,), got {offset.shape}")
        cos, sin = np.cos(angle), np.sin(angle)
        turn = np.array([[cos, sin], [-sin, cos]])
        return Cells(self.points @ turn + offset, self.sizes, self.reach)


def ellipse(semi_axes: ArrayLike, count: int = DEFAULT_COUNT) -> Cells:
    """Return an ellipse about the origin with semi-axes (a, b) [m] along x and y."""
    axes = _positive_pair("semi_axes", semi_axes)
    disc = ring(0.0, 1.0, count)
    return Cells(disc.points * axes, disc.sizes * axes.prod(), float(axes.max()))


def disc(radius: float, count: int = DEFAULT_COUNT) -> Cells:
    """Return a disc of that radius [m] about the origin."""
    return ring(0.0, _length("radius", radius), count)


def ring(inner_radius: float, outer_radius: float, count: int = DEFAULT_COUNT) -> Cells:
    """Return a ring between two radii [m] about the origin; the inner may be 0 or the outer.

    With both radii equal it is a circular line.

    Raises:
        RangeError: The radii are not 0 <= inner <= outer, outer above 0.
    """
    outer = _length("outer_radius", outer_radius)
    if not 0.0 <= inner_radius <= outer:
        raise RangeError(f"inner_radius must be from 0 to {outer}, got {inner_radius}")
    _check_count(count)
    if inner_radius == outer:
        angle = 2.0 * np.pi * np.arange(count) / count
        points = outer * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        return Cells(points, np.full(count, 2.0 * np.pi * outer / count), outer)
    # Annuli of equal width with two circles of points in each, as far apart along the circles as
    # the circles are from each other.
    thickness = outer - inner_radius
    area = np.pi * (outer + inner_radius) * thickness / count
    annuli = max(1, round(0.5 * thickness / np.sqrt(area)))
    width = thickness / annuli
    middles = inner_radius + width * (np.arange(annuli) + 0.5)
    points_of_circles: list[Floats] = []
    sizes: list[Floats] = []
    for index, radius in enumerate((middles[:, None] + [-_GAUSS * width, _GAUSS * width]).ravel()):
        # An even number: every circle, and so the disc, is symmetric about both axes.
        half = max(2, round(0.5 * np.pi * radius * width / area))
        angle = np.pi * (np.arange(2 * half) + 0.5 * (index % 2)) / half
        points_of_circles.append(radius * np.stack([np.cos(angle), np.sin(angle)], axis=1))
        sizes.append(np.full(2 * half, 0.5 * np.pi * radius * width / half))
    return Cells(np.concatenate(points_of_circles), np.concatenate(sizes), outer)


def rectangle(size: ArrayLike, count: int = DEFAULT_COUNT) -> Cells:
    """Return a rectangle about the origin, of size (width, height) [m] along x and y."""
    extent = _positive_pair("size", size)
    _check_count(count)
    cell = np.sqrt(extent.prod() / count)
    blocks = np.clip(np.round(0.5 * extent / cell), 1, max(1, count // 2)).astype(int)
    x, y = (w * _gauss_points(n) for w, n in zip(extent, blocks, strict=True))
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    sizes = np.full(len(points), extent.prod() / len(points))
    return Cells(points, sizes, 0.5 * float(np.hypot(*extent)))


def _gauss_points(blocks: int) -> Floats:
    """Return two points in each of so many equal parts of [-1/2, 1/2], shape (2 blocks,)."""
    middles = (np.arange(blocks) + 0.5) / blocks - 0.5
    return np.asarray((middles[:, None] + np.array([-_GAUSS, _GAUSS]) / blocks).ravel())


def line(start: ArrayLike, end: ArrayLike, count: int = 100) -> Cells:
    """Return a line of contact between two points [m].

    Raises:
        GeometryError: The two points coincide.
    """
    ends = [as_floats("start", start), as_floats("end", end)]
    if any(point.shape != (2,) for point in ends):
        raise ShapeError("the start and the end of a line must be two numbers each")
    _check_count(count)
    length = float(np.hypot(*(ends[1] - ends[0])))
    if length == 0.0:
        raise GeometryError(f"a line of contact needs two points, got {ends[0].tolist()} twice")
    _length("the length of a line", length)
    share = (np.arange(count)[:, np.newaxis] + 0.5) / count
    points = ends[0] + share * (ends[1] - ends[0])
    return Cells(points, np.full(count, length / count), 0.5 * length)


def polygon(
    vertices: ArrayLike, holes: Sequence[ArrayLike] = (), count: int = DEFAULT_COUNT
) -> Cells:
    """Return a polygon, which need not be convex and may have holes.

    Args:
        vertices: Outer boundary [m], shape (n, 2), in either sense; closing it is optional.
        holes: Boundaries of holes, each like `vertices`.
        count: About how many cells.

    Raises:
        GeometryError: The polygon crosses itself, has no area, or a hole lies outside it.
        MissingExtraError: shapely is not installed.
    """
    try:
        import shapely
    except ImportError:
        raise MissingExtraError("shapely", "shapes") from None
    _check_count(count)
    shape = shapely.Polygon(_boundary(vertices), [_boundary(hole) for hole in holes])
    if not shape.is_valid:
        raise GeometryError(f"the polygon is not simple: {shapely.is_valid_reason(shape)}")
    if not shape.area > 0.0:
        raise GeometryError("the polygon has no area")
    left, bottom, right, top = shape.bounds
    _length("the longer side of a polygon", max(right - left, top - bottom))
    side = np.sqrt(max(shape.area, (right - left) * (top - bottom) / _MOST_BOXES) / count)
    across = np.linspace(left, right, max(1, round((right - left) / side)) + 1)
    along = np.linspace(bottom, top, max(1, round((top - bottom) / side)) + 1)
    x, y = np.meshgrid(across[:-1], along[:-1])
    boxes = shapely.box(x, y, x + (across[1] - across[0]), y + (along[1] - along[0])).ravel()
    pieces = shapely.intersection(boxes, shape)
    areas = shapely.area(pieces)
    kept = areas > 1e-12 * shape.area
    centroid = shapely.get_coordinates(shape.centroid)
    corners = shapely.get_coordinates(shape.exterior)
    reach = float(np.linalg.norm(corners - centroid, axis=1).max())
    return Cells(shapely.get_coordinates(shapely.centroid(pieces[kept])), areas[kept], reach)


def bitmap(pressures: ArrayLike, cell: float) -> tuple[Cells, Floats]:
    """Return the cells and pressures of a pressure map, centred on the origin.

    Args:
        pressures: Pressure in each cell in any unit, not negative, shape (rows, columns); the
            first row is the one of largest y, as in a picture.
        cell: Side of a cell [m].

    Raises:
        GeometryError: No cell carries pressure.
        RangeError: A pressure is negative.
    """
    array = as_floats("pressures", pressures)
    side = as_positive("cell", cell)
    if array.ndim != 2:
        raise ShapeError(f"pressures must have shape (rows, columns), got {array.shape}")
    if not (array >= 0.0).all():
        raise RangeError(f"pressures must not be negative, got {array.min()}")
    if not array.any():
        raise GeometryError("no cell of the pressure map carries any pressure")
    rows, columns = np.nonzero(array)
    x = (columns - 0.5 * (array.shape[1] - 1)) * side
    y = (0.5 * (array.shape[0] - 1) - rows) * side
    points = np.stack([x, y], axis=1)
    return Cells(points, np.full(len(points), side * side)), array[rows, columns]


def _boundary(vertices: ArrayLike) -> Floats:
    points = as_floats("vertices", vertices)
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < 3:
        raise ShapeError(f"vertices must have shape (n, 2) with n >= 3, got {points.shape}")
    return points


def _positive_pair(name: str, values: ArrayLike) -> Floats:
    pair = as_floats(name, values)
    if pair.shape != (2,):
        raise ShapeError(f"{name} must be two numbers, got shape {pair.shape}")
    if not (pair > 0.0).all():
        raise RangeError(f"{name} must be above 0, got {pair.tolist()}")
    for length in pair:
        _length(name, float(length))
    return pair


def _length(name: str, value: float) -> float:
    """Return a length that a body can have.

    Raises:
        RangeError: It is not above 0, or too small or too large for areas of it.
    """
    length = as_positive(name, value)
    if not SHORTEST <= length <= LONGEST:
        raise RangeError(f"{name} must be from {SHORTEST:g} to {LONGEST:g} m, got {length:g}")
    return length


def _check_count(count: int) -> None:
    if count < 1:
        raise RangeError(f"count must be at least 1, got {count}")
