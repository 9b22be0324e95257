"""Sphinx's settings of the documentation site; ``python -m docs.site`` writes the sources."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))  # eomgen and docs.site, in the processes of a parallel build, too

from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx

from eomgen import __version__

project = "eomgen"
author = "the eomgen authors"
copyright = author
version = release = __version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.intersphinx",
    "numpydoc",
    "docs.site.docstrings",
    "docs.site.mathml",
    "docs.site.narrow",
    "docs.site.navigation",
]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns: list[str] = []
nitpicky = False
default_role = "code"
highlight_language = "none"
pygments_style = "friendly"
pygments_dark_style = "monokai"

myst_heading_anchors = 4
myst_enable_extensions = ["dollarmath"]

autodoc_typehints = "none"  # types stand in the sections Parameters and Returns
numpydoc_show_class_members = False
numpydoc_xref_param_type = False
python_maximum_signature_line_length = 88

# A build uses no network: inventories of other projects are files that the user names, none by default.
intersphinx_mapping: dict[str, tuple[str, str | None]] = {}

html_theme = "furo"
html_title = f"eomgen {version}"
html_static_path = ["static"]
html_css_files = ["eomgen.css"]
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#155e8a", "color-brand-content": "#155e8a"},
    "dark_css_variables": {"color-brand-primary": "#7cc4ec", "color-brand-content": "#7cc4ec"},
}
html_copy_source = False
html_show_sphinx = False


def setup(app: Sphinx) -> None:
    """Name the languages of blocks that Pygments does not know."""
    app.add_lexer("csv", TextLexer)
