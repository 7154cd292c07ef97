"""How Sphinx makes a site of the project's Markdown: `make docs`.

The source folder is the project itself, so that a link between two pages, or from a page to a
source file, is the same on a forge and in the site.
"""

import sys
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(HERE), str(ROOT)]

project = "mortarcheck"
project_copyright = "The mortarcheck contributors, GPL-3.0-or-later"
root_doc = "docs/index"
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "mathml",
    "pages",
]
include_patterns = [
    "README.md",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
    "docs/*.md",
    "docs/design/*.md",
    "results/README.md",
]
exclude_patterns = [".*", "cases", "solver", "tests", "workflow", "profiles", "results/[!R]*"]

# Headings have the anchors that forges give them; formulas are written between dollar signs.
myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_heading_anchors = 4

# What annotations name outside of the project is not looked up: that would take a network.
nitpicky = True
nitpick_ignore_regex = [("py:.*", r"(?!solver\.).*")]
default_role = "code"
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
autodoc_use_legacy_class_based = False
napoleon_google_docstring = True

html_theme = "furo"
html_title = "mortarcheck"
html_math_renderer = "mathml"
html_static_path = [str(HERE / "static")]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
pygments_style, pygments_dark_style = "default", "github-dark"
