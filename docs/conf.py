"""The documentation site, built without network: `sphinx-build -W docs out/site` (extra `docs`).

`-D with_gallery=0` leaves out the pages of the catalog's mechanisms, which take minutes.
"""

from __future__ import annotations

import sys
from importlib.metadata import version as installed
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

project = "mechlab"
author = "The mechlab developers"
project_copyright = "The mechlab developers, Apache-2.0"
release = version = installed("mechanism-lab")

extensions = ["myst_parser", "sphinx.ext.autodoc", "mathml", "reference", "schemas", "lessons", "gallery"]
exclude_patterns = ["_build", "_ext"]
nitpicky = False
default_role = "code"
smartquotes = False  # quotation marks of commands stay what they are

myst_enable_extensions = ["dollarmath", "deflist", "colon_fence", "attrs_inline"]
myst_heading_anchors = 3

autodoc_typehints = "signature"
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
python_maximum_signature_line_length = 90
add_module_names = False

html_theme = "furo"
html_title = "mechlab"
html_static_path = ["_static"]
html_favicon = "_static/icon.svg"
html_css_files = ["site.css"]
html_show_sphinx = False
html_copy_source = False
html_theme_options = {"sidebar_hide_name": False, "navigation_with_keys": True}
