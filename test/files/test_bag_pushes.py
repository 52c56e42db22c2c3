# SPDX-License-Identifier: Apache-2.0
"""Pushes are found in real bags of both storages, and what is dropped is counted."""

import numpy as np
import pytest
from bag_helpers import (
    POSE,
    TIMES,
    TWIST,
    StoragePlugin,
    pose,
    steady_push,
    twist,
    wrench,
    write_bag,
)

from limit_surface_ros.errors import DataError, FileError, RangeError
from limit_surface_ros.files.bag_pushes import Selection, read_bag_pushes


@pytest.mark.parametrize("storage", [StoragePlugin.SQLITE3, StoragePlugin.MCAP])
def test_a_steady_push_is_read_from_both_storages(tmp_path, storage):
    bag = write_bag(tmp_path / "bag", steady_push(), storage)
    pushes = read_bag_pushes(bag, "load", "/motion")
    assert len(pushes.pairs) == 4
    np.testing.assert_allclose(pushes.pairs.wrenches, np.tile([1.0, 0.5, 0.02], (4, 1)))
    np.testing.assert_allclose(pushes.pairs.twists, np.tile([0.02, 0.01, 0.1], (4, 1)))
    assert pushes.samples == len(TIMES)
    assert pushes.dropped["without motions near them"] == 1


def test_poses_in_a_fixed_frame_become_twists_of_the_body(tmp_path):
    topics = steady_push()
    # Along the body's own x at 0.02 m/s while turning at 0.5 rad/s: a circle.
    angle = 2.0 + 0.5 * (TIMES - TIMES[0])
    radius = 0.02 / 0.5
    poses = [
        pose(t, float(radius * np.sin(a)), float(-radius * np.cos(a)), a)
        for t, a in zip(TIMES, angle, strict=True)
    ]
    topics["/motion"] = (POSE, poses)
    pushes = read_bag_pushes(write_bag(tmp_path / "bag", topics), "/load", "/motion")
    expected = np.tile([0.02, 0.0, 0.5], (len(pushes.pairs), 1))
    np.testing.assert_allclose(pushes.pairs.twists, expected, atol=1e-5)


def test_every_rule_drops_what_it_says(tmp_path):
    topics = steady_push()
    loads, motions = topics["/load"][1], topics["/motion"][1]
    for index in range(40):
        loads[index] = wrench(TIMES[index], 0.01, 0.0, 0.0)
        motions[60 + index] = twist(TIMES[60 + index], 0.0, 0.0, 0.0)
        motions[150 + index] = twist(TIMES[150 + index], 0.3, 0.0, 0.0)
    topics["/motion"] = (TWIST, motions)
    loads[120] = wrench(TIMES[120], float("nan"), 0.0, 0.0)
    pushes = read_bag_pushes(write_bag(tmp_path / "bag", topics), "/load", "/motion")
    assert pushes.dropped["with too small a force"] == 39  # one lies before the motions
    assert 35 <= pushes.dropped["too slow"] <= 40
    assert 35 <= pushes.dropped["too fast"] <= 42
    assert pushes.dropped["accelerating"] > 0
    assert pushes.dropped["with a number that is not finite"] == 1
    np.testing.assert_allclose(pushes.pairs.wrenches[:, 0], 1.0)


def test_faults_of_a_bag_are_named(tmp_path):
    bag = write_bag(tmp_path / "bag", steady_push())
    with pytest.raises(FileError, match="has no topic /speed; there are /load, /motion"):
        read_bag_pushes(bag, "load", "speed")
    with pytest.raises(FileError, match="WrenchStamped; motions are read of"):
        read_bag_pushes(bag, "load", "load")
    with pytest.raises(DataError, match="no part is a quasi-static push; of 200 wrenches"):
        read_bag_pushes(bag, "load", "motion", Selection(min_force=50.0))
    with pytest.raises(RangeError, match="window"):
        Selection(window=0.0)
    topics = steady_push()
    topics["/motion"] = (TWIST, [twist(t, 0.02, 0.0, 0.0, "world") for t in TIMES])
    with pytest.raises(FileError, match="motions are given in frame 'world'"):
        read_bag_pushes(write_bag(tmp_path / "other", topics), "load", "motion")
