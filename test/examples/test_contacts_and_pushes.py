# SPDX-License-Identifier: Apache-2.0
"""The promise of examples/contacts, examples/pushes and the gallery: programs make all of it."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest

from limit_surface_ros.files.contact_file import read_contact
from limit_surface_ros.files.pushes_csv import read_pushes
from limit_surface_ros.surface.measures import mean_angle

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
CONTACTS = sorted((EXAMPLES / "contacts").glob("*.yaml"))


def program(path):
    """Return the names of an example program, which is not run."""
    return runpy.run_path(str(EXAMPLES / path))


@pytest.mark.parametrize("path", CONTACTS, ids=lambda path: path.stem)
def test_a_contact_is_read_without_a_doubt_and_stands_in_the_gallery(path):
    contact = read_contact(path)
    assert contact.name == path.stem
    assert not contact.doubts
    page = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    assert f"literalinclude}} ../examples/contacts/{path.name}" in page
    assert f"images/gallery/{path.stem}.png" in page
    assert (ROOT / f"docs/images/gallery/{path.stem}.png").is_file()


def test_the_pushes_are_what_their_program_makes_and_mostly_true(tmp_path):
    program("pushes/make_pushes.py")["main"](tmp_path / "again.csv")
    kept = read_pushes(EXAMPLES / "pushes" / "l_shape.csv")
    made = read_pushes(tmp_path / "again.csv")
    np.testing.assert_allclose(made.pairs.wrenches, kept.pairs.wrenches, atol=2e-5)
    np.testing.assert_allclose(made.pairs.twists, kept.pairs.twists, atol=2e-5)
    body = read_contact(EXAMPLES / "contacts" / "l_shape.yaml").surface
    assert 2.0 < np.degrees(mean_angle(body, kept.pairs)) < 8.0


def test_the_bag_gives_pushes_of_the_body(tmp_path):
    pytest.importorskip("rosbags", reason="rosbags writes the bag")
    from limit_surface_ros.files.bag_pushes import read_bag_pushes

    program("pushes/make_bag.py")["main"](tmp_path / "bag", pushes=4)
    pairs = read_bag_pushes(tmp_path / "bag", "/wrench", "/pose").pairs
    body = read_contact(EXAMPLES / "contacts" / "l_shape.yaml").surface
    assert len(pairs) > 8
    assert np.degrees(mean_angle(body, pairs)) < 3.0


@pytest.mark.parametrize("name", ["stool", "gripper_pad"])
def test_the_gallery_draws_four_panels_of_a_contact(monkeypatch, name):
    pytest.importorskip("matplotlib", reason="matplotlib draws the pictures")
    gallery = program("gallery/make_gallery.py")
    monkeypatch.setitem(gallery["models_of"].__globals__, "MOTIONS", 60)
    figure = gallery["draw"](EXAMPLES / "contacts" / f"{name}.yaml")
    titles = [axes.get_title() for axes in figure.axes]
    assert titles[:2] == ["contact", "limit surface"]
    assert titles[3] == ("pushed along a path" if name == "stool" else "section $f_x$ = 0")
