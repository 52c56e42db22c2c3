# SPDX-License-Identifier: Apache-2.0
"""Launch files in Python and XML declare the same arguments and start programs that exist.

`launch` is not on the Python package index: where it is absent, the files are read as text.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from limit_surface_ros.nodes.decay_node import DecayNode
from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode

ROOT = Path(__file__).resolve().parents[2]
XML_FILES = sorted((ROOT / "launch").glob("*.xml"))
PROGRAMS = set(re.findall(r'"(\w+)": "limit_surface_ros\.', (ROOT / "setup.py").read_text()))


@pytest.mark.parametrize("path", XML_FILES, ids=lambda path: path.name)
def test_xml_declares_each_argument_that_it_uses_and_starts_a_program_that_exists(path):
    root = ElementTree.parse(path).getroot()
    declared = {argument.get("name") for argument in root.iter("arg")}
    used = set(re.findall(r"\$\(var (\w+)\)", path.read_text()))
    assert used == declared
    assert {node.get("exec") for node in root.iter("node")} <= PROGRAMS
    for config in re.findall(r"limit_surface_ros\)/(config/\w+\.yaml)", path.read_text()):
        assert yaml.safe_load((ROOT / config).read_text())


def tables():
    """Return the constants of the module that the launch files share, without `launch`."""
    tree = ast.parse((ROOT / "launch" / "limit_surface_launching.py").read_text())
    found = {}
    for node in tree.body:
        if isinstance(node, ast.Assign):
            found[node.targets[0].id] = ast.literal_eval(node.value)
    return found


@pytest.mark.parametrize("path", XML_FILES, ids=lambda path: path.name)
def test_the_xml_file_declares_the_arguments_of_the_python_file_and_hands_all_of_them_on(path):
    root = ElementTree.parse(path).getroot()
    (include,) = root.iter("include")
    assert include.get("file").endswith(f"/launch/{path.with_suffix('.py').name}")
    handed_on = {argument.get("name"): argument.get("value") for argument in include}
    declared = {argument.get("name"): argument for argument in root.findall("arg")}
    assert handed_on == {name: f"$(var {name})" for name in declared}
    tree = ast.parse(path.with_suffix(".py").read_text())
    (call,) = (
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "description"
    )
    program, nodes, lists = (ast.literal_eval(argument) for argument in call.args)
    assert program in PROGRAMS
    shared = tables()
    topics = {**shared["SHARED_TOPICS"]}
    for node in nodes:
        topics |= shared["TOPICS"][node]
    assert set(declared) == {*shared["COMMON"], *lists, *topics}
    for name, topic in topics.items():
        assert declared[name].get("default") == topic


@pytest.mark.parametrize("name", ["limit_surface", "decay"])
def test_every_topic_of_a_node_has_an_argument(ros, name):
    node = ros.add({"limit_surface": LimitSurfaceNode, "decay": DecayNode}[name])
    own = node.get_name(), node.get_namespace()
    found = [
        topic.replace(f"/{name}/", "~/")
        for topics in (
            node.get_publisher_names_and_types_by_node(*own),
            node.get_subscriber_names_and_types_by_node(*own),
        )
        for topic, _ in topics
        if topic.startswith(f"/{name}/")
    ]
    assert set(tables()["TOPICS"][name].values()) == set(found)


@pytest.mark.parametrize("path", XML_FILES, ids=lambda path: path.name)
def test_the_python_file_starts_the_same_program(path):
    tree = ast.parse(path.with_suffix(".py").read_text())
    words = {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant)}
    started = {node.get("exec") for node in ElementTree.parse(path).getroot().iter("node")}
    assert started <= words


@pytest.mark.parametrize("path", XML_FILES, ids=lambda path: path.name)
def test_launch_reads_both_files_and_finds_the_same_arguments(path):
    sources = pytest.importorskip("launch.launch_description_sources", reason="no launch here")
    pytest.importorskip("launch_ros", reason="no launch_ros here")
    pytest.importorskip("launch_xml", reason="no launch_xml here")
    names = []
    for file in (path, path.with_suffix(".py")):
        description = sources.AnyLaunchDescriptionSource(
            str(file)
        ).try_get_launch_description_without_context()
        names.append({argument.name for argument in description.get_launch_arguments()})
    assert names[0] == names[1]
