# SPDX-License-Identifier: Apache-2.0
"""How far apart the ends of an ensemble's motions lie: pushes along a path, slides to rest."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import RangeError
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

        It has the shape of their covariance, whatever their distribution.

        Raises:
            RangeError: The probability is not between 0 and 1.

        Example:
            >>> turn = 2.0 * np.pi * np.arange(100) / 100
            >>> ends = EndPoses(np.stack([2 * np.cos(turn), np.sin(turn), 0 * turn], axis=1))
            >>> ends.ellipse(0.9).half_axes.round(6).tolist()
            [2.0, 1.0]
        """
        if not 0.0 < probability < 1.0:
            raise RangeError(f"probability must be above 0 and below 1, got {probability}")
        places = self.poses[:, :2]
        centre = places.mean(axis=0)
        values, axes = np.linalg.eigh(self.covariance[:2, :2])
        sizes = np.sqrt(np.maximum(values, 0.0))
        away = (places - centre) @ axes / np.where(sizes > 0.0, sizes, 1.0)
        reach = float(np.quantile(np.linalg.norm(away, axis=1), probability))
        angle = float(np.arctan2(axes[1, 1], axes[0, 1]))
        return Ellipse(centre, reach * sizes[::-1], angle)


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
