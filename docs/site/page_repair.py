"""Repairs of the HTML of Sphinx and its theme, which keeps some people from using a page."""

import re
from pathlib import Path

#: A signature of several lines: a list of descriptions, of nothing.
_SIGNATURE = re.compile(r'<dl>\n((?:<dd><em class="sig-param">.*?</dd>\n)+)</dl>', re.DOTALL)
#: Arrays and modules in the types of attributes, which annotations give in full.
_DTYPE = r"numpy\.dtype\[(?:numpy\.)?(\w+)(?:\[Any\])?\]"
_ARRAY = re.compile(r"numpy\.ndarray\[tuple\[Any, \.\.\.\], " + _DTYPE + r"\]")
_MODULE = re.compile(r"\b(?:lightpaint|collections|pathlib)\.(?:\w+\.)*(?=[A-Z])")
_TYPE = re.compile(r'(?<=<dd class="field-odd"><p>)[^<]*\w\.\w[^<]*')


def mend_pages(html: Path) -> None:
    """Change the pages in the folder `html`."""
    for page in html.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        # A heading of the navigation, which does not say of which level.
        mended = text.replace('class="caption" role="heading"', f'{_CAPTION} aria-level="2"')
        mended = mended.replace('<aside class="sidebar-drawer"', f'{_SIDEBAR} aria-label="Pages"')
        mended = _SIGNATURE.sub(_lines, mended)
        if page.parent.name == "api":
            mended = _TYPE.sub(lambda match: short_type(match[0]), mended)
        if mended != text:
            page.write_text(mended, encoding="utf-8")


_SIDEBAR = '<aside class="sidebar-drawer"'
_CAPTION = 'class="caption" role="heading"'


def short_type(text: str) -> str:
    """Return a type without the modules of its names, and with arrays by their numbers."""
    text = _ARRAY.sub(lambda match: f"array of {match[1]}", text)
    return _MODULE.sub("", text)


def _lines(match: re.Match[str]) -> str:
    lines = match[1].replace("<dd>", '<span class="sig-line">').replace("</dd>", "</span>")
    return f'<span class="sig-lines">\n{lines}</span>'
