# SPDX-License-Identifier: Apache-2.0
"""Outlines without corners: ellipses, and smooth curves through points."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_floats, as_number, as_positive
from limit_surface_ros.errors import ShapeError
from limit_surface_ros.motion.outline import (
    MOST_VERTICES,
    Nearest,
    Outline,
    Polygon,
    check_length,
    cross,
)

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Bools, Floats, Places

# Rounds of the searches for a nearest point and a first touch.
_ROUNDS = 60
# Samples of a curve between two of its points, and at least in all.
_SAMPLES, _LEAST_SAMPLES = 8, 128


class Ellipse(Outline):
    """An ellipse, or a circle.

    Args:
        semi_axes: Half its length and half its width [m].
        centre: [m], shape (2,).
        angle: Of the first axis from x [rad].

    Raises:
        ShapeError: There are not two numbers each.
        NotFiniteError: A number is NaN or infinite.
        RangeError: A semi-axis is not above zero, or no length of a body.
    """

    def __init__(
        self, semi_axes: ArrayLike, centre: ArrayLike = (0.0, 0.0), angle: float = 0.0
    ) -> None:
        """Check the numbers."""
        axes, middle = as_floats("semi_axes", semi_axes), as_floats("centre", centre)
        if axes.shape != (2,) or middle.shape != (2,):
            raise ShapeError("an ellipse has two semi_axes and a centre of two coordinates")
        for axis in axes.tolist():
            check_length("semi_axes", as_positive("semi_axes", axis))
        self.semi_axes, self.centre = axes.copy(), middle.copy()
        for array in (self.semi_axes, self.centre):
            array.setflags(write=False)
        self.angle = as_number("angle", angle)
        c, s = np.cos(self.angle), np.sin(self.angle)
        self._turn = np.array([[c, -s], [s, c]])

    @property
    def is_convex(self) -> bool:
        """Always."""
        return True

    def nearest(self, points: Floats) -> Nearest:
        """See `Outline`: q = (a^2 x / (t + a^2), b^2 y / (t + b^2)), t by Newton's method.

        On the inverse root of its secular equation, which is nearly straight.
        """
        own = (points - self.centre) @ self._turn
        squares = self.semi_axes**2
        # On an axis within, the nearest point is beside it: a little to one side.
        sides = np.where(own < 0.0, -1.0, 1.0)
        away = np.maximum(np.abs(own), 1e-13 * self.semi_axes)
        t = np.maximum.reduce(self.semi_axes * away - squares, axis=1)
        scaled = self.semi_axes * away
        for _ in range(_ROUNDS):
            share = scaled / (t[:, np.newaxis] + squares)
            share *= share
            value = np.add.reduce(share, axis=1)
            slope = np.add.reduce(share / (t[:, np.newaxis] + squares), axis=1)
            step = value / slope * (np.sqrt(value) - 1.0)
            t = t + step
            if not (np.abs(step) > 1e-15 * squares.max()).any():
                break
        feet = sides * squares * away / (t[:, np.newaxis] + squares)
        normals = feet / squares
        length = np.hypot(*normals.T)
        # p - q = t (x / a^2, y / b^2).
        distances = t * length
        normals /= length[:, np.newaxis]
        return Nearest(feet @ self._turn.T + self.centre, normals @ self._turn.T, distances)

    def curvatures(self, points: Floats) -> Floats:
        """See `Outline`: (a b)^-2 (x^2 / a^4 + y^2 / b^4)^(-3/2)."""
        own = (self.nearest(points).points - self.centre) @ self._turn
        normals = own / self.semi_axes**2
        return np.asarray((self.semi_axes.prod() * np.hypot(*normals.T) ** 1.5) ** -2.0)

    def first_touch(self, starts: Floats, directions: Floats, radius: Floats) -> Floats:
        """See `Outline`."""
        return _touch_of_convex(self, starts, directions, radius)

    def touch_counts(self, points: Floats, distances: Floats, slack: float) -> Places:
        """See `Outline`: a tip outside touches one place."""
        return (np.abs(self.nearest(points).distances - distances) <= slack).astype(np.intp)

    def touched(self, point: Floats, distance: float, slack: float) -> list[tuple[Floats, Floats]]:
        """See `Outline`."""
        near = self.nearest(point[np.newaxis])
        touches = abs(near.distances[0] - distance) <= slack
        return [(near.points[0], near.normals[0])] if touches else []

    def drawn(self) -> Floats:
        """See `Outline`: 120 points."""
        angles = np.linspace(0.0, 2.0 * np.pi, 120, endpoint=False)
        around = np.stack([np.cos(angles), np.sin(angles)], axis=1) * self.semi_axes
        return np.asarray(around @ self._turn.T + self.centre)


class SmoothCurve(Outline):
    """A smooth closed curve through points: a periodic cubic spline over their chord lengths.

    Args:
        points: In order, either way round, the first not repeated, shape (n, 2) [m].

    Raises:
        ShapeError, NotFiniteError, OutlineError, RangeError: As `Polygon`.
    """

    def __init__(self, points: ArrayLike) -> None:
        """Check the points and interpolate them."""
        from scipy.interpolate import CubicSpline

        polygon = Polygon(points)
        knots = np.concatenate([polygon.vertices, polygon.vertices[:1]])
        lengths = np.hypot(*np.diff(knots, axis=0).T)
        places = np.concatenate([[0.0], np.cumsum(lengths)])
        self.points = polygon.vertices
        self._end = float(places[-1])
        self._curve = CubicSpline(places, knots, bc_type="periodic")
        parts = max(_SAMPLES, -(-_LEAST_SAMPLES // len(lengths)))
        parts = min(parts, max(1, MOST_VERTICES // len(lengths)))
        share = np.arange(parts) / parts
        self._places = (places[:-1, np.newaxis] + lengths[:, np.newaxis] * share).ravel()
        self._samples = Polygon(self._curve(self._places))
        self._reach = float(np.diff(np.append(self._places, self._end)).max())
        first, second = self._curve(self._places, 1), self._curve(self._places, 2)
        turning = cross(first, second)
        self._is_convex = bool((turning >= -1e-9 * np.abs(turning).max()).all())

    @property
    def is_convex(self) -> bool:
        """Whether the curve is bent inward nowhere, as its samples tell."""
        return self._is_convex

    def nearest(self, points: Floats) -> Nearest:
        """See `Outline`: Newton's method from the nearest of the curve's samples."""
        return self._from_samples(points, self._nearest_samples(points))

    def curvatures(self, points: Floats) -> Floats:
        """See `Outline`."""
        place = self._places_near(points, self._nearest_samples(points))
        first, second = self._curve(place, 1), self._curve(place, 2)
        return np.asarray(cross(first, second) / np.hypot(*first.T) ** 3)

    def touch_counts(self, points: Floats, distances: Floats, slack: float) -> Places:
        """See `Outline`: the least distances along the curve."""
        rows, samples = np.nonzero(self._least_samples(points))
        near = self._from_samples(points[rows], samples)
        touches = np.abs(near.distances - distances[rows]) <= slack
        return np.bincount(rows[touches], minlength=len(points))

    def touched(self, point: Floats, distance: float, slack: float) -> list[tuple[Floats, Floats]]:
        """See `Outline`."""
        samples = np.flatnonzero(self._least_samples(point[np.newaxis])[0])
        near = self._from_samples(np.repeat(point[np.newaxis], len(samples), axis=0), samples)
        touches = np.abs(near.distances - distance) <= slack
        return list(zip(near.points[touches], near.normals[touches], strict=True))

    def _nearest_samples(self, points: Floats) -> Places:
        return np.asarray(self._sample_squares(points).argmin(axis=1))

    def _sample_squares(self, points: Floats) -> Floats:
        """Return squared distances of samples, up to a number for each point, shape (m, n)."""
        samples = self._samples.vertices
        return np.asarray((samples**2).sum(axis=1) - 2.0 * points @ samples.T)

    def _least_samples(self, points: Floats) -> Bools:
        """Return which samples are nearer than their neighbours, shape (m, n)."""
        square = self._sample_squares(points)
        return np.asarray(
            (square < np.roll(square, 1, axis=1)) & (square <= np.roll(square, -1, axis=1))
        )

    def _from_samples(self, points: Floats, samples: Places) -> Nearest:
        """Return the least distances near samples, one for each point."""
        place = self._places_near(points, samples)
        feet, first = self._curve(place), self._curve(place, 1)
        first /= np.hypot(*first.T)[:, np.newaxis]
        normals = np.stack([first[:, 1], -first[:, 0]], axis=1)
        return Nearest(feet, normals, ((points - feet) * normals).sum(axis=1))

    def _places_near(self, points: Floats, samples: Places) -> Floats:
        """Return where the curve is nearest to points, near a sample each."""
        place = start = self._places[samples]
        for _ in range(_ROUNDS):
            arm = self._curve(np.mod(place, self._end)) - points
            at = np.mod(place, self._end)
            first, second = self._curve(at, 1), self._curve(at, 2)
            slope = (arm * first).sum(axis=1)
            speed = (first * first).sum(axis=1)
            curvature = speed + (arm * second).sum(axis=1)
            # Where the distance is not convex, Gauss and Newton's step leads down all the same.
            step = slope / np.where(curvature > 0.1 * speed, curvature, speed)
            moved = np.clip(place - step, start - self._reach, start + self._reach)
            done = not (np.abs(moved - place) > 1e-14 * self._end).any()
            place = moved
            if done:
                break
        return np.asarray(np.mod(place, self._end))

    def first_touch(self, starts: Floats, directions: Floats, radius: Floats) -> Floats:
        """See `Outline`: concave ones from where their samples' polygon is touched."""
        if self.is_convex:
            return _touch_of_convex(self, starts, directions, radius)
        best = self._samples.first_touch(starts, directions, radius)
        rows = np.flatnonzero(best < np.inf)
        moved = best[rows]
        for _ in range(8):
            near = self.nearest(starts[rows] + moved[:, np.newaxis] * directions[rows])
            closing = (near.normals * directions[rows]).sum(axis=1)
            gap = near.distances - radius[rows]
            moved = np.where(closing < -1e-3, np.maximum(moved - gap / closing, 0.0), moved)
        best[rows] = moved
        return np.asarray(best)

    def drawn(self) -> Floats:
        """See `Outline`: the samples."""
        return self._samples.vertices


def _touch_of_convex(
    outline: Outline, starts: Floats, directions: Floats, radius: Floats
) -> Floats:
    """Return first touches by Newton's method: along a line the distance is convex.

    From outside its steps never pass the root, and the distance stops falling where a tip misses.
    """
    moved = np.zeros(len(starts))
    rows = np.arange(len(starts))
    for _ in range(_ROUNDS):
        near = outline.nearest(starts[rows] + moved[rows, np.newaxis] * directions[rows])
        closing = (near.normals * directions[rows]).sum(axis=1)
        gap = near.distances - radius[rows]
        misses = closing >= 0.0
        moved[rows[misses]] = np.inf
        step = -gap / np.where(misses, -1.0, closing)
        goes_on = ~misses & (step > 1e-15 * (1.0 + moved[rows]))
        moved[rows[goes_on]] += step[goes_on]
        rows = rows[goes_on]
        if not len(rows):
            break
    return np.asarray(moved)
