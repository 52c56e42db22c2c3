# SPDX-License-Identifier: Apache-2.0
"""Bags written by rosbags, and the messages in them, for tests of what reads bags."""

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="the extra 'bags' is not installed")

from rosbags.rosbag2 import CompressionFormat, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)
TYPES = STORE.types
WRENCH, TWIST, POSE = (f"geometry_msgs/msg/{name}Stamped" for name in ("Wrench", "Twist", "Pose"))


def header(time, frame):
    stamp = TYPES["builtin_interfaces/msg/Time"](sec=int(time), nanosec=round(time % 1 * 1e9))
    return TYPES["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)


def vector(x, y, z):
    return TYPES["geometry_msgs/msg/Vector3"](x=x, y=y, z=z)


def wrench(time, fx, fy, tau):
    load = TYPES["geometry_msgs/msg/Wrench"](force=vector(fx, fy, 9.0), torque=vector(9, 9, tau))
    return TYPES[WRENCH](header=header(time, "object"), wrench=load)


def twist(time, vx, vy, omega, frame="object"):
    motion = TYPES["geometry_msgs/msg/Twist"](
        linear=vector(vx, vy, 0.0), angular=vector(0.0, 0.0, omega)
    )
    return TYPES[TWIST](header=header(time, frame), twist=motion)


def pose(time, x, y, yaw, frame="world"):
    turn = TYPES["geometry_msgs/msg/Quaternion"](
        x=0.0, y=0.0, z=float(np.sin(yaw / 2)), w=float(np.cos(yaw / 2))
    )
    place = TYPES["geometry_msgs/msg/Point"](x=x, y=y, z=0.0)
    at = TYPES["geometry_msgs/msg/Pose"](position=place, orientation=turn)
    return TYPES[POSE](header=header(time, frame), pose=at)


def time_of(message, fallback):
    if hasattr(message, "transforms"):
        message = message.transforms[0]
    if not hasattr(message, "header"):
        return fallback
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def write_bag(path, topics, storage=StoragePlugin.SQLITE3, recorded=None, compress=None):
    """Write messages, recorded at the times of their headers, or as `recorded` tells by topic."""
    bag = Writer(path, version=9, storage_plugin=storage)
    if compress is not None:
        bag.set_compression(compress, CompressionFormat.ZSTD)
    with bag as writer:
        for topic, (kind, messages) in topics.items():
            connection = writer.add_connection(topic, kind, typestore=STORE)
            for index, message in enumerate(messages):
                time = time_of(message, round((100.0 + 0.01 * index) * 1e9))
                if recorded is not None:
                    time = round(recorded[topic][index] * 1e9)
                writer.write(connection, time, STORE.serialize_cdr(message, kind))
    return path


TIMES = np.arange(100.0, 102.0, 0.01)


def steady_push(times=TIMES):
    wrenches = [wrench(t, 1.0, 0.5, 0.02) for t in times]
    twists = [twist(t, 0.02, 0.01, 0.1) for t in times + 0.003]
    return {"/load": (WRENCH, wrenches), "/motion": (TWIST, twists)}


def on_a_circle(times):
    """Return x, y and yaw of a body that moves along its own x at 0.02 m/s and turns at 0.5."""
    angle = 2.0 + 0.5 * (times - times[0])
    return 0.04 * np.sin(angle), -0.04 * np.cos(angle), angle


CIRCLE = [0.02, 0.0, 0.5]
LOAD = [1.0, 0.5, 0.02]
GEOMETRY = "geometry_msgs/msg/"


def quaternion(yaw, norm=1.0):
    return TYPES[f"{GEOMETRY}Quaternion"](
        x=0.0, y=0.0, z=float(norm * np.sin(yaw / 2)), w=float(norm * np.cos(yaw / 2))
    )


def plain_pose(x, y, yaw, norm=1.0):
    place = TYPES[f"{GEOMETRY}Point"](x=float(x), y=float(y), z=0.0)
    return TYPES[f"{GEOMETRY}Pose"](position=place, orientation=quaternion(yaw, norm))


def transform(time, parent, child, x, y, yaw):
    moved = TYPES[f"{GEOMETRY}Transform"](
        translation=vector(float(x), float(y), 0.0), rotation=quaternion(yaw)
    )
    return TYPES[f"{GEOMETRY}TransformStamped"](
        header=header(time, parent), child_frame_id=child, transform=moved
    )


def tf_of(*transforms):
    return TYPES["tf2_msgs/msg/TFMessage"](transforms=list(transforms))


def plain_twist(vx, vy, omega):
    return TYPES[f"{GEOMETRY}Twist"](linear=vector(vx, vy, 0.0), angular=vector(0.0, 0.0, omega))


def motion_messages(kind, norm=1.0, late=0.0):
    """Return messages of a type that tell the circle, stamped later than they should be."""
    circle = zip(TIMES, *on_a_circle(TIMES), strict=True)
    return [motion_message(kind, t + late, x, y, yaw, norm) for t, x, y, yaw in circle]


def motion_message(kind, t, x, y, yaw, norm):
    """Return one message that tells a pose of the circle, or its twist."""
    name, make = kind.rpartition("/")[2], TYPES.get(kind)
    top, still, covariance = header(t, "world"), header(t, "object"), np.zeros(36)
    at, going = plain_pose(x, y, yaw, norm), plain_twist(*CIRCLE)
    at_c = TYPES[f"{GEOMETRY}PoseWithCovariance"](pose=at, covariance=covariance)
    going_c = TYPES[f"{GEOMETRY}TwistWithCovariance"](twist=going, covariance=covariance)
    makers = {
        "PoseStamped": lambda: make(header=top, pose=at),
        "PoseWithCovarianceStamped": lambda: make(header=top, pose=at_c),
        "Pose": lambda: at,
        "Pose2D": lambda: make(x=float(x), y=float(y), theta=float(yaw)),
        "TransformStamped": lambda: transform(t, "world", "object", x, y, yaw),
        "TFMessage": lambda: tf_of(transform(t, "world", "object", x, y, yaw)),
        "Odometry": lambda: make(header=top, child_frame_id="object", pose=at_c, twist=going_c),
        "TwistStamped": lambda: make(header=still, twist=going),
        "TwistWithCovarianceStamped": lambda: make(header=still, twist=going_c),
        "Twist": lambda: going,
    }
    return makers[name]()


def loads(frame="object", load=LOAD, kind=WRENCH):
    messages = []
    for t in TIMES:
        message = wrench(t, *load)
        message.header.frame_id = frame
        messages.append(message if kind == WRENCH else message.wrench)
    return kind, messages
