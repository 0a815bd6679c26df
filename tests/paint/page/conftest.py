"""One tab for all tests of the page, and a site that serves its modules and arrays."""

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import numpy as np
import pytest
from axe import axe_source
from painter_page import Painter
from renderer import REPOSITORY

from lightpaint import viewer

PAGE = REPOSITORY / "lightpaint" / "paint" / "page"
HERE = Path(__file__).parent

KINDS = {".js": "text/javascript", ".html": "text/html; charset=utf-8", ".css": "text/css"}

#: Of painters whose test does not ask for another.
VIEWPORT = {"width": 1280, "height": 720}

#: Of the system, where a test does not ask for the other.
THEME = "dark"


@pytest.fixture(scope="session")
def axe() -> str:
    """The source of axe-core."""
    return axe_source()


@dataclass
class Site:
    """What is served: the page's files, those of this folder, and arrays as `/data/NAME`."""

    url: str = ""
    arrays: dict[str, np.ndarray] = field(default_factory=dict)


@pytest.fixture(scope="session")
def site() -> Iterator[Site]:
    """On a port of its own."""
    new_site = Site()

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"  # one connection for many files
        wbufsize = -1  # head and content in one

        def do_GET(self) -> None:
            path = unquote(urlsplit(self.path).path)
            headers, content = served_file(new_site, path)
            self.send_response(200 if headers else 404)
            for name, value in headers.items():
                self.send_header(name, value)
            if headers and not path.startswith("/data/"):
                # No file changes while tests run: fifty modules are fetched and compiled once.
                self.send_header("cache-control", "max-age=3600")
            self.send_header("content-length", str(len(content)))
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, *_: Any) -> None:
            """Say nothing."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    new_site.url = f"http://127.0.0.1:{server.server_port}"
    yield new_site
    server.shutdown()
    server.server_close()


#: What serves the painter over the made-up session as one script, instead of `fake/index.html`.
#: All style sheets of the page as one, as a server gives them.
STYLE_SHEET = "/style.css"

BUNDLE, BUNDLE_PAGE = "/fake/bundle.js", "/fake/bundled.html"


@cache
def fake_bundle() -> bytes:
    """Return the script of that page with all that it imports.

    A hundred modules, one by one, take more of each test than what it does. They load as a server
    gives them in `test_real.py`, `test_language.py` and wherever else a test asks for them.
    """
    package_source = viewer.source

    def source(path: str) -> str:
        own = HERE / path.removeprefix("paint/page/")
        return own.read_text(encoding="utf-8") if own.is_file() else package_source(path)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(viewer, "source", source)
        return viewer.bundled("paint/page/fake/main.js").encode()


def served_file(site: Site, path: str) -> tuple[dict[str, str], bytes]:
    """Headers and content; none for what there is not."""
    if path.startswith("/data/"):
        array = site.arrays.get(path.removeprefix("/data/"))
        if array is None:
            return {}, b"there is no such picture"
        shape = ",".join(map(str, array.shape))
        return {"x-dtype": array.dtype.name, "x-shape": shape}, array.tobytes()
    if path == "/favicon.ico":
        return {"content-type": "image/x-icon"}, b""
    if path == BUNDLE:
        return {"content-type": KINDS[".js"]}, fake_bundle()
    if path == STYLE_SHEET:
        return {"content-type": KINDS[".css"]}, viewer.styles("paint/page/style.css").encode()
    if path == BUNDLE_PAGE:
        text = (HERE / "fake" / "index.html").read_text(encoding="utf-8")
        return {"content-type": KINDS[".html"]}, text.replace("main.js", "bundle.js").encode()
    for folder in (PAGE, HERE, REPOSITORY / "lightpaint"):
        file = folder / path.lstrip("/")
        if file.is_file():
            return {"content-type": KINDS[file.suffix]}, file.read_bytes()
    return {}, b""


@pytest.fixture(scope="session")
def tab(browser: Any) -> tuple[Any, list[str]]:
    """One page for all tests, which start a process less; and what goes wrong on it."""
    new_page = browser.new_page(viewport={"width": 800, "height": 600})
    errors: list[str] = []
    new_page.on("pageerror", lambda error: errors.append(str(error)))
    new_page.on("console", lambda line: errors.append(line.text) if line.type == "error" else None)
    return new_page, errors


@pytest.fixture
def page(tab: Any, site: Site) -> Iterator[Any]:
    """An empty page of the site. What a test leaves on its console as an error fails it."""
    blank_page, errors = tab
    blank_page.goto(f"{site.url}/empty.html")
    yield blank_page
    site.arrays.clear()
    page_errors, errors[:] = errors[:], []
    assert page_errors == []


class Tabs:
    """Tabs that one test after another takes, each as if it were new.

    A new one in a context of its own takes thrice the time: it starts a process, and compiles all
    modules of the page. In a tab that is there already the next painter opens in place of the last.
    """

    def __init__(self, browser: Any, site: Site) -> None:
        self.browser, self.site = browser, site
        self.idle: list[Any] = []

    def take(self, viewport: dict[str, int]) -> Any:
        """Return a tab of that size which nobody else has."""
        if not self.idle:
            return self.browser.new_context(viewport=viewport, color_scheme=THEME).new_page()
        tab = self.idle.pop()
        if tab.viewport_size != viewport:
            tab.set_viewport_size(viewport)
        return tab

    def give_back(self, tab: Any) -> None:
        """Forget all that a test may have left: what is stored, permissions, mouse and keys."""
        if tab.is_closed() or len(tab.context.pages) > 1:
            tab.context.close()
            return
        tab.mouse.up()
        tab.mouse.move(-10, -10)
        for key in ("Shift", "Control", "Alt", "Meta", "Space"):
            tab.keyboard.up(key)
        if not tab.evaluate("() => 'closePainter' in window && !closePainter()"):
            # To a page that stores nothing, since the painter may while it ends.
            tab.goto(f"{self.site.url}/empty.html")
        tab.evaluate("() => { localStorage.clear(); sessionStorage.clear(); }")
        tab.context.clear_permissions()
        tab.context.clear_cookies()
        self.idle.append(tab)

    def close(self) -> None:
        for tab in self.idle:
            tab.context.close()


@pytest.fixture(scope="session")
def tabs(browser: Any, site: Site) -> Iterator[Tabs]:
    """Tabs for the painters of all tests."""
    new_tabs = Tabs(browser, site)
    yield new_tabs
    new_tabs.close()


@pytest.fixture
def new_painter(tabs: Tabs) -> Iterator[Any]:
    """Opens painters. No test leaves an error on the console, or one that nobody caught.

    is_fresh: in a context of its own, for a test that changes what cannot be changed back, such as
    a clock or a function of the browser. So is every painter with a script that runs first, or
    options beside the viewport.
    prepare: what is done with the context before the page opens. with_modules: load each module.
    axe: the source of axe-core, once it is open; before, it would take a context of its own.
    """
    pages_in_use: list[tuple[Any, bool]] = []
    errors: list[str] = []

    def note_error(error: Any) -> None:
        errors.append(str(error))

    def note_console(line: Any) -> None:
        if line.type in ("error", "warning"):
            errors.append(line.text)

    def open_painter(
        query: str = "",
        init: str = "",
        until: str = ".lightpaint .tag",
        *,
        is_fresh: bool = False,
        with_modules: bool = False,
        axe: str = "",
        prepare: Callable[[Any], None] | None = None,
        viewport: dict[str, int] = VIEWPORT,
        **options: Any,
    ) -> Painter:
        if is_fresh or init or prepare or options:
            options = {"color_scheme": THEME, **options}
            page = tabs.browser.new_context(viewport=viewport, **options).new_page()
            pages_in_use.append((page, True))
        else:
            page = tabs.take(viewport)
            pages_in_use.append((page, False))
        page.on("pageerror", note_error)
        page.on("console", note_console)
        if init:
            page.add_init_script(init)
        if prepare:
            prepare(page.context)
        whole_query = f"?{query}&size=48x27"
        if with_modules or "shadow" in query or not page.evaluate("() => 'openPainter' in window"):
            page_path = "/fake/index.html" if with_modules else BUNDLE_PAGE
            page.goto(tabs.site.url + page_path + whole_query)
        else:
            page.evaluate("async (query) => { await openPainter(query); }", whole_query)
        page.wait_for_selector(until)
        if axe:
            page.evaluate(axe)
        return Painter(page)

    yield open_painter
    for page, is_own in pages_in_use:
        if is_own or errors:
            page.context.close()
        else:
            tabs.give_back(page)
            page.remove_listener("pageerror", note_error)
            page.remove_listener("console", note_console)
    assert not errors


@pytest.fixture
def painter(new_painter: Any) -> Painter:
    return new_painter()
