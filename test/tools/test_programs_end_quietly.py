# SPDX-License-Identifier: Apache-2.0
"""A program whose output goes nowhere ends without a traceback."""

import os
import runpy
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from limit_surface_ros import runtime
from process_helpers import REPOSITORY

PROGRAM = [sys.executable, "-m", "limit_surface_ros.tools.fit_decay"]
MODEL = REPOSITORY / "config" / "models" / "triangle_patch.yaml"
FIT = [*PROGRAM, "f1", "--terms", "1", "--method", "esprit"]


def test_a_reader_that_goes_away_is_no_error_to_tell():
    unread, output = os.pipe()
    os.close(unread)
    try:
        ended = subprocess.run(FIT, stdout=output, stderr=subprocess.PIPE, text=True, check=False)
    finally:
        os.close(output)
    assert ended.returncode == 1
    assert "Error" not in ended.stderr
    assert "Traceback" not in ended.stderr


@pytest.mark.parametrize(("package", "program"), [("nodes", "ask"), ("tools", "fit_surface")])
def test_help_that_nobody_reads_is_no_error_to_tell(package, program):
    unread, output = os.pipe()
    os.close(unread)
    command = f"import sys; from limit_surface_ros.runtime import {package}; "
    command += f"sys.argv = ['{program}', '--help']; sys.exit({package}.{program}())"
    try:
        ended = subprocess.run(
            [sys.executable, "-c", command],
            # What is not written at once is written at the end.
            env=os.environ | {"PYTHONUNBUFFERED": ""},
            stdout=output,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    finally:
        os.close(output)
    # A parser that meets the broken pipe itself passes over it and ends with 0.
    assert ended.returncode in (0, 1)
    assert ended.stderr == ""


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
def test_a_full_disk_is_told_in_one_line():
    with Path("/dev/full").open("w") as full:
        ended = subprocess.run(FIT, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert ended.returncode == 1
    assert ended.stderr.splitlines()[-1].startswith("fit_decay: error: ")
    assert "Traceback" not in ended.stderr


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
def test_a_full_disk_is_told_in_one_line_by_programs_that_ask_nodes_too():
    command = "import sys; from limit_surface_ros.runtime import nodes; "
    command += "sys.argv = ['ask', '--help']; sys.exit(nodes.ask())"
    with Path("/dev/full").open("w") as full:
        ended = subprocess.run(
            [sys.executable, "-c", command],
            env=os.environ | {"PYTHONUNBUFFERED": ""},
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert ended.returncode == 1
    assert ended.stderr.startswith("ask: error: ")
    assert ended.stderr.count("\n") == 1


EXPORT = [sys.executable, "-m", "limit_surface_ros.tools.export_surface"]


@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&- >&- 2>&-"])
def test_closed_standard_streams_are_no_error_and_no_file_takes_their_place(tmp_path, closed):
    output = tmp_path / "model.hpp"
    program = [*EXPORT, MODEL, "--to", "cpp", "-o", output]
    ended = subprocess.run(
        ["sh", "-c", f'exec "$@" {closed}', "sh", *map(str, program)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (ended.returncode, ended.stderr) == (0, "")
    assert output.read_text().endswith("\n")
    assert "written     " not in output.read_text()


def test_a_name_that_the_encoding_does_not_have_is_printed_all_the_same(tmp_path):
    output = tmp_path / "ö \udcff.hpp"
    ended = subprocess.run(
        [*EXPORT, MODEL, "--to", "cpp", "-o", output],
        env=os.environ | {"PYTHONIOENCODING": "ascii"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (ended.returncode, ended.stderr) == (0, "")
    assert "\\xf6 \\udcff.hpp" in ended.stdout
    assert output.exists()


def run_while_it_imports(folder, stand_in, package, program, begin=""):
    """Run a program that finds a module of the test in place of what it imports first."""
    for name in ("numpy", "rclpy", "geometry_msgs"):
        (folder / f"{name}.py").write_text(stand_in)
    command = f"{begin}import sys; from limit_surface_ros.runtime import {package}; "
    command += f"sys.exit({package}.{program}())"
    paths = os.pathsep.join([str(folder), str(REPOSITORY), os.environ.get("PYTHONPATH", "")])
    return subprocess.run(
        [sys.executable, "-c", command],
        env=os.environ | {"PYTHONPATH": paths},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize("package", ["tools", "nodes"])
def test_an_interrupt_while_a_program_still_imports_is_told_in_one_line(tmp_path, package):
    program = {"tools": "fit_surface", "nodes": "demo"}[package]
    stand_in = (
        "import os, signal, time\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "os.kill(os.getpid(), signal.SIGINT)\n"
        "time.sleep(3600)\n"
    )
    ended = run_while_it_imports(tmp_path, stand_in, package, program)
    assert ended.returncode == 130
    assert ended.stderr == f"{program}: interrupted\n"


@pytest.mark.parametrize("number", runtime.ENDING)
@pytest.mark.parametrize("program", runtime.NODES)
def test_a_node_that_is_told_to_end_while_it_imports_ends_with_0(tmp_path, program, number):
    stand_in = f"import os, time; os.kill(os.getpid(), {int(number)}); time.sleep(3600)\n"
    begin = "import signal; signal.signal(signal.SIGHUP, signal.SIG_DFL); "
    ended = run_while_it_imports(tmp_path, stand_in, "nodes", program, begin)
    assert (ended.returncode, ended.stdout + ended.stderr) == (0, "")


def test_every_installed_program_starts_where_interrupts_are_quiet(monkeypatch):
    setuptools = pytest.importorskip("setuptools", reason="setuptools is not installed")
    given = {}
    monkeypatch.setattr(setuptools, "setup", lambda **options: given.update(options))
    monkeypatch.chdir(REPOSITORY)
    programs = runpy.run_path("setup.py")["PROGRAMS"]
    scripts = [script.split(" = ") for script in given["entry_points"]["console_scripts"]]
    assert len(scripts) == len(programs) > 0
    for name, place in scripts:
        run = EntryPoint(name, place, "console_scripts").load()
        assert run.func is runtime.run
        assert ".".join(run.args) == programs[name]
