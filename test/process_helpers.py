# SPDX-License-Identifier: Apache-2.0
"""Programs in process groups of their own, none of which outlives its test."""

import contextlib
import functools
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

REPOSITORY = Path(__file__).parents[1]
# How long a test waits for what must come, on the busiest machine [s].
WAIT = 300.0
_STARTED: list[subprocess.Popen] = []
_CLAIMS: list[socket.socket] = []


@functools.cache
def own_domain(use: str) -> dict[str, str]:
    """Return variables of a ROS domain that nothing else on this machine has, one for each `use`.

    Claimed as `scripts/with_ros --isolated` does, for as long as this process lives: its programs
    must not be heard either.
    """
    claim = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    for offset in range(101):
        # Anywhere: what ended a moment ago may still be heard in its domain.
        domain = 1 + (os.getpid() + offset) % 101
        try:
            claim.bind(f"\0limit_surface_ros/domain/{domain}")
        except OSError:
            continue
        _CLAIMS.append(claim)
        return {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    raise RuntimeError(f"all ROS domains are taken by other runs; none is left for {use}")


def until(condition, what: str, seconds: float = WAIT):
    """Wait for a condition; return what it gives."""
    end = time.monotonic() + seconds
    while not (value := condition()):
        assert time.monotonic() < end, f"not within {seconds} s: {what}"
        time.sleep(0.02)
    return value


def started(module: str, *arguments: object, **options) -> subprocess.Popen:
    """Start a module; see `started_python`."""
    return started_python("-m", module, *arguments, **options)


def started_python(*arguments: object, **options) -> subprocess.Popen:
    """Start Python with arguments, as the leader of a process group of its own."""
    paths = [str(REPOSITORY), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))}
    process = subprocess.Popen(
        [sys.executable, *map(str, arguments)],
        env=environment,
        start_new_session=True,
        text=True,
        **options,
    )
    _STARTED.append(process)
    return process


def end_all() -> None:
    """Kill what is left of the groups of all that was started: tests that fail leave some."""
    while _STARTED:
        process = _STARTED.pop()
        if not group_is_gone(process.pid):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def group_is_gone(group: int) -> bool:
    """Tell whether no process of a group is left."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return True
    return False


def processes_of_group(group: int) -> list[int]:
    """Return the processes of a group."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        # One may end while it is looked at.
        with contextlib.suppress(ProcessLookupError):
            if os.getpgid(int(entry.name)) == group:
                found.append(int(entry.name))
    return found
