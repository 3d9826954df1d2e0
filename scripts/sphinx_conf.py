"""Settings with which Sphinx builds the manual: see scripts/manual."""

from parcontact import __version__

project, release, author = "parcontact", __version__, "parcontact developers"
copyright = author
default_role = "code"  # of words in `backticks` in docstrings
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.mathjax", "sphinx-mathjax-offline"]
myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
html_theme, html_title = "furo", "parcontact"
html_static_path, html_css_files = ["static"], ["manual.css"]
html_copy_source = False
autodoc_typehints = "none"
nitpicky = True
nitpick_ignore_regex = [("py:.*", ".*")]  # types of other packages have no pages here
