# SPDX-License-Identifier: Apache-2.0
"""The help of each program tells what its files hold, and names the page that tells all of it."""

import importlib
import runpy

import pytest

from limit_surface_ros.tools.common.program import FILES_PAGE
from process_helpers import REPOSITORY


def programs(monkeypatch):
    """Return the modules of the programs, as setup.py names them."""
    setuptools = pytest.importorskip("setuptools", reason="setuptools is not installed")
    monkeypatch.setattr(setuptools, "setup", lambda **_: None)
    monkeypatch.chdir(REPOSITORY)
    return runpy.run_path("setup.py")["PROGRAMS"]


def test_every_program_that_reads_files_tells_what_they_hold(monkeypatch):
    assert (REPOSITORY / FILES_PAGE).is_file()
    tools = {n: m for n, m in programs(monkeypatch).items() if ".tools." in m}
    assert len(tools) > 8
    for name, module in tools.items():
        told = importlib.import_module(module).parser().format_help()
        assert "examples:" in told, name
        if name != "reproduce_thesis":
            assert FILES_PAGE in told, name
