# SPDX-License-Identifier: Apache-2.0
"""fit_surface: from data to a model file, or one clear line and no file."""

import json
import os
import re
import signal
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from limit_surface_ros.files.pushes_csv import read_pushes
from limit_surface_ros.files.surface_file import read_surface_model
from limit_surface_ros.fitting.few_pushes.bootstrap import surfaces_of
from limit_surface_ros.fitting.few_pushes.calibration import squared_residuals
from limit_surface_ros.fitting.result import Errors, FitResult
from limit_surface_ros.surface.kinds.dissipation_scatter import region_quantile
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.measures import mean_angle
from limit_surface_ros.surface.sampling import random_motions
from limit_surface_ros.surface.scaling import Scaling
from limit_surface_ros.tools.fit_surface import main, starts_in_words
from process_helpers import group_is_gone, started, until

RECORDED = Path(__file__).parents[3] / "shared" / "data" / "pushing"
TRIANGLE = PointContacts(
    np.array([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]]), np.full(3, 0.5), Scaling(0.15)
)


@pytest.fixture
def pushes(tmp_path):
    """A CSV of 60 exact pushes of the triangle."""
    pairs = random_motions(TRIANGLE, 60, 0)
    rows = np.hstack([pairs.wrenches, pairs.twists])
    lines = ["fx_N,fy_N,tau_Nm,vx,vy,omega", *(",".join(map(repr, row.tolist())) for row in rows)]
    path = tmp_path / "pushes.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def with_reversed_load(row):
    """Return a row of a CSV with the wrench that the body exerts on the pusher."""
    cells = row.split(",")
    return ",".join([*(repr(-float(cell)) for cell in cells[:3]), *cells[3:]])


def test_a_model_is_fitted_and_written_with_its_history(pushes, tmp_path, capsys):
    output = tmp_path / "model.yaml"
    arguments = [str(pushes), "-o", str(output), "--terms", "2", "--rows", "0-39", "--starts", "4"]
    assert main(arguments) == 0
    printed = capsys.readouterr().out
    for word in ("cost", "training", "held out", "time"):
        assert word in printed
    model = read_surface_model(output)
    assert model.name == "model"
    assert model.fit["held_out"]["pairs"] == 20
    assert model.fit["objective"] == "J2, velocity weight 1"
    assert f"fit_surface {pushes}" in output.read_text().splitlines()[0]
    test = random_motions(TRIANGLE, 500, 1)
    assert np.degrees(mean_angle(model.surface, test)) < 8.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda lines: [lines[0].replace("vx", "speed"), *lines[1:]], "column vx is missing"),
        (lambda lines: [*lines[:5], "a" + lines[5], *lines[6:]], "line 6: column fx_N"),
        (
            lambda lines: [*lines, "nan,1,1,1,1,1"],
            "line 62: column fx_N: 'nan' is no finite number",
        ),
        (lambda lines: lines[:10], "9 pairs cannot determine 18 parameters"),
        (lambda lines: [lines[0], *([lines[1]] * 60)], "all motions go in one direction"),
        (
            lambda lines: [lines[0], *map(with_reversed_load, lines[1:])],
            "60 of 60 pushes have negative power",
        ),
    ],
)
def test_bad_data_give_one_line_and_no_file(pushes, tmp_path, capsys, change, message):
    pushes.write_text("\n".join(change(pushes.read_text().splitlines())) + "\n")
    output = tmp_path / "model.yaml"
    assert main([str(pushes), "-o", str(output)]) == 2
    printed = capsys.readouterr().err
    assert message in printed
    assert len(printed.splitlines()) == 1
    assert not output.exists()


CONTACT = """schema: 1
name: triangle
points: [[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]]
friction_limits: [0.5, 0.5, 0.5]
"""


@pytest.mark.parametrize(
    ("options", "kind", "most_degrees"),
    [
        (
            ["--kind", "power_sum", "--terms", "2", "--characteristic-length", "0.15"],
            "power_sum",
            6.0,
        ),
        ([], "point_contacts", 1e-9),
        (["--terms", "3"], "dissipation", 1e-3),
        (["--family", "norms", "--objective", "J1"], "power_sum", 9.0),
        (["--objective", "second"], "power_sum", 9.0),
        (["--kind", "polynomial"], "polynomial", 14.0),
        (["--kind", "dissipation"], "dissipation", 0.5),
        (["--kind", "dissipation", "--load-noise", "0.05", "--terms", "2"], "dissipation", 9.0),
    ],
)
def test_a_contact_is_simulated_and_fitted(tmp_path, options, kind, most_degrees):
    contact, output = tmp_path / "contact.yaml", tmp_path / "model.yaml"
    contact.write_text(CONTACT)
    few = ["--motions", "400", "--facet-loads", "20"]
    assert main([str(contact), "-o", str(output), *few, *options]) == 0
    model = read_surface_model(output)
    assert model.surface.kind == kind
    assert model.fit["motions"] == 400
    test = random_motions(TRIANGLE, 500, 1)
    assert np.degrees(mean_angle(model.surface, test)) < most_degrees


def test_the_automatic_fit_stores_its_choice_and_its_bootstrap(pushes, tmp_path):
    output = tmp_path / "model.yaml"
    arguments = [str(pushes), "-o", str(output), "--auto", "--bootstrap", "3", "--rows", "0-15"]
    assert main([*arguments, "--folds", "2"]) == 0
    model = read_surface_model(output)
    assert len(model.fit["cross_validation_mean_angle_deg"]) == 4
    answer = model.uncertain.twist_with_covariance([1.0, 0.0, 0.01])
    assert answer.covariance.shape == (3, 3)
    assert 0.0 < answer.half_axes[1] <= answer.half_axes[0]
    assert len(surfaces_of(model.fit["bootstrap"], model.surface.scaling)) == 3


def test_the_automatic_fit_tells_how_many_pushes_its_regions_hold(pushes, tmp_path, capsys):
    pytest.importorskip("matplotlib", reason="matplotlib draws the pictures")
    output, picture = tmp_path / "model.yaml", tmp_path / "calibration.png"
    arguments = [str(pushes), "-o", str(output), "--picture", str(picture), "--rows", "0-15"]
    assert main(arguments) == 2
    assert "--picture is for --auto" in capsys.readouterr().err
    assert main([*arguments, "--auto", "--folds", "2"]) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    model, rest = read_surface_model(output), read_pushes(pushes).rest(range(16))
    stored = model.fit["held_out_calibration"]
    squares = squared_residuals(model.uncertain.scatter, model.surface, rest)
    inside = [np.mean(squares <= region_quantile(region)) for region in stored["regions"]]
    np.testing.assert_allclose(stored["inside"], inside, atol=1e-4)
    told = {region: 100.0 * share for region, share in zip(stored["regions"], inside, strict=True)}
    expected = f"hold {told[0.5]:.0f} / {told[0.9]:.0f} / {told[0.95]:.0f} % of {len(rest)} pushes"
    printed = capsys.readouterr().out
    assert f"50 / 90 / 95 % regions {expected} not seen, of those held out" in printed
    assert f"% of {model.fit['calibration']['pushes']} pushes not seen\n" in printed
    assert model.fit["calibration"]["pushes"] == 16


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ["--objective", "forces"],
            "--objective forces is not for --kind power_sum, which takes J2",
        ),
        (["--kind", "dissipation", "--objective", "J2"], "which takes forces, directions, both"),
        (["--bootstrap", "5"], "--bootstrap does nothing here: it is for --auto"),
        (["--motions", "300"], "--motions does nothing here: it is for a contact file"),
        (["--wrench-topic", "/w"], "--wrench-topic does nothing here: it is for a bag"),
        (["--kind", "dissipation", "--family", "norms"], "it is for --kind power_sum"),
        (["--folds", "3"], "it is for --auto"),
        (["--auto", "--terms", "4"], "--terms does nothing here: it is what --auto chooses"),
        (["--auto", "--kind", "dissipation"], "--kind does nothing here"),
        (
            ["--kind", "polynomial", "--velocity-weight", "2"],
            "--velocity-weight does nothing here: it is not for the objective least-squares",
        ),
        (["--kind", "polynomial", "--starts", "3"], "--starts does nothing here: it is not for"),
        (["--objective", "J1", "--velocity-weight", "2"], "not for the objective J1"),
        (["--characteristic-length", "0"], "must be"),
        (["--name", ""], "--name must not be empty"),
        (["--output", "model.txt"], "must end in .yaml or .yml"),
        (["--auto", "--support"], 'CSV states them in a first line # {"support_points_m_body'),
        (["--terms", "0"], "--terms must be from 1 to 1000, got 0"),
        (["--starts", "0"], "--starts must be from 1 to 1000000, got 0"),
        (["--velocity-weight", "-1"], "--velocity-weight must be from 0 to"),
        (["--rows", "1-x"], "rows must be like"),
        (["--rows", "70"], "there is no row 70"),
        (["--rows", "0-99999999999"], "there is no row 99999999999; rows are 0 to 59"),
        (["--frame-id", ""], "--frame-id must not be empty"),
        (["--reference-point", "0", "nan"], "--reference-point must be two numbers"),
        (["--seed", "-1"], "--seed must be from 0 to"),
        (["--motions", "0"], "--motions must be from 1 to 1000000, got 0"),
        (["--load-noise", "nan"], "--load-noise must be from 0 to 1000000, got nan"),
        (["--facet-loads", "-1"], "--facet-loads must be from 0"),
        (["--objective", "second", "--terms", "2"], "--terms does nothing here: it is not for"),
        (["--output", "absent/model.yaml"], "absent/model.yaml: its folder does not exist"),
    ],
)
def test_options_that_do_not_fit_together_are_refused(pushes, tmp_path, capsys, options, message):
    output = tmp_path / "model.yaml"
    assert main([str(pushes), "-o", str(output), *options]) == 2
    assert message in capsys.readouterr().err
    assert not output.exists()


def test_a_contact_gives_its_model_name_frame_and_reference_point(tmp_path):
    contact, output = tmp_path / "contact.yaml", tmp_path / "model.yaml"
    contact.write_text(f"{CONTACT}frame_id: el_frame\nreference_point: [0.01, 0.02]\n")
    few = [str(contact), "-o", str(output), "--terms", "1", "--motions", "50", "--starts", "1"]
    assert main(few) == 0
    model = read_surface_model(output)
    assert (model.name, model.frame_id) == ("triangle", "el_frame")
    assert model.reference_point == (0.01, 0.02)
    assert main([*few, "--name", "foot", "--frame-id", "sole"]) == 0
    model = read_surface_model(output)
    assert (model.name, model.frame_id) == ("foot", "sole")


def test_pushes_that_state_no_frame_are_of_the_frame_object(pushes, tmp_path):
    output = tmp_path / "model.yaml"
    assert main([str(pushes), "-o", str(output), "--terms", "1", "--starts", "1"]) == 0
    assert read_surface_model(output).frame_id == "object"


def test_pushes_are_about_the_point_that_is_stated(pushes, tmp_path, capsys):
    output = tmp_path / "model.yaml"
    few = [str(pushes), "-o", str(output), "--terms", "1", "--starts", "1"]
    assert main([*few, "--reference-point", "0.01", "-0.02"]) == 0
    assert "about       (0.01, -0.02) m in frame object" in capsys.readouterr().out
    assert read_surface_model(output).reference_point == (0.01, -0.02)


def test_a_contact_states_its_reference_point_itself(tmp_path, capsys):
    contact = tmp_path / "contact.yaml"
    contact.write_text(CONTACT)
    output = str(tmp_path / "m.yaml")
    assert main([str(contact), "-o", output, "--reference-point", "0", "0"]) == 2
    told = capsys.readouterr().err
    assert "--reference-point does nothing here: it is for a CSV of pushes" in told


def test_costs_of_starts_are_told_in_one_short_line(tmp_path, capsys):
    contact = tmp_path / "contact.yaml"
    contact.write_text(CONTACT)
    few = ["--motions", "200", "--facet-loads", "5", "--terms", "2", "--starts", "8"]
    assert main([str(contact), "-o", str(tmp_path / "m.yaml"), *few]) == 0
    (line,) = [x for x in capsys.readouterr().out.splitlines() if x.startswith("starts")]
    assert re.fullmatch(r"starts +\d of \d starts agree(, the next best cost [\d.]+)?", line)


def test_the_second_approximation_says_what_its_cost_is_beside_that_of_its_starts():
    errors = Errors(60, np.zeros(3), 0.0)
    result = FitResult(None, "", 7.9, (3.5, 3.5, 4.2), 1, 0.0, True, 0.0, errors)
    assert starts_in_words(result) == "2 of 3 starts agree, the next best cost 4.2"
    second = replace(result, details={"projected_cost": 3.5})
    assert "their best cost 3.5 is of a surface that is not closed" in starts_in_words(second)
    closed = replace(second, cost=3.5)
    assert "not closed" not in starts_in_words(closed)


def test_the_input_is_never_overwritten(tmp_path, capsys):
    contact, link = tmp_path / "contact.yaml", tmp_path / "link.yaml"
    contact.write_text(CONTACT)
    link.symlink_to(contact)
    for output in (contact, link, tmp_path / "." / "contact.yaml"):
        assert main([str(contact), "-o", str(output)]) == 2
        assert "is the input" in capsys.readouterr().err
    assert contact.read_text() == CONTACT


def test_what_is_wrong_with_the_data_is_told_with_their_file(pushes, tmp_path, capsys):
    lines = pushes.read_text().splitlines()
    pushes.write_text("\n".join(lines[:4]) + "\n")
    assert main([str(pushes), "-o", str(tmp_path / "m.yaml")]) == 2
    assert "pushes.csv: 3 pairs cannot determine 18 parameters" in capsys.readouterr().err
    assert main([str(pushes), "-o", str(tmp_path / "m.yaml"), "--auto"]) == 2
    assert (
        "pushes.csv: 3 pushes are too few, even for a regularised fit" in capsys.readouterr().err
    )


def test_an_error_names_the_file_of_the_data_once(pushes, tmp_path, capsys):
    contact, bag = tmp_path / "contact.yaml", tmp_path / "pushes.mcap"
    contact.write_text(CONTACT.replace("0.08", "1.0e+99"))
    bag.touch()
    for data, options in (
        (pushes, ["--rows", "70"]),
        (pushes, ["--rows", "0-2"]),
        (pushes, ["--auto", "--support"]),
        (contact, []),
        (bag, []),
    ):
        assert main([str(data), "-o", str(tmp_path / "m.yaml"), *options]) == 2
        assert capsys.readouterr().err.count(str(data)) == 1


def test_data_of_a_size_that_no_model_file_takes_are_refused(tmp_path, capsys):
    contact = tmp_path / "contact.yaml"
    contact.write_text(CONTACT.replace("0.08", "1.0e+99"))
    assert main([str(contact), "-o", str(tmp_path / "m.yaml")]) == 2
    assert "a characteristic length [m]" in capsys.readouterr().err


def test_rows_of_a_contact_are_refused(tmp_path, capsys):
    contact, output = tmp_path / "contact.yaml", tmp_path / "model.yaml"
    contact.write_text(CONTACT)
    assert main([str(contact), "-o", str(output), "--rows", "0-3"]) == 2
    assert "--rows does nothing here: it is for a CSV of pushes" in capsys.readouterr().err


def test_an_unknown_input_is_refused(tmp_path, capsys):
    other = tmp_path / "data.png"
    other.touch()
    assert main([str(other), "-o", str(tmp_path / "m.yaml")]) == 2
    assert "files that end in .png are not known; accepted is" in capsys.readouterr().err
    assert main([str(tmp_path / "none.csv"), "-o", str(tmp_path / "m.yaml")]) == 2
    assert "there is no such file" in capsys.readouterr().err
    loop = tmp_path / "loop.csv"
    loop.symlink_to(loop)
    assert main([str(loop), "-o", str(tmp_path / "m.yaml")]) == 2
    assert "loop.csv: cannot be read: Too many levels" in capsys.readouterr().err
    assert main(["/dev/null", "-o", str(tmp_path / "m.yaml")]) == 2
    assert "a file without a suffix is not known" in capsys.readouterr().err


def test_that_an_input_is_absent_is_told_before_what_options_do(tmp_path, capsys):
    output = ["-o", str(tmp_path / "m.yaml"), "--motions", "100"]
    for absent, message in (
        (tmp_path / "none.txt", "there is no such file"),
        (tmp_path, "is a folder without a metadata.yaml, so no bag"),
    ):
        assert main([str(absent), *output]) == 2
        assert message in capsys.readouterr().err


def test_an_empty_name_is_no_input(tmp_path, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["", "-o", str(tmp_path / "m.yaml")])
    assert ended.value.code == 2
    assert "an empty name is no file" in capsys.readouterr().err


@pytest.mark.skipif(not RECORDED.is_dir(), reason="recorded pushes are not at ../shared/data")
def test_real_pushes_are_predicted_within_twelve_degrees(tmp_path):
    name = "hardboard_10_130_10_10_10_130"
    rows = json.loads((RECORDED / "splits.json").read_text())[name]["25"][0]
    output = tmp_path / "model.yaml"
    pushes = RECORDED / f"{name}.csv"
    assert main([str(pushes), "-o", str(output), "--rows", ",".join(map(str, rows))]) == 0
    held_out = read_pushes(pushes).rest(rows)
    assert np.degrees(mean_angle(read_surface_model(output).surface, held_out)) < 12.0


@pytest.mark.parametrize("workers", [1, 2])
def test_an_interrupted_fit_says_so_and_leaves_neither_file_nor_process(pushes, tmp_path, workers):
    output = tmp_path / "model.yaml"
    endless = ["--kind", "dissipation", "--terms", "6", "--starts", "100000"]
    arguments = [pushes, "-o", output, *endless, "--workers", str(workers)]
    process = started(
        "limit_surface_ros.tools.fit_surface",
        *arguments,
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    # Well past the imports, in the fit: told by the processor time of the group's processes.
    until(lambda: processor_ticks(process.pid) > 3 * os.sysconf("SC_CLK_TCK"), "the fit is going")
    os.killpg(process.pid, signal.SIGINT)
    errors = process.communicate()[1]
    assert process.returncode == 130
    assert len(errors.splitlines()) == 1
    assert "interrupted" in errors
    until(lambda: group_is_gone(process.pid), "every process of the run ends")
    assert [path.name for path in tmp_path.iterdir()] == ["pushes.csv"]


def processor_ticks(group):
    """Processor time of the processes of a group, in clock ticks."""
    ticks = 0
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[2]) == group:
            ticks += int(fields[11]) + int(fields[12])
    return ticks


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("[0.12, 0.07]", "[120, 70]"), "are the lengths in metres?"),
        (("0.35", "35"), "is it a percentage, or an angle?"),
        (("0.07]", "0.07], angle: 45"), "is it in degrees?"),
        (("0.35", "0.35"), ""),
    ],
)
def test_a_contact_in_other_units_is_warned_about(tmp_path, capsys, recwarn, change, words):
    text = (
        "schema: 1\nname: box\nfriction_coefficient: 0.35\nnormal_force: 3.924\ncells: 100\n"
        "shape: {kind: rectangle, size: [0.12, 0.07]}\n"
    )
    contact, output = tmp_path / "box.yaml", tmp_path / "model.yaml"
    contact.write_text(text.replace(*change))
    assert main([str(contact), "-o", str(output), "--motions", "100", "--terms", "1"]) == 0
    errors = capsys.readouterr().err
    assert words in errors
    assert ("box.yaml" in errors) == bool(words)


def test_a_stool_of_three_feet_becomes_its_exact_model(tmp_path):
    contact, output = tmp_path / "stool.yaml", tmp_path / "model.yaml"
    contact.write_text(
        "schema: 1\nname: stool\npoints: [[0.16, 0.0], [-0.08, 0.13], [-0.07, -0.12]]\n"
        "friction_limits: [3.4335, 5.15025, 8.58375]\n"
    )
    assert main([str(contact), "-o", str(output)]) == 0
    model = read_surface_model(output)
    assert model.surface.kind == "point_contacts"
    assert model.fit["held_out"]["mean_angle_rad"] < 1e-9
    assert model.surface.scaling.friction_force == pytest.approx(17.1675)


def test_a_link_of_a_urdf_is_fitted(tmp_path, capsys):
    robot, output = tmp_path / "robot.urdf", tmp_path / "model.yaml"
    robot.write_text(
        "<robot name='r'><link name='base'><inertial><mass value='0.4'/></inertial><collision>"
        "<geometry><box size='0.12 0.07 0.05'/></geometry></collision></link></robot>"
    )
    arguments = [str(robot), "-o", str(output), "--motions", "300"]
    assert main(arguments) == 2
    assert "give --friction-coefficient" in capsys.readouterr().err
    assert main([*arguments, "--link", "base", "--friction-coefficient", "0.35"]) == 0
    model = read_surface_model(output)
    assert (model.name, model.frame_id, model.surface.kind) == ("base", "base", "dissipation")
    straight = model.surface.twist_of_wrench([1.0, 0.0, 0.0])
    np.testing.assert_allclose(straight / model.surface.scaling.twist_unit, [1, 0, 0], atol=1e-9)
    assert main([str(robot), "-o", str(output), "--rows", "1"]) == 2


@pytest.mark.parametrize("option", ["--link", "--friction-coefficient", "--normal-force"])
def test_options_of_links_are_refused_for_other_inputs(pushes, tmp_path, capsys, option):
    assert main([str(pushes), "-o", str(tmp_path / "m.yaml"), option, "1"]) == 2
    assert f"{option} does nothing here: it is for a URDF or SDF" in capsys.readouterr().err
