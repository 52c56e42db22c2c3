# SPDX-License-Identifier: Apache-2.0
"""The promise of examples/: short, and they run (C++: compiles) as they stand."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from limit_surface_ros.files.surface_file import SurfaceModel, write_surface_model
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from process_helpers import own_domain

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
PROGRAMS = [EXAMPLES / "python_client.py", EXAMPLES / "cpp_client" / "cpp_client.cpp"]
BODY = PointContacts([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]], [1.0, 1.0, 1.0])


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.name)
def test_an_example_has_fewer_than_60_lines(path):
    assert len(path.read_text().splitlines()) < 60


@pytest.fixture
def environment():
    """The environment of a test run, in a ROS domain that only examples use."""
    return os.environ | own_domain("examples")


def test_the_python_client_prints_what_the_library_says(tmp_path, environment):
    pytest.importorskip("rclpy", reason="rclpy is not installed")
    pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")
    path = tmp_path / "triangle.yaml"
    write_surface_model(SurfaceModel("triangle", BODY), path)
    module = "limit_surface_ros.nodes.limit_surface_node"
    node = subprocess.Popen(
        [sys.executable, "-m", module, "--ros-args", "-p", f"model_files:=['{path}']"],
        env=environment,
    )
    try:
        run = subprocess.run(
            [sys.executable, str(EXAMPLES / "python_client.py")],
            env=environment,
            capture_output=True,
            text=True,
        )
    finally:
        node.terminate()
        assert node.wait() == 0
    assert run.returncode == 0, run.stderr
    numbers = [
        [float(n) for n in re.findall(r"-?\d+\.\d+", line)] for line in run.stdout.split("\n")
    ]
    push = np.array([4.0, 1.0, 0.05])
    assert "slides" in run.stdout
    np.testing.assert_allclose(numbers[0], [BODY.load_factor(push)], atol=1e-3)
    np.testing.assert_allclose(numbers[1], BODY.twist_of_wrench(push), atol=1e-3)
    np.testing.assert_allclose(numbers[2], BODY.wrench_of_twist([0.0, 0.0, 1.0]), atol=1e-3)


def test_the_python_client_says_so_when_no_node_runs(environment):
    pytest.importorskip("rclpy", reason="rclpy is not installed")
    pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")
    code = (
        "import runpy, rclpy.client as c\n"
        "real = c.Client.wait_for_service\n"
        "c.Client.wait_for_service = lambda self, timeout_sec=None: real(self, timeout_sec=0.2)\n"
        f"runpy.run_path({str(EXAMPLES / 'python_client.py')!r}, run_name='__main__')\n"
    )
    run = subprocess.run(
        [sys.executable, "-c", code],
        env=environment,
        capture_output=True,
        text=True,
    )
    assert run.returncode == 1
    assert "is the node running?" in run.stderr


def test_the_cpp_client_compiles(tmp_path):
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    index = "share/ament_index/resource_index/packages"
    found = {
        name: any((Path(prefix) / index / name).exists() for prefix in prefixes if prefix)
        for name in ("rclcpp", "limit_surface_interfaces")
    }
    absent = [name for name, there in found.items() if not there]
    if absent:
        pytest.skip(f"{' and '.join(absent)} not on AMENT_PREFIX_PATH: nothing to compile against")
    for arguments in (
        ["-S", str(EXAMPLES / "cpp_client"), "-B", str(tmp_path)],
        ["--build", str(tmp_path)],
    ):
        run = subprocess.run(["cmake", *arguments], capture_output=True, text=True)
        assert run.returncode == 0, run.stdout + run.stderr
    assert (tmp_path / "cpp_client").exists()
