# SPDX-License-Identifier: Apache-2.0
"""The main job end to end: recorded pushes, a fitted model in YAML, the node, its answers."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from limit_surface_interfaces.srv import WrenchToTwist

from limit_surface_ros.files.pushes_csv import read_pushes
from limit_surface_ros.files.surface_file import SurfaceModel, write_surface_model
from limit_surface_ros.fitting.pairs import scaling_of_pairs
from limit_surface_ros.fitting.power_sum import fit_power_sum
from limit_surface_ros.fitting.search import Search
from limit_surface_ros.surface.kinds.power_sum import thesis_exponents
from node_helpers import Program, planar_twist, wrench_message

SHARED = Path(os.environ.get("LIMIT_SURFACE_SHARED", Path(__file__).parents[3] / "shared"))
DATA = SHARED / "data" / "pushing"
SET = "hardboard_10_130_10_10_10_130"
RHO = 0.05


@pytest.mark.skipif(not DATA.is_dir(), reason=f"the recorded pushes are not at {DATA}")
def test_a_model_of_25_pushes_predicts_the_other_25_within_12_degrees(ros, client_node, tmp_path):
    pushes = read_pushes(DATA / f"{SET}.csv")
    rows = json.loads((DATA / "splits.json").read_text())[SET]["25"][0]
    training = pushes.rows(rows)
    result = fit_power_sum(
        training,
        thesis_exponents(3),
        scaling=scaling_of_pairs(training, RHO),
        search=Search(starts=4, seed=0),
    )
    path = tmp_path / "pushed.yaml"
    write_surface_model(SurfaceModel("pushed", result.surface), path)
    test = pushes.rest(rows)
    assert len(test) == 25
    with Program("limit_surface_node", "--ros-args", "-p", f"model_files:=['{path}']") as program:
        call = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
        answers = [
            call(WrenchToTwist.Request(model="pushed", wrench=wrench_message(wrench)))
            for wrench in test.wrenches
        ]
        code, output = program.end()
    assert code == 0, output
    assert not any(answer.error_code for answer in answers)
    scale = [1.0, 1.0, RHO]
    predicted = np.array([planar_twist(answer.twist) for answer in answers]) * scale
    measured = test.twists * scale
    cosines = (predicted * measured).sum(axis=1)
    cosines /= np.linalg.norm(predicted, axis=1) * np.linalg.norm(measured, axis=1)
    angles = np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0)))
    assert angles.mean() < 12.0
