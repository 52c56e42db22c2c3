# SPDX-License-Identifier: Apache-2.0
"""Services and topics of both nodes against a node with empty handlers of the same types.

Usage: python benchmarks/bench_services.py

The nodes run in processes of their own, with the default executor; the calls alternate between
them. Also measured: each kind of model, and each under another weight; 1, 4 and 16 clients, the
topic path, and processor time. The lists are of unequal length: an empty handler lists nothing.
"""

from __future__ import annotations

import contextlib
import tempfile
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from bench_maps import kinds
from geometry_msgs.msg import TwistStamped, WrenchStamped
from limit_surface_interfaces.srv import (
    EvaluateDecay,
    ListDecays,
    ListModels,
    PredictStop,
    Push,
    TimeToLevel,
    TwistsToWrenches,
    TwistToWrench,
    WrenchesToTwists,
    WrenchToTwist,
)
from node_processes import (
    BARE,
    OURS,
    OURS_DECAY,
    isolate,
    process,
    processor_seconds,
    timed,
    wrench_message,
)
from rclpy.qos import QoSProfile

from limit_surface_ros.files.surface_file import SurfaceModel, write_surface_model
from limit_surface_ros.nodes.clients.service_client import ServiceClient
from limit_surface_ros.nodes.messages import convert

if TYPE_CHECKING:
    from collections.abc import Iterator

SINGLE_CALLS = 1500
BATCH_CALLS = 100
KIND_CALLS = 300
KIND_BATCHES = 30
ROWS = 10_000
MESSAGES = 4000
WINDOW = 5
KINDS = {
    kind.Request: kind
    for kind in (
        EvaluateDecay,
        ListDecays,
        ListModels,
        PredictStop,
        Push,
        TimeToLevel,
        TwistsToWrenches,
        TwistToWrench,
        WrenchesToTwists,
        WrenchToTwist,
    )
}
SINGLE_GOAL = 1.15
BATCH_GOAL = 2.5
WEIGHT_GOAL = 1.2
# What presses the bodies of the models [N], and what a parameter or a wrench says of it.
NORMAL_FORCE, OTHER_FORCE = 2.0, 3.0
NODES = {"ours": "/limit_surface", "empty": "/bare"}


def quantiles(times: list[float]) -> tuple[float, float]:
    """Return p50 and p99 in [ms]."""
    p50, p99 = np.quantile(np.array(times) * 1e3, [0.5, 0.99])
    return float(p50), float(p99)


def map_calls(node: str, model: str, one: int, many: int) -> list[Call]:
    """Return calls of the services that map, `one` of each and `many` of each batch."""
    flat = convert.flat_of(np.random.default_rng(0).normal(size=(ROWS, 3)))
    wrench = wrench_message([2.0, 1.0, 0.05])
    twist = TwistStamped()
    twist.header.frame_id = "object"
    twist.twist.linear.x, twist.twist.angular.z = 0.1, 1.0
    push = Push.Request(friction=0.3, model=model)
    push.header.frame_id = "object"
    push.contact.x, push.normal.x, push.velocity.x, push.velocity.y = -0.04, 1.0, 0.1, 0.02
    single = {
        "wrench_to_twist": WrenchToTwist.Request(model=model, wrench=wrench),
        "twist_to_wrench": TwistToWrench.Request(model=model, twist=twist),
        "push": push,
    }
    batch = {
        "wrenches_to_twists": WrenchesToTwists.Request(model=model, wrenches=flat),
        "twists_to_wrenches": TwistsToWrenches.Request(model=model, twists=flat),
    }
    return [
        *(Call(node, name, asked, 1, one, SINGLE_GOAL) for name, asked in single.items()),
        *(Call(node, name, asked, ROWS, many, BATCH_GOAL) for name, asked in batch.items()),
    ]


def calls() -> list[Call]:
    """Return one call of each service."""
    times = convert.flat_of(np.linspace(0.0, 5.0, ROWS))
    wrench = wrench_message([2.0, 1.0, 0.05])
    one, many = SINGLE_CALLS, BATCH_CALLS
    surface, decay = "/limit_surface", "/decay"
    return [
        *map_calls(surface, "", one, many),
        Call(surface, "list_models", ListModels.Request(), 0, one // 4, None),
        Call(decay, "time_to_level", TimeToLevel.Request(level=0.1), 1, one, SINGLE_GOAL),
        Call(decay, "predict_stop", PredictStop.Request(wrench=wrench), 1, one // 4, None),
        Call(decay, "evaluate", EvaluateDecay.Request(times=times), ROWS, many, BATCH_GOAL),
        Call(decay, "list_models", ListDecays.Request(), 0, one // 4, None),
    ]


class Call(NamedTuple):
    """A call of a service.

    Attributes:
        node: Of ours, whose service it is.
        service: Name of the service.
        request: What is asked.
        rows: How many vectors or times go through.
        repeats: How often it is called.
        goal: Ratio to the empty handler that ours may reach; None if there is no goal.
    """

    node: str
    service: str
    request: Any
    rows: int
    repeats: int
    goal: float | None

    def times(self, client: ServiceClient) -> tuple[list[float], list[float]]:
        """Return times [s] of ours and of the empty handler, called in turns."""
        bare = "list_decays" if KINDS[type(self.request)] is ListDecays else self.service
        return self.times_beside(client, f"/bare/{bare}")

    def times_beside(self, client: ServiceClient, other: str) -> tuple[list[float], list[float]]:
        """Return times [s] of ours and of another service of its type, called in turns."""
        kind = KINDS[type(self.request)]
        names = f"{self.node}/{self.service}", other
        found: tuple[list[float], list[float]] = [], []
        for turn in range(20 + self.repeats):
            for name, elapsed in zip(names, found, strict=True):
                seconds = timed(client.call, kind, name, self.request)
                if turn >= 20:
                    elapsed.append(seconds)
        return found


def service_rows(client: ServiceClient) -> None:
    """Print round trips of each service."""
    print("### Round trip between two processes\n")
    print(
        "| node | service | rows | ours p50 / p99 [ms] | empty handler p50 / p99 [ms] "
        "| ratio of p50 | goal |"
    )
    print("|---|---|---|---|---|---|---|")
    for call in calls():
        times = call.times(client)
        ours, empty = map(quantiles, times)
        print(
            f"| {call.node[1:]} | `{call.service}` | {call.rows or ''} "
            f"| {ours[0]:.3f} / {ours[1]:.3f} | {empty[0]:.3f} / {empty[1]:.3f} "
            f"| {ours[0] / empty[0]:.2f} | {call.goal or ''} |",
            flush=True,
        )


@contextlib.contextmanager
def folder_of_kinds() -> Iterator[tuple[str, dict[str, str]]]:
    """Write a model of each kind; yield their folder, and their names by kind."""
    with tempfile.TemporaryDirectory() as folder:
        names = {}
        for index, (kind, surface) in enumerate(kinds().items()):
            names[kind] = f"model_{index}"
            model = SurfaceModel(f"model_{index}", surface, normal_force=NORMAL_FORCE)
            write_surface_model(model, Path(folder) / f"model_{index}.yaml")
        yield folder, names


def serving(node: str, folder: str, *parameters: str) -> list[str]:
    """Return the command of a node that serves the models of a folder."""
    told = [f"model_files:=['{folder}']", *parameters]
    return [*OURS, "--ros-args", "-r", f"__node:={node}", *(x for p in told for x in ("-p", p))]


def kind_rows(client: ServiceClient) -> None:
    """Print round trips on a model of each kind."""
    print("\n### Each kind of model: p50 over that of an empty handler (p50 [ms])\n")
    with folder_of_kinds() as (folder, names), process(serving("kinds", folder)):
        for row, (kind, name) in enumerate(names.items()):
            asked = map_calls("/kinds", name, KIND_CALLS, KIND_BATCHES)
            if row == 0:
                print("| kind |", " | ".join(f"`{call.service}`" for call in asked), "|")
                print("|---" * (len(asked) + 1) + "|")
            cells = []
            for call in asked:
                ours, empty = map(quantiles, call.times(client))
                cells.append(f"{ours[0] / empty[0]:.2f} ({ours[0]:.2f})")
            print(f"| {kind} | {' | '.join(cells)} |", flush=True)


def weight_rows(client: ServiceClient) -> None:
    """Print round trips under another weight, over those of the model as it is."""
    print(f"\n### Each kind under another weight: p50 over the model's own (goal {WEIGHT_GOAL})\n")
    print(
        "By `normal_force_from: parameter`; in brackets by `wrench`, which batches do not know.\n"
    )
    # The wrench presses, which is out of the plane where it does not count: not to be reported.
    quiet = "out_of_plane_tolerance:=1.0e9"
    forces = "normal_force_from:=parameter", f"normal_force:={OTHER_FORCE}"
    with (
        folder_of_kinds() as (folder, names),
        process(serving("kinds", folder, quiet)),
        process(serving("parameter", folder, quiet, *forces)),
        process(serving("wrench", folder, quiet, "normal_force_from:=wrench")),
    ):
        for row, (kind, name) in enumerate(names.items()):
            asked = map_calls("/kinds", name, KIND_CALLS, KIND_BATCHES)
            asked[0].request.wrench.wrench.force.z = -OTHER_FORCE
            if row == 0:
                print("| kind |", " | ".join(f"`{call.service}`" for call in asked), "|")
                print("|---" * (len(asked) + 1) + "|")
            cells = []
            for index, call in enumerate(asked):
                ratios = []
                for source in ("parameter", "wrench")[: 2 if index == 0 else 1]:
                    own, other = call.times_beside(client, f"/{source}/{call.service}")
                    ratios.append(quantiles(other)[0] / quantiles(own)[0])
                told = " ".join(
                    f"{ratio:.2f}" if place == 0 else f"({ratio:.2f})"
                    for place, ratio in enumerate(ratios)
                )
                cells.append(f"{told} missed" if max(ratios) > WEIGHT_GOAL else told)
            print(f"| {kind} | {' | '.join(cells)} |", flush=True)


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
    with (
        process(OURS) as ours,
        process(OURS_DECAY),
        process(BARE) as bare,
        ServiceClient("bench", patience=60.0) as client,
    ):
        service_rows(client)
        kind_rows(client)
        weight_rows(client)
        client_rows(client)
        topic_rows(client, {"ours": ours.pid, "empty": bare.pid})


if __name__ == "__main__":
    main()
