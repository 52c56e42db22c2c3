# SPDX-License-Identifier: Apache-2.0
"""The options that say how pushes are read from a bag, and what was found, for people to read."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.errors import DataError, RangeError
from limit_surface_ros.files.bag_frames import transform_of_text
from limit_surface_ros.files.bag_messages import MOTIONS, WRENCHES
from limit_surface_ros.files.bag_pushes import read_bag_pushes
from limit_surface_ros.files.bag_recording import STAMPS, BagFrames
from limit_surface_ros.files.recordings.clocks import LARGEST_DELAY
from limit_surface_ros.files.recordings.pushes import IN_PLANE, Corrections
from limit_surface_ros.files.recordings.selection import Selection

if TYPE_CHECKING:
    import argparse
    from pathlib import Path

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.files.recordings.pushes import RecordedPushes

# As attributes, for the refusal of options that do nothing.
OF_BAGS = (
    "wrench_topic",
    "motion_topic",
    "body",
    "fixed",
    "wrench_transform",
    "stamps",
    "clock_offset",
    "no_tare",
    *asdict(Selection()),
)
_RULES = {
    "max_gap": "s|a wrench counts between two motions no further apart",
    "min_speed": "m/s|slower, the body may stick",
    "max_speed": "m/s|faster, inertia may count",
    "max_acceleration": "m/s^2|a larger change of speed is not quasi-static",
    "min_force": "N|a smaller force does not push",
    "window": "s|pushes are averaged over windows of about this length, shorter where they turn",
    "lever": "m|turns angular speed into speed",
}


def _short(kinds: Any) -> str:
    return ", ".join(kind.rpartition("/")[2] for kind in kinds)


def add_bag_options(parser: argparse.ArgumentParser) -> None:
    """Declare how pushes are read from a bag."""
    bags = parser.add_argument_group("bags")
    bags.add_argument("--wrench-topic", metavar="NAME", help=f"of {_short(WRENCHES)}")
    bags.add_argument("--motion-topic", metavar="NAME", help=f"of {_short(MOTIONS)}")
    bags.add_argument(
        "--body",
        metavar="FRAME",
        help="the body's frame, which the model gets; default: that of the twists, or the child "
        "of the poses, or object",
    )
    bags.add_argument(
        "--fixed", metavar="FRAME", help="in which /tf gives the body's poses (for TFMessage)"
    )
    bags.add_argument(
        "--wrench-transform",
        metavar="POSE",
        help="pose of the wrenches' frame in the body's: 'x y z roll pitch yaw' or "
        "'x y z qx qy qz qw' [m, rad]; default: by /tf and /tf_static of the bag",
    )
    bags.add_argument(
        "--stamps",
        choices=STAMPS,
        default="auto",
        help="times of headers, or of the recording; auto: headers, unless they are empty or of "
        "clocks that never meet (%(default)s)",
    )
    bags.add_argument(
        "--clock-offset",
        type=float,
        metavar="S",
        help="how late wrenches are stamped beside motions [s]; default: estimated, and applied "
        "if it is certain",
    )
    bags.add_argument(
        "--no-tare",
        action="store_true",
        help="do not take the sensor's bias away that is found while the body rests",
    )
    rules = parser.add_argument_group("bags: what counts as a quasi-static push")
    for rule, default in asdict(Selection()).items():
        unit, _, text = _RULES[rule].partition("|")
        rules.add_argument(
            f"--{rule.replace('_', '-')}",
            type=float,
            default=default,
            metavar="X",
            help=f"{text} [{unit}] (%(default)s)",
        )


def pushes_of_bag(path: Path, options: argparse.Namespace) -> RecordedPushes:
    """Read the pushes of a bag as the options say.

    Raises:
        DataError: A topic is not named, or the bag holds no push.
        FileError: The bag cannot be read, or its frames do not fit.
        RangeError: An option is out of range.
    """
    if options.wrench_topic is None or options.motion_topic is None:
        raise DataError(f"{path}: is a bag: name --wrench-topic and --motion-topic")
    offset = options.clock_offset
    if offset is not None and not abs(offset) <= 1e6:
        raise RangeError(f"--clock-offset must be a number of seconds, got {offset}")
    pose = options.wrench_transform
    frames = BagFrames(
        body=options.body,
        fixed=options.fixed,
        wrench_transform=None if pose is None else transform_of_text(pose),
        stamps=options.stamps,
    )
    rules = Selection(**{rule: getattr(options, rule) for rule in asdict(Selection())})
    corrections = Corrections(tare=not options.no_tare, clock_offset=offset)
    topics = options.wrench_topic, options.motion_topic
    return read_bag_pushes(path, *topics, rules, frames, corrections)


def about_pushes(pushes: RecordedPushes) -> dict[str, Any]:
    """Return what was found and corrected in a bag, for a model file."""
    found: dict[str, Any] = {
        "wrenches": pushes.samples,
        "dropped": pushes.dropped,
        "motion_noise": _rounded(pushes.pose_noise),
        "wrench_noise": _rounded(pushes.wrench_noise),
        "weights": "of each pair's noise",
        "read": [*pushes.notes, *corrections_in_words(pushes)],
    }
    if pushes.clock_offset is not None:
        offset = pushes.clock_offset
        found["clock_offset"] = {
            "delay": round(offset.delay, 4),
            "interval": [round(offset.low, 4), round(offset.high, 4)],
            "applied": offset.applied,
        }
    if pushes.tare is not None:
        found["tare"] = {
            "bias": _rounded(pushes.tare.mean[IN_PLANE]),
            "drift": _rounded(pushes.tare.drift[IN_PLANE]),
            "rests": pushes.tare.rests,
        }
    return found


def _rounded(values: Floats) -> list[float]:
    return [float(f"{value:.4g}") for value in values]


def corrections_in_words(pushes: RecordedPushes) -> list[str]:
    """Return what the recording's clocks, rests and noise are, in one line each."""
    lines = []
    x, y, turn = pushes.pose_noise
    fx, fy, moment = pushes.wrench_noise
    lines.append(f"noise of the motion {np.hypot(x, y):.2g}, {turn:.2g} (m and rad, or per s)")
    lines.append(f"noise of the wrenches {np.hypot(fx, fy):.2g} N, {moment:.2g} N m")
    offset = pushes.clock_offset
    if offset is None:
        lines.append("too little motion to tell whether wrenches are stamped late")
    elif offset.low == offset.high:
        lines.append(f"wrenches are stamped {offset.delay:g} s late, as told")
    else:
        interval = f"between {offset.low:.3f} and {offset.high:.3f} s"
        if offset.applied:
            at_end = max(abs(offset.low), abs(offset.high)) > LARGEST_DELAY
            lines.append(
                f"wrenches are stamped {offset.delay:.3f} s late ({interval}): corrected"
                + ("; it may be more: look at the clocks" if at_end else "")
            )
        else:
            lines.append(f"wrenches are stamped as motions are ({interval} late)")
    tare = pushes.tare
    if tare is None:
        lines.append("no bias of the sensor is known: no level of the wrenches recurs at rests")
    else:
        fx, fy, moment = tare.mean[IN_PLANE]
        drift = np.abs(tare.drift[IN_PLANE])
        lines.append(
            f"bias of the sensor {fx:.3f}, {fy:.3f} N, {moment:.4f} N m at "
            f"{tare.rests} rests: taken away"
            + (f"; it drifts by {drift[:2].max():.2g} N" if drift.any() else "")
        )
    return lines
