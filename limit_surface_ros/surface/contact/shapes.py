# SPDX-License-Identifier: Apache-2.0
"""Shapes of contact as cells: points with areas, by which integrals over the shape become sums.

Every function returns `Cells` of about `count` cells, each with its centroid and its area (for a
line its length), so that areas and centres are exact whatever the count.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_floats, as_positive
from limit_surface_ros.errors import GeometryError, MissingExtraError, RangeError, ShapeError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats

# Loads of 1000 cells are within 4e-4 of the friction limit at half of all motions and 3e-3 at all;
# those of 10 000 within 4e-5 and 2e-4: the error falls as 1 / count (bench_exactness.py).
DEFAULT_COUNT = 1000


@dataclass(frozen=True)
class Cells:
    """A shape cut into cells.

    Attributes:
        points: Centroids of the cells [m], shape (n, 2).
        sizes: Areas [m^2] or lengths [m] of the cells, shape (n,).
    """

    points: Floats
    sizes: Floats

    @property
    def centroid(self) -> Floats:
        """Centroid of the shape [m], shape (2,)."""
        return np.asarray(self.sizes @ self.points / self.sizes.sum())

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
        return Cells(self.points @ turn + offset, self.sizes)


def ellipse(semi_axes: ArrayLike, count: int = DEFAULT_COUNT) -> Cells:
    """Return an ellipse about the origin with semi-axes (a, b) [m] along x and y."""
    axes = _positive_pair("semi_axes", semi_axes)
    disc = ring(0.0, 1.0, count)
    return Cells(disc.points * axes, disc.sizes * axes.prod())


def disc(radius: float, count: int = DEFAULT_COUNT) -> Cells:
    """Return a disc of that radius [m] about the origin."""
    return ring(0.0, as_positive("radius", radius), count)


def ring(inner_radius: float, outer_radius: float, count: int = DEFAULT_COUNT) -> Cells:
    """Return a ring between two radii [m] about the origin; the inner may be 0 or the outer.

    With both radii equal it is a circular line.

    Raises:
        RangeError: The radii are not 0 <= inner <= outer, outer above 0.
    """
    outer = as_positive("outer_radius", outer_radius)
    if not 0.0 <= inner_radius <= outer:
        raise RangeError(f"inner_radius must be from 0 to {outer}, got {inner_radius}")
    _check_count(count)
    if inner_radius == outer:
        angle = 2.0 * np.pi * np.arange(count) / count
        points = outer * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        return Cells(points, np.full(count, 2.0 * np.pi * outer / count))
    # Annuli of equal width, each cut into cells about as long as they are wide.
    width = np.sqrt(np.pi * (outer**2 - inner_radius**2) / count)
    edges = np.linspace(inner_radius, outer, max(1, round((outer - inner_radius) / width)) + 1)
    centres: list[Floats] = []
    areas: list[Floats] = []
    for index, (low, high) in enumerate(pairwise(edges)):
        cells = max(3, round(np.pi * (low + high) / (high - low)))
        half = np.pi / cells
        angle = 2.0 * half * np.arange(cells) + half * (index % 2)
        radius = 2.0 / 3.0 * (high**3 - low**3) / (high**2 - low**2) * np.sin(half) / half
        centres.append(radius * np.stack([np.cos(angle), np.sin(angle)], axis=1))
        areas.append(np.full(cells, half * (high**2 - low**2)))
    return Cells(np.concatenate(centres), np.concatenate(areas))


def rectangle(size: ArrayLike, count: int = DEFAULT_COUNT) -> Cells:
    """Return a rectangle about the origin, of size (width, height) [m] along x and y."""
    extent = _positive_pair("size", size)
    _check_count(count)
    cell = np.sqrt(extent.prod() / count)
    numbers = np.maximum(1, np.round(extent / cell)).astype(int)
    x, y = (w * ((np.arange(n) + 0.5) / n - 0.5) for w, n in zip(extent, numbers, strict=True))
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    return Cells(points, np.full(len(points), extent.prod() / numbers.prod()))


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
    share = (np.arange(count)[:, np.newaxis] + 0.5) / count
    return Cells(ends[0] + share * (ends[1] - ends[0]), np.full(count, length / count))


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
    side = np.sqrt(shape.area / count)
    across = np.linspace(left, right, max(1, round((right - left) / side)) + 1)
    along = np.linspace(bottom, top, max(1, round((top - bottom) / side)) + 1)
    x, y = np.meshgrid(across[:-1], along[:-1])
    boxes = shapely.box(x, y, x + (across[1] - across[0]), y + (along[1] - along[0])).ravel()
    pieces = shapely.intersection(boxes, shape)
    areas = shapely.area(pieces)
    kept = areas > 1e-12 * shape.area
    return Cells(shapely.get_coordinates(shapely.centroid(pieces[kept])), areas[kept])


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
    return pair


def _check_count(count: int) -> None:
    if count < 1:
        raise RangeError(f"count must be at least 1, got {count}")
