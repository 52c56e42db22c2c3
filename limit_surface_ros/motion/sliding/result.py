# SPDX-License-Identifier: Apache-2.0
"""What a slide is found to be: the rest, and the path there at any time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_floats

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.motion.sliding.equations import State


@dataclass(frozen=True, eq=False)
class Path:
    """Where a body was and how it moved.

    Attributes:
        times: Of the steps [s], never falling, shape (n,).
        poses: x, y of the reference point [m] and heading [rad] in the world, shape (n, 3).
        twists: (vx, vy, omega) at the reference point, in the body's frame, shape (n, 3).
        accelerations: Second derivatives of the poses by time, shape (n, 3).
    """

    times: Floats
    poses: Floats
    twists: Floats
    accelerations: Floats

    def at(self, times: ArrayLike) -> tuple[Floats, Floats]:
        """Return poses and twists at some times, between the steps by quintic interpolation.

        Args:
            times: Shape (m,) [s]; before the first and after the last step the body rests there.

        Returns:
            Poses and twists, shape (m, 3) each.

        Raises:
            NotFiniteError: A time is NaN or infinite.
        """
        asked = np.clip(as_floats("times", times), self.times[0], self.times[-1])
        right = np.clip(np.searchsorted(self.times, asked, "right"), 1, len(self.times) - 1)
        if len(self.times) == 1:
            return np.tile(self.poses, (len(asked), 1)), np.zeros((len(asked), 3))
        left = right - 1
        width = self.times[right] - self.times[left]
        safe = np.where(width > 0.0, width, 1.0)
        part = ((asked - self.times[left]) / safe)[:, np.newaxis]
        width = width[:, np.newaxis]
        velocities = _turned(self.twists, self.poses[:, 2])
        begin, end = self.poses[left], self.poses[right]
        v0, v1 = velocities[left] * width, velocities[right] * width
        a0, a1 = self.accelerations[left] * width**2, self.accelerations[right] * width**2
        rise = end - begin - v0 - 0.5 * a0
        speed = v1 - v0 - a0
        jump = a1 - a0
        c3 = 10.0 * rise - 4.0 * speed + 0.5 * jump
        c4 = -15.0 * rise + 7.0 * speed - jump
        c5 = 6.0 * rise - 3.0 * speed + 0.5 * jump
        poses = begin + part * (v0 + part * (0.5 * a0 + part * (c3 + part * (c4 + part * c5))))
        slopes = v0 + part * (a0 + part * (3.0 * c3 + part * (4.0 * c4 + part * 5.0 * c5)))
        slopes = slopes / safe[:, np.newaxis]
        return poses, _turned(slopes, -poses[:, 2])


@dataclass(frozen=True, eq=False)
class Slide:
    """How a body slid to rest.

    Attributes:
        time: When it rests for good [s].
        pose: Where: x, y of the reference point [m] and heading [rad] in the world, shape (3,).
        path: Poses and twists on the way; see `Path`.
        final_direction: The twist in whose direction it comes to rest, of unit norm in the
            surface's scaled variables, in the body's frame; zero if it never moved. Shape (3,).
        rests: Times [s] between which it rested on the way, shape (n, 2). A reversal is a rest of
            no length.
        energy_residual: Kinetic energy at the start plus work of the load less work of friction,
            in parts of what there was: how well the integration keeps the balance.
        evaluations: Of the friction.
    """

    time: float
    pose: Floats
    path: Path
    final_direction: Floats
    rests: Floats
    energy_residual: float
    evaluations: int


def _turned(vectors: Floats, angles: Floats) -> Floats:
    """Return planar vectors (n, 3) with their first two components turned by angles (n,)."""
    c, s = np.cos(angles), np.sin(angles)
    x, y, turn = vectors.T
    return np.stack([c * x - s * y, s * x + c * y, turn], axis=1)


class Recorder:
    """Collects the steps of a slide."""

    def __init__(self) -> None:
        """Begin with none."""
        self._rows: list[tuple[float, ...]] = []

    def __len__(self) -> int:
        """Return the number of steps so far."""
        return len(self._rows)

    def add(self, state: State, acceleration: Sequence[float]) -> None:
        """Add a state with the second derivatives of its pose."""
        self._rows.append((state.time, *state.pose, *state.twist, *acceleration))

    def arrive(self, state: State, acceleration: Sequence[float]) -> None:
        """Add a state at rest that was reached with some acceleration."""
        self._rest(state, acceleration)
        self._rest(state)

    def depart(self, state: State, acceleration: Sequence[float]) -> None:
        """Add a state at rest that is left with some acceleration."""
        self._rest(state)
        self._rest(state, acceleration)

    def stay(self, state: State) -> None:
        """Add a state at rest."""
        self._rest(state)

    def _rest(self, state: State, acceleration: Sequence[float] = (0.0, 0.0, 0.0)) -> None:
        self._rows.append((state.time, *state.pose, 0.0, 0.0, 0.0, *acceleration))

    def path(self) -> Path:
        """Return the path."""
        rows = np.array(self._rows)
        return Path(rows[:, 0], rows[:, 1:4], rows[:, 4:7], rows[:, 7:10])
