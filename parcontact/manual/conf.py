"""How Sphinx builds the manual: see scripts/manual."""

from parcontact import __version__

project, release, author = "parcontact", __version__, "parcontact developers"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.mathjax", "sphinx-mathjax-offline"]
myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
html_theme, html_title = "furo", "parcontact"
html_static_path: list[str] = []
html_copy_source = False
autodoc_typehints = "none"
nitpicky = True
nitpick_ignore_regex = [("py:.*", ".*")]  # types of other packages have no pages here
