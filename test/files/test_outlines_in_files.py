# SPDX-License-Identifier: Apache-2.0
"""Outlines of bodies in model and contact files: written, read back, refused with their place."""

import numpy as np
import pytest

from limit_surface_ros.errors import FileError
from limit_surface_ros.files.contact_file import read_contact
from limit_surface_ros.files.surface_file import (
    SurfaceModel,
    read_surface_model,
    write_surface_model,
)
from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.motion.round_outlines import Ellipse, SmoothCurve
from limit_surface_ros.surface.kinds.power_sum import PowerSum

SURFACE = PowerSum.thesis([np.eye(3)])
POINTS = np.array([[0.06, 0.0], [0.04, 0.05], [-0.05, 0.04], [-0.02, 0.01], [-0.05, -0.04]])
PATCH = """schema: 1
name: patch
friction_coefficient: 0.3
normal_force: 10.0
cells: 50
shape: {kind: rectangle, size: [0.1, 0.06], centre: [0.01, 0.0], angle: 0.5}
"""


@pytest.mark.parametrize(
    "outline", [Polygon(POINTS), SmoothCurve(POINTS), Ellipse([0.05, 0.03], [0.01, 0.02], 0.3)]
)
def test_an_outline_is_read_back_bit_for_bit(tmp_path, outline):
    path = tmp_path / "model.yaml"
    write_surface_model(SurfaceModel("body", SURFACE, outline=outline), path)
    found = read_surface_model(path).outline
    assert type(found) is type(outline)
    np.testing.assert_array_equal(found.drawn(), outline.drawn())
    write_surface_model(SurfaceModel("body", SURFACE, outline=found), tmp_path / "again.yaml")
    assert (tmp_path / "again.yaml").read_text() == path.read_text()


def test_a_model_without_an_outline_has_none(tmp_path):
    write_surface_model(SurfaceModel("body", SURFACE), tmp_path / "model.yaml")
    assert "outline" not in (tmp_path / "model.yaml").read_text()
    assert read_surface_model(tmp_path / "model.yaml").outline is None


@pytest.mark.parametrize(
    ("outline", "message"),
    [
        ("{kind: polygon, vertices: [[0, 0], [2, 2], [2, 0], [0, 1]]}", "cross"),
        ("{kind: polygon, vertices: [[0, 0], [1, 0]]}", "three"),
        ("{kind: polygon, points: [[0, 0], [1, 0], [1, 1]]}", "vertices"),
        ("{kind: star}", "kind"),
        ("{kind: ellipse, semi_axes: [0.1, -0.1]}", "semi_axes"),
        ("{kind: disc, radius: 0.1, size: 3}", "size"),
        ("[[0, 0], [1, 0], [1, 1]]", "mapping"),
    ],
)
def test_what_is_no_outline_is_refused_with_its_place(tmp_path, outline, message):
    path = tmp_path / "model.yaml"
    write_surface_model(SurfaceModel("body", SURFACE), path)
    text = path.read_text().replace("terms:", f"outline: {outline}\nterms:")
    path.write_text(text)
    with pytest.raises(FileError, match=message) as caught:
        read_surface_model(path)
    assert "outline" in str(caught.value)


def test_the_outline_of_a_contact_is_the_rim_of_its_shape_unless_given(tmp_path):
    path = tmp_path / "contact.yaml"
    path.write_text(PATCH)
    outline = read_contact(path).outline
    assert isinstance(outline, Polygon)
    c, s = np.cos(0.5), np.sin(0.5)
    corner = np.array([c * 0.05 - s * 0.03 + 0.01, s * 0.05 + c * 0.03])
    assert np.linalg.norm(outline.vertices - corner, axis=1).min() < 1e-15
    path.write_text(PATCH + "outline: {kind: disc, radius: 0.2}\n")
    given = read_contact(path).outline
    assert isinstance(given, Ellipse)
    assert given.semi_axes.tolist() == [0.2, 0.2]
