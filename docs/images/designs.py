"""Records three longer sessions in the painter, each the work of about an hour, and counts actions.

    pip install '.[test]'
    python docs/images/designs.py [--spp 64] [--port 8441] [--only NAME ...]

writes `design-NAME.webp` beside itself, the page after each action, and prints the actions with the
sentence that each session ended in:

    three-looks     the gallery from nothing to three looks: dusk, an opening, the night
    window-weaker   the next day: as yesterday, but the window weaker and the figure warmer
    second-person   somebody else goes on with it: sees how it came about, and makes a look of their
                    own

All three work on one session, each in a new page after the painter has been started again. An
action is one press, one drag, one key or one number that is typed. A basis is rendered once, and
kept where all bases are.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

from PIL import Image
from record import FRAME, HERE, SIZE, using
from record import painter as started
from tasks import AWAY, FIGURE, KNOT, VASE, Designer

#: Frames that a page is shown for after an action.
SHOWN = 14

#: Where the annex is seen, which has a window, as shares of the gallery's picture.
ANNEX = (0.655, 0.42)


def three_looks(designer: Designer) -> None:
    """Dusk, an opening and the night, each from the look of the scene."""
    preset(designer, "Golden hour")
    designer.number("Strength", 70)
    designer.key("a")
    designer.choose("Area", "Object")
    designer.ask("drag the annex up and left", ANNEX, 100, -40)
    save(designer, "Dusk")
    start_over(designer)
    preset(designer, "Gallery")
    designer.key("a")
    designer.ask("drag the knot up", KNOT, 60)
    designer.ask("drag the vase up and right", VASE, 50, 40)
    save(designer, "Opening")
    start_over(designer)
    preset(designer, "Moonlight")
    designer.key("a")
    designer.ask("drag the figure up and right", FIGURE, 70, 60)
    save(designer, "Night")
    designer.press("Load Dusk")


def window_weaker(designer: Designer) -> None:
    """As yesterday, but the window weaker: one wish of that look has less strength."""
    layer = designer.page.locator(".layer-name").first
    layer.click()
    designer.done("unfold the newest wish, the window in the annex")
    designer.number("Strength", 40)
    designer.key("a")
    designer.ask("drag the figure right", FIGURE, 0, 60)
    save(designer, "Dusk, softer")


def second_person(designer: Designer) -> None:
    """Looks at the way back and at all looks, and goes on from one of them."""
    fold(designer, "History")
    designer.page.locator(".steps button").nth(3).click()
    designer.done("click an earlier step")
    designer.key("Control+Shift+z")
    designer.key("Control+Shift+z")
    designer.key("Control+Shift+z")
    designer.press("All looks: pictures and lamps")
    designer.page.get_by_role("button", name="Load Opening", exact=True).last.click()
    designer.done("load Opening from the sheet")
    search = designer.page.get_by_role("searchbox", name="Search lights")
    search.fill("spot_*")
    designer.page.keyboard.press("Enter")
    designer.done("select spot_*")
    designer.number("Dim by", -0.5)
    save(designer, "Opening, calmer")
    designer.press("Compare looks")


def preset(designer: Designer, title: str) -> None:
    designer.press("Presets")
    designer.page.get_by_role("dialog").get_by_role("button", name=title).first.click()
    designer.done(f"preset {title}")


def save(designer: Designer, name: str) -> None:
    """Save a look, and name it."""
    page = designer.page
    designer.key("Control+s")
    page.locator(".look.is-current .look-name").click()
    page.locator("input.naming").fill(name)
    page.keyboard.press("Enter")
    designer.done(f"name it {name}")


def fold(designer: Designer, title: str) -> None:
    designer.page.get_by_role("button", name=title, exact=True).first.click()
    designer.done(f"unfold {title}")


def start_over(designer: Designer) -> None:
    page = designer.page
    if not page.get_by_role("button", name="Start over", exact=True).count():
        fold(designer, "History")
    designer.press("Start over")


#: What is done in one page after the other.
SESSIONS: dict[str, Callable[[Designer], None]] = {
    "three-looks": three_looks,
    "window-weaker": window_weaker,
    "second-person": second_person,
}


def main() -> None:
    """Work through the sessions."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--port", type=int, default=8441)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for name, work in SESSIONS.items():
            with ExitStack() as stack:
                url = stack.enter_context(
                    started("gallery", options.spp, options.port, folder=folder)
                )
                designer = Watched(stack.enter_context(using(url)))
                work(designer)
                designer.page.mouse.move(*AWAY)
                designer.hand.wait(0)
                designer.look()
                print(f"{name}: {len(designer.actions)} actions: {'; '.join(designer.actions)}")
                print(f"    {designer.sentence}", flush=True)
                designer.write(Path(HERE) / f"design-{name}.webp")


class Watched(Designer):
    """A designer whose page is seen after each action, and not in between."""

    def done(self, action: str) -> None:
        super().done(action)
        self.look()

    def look(self) -> None:
        self.hand.see(SHOWN)
        self.hand.frames, self.hand.times = self.hand.frames[-1:], self.hand.times[-1:]
        self.pages.append(self.hand.frames[0].resize(SIZE, Image.Resampling.LANCZOS))

    @property
    def pages(self) -> list[Image.Image]:
        self._pages: list[Image.Image] = getattr(self, "_pages", [])
        return self._pages

    def write(self, path: Path) -> None:
        first, *others = self.pages
        first.save(
            path,
            save_all=True,
            append_images=others,
            duration=SHOWN * FRAME,
            loop=0,
            quality=60,
            method=4,
        )
        print(f"    {len(self.pages)} pictures, {path.stat().st_size / 1e6:.1f} MB", flush=True)


if __name__ == "__main__":
    main()
