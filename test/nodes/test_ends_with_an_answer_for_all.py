# SPDX-License-Identifier: Apache-2.0
"""However a node is told to end, all that waits is answered or refused; nothing else ends it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from limit_surface_interfaces.msg import ErrorCode
from limit_surface_interfaces.srv import WrenchesToTwists, WrenchToTwist
from rclpy.qos import QoSProfile

from limit_surface_ros.files.surface_file import SurfaceModel, write_surface_model
from limit_surface_ros.nodes.messages import convert
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.scaling import Scaling
from node_helpers import Program, processor_ticks, wrench_message
from process_helpers import WAIT, group_is_gone, processes_of_group, started_python, until

BATCHES = 20


@pytest.mark.parametrize("executor", ["single_threaded", "events"])
def test_twenty_batches_that_wait_at_a_signal_all_get_an_answer(
    ros, client_node, tmp_path, executor
):
    factors = np.random.default_rng(0).normal(size=(24, 3, 2))
    surface = Dissipation(factors @ factors.transpose(0, 2, 1), Scaling(0.05, 2.0))
    path = tmp_path / "slow.yaml"
    write_surface_model(SurfaceModel(name="slow", surface=surface), path)
    options = "-p", f"model_files:=['{path}']", "-p", f"executor:={executor}"
    with Program("limit_surface_node", "--ros-args", *options) as program:
        client = client_node.create_client(
            WrenchesToTwists,
            "/limit_surface/wrenches_to_twists",
            qos_profile=QoSProfile(depth=2 * BATCHES),
        )
        assert client.wait_for_service(timeout_sec=WAIT)
        one = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
        # A server drops answers to a client that it has yet to discover.
        while not ros.done(client.call_async(WrenchesToTwists.Request()), 2.0):
            pass
        wrenches = np.random.default_rng(1).normal(size=(20_000, 3))
        asked = WrenchesToTwists.Request(wrenches=convert.flat_of(wrenches))
        waiting = [client.call_async(asked) for _ in range(BATCHES)]
        # What is asked after them is answered while they wait: they have all come.
        assert one(WrenchToTwist.Request(wrench=wrench_message([9, 0, 0]))).error_code == 0
        code, output = program.end(signal.SIGINT)
    assert code == 0, output
    for future in waiting:
        assert ros.done(future, WAIT)
    codes = [future.result().error_code for future in waiting]
    assert set(codes) <= {ErrorCode.NONE, ErrorCode.UNAVAILABLE}
    assert ErrorCode.UNAVAILABLE in codes
    assert "Traceback" not in output


def started_with(hang_up, *options):
    """Start the node as a shell does, or as `nohup`: these tests may run under either."""
    before = signal.signal(signal.SIGHUP, hang_up)
    try:
        return Program("limit_surface_node", "--ros-args", *options)
    finally:
        signal.signal(signal.SIGHUP, before)


# A node whose tool's transform never comes, and whose clock, being simulated, stands still.
WAITS = f"""
import sys
sys.path.insert(0, {str(Path(__file__).parents[1])!r})
from transform_helpers import Buffer
from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
from limit_surface_ros.nodes.serving import spin
buffer = Buffer()
buffer.set_transform(1, 0.0)
sys.exit(spin.run(lambda: [LimitSurfaceNode(buffer=buffer)], {{}}, "", sys.argv))
"""


def test_what_waits_for_a_transform_at_a_signal_is_refused_at_once(ros, client_node, model_file):
    options = [f"model_files:=['{model_file()[1]}']", "transform_timeout:=60.0"]
    options += ["use_sim_time:=true"]
    process = started_python(
        "-c",
        WAITS,
        "--ros-args",
        *(part for option in options for part in ("-p", option)),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    client = client_node.create_client(WrenchToTwist, "/limit_surface/wrench_to_twist")
    assert client.wait_for_service(timeout_sec=WAIT)
    known = wrench_message([9, 0, 0])
    while not ros.done(client.call_async(WrenchToTwist.Request(wrench=known)), 2.0):
        pass
    late = WrenchToTwist.Request(wrench=wrench_message([9, 0, 0], frame="tool"))
    waiting = [client.call_async(late) for _ in range(5)]
    # What is asked after them is answered while they wait: they have all come.
    assert ros.done(client.call_async(WrenchToTwist.Request(wrench=known)), WAIT)
    assert not any(future.done() for future in waiting)
    process.send_signal(signal.SIGTERM)
    output, _ = process.communicate(timeout=WAIT)
    assert process.returncode == 0, output
    for future in waiting:
        assert ros.done(future, WAIT)
        assert future.result().error_code == ErrorCode.UNAVAILABLE
        assert "ending" in future.result().error_msg


def test_a_terminal_that_is_closed_ends_the_node_as_sigterm_does(ros, client_node, model_file):
    options = "-p", f"model_files:=['{model_file()[1]}']"
    with started_with(signal.SIG_DFL, *options) as program:
        ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
        code, output = program.end(signal.SIGHUP)
    assert code == 0, output
    assert "Traceback" not in output


def test_a_terminal_that_is_closed_ends_a_node_that_learns_without_a_word(
    ros, client_node, model_file
):
    module = "limit_surface_ros.nodes.limit_surface_node"
    options = "-p", f"model_files:=['{model_file()[1]}']", "-p", "learn:=true"
    reset = "import signal; signal.signal(signal.SIGHUP, signal.SIG_DFL)"
    command = f"{reset}; import sys; from {module} import main; sys.exit(main())"
    process = started_python(
        "-c",
        command,
        "--ros-args",
        *options,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
    # Itself, the process that counts semaphores, and the one that learns.
    until(lambda: len(processes_of_group(process.pid)) == 3, "the process that learns")
    # A terminal tells all of them, and so does a second one that ends the shell.
    os.killpg(process.pid, signal.SIGHUP)
    os.killpg(process.pid, signal.SIGHUP)
    output, _ = process.communicate(timeout=WAIT)
    assert process.returncode == 0, output
    assert "Traceback" not in output
    assert "died" not in output
    until(lambda: group_is_gone(process.pid), "the end of its processes")


def test_under_nohup_a_node_outlives_its_terminal(ros, client_node, model_file):
    options = "-p", f"model_files:=['{model_file()[1]}']"
    with started_with(signal.SIG_IGN, *options) as program:
        call = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
        program.process.send_signal(signal.SIGHUP)
        asked = WrenchToTwist.Request(wrench=wrench_message([9, 0, 0]))
        assert call(asked).error_code == ErrorCode.NONE
        code, output = program.end()
    assert code == 0, output


def test_a_node_without_standard_streams_serves(ros, client_node, model_file):
    module = "limit_surface_ros.nodes.limit_surface_node"
    command = f'exec {sys.executable} -m {module} --ros-args -p "$1" >&- 2>&- <&-'
    process = subprocess.Popen(
        ["/bin/sh", "-c", command, "sh", f"model_files:=['{model_file()[1]}']"],
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
    )
    try:
        call = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
        asked = WrenchToTwist.Request(wrench=wrench_message([9, 0, 0]))
        assert call(asked).error_code == ErrorCode.NONE
        # What it would have logged.
        asked.model = "none"
        assert call(asked).error_code == ErrorCode.UNKNOWN_MODEL
        asked.model = ""
        assert call(asked).error_code == ErrorCode.NONE
        assert process.poll() is None
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=WAIT) == 0
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()


def test_a_second_signal_refuses_what_has_begun(ros, client_node, tmp_path):
    factors = np.random.default_rng(0).normal(size=(24, 3, 2))
    surface = Dissipation(factors @ factors.transpose(0, 2, 1), Scaling(0.05, 2.0))
    path = tmp_path / "slow.yaml"
    write_surface_model(SurfaceModel(name="slow", surface=surface), path)
    options = "-p", f"model_files:=['{path}']"
    with Program("limit_surface_node", "--ros-args", *options) as program:
        name = "/limit_surface/wrenches_to_twists"
        client = client_node.create_client(WrenchesToTwists, name)
        assert client.wait_for_service(timeout_sec=WAIT)
        while not ros.done(client.call_async(WrenchesToTwists.Request()), 2.0):
            pass
        idle = processor_ticks(program.process.pid)
        wrenches = np.random.default_rng(1).normal(size=(1_000_000, 3))
        answered = client.call_async(WrenchesToTwists.Request(wrenches=convert.flat_of(wrenches)))
        ros.wait(lambda: processor_ticks(program.process.pid) > idle + 30)
        program.process.send_signal(signal.SIGINT)
        code, output = program.end(signal.SIGTERM)
    assert code == 0, output
    assert ros.done(answered, WAIT)
    assert answered.result().error_code == ErrorCode.UNAVAILABLE


def test_signals_after_the_end_change_nothing(ros, client_node, model_file):
    again = "[os.kill(os.getpid(), number) for number in (2, 15)]"
    command = "import os, sys; from limit_surface_ros.nodes.limit_surface_node import main; "
    process = started_python(
        "-c",
        f"{command}code = main(); {again}; sys.exit(code)",
        "--ros-args",
        "-p",
        f"model_files:=['{model_file()[1]}']",
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
    process.send_signal(signal.SIGTERM)
    output, _ = process.communicate(timeout=WAIT)
    assert process.returncode == 0, output
    assert "ignored" not in output
