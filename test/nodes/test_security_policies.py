# SPDX-License-Identifier: Apache-2.0
"""The policies in config/security allow what the nodes' own graph holds, and nothing else."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from limit_surface_ros.nodes.decay_node import DecayNode
from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode

FOLDER = Path(__file__).parents[2] / "config" / "security"
# What a node uses only with tf2 installed, or with simulated time.
SOMETIMES = {("topics", "subscribe", name) for name in ("/tf", "/tf_static", "/clock")}
NODES = {"limit_surface": LimitSurfaceNode, "decay": DecayNode}


def used_by(node):
    """Return what a node publishes, subscribes to, serves and calls."""
    own = node.get_name(), node.get_namespace()
    services = "services"
    found = {
        ("topics", "publish"): node.get_publisher_names_and_types_by_node(*own),
        ("topics", "subscribe"): node.get_subscriber_names_and_types_by_node(*own),
        (services, "reply"): node.get_service_names_and_types_by_node(*own),
        (services, "request"): node.get_client_names_and_types_by_node(*own),
    }
    return {(*kind, name) for kind, entries in found.items() for name, _ in entries}


def allowed_by(path, name):
    """Return what a policy allows a node of that name in the root namespace."""
    (profile,) = ElementTree.parse(path).getroot().iter("profile")
    assert (profile.get("ns"), profile.get("node")) == ("/", name)
    found = set()
    for rules in profile:
        ((action, verdict),) = rules.items()
        assert verdict == "ALLOW"
        for entry in rules:
            text = entry.text.strip()
            full = f"/{name}/{text[2:]}" if text.startswith("~/") else f"/{text.lstrip('/')}"
            found.add((rules.tag, action, full))
    return found


@pytest.mark.parametrize("name", NODES)
def test_a_policy_allows_what_its_node_uses_and_nothing_else(ros, name):
    node = ros.add(NODES[name])
    ros.wait(lambda: ("services", "reply", f"/{name}/reload") in used_by(node))
    allowed = allowed_by(FOLDER / f"{name}.policy.xml", name)
    assert allowed - SOMETIMES == used_by(node) - SOMETIMES
    assert allowed >= SOMETIMES


def test_the_files_are_named_after_their_nodes():
    assert {path.name.removesuffix(".policy.xml") for path in FOLDER.glob("*.xml")} == set(NODES)
