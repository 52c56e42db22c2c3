# SPDX-License-Identifier: Apache-2.0
"""How far apart the ends of an ensemble's motions lie: pushes along a path, slides to rest.

An ensemble knows how the ground scatters, and nothing of the tip's friction, the outline or the
poses that were measured: the ellipse of 9 of 10 members held 0.05 to 0.28 of recorded pushes. With
some recorded pushes `calibrate_ends` makes it one that holds what it says.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_vectors
from limit_surface_ros.errors import DataError, RangeError, ShapeError
from limit_surface_ros.motion.rollout import DEFAULT_ACCURACY, simulate_push

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.motion.outline import Outline
    from limit_surface_ros.surface.base import LimitSurface

# What is told of a spread: the median and the ends of its middle 90 %.
QUANTILES = (0.05, 0.5, 0.95)


@dataclass(frozen=True)
class Ellipse:
    """A region of the plane.

    Attributes:
        centre: (x, y) [m], shape (2,).
        half_axes: The larger first, shape (2,) [m].
        angle: Of the larger axis from x [rad].
    """

    centre: Floats
    half_axes: Floats
    angle: float

    def border(self, count: int = 60) -> Floats:
        """Return points around it, shape (count, 2) [m]."""
        turn = 2.0 * np.pi * np.arange(count) / count
        c, s = np.cos(self.angle), np.sin(self.angle)
        along = np.stack([np.cos(turn), np.sin(turn)], axis=1) * self.half_axes
        return np.asarray(self.centre + along @ np.array([[c, s], [-s, c]]))


@dataclass(frozen=True, eq=False)
class EndPoses:
    """Where the members of an ensemble end.

    Attributes:
        poses: x, y [m] and heading [rad], not wound back to a turn, shape (n, 3).
    """

    poses: Floats

    @cached_property
    def pose_quantiles(self) -> Floats:
        """Of each component of the poses, at `QUANTILES`, shape (3, 3), quantile by component."""
        return np.quantile(self.poses, QUANTILES, axis=0)

    @cached_property
    def covariance(self) -> Floats:
        """Of the poses, shape (3, 3)."""
        return np.cov(self.poses.T)

    def ellipse(self, probability: float = 0.9) -> Ellipse:
        """Return an ellipse that holds the places of that share of the members.

        It has the shape of their covariance, whatever their distribution. Real ends lie outside
        more often: they err by more than members differ by; see `calibrate_ends`.

        Raises:
            RangeError: The probability is not between 0 and 1.

        Example:
            >>> turn = 2.0 * np.pi * np.arange(100) / 100
            >>> ends = EndPoses(np.stack([2 * np.cos(turn), np.sin(turn), 0 * turn], axis=1))
            >>> ends.ellipse(0.9).half_axes.round(6).tolist()
            [2.0, 1.0]
        """
        _check_probability(probability)
        distances = _distances(self, self.places - self.centre, 0.0)
        return _ellipse(self, 0.0, float(np.quantile(distances, probability)))

    @property
    def places(self) -> Floats:
        """(x, y) of the poses [m], shape (n, 2)."""
        return self.poses[:, :2]

    @property
    def centre(self) -> Floats:
        """Mean of the places [m], shape (2,)."""
        return np.asarray(self.places.mean(axis=0))


@dataclass(frozen=True, eq=False)
class EndCalibration:
    """How far from the members' ends recorded pushes ended.

    Attributes:
        deviation: Standard deviation of what members do not know, along every direction [m].
        distances: Of the recorded ends from the members' mean, in standard deviations of both, the
            least first, shape (n,).
    """

    deviation: float
    distances: Floats

    def ellipse(self, ends: EndPoses, probability: float = 0.9) -> Ellipse:
        """Return an ellipse that holds the place of another push's end with that probability.

        It does so whatever the distribution of the errors, as long as the other push is one like
        those that were recorded (split conformal prediction, Lei et al. 2018,
        doi:10.1080/01621459.2017.1307116).

        Args:
            ends: Of the members, by that push.
            probability: Of n recorded pushes at most n / (n + 1) can be told.

        Raises:
            RangeError: The probability is not between 0 and 1.
            DataError: The recorded pushes are too few for it.
        """
        _check_probability(probability)
        count = len(self.distances)
        rank = math.ceil(probability * (count + 1) - 1e-9)
        if rank > count:
            needed = math.ceil(probability / (1.0 - probability) - 1e-9)
            raise DataError(
                f"an ellipse of probability {probability:g} needs at least {needed} recorded "
                f"pushes, there are {count}"
            )
        return _ellipse(ends, self.deviation, float(self.distances[rank - 1]))


def calibrate_ends(ensembles: Sequence[EndPoses], recorded: ArrayLike) -> EndCalibration:
    """Compare where recorded pushes ended with where the members of an ensemble do.

    Args:
        ensembles: Ends of the members of each push, as of `push_spread`.
        recorded: Poses at which the pushes ended, x, y [m] and heading [rad], of which the places
            count, shape (n, 3).

    Raises:
        ShapeError: There are not as many poses as ensembles, or they are none.
        NotFiniteError: A pose is NaN or infinite.
        DataError: There are none.

    Example:
        >>> rng = np.random.default_rng(0)
        >>> ends = [EndPoses(rng.normal(size=(8, 3)) * [3e-3, 1e-4, 0.1]) for _ in range(29)]
        >>> true = 1e-3 * rng.normal(size=(29, 3))
        >>> known = calibrate_ends(ends[:20], true[:20])
        >>> bool(known.ellipse(ends[20]).half_axes[1] > 1e-3)
        True
    """
    poses = as_vectors("recorded poses", recorded).reshape(-1, 3)
    if len(poses) != len(ensembles):
        raise ShapeError(f"{len(ensembles)} ensembles need as many poses, there are {len(poses)}")
    if not len(poses):
        raise DataError("there are no recorded pushes")
    away = [pose[:2] - ends.centre for pose, ends in zip(poses, ensembles, strict=True)]
    # Half of a round normal distribution lies within; a push that went astray moves it little.
    half = float(np.median(np.linalg.norm(away, axis=1)))
    deviation = half / math.sqrt(2.0 * math.log(2.0))
    distances = [
        float(_distances(ends, each[None], deviation)[0])
        for ends, each in zip(ensembles, away, strict=True)
    ]
    return EndCalibration(deviation, np.sort(distances))


def _check_probability(probability: float) -> None:
    if not 0.0 < probability < 1.0:
        raise RangeError(f"probability must be above 0 and below 1, got {probability}")


def _axes(ends: EndPoses, deviation: float) -> tuple[Floats, Floats]:
    """Return standard deviations, the smaller first, of places and more, and their axes."""
    values, axes = np.linalg.eigh(ends.covariance[:2, :2])
    return np.sqrt(np.maximum(values, 0.0) + deviation**2), axes


def _distances(ends: EndPoses, away: Floats, deviation: float) -> Floats:
    """Return how far from the centre places lie, in standard deviations, shape (n,)."""
    sizes, axes = _axes(ends, deviation)
    along = away @ axes / np.where(sizes > 0.0, sizes, 1.0)
    return np.asarray(np.linalg.norm(along, axis=1))


def _ellipse(ends: EndPoses, deviation: float, reach: float) -> Ellipse:
    sizes, axes = _axes(ends, deviation)
    return Ellipse(ends.centre, reach * sizes[::-1], float(np.arctan2(axes[1, 1], axes[0, 1])))


def push_spread(
    surfaces: Sequence[LimitSurface],
    outline: Outline,
    tip_radius: float,
    friction: float,
    pose: ArrayLike,
    path: ArrayLike,
    *,
    accuracy: float = DEFAULT_ACCURACY,
    overlap: str = "keep",
    reference_point: ArrayLike = (0.0, 0.0),
) -> EndPoses:
    """Return how the ends of one push spread over an ensemble of surfaces.

    Args:
        surfaces: The members, such as `UncertainSurface.members`; at least two.
        outline: As in `simulate_push`, as are all others.
        tip_radius: Of the pusher [m].
        friction: Coefficient between tip and body.
        pose: At the start, shape (3,).
        path: Of the tip's centre, shape (m, 2) [m].
        accuracy: Of each end pose [m].
        overlap: Of tip and body at the start.
        reference_point: Of the surfaces [m], shape (2,).

    Raises:
        RangeError: There are fewer than two members, or as in `simulate_push`.
        LimitSurfaceError: As in `simulate_push`.
    """
    if len(surfaces) < 2:
        raise RangeError("an ensemble needs at least two members")
    ends = [
        simulate_push(
            surface,
            outline,
            tip_radius,
            friction,
            pose,
            path,
            accuracy=accuracy,
            overlap=overlap,
            reference_point=reference_point,
        ).end_pose
        for surface in surfaces
    ]
    return EndPoses(np.array(ends))
