# SPDX-License-Identifier: Apache-2.0
r"""Make a ROS 2 bag of a robot that pushes the L of `examples/contacts` around.

    scripts/with_ros --with extras -- python3 examples/pushes/make_bag.py pushes_bag
    scripts/with_ros --with extras -- fit_surface pushes_bag --wrench-topic /wrench \
        --motion-topic /pose --auto -o learnt.yaml

`/wrench` holds the loads on the body in its own frame at 500 Hz, `/pose` where a camera sees it at
100 Hz, with noise on both. Between pushes the body rests, which tells the sensor's bias.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from limit_surface_ros.files.contact_file import read_contact
from limit_surface_ros.files.recordings.simulation import RecordingPlan, simulate_recording

CONTACT = Path(__file__).resolve().parents[1] / "contacts" / "l_shape.yaml"
STORE = get_typestore(Stores.ROS2_JAZZY)
TYPES = STORE.types
START = 1000.0


def message(name, **fields):
    """Return a message of a type by its name, such as "geometry_msgs/Point"."""
    return TYPES[name.replace("/", "/msg/")](**fields)


def header(time, frame):
    """Return a header; times are since the recording began [s]."""
    seconds, rest = divmod(START + time, 1.0)
    stamp = message("builtin_interfaces/Time", sec=int(seconds), nanosec=int(rest * 1e9))
    return message("std_msgs/Header", stamp=stamp, frame_id=frame)


def vector(x, y, z):
    """Return a Vector3."""
    return message("geometry_msgs/Vector3", x=float(x), y=float(y), z=float(z))


def wrench(time, six):
    """Return a WrenchStamped of (fx, fy, fz, tx, ty, tz)."""
    load = message("geometry_msgs/Wrench", force=vector(*six[:3]), torque=vector(*six[3:]))
    return message("geometry_msgs/WrenchStamped", header=header(time, "object"), wrench=load)


def pose(time, place):
    """Return a PoseStamped of (x, y, yaw)."""
    x, y, yaw = map(float, place)
    turn = {"x": 0.0, "y": 0.0, "z": float(np.sin(yaw / 2)), "w": float(np.cos(yaw / 2))}
    where = message(
        "geometry_msgs/Pose",
        position=message("geometry_msgs/Point", x=x, y=y, z=0.0),
        orientation=message("geometry_msgs/Quaternion", **turn),
    )
    return message("geometry_msgs/PoseStamped", header=header(time, "world"), pose=where)


def main(path, pushes=30):
    """Simulate and write."""
    body = read_contact(CONTACT)
    plan = RecordingPlan(pushes=pushes, pose_noise=5e-5, yaw_noise=5e-4)
    recording = simulate_recording(body.surface, plan, seed=2).recording
    topics = {
        "/wrench": (
            "geometry_msgs/WrenchStamped",
            wrench,
            recording.wrench_times,
            recording.wrenches,
        ),
        "/pose": ("geometry_msgs/PoseStamped", pose, recording.motion_times, recording.motions),
    }
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        for topic, (name, make, times, values) in topics.items():
            kind = name.replace("/", "/msg/")
            connection = bag.add_connection(topic, kind, typestore=STORE)
            for time, row in zip(times, values, strict=True):
                stamp = round((START + time) * 1e9)
                bag.write(connection, stamp, STORE.serialize_cdr(make(time, row), kind))
    print(f"{pushes} pushes into {path}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "pushes_bag"))
