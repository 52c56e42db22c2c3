# SPDX-License-Identifier: Apache-2.0
"""The promises of plot_slide as a program: what it says is what the library finds."""

import numpy as np
import pytest

from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.files.decay_file import DecayModel, write_decay_model
from limit_surface_ros.files.surface_file import read_surface_model
from limit_surface_ros.motion.sliding.inertia import Inertia
from limit_surface_ros.motion.sliding.load import Load
from limit_surface_ros.motion.sliding.slide import slide
from limit_surface_ros.plots.film import outline_at
from limit_surface_ros.plots.slide_view import draw_slide
from limit_surface_ros.tools import plot_slide

pytest.importorskip("matplotlib", reason="matplotlib is not installed")

MODEL = """\
schema: 1
name: box
kind: dissipation
frame_id: object
characteristic_length: 0.05
friction_force: 1.5
reference_point: [0.01, 0.0]
outline: {kind: rectangle, size: [0.1, 0.06]}
terms: 1
matrices: [[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.4]]]
"""
FADING = ExponentialSum([-2.0], [3.0])
BODY = ["--mass", "0.3", "--moment", "5e-4"]


@pytest.fixture
def model(tmp_path):
    path = tmp_path / "box.yaml"
    path.write_text(MODEL)
    return path


def test_it_says_and_draws_a_shoved_body(model, tmp_path, capsys):
    picture = tmp_path / "slide.png"
    arguments = [str(model), *BODY, "--twist", "0.8", "0.2", "12", "-o", str(picture)]
    assert plot_slide.main(arguments) == 0
    found = slide(read_surface_model(model).surface, Inertia(0.3, 5e-4), (0.8, 0.2, 12.0))
    told = capsys.readouterr().out
    assert f"rests       after {found.time:.6f} s" in told
    assert f"x {found.pose[0]:.6f} m, y {found.pose[1]:.6f} m" in told
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_it_says_the_bracket_of_a_load_and_makes_a_film(model, tmp_path, capsys):
    decay = tmp_path / "fading.yaml"
    write_decay_model(DecayModel("fading", FADING, (0.0, 6.0), "inf", 0.02), decay)
    film = tmp_path / "slide.gif"
    arguments = [str(model), *BODY, "--wrench", "4", "1", "0.1", "--decay", str(decay)]
    arguments += ["-o", str(tmp_path / "x.svg"), "--animate", str(film), "--seconds", "0.2"]
    assert plot_slide.main(arguments) == 0
    load = Load([4.0, 1.0, 0.1], FADING)
    found = slide(read_surface_model(model).surface, Inertia(0.3, 5e-4), (0.0, 0.0, 0.0), load)
    told = capsys.readouterr().out
    assert f"rests       after {found.time:.6f} s" in told
    earliest, latest = (float(told.split("bracket")[1].split()[i]) for i in (0, 2))
    assert earliest < found.time < latest
    assert film.read_bytes().startswith(b"GIF8")


def test_the_picture_shows_the_path_and_the_rests(model):
    surface = read_surface_model(model).surface
    x = ExponentialSum([-0.7, -0.5 + 6.0j], [0.4, 0.6])
    load = Load([4.0, 0.0, 0.0], x)
    found = slide(surface, Inertia(0.3, 5e-4), (0.0, 0.0, 0.0), load)
    assert len(found.rests)
    outline = plot_slide.outline_of(read_surface_model(model))
    way, motion, _, factors = draw_slide(found, outline, surface, load).axes
    labels = [line.get_label() for line in way.get_lines()]
    assert "rests on the way" in labels
    end = way.get_lines()[labels.index("rests for good")].get_xydata()[0]
    np.testing.assert_allclose(end, 1e3 * found.pose[:2], atol=1e-6)
    speeds = motion.get_lines()[-1].get_ydata()
    assert speeds.max() > 0.1
    assert speeds[-1] == 0.0
    levels = [line.get_ydata() for line in factors.get_lines()]
    first = float(surface.load_factor((4.0, 0.0, 0.0)))
    assert any(len(each) > 2 and each[0] == pytest.approx(first) for each in levels)


def test_an_outline_is_about_the_reference_point_and_turns_with_the_body(model):
    outline = plot_slide.outline_of(read_surface_model(model))
    np.testing.assert_allclose(outline.mean(axis=0), [-0.01, 0.0], atol=1e-12)
    turned = outline_at(outline, np.array([1.0, 2.0, np.pi / 2.0]))
    np.testing.assert_allclose(turned[:-1].mean(axis=0), [1.0, 1.99], atol=1e-12)
    np.testing.assert_array_equal(turned[0], turned[-1])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--mass", "0"], "mass must be a finite number above 0"),
        (["--wrench", "1", "0", "0"], "--wrench and --decay belong together"),
        (["--in-world"], "--in-world does nothing here"),
        (["--seconds", "2"], "--seconds does nothing here"),
        (["--animate", "x.avi"], "must end in .gif or .mp4"),
        (["--twist", "nan", "0", "0"], "twist must be finite"),
    ],
)
def test_what_makes_no_slide_is_refused_in_a_line(model, options, message, capsys):
    assert plot_slide.main([str(model), *BODY, *options]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
