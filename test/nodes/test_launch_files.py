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
