# SPDX-License-Identifier: Apache-2.0
"""Where a body goes that a tip pushes along a path: quasi-static, to a given accuracy."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_coordinates, as_number, as_positive
from limit_surface_ros.errors import OutlineError, RangeError, ShapeError
from limit_surface_ros.motion.inward_corner import Scene
from limit_surface_ros.motion.outcomes import MODES, PushRun, PushRuns
from limit_surface_ros.motion.push_checks import as_vectors_of, friction_edges
from limit_surface_ros.motion.rollout_steps import Rollout
from limit_surface_ros.motion.stages import finish

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.motion.outline import Outline
    from limit_surface_ros.surface.base import LimitSurface

__all__ = [
    "DEFAULT_ACCURACY",
    "OVERLAPS",
    "PushRun",
    "PushRuns",
    "Pushing",
    "simulate_push",
    "simulate_pushes",
]

DEFAULT_ACCURACY = 1e-5
# Accuracy that double precision still gives [m], and the coarsest that makes sense.
_FINEST, _COARSEST = 1e-12, 1.0
# The end pose is off by 1 to 2 times the error allowed for a step in the mean, 5 to 25 times in
# the worst of a hundred pushes.
_STEPS_PER_ACCURACY = 20.0
# Pushes moved together: few enough for arrays of them to stay in the processor's cache.
_BLOCK = 1024
OVERLAPS = ("keep", "push_out")
# Depth of a tip's centre within an outline, in mean radii, that no error of a pose explains.
_DEEPEST = 0.25
# Rounds in which tips and bodies are parted, until no overlap is left but rounding [m].
_PARTINGS, _ROUNDING = 30, 1e-15
# Motions that are searched for in a push, at least.
_SEARCHES = 10


def simulate_push(
    surface: LimitSurface,
    outline: Outline,
    tip_radius: float,
    friction: float,
    pose: ArrayLike,
    path: ArrayLike,
    *,
    accuracy: float = DEFAULT_ACCURACY,
    overlap: str = "keep",
    reference_point: ArrayLike = (0.0, 0.0),
) -> PushRun:
    """Return how a body moves that a round tip pushes along a path.

    Args:
        surface: Limit surface of the body; it should be convex.
        outline: Of the body, in its frame.
        tip_radius: Of the pusher [m]; 0 for a point.
        friction: Coefficient of friction between tip and body, from 0 to infinity.
        pose: Of the body at the start, x, y [m] and angle [rad], shape (3,).
        path: Of the tip's centre, a polyline in the frame of the pose, shape (m, 2) [m].
        accuracy: Error of the end pose that is aimed at [m]: nearly all pushes meet it, those
            that come close to a tie (straight at a corner, say) may not.
        overlap: Of tip and body at the start: "keep" takes it as an offset of the measured pose
            and the tip as that much thinner, "push_out" moves the body out of its way first.
        reference_point: Of the surface in the body's frame [m], shape (2,).

    Raises:
        ShapeError: An array has another shape, or `overlap` is none of the two words.
        NotFiniteError: A number is NaN or infinite.
        RangeError: The radius or the coefficient is below 0, or the accuracy out of range.
        OutlineError: Tip and body cannot be parted.
        SolverError: The path needs too many steps.

    Example:
        >>> import numpy as np
        >>> from limit_surface_ros.motion.outline import Polygon
        >>> from limit_surface_ros.surface.kinds.power_sum import PowerSum
        >>> square = Polygon([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
        >>> body = PowerSum.thesis([np.eye(3)])
        >>> run = simulate_push(body, square, 0.1, 0.3, [0, 0, 0], [[-1, 0], [0, 0]])
        >>> (np.round(run.end_pose, 6) + 0.0).tolist()
        [0.6, 0.0, 0.0]
    """
    pushing = Pushing(surface, outline, tip_radius, friction, accuracy, overlap, reference_point)
    return finish(pushing.along(pose, path))


def simulate_pushes(
    surface: LimitSurface,
    outline: Outline,
    tip_radius: float,
    friction: float,
    poses: ArrayLike,
    paths: ArrayLike,
    *,
    accuracy: float = DEFAULT_ACCURACY,
    overlap: str = "keep",
    reference_point: ArrayLike = (0.0, 0.0),
) -> PushRuns:
    """Return where n pushes of one body end: `simulate_push` for many, in far less time each.

    Args:
        surface: Limit surface of the body; it should be convex.
        outline: Of the body, in its frame.
        tip_radius: Of the pusher [m]; 0 for a point.
        friction: Coefficient of friction between tip and body, from 0 to infinity.
        poses: Of the body at the starts, x, y [m] and angle [rad], shape (n, 3).
        paths: Of the tip's centre, polylines of as many points each, shape (n, m, 2) [m].
        accuracy: See `simulate_push`.
        overlap: See `simulate_push`.
        reference_point: Of the surface in the body's frame [m], shape (2,).

    Raises:
        ShapeError, NotFiniteError, RangeError, OutlineError, SolverError: As `simulate_push`.
    """
    pushing = Pushing(surface, outline, tip_radius, friction, accuracy, overlap, reference_point)
    return finish(pushing.along_each(poses, paths))


class Pushing:
    """A body, a round tip and how exactly to follow the two, for one push or many.

    Work is in stages, between which who has more to do may do it; see `motion.stages`. What is
    wrong with paths and poses is told by the first stage.

    Args:
        surface, outline, tip_radius, friction, accuracy, overlap, reference_point: See
            `simulate_push`.

    Raises:
        ShapeError, NotFiniteError, RangeError: As `simulate_push`.
    """

    def __init__(
        self,
        surface: LimitSurface,
        outline: Outline,
        tip_radius: float,
        friction: float,
        accuracy: float = DEFAULT_ACCURACY,
        overlap: str = "keep",
        reference_point: ArrayLike = (0.0, 0.0),
    ) -> None:
        """Check the settings."""
        radius = as_number("tip_radius", as_coordinates("tip_radius", tip_radius))
        if radius < 0.0:
            raise RangeError(f"tip_radius must be 0 or above, got {radius}")
        if not _FINEST <= as_positive("accuracy", accuracy) <= _COARSEST:
            raise RangeError(f"accuracy must be {_FINEST:g} to {_COARSEST:g} m, got {accuracy}")
        if overlap not in OVERLAPS:
            raise RangeError(f"overlap must be one of {', '.join(OVERLAPS)}, got {overlap!r}")
        about = as_coordinates("reference_point", reference_point)
        if about.shape != (2,):
            raise ShapeError(f"reference_point must have shape (2,), got {about.shape}")
        self.scene = Scene(
            surface,
            outline,
            complex(*about.tolist()),
            complex(friction_edges(friction, 1)[0]),
            accuracy / _STEPS_PER_ACCURACY,
        )
        self.radius, self._overlap = radius, overlap

    def along(self, pose: ArrayLike, path: ArrayLike) -> Generator[None, None, PushRun]:
        """Do as `simulate_push`, in stages of about a millisecond."""
        given, way = as_coordinates("pose", pose), as_coordinates("path", path)
        if given.shape != (3,):
            raise ShapeError(f"pose must be x, y and an angle, got shape {given.shape}")
        if way.ndim != 2:
            raise ShapeError(f"path must have shape (m, 2), got {way.shape}")
        (rollout,) = self._blocks(given[np.newaxis], way[np.newaxis], record=True)
        yield from rollout.rounds()
        steps = rollout.recorded
        twists, modes, wrenches, contacts = rollout.outcomes(steps)
        touched, left = float(rollout.touched_at[0]), float(rollout.left_at[0])
        return PushRun(
            rollout.poses[0],
            steps.poses,
            steps.lengths,
            as_vectors_of(steps.tips),
            _placed(steps.poses, contacts),
            tuple(MODES[mode] for mode in modes),
            twists,
            wrenches,
            None if np.isnan(touched) else touched,
            None if np.isnan(left) else left,
            float(rollout.errors[0]),
            int(rollout.evaluations[0]),
            steps.rates,
        )

    def along_each(self, poses: ArrayLike, paths: ArrayLike) -> Generator[None, None, PushRuns]:
        """Do as `simulate_pushes`, in stages of a few milliseconds."""
        runs = []
        for rollout in self._blocks(*_poses_and_paths(poses, paths), record=False):
            yield from rollout.rounds()
            runs.append(rollout)
        return PushRuns(
            *(
                np.concatenate([getattr(run, name) for run in runs])
                for name in ("poses", "touched_at", "left_at", "errors", "evaluations")
            )
        )

    def recorded(self, poses: ArrayLike, paths: ArrayLike) -> Iterator[Rollout]:
        """Yield blocks of pushes that have ended, with all their steps."""
        for rollout in self._blocks(*_poses_and_paths(poses, paths), record=True):
            for _ in rollout.rounds():
                pass
            yield rollout

    def _blocks(self, poses: Floats, paths: Floats, *, record: bool) -> Iterator[Rollout]:
        """Yield blocks of pushes that have not begun, at least one."""
        if paths.shape[2:] != (2,) or paths.shape[1] < 2:
            raise ShapeError(f"a path has shape (m, 2) with m at least 2, got {paths.shape[1:]}")
        if self.scene.surface.wrench_is_closed:
            # Sliding pushes search for their motions: many together pay for a table.
            self.scene.surface.shape.expect(_SEARCHES * len(poses))
        for start in range(0, max(len(poses), 1), _BLOCK):
            block = slice(start, start + _BLOCK)
            begun, radii = self._parted(poses[block], paths[block, 0])
            yield Rollout(self.scene, begun, paths[block], radii, record=record)

    def _parted(self, poses: Floats, tips: Floats) -> tuple[Floats, Floats]:
        """Return poses from which to begin, and distances at which the tips touch."""
        outline = self.scene.outline
        begun = poses.copy()
        near = outline.nearest(_seen_from(begun, tips))
        deepest = -_DEEPEST * outline.mean_radius
        deep = np.flatnonzero(near.distances < deepest)
        if len(deep):
            raise OutlineError(
                f"the tip of push {deep[0]} begins {-near.distances[deep[0]]:.6g} m within the "
                f"outline: its centre may be at most {-deepest:.6g} m within"
            )
        if self._overlap == "keep":
            return begun, np.minimum(self.radius, near.distances)
        for _ in range(_PARTINGS):
            depth = np.maximum(self.radius - near.distances, 0.0)
            if (depth <= _ROUNDING).all():
                break
            c, s = np.cos(begun[:, 2]), np.sin(begun[:, 2])
            nx, ny = near.normals.T * depth
            begun[:, 0] -= c * nx - s * ny
            begun[:, 1] -= s * nx + c * ny
            near = outline.nearest(_seen_from(begun, tips))
        return begun, np.minimum(self.radius, near.distances)


def _poses_and_paths(poses: ArrayLike, paths: ArrayLike) -> tuple[Floats, Floats]:
    """Return starts of bodies (n, 3) and paths of tips (n, m, ...), checked."""
    given, ways = as_coordinates("poses", poses), as_coordinates("paths", paths)
    if given.ndim != 2 or given.shape[1] != 3:
        raise ShapeError(f"poses must have shape (n, 3), got {given.shape}")
    if ways.ndim != 3 or len(ways) != len(given):
        raise ShapeError(f"paths must have shape ({len(given)}, m, 2), got {ways.shape}")
    return given, ways


def _seen_from(poses: Floats, points: Floats) -> Floats:
    """Return points (m, 2) in the frames of bodies with poses (m, 3)."""
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    x, y = (points - poses[:, :2]).T
    return np.stack([c * x + s * y, c * y - s * x], axis=1)


def _placed(poses: Floats, points: Floats) -> Floats:
    """Return points (m, 2) of bodies with poses (m, 3) in the frame of the poses."""
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    x, y = points.T
    return np.stack([c * x - s * y, s * x + c * y], axis=1) + poses[:, :2]
