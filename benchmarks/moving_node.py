# SPDX-License-Identifier: Apache-2.0
"""The limit_surface node with a buffer of transforms that come at 30 Hz, for bench_soak.py.

The buffer is tf2's where tf2_ros is installed, else the stand-in of the tests, filled as a
listener would: by the node's own executor.
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from typing import Any

from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
from limit_surface_ros.nodes.serving import spin

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "test"))
PERIOD = 1.0 / 30.0


class MovingNode(LimitSurfaceNode):
    """Knows where `tool` is in `object`, thirty times a second."""

    def __init__(self) -> None:
        """Start the transforms."""
        buffer: Any
        if importlib.util.find_spec("tf2_ros"):
            import tf2_ros

            buffer = tf2_ros.Buffer()
        else:
            from transform_helpers import Buffer

            buffer = Buffer()
        super().__init__(buffer=buffer, cli_args=["--ros-args", "-r", "__node:=moving"])
        self._buffer = buffer
        self.create_timer(PERIOD, self._move)

    def _move(self) -> None:
        now = self.get_clock().now()
        if not hasattr(self._buffer, "set_transform_static"):
            self._buffer.set_transform(now.nanoseconds, 0.01)
            return
        from geometry_msgs.msg import TransformStamped

        pose = TransformStamped()
        pose.header.stamp = now.to_msg()
        pose.header.frame_id, pose.child_frame_id = "object", "tool"
        pose.transform.translation.x, pose.transform.rotation.w = 0.01, 1.0
        self._buffer.set_transform(pose, "bench")


if __name__ == "__main__":
    sys.exit(spin.run(lambda: [MovingNode()], {}, __doc__, sys.argv))
