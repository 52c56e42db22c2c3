# SPDX-License-Identifier: Apache-2.0
"""A stand-in for a tf2 buffer: the methods that the nodes call, with the meaning that tf2 gives.

tf2_ros is not on the Python package index. One pair of frames, poses by stamp, linear between.
"""

from __future__ import annotations

import bisect

from geometry_msgs.msg import TransformStamped
from rclpy.time import Time


class NotJoined(Exception):
    """No transform between two frames has come yet."""


class Buffer:
    """Where `child` is along the x axis of `parent`, by stamp.

    Attributes:
        rotation: Quaternion (x, y, z, w) of every transform, as it was published.
    """

    rotation = (0.0, 0.0, 0.0, 1.0)

    def __init__(self, parent="object", child="tool"):
        self._frames = {parent, child}
        self._child = child
        self._stamps: list[int] = []
        self._places: list[float] = []

    def set_transform(self, stamp: int, x: float) -> None:
        """Take a pose [m] at a stamp [ns], later than all before."""
        self._stamps.append(stamp)
        self._places.append(x)

    def can_transform(self, target, source, time, timeout=None, return_debug_tuple=False):
        """Tell whether a transform is known, and if not why."""
        stamp = time.nanoseconds
        known = {target, source} == self._frames and bool(self._stamps)
        if known and stamp:
            known = self._stamps[0] <= stamp <= self._stamps[-1]
        return (known, "" if known else "not there") if return_debug_tuple else known

    def get_latest_common_time(self, target, source):
        """Return the newest stamp."""
        if {target, source} != self._frames or not self._stamps:
            raise NotJoined(f"{source!r} and {target!r} are not joined")
        return Time(nanoseconds=self._stamps[-1])

    def lookup_transform(self, target, source, time):
        """Return the pose of `source` in `target`."""
        assert self.can_transform(target, source, time)
        stamp = time.nanoseconds or self._stamps[-1]
        place = bisect.bisect_left(self._stamps, stamp)
        x = self._places[place]
        if self._stamps[place] != stamp:
            before, after = self._stamps[place - 1], self._stamps[place]
            share = (stamp - before) / (after - before)
            x = self._places[place - 1] + share * (x - self._places[place - 1])
        pose = TransformStamped()
        pose.transform.translation.x = x if source == self._child else -x
        turned = pose.transform.rotation
        turned.x, turned.y, turned.z, turned.w = self.rotation
        return pose
