# SPDX-License-Identifier: Apache-2.0
"""The slowest of many small batches in a row, each kind of model, through the node's services.

Usage: python benchmarks/bench_steady.py [CALLS]

No call may pay for what was asked before, nor for the tables that a thread makes after a reload.
What the machine does on its own comes in one run and not in the next: where the goal is missed,
the least of three runs counts.
"""

from __future__ import annotations

import sys
import threading
from typing import TYPE_CHECKING, Any

import numpy as np
from bench_maps import kinds
from bench_services import ROWS, folder_of_kinds, map_calls, serving
from limit_surface_interfaces.srv import TwistsToWrenches, WrenchesToTwists
from node_processes import BARE, isolate, process, timed
from std_srvs.srv import Trigger

from limit_surface_ros.nodes.clients.service_client import ServiceClient

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats

# Calls in a row, and the rows of each.
CALLS, FEW = 20_000, 10
# Part of them after a reload: preparing the models takes a few seconds.
AFTER = 0.25
RUNS = 3
# Until a reload is answered that prepares eight models [s].
LONG = 120.0
TYPES = {"wrenches_to_twists": WrenchesToTwists, "twists_to_wrenches": TwistsToWrenches}


def goal(middle: float) -> float:
    """Return how long the slowest call may take [s], from the median."""
    return 5.0 * middle + 5e-3


def steady(client: ServiceClient, node: str, calls: int, request: Any, *, again: bool) -> Floats:
    """Return times [s] of calls in a row; of the run with the least slowest one, if it is slow.

    Args:
        client: Calls.
        node: Whose service is called.
        calls: How many.
        request: What is asked.
        again: Whether the models are read anew just before.
    """
    runs = []
    for _ in range(RUNS):
        if again:
            reload(client, node)
        kind = type_of(request)
        name = next(name for name, each in TYPES.items() if each is kind)
        runs.append([timed(client.call, kind, f"{node}/{name}", request) for _ in range(calls)])
        if max(runs[-1]) <= goal(float(np.median(runs[-1]))):
            break
    return np.array(min(runs, key=max))


def reload(client: ServiceClient, node: str) -> None:
    """Have the models read anew: one request, where the client would soon ask again."""
    service = client.node.create_client(Trigger, f"{node}/reload")
    if not service.wait_for_service(timeout_sec=client.patience):
        raise TimeoutError(f"there is no {node}/reload")
    answered = threading.Event()
    service.call_async(Trigger.Request()).add_done_callback(lambda _: answered.set())
    if not answered.wait(LONG):
        raise TimeoutError(f"{node}/reload did not answer within {LONG:g} s")
    client.node.destroy_client(service)


def type_of(request: Any) -> Any:
    """Return the service that a request is for."""
    return next(each for each in TYPES.values() if isinstance(request, each.Request))


def small(request: Any) -> Any:
    """Return a batch's request with its first few rows."""
    field = "wrenches" if type_of(request) is WrenchesToTwists else "twists"
    setattr(request, field, getattr(request, field)[: 3 * FEW])
    return request


def main(calls: int) -> None:
    """Measure and print."""
    isolate()
    surfaces: dict[str, Any] = kinds()
    with (
        folder_of_kinds() as (folder, names),
        process(serving("kinds", folder)),
        process(BARE),
        ServiceClient("bench", patience=60.0) as client,
    ):
        print(f"### The slowest of {calls} calls of {FEW} rows in a row\n")
        print(
            "The map of each kind that has to search. Goal: at most 5 times the median and 5 ms."
        )
        print(f"After a reload {int(calls * AFTER)} calls.\n")
        print(
            "| kind | service | median [ms] | slowest [ms] | slowest just after `~/reload` [ms] |"
        )
        print("|---|---|---|---|---|")
        for kind, name in names.items():
            batches = [call for call in map_calls("/kinds", name, 1, 1) if call.rows == ROWS]
            call = batches[0 if surfaces[kind].wrench_is_closed else 1]
            request = small(call.request)
            cells = []
            for again in (False, True):
                count = int(calls * AFTER) if again else calls
                times = steady(client, "/kinds", count, request, again=again)
                middle, worst = float(np.median(times)), float(times.max())
                missed = "" if worst <= goal(middle) else " missed"
                cells.append((middle, f"{1e3 * worst:.1f}{missed}"))
            told = " | ".join(cell for _, cell in cells)
            print(f"| {kind} | `{call.service}` | {1e3 * cells[0][0]:.3f} | {told} |", flush=True)
        times = steady(client, "/bare", calls, request, again=False)
        print(
            f"| empty handler | `{call.service}` | {1e3 * np.median(times):.3f} "
            f"| {1e3 * times.max():.1f} | |"
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else CALLS)
