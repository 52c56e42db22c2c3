# SPDX-License-Identifier: Apache-2.0
"""Outlines of bodies, and where a round tip touches them.

All in the body's frame. A tip of radius r whose centre is c touches an outline where the nearest
point q is r away; the normal is along c - q, also at a vertex, so that it turns steadily as the
tip rolls around one: its centre sees the outline grown by a disc.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from limit_surface_ros.checks import SMALLEST, as_coordinates
from limit_surface_ros.errors import OutlineError, RangeError, ShapeError
from limit_surface_ros.motion.push_checks import as_complex, as_vectors_of

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Bools, Floats, Places

# Lengths of bodies [m]; beyond them a file or a message holds other units.
_SMALLEST, _LARGEST = 1e-9, 1e9
MOST_VERTICES = 2000
# Turn of an outline, as a sine, that counts as straight on.
_STRAIGHT = 1e-12
# Part of an outline's size below which two vertices are one.
_SAME = 1e-12


class Nearest(NamedTuple):
    """The points of an outline that are nearest to others.

    Attributes:
        points: On the outline [m], shape (m, 2).
        normals: Unit outward normals of a tip that touches there, shape (m, 2).
        distances: To them [m], below 0 from within, shape (m,).
    """

    points: Floats
    normals: Floats
    distances: Floats


class Outline(ABC):
    """A closed curve that does not cross itself: the side of a body that pushers touch."""

    @property
    @abstractmethod
    def is_convex(self) -> bool:
        """Whether the outline is nowhere bent inward."""

    @abstractmethod
    def nearest(self, points: Floats) -> Nearest:
        """Return the nearest points of the outline to points of shape (m, 2) [m]."""

    @abstractmethod
    def curvatures(self, points: Floats) -> Floats:
        """Return the outline's curvatures (m,) [1/m] where it is nearest to points (m, 2) [m].

        Above 0 where it is bent outward; infinite at a vertex.
        """

    @abstractmethod
    def first_touch(self, starts: Floats, directions: Floats, radius: Floats) -> Floats:
        """Return how far tips can move before they touch.

        Args:
            starts: Centres of the tips [m], outside by at least their radius, shape (m, 2).
            directions: Unit vectors, shape (m, 2).
            radius: Of the tips [m], shape (m,); below 0, the depth at which a pusher touches.

        Returns:
            Lengths [m], infinite where the tip never touches, shape (m,).
        """

    @abstractmethod
    def touch_counts(self, points: Floats, distances: Floats, slack: float) -> Places:
        """Return at how many places of the outline points lie at given distances, shape (m,).

        A tip in an inward corner, or in a hollow in which it does not fit, touches two.

        Args:
            points: Shape (m, 2) [m].
            distances: Of the points from the outline, below 0 from within, shape (m,) [m].
            slack: What distances may be off [m].
        """

    @abstractmethod
    def touched(self, point: Floats, distance: float, slack: float) -> list[tuple[Floats, Floats]]:
        """Return the places that `touch_counts` counts for one point: feet and outward normals."""

    @abstractmethod
    def drawn(self) -> Floats:
        """Return vertices of the outline, or of a polygon that looks like it, shape (n, 2) [m]."""

    @cached_property
    def mean_radius(self) -> float:
        """Mean distance of its vertices from the origin [m]: what a turn moves, per radian."""
        return float(np.hypot(*self.drawn().T).mean())


class Polygon(Outline):
    """An outline of straight edges, convex or not.

    Args:
        vertices: In order, either way round, the first not repeated, shape (n, 2) [m].

    Raises:
        ShapeError: The vertices are no list of pairs of numbers.
        NotFiniteError: A coordinate is NaN or infinite.
        OutlineError: There are fewer than three vertices, they enclose no area, or edges cross.
        RangeError: There are more than 2000 vertices, or lengths that no body has.

    Example:
        >>> square = Polygon([[-1, -1], [1, -1], [1, 1], [-1, 1]])
        >>> square.nearest(np.array([[3.0, 0.5]])).distances
        array([2.])
    """

    def __init__(self, vertices: ArrayLike) -> None:
        """Check the vertices and turn them counterclockwise."""
        points = _vertices(vertices)
        following = np.roll(points, -1, axis=0)
        area = 0.5 * float((cross(points, following)).sum())
        size = float(np.ptp(points, axis=0).max())
        if not abs(area) > _SAME * size * size:
            raise OutlineError("the vertices of an outline enclose no area")
        if area < 0.0:
            points = points[::-1]
        if _crosses_itself(points):
            raise OutlineError("the edges of an outline must not cross or touch each other")
        points.setflags(write=False)
        self.vertices = points
        edges = np.roll(points, -1, axis=0) - points
        self._lengths = np.hypot(*edges.T)
        self._along = edges / self._lengths[:, np.newaxis]
        self._outward = np.stack([self._along[:, 1], -self._along[:, 0]], axis=1)
        self._starts = as_complex(points)
        # Points times these are along the edges, and to their left.
        self._turns = np.conj(as_complex(self._along))
        self._origins = self._starts * self._turns
        self._at_along = (points * self._along).sum(axis=1)
        self._at_outward = (points * self._outward).sum(axis=1)
        # Of the vertex at each edge's start.
        turns = cross(np.roll(self._along, 1, axis=0), self._along)
        self._inward = turns < -_STRAIGHT

    @property
    def is_convex(self) -> bool:
        """Whether no vertex is bent inward."""
        return not bool(self._inward.any())

    def nearest(self, points: Floats) -> Nearest:
        """See `Outline`: in the frame of each edge, along it and to its left."""
        z = as_complex(points)[:, np.newaxis] * self._turns
        z -= self._origins
        place = np.minimum(np.maximum(z.real, 0.0), self._lengths)
        away = z - place
        edge = (away.real**2 + away.imag**2).argmin(axis=1)
        chosen = np.arange(len(edge)), edge
        place, away = place[chosen], away[chosen]
        turn = np.conj(self._turns[edge])
        feet = self._starts[edge] + place * turn
        distances = np.abs(away)
        # To the right of an edge is outside.
        inside = away.imag > 0.0
        at_end = place >= self._lengths[edge]
        corner = np.flatnonzero(at_end | (place <= 0.0))
        if len(corner):
            # Only a vertex that is bent inward is nearest to a point within.
            vertex = (edge[corner] + at_end[corner]) % len(self._lengths)
            inside[corner] = self._inward[vertex]
        distances[inside] *= -1.0
        on = distances == 0.0
        if on.any():
            away[on], distances[on] = -1j, 1.0
            normals = turn * away / distances
            distances[on] = 0.0
        else:
            normals = turn * away / distances
        return Nearest(as_vectors_of(feet), as_vectors_of(normals), distances)

    def curvatures(self, points: Floats) -> Floats:
        """See `Outline`: 0 but for vertices."""
        away = self.nearest(points).points[:, np.newaxis] - self.vertices
        apart = np.hypot(away[:, :, 0], away[:, :, 1]).min(axis=1)
        return np.where(apart <= _SAME * np.ptp(self.vertices, axis=0).max(), np.inf, 0.0)

    def first_touch(self, starts: Floats, directions: Floats, radius: Floats) -> Floats:
        """See `Outline`: by the edges moved out by the radius, and circles about the vertices."""
        wide = radius[:, np.newaxis]
        height = starts @ self._outward.T - self._at_outward
        closing = directions @ self._outward.T
        # Slower than that it comes to no body's length.
        approaches = closing < -SMALLEST
        moved = (wide - height) / np.where(approaches, closing, -1.0)
        place = starts @ self._along.T - self._at_along + moved * (directions @ self._along.T)
        slack = 1e-12 * self._lengths
        hits = approaches & (moved >= 0.0) & (place >= -slack) & (place <= self._lengths + slack)
        best = np.where(hits, moved, np.inf).min(axis=1)
        if (radius > 0.0).any():
            # Vertices from the start: along the way, and to its left.
            ahead = directions @ self.vertices.T - (starts * directions).sum(axis=1)[:, np.newaxis]
            left = np.stack([-directions[:, 1], directions[:, 0]], axis=1)
            beside = left @ self.vertices.T - (starts * left).sum(axis=1)[:, np.newaxis]
            rest = wide * wide - beside * beside
            moved = ahead - np.sqrt(np.maximum(rest, 0.0))
            hits = (rest >= 0.0) & (moved >= 0.0) & (wide > 0.0)
            best = np.minimum(best, np.where(hits, moved, np.inf).min(axis=1))
        return np.asarray(best)

    def touch_counts(self, points: Floats, distances: Floats, slack: float) -> Places:
        """See `Outline`.

        An edge counts with the points beside it, a vertex bent outward with those beyond the ends
        of both its edges.
        """
        places = self._places(points, distances[:, np.newaxis], slack)
        return np.asarray(np.add.reduce(places[0], axis=1) + np.add.reduce(places[1], axis=1))

    def touched(self, point: Floats, distance: float, slack: float) -> list[tuple[Floats, Floats]]:
        """See `Outline`."""
        edges, corners = self._places(point[np.newaxis], distance, slack)
        found = []
        for edge in np.flatnonzero(edges[0]):
            along = (point - self.vertices[edge]) @ self._along[edge]
            foot = self.vertices[edge] + along * self._along[edge]
            found.append((foot, self._outward[edge]))
        for vertex in np.flatnonzero(corners[0]):
            arm = point - self.vertices[vertex]
            found.append((self.vertices[vertex], arm / max(float(np.hypot(*arm)), 1e-300)))
        return found

    def _places(
        self, points: Floats, distances: Floats | float, slack: float
    ) -> tuple[Bools, Bools]:
        along = points @ self._along.T - self._at_along
        height = points @ self._outward.T - self._at_outward
        beside = (along > 0.0) & (along < self._lengths)
        beyond = (along <= 0.0) & (np.roll(along - self._lengths, 1, axis=1) >= 0.0)
        edges = beside & (np.abs(height - distances) <= slack)
        corners = beyond & ~self._inward & (np.abs(np.hypot(along, height) - distances) <= slack)
        return edges, corners

    def drawn(self) -> Floats:
        """See `Outline`."""
        return self.vertices


def _vertices(values: ArrayLike) -> Floats:
    points = as_coordinates("vertices", values)
    if points.ndim != 2 or points.shape[1] != 2:
        raise ShapeError(f"vertices must have shape (n, 2), got {points.shape}")
    if len(points) > MOST_VERTICES:
        raise RangeError(
            f"an outline has at most {MOST_VERTICES} vertices, got {len(points)}: "
            "take an ellipse or a smooth curve for what is round"
        )
    if len(points) >= 3:
        check_length("vertices", float(np.ptp(points, axis=0).max()))
        apart = np.hypot(*(points - np.roll(points, 1, axis=0)).T)
        points = points[apart > _SAME * np.ptp(points, axis=0).max()]
    if len(points) < 3:
        raise OutlineError(f"an outline needs at least three vertices, got {len(points)}")
    return np.array(points)


def check_length(name: str, size: float) -> None:
    """Raise a RangeError for lengths that no body has."""
    if not _SMALLEST <= size <= _LARGEST:
        raise RangeError(
            f"{name} must be lengths of a body [m], {_SMALLEST:g} to {_LARGEST:g}, got {size}"
        )


def cross(a: Floats, b: Floats) -> Floats:
    """Return the cross products of vectors (..., 2), positive if b is to the left of a."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _crosses_itself(points: Floats) -> bool:
    """Return whether two edges that are not neighbours meet, or neighbours fold back."""
    count = len(points)
    ends = np.roll(points, -1, axis=0)
    along = ends - points
    folds = (cross(np.roll(along, 1, axis=0), along) == 0.0) & (
        (np.roll(along, 1, axis=0) * along).sum(axis=1) < 0.0
    )
    if folds.any():
        return True
    places: Places = np.arange(count)
    for edge in range(count - 2):
        # Each edge against those after it, but for its neighbours.
        others = places[edge + 2 : count - 1 if edge == 0 else count]
        a, b, c, d = points[edge], ends[edge], points[others], ends[others]
        sides = cross(b - a, c - a) * cross(b - a, d - a)
        others_sides = cross(d - c, a - c) * cross(d - c, b - c)
        meets: Bools = (sides <= 0.0) & (others_sides <= 0.0)
        if meets.any():
            # Edges along one line meet only where their boxes do.
            low, high = np.minimum(c, d), np.maximum(c, d)
            apart = (low > np.maximum(a, b)).any(axis=1) | (high < np.minimum(a, b)).any(axis=1)
            if (meets & ~apart).any():
                return True
    return False
