# SPDX-License-Identifier: Apache-2.0
"""compare_surfaces: one table of models and kinds, pictures, and clear refusals."""

from dataclasses import replace

import numpy as np
import pytest

from catalogue_helpers import write_objects
from limit_surface_ros.files.surface_file import SurfaceModel, write_surface_model
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.polynomial import Polynomial
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling
from limit_surface_ros.tools import fit_surface
from limit_surface_ros.tools.compare_surfaces import main

CONTACT = """schema: 1
name: triangle
points: [[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]]
friction_limits: [0.5, 0.5, 0.5]
"""


@pytest.fixture
def contact(tmp_path):
    path = tmp_path / "contact.yaml"
    path.write_text(CONTACT)
    return path


def rows(printed):
    return {line.split()[0]: line.split() for line in printed.splitlines()[2:] if line}


def test_files_and_kinds_stand_in_one_table(contact, tmp_path, capsys):
    model = tmp_path / "round.yaml"
    surface = PowerSum(np.eye(3)[None], [1.0], Scaling(0.08, 1.0))
    write_surface_model(SurfaceModel("round", surface), model)
    few = ["--motions", "300", "--facet-loads", "10", "--workers", "1"]
    fits = ["--fit", "thesis:2", "dissipation:3"]
    assert main([str(contact), "--models", str(model), *fits, *few]) == 0
    table = rows(capsys.readouterr().out)
    assert list(table) == ["round", "thesis:2", "dissipation:3"]
    angles = [float(cells[6]) for cells in table.values()]
    assert angles[0] > angles[1] > angles[2]
    assert [cells[2] for cells in table.values()] == ["6", "12", "18"]


def test_models_of_one_file_name_are_told_apart_by_their_folders(contact, tmp_path, capsys):
    paths = [tmp_path / folder / "model.yaml" for folder in ("first", "second")]
    for path, size in zip(paths, (1.0, 2.0), strict=True):
        path.parent.mkdir()
        surface = PowerSum(np.diag([1.0, size, 1.0])[None], [1.0], Scaling(0.08, 1.0))
        write_surface_model(SurfaceModel("model", surface), path)
    few = ["--motions", "50", "--facet-loads", "0", "--workers", "1"]
    assert main([str(contact), "--models", *map(str, paths), *few]) == 0
    assert list(rows(capsys.readouterr().out)) == [str(path) for path in paths]


def test_errors_of_loads_stand_beside_those_of_motions_in_one_unit(contact, tmp_path, capsys):
    exact = PointContacts([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]], [0.5, 0.5, 0.5])
    paths = [tmp_path / f"{name}.yaml" for name in ("exact", "small", "scaled")]
    scaled = replace(exact, scaling=Scaling(0.3, 7.0))
    for path, surface in zip(paths, (exact, exact.scaled(0.5), scaled), strict=True):
        write_surface_model(SurfaceModel(path.stem, surface), path)
    few = ["--motions", "200", "--facet-loads", "0", "--workers", "1"]
    assert main([str(contact), "--models", *map(str, paths), *few]) == 0
    table = rows(capsys.readouterr().out)
    worst = {name: float(cells[9]) for name, cells in table.items()}
    assert worst["exact"] == worst["scaled"] == 0.0
    assert worst["small"] > 0.2


@pytest.mark.parametrize(("frame", "point"), [("other", (0.0, 0.0)), ("object", (0.01, 0.0))])
def test_what_is_about_another_point_or_frame_is_not_compared(
    contact, tmp_path, capsys, frame, point
):
    model = tmp_path / "there.yaml"
    surface = PowerSum(np.eye(3)[None], [1.0], Scaling(0.08, 1.0))
    there = SurfaceModel("there", surface, frame_id=frame, reference_point=point)
    write_surface_model(there, model)
    assert main([str(contact), "--models", str(model)]) == 2
    error = capsys.readouterr().err
    assert f"contact.yaml is about ({0:g}, {0:g}) m in frame 'object'" in error
    assert f"there.yaml is about ({point[0]:g}, 0) m in frame '{frame}'" in error


def test_a_bootstrap_shows_its_spread(tmp_path, capsys):
    rng = np.random.default_rng(0)
    body = PointContacts([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]], [0.5, 0.5, 0.5])
    twists = rng.normal(size=(30, 3)) * [1, 1, 15]
    wrenches = body.wrench_of_twist(twists) * rng.normal(1.0, 0.1, size=(30, 3))
    path, model = tmp_path / "pushes.csv", tmp_path / "box.yaml"
    table = np.column_stack([wrenches, twists])
    np.savetxt(path, table, delimiter=",", header="fx_N,fy_N,tau_Nm,vx,vy,omega", comments="")
    few = ["--rows", "0-19", "--workers", "1"]
    arguments = [str(path), "-o", str(model), "--auto", "--bootstrap", "5", *few]
    assert fit_surface.main(arguments) == 0
    capsys.readouterr()
    assert main([str(path), "--models", str(model), "--fit", "thesis:1", *few]) == 0
    table = rows(capsys.readouterr().out)
    assert 0.1 < float(table["box"][10]) < 30.0
    assert table["thesis:1"][10] == "-"


def test_the_distributions_are_drawn(contact, tmp_path, capsys):
    pytest.importorskip("matplotlib", reason="the extra 'plots' is not installed")
    picture = tmp_path / "errors.png"
    few = ["--motions", "100", "--facet-loads", "5", "--workers", "1"]
    assert main([str(contact), "--fit", "thesis:1", "--picture", str(picture), *few]) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert str(picture) in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "nothing to compare"),
        (["--fit", "spline:3"], "got 'spline:3'"),
        (["--fit", "norms:x"], "got 'norms:x'"),
        (["--fit", "norms:0"], "a number of terms from 1 to 1000, such as norms:4; got 'norms:0'"),
        (["--fit", "auto:3"], "--fit auto takes no number of terms; got 'auto:3'"),
        (["--fit", "polynomial:3"], "--fit polynomial takes no number of terms"),
        (["--fit", "second:5"], "--fit second takes no number of terms"),
        (["--fit", "norms:2", "--auto"], "--auto does nothing here: it is written --fit auto"),
        (["--fit", "norms:2", "--folds", "3"], "--folds does nothing here: it is for --fit auto"),
        (["--fit", "norms:2", "--seed", "-1"], "--seed must be from 0"),
        (["--fit", "norms:2", "--picture", "x.foo"], "x.foo: cannot be written: must end in .png"),
        (["--fit", "norms:2", "--picture", "no/x.png"], "its folder does not exist"),
        (["--models", "none.yaml"], "none.yaml: cannot be read"),
    ],
)
def test_what_cannot_be_compared_is_refused(contact, capsys, arguments, message):
    assert main([str(contact), *arguments]) == 2
    assert message in capsys.readouterr().err


def test_data_that_cannot_be_read_as_asked_are_told_with_their_file(contact, tmp_path, capsys):
    write_objects(tmp_path / "pushes", 1)
    contact.write_text(contact.read_text().replace("0.08", "1.0e+99"))
    for data, options, message in (
        (tmp_path / "pushes" / "object_00.csv", ["--rows", "70"], "--rows: there is no row 70"),
        (contact, [], "the data make a characteristic length [m]"),
    ):
        assert main([str(data), "--fit", "thesis:1", *options]) == 2
        assert f"error: {data}: {message}" in capsys.readouterr().err


def test_a_model_that_is_not_convex_is_warned_of_in_one_plain_line(contact, tmp_path, capsys):
    dented = tmp_path / "dented.yaml"
    # x^4 + y^4 + m^4 + 12 x^2 y^2 bends inward.
    cross = [1, 0, 0, 12, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1]
    surface = Polynomial(cross, Scaling(0.08, 1.0))
    write_surface_model(SurfaceModel("dented", surface), dented)
    few = ["--motions", "20", "--facet-loads", "0"]
    assert main([str(contact), "--models", str(dented), *few]) == 0
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("compare_surfaces: warning: limit surface 'dented' is not convex")


def test_the_size_of_every_kind_is_how_many_numbers_define_it():
    points = PointContacts([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]], [0.5, 0.5, 0.5])
    assert points.size == 9
    assert points.dissipation().size == 18
    assert PowerSum(np.eye(3)[None], [1.0]).size == 6


def test_a_kind_that_the_data_cannot_support_is_left_out_with_its_reason(contact, capsys):
    few = ["--motions", "16", "--facet-loads", "0", "--workers", "1"]
    assert main([str(contact), "--fit", "thesis:1", "thesis:3", *few]) == 0
    printed = capsys.readouterr().out
    assert "left out: thesis:3: 16 pairs cannot determine 18 parameters" in printed
    assert "thesis:1 " in printed


def test_where_no_kind_can_be_fitted_nothing_is_drawn(contact, tmp_path, capsys):
    picture = tmp_path / "errors.png"
    few = ["--motions", "10", "--facet-loads", "0", "--workers", "1"]
    fits = ["--fit", "second", "norms:2"]
    assert main([str(contact), *fits, "--picture", str(picture), *few]) == 2
    error = capsys.readouterr().err
    assert "second: 10 pairs cannot determine 12 parameters" in error
    assert "norms:2: 10 pairs" in error
    assert not picture.exists()
