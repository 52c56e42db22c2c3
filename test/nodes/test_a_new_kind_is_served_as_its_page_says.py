# SPDX-License-Identifier: Apache-2.0
"""The page on new kinds, followed to the letter: its kind is read, served, drawn and compared."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from limit_surface_interfaces.msg import ErrorCode
from limit_surface_interfaces.srv import ListModels, WrenchToTwist
from rclpy.qos import DurabilityPolicy, QoSProfile
from visualization_msgs.msg import Marker, MarkerArray

from limit_surface_ros.files.surface_file import read_surface_model, write_surface_model
from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
from limit_surface_ros.surface.kinds import KINDS
from limit_surface_ros.tools import compare_surfaces
from node_helpers import planar_twist, wrench_message

PAGE = Path(__file__).resolve().parents[2] / "docs/how_to/add_a_model_kind.md"
LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
CONTACT = """schema: 1
name: triangle
points: [[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]]
friction_limits: [0.5, 0.5, 0.5]
"""


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```$", PAGE.read_text(), re.MULTILINE | re.DOTALL)


@pytest.fixture
def box(tmp_path, monkeypatch):
    """The page's model file, with its Python run: its kind is known until the test ends."""
    monkeypatch.setitem(KINDS, "box", None)
    del KINDS["box"]
    module = tmp_path / "box.py"
    module.write_text("".join(blocks("python")))
    spec = importlib.util.spec_from_file_location("box", module)
    loaded = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "box", loaded)
    spec.loader.exec_module(loaded)
    (text,) = blocks("yaml")
    path = tmp_path / "box.yaml"
    path.write_text(text)
    return path


def test_its_file_is_read_and_written_again(box, tmp_path):
    model = read_surface_model(box)
    assert type(model.surface) is KINDS["box"]
    assert model.convexity.proved
    copy = tmp_path / "copy.yaml"
    write_surface_model(model, copy)
    np.testing.assert_array_equal(read_surface_model(copy).surface.limits, [1.0, 1.0, 0.5])


def test_it_is_served_listed_and_drawn(ros, client_node, box):
    surface = read_surface_model(box).surface
    ros.add(LimitSurfaceNode, files=[box], parameters={"marker_rate": 50.0})
    ask = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
    wrench = [7.0, 1.0, 0.1]
    answer = ask(WrenchToTwist.Request(wrench=wrench_message(wrench)))
    assert answer.error_code == ErrorCode.NONE, answer.error_msg
    np.testing.assert_allclose(planar_twist(answer.twist), surface.twist_of_wrench(wrench))
    models = ros.client(client_node, ListModels, "/limit_surface/list_models")
    (info,) = models(ListModels.Request()).models
    assert (info.name, info.kind, info.convex) == ("crate", "box", True)
    messages = ros.listen(client_node, MarkerArray, "/limit_surface/surface", LATCHED)

    def mesh():
        return [
            marker
            for message in messages
            for marker in message.markers
            if marker.ns == "surface" and marker.action == Marker.ADD
        ]

    ros.wait(mesh)
    assert len(mesh()[0].points) > 100


def test_it_is_compared_with_other_kinds(box, tmp_path, capsys):
    contact = tmp_path / "contact.yaml"
    contact.write_text(CONTACT)
    few = ["--motions", "60", "--facet-loads", "0", "--workers", "1"]
    assert compare_surfaces.main([str(contact), "--models", str(box), *few]) == 0
    row = capsys.readouterr().out.splitlines()[-1].split()
    assert row[:3] == ["box", "box", "3"]


def test_a_second_kind_of_the_same_name_is_refused(box):
    from limit_surface_ros.errors import RangeError
    from limit_surface_ros.surface.kinds import register

    class Other(KINDS["box"]):
        pass

    with pytest.raises(RangeError, match="there is a kind 'box' already: Box"):
        register(Other)
