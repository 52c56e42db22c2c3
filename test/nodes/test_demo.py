"""The demonstration: a table, exit code 0, no process left behind."""

from __future__ import annotations

import re

import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from node_helpers import Program


def test_the_demonstration_prints_a_table_and_checks_it():
    with Program("demo") as program:
        code, output = program.ended()
    assert code == 0, output
    assert len(re.findall(r"^.*\b(?:slides|sticks)\b.*e[-+]\d\d$", output, re.MULTILINE)) == 5
    assert "round trips agree" in output
