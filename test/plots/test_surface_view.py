# SPDX-License-Identifier: Apache-2.0
"""The promises of `plots.surface_view`: what is drawn lies on the surface, in its units."""

import numpy as np
import pytest

from limit_surface_ros.errors import DataError
from limit_surface_ros.plots.canvas import save_figure
from limit_surface_ros.plots.distributions import draw_distributions
from limit_surface_ros.plots.surface_view import (
    SECTIONS,
    draw_surfaces,
    section_curve,
    surface_grid,
)
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.sampling import random_loads
from limit_surface_ros.surface.scaling import Scaling

pytest.importorskip("matplotlib", reason="matplotlib draws the pictures")

SURFACE = PowerSum.norms(
    [np.diag([0.3, 0.2, 0.4]), [[0.3, 0.1, 0.0], [0.1, 0.2, 0.05], [0.0, 0.05, 0.3]]],
    Scaling(0.06, 7.0),
)


def test_every_vertex_of_the_grid_lies_on_the_surface():
    grid = surface_grid(SURFACE)
    np.testing.assert_allclose(SURFACE.load_factor(grid), 1.0, rtol=1e-12)


@pytest.mark.parametrize("components", SECTIONS)
def test_a_section_lies_on_the_surface_and_in_its_plane(components):
    curve = section_curve(SURFACE, components)
    wrenches = np.zeros((len(curve), 3))
    wrenches[:, components] = curve
    np.testing.assert_allclose(SURFACE.load_factor(wrenches), 1.0, rtol=1e-12)
    np.testing.assert_allclose(curve[0], curve[-1], atol=1e-12)


def test_the_picture_names_every_surface_and_every_unit(tmp_path):
    surfaces = {"one": SURFACE, "another": SURFACE.scaled(1.3)}
    figure = draw_surfaces(surfaces, random_loads(SURFACE, 50, 1).wrenches)
    titles = [axes.get_title() for axes in figure.axes]
    assert titles[:2] == ["one", "another"]
    labels = {axes.get_xlabel() for axes in figure.axes} | {a.get_ylabel() for a in figure.axes}
    assert labels == {"$f_x$ [N]", "$f_y$ [N]", r"$\tau_z$ [N m]"}
    legend = [text.get_text() for text in figure.axes[2].get_legend().get_texts()]
    assert legend == ["data", "one", "another"]
    save_figure(figure, tmp_path / "surfaces.png")
    assert (tmp_path / "surfaces.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("count", [0, 5])
def test_too_few_or_too_many_surfaces_are_refused(count):
    with pytest.raises(DataError, match=f"one to four surfaces, got {count}"):
        draw_surfaces({str(index): SURFACE for index in range(count)})


def test_a_distribution_ends_at_the_largest_error():
    from matplotlib.figure import Figure

    axes = Figure().subplots()
    draw_distributions(axes, {"a": [0.3, 0.1, 0.2], "b": [0.5]}, "error [-]")
    steps = axes.get_lines()[0].get_xydata()
    np.testing.assert_allclose(steps, [[0.1, 100 / 3], [0.2, 200 / 3], [0.3, 100.0]])
    assert axes.get_xlabel() == "error [-]"
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["a", "b"]
