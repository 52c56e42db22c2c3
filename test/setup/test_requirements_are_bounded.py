# SPDX-License-Identifier: Apache-2.0
"""What the set-up installs is known: wheels of ROS by their hashes, others within two bounds."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

REQUIREMENTS = Path(__file__).resolve().parents[2] / "requirements"


def lines_of(name: str) -> list[str]:
    text = (REQUIREMENTS / name).read_text()
    lines = (line.split("#")[0].strip() for line in text.replace("\\\n", " ").splitlines())
    return [line for line in lines if line and not line.startswith("-r ")]


@pytest.mark.parametrize("path", list(REQUIREMENTS.glob("*.txt")), ids=lambda path: path.name)
def test_every_requirement_is_bounded_from_both_sides(path: Path) -> None:
    for line in lines_of(path.name):
        assert "==" in line or (">=" in line and ",<" in line) or re.search(r"[^=]<", line), line


def test_every_wheel_of_ros_that_is_named_is_locked_at_its_version_with_its_hashes() -> None:
    locked = {}
    for line in lines_of("ros.lock"):
        pinned, *hashes = line.split()
        assert hashes, line
        assert all(re.fullmatch(r"--hash=sha256:[0-9a-f]{64}", each) for each in hashes), line
        name, _, version = pinned.partition("==")
        locked[name] = version
    named = [line for line in lines_of("ros.txt") if line.startswith("ros-")]
    assert named
    for line in named:
        name, _, version = re.sub(r"\[.*\]", "", line).partition("==")
        assert locked[name] == version
