# SPDX-License-Identifier: Apache-2.0
"""fit_catalogue: every object that can be fitted is, once; a run that ends early goes on."""

import json
import os
import signal
import subprocess

import pytest

from catalogue_helpers import OPTIONS, matrices, write_objects
from limit_surface_ros.errors import RangeError
from limit_surface_ros.files.surface_file import read_surface_model
from limit_surface_ros.tools import fit_catalogue, fit_surface
from limit_surface_ros.tools.common.fit_options import refuse_options_of_others
from limit_surface_ros.tools.common.training_data import CONTACT, PUSHES
from process_helpers import group_is_gone, started, until

MODULE = "limit_surface_ros.tools.fit_catalogue"


@pytest.fixture
def folder(tmp_path):
    write_objects(tmp_path / "pushes", 4)
    return tmp_path / "pushes"


def run(folder, output, *options):
    return fit_catalogue.main([str(folder), "--output", str(output), *OPTIONS, *options])


def times(output):
    return {path.name: path.stat().st_mtime_ns for path in output.iterdir()}


def test_models_do_not_depend_on_the_number_of_workers(folder, tmp_path):
    names = [path.stem for path in sorted(folder.iterdir())]
    assert run(folder, tmp_path / "one", "--workers", "1") == 0
    assert run(folder, tmp_path / "two", "--workers", "2") == 0
    assert matrices(tmp_path / "one", names) == matrices(tmp_path / "two", names)
    fit_surface.main([str(folder / "object_02.csv"), "-o", str(tmp_path / "m.yaml"), *OPTIONS])
    assert matrices(tmp_path, ["m"]) == matrices(tmp_path / "two", ["object_02"])


def test_a_bad_object_fails_alone_and_is_listed_at_the_end(folder, tmp_path, capsys):
    (folder / "object_01.csv").write_text("fx_N,fy_N\n1,2\n")
    (folder / "object_03.csv").write_bytes(b"\xff\xfe\x00")
    assert run(folder, tmp_path / "models") == 1
    printed = capsys.readouterr()
    failed = printed.err.splitlines()
    assert [line.split(":")[0] for line in failed] == [
        "FAILED object_01.csv",
        "FAILED object_03.csv",
    ]
    assert "column tau_Nm is missing" in failed[0]
    assert "2 fitted, 0 kept, 2 failed" in printed.out
    assert sorted(times(tmp_path / "models")) == ["object_00.yaml", "object_02.yaml"]


def test_contacts_and_bags_are_objects_and_other_things_are_not(folder, tmp_path, capsys):
    for path in folder.glob("object_0[1-3].csv"):
        path.unlink()
    (folder / "three_points.yaml").write_text(
        "schema: 1\nname: three_points\n"
        "points: [[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]]\n"
        "friction_limits: [0.5, 0.5, 0.5]\n"
    )
    (folder / "notes.txt").touch()
    (folder / "broken_bag").mkdir()
    (folder / "broken_bag" / "metadata.yaml").write_text("nothing: 1\n")
    output = folder / "models"
    for kept in (0, 2):
        assert run(folder, output) == 1
        printed = capsys.readouterr()
        assert f"3 objects: {kept} finished before" in printed.out
        (line,) = printed.err.splitlines()
        assert line.startswith("FAILED broken_bag: ")
    assert sorted(times(output)) == ["object_00.yaml", "three_points.yaml"]


def test_models_have_the_names_and_frames_of_their_contacts(tmp_path):
    contacts, output = tmp_path / "contacts", tmp_path / "models"
    contacts.mkdir()
    (contacts / "file_name.yaml").write_text(
        "schema: 1\nname: box\nframe_id: box_frame\n"
        "points: [[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]]\n"
        "friction_limits: [0.5, 0.5, 0.5]\n"
    )
    assert run(contacts, output, "--motions", "60", "--workers", "1") == 0
    model = read_surface_model(output / "file_name.yaml")
    assert (model.name, model.frame_id) == ("box", "box_frame")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--seed", "-1"], "--seed must be from 0"),
        (["--frame-id", " "], "--frame-id must not be empty"),
        (["--dask", "foo"], "--dask must be a scheduler's address with its port, such as tcp://"),
    ],
)
def test_options_are_looked_at_before_any_object_is(tmp_path, capsys, options, message):
    assert run(tmp_path / "absent", tmp_path / "models", *options) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--motions", "60"], "--motions does nothing here: it is for a contact file"),
        (["--min-force", "1"], "--min-force does nothing here: it is for a bag"),
        (["--auto"], "--terms does nothing here: it is what --auto chooses"),
        (["--bootstrap", "5"], "--bootstrap does nothing here: it is for --auto"),
        (["--kind", "polynomial"], "--terms does nothing here: it is not for --kind polynomial"),
        (["--objective", "convex"], "--objective convex is not for --kind power_sum"),
        (["--objective", "J1", "--velocity-weight", "2"], "it is not for the objective J1"),
    ],
)
def test_options_that_do_nothing_for_any_object_are_refused_before_the_work(
    folder, tmp_path, capsys, options, message
):
    assert run(folder, tmp_path / "models", *options) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert message in line
    assert not (tmp_path / "models").exists()


def test_an_option_that_counts_for_some_objects_is_accepted():
    top = fit_catalogue.parser()
    weighed = ["--kind", "dissipation", "--velocity-weight", "2"]
    for given in (["--motions", "60"], ["--rows", "0-9"], weighed):
        options = top.parse_args(["in", "-o", "out", *given])
        refuse_options_of_others(top, options, {CONTACT, PUSHES})
    with pytest.raises(RangeError, match="not for the objective forces"):
        refuse_options_of_others(top, options, {CONTACT})


def test_finished_models_are_kept_until_their_input_or_the_options_change(
    folder, tmp_path, capsys
):
    output = tmp_path / "models"
    run(folder, output)
    first = times(output)
    assert run(folder, output, "--workers", "1") == 0
    assert "4 finished before, 0 to fit" in capsys.readouterr().out
    assert times(output) == first

    changed = folder / "object_01.csv"
    changed.write_text("\n".join(changed.read_text().splitlines()[:-1]) + "\n")
    cut = output / "object_02.yaml"
    cut.write_text(cut.read_text()[:-20])
    run(folder, output)
    refitted = {name for name, time in times(output).items() if time != first[name]}
    assert refitted == {"object_01.yaml", "object_02.yaml"}
    assert read_surface_model(output / "object_01.yaml").fit["training"]["pairs"] == 39

    second = times(output)
    run(folder, output, "--objective", "J1")
    assert all(time != second[name] for name, time in times(output).items())
    run(folder, output, "--objective", "J1", "--refit")
    assert "4 finished before" not in capsys.readouterr().out.splitlines()[-2]


def test_models_of_another_version_are_fitted_anew(folder, tmp_path, capsys, monkeypatch):
    output = tmp_path / "models"
    run(folder, output)
    monkeypatch.setattr(fit_catalogue, "__version__", "999.0.0")
    for told in ("0 finished before, 4 to fit", "4 finished before, 0 to fit"):
        capsys.readouterr()
        assert run(folder, output) == 0
        assert told in capsys.readouterr().out


def test_an_interrupted_run_leaves_whole_models_and_goes_on(tmp_path, capsys):
    names = write_objects(tmp_path / "pushes", 30)
    output = tmp_path / "models"
    arguments = [tmp_path / "pushes", "-o", output, *OPTIONS, "--workers", "2"]
    process = started(MODULE, *arguments, stderr=subprocess.PIPE, stdout=subprocess.PIPE)
    until(lambda: output.is_dir() and list(output.glob("*.yaml")), "the first model")
    os.killpg(process.pid, signal.SIGINT)
    errors = process.communicate()[1]
    assert process.returncode == 130
    assert errors.splitlines() == [
        "fit_catalogue: interrupted; finished models are kept, the same command goes on from there"
    ]
    until(lambda: group_is_gone(process.pid), "every process of the run ends")
    done = times(output)
    assert 0 < len(done) < 30
    for name in done:
        read_surface_model(output / name)

    assert run(tmp_path / "pushes", output) == 0
    assert f"{len(done)} finished before" in capsys.readouterr().out
    assert done.items() <= times(output).items()
    assert len(matrices(output, names)) == 30


def test_a_killed_run_leaves_no_process_and_goes_on(tmp_path):
    names = write_objects(tmp_path / "pushes", 30)
    output = tmp_path / "models"
    arguments = [tmp_path / "pushes", "-o", output, *OPTIONS, "--workers", "2"]
    process = started(MODULE, *arguments, stdout=subprocess.DEVNULL)
    until(lambda: output.is_dir() and list(output.glob("*.yaml")), "the first model")
    process.kill()
    process.wait()
    until(lambda: group_is_gone(process.pid), "the workers end with their parent")
    done = times(output)
    assert len(list(output.glob("*.yaml"))) < 30
    assert run(tmp_path / "pushes", output) == 0
    assert done.items() <= times(output).items()
    assert len(matrices(output, names)) == 30


@pytest.mark.parametrize(
    ("prepare", "output", "message"),
    [
        (lambda folder: (folder / "object_00.yaml").touch(), "models", "would both become"),
        (lambda folder: None, "pushes", "must go to another folder"),
        (lambda folder: [path.unlink() for path in folder.iterdir()], "models", "holds no .yaml"),
        (lambda folder: folder.rename(folder.parent / "gone"), "models", "no such folder"),
        (lambda folder: (folder.parent / "models").touch(), "models", "cannot be made"),
    ],
)
def test_a_catalogue_that_cannot_be_is_refused_at_once(
    folder, tmp_path, capsys, prepare, output, message
):
    prepare(folder)
    assert run(folder, tmp_path / output) == 2
    assert message in capsys.readouterr().err


def test_every_option_that_changes_models_tells_them_apart():
    top = fit_catalogue.parser()
    base = ["in", "-o", "out"]
    same = top.parse_args(base)
    for options in (["--terms", "2"], ["--seed", "1"], ["--family", "norms"], ["--starts", "3"]):
        changed = top.parse_args(base + options)
        assert fit_catalogue.fit_settings(changed) != fit_catalogue.fit_settings(same)
    for options in (["--workers", "7"], ["--dask", "tcp://a:1"], ["--refit"]):
        changed = top.parse_args(base + options)
        assert fit_catalogue.fit_settings(changed) == fit_catalogue.fit_settings(same)
    assert "seed" in json.loads(fit_catalogue.fit_settings(same))
