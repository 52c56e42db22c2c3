# SPDX-License-Identifier: Apache-2.0
"""Ways to run the set-up program in a doctored environment."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(autouse=True)
def set_up_modules(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make the modules of the set-up program importable."""
    monkeypatch.syspath_prepend(str(ROOT / "scripts" / "ros_setup"))


@pytest.fixture
def with_ros(tmp_path: Path) -> Callable[..., subprocess.CompletedProcess[str]]:
    """Return a function that runs scripts/with_ros where only the named programs exist."""

    def run(*programs: str, **variables: str) -> subprocess.CompletedProcess[str]:
        folder = tmp_path / "bin"
        folder.mkdir(exist_ok=True)
        for program in ("bash", "env", "dirname", "readlink", *programs):
            found = shutil.which(program)
            assert found, program
            (folder / program).symlink_to(found)
        python = os.path.realpath(sys.executable)
        return subprocess.run(
            [ROOT / "scripts" / "with_ros", "--", "echo", "went on"],
            env={"PATH": str(folder), "PYTHON": python, "HOME": str(tmp_path), **variables},
            capture_output=True,
            text=True,
            check=False,
        )

    return run
