"""One tab for all tests of the page, and a site that serves its modules and arrays."""

import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import numpy as np
import pytest
from accessible import axe_source
from interface import Painter
from renderer import REPOSITORY

PAGE = REPOSITORY / "lightpaint" / "paint" / "page"
HERE = Path(__file__).parent

KINDS = {".js": "text/javascript", ".html": "text/html; charset=utf-8", ".css": "text/css"}


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
    made = Site()

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"  # one connection for many files
        wbufsize = -1  # head and content in one

        def do_GET(self) -> None:
            path = unquote(urlsplit(self.path).path)
            headers, content = served(made, path)
            self.send_response(200 if headers else 404)
            for name, value in headers.items():
                self.send_header(name, value)
            self.send_header("content-length", str(len(content)))
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, *_: Any) -> None:
            """Say nothing."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    made.url = f"http://127.0.0.1:{server.server_port}"
    yield made
    server.shutdown()
    server.server_close()


def served(site: Site, path: str) -> tuple[dict[str, str], bytes]:
    """Headers and content; none for what there is not."""
    if path.startswith("/data/"):
        array = site.arrays.get(path.removeprefix("/data/"))
        if array is None:
            return {}, b"there is no such picture"
        shape = ",".join(map(str, array.shape))
        return {"x-dtype": array.dtype.name, "x-shape": shape}, array.tobytes()
    if path == "/favicon.ico":
        return {"content-type": "image/x-icon"}, b""
    for folder in (PAGE, HERE, REPOSITORY / "lightpaint"):
        file = folder / path.lstrip("/")
        if file.is_file():
            return {"content-type": KINDS[file.suffix]}, file.read_bytes()
    return {}, b""


@pytest.fixture(scope="session")
def tab(browser: Any) -> tuple[Any, list[str]]:
    """One page for all tests, which start a process less; and what goes wrong on it."""
    opened = browser.new_page(viewport={"width": 800, "height": 600})
    wrong: list[str] = []
    opened.on("pageerror", lambda error: wrong.append(str(error)))
    opened.on("console", lambda line: wrong.append(line.text) if line.type == "error" else None)
    return opened, wrong


@pytest.fixture
def page(tab: Any, site: Site) -> Iterator[Any]:
    """An empty page of the site. What a test leaves on its console as an error fails it."""
    opened, wrong = tab
    opened.goto(f"{site.url}/empty.html")
    yield opened
    site.arrays.clear()
    left, wrong[:] = wrong[:], []
    assert left == []


@pytest.fixture
def opened(browser: Any, site: Any) -> Iterator[Any]:
    """Opens painters. No test leaves an error on the console, or one that nobody caught."""
    contexts, errors = [], []

    def open_painter(
        query: str = "", init: str = "", until: str = ".lightpaint .tag", **about: Any
    ) -> Painter:
        context = browser.new_context(**{"viewport": {"width": 1280, "height": 720}, **about})
        contexts.append(context)
        page = context.new_page()
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on(
            "console",
            lambda said: errors.append(said.text) if said.type in ("error", "warning") else None,
        )
        if init:
            page.add_init_script(init)
        page.goto(f"{site.url}/fake/index.html?{query}&size=48x27")
        page.wait_for_selector(until)
        return Painter(page)

    yield open_painter
    for context in contexts:
        context.close()
    assert not errors


@pytest.fixture
def painter(opened: Any) -> Painter:
    return opened()
