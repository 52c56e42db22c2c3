# SPDX-License-Identifier: Apache-2.0
"""What pushes come to: modes, motions and loads."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

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
