# SPDX-License-Identifier: Apache-2.0
"""From the frame of a message to another: fixed transforms of a parameter, and tf2 where it is.

tf2_ros is optional: it is imported when a node starts, and without it (it is not on the Python
package index) the static transforms of the node's parameter are all there is. A transform that is
not there yet, as that of a sensor on a moving arm when its message comes, is waited for.
"""

from __future__ import annotations

import importlib.util
import math
import time
from typing import TYPE_CHECKING, Any, NamedTuple

from rclpy.clock import Clock, ClockType
from rclpy.time import Time

from limit_surface_ros.checks import LARGEST
from limit_surface_ros.errors import (
    FrameError,
    LimitSurfaceError,
    TransformTooNewError,
    TransformTooOldError,
    UnavailableError,
    shortened,
)
from limit_surface_ros.nodes.messages.convert import nanoseconds
from limit_surface_ros.nodes.messages.static_transforms import StaticTransforms
from limit_surface_ros.nodes.serving.settings import Setting
from limit_surface_ros.nodes.serving.waiting import Waiting
from limit_surface_ros.surface.frames import RigidTransform

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.node import Node
    from std_msgs.msg import Header

    from limit_surface_ros.nodes.serving.parameters import Parameters, Values

SETTINGS = (
    Setting(
        "assume_model_frame",
        False,
        "Take messages without a frame_id as given in the model's frame; otherwise refuse them",
    ),
    Setting(
        "static_transforms",
        [],
        "Fixed transforms, each 'parent child x y z roll pitch yaw' or "
        "'parent child x y z qx qy qz qw': the child's pose in the parent [m, rad]",
        check=StaticTransforms,
    ),
    Setting(
        "use_tf",
        True,
        "Look up frames that the static transforms do not know in /tf, if tf2_ros is installed",
        read_only=True,
    ),
    Setting(
        "transform_timeout",
        0.1,
        "How long an input waits for the transform of its frame at its stamp, in node time [s]; "
        "0: what is not there is refused",
        minimum=0.0,
        maximum=60.0,
    ),
    Setting(
        "transform_tolerance",
        0.0,
        "Take the newest transform if it is at most that much older than an input, instead of "
        "waiting for one at its stamp [s]",
        minimum=0.0,
        maximum=3600.0,
    ),
)
# Inputs that wait; what more come are refused at once.
MOST_WAITING = 2000
# While somebody waits, how often it is looked whether transforms have come [s]. tf2's own futures
# are forgotten only when new transforms come: where none do, they would pile up without end.
_SWEEP = 0.005
# A paused clock holds nobody longer than this many times transform_timeout, in real time.
_PATIENCE = 10.0


class _Wait(NamedTuple):
    """An input that waits for its transform: between which frames and at which stamp [ns]."""

    waiting: Waiting
    frames: tuple[str, str]
    stamp: int
    since: int
    real_since: float


class Frames:
    """Transforms from message frames to model frames.

    Args:
        node: The node, with its `endpoints`; tf2's listener subscribes through it.
        parameters: Its parameters, which include `SETTINGS`.
        buffer: What has the methods of a `tf2_ros.Buffer` and is filled by somebody else; None:
            one of tf2's own, if `use_tf` is set and tf2_ros is installed.
    """

    def __init__(self, node: Any, parameters: Parameters, buffer: Any = None) -> None:
        """Read the static transforms and start listening to tf2 where it is installed."""
        self._node = node
        self._parameters = parameters
        self._static = StaticTransforms()
        unused = "" if buffer is not None else _why_tf_is_not_used(parameters)
        self._buffer = buffer if buffer is not None or unused else _listening_buffer(node)
        node.get_logger().info(
            "frames: by static_transforms, "
            + (f"not by /tf: {unused}" if unused else "others by /tf")
        )
        self._waits: list[_Wait] = []
        self._sweep = node.create_timer(
            _SWEEP,
            self._end_waits,
            clock=Clock(clock_type=ClockType.STEADY_TIME),
            autostart=False,
        )
        parameters.on_change(["static_transforms"], self._prepare)
        node.endpoints.when_ending.append(self._refuse_next)

    @property
    def waiting(self) -> int:
        """How many inputs wait for their transforms."""
        return len(self._waits)

    async def to_frame(self, target: str, header: Header) -> RigidTransform | None:
        """Return the transform from a message's frame to `target`; None: they are the same.

        Waits for it as long as the parameters say if it is not there yet.

        Raises:
            FrameError: The frame is empty, no transform is known, or the one that is known has
                no rotation, or a translation that is not finite or beyond 1e100 m.
            TransformTooOldError: The stamp is older than all that tf2 remembers.
            TransformTooNewError: The stamp is newer than what tf2 has received.
            UnavailableError: Too many wait already.
        """
        source = header.frame_id
        if source == target:
            return None
        if not source:
            if self._parameters["assume_model_frame"]:
                return None
            raise FrameError(
                f"frame_id is empty; give the model's frame {_shown(target)} or one with a known "
                "transform to it, or set the parameter assume_model_frame"
            )
        if self._buffer is None or (source in self._static and target in self._static):
            return _usable(self._static.look_up(target, source), target, source)
        stamp = nanoseconds(header.stamp)
        try:
            return self._look_up(target, source, stamp)
        except TransformTooOldError:
            raise
        except FrameError:
            if not self._parameters["transform_timeout"]:
                raise
        await self._come(target, source, stamp)
        return self._look_up(target, source, stamp)

    def _look_up(self, target: str, source: str, stamp: int) -> RigidTransform:
        """Return the transform at a stamp [ns]; 0 means the latest."""
        buffer = self._buffer
        when = Time(nanoseconds=stamp)
        known, reason = buffer.can_transform(target, source, when, return_debug_tuple=True)
        if not known:
            when = self._newest_in_place_of(target, source, stamp, reason)
        pose = buffer.lookup_transform(target, source, when).transform
        moved, turned = pose.translation, pose.rotation
        try:
            transform = RigidTransform.from_quaternion(
                [moved.x, moved.y, moved.z], [turned.x, turned.y, turned.z, turned.w]
            )
        except LimitSurfaceError as error:
            raise _unusable(target, source, str(error)) from None
        return _usable(transform, target, source)

    def _newest_in_place_of(self, target: str, source: str, stamp: int, reason: str) -> Time:
        """Return the newest time that is known if it will do, or raise what is wrong."""
        missing = f"no transform from frame {_shown(source)} to the model's frame {_shown(target)}"
        try:
            latest = self._buffer.get_latest_common_time(target, source)
        except Exception as error:
            # Of tf2's exceptions the base class is all that they have in common.
            slash = next((frame for frame in (source, target) if frame.startswith("/")), None)
            hint = f"; frames of tf2 begin with no slash: {_shown(slash[1:])}?" if slash else ""
            raise FrameError(f"{missing} is known: {shortened(str(error), 500)}{hint}") from None
        age = (stamp - latest.nanoseconds) * 1e-9
        if age <= 0.0:
            raise TransformTooOldError(f"{missing} at its stamp: {shortened(reason, 500)}")
        if age > self._parameters["transform_tolerance"]:
            raise TransformTooNewError(
                f"{missing} at its stamp has come: the newest is {age:.3g} s older"
            )
        return latest

    async def _come(self, target: str, source: str, stamp: int) -> None:
        """Wait until a transform has come, or the time is up."""
        if len(self._waits) >= MOST_WAITING:
            raise UnavailableError(f"more than {MOST_WAITING} inputs wait for transforms")
        waiting = Waiting()
        wait = _Wait(waiting, (target, source), stamp, self._now(), time.monotonic())
        if not self._waits:
            self._sweep.reset()
        self._waits.append(wait)
        try:
            await waiting
        finally:
            self._waits.remove(wait)

    def _refuse_next(self, error: Exception) -> None:
        """Have the input that has waited longest refused."""
        if self._waits:
            self._waits[0].waiting.settle(error)

    def _end_waits(self) -> None:
        """Settle the waits whose transform has come, and those that were in vain."""
        if not self._waits:
            self._sweep.cancel()
            return
        timeout = self._parameters["transform_timeout"]
        now, real = self._now(), time.monotonic()
        newest = {frames: self._newest(*frames) for frames in {w.frames for w in self._waits}}
        for wait in list(self._waits):
            waited = (now - wait.since) * 1e-9
            if (
                wait.stamp <= newest[wait.frames]
                # A clock that was set back has not waited less than no time.
                or not 0.0 <= waited < timeout
                or real - wait.real_since > _PATIENCE * timeout
            ):
                wait.waiting.settle()

    def _newest(self, target: str, source: str) -> float:
        """Return the newest stamp at which a transform is known [ns]; -infinity: none is."""
        try:
            latest = self._buffer.get_latest_common_time(target, source).nanoseconds
        except Exception:
            return -math.inf
        # Static transforms alone hold at any time, and tell 0.
        return float(latest) or math.inf

    def _now(self) -> int:
        return int(self._node.get_clock().now().nanoseconds)

    def _prepare(self, values: Values) -> Callable[[], None]:
        static = StaticTransforms(values["static_transforms"])

        def apply() -> None:
            self._static = static

        return apply


def _usable(transform: RigidTransform, target: str, source: str) -> RigidTransform:
    """Return a transform with which no vector overflows that is accepted.

    Otherwise the wrench or twist would be said not to be finite, which is in order.
    """
    translation = transform.translation.tolist()
    if not all(abs(coordinate) <= LARGEST for coordinate in translation):
        raise _unusable(
            target, source, f"its translation must be at most {LARGEST:g} m, got {translation}"
        )
    return transform


def _unusable(target: str, source: str, reason: str) -> FrameError:
    return FrameError(
        f"the transform from frame {_shown(source)} to the model's frame {_shown(target)} cannot "
        f"be used: {reason}"
    )


def _shown(frame: str) -> str:
    return repr(shortened(frame))


def _why_tf_is_not_used(parameters: Parameters) -> str:
    """Return why not; empty: it is."""
    if not parameters["use_tf"]:
        return "use_tf is false"
    return "" if importlib.util.find_spec("tf2_ros") else "tf2_ros is not installed"


def _listening_buffer(node: Node) -> Any:
    import tf2_ros

    buffer = tf2_ros.Buffer(node=node)
    # It lives as long as the buffer.
    buffer.listener_of_this_node = tf2_ros.TransformListener(buffer, node)
    return buffer
