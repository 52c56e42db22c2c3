# SPDX-License-Identifier: Apache-2.0
"""Many shoved bodies at once: each row slides to rest with its own steps.

Rows may share a surface and an inertia or have their own, as the members of an ensemble do. A row
that comes near a crease, or that explicit steps do not bring to rest, is done by `slide`.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_vectors
from limit_surface_ros.errors import ShapeError
from limit_surface_ros.motion.sliding.body import SlidingBody
from limit_surface_ros.motion.sliding.dormand_prince import (
    COEFFICIENTS,
    ERROR_3,
    ERROR_5,
    STAGES,
    WEIGHTS,
)
from limit_surface_ros.motion.sliding.friction import NormFriction
from limit_surface_ros.motion.sliding.inertia import Inertia
from limit_surface_ros.motion.sliding.slide import TOLERANCE, slide_stages
from limit_surface_ros.motion.stages import finish
from limit_surface_ros.surface.base import LimitSurface

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Bools, Floats, Places
    from limit_surface_ros.motion.sliding.load import Load

# Rows that are integrated together: their stages stay in the processor's cache.
_BLOCK = 1024
# Part of a row's first energy norm below which it ends along its last direction.
_END = 1e-6
# |R_k q| in parts of its largest value below which a row is done alone.
_NEAR = 1e-4
_MOST_STEPS = 1500
_ROWS = tuple(np.array(row) for row in COEFFICIENTS)
_ERRORS = np.array([ERROR_5, ERROR_3])
_TINY = 1e-300


@dataclass(frozen=True, eq=False)
class Slides:
    """How bodies slid to rest.

    Attributes:
        times: When each rests [s], shape (n,).
        poses: Where: x, y of the reference point [m] and heading [rad], shape (n, 3).
        last_directions: Twists shortly before rest, of unit norm in the surface's scaled
            variables, in the bodies' frames, shape (n, 3); `slide` solves for those at rest.
        alone: Whether a row was done by `slide`, shape (n,).
    """

    times: Floats
    poses: Floats
    last_directions: Floats
    alone: Bools


def slides(
    surface: LimitSurface | Sequence[LimitSurface],
    inertia: Inertia | Sequence[Inertia],
    twists: ArrayLike,
    load: Load | None = None,
    poses: ArrayLike = (0.0, 0.0, 0.0),
) -> Slides:
    """Return how many bodies slide to rest, each as `slide` tells it.

    Args:
        surface: One for all rows, or one for each.
        inertia: One for all rows, or one for each.
        twists: At the start, shape (n, 3).
        load: On each body; under a load the rows are done one after the other.
        poses: At the start, one for all rows or shape (n, 3).

    Raises:
        ShapeError: The lengths do not fit.
        NotFiniteError: A number is NaN or infinite.
        DataError: A motion that nothing resists would never end.
        UnstableError: The load that stays is beyond what friction can hold.
        SolverError: A body does not come to rest.

    Example:
        >>> import numpy as np
        >>> from limit_surface_ros.motion.sliding.inertia import Inertia
        >>> from limit_surface_ros.surface.kinds.dissipation import Dissipation
        >>> surface = Dissipation([np.eye(3)])
        >>> found = slides(surface, Inertia(1.0, 1.0), [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
        >>> found.times.round(6).tolist()
        [1.0, 2.0]
    """
    starts = as_vectors("twists", twists)
    if starts.ndim != 2:
        raise ShapeError(f"twists must have shape (n, 3), got {starts.shape}")
    count = len(starts)
    places = as_vectors("poses", poses)
    if places.shape not in ((3,), (count, 3)):
        raise ShapeError(f"poses must have shape (3,) or ({count}, 3), got {places.shape}")
    places = np.broadcast_to(places, (count, 3))
    bodies = _bodies(surface, inertia, count)
    times, ends = np.zeros(count), places.astype(np.float64)
    directions, alone = np.zeros((count, 3)), np.ones(count, dtype=bool)
    for rows in _together(bodies, starts) if load is None else []:
        for first in range(0, len(rows), _BLOCK):
            block = rows[first : first + _BLOCK]
            members = [bodies[row] for row in block]
            done, stops, stopped, last = _slide_together(members, starts[block], places[block])
            rested = block[done]
            times[rested], ends[rested], alone[rested] = stops, stopped, False
            units = np.array([bodies[row].surface.scaling.twist_unit for row in rested])
            scaled = np.linalg.norm(last / units.reshape(-1, 3), axis=1, keepdims=True)
            directions[rested] = last / scaled
    for row in np.flatnonzero(alone).tolist():
        found = finish(slide_stages(bodies[row], starts[row], load, places[row]))
        times[row], ends[row], directions[row] = found.time, found.pose, found.final_direction
    return Slides(times, ends, directions, alone)


def _bodies(
    surface: LimitSurface | Sequence[LimitSurface],
    inertia: Inertia | Sequence[Inertia],
    count: int,
) -> list[SlidingBody]:
    """Return the body of each row; rows that share all share it."""
    surfaces = [surface] * count if isinstance(surface, LimitSurface) else list(surface)
    inertias = [inertia] * count if isinstance(inertia, Inertia) else list(inertia)
    if len(surfaces) != count or len(inertias) != count:
        raise ShapeError(
            f"{count} twists need one surface and inertia or {count} of them, got "
            f"{len(surfaces)} and {len(inertias)}"
        )
    known: dict[tuple[int, int], SlidingBody] = {}
    bodies = []
    for each, its in zip(surfaces, inertias, strict=True):
        key = (id(each), id(its))
        if key not in known:
            known[key] = SlidingBody(each, its)
        bodies.append(known[key])
    return bodies


def _together(bodies: list[SlidingBody], starts: Floats) -> list[Places]:
    """Return rows that move and whose friction can be evaluated at once, shape (m,) each."""
    groups: dict[object, list[int]] = {}
    for row, body in enumerate(bodies):
        if starts[row].any():
            friction = body.friction
            norms = isinstance(friction, NormFriction)
            key = len(friction.roots) if isinstance(friction, NormFriction) else id(body.surface)
            groups.setdefault((norms, key), []).append(row)
    return [np.array(rows) for rows in groups.values()]


class _Rows:
    """Rows whose friction is evaluated at once; (Vx, Vy, omega, heading, X, Y, time) of each."""

    def __init__(self, bodies: list[SlidingBody]) -> None:
        inertias = [body.inertia for body in bodies]
        self._mass = np.array([each.mass for each in inertias])
        self._moment = np.array([each.moment for each in inertias])
        self._centre = np.array([each.centre for each in inertias]).T
        self._largest = np.array([body.largest for body in bodies])
        self._map = bodies[0].friction
        # Rows of one body share its roots.
        members = bodies[:1] if all(body is bodies[0] for body in bodies) else bodies
        norms = [each.friction for each in members if isinstance(each.friction, NormFriction)]
        self._roots: Floats | None = None
        if norms:
            roots = np.array([each.roots for each in norms])
            inverses = np.array([np.linalg.inv(body.root) for body in members])
            self._weights = np.square(roots @ inverses[:, np.newaxis]).sum(axis=(2, 3)).T
            deficient = np.array([each.ranks < 3 for each in norms]).T
            self._near = np.where(deficient, _NEAR * np.sqrt(self._weights), 0.0)
            # Component of the image, of the twist, term, row.
            self._roots = np.ascontiguousarray(roots.transpose(2, 3, 1, 0))

    def take(self, keep: Bools) -> _Rows:
        """Return some of the rows."""
        rows = copy(self)
        rows._mass, rows._moment = self._mass[keep], self._moment[keep]
        rows._centre, rows._largest = self._centre[:, keep], self._largest[keep]
        if self._roots is not None and self._roots.shape[3] > 1:
            rows._roots = self._roots[..., keep]
            rows._weights, rows._near = self._weights[:, keep], self._near[:, keep]
        return rows

    def begin(self, twists: Floats, poses: Floats) -> Floats:
        """Return the states of twists and poses (m, 3), shape (7, m)."""
        vx, vy, turn = twists.T
        x, y, heading = poses.T
        c, s = np.cos(heading), np.sin(heading)
        cx, cy = self._centre
        bx, by = vx - turn * cy, vy + turn * cx
        place = [x + c * cx - s * cy, y + s * cx + c * cy, np.zeros(len(twists))]
        return np.array([c * bx - s * by, s * bx + c * by, turn, heading, *place])

    def scale(self, speed: Floats) -> Floats:
        """Return the sizes of the components for energy norms, shape (7, m)."""
        straight, turning = speed / np.sqrt(self._mass), speed / np.sqrt(self._moment)
        time = speed / self._largest
        place = straight * time
        return np.array([straight, straight, turning, turning * time, place, place, time])

    def speeds(self, y: Floats) -> Floats:
        """Return energy norms, shape (m,)."""
        squares = self._mass * (y[0] ** 2 + y[1] ** 2) + self._moment * y[2] ** 2
        return np.asarray(np.sqrt(squares))

    def slope(self, y: Floats) -> tuple[Floats, Bools]:
        """Return the derivatives by the scaled time, and which rows are near a crease."""
        twist, c, s = self._twist(y)
        (fx, fy, torque), rate, near = self._friction(twist, y)
        pace = 1.0 / rate
        cx, cy = self._centre
        push = -pace / self._mass
        rise = [
            push * (c * fx - s * fy),
            push * (s * fx + c * fy),
            -pace * (torque - cx * fy + cy * fx) / self._moment,
        ]
        return np.array([*rise, pace * y[2], pace * y[0], pace * y[1], pace]), near

    def rest(self, y: Floats) -> tuple[Floats, Floats, Floats]:
        """Return times (m,) and poses (m, 3) at rest, and the last twists (m, 3)."""
        twist, c, s = self._twist(y)
        force, _, _ = self._friction(twist, y)
        left = self.speeds(y) ** 2 / (force * twist).sum(axis=0)
        cx, cy = self._centre
        dx, dy, turn = 0.5 * left * twist
        poses = [
            y[4] - c * cx + s * cy + c * dx - s * dy,
            y[5] - s * cx - c * cy + s * dx + c * dy,
            y[3] + turn,
        ]
        return y[6] + left, np.array(poses).T, twist.T

    def _twist(self, y: Floats) -> tuple[Floats, Floats, Floats]:
        wx, wy, turn, heading = y[:4]
        c, s = np.cos(heading), np.sin(heading)
        cx, cy = self._centre
        return np.array([c * wx + s * wy + turn * cy, c * wy - s * wx - turn * cx, turn]), c, s

    def _friction(self, twist: Floats, y: Floats) -> tuple[Floats, Floats, Bools]:
        """Return wrenches (3, m), rates of the scaled time, and which rows are near a crease."""
        speed = self.speeds(y)
        if self._roots is None:
            force = self._map.wrenches(np.ascontiguousarray(twist.T)).T
            return force, self._largest / (speed + _TINY), np.zeros(len(speed), dtype=bool)
        (a, b, c), (_, d, e), (_, _, f) = self._roots
        x, z, turn = twist
        u, v, w = a * x + b * z + c * turn, d * z + e * turn, f * turn
        inverse = 1.0 / (np.sqrt(u * u + v * v + w * w) + _TINY)
        rate = (self._weights * inverse).sum(axis=0)
        near = (inverse * self._near * speed > 1.0).any(axis=0)
        u, v, w = u * inverse, v * inverse, w * inverse
        force = [a * u, b * u + d * v, c * u + e * v + f * w]
        return np.array([each.sum(axis=0) for each in force]), rate, near


def _slide_together(
    bodies: list[SlidingBody], twists: Floats, poses: Floats
) -> tuple[Bools, Floats, Floats, Floats]:
    """Return which rows came to rest, and the times, poses and last twists of these."""
    every = active = _Rows(bodies)
    y = ends = active.begin(twists, poses)
    ends = ends.copy()
    first = active.speeds(y)
    scale = TOLERANCE * active.scale(first)
    done = np.zeros(len(bodies), dtype=bool)
    rows, width = np.arange(len(bodies)), np.full(len(bodies), 0.1)
    slope, near = active.slope(y)
    for _ in range(_MOST_STEPS):
        end, error = _step(active, y, slope, width, scale)
        # Not a number fails the comparison.
        good = error <= 1.0
        change = 0.9 * np.maximum(np.where(error < 1e9, error, 1e9), 1e-12) ** -0.125
        y, width = np.where(good, end, y), width * np.clip(change, 0.2, 8.0)
        slope, near = active.slope(y)
        slow = active.speeds(y) < _END * first
        if (slow | near).any():
            done[rows[slow]] = True
            ends[:, rows[slow]] = y[:, slow]
            keep = ~(slow | near)
            if not keep.any():
                break
            rows, y, slope, width = rows[keep], y[:, keep], slope[:, keep], width[keep]
            first, scale, active = first[keep], scale[:, keep], active.take(keep)
    if not done.any():
        return done, np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3))
    return done, *every.take(done).rest(ends[:, done])


def _step(
    rows: _Rows, y: Floats, slope: Floats, width: Floats, scale: Floats
) -> tuple[Floats, Floats]:
    """Return where a step leads, and its errors in parts of the scale, shape (m,)."""
    stages = np.empty((STAGES, *y.shape))
    stages[0] = slope
    flat = stages.reshape(STAGES, -1)
    for count, row in enumerate(_ROWS, 1):
        place = y + width * (row @ flat[:count]).reshape(y.shape)
        stages[count] = rows.slope(place)[0]
    five, three = (((_ERRORS @ flat).reshape(2, *y.shape) / scale) ** 2).sum(axis=1)
    error = width * five / np.sqrt((five + 0.01 * three) * len(y) + _TINY)
    return y + width * (WEIGHTS @ flat).reshape(y.shape), error
