"""Sphinx configuration. The scenario reference is made from the schema while the pages are read."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

import cdfctl

project = "cdfctl"
author = "The cdfctl developers"
project_copyright = "the cdfctl developers"
release = version = cdfctl.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "generated",
    "experiment",
]
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = "cdfctl"
nitpicky = False

myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence", "deflist"]
myst_heading_anchors = 3

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
