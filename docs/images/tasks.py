"""Records five jobs that a designer does in the painter, each in at most ten actions.

    pip install '.[test]'
    python docs/images/tasks.py [--spp 64] [--port 8437] [--only NAME ...]

writes `task-NAME.jpg` beside itself, the page when the job is done, and prints the actions with the
sentence that each ended in. An action is one press, one drag, one key or one number that is typed.
The painter's own server in folders that are removed; a basis is rendered once, and kept where all
bases are.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

from record import HERE, Hand, load, painter, using

#: Most actions that a job may take.
MOST = 10

#: Where things are in the gallery's picture, as shares of its width and height.
FIGURE, KNOT, VASE = (0.28, 0.59), (0.584, 0.5), (0.8, 0.58)
FIELD, LEFT_TIDE, RIGHT_TIDE = (0.45, 0.48), (0.06, 0.48), (0.16, 0.48)


class Designer:
    """Works in a page, and writes down each action."""

    def __init__(self, hand: Hand) -> None:
        self.hand, self.page = hand, hand.page
        self.actions: list[str] = []

    def done(self, action: str) -> None:
        """Count one action, and wait for what it leads to."""
        self.actions.append(action)
        self.hand.wait(0)

    def press(self, name: str) -> None:
        self.hand.press(name)
        self.done(f"press {name}")

    def key(self, keys: str) -> None:
        self.page.keyboard.press(keys)
        self.done(f"key {keys}")

    def number(self, label: str, value: float) -> None:
        field = self.page.get_by_role("textbox", name=label, exact=True).first
        field.fill(f"{value:g}")
        field.press("Tab")
        self.done(f"{label}: {value:g}")

    def choose(self, label: str, value: str) -> None:
        group = self.page.get_by_role("group", name=label, exact=True)
        group.get_by_role("button", name=value).click()
        self.done(f"{label}: {value}")

    def drag(self, what: str, *places: tuple[float, float]) -> None:
        self.hand.drag(*(self.hand.of_painting(*place) for place in places))
        self.done(what)

    def ask(self, what: str, place: tuple[float, float], up: float, right: float = 0) -> None:
        """Drag at a place by so many pixels."""
        x, y = self.hand.of_painting(*place)
        self.hand.drag((x, y), (x + right, y - up))
        self.done(what)

    def whole(self, stops: float, mired: float = 0) -> None:
        """Ask for all of the picture, in numbers."""
        if not self.page.get_by_role("button", name="Apply").count():
            self.key("a")
            self.press("By numbers")
        self.number("Brighter", stops)
        if mired:
            self.number("Warmer", mired)
        self.press("Apply")

    @property
    def sentence(self) -> str:
        return self.page.locator(".headline .said").inner_text().strip()


def sculptures(designer: Designer) -> None:
    """A warm evening, with light on the sculptures only."""
    designer.whole(-2.5)
    designer.choose("Area", "Object")
    for name, place in {"figure": FIGURE, "knot": KNOT, "vase": VASE}.items():
        designer.ask(f"drag {name} up and right", place, 130, 60)


def red_picture(designer: Designer) -> None:
    """The red picture alone, by five white lamps."""
    designer.whole(-4)
    designer.choose("Area", "Object")
    designer.ask("drag the red picture up", FIELD, 150)
    designer.press("Solve settings")
    designer.choose("Light colours", "White")
    designer.number("At most", 5)
    designer.key("Escape")


def moonlit(designer: Designer) -> None:
    """A moonlit stage from two seats, with a warm lantern."""
    designer.whole(-2, -60)
    designer.ask("drag the lantern up and right", (0.392, 0.7), 60, 120)
    designer.key("n")
    load(designer.page)
    designer.press("Apply")


def contradictory(designer: Designer) -> None:
    """One of two pictures under one lamp brighter, the other one darker."""
    designer.key("a")
    designer.choose("Area", "Object")
    designer.ask("drag the left picture up", LEFT_TIDE, 110)
    designer.ask("drag the right picture down", RIGHT_TIDE, -110)
    designer.press("Analysis")
    designer.press("Why not closer?")


def an_hour_ago(designer: Designer) -> None:
    """Three wishes that are kept as a look."""
    designer.key("a")
    designer.choose("Area", "Object")
    designer.ask("drag the figure up and right", FIGURE, 110, 50)
    designer.ask("drag the red picture down", FIELD, -80)
    designer.ask("drag the vase up", VASE, 100)
    designer.key("Control+s")


def an_hour_later(designer: Designer) -> None:
    """Two of them undone, and something else asked for."""
    designer.key("Control+z")
    designer.key("Control+z")
    designer.key("a")
    designer.ask("drag the knot up", KNOT, 100)


Job = Callable[[Designer], None]

#: Where the pointer outlines nothing, and no tip appears.
AWAY = (260, 20)

STAGE = ("--sensor=balcony", "--sensor=box", "--resolution=1/2")

#: Scene, more words for the command, and what is done in one page after the other.
JOBS: dict[str, tuple[str, tuple[str, ...], tuple[Job, ...]]] = {
    "sculptures": ("gallery", (), (sculptures,)),
    "red-picture": ("gallery", (), (red_picture,)),
    "moonlit-stage": ("stage", STAGE, (moonlit,)),
    "contradictory": ("gallery", (), (contradictory,)),
    "an-hour-later": ("gallery", (), (an_hour_ago, an_hour_later)),
}


def main() -> None:
    """Do the jobs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--port", type=int, default=8437)
    parser.add_argument("--only", nargs="+", choices=JOBS, default=list(JOBS))
    options = parser.parse_args()
    for name in options.only:
        scene, words, pages = JOBS[name]
        with tempfile.TemporaryDirectory() as folder:
            actions = []
            for job in pages:
                with ExitStack() as stack:
                    server = painter(scene, options.spp, options.port, *words, folder=folder)
                    designer = Designer(stack.enter_context(using(stack.enter_context(server))))
                    job(designer)
                    load(designer.page)  # samples that are still rendered
                    designer.page.mouse.move(*AWAY)
                    designer.hand.wait(0)
                    actions += designer.actions
                    sentence = designer.sentence
                    shot = Path(HERE) / f"task-{name}.jpg"
                    designer.page.screenshot(path=shot, type="jpeg", quality=85)
        print(f"{name}: {len(actions)} actions: {'; '.join(actions)}\n    {sentence}", flush=True)
        assert len(actions) <= MOST, name


if __name__ == "__main__":
    main()
