"""The painter as people have it: page, server, studio and session file, in a browser.

What is shown is read back from the pixels that are truly on the canvas. No test leaves an error
or a warning on a console.
"""

import re
import shlex
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from console_rigs import COLORS, SacnFields, lamp, open_port, sacn_fields
from nightly import nightly
from patience import PATIENCE_S
from renderer import REPOSITORY
from studio_client import look_of

import lightpaint as lp
from lightpaint.basis import denoise_mix
from lightpaint.cli.commands.paint_command import command_for_paintings
from lightpaint.colour import LUMINANCE
from lightpaint.colour.primaries import to_8_bit
from lightpaint.dmx.console_link import ConsoleLink
from lightpaint.dmx.console_rig import ConsoleRig
from lightpaint.dmx.levels import encode_levels
from lightpaint.images.object_map import Objects
from lightpaint.lighting.analysis.noise.noise_correction import correct_noise
from lightpaint.paint.server.page_server import Server
from lightpaint.paint.session import picture_table
from lightpaint.paint.store.history_steps import name_in_view
from lightpaint.paint.store.session_file import Store
from lightpaint.paint.studio.console_switch import Console, drives_of_session
from lightpaint.paint.studio.session_studio import Studio
from lightpaint.paint.subject import Subject
from lightpaint.paint.subject_factory import make_subject
from lightpaint.pipeline.job.sources import BasisFile
from lightpaint.scene.lights.lights_file import SceneRequests

H, W, N = 54, 96, 3

#: Of pages whose test does not ask for another: of half the pixels that people have, which the
#: processor has to draw here.
VIEWPORT = {"width": 800, "height": 600}

#: What goes wrong in the page and is none of its: a picture that a test reads has to be waited for.
OURS = "ReadPixels"

UNPAINTED = "Nothing is painted: the answer is the current lighting."

PAINTER = "document.getElementById('lightpaint').painter"


#: Counts in `window.losses` how often a page says that its connection is lost, also where that is
#: said for less time than a busy machine needs to look.
COUNT_LOSSES = """
  let wasShown = false;
  window.losses = 0;
  new MutationObserver(() => {
    const isShown = document.body.textContent.includes('The connection is lost');
    window.losses += isShown && !wasShown;
    wasShown = isShown;
  }).observe(document.body, { childList: true, subtree: true, characterData: true });
"""


#: Codes of what is on a canvas, of which the page itself reads nothing; none for another element.
PIXELS_OF = """(element) => {
  const { width = 0, height = 0 } = element;
  if (!width) return [];
  const copy = Object.assign(document.createElement('canvas'), { width, height });
  const context = copy.getContext('2d', { willReadFrequently: true });
  context.drawImage(element, 0, 0);
  return Array.from(context.getImageData(0, 0, width, height).data);
}"""


def wait_until(is_so: Callable[[], Any], description: str, seconds: float = PATIENCE_S) -> Any:
    """What is looked for, once it is so."""
    end = time.monotonic() + seconds
    while not (value := is_so()):
        assert time.monotonic() < end, description
        time.sleep(0.02)
    return value


#: Keys of a hard brush at full flow, whose middle leaves nothing of what was there.
FIRM = ("0", *["Shift+}"] * 8)


class ServedPainter:
    """A painter on a port of its own, in threads of this process."""

    def __init__(self, *subjects: Subject, port: int = 0, **options: Any) -> None:
        self.folder = subjects[0].folder
        self.store: Store | None = None
        self.studio = Studio(subjects, self._opened, **options)
        self.server = Server(self.studio, port=port)
        self.thread = threading.Thread(target=self.server.run, daemon=True)
        self.thread.start()
        self.studio.start()

    def _opened(self, identity: Any) -> Store:
        self.store = Store.open(self.folder / "session.db", identity)
        return self.store

    @property
    def steps(self) -> list[str]:
        """Names of the steps that are done, without the place of each."""
        store = self.studio.session.store
        return [re.split(" on |, ", step.label)[0] for step in store.steps[: store.position]]

    def close(self) -> None:
        self.server.stop()
        self.thread.join()
        self.server.close()
        self.studio.close()


class PainterUser:
    """Somebody at a page, and what they do and see."""

    def __init__(self, page: Any, served_painter: ServedPainter) -> None:
        self.page, self.served = page, served_painter

    def look(self, script: str, argument: Any = None) -> Any:
        """What a script finds in the page."""
        names = f"const {{ host, engine }} = {PAINTER}; const {{ mirror, screen }} = engine;"
        return self.page.evaluate(f"(given) => {{ {names} {script} }}", argument)

    def ready(self) -> "PainterUser":
        """Wait until all pictures are there, and what was done before."""
        self.page.wait_for_selector(".lightpaint .tag")
        condition = (
            "const { loader } = mirror; return mirror.isReady && !loader.missingSlots().length"
            " && !loader.activeFetches.size"
            "&& screen.width > 0 && screen.width === engine.element.clientWidth"
        )
        wait_until(lambda: self.look(condition), "the page is not ready")
        return self.still(*self.served.steps)

    def still(self, *steps: str) -> "PainterUser":
        """Wait until these steps are done, and the exact answer to them is on screen."""
        studio = self.served.studio
        wait_until(lambda: self.served.steps == list(steps), f"not {steps}")
        at_rest = "return !mirror.strokes.isPending && !screen.isLive && !screen.frame"
        wait_until(lambda: self.look(at_rest), "strokes are not answered")

        def is_exact() -> bool:
            with studio._access.lock:
                session = studio.session
                answer = studio.state().fields["answer"]
                weights = session.weights.tolist()
            if session.is_painted and "headline" not in answer:
                return False
            page_weights = self.look("return Array.from(mirror.weights)")
            return bool(page_weights == [x for rgb in weights for x in rgb])

        wait_until(is_exact, "there is no exact answer")
        wait_until(lambda: self.look(at_rest), "the answer is not on screen")
        return self

    def at(self, x: float, y: float, pane: int = 0) -> tuple[float, float]:
        """Where a place of the picture is on the screen."""
        left, top, scale = self.look(
            "const box = engine.element.getBoundingClientRect();"
            "const pane = engine.panes()[given];"
            "return [box.left + pane.left, box.top + pane.top, pane.scale]",
            pane,
        )
        return left + (x + 0.5) * scale, top + (y + 0.5) * scale

    def seen(self, x: int, y: int, pane: int = 0) -> list[int]:
        """Codes on the canvas where a pixel of the picture is shown."""
        return self.look(
            "const { left, top, scale } = screen.panes()[given[2]]; screen.drawNow();"
            "const at = [left + (given[0] + 0.5) * scale, top + (given[1] + 0.5) * scale];"
            "return Array.from(screen.view.read(Math.floor(at[0]), Math.floor(at[1]), 1, 1))"
            ".slice(0, 3)",
            [x, y, pane],
        )  # type: ignore[no-any-return]

    def drag(self, *places: tuple[float, float], hold: bool = False) -> "PainterUser":
        """Press the mouse and go from place to place of the screen."""
        mouse = self.page.mouse
        mouse.move(*places[0])
        mouse.down()
        for place in places[1:]:
            mouse.move(*place, steps=3)
        if not hold:
            mouse.up()
        return self

    def stroke(self, *places: tuple[float, float]) -> "PainterUser":
        """Drag from place to place of the painting."""
        return self.drag(*(self.at(*place) for place in places))

    def press(self, *keys: str) -> "PainterUser":
        for key in keys:
            self.page.keyboard.press(key)
        return self

    def button(self, name: str, **options: Any) -> Any:
        return self.page.get_by_role("button", name=name, **options).first

    @property
    def paint(self) -> Any:
        """Linear light of what is in the hand."""
        return np.array(self.look("return engine.tool.rgb"))

    def code(self, light: Any) -> Any:
        """What a display shows of light in this session."""
        display = self.served.studio.session.transform.encode(
            np.asarray(light, float).reshape(1, 3)
        )
        return to_8_bit(display)[0].astype(int)

    def answered(self, x: int, y: int, view: int = 0) -> Any:
        """Codes of the answer at a pixel, from the planes that the page is given."""
        studio = self.served.studio
        planes = [
            studio.resource(name_in_view(f"clean/{k}", view))[y, x].astype(float) * scale
            for k, scale in enumerate(studio.state().fields["views"][view]["scales"])
        ]
        return self.code((studio.session.weights * planes).sum(axis=0))


@pytest.fixture(scope="module")
def basis(make_basis: Any) -> lp.Basis:
    """Three soft lights with a little noise, on a wall and a floor."""
    rng = np.random.default_rng(2)
    y, x = np.mgrid[:H, :W] / H
    images = np.array(
        [
            (np.exp(-((y - a) ** 2 + (x - b) ** 2) / 0.3) + 0.05)[..., None] * colour
            for (a, b), colour in zip(
                ((0.2, 0.3), (0.6, 0.8), (0.4, 1.4)), rng.uniform(0.5, 1, (N, 3)), strict=True
            )
        ]
    )
    noise = 0.01 * images * rng.standard_normal(images.shape)
    new_basis = make_basis(
        images=images + noise, half_differences=noise, emission=[[0.5, 0.5, 0.5]] * N
    )
    index = np.zeros((H, W), np.int32)
    index[H // 2 :] = 1
    return replace(new_basis, objects=Objects(index, ("wall", "floor")))  # type: ignore[no-any-return]


@pytest.fixture
def subject(basis: lp.Basis, tmp_path: Path) -> Subject:
    """A basis that was saved."""
    path = tmp_path / "room.basis.exr"
    lp.write_basis(path, basis)
    return make_subject(
        BasisFile(str(path)),
        tmp_path / "room",
        command=lambda paintings, requests: command_for_paintings(
            str(path), paintings, (), requests
        ),
    )


@pytest.fixture
def served_painter(subject: Subject, without_reasons: None) -> Iterator[ServedPainter]:
    """A painter of it."""
    painter = ServedPainter(subject)
    yield painter
    painter.close()


@pytest.fixture
def open_page(browser: Any) -> Iterator[Callable[..., PainterUser]]:
    """Opens pages of a painter; of the same browser, if they are to know each other."""
    contexts: list[Any] = []
    errors: list[str] = []

    def open_in_browser(
        served: ServedPainter,
        view: str | None = "cpu",
        beside: PainterUser | None = None,
        **options: Any,
    ) -> PainterUser:
        context_options = {"viewport": VIEWPORT, **options}
        context = beside.page.context if beside else browser.new_context(**context_options)
        contexts.append(context)
        page = context.new_page()
        page.on("response", lambda r: errors.append(r.url) if r.status >= 400 else None)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("console", lambda line: errors.append(line.text) if is_wrong(line) else None)
        page.goto(served.server.url.replace("#", f"?view={view}#" if view else "#"))
        return PainterUser(page, served)

    def is_wrong(line: Any) -> bool:
        return line.type in ("error", "warning") and OURS not in line.text

    yield open_in_browser
    page_errors = errors.copy()
    for context in contexts:
        context.close()
    assert page_errors == []


@pytest.mark.parametrize("view", [nightly("cpu"), "gl"])
def test_what_is_painted_and_answered_is_on_the_screen(
    served_painter: ServedPainter, open_page: Any, view: str
) -> None:
    user = open_page(served_painter, view).ready()
    assert user.look("return screen.view.name") == view
    before, far, new_code = user.seen(30, 10), user.seen(90, 50), user.seen(30, 10, 1)
    user.look("mirror.canvas.importance[5] = 2.5")
    assert user.look("return engine.maxImportance()") == 2.5
    user.look("mirror.canvas.importance[5] = 0")
    assert user.look("return engine.maxImportance()") == 1
    user.press("0").stroke((20, 10), (40, 10)).still("brush")
    np.testing.assert_allclose(user.seen(30, 10), user.code(user.paint), atol=1)
    assert user.seen(90, 50) == far
    for x, y in ((30, 10), (70, 40)):
        np.testing.assert_allclose(user.seen(x, y, 1), user.answered(x, y), atol=1)
    assert user.seen(30, 10, 1) != new_code
    user.press("Control+z").still()
    assert (user.seen(30, 10), user.seen(30, 10, 1)) == (before, new_code)
    # While the brush is down, what is under it is taken back.
    user.drag(user.at(60, 10), user.at(70, 10), hold=True)
    user.press("Control+z").page.mouse.up()
    user.still()
    assert (
        user.seen(70, 10)
        == user.code(served_painter.studio.session.views[0].current[10, 70]).tolist()
    )
    user.press("Control+Shift+Z").still("brush")
    np.testing.assert_allclose(user.seen(30, 10), user.code(user.paint), atol=1)
    fill_and_ask(user)
    user.page.keyboard.press("v")
    box = user.page.locator(".wipe").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    # The wipe paints nothing.
    user.drag((x, y), (x - 150, y)).still("brush", "Floor", "Spot")
    assert user.look("return screen.panes().map((pane) => pane.kind)") == ["solution", "painting"]
    np.testing.assert_allclose(user.seen(5, 50, 1), user.code(user.paint), atol=1)
    np.testing.assert_allclose(user.seen(90, 50, 0), user.answered(90, 50), atol=1)


@pytest.mark.parametrize("view", [nightly("cpu"), "gl"])
def test_answers_of_many_lights_are_mixed_by_the_session(
    subject: Subject,
    basis: lp.Basis,
    open_page: Any,
    monkeypatch: pytest.MonkeyPatch,
    without_reasons: None,
    view: str,
) -> None:
    """No plane is fetched: not for the answer, one light alone, nor the shares of all."""
    monkeypatch.setattr(picture_table, "MIN_MIXED_LIGHTS", N)
    monkeypatch.setattr(picture_table, "MAX_OPENING_VALUES", 0)
    served = ServedPainter(subject)
    try:
        user = open_page(served, view).ready()
        fetched: list[str] = []
        user.page.on("request", lambda request: fetched.append(request.url))
        before = user.seen(70, 40, 1)
        user.look(
            "const send = host.send.bind(host); window.drafts = [];"
            " host.send = async (kind, fields, arrays) => {"
            " const reply = await send(kind, fields, arrays);"
            " if (kind === 'paint') window.drafts.push(Boolean(reply.arrays.draft));"
            " return reply; }"
        )
        user.press("0").drag(user.at(20, 10), user.at(40, 10), hold=True)
        wait_until(lambda: user.page.evaluate("() => window.drafts.length"), "no answer")
        # While the brush is down, no question about shares keeps answers waiting.
        asked = [url.partition("lights_at/")[2] for url in fetched if "lights_at/" in url]
        assert set(asked) <= {"10%2C20"}, asked  # where the pointer came before
        user.page.mouse.up()
        user.still("brush")
        assert all(user.page.evaluate("() => window.drafts"))

        def shows(weights: Any) -> None:
            light = denoise_mix(basis, weights)
            for x, y in ((30, 10), (70, 40)):
                code = user.code(light[y, x])
                wait_until(
                    lambda x=x, y=y, code=code: abs(user.seen(x, y, 1) - code).max() <= 1,
                    f"the answer at {x}, {y} is not on the screen",
                )

        weights = served.studio.session.weights
        shows(weights)
        assert user.seen(70, 40, 1) != before
        # A light alone, as under a pointer on its row.
        alone = np.zeros((N, 3))
        alone[1] = weights[1]
        user.page.locator(".light-thumb").nth(1).hover()
        wait_until(lambda: user.look("return mirror.display.otherWeights"), "no light is alone")
        gain = user.look("return mirror.display.otherWeights[1][0]") / weights[1, 0]
        shows(gain * alone)
        place = user.at(30, 10, 1)
        user.page.mouse.move(*place)
        script = "return engine.probe(30, 10).shares"
        wait_until(lambda: sum(user.look(script)) > 0, "no shares")
        around = (
            basis.planes.plane(0)[10, 30] @ LUMINANCE,
            basis.planes.plane(1)[10, 30] @ LUMINANCE,
        )
        shares = user.look(script)
        expected = np.divide(*around) * (weights[0] @ LUMINANCE) / (weights[1] @ LUMINANCE)
        np.testing.assert_allclose(shares[0] / shares[1], expected, rtol=0.1)
        assert fetched
        assert not [url for url in fetched if re.search("/data/(plane|clean)/", url)]
    finally:
        served.close()


def fill_and_ask(user: PainterUser) -> None:
    """Fill the floor; then, by a drag, ask for a place of the wall to be two stops darker."""
    wall = user.seen(10, H // 2 - 1)
    user.press("g").stroke((50, 40)).still("brush", "Floor")
    np.testing.assert_allclose(user.seen(3, H // 2), user.code(user.paint), atol=1)
    assert user.seen(10, H // 2 - 1) == wall
    light = user.served.studio.session.views[0].image[15, 80] / 4
    user.press("a")
    x, y = user.at(80, 15)
    user.drag((x, y), (x, y + 160), hold=True)
    assert user.page.get_by_text("2.0 stops darker").is_visible()
    user.page.mouse.up()
    user.still("brush", "Floor", "Spot")
    np.testing.assert_allclose(user.seen(80, 15), user.code(light), atol=2)


@pytest.mark.nightly
def test_a_light_is_held_and_moved_and_left(served_painter: ServedPainter, open_page: Any) -> None:
    user = open_page(served_painter, viewport={"width": 1280, "height": 720}).ready()
    session = served_painter.studio.session
    user.press("0").stroke((60, 30), (80, 30)).still("brush")
    slider = user.page.get_by_role("slider", name="light 1, stops from now", exact=True).first
    box = slider.bounding_box()
    user.button("Lock light 1 as it is in the answer").click()
    user.still("brush", "light 1")
    held_weights = session.weights[1].copy()
    user.page.get_by_text("locked", exact=True).wait_for()
    assert slider.bounding_box() == box  # what is said of a light moves no row
    slider.focus()
    slider.press("ArrowRight")
    user.still("brush", "light 1", "light 1")
    assert 1 < session.weights[1].max() / held_weights.max() < 1.1
    np.testing.assert_allclose(user.seen(40, 10, 1), user.answered(40, 10), atol=1)
    user.press("Control+z", "Control+z", "Control+z")  # as fast as fingers are
    user.still()
    assert not session.requests.lights
    # A page that goes in the middle of it leaves nothing. Rows that need two lines have had theirs.
    box = slider.bounding_box()
    y = box["y"] + box["height"] / 2
    user.drag((box["x"] + 40, y), (box["x"] + box["width"], y), hold=True)
    wait_until(lambda: session.is_open, "the slider is not heard")
    user.page.reload()
    user.ready()
    assert not session.is_open
    assert not session.requests.lights


@pytest.mark.nightly
def test_a_stroke_is_kept_though_the_page_is_closed_at_once(
    served_painter: ServedPainter, open_page: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    user = open_page(served_painter).ready().press("0")
    handle = served_painter.studio.handle

    def slowly(*arguments: Any) -> Any:
        time.sleep(0.3)
        return handle(*arguments)

    monkeypatch.setattr(served_painter.studio, "handle", slowly)
    user.stroke(
        (60, 30), (80, 30)
    )  # its end waits for the answer to what was said while it went on
    user.page.goto("about:blank")
    wait_until(lambda: served_painter.steps == ["brush"], "the stroke is lost")


@pytest.mark.nightly
def test_what_is_said_while_nothing_is_painted(
    served_painter: ServedPainter, open_page: Any
) -> None:
    user = open_page(served_painter).ready()
    headline, rows = user.page.locator(".headline"), user.page.locator(".lights")
    wait_until(lambda: headline.inner_text() == UNPAINTED, "it is not said at the start")
    user.press("0").stroke((60, 30), (80, 30)).still("brush")
    user.page.get_by_text("ΔE").first.wait_for()
    wait_until(lambda: "±" in rows.inner_text(), "it is not said how sure lights are")
    user.page.reload()
    user.ready().press("Control+z").still()
    wait_until(lambda: headline.inner_text() == UNPAINTED, "it is not said after all is undone")
    assert "±" not in rows.inner_text()
    slider = user.page.get_by_role("slider", name="light 1, stops from now", exact=True).first
    slider.press("ArrowRight")
    user.still("light 1")
    wait_until(
        lambda: "as you set them, all others as they were" in headline.inner_text(),
        "it is not said that a light is set",
    )


@pytest.mark.nightly
def test_a_pen_paints_with_its_pressure_and_fingers_paint_and_zoom(
    served_painter: ServedPainter, open_page: Any
) -> None:
    user = open_page(
        served_painter, has_touch=True, viewport={"width": 1024, "height": 768}
    ).ready()
    user.press("0")
    screen = user.page.context.new_cdp_session(user.page)

    def pen(y: float, force: float) -> None:
        for kind, x in (("Pressed", 20), ("Moved", 30), ("Moved", 40), ("Released", 40)):
            point = dict(zip("xy", user.at(x, y), strict=True))
            pen_options = {"pointerType": "pen", "button": "left", "buttons": 1, "clickCount": 1}
            event = {"type": f"mouse{kind}", **point, **pen_options, "force": force}
            screen.send("Input.dispatchMouseEvent", event)

    def touch(kind: str, *points: tuple[float, float]) -> None:
        touches = [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(points)]
        screen.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": touches})

    before = user.seen(30, 45)
    pen(10, 1.0)
    pen(45, 0.25)
    user.still("brush", "brush")
    hard, soft = (served_painter.studio.session.views[0].importance[y, 30] for y in (10, 45))
    assert 0 < soft < 0.8 * hard
    np.testing.assert_allclose(user.seen(30, 10), user.code(user.paint), atol=1)
    assert user.seen(30, 45) not in (before, user.seen(30, 10))
    for kind, *places in (
        ("touchStart", (20, 27)), ("touchMove", (30, 27)), ("touchMove", (40, 27)), ("touchEnd",)
    ):  # fmt: skip
        touch(kind, *(user.at(*place) for place in places))
    user.still("brush", "brush", "brush")
    np.testing.assert_allclose(user.seen(30, 27), user.code(user.paint), atol=1)
    scale = user.look("return engine.panes()[0].scale")
    x, y = user.at(30, 27)
    touch("touchStart", (x - 20, y))
    touch("touchStart", (x - 20, y), (x + 20, y))
    touch("touchMove", (x - 40, y), (x + 40, y))
    touch("touchEnd")
    user.still("brush", "brush", "brush")
    assert user.look("return engine.panes()[0].scale") == pytest.approx(2 * scale, rel=0.1)
    np.testing.assert_allclose(user.at(30, 27), (x, y), atol=3)
    np.testing.assert_allclose(user.seen(30, 27), user.code(user.paint), atol=1)


@pytest.mark.nightly
def test_strokes_outlive_their_connection(served_painter: ServedPainter, open_page: Any) -> None:
    user = open_page(served_painter).ready()
    lost_notice = user.page.get_by_text("The connection is lost")
    user.look(COUNT_LOSSES)
    user.press(*FIRM).drag(user.at(20, 20), user.at(30, 20), hold=True)
    user.look("host.socket.close()")
    user.page.wait_for_function("() => window.losses === 1")
    user.page.mouse.move(*user.at(40, 20), steps=3)
    user.page.mouse.up()
    lost_notice.wait_for(state="detached")
    user.still("brush")
    for x in (20, 30, 40):
        np.testing.assert_allclose(user.seen(x, 20), user.code(user.paint), atol=1)
        np.testing.assert_allclose(
            served_painter.studio.session.views[0].image[20, x], user.paint, rtol=1e-6
        )
    # A stroke that was kept, and whose answer never came, comes again and is kept once.
    user.look(
        "const receive = host.receive.bind(host);"
        "host.receive = (message) => {"
        "  if (message.kind === 'answer' && message.history) {"
        "    host.receive = receive; host.socket.close();"
        "  } else receive(message); }"
    )
    user.stroke((60, 40), (80, 40))
    user.page.wait_for_function("() => window.losses === 2")
    lost_notice.wait_for(state="detached")
    user.still("brush", "brush")
    user.press("Control+z", "Control+z")
    user.still()
    assert not served_painter.studio.session.is_painted


@pytest.mark.nightly
def test_what_is_kept_is_there_again_and_solved_alike_from_its_files(
    served_painter: ServedPainter, open_page: Any
) -> None:
    user = open_page(served_painter, view=None).ready()  # as the terminal's address leads there
    before = user.seen(60, 30)
    user.press("0").stroke((20, 20), (40, 20)).still("brush")
    user.press("Control+s")
    user.button("Load Look 1").wait_for()
    user.stroke((60, 20), (60, 40)).still("brush", "brush")
    codes = [user.seen(x, 30, pane) for x in (30, 60) for pane in (0, 1)]
    user.page.reload()
    user.ready()
    assert [user.seen(x, 30, pane) for x in (30, 60) for pane in (0, 1)] == codes
    user.press("Control+z").still("brush")
    assert user.seen(60, 30) == before
    user.press("Control+Shift+Z").still("brush", "brush")
    user.button("Load Look 1").click()
    user.still("brush", "brush", "look Look 1")
    user.button("Lock light 2 as it is in the answer").click()
    user.still("brush", "brush", "look Look 1", "light 2")
    np.testing.assert_allclose(user.seen(30, 20), user.code(user.paint), atol=1)
    assert user.seen(60, 30) == before
    user.button("Export").click()
    user.page.get_by_label("Report").uncheck()
    user.page.get_by_role("dialog").get_by_role("button", name="Export", exact=True).click()
    command = shlex.split(user.page.locator(".command code").inner_text())
    command_again = [
        sys.executable,
        "-m",
        *command,
        "--output",
        str(served_painter.folder / "again"),
    ]
    completed = subprocess.run(
        command_again, cwd=REPOSITORY, capture_output=True, text=True, check=False
    )
    assert completed.returncode == 0, completed.stderr
    session = served_painter.studio.session
    [exported_lighting] = served_painter.folder.glob("exports/*/lighting.json")
    for path in (
        exported_lighting,
        served_painter.folder / "again" / "lighting.json",
    ):
        emission = lp.read_lighting(path).emission
        weights = [emission[name] for name in session.basis.names]
        np.testing.assert_allclose(weights, session.weights, rtol=1e-9)


@pytest.mark.nightly
def test_pictures_of_the_choices_follow_the_painting_after_a_reload(
    served_painter: ServedPainter, open_page: Any
) -> None:
    user = open_page(served_painter, viewport={"width": 1280, "height": 800}).ready().press("0")
    studio = served_painter.studio

    def show_the_answers() -> None:
        """Wait until the three small pictures show what the session solved last."""
        for k, colors in enumerate(("own", "gentle", "free")):

            def is_shown(k: int = k, colors: str = colors) -> bool:
                shown = user.page.locator(".answer-choice .thumb").nth(k).evaluate(PIXELS_OF)
                solved = studio.resource(f"choice/{colors}")
                return np.array_equal(np.reshape(shown, (-1, 4))[:, :3], solved.reshape(-1, 3))

            wait_until(
                lambda: studio.state().choices and is_shown(), f"another picture of {colors}"
            )

    user.stroke((60, 30), (80, 30)).still("brush")
    show_the_answers()
    user.page.reload()
    user.ready()
    show_the_answers()
    user.press("x", "0").stroke((20, 20), (40, 20)).still("brush", "brush")
    show_the_answers()


@pytest.mark.nightly
def test_a_second_tab_takes_over_and_the_first_takes_back(
    served_painter: ServedPainter, open_page: Any
) -> None:
    first = open_page(served_painter).ready()
    first.press("0").stroke((20, 20), (40, 20)).still("brush")
    second = open_page(served_painter, beside=first)
    second.page.get_by_text("the painter is open in another tab").wait_for()
    second.button("Take over").click()
    second.ready()
    first.page.get_by_text("another tab has taken this session over").wait_for()
    second.press("0").stroke((60, 40), (80, 40)).still("brush", "brush")
    first.page.bring_to_front()
    first.stroke((10, 5), (20, 5))
    assert served_painter.steps == ["brush", "brush"]
    first.button("Take over").click()
    second.page.get_by_text("another tab has taken this session over").wait_for(state="attached")
    first.ready()
    np.testing.assert_allclose(first.seen(70, 40), first.code(first.paint), atol=1)
    current = served_painter.studio.session.views[0].current[5, 15]
    np.testing.assert_allclose(first.seen(15, 5), first.code(current), atol=1)


@pytest.mark.nightly
def test_a_stroke_that_was_taken_over_lies_over_nothing(
    served_painter: ServedPainter, open_page: Any
) -> None:
    first = open_page(served_painter).ready()
    first.press(*FIRM).drag(first.at(10, 5), first.at(20, 5), hold=True)
    wait_until(lambda: served_painter.studio.session.is_open, "the stroke is not heard")
    second = open_page(served_painter, beside=first)
    second.button("Take over").click()
    second.ready()
    # What was heard of it is kept; what the second tab paints there lies over it. It has the brush
    # that the first one had.
    second.press("x").stroke((10, 5), (40, 5)).still("stroke", "brush")
    first.page.bring_to_front()
    first.page.mouse.move(*first.at(60, 5), steps=3)
    first.page.mouse.up()
    first.button("Take over").click()
    first.page.get_by_text("A stroke in this tab had not been sent").wait_for()
    first.ready()
    assert served_painter.steps == ["stroke", "brush"]
    np.testing.assert_allclose(first.seen(15, 5), first.code(second.paint), atol=1)
    current = served_painter.studio.session.views[0].current[5, 58]
    np.testing.assert_allclose(first.seen(58, 5), first.code(current), atol=1)


@pytest.mark.nightly
def test_a_tab_of_an_earlier_start_says_what_to_do(subject: Subject, browser: Any) -> None:
    """Its errors on the console are what a server that is not there, or refuses it, makes."""
    first_painter = ServedPainter(subject)
    context = browser.new_context()
    try:
        page = context.new_page()
        page.goto(first_painter.server.url)
        user = PainterUser(page, first_painter).ready()
        user.look("host.listeners.delete('closed')")  # one that is killed says no goodbye
    finally:
        first_painter.close()
    second_painter = None
    try:
        page.get_by_text("What you paint now is sent if the same painter comes back").wait_for()
        user.stroke((10, 5), (20, 5))
        user.stroke((10, 15), (20, 15))
        second_painter = ServedPainter(subject, port=first_painter.server.port)
        page.get_by_text("This page belongs to a painter that has ended").wait_for()
        page.get_by_text("2 strokes painted here could not be sent, and are lost").wait_for()
        # Nobody would hear more of them.
        count = user.look("return mirror.strokes.count")
        user.stroke((10, 25), (20, 25))
        assert user.look("return mirror.strokes.count") == count
        second_page = context.new_page()
        second_page.goto(second_painter.server.url)
        # The new tab has the new key, and the old one does not take the session by it.
        PainterUser(second_page, second_painter).ready()
        assert page.get_by_text("This page belongs to a painter that has ended").is_visible()
    finally:
        context.close()
        if second_painter:
            second_painter.close()


@pytest.fixture
def two_views(subject: Subject, basis: lp.Basis) -> Iterator[ServedPainter]:
    """A painter of two views: the second one is smaller, and sees a part of the first."""
    half = {
        "planes": np.ascontiguousarray(basis.images[:, 10:, :48]),
        "noise": np.ascontiguousarray(basis.half_differences[:, 10:, :48]),
        "emitters_seen": basis.emitters_seen[10:, :48],
        "objects": Objects(basis.objects.index[10:, :48], ("wall", "floor")),
        "origin": replace(basis.origin, sensor="side"),
    }
    painter = ServedPainter(subject, replace(subject, basis=replace(basis, **half)))
    yield painter
    painter.close()


@pytest.mark.nightly
def test_two_views_are_painted_and_have_one_answer(
    two_views: ServedPainter, open_page: Any
) -> None:
    user = open_page(two_views).ready()
    views = two_views.studio.session.views
    user.press(*FIRM).stroke((20, 10), (40, 10)).still("brush")
    before = user.answered(10, 30, 1)
    user.press("n").ready()
    assert user.look("return [engine.mirror.view, ...screen.size]") == [1, 44, 48]
    assert user.button("side not painted").get_attribute("aria-pressed") == "true"
    np.testing.assert_allclose(user.seen(10, 30, 1), before, atol=1)
    user.page.get_by_text("Nothing is painted in this view").wait_for()
    user.press("x").stroke((10, 30), (30, 30)).still("brush", "brush")
    paint = user.paint
    np.testing.assert_allclose(user.seen(20, 30), user.code(paint), atol=1)
    np.testing.assert_allclose(views[1].image[30, 20], paint, rtol=1e-6)
    np.testing.assert_allclose(user.seen(10, 30, 1), user.answered(10, 30, 1), atol=1)
    assert not views[0].importance[30].any()
    # Fill takes the object of this view.
    user.press("g").stroke((40, 40)).still("brush", "brush", "Floor")
    np.testing.assert_allclose(user.seen(3, 40), user.code(paint), atol=1)
    user.page.reload()
    user.ready()
    np.testing.assert_allclose(user.seen(70, 40, 1), user.answered(70, 40), atol=1)
    # What is undone is seen.
    user.press("Control+z")
    wait_until(lambda: user.look("return engine.mirror.view") == 1, "the other view is shown")
    user.ready().still("brush", "brush")
    np.testing.assert_allclose(user.seen(20, 30), user.code(paint), atol=1)
    user.press("Control+z").still("brush")
    user.press("Control+z")
    wait_until(lambda: user.look("return engine.mirror.view") == 0, "the first view is shown")
    user.ready().still()
    np.testing.assert_allclose(user.seen(30, 10), user.code(views[0].current[10, 30]), atol=1)
    user.press("Control+Shift+Z", "Control+Shift+Z").still("brush", "brush")
    wait_until(lambda: user.look("return engine.mirror.view") == 1, "the other view is shown")
    user.ready()
    user.button("Export").click()
    assert not user.page.get_by_label("Report").is_visible()  # of bases without their scene
    user.page.get_by_role("dialog").get_by_role("button", name="Export", exact=True).click()
    user.page.locator(".exported li", has_text="painting-side.exr").wait_for()
    [folder] = (two_views.folder / "exports").iterdir()
    paintings = [folder / f"painting-{view.name}.exr" for view in views]
    bases = [view.basis for view in views]
    solution = correct_noise(lp.solve(bases, [lp.read_target(path) for path in paintings]))
    weights = lp.read_lighting(folder / "lighting.json").weights_for(bases[0])
    np.testing.assert_allclose(weights, solution.weights, rtol=1e-9)


class Rendering(Subject):
    """A scene whose first picture takes a while, and which then gets better."""

    steps: list[threading.Event]

    def bases(self, progress: Any = None) -> Iterator[lp.Basis]:
        first, better, announced = self.folder.events  # type: ignore[attr-defined]
        progress("rendering lights", 1, 4, "passes")
        first.wait(60)
        assert self.basis is not None
        yield self.basis
        better.wait(60)
        images = self.basis.images * np.float32(1.25)
        yield replace(self.basis, planes=images)
        announced.set()


class Beginning(Subject):
    """A scene of which a picture comes before its lights."""

    def bases(self, progress: Any = None) -> Iterator[lp.Basis]:
        [rendered] = self.folder.events  # type: ignore[attr-defined]
        assert self.basis is not None
        yield look_of(self.basis)
        rendered.wait(60)
        yield self.basis


class Folder(type(Path())):  # type: ignore[misc]
    """A folder that carries what its test waits for."""

    events: tuple[threading.Event, ...]


def test_one_paints_on_the_first_picture_and_is_answered_by_the_lights(
    basis: lp.Basis, tmp_path: Path, open_page: Any
) -> None:
    folder = Folder(tmp_path)
    folder.events = (threading.Event(),)
    painter = ServedPainter(Beginning("room.xml", folder, basis=basis))
    try:
        user = open_page(painter, viewport={"width": 1280, "height": 720})
        user.page.get_by_text("Answer: the lights are being rendered …").wait_for()
        user.ready()
        user.press(*FIRM).drag(user.at(20, 20), user.at(40, 20))
        user.page.get_by_text("what you paint is kept, and answered then").wait_for()
        np.testing.assert_allclose(user.seen(30, 20), user.code(user.paint), atol=1)
        session = painter.studio.session
        np.testing.assert_array_equal(session.weights, basis.current_weights)
        folder.events[0].set()
        user.page.get_by_text("Answer: the lights are being rendered …").wait_for(state="detached")
        user.still("brush").ready()
        assert not np.allclose(session.weights, basis.current_weights)
        np.testing.assert_allclose(user.seen(30, 20), user.code(user.paint), atol=1)
        np.testing.assert_allclose(user.seen(70, 40, 1), user.answered(70, 40), atol=1)
    finally:
        painter.close()


@pytest.mark.nightly
def test_one_waits_for_the_first_picture_and_paints_while_it_gets_better(
    basis: lp.Basis, tmp_path: Path, open_page: Any
) -> None:
    folder = Folder(tmp_path)
    folder.events = threading.Event(), threading.Event(), threading.Event()
    painter = ServedPainter(Rendering("room.xml", folder, basis=basis))
    try:
        user = open_page(painter, viewport={"width": 1280, "height": 720})
        user.page.get_by_text("Rendering the first picture …").wait_for()
        full_size = user.page.get_by_role("button", name="1:1", exact=True)
        assert full_size.get_attribute("aria-pressed") != "true"  # there is no picture yet
        user.page.reload()
        user.page.get_by_text("Rendering the first picture …").wait_for()
        assert user.page.get_by_role("progressbar").first.get_attribute("aria-valuenow") == "1"
        folder.events[0].set()
        user.ready()
        code = user.seen(90, 50)
        user.press(*FIRM).drag(user.at(20, 20), user.at(30, 20), hold=True)
        folder.events[1].set()
        folder.events[2].wait(60)
        wait_until(lambda: user.seen(90, 50) != code, "the page has the old picture")
        user.page.mouse.move(*user.at(40, 20), steps=3)
        user.page.mouse.up()
        user.still("brush").ready()
        session = painter.studio.session
        for x in (20, 30, 40):
            np.testing.assert_allclose(user.seen(x, 20), user.code(user.paint), atol=1)
            np.testing.assert_allclose(session.views[0].image[20, x], user.paint, rtol=1e-6)
        np.testing.assert_allclose(user.seen(70, 40, 1), user.answered(70, 40), atol=1)
        user.press("Control+z").still()
        np.testing.assert_allclose(
            user.seen(30, 20), user.code(session.views[0].current[20, 30]), atol=1
        )
    finally:
        for event in folder.events:
            event.set()
        painter.close()


@pytest.mark.nightly
def test_what_comes_at_rest_is_drawn_sharply_at_once(
    served_painter: ServedPainter, open_page: Any
) -> None:
    """As each round of samples does: a picture that is looked at does not turn coarse for it."""
    user = open_page(served_painter).ready()
    user.stroke((20, 20), (40, 20)).still("brush")
    user.look(
        "const draw = screen.view.draw.bind(screen.view); window.drawn = [];"
        "screen.view.draw = (params) => { window.drawn.push(params.live); draw(params); }"
    )
    served_painter.studio._exact_answers.notify()
    wait_until(lambda: user.page.evaluate("() => window.drawn.length"), "nothing is drawn")
    user.still("brush")
    assert not any(user.page.evaluate("() => window.drawn"))


@pytest.mark.nightly
def test_in_a_browser_that_is_zoomed_it_is_sharp_and_in_its_place(
    served_painter: ServedPainter, open_page: Any
) -> None:
    """At 200 % a window of 1280x720 has half the room, and two pixels for each of its own."""
    size = {"width": 640, "height": 360}
    user = open_page(served_painter, viewport=size, device_scale_factor=2).ready()
    width = user.look("return screen.view.canvas.width / engine.element.clientWidth")
    assert width == pytest.approx(2, rel=0.01)
    user.press("0").stroke((20, 20), (40, 20)).still("brush")
    np.testing.assert_allclose(user.seen(30, 20), user.code(user.paint), atol=1)
    assert user.look("return document.documentElement.scrollWidth <= innerWidth")
    user.button("Export").click()  # what does not fit is scrolled to
    user.page.get_by_role("dialog", name="Export").wait_for()


#: A lamp of the painter with a console, and the linear colours of its emitters at full.
LAMP = "light 0"
FULL = {"red": [2, 0, 0], "green": [0, 2, 0], "blue": [0, 0, 2], "white": [1, 1, 1]}
RIG = ConsoleRig("show.mvr", (lamp(LAMP, 1),))


class Wire:
    """What has arrived at a port."""

    def __init__(self, port: socket.socket) -> None:
        port.setblocking(False)
        self.port = port
        self.address = f"sacn://127.0.0.1:{port.getsockname()[1]}"

    def packets(self) -> list[SacnFields]:
        """All packets since the last call."""
        found = []
        while True:
            try:
                found.append(sacn_fields(self.port.recv(2048)))
            except BlockingIOError:
                return found

    def has(self, levels: bytes) -> bool:
        """Return whether the last packet that came has these levels."""
        packets = self.packets()
        return bool(packets) and packets[-1].slots == levels


@pytest.fixture
def wire() -> Iterator[Wire]:
    with open_port() as port:
        yield Wire(port)


@pytest.fixture
def console_painter(
    basis: lp.Basis, wire: Wire, tmp_path: Path, without_reasons: None
) -> Iterator[ServedPainter]:
    """A painter of a lamp of four emitters at 1.1, and two lights of any colour."""
    emitters = [{"name": name, "rgb": FULL[name]} for name in COLORS]
    keys = {"light": {LAMP: {"emitters": emitters}}}
    requested = basis.with_requests(SceneRequests(keys, "room.lights.toml"))
    console = Console(RIG, partial(ConsoleLink.open, wire.address, RIG), wire.address)
    painter = ServedPainter(make_subject(requested, tmp_path / "room"), console=console)
    yield painter
    painter.close()


@pytest.mark.nightly
def test_the_lamps_follow_and_go_dark_at_the_second_press(
    console_painter: ServedPainter, open_page: Any, wire: Wire
) -> None:
    user = open_page(console_painter).ready()
    user.press("0").stroke((20, 10), (60, 10), (20, 30)).still("brush")
    assert wire.packets() == []  # nothing is sent before it is switched on
    switch = user.page.get_by_role("checkbox", name="Console")
    assert not switch.is_checked()
    switch.click()

    def lit() -> bytes:
        with console_painter.studio._access.lock:
            drives = drives_of_session(console_painter.studio.session)
        return encode_levels(RIG, drives)[1]

    wait_until(lambda: wire.has(lit()), "the answer is not on the wire")
    dark = encode_levels(RIG, {})[1]
    assert lit() != dark
    # One press asks, and is forgotten after a while.
    user.button("Blackout").click()
    user.button("Press again").wait_for()
    user.button("Blackout").wait_for()
    assert all(x.slots == lit() for x in wire.packets())
    user.button("Blackout").click()
    user.button("Press again").click()
    user.button("Light again").wait_for()
    wait_until(lambda: wire.has(dark), "it is not dark")
    # It stays dark while somebody paints on.
    user.stroke((60, 20), (80, 30)).still("brush", "brush")
    assert all(x.slots == dark for x in wire.packets())
    user.button("Light again").click()
    wait_until(lambda: wire.has(lit()), "it is not lit again")
    switch.click()
    wait_until(lambda: any(x.is_last for x in wire.packets()), "the stream has no end")
