"""Records sessions of the painter: moving pictures, and some that stand still.

    pip install '.[test]'
    python docs/images/record.py [--spp 64] [--port 8431] [--only PICTURE]

writes beside itself

    painting.webp   somebody paints the gallery: a warm wall, a cool one, light on a figure
    painter.jpg     the painter when that is done
    painter-views.jpg   the stage, painted from the balcony and from a box
    painter-layers.jpg  the gallery with wishes as layers, one of them unfolded
    painter-selection.jpg  a warm gradient on the wall of the window, which is selected
    painter-reference.jpg  the gallery made to look like one of four references
    painter-presets.jpg, painter-looks.jpg, painter-history.jpg  what is asked for at a click, the
                        looks that were kept, and the steps that led to them
    painter-lamps.jpg   spots dimmed together, two of them with a gel, under a master
    painter-sky.jpg     the table under a sky in texels, some of which are painted on its map
    painter-side-by-side.jpg   three looks side by side, in the light theme
    painter-planes.jpg  lux on the desks of the office, over the picture of the answer
    painter-tour.jpg, painter-keys.jpg, painter-settings.jpg, painter-analysis.jpg  a step of the
                        tour, the shortcuts, the settings, and why an answer is no closer
    lights.webp     somebody drags a spot, aims it by a click, paints, and lets the lights move;
                    it also prints the answers a second of the drag

The painter's own server, with new sessions in folders that are removed, and headless Chromium.
A basis is rendered once, and kept where all bases are. Nothing is sped up but the waiting.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from threading import Thread
from typing import Literal

from PIL import Image, ImageDraw
from playwright.sync_api import Page, sync_playwright

HERE = Path(__file__).resolve().parent
SCENES = HERE.parent.parent / "scenes"
PAINTINGS = HERE.parent.parent / "targets/gallery"

#: Of the page, and of the recording.
WINDOW, SIZE = (1360, 800), (1020, 600)

#: Milliseconds that a frame is shown.
FRAME = 90

#: Looks in a row at which nothing is being solved, before an answer counts as final: on a busy
#: machine a drag begins to be solved only after a while.
CALM = 4

#: Milliseconds between looks at a search for places of lights, and frames of it that are shown: on
#: a busy machine a search takes many minutes.
SEARCH_PAUSE_MS, SEARCH_FRAMES = 1500, 24

#: Seconds after which something has failed, however busy the machine is.
PATIENCE_S = 1800

#: Counts answers to moves of lights.
COUNT_ANSWERS = """() => {
  const { host } = document.getElementById('lightpaint').painter;
  const send = host.send.bind(host);
  window.answerCount = 0;
  host.send = async (kind, fields, arrays) => {
    const reply = await send(kind, fields, arrays);
    if (kind === 'move') window.answerCount += 1;
    return reply;
  };
}"""

#: Whether all pictures of a sheet have come.
ARE_PICTURES_DRAWN = (
    "() => [...document.querySelectorAll('.sheet canvas')].every(({ width }) => width > 1)"
)

#: An arrow whose tip is its first point.
POINTER = ((0, 0), (0, 19), (5, 15), (8, 22), (12, 20), (9, 14), (15, 14))

Place = tuple[float, float]


class Hand:
    """Uses a page with a pointer that is seen, and takes a picture after every move."""

    def __init__(self, page: Page) -> None:
        self.page, self.at = page, (620.0, 30.0)
        self.frames: list[Image.Image] = []
        self.times: list[int] = []

    def see(self, times: int = 1) -> None:
        """What the window shows now, with the pointer."""
        frame = Image.open(BytesIO(self.page.screenshot())).convert("RGB")
        tip = [(self.at[0] + x, self.at[1] + y) for x, y in POINTER]
        ImageDraw.Draw(frame).polygon(tip, fill="white", outline="black", width=1)
        self.frames.append(frame)
        self.times.append(times * FRAME)

    def go(self, to: Place, moves: int = 6) -> None:
        """Move there, slower at both ends."""
        begin = self.at
        for k in range(1, moves + 1):
            t = k / moves
            t = t * t * (3 - 2 * t)
            self.at = tuple(a + t * (b - a) for a, b in zip(begin, to, strict=True))  # type: ignore[assignment]
            self.page.mouse.move(*self.at)
            time.sleep(0.05)
            self.see()

    def drag(self, *places: Place, moves: int = 7) -> None:
        """Press at the first place, and let go at the last."""
        self.go(places[0])
        self.page.mouse.down()
        for place in places[1:]:
            self.go(place, moves)
        self.page.mouse.up()

    def press(self, name: str) -> None:
        """Click on what has that label."""
        button = self.page.get_by_role("button", name=name, exact=True).first
        button.scroll_into_view_if_needed()
        box = button.bounding_box()
        assert box is not None, name
        self.go((box["x"] + box["width"] / 2, box["y"] + box["height"] / 2))
        self.page.mouse.click(*self.at)
        self.see(3)

    def thin_out(self, first: int, count: int) -> None:
        """Keep only `count` of the frames from the first of these on, evenly spread."""
        step = max(1, -(-(len(self.frames) - first) // count))
        self.frames[first:] = self.frames[first::step]
        self.times[first:] = self.times[first::step]

    def wait(self, times: int = 12) -> None:
        """Until the answer is exact, and stays it, and its sentence and the reasons are there.

        Raises RuntimeError where the page warns of something.
        """
        calm = 0

        def is_settled() -> bool:
            nonlocal calm
            if warnings := self.page.locator(".toast.is-warn").all_inner_texts():
                raise RuntimeError(warnings[0])
            calm = calm + 1 if self.is_calm() else 0
            return calm >= CALM

        self.until(is_settled, "the answer is exact")
        time.sleep(0.8)  # a toast, a sharp picture
        self.see(times)

    def until(self, is_so: Callable[[], bool], what: str) -> None:
        """Wait until something is so. Raises TimeoutError, which says what never was."""
        start = time.monotonic()
        while not is_so():
            if time.monotonic() > start + PATIENCE_S:
                raise TimeoutError(f"after {PATIENCE_S} s it is not so that {what}")
            self.page.wait_for_timeout(400)
        print(f"{time.monotonic() - start:6.1f} s until {what}", flush=True)

    def is_calm(self) -> bool:
        """Whether nothing is being solved or explained, and the other answers are solved, too."""
        said = self.page.locator(".headline .said")
        reasons = self.page.get_by_role("button", name="Finding reasons …")
        is_painted = "ΔE" in self.page.locator(".headline").inner_text()
        is_busy = self.page.locator(".headline .live").count() or reasons.count()
        has_old_choices = is_painted and self.page.locator(".choices.is-old").count()
        return not is_busy and not has_old_choices and "…" not in said.inner_text()

    def of_painting(self, u: float, v: float) -> Place:
        """A place of the left, or upper, picture, as shares of it."""
        left, top, width, height = self.page.evaluate(
            """() => {
              const { engine } = document.getElementById('lightpaint').painter;
              const { x, y } = engine.element.getBoundingClientRect();
              const [pane] = engine.panes(), [height, width] = engine.screen.size;
              return [x + pane.left, y + pane.top, width * pane.scale, height * pane.scale];
            }"""
        )
        return left + u * width, top + v * height


def session(hand: Hand) -> None:
    """What somebody does."""
    on = hand.of_painting
    hand.see(12)
    # A low sun on the wall to the right.
    hand.drag(on(0.895, 0.25), on(0.905, 0.62), on(0.94, 0.74), on(0.93, 0.5))
    hand.wait()
    # The other colour, on the wall to the left.
    hand.page.keyboard.press("x")
    hand.see(3)
    hand.drag(on(0.03, 0.27), on(0.13, 0.34), on(0.25, 0.41), on(0.1, 0.37), on(0.02, 0.33))
    hand.wait()
    # More light on the figure, and warmer.
    hand.press("Adjust: drag up for brighter, right for warmer")
    x, y = on(0.295, 0.56)
    hand.drag((x, y), (x + 50, y - 110), moves=14)
    hand.wait()
    hand.press("Wipe")
    hand.see(16)
    hand.press("Side by side")
    hand.see(16)


def from_two_seats(hand: Hand) -> None:
    """The figure, from the balcony; then the wall behind her as it is seen from a box."""
    on = hand.of_painting
    hand.page.keyboard.press("a")
    x, y = on(0.53, 0.66)
    hand.drag((x, y), (x + 40, y - 90))
    hand.wait()
    hand.page.keyboard.press("n")
    load(hand.page)
    hand.page.keyboard.press("b")
    hand.page.keyboard.press("x")
    hand.drag(on(0.44, 0.3), on(0.5, 0.2), on(0.58, 0.35))
    hand.wait()


def layered(hand: Hand) -> None:
    """An evening of several wishes, of which one is unfolded."""
    on, page = hand.of_painting, hand.page
    page.keyboard.press("a")
    page.get_by_role("button", name="By numbers", exact=True).click()
    for label, text in (("Brighter", "-1"), ("Warmer", "-30")):
        field = page.get_by_role("textbox", name=label, exact=True).first
        field.fill(text)
        field.press("Enter")
    page.get_by_role("button", name="Apply", exact=True).click()
    page.get_by_role("button", name="Adjust by numbers", exact=True).click()
    page.get_by_role("button", name="Object", exact=True).click()
    for place, (right, up) in (((0.61, 0.55), (40, 90)), ((0.295, 0.56), (25, 60))):
        x, y = on(*place)
        hand.drag((x, y), (x + right, y - up))
    page.keyboard.press("b")
    hand.drag(on(0.03, 0.27), on(0.13, 0.34), on(0.25, 0.41))
    hand.drag(on(0.895, 0.25), on(0.905, 0.62))
    hand.wait()
    page.locator(".is-colour .fold-head button").first.click()  # there is room for all layers then
    page.locator(".layer-name", has_text="Knot").first.click()
    page.mouse.move(5, 5)
    hand.wait()


def many_lamps(hand: Hand) -> None:
    """Spots that are dimmed by a stop together, two of them with a gel, under a master of 70 %."""
    page = hand.page
    page.locator(".is-colour .fold-head button").first.click()
    page.get_by_role("searchbox", name="Search lights").fill("spot_*")
    page.keyboard.press("Enter")
    _type(page, "Dim by", "-1")
    page.get_by_role("button", name="Select none").click()
    for name in ("spot_knot", "spot_figure"):
        page.get_by_role("checkbox", name=f"Select {name}").click()
    panel = page.get_by_role("region", name="Selected lights")
    panel.get_by_role("button", name="Colour", exact=True).click()
    panel.get_by_role("button", name="Gel", exact=True).click()
    _type(page, "Filter", "201")
    page.get_by_role("textbox", name="Filter", exact=True).fill("")  # lists all
    _type(page, "Master", "70")
    page.mouse.move(5, 5)
    hand.wait()


def painted_sky(hand: Hand) -> None:
    """A sun and a blue half, painted on the map of a sky; the room shows it."""
    page = hand.page
    page.locator(".is-colour .fold-head button").first.click()
    page.get_by_role("button", name="sky", exact=True).click()
    paint = page.get_by_role("group", name="Paint of texels")
    sky = page.get_by_role("grid", name="Texels of sky")
    strokes = (
        ("#ff7a30", "2.5", (0.03, 0.43), (0.28, 0.43)),
        ("#3050ff", "0.5", (0.53, 0.32), (0.97, 0.32)),
    )
    for color, stops, *places in strokes:
        paint.get_by_label("Hex").fill(color)
        page.keyboard.press("Enter")
        paint.get_by_role("textbox", name="Brightness").fill(stops)
        page.keyboard.press("Enter")
        sky.scroll_into_view_if_needed()
        box = sky.bounding_box()
        assert box is not None
        hand.drag(*((box["x"] + u * box["width"], box["y"] + v * box["height"]) for u, v in places))
    page.get_by_role("slider", name="sky, stops from now").scroll_into_view_if_needed()
    page.mouse.move(5, 5)
    hand.wait()


def like_a_reference(hand: Hand) -> None:
    """Paintings as references, and the light of one of them."""
    page = hand.page
    page.get_by_role("button", name="References").click()
    for name in ("opening.png", "overcast.png", "after-hours.png", "last-sun.png"):
        page.locator(".reference-pane input[type=file]").set_input_files(PAINTINGS / name)
        label = name.removesuffix(".png")
        page.locator(".reference-name", has_text=label).wait_for()
    page.get_by_role("button", name="Same view", exact=True).click()
    page.get_by_role("checkbox", name="As bright as it").check()
    page.get_by_role("button", name="Look like this", exact=True).click()
    _wait_for_layer(hand, "Like last-sun")


def _wait_for_layer(hand: Hand, name: str) -> None:
    hand.page.locator(".layer-name", has_text=name).first.wait_for()
    hand.page.mouse.move(5, 5)
    hand.wait()


def keep_looks(hand: Hand) -> None:
    """Looks of the references, and of presets; each is a step, or two."""
    page = hand.page
    _save(hand, "Last sun")
    for name in ("overcast", "opening"):
        page.keyboard.press("Control+z")
        page.get_by_role("button", name=f"Show {name}").click()
        page.get_by_role("button", name="Look like this", exact=True).click()
        _wait_for_layer(hand, f"Like {name}")
        _save(hand, name.capitalize())
    page.get_by_role("button", name="Close the references").click()
    for name in ("Moonlight", "Noir", "Only this object"):
        page.get_by_role("button", name="Clear painting", exact=True).click()
        page.get_by_role("button", name="Presets", exact=True).click()
        page.locator(".sheet button", has_text=name).click()
        _wait_for_layer(hand, name)
        _save(hand, name)


def _save(hand: Hand, name: str) -> None:
    page = hand.page
    count = page.locator(".look").count()
    page.get_by_role("button", name="Save look").first.click()
    page.locator(".look").nth(count).wait_for()
    page.locator(".look-name").last.click()
    page.locator("input.naming").fill(name)
    page.keyboard.press("Enter")
    page.locator(".look-name", has_text=name).wait_for()


def looks_beside(hand: Hand) -> None:
    """Looks of three presets, side by side."""
    page = hand.page
    names = page.locator(".look-name")
    for k, preset in enumerate(("Moonlight", "Golden hour", "Gallery")):
        page.get_by_role("button", name="Presets", exact=True).click()
        page.locator(".sheet button", has=page.get_by_text(preset, exact=True)).click()
        page.locator(".layer-name", has_text=preset).first.wait_for()
        page.wait_for_timeout(3000)  # a busy machine begins to solve late
        hand.wait()
        page.keyboard.press("Control+s")
        names.nth(k).click()
        page.locator(".naming").fill(preset)
        page.keyboard.press("Enter")
        page.get_by_role("button", name=f"Load {preset}").wait_for()
        page.keyboard.press("Control+z")
        hand.wait()
    page.get_by_role("button", name="All looks").click()
    sheet = page.get_by_role("dialog")
    for box in sheet.get_by_role("checkbox").all():
        box.check()
    sheet.get_by_role("button", name="Side by side").click()
    page.mouse.move(5, 5)
    page.wait_for_timeout(2000)


def panels(hand: Hand) -> Iterator[str]:
    """Panels that stand still; yields the name of each while it is shown."""
    page, on = hand.page, hand.of_painting
    page.keyboard.press("?")
    dialog = page.get_by_role("dialog")
    dialog.wait_for()
    page.wait_for_timeout(600)
    yield "keys"
    dialog.get_by_role("button", name="Show the tour").click()
    for _ in range(2):
        page.get_by_role("button", name="Next", exact=True).last.click()
    page.wait_for_timeout(600)
    yield "tour"
    page.keyboard.press("Escape")
    page.keyboard.press("a")
    page.get_by_role("button", name="Object", exact=True).click()
    for (x, y), up in ((on(0.06, 0.48), 110), (on(0.16, 0.48), -110)):
        hand.drag((x, y), (x, y - up))
    hand.wait()
    hand.press("Analysis")
    hand.press("Why not closer?")
    hand.wait()
    yield "analysis"
    hand.press("Solve settings")
    page.mouse.move(5, 5)
    page.wait_for_timeout(600)
    yield "settings"


def _type(page: Page, label: str, text: str) -> None:
    field = page.get_by_role("textbox", name=label, exact=True).first
    field.fill(text)
    field.press("Enter")


def lux_on_desks(hand: Hand) -> None:
    """The office darker, while its desks keep the lux that are wished for."""
    page, on = hand.page, hand.of_painting
    page.keyboard.press("a")
    page.get_by_role("button", name="By numbers", exact=True).click()
    _type(page, "Brighter", "-1")
    page.get_by_role("button", name="Apply", exact=True).click()
    for title in ("Colour", "Adjust by numbers", "Layers", "Lights"):  # there is room for planes
        page.locator(".fold-head button", has_text=title).first.click()
    page.locator(".is-planes").wait_for()
    page.get_by_role("checkbox", name="Lux in the picture").check()
    page.get_by_role("button", name="Hide room in the picture").click()
    page.keyboard.press("b")
    page.get_by_role("button", name="Blink", exact=True).click()
    page.keyboard.press("k")
    hand.wait()
    page.mouse.move(*on(0.37, 0.83))
    page.wait_for_timeout(1500)


def selected(hand: Hand) -> None:
    """A stop more on what a spot lights, and a gradient on a wall within a soft lasso."""
    on, page = hand.of_painting, hand.page
    for _ in range(3):
        page.keyboard.press("m")
    page.get_by_role("button", name="More", exact=True).click()
    panel = page.locator(".select-panel")
    panel.get_by_role("combobox", name="Select").select_option("light")
    panel.get_by_role("combobox", name="Light").last.select_option("spot_knot")
    panel.get_by_role("button", name="Select", exact=True).click()
    page.wait_for_timeout(1000)
    page.keyboard.press("a")
    x, y = on(0.5, 0.5)
    hand.drag((x, y), (x, y - 80))
    hand.wait()
    page.keyboard.press("m")
    hand.drag(on(0.856, 0.15), on(0.856, 0.7), on(0.995, 0.84), on(0.995, 0.03), on(0.86, 0.14))
    panel.get_by_role("button", name="Feather", exact=True).click()
    page.get_by_role("button", name="Colour", exact=True).first.click()
    page.keyboard.press("r")
    hand.drag(on(0.985, 0.1), on(0.87, 0.72))
    hand.wait()
    page.mouse.move(5, 5)
    hand.wait()


def moving_lights(hand: Hand) -> None:
    """A spot that is dragged, and aimed by a click; a wish that lights answer by moving."""
    on, page = hand.of_painting, hand.page
    page.keyboard.press("d")
    page.locator(".lamp").first.wait_for(timeout=900_000)
    hand.see(10)
    box = page.locator('.lamp[data-lamp="spot_figure"]').first.bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.evaluate(COUNT_ANSWERS)
    start = time.perf_counter()
    hand.drag((x, y), (x + 60, y - 4), (x + 110, y + 2), moves=10)
    answers = page.evaluate("() => window.answerCount") / (time.perf_counter() - start)
    print(f"{answers:.1f} answers a second, while pictures of the page were taken")
    hand.wait()
    row = page.locator('[data-light="spot_figure"]')
    row.get_by_role("button", name="spot_figure", exact=True).first.click()
    aim = row.get_by_role("button", name="Aim here")
    aim.scroll_into_view_if_needed()
    aim.click()
    hand.see(6)
    hand.go(on(0.61, 0.55))
    before = page.locator(".lamp-aim").first.get_attribute("style")
    page.mouse.click(*hand.at)
    aimed = page.locator(".lamp-aim").first
    hand.until(lambda: aimed.get_attribute("style") != before, "the spot is aimed")
    hand.wait(16)
    # A wish that lights answer by moving.
    hand.drag(on(0.03, 0.27), on(0.13, 0.34), on(0.25, 0.41), on(0.1, 0.37))
    hand.wait()
    hand.press("Let lights move")
    page.get_by_role("button", name="Begin", disabled=False).wait_for()
    hand.press("Begin")
    working = page.get_by_role("button", name="Stop, move nothing")
    working.wait_for()
    first = len(hand.frames)

    def has_ended() -> bool:
        hand.see(2)
        page.wait_for_timeout(SEARCH_PAUSE_MS)
        return not working.count()

    hand.until(has_ended, "the search has ended")
    hand.thin_out(first, SEARCH_FRAMES)
    hand.wait(24)


def load(page: Page) -> None:
    """Until all is rendered, and clean: nothing that is published has grain."""
    page.wait_for_function(
        """() => {
          const { mirror } = document.getElementById('lightpaint').painter.engine;
          const loaded = [...mirror.loader.loadedVersions.values()];
          const clean = loaded.filter((version) => version.includes(' clean/'));
          const isDone = !document.querySelector('.working');
          return isDone && mirror.isReady && clean.length === mirror.state.lights.length;
        }""",
        timeout=600_000,
    )
    page.wait_for_timeout(1500)


@contextmanager
def painter(
    scene: str, spp: int, port: int, *more: str, folder: str | None = None
) -> Iterator[str]:
    """Start a painter and give its address. folder: of its session, by default one of its own.

    Raises RuntimeError with its lines where it ends before it has an address.
    """
    with tempfile.TemporaryDirectory() as own:
        words = [
            "paint",
            str(SCENES / scene) if scene.endswith(".xml") else str(SCENES / scene / "scene.xml"),
            *more,
            f"--spp={spp}",
            f"--port={port}",
            "--no-browser",
            "-o",
            folder or own,
        ]
        run = [sys.executable, "-m", "lightpaint", *words]
        server = subprocess.Popen(run, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        assert server.stdout is not None
        try:
            lines: list[str] = []
            for line in server.stdout:
                lines.append(line)
                if addresses := [word for word in line.split() if "#token=" in word]:
                    break
            else:
                raise RuntimeError("".join(lines))
            # It would wait for a reader of what else it prints.
            Thread(target=server.stdout.read, daemon=True).start()
            yield addresses[0]
        finally:
            server.terminate()
            server.wait(60)


@contextmanager
def using(url: str, theme: Literal["dark", "light"] = "dark") -> Iterator[Hand]:
    """A page at that address, with all pictures."""
    with sync_playwright() as playwright:
        path = shutil.which("chromium") or playwright.chromium.executable_path
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        page = browser.new_page(
            viewport={"width": WINDOW[0], "height": WINDOW[1]}, color_scheme=theme
        )
        page.set_default_timeout(1000 * PATIENCE_S)
        page.goto(url)
        page.locator("[data-light]").first.wait_for()
        load(page)
        yield Hand(page)
        browser.close()


def main() -> None:
    """Record them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--port", type=int, default=8431)
    pictures = (
        "painting",
        "views",
        "layers",
        "selection",
        "lamps",
        "sky",
        "planes",
        "lights",
        "reference",
        "looks",
        "panels",
    )
    parser.add_argument("--only", choices=pictures)
    asked = parser.parse_args()
    if asked.only in (None, "lights"):
        with painter("gallery", asked.spp, asked.port) as url, using(url) as hand:
            moving_lights(hand)
        _write(hand, HERE / "lights.webp")
    if asked.only in (None, "views"):
        seats = ("--sensor=balcony", "--sensor=box", "--resolution=1/2")
        with painter("stage", asked.spp, asked.port, *seats) as url, using(url) as hand:
            from_two_seats(hand)
            hand.page.screenshot(path=HERE / "painter-views.jpg", type="jpeg", quality=88)
    if asked.only in (None, "lamps"):
        with painter("gallery", asked.spp, asked.port) as url, using(url) as hand:
            many_lamps(hand)
            hand.page.screenshot(path=HERE / "painter-lamps.jpg", type="jpeg", quality=88)
    if asked.only in (None, "sky"):
        with painter("table", asked.spp, asked.port) as url, using(url) as hand:
            painted_sky(hand)
            hand.page.screenshot(path=HERE / "painter-sky.jpg", type="jpeg", quality=88)
    if asked.only in (None, "planes"):
        planes = f"--planes={SCENES / 'office/office.planes.toml'}"
        with painter("office/office.xml", asked.spp, asked.port, planes) as url, using(url) as hand:
            lux_on_desks(hand)
            hand.page.screenshot(path=HERE / "painter-planes.jpg", type="jpeg", quality=88)
    if asked.only in (None, "reference"):
        with painter("gallery", asked.spp, asked.port) as url, using(url) as hand:
            page = hand.page
            like_a_reference(hand)
            page.screenshot(path=HERE / "painter-reference.jpg", type="jpeg", quality=88)
            page.get_by_role("button", name="Presets", exact=True).click()
            page.wait_for_function(ARE_PICTURES_DRAWN)
            page.wait_for_timeout(1000)
            page.screenshot(path=HERE / "painter-presets.jpg", type="jpeg", quality=88)
            page.keyboard.press("Escape")
            page.get_by_role("button", name="Colour", exact=True).last.click()
            page.get_by_role("button", name="History", exact=True).click()
            keep_looks(hand)
            for title in ("Layers", "Lights"):  # there is room for the history then
                page.locator(".fold-head button", has_text=title).first.click()
            page.mouse.move(5, 5)
            page.wait_for_timeout(1000)
            page.screenshot(path=HERE / "painter-history.jpg", type="jpeg", quality=88)
            page.get_by_role("button", name="All looks").click()
            page.wait_for_timeout(2000)
            page.screenshot(path=HERE / "painter-looks.jpg", type="jpeg", quality=88)
    if asked.only in (None, "looks"):
        with painter("gallery", asked.spp, asked.port) as url, using(url, "light") as hand:
            looks_beside(hand)
            hand.page.screenshot(path=HERE / "painter-side-by-side.jpg", type="jpeg", quality=88)
    if asked.only in (None, "panels"):
        with painter("gallery", asked.spp, asked.port) as url, using(url, "light") as hand:
            for name in panels(hand):
                hand.page.screenshot(path=HERE / f"painter-{name}.jpg", type="jpeg", quality=88)
    if asked.only in (None, "layers"):
        with painter("gallery", asked.spp, asked.port) as url, using(url) as hand:
            layered(hand)
            hand.page.screenshot(path=HERE / "painter-layers.jpg", type="jpeg", quality=88)
    if asked.only in (None, "selection"):
        with painter("gallery", asked.spp, asked.port) as url, using(url) as hand:
            selected(hand)
            hand.page.screenshot(path=HERE / "painter-selection.jpg", type="jpeg", quality=88)
    if asked.only in (None, "painting"):
        with painter("gallery", asked.spp, asked.port) as url, using(url) as hand:
            session(hand)
            hand.page.screenshot(path=HERE / "painter.jpg", type="jpeg", quality=88)
        _write(hand, HERE / "painting.webp")


def _write(hand: Hand, path: Path) -> None:
    first, *others = (frame.resize(SIZE, Image.Resampling.LANCZOS) for frame in hand.frames)
    first.save(
        path,
        save_all=True,
        append_images=others,
        duration=hand.times,
        loop=0,
        quality=60,
        method=4,
    )
    print(f"{len(hand.frames)} frames, {path.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
