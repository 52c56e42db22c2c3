# SPDX-License-Identifier: Apache-2.0
"""Nodes in processes of their own, and calls of their services, for the benchmarks."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from geometry_msgs.msg import WrenchStamped

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

FOLDER = Path(__file__).parent
OURS = [sys.executable, "-m", "limit_surface_ros.nodes.limit_surface_node"]
OURS_DECAY = [sys.executable, "-m", "limit_surface_ros.nodes.decay_node"]
_claims: list[Any] = []
BARE = [sys.executable, str(FOLDER / "bare_node.py"), "bare"]


def isolate() -> None:
    """Keep this run's nodes among themselves, in a ROS domain that no other run here has."""
    sys.path.insert(0, str(FOLDER.parent / "scripts" / "ros_setup"))
    from environment import isolate_discovery

    # As long as this process lives.
    _claims.append(isolate_discovery(os.environ, FOLDER.parent / "log" / "ros"))


@contextlib.contextmanager
def process(command: Sequence[str]) -> Iterator[subprocess.Popen[bytes]]:
    """Run a node's process, and end it."""
    running = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    try:
        yield running
    finally:
        running.send_signal(signal.SIGINT)
        running.wait(timeout=10.0)


def processor_seconds(pid: int) -> float:
    """Return the processor time that a process has used [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / float(os.sysconf("SC_CLK_TCK"))


def resident(pid: int) -> int:
    """Return the resident memory of a process [kB]."""
    status = Path(f"/proc/{pid}/status").read_text()
    return int(status.partition("VmRSS:")[2].split()[0])


def wrench_message(wrench: Sequence[float], frame: str = "object") -> WrenchStamped:
    """Return a stamped planar wrench."""
    message = WrenchStamped()
    message.header.frame_id = frame
    message.wrench.force.x, message.wrench.force.y, message.wrench.torque.z = map(float, wrench)
    return message


def timed(call: Any, *arguments: Any) -> float:
    """Return the time that a call takes [s]."""
    start = time.perf_counter()
    answer = call(*arguments)
    elapsed = time.perf_counter() - start
    if answer.error_code:
        raise RuntimeError(answer.error_msg)
    return elapsed
