# SPDX-License-Identifier: Apache-2.0
"""What a shell holds does not mislead the programs of the workspace."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest


def test_traces_of_another_environment_are_gone(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from environment import base_environment

    monkeypatch.setenv("_ROS_WHEELS_BOOTSTRAP_COMPLETE", "1")
    monkeypatch.setenv("VIRTUAL_ENV", "/other")
    monkeypatch.setenv("PYTHONPATH", "/other/lib")
    monkeypatch.setenv("AMENT_PREFIX_PATH", "/other/install/a")
    monkeypatch.setenv("LD_LIBRARY_PATH", "/other/install/a/lib:/mine")
    env = base_environment(tmp_path, system_ros=False)
    assert not [value for value in env.values() if "/other" in value]
    assert "_ROS_WHEELS_BOOTSTRAP_COMPLETE" not in env
    assert env["LD_LIBRARY_PATH"] == "/mine"


def test_a_sourced_ros_stays(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from environment import base_environment

    monkeypatch.setenv("PYTHONPATH", "/opt/ros/jazzy/lib")
    monkeypatch.setenv("AMENT_PREFIX_PATH", "/opt/ros/jazzy")
    env = base_environment(tmp_path, system_ros=True)
    assert env["PYTHONPATH"] == "/opt/ros/jazzy/lib"
    assert env["AMENT_PREFIX_PATH"] == "/opt/ros/jazzy"


def test_programs_run_by_their_names(tmp_path: Path) -> None:
    from environment import add_package

    prefix = tmp_path / "a_package"
    program = prefix / "lib" / "a_package" / "a_program"
    program.parent.mkdir(parents=True)
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    env = {"PATH": "/usr/bin"}
    add_package(env, prefix)
    add_package(env, tmp_path / "package_without_programs")
    assert env["PATH"] == f"{program.parent}{os.pathsep}/usr/bin"
    assert shutil.which("a_program", path=env["PATH"]) == str(program)


@pytest.mark.parametrize("home", ["", "/proc/nowhere"])
def test_a_home_that_cannot_be_written_is_replaced(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, home: str
) -> None:
    from environment import base_environment

    monkeypatch.setenv("HOME", home)
    env = base_environment(tmp_path, system_ros=False)
    assert os.access(env["HOME"], os.W_OK)
    assert Path(env["HOME"]).is_relative_to(tmp_path)


def test_runs_side_by_side_get_domains_of_their_own(tmp_path: Path) -> None:
    from environment import isolate_discovery

    environments: list[dict[str, str]] = [{"ROS_DOMAIN_ID": "7"} for _ in range(3)]
    claims = [isolate_discovery(env, tmp_path) for env in environments]
    try:
        domains = {env["ROS_DOMAIN_ID"] for env in environments}
        assert len(domains) == 3
        assert all(1 <= int(domain) <= 101 for domain in domains)
        assert {env["ROS_AUTOMATIC_DISCOVERY_RANGE"] for env in environments} == {"LOCALHOST"}
    finally:
        for claim in claims:
            claim.close()
