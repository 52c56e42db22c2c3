# SPDX-License-Identifier: Apache-2.0
"""The help of the programs with nodes says what they do, what can be asked, and where more is."""

from __future__ import annotations

import importlib
import re
import subprocess
import sys

import pytest

from process_helpers import REPOSITORY

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

# What every node of rclpy has.
STANDARD = re.compile(r"parameter|get_type_description")


@pytest.mark.parametrize("name", ["limit_surface", "decay"])
def test_the_help_names_what_the_policy_allows_and_nothing_else(name):
    told = importlib.import_module(f"limit_surface_ros.nodes.{name}_node").HELP
    policy = (REPOSITORY / "config" / "security" / f"{name}.policy.xml").read_text("utf-8")
    allowed = {each for each in re.findall(r">~/(\w+)<", policy) if not STANDARD.search(each)}
    assert len(allowed) > 12
    # The policies are those of nodes that do not learn.
    named = set(re.findall(r"~/(\w+)", told.partition("with learn:")[0]))
    assert named == allowed


@pytest.mark.parametrize(
    "name", ["limit_surface_node", "decay_node", "force_motion_nodes", "demo", "ask"]
)
def test_the_help_names_a_page_that_is_there(name):
    command = [sys.executable, "-m", f"limit_surface_ros.nodes.{name}", "--help"]
    told = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    pages = re.findall(r"docs/[\w/]+\.md", told)
    assert pages
    for page in pages:
        assert (REPOSITORY / page).is_file()
    if name == "force_motion_nodes":
        assert "~/push" in told
        assert "~/onset" in told
