# SPDX-License-Identifier: Apache-2.0
"""The promise of a release: every place states one version, and the upgrade notes name what is."""

from __future__ import annotations

import re
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import limit_surface_ros

ROOT = Path(__file__).resolve().parents[2]
UPGRADE = ROOT / "docs" / "how_to" / "upgrade_to_0_2.md"
PLACES = {
    "package.xml": r"<version>(.+)</version>",
    "limit_surface_interfaces/package.xml": r"<version>(.+)</version>",
    "examples/cpp_client/package.xml": r"<version>(.+)</version>",
    "setup.py": r'version="(.+)"',
    "CITATION.cff": r"(?m)^version: (.+)$",
    # The newest release stands first.
    "CHANGELOG.rst": r"(?m)^(\d+\.\d+\.\d+) \(",
}


def test_every_place_states_the_version_of_the_package():
    stated = {
        place: re.search(pattern, (ROOT / place).read_text(encoding="utf-8"))[1]
        for place, pattern in PLACES.items()
    }
    assert set(stated.values()) == {limit_surface_ros.__version__}, stated


def test_the_newest_release_and_its_citation_have_one_date():
    changes = (ROOT / "CHANGELOG.rst").read_text(encoding="utf-8")
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    dated = re.search(r"(?m)^\d+\.\d+\.\d+ \((.+)\)$", changes)[1]
    assert re.search(r"(?m)^date-released: (.+)$", citation)[1] == dated


def modules_of_the_table():
    """Return what the table of moved modules names on its right-hand side, whole."""
    rows = UPGRADE.read_text(encoding="utf-8").partition("## Moved modules")[2]
    for row in re.findall(r"(?m)^\| `(?:.+?) \| (.+) \|$", rows):
        package = ""
        for name in re.findall(r"`([\w.]+)`", row):
            package = package if name.startswith(".") else name.rpartition(".")[0]
            yield f"{package}{name}" if name.startswith(".") else name


def test_modules_that_moved_are_where_the_upgrade_notes_say():
    names = list(modules_of_the_table())
    assert len(names) > 20
    for name in names:
        package, _, member = f"limit_surface_ros.{name}".rpartition(".")
        there = find_spec(package)
        assert there is not None, name
        if there.submodule_search_locations is None:
            assert hasattr(import_module(package), member), name
        else:
            assert find_spec(f"{package}.{member}") is not None, name
