# SPDX-License-Identifier: Apache-2.0
"""Contact files: every description is read, and what is wrong is named."""

import numpy as np
import pytest

from limit_surface_ros.errors import FileError
from limit_surface_ros.files.contact_file import read_contact

PATCH = "schema: 1\nname: body\nfriction_coefficient: 0.5\nnormal_force: 10.0\ncells: 200\n"
POINTS = "schema: 1\nname: tripod\npoints: [[0, 0], [0.3, 0], [0, 0.3]]\n"


def read(tmp_path, text):
    path = tmp_path / "contact.yaml"
    path.write_text(text)
    return read_contact(path)


def test_support_points_are_read_about_their_centroid(tmp_path):
    model = read(tmp_path, POINTS + "friction_limits: [1, 2, 3]\n")
    np.testing.assert_allclose(model.reference_point, [0.1, 0.1])
    np.testing.assert_allclose(model.surface.points[0], [-0.1, -0.1])
    np.testing.assert_array_equal(model.surface.friction_limits, [1, 2, 3])
    assert model.surface.scaling.friction_force == 6.0


def test_support_points_may_state_the_weight_at_which_their_limits_hold(tmp_path):
    limits = POINTS + "friction_limits: [1, 2, 3]\n"
    assert read(tmp_path, limits).normal_force is None
    assert read(tmp_path, limits + "normal_force: 12.0\n").normal_force == 12.0


def test_a_given_reference_point_is_kept(tmp_path):
    model = read(tmp_path, POINTS + "friction_limits: [1, 2, 3]\nreference_point: [0, 0.3]\n")
    np.testing.assert_allclose(model.surface.points[2], [0, 0])


@pytest.mark.parametrize(
    "shape",
    [
        "{kind: polygon, vertices: [[0, 0], [1, 0], [0, 1]]}",
        "{kind: polygon, vertices: [[0, 0], [4, 0], [0, 4]], holes: [[[1, 1], [2, 1], [1, 2]]]}",
        "{kind: disc, radius: 0.1, centre: [1, 2], angle: 0.3}",
        "{kind: ring, inner_radius: 0.1, outer_radius: 0.2}",
        "{kind: ellipse, semi_axes: [0.1, 0.2]}",
        "{kind: rectangle, size: [0.1, 0.2]}",
        "{kind: line, start: [0, 0], end: [1, 1]}",
        "{kind: bitmap, pressures: [[1, 2, 3], [4, 5, 6]], cell: 0.01}",
    ],
)
def test_every_shape_carries_the_friction_of_its_weight(tmp_path, shape):
    model = read(tmp_path, f"{PATCH}shape: {shape}\n")
    assert model.surface.friction_limits.sum() == pytest.approx(5.0)
    assert model.normal_force == 10.0
    assert np.isfinite(model.surface.load_factor([1.0, 1.0, 0.01]))


@pytest.mark.parametrize(
    "pressure", ["{kind: linear, centre_of_pressure: [0.01, 0]}", "{kind: rim}", "{kind: centre}"]
)
def test_every_pressure_is_read(tmp_path, pressure):
    shape = "shape: {kind: disc, radius: 0.1}\n"
    limits = read(tmp_path, f"{PATCH}{shape}pressure: {pressure}\n").surface.friction_limits
    assert limits.max() > 1.05 * read(tmp_path, PATCH + shape).surface.friction_limits.max()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (PATCH, "either `points` or a `shape`"),
        (POINTS, "friction_limits: missing; it must be an array of 3 numbers"),
        (POINTS + "friction_limits: [1, -1, 1]\n", r"friction_limits\[1\]: must be at least 0"),
        (POINTS.replace("0.3]", "1.0e+101]"), r"points\[2\]\[1\]: must be at most 1e\+100"),
        (
            POINTS + "reference_point: centre\n",
            r"reference_point: must be centroid, or \[x, y\] in metres, got 'centre'",
        ),
        ("kind: dissipation\n" + POINTS, "kind: this is a surface model: plot_surface draws it"),
        ("kind: exponential_sum\nrates: [[-1, 0]]\n", "this is a decay model: plot_decay draws"),
        (
            PATCH.replace("200", "100000000") + "shape: {kind: disc, radius: 1}\n",
            "cells: must be a whole number from 1 to 1000000, got 100000000",
        ),
        (POINTS + "friction_limits: [1, 2]\n", "friction_limits: must be an array of 3"),
        (POINTS + "friction_limits: [0, 0, 0]\n", "friction_limits: .* above 0"),
        (
            POINTS + "friction_limits: [1, 1, 1]\nnormal_force: 0\n",
            "normal_force: must be above 0",
        ),
        (POINTS + "friction_limits: [1, 1, 1]\ncolour: red\n", "colour: is not known"),
        (PATCH + "shape: {kind: star}\n", r"shape.kind: must be one of polygon, .* bitmap"),
        (PATCH + "shape: {kind: disc, radius: -1}\n", "shape.radius: must be above 0"),
        (PATCH + "shape: {kind: disc, radius: 1, size: 2}\n", "shape.size: is not known"),
        (
            PATCH + "shape: {kind: polygon, vertices: [[0, 0], [1, 1], [1, 0], [0, 1]]}\n",
            "shape: the polygon is not simple",
        ),
        (
            PATCH + "shape: {kind: disc, radius: 1}\n"
            "pressure: {kind: linear, centre_of_pressure: [0.9, 0]}\n",
            "pressure: .*would lift",
        ),
        (PATCH + "shape: {kind: bitmap, pressures: [], cell: 1}\n", "pressures: must be an array"),
    ],
)
def test_errors_name_the_key_and_what_is_accepted(tmp_path, text, message):
    with pytest.raises(FileError, match=message):
        read(tmp_path, text)
