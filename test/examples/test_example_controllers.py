# SPDX-License-Identifier: Apache-2.0
"""The promise of examples/: a controller in C++ compiles and runs, and planned pushes arrive."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from limit_surface_ros.export.targets import export_surface
from limit_surface_ros.files.surface_file import SurfaceModel
from limit_surface_ros.surface import PointContacts

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
CORNERS = [[0.05, 0.05], [0.05, -0.05], [-0.05, 0.05], [-0.05, -0.05]]


@pytest.mark.skipif(shutil.which("g++") is None, reason="no g++ on this machine")
def test_the_controller_compiles_without_a_warning_and_has_an_answer_at_each_step(tmp_path):
    for path in (EXAMPLES / "ros2_control_snippet").iterdir():
        shutil.copy(path, tmp_path)
    model = SurfaceModel("box", PointContacts(CORNERS, [0.8] * 4))
    (tmp_path / "box.hpp").write_text(export_surface(model, "cpp").text, encoding="utf-8")
    command = ["g++", "-std=c++17", "-O2", "-Wall", "-Wextra", "-Werror", "-o", "loop", "loop.cpp"]
    subprocess.run(command, cwd=tmp_path, check=True)
    done = subprocess.run(
        [tmp_path / "loop", "500"], capture_output=True, text=True, check=True
    ).stdout
    steps, sliding = map(int, re.match(r"(\d+) steps, (\d+) sliding", done).groups())
    assert steps == 500
    assert 0 < sliding < 500


def test_planned_pushes_arrive_and_a_better_model_arrives_nearer(tmp_path):
    pytest.importorskip("casadi", reason="casadi is not installed: make test_exports has it")
    program = EXAMPLES / "mpc_push" / "plan_push.py"
    done = subprocess.run(
        [sys.executable, program], capture_output=True, text=True, cwd=tmp_path, check=True
    ).stdout
    rows = re.findall(r"^(\w+) +\(.*\) +(\d+) +([\d.]+) mm +([\d.]+) deg$", done, re.MULTILINE)
    assert len(rows) == 15
    off = {}
    for name, iterations, millimetres, _ in rows:
        assert int(iterations) < 100
        off.setdefault(name, []).append(float(millimetres))
    mean = {name: sum(each) / len(each) for name, each in off.items()}
    assert mean["norms_4"] < mean["ellipsoid"]
    assert mean["dissipation_4"] < mean["ellipsoid"]
