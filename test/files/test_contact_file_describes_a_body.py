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


def test_feet_under_a_centre_of_mass_have_loads_by_statics(tmp_path):
    model = read(
        tmp_path,
        POINTS + "friction_coefficient: 0.5\nnormal_force: 12.0\ncentre_of_mass: [0.15, 0.1]\n",
    )
    np.testing.assert_allclose(model.surface.friction_limits, [1.0, 3.0, 2.0])
    assert (model.normal_force, model.load_method, model.of_points) == (12.0, "statics", True)


def test_feet_may_state_their_loads(tmp_path):
    model = read(tmp_path, POINTS + "friction_coefficient: 0.5\nloads: [1, 2, 3]\n")
    np.testing.assert_allclose(model.surface.friction_limits, [0.5, 1.0, 1.5])
    assert (model.normal_force, model.load_method) == (6.0, None)


def test_four_feet_share_the_weight_as_springs_and_say_so(tmp_path):
    four = POINTS.replace("[0, 0.3]]", "[0, 0.3], [0.3, 0.3]]")
    body = four + "friction_coefficient: 0.5\nnormal_force: 8.0\ncentre_of_mass: [0.15, 0.15]\n"
    model = read(tmp_path, body)
    np.testing.assert_allclose(model.surface.friction_limits, [1.0] * 4)
    assert "least norm" in model.load_method
    stiff = read(tmp_path, body + "stiffnesses: [3, 1, 1, 3]\n")
    np.testing.assert_allclose(stiff.surface.friction_limits, [1.5, 0.5, 0.5, 1.5])
    assert "given stiffnesses" in stiff.load_method


@pytest.mark.parametrize(
    ("stated", "symmetry", "doubts"),
    [
        ("", ("x", "y"), 0),
        ("symmetry: auto\n", ("x", "y"), 0),
        ("symmetry: none\n", (), 0),
        ("symmetry: [y]\n", ("y",), 0),
    ],
)
def test_a_box_is_symmetric_unless_the_file_says_otherwise(tmp_path, stated, symmetry, doubts):
    model = read(tmp_path, PATCH + "shape: {kind: rectangle, size: [0.12, 0.07]}\n" + stated)
    assert model.symmetry == symmetry
    assert len(model.doubts) == doubts


def test_symmetry_that_the_contact_has_not_is_doubted(tmp_path):
    turned = PATCH + "shape: {kind: rectangle, size: [0.12, 0.07], angle: 0.3}\n"
    assert read(tmp_path, turned).symmetry == ()
    model = read(tmp_path, turned + "symmetry: [x]\n")
    assert model.symmetry == ("x",)
    assert "not its own mirror image about the x axis" in model.doubts[0]


@pytest.mark.parametrize(
    ("text", "doubt"),
    [
        (
            PATCH + "shape: {kind: rectangle, size: [120, 70]}\n",
            "37.1 m from the reference point: are the lengths in metres",
        ),
        (
            PATCH.replace("0.5", "35") + "shape: {kind: disc, radius: 0.1}\n",
            "friction coefficient of 35 is more than rubber has",
        ),
        (
            PATCH + "shape: {kind: rectangle, size: [0.12, 0.07], angle: 45}\n",
            "angle of 45 rad is more than a turn: is it in degrees",
        ),
        (
            POINTS.replace("0.3", "300.0") + "friction_limits: [1, 1, 1]\n",
            "are the lengths in metres",
        ),
    ],
)
def test_what_looks_like_other_units_is_doubted(tmp_path, text, doubt):
    (found,) = read(tmp_path, text).doubts
    assert doubt in found


def test_an_ordinary_contact_is_not_doubted(tmp_path):
    assert read(tmp_path, PATCH + "shape: {kind: disc, radius: 0.1, angle: 6}\n").doubts == ()


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
        (
            POINTS + "friction_coefficient: 0.5\nnormal_force: 1.0\n",
            "loads: missing; beside points and friction_coefficient stand either the loads",
        ),
        (
            POINTS + "friction_coefficient: 0.5\nnormal_force: 1.0\ncentre_of_mass: [1, 1]\n",
            "centre_of_mass: .*would tip over",
        ),
        (
            PATCH + "symmetry: [z]\nshape: {kind: disc, radius: 1}\n",
            "symmetry: must be auto, none, or a list of the axes x and y",
        ),
        (
            PATCH + "shape: {kind: rectangle, size: [0.1, 1.0e+23]}\n",
            "size must be from 1e-09 to",
        ),
        (
            PATCH + "shape: {kind: rectangle, size: [1.0e-150, 0.2]}\npressure: {kind: rim}\n",
            "size must be from 1e-09 to",
        ),
        (POINTS + "friction_limits: [1, 2]\n", "friction_limits: must be an array of 3"),
        (POINTS + "friction_limits: [0, 0, 0]\n", "friction_limits: .* above 0"),
        (
            POINTS + "friction_limits: [1, 1, 1]\nnormal_force: 0\n",
            "normal_force: must be above 0",
        ),
        (POINTS + "friction_limits: [1, 1, 1]\ncolour: red\n", "colour: is not known"),
        (
            PATCH + "shape: {kind: disc, radius: 1}\ncentre_of_mass: [0, 0]\n",
            "linear, centre_of_pr",
        ),
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


def test_keys_that_are_accepted_are_each_listed_once(tmp_path):
    with pytest.raises(FileError, match=r"accepted are schema, .*symmetry, outline") as error:
        read(tmp_path, PATCH.replace("cells", "cels") + "shape: {kind: disc, radius: 1}\n")
    listed = str(error.value).split("accepted are ")[1].split(", ")
    assert len(set(listed)) == len(listed)
