"""The site: Markdown by MyST, reference pages made by ``python docs/reference_pages.py``.

``pip install '.[docs]' && sphinx-build -W docs site``
"""

import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import reference_pages

import wearlab

project = "wearlab"
author = "The wearlab developers"
version = release = wearlab.__version__
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
]
myst_enable_extensions = ["dollarmath", "deflist", "attrs_inline"]
myst_heading_anchors = 3
exclude_patterns = ["_build", "README.md"]
autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_use_param = False
napoleon_use_rtype = False
napoleon_preprocess_types = False
suppress_warnings = ["myst.header", "misc.highlighting_failure"]
html_theme = "furo"
html_show_copyright = False
html_title = f"wearlab {version}"
html_static_path = ["_static"]
html_css_files = ["narrow.css"]
html_theme_options = {
    "light_css_variables": {
        "color-brand-primary": "#0b5b8c",
        "color-brand-content": "#0b5b8c",
    },
    "dark_css_variables": {
        "color-brand-primary": "#7cc0ea",
        "color-brand-content": "#7cc0ea",
    },
}


RAISED = re.compile(r"^(\w+) : (.+)$")


def spread_raises(app, what, name, obj, options, lines):
    """Write ``Error : when`` of a Raises section as its name, and below it when."""
    inside = False
    found = []
    for number, line in enumerate(lines):
        if line.strip() == "Raises":
            inside = True
        elif number + 1 < len(lines) and set(lines[number + 1].strip()) == {"-"}:
            inside = False
        told = RAISED.match(line) if inside else None
        found += [line] if told is None else [told[1], f"    {told[2]}"]
    lines[:] = found


def stack_tables(app, page, source):
    """Let a telephone stack the cells of the reference pages' tables."""
    if page.startswith(("reference/", "papers/")):
        source[0] = reference_pages.stacked(source[0])


def make_checks(app):
    """Write the list of all checks, which only the site has."""
    reference_pages.write_checks(Path(app.srcdir) / "reference")


def setup(app):
    """Shape docstrings and tables for the site; other reference pages are committed."""
    app.connect("builder-inited", make_checks)
    app.connect(
        "autodoc-process-docstring", spread_raises, priority=400
    )  # before napoleon
    app.connect("source-read", stack_tables)
