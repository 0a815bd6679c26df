"""A browser for the tests of the page, one for all of them, and a server for files of a page."""

import shutil
import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

import lightpaint

#: As the server of the painter has it: nothing from elsewhere, nothing inline.
CSP = (
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data: "
    "blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)

FOLDERS = {"/page/": Path(lightpaint.__file__).parent / "paint" / "page", "/fake/": Path(__file__).parent / "fake"}


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Chromium of the system, or what Playwright has installed."""
    driver = pytest.importorskip("playwright.sync_api", reason="playwright")
    program = shutil.which("chromium") or shutil.which("google-chrome")
    with driver.sync_playwright() as playwright:
        try:
            opened = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        except driver.Error:
            pytest.skip("a browser")
        yield opened
        opened.close()


class _Files(SimpleHTTPRequestHandler):
    """Files of the page and of what stands in for the rest of it."""

    def translate_path(self, path: str) -> str:
        plain = path.split("?")[0]
        for prefix, folder in FOLDERS.items():
            if plain.startswith(prefix):
                return str(folder / plain.removeprefix(prefix))
        return str(FOLDERS["/fake/"] / "index.html")

    def end_headers(self) -> None:
        self.send_header("Content-Security-Policy", CSP)
        self.send_header("Cache-Control", "no-store")
        super().end_headers()

    def log_message(self, *_: Any) -> None:
        pass


@pytest.fixture(scope="session")
def fake_page() -> Iterator[str]:
    """Address of the interface over a session that is made up."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(_Files))
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()
    server.server_close()
