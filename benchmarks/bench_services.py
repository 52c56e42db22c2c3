"""Services and topics of the limit_surface node against a node with empty handlers.

Usage: python benchmarks/bench_services.py

Both nodes run in processes of their own, with the default executor; the calls alternate between
them. Also measured: 1, 4 and 16 clients, the topic path, and processor time.
"""

from __future__ import annotations

import threading
import time
from typing import Any

import numpy as np
from geometry_msgs.msg import TwistStamped, WrenchStamped
from limit_surface_interfaces.srv import (
    TwistsToWrenches,
    TwistToWrench,
    WrenchesToTwists,
    WrenchToTwist,
)
from node_processes import (
    BARE,
    OURS,
    isolate,
    process,
    processor_seconds,
    timed,
    wrench_message,
)
from rclpy.qos import QoSProfile

from limit_surface_ros.nodes import convert
from limit_surface_ros.nodes.service_client import ServiceClient

SINGLE_CALLS = 2000
BATCH_CALLS = 100
ROWS = 10_000
MESSAGES = 4000
WINDOW = 5
NODES = {"ours": "/limit_surface", "empty": "/bare"}


def quantiles(times: list[float]) -> tuple[float, float]:
    """Return p50 and p99 in [ms]."""
    p50, p99 = np.quantile(np.array(times) * 1e3, [0.5, 0.99])
    return float(p50), float(p99)


def service_rows(client: ServiceClient) -> None:
    """Print round trips of each service, alternating between the nodes."""
    rng = np.random.default_rng(0)
    flat = convert.flat_of(rng.normal(size=(ROWS, 3)))
    single = wrench_message([2.0, 1.0, 0.05])
    twist = TwistStamped()
    twist.header.frame_id = "object"
    twist.twist.linear.x, twist.twist.angular.z = 0.1, 1.0
    work: list[tuple[str, Any, Any, int]] = [
        ("wrench_to_twist", WrenchToTwist, WrenchToTwist.Request(wrench=single), SINGLE_CALLS),
        ("twist_to_wrench", TwistToWrench, TwistToWrench.Request(twist=twist), SINGLE_CALLS),
        ("wrenches_to_twists", WrenchesToTwists, WrenchesToTwists.Request(wrenches=flat), 0),
        ("twists_to_wrenches", TwistsToWrenches, TwistsToWrenches.Request(twists=flat), 0),
    ]
    print("### Round trip between two processes\n")
    print("| service | rows | ours p50 / p99 [ms] | empty handler p50 / p99 [ms] | ratio of p50 |")
    print("|---|---|---|---|---|")
    for name, kind, request, calls in work:
        times: dict[str, list[float]] = {node: [] for node in NODES}
        for turn in range(20 + (calls or BATCH_CALLS)):
            for node, prefix in NODES.items():
                elapsed = timed(client.call, kind, f"{prefix}/{name}", request)
                if turn >= 20:
                    times[node].append(elapsed)
        ours, empty = quantiles(times["ours"]), quantiles(times["empty"])
        print(
            f"| `{name}` | {1 if calls else ROWS} | {ours[0]:.3f} / {ours[1]:.3f} "
            f"| {empty[0]:.3f} / {empty[1]:.3f} | {ours[0] / empty[0]:.2f} |"
        )


def client_rows(client: ServiceClient) -> None:
    """Print what several clients in this process get together, each with one call under way."""
    print("\n### Calls a second of several clients\n")
    print("| clients | ours | empty handler | ratio |")
    print("|---|---|---|---|")
    for count in (1, 4, 16):
        crowds = {node: Crowd(client, prefix, count) for node, prefix in NODES.items()}
        rates: dict[str, list[float]] = {node: [] for node in NODES}
        for _ in range(5):
            for node, crowd in crowds.items():
                rates[node].append(crowd.rate(800))
        for crowd in crowds.values():
            crowd.leave()
        ours, empty = np.median(rates["ours"]), np.median(rates["empty"])
        print(f"| {count} | {ours:.0f} | {empty:.0f} | {ours / empty:.2f} |")


class Crowd:
    """Clients of one service, each of which calls again as soon as it is answered."""

    def __init__(self, client: ServiceClient, prefix: str, count: int) -> None:
        """Make the clients and wait until each was answered once."""
        self._node = client.node
        self._request = WrenchToTwist.Request(wrench=wrench_message([2.0, 1.0, 0.05]))
        name = f"{prefix}/wrench_to_twist"
        # Every client of a service hears all of its answers: with the default depth of 10 those to
        # others push its own out before it is taken.
        deep = QoSProfile(depth=1000)
        self._clients = [
            self._node.create_client(WrenchToTwist, name, qos_profile=deep) for _ in range(count)
        ]
        self._left = 0
        self._counting = threading.Lock()
        self._done = threading.Event()
        for each in self._clients:
            self._greet(each)

    def _greet(self, client: Any) -> None:
        """Call until answered: a server drops answers to clients that it has yet to discover."""
        client.wait_for_service(timeout_sec=10.0)
        for _ in range(10):
            answered = threading.Event()
            future = client.call_async(self._request)
            future.add_done_callback(lambda _, event=answered: event.set())
            if answered.wait(1.0):
                return
            client.remove_pending_request(future)
        raise RuntimeError("a client was never answered")

    def rate(self, calls: int) -> float:
        """Return calls a second."""
        self._left = calls
        self._done.clear()
        start = time.perf_counter()
        for each in self._clients:
            self._ask(each)
        if not self._done.wait(30.0):
            raise RuntimeError("an answer was lost")
        return calls / (time.perf_counter() - start)

    def leave(self) -> None:
        """Remove the clients."""
        for each in self._clients:
            self._node.destroy_client(each)

    def _ask(self, client: Any) -> None:
        client.call_async(self._request).add_done_callback(lambda _: self._answered(client))

    def _answered(self, client: Any) -> None:
        # In the executor's thread, or in the asker's if the answer was faster than it.
        with self._counting:
            self._left -= 1
            left = self._left
        if left >= len(self._clients):
            self._ask(client)
        elif left == 0:
            self._done.set()


def topic_rows(client: ServiceClient, pids: dict[str, int]) -> None:
    """Print the rate at which wrenches become twists, with a few in flight."""
    print("\n### Topic path: wrench in, twist out\n")
    print("| node | messages a second | processor time a message [us] |")
    print("|---|---|---|")
    paths = {node: TopicPath(client, prefix) for node, prefix in NODES.items()}
    rates: dict[str, list[float]] = {node: [] for node in NODES}
    used: dict[str, list[float]] = {node: [] for node in NODES}
    for _ in range(5):
        for node, path in paths.items():
            before = processor_seconds(pids[node])
            rates[node].append(path.rate(MESSAGES))
            used[node].append((processor_seconds(pids[node]) - before) / MESSAGES * 1e6)
    for node in NODES:
        name = "ours" if node == "ours" else "bare relay"
        print(f"| {name} | {np.median(rates[node]):.0f} | {np.median(used[node]):.0f} |")
    ratio = np.median(rates["ours"]) / np.median(rates["empty"])
    print(f"\nRatio of rates: {ratio:.2f}.")


class TopicPath:
    """Publishes wrenches to a node and counts the twists that come back."""

    def __init__(self, client: ServiceClient, prefix: str) -> None:
        """Connect both topics."""
        self._tickets = threading.Semaphore(WINDOW)
        client.node.create_subscription(
            TwistStamped, f"{prefix}/predicted_twist", lambda _: self._tickets.release(), 100
        )
        self._publisher = client.node.create_publisher(WrenchStamped, f"{prefix}/wrench", 100)
        while not self._publisher.get_subscription_count():
            time.sleep(0.01)
        while not client.node.count_publishers(f"{prefix}/predicted_twist"):
            time.sleep(0.01)
        time.sleep(0.5)

    def rate(self, count: int) -> float:
        """Return messages a second, with at most `WINDOW` of them under way."""
        message = wrench_message([2.0, 1.0, 0.05])
        start = time.perf_counter()
        for _ in range(count):
            if not self._tickets.acquire(timeout=5.0):
                raise RuntimeError("a message was lost")
            self._publisher.publish(message)
        for _ in range(WINDOW):
            self._tickets.acquire(timeout=5.0)
        for _ in range(WINDOW):
            self._tickets.release()
        return count / (time.perf_counter() - start)


def main() -> None:
    """Measure and print."""
    isolate()
    with process(OURS) as ours, process(BARE) as bare, ServiceClient("bench") as client:
        service_rows(client)
        client_rows(client)
        topic_rows(client, {"ours": ours.pid, "empty": bare.pid})


if __name__ == "__main__":
    main()
