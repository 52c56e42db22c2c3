# SPDX-License-Identifier: Apache-2.0
"""What pushes come to: modes, motions and loads."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_floats
from limit_surface_ros.errors import ShapeError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from limit_surface_ros.checks import Floats


class ContactMode(str, Enum):
    """What a pusher does at its contact; left and right as seen along the inward normal."""

    STICK = "stick"
    SLIDE_LEFT = "slide_left"
    SLIDE_RIGHT = "slide_right"
    SEPARATE = "separate"


# In the order of the numbers that `Pushes.modes` holds.
MODES = (
    ContactMode.STICK,
    ContactMode.SLIDE_LEFT,
    ContactMode.SLIDE_RIGHT,
    ContactMode.SEPARATE,
)


@dataclass(frozen=True, eq=False)
class Push:
    """Outcome of a push.

    Attributes:
        twist: Of the body at the reference point, (vx, vy, omega_z) in [m/s, m/s, rad/s].
        mode: Whether the pusher sticks to the body, or which way it slides along it.
        wrench: Of the pusher on the body, (fx, fy, tau_z) in [N, N, N m]; zero if it leaves.
    """

    twist: Floats
    mode: ContactMode
    wrench: Floats


@dataclass(frozen=True, eq=False)
class Pushes:
    """Outcomes of n pushes.

    Attributes:
        twists: Of the bodies at the reference point, (vx, vy, omega_z) in [m/s, m/s, rad/s],
            shape (n, 3).
        modes: Places in `MODES`: 0 stick, 1 slide left, 2 slide right, 3 separate; shape (n,).
        wrenches: Of the pushers on the bodies, (fx, fy, tau_z) in [N, N, N m], shape (n, 3).
    """

    twists: Floats
    modes: NDArray[np.intp]
    wrenches: Floats

    def __len__(self) -> int:
        """Return how many pushes there are."""
        return len(self.modes)

    def __getitem__(self, row: int) -> Push:
        """Return one of them."""
        return Push(self.twists[row], MODES[self.modes[row]], self.wrenches[row])


@dataclass(frozen=True, eq=False)
class MotionCone:
    """What a pusher can cause: wrenches and twists at the edges of the friction cone.

    Attributes:
        wrenches: On the limit surface, for the right and the left edge, shape (2, 3).
        twists: The motions these cause, of unit norm in scaled variables, shape (2, 3).
        velocities: Of the body at the contact in these motions, shape (2, 2); a pusher sticks
            whose velocity lies between them, turning from the right one to the left one.
    """

    wrenches: Floats
    twists: Floats
    velocities: Floats


@dataclass(frozen=True, eq=False)
class PushRuns:
    """Where n pushes end.

    Attributes:
        end_poses: Of the bodies, x, y [m] and angle [rad], shape (n, 3).
        touched_at: Lengths along the paths at which the tips first touch [m]; NaN if never.
        left_at: The same where they leave for good; NaN if they touch to the end, or never.
        errors: Sums of the estimated errors of the steps [m], of position or of the turn times
            the outline's mean radius; an estimate of the end pose's error, and no bound.
        evaluations: How many single pushes were solved for each.
    """

    end_poses: Floats
    touched_at: Floats
    left_at: Floats
    errors: Floats
    evaluations: NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class PushRun:
    """How one push goes on, at k places along its path.

    Attributes:
        end_pose: Of the body, x, y [m] and angle [rad], shape (3,).
        poses: On the way, shape (k, 3).
        path_lengths: Of the tip's path up to there [m], never falling, shape (k,).
        tips: Centres of the tip, shape (k, 2) [m].
        contacts: Points of the outline next to the tip, in the frame of the path, (k, 2) [m].
        modes: What the pusher does from there on, k members.
        twists: Of the body in its own frame about the surface's reference point, for a tip of
            1 m/s, (vx, vy, omega_z) in [m/s, m/s, rad/s], shape (k, 3).
        wrenches: Of the tip on the body, in its frame about that point, (fx, fy, tau_z) in
            [N, N, N m]; zero where it does not push, shape (k, 3).
        touched_at: Length along the path at which the tip first touches [m]; None if never.
        left_at: The same where it leaves for good; None if it touches to the end, or never.
        error: Sum of the estimated errors of the steps [m]; see `PushRuns`.
        evaluations: How many single pushes were solved.
    """

    end_pose: Floats
    poses: Floats
    path_lengths: Floats
    tips: Floats
    contacts: Floats
    modes: tuple[ContactMode, ...]
    twists: Floats
    wrenches: Floats
    touched_at: float | None
    left_at: float | None
    error: float
    evaluations: int
    _rates: Floats

    def poses_at(self, lengths: ArrayLike) -> Floats:
        """Return poses at lengths along the tip's path, by cubics between the steps.

        Args:
            lengths: [m], those beyond the path's ends are taken as the ends; shape (m,).

        Returns:
            x, y [m] and angle [rad], shape (m, 3).
        """
        asked = np.clip(as_floats("lengths", lengths), 0.0, self.path_lengths[-1])
        if asked.ndim != 1:
            raise ShapeError(f"lengths must have shape (m,), got {asked.shape}")
        s = self.path_lengths
        after = np.clip(np.searchsorted(s, asked, side="right"), 1, len(s) - 1)
        before = after - 1
        width = s[after] - s[before]
        place = (asked - s[before]) / np.where(width > 0.0, width, 1.0)
        return cubic_poses(
            place,
            width,
            self.poses[before],
            self.poses[after],
            self._rates[before],
            self._rates[after],
        )


def cubic_poses(
    places: Floats | float, widths: Floats, a: Floats, b: Floats, ka: Floats, kb: Floats
) -> Floats:
    """Return poses (m, 3) at places from 0 to 1 of steps with given widths (m,).

    By the cubics through the poses a and b (m, 3) at their ends, with the rates ka and kb there.
    """
    t, h = np.asarray(places)[..., np.newaxis], widths[:, np.newaxis]
    return np.asarray(
        (1 + 2 * t) * (1 - t) ** 2 * a
        + t * (1 - t) ** 2 * h * ka
        + t * t * (3 - 2 * t) * b
        - t * t * (1 - t) * h * kb
    )
