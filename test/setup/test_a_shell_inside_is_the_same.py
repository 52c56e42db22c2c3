# SPDX-License-Identifier: Apache-2.0
"""Within `scripts/with_ros bash`, `make` finds the Python and the ROS that it finds outside."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
# Stands where scripts/with_ros looks for a Python: new enough, and tells what it was started with.
TELLS = '#!/bin/sh\n[ "$1" = -c ] || { echo "PYTHON_RUN=$0"; env; }\n'


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """Return a clone whose .venv was made by a Python that is not the first on the PATH."""
    root = tmp_path / "a clone"
    (root / "scripts").mkdir(parents=True)
    shutil.copy(ROOT / "scripts" / "with_ros", root / "scripts")
    for python in (tmp_path / "first" / "python3", tmp_path / "used" / "python3"):
        python.parent.mkdir()
        python.write_text(TELLS)
        python.chmod(0o755)
    (root / ".venv" / "bin").mkdir(parents=True)
    for name in ("python", "python3"):
        (root / ".venv" / "bin" / name).symlink_to(tmp_path / "used" / "python3")
    return root


def started_with(clone: Path, env: dict[str, str]) -> dict[str, str]:
    """Return the environment in which scripts/with_ros would start the set-up."""
    env = {**env, "PATH": f"{env['PATH']}:{clone.parent / 'first'}:{os.environ['PATH']}"}
    answer = subprocess.run(
        [clone / "scripts" / "with_ros"], env=env, capture_output=True, text=True, check=True
    ).stdout
    lines = (line.partition("=") for line in answer.splitlines())
    # The underscore is the shell's own note of what it runs.
    return {name: value for name, _, value in lines if name != "_"}


def inside(clone: Path, env: dict[str, str], wheels: bool) -> dict[str, str]:
    """Return `env` as scripts/with_ros leaves it to its commands."""
    from environment import add_package, add_ros_wheels, enter_venv

    env = dict(env)
    enter_venv(env, clone / ".venv")
    env.pop("VIRTUAL_ENV")  # the set-up takes it out by itself
    if wheels:
        add_ros_wheels(env, clone / ".venv")
    prefix = clone / "install" / "limit_surface_ros"
    for name in ("lib/limit_surface_ros", "lib/python3.11/site-packages"):
        (prefix / name).mkdir(parents=True)
    (prefix / "lib" / "a.so").touch()
    add_package(env, prefix)
    return env


def test_the_wheels_are_not_taken_for_a_sourced_ros(clone: Path) -> None:
    outside = {"PATH": "/mine/bin", "LD_LIBRARY_PATH": "/mine/lib"}
    expected = started_with(clone, outside)
    assert expected["PYTHON_RUN"] == str(clone.parent / "used" / "python3")
    assert started_with(clone, inside(clone, outside, wheels=True)) == expected


def test_a_sourced_ros_stays_sourced(clone: Path) -> None:
    outside = {
        "PATH": "/opt/ros/jazzy/bin",
        "ROS_DISTRO": "jazzy",
        "AMENT_PREFIX_PATH": "/opt/ros/jazzy",
        "PYTHONPATH": "/opt/ros/jazzy/lib/python3.12/site-packages",
        "LD_LIBRARY_PATH": "/opt/ros/jazzy/lib",
    }
    expected = started_with(clone, outside)
    assert expected["ROS_DISTRO"] == "jazzy"
    assert started_with(clone, inside(clone, outside, wheels=False)) == expected


def test_a_distribution_that_only_its_name_tells_is_still_refused(clone: Path) -> None:
    assert (
        started_with(clone, {"PATH": "/mine/bin", "ROS_DISTRO": "jazzy"})["ROS_DISTRO"] == "jazzy"
    )
