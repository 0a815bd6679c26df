"""Repairs of the HTML of Sphinx and its theme, which keeps some people from using a page."""

import re
from pathlib import Path

#: A signature of several lines: a list of descriptions, of nothing.
_SIGNATURE = re.compile(r'<dl>\n((?:<dd><em class="sig-param">.*?</dd>\n)+)</dl>', re.DOTALL)


def mend_pages(html: Path) -> None:
    """Change the pages in the folder `html`."""
    for page in html.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        # A heading of the navigation, which does not say of which level.
        mended = text.replace('class="caption" role="heading"', f'{_CAPTION} aria-level="2"')
        mended = mended.replace('<aside class="sidebar-drawer"', f'{_SIDEBAR} aria-label="Pages"')
        mended = _SIGNATURE.sub(_lines, mended)
        if mended != text:
            page.write_text(mended, encoding="utf-8")


_SIDEBAR = '<aside class="sidebar-drawer"'
_CAPTION = 'class="caption" role="heading"'


def _lines(match: re.Match[str]) -> str:
    lines = match[1].replace("<dd>", '<span class="sig-line">').replace("</dd>", "</span>")
    return f'<span class="sig-lines">\n{lines}</span>'
