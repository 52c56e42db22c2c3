# SPDX-License-Identifier: Apache-2.0
"""The limit_surface node learns while it serves: under its own name, saved, restored, followed."""

from __future__ import annotations

import errno
import multiprocessing
import os
import signal
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from builtin_interfaces.msg import Time
from geometry_msgs.msg import TwistStamped, WrenchStamped
from limit_surface_interfaces.msg import ErrorCode
from limit_surface_interfaces.srv import ListModels, WrenchToTwist
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger

from limit_surface_ros.errors import FileError, UnknownModelError
from limit_surface_ros.files.surface_file import (
    SurfaceModel,
    read_surface_model,
    write_surface_model,
)
from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.pairs import Pairs
from limit_surface_ros.surface.sampling import random_loads
from limit_surface_ros.surface.scaling import Scaling
from node_helpers import handled, planar_twist, twist_message, wrench_message

SCALING = Scaling(0.08, 5.0)
BODY = PointContacts([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]], [2.0, 1.0, 1.5], SCALING)
SHIFTED = PointContacts([[0.0, -0.04], [0.0, 0.08], [0.12, -0.04]], [2.0, 1.0, 1.5], SCALING)
REFERENCE = (0.02, -0.01)
OUTLINE = Polygon([(-0.05, -0.05), (0.09, -0.05), (-0.05, 0.09)])


@pytest.fixture
def prior(tmp_path):
    """A model file of a wrong prior, about a point off its frame's origin."""
    path = tmp_path / "prior.yaml"
    sphere = Dissipation(np.eye(3)[None], SCALING)
    model = SurfaceModel("body", sphere, reference_point=REFERENCE, outline=OUTLINE)
    write_surface_model(model, path)
    return path


class Robot:
    """Publishes pushes of a body as measurements whose stamps are those of 100 Hz."""

    def __init__(self, ros, client_node):
        self.ros = ros
        self.wrenches = client_node.create_publisher(
            WrenchStamped, "/limit_surface/measured_wrench", 100
        )
        self.twists = client_node.create_publisher(
            TwistStamped, "/limit_surface/measured_twist", 100
        )
        ros.matched(self.wrenches)
        ros.matched(self.twists)
        self.time = 10.0

    def push(self, node, body, count, seed):
        """Push until so many more pushes are learnt: for one that is not, another comes."""
        goal = node.learner.count + count
        rng = np.random.default_rng(seed)

        def said():
            return node.describe()["learning"], node.health.reported["learning"]

        while node.learner.count < goal:
            pair = random_loads(body, 1, rng)
            motion = 0.02 * pair.twists[0] / np.linalg.norm(pair.twists[0] / SCALING.twist_unit)
            noise = 4e-4 * SCALING.twist_unit * rng.normal(size=(8, 3))
            before = said()
            self.measure(
                node,
                np.vstack([np.tile(pair.wrenches[0], (8, 1)), np.zeros(3)]),
                np.vstack([motion + noise, np.zeros(3)]),
            )
            self.time += 1.0
            self.ros.wait(lambda before=before: said() != before)

    def measure(self, node, wrenches, twists):
        """Publish measurements at the origin of the frame; each twist finds its wrench there."""
        x, y = REFERENCE
        stamps = []
        for _ in wrenches:
            self.time += 0.01
            stamps.append(Time(sec=int(self.time), nanosec=int(1e9 * (self.time % 1.0))))
        loads = [(fx, fy, tau + x * fy - y * fx) for fx, fy, tau in wrenches]
        motions = [(vx + omega * y, vy - omega * x, omega) for vx, vy, omega in twists]
        for name, publisher, message, vectors in (
            ("measured_wrench", self.wrenches, wrench_message, loads),
            ("measured_twist", self.twists, twist_message, motions),
        ):
            due = handled(node.health, name) + len(stamps)
            for vector, stamp in zip(vectors, stamps, strict=True):
                publisher.publish(message(vector, stamp=stamp))
            self.ros.wait(lambda name=name, due=due: handled(node.health, name) == due)


def angles(call, model, test):
    """Angles [rad] between the twists that a service answers for a model and those of pairs."""
    found = []
    x, y = REFERENCE
    for (fx, fy, tau), twist in zip(test.wrenches, test.twists, strict=True):
        wrench = wrench_message((fx, fy, tau + x * fy - y * fx))
        answer = call(WrenchToTwist.Request(model=model, wrench=wrench))
        assert answer.error_code == ErrorCode.NONE, answer.error_msg
        vx, vy, omega = planar_twist(answer.twist)
        unit = np.array([vx - omega * y, vy + omega * x, omega]) / SCALING.twist_unit
        expected = twist / SCALING.twist_unit
        cosine = unit @ expected / np.linalg.norm(unit) / np.linalg.norm(expected)
        found.append(np.arccos(min(1.0, cosine)))
    return float(np.degrees(np.mean(found)))


def some(body):
    pairs = random_loads(body, 25, 9)
    return Pairs(2.0 * pairs.wrenches, pairs.twists)


def test_predictions_improve_follow_a_change_and_outlive_the_node(
    ros, client_node, prior, tmp_path
):
    saved = tmp_path / "learnt.yaml"
    parameters = {"learn": True, "learn_file": str(saved)}
    node = ros.add(LimitSurfaceNode, files=[prior], parameters=parameters)
    call = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
    save = ros.client(client_node, Trigger, "/limit_surface/save_learnt")
    refused = save(Trigger.Request())
    assert not refused.success
    assert "nothing has been learnt yet" in refused.message
    # The name stands for the prior until there is a push.
    unlearnt, before = (angles(call, name, some(BODY)) for name in ("body_learnt", "body"))
    assert unlearnt == pytest.approx(before, abs=1e-6)
    robot = Robot(ros, client_node)
    robot.push(node, BODY, 12, 1)
    before, learnt = (angles(call, name, some(BODY)) for name in ("body", "body_learnt"))
    assert learnt < 0.6 * before
    listed = ros.client(client_node, ListModels, "/limit_surface/list_models")
    names = [model.name for model in listed(ListModels.Request()).models]
    assert names == ["body", "body_learnt"]
    assert "12 pushes" in node.describe()["learning"]
    assert "predicted within" in node.describe()["last push"]
    assert "mean of 10" in node.describe()["last pushes"]
    asked = WrenchToTwist.Request(model="body_learnt", wrench=wrench_message((9.0, 1.0, 0.1)))
    assert call(asked).has_covariance
    # What is learnt outlives a reload, and the node.
    reload = ros.client(client_node, Trigger, "/limit_surface/reload")
    assert reload(Trigger.Request()).success
    assert angles(call, "body_learnt", some(BODY)) == pytest.approx(learnt, abs=1e-6)
    answer = save(Trigger.Request())
    assert answer.success, answer.message
    model = read_surface_model(saved)
    assert (model.name, model.reference_point) == ("body_learnt", REFERENCE)
    np.testing.assert_array_equal(model.outline.drawn(), OUTLINE.drawn())
    # What is learnt can be the default, as long as it is served.
    assert node.set_parameters([Parameter("default_model", value="body_learnt")])[0].successful
    assert angles(call, "", some(BODY)) == pytest.approx(learnt, abs=1e-6)
    assert reload(Trigger.Request()).success
    assert node.host.models.default == "body_learnt"
    again = ros.add(LimitSurfaceNode, files=[prior], parameters=parameters, namespace="/again")
    ros.wait(lambda: again.learner.count == 12)
    # The body is another one half-way.
    stale = angles(call, "body_learnt", some(SHIFTED))
    robot.push(node, SHIFTED, 12, 2)
    assert angles(call, "body_learnt", some(SHIFTED)) < 0.8 * stale


def test_a_node_that_does_not_learn_has_no_such_topics(ros, client_node, prior):
    node = ros.add(LimitSurfaceNode, files=[prior])
    assert node.learner is None
    names = {name for name, _ in node.get_topic_names_and_types()}
    assert "/limit_surface/measured_wrench" not in names
    assert "learning" not in node.describe()


def test_learning_goes_on_when_its_process_is_killed(ros, client_node, prior):
    before = set(multiprocessing.active_children())
    node = ros.add(LimitSurfaceNode, files=[prior], parameters={"learn": True})
    robot = Robot(ros, client_node)
    robot.push(node, BODY, 6, 1)
    (process,) = set(multiprocessing.active_children()) - before
    # The node has the cores first.
    own = os.getpriority(os.PRIO_PROCESS, os.getpid())
    assert os.getpriority(os.PRIO_PROCESS, process.pid) == min(own + 10, 19)
    process.kill()
    robot.push(node, BODY, 2, 2)
    assert node.learner.count >= 8
    assert node.health.reported["learning"] == 1


def test_measurements_that_teach_nothing_do_no_harm(ros, client_node, prior):
    node = ros.add(LimitSurfaceNode, files=[prior], parameters={"learn": True})
    robot = Robot(ros, client_node)
    robot.push(node, BODY, 1, 1)
    # Not a number in the midst of a push; a twist that is late; a clock that is turned back.
    robot.measure(node, [(5.0, 0.0, 0.0)] * 4, [(0.02, 0.0, 0.0)] * 4)
    robot.measure(node, [(np.nan, 0.0, 0.0)], [(0.02, np.nan, 0.0)])
    assert node.health.refused["measured_twist", "NOT_FINITE"] == 1
    taken = node.health.accepted["measured_twist"]
    robot.twists.publish(twist_message((0.02, 0.0, 0.0), stamp=Time(sec=99)))
    ros.wait(lambda: node.health.accepted["measured_twist"] > taken)
    robot.time = 1.0
    robot.measure(node, np.zeros((1, 3)), np.zeros((1, 3)))
    ros.wait(lambda: node.health.reported["measured twist without a wrench"] == 1)
    robot.push(node, BODY, 1, 2)
    assert node.learner.count >= 2


def test_a_twist_that_comes_before_its_wrench_waits_for_it(ros, client_node, prior):
    node = ros.add(LimitSurfaceNode, files=[prior], parameters={"learn": True})
    robot = Robot(ros, client_node)
    sides = (
        (robot.twists, twist_message, (0.02, 0.005, 0.1), "measured_twist"),
        (robot.wrenches, wrench_message, (5.0, 1.0, 0.1), "measured_wrench"),
    )
    for number in range(10):
        # At 20 Hz, so that the wrench before is of another time.
        stamp = Time(sec=5, nanosec=50_000_000 * number)
        for publisher, message, vector, name in sides:
            taken = node.health.accepted[name]
            publisher.publish(message(vector if number < 9 else (0.0, 0.0, 0.0), stamp=stamp))
            ros.wait(lambda taken=taken, name=name: node.health.accepted[name] > taken)
    ros.wait(lambda: node.learner.count == 1)


def test_measurements_without_stamps_are_of_the_present(ros, client_node, prior):
    node = ros.add(LimitSurfaceNode, files=[prior], parameters={"learn": True})
    robot = Robot(ros, client_node)
    for number in range(400):
        taken = node.health.accepted["measured_twist"]
        moving = float(number % 20 > 0)
        robot.wrenches.publish(wrench_message((5.0 * moving, moving, 0.0), stamp=Time()))
        robot.twists.publish(twist_message((0.02 * moving, 0.0, 0.0), stamp=Time()))
        ros.wait(lambda taken=taken: node.health.accepted["measured_twist"] > taken)
        if node.learner.count:
            break
    ros.wait(lambda: node.learner.count)


def test_a_node_ends_whose_learning_process_does_not_answer(ros, client_node, prior):
    before = set(multiprocessing.active_children())
    node = ros.add(LimitSurfaceNode, files=[prior], parameters={"learn": True})
    robot = Robot(ros, client_node)
    robot.push(node, BODY, 1, 1)
    (process,) = set(multiprocessing.active_children()) - before
    os.kill(process.pid, signal.SIGSTOP)
    loads, motions = np.tile((5.0, 1.0, 0.1), (9, 1)), np.tile((0.02, 0.005, 0.1), (9, 1))
    loads[-1] = motions[-1] = 0.0
    # One that the process has, and one that waits for it.
    for _ in range(2):
        robot.measure(node, loads, motions)
    ros.wait(lambda: node.describe()["pushes that wait"] == "1")
    node.learner.close()
    ros.wait(lambda: not process.is_alive())


def test_what_is_learnt_can_be_saved_later_where_its_folder_was_read_only_or_gone(
    ros, client_node, prior, tmp_path, monkeypatch
):
    folder = tmp_path / "kept"
    folder.mkdir()
    saved = folder / "learnt.yaml"
    parameters = {"learn": True, "learn_file": str(saved)}
    node = ros.add(LimitSurfaceNode, files=[prior], parameters=parameters)
    save = ros.client(client_node, Trigger, "/limit_surface/save_learnt")
    Robot(ros, client_node).push(node, BODY, 1, 1)
    folder.rmdir()
    gone = save(Trigger.Request())
    assert not gone.success
    assert "No such file or directory; nothing was written" in gone.message

    def refused(*_, **__):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    # A read-only file system refuses to take away even what is not there.
    with monkeypatch.context() as patched:
        patched.setattr("pathlib.Path.open", refused)
        patched.setattr("pathlib.Path.unlink", refused)
        fixed = save(Trigger.Request())
    assert not fixed.success
    assert "Read-only file system; nothing was written" in fixed.message
    assert node.health.refused["save_learnt", "BAD_FILE"] == 2
    folder.mkdir()
    assert save(Trigger.Request()).success
    assert [path.name for path in folder.iterdir()] == ["learnt.yaml"]
    assert len(read_surface_model(saved).fit["online"]["pushes"]) == 1


def test_what_another_node_has_saved_is_not_written_over(ros, client_node, prior, tmp_path):
    saved = tmp_path / "learnt.yaml"
    parameters = {"learn": True, "learn_file": str(saved)}
    node = ros.add(LimitSurfaceNode, files=[prior], parameters=parameters)
    other = ros.add(
        LimitSurfaceNode, files=[prior], parameters=parameters, remap=["__node:=other"]
    )
    save = ros.client(client_node, Trigger, "/limit_surface/save_learnt")
    save_other = ros.client(client_node, Trigger, "/other/save_learnt")
    Robot(ros, client_node).push(node, BODY, 1, 1)
    other.learner._model = node.learner._model
    assert save(Trigger.Request()).success
    # Its own file is saved anew as often as it is asked for.
    assert save(Trigger.Request()).success
    theirs = saved.read_bytes()
    refused = save_other(Trigger.Request())
    assert not refused.success
    assert "somebody else has written it" in refused.message
    assert other.health.refused["save_learnt", "BAD_FILE"] == 1
    assert saved.read_bytes() == theirs
    saved.rename(tmp_path / "theirs.yaml")
    assert save_other(Trigger.Request()).success


def test_learning_goes_on_when_the_clock_is_set_back(ros, client_node, prior):
    node = ros.add(LimitSurfaceNode, files=[prior], parameters={"learn": True})
    robot = Robot(ros, client_node)
    robot.time = 100.0
    robot.push(node, BODY, 1, 1)
    robot.time = 90.0
    robot.push(node, BODY, 1, 2)
    assert not node.health.refused


def test_what_is_going_to_be_learnt_can_be_the_default_from_the_start(ros, prior):
    wanted = {"default_model": "body_learnt"}
    node = ros.add(LimitSurfaceNode, files=[prior], parameters={"learn": True, **wanted})
    assert (node.host.models.default, node.learner.name) == ("body_learnt", "body_learnt")
    for others in ({}, {"learn": True, "learn_prior": "absent"}):
        with pytest.raises(UnknownModelError, match="no model"):
            ros.add(LimitSurfaceNode, files=[prior], parameters={**wanted, **others})


def test_what_learning_cannot_begin_with_is_refused(ros, prior, tmp_path):
    with pytest.raises(UnknownModelError, match="no model 'absent'"):
        ros.add(
            LimitSurfaceNode, files=[prior], parameters={"learn": True, "learn_prior": "absent"}
        )
    for place, message in (
        (tmp_path / "absent" / "learnt.yaml", "its folder does not exist: make"),
        (tmp_path / f"{'long' * 99}.yaml", "cannot be written: File name too long"),
        (tmp_path, "cannot be written: it is no regular file"),
    ):
        with pytest.raises(FileError, match=message):
            ros.add(
                LimitSurfaceNode,
                files=[prior],
                parameters={"learn": True, "learn_file": str(place)},
            )
    with pytest.raises(FileError, match="is no learnt model"):
        ros.add(
            LimitSurfaceNode,
            files=[prior],
            parameters={"learn": True, "learn_file": str(prior)},
        )
    model = read_surface_model(prior)
    for state, reference, message in (
        ({"version": 1, "pushes": [[1.0, 2.0]]}, REFERENCE, "fit: online: this is no state"),
        ({"version": 1, "pushes": []}, (0.0, 0.0), "was learnt in frame 'object' about"),
    ):
        saved = tmp_path / "saved.yaml"
        write_surface_model(
            replace(model, fit={"online": state}, reference_point=reference), saved
        )
        with pytest.raises(FileError, match=message):
            ros.add(
                LimitSurfaceNode,
                files=[prior],
                parameters={"learn": True, "learn_file": str(saved)},
            )
