# SPDX-License-Identifier: Apache-2.0
"""Transforms between frames that are given once, as texts; ROS-free.

Each text reads `parent child x y z roll pitch yaw` or `parent child x y z qx qy qz qw`: the pose
of the child in the parent, in [m] and [rad].
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import FrameError, RangeError, shortened
from limit_surface_ros.surface.frames import RigidTransform

if TYPE_CHECKING:
    from collections.abc import Iterable

ACCEPTED = "'parent child x y z roll pitch yaw' or 'parent child x y z qx qy qz qw'"


class StaticTransforms:
    """A tree of fixed frames.

    Args:
        texts: The edges of the tree; see the module's description.

    Raises:
        RangeError: A text is not understood, or a frame is given two parents or is its own
            ancestor.
    """

    def __init__(self, texts: Iterable[str] = ()) -> None:
        """Parse the edges and place each frame in the root of its tree."""
        self._edges: dict[str, tuple[str, RigidTransform]] = {}
        for text in texts:
            parent, child, pose = _parsed(text)
            if child in self._edges:
                raise RangeError(
                    f"frame {_shown(child)} has two parents, {_shown(self._edges[child][0])} and "
                    f"{_shown(parent)}"
                )
            self._edges[child] = parent, pose
        self._in_root: dict[str, tuple[str, RigidTransform]] = {}
        for frame in self._edges:
            self._place(frame)

    def __contains__(self, frame: str) -> bool:
        """Tell whether the frame is part of any tree."""
        return frame in self._in_root

    def look_up(self, target: str, source: str) -> RigidTransform:
        """Return the transform that takes vectors from `source` to `target`.

        Raises:
            FrameError: A frame is unknown, or no chain of transforms joins the two.
        """
        for frame in (source, target):
            if frame not in self._in_root:
                raise FrameError(
                    f"no transform from frame {_shown(source)} to the model's frame "
                    f"{_shown(target)} is known: frame {_shown(frame)} is in no static transform"
                    + _slash_hint(frame)
                )
        source_root, source_pose = self._in_root[source]
        target_root, target_pose = self._in_root[target]
        if source_root != target_root:
            raise FrameError(
                f"no transform from frame {_shown(source)} to the model's frame {_shown(target)} "
                "is known: no chain of static transforms joins them"
            )
        return target_pose.inverse @ source_pose

    def _place(self, frame: str) -> None:
        """Find the root above a frame and the frame's pose in it, and of all frames between."""
        chain: dict[str, None] = {}
        while frame not in self._in_root and frame in self._edges:
            if frame in chain:
                cycle = shortened(" < ".join(chain))
                raise RangeError(f"frame {_shown(frame)} is its own ancestor: {cycle}")
            chain[frame] = None
            frame = self._edges[frame][0]
        root, pose = self._in_root.setdefault(
            frame, (frame, RigidTransform(np.eye(3), np.zeros(3)))
        )
        for below in reversed(chain):
            pose = pose @ self._edges[below][1]
            self._in_root[below] = root, pose


def _parsed(text: str) -> tuple[str, str, RigidTransform]:
    words = text.split()
    try:
        numbers = [float(word) for word in words[2:]]
    except ValueError as error:
        raise RangeError(f"{_shown(text)}: {error}; accepted is {ACCEPTED}") from None
    if len(numbers) not in (6, 7) or not np.isfinite(numbers).all():
        raise RangeError(f"{_shown(text)}: accepted is {ACCEPTED}, with finite numbers")
    build = RigidTransform.from_euler if len(numbers) == 6 else RigidTransform.from_quaternion
    return words[0], words[1], build(numbers[:3], numbers[3:])


def _shown(name: str) -> str:
    return repr(shortened(name))


def _slash_hint(frame: str) -> str:
    """Return what is wrong with a name of the ROS 1 kind."""
    return f"; frames begin with no slash: {_shown(frame[1:])}?" if frame.startswith("/") else ""
