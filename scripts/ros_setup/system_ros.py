# SPDX-License-Identifier: Apache-2.0
"""A ROS 2 Jazzy that is sourced: what it must hold, and what it fixes."""

import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from console import SetupError
from needs import DISTRO

# Modules that package.xml asks for, with the Debian package that brings each.
MODULES = {
    "numpy": "python3-numpy",
    "scipy": "python3-scipy",
    "yaml": "python3-yaml",
    "diagnostic_msgs": f"ros-{DISTRO}-diagnostic-msgs",
    "geometry_msgs": f"ros-{DISTRO}-geometry-msgs",
    "std_msgs": f"ros-{DISTRO}-std-msgs",
    "std_srvs": f"ros-{DISTRO}-std-srvs",
    "visualization_msgs": f"ros-{DISTRO}-visualization-msgs",
}
MISSING_MODULES = """
import importlib.util, sys
print(*(name for name in sys.argv[1:] if importlib.util.find_spec(name) is None))
"""
MISSING_DISTRIBUTIONS = """
import importlib.metadata, sys
for name in sys.argv[1:]:
    try:
        importlib.metadata.distribution(name)
    except importlib.metadata.PackageNotFoundError:
        print(name)
"""
VERSIONS = """
import numpy, scipy
print(f"numpy=={numpy.__version__}\\nscipy=={scipy.__version__}")
"""


def check_system_ros(env: Mapping[str, str]) -> None:
    """Raise SetupError where the sourced ROS cannot build and run this package."""
    if not shutil.which("colcon"):
        raise SetupError(
            "no colcon on the PATH; install it (sudo apt install python3-colcon-common-extensions)"
        )
    _ask_to_import_rclpy(env)
    missing = _ask(MISSING_MODULES, list(MODULES), env).split()
    if missing:
        packages = " ".join(MODULES[name] for name in missing)
        raise SetupError(
            f"{sys.executable} has no {', '.join(missing)}; install what package.xml asks for"
            f" (sudo apt install {packages})"
        )


def missing_requirements(files: Sequence[Path], env: Mapping[str, str]) -> list[str]:
    """Return the requirements in `files` that this Python has no distribution of."""
    names = []
    for path in files:
        for line in path.read_text(encoding="utf-8").splitlines():
            name = line.split("#")[0].split(">")[0].split("=")[0].strip()
            if name:
                names.append(name)
    return _ask(MISSING_DISTRIBUTIONS, names, env).split()


def fixed_versions(env: Mapping[str, str]) -> str:
    """Return pip constraints that keep what the system's ROS was compiled with."""
    return _ask(VERSIONS, [], env)


def _ask_to_import_rclpy(env: Mapping[str, str]) -> None:
    try:
        _ask("import rclpy", [], env)
    except subprocess.CalledProcessError as error:
        reason = error.stderr.strip().splitlines()[-1]
        raise SetupError(
            f"{sys.executable} cannot import rclpy of the sourced ROS 2 {DISTRO} ({reason});"
            " name the Python that this ROS is made for: PYTHON=/usr/bin/python3 make ..."
        ) from error


def _ask(program: str, arguments: Sequence[str], env: Mapping[str, str]) -> str:
    return subprocess.run(
        [sys.executable, "-c", program, *arguments],
        env=dict(env),
        check=True,
        capture_output=True,
        text=True,
    ).stdout
