# SPDX-License-Identifier: Apache-2.0
"""Every planar message of a bag is read, in every frame that can be brought to the body's."""

import os

import numpy as np
import pytest
from bag_helpers import (
    CIRCLE,
    GEOMETRY,
    LOAD,
    POSE,
    TIMES,
    TWIST,
    WRENCH,
    StoragePlugin,
    Stores,
    get_typestore,
    header,
    loads,
    motion_messages,
    on_a_circle,
    quaternion,
    steady_push,
    tf_of,
    transform,
    vector,
    wrench,
    write_bag,
)
from rosbags.rosbag2 import CompressionMode

from limit_surface_ros.errors import DataError, FileError
from limit_surface_ros.files.bag_messages import MOTIONS
from limit_surface_ros.files.bag_pushes import BagFrames, read_bag_pushes
from limit_surface_ros.files.bag_topic import read_topic
from limit_surface_ros.surface.frames import RigidTransform

TF = "tf2_msgs/msg/TFMessage"


# ROS 1 has another name of TFMessage, too.
@pytest.mark.parametrize("kind", [kind for kind in MOTIONS if not kind.startswith("tf/")])
@pytest.mark.parametrize("load_kind", [WRENCH, f"{GEOMETRY}Wrench"])
def test_every_type_of_motion_and_wrench_is_read(tmp_path, kind, load_kind):
    frames = BagFrames(body="object", fixed="world") if kind == TF else None
    bag = write_bag(
        tmp_path / "bag",
        {"/load": loads(kind=load_kind), "/motion": (kind, motion_messages(kind))},
        StoragePlugin.MCAP,
    )
    pushes = read_bag_pushes(bag, "/load", "/motion", None, frames)
    count = len(pushes.pairs)
    assert count == 4
    np.testing.assert_allclose(pushes.pairs.twists, [CIRCLE] * count, atol=1e-6)
    np.testing.assert_allclose(pushes.pairs.wrenches, [LOAD] * count, atol=1e-12)
    assert pushes.frame_id == "object"


@pytest.mark.parametrize("norm", [0.5, 1.1])
def test_quaternions_of_any_norm_are_orientations(tmp_path, norm):
    topics = {"/load": loads(), "/motion": (POSE, motion_messages(POSE, norm))}
    pushes = read_bag_pushes(write_bag(tmp_path / "bag", topics), "/load", "/motion")
    np.testing.assert_allclose(pushes.pairs.twists, [CIRCLE] * 4, atol=1e-6)
    assert any("200 of 200 quaternions on /motion have norms" in note for note in pushes.notes)


def test_a_zero_quaternion_is_refused_with_the_count(tmp_path):
    motion = motion_messages(POSE)
    for index in range(7):
        motion[index].pose.orientation = quaternion(0.0, 0.0)
    bag = write_bag(tmp_path / "bag", {"/load": loads(), "/motion": (POSE, motion)})
    with pytest.raises(FileError, match="7 of 200 messages on /motion have a zero quaternion"):
        read_bag_pushes(bag, "/load", "/motion")


def test_a_tilted_body_is_told(tmp_path):
    motion = motion_messages(POSE)
    for message in motion:
        message.pose.orientation.x = 0.2
    bag = write_bag(tmp_path / "bag", {"/load": loads(), "/motion": (POSE, motion)})
    assert any("tilted by up to" in note for note in read_bag_pushes(bag, "load", "motion").notes)


def test_more_frames_than_one_on_a_topic_are_refused_with_their_counts(tmp_path):
    kind, messages = loads()
    messages[150].header.frame_id = "gripper"
    bag = write_bag(
        tmp_path / "bag", {"/load": (kind, messages), "/motion": (POSE, motion_messages(POSE))}
    )
    with pytest.raises(FileError, match=r"more than one frame.*'object' \(199\), 'gripper' \(1\)"):
        read_bag_pushes(bag, "/load", "/motion")


def test_wrenches_in_a_foreign_frame_are_refused_with_the_ways_out(tmp_path):
    topics = {"/load": loads("ft_sensor"), "/motion": (POSE, motion_messages(POSE))}
    bag = write_bag(tmp_path / "bag", topics)
    with pytest.raises(
        FileError, match=r"frame 'ft_sensor'.*--body ft_sensor.*--wrench-transform"
    ):
        read_bag_pushes(bag, "/load", "/motion")
    named = read_bag_pushes(bag, "/load", "/motion", None, BagFrames(body="ft_sensor"))
    assert named.frame_id == "ft_sensor"


def test_numbers_in_several_frames_are_no_record(tmp_path):
    kind, messages = loads()
    messages[150].header.frame_id = "gripper"
    bag = write_bag(tmp_path / "bag", {"/load": (kind, messages)})
    with pytest.raises(FileError, match="messages on /load are in 2 frames, 'gripper', 'object'"):
        read_topic(bag, "/load", ["wrench.force.x"])


def test_positions_in_millimetres_are_named(tmp_path):
    motion = motion_messages(POSE)
    for message in motion:
        message.pose.position.x *= 1000.0
        message.pose.position.y *= 1000.0
    bag = write_bag(tmp_path / "bag", {"/load": loads(), "/motion": (POSE, motion)})
    with pytest.raises(DataError, match=r"too fast.*are positions in millimetres"):
        read_bag_pushes(bag, "/load", "/motion")


SENSOR = RigidTransform.from_euler([0.1, -0.05, 0.2], [0.0, 0.0, 0.7])


def in_sensor(load=LOAD):
    six = SENSOR.inverse.wrench(np.array([load[0], load[1], 9.0, 9.0, 9.0, load[2]]))
    messages = []
    for t in TIMES:
        message = wrench(t, 0.0, 0.0, 0.0)
        message.header.frame_id = "ft_sensor"
        message.wrench.force, message.wrench.torque = vector(*six[:3]), vector(*six[3:])
        messages.append(message)
    return WRENCH, messages


def fixed_transform(parent, child, placed):
    x, y = placed.translation[:2]
    one = transform(100.0, parent, child, x, y, np.arctan2(*placed.rotation[[1, 0], 0]))
    one.transform.translation.z = float(placed.translation[2])
    return tf_of(one)


def test_a_transform_that_is_given_brings_wrenches_to_the_body(tmp_path):
    topics = {"/load": in_sensor(), "/motion": (POSE, motion_messages(POSE))}
    frames = BagFrames(wrench_transform=SENSOR)
    pushes = read_bag_pushes(write_bag(tmp_path / "bag", topics), "load", "motion", None, frames)
    np.testing.assert_allclose(pushes.pairs.wrenches, [LOAD] * 4, atol=1e-9)
    assert pushes.frame_id == "object"


def test_static_transforms_of_the_bag_bring_wrenches_to_the_body(tmp_path):
    kind = "nav_msgs/msg/Odometry"
    half = RigidTransform.from_euler([0.1, 0.0, 0.0], [0.0, 0.0, 0.3])
    topics = {
        "/load": in_sensor(),
        "/motion": (kind, motion_messages(kind)),
        "/tf_static": (
            TF,
            [
                fixed_transform("object", "handle", half),
                fixed_transform("handle", "ft_sensor", half.inverse @ SENSOR),
            ],
        ),
    }
    pushes = read_bag_pushes(write_bag(tmp_path / "bag", topics), "/load", "/motion")
    np.testing.assert_allclose(pushes.pairs.wrenches, [LOAD] * 4, atol=1e-9)
    assert any("from frame 'ft_sensor' to the body's" in note for note in pushes.notes)


@pytest.mark.parametrize("kind", [POSE, TF])
def test_a_sensor_that_moves_beside_the_body_is_followed_by_tf(tmp_path, kind):
    """The sensor is on an arm that stands still in the world, so that the body turns beside it."""
    arm = RigidTransform.from_euler([0.3, 0.1, 0.0], [0.0, 0.0, -0.4])
    load = np.array([*LOAD[:2], 0.0, 0.0, 0.0, LOAD[2]])
    messages = []
    for t, x, y, yaw in zip(TIMES, *on_a_circle(TIMES), strict=True):
        body = RigidTransform.from_euler([x, y, 0.0], [0.0, 0.0, yaw])
        six = (arm.inverse @ body).wrench(load)
        message = wrench(t, 0.0, 0.0, 0.0)
        message.header.frame_id = "ft_sensor"
        message.wrench.force, message.wrench.torque = vector(*six[:3]), vector(*six[3:])
        messages.append(message)
    topics = {
        "/load": (WRENCH, messages),
        "/tf": (TF, motion_messages(TF)) if kind == TF else (kind, motion_messages(kind)),
        "/tf_static": (TF, [fixed_transform("world", "ft_sensor", arm)]),
    }
    frames = BagFrames(body="object", fixed="world") if kind == TF else None
    bag = write_bag(tmp_path / "bag", topics)
    pushes = read_bag_pushes(bag, "/load", "/tf", None, frames)
    np.testing.assert_allclose(pushes.pairs.wrenches, [LOAD] * len(pushes.pairs), atol=1e-4)
    np.testing.assert_allclose(pushes.pairs.twists, [CIRCLE] * len(pushes.pairs), atol=1e-4)


def test_transforms_need_the_frames_that_they_join(tmp_path):
    bag = write_bag(tmp_path / "bag", {"/load": loads(), "/tf": (TF, motion_messages(TF))})
    with pytest.raises(FileError, match=r"--body, and in which with --fixed; .*: object, world"):
        read_bag_pushes(bag, "/load", "/tf")
    with pytest.raises(
        FileError, match=r"from frame 'box' to 'world'.*frames there: object, world"
    ):
        read_bag_pushes(bag, "/load", "/tf", None, BagFrames(body="box", fixed="world"))


def test_a_refused_type_is_told_with_those_that_are_taken_and_the_topics_there_are(tmp_path):
    bag = write_bag(tmp_path / "bag", {"/load": loads(), "/tf": (TF, motion_messages(TF))})
    with pytest.raises(FileError) as error:
        read_bag_pushes(bag, "/tf", "/tf")
    for part in ("/tf is of type tf2_msgs/msg/TFMessage", "WrenchStamped", "/load (geometry_msgs"):
        assert part in str(error.value)


def without_stamps(messages):
    for message in messages:
        message.header.stamp = header(0.0, "").stamp
    return messages


def test_empty_stamps_and_clocks_that_never_meet_leave_the_times_of_the_recording(tmp_path):
    recorded = {"/load": TIMES + 0.001, "/motion": TIMES}
    kind = f"{GEOMETRY}TransformStamped"
    motions = without_stamps(motion_messages(kind)), motion_messages(kind, late=-1000.0)
    for number, motion in enumerate(motions):
        topics = {"/load": loads(), "/motion": (kind, motion)}
        bag = write_bag(tmp_path / str(number), topics, recorded=recorded)
        pushes = read_bag_pushes(bag, "/load", "/motion")
        assert len(pushes.pairs) == 4
        assert any("the times of the recording are taken" in note for note in pushes.notes)
        with pytest.raises(
            DataError, match=r"never meet in time.*--stamps recorded|holds 1 motions"
        ):
            read_bag_pushes(bag, "/load", "/motion", None, BagFrames(stamps="header"))


@pytest.mark.parametrize("mode", [CompressionMode.FILE, CompressionMode.MESSAGE])
def test_compressed_bags_are_read(tmp_path, mode):
    bag = write_bag(tmp_path / "bag", steady_push(), compress=mode)
    assert len(read_bag_pushes(bag, "/load", "/motion").pairs) == 4


def test_bags_of_ros_1_are_read(tmp_path):
    from rosbags.rosbag1 import Writer as Writer1

    store = get_typestore(Stores.ROS1_NOETIC)
    types = store.types
    path = tmp_path / "pushes.bag"
    with Writer1(path) as writer:
        for topic, kind in (("/load", WRENCH), ("/motion", TWIST)):
            connection = writer.add_connection(topic, kind, typestore=store)
            for index, t in enumerate(TIMES):
                stamp = types["builtin_interfaces/msg/Time"](
                    sec=int(t), nanosec=round(t % 1 * 1e9)
                )
                top = types["std_msgs/msg/Header"](seq=index, stamp=stamp, frame_id="/object")
                parts = types[f"{GEOMETRY}Vector3"]
                if kind == WRENCH:
                    body = {
                        "wrench": types[f"{GEOMETRY}Wrench"](
                            force=parts(x=1.0, y=0.5, z=9.0), torque=parts(x=9.0, y=9.0, z=0.02)
                        )
                    }
                else:
                    body = {
                        "twist": types[f"{GEOMETRY}Twist"](
                            linear=parts(x=0.02, y=0.01, z=0.0), angular=parts(x=0.0, y=0.0, z=0.1)
                        )
                    }
                raw = store.serialize_ros1(types[kind](header=top, **body), kind)
                writer.write(connection, round(t * 1e9), raw)
    pushes = read_bag_pushes(path, "load", "motion")
    np.testing.assert_allclose(pushes.pairs.twists, [[0.02, 0.01, 0.1]] * 4)
    assert pushes.frame_id == "object"


def test_damaged_bags_name_the_remedy(tmp_path):
    bag = write_bag(tmp_path / "bag", steady_push())
    (bag / "metadata.yaml").unlink()
    with pytest.raises(FileError, match=r"ros2 bag reindex .*or give the file bag\.db3 itself"):
        read_bag_pushes(bag, "load", "motion")
    assert len(read_bag_pushes(bag / "bag.db3", "load", "motion").pairs) == 4
    whole = write_bag(tmp_path / "other", steady_push(), StoragePlugin.MCAP) / "other.mcap"
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    with pytest.raises(FileError, match="mcap recover"):
        read_bag_pushes(cut, "load", "motion")
    fifo = tmp_path / "fifo.mcap"
    os.mkfifo(fifo)
    with pytest.raises(FileError, match="no regular file"):
        read_bag_pushes(fifo, "load", "motion")
