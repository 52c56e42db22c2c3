# SPDX-License-Identifier: Apache-2.0
"""Few replies are kept for clients that are slow or have stopped where replies may be long."""

from __future__ import annotations

import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from decay_helpers import Bench
from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
from limit_surface_ros.nodes.serving.endpoints import WAITING, WAITING_LARGE

LONG = {"wrenches_to_twists", "twists_to_wrenches", "simulate_push", "simulate_pushes"}
LONG |= {"list_models", "describe_model", "evaluate", "predict_slide"}
SHORT = {"wrench_to_twist", "twist_to_wrench", "push", "time_to_level"}


@pytest.mark.parametrize("name", ["limit_surface", "decay"])
def test_replies_are_kept_by_how_long_they_may_be(ros, client_node, tmp_path, model_file, name):
    if name == "decay":
        node = Bench(ros, client_node, tmp_path, sim_time=False).node
    else:
        node = ros.add(LimitSurfaceNode, files=[model_file()[1]])
    kept = {each.srv_name.rpartition("/")[2]: each.qos_profile.depth for each in node.services}
    assert {kept[each] for each in LONG & kept.keys()} == {WAITING_LARGE}
    assert {kept[each] for each in SHORT & kept.keys()} == {WAITING}
