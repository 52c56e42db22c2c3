# SPDX-License-Identifier: Apache-2.0
"""The promise of `explore_surface`: a page of one file whose answers are those of the library."""

import html
import json
import re

import numpy as np
import pytest

from browser_helpers import document_of, needs_browser
from export_models import MODELS, SCALING, TRIANGLE, vectors
from limit_surface_ros.export.explorer import (
    explorer_page,
    outline_of,
    scatter_numbers,
    scatter_script,
)
from limit_surface_ros.export.javascript import javascript_engine
from limit_surface_ros.files.surface_file import SurfaceModel, write_surface_model
from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.motion.push import push
from limit_surface_ros.surface import PointContacts
from limit_surface_ros.surface.kinds.dissipation_scatter import (
    TwistScatter,
    UncertainSurface,
    log_map,
    region_quantile,
    tangent_basis,
)
from limit_surface_ros.tools.explore_surface import main

# Presses keys and moves sliders as somebody would, then writes down where everything stands.
USE = """<pre id="seen"></pre><script type="module">
const press = (id, key, times) => { for (let i = 0; i < times; ++i) document.getElementById(id)
  .dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true })); };
const slide = (id, value) => { const input = document.getElementById(id); input.value = value;
  input.dispatchEvent(new Event("input")); };
press("load-handle", "ArrowLeft", 10);
press("load-handle", "ArrowDown", 30);
slide("moment", 0.3);
press("push-handle", "ArrowRight", 7);
slide("direction", DIRECTION);
slide("friction", FRICTION);
const box = document.getElementById("push").getBoundingClientRect();
document.getElementById("seen").textContent = [...document.querySelectorAll("#answers tr")]
  .map((row) => [...row.children].map((cell) => cell.textContent).join("|"))
  .concat(document.getElementById("load-handle").getAttribute("aria-valuetext"),
          document.getElementById("push-handle").getAttribute("aria-valuetext"),
          String(document.documentElement.scrollWidth <= innerWidth)).join("\\n");
</script>"""


def numbers(text):
    """Return the numbers in a text."""
    return [float(each) for each in re.findall(r"-?\d+\.?\d*(?:e[+-]?\d+)?", text)]


@needs_browser
@pytest.mark.parametrize(("direction", "friction"), [(0, 0.3), (70, 0.3), (-70, 0.3), (20, 1.5)])
def test_a_page_that_is_used_shows_what_the_library_says(direction, friction, tmp_path):
    surfaces = {"triangle": TRIANGLE, "norms": MODELS["norms_4"]}
    models = [SurfaceModel(name, surface) for name, surface in surfaces.items()]
    use = USE.replace("DIRECTION", str(direction)).replace("FRICTION", str(friction))
    page = tmp_path / "page.html"
    page.write_text(explorer_page(models).replace("</body>", use + "</body>"), encoding="utf-8")
    dump = document_of(page, "--window-size=360,800")
    seen = html.unescape(re.search(r'<pre id="seen">(.*?)</pre>', dump, re.DOTALL)[1])
    *rows, load, place, fits = seen.split("\n")
    assert fits == "true"
    force = numbers(load)
    point = np.array(numbers(place))
    moment = 0.3 * max(s.wrench_of_twist([0.0, 0.0, 1.0])[2] for s in surfaces.values())
    # The place is on an edge: its inward normal is that edge's.
    corners = outline_of(models[0])
    ends = np.roll(corners, -1, axis=0)
    edges = ends - corners
    to_point = point - corners
    away = np.abs(edges[:, 0] * to_point[:, 1] - edges[:, 1] * to_point[:, 0])
    away /= np.linalg.norm(edges, axis=1)
    tangent = edges[away.argmin()] / np.linalg.norm(edges[away.argmin()])
    normal = np.array([-tangent[1], tangent[0]])
    angle = np.radians(direction)
    velocity = np.cos(angle) * normal - np.sin(angle) * tangent
    for row, (name, surface) in zip(rows, surfaces.items(), strict=True):
        shown, factor, twist, _, mode, pushed = row.split("|")
        assert shown == name
        wrench = [*force, moment]
        assert numbers(factor)[0] == pytest.approx(surface.load_factor(wrench), rel=0.02)
        assert ("slides" in factor) == (numbers(factor)[0] >= 1.0)
        right = surface.twist_of_wrench(wrench) / SCALING.twist_unit
        assert numbers(twist) / SCALING.twist_unit == pytest.approx(right, abs=0.05)
        expected = push(surface, point, normal, friction, velocity)
        assert mode == {"stick": "sticks"}.get(
            expected.mode, expected.mode.replace("slide_", "slides ")
        )
        found = np.array(numbers(pushed)) / SCALING.twist_unit
        assert found == pytest.approx(expected.twist / SCALING.twist_unit, abs=0.05)


def uncertain(name):
    """A dissipation model with folds near it, such as a fit that leaves pushes out makes."""
    surface, rng = MODELS[name], np.random.default_rng(0)
    matrices = surface.matrices
    near = [matrices * rng.lognormal(0.0, 0.2, (len(matrices), 1, 1)) for _ in range(5)]
    return UncertainSurface(surface, TwistScatter(matrices, tuple(near), 0.2))


REGIONS = """<!doctype html><meta charset="utf-8"><pre></pre><script type="module">
{script}
const scatters = {scatters}, asked = {asked}, answers = {{}};
for (const [name, numbers] of Object.entries(scatters)) {{
  answers[name] = asked[name].map(makeScatter(numbers))
    .map(({{ halfAxes, around }}) => ({{ halfAxes, border: around(1) }}));
}}
document.querySelector("pre").textContent = JSON.stringify(answers);
</script>"""


@needs_browser
def test_a_browser_gives_the_regions_of_the_library(tmp_path):
    models = {name: uncertain(name) for name in ("dissipation_4", "dissipation_with_facets")}
    loads = {name: vectors(name, 40) * SCALING.wrench_unit for name in models}
    twists = {name: each.surface.twist_of_wrench(loads[name]) for name, each in models.items()}
    asked = {name: each / SCALING.twist_unit for name, each in twists.items()}
    page = tmp_path / "page.html"
    text = REGIONS.format(
        script=javascript_engine() + scatter_script(),
        scatters=json.dumps({k: scatter_numbers(m.scatter) for k, m in models.items()}),
        asked=json.dumps({name: each.tolist() for name, each in asked.items()}),
    )
    page.write_text(text, encoding="utf-8")
    found = re.search(r"<pre>(.*?)</pre>", document_of(page), re.DOTALL)[1]
    answers = json.loads(html.unescape(found))
    for name, model in models.items():
        plane = tangent_basis(asked[name])
        scale = region_quantile(0.9) * model.scatter.plane_scale(asked[name], plane)
        axes = np.sqrt(np.linalg.eigvalsh(scale))[:, ::-1]
        shown = np.array([each["halfAxes"] for each in answers[name]])
        np.testing.assert_allclose(shown, axes, rtol=0.0, atol=1e-9)
        told = model.twist_with_covariance(loads[name], 0.9).half_axes
        np.testing.assert_allclose(shown, told, rtol=1e-6)
        # Twists on the border are at the quantile.
        for row, unit in enumerate(asked[name]):
            border = np.array(answers[name][row]["border"])
            many = [
                np.tile(unit, (len(border), 1)),
                border,
                np.tile(plane[row], (len(border), 1, 1)),
            ]
            away = log_map(*many)
            squares = np.einsum("ni,ij,nj->n", away, np.linalg.inv(scale[row]), away)
            if axes[row, 0] < np.pi:
                np.testing.assert_allclose(squares, 1.0, atol=1e-9)


@needs_browser
def test_a_model_that_knows_its_scatter_shows_it_and_another_shows_none(tmp_path):
    fit = {"uncertainty": uncertain("dissipation_4").scatter.stored()}
    models = [
        SurfaceModel("pushed", MODELS["dissipation_4"], fit=fit),
        SurfaceModel("triangle", TRIANGLE),
    ]
    page = tmp_path / "page.html"
    page.write_text(explorer_page(models), encoding="utf-8")
    dump = document_of(page)
    cells = [
        re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row)
        for row in re.findall(r"<tr>(.*?)</tr>", dump.partition('id="answers"')[2])
    ]
    told = re.fullmatch(r"\(.*\), (9 of 10 motions within (\d+) deg)", cells[0][2])
    load = re.search(r'id="load-handle".*?aria-valuetext="(.*?)"', dump, re.DOTALL)[1]
    answer = models[0].uncertain.twist_with_covariance([[*numbers(load), 0.0]], 0.9)
    assert float(told[2]) == pytest.approx(np.degrees(answer.half_axes[0, 0]), abs=1.0)
    assert "within" not in cells[1][2]
    said = re.search(r'<p id="said"[^>]*>(.*?)</p>', dump)[1].split("; ")
    assert [told[1] in each for each in said] == [True, False]
    assert dump.count('class="fan"') == 1


def test_the_page_needs_no_network_and_holds_names_as_text(tmp_path):
    text = explorer_page([SurfaceModel("</script><b>box & co", TRIANGLE)])
    assert not re.search(r"(?:src|href)=|@import|url\(|fetch\(", text)
    assert "</script><b>" not in text
    assert "&lt;b&gt;box &amp; co" in text


def test_an_outline_is_the_hull_of_support_points_or_a_disc():
    assert len(outline_of(SurfaceModel("triangle", TRIANGLE))) == 3
    line = PointContacts([[0.0, 0.0], [0.1, 0.0], [0.2, 0.0]], [1.0] * 3, SCALING)
    assert len(outline_of(SurfaceModel("line", line))) == 48
    assert len(outline_of(SurfaceModel("norms", MODELS["norms_4"]))) == 48


@pytest.mark.parametrize("order", [1, -1])
def test_an_outline_of_the_model_is_taken_about_its_reference_point(order):
    corners = np.array([[0.0, 0.0], [0.2, 0.0], [0.2, 0.1], [0.0, 0.1]])
    model = SurfaceModel(
        "box", TRIANGLE, reference_point=(0.05, 0.02), outline=Polygon(corners[::order])
    )
    shown = outline_of(model)
    assert {tuple(corner) for corner in shown.round(9)} == {
        tuple(corner) for corner in (corners - [0.05, 0.02]).round(9)
    }
    x, y = shown.T
    assert (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() > 0.0


def test_the_program_writes_the_page_and_refuses_what_it_cannot_show(tmp_path, capsys):
    paths = []
    for name in "abcde":
        paths.append(tmp_path / f"{name}.yaml")
        write_surface_model(SurfaceModel(name, TRIANGLE), paths[-1])
    page = tmp_path / "page.html"
    assert main([*map(str, paths[:2]), "-o", str(page)]) == 0
    assert page.read_text(encoding="utf-8").startswith("<!doctype html>")
    assert main([*map(str, paths), "-o", str(page)]) == 2
    assert "1 to 4" in capsys.readouterr().err
    assert main([str(paths[0]), str(paths[0]), "-o", str(page)]) == 2
    assert "two files" in capsys.readouterr().err
    write_surface_model(SurfaceModel("else", TRIANGLE, frame_id="other"), paths[1])
    assert main([str(paths[0]), str(paths[1]), "-o", str(page)]) == 2
