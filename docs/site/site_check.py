"""Checks of the built site: no dead link, no request to another host, and its size."""

import re
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

#: Largest size of the site.
MAX_BYTES = 30_000_000


class _Page(HTMLParser):
    """Ids of a page, its links, and what it loads."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.ids: set[str] = set()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.without_alt: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        values = dict(attributes)
        self.ids |= {x for key in ("id", "name") if (x := values.get(key))}
        if tag == "a" and (link := values.get("href")):
            self.links.append(link)
        if tag in ("img", "script", "source", "iframe") and (link := values.get("src")):
            self.loaded.append(link)
        if tag == "link" and (link := values.get("href")):
            self.loaded.append(link)
        if tag == "img" and values.get("alt") is None:
            self.without_alt.append(values.get("src") or "")


def check_site(html: Path) -> list[str]:
    """Return what is wrong with the site in the folder `html`, one line each."""
    pages = {file: _Page(file.read_text(encoding="utf-8")) for file in html.rglob("*.html")}
    problems = []
    for file, page in sorted(pages.items()):
        name = file.relative_to(html)
        problems += [f"{name}: dead link {x}" for x in page.links if _is_dead(x, file, pages)]
        problems += [f"{name}: no file {x}" for x in page.loaded if _is_dead(x, file, pages)]
        problems += [f"{name}: loads {x}" for x in page.loaded if urlsplit(x).netloc]
        problems += [f"{name}: no text for the picture {x}" for x in page.without_alt]
    for style in html.rglob("*.css"):
        if re.search(r"url\(\s*[\"']?https?:", style.read_text(encoding="utf-8")):
            problems.append(f"{style.relative_to(html)}: loads from elsewhere")
    size = sum(file.stat().st_size for file in html.rglob("*") if file.is_file())
    if size > MAX_BYTES:
        problems.append(f"the site has {size:,} bytes: at most {MAX_BYTES:,}")
    return problems


def _is_dead(link: str, file: Path, pages: dict[Path, _Page]) -> bool:
    """Return whether a link within the site leads nowhere; others are not tried."""
    parts = urlsplit(link)
    if parts.scheme or parts.netloc:
        return False
    target = (file.parent / unquote(parts.path)).resolve() if parts.path else file
    if not target.is_file():
        return True
    anchor = unquote(parts.fragment)
    return bool(anchor) and target in pages and anchor not in pages[target].ids
