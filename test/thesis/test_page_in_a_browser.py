# SPDX-License-Identifier: Apache-2.0
"""The promise of the page: a browser shows all of it, at the width of a phone, without network."""

import html
import json
import re

import pytest

from browser_helpers import document_of, needs_browser
from limit_surface_ros.thesis.exact_surfaces import STUDIES
from limit_surface_ros.thesis.run import carry_out
from limit_surface_ros.thesis.settings import QUICK
from limit_surface_ros.thesis.store import Store

pytest.importorskip("matplotlib", reason="matplotlib draws the pictures")

PHONE = 360
# Shows the page in a frame as wide as a phone and writes down what came of it.
FRAME = """<!doctype html><iframe width={width} height=800 srcdoc="{page}"></iframe><pre></pre>
<script>addEventListener("load", () => {{
  const page = document.querySelector("iframe").contentDocument;
  document.querySelector("pre").textContent = JSON.stringify({{
    width: page.documentElement.scrollWidth,
    window: page.documentElement.clientWidth,
    pictures: [...page.images].map(i => [i.naturalWidth, i.clientWidth, i.alt]),
    headings: [...page.querySelectorAll("h2")].map(h => h.textContent),
    claims: page.querySelectorAll(".claims li").length,
    ink: getComputedStyle(page.body).fontSize,
  }});
}})</script>"""


@needs_browser
def test_a_phone_shows_every_figure_within_its_width(tmp_path):
    page = carry_out(STUDIES, Store(tmp_path, QUICK)).read_text(encoding="utf-8")
    frame = tmp_path / "frame.html"
    frame.write_text(FRAME.format(width=PHONE, page=html.escape(page)), encoding="utf-8")
    dump = document_of(frame)
    seen = json.loads(html.unescape(re.search(r"<pre>(.*?)</pre>", dump, re.DOTALL)[1]))
    assert seen["width"] <= seen["window"] <= PHONE
    numbers = [heading.split()[0] for heading in seen["headings"]]
    assert numbers == ["What", *(study.number for study in STUDIES)]
    assert len(seen["pictures"]) == len(STUDIES)
    for natural, shown, alt in seen["pictures"]:
        assert natural >= 700
        assert 300 <= shown <= PHONE
        assert alt
    assert seen["claims"] == 5
    assert seen["ink"] == "16px"
