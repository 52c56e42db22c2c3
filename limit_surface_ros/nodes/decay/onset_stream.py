# SPDX-License-Identifier: Apache-2.0
"""The falling wrench and its value, published while an onset dies away."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from geometry_msgs.msg import Vector3Stamped, WrenchStamped
from rclpy.clock import JumpThreshold
from rclpy.duration import Duration

from limit_surface_ros.errors import LimitSurfaceError
from limit_surface_ros.nodes.messages.convert import fill_stamp

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from geometry_msgs.msg import Wrench
    from rclpy.node import Node

    from limit_surface_ros.nodes.decay.onset import Onset
    from limit_surface_ros.nodes.serving.endpoints import Output


# What has been due for longer was missed: a stalled process does not flood its listeners [ns].
LONGEST_DELAY = 1_000_000_000


class Schedule:
    """Stamps start + k / rate of one stream, counted and not added up, in integer nanoseconds.

    A timer that fires late, or a simulated clock that ticks coarsely, delays messages but neither
    loses them nor shifts the stamps of those that follow.

    Args:
        start: Time of the first stamp [ns].
        rate: Stamps a second [Hz].
        now: Present time [ns]; stamps before it are not due any more.
    """

    def __init__(self, start: int, rate: float, now: int) -> None:
        """Begin at the first stamp that is not past."""
        self._start = start
        self._rate = rate
        self.restart(now)

    def restart(self, now: int) -> None:
        """Go on from the first stamp that is not before `now` [ns]: the clock has jumped."""
        elapsed = now - self._start
        self._next = max(0, math.ceil(elapsed * 1e-9 * self._rate))
        # Rounding may have taken a stamp that is due just now for one that is past.
        if self._next > 0 and self._offset(self._next - 1) >= elapsed:
            self._next -= 1

    @property
    def next_offset(self) -> int:
        """Time from the start to the stamp that is due next [ns]."""
        return self._offset(self._next)

    @property
    def next_stamp(self) -> int:
        """The stamp that is due next [ns]."""
        return self._start + self.next_offset

    def due(self, now: int) -> list[int]:
        """Return the times from the start to all stamps that have come due [ns], each once."""
        if now - self.next_stamp > LONGEST_DELAY:
            self.restart(now)
        offsets: list[int] = []
        while self.next_stamp <= now:
            offsets.append(self.next_offset)
            self._next += 1
        return offsets

    def _offset(self, index: int) -> int:
        return round(index * 1e9 / self._rate)


class OnsetStream:
    """Publishes the present onset's load at a steady rate, in node time.

    The timer is aimed at each stamp anew, so that a message leaves when its stamp is reached and
    nothing adds up; where node time jumps, the stream goes on from the time it jumped to.

    Args:
        node: The node, for its clock and timer.
        wrenches: Publisher of WrenchStamped.
        values: Publisher of Vector3Stamped.
        advanced: Told the node time [ns] when messages have gone out.
        jumped_back: Told when node time was set back, before the stream goes on.
        refused: Told what could not be published, and why.
    """

    def __init__(
        self,
        node: Node,
        wrenches: Output,
        values: Output,
        advanced: Callable[[int], None],
        jumped_back: Callable[[], None],
        refused: Callable[[str, Exception], object],
    ) -> None:
        """Wait for an onset."""
        self._clock = node.get_clock()
        self._wrenches = wrenches
        self._values = values
        self._advanced = advanced
        self._jumped_back = jumped_back
        self._refused = refused
        self._wrench = WrenchStamped()
        self._value = Vector3Stamped()
        self._onset: Onset | None = None
        self._end = 0.0
        self._timer = node.create_timer(1.0, self._publish_due, autostart=False)
        self._jumps = self._clock.create_jump_callback(
            JumpThreshold(
                min_forward=None, min_backward=Duration(nanoseconds=-1), on_clock_change=True
            ),
            post_callback=lambda jump: self._restart(),
        )

    @property
    def running(self) -> bool:
        """Whether an onset is waited for or is dying away."""
        return self._onset is not None and not self._timer.is_canceled()

    @property
    def end(self) -> float:
        """Time after the onset at which publishing ends [s]."""
        return self._end

    def start(self, onset: Onset, rate: float, end: float) -> None:
        """Publish an onset's load from now on, in place of the one before.

        Args:
            onset: The onset; in the future: it is waited for.
            rate: Messages a second [Hz].
            end: Time after the onset at which publishing ends [s].
        """
        self._onset = onset
        self._wrench.header.frame_id = onset.message.header.frame_id
        self._value.header.frame_id = onset.message.header.frame_id
        self._schedule = Schedule(onset.start, rate, self._now())
        self.end_at(end)

    def end_at(self, end: float) -> None:
        """Set the time after the onset at which publishing ends [s]."""
        self._end = end
        self._aim()

    def _restart(self) -> None:
        if self._onset is None:
            return
        self._jumped_back()
        self._schedule.restart(self._now())
        self._aim()

    def _publish_due(self) -> None:
        now = self._now()
        offsets = [o for o in self._schedule.due(now) if o * 1e-9 <= self._end]
        try:
            if offsets:
                self._publish(offsets)
                self._advanced(now)
        except LimitSurfaceError as error:
            # A number that is not finite is not sent; the stream goes on.
            self._refused("wrench", error)
        finally:
            self._aim()

    def _publish(self, offsets: list[int]) -> None:
        onset = self._onset
        values = onset.response.x(np.array(offsets) * 1e-9)
        loads = np.multiply.outer(values / onset.response.start, onset.load)
        for offset, value, load in zip(offsets, values.tolist(), loads.tolist(), strict=True):
            for message in (self._wrench, self._value):
                fill_stamp(message.header.stamp, onset.start + offset)
            _fill_load(self._wrench.wrench, load)
            self._value.vector.x = value
            self._wrenches.publish(self._wrench)
            self._values.publish(self._value)

    def _aim(self) -> None:
        """Have the timer fire at the next stamp, or not at all after the last one."""
        if self._schedule.next_offset * 1e-9 > self._end:
            self._timer.cancel()
            return
        self._timer.timer_period_ns = max(self._schedule.next_stamp - self._now(), 1)
        self._timer.reset()

    def _now(self) -> int:
        return int(self._clock.now().nanoseconds)


def _fill_load(wrench: Wrench, load: Sequence[float]) -> None:
    force, torque = wrench.force, wrench.torque
    force.x, force.y, force.z, torque.x, torque.y, torque.z = load
