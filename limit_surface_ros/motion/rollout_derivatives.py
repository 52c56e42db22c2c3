# SPDX-License-Identifier: Apache-2.0
"""How the end of a push along a path changes with its start and with its path.

With F the rate of the pose q by the length of the path, c the tip's centre and u its direction, a
small change follows d(dq)/ds = F_q dq + F_c dc + F_u du along the path that `rollout` finds; it is
carried over its steps by Runge and Kutta's method. Lengths are measured in parts of each straight
piece, so that its ends may move. A tip that is on its way touches later the farther off the body
is, and the body is pushed that much less. Where the tip begins to slide, rolls onto a vertex or
leaves, F is continuous, and so is dq.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from limit_surface_ros.motion.inward_corner import TWO_PLACES
from limit_surface_ros.motion.outcomes import MODES, cubic_poses
from limit_surface_ros.motion.push_checks import as_complex, as_vectors_of
from limit_surface_ros.motion.push_derivatives import push_derivatives
from limit_surface_ros.motion.rollout import DEFAULT_ACCURACY, Pushing
from limit_surface_ros.motion.rollout_steps import in_body_frames

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from limit_surface_ros.checks import Bools, Complexes, Floats, Places
    from limit_surface_ros.motion.inward_corner import Scene
    from limit_surface_ros.motion.outline import Outline
    from limit_surface_ros.motion.rollout_steps import Rollout
    from limit_surface_ros.surface.base import LimitSurface

# Change of a rate, for a tip of unit speed, within the last piece that is no steady one.
_LEAP = 1e-2
# Part of a tip's motion towards the outline below which it may as well miss.
_GRAZING = 1e-9
# Difference of unit normals that is rounding.
_SAME = 1e-9
# A step in which the mode changes is cut into so many pieces, so often.
_PIECES, _ROUNDS = 32, 2


@dataclass(frozen=True, eq=False)
class EndDerivatives:
    """Where n pushes end, and how that changes.

    Attributes:
        end_poses: Of the bodies, x, y [m] and angle [rad], shape (n, 3).
        by_pose: Derivatives by the poses at the start, shape (n, 3, 3).
        by_path: Derivatives by the points of the paths, shape (n, 3, m, 2).
        smooth: Where all that the push meets has derivatives; shape (n,).
    """

    end_poses: Floats
    by_pose: Floats
    by_path: Floats
    smooth: Bools


def simulate_push_derivatives(
    surface: LimitSurface,
    outline: Outline,
    tip_radius: float,
    friction: float,
    poses: ArrayLike,
    paths: ArrayLike,
    *,
    accuracy: float = DEFAULT_ACCURACY,
    reference_point: ArrayLike = (0.0, 0.0),
) -> EndDerivatives:
    """Return where pushes end, as `simulate_pushes` does, and the derivatives of the end poses.

    Args:
        surface: Limit surface of the body; it should be convex.
        outline: Of the body, in its frame.
        tip_radius: Of the pusher [m]; 0 for a point.
        friction: Coefficient of friction between tip and body, from 0 to infinity.
        poses: Of the body at the starts, x, y [m] and angle [rad], shape (n, 3).
        paths: Of the tip's centre, polylines of as many points each, shape (n, m, 2) [m].
        accuracy: Error of the end pose that is aimed at [m]. Beside changes of the mode the
            derivatives' relative error is about the root of its part of the body's size.
        reference_point: Of the surface in the body's frame [m], shape (2,).

    Returns:
        An overlap at the start is kept, as `simulate_pushes` keeps it. A tip that only just
        touches there is taken to touch, whichever way the start moves.

    Raises:
        ShapeError, NotFiniteError, RangeError, OutlineError, SolverError: As `simulate_pushes`.
        DataError: The kind of surface has no derivatives in closed form.

    Example:
        >>> import numpy as np
        >>> from limit_surface_ros.motion.outline import Polygon
        >>> from limit_surface_ros.surface.kinds.power_sum import PowerSum
        >>> square = Polygon([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
        >>> body = PowerSum.thesis([np.eye(3)])
        >>> path = [[[-1.0, 0.0], [0.0, 0.0]]]
        >>> found = simulate_push_derivatives(body, square, 0.1, 0.3, [[0, 0, 0]], path)
        >>> found.by_path[0, 0].round(6).tolist()
        [[0.0, 0.0], [1.0, 0.0]]
    """
    pushing = Pushing(
        surface, outline, tip_radius, friction, accuracy, reference_point=reference_point
    )
    found = [
        (rollout.poses, *_ends(pushing.scene, rollout, pushing.radius))
        for rollout in pushing.recorded(poses, paths)
    ]
    ends, tangents, smooth = (np.concatenate(each) for each in zip(*found, strict=True))
    by_path = tangents[:, :, 3:].reshape(*ends.shape, -1, 2)
    return EndDerivatives(ends, tangents[:, :, :3], by_path, smooth)


class _Rates(NamedTuple):
    """Rates of poses (m, 3) by the path's length, and what they change with.

    By the pose (m, 3, 3), and by the tip's centre and direction (m, 3, 2). `gaps` (m, 3) are the
    derivatives of the distance from the outline by the pose; by the centre it is minus the first
    two. `closings` is how fast the tip closes in. Within one of the `pieces`, a mode on an edge or
    about a vertex, rates are smooth. `facing` holds normals in the body's frame where the outline
    is straight, and 0 elsewhere.
    """

    rates: Floats
    by_pose: Floats
    by_tip: Floats
    by_direction: Floats
    gaps: Floats
    closings: Floats
    pieces: NDArray[np.intp]
    facing: Complexes
    smooth: Bools


def _rates(scene: Scene, poses: Floats, tips: Complexes, directions: Complexes) -> _Rates:
    """Return rates where tips touch, with their derivatives; arrays as in `Rollout`."""
    turn, centre = in_body_frames(poses, tips)
    heading = directions * turn
    seen = as_vectors_of(centre)
    near, curvature = scene.outline.nearest(seen), scene.outline.curvatures(seen)
    outward = as_complex(near.normals)
    friction = scene.edge.imag / scene.edge.real if scene.edge.real > 0.0 else np.inf
    found = push_derivatives(
        scene.surface,
        as_vectors_of(as_complex(near.points) - scene.reference_point),
        -near.normals,
        friction,
        as_vectors_of(heading),
    )
    # The centre's step along the outline moves the nearest point less, and turns the normal.
    corner = ~(curvature < np.inf)
    apart = np.where(
        corner, near.distances, 1.0 + np.where(corner, 0.0, curvature) * near.distances
    )
    sharp = ~(apart > 1e-12 * np.where(corner, scene.outline.mean_radius, 1.0))
    apart[sharp] = np.inf
    moved, bent = np.where(corner, 0.0, 1.0) / apart, np.where(corner, 1.0, curvature) / apart
    along = as_vectors_of(1j * outward)
    by_place = moved[:, np.newaxis] * np.einsum("mij,mj->mi", found.twist.by_point, along)
    by_place += bent[:, np.newaxis] * found.twist.by_normal
    # By centre and heading in the body's frame, first.
    by_centre = by_place[:, :, np.newaxis] * along[:, np.newaxis]
    by_heading = found.twist.by_velocity
    back = np.conj(turn)[:, np.newaxis]

    def in_frame(columns: Floats) -> Floats:
        """Return changes of twists (m, 3, k) as changes of the rates of poses."""
        rates = np.empty_like(columns)
        x_y = columns[:, 0] + 1j * columns[:, 1] - 1j * scene.reference_point * columns[:, 2]
        x_y *= back
        rates[:, 0], rates[:, 1], rates[:, 2] = x_y.real, x_y.imag, columns[:, 2]
        return rates

    rates = in_frame(found.twists[:, :, np.newaxis])[:, :, 0]
    # A vector that stands still turns the other way in the body's frame.
    axes = np.stack([as_vectors_of(turn), as_vectors_of(1j * turn)], axis=2)
    by_tip, by_direction = in_frame(by_centre @ axes), in_frame(by_heading @ axes)
    turning = np.einsum("mij,mj->mi", by_centre, as_vectors_of(-1j * centre))
    turning += np.einsum("mij,mj->mi", by_heading, as_vectors_of(-1j * heading))
    by_angle = in_frame(turning[:, :, np.newaxis])[:, :, 0]
    by_angle[:, 0] -= rates[:, 1]
    by_angle[:, 1] += rates[:, 0]
    by_pose = np.concatenate([-by_tip, by_angle[:, :, np.newaxis]], axis=2)
    normals = as_vectors_of(outward * np.conj(turn))
    gaps = np.column_stack([-normals, (np.conj(outward) * -1j * centre).real])
    closings = -(np.conj(outward) * heading).real
    return _Rates(
        rates,
        by_pose,
        by_tip,
        by_direction,
        gaps,
        closings,
        found.modes + len(MODES) * corner,
        np.where(curvature == 0.0, outward, 0.0),
        found.smooth & ~sharp,
    )


class _Steps(NamedTuple):
    """Steps (m,) over which tips touch, of one push after the other.

    Attributes:
        pushes: Which push each is of.
        parts: On which straight part of its path.
        first: Where that part begins.
        last: Where it ends.
        passed: How far on it the step begins [m].
        lengths: How long the step is [m].
        before: Poses at its start, shape (m, 3).
        after: Poses at its end, shape (m, 3).
        touches: Whether the tip was on its way before.
    """

    pushes: Places
    parts: Places
    first: Complexes
    last: Complexes
    passed: Floats
    lengths: Floats
    before: Floats
    after: Floats
    touches: Bools

    def take(self, rows: Places | Bools) -> _Steps:
        """Return some of the steps."""
        values: Any = (each[rows] for each in self)
        return _Steps(*values)

    def shares(self, place: float) -> Floats:
        """Return which share of its part a tip has passed at a place of its step, 0 to 1."""
        return (self.passed + place * self.lengths) / np.abs(self.last - self.first)

    def rates(self, scene: Scene, place: float, poses: Floats) -> _Rates:
        """Return the rates of poses at a place of each step, 0 to 1."""
        ways = self.last - self.first
        return _rates(scene, poses, self.tips(place), ways / np.abs(ways))

    def tips(self, place: float) -> Complexes:
        """Return the tips' centres at a place of each step, 0 to 1."""
        return np.asarray(self.first + self.shares(place) * (self.last - self.first))

    def split(self, which: Bools, begin: Floats, end: Floats) -> _Steps:
        """Return the steps, some in `_PIECES` parts, from the rates (m, 3) at their ends."""
        counts = np.where(which, _PIECES, 1)
        rows = np.repeat(np.arange(len(counts)), counts)
        nth = np.arange(len(rows)) - np.repeat(np.cumsum(counts) - counts, counts)
        some = self.take(rows)
        share = nth / counts[rows]
        lengths = some.lengths / counts[rows]
        return some._replace(
            passed=some.passed + nth * lengths,
            lengths=lengths,
            before=some.between(share, begin[rows], end[rows]),
            after=some.between(share + 1.0 / counts[rows], begin[rows], end[rows]),
            touches=some.touches & (nth == 0),
        )

    def between(self, place: Floats | float, begin: Floats, end: Floats) -> Floats:
        """Return poses at places of the steps, from 0 to 1, by cubics."""
        return cubic_poses(place, self.lengths, self.before, self.after, begin, end)


def _steps(rollout: Rollout) -> _Steps:
    """Return the steps of pushes that a rollout recorded."""
    recorded = rollout.recorded
    order = np.argsort(recorded.pushes, kind="stable")
    rows, following = order[:-1], order[1:]
    lengths = recorded.lengths[following] - recorded.lengths[rows]
    some = (recorded.pushes[rows] == recorded.pushes[following]) & (lengths > 0.0)
    rows, following, lengths = rows[some], following[some], lengths[some]
    pushes, starts = recorded.pushes[rows], recorded.lengths[rows]
    before, after = recorded.poses[rows], recorded.poses[following]
    # A body that is not touched stays exactly where it is.
    moves = (before != after).any(axis=1)
    touches = np.zeros(len(rows), dtype=bool)
    touches[1:] = ~moves[:-1] & (pushes[1:] == pushes[:-1])
    begun = np.zeros(rollout.paths.shape)
    begun[:, 1:] = np.cumsum(np.abs(np.diff(rollout.paths, axis=1)), axis=1)
    middle = (starts + 0.5 * lengths)[:, np.newaxis]
    parts = (begun[pushes, 1:-1] <= middle).sum(axis=1)
    first, last = (rollout.paths[pushes, parts + k] for k in (0, 1))
    passed = starts - begun[pushes, parts]
    steps = _Steps(pushes, parts, first, last, passed, lengths, before, after, touches)
    return steps.take(moves)


class _Slopes(NamedTuple):
    """What drives derivatives of poses, and of gaps, at some place of each step.

    By the pose, shape (m, k, 3), and by the ends of the straight part, shape (m, k, 4).
    """

    by_pose: Floats
    by_ends: Floats

    def of(self, rows: Places, columns: Places, tangents: Floats) -> Floats:
        """Return changes (r, k, c) that come of derivatives (r, 3, c) of some steps' poses."""
        changes = self.by_pose[rows] @ tangents
        which, lines = np.arange(len(rows)), np.arange(changes.shape[1])
        changes[which[:, None, None], lines[:, None], columns[:, None]] += self.by_ends[rows]
        return np.asarray(changes)


def _switches(begin: _Rates, end: _Rates) -> Bools:
    """Return over which steps (m,) the mode or the side of the outline changes."""
    return np.asarray((begin.pieces != end.pieces) | (np.abs(begin.facing - end.facing) > _SAME))


def _at_two_places(scene: Scene, rollout: Rollout, steps: _Steps) -> Bools:
    """Return in which steps the tip ends at two places of the outline."""
    _, centres = in_body_frames(steps.after, steps.tips(1.0))
    slack = TWO_PLACES * scene.tolerance
    radii = rollout.radii[steps.pushes]
    return np.asarray(scene.outline.touch_counts(as_vectors_of(centres), radii, slack) > 1)


def _slopes(steps: _Steps, place: float, found: _Rates) -> tuple[_Slopes, _Slopes]:
    """Return what drives poses and gaps at a place of each step, 0 to 1."""
    share, whole = steps.shares(place), np.abs(steps.last - steps.first)
    shares = np.stack([1.0 - share, share], axis=1)[:, np.newaxis, :, np.newaxis]
    # The direction follows both ends.
    signs = np.stack([-1.0 / whole, 1.0 / whole], axis=1)[:, np.newaxis, :, np.newaxis]
    by_ends = (
        shares * found.by_tip[:, :, np.newaxis] + signs * found.by_direction[:, :, np.newaxis]
    )
    gaps = found.gaps[:, np.newaxis]
    gaps_by_ends = -shares * gaps[:, :, np.newaxis, :2]
    return (
        _Slopes(found.by_pose, by_ends.reshape(-1, 3, 4)),
        _Slopes(gaps, gaps_by_ends.reshape(-1, 1, 4)),
    )


def _ends(scene: Scene, rollout: Rollout, tip_radius: float) -> tuple[Floats, Bools]:
    """Return derivatives (n, 3, 3 + 2 m) of end poses by pose and path, and where smooth."""
    count, points = rollout.paths.shape
    tangents = np.zeros((count, 3, 3 + 2 * points))
    tangents[:, range(3), range(3)] = 1.0
    smooth = np.ones(count, dtype=bool)
    steps = _steps(rollout)
    if len(steps.pushes) == 0:
        return tangents, smooth
    begin, end = steps.rates(scene, 0.0, steps.before), steps.rates(scene, 1.0, steps.after)
    for _ in range(_ROUNDS):
        switches = _switches(begin, end)
        if not switches.any():
            break
        steps = steps.split(switches, begin.rates, end.rates)
        begin, end = steps.rates(scene, 0.0, steps.before), steps.rates(scene, 1.0, steps.after)
    middle = steps.rates(scene, 0.5, steps.between(0.5, begin.rates, end.rates))
    for found in (begin, middle, end):
        smooth[steps.pushes[~found.smooth]] = False
    closings = np.maximum(begin.closings, _GRAZING)
    # One that grazes may miss; one that overlapped at the start is as thin as that start says.
    doubtful = (begin.closings <= _GRAZING) | (rollout.radii[steps.pushes] < tip_radius)
    smooth[steps.pushes[steps.touches & doubtful]] = False
    # Where a point passes a vertex, or a tip lets go that could not slip, the rate leaps.
    size = np.array([1.0, 1.0, scene.outline.mean_radius])
    leaps = _switches(begin, end) & (np.abs((end.rates - begin.rates) * size).max(axis=1) > _LEAP)
    smooth[steps.pushes[leaps]] = False
    if not scene.outline.is_convex:
        # In an inward corner two places are touched.
        smooth[steps.pushes[_at_two_places(scene, rollout, steps)]] = False
    at_begin, gaps = _slopes(steps, 0.0, begin)
    at_middle, at_end = _slopes(steps, 0.5, middle)[0], _slopes(steps, 1.0, end)[0]
    counts = np.bincount(steps.pushes, minlength=count)
    firsts = np.cumsum(counts) - counts
    for place in range(counts.max()):
        pushes = np.flatnonzero(counts > place)
        rows = firsts[pushes] + place
        columns = (3 + 2 * steps.parts[rows])[:, np.newaxis] + np.arange(4)
        now = tangents[pushes]
        # A tip that touches later pushes less: by its rate times how much later that is.
        later = np.where(steps.touches[rows], 1.0 / closings[rows], 0.0)
        later = later[:, np.newaxis, np.newaxis] * gaps.of(rows, columns, now)
        now -= begin.rates[rows, :, np.newaxis] * later
        h = steps.lengths[rows, np.newaxis, np.newaxis]
        k1 = at_begin.of(rows, columns, now)
        k2 = at_middle.of(rows, columns, now + 0.5 * h * k1)
        k3 = at_middle.of(rows, columns, now + 0.5 * h * k2)
        k4 = at_end.of(rows, columns, now + h * k3)
        tangents[pushes] = now + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return tangents, smooth
