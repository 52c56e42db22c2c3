# SPDX-License-Identifier: Apache-2.0
"""The parameter files in config/ show each parameter at its default."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from limit_surface_interfaces.srv import ListDecays, ListModels

from limit_surface_ros.nodes.decay_node import SETTINGS as DECAY_SETTINGS
from limit_surface_ros.nodes.limit_surface_node import SETTINGS as SURFACE_SETTINGS
from limit_surface_ros.nodes.models.model_node import COMMON_SETTINGS
from node_helpers import Program

CONFIG = Path(__file__).parents[2] / "config"
TABLES = {
    "limit_surface": [*SURFACE_SETTINGS, *COMMON_SETTINGS],
    "decay": [*DECAY_SETTINGS, *COMMON_SETTINGS],
}


@pytest.mark.parametrize("name", TABLES)
def test_each_parameter_is_shown_at_its_default(name):
    text = (CONFIG / f"{name}.yaml").read_text()
    given = yaml.safe_load(text)[f"/**/{name}"]["ros__parameters"]
    table = {setting.name: setting.default for setting in TABLES[name]}
    assert all(given[key] == table[key] for key in given)
    # rcl cannot read empty lists: those, and lists of files, may stand in comments only.
    hidden = set(table) - set(given)
    assert all(isinstance(table[key], list) for key in hidden)


@pytest.mark.parametrize(
    ("program", "name", "service"),
    [("limit_surface_node", "limit_surface", ListModels), ("decay_node", "decay", ListDecays)],
)
def test_the_program_starts_with_its_file_and_serves_the_models_that_ship(
    ros, client_node, program, name, service
):
    path = str(CONFIG / f"{name}.yaml")
    with Program(program, "--ros-args", "--params-file", path) as running:
        answer = ros.client(client_node, service, f"/{name}/list_models")(service.Request())
        code, output = running.end()
    assert answer.models
    assert code == 0, output


@pytest.mark.parametrize("arguments", [["-p"], ["--params-file", "/nope.yaml"], ["--bogus"]])
def test_bad_ros_arguments_are_told_in_one_line(arguments):
    with Program("limit_surface_node", "--ros-args", *arguments) as running:
        code, output = running.ended()
    assert code == 1
    assert "cannot start" in output
    assert "Traceback" not in output
