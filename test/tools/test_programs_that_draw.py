# SPDX-License-Identifier: Apache-2.0
"""The promises of plot_surface, plot_decay and reproduce_thesis as programs."""

import numpy as np
import pytest

from limit_surface_ros.files.decay_file import read_decay_model
from limit_surface_ros.files.surface_file import SurfaceModel, write_surface_model
from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.plots.decay_view import draw_decay
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.dissipation_scatter import TwistScatter
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling
from limit_surface_ros.tools import (
    fit_decay,
    plot_decay,
    plot_push,
    plot_surface,
    reproduce_thesis,
)

pytest.importorskip("matplotlib", reason="matplotlib draws the pictures")


@pytest.fixture
def surface_file(tmp_path):
    path = tmp_path / "disc.yaml"
    write_surface_model(SurfaceModel("disc", PowerSum.norms([np.diag([1.0, 1.0, 2.0])])), path)
    return path


@pytest.fixture
def decay_file(tmp_path):
    path = tmp_path / "stick.yaml"
    arguments = ["f1", "--terms", "5", "--method", "neutral", "--output", str(path)]
    assert fit_decay.main(arguments) == 0
    return path


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_plot_surface_writes_the_picture_it_is_asked_for(tmp_path, surface_file, suffix):
    picture = tmp_path / f"disc.{suffix}"
    assert plot_surface.main([str(surface_file), "--output", str(picture)]) == 0
    start = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}[suffix]
    assert picture.read_bytes().startswith(start)


def test_two_models_of_one_name_cannot_be_told_apart(tmp_path, surface_file, capsys):
    assert plot_surface.main([str(surface_file), str(surface_file)]) == 2
    assert "another file holds a model named 'disc'" in capsys.readouterr().err


def test_models_about_two_points_are_not_drawn_as_if_they_were_about_one(
    tmp_path, surface_file, capsys
):
    other, picture = tmp_path / "other.yaml", tmp_path / "x.png"
    surface = PowerSum.norms([np.diag([1.0, 1.0, 2.0])])
    write_surface_model(SurfaceModel("other", surface, reference_point=(0.1, 0.0)), other)
    assert plot_surface.main([str(surface_file), str(other), "-o", str(picture)]) == 2
    error = capsys.readouterr().err
    assert "disc.yaml is about (0, 0) m in frame 'object'" in error
    assert "other.yaml is about (0.1, 0) m" in error
    assert not picture.exists()


@pytest.mark.parametrize("program", [plot_surface, plot_decay])
@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--dpi", "100000"], "--dpi must be from 10 to 1200, got 100000"),
        (["--output", "x.foo"], "x.foo: cannot be written: must end in .png or .svg or .pdf"),
        (["--output", "absent/x.png"], "absent/x.png: its folder does not exist"),
    ],
)
def test_a_picture_that_cannot_be_made_is_refused_before_the_work(
    tmp_path, program, options, message, capsys
):
    # The model is not looked at before the picture's options are.
    assert program.main([str(tmp_path / "absent.yaml"), *options]) == 2
    assert message in capsys.readouterr().err


def test_a_picture_never_replaces_its_model(tmp_path, surface_file, decay_file, capsys):
    for program, model in ((plot_surface, surface_file), (plot_decay, decay_file)):
        named_as_picture = tmp_path / "model.png"
        named_as_picture.write_bytes(model.read_bytes())
        assert program.main([str(named_as_picture), "-o", str(named_as_picture)]) == 2
        assert "is the input" in capsys.readouterr().err
        assert named_as_picture.read_bytes() == model.read_bytes()


def test_a_model_that_is_not_there_is_one_line_and_no_picture(tmp_path, capsys):
    picture = tmp_path / "x.png"
    absent = str(tmp_path / "absent.yaml")
    for program in (plot_surface, plot_decay):
        assert program.main([absent, "--output", str(picture)]) == 2
        error = capsys.readouterr().err
        assert error.count("\n") == 1
        assert "absent.yaml" in error
    assert not picture.exists()


def test_plot_decay_finds_the_response_that_the_model_was_fitted_to(tmp_path, decay_file):
    picture = tmp_path / "stick.png"
    assert plot_decay.main([str(decay_file), "--output", str(picture)]) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    options = plot_decay.parser().parse_args([str(decay_file)])
    target = plot_decay.response_of(read_decay_model(decay_file), options)
    np.testing.assert_allclose(target([0.0, 0.5, 2.0]), [1.0, 0.5, 0.0])


def test_a_decay_is_drawn_with_error_rates_and_projection(decay_file):
    model = read_decay_model(decay_file)
    options = plot_decay.parser().parse_args([str(decay_file)])
    target = plot_decay.response_of(model, options)
    above, rates, below, projection = draw_decay(model, target).axes
    error = below.get_lines()[0].get_ydata()
    assert np.abs(error).max() == pytest.approx(model.max_error, rel=0.02)
    points = sum(len(group.get_offsets()) for group in rates.collections)
    assert points == model.sum.terms
    assert projection.get_xlim() == (0.0, 18.0)
    assert above.get_xlabel() == "t [s]"


def test_a_record_is_drawn_as_the_fit_saw_it(tmp_path):
    record, output = tmp_path / "record.csv", tmp_path / "model.yaml"
    times = np.linspace(0.0, 3.0, 61)
    record.write_text("\n".join(f"{t},{3.0 * np.exp(-2.0 * t) + 1.0}" for t in times))
    chosen = ["--start", "0.5", "--offset", "1"]
    assert fit_decay.main([str(record), "-n", "1", *chosen, "-o", str(output)]) == 0
    model = read_decay_model(output)
    target = plot_decay.response_of(model, plot_decay.parser().parse_args([str(output)]))
    above, _, below, _ = draw_decay(model, target).axes
    samples, error = above.get_lines()[0], below.get_lines()[0]
    assert samples.get_label() == "samples"
    assert samples.get_ydata()[0] == pytest.approx(3.0 * np.exp(-1.0))
    assert np.abs(error.get_ydata()).max() <= 1.001 * model.max_error + 1e-12


def test_without_a_response_only_the_model_is_drawn(decay_file):
    above, _, below, _ = draw_decay(read_decay_model(decay_file)).axes
    assert [line.get_label() for line in above.get_lines()] == ["model"]
    assert "not known" in below.get_title()


def test_a_response_that_does_not_exist_lists_the_examples(decay_file, capsys):
    assert plot_decay.main([str(decay_file), "--response", "f9"]) == 2
    assert "examples are f1, f2" in capsys.readouterr().err


def test_reproduce_thesis_makes_the_figures_it_is_asked_for(tmp_path, capsys):
    out = tmp_path / "a folder" / "out"
    assert reproduce_thesis.main([str(out), "--quick", "--figures", "2.1", "3.2"]) == 0
    assert sorted(path.name for path in out.iterdir()) == [
        "claims.md",
        "figure_2_01",
        "figure_3_02",
        "index.html",
    ]
    assert str(out / "index.html") in capsys.readouterr().out


def test_a_figure_that_the_thesis_does_not_have_is_refused(tmp_path, capsys):
    assert reproduce_thesis.main([str(tmp_path / "out"), "--figures", "3.99"]) == 2
    assert "there is no figure 3.99; there are 2.1" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_folder_that_cannot_be_made_is_one_line(tmp_path, capsys):
    blocker = tmp_path / "file"
    blocker.write_text("")
    assert reproduce_thesis.main([str(blocker / "out"), "--quick"]) == 2
    assert "cannot be made" in capsys.readouterr().err


@pytest.mark.parametrize("program", [plot_surface, plot_decay, reproduce_thesis])
def test_help_gives_examples(program, capsys):
    with pytest.raises(SystemExit) as done:
        program.main(["--help"])
    assert done.value.code == 0
    assert "examples:" in capsys.readouterr().out


@pytest.fixture
def pushed_file(tmp_path):
    path = tmp_path / "box.yaml"
    outline = Polygon([[-0.05, -0.03], [0.05, -0.03], [0.05, 0.03], [-0.05, 0.03]])
    surface = PowerSum.norms([np.diag([1.0, 1.0, 2.0])], Scaling(0.05, 3.0))
    write_surface_model(SurfaceModel("box", surface, outline=outline), path)
    return path


def test_plot_push_says_where_the_body_ends_and_draws_its_way(tmp_path, pushed_file, capsys):
    picture, film = tmp_path / "push.png", tmp_path / "push.gif"
    path = ["-0.1", "0.0", "-0.035", "0.0"]
    arguments = [str(pushed_file), "--path", *path, "-o", str(picture), "--animate", str(film)]
    assert plot_push.main([*arguments, "--seconds", "0.3"]) == 0
    printed = capsys.readouterr().out
    assert "touched     after 45.000 mm" in printed
    assert "end         x 0.020000 m, y 0.000000 m, angle 0.0000 deg" in printed
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert film.read_bytes().startswith(b"GIF8")


def test_plot_push_draws_where_members_of_a_scatter_end(tmp_path, pushed_file, capsys):
    assert plot_push.main([str(pushed_file), "--members", "5"]) == 2
    assert "does not say how far pushes scatter" in capsys.readouterr().err
    matrices = np.stack([np.diag([1.0, 1.0, 2.0]), np.diag([1.0, 1.0, 0.2])])
    scatter = TwistScatter(matrices, (matrices,) * 3)
    model = SurfaceModel(
        "box",
        Dissipation(matrices, Scaling(0.05, 1.0)),
        fit={"uncertainty": scatter.stored()},
        outline=Polygon([[-0.05, -0.03], [0.05, -0.03], [0.05, 0.03], [-0.05, 0.03]]),
    )
    path, picture = tmp_path / "box.yaml", tmp_path / "push.svg"
    write_surface_model(model, path)
    assert plot_push.main([str(path), "--members", "8", "-o", str(picture)]) == 0
    told = capsys.readouterr().out
    assert "spread      9 of 10 members in an ellipse of half-axes" in told
    assert "by the ground alone: real ends lie outside far more often" in told
    assert "90 % of the members" in picture.read_text()


def test_plot_push_without_a_path_pushes_from_the_left(tmp_path, pushed_file, capsys):
    assert plot_push.main([str(pushed_file), "-o", str(tmp_path / "push.svg")]) == 0
    printed = capsys.readouterr().out
    assert "touched     after" in printed
    assert "modes       separate, s" in printed


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (["--path", "0", "0"], "two or more corners"),
        (["--path", "0", "0", "1"], "two or more corners"),
        (["--path", "0", "0", "1", "0"], "within"),
        (["--friction", "-1"], "friction"),
        (["--accuracy", "0"], "accuracy"),
        (["--animate", "push.webm"], ".gif or .mp4"),
        (["--seconds", "0"], "seconds"),
    ],
)
def test_what_plot_push_cannot_draw_is_refused(tmp_path, pushed_file, capsys, changes, message):
    arguments = [str(pushed_file), "-o", str(tmp_path / "push.png"), *changes]
    assert plot_push.main(arguments) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "push.png").exists()


def test_a_body_without_an_outline_is_not_pushed(tmp_path, surface_file, capsys):
    assert plot_push.main([str(surface_file), "-o", str(tmp_path / "push.png")]) == 2
    assert "no outline" in capsys.readouterr().err
