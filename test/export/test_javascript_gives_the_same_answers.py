# SPDX-License-Identifier: Apache-2.0
"""The promise of `--to js`: a browser gives the library's answers."""

import html
import json
import re
import shutil
import subprocess

import numpy as np
import pytest

from browser_helpers import document_of, needs_browser
from export_models import MODELS, SCALING, scaled_error, vectors
from limit_surface_ros.export.javascript import (
    javascript_engine,
    javascript_module,
    javascript_numbers,
)
from limit_surface_ros.export.portable import portable

NODE = shutil.which("node")
COUNT = 200
PAGE = """<!doctype html><meta charset="utf-8"><pre></pre><script type="module">
{engine}
const models = {models}, asked = {asked}, rho = {rho};
const answers = {{}};
for (const [name, numbers] of Object.entries(models)) {{
  const surface = makeSurface(numbers);
  answers[name] = asked[name].map((x) => {{
    const wrench = [x[0], x[1], x[2] * rho], twist = [x[0], x[1], x[2] / rho];
    return [surface.loadFactor(wrench), ...surface.twistOfWrench(wrench),
            ...surface.wrenchOfTwist(twist)];
  }});
}}
document.querySelector("pre").textContent = JSON.stringify(answers);
</script>"""


@needs_browser
def test_a_browser_gives_the_answers_of_the_library(tmp_path):
    numbers = {
        name: json.loads(javascript_numbers(portable(s), name)) for name, s in MODELS.items()
    }
    asked = {name: vectors(name, COUNT) for name in MODELS}
    rho = SCALING.characteristic_length
    page = tmp_path / "page.html"
    page.write_text(
        PAGE.format(
            engine=javascript_engine(),
            models=json.dumps(numbers),
            asked=json.dumps({name: each.tolist() for name, each in asked.items()}),
            rho=rho,
        ),
        encoding="utf-8",
    )
    dump = document_of(page)
    answers = json.loads(html.unescape(re.search(r"<pre>(.*?)</pre>", dump, re.DOTALL)[1]))
    for name, surface in MODELS.items():
        found = np.array(answers[name])
        wrenches, twists = asked[name] * [1.0, 1.0, rho], asked[name] / [1.0, 1.0, rho]
        right = np.array([surface.load_factor(each) for each in wrenches])
        assert np.abs(found[:, 0] / right - 1.0).max() < 1e-12, name
        for columns, unit, rights in (
            (found[:, 1:4], SCALING.twist_unit, map(surface.twist_of_wrench, wrenches)),
            (found[:, 4:7], SCALING.wrench_unit, map(surface.wrench_of_twist, twists)),
        ):
            error = scaled_error(columns, np.array(list(rights)), unit)
            assert np.quantile(error, 0.75 if "nearly" in name else 0.99) < 1e-12, name
            assert error.max() < 1e-9, name


@pytest.mark.skipif(NODE is None, reason="no Node.js on this machine")
def test_the_module_is_one_for_node_too_and_has_no_answer_where_there_is_none(tmp_path):
    text = javascript_module(portable(MODELS["triangle"]), "triangle", "A surface.")
    (tmp_path / "triangle.mjs").write_text(text, encoding="utf-8")
    script = (
        'import { surface as s } from "./triangle.mjs"; console.log(JSON.stringify(['
        "s.name, s.loadFactor([0, 0, 0]), s.twistOfWrench([0, 0, 0]), s.loadFactor([1, NaN, 0])]))"
    )
    (tmp_path / "ask.mjs").write_text(script, encoding="utf-8")
    done = subprocess.run(
        [NODE, "ask.mjs"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert json.loads(done.stdout) == ["triangle", 0, None, None]
