# SPDX-License-Identifier: Apache-2.0
"""Triangle meshes of limit surfaces, for pictures and RViz."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import RangeError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.base import LimitSurface


@dataclass(frozen=True, eq=False)
class Mesh:
    """A closed surface of triangles.

    Attributes:
        vertices: Wrenches on the surface, shape (n, 3), [N, N, N m].
        triangles: Indices of vertices, counter-clockwise as seen from outside, shape (m, 3).
        normals: The twist that each vertex causes, a unit vector in scaled variables that points
            out of the surface there, shape (n, 3), [m/s, m/s, rad/s].
    """

    vertices: Floats
    triangles: NDArray[np.int64]
    normals: Floats


def mesh_of(surface: LimitSurface, cells: int = 12) -> Mesh:
    """Return a mesh of a limit surface.

    Args:
        surface: The surface; it must bound every direction of load.
        cells: Parts into which each edge of an octahedron is cut, which is then drawn out to the
            surface: 8 cells^2 triangles on 4 cells^2 + 2 vertices.

    Raises:
        RangeError: There is no cell, or friction resists any amount of some load.
    """
    if cells < 1:
        raise RangeError(f"cells must be at least 1, got {cells}")
    directions, triangles = _sphere(cells)
    wrenches = directions * surface.scaling.wrench_unit
    factors = surface.load_factor(wrenches)[:, np.newaxis]
    if not (factors > 0.0).all():
        raise RangeError("a mesh needs a surface that bounds every direction of load")
    return Mesh(wrenches / factors, triangles, surface.twist_of_wrench(wrenches))


@lru_cache(maxsize=8)
def _sphere(cells: int) -> tuple[Floats, NDArray[np.int64]]:
    """Return unit vectors (n, 3) and triangles (m, 3) of an octahedron drawn out to a sphere."""
    # Points with whole coordinates and |x| + |y| + |z| = cells are the octahedron's.
    span = np.arange(-cells, cells + 1)
    grid = np.stack(np.meshgrid(span, span, span, indexing="ij"), axis=-1).reshape(-1, 3)
    points = grid[np.abs(grid).sum(axis=1) == cells]
    number = {tuple(point): index for index, point in enumerate(points.tolist())}
    triangles = []
    for i in range(cells):
        for j in range(cells - i):
            # In the positive octant, a triangle that points away from z, and one towards it.
            corners = [[(i + 1, j), (i, j + 1), (i, j)]]
            if i + j < cells - 1:
                corners.append([(i + 1, j), (i + 1, j + 1), (i, j + 1)])
            for corner in corners:
                octant = [(x, y, cells - x - y) for x, y in corner]
                triangles += _mirrored(octant, number)
    # Angles and not chords in proportion to the coordinates: cells of nearly one size.
    drawn = np.sin(0.5 * np.pi * points / cells)
    return drawn / np.linalg.norm(drawn, axis=1, keepdims=True), np.array(triangles)


def _mirrored(
    octant: list[tuple[int, int, int]], number: dict[tuple[int, ...], int]
) -> list[list[int]]:
    """Return a triangle of the positive octant in all eight, each turned the right way round."""
    triangles = []
    for signs in np.ndindex(2, 2, 2):
        mirror = [1 - 2 * sign for sign in signs]
        corners = [
            number[tuple(m * c for m, c in zip(mirror, point, strict=True))] for point in octant
        ]
        triangles.append(corners if sum(signs) % 2 == 0 else corners[::-1])
    return triangles
