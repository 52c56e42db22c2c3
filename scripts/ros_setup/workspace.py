# SPDX-License-Identifier: Apache-2.0
"""The two packages of this repository, built by colcon when their sources changed."""

import hashlib
import os
import shutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from console import run_logged
from environment import add_package

STAMP = ".built-from"


@dataclass(frozen=True)
class Package:
    """A package of the workspace and the files it is built from, relative to the repository."""

    name: str
    folder: str
    sources: tuple[str, ...]


# In the order of their dependencies.
PACKAGES = (
    Package("limit_surface_interfaces", "limit_surface_interfaces", ("limit_surface_interfaces",)),
    Package(
        "limit_surface_ros",
        ".",
        (
            "package.xml",
            "setup.py",
            "setup.cfg",
            "resource",
            "config",
            "launch",
            "limit_surface_ros",
        ),
    ),
)


def build(root: Path, python: Path, env: Mapping[str, str]) -> None:
    """Build what is missing or older than its sources.

    A package that is rebuilt starts from nothing, so that no removed module and no half-written
    file of an interrupted build stays behind.

    Raises:
        SetupError: colcon failed.
    """
    layout = root / "install" / ".colcon_install_layout"
    if layout.is_file() and layout.read_text(encoding="utf-8").strip() != "isolated":
        # Someone ran `colcon build --merge-install` here.
        shutil.rmtree(root / "install")
        shutil.rmtree(root / "build", ignore_errors=True)
    keys = {package.name: source_digest(root, package, python) for package in PACKAGES}
    stale = [
        package
        for package in PACKAGES
        if _read_stamp(root / "install" / package.name) != keys[package.name]
    ]
    if not stale:
        return
    for package in stale:
        (root / "install" / package.name / STAMP).unlink(missing_ok=True)
        for place in ("install", "build"):
            shutil.rmtree(root / place / package.name, ignore_errors=True)
    names = [package.name for package in stale]
    # Without a number of jobs colcon adds `-l`, and builds with one job on a busy machine.
    jobs = f"-j{len(os.sched_getaffinity(0))}"
    run_logged(
        [
            *("colcon", "build", "--base-paths", *(package.folder for package in PACKAGES)),
            *("--packages-select", *names),
            *("--event-handlers", "console_direct+", "desktop_notification-"),
            *("--cmake-args", "-DBUILD_TESTING=OFF", "-DCMAKE_BUILD_TYPE=Release"),
            *(f"-D{name}_EXECUTABLE={python}" for name in ("Python3", "PYTHON")),
        ],
        root / "log" / "set-up" / "build.log",
        f"building {' and '.join(names)}",
        {"MAKEFLAGS": jobs, **env},
        root,
    )
    for package in stale:
        (root / "install" / package.name / STAMP).write_text(keys[package.name], encoding="utf-8")


def add_workspace(root: Path, env: dict[str, str]) -> None:
    """Let programs in `env` find the packages of the workspace, and a shell their programs."""
    for package in PACKAGES:
        add_package(env, root / "install" / package.name)


def source_digest(root: Path, package: Package, python: Path) -> str:
    """Return a digest of the sources and of what else a build depends on."""
    digest = hashlib.sha256(f"{root}\0{python}\0{python.resolve()}".encode())
    for path in _source_files(root, package):
        digest.update(f"\0{path.relative_to(root)}\0".encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _source_files(root: Path, package: Package) -> Iterator[Path]:
    for source in package.sources:
        path = root / source
        if path.is_file():
            yield path
        for below in sorted(path.rglob("*")):
            if below.is_file() and "__pycache__" not in below.parts:
                yield below


def _read_stamp(prefix: Path) -> str:
    path = prefix / STAMP
    return path.read_text(encoding="utf-8") if path.is_file() else ""
