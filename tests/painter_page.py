"""A painter's page over a session and an engine that are made up (`paint/page/fake/`), and what a
person does on it: tests count what the interface sends to them.
"""

from typing import Any


class Painter:
    """A page, and what a person does on it."""

    def __init__(self, page: Any) -> None:
        self.page = page

    def requests(self, kind: str) -> list[dict[str, Any]]:
        """Return the requests of a kind that were sent to the session, once all is still."""
        self.still()
        return [
            one for one in self.page.evaluate("() => window.host.requests") if one["kind"] == kind
        ]

    def still(self) -> None:
        """Wait until all is answered, and shown: what a change brings may come a frame after it."""
        self.page.evaluate(
            """async () => {
              const frame = () => new Promise((done) => requestAnimationFrame(done));
              do {
                window.painter.store.flush(); // what waits for the next change
                for (let k = 0; k < 2; k += 1) await frame();
                await new Promise((done) => setTimeout(done, 20));
              } while (window.host.busy);
            }"""
        )

    def calls(self, name: str) -> list[Any]:
        """What the engine was asked to do."""
        calls = self.page.evaluate("() => window.engine.calls")
        return [call for call in calls if call[0] == name]

    def ui(self, key: str) -> Any:
        return self.page.evaluate("(key) => window.painter.store.value[key]", key)

    def button(self, name: str, **options: Any) -> Any:
        return self.page.get_by_role("button", name=name, **options).first

    def slide(self, label: str, presses: str, times: int = 1) -> None:
        slider = self.page.get_by_role("slider", name=label, exact=True).first
        slider.focus()
        for _ in range(times):
            slider.press(presses)

    def type(self, label: str, text: str) -> None:
        field = self.page.get_by_role("textbox", name=label, exact=True).first
        field.fill(text)
        field.press("Enter")

    def choose(self, label: str, value: str) -> None:
        self.page.get_by_role("combobox", name=label, exact=True).first.select_option(value)

    def stroke(self, *, modifiers: str = "", by: float = 80) -> None:
        """Drag over the middle of the painting."""
        x, y = self.place()
        if modifiers:
            self.page.keyboard.down(modifiers)
        self.page.mouse.move(x, y)
        self.page.mouse.down()
        self.page.mouse.move(x + by, y, steps=4)
        self.page.mouse.up()
        if modifiers:
            self.page.keyboard.up(modifiers)

    def give_up(self) -> None:
        """Begin a stroke, and press Escape before it is done."""
        x, y = self.place()
        self.page.mouse.move(x, y)
        self.page.mouse.down()
        self.page.mouse.move(x + 30, y)
        self.page.keyboard.press("Escape")
        self.page.mouse.up()

    def place(self, further: float = 0) -> tuple[float, float]:
        box = self.page.locator(".stage").bounding_box()
        pane = self.page.evaluate("() => window.engine.panes()[0]")
        return (
            box["x"] + pane["x"] + (0.4 + further) * pane["width"],
            box["y"] + pane["y"] + 0.5 * pane["height"],
        )

    def tell(self, **message: Any) -> None:
        self.page.evaluate("(message) => window.host.tell(message)", message)
        self.still()


class Finger:
    """One that goes over a page."""

    def __init__(self, page: Any) -> None:
        self.page = page
        self.session = page.context.new_cdp_session(page)

    def drag(self, *places: tuple[float, float]) -> None:
        """Come down at the first place, and lift at the last."""
        for k, (x, y) in enumerate(places):
            kind = "touchMove" if k else "touchStart"
            points = [{"x": x, "y": y, "id": 0}]
            self.session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
            self.page.wait_for_timeout(16)
        self.session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        self.page.wait_for_timeout(60)
