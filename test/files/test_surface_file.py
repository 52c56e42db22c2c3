# SPDX-License-Identifier: Apache-2.0
"""A surface model written and read back is the same; a file that is not one says why."""

import json

import numpy as np
import pytest

from limit_surface_ros.errors import FileError, RangeError
from limit_surface_ros.files.surface_file import (
    SurfaceModel,
    read_surface_model,
    write_surface_model,
)
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.polynomial import Polynomial
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling

RNG = np.random.default_rng(5)


def random_matrices(terms):
    factors = RNG.normal(size=(terms, 3, 3))
    return factors @ factors.transpose(0, 2, 1)


def surfaces():
    scaling = Scaling(0.1 / 3, 7.0 / 3)
    return [
        PowerSum(random_matrices(3), [1.0, 2 / 3, 1 / 3], scaling),
        Dissipation(random_matrices(2), scaling),
        PointContacts(RNG.normal(size=(3, 2)), [0.5, 0.1, 1 / 3], scaling),
        Polynomial([1, 0, 0, 1 / 3, 0, 1, 0, 0, 0, 0, 2, 0, 1, 0, 3], scaling),
    ]


@pytest.mark.parametrize("surface", surfaces(), ids=lambda surface: surface.kind)
def test_a_model_written_and_read_back_is_the_same_bit_for_bit(tmp_path, surface):
    model = SurfaceModel(
        "part", surface, "part_frame", (0.1, -0.2 / 3), 14.876, {"cost": 1e-7, "seed": 3}
    )
    write_surface_model(model, tmp_path / "part.yaml", header="made by a test")
    read = read_surface_model(tmp_path / "part.yaml")
    assert (read.name, read.frame_id, read.reference_point, read.normal_force, read.fit) == (
        model.name,
        model.frame_id,
        model.reference_point,
        model.normal_force,
        model.fit,
    )
    assert read.surface.scaling == surface.scaling
    twists = RNG.normal(size=(20, 3))
    assert np.array_equal(read.surface.wrench_of_twist(twists), surface.wrench_of_twist(twists))


@pytest.mark.parametrize("surface", surfaces(), ids=lambda surface: surface.kind)
def test_a_file_cut_short_anywhere_is_refused(tmp_path, surface):
    path = tmp_path / "part.yaml"
    write_surface_model(SurfaceModel("part", surface, fit={"seed": 3}), path)
    whole = path.read_text()
    for length in range(len(whole.rstrip())):
        path.write_text(whole[:length])
        with pytest.raises(FileError, match=r"part\.yaml: "):
            read_surface_model(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("schema: 1\n", "", "schema: missing; it must be one of 1"),
        ("kind: power_sum", "rates: [[-1.0, 0.0]]", "kind: this is a decay model: plot_decay"),
        ("schema: 1", "schema: 2", "schema: must be one of 1; got 2"),
        ("kind: power_sum", "kind: power", "kind: must be one of power_sum, .*; got 'power'"),
        ("name: part", "", "name: missing"),
        ("name: part", "name: 7", "name: must be a text that is not empty, got 7"),
        ("frame_id: object", "frame_id: ''", "frame_id: must be a text"),
        ("friction_force: 1.0", "friction_force: -1.0", "friction_force: must be at least 1e-12"),
        (
            "friction_force: 1.0",
            "friction_force: '1000'",
            "friction_force: '1000' is text; write it as the number 1000.0",
        ),
        ("terms: 1", "terms: 2", "matrices: must be an array of 2 x 3 x 3 numbers"),
        ("exponents: [1.0]", "exponents: [1.0, 0.5]", "exponents: must be an array of 1"),
        ("exponents: [1.0]", "exponents: [1.5]", "power_sum: .*exponent"),
        ("[0.0, 0.0, 1.0]", "[0.0, 0.0, -1.0]", "power_sum: .*semidefinite"),
        ("[0.0, 0.0, 1.0]", "[0.0, 0.0, .nan]", r"matrices\[0\]\[2\]\[2\]: must be finite"),
        ("terms: 1", "terms: 1\nmatrix: 3", "matrix: is not known here"),
        ("terms: 1", "terms: 1\nnormal_force: 0.0", "normal_force: must be above 0.0"),
        ("terms: 1", "terms: 1\nfit: 3", "fit: must be a mapping"),
    ],
)
def test_a_fault_in_a_file_is_named_with_its_key(tmp_path, old, new, message):
    path = tmp_path / "part.yaml"
    write_surface_model(SurfaceModel("part", PowerSum(np.eye(3)[None], [1.0])), path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(FileError, match=f"part.yaml: {message}"):
        read_surface_model(path)


def test_a_model_without_a_name_or_with_a_weight_of_zero_is_refused():
    surface = PowerSum(np.eye(3)[None], [1.0])
    with pytest.raises(RangeError, match="name must not be empty"):
        SurfaceModel(" ", surface)
    with pytest.raises(RangeError, match="normal_force must be a finite number above 0"):
        SurfaceModel("part", surface, normal_force=0.0)


@pytest.mark.parametrize("text", ["n" * 201, "line\nbreak", "bell\a"])
def test_names_that_lists_and_logs_cannot_show_are_refused(tmp_path, text):
    surface = PowerSum(np.eye(3)[None], [1.0])
    with pytest.raises(RangeError, match="name must have at most 200 characters, all of which"):
        SurfaceModel(text, surface)
    with pytest.raises(RangeError, match="frame_id must have at most 200"):
        SurfaceModel("part", surface, frame_id=text)
    path = tmp_path / "part.yaml"
    write_surface_model(SurfaceModel("part", surface), path)
    path.write_text(path.read_text().replace("name: part", f"name: {json.dumps(text)}"))
    with pytest.raises(FileError, match=r"part\.yaml: name: must have at most 200") as raised:
        read_surface_model(path)
    assert len(str(raised.value)) < 1000
