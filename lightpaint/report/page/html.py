"""Templates of the report's parts, which escape what is put into them.

Each section has a template of Jinja2 in `templates/`, and its module finds the values.
`pieces.html` has the macros that they share.
"""

import json
import re
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from typing import Any

import jinja2
import rcssmin
from markupsafe import Markup

from lightpaint.report.basis_memo import ROWS_SHOWN, SPARE_ROWS
from lightpaint.report.phrases import spoken_percent
from lightpaint.viewer import compact_script, source, styles, unindented

#: Folder of the report's templates, below the package.
TEMPLATES = "report/page/templates"


def html(template: str, /, **values: Any) -> Markup:
    """Return a template with its values, which are escaped unless they are Markup.

    template: its name among the templates of the report, or its path below the package, without
    `.html`.
    """
    return Markup(_environment().get_template(f"{template}.html").render(values))


def piece(macro: str, /, *values: Any) -> Markup:
    """Return what a macro of `pieces.html` makes of some values."""
    make: Callable[..., Markup] = getattr(_environment().get_template("pieces.html").module, macro)
    return make(*values)


@cache
def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(_source),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
    )
    environment.filters.update(breakable=breakable_name, percent=spoken_percent)
    environment.globals.update(rows_shown=ROWS_SHOWN, spare_rows=SPARE_ROWS)
    return environment


def _source(name: str) -> str:
    """Return a template without space that has no meaning."""
    if "/" in name:
        return unindented(source(name))
    text = unindented(source(f"{TEMPLATES}/{name}")).replace(">\n<", "><")
    if name != "page.html":
        return text
    head, style, body, script, end = re.split("</?(?:style|script)>", text)
    return (
        f"{head}<style>{rcssmin.cssmin(style)}{styles('viewer/mixer/wipe.css')}</style>{body}"
        f"<script>{compact_script(script)}</script>{end}"
    )


def breakable_name(name: str) -> Markup:
    """Return a name that may break after joining characters and in very long words."""
    words = re.findall(r"[^_./-]{1,14}[_./-]*|[_./-]+", name, re.DOTALL)
    return Markup("<wbr>").join(words)


def script_json(record: Any) -> Markup:
    """Return JSON for a script element, which only `<` can end, and which allows no escapes."""
    text = json.dumps(record, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return Markup(text.replace("<", "\\u003c"))


def name_list(names: Sequence[str]) -> Markup:
    """Return names with commas; the rest of many is folded."""
    return piece("names", names)


def facts(entries: Iterable[tuple[str, Any]]) -> Markup:
    """Return terms with their values."""
    return piece("facts", list(entries))
