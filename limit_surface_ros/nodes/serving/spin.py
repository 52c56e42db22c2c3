# SPDX-License-Identifier: Apache-2.0
"""Run nodes until SIGINT or SIGTERM, and end with exit code 0, no traceback and no reply lost.

The signals only wake a thread that asks the executor to end between two callbacks: none is cut in
the middle, as rclpy's own handlers would do. What is being answered is answered; then the nodes
end.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import os
import re
import signal
import socket
import sys
import threading
import time
import traceback
from typing import TYPE_CHECKING, Any

import numpy as np
import rclpy
import rclpy.logging
from rclpy.exceptions import ParameterException
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from rclpy.utilities import remove_ros_args

from limit_surface_ros.checks import check_utf_8
from limit_surface_ros.errors import FileError, LimitSurfaceError, RangeError
from limit_surface_ros.nodes.serving import middleware
from limit_surface_ros.nodes.serving.settings import Setting, help_of
from limit_surface_ros.runtime import keep_large_pieces, mend_standard_streams, on_ending

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from limit_surface_ros.nodes.serving.endpoints import Endpoints

# What a user gets wrong at start is told in one line, without a traceback. rcl's errors, unknown
# ROS arguments among them, are RuntimeErrors.
_CONFIGURATION_ERRORS = (LimitSurfaceError, ParameterException, RuntimeError)
_EPILOG = """\
Parameters, remappings and the namespace are given as ROS arguments:
  --ros-args -p NAME:=VALUE --params-file FILE -r FROM:=TO -r __ns:=/NAMESPACE
such as
  --ros-args -p "model_files:=['/path/to/model.yaml']" -p normal_force:=5.0

docs/tutorials/first_hour.md shows the nodes at work; README.md has tables of services, topics and
types."""
_ADDRESSED = (
    "parameters go to all nodes of the process; -p NODE:NAME:=VALUE, such as "
    '-p "limit_surface:model_files:=[...]", and parameter files address one'
)
_IN_A_NAMESPACE = (
    "-p {node}:NAME:=VALUE reaches no node in a namespace, and ROS 2 takes no namespace there: "
    "give {name} in a parameter file, under /**/{node}: ros__parameters:"
)
# What names the folder of the log, for rcl.
_HOMES = ("ROS_LOG_DIR", "ROS_HOME", "HOME")
# Requests may be on their way: so long after the last one [s], and no longer in all, a node that
# ends refuses what comes, and one of those that wait at a time. On a busy machine the time may
# pass before it has looked so many times.
QUIET, LONGEST_END, PACE, QUIET_TURNS = 0.2, 5.0, 0.02, 10
# What has begun is finished, unless it takes so long [s] or a second signal comes; then it is
# refused.
LONGEST_ANSWER = 60.0
# Threads that prepare models give way to the node this often [s].
SWITCH_INTERVAL = 5e-4
# The middleware is still sending an answer when the call is over, a large one in many pieces; it
# is lost if the node is gone before [s].
TIME_TO_SEND, TIME_TO_SEND_MUCH = 0.3, 3.0
_LONG = 3600.0
EXECUTOR = Setting(
    "executor",
    "single_threaded",
    "Executor of the process, the same for all its nodes; `events` needs less of the processor "
    "and is experimental in rclpy",
    choices=("single_threaded", "events"),
    read_only=True,
)


def run(
    make_nodes: Callable[[], Sequence[Any]],
    tables: Mapping[str, Iterable[Setting]],
    description: str,
    argv: Sequence[str],
) -> int:
    """Run the nodes of one process until they are told to end.

    Args:
        make_nodes: Makes the nodes; called with ROS initialised. Errors end the process with a
            line in the log.
        tables: Each node's parameters by its name, for `--help`.
        description: What the program is, for `--help`.
        argv: The command line, the program's name first.

    Returns:
        The process's exit code: 0 after SIGINT, SIGTERM or SIGHUP, 1 if the nodes could not
        start, be it because they ask for different executors.
    """
    mend_standard_streams()
    sys.setswitchinterval(SWITCH_INTERVAL)
    keep_large_pieces()
    # Numbers near the ends of their range overflow; what leaves a node is looked at instead.
    np.seterr(all="ignore")
    # Whichever thread the kernel picks (OpenBLAS has some of its own), Python writes to this end.
    woken, wakes = socket.socketpair()
    wakes.setblocking(False)
    signal.set_wakeup_fd(wakes.fileno())
    on_ending(lambda *_: None)
    try:
        return _run(make_nodes, tables, description, argv, woken, wakes)
    finally:
        # Python would end by a signal that comes while it ends itself, and has nobody to wake.
        on_ending(signal.SIG_IGN)
        signal.set_wakeup_fd(-1)


def _run(
    make_nodes: Callable[[], Sequence[Any]],
    tables: Mapping[str, Iterable[Setting]],
    description: str,
    argv: Sequence[str],
    woken: socket.socket,
    wakes: socket.socket,
) -> int:
    """Do what `run` does, with signals that are read from `woken` and come from `wakes`."""
    parser = argparse.ArgumentParser(
        description=description,
        epilog="\n\n".join([_EPILOG, *(help_of(name, table) for name, table in tables.items())]),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    try:
        check_utf_8(argv)
        _, unknown = parser.parse_known_args(remove_ros_args(list(argv))[1:])
        if unknown:
            parser.error(
                f"{unknown[0]!r} is not accepted here; files of models are given as a parameter: "
                f"--ros-args -p \"model_files:=['{unknown[0]}']\""
            )
        logs = "--disable-external-lib-logs" not in argv
        if logs and not any(os.environ.get(name) for name in _HOMES):
            raise FileError(f"ROS 2 finds no place for its log: set one of {', '.join(_HOMES)}")
        _refuse_what_reaches_no_node(argv, tables)
        rclpy.init(args=list(argv), signal_handler_options=SignalHandlerOptions.NO)
        with middleware.settings():
            nodes = make_nodes()
        executor = _executor(nodes)
    except _CONFIGURATION_ERRORS as error:
        sentence = f"cannot start: {error}"
        if isinstance(error, FileError) and len(tables) > 1:
            sentence += f" ({_ADDRESSED})"
        rclpy.logging.get_logger("limit_surface_ros").fatal(sentence)
        rclpy.try_shutdown()
        return 1
    for node in nodes:
        executor.add_node(node)
    _spin_until_woken(executor, woken, wakes)
    endpoints = [node.endpoints for node in nodes]
    _answer_what_waits(executor, endpoints, woken)
    much = max(each.last_large for each in endpoints) + TIME_TO_SEND_MUCH - time.monotonic()
    time.sleep(max(TIME_TO_SEND, much))
    executor.shutdown()
    for node in nodes:
        node.destroy_node()
    rclpy.try_shutdown()
    return 0


def _refuse_what_reaches_no_node(argv: Sequence[str], names: Iterable[str]) -> None:
    """Refuse parameters for one node that rcl drops without a word.

    Raises:
        RangeError: A node is in a namespace, which such a rule cannot name.
    """
    if not any(re.search(r"(^|:)__ns:=/.", each) for each in argv):
        return
    for option, given in itertools.pairwise(argv):
        rule = re.match(r"([^:]+):([^:=]+):=", given)
        # Names of topics are remapped by -r for one node, whatever its namespace is.
        if option in ("-p", "--param") and rule and rule[1] in names:
            raise RangeError(_IN_A_NAMESPACE.format(node=rule[1], name=rule[2]))


def _executor(nodes: Sequence[Any]) -> Executor:
    """Make the executor that the nodes ask for.

    Raises:
        RangeError: They ask for different ones.
    """
    asked = [str(node.get_parameter(EXECUTOR.name).value) for node in nodes]
    if len(set(asked)) > 1:
        given = ", ".join(
            f"{value} for {node.get_name()}" for node, value in zip(nodes, asked, strict=True)
        )
        raise RangeError(
            f"{EXECUTOR.name} is {given}; the nodes of a process share one: give all of them the "
            f"same, such as by -p {EXECUTOR.name}:=events"
        )
    if asked[0] == "events":
        try:
            from rclpy.experimental import EventsExecutor
        except ImportError:
            nodes[0].get_logger().warning(
                "this rclpy has no EventsExecutor; single_threaded is used"
            )
        else:
            return EventsExecutor()
    return SingleThreadedExecutor()


def _answer_what_waits(
    executor: Executor, endpoints: Sequence[Endpoints], woken: socket.socket
) -> None:
    """Finish answers that have begun, and refuse what has come or still comes."""
    for each in endpoints:
        each.end()
    woken.setblocking(False)
    start = refused = time.monotonic()
    cut = False
    turns, latest = 0, start
    while True:
        now = time.monotonic()
        if now - refused > PACE:
            refused = now
            for each in endpoints:
                each.refuse_next()
        under_way = any(each.under_way for each in endpoints)
        last = max(start, *(each.last_request for each in endpoints))
        turns, latest = (0 if under_way or last > latest else turns + 1), last
        quiet = now - last > QUIET and turns > QUIET_TURNS
        if not under_way and (quiet or now - start > LONGEST_END):
            break
        if not cut and (now - start > LONGEST_ANSWER or _again(woken)):
            cut, start = True, now
            for each in endpoints:
                each.cut()
        elif cut and now - start > LONGEST_END:
            break
        _spin_guarded(executor, PACE)


def _again(woken: socket.socket) -> bool:
    """Return whether another signal has come."""
    with contextlib.suppress(BlockingIOError):
        return any(woken.recv(64))
    return False


def _spin_until_woken(executor: Executor, woken: socket.socket, wakes: socket.socket) -> None:
    ended: Any = Future()

    def wait() -> None:
        woken.recv(1)
        # As a task it is run between callbacks, and wakes an executor that waits.
        executor.create_task(ended.set_result, None)

    waiter = threading.Thread(target=wait, daemon=True)
    waiter.start()
    while rclpy.ok() and not ended.done():
        _spin_guarded(executor, None, ended)
    # If the context was shut down from elsewhere, the thread still waits.
    wakes.send(b"\0")
    waiter.join()


def _spin_guarded(executor: Executor, timeout: float | None, until: Any = None) -> None:
    """Let the executor do something; what rclpy itself raises must not end a node.

    It cannot convert some messages, such as texts that are not UTF-8.
    """
    try:
        if isinstance(executor, SingleThreadedExecutor):
            # Its spin_until_future_complete would leave a callback behind at each turn.
            executor.spin_once(timeout)
        else:
            # Without a timeout the EventsExecutor of rclpy 7.1.6 turns hot and deaf.
            executor.spin_until_future_complete(
                Future() if until is None else until,
                timeout_sec=_LONG if timeout is None else timeout,
            )
    except Exception:
        rclpy.logging.get_logger("limit_surface_ros").error(
            f"while spinning: {traceback.format_exc()}", throttle_duration_sec=5.0
        )
