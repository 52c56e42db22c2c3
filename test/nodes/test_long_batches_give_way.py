# SPDX-License-Identifier: Apache-2.0
"""While a long batch is answered, topics and other services are served; none is lost."""

from __future__ import annotations

import time

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from geometry_msgs.msg import TwistStamped, WrenchStamped
from limit_surface_interfaces.msg import ErrorCode
from limit_surface_interfaces.srv import WrenchesToTwists, WrenchToTwist

from limit_surface_ros.files.surface_file import SurfaceModel, write_surface_model
from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
from limit_surface_ros.nodes.messages import convert
from limit_surface_ros.nodes.serving import batches
from limit_surface_ros.nodes.serving.waiting import Handling
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.scaling import Scaling
from node_helpers import stamp_message, wrench_message
from process_helpers import WAIT

ROWS = 60_000
STREAM = 100


@pytest.fixture
def slow(ros, client_node, tmp_path):
    """A node whose batches take long, and a function that asks for one."""
    factors = np.random.default_rng(0).normal(size=(24, 3, 2))
    surface = Dissipation(factors @ factors.transpose(0, 2, 1), Scaling(0.05, 2.0))
    path = tmp_path / "slow.yaml"
    write_surface_model(SurfaceModel(name="slow", surface=surface), path)
    node = ros.add(LimitSurfaceNode, files=[path])
    client = client_node.create_client(WrenchesToTwists, "/limit_surface/wrenches_to_twists")
    assert client.wait_for_service(timeout_sec=WAIT)

    def ask(rows, spoil=None):
        wrenches = np.random.default_rng(rows).normal(size=(rows, 3))
        if spoil is not None:
            wrenches[spoil] = np.nan
        flat = convert.flat_of(wrenches)
        return client.call_async(WrenchesToTwists.Request(wrenches=flat))

    return node, ask


def test_a_stream_and_other_calls_are_answered_before_a_long_batch_is(ros, client_node, slow):
    node, ask = slow
    twists = ros.listen(client_node, TwistStamped, "/limit_surface/predicted_twist", 1000)
    loads = client_node.create_publisher(WrenchStamped, "/limit_surface/wrench", 1000)
    call = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
    ros.matched(loads)
    ros.matched(node._twists)
    batch = ask(ROWS)
    ros.wait(lambda: node.endpoints.under_way == 1)
    for number in range(STREAM):
        loads.publish(wrench_message([9.0, 0.0, 0.0], stamp=stamp_message(number)))
    assert call(WrenchToTwist.Request(wrench=wrench_message([9, 0, 0]))).error_code == 0
    ros.wait(lambda: len(twists) == STREAM)
    assert node.endpoints.under_way == 1, "the batch was over before the others were answered"
    assert not batch.done()
    assert [twist.header.stamp.nanosec for twist in twists] == list(range(STREAM))
    assert ros.done(batch, WAIT)
    assert batch.result().error_code == ErrorCode.NONE
    assert len(batch.result().twists) == 3 * ROWS


def test_short_batches_do_not_wait_for_a_long_one_and_long_ones_come_in_their_order(ros, slow):
    node, ask = slow
    over = []
    first, second, broken = ask(ROWS), ask(2000), ask(3000, spoil=2500)
    for name, future in (("first", first), ("second", second), ("broken", broken)):
        future.add_done_callback(lambda _, name=name: over.append(name))
    ros.wait(lambda: node.endpoints.under_way == 3)
    short = ask(10)
    assert ros.done(short, WAIT)
    assert short.result().error_code == ErrorCode.NONE
    assert not first.done()
    for future in (first, second, broken):
        assert ros.done(future, WAIT)
    assert over == ["first", "second", "broken"]
    assert second.result().error_code == ErrorCode.NONE
    assert broken.result().error_code == ErrorCode.NOT_FINITE
    assert "row 2500" in broken.result().error_msg
    assert node.endpoints.under_way == 0


def test_more_than_may_wait_is_refused_and_not_lost(ros, slow, monkeypatch):
    node, ask = slow
    monkeypatch.setattr(batches, "MOST_BYTES", 24 * 5000)
    first = ask(ROWS)
    ros.wait(lambda: node.endpoints.under_way == 1)
    waits, refused = ask(3000), ask(3001)
    assert ros.done(refused, WAIT)
    assert refused.result().error_code == ErrorCode.UNAVAILABLE
    assert "wait already" in refused.result().error_msg
    assert ros.done(first, WAIT)
    assert ros.done(waits, WAIT)
    assert waits.result().error_code == ErrorCode.NONE


def test_of_several_long_batches_of_pushes_one_at_a_time_has_begun(ros, slow):
    node, _ = slow
    begun, over, gate = [], [], []

    def stages(name):
        begun.append(name)
        while name == "long" and not gate:
            yield
            # A slice is over: others have their turns.
            time.sleep(batches.SLICE)
        return name

    async def run(name, rows):
        over.append(await node.batches.run_stages(rows, stages(name)))

    def begin():
        for name, rows in (("long", 1000), ("next", 1000), ("short", 10)):
            Handling(lambda _: None, run, (name, rows), lambda _: None).begin()

    ros.executor.create_task(begin)
    ros.wait(lambda: over == ["short"])
    assert begun == ["long", "short"]
    gate.append("open")
    ros.wait(lambda: len(over) == 3)
    assert begun == ["long", "short", "next"]
