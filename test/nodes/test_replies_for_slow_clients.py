# SPDX-License-Identifier: Apache-2.0
"""Few replies are kept for clients that are slow or have stopped where replies may be long.

Requests wait by more than that.
"""

from __future__ import annotations

import signal

import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from limit_surface_interfaces.msg import ErrorCode
from limit_surface_interfaces.srv import WrenchesToTwists
from rclpy.qos import QoSProfile
from rclpy.utilities import get_rmw_implementation_identifier

from decay_helpers import Bench
from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
from limit_surface_ros.nodes.serving import middleware
from limit_surface_ros.nodes.serving.endpoints import KEPT_LARGE, WAITING, WAITING_LARGE
from node_helpers import Program
from process_helpers import WAIT

LONG = {"wrenches_to_twists", "twists_to_wrenches", "simulate_push", "simulate_pushes"}
LONG |= {"list_models", "describe_model", "evaluate", "predict_slide"}
SHORT = {"wrench_to_twist", "twist_to_wrench", "push", "time_to_level"}
FAST_DDS = get_rmw_implementation_identifier().startswith("rmw_fastrtps")


def depths(node):
    return {each.srv_name.rpartition("/")[2]: each.qos_profile.depth for each in node.services}


@pytest.mark.parametrize("name", ["limit_surface", "decay"])
def test_replies_are_kept_by_how_long_they_may_be(ros, client_node, tmp_path, model_file, name):
    if name == "decay":
        node = Bench(ros, client_node, tmp_path, sim_time=False).node
    else:
        node = ros.add(LimitSurfaceNode, files=[model_file()[1]])
    kept = depths(node)
    assert {kept[each] for each in LONG & kept.keys()} == {WAITING_LARGE}
    assert {kept[each] for each in SHORT & kept.keys()} == {WAITING}


@pytest.mark.skipif(not FAST_DDS, reason="the settings that ship are of Fast DDS")
def test_fewer_are_kept_where_requests_have_a_queue_of_their_own(
    ros, model_file, monkeypatch, tmp_path
):
    for name in (middleware.VARIABLE, "FASTDDS_BUILTIN_TRANSPORTS"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.chdir(tmp_path)
    _, path = model_file()
    with middleware.settings():
        kept = depths(ros.add(LimitSurfaceNode, files=[path]))
    assert {kept[each] for each in LONG & kept.keys()} == {KEPT_LARGE}
    assert {kept[each] for each in SHORT & kept.keys()} == {WAITING}
    monkeypatch.setenv(middleware.VARIABLE, "/of/the/user.xml")
    assert not middleware.requests_wait_apart()


def test_more_requests_wait_for_a_busy_node_than_replies_are_kept(ros, client_node, model_file):
    _, path = model_file()
    count = WAITING_LARGE - 4
    with Program("limit_surface_node", "--ros-args", "-p", f"model_files:=['{path}']") as program:
        client = client_node.create_client(
            WrenchesToTwists,
            "/limit_surface/wrenches_to_twists",
            qos_profile=QoSProfile(depth=1000),
        )
        assert client.wait_for_service(timeout_sec=WAIT)
        request = WrenchesToTwists.Request(wrenches=[3.0, 1.0, 0.1] * 10)
        # The first answer tells that both know each other.
        first = client.call_async(request)
        while not ros.done(first, 1.0):
            first = client.call_async(request)
        program.process.send_signal(signal.SIGSTOP)
        answers = [client.call_async(request) for _ in range(count)]
        program.process.send_signal(signal.SIGCONT)
        ros.wait(lambda: all(each.done() for each in answers))
        assert {each.result().error_code for each in answers} == {ErrorCode.NONE}
        code, output = program.end()
    assert code == 0, output
