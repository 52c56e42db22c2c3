# SPDX-License-Identifier: Apache-2.0
"""Stamps tell what is up to date: sources, place and Python."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

PYTHON = Path(sys.executable)


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    root = tmp_path / "repository"
    for name in ("limit_surface_ros/a.py", "limit_surface_interfaces/srv/A.srv", "setup.py"):
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text("1")
    return root


def digests(root: Path) -> dict[str, str]:
    from workspace import PACKAGES, source_digest

    return {package.name: source_digest(root, package, PYTHON) for package in PACKAGES}


def test_untouched_sources_are_up_to_date(repository: Path) -> None:
    before = digests(repository)
    (repository / "limit_surface_ros" / "__pycache__").mkdir()
    (repository / "limit_surface_ros" / "__pycache__" / "a.pyc").write_text("x")
    assert digests(repository) == before


@pytest.mark.parametrize("change", ["edit", "add", "remove", "rename"])
def test_a_changed_module_concerns_its_package_only(repository: Path, change: str) -> None:
    before = digests(repository)
    module = repository / "limit_surface_ros" / "a.py"
    if change == "edit":
        module.write_text("2")
    elif change == "add":
        module.with_name("b.py").write_text("")
    elif change == "remove":
        module.unlink()
    else:
        module.rename(module.with_name("b.py"))
    after = digests(repository)
    assert after["limit_surface_ros"] != before["limit_surface_ros"]
    assert after["limit_surface_interfaces"] == before["limit_surface_interfaces"]


def test_a_changed_interface_is_noticed(repository: Path) -> None:
    before = digests(repository)
    (repository / "limit_surface_interfaces" / "srv" / "A.srv").write_text("2")
    assert digests(repository)["limit_surface_interfaces"] != before["limit_surface_interfaces"]


def test_a_copied_clone_is_built_anew(repository: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    shutil.copytree(repository, copy)
    assert set(digests(copy).values()).isdisjoint(digests(repository).values())


def test_cmake_files_of_the_wheels_name_this_machine() -> None:
    from venv_dir import mend_cmake

    lib = "/opt/python/cp311-cp311/lib/python3.11/site-packages/numpy/_core/include"
    text = f'"/opt/python/cp311-cp311/include/python3.11;{lib};${{_IMPORT_PREFIX}}"'
    mended = mend_cmake(text, "/my/numpy", "/my/python")
    assert mended == '"/my/python;/my/numpy;${_IMPORT_PREFIX}"'
    assert mend_cmake(mended, "/my/numpy", "/my/python") == mended


def test_help_tells_every_target() -> None:
    root = Path(__file__).resolve().parents[2]
    answer = subprocess.run(
        ["make", "-C", root, "--no-print-directory"], capture_output=True, text=True, check=True
    ).stdout
    targets = next(
        line.split(":")[1].split()
        for line in (root / "Makefile").read_text().splitlines()
        if line.startswith(".PHONY")
    )
    assert len(targets) > 5
    for target in targets:
        assert f"\n  {target} " in answer


def test_a_changed_lock_of_ros_is_noticed(tmp_path: Path) -> None:
    from venv_dir import VenvDir

    folder = tmp_path / "requirements"
    folder.mkdir()
    for name in ("ros.txt", "ros.lock", "test.txt"):
        (folder / name).write_text("1")
    venv = VenvDir(tmp_path, system_ros=False)
    before = {group: venv._key(group) for group in ("ros", "test")}
    (folder / "ros.lock").write_text("2")
    assert venv._key("ros") != before["ros"]
    assert venv._key("test") == before["test"]
