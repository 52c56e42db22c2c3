# SPDX-License-Identifier: Apache-2.0
"""What must be there before anything is installed, each with the sentence that says it is not."""

import importlib.util
import os
import platform
import shutil
import sys
import sysconfig
from pathlib import Path

from console import SetupError

DISTRO = "jazzy"
WHEEL_PYTHONS = ((3, 10), (3, 13))
# The wheels are built for manylinux_2_28.
WHEEL_GLIBC = (2, 28)


def uses_system_ros() -> bool:
    """Tell whether a ROS 2 Jazzy is sourced.

    Raises:
        SetupError: another distribution is sourced, or only its name is set.
    """
    distro = os.environ.get("ROS_DISTRO", "")
    if not distro:
        return False
    if distro != DISTRO:
        raise SetupError(
            f"ROS_DISTRO is '{distro}', but limit_surface_ros needs ROS 2 {DISTRO}; source"
            f" /opt/ros/{DISTRO}/setup.bash in a new shell, or source no ROS to use the wheels"
        )
    if not os.environ.get("AMENT_PREFIX_PATH"):
        raise SetupError(
            f"ROS_DISTRO is '{distro}', but AMENT_PREFIX_PATH is not set; source"
            f" /opt/ros/{DISTRO}/setup.bash, or unset ROS_DISTRO to use the wheels"
        )
    return True


def check_wheels_exist() -> None:
    """Raise SetupError where no ROS wheels are made for this machine and Python."""
    elsewhere = f"; source a ROS 2 {DISTRO} (/opt/ros/{DISTRO}/setup.bash) and run this again"
    system, machine = platform.system(), platform.machine()
    if (system, machine) != ("Linux", "x86_64"):
        raise SetupError(
            f"ROS wheels exist for Linux on x86_64 only, and this is {system} on"
            f" {machine}{elsewhere}"
        )
    libc, version = platform.libc_ver()
    if libc != "glibc" or _numbers(version) < WHEEL_GLIBC:
        need = ".".join(map(str, WHEEL_GLIBC))
        raise SetupError(
            f"ROS wheels need glibc {need} or newer, and this machine has"
            f" {libc or 'another C library'} {version}{elsewhere}"
        )
    found = sys.version_info[:2]
    oldest, newest = WHEEL_PYTHONS
    if platform.python_implementation() != "CPython" or not oldest <= found <= newest:
        raise SetupError(
            f"ROS wheels exist for CPython {_dotted(oldest)} to {_dotted(newest)}, and"
            f" {sys.executable} is {platform.python_implementation()} {_dotted(found)};"
            f" name another with PYTHON=python3.12, or source a ROS 2 {DISTRO}"
            f" (/opt/ros/{DISTRO}/setup.bash), and run this again"
        )


def check_build_tools() -> None:
    """Raise SetupError where make or a compiler is missing: interfaces are compiled here."""
    if not shutil.which("make"):
        raise SetupError("no make on the PATH; install one (sudo apt install make)")
    compilers = [name for name in (os.environ.get("CXX", "").split() or [""])[:1] if name]
    compilers = compilers or ["c++", "g++", "clang++"]
    if not any(shutil.which(name) for name in compilers):
        raise SetupError(
            f"no C++ compiler on the PATH (looked for {', '.join(compilers)}); install one"
            " (sudo apt install g++)"
        )


def check_python_headers() -> None:
    """Raise SetupError where the headers that message classes are compiled with are missing."""
    header = Path(sysconfig.get_paths()["include"]) / "Python.h"
    if not header.is_file():
        raise SetupError(
            f"the C headers of {sys.executable} are missing ({header}); install them"
            f" (sudo apt install python{_dotted(sys.version_info[:2])}-dev)"
        )


def check_venv() -> None:
    """Raise SetupError where Python cannot make virtual environments (Debian splits it off)."""
    if any(importlib.util.find_spec(name) is None for name in ("venv", "ensurepip")):
        raise SetupError(
            f"{sys.executable} cannot make a virtual environment (no venv and ensurepip modules);"
            f" install them (sudo apt install python{_dotted(sys.version_info[:2])}-venv)"
        )


def _dotted(version: tuple[int, ...]) -> str:
    return ".".join(map(str, version))


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in version.split(".") if part.isdigit())
