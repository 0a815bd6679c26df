"""The files of the page, read once at the start: nothing else can be requested."""

from dataclasses import dataclass
from pathlib import Path

from lightpaint.viewer.bundle import bundled, styles

#: Content types by suffix; other files are not part of the page.
CONTENT_TYPES = {
    ".html": "text/html;charset=utf-8",
    ".js": "text/javascript;charset=utf-8",
    ".css": "text/css;charset=utf-8",
    ".json": "application/json",
    ".svg": "image/svg+xml",
    ".png": "image/png",
    ".wasm": "application/wasm",
    ".woff2": "font/woff2",
    ".txt": "text/plain;charset=utf-8",
}

PAGE_FOLDER = Path(__file__).parents[1] / "page"

#: The viewer's modules, served as `/viewer`. Modules of the page import them by their path in the
#: package; browsers ignore the `..` beyond the root.
VIEWER_FOLDER = Path(__file__).parents[2] / "viewer"

#: The page's main module; a browser loads it with all its imports.
ENTRY_MODULE = "/main.js"

#: Its style sheet, which imports one for each part of the page.
STYLE_SHEET = "/style.css"

ICON = "/icon.svg"


@dataclass(frozen=True)
class PageFile:
    """A file of the page, as it was at the start."""

    kind: str
    content: bytes


def page_files(folder: Path = PAGE_FOLDER) -> dict[str, PageFile]:
    """Return the files of the page by their paths; `/` is the page itself.

    Hidden files, links that lead elsewhere, and other kinds of files are left out.
    """
    root = folder.resolve()
    table = _files_below(root, "/")
    if "/index.html" in table:
        table["/"] = table["/index.html"]
    if ICON in table:
        # Some browsers request it from every page.
        table["/favicon.ico"] = table[ICON]
    if root == PAGE_FOLDER.resolve():
        table |= _files_below(VIEWER_FOLDER.resolve(), "/viewer/")
        # A browser takes ten milliseconds per file, independent of the server.
        table[ENTRY_MODULE] = PageFile(
            CONTENT_TYPES[".js"], bundled(f"paint/page{ENTRY_MODULE}").encode()
        )
        table[STYLE_SHEET] = PageFile(
            CONTENT_TYPES[".css"], styles(f"paint/page{STYLE_SHEET}").encode()
        )
    return table


def _files_below(root: Path, start: str) -> dict[str, PageFile]:
    """Return the files of a folder by their paths, which begin with `start`."""
    table = {}
    for path in sorted(root.rglob("*")):
        place = path.relative_to(root)
        is_hidden = any(part.startswith((".", "_")) for part in place.parts)
        if is_hidden or path.suffix not in CONTENT_TYPES or not path.resolve().is_relative_to(root):
            continue
        if path.is_file():
            table[f"{start}{place.as_posix()}"] = PageFile(
                CONTENT_TYPES[path.suffix], path.read_bytes()
            )
    return table
