# SPDX-License-Identifier: Apache-2.0
"""The set-up stops before it installs anything, with one sentence on what is missing."""

from __future__ import annotations

import importlib.util
import platform
import subprocess
import sys
import sysconfig
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

WithRos = Callable[..., subprocess.CompletedProcess[str]]


class Version(NamedTuple):
    major: int
    minor: int


def one_sentence(result: subprocess.CompletedProcess[str]) -> str:
    assert result.returncode == 2, result
    assert result.stdout == ""
    (line,) = result.stderr.splitlines()
    assert line.startswith("set-up: ")
    return line


def test_another_distribution_is_refused_by_name(with_ros: WithRos) -> None:
    assert "'humble'" in one_sentence(with_ros("make", "c++", ROS_DISTRO="humble"))


def test_a_distribution_that_is_only_named_is_not_taken_for_sourced(with_ros: WithRos) -> None:
    assert "AMENT_PREFIX_PATH" in one_sentence(with_ros("make", "c++", ROS_DISTRO="jazzy"))


def test_a_missing_compiler_is_named(with_ros: WithRos) -> None:
    assert "no C++ compiler" in one_sentence(with_ros("make"))


def test_a_missing_make_is_named(with_ros: WithRos) -> None:
    assert "no make" in one_sentence(with_ros("c++"))


def test_an_old_python_is_told_its_version(with_ros: WithRos, tmp_path: Path) -> None:
    old = tmp_path / "python3.8"
    # Answers as Python 3.8 would: too old for the question, then its version.
    old.write_text('#!/bin/sh\ncase "$2" in *exit*) exit 1 ;; *) echo 3.8 ;; esac\n')
    old.chmod(0o755)
    sentence = one_sentence(with_ros("make", "c++", PYTHON=str(old)))
    assert "Python 3.10 or newer" in sentence
    assert sentence.count("3.8") == 2


def test_a_python_that_is_not_there_is_named(with_ros: WithRos) -> None:
    assert "/no/python does not run" in one_sentence(with_ros("make", PYTHON="/no/python"))


@pytest.mark.parametrize(
    ("function", "answer", "named"),
    [
        ("machine", "aarch64", "aarch64"),
        ("system", "Darwin", "Darwin"),
        ("libc_ver", ("", ""), "glibc 2.28"),
        ("libc_ver", ("glibc", "2.17"), "2.17"),
        ("python_implementation", "PyPy", "PyPy"),
    ],
)
def test_a_platform_without_wheels_is_sent_to_a_sourced_ros(
    monkeypatch: pytest.MonkeyPatch, function: str, answer: object, named: str
) -> None:
    import needs
    from console import SetupError

    monkeypatch.setattr(platform, function, lambda: answer)
    with pytest.raises(SetupError, match=named) as caught:
        needs.check_wheels_exist()
    assert "source a ROS 2 jazzy" in str(caught.value)


@pytest.mark.parametrize("minor", [9, 14])
def test_a_python_without_wheels_is_sent_to_another(
    monkeypatch: pytest.MonkeyPatch, minor: int
) -> None:
    import needs
    from console import SetupError

    monkeypatch.setattr(sys, "version_info", Version(3, minor))
    with pytest.raises(SetupError, match=rf"3\.10 to 3\.13.*3\.{minor};.*PYTHON=python3\.12"):
        needs.check_wheels_exist()


def test_a_python_that_cannot_make_virtual_environments_is_told_the_package(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    import needs
    from console import SetupError

    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "ensurepip" else find(name)
    )
    with pytest.raises(SetupError, match=r"apt install python3\.\d+-venv"):
        needs.check_venv()


def test_missing_python_headers_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    import needs
    from console import SetupError

    monkeypatch.setattr(sysconfig, "get_paths", lambda: {"include": "/no/include"})
    with pytest.raises(SetupError, match=r"/no/include/Python\.h.*-dev"):
        needs.check_python_headers()
