"""The site: Markdown by MyST, reference pages made from the code itself when the site is built.

``pip install '.[docs]' && sphinx-build -W docs site``
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import reference_pages

import wearlab

project = "wearlab"
author = "The wearlab developers"
version = release = wearlab.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.mathjax"]
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
html_title = f"wearlab {version}"
html_static_path = ["_static"]
html_css_files = ["narrow.css"]
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#0b5b8c", "color-brand-content": "#0b5b8c"},
    "dark_css_variables": {"color-brand-primary": "#7cc0ea", "color-brand-content": "#7cc0ea"},
}


def setup(app):
    """Write the generated pages before the site is read."""
    app.connect("builder-inited", lambda app: reference_pages.write(Path(app.srcdir) / "reference"))
