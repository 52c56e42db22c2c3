# SPDX-License-Identifier: Apache-2.0
"""The environment that programs of the workspace run in, whatever the user's shell holds."""

import os
import socket
from pathlib import Path

# Ids of ROS domains that are safe beside Linux's ephemeral ports; 0 is everybody's.
DOMAINS = range(1, 102)
# Where a Python or a build would look before this workspace.
MISLEADING = (
    "_ROS_WHEELS_BOOTSTRAP_COMPLETE",
    "COLCON_DEFAULTS_FILE",
    "CONDA_PREFIX",
    "MAKEFLAGS",
    "MAKELEVEL",
    "MFLAGS",
    "PIP_PREFIX",
    "PIP_REQUIRE_VIRTUALENV",
    "PIP_TARGET",
    "PIP_USER",
    "PYTHONHOME",
    "VIRTUAL_ENV",
)
# Of a ROS that the wheels replace.
FOREIGN_ROS = (
    "AMENT_PREFIX_PATH",
    "CMAKE_PREFIX_PATH",
    "COLCON_PREFIX_PATH",
    "PYTHONPATH",
    "RMW_IMPLEMENTATION",
)
# Ways out of LOCALHOST, or past the domain.
OPEN_DISCOVERY = (
    "FASTDDS_DEFAULT_PROFILES_FILE",
    "FASTRTPS_DEFAULT_PROFILES_FILE",
    "ROS_DISCOVERY_SERVER",
    "ROS_LOCALHOST_ONLY",
    "ROS_STATIC_PEERS",
)


def base_environment(root: Path, system_ros: bool) -> dict[str, str]:
    """Return the user's environment without what would mislead a Python or a build."""
    env = dict(os.environ)
    if not system_ros:
        foreign = _parts(env.get("AMENT_PREFIX_PATH")) + _parts(env.get("COLCON_PREFIX_PATH"))
        libraries = [
            part
            for part in _parts(env.get("LD_LIBRARY_PATH"))
            if not any(Path(part).is_relative_to(prefix) for prefix in foreign)
        ]
        _set_path(env, "LD_LIBRARY_PATH", libraries)
        for name in FOREIGN_ROS:
            env.pop(name, None)
        env["PYTHONNOUSERSITE"] = "1"
    for name in MISLEADING:
        env.pop(name, None)
    home = env.get("HOME", "")
    if not home or not os.access(home, os.W_OK | os.X_OK):
        # pip, rclpy's log and matplotlib all write there.
        substitute = root / "build" / "home"
        substitute.mkdir(parents=True, exist_ok=True)
        env["HOME"] = str(substitute)
    # Build options of the user's other workspaces (symlink-install!) are not for this one.
    env["COLCON_HOME"] = str(root / "build" / "colcon_home")
    env["PIP_DISABLE_PIP_VERSION_CHECK"] = "1"
    return env


def enter_venv(env: dict[str, str], venv: Path) -> None:
    """Change `env` to what the virtual environment's activate script would make of it."""
    env["VIRTUAL_ENV"] = str(venv)
    _prepend(env, "PATH", venv / "bin")


def add_ros_wheels(env: dict[str, str], venv: Path) -> None:
    """Let ament and CMake find the ROS that is installed in `venv`."""
    env["ROS_DISTRO"] = "jazzy"
    env["ROS_VERSION"] = "2"
    env["ROS_PYTHON_VERSION"] = "3"
    _prepend(env, "AMENT_PREFIX_PATH", venv)
    _prepend(env, "CMAKE_PREFIX_PATH", venv)


def add_package(env: dict[str, str], prefix: Path) -> None:
    """Change `env` to what the local_setup script of the package in `prefix` would make of it.

    Its programs are put on the PATH besides, for who has no `ros2 run`.
    """
    programs = prefix / "lib" / prefix.name
    if programs.is_dir():
        _prepend(env, "PATH", programs)
    _prepend(env, "AMENT_PREFIX_PATH", prefix)
    _prepend(env, "CMAKE_PREFIX_PATH", prefix)
    if list((prefix / "lib").glob("*.so")):
        _prepend(env, "LD_LIBRARY_PATH", prefix / "lib")
    # Debian's Python installs below local/ and calls the folder dist-packages.
    for packages in sorted(prefix.glob("**/lib/python3*/*-packages")):
        _prepend(env, "PYTHONPATH", packages)


def isolate_discovery(env: dict[str, str], log_dir: Path) -> socket.socket:
    """Give `env` a ROS domain of its own on this machine, for as long as the result is open.

    Returns:
        The claim on the domain; inheritable, so that it lasts as long as the program run in `env`.
    """
    for name in OPEN_DISCOVERY:
        env.pop(name, None)
    env["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    env.setdefault("ROS_LOG_DIR", str(log_dir))
    claim = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    for offset in range(len(DOMAINS)):
        # Start anywhere: what ended a moment ago may still be heard in its domain.
        domain = DOMAINS[(os.getpid() + offset) % len(DOMAINS)]
        try:
            # An abstract name is as wide as the network namespace, and the kernel cleans it up.
            claim.bind(f"\0limit_surface_ros/domain/{domain}")
        except OSError:
            continue
        env["ROS_DOMAIN_ID"] = str(domain)
        claim.set_inheritable(True)
        return claim
    raise RuntimeError("every ROS domain of this machine is taken by a run of limit_surface_ros")


def _parts(value: str | None) -> list[str]:
    return [part for part in (value or "").split(os.pathsep) if part]


def _set_path(env: dict[str, str], name: str, parts: list[str]) -> None:
    if parts:
        env[name] = os.pathsep.join(parts)
    else:
        env.pop(name, None)


def _prepend(env: dict[str, str], name: str, path: Path) -> None:
    rest = [part for part in _parts(env.get(name)) if part != str(path)]
    _set_path(env, name, [str(path), *rest])
