"""Links to other sites: what answers passes, and what is gone is found."""

import subprocess
import sys
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread

import pytest
from renderer import REPOSITORY

pytest.importorskip("sphinx", reason="sphinx")
pytest.importorskip("myst_nb", reason="myst_nb")

CHECK = "import sys; from build import check_links; from pathlib import Path; "
CHECK += "sys.exit(check_links(Path('source'), Path('links')))"


class Site(BaseHTTPRequestHandler):
    """A site with one page, to which another address leads."""

    def do_GET(self) -> None:
        """Answer a request."""
        self.send_response({"/there": 200, "/moved": 301}.get(self.path, 404))
        self.send_header("Location", "/there")
        self.send_header("Content-Length", "0")
        self.end_headers()

    def do_HEAD(self) -> None:
        """Answer a request for the head alone."""
        self.do_GET()

    def log_message(self, *_: object) -> None:
        """Print nothing."""


@pytest.fixture
def site() -> Iterator[str]:
    """The address of a site on this machine."""
    with ThreadingHTTPServer(("127.0.0.1", 0), Site) as server:
        thread = Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


def check(folder: Path, text: str) -> subprocess.CompletedProcess[str]:
    """Check a site of one page."""
    (folder / "source").mkdir()
    (folder / "source" / "index.md").write_text(f"# Page\n\n{text}\n", "utf-8")
    path = f"import sys; sys.path.insert(0, {str(REPOSITORY / 'docs' / 'site')!r}); "
    command = [sys.executable, "-c", path + CHECK]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300)


@pytest.mark.nightly
def test_links_that_answer_pass(site: str, tmp_path: Path) -> None:
    run = check(tmp_path, f"<{site}/there> <{site}/moved> <http://127.0.0.1:8421/> [here](#page)")
    assert run.returncode == 0, run.stderr
    assert "2 links to other sites, none of them dead" in run.stdout


@pytest.mark.nightly
def test_links_that_are_gone_are_found(site: str, tmp_path: Path) -> None:
    run = check(tmp_path, f"<{site}/there> <{site}/gone>")
    assert run.returncode == 1
    assert f"broken link: {site}/gone (404" in run.stderr
    assert "/there" not in run.stderr


def test_another_word_is_refused() -> None:
    command = [sys.executable, "docs/site/build.py", "--link"]
    run = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True, timeout=300)
    assert (run.returncode, run.stdout) == (2, "")
    assert run.stderr == "expected nothing or --links, not: --link\n"
