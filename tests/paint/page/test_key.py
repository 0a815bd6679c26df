"""Who gets the session in a browser: pages of the terminal's address, however often, and no others.

Nothing that a browser attaches by itself opens it, so another server of this machine that collects
what it is sent, and sends it on, gets nothing.
"""

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from foreign_server import ForeignServer

from lightpaint.paint.server.page_server import Server
from lightpaint.paint.store.session_file import MemoryStore
from lightpaint.paint.studio.session_studio import Studio
from lightpaint.paint.subject import Subject

NO_KEY_TEXT = (
    "This page belongs to a painter that has ended. Open the address that the terminal shows"
)


@pytest.fixture
def server(make_basis: Any, tmp_path: Path) -> Iterator[Server]:
    """A painter on a port of its own."""
    subject = Subject("room.basis.exr", tmp_path / "room", basis=make_basis(2, (27, 48)))
    studio = Studio([subject], MemoryStore)
    new_server = Server(studio, port=0)
    thread = threading.Thread(target=new_server.run, daemon=True)
    thread.start()
    studio.start()
    yield new_server
    new_server.stop()
    thread.join()
    new_server.close()
    studio.close()


@pytest.fixture
def foreign_server() -> Iterator[ForeignServer]:
    foreign = ForeignServer()
    yield foreign
    foreign.close()


@pytest.fixture
def open_tab(browser: Any) -> Iterator[Any]:
    """Opens tabs of one browser."""
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    yield context.new_page
    context.close()


def has_painter(page: Any) -> None:
    """Wait until the painter is there, with a picture that was fetched."""
    page.wait_for_selector(".lightpaint .tag")
    page.wait_for_function(
        "() => document.getElementById('lightpaint').painter.engine.mirror.isReady"
    )


def test_a_neighbour_that_is_visited_gets_nothing_that_opens_the_session(
    server: Server, foreign_server: ForeignServer, open_tab: Any
) -> None:
    page = open_tab()
    page.goto(server.url)
    has_painter(page)
    assert page.url == server.address.url  # the token is seen no longer
    address = f"{foreign_server.url}?of={server.address.url}"
    page.evaluate("(url) => { location.href = url; }", address)  # as a link would
    assert foreign_server.has_tried.wait(60)
    second_tab = open_tab()
    second_tab.goto(address)
    second_tab.wait_for_function("() => document.title === 'done'")
    assert len(foreign_server.collected) >= 3
    assert {attempt: outcome for attempt, outcome in foreign_server.tried.items() if outcome} == {}
    token = server.url.partition("=")[2]
    for headers in foreign_server.collected:
        assert token not in str(headers)
        assert str(server.port) not in headers.get("Referer", "").partition("?")[0]
    assert foreign_server.replay(server.address.url) == []
    # The person comes back to a page that goes on.
    page.go_back()
    has_painter(page)


@pytest.mark.nightly
def test_a_page_that_is_loaded_anew_goes_on_and_so_does_a_second_tab(
    server: Server, open_tab: Any
) -> None:
    first = open_tab()
    first.goto(server.url)
    has_painter(first)
    first.reload()
    has_painter(first)
    second = open_tab()
    second.goto(server.url)
    second.get_by_role("button", name="Take over").click()
    has_painter(second)
    # The address alone opens nothing, and says what does.
    third = open_tab()
    third.goto(server.address.url)
    third.get_by_text(NO_KEY_TEXT).wait_for()
    third.goto(server.url)  # in the same tab, where no more than its fragment changes
    third.get_by_role("button", name="Take over").click()
    has_painter(third)
    assert third.url == server.address.url


@pytest.mark.nightly
def test_the_address_that_a_browser_was_started_with_is_good_once(
    server: Server, open_tab: Any
) -> None:
    url = server.one_time_url()
    first, second = open_tab(), open_tab()
    first.goto(url)
    has_painter(first)
    second.goto(url)
    second.get_by_text(NO_KEY_TEXT).wait_for()
    first.reload()
    has_painter(first)
