# SPDX-License-Identifier: Apache-2.0
"""The promises of `plots.canvas`: the same files each time, whole files, no global state."""

import sys

import numpy as np
import pytest

from limit_surface_ros.errors import FileError, MissingExtraError
from limit_surface_ros.plots.canvas import CYCLE, line_style, new_figure, save_figure

matplotlib = pytest.importorskip("matplotlib", reason="matplotlib draws the pictures")


def drawing(height=1.0):
    with new_figure(2.0, 1.5) as figure:
        figure.subplots().plot([0.0, 1.0], [0.0, height])
    return figure


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_the_same_picture_gives_the_same_bytes(tmp_path, suffix):
    first, second, other = (tmp_path / f"{name}{suffix}" for name in ("a", "b", "c"))
    save_figure(drawing(), first)
    save_figure(drawing(), second)
    save_figure(drawing(2.0), other)
    assert first.read_bytes() == second.read_bytes()
    assert first.read_bytes() != other.read_bytes()


def test_a_picture_of_another_suffix_is_refused_by_name(tmp_path):
    with pytest.raises(FileError, match=r"\.png, \.svg, \.pdf, got '\.bmp'"):
        save_figure(drawing(), tmp_path / "a.bmp")


def test_a_picture_that_cannot_be_written_leaves_nothing_behind(tmp_path):
    with pytest.raises(FileError, match="cannot be written"):
        save_figure(drawing(), tmp_path / "absent" / "a.png")
    assert list(tmp_path.iterdir()) == []


def test_drawing_leaves_the_settings_of_the_caller_alone():
    before = dict(matplotlib.rcParams)
    drawing()
    assert dict(matplotlib.rcParams) == before


def test_without_matplotlib_the_error_tells_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    sentence = r"pip install matplotlib \(.*extra 'plots'\)$"
    with pytest.raises(MissingExtraError, match=sentence), new_figure(1, 1):
        pass


def luminance(color):
    """Relative luminance of WCAG 2.2."""
    channel = np.array(matplotlib.colors.to_rgb(color))
    linear = np.where(channel <= 0.04045, channel / 12.92, ((channel + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


@pytest.mark.parametrize("color", CYCLE)
def test_every_line_stands_out_from_white(color):
    assert 1.05 / (luminance(color) + 0.05) > 2.0


def test_curves_of_one_picture_differ_in_colour_and_in_dashes():
    styles = [line_style(index) for index in range(len(CYCLE))]
    assert len({style["color"] for style in styles}) == len(CYCLE)
    assert len({str(style["linestyle"]) for style in styles}) == len(CYCLE)


def test_the_first_forty_nine_curves_look_different():
    looks = {str(sorted(line_style(index).items())) for index in range(49)}
    assert len(looks) == 49
