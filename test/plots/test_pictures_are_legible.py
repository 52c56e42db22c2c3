# SPDX-License-Identifier: Apache-2.0
"""Labels lie within the picture and apart, and no curve lies under an axis."""

from itertools import combinations

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="matplotlib draws the pictures")

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.motion.rollout import simulate_push
from limit_surface_ros.motion.sliding.inertia import Inertia
from limit_surface_ros.motion.sliding.slide import slide
from limit_surface_ros.plots.canvas import new_figure
from limit_surface_ros.plots.distributions import draw_distributions
from limit_surface_ros.plots.push_view import draw_push
from limit_surface_ros.plots.slide_view import draw_slide
from limit_surface_ros.plots.surface_view import draw_solid, draw_surfaces
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.scaling import Scaling

BODY = PointContacts([[-1.0, 0.2], [0.5, 0.9], [0.3, -1.1]], [0.4, 0.5, 0.6], Scaling(1.0, 1.5))


@pytest.fixture
def drawn(monkeypatch):
    """Return a function that draws a figure and gives what stands where in each solid panel."""
    places = {}
    draw = Text.draw

    def noting(self, renderer):
        draw(self, renderer)
        if self.get_visible() and self.get_text() and hasattr(self.axes, "zaxis"):
            box = self.get_window_extent(renderer)
            places.setdefault(self.axes, {})[self.get_text(), round(box.x0)] = box

    monkeypatch.setattr(Text, "draw", noting)

    def of(figure):
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        places.clear()
        canvas.draw()
        return [[(text, box) for (text, _), box in found.items()] for found in places.values()]

    return of


def panels(rows, columns, width, height):
    with new_figure(width, height) as figure:
        for place in range(rows * columns):
            axes = figure.add_subplot(rows, columns, place + 1, projection="3d")
            draw_solid(axes, BODY)
            axes.set_title("3 terms, J2", y=0.98)
    return figure


@pytest.mark.parametrize(
    "figure",
    [
        pytest.param(lambda: panels(2, 3, 7.5, 5.2), id="as figure 3.6"),
        pytest.param(lambda: panels(3, 3, 7.5, 7.5), id="as figure 3.8"),
        pytest.param(lambda: draw_surfaces({"body": BODY}), id="one surface"),
        pytest.param(lambda: draw_surfaces(dict.fromkeys("abcd", BODY)), id="four surfaces"),
    ],
)
def test_every_label_of_a_solid_is_whole_and_apart_from_the_others(drawn, figure):
    figure = figure()
    whole = figure.bbox
    panels = drawn(figure)
    assert panels
    for texts in panels:
        assert {"$f_x$ [N]", "$f_y$ [N]", r"$\tau_z$ [N m]"} <= {text for text, _ in texts}
        for text, box in texts:
            assert whole.x0 <= box.x0, text
            assert box.x1 <= whole.x1, text
            assert whole.y0 <= box.y0 < box.y1 <= whole.y1, text
        ticks = [(text, box) for text, box in texts if "[" not in text]
        for (first, one), (second, other) in combinations(ticks, 2):
            assert not one.overlaps(other), (first, second)


def test_an_exact_model_is_a_line_beside_the_axis():
    with new_figure(5.0, 4.0) as figure:
        axes = figure.subplots()
        errors = {"rough": np.linspace(0.0, 0.5, 9), "exact": np.zeros(9)}
        draw_distributions(axes, errors, "error")
    left, right = axes.get_xlim()
    rise, end = (each.get_segments()[0] for each in axes.collections[2:])
    assert left < 0.0
    np.testing.assert_allclose(rise[0], [0.0, 0.0])
    np.testing.assert_allclose(end, [[0.0, 100.0], [right, 100.0]])
    assert axes.get_ylim()[1] > 100.0


def test_models_that_are_all_exact_are_drawn():
    with new_figure(5.0, 4.0) as figure:
        axes = figure.subplots()
        draw_distributions(axes, {"exact": np.zeros(3)}, "error")
    assert axes.get_xlim()[1] > 0.0


SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def picture_of_a_push():
    outline = Polygon(SQUARE)
    return draw_push(
        simulate_push(BODY, outline, 0.1, 0.3, [0, 0, 0], [[-1.5, 0.4], [1.0, 0.2]]), outline, 0.1
    )


def picture_of_a_slide():
    return draw_slide(slide(BODY, Inertia(1.0, 1.0), (1.0, 0.3, 2.0)), SQUARE, BODY)


@pytest.mark.parametrize("picture", [picture_of_a_push, picture_of_a_slide])
def test_the_legend_of_a_way_covers_no_part_of_it(picture):
    figure = picture()
    FigureCanvasAgg(figure).draw()
    (legend,) = figure.legends
    box = legend.get_window_extent()
    assert figure.bbox.x0 <= box.x0 < box.x1 <= figure.bbox.x1
    assert figure.bbox.y0 <= box.y0
    for axes in figure.axes:
        assert box.y1 <= axes.get_tightbbox().y0
