# SPDX-License-Identifier: Apache-2.0
"""One page that shows every figure: it needs no other file, no network and no wide screen."""

from __future__ import annotations

import base64
from html import escape
from typing import TYPE_CHECKING

from limit_surface_ros.thesis.findings import VERDICTS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.thesis.findings import Claim
    from limit_surface_ros.thesis.records import Record

_MARKS = dict(zip(VERDICTS, ("✓", "~", "✗"), strict=True))
_CLASSES = dict(zip(VERDICTS, ("yes", "partly", "no"), strict=True))

_STYLE = """
:root { --ink: #1c1c1c; --soft: #5a5a5a; --line: #dcdcdc; --blue: #0072b2; }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1rem; max-width: 60rem; color: var(--ink); background: #fff;
  font: 1rem/1.5 system-ui, sans-serif; overflow-wrap: anywhere; }
h1 { font-size: 1.6rem; line-height: 1.2; }
h3 { font-size: 1rem; margin: 1rem 0 .25rem; }
h2 { font-size: 1.2rem; margin: 2.5rem 0 .5rem; border-top: 1px solid var(--line);
  padding-top: 1rem; }
a { color: var(--blue); }
img { display: block; width: 100%; height: auto; margin: .5rem 0; }
nav ol { columns: 2 16rem; padding-left: 0; list-style: none; font-size: .9rem; }
.claims { list-style: none; padding: 0; }
.claims li { margin: .6rem 0; padding: .5rem .75rem; border-left: .3rem solid var(--soft);
  background: #f6f6f6; }
.claims .yes { border-color: #009e73; }
.claims .partly { border-color: #0072b2; }
.claims .no { border-color: #d55e00; }
.claims b { white-space: nowrap; }
.claims span { display: block; color: var(--soft); font-size: .92rem; }
table { border-collapse: collapse; width: 100%; font-size: .9rem; }
th { white-space: nowrap; }
th, td { text-align: left; vertical-align: top; padding: .3rem .5rem .3rem 0;
  border-bottom: 1px solid var(--line); }
td:last-child { white-space: nowrap; }
pre { overflow-x: auto; font-size: .8rem; line-height: 1.35; padding: .5rem; background: #f6f6f6;
  overflow-wrap: normal; }
.beyond, .files { color: var(--soft); font-size: .92rem; }
"""


def page_of(records: Sequence[Record], subtitle: str) -> str:
    """Return the whole page.

    Args:
        records: The figures in order.
        subtitle: How they were made: settings, version.
    """
    claims = [claim for record in records for claim in record.claims]
    counts = ", ".join(
        f"{sum(claim.verdict == verdict for claim in claims)} {words}"
        for verdict, words in zip(VERDICTS, ("hold", "hold partly", "do not hold"), strict=True)
    )
    contents = "".join(
        f'<li><a href="#{record.folder.name}">{escape(record.number)}</a> '
        f"{escape(record.title)}</li>\n"
        for record in records
    )
    figures = "".join(_section(record) for record in records)
    return (
        "<!doctype html>\n"
        '<html lang="en"><head><meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        "<title>The thesis's figures, rebuilt</title>\n"
        f"<style>{_STYLE}</style></head><body>\n"
        "<header><h1>The thesis's figures, rebuilt from scratch</h1>\n"
        f"<p>{escape(subtitle)}</p>\n"
        f"<p>Of {len(claims)} claims of the text, {counts}. Each stands with its figure, in this "
        "package's words, with what was measured.</p></header>\n"
        f"<nav><ol>\n{contents}</ol></nav>\n"
        f"<main>\n{_verdicts(records)}{figures}</main>\n"
        "</body></html>\n"
    )


def claims_text(records: Sequence[Record]) -> str:
    """Return all claims as a table in Markdown: claim, what was measured, verdict."""
    rows = ["| figure | the text says | measured | verdict |", "|---|---|---|---|"]
    rows += [
        f"| {record.number} | {_cell(claim.said)} | {_cell(claim.measured)} | {claim.verdict} |"
        for record in records
        for claim in record.claims
    ]
    return "\n".join(rows) + "\n"


def _cell(text: str) -> str:
    return text.replace("|", r"\|").replace("*", r"\*")


def _verdicts(records: Sequence[Record]) -> str:
    rows = "".join(
        f'<tr><td><a href="#{record.folder.name}">{escape(record.number)}</a></td>'
        f"<td>{escape(claim.said)}</td>"
        f"<td>{_MARKS[claim.verdict]} {claim.verdict}</td></tr>\n"
        for record in records
        for claim in record.claims
    )
    if not rows:
        return ""
    return (
        '<h2 id="claims">What holds</h2>\n<table><thead><tr><th>figure</th><th>the text says</th>'
        f"<th>verdict</th></tr></thead><tbody>\n{rows}</tbody></table>\n"
    )


def _section(record: Record) -> str:
    pictures = "".join(
        _picture(record, name, caption)
        for name, caption in zip(record.pictures, record.captions, strict=True)
    )
    # What is wider than the page is reached by keys, too.
    listings = "".join(
        f'<h3>{escape(heading)}</h3>\n<pre tabindex="0">{escape(text)}</pre>\n'
        for heading, text in record.listings.items()
    )
    claims = "".join(_claim(claim) for claim in record.claims)
    tables = ", ".join(
        f'<a href="{record.folder.name}/{escape(name)}">{escape(name)}</a>'
        for name in record.tables
    )
    return (
        f'<section id="{record.folder.name}">\n'
        f"<h2>{escape(record.number)} {escape(record.title)}</h2>\n"
        + (f"<p>{escape(record.remarks)}</p>\n" if record.remarks else "")
        + pictures
        + listings
        + (f'<ul class="claims">\n{claims}</ul>\n' if claims else "")
        + f'<p class="files">Numbers: {tables}</p>\n</section>\n'
    )


def _picture(record: Record, name: str, caption: str) -> str:
    data = base64.b64encode((record.folder / name).read_bytes()).decode()
    heading = f'<p class="beyond">{escape(caption)}:</p>\n' if caption else ""
    label = f"{record.number} {record.title}" + (f": {caption}" if caption else "")
    return f'{heading}<img alt="{escape(label)}" src="data:image/png;base64,{data}">\n'


def _claim(claim: Claim) -> str:
    return (
        f'<li class="{_CLASSES[claim.verdict]}">{escape(claim.said)} '
        f"<b>{_MARKS[claim.verdict]} {claim.verdict}</b>"
        f"<span>{escape(claim.measured)}</span></li>\n"
    )
