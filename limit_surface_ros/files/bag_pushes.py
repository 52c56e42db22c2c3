# SPDX-License-Identifier: Apache-2.0
"""Pushes in bags; see `bag_recording` for what is read, `recordings` for what becomes of it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from limit_surface_ros.errors import DataError
from limit_surface_ros.files.bag_recording import BagFrames, read_bag_recording
from limit_surface_ros.files.recordings.pushes import Corrections, find_pushes
from limit_surface_ros.files.recordings.selection import Selection

if TYPE_CHECKING:
    from pathlib import Path

    from limit_surface_ros.files.recordings.pushes import RecordedPushes

__all__ = ["BagFrames", "Corrections", "Selection", "read_bag_pushes"]


def read_bag_pushes(
    path: str | Path,
    wrench_topic: str,
    motion_topic: str,
    selection: Selection | None = None,
    frames: BagFrames | None = None,
    corrections: Corrections | None = None,
) -> RecordedPushes:
    """Read pushes from a bag.

    Args:
        path: The bag: its folder, or a file of it.
        wrench_topic: Of one of the types in `bag_messages.WRENCHES`.
        motion_topic: Of one of those in `bag_messages.MOTIONS`.
        selection: What counts as a push.
        frames: What is known of frames and clocks.
        corrections: What is corrected first.

    Raises:
        MissingExtraError: rosbags is not installed.
        FileError: The bag cannot be read, a topic is not there or of another type, or the frames
            do not fit.
        DataError: No part of the recording is a quasi-static push.
    """
    rules = selection or Selection()
    read = read_bag_recording(path, wrench_topic, motion_topic, rules.max_gap, frames)
    try:
        found = find_pushes(read.recording, rules, corrections)
    except DataError as error:
        raise DataError(f"{path}: {error}") from None
    return replace(found, frame_id=read.frame_id, notes=read.notes + found.notes)
