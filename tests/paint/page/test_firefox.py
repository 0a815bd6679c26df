"""The page in Firefox: it opens, paints, is answered, and shows that, without a word of complaint.

Firefox is spoken to by WebDriver BiDi, which every installed one understands; that of Playwright
is another, and a large download.
"""

import json
import shutil
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from foreign_server import ForeignServer
from patience import PATIENCE_S
from websockets.sync.client import ClientConnection, connect

import lightpaint as lp
from lightpaint.colour.primaries import to_8_bit
from lightpaint.paint.server.page_server import Server
from lightpaint.paint.store.session_file import MemoryStore
from lightpaint.paint.studio.session_studio import Studio
from lightpaint.paint.subject import Subject

PAINTER = "document.getElementById('lightpaint').painter"


class Firefox:
    """One tab."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket, self.number = socket, 0
        self.received: list[Any] = []
        self.ask("session.new", capabilities={})
        self.ask("session.subscribe", events=["log.entryAdded"])
        self.tab = self.ask("browsingContext.getTree")["contexts"][0]["context"]

    def ask(self, method: str, **params: Any) -> Any:
        self.number += 1
        self.socket.send(json.dumps({"id": self.number, "method": method, "params": params}))
        while True:
            message = json.loads(self.socket.recv(timeout=PATIENCE_S))
            if message.get("id") == self.number:
                assert message["type"] == "success", message
                return message["result"]
            self.received.append(message)

    def open(self, url: str) -> None:
        self.ask("browsingContext.navigate", context=self.tab, url=url, wait="complete")

    def look(self, script: str) -> Any:
        """What a script finds in the page, None while there is none."""
        names = f"const {{ engine }} = {PAINTER}; const {{ mirror, screen }} = engine;"
        answer = self.ask(
            "script.evaluate",
            expression=f"JSON.stringify((() => {{ {names} {script} }})() ?? null)",
            target={"context": self.tab},
            awaitPromise=True,
        )
        return json.loads(answer["result"]["value"]) if answer["type"] == "success" else None

    def new_tab(self) -> None:
        self.tab = self.ask("browsingContext.create", type="tab")["context"]

    def reads(self, text: str) -> bool:
        """Whether the page shows it."""
        return bool(self.look(f"return document.body.innerText.includes({json.dumps(text)})"))

    def errors(self) -> list[str]:
        """What the console has shown."""
        events = [event.get("params", {}) for event in self.received]
        return [event["text"] for event in events if event.get("level") == "error"]

    def press(self, *keys: str) -> None:
        actions = [{"type": x, "value": key} for key in keys for x in ("keyDown", "keyUp")]
        source = {"type": "key", "id": "keys", "actions": actions}
        self.ask("input.performActions", context=self.tab, actions=[source])

    def drag(self, *places: list[int]) -> None:
        moves = [{"type": "pointerMove", "x": x, "y": y, "duration": 30} for x, y in places]
        down, up = ({"type": x, "button": 0} for x in ("pointerDown", "pointerUp"))
        source = {"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}}
        actions = {**source, "actions": [moves[0], down, *moves[1:], up]}
        self.ask("input.performActions", context=self.tab, actions=[actions])

    def at(self, x: int, y: int) -> list[int]:
        """Where a pixel of the painting is in the window."""
        return self.look(
            "const box = engine.element.getBoundingClientRect(), [pane] = engine.panes();"
            f"return [box.left + pane.left + {x + 0.5} * pane.scale,"
            f" box.top + pane.top + {y + 0.5} * pane.scale].map(Math.round)"
        )  # type: ignore[no-any-return]

    def seen(self, x: int, y: int) -> list[int]:
        """Codes on the canvas where a pixel of the painting is shown."""
        return self.look(
            "const { left, top, scale } = screen.panes()[0]; screen.drawNow();"
            f"return Array.from(screen.view.read(Math.floor(left + {x + 0.5} * scale),"
            f" Math.floor(top + {y + 0.5} * scale), 1, 1)).slice(0, 3)"
        )  # type: ignore[no-any-return]


@pytest.fixture
def firefox(tmp_path: Path) -> Iterator[Firefox]:
    """Firefox, where one is installed."""
    path = shutil.which("firefox-esr") or shutil.which("firefox")
    if path is None:
        pytest.skip("Firefox")
    profile = tmp_path / "profile"
    profile.mkdir()
    words = [path, "--headless", "--no-remote", "--profile", str(profile)]
    process = subprocess.Popen(
        [*words, "--remote-debugging-port", "0", "about:blank"],
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
    )
    with process:
        try:
            assert process.stderr is not None
            addresses = (
                line.partition("WebDriver BiDi listening on ")[2] for line in process.stderr
            )
            address = next(filter(None, addresses), "").strip()
            assert address, "Firefox has not begun"
            threading.Thread(target=process.stderr.read, daemon=True).start()
            with connect(f"{address}/session", max_size=2**26, proxy=None) as socket:
                yield Firefox(socket)
        finally:
            process.terminate()


@contextmanager
def serve_painter(basis: lp.Basis, folder: Path) -> Iterator[tuple[Studio, str]]:
    """A painter of `basis`, and its address."""
    studio = Studio([Subject("room.basis.exr", folder, basis=basis)], MemoryStore)
    server = Server(studio, port=0)
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    studio.start()
    try:
        yield studio, server.url
    finally:
        server.stop()
        thread.join()
        server.close()
        studio.close()


def wait_until(is_so: Callable[[], Any], description: str) -> None:
    end = time.monotonic() + PATIENCE_S
    while not is_so():
        assert time.monotonic() < end, description
        time.sleep(0.1)


@pytest.mark.nightly
def test_what_is_painted_is_answered_and_shown(
    firefox: Firefox, make_basis: Any, tmp_path: Path
) -> None:
    basis = make_basis(3, (54, 96))
    with serve_painter(basis, tmp_path / "room") as (studio, url):
        firefox.open(url)
        wait_until(
            lambda: firefox.look(
                "return mirror.isReady && screen.width > 0 && !mirror.loader.total"
            ),
            "the page is not ready",
        )
        firefox.press("0", *"]" * 4)
        before = firefox.seen(80, 40)

        def painted() -> bool:
            if not studio.session.store.steps:
                firefox.drag(firefox.at(20, 20), firefox.at(30, 20), firefox.at(40, 20))
            return bool(studio.session.store.steps)

        wait_until(painted, "no stroke is heard")
        light = np.array(firefox.look("return engine.tool.rgb"), float).reshape(1, 3)
        code = to_8_bit(studio.session.transform.encode(light))[0].astype(int)

        def is_answered() -> bool:
            weights = firefox.look("return Array.from(mirror.weights)")
            is_exact = "headline" in studio.state().fields["answer"]
            return is_exact and weights == studio.session.weights.ravel().tolist()

        wait_until(is_answered, "the exact answer does not come")
        wait_until(
            lambda: np.allclose(firefox.seen(30, 20), code, atol=8), "the stroke is not shown"
        )
        assert firefox.seen(80, 40) == before
        assert firefox.errors() == []
        # What another server of the machine collects of this browser opens nothing, and the page
        # that is left for it and opened again goes on.
        painter = url.partition("#")[0]
        with closing(ForeignServer()) as neighbour:
            firefox.open(f"{neighbour.url}?of={painter}")
            assert neighbour.has_tried.wait(PATIENCE_S)
            assert {path: outcome for path, outcome in neighbour.tried.items() if outcome} == {}
            assert neighbour.collected
            assert url.partition("=")[2] not in str(neighbour.collected)
            assert neighbour.replay(painter) == []
        firefox.open(painter)
        wait_until(
            lambda: firefox.look("return mirror.isReady && screen.width > 0"), "it does not go on"
        )
        wait_until(
            lambda: np.allclose(firefox.seen(30, 20), code, atol=8), "the stroke is not there"
        )
        # The address alone opens nothing; with its token it opens a second tab.
        firefox.new_tab()
        for address, address_or_error in (
            (painter, "belongs to a painter that has ended"),
            (url, "open in another tab"),
        ):
            firefox.open(address)
            wait_until(
                partial(firefox.reads, address_or_error), f"it does not say: {address_or_error}"
            )
