# SPDX-License-Identifier: Apache-2.0
"""The limit_surface node under load for half a minute: nothing lost, nothing wrong, nothing grows.

Usage: python benchmarks/bench_soak.py [SECONDS]

1 kHz of wrenches of which 1 % are bad, four clients whose answers are checked against the
library, and a reload each second. Then the topic path under two loads and with both executors,
beside a node with empty handlers: what is late there, too, is not late because of ours. Then the
hard cases of soak_hard.py; with `hard` in place of SECONDS these alone. The exit code is 1 if an
answer was lost or wrong, or a goal of a hard case missed.
"""

from __future__ import annotations

import contextlib
import functools
import multiprocessing
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from typing import TYPE_CHECKING

import numpy as np
import soak_hard
import soak_load
from ament_index_python.packages import get_package_share_directory
from node_processes import BARE, OURS, isolate, process, processor_seconds, resident

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Sequence

SECONDS = 30.0
# Models that are read again leave room in the heap, which levels off after some twenty times.
WARM_UP = 40.0
# Of each row of the second table.
ROW_SECONDS = 4.0
CLIENTS = 4
MODEL = "triangle_patch"
# Time from one call of a client to the next [s]; 0: as soon as it was answered.
LOADS = {"4 clients in closed loops": 0.0, "4 clients at 50 calls/s each": 0.02}


class Load:
    """Processes that load a node.

    Attributes:
        pool: The processes.

    Args:
        model_file: What our node answers by.
    """

    def __init__(self, model_file: str) -> None:
        """Start them."""
        self.pool = ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn"))
        self._model_file = model_file

    def run(
        self, prefix: str, node: subprocess.Popen[bytes], period: float, seconds: float
    ) -> tuple[soak_load.Stream, soak_load.Calls, float, tuple[int, int]]:
        """Load a node.

        Returns:
            What became of wrenches and calls, the share of a core that the node used, and its
            resident memory [kB] after warming up and at the end.
        """
        ours = prefix != "/bare"
        calls = self.pool.submit(
            soak_load.call, prefix, seconds, period, CLIENTS, self._model_file if ours else None
        )
        stream = self.pool.submit(
            soak_load.stream, prefix, seconds, self._model_file if ours else None
        )
        warm_up = WARM_UP if seconds > WARM_UP else seconds / 4
        time.sleep(warm_up)
        start, used, before = time.perf_counter(), processor_seconds(node.pid), resident(node.pid)
        seen = stream.result()
        share = (processor_seconds(node.pid) - used) / (time.perf_counter() - start)
        memory = before, resident(node.pid)
        # What is first sent meets a node that is still being discovered.
        seen.delays = seen.delays[int(len(seen.delays) * warm_up / seconds) :]
        return seen, calls.result(), share, memory


def milliseconds(times: Sequence[float]) -> str:
    """Return p50 / p99 of times [s] in [ms]."""
    p50, p99 = np.quantile(np.array(times) * 1e3, [0.5, 0.99])
    return f"{p50:.2f} / {p99:.2f}"


def soak(load: Load, prefix: str, node: subprocess.Popen[bytes], seconds: float) -> bool:
    """Print the long soak; return whether every answer came and was right."""
    stream, calls, _, (before, after) = load.run(prefix, node, 0.0, WARM_UP + seconds)
    alive = node.poll() is None
    print(f"### {seconds:g} s after {WARM_UP:g} s of warming up, clients in closed loops\n")
    print("| what | seen | goal |")
    print("|---|---|---|")
    print(f"| service calls answered | {len(calls.times)} | |")
    print(f"| answers lost | {calls.lost} | 0 |")
    print(f"| answers that differ from the library | {calls.wrong} | 0 |")
    print(f"| reloads | {calls.reloads} | |")
    print(f"| good wrenches sent / answered | {stream.sent} / {stream.answered} | |")
    print(f"| bad wrenches sent / answered | {stream.bad} / {stream.unasked} | 0 answered |")
    print(f"| twists on the topic that differ from the library | {stream.wrong} | 0 |")
    print(f"| topic path p50 / p99 [ms] | {milliseconds(stream.delays)} | p99 < 5 |")
    print(f"| resident memory [MB] | {before / 1e3:.1f} -> {after / 1e3:.1f} ", end="")
    print(f"({(after / before - 1) * 100:+.2f} %) | < 1 % |")
    return alive and not (calls.lost or calls.wrong or stream.wrong or stream.unasked)


def main() -> int:
    """Load the nodes and print what became of it."""
    only_hard = sys.argv[1:] == ["hard"]
    seconds = float(sys.argv[1]) if sys.argv[1:] and not only_hard else SECONDS
    isolate()
    share = get_package_share_directory("limit_surface_ros")
    load = Load(f"{share}/config/models/{MODEL}.yaml")
    ours = [*OURS, "--ros-args", "-p", f"default_model:={MODEL}"]
    events = [*ours, "-r", "__node:=with_events", "-p", "executor:=events"]
    commands = {
        "ours": ("/limit_surface", ours),
        "ours, `executor: events`": ("/with_events", events),
        "empty handlers": ("/bare", BARE),
    }
    if only_hard:
        with process(ours) as node:
            return 0 if hard_cases(load, "/limit_surface", node) else 1
    with contextlib.ExitStack() as stack:
        nodes = {
            name: (prefix, stack.enter_context(process(command)))
            for name, (prefix, command) in commands.items()
        }
        right = soak(load, *nodes["ours"], seconds)
        print("\n### Topic path beside a node with empty handlers\n")
        print("| load | node | calls/s | wrenches answered | topic path p50 / p99 [ms] ", end="")
        print("| call p50 / p99 [ms] | share of a core |")
        print("|---|---|---|---|---|---|---|")
        for name, period in LOADS.items():
            for node, (prefix, running) in nodes.items():
                stream, calls, used, _ = load.run(prefix, running, period, ROW_SECONDS)
                right = right and not (calls.lost or calls.wrong or stream.wrong)
                print(f"| {name} | {node} | {len(calls.times) / ROW_SECONDS:.0f} ", end="")
                print(f"| {stream.answered / stream.sent:.1%} ", end="")
                print(f"| {milliseconds(stream.delays)} | {milliseconds(calls.times)} ", end="")
                print(f"| {used:.2f} |")
        right = hard_cases(load, *nodes["ours"]) and right
    return 0 if right else 1


def hard_cases(load: Load, prefix: str, node: subprocess.Popen[bytes]) -> bool:
    """Print the table of hard cases; return whether each goal was met."""
    print("\n### Hard cases\n\n| case | seen | goal |\n|---|---|---|", flush=True)
    met = True
    for case in (
        lambda: soak_hard.long_batches(load.pool, prefix, 2.0 * ROW_SECONDS),
        lambda: soak_hard.many_clients(load.pool, prefix, ROW_SECONDS),
        *(
            functools.partial(soak_hard.stopped_client, load.pool, prefix, node, *each)
            for each in soak_hard.STOPPED
        ),
        lambda: soak_hard.moving_frame(load.pool, ROW_SECONDS),
    ):
        row, good = case()
        print(row, flush=True)
        met = met and good
    return met


if __name__ == "__main__":
    sys.exit(main())
