# SPDX-License-Identifier: Apache-2.0
"""Small messages do not wait for seconds behind a long answer, and users' own settings stand."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from limit_surface_ros.nodes.serving import middleware


@pytest.fixture(autouse=True)
def elsewhere(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    for name in (middleware.VARIABLE, "FASTDDS_BUILTIN_TRANSPORTS"):
        monkeypatch.delenv(name, raising=False)


def test_nodes_are_made_with_the_settings_that_ship_and_children_do_not_inherit_them():
    with middleware.settings():
        text = Path(os.environ[middleware.VARIABLE]).read_text()
    assert "<heartbeatPeriod>" in text
    assert middleware.VARIABLE not in os.environ


def test_settings_of_the_user_are_left_alone(monkeypatch, tmp_path):
    monkeypatch.setenv(middleware.VARIABLE, "/of/the/user.xml")
    with middleware.settings():
        assert os.environ[middleware.VARIABLE] == "/of/the/user.xml"
    assert os.environ[middleware.VARIABLE] == "/of/the/user.xml"
    monkeypatch.delenv(middleware.VARIABLE)
    (tmp_path / "DEFAULT_FASTRTPS_PROFILES.xml").write_text("<profiles/>")
    with middleware.settings():
        assert middleware.VARIABLE not in os.environ
    (tmp_path / "DEFAULT_FASTRTPS_PROFILES.xml").unlink()
    monkeypatch.setenv("FASTDDS_BUILTIN_TRANSPORTS", "UDPv4")
    with middleware.settings():
        assert middleware.VARIABLE not in os.environ
