"""Sphinx's configuration of the site; `docs/build` stages the sources and runs it."""

import inspect
import re
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any, get_type_hints

from docutils import nodes

DOCS = Path(__file__).resolve().parent
sys.path.insert(0, str(DOCS.parent))

from lightpaint import arrays  # noqa: E402
from lightpaint.version import __version__  # noqa: E402

project = "lightpaint"
author = "The lightpaint authors"
project_copyright = "The lightpaint authors"
version = release = __version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "sphinx_design",
]

# Documents are written for GitHub: its anchors, no directives but on the front page.
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 4
nb_execution_mode = "off"  # notebooks keep their outputs
# Widgets need a kernel, and scripts of another site; what a cell shows beside them does not.
nb_ipywidgets_js: dict[str, dict[str, str]] = {}
nb_mime_priority_overrides = [["html", "application/vnd.jupyter.widget-view+json", None]]

default_role = "code"  # docstrings have code in single backticks, like the documents
highlight_language = "text"
smartquotes = False  # "--" begins an option
add_module_names = False
toc_object_entries = False
python_maximum_signature_line_length = 80
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
napoleon_use_rtype = False

exclude_patterns = ["files"]

# For docs/build --links: what is no other site, such as the painter's own address.
linkcheck_ignore = [r"(?!https?://)", r"http://127\.0\.0\.1:8421"]
# Publishers refuse programs that ask for a paper; who registered its DOI answers them.
linkcheck_request_headers = {
    "https://doi.org/": {"Accept": "application/vnd.citationstyles.csl+json"}
}
linkcheck_timeout = 20
linkcheck_workers = 4

html_theme = "furo"
html_title = "lightpaint"
html_static_path = ["_static", "../lightpaint/paint/page/icon.svg"]
html_logo = "../lightpaint/paint/page/icon.svg"
html_favicon = "../lightpaint/paint/page/icon.svg"
html_extra_path = ["_build/extra"]
html_css_files = ["site.css"]
html_js_files = ["site.js"]
html_copy_source = False
html_show_sphinx = False
# A page opened from a disk may not read its neighbours.
html_show_search_summary = False
html_theme_options = {
    "light_css_variables": {
        "color-brand-primary": "#8a5100",
        "color-brand-content": "#8a5100",
        "color-brand-visited": "#6d4a75",
    },
    "dark_css_variables": {
        "color-brand-primary": "#f2b55c",
        "color-brand-content": "#f2b55c",
        "color-brand-visited": "#d3b3dc",
    },
}


def setup(app: Any) -> None:
    """Register what is done to every page."""
    app.connect("autodoc-before-process-signature", show_types)
    app.connect("autodoc-process-docstring", keep_colons, priority=400)  # before napoleon
    app.connect("autodoc-process-docstring", mark_names, priority=400)
    app.connect("doctree-resolved", dash_fields)


def show_types(app: Any, value: Any, is_bound: bool) -> None:
    """Show the types of arguments alone, without the checks and options in their annotations."""
    function = inspect.unwrap(value)
    if inspect.isfunction(function):
        with suppress(NameError):  # a type that only type checkers import
            # In place: what wraps the function has the same dict.
            function.__annotations__.update(get_type_hints(function, localns=vars(arrays)))


def keep_colons(app: Any, what: str, name: str, value: Any, options: Any, lines: list[str]) -> None:
    """Begin the docstring of a property with an empty comment.

    Otherwise napoleon takes what is before a colon in the first line for the property's type.
    """
    if what == "property":
        lines[:0] = ["..", ""]


def mark_names(app: Any, what: str, name: str, value: Any, options: Any, lines: list[str]) -> None:
    """Show as code the names in `name: what it is. other: what that is.` of a docstring.

    They are those of arguments or fields, before the first section.
    """
    try:
        names = "|".join(inspect.signature(value).parameters)
    except (TypeError, ValueError):
        return
    pattern = re.compile(rf"(?:^|(?<=[.;] ))(?:(?:{names})(?:, (?=\w)|(?=:)))+: ")
    for number, line in enumerate(lines):
        if line in SECTIONS:
            return
        lines[number] = pattern.sub(lambda match: re.sub(r"\w+", r"`\g<0>`", match[0]), line)


#: Headings after which a docstring lists names itself.
SECTIONS = ("Args:", "Attributes:", "Returns:", "Raises:", "Examples:")


def dash_fields(app: Any, doctree: nodes.document, name: str) -> None:
    """Write a dash between an argument and what it is, as typography has it."""
    for text in list(doctree.findall(nodes.Text)):
        if text == " -- ":
            text.parent.replace(text, nodes.Text(" – "))
