# SPDX-License-Identifier: Apache-2.0
"""What bench_soak.py loads a node with; each function is the work of a process of its own.

One thread and rclpy's EventsExecutor: what the load itself costs, and how late it sends and
receives, is felt in every figure.
"""

from __future__ import annotations

import contextlib
import math
import sys
import time
from array import array
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistStamped, WrenchStamped
from limit_surface_interfaces.srv import WrenchesToTwists, WrenchToTwist
from node_processes import wrench_message
from rclpy.experimental import EventsExecutor
from rclpy.qos import QoSProfile
from rclpy.task import Future
from std_srvs.srv import Trigger

from limit_surface_ros.files.surface_file import SurfaceModel, read_surface_model

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rclpy.node import Node

RATE = 1000.0
# What is sent; it makes the body slide.
WRENCH = (2.0, 1.0, 0.05)
# One wrench in so many is bad.
BAD = 100
# After so long an answer counts as lost [s].
LOST = 5.0
# After so long without any answer a stream does not begin [s].
UNHEARD = 30.0
# A stream ends so long before its load does [s].
LAST = 0.5
# Stamp [s] of wrenches that are sent before a stream begins.
NEVER = 1_000_000
# Every client of a service hears all of its answers; few would push its own out.
DEEP = QoSProfile(depth=1000)


@dataclass
class Stream:
    """What became of a stream of wrenches.

    Attributes:
        sent: Good wrenches.
        bad: Bad ones.
        answered: Good wrenches whose twist came.
        unasked: Twists that answer no good wrench.
        wrong: Twists that differ from the library's.
        delays: From sending a good wrench to its twist [s].
    """

    sent: int = 0
    bad: int = 0
    answered: int = 0
    unasked: int = 0
    wrong: int = 0
    delays: list[float] = field(default_factory=list)


@dataclass
class Calls:
    """What became of the calls of a service.

    Attributes:
        lost: Never answered.
        wrong: Answered otherwise than the library does.
        reloads: Reloads that were answered with success.
        times: Round trips [s].
    """

    lost: int = 0
    wrong: int = 0
    reloads: int = 0
    times: list[float] = field(default_factory=list)


@contextlib.contextmanager
def _spinning(name: str, seconds: float) -> Iterator[Node]:
    """Give a node, and spin it for so long at the end of the block."""
    # A context cannot be used again, and the process that runs this is.
    with rclpy.Context() as context:
        node = rclpy.create_node(name, context=context)
        yield node
        executor = EventsExecutor(context=context)
        executor.add_node(node)
        executor.spin_until_future_complete(Future(), timeout_sec=seconds)
        executor.shutdown()
        node.destroy_node()


def _wait_for_an_answer(node: Node, prefix: str, publisher: Any) -> None:
    """Send wrenches until one is answered.

    That the publisher knows of the subscription does not mean that the node knows of the
    publisher already: on a busy machine that takes some tenths of a second, and what is sent
    meanwhile is not lost, but was never received.
    """
    known, end = False, time.perf_counter() + UNHEARD

    def note(_: TwistStamped) -> None:
        nonlocal known
        known = True

    subscription = node.create_subscription(TwistStamped, f"{prefix}/predicted_twist", note, DEEP)
    executor = EventsExecutor(context=node.context)
    executor.add_node(node)
    message = wrench_message(WRENCH)
    message.header.stamp.sec = NEVER
    while not known:
        if time.perf_counter() > end:
            raise RuntimeError(
                f"no twist from {prefix} in {UNHEARD:g} s: its subscription matched "
                f"{publisher.get_subscription_count()} times, its publisher "
                f"{node.count_publishers(subscription.topic_name)} times"
            )
        publisher.publish(message)
        executor.spin_until_future_complete(Future(), timeout_sec=0.1)
    executor.shutdown()
    node.destroy_subscription(subscription)


def stream(prefix: str, seconds: float, model_file: str | None) -> Stream:
    """Send wrenches at a steady rate, one in a hundred of them bad, and time the twists.

    The twists are held against those of the library if there is a model file.
    """
    seen = Stream()
    due: dict[tuple[int, int], float] = {}
    surface = read_surface_model(model_file).surface if model_file else None
    expected = None if surface is None else surface.twist_of_wrench(WRENCH)

    def take(message: TwistStamped) -> None:
        stamp = message.header.stamp
        start = due.pop((stamp.sec, stamp.nanosec), None)
        if start is None:
            seen.unasked += stamp.sec != NEVER
        else:
            seen.answered += 1
            if expected is not None:
                found = message.twist
                twist = [found.linear.x, found.linear.y, found.angular.z]
                seen.wrong += not np.allclose(twist, expected, rtol=1e-9, atol=1e-9)
            seen.delays.append(time.perf_counter() - start)

    def send() -> None:
        # What is sent last may still be under way when the load ends.
        if time.perf_counter() > end:
            return
        number = seen.sent + seen.bad
        message = wrench_message(WRENCH)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(number, 1000)
        if number % BAD == BAD - 1:
            message.wrench.force.x = math.nan
            seen.bad += 1
        else:
            due[divmod(number, 1000)] = time.perf_counter()
            seen.sent += 1
        publisher.publish(message)

    with _spinning("soak_stream", seconds) as node:
        node.create_subscription(TwistStamped, f"{prefix}/predicted_twist", take, DEEP)
        publisher = node.create_publisher(WrenchStamped, f"{prefix}/wrench", DEEP)
        _wait_for_an_answer(node, prefix, publisher)
        end = time.perf_counter() + seconds - LAST
        node.create_timer(1.0 / RATE, send)
    return seen


class _Caller:
    """A client with one call under way at a time, each checked against the library if asked to.

    Args:
        period: From one call to the next [s]; 0: call again as soon as answered.
        model: What the service should answer by; None: do not check.
    """

    def __init__(
        self, node: Node, prefix: str, period: float, seed: int, model: SurfaceModel | None
    ) -> None:
        self.calls = Calls()
        self._model = model
        self._rng = np.random.default_rng(seed)
        self._client = node.create_client(
            WrenchToTwist, f"{prefix}/wrench_to_twist", qos_profile=DEEP
        )
        self._client.wait_for_service()
        self._again = not period
        self._pending: tuple[Future, float] | None = None
        # Also what starts a closed loop, and starts it again after a lost answer.
        node.create_timer(period or 0.1, self._ask)

    def _ask(self) -> None:
        if self._pending is not None:
            future, start = self._pending
            if time.perf_counter() - start < LOST:
                return
            self._client.remove_pending_request(future)
            self.calls.lost += 1
        wrench = self._rng.normal(size=3) * [2.0, 2.0, 0.1]
        start = time.perf_counter()
        future = self._client.call_async(WrenchToTwist.Request(wrench=wrench_message(wrench)))
        self._pending = future, start
        future.add_done_callback(lambda done: self._answered(done.result(), wrench, start))

    def _answered(self, answer: Any, wrench: Any, start: float) -> None:
        self.calls.times.append(time.perf_counter() - start)
        self._pending = None
        if self._model is not None:
            surface, found = self._model.surface, answer.twist.twist
            self.calls.wrong += not (
                np.allclose(
                    [found.linear.x, found.linear.y, found.angular.z],
                    surface.twist_of_wrench(wrench),
                    rtol=1e-9,
                    atol=1e-9,
                )
                and math.isclose(
                    answer.load_factor, float(surface.load_factor(wrench)), rel_tol=1e-9
                )
            )
        if self._again:
            self._ask()


def call(
    prefix: str, seconds: float, period: float, clients: int, model_file: str | None
) -> Calls:
    """Call from several clients, and reload once a second if there is a model to reload."""
    model = read_surface_model(model_file) if model_file else None
    total = Calls()
    with _spinning("soak_calls", seconds) as node:
        callers = [_Caller(node, prefix, period, seed, model) for seed in range(clients)]
        if model is not None:
            trigger = node.create_client(Trigger, f"{prefix}/reload")
            trigger.wait_for_service()
            node.create_timer(1.0, _reloads(trigger, total))
    for caller in callers:
        total.lost += caller.calls.lost
        total.wrong += caller.calls.wrong
        total.times += caller.calls.times
    return total


def _reloads(client: Any, total: Calls) -> Callable[[], None]:
    def count(done: Any) -> None:
        total.reloads += done.result().success

    return lambda: client.call_async(Trigger.Request()).add_done_callback(count)


def moving_stream(prefix: str, seconds: float) -> tuple[Stream, str]:
    """Send wrenches stamped now in a moving frame, and time the twists.

    Returns:
        What became of them, and what the node says of them if one was not answered: whether it
        never heard it, refused it, or its answer was lost on the way.
    """
    seen = Stream()
    due: dict[tuple[int, int], float] = {}
    told: dict[str, str] = {}

    def take(message: TwistStamped) -> None:
        stamp = message.header.stamp
        start = due.pop((stamp.sec, stamp.nanosec), None)
        if start is not None:
            seen.answered += 1
            seen.delays.append(time.perf_counter() - start)

    def note(message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name == prefix.lstrip("/"):
                told.update((each.key, each.value) for each in status.values)

    with _spinning("soak_moving", seconds + 2.5) as node:

        def send() -> None:
            if time.perf_counter() > end:
                return
            message = wrench_message(WRENCH, "tool")
            message.header.stamp = node.get_clock().now().to_msg()
            due[message.header.stamp.sec, message.header.stamp.nanosec] = time.perf_counter()
            seen.sent += 1
            publisher.publish(message)

        node.create_subscription(TwistStamped, f"{prefix}/predicted_twist", take, DEEP)
        node.create_subscription(DiagnosticArray, "/diagnostics", note, 10)
        publisher = node.create_publisher(WrenchStamped, f"{prefix}/wrench", DEEP)
        _wait_for_an_answer(node, prefix, publisher)
        end = time.perf_counter() + seconds
        node.create_timer(1.0 / 200.0, send)
    words = (f"{key} {value}" for key, value in told.items() if " wrench" in key)
    return seen, "" if seen.answered == seen.sent else f"; the node: {', '.join(words)}"


def batches(prefix: str, seconds: float, rows: int) -> Calls:
    """Ask for batches in a closed loop for so long."""
    return _batches(prefix, rows, lambda calls, start: time.perf_counter() - start < seconds)


def batch_calls(prefix: str, count: int, rows: int) -> Calls:
    """Ask for so many batches in a closed loop."""
    return _batches(prefix, rows, lambda calls, _: len(calls.times) + calls.lost < count)


def _batches(prefix: str, rows: int, go_on: Callable[[Calls, float], bool]) -> Calls:
    calls = Calls()
    flat = array("d", np.random.default_rng(0).normal(size=3 * rows))
    request = WrenchesToTwists.Request(wrenches=flat)
    with rclpy.Context() as context:
        node = rclpy.create_node("soak_batches", context=context)
        client = node.create_client(
            WrenchesToTwists, f"{prefix}/wrenches_to_twists", qos_profile=DEEP
        )
        client.wait_for_service()
        executor = EventsExecutor(context=context)
        executor.add_node(node)
        # The middleware drops answers to a client that it has yet to discover.
        known = client.call_async(WrenchesToTwists.Request())
        while not known.done():
            executor.spin_until_future_complete(known, timeout_sec=1.0)
            if not known.done():
                client.remove_pending_request(known)
                known = client.call_async(WrenchesToTwists.Request())
        start = time.perf_counter()
        while go_on(calls, start):
            asked = time.perf_counter()
            future = client.call_async(request)
            executor.spin_until_future_complete(future, timeout_sec=10.0 * LOST)
            if future.done():
                calls.times.append(time.perf_counter() - asked)
            else:
                calls.lost += 1
        executor.shutdown()
        node.destroy_node()
    return calls


def _wait_to_be_stopped(name: str) -> None:
    """Be a client of a service that takes no answers."""
    rclpy.init()
    node = rclpy.create_node("soak_stopped")
    client = node.create_client(WrenchesToTwists, name)
    client.wait_for_service()
    print("ready", flush=True)
    time.sleep(3600.0)


if __name__ == "__main__":
    _wait_to_be_stopped(sys.argv[1])
