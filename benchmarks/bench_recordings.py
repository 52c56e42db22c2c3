# SPDX-License-Identifier: Apache-2.0
"""Pushes from noisy recordings: pairs against the truth, beside slopes of Savitzky and Golay."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from scipy.signal import savgol_filter

from limit_surface_ros.files.bag_pushes import read_bag_pushes
from limit_surface_ros.files.recordings.pushes import IN_PLANE, find_pushes
from limit_surface_ros.files.recordings.simulation import RecordingPlan, simulate_recording
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.pairs import Pairs
from limit_surface_ros.surface.scaling import Scaling

FEET = np.array([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]])
BODY = PointContacts(FEET, np.full(3, 4.1 / 3), Scaling(0.05, 4.1))
SEEDS = (0, 1, 2)
FINE = {"pose_noise": 5e-5, "yaw_noise": 5e-4}
USUAL = {"pose_noise": 2e-4, "yaw_noise": 2e-3}
COARSE = {"pose_noise": 1e-3, "yaw_noise": 1e-2}
BIASED = {"bias": (0.4, -0.3, 0.01)}
# Name, plan, goal of the mean angle "together" [deg].
ROWS = [
    ("poses exact", {}, ""),
    ("50 um / 0.5 mrad", FINE, "1.5"),
    ("200 um / 2 mrad", USUAL, "2.1"),
    ("1 mm / 10 mrad", COARSE, "3.0"),
    ("rounded to 1 mm / 10 mrad", {**COARSE, "rounded": True}, "2.5"),
    ("wrench noise 0.2 N, 50 um", {**FINE, "wrench_noise": 0.2}, "1.5"),
    ("bias 0.4 N, 50 um", {**FINE, **BIASED}, "1.5"),
    ("the same, pusher leans 1 s", {**FINE, **BIASED, "leaning": 1.0}, "1.5"),
    ("bias drifting by 0.3 N", {**FINE, **BIASED, "drift": (0.3, 0.3, 0.0)}, "1.5"),
    ("wrench late by 0.05 s, 50 um", {**FINE, "delay": 0.05}, "1.5"),
    ("wrench late by 0.3 s, 50 um", {**FINE, "delay": 0.3}, "1.5"),
    ("-0.3 s, 200 um", {**USUAL, "delay": -0.3}, "2.1"),
    ("0.3 s, bias, 200 um, leaning", {**USUAL, **BIASED, "delay": 0.3, "leaning": 1.0}, "2.1"),
    ("0.3 s, 1 mm", {**COARSE, "delay": 0.3}, "3.0"),
    ("200 um, jitter of 50 ms", {**USUAL, "jitter": 0.05}, ""),
    ("31 Hz, 200 um, 10 % lost", {**USUAL, "pose_rate": 31.0, "lost": 0.1}, ""),
    ("pushes of constant direction, 200 um", {**USUAL, "wander": 0.0}, "2.1"),
]
BAGS = ("200 um / 2 mrad", "0.3 s, bias, 200 um, leaning")


def angles(first, second, unit):
    """Return the angles between rows in scaled variables [deg]."""
    a, b = first / unit, second / unit
    cross = np.linalg.norm(np.cross(a, b), axis=1)
    return np.degrees(np.arctan2(cross, np.sum(a * b, axis=1)))


def together(pairs):
    """Return the angles between recovered loads and those that recovered twists need [deg]."""
    return angles(BODY.wrench_of_twist(pairs.twists), pairs.wrenches, BODY.scaling.wrench_unit)


def savitzky_golay(recording, window=0.5):
    """Return pairs by quadratic slopes over 0.25 s and rules for single samples."""
    step = float(np.median(np.diff(recording.motion_times)))
    count = 2 * (round(0.25 / step) // 2) + 1
    times = np.arange(recording.motion_times[0], recording.motion_times[-1], step)
    poses = np.column_stack(
        [np.interp(times, recording.motion_times, column) for column in recording.motions.T]
    )
    slopes = savgol_filter(poses, max(count, 3), 2, deriv=1, delta=step, axis=0)
    yaw = savgol_filter(poses[:, 2], max(count, 3), 2)
    cos, sin = np.cos(yaw), np.sin(yaw)
    vx, vy, omega = slopes.T
    twists = np.column_stack([cos * vx + sin * vy, cos * vy - sin * vx, omega])
    speed = np.hypot(vx, vy) + 0.05 * np.abs(omega)
    change = np.abs(np.gradient(speed, times))
    at = recording.wrench_times
    loads = recording.wrenches[:, IN_PLANE]
    kept = (np.interp(at, times, speed) >= 0.002) & (np.interp(at, times, change) <= 0.5)
    kept &= (np.hypot(loads[:, 0], loads[:, 1]) >= 0.1) & (at >= times[0]) & (at <= times[-1])
    found = []
    start, last = None, -1
    for index in np.append(np.flatnonzero(kept), len(at) + 1):
        fresh = start is None or index != last + 1 or at[index] - at[start] > window
        if start is not None and fresh and at[last] - at[start] >= 0.5 * window:
            part = slice(start, last + 1)
            mean = [np.interp(at[part], times, column).mean() for column in twists.T]
            found.append((loads[part].mean(axis=0), mean))
        if fresh:
            start = index
        last = index
    if not found:
        return None
    return Pairs(np.array([load for load, _ in found]), np.array([twist for _, twist in found]))


def row(name, plan, goal):
    """Print one row: means and extremes over the seeds."""
    ours, twist, wrench, counts, peers, seconds = [], [], [], [], [], []
    delays, biases = [], []
    for seed in SEEDS:
        simulated = simulate_recording(BODY, RecordingPlan(**plan), seed)
        start = time.perf_counter()
        found = find_pushes(simulated.recording)
        seconds.append(time.perf_counter() - start)
        true_twists, true_loads = simulated.means(found.windows)
        ours.append(together(found.pairs).mean())
        twist.append(angles(found.pairs.twists, true_twists, BODY.scaling.twist_unit).mean())
        wrench.append(angles(found.pairs.wrenches, true_loads, BODY.scaling.wrench_unit).mean())
        counts.append(len(found.pairs))
        delays.append(found.clock_offset)
        biases.append(found.tare)
        peer = savitzky_golay(simulated.recording)
        peers.append(np.nan if peer is None else together(peer).mean())
    delay = max(abs(offset.delay - plan.get("delay", 0.0)) for offset in delays)
    applied = sum(offset.applied for offset in delays)
    truth = np.array(plan.get("bias", (0.0, 0.0, 0.0)))[:2] + 0.5 * np.array(
        plan.get("drift", (0.0, 0.0, 0.0))[:2]
    )
    bias = max(np.abs(tare.mean[:2] - truth).max() if tare else np.nan for tare in biases)
    print(
        f"| {name} | {min(counts)} to {max(counts)} | {np.mean(twist):.2f} | "
        f"{np.mean(wrench):.2f} | {np.mean(ours):.2f} (worst {max(ours):.2f}) | {goal} | "
        f"{np.mean(peers):.2f} | {1e3 * delay:.0f} ms, {applied} of {len(SEEDS)} | "
        f"{bias:.3f} N | {np.median(seconds):.2f} s |",
        flush=True,
    )


def write_bag(path, recording):
    """Write a recording as WrenchStamped and PoseStamped, 100 s after zero."""
    store = get_typestore(Stores.ROS2_JAZZY)
    types, folder = store.types, "geometry_msgs/msg/"

    def header(t, frame):
        stamp = types["builtin_interfaces/msg/Time"](sec=int(t), nanosec=int(t % 1 * 1e9))
        return types["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)

    def of_wrench(t, six):
        vector = types[f"{folder}Vector3"]
        force = vector(*map(float, six[:3]))
        load = types[f"{folder}Wrench"](force=force, torque=vector(*map(float, six[3:])))
        return types[f"{folder}WrenchStamped"](header=header(t, "object"), wrench=load)

    def of_pose(t, pose):
        x, y, yaw = map(float, pose)
        turn = types[f"{folder}Quaternion"](
            x=0.0, y=0.0, z=float(np.sin(yaw / 2)), w=float(np.cos(yaw / 2))
        )
        place = types[f"{folder}Point"](x=x, y=y, z=0.0)
        at = types[f"{folder}Pose"](position=place, orientation=turn)
        return types[f"{folder}PoseStamped"](header=header(t, "world"), pose=at)

    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for topic, make, times, rows in (
            ("/wrench", of_wrench, recording.wrench_times, recording.wrenches),
            ("/pose", of_pose, recording.motion_times, recording.motions),
        ):
            kind = f"{folder}{'WrenchStamped' if make is of_wrench else 'PoseStamped'}"
            connection = writer.add_connection(topic, kind, typestore=store)
            for t, numbers in zip(times + 100.0, rows, strict=True):
                raw = store.serialize_cdr(make(t, numbers), kind)
                writer.write(connection, round(t * 1e9), raw)


def bag_rows():
    """Print that bags hold what their recordings do, and how long they take to be read."""
    plans = {name: plan for name, plan, _ in ROWS}
    for name in BAGS:
        recording = simulate_recording(BODY, RecordingPlan(**plans[name]), 0).recording
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "bag"
            write_bag(path, recording)
            start = time.perf_counter()
            read = read_bag_pushes(path, "/wrench", "/pose")
            seconds = time.perf_counter() - start
        direct = find_pushes(recording)
        same = abs(together(read.pairs).mean() - together(direct.pairs).mean())
        count = len(recording.wrench_times)
        print(
            f"| {name} | {len(read.pairs)} | {together(read.pairs).mean():.2f} | {same:.3f} | "
            f"{count} | {seconds:.1f} s |",
            flush=True,
        )


def main() -> None:
    """Print the tables."""
    print("### 30 pushes of a triangle on 3 points, wrenches at 500 Hz, poses at 100 Hz\n")
    print(
        "Mean angles [deg] of recovered twists and loads to the true ones, and together: between "
        "recovered loads and those that the true body needs for the recovered twists. Bias and "
        f"delay: worst error of {len(SEEDS)} seeds, and how often the delay was applied.\n"
    )
    print(
        "| recording | pairs | twist | wrench | together | goal | Savitzky-Golay | delay | bias | "
        "time |\n|---|---|---|---|---|---|---|---|---|---|"
    )
    for name, plan, goal in ROWS:
        row(name, plan, goal)
    print("\n### The same from MCAP bags\n")
    print("| recording | pairs | together | difference | wrenches | time |")
    print("|---|---|---|---|---|---|")
    bag_rows()


if __name__ == "__main__":
    main()
