# SPDX-License-Identifier: Apache-2.0
"""Streams of wrenches and twists cut into segments, each of which is one push to learn.

Samples of one push are no independent pushes: friction is off by the same error in all of them.
Learnt one by one they would drive the earlier pushes out of a window. So load and unit motion are
averaged until the running mean of either has turned by some degrees since the segment began, or
contact or motion is lost; segments of few samples are dropped.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_positive, as_vector

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.scaling import Scaling

# Samples of the running means.
_RUN = 5
_TINY = 1e-300


class Segments:
    """Cuts a stream of samples into pairs of a mean wrench and a mean direction of motion.

    Example:
        >>> from limit_surface_ros.surface.scaling import Scaling
        >>> segments = Segments(Scaling(0.1, 2.0))
        >>> for k in range(10):
        ...     closed = segments.feed(0.01 * k, [2.0, 0.0, 0.0], [0.05, 0.0, 0.0])
        >>> wrench, twist = segments.feed(0.1, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0])
        >>> wrench.tolist(), twist.tolist()
        ([2.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    """

    def __init__(
        self,
        scaling: Scaling,
        *,
        turn_deg: float = 8.0,
        least: int = 5,
        least_force: float = 0.1,
        least_speed: float = 1e-3,
        most_gap: float = 0.5,
    ) -> None:
        """Begin without a segment.

        Args:
            scaling: Makes moments and rotations comparable.
            turn_deg: Turn of load or motion at which a segment ends [deg], in scaled variables.
            least: Samples of a segment at least.
            least_force: Load below which there is no contact, in parts of the friction force.
            least_speed: Speed below which the body is at rest, in scaled variables [m/s].
            most_gap: Time between samples that ends a segment [s]. One that is behind by less has
                come late, and counts like the others.

        Raises:
            RangeError: A number is not above zero, or not finite.
        """
        numbers = {
            "turn_deg": turn_deg,
            "least": least,
            "least_force": least_force,
            "least_speed": least_speed,
            "most_gap": most_gap,
        }
        for name, number in numbers.items():
            as_positive(name, number)
        self._scaling = scaling
        self._turn = float(np.cos(np.radians(turn_deg)))
        self._least = least
        self._least_force, self._least_speed = least_force, least_speed
        self._most_gap = most_gap
        self._stamp: float | None = None
        self._loads: list[Floats] = []
        self._motions: list[Floats] = []
        self._runs: deque[tuple[Floats, Floats]] = deque(maxlen=_RUN)
        self._first: tuple[Floats, Floats] | None = None

    def feed(
        self, stamp: float, wrench: ArrayLike, twist: ArrayLike
    ) -> tuple[Floats, Floats] | None:
        """Take a sample; return the pair of the segment that it ends, if it ends one.

        Args:
            stamp: [s]. Equal ones are those of a clock that rises more slowly than samples come.
            wrench: (fx, fy, tau_z) [N, N, N m], shape (3,).
            twist: (vx, vy, omega_z) [m/s, m/s, rad/s] at the same time, shape (3,).

        Returns:
            Mean wrench and unit (in scaled variables) mean twist of the segment, shape (3,) each.

        Raises:
            ShapeError: Wrench or twist are no three numbers.
            NotFiniteError: A component is NaN or infinite.
        """
        load = as_vector("wrench", wrench) / self._scaling.wrench_unit
        motion = as_vector("twist", twist) / self._scaling.twist_unit
        speed = float(np.linalg.norm(motion))
        gap = self._stamp is not None and not abs(stamp - self._stamp) <= self._most_gap
        closed = self.close() if gap else None
        self._stamp = stamp if self._stamp is None else max(stamp, self._stamp)
        if float(np.linalg.norm(load)) < self._least_force or speed < self._least_speed:
            return closed or self.close()
        motion = motion / speed
        self._runs.append((load, motion))
        if self._first is None and len(self._runs) == _RUN:
            self._first = self._mean()
        elif self._first is not None and self._has_turned():
            newest = self._stamp
            closed = self.close()
            self._stamp = newest
            self._runs.append((load, motion))
        self._loads.append(load)
        self._motions.append(motion)
        return closed

    def close(self) -> tuple[Floats, Floats] | None:
        """End the segment; return its pair, None if it has too few samples."""
        loads, motions = self._loads, self._motions
        self._begin()
        if len(loads) < self._least:
            return None
        motion = np.mean(motions, axis=0)
        size = float(np.linalg.norm(motion))
        if size < 0.5:
            # The motion went to and fro: its mean is none.
            return None
        wrench = np.mean(loads, axis=0) * self._scaling.wrench_unit
        return np.asarray(wrench), np.asarray(motion / size * self._scaling.twist_unit)

    def _begin(self) -> None:
        self._stamp = None
        self._loads, self._motions = [], []
        self._runs.clear()
        self._first = None

    def _mean(self) -> tuple[Floats, Floats]:
        loads, motions = zip(*self._runs, strict=True)
        return _unit(np.mean(loads, axis=0)), _unit(np.mean(motions, axis=0))

    def _has_turned(self) -> bool:
        assert self._first is not None
        now = self._mean()
        return any(float(a @ b) < self._turn for a, b in zip(self._first, now, strict=True))


def _unit(vector: Floats) -> Floats:
    return np.asarray(vector / max(float(np.linalg.norm(vector)), _TINY))
