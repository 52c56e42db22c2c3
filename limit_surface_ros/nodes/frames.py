# SPDX-License-Identifier: Apache-2.0
"""From the frame of a message to the frame of a model: static transforms, and tf2 where it is.

tf2_ros is optional: it is imported when a node starts, and without it (it is not on the Python
package index) the static transforms of the node's parameter are all there is.
"""

from __future__ import annotations

import importlib.util
from typing import TYPE_CHECKING

from rclpy.time import Time

from limit_surface_ros.errors import FrameError, TransformTooNewError, TransformTooOldError
from limit_surface_ros.nodes.settings import Setting
from limit_surface_ros.nodes.stamps import nanoseconds
from limit_surface_ros.nodes.static_transforms import StaticTransforms
from limit_surface_ros.surface.frames import RigidTransform

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.node import Node
    from std_msgs.msg import Header

    from limit_surface_ros.nodes.parameters import Parameters, Values

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
)


class Frames:
    """Transforms from message frames to model frames.

    Args:
        node: The node; tf2's listener subscribes through it.
        parameters: Its parameters, which include `SETTINGS`.
    """

    def __init__(self, node: Node, parameters: Parameters) -> None:
        """Read the static transforms and start listening to tf2 where it is installed."""
        self._parameters = parameters
        self._static = StaticTransforms()
        self._buffer = None
        unused = _why_tf_is_not_used(parameters)
        if not unused:
            self._buffer = _Tf2(node)
        node.get_logger().info(
            "frames: by static_transforms, "
            + (f"not by /tf: {unused}" if unused else "others by /tf")
        )
        parameters.concern(["static_transforms"], self._prepare)

    def to_model(self, target: str, header: Header) -> RigidTransform | None:
        """Return the transform from a message's frame to `target`; None: they are the same.

        Nothing is waited for: what is not known at the message's stamp now is refused.

        Raises:
            FrameError: The frame is empty, or no transform is known.
            TransformTooOldError: The stamp is older than all that tf2 remembers.
            TransformTooNewError: The stamp is newer than what tf2 has received.
        """
        source = header.frame_id
        if source == target:
            return None
        if not source:
            if self._parameters["assume_model_frame"]:
                return None
            raise FrameError(
                f"frame_id is empty; give the model's frame {target!r} or one with a known "
                "transform to it, or set the parameter assume_model_frame"
            )
        known_here = source in self._static and target in self._static
        if self._buffer is not None and not known_here:
            return self._buffer.look_up(target, source, header)
        return self._static.look_up(target, source)

    def _prepare(self, values: Values) -> Callable[[], None]:
        static = StaticTransforms(values["static_transforms"])

        def apply() -> None:
            self._static = static

        return apply


def _why_tf_is_not_used(parameters: Parameters) -> str:
    """Return why not; empty: it is."""
    if not parameters["use_tf"]:
        return "use_tf is false"
    return "" if importlib.util.find_spec("tf2_ros") else "tf2_ros is not installed"


class _Tf2:
    """A tf2 buffer that is filled by a listener and never waited for."""

    def __init__(self, node: Node) -> None:
        import tf2_ros

        self._tf2 = tf2_ros
        self._buffer = tf2_ros.Buffer(node=node)
        self._listener = tf2_ros.TransformListener(self._buffer, node)

    def look_up(self, target: str, source: str, header: Header) -> RigidTransform:
        """Return the transform at the header's stamp; a zero stamp means the latest."""
        stamp = nanoseconds(header.stamp)
        try:
            pose = self._buffer.lookup_transform(target, source, Time(nanoseconds=stamp)).transform
        except self._tf2.ExtrapolationException as error:
            # What is outside of tf2's memory lies before or after it; of a single transform its
            # words do not tell which.
            latest = self._buffer.get_latest_common_time(target, source).nanoseconds
            kind = TransformTooNewError if stamp > latest else TransformTooOldError
            raise kind(
                f"no transform from frame {source!r} to the model's frame {target!r}: {error}"
            ) from None
        except self._tf2.TransformException as error:
            raise FrameError(
                f"no transform from frame {source!r} to the model's frame {target!r} is known: "
                f"{error}"
            ) from None
        moved, turned = pose.translation, pose.rotation
        return RigidTransform.from_quaternion(
            [moved.x, moved.y, moved.z], [turned.x, turned.y, turned.z, turned.w]
        )
