# SPDX-License-Identifier: Apache-2.0
"""The demonstration: a table, exit code 0, no process left behind."""

from __future__ import annotations

import re

import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from node_helpers import Program


@pytest.fixture(scope="module")
def output():
    with Program("demo") as program:
        code, printed = program.ended()
    assert code == 0, printed
    return printed


def test_the_demonstration_prints_a_table_and_checks_it(output):
    assert len(re.findall(r"^.*\b(?:slides|sticks)\b.*e[-+]\d\d$", output, re.MULTILINE)) == 5
    assert "round trips agree" in output


def test_the_demonstration_shows_a_wrench_that_falls_until_friction_can_hold(output):
    rows = re.findall(
        r"^ *\d+\.\d{3}(?: +-?\d+\.\d{4}){3} +\d+\.\d{3}  (gives way|can hold)$",
        output,
        re.MULTILINE,
    )
    assert len(rows) == 8
    assert rows == sorted(rows, reverse=True)
    assert set(rows) == {"gives way", "can hold"}
    found, closed = re.search(r"hold it after (\S+) s; .* says (\S+) s", output).groups()
    assert float(found) == pytest.approx(float(closed), abs=1e-6)


def test_the_demonstration_pushes_the_body_along_a_path(output):
    rows = re.findall(r"^ +\d+\.\d{2}(?: +-?\d+\.\d{3}){3}  (\w[\w ]+)$", output, re.MULTILINE)
    assert rows[0] == "does not push"
    assert {"sticks", "slides left", "slides right"} & set(rows)
    assert "it ends where the batch of pushes says" in output


def test_nobody_is_waited_for_who_has_ended():
    from limit_surface_interfaces.srv import ListModels

    from limit_surface_ros.nodes.clients.service_client import ServiceClient

    with (
        ServiceClient("asks", patience=3600.0, alive=lambda: False) as client,
        pytest.raises(TimeoutError, match="there is no service /absent"),
    ):
        client.call(ListModels, "/absent", ListModels.Request())


def test_the_demonstration_shows_a_slide_that_ends(output):
    rows = re.findall(
        r"^ *\d+\.\d{3}((?: +-?\d+\.\d{4}){2} +-?\d+\.\d{3} +\d+\.\d{4})$", output, re.M
    )
    assert len(rows) == 8
    speeds = [float(row.split()[-1]) for row in rows]
    assert speeds[0] == speeds[-1] == 0.0
    assert max(speeds) > 0.1
    rests, held = (
        float(re.search(rf"{words} after (\S+) s", output)[1]) for words in ("it rests", "hold it")
    )
    assert rests > held
