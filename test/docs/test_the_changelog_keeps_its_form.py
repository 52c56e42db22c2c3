# SPDX-License-Identifier: Apache-2.0
"""Each part of a release lists what was added, changed and fixed, once each and in this order."""

import re
from pathlib import Path

TEXT = (Path(__file__).resolve().parents[2] / "CHANGELOG.rst").read_text(encoding="utf-8")
SORTS = ["Added", "Changed", "Fixed"]


def parts():
    """Return release, part and text of each part."""
    for release in re.split(r"\n(?=[^\n]+\n-{4,}\n)", TEXT)[1:]:
        for part in re.split(r"\n(?=[^\n]+\n~{4,}\n)", release)[1:]:
            yield release.splitlines()[0], part.splitlines()[0], part


def test_every_part_has_each_heading_at_most_once_and_in_order():
    assert len(list(parts())) > 12
    for release, part, text in parts():
        found = re.findall(r"^\*\*(\w+)\*\*$", text, re.MULTILINE)
        assert found == [sort for sort in SORTS if sort in found], (release, part, found)


def test_every_line_is_below_a_heading_and_no_part_is_there_twice():
    seen = [(release, part) for release, part, _ in parts()]
    assert len(seen) == len(set(seen))
    for release, part, text in parts():
        before = text.partition("**")[0]
        assert not re.search(r"^\* ", before, re.MULTILINE), (release, part)
