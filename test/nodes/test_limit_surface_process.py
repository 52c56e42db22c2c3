# SPDX-License-Identifier: Apache-2.0
"""The limit_surface program: starts, serves other processes, and ends without a traceback."""

from __future__ import annotations

import importlib.util
import signal

import numpy as np
import pytest
import yaml

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from limit_surface_interfaces.srv import ListModels, WrenchToTwist

from limit_surface_ros.files.surface_file import read_surface_model
from limit_surface_ros.nodes import decay_node, limit_surface_node
from limit_surface_ros.nodes.models.model_node import COMMON_SETTINGS
from node_helpers import Program, planar_twist, wrench_message


def started(path, *arguments):
    """Start the node's program on one model file."""
    return Program(
        "limit_surface_node",
        "--ros-args",
        "-p",
        f"model_files:=['{path}']",
        *arguments,
    )


@pytest.mark.parametrize("executor", ["single_threaded", "events"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_another_process_is_served_until_a_signal_ends_it_cleanly(
    ros, client_node, model_file, number, executor
):
    model, path = model_file()
    with started(path, "-p", f"executor:={executor}") as program:
        call = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
        answer = call(WrenchToTwist.Request(wrench=wrench_message([3.0, 1.0, 0.1])))
        expected = model.surface.twist_of_wrench([3.0, 1.0, 0.1])
        np.testing.assert_allclose(planar_twist(answer.twist), expected, atol=1e-12)
        code, output = program.end(number)
    assert code == 0, output
    assert "Traceback" not in output
    assert "terminate" not in output


@pytest.mark.parametrize(
    ("broken", "told"),
    [
        ("model_files:=['/nowhere/box.yaml']", "/nowhere/box.yaml"),
        ("default_model:=sofa", "sofa"),
        ("input_timeout:=-1.0", "input_timeout"),
        ("input_timeout:=.nan", "input_timeout"),
        ("normal_force_from:=moon", "normal_force_from"),
        ("static_transforms:=['a b 1 2']", "static_transforms"),
        ("model_files:=/box.yaml", "model_files must be a list of texts: write ['/box.yaml']"),
        ("out_of_plane_tolerance:=text", "out_of_plane_tolerance"),
        ("learn_file:=caf\udce9.yaml", "dce9.yaml' is not UTF-8, and ROS 2 takes no other"),
    ],
)
def test_a_bad_parameter_at_start_is_told_in_one_line(ros, model_file, broken, told):
    _, path = model_file()
    with started(path, "-p", broken) as program:
        code, output = program.ended()
    assert code == 1
    assert told in output
    assert "Traceback" not in output


def test_a_misspelt_parameter_is_told_with_the_one_that_was_meant(ros, client_node, model_file):
    _, path = model_file()
    given = "-p model_file:=other.yaml -p weather:=fine -p use_sim_time:=false"
    with started(path, *given.split()) as program:
        ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
        _, output = program.end()
    assert "'model_file' is not known here and is ignored; did you mean 'model_files'?" in output
    (line,) = (line for line in output.splitlines() if "'weather' is not known here" in line)
    assert "[WARN]" in line
    assert output.count("not known here") == 2


@pytest.mark.parametrize(
    ("use_tf", "told"),
    [
        ("true", "others by /tf" if importlib.util.find_spec("tf2_ros") else "is not installed"),
        ("false", "not by /tf: use_tf is false"),
    ],
)
def test_it_is_told_whether_tf_is_listened_to(ros, client_node, model_file, use_tf, told):
    _, path = model_file()
    with started(path, "-p", f"use_tf:={use_tf}") as program:
        ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
        _, output = program.end()
    (line,) = (line for line in output.splitlines() if "frames: " in line)
    assert told in line


def test_without_a_place_for_the_log_the_reason_is_told_in_one_line(model_file, monkeypatch):
    for name in ("HOME", "ROS_HOME", "ROS_LOG_DIR"):
        monkeypatch.delenv(name, raising=False)
    with started(model_file()[1]) as program:
        code, output = program.ended()
    assert code == 1
    (line,) = output.splitlines()
    assert "cannot start: " in line
    assert "ROS_LOG_DIR" in line


def test_help_teaches_how_to_give_parameters():
    with Program("limit_surface_node", "--help") as program:
        code, output = program.ended()
    assert code == 0
    assert "--params-file" in output


@pytest.mark.parametrize(
    ("program", "tables"),
    [
        ("limit_surface_node", [limit_surface_node.SETTINGS]),
        ("decay_node", [decay_node.SETTINGS]),
        ("force_motion_nodes", [limit_surface_node.SETTINGS, decay_node.SETTINGS]),
    ],
)
def test_help_lists_every_parameter_with_default_and_meaning(program, tables):
    with Program(program, "--help") as running:
        code, output = running.ended()
    assert code == 0
    assert "-p \"model_files:=['/path/to/model.yaml']\"" in output
    told = " ".join(output.split())
    for table in tables:
        for setting in (*table, *COMMON_SETTINGS):
            assert f"{setting.name} := {setting.written} {setting.description}" in told


def test_a_model_file_without_its_parameter_is_told_how_to_be_given():
    with Program("limit_surface_node", "model.yaml") as program:
        code, output = program.ended()
    assert code == 2
    assert "-p \"model_files:=['model.yaml']\"" in output


def test_a_whole_number_does_for_one_with_a_point(ros, client_node, model_file):
    _, path = model_file(normal_force=10.0)
    given = "-p", "normal_force_from:=parameter", "-p", "normal_force:=5"
    with started(path, *given) as program:
        call = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
        asked = WrenchToTwist.Request(wrench=wrench_message([3.0, 1.0, 0.1]))
        factor = read_surface_model(path).surface.load_factor([3.0, 1.0, 0.1])
        assert call(asked).load_factor == pytest.approx(2.0 * float(factor))
        code, output = program.end()
    assert code == 0, output


def test_nodes_of_one_process_that_ask_for_different_executors_do_not_start():
    with Program("force_motion_nodes", "--ros-args", "-p", "decay:executor:=events") as program:
        code, output = program.ended()
    assert code == 1
    assert "executor is single_threaded for limit_surface, events for decay; the nodes" in output
    assert "-p executor:=events" in output
    assert "Traceback" not in output


def test_a_file_that_both_nodes_of_a_process_were_given_is_told_how_to_give_to_one(model_file):
    _, path = model_file()
    files = f"model_files:=['{path}']"
    with Program("force_motion_nodes", "--ros-args", "-p", files) as program:
        code, output = program.ended()
    assert code == 1
    assert "this is a limit surface, which the limit_surface node serves" in output
    assert '-p "limit_surface:model_files:=' in output


def test_a_parameter_for_one_node_that_a_namespace_keeps_from_it_is_refused(model_file):
    _, path = model_file()
    files = f"limit_surface:model_files:=['{path}']"
    arguments = ["--ros-args", "-r", "__ns:=/left", "-p", files]
    with Program("force_motion_nodes", *arguments) as program:
        code, output = program.ended()
    assert code == 1
    assert "give model_files in a parameter file, under /**/limit_surface: ros__param" in output


def test_a_parameter_file_addresses_one_node_of_a_process_in_a_namespace(
    ros, client_node, model_file, tmp_path
):
    _, path = model_file(name="crate")
    parameters = {"/**/limit_surface": {"ros__parameters": {"model_files": [str(path)]}}}
    file = tmp_path / "parameters.yaml"
    file.write_text(yaml.safe_dump(parameters))
    arguments = ["--ros-args", "-r", "__ns:=/left", "--params-file", str(file)]
    with Program("force_motion_nodes", *arguments) as program:
        call = ros.client(client_node, ListModels, "/left/limit_surface/list_models")
        assert [each.name for each in call(ListModels.Request()).models] == ["crate"]
        code, output = program.end()
    assert code == 0, output
