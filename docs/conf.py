# SPDX-License-Identifier: Apache-2.0
"""How the documentation is built: `make docs`; every warning is an error."""

import re
import sys
from pathlib import Path

DOCS = Path(__file__).resolve().parent
sys.path.insert(0, str(DOCS))
sys.path.insert(0, str(DOCS.parent))

from generate_explorer import write_explorer  # noqa: E402
from generate_reference import write_pages  # noqa: E402

project = "limit_surface_ros"
author = "limit_surface_ros maintainers"
project_copyright = "limit_surface_ros maintainers, Apache-2.0"

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx-mathjax-offline",
    "sphinx_copybutton",
]
exclude_patterns = ["_build", "reference/generated/explorer"]
myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3

autodoc_default_options = {
    "members": True,
    "member-order": "bysource",
    "show-inheritance": True,
    # What a module takes from another is described there.
    "ignore-module-all": True,
}
autodoc_typehints = "none"
# Attributes are described in their class and have no entries of their own.
napoleon_use_ivar = True

# Of a session in Python only what is typed is copied.
copybutton_prompt_text = r">>> |\.\.\. "
copybutton_prompt_is_regexp = True

html_theme = "furo"
html_title = "limit_surface_ros"
html_static_path = ["_static"]
html_css_files = ["pictures.css"]
html_js_files = ["scroll.js"]
html_theme_options = {"navigation_with_keys": True}

# Docstrings are written to be read in the code: |x| is a norm there, `name` is code, and *.yaml is
# a pattern; reStructuredText would take the three for markup.
CODE = re.compile(r"``.+?``|`[^`]+`")


def as_markup(text):
    """Return a line of a docstring with code marked as code, and all else as plain text."""
    if text.lstrip().startswith((">>>", "...")):
        return text
    parts, end = [], 0
    for match in CODE.finditer(text):
        parts += [re.sub(r"([|*])", r"\\\1", text[end : match.start()])]
        parts += [f"``{match[0].strip('`')}``"]
        end = match.end()
    return "".join([*parts, re.sub(r"([|*])", r"\\\1", text[end:])])


def setup(app):
    """Have docstrings marked up before they are taken apart."""

    def mark_up(app, what, name, item, options, lines):
        marked = []
        for paragraph in "\n".join(lines).split("\n\n"):
            rows = paragraph.split("\n")
            if what == "module" and any(row.startswith(" ") for row in rows):
                # An example of a file, or a table: shown as it stands.
                marked += [".. code-block:: text", "", *(f"   {row}" for row in rows), ""]
            else:
                # The block that follows `::` is marked above.
                marked += [*map(as_markup, re.sub("::$", ":", paragraph).split("\n")), ""]
        lines[:] = marked

    app.connect("autodoc-process-docstring", mark_up, priority=100)


write_pages(DOCS / "reference" / "generated")
# Copied beside the pages, into which it is framed.
html_extra_path = [str(write_explorer(DOCS / "reference" / "generated" / "explorer"))]
