# SPDX-License-Identifier: Apache-2.0
"""The hard cases of bench_soak.py: long batches, many clients, a stopped client, moving frames.

Each returns a row of its table and whether its goal was met.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import soak_load
from node_processes import process, resident

if TYPE_CHECKING:
    from concurrent.futures import ProcessPoolExecutor

FOLDER = Path(__file__).parent
MOVING = [sys.executable, str(FOLDER / "moving_node.py")]
# Answers to another client while one is stopped, and rows of each.
STOPPED = ((400, 10_000), (60, 100_000))
# What a stopped client may cost [MB].
STOPPED_GOAL = 50.0


def quantile(times: list[float], q: float) -> float:
    """Return a quantile of times [s] in [ms]."""
    return float(np.quantile(np.array(times) * 1e3, q)) if times else float("nan")


def long_batches(pool: ProcessPoolExecutor, prefix: str, seconds: float) -> tuple[str, bool]:
    """1 kHz of wrenches beside batches of a million rows in a closed loop.

    Two batches before it give the process the memory that it keeps: fresh pages cost as much
    again.
    """
    pool.submit(soak_load.batch_calls, prefix, 2, 1_000_000).result()
    batches = pool.submit(soak_load.batches, prefix, seconds + 1.0, 1_000_000)
    stream = pool.submit(soak_load.stream, prefix, seconds, None).result()
    done = batches.result()
    lost = stream.sent - stream.answered
    p50, p99 = quantile(stream.delays, 0.5), quantile(stream.delays, 0.99)
    row = (
        f"| 1 kHz beside batches of 1e6 rows | {len(done.times)} batches of "
        f"{quantile(done.times, 0.5):.0f} ms; {lost} of {stream.sent} wrenches lost; path p50 / "
        f"p99 {p50:.2f} / {p99:.2f} ms | 0 lost, p99 < 20 ms |"
    )
    return row, not lost and p99 < 20.0


def many_clients(pool: ProcessPoolExecutor, prefix: str, seconds: float) -> tuple[str, bool]:
    """64 clients in closed loops."""
    calls = pool.submit(soak_load.call, prefix, seconds, 0.0, 64, None).result()
    row = (
        f"| 64 clients | {len(calls.times)} calls, {calls.lost} lost, p50 / p99 "
        f"{quantile(calls.times, 0.5):.1f} / {quantile(calls.times, 0.99):.1f} ms | 0 lost |"
    )
    return row, not calls.lost


def stopped_client(
    pool: ProcessPoolExecutor, prefix: str, node: subprocess.Popen[bytes], calls: int, rows: int
) -> tuple[str, bool]:
    """A client that is stopped while another asks for large answers."""
    name = f"{prefix}/wrenches_to_twists"
    pool.submit(soak_load.batch_calls, prefix, 50, rows).result()
    stopped = subprocess.Popen(
        [sys.executable, str(FOLDER / "soak_load.py"), name], stdout=subprocess.PIPE
    )
    try:
        assert stopped.stdout is not None
        stopped.stdout.readline()
        time.sleep(1.0)
        before = resident(node.pid)
        os.kill(stopped.pid, signal.SIGSTOP)
        done = pool.submit(soak_load.batch_calls, prefix, calls, rows).result()
        grown = (resident(node.pid) - before) / 1e3
    finally:
        stopped.kill()
        stopped.wait()
    row = (
        f"| a stopped client, {len(done.times)} answers of {rows} rows to another "
        f"| {grown:+.1f} MB, {done.lost} lost | <= {STOPPED_GOAL:g} MB, 0 lost |"
    )
    return row, grown <= STOPPED_GOAL and not done.lost


def moving_frame(pool: ProcessPoolExecutor, seconds: float) -> tuple[str, bool]:
    """200 Hz of wrenches stamped now in a frame whose transforms come at 30 Hz."""
    with process(MOVING):
        seen, why = pool.submit(soak_load.moving_stream, "/moving", seconds).result()
    late = quantile(seen.delays, 1.0)
    row = (
        f"| 200 Hz in a frame known at 30 Hz | {seen.answered} of {seen.sent} answered, "
        f"delay p50 / most {quantile(seen.delays, 0.5):.1f} / {late:.1f} ms{why} "
        "| all, at most 33 ms and a call |"
    )
    return row, seen.answered == seen.sent
