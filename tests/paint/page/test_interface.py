"""The interface in a browser: every control says what it does, by mouse, keys and touch.

Session and picture engine are made up (`fake/`): here it counts what the interface sends to them.
"""

from collections.abc import Iterator
from typing import Any

import pytest


class Painter:
    """A page, and what a person does on it."""

    def __init__(self, page: Any) -> None:
        self.page = page

    def said(self, kind: str) -> list[dict[str, Any]]:
        """What was sent to the session, of a kind, once all is still."""
        self.still()
        return [one for one in self.page.evaluate("() => window.host.said") if one["kind"] == kind]

    def still(self) -> None:
        """Wait until all is answered, and shown."""
        self.page.evaluate(
            "async () => { do { await new Promise((done) => setTimeout(done, 20)); }"
            " while (window.host.busy); }"
        )

    def calls(self, name: str) -> list[Any]:
        """What the engine was asked to do."""
        calls = self.page.evaluate("() => window.engine.calls")
        return [call for call in calls if call[0] == name]

    def ui(self, key: str) -> Any:
        return self.page.evaluate("(key) => window.painter.store.value[key]", key)

    def button(self, name: str, **about: Any) -> Any:
        return self.page.get_by_role("button", name=name, **about).first

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

    def place(self) -> tuple[float, float]:
        box = self.page.locator(".stage").bounding_box()
        pane = self.page.evaluate("() => window.engine.panes()[0]")
        return (
            box["x"] + pane["x"] + 0.4 * pane["width"],
            box["y"] + pane["y"] + 0.5 * pane["height"],
        )

    def tell(self, **message: Any) -> None:
        self.page.evaluate("(message) => window.host.tell(message)", message)
        self.still()


@pytest.fixture
def opened(browser: Any, site: Any) -> Iterator[Any]:
    """Opens painters. No test leaves an error on the console, or one that nobody caught."""
    contexts, errors = [], []

    def open_painter(query: str = "", init: str = "", **about: Any) -> Painter:
        context = browser.new_context(**{"viewport": {"width": 1280, "height": 720}, **about})
        contexts.append(context)
        context.set_default_timeout(5000)
        page = context.new_page()
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on(
            "console",
            lambda said: errors.append(said.text) if said.type in ("error", "warning") else None,
        )
        if init:
            page.add_init_script(init)
        page.goto(f"{site.url}/fake/index.html?size=48x27&{query}")
        page.wait_for_selector(".lightpaint .tag")
        return Painter(page)

    yield open_painter
    for context in contexts:
        context.close()
    assert not errors


@pytest.fixture
def painter(opened: Any) -> Painter:
    return opened()


def test_a_stroke_goes_to_the_engine_and_the_hint_goes_away(opened: Any) -> None:
    painter = opened("first")
    assert painter.page.get_by_text("Paint how it should look").is_visible()
    assert painter.page.get_by_text("You can paint already").is_visible()
    painter.stroke()
    assert [call[1] for call in painter.calls("begin")] == ["brush"]
    assert painter.calls("end")
    assert painter.said("paint")[-1]["done"] is True
    assert not painter.page.get_by_text("Paint how it should look").is_visible()
    assert painter.page.get_by_text("Close to what was painted").is_visible()


def test_keys_of_paint_programs(painter: Painter) -> None:
    press = painter.page.keyboard.press
    tools = {"e": "eraser", "w": "weight", "i": "pick", "g": "fill", "l": "line", "a": "ask"}
    for key, tool in {**tools, "b": "brush"}.items():
        press(key)
        assert painter.ui("tool") == tool
    size, hardness = painter.ui("size"), painter.ui("hardness")
    press("]")
    assert painter.ui("size") > size
    press("[")
    press("[")
    assert painter.ui("size") < size
    press("Shift+}")
    assert painter.ui("hardness") > hardness
    press("3")
    assert painter.ui("flow") == 0.3
    press("0")
    assert painter.ui("flow") == 1
    first, second = painter.ui("colour"), painter.ui("second")["colour"]
    press("x")
    assert (painter.ui("colour"), painter.ui("second")["colour"]) == (second, first)
    press("Control+z")
    press("Control+Shift+Z")
    assert painter.said("undo")
    assert painter.said("redo")
    for layout in ("wipe", "blink", "side"):
        press("v")
        assert painter.ui("show")["layout"] == layout
    press("c")
    press("o")
    press(".")
    show = painter.ui("show")
    assert (show["clean"], show["overlay"], show["stops"]) == (False, "missed", 0.5)
    press("+")
    assert painter.ui("show")["zoom"] > 1
    press("f")
    assert painter.ui("show")["zoom"] == 1


def test_every_key_of_the_overlay_is_there(painter: Painter) -> None:
    painter.page.keyboard.press("?")
    dialog = painter.page.get_by_role("dialog", name="Keys")
    dialog.wait_for()
    assert dialog.locator("kbd").count() > 40
    painter.page.keyboard.press("e")  # goes nowhere while a window is open
    assert painter.ui("tool") == "brush"
    painter.page.keyboard.press("Escape")
    assert not dialog.is_visible()


def test_mouse_with_modifiers(painter: Painter) -> None:
    before = painter.ui("colour")
    painter.stroke(modifiers="Alt")
    assert not painter.calls("begin")
    assert painter.ui("colour") != before
    painter.stroke()
    painter.page.keyboard.down("Shift")
    x, y = painter.place()
    painter.page.mouse.click(x + 40, y + 40)
    painter.page.keyboard.up("Shift")
    assert len(painter.calls("line")) == 1
    painter.page.mouse.move(x, y)
    painter.stroke(modifiers="Space")
    assert painter.ui("show")["pan"][0] < 0
    assert len(painter.calls("begin")) == 1
    painter.page.keyboard.down("Control")
    painter.page.mouse.wheel(0, -240)
    painter.page.keyboard.up("Control")
    painter.still()
    assert painter.ui("show")["zoom"] == pytest.approx(2, rel=1e-6)


def test_escape_leaves_a_stroke(painter: Painter) -> None:
    x, y = painter.place()
    painter.page.mouse.move(x, y)
    painter.page.mouse.down()
    painter.page.mouse.move(x + 30, y)
    painter.page.keyboard.press("Escape")
    painter.page.mouse.up()
    assert painter.calls("cancel")
    assert not painter.calls("end")
    assert painter.said("drop")


def test_one_finger_paints_and_two_move_and_zoom(opened: Any) -> None:
    size = {"width": 1024, "height": 768}
    painter = opened(viewport=size, has_touch=True, is_mobile=True)
    touch = painter.page.context.new_cdp_session(painter.page)
    x, y = painter.place()

    def send(kind: str, *points: tuple[float, float]) -> None:
        made = [{"x": a, "y": b, "id": k} for k, (a, b) in enumerate(points)]
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": made})

    send("touchStart", (x, y))
    send("touchMove", (x + 20, y))
    send("touchMove", (x + 40, y))
    send("touchEnd")
    painter.still()
    assert len(painter.calls("begin")) == len(painter.calls("end")) == 1
    send("touchStart", (x, y))
    send("touchStart", (x, y), (x + 50, y))
    send("touchMove", (x - 25, y), (x + 75, y))
    send("touchEnd")
    painter.still()
    assert painter.ui("show")["zoom"] == pytest.approx(2, rel=0.1)
    assert painter.calls("cancel")  # of what the first finger had begun
    assert len(painter.calls("end")) == 1


def test_the_colour_panel(painter: Painter) -> None:
    painter.type("Hex", "#336699")
    blue = painter.ui("colour")
    assert blue == pytest.approx([0.0331, 0.1329, 0.3185], abs=1e-4)  # IEC 61966-2-1 by hand
    painter.button("RGB").click()
    painter.type("Red", "255")
    assert painter.ui("colour") == pytest.approx([1, *blue[1:]])
    painter.button("HSV", exact=True).click()
    painter.type("Saturation", "0")
    assert len({round(x, 9) for x in painter.ui("colour")}) == 1
    painter.button("White", exact=True).click()
    painter.type("Kelvin", "6504")
    painter.type("Green", "10")
    rgb = painter.ui("colour")
    assert rgb[1] == max(rgb)  # greener than daylight, in which green is not the largest
    painter.type("Brightness", "2")
    assert painter.ui("stops") == 2
    painter.button("2700 K").click()
    warm = painter.ui("colour")
    assert warm[0] > warm[1] > warm[2]
    painter.stroke()
    assert painter.page.get_by_role("group", name="Used lately").get_by_role("button").count() == 1
    painter.button("Look", exact=True).click()
    assert painter.ui("as") == "look"


def test_asking_in_numbers(painter: Painter) -> None:
    painter.page.keyboard.press("a")
    painter.choose("Where", "3")
    painter.type("Brighter", "-1.5")
    painter.type("Warmer", "40")
    painter.button("Ask for it").click()
    assert painter.calls("ask")[-1][1] == {"stops": -1.5, "mired": 40, "object": 3}
    painter.stroke()
    assert painter.calls("begin")[-1][1] == "ask"


def test_names_from_files_are_text(painter: Painter) -> None:
    painter.page.keyboard.press("a")
    assert "blue <b>ball</b>" in painter.page.get_by_role("combobox", name="Where").inner_text()
    painter.tell(kind="say", text="<img src=x>", tone="info")
    assert painter.page.get_by_text("<img src=x>").is_visible()
    assert painter.page.locator(".toasts img").count() == 0


def test_a_light_is_moved_by_hand_and_freed(painter: Painter) -> None:
    painter.slide("key, stops from now", "ArrowRight", 20)
    asked = painter.said("ask")
    assert asked[-1]["light"] == 0
    assert asked[-1]["done"] is True
    present = painter.page.evaluate("() => window.painter.store.value.lights[0].present")
    lock = asked[-1]["asked"]["lock"]
    assert lock == pytest.approx([x * 2 for x in present], rel=1e-6)  # 20 steps of a twentieth
    painter.button("Let the solve have key again").click()
    assert painter.said("ask")[-1]["asked"] == {}
    painter.slide("key, stops from now", "Home")
    assert painter.said("ask")[-1]["asked"] == {"lock": [0, 0, 0]}


def test_an_answer_to_what_was_undone_says_nothing(painter: Painter) -> None:
    asked, history = {"key": {"lock": 1}}, {"undo": ["brush"], "redo": []}
    painter.tell(kind="answer", version=6, asked=asked, history=history)
    assert (painter.ui("asked"), painter.ui("history")) == (asked, history)
    undone = {"undo": [], "redo": ["brush"]}
    painter.tell(kind="patch", version=7, asked={}, history=undone)
    painter.tell(kind="answer", version=6, exact=True, asked=asked, history=history, headline="Old")
    assert (painter.ui("asked"), painter.ui("history")) == ({}, undone)
    painter.page.evaluate("() => host.tell({ ...host.state(), headline: '' })")  # counts anew
    painter.tell(kind="answer", version=1, asked=asked, history=history)
    assert (painter.ui("asked"), painter.ui("history")) == (asked, history)


@pytest.mark.parametrize("way", ["off", "slider"])
def test_what_was_asked_of_a_light_is_known_until_it_is_free(painter: Painter, way: str) -> None:
    """Also where an answer of before comes while the session has not heard of the hand."""
    limits = {"limits": {"max": "150%"}}
    painter.page.evaluate(
        """async ([limits, way]) => {
          const { session } = painter;
          await session.ask(0, limits);
          const asked = way === 'off' ? session.turn(0, true) : session.hold(0, [1, 1, 1], true);
          host.tell({ kind: 'answer', exact: true, asked: { key: limits }, arrays: {} });
          await asked;
        }""",
        [limits, way],
    )
    painter.still()
    painter.page.evaluate("() => painter.session.release(0)")
    assert painter.said("ask")[-1]["asked"] == limits


def test_what_a_light_may_do(painter: Painter) -> None:
    page = painter.page
    page.get_by_role("button", name="key", exact=True).click()
    painter.type("At most", "150")
    assert painter.said("ask")[-1]["asked"] == {"limits": {"max": "150%"}}
    painter.type("At least", "20")
    assert painter.said("ask")[-1]["asked"] == {"limits": {"min": "20%", "max": "150%"}}
    painter.choose("Colour", "kelvin")
    painter.type("From", "3000")
    asked = painter.said("ask")[-1]["asked"]
    assert asked == {"limits": {"min": "20%", "max": "150%"}, "kelvin": [3000, 6500]}
    panel = page.get_by_role("group", name="What the solve may do with key")
    panel.get_by_role("button", name="Off", exact=True).click()
    assert painter.said("ask")[-1]["asked"] == {"off": True}
    panel.get_by_role("button", name="Free", exact=True).click()
    assert painter.said("ask")[-1]["asked"] == asked  # as it was before it was off
    painter.choose("Colour", "color")
    painter.type("Hex or kelvin", "3200K")
    assert painter.said("ask")[-1]["asked"]["color"] == "3200K"
    painter.choose("Colour", "primaries")
    assert len(painter.said("ask")[-1]["asked"]["primaries"]) == 3
    panel.get_by_role("button", name="As now", exact=True).click()
    assert painter.said("ask")[-1]["asked"] == {"lock": True}
    painter.choose("On one dimmer with", "cove")
    assert painter.said("tie")[-1]["ties"] == [["key", "cove"]]
    group = painter.page.get_by_role("group", name="key and cove, on one dimmer")
    assert group.locator(".light").count() == 2
    group.get_by_role("button", name="key and cove, on one dimmer").first.click()  # it folds
    assert group.locator(".light").count() == 0
    group.get_by_role("button", name="key and cove, on one dimmer").first.click()
    painter.button("Untie").click()
    assert painter.said("tie")[-1]["ties"] == []


def test_solo_and_mute_ask_nothing_of_the_solve(painter: Painter) -> None:
    painter.button("Solo: show pendant").click()
    assert painter.page.evaluate("() => window.engine.shown.gains") == [k == 2 for k in range(7)]
    painter.button("Show all").click()
    painter.button("Mute: show the picture without key").click()
    assert painter.page.evaluate("() => window.engine.shown.gains") == [k != 0 for k in range(7)]
    assert not painter.said("ask")
    painter.page.locator(".light-thumb").nth(1).hover()
    painter.still()
    shown = painter.page.evaluate("() => window.engine.shown")
    assert shown["right"] == "other"
    assert [max(rgb) > 0 for rgb in shown["other"]] == [k == 1 for k in range(7)]


@pytest.mark.parametrize("way", ["panels", "fold", "search"])
def test_a_light_is_shown_alone_until_its_row_is_gone(painter: Painter, way: str) -> None:
    painter.page.locator(".light-thumb").nth(1).hover()
    painter.page.wait_for_function("() => engine.shown.right === 'other'")
    if way == "panels":
        painter.page.keyboard.press("p")
    elif way == "fold":
        painter.page.locator(".is-lights button").first.focus()
        painter.page.keyboard.press("Enter")
    else:
        painter.page.evaluate("() => painter.store.set({ search: 'key' })")
    painter.page.locator(".light").nth(1).wait_for(state="detached")
    painter.page.wait_for_function("() => engine.shown.right === 'solution'")


def test_space_is_not_held_in_a_window_that_is_left(painter: Painter) -> None:
    painter.page.mouse.move(*painter.place())
    painter.page.keyboard.down("Space")
    assert painter.page.locator(".stage.is-panning").count() == 1
    painter.page.evaluate("() => window.dispatchEvent(new Event('blur'))")
    assert painter.page.locator(".stage.is-panning").count() == 0
    painter.stroke()
    assert painter.calls("begin")


def test_what_is_under_the_pointer(painter: Painter) -> None:
    painter.page.mouse.move(*painter.place())
    painter.page.locator(".here", has_text="back wall").wait_for()
    assert sum(painter.ui("pointed")["shares"]) == pytest.approx(1, abs=1e-6)
    assert painter.page.locator(".share.is-here").count() == 7


def test_64_lights_are_found_sorted_and_folded(opened: Any) -> None:
    painter = opened("lights=64")
    rows = painter.page.locator(".light")
    assert rows.count() == 64
    painter.page.get_by_label("Search lights").fill("row b")
    assert rows.count() == 8
    painter.button("Row B", exact=False).click()
    assert rows.count() == 0
    painter.page.get_by_label("Search lights").fill("nothing such")
    assert painter.page.get_by_text("No light is called so").is_visible()
    painter.page.get_by_label("Search lights").fill("")
    painter.choose("Sort by", "share")
    names = [row.get_attribute("data-light") for row in rows.all()]
    shares = painter.page.evaluate(
        "() => Object.fromEntries(painter.store.value.lights.map((one, k) =>"
        " [one.name, painter.store.value.lit[k].share]))"
    )
    alone = [shares[name] for name in names[:3]]
    assert alone == sorted(alone, reverse=True)


def test_overlays_by_their_key_say_what_their_colours_mean(painter: Painter) -> None:
    legend, press = painter.page.locator(".legend"), painter.page.keyboard.press
    painter.page.locator(".stage").focus()
    assert legend.count() == 0
    press("o")
    assert "too dark" in legend.inner_text()
    press("o")  # asks for what it shows
    painter.page.get_by_text("Out of reach", exact=True).wait_for()
    asked = len(painter.said("explain"))
    assert asked == 1
    # An answer to an earlier painting is none.
    painter.tell(kind="explained", sentences=["Old"], view=0, is_old=True)
    painter.page.wait_for_function(
        "(asked) => host.said.filter(({ kind }) => kind === 'explain').length > asked", arg=asked
    )
    painter.page.get_by_text("Out of reach", exact=True).wait_for()
    assert len(painter.said("explain")) == asked + 1
    press("o")
    assert "grey" in legend.inner_text()
    press("o")
    assert "counts" in legend.inner_text()
    press("o")
    assert legend.count() == 0


def test_truth(painter: Painter) -> None:
    how = painter.page.locator(".answer").get_by_role("button", name="How true?")
    box = how.bounding_box()
    how.click()
    assert how.bounding_box() == box  # or Keep look, and its tip, would be under the pointer
    assert how.get_attribute("aria-pressed") == "true"
    painter.button("False colour").click()
    assert painter.ui("show")["overlay"] == "falsecolor"
    painter.button("Out of reach").click()  # asks for what it shows
    assert painter.said("explain")
    assert painter.page.get_by_text("The cove is at its limit").is_visible()
    painter.button("Verify").click()
    assert painter.said("verify")[-1]["run"] is True
    bar = painter.page.get_by_role("progressbar", name="Verifying")
    painter.tell(kind="progress", what="verify", done=5, total=16, unit="passes")
    assert bar.get_attribute("aria-valuenow") == "5"
    painter.button("Stop the render").click()
    assert painter.said("verify")[-1]["run"] is False
    painter.tell(kind="verified", agrees=True, text="The render agrees.")
    painter.button("Answer | Render").click()
    show = painter.ui("show")
    assert (show["left"], show["right"], show["layout"]) == ("solution", "verified", "wipe")
    painter.slide("Wipe", "ArrowRight")
    assert painter.ui("show")["wipe"] == pytest.approx(0.52)


def test_how_pictures_are_shown(painter: Painter) -> None:
    painter.choose("Compare", "present solution")
    painter.choose("View", "agx")
    painter.type("Exposure", "1.5")
    painter.page.get_by_label("Clean").uncheck()
    show = painter.page.evaluate("() => window.engine.shown")
    assert (show["left"], show["transform"], show["stops"]) == ("present", "agx", 1.5)
    assert show["clean"] is False
    assert not painter.said("set")  # for the eye only


def test_looks(painter: Painter) -> None:
    painter.button("Keep look").click()
    painter.stroke()
    painter.page.keyboard.press("Control+s")
    assert [one["name"] for one in painter.said("save_look")] == ["Look 1", "Look 2"]
    painter.button("Look 2", exact=True).click()
    painter.page.get_by_label("Name of Look 2").fill("Dawn")
    painter.page.get_by_label("Name of Look 2").press("Enter")
    assert painter.said("rename_look")[-1] == {"kind": "rename_look", "look": 2, "name": "Dawn"}
    painter.button("Go on from Look 1").click()
    assert painter.said("load_look")[-1]["look"] == 1
    painter.button("Compare looks").click()
    painter.type("Between", "25")
    one, two = (look["weights"] for look in painter.ui("looks"))
    shown = painter.page.evaluate("() => window.engine.shown")
    assert shown["instead"] == one
    between = [0.75 * a + 0.25 * b for a, b in zip(one[0], two[0], strict=True)]
    assert shown["other"][0] == pytest.approx(between)
    painter.stroke()
    assert painter.page.get_by_text("The painting is not shown").is_visible()
    assert len(painter.calls("begin")) == 1  # the one before
    painter.button("Back to the painting").click()
    assert painter.ui("show")["left"] == "painting"
    painter.page.locator(".look").first.hover()
    painter.button("Duplicate Look 1").click()
    painter.button("Delete Look 1", exact=True).click()
    assert not painter.said("drop_look")  # asks once more
    painter.button("Delete Look 1: press again").click()
    assert painter.said("drop_look")[-1]["look"] == 1
    assert painter.said("copy_look")[-1]["look"] == 1


@pytest.mark.parametrize("way", ["deleted", "elsewhere"])
def test_looks_are_compared_while_both_are_there(painter: Painter, way: str) -> None:
    for _ in range(3):
        painter.page.keyboard.press("Control+s")
        painter.still()
    painter.choose("Second look", "3")
    assert painter.ui("mix") == {"a": 1, "b": 3, "share": 1}
    if way == "deleted":
        painter.page.locator(".look").first.hover()
        painter.button("Delete Look 1", exact=True).click()
        painter.button("Delete Look 1: press again").click()
        assert painter.said("drop_look")
    else:
        painter.page.evaluate("() => { host.drop_look({ look: 1 }); host.tell(host.state()); }")
    painter.still()
    show = painter.page.evaluate("() => engine.shown")
    assert [show[name] for name in ("left", "right", "instead")] == ["painting", "solution", None]
    chosen = [
        painter.page.get_by_role("combobox", name=name).input_value()
        for name in ("First look", "Second look", "Compare")
    ]
    assert chosen == ["2", "3", "painting solution"]
    painter.stroke()
    assert painter.calls("begin")
    painter.button("Compare looks").click()
    painter.page.evaluate("() => painter.session.send('drop_look', { look: 3 })")
    painter.still()
    assert painter.page.get_by_role("combobox", name="First look").count() == 0
    painter.stroke()
    assert len(painter.calls("begin")) == 2


def test_files_are_written_and_their_command_shown(painter: Painter) -> None:
    painter.button("Write files").click()
    painter.page.get_by_label("Report").uncheck()
    painter.button("Write", exact=True).click()
    assert painter.said("export")[-1]["what"] == ["target", "lighting", "relit"]
    assert painter.page.get_by_text("gallery-evening/lighting", exact=True).is_visible()
    assert painter.page.get_by_text("lightpaint solve gallery.xml").is_visible()


def test_settings(painter: Painter) -> None:
    painter.button("How the painting is answered").click()
    painter.button("Let go").click()
    assert painter.said("set")[-1]["values"]["hold"] == 0
    painter.button("Keep", exact=True).click()
    painter.type("Strength", "2.5")
    painter.button("As light").click()
    painter.button("Whites").click()
    painter.page.get_by_label("Take the paint at its word").check()
    painter.type("Use at most", "3")
    painter.type("Stay as now, strength", "0.01")
    asked: dict[str, Any] = {}
    for said in painter.said("set"):
        asked |= said["values"]
    assert asked == {
        "hold": 2.5, "space": "linear", "colors": "white", "literal": True,
        "prefer_current": 0.01, "sparse": 3,
    }  # fmt: skip
    painter.type("Use at most", "")
    assert painter.said("set")[-1]["values"]["sparse"] is None


def test_what_fails_is_said_and_the_painter_lives(painter: Painter) -> None:
    painter.page.evaluate("() => { window.host.fails = 'the disk is full'; }")
    painter.button("Keep look").click()
    painter.page.get_by_text("the disk is full").wait_for()
    painter.button("Dismiss").click()
    assert not painter.page.get_by_text("the disk is full").is_visible()
    painter.button("Keep look").click()
    assert len(painter.said("save_look")) == 2


def test_a_session_that_is_lost_or_taken(painter: Painter) -> None:
    painter.tell(kind="connection", state="lost")
    assert painter.page.get_by_role("alert").get_by_text("connection is lost").is_visible()
    painter.tell(kind="connection", state="open")
    assert not painter.page.get_by_role("alert").is_visible()
    painter.tell(kind="closed", reason="taken", text="It is open on another page.")
    painter.stroke()
    assert not painter.calls("begin")  # who does not have it does not paint on it
    painter.button("Take over").click()
    assert painter.said("take_over")
    assert not painter.page.get_by_role("alert").is_visible()


#: Small pictures that are shown, and of those how many are there.
THUMBS = (
    "() => { const all = [...document.querySelectorAll('.lightpaint .thumb')];"
    " return [all.length, all.filter((one) => one.width > 1).length]; }"
)


def test_a_place_that_has_lost_the_painter_gets_its_pictures_when_it_has_it_again(
    opened: Any,
) -> None:
    """In a notebook it asks for them over the same line by which it is told of its loss."""
    painter = opened("model=taken&engine")
    take_over = painter.button("Take over")
    take_over.wait_for()
    painter.page.wait_for_timeout(100)
    assert painter.page.evaluate(THUMBS) == [7, 0]
    assert painter.ui("toasts") == []
    take_over.click()
    painter.page.wait_for_function(f"() => ({THUMBS})()[1] === 7")
    painter.page.wait_for_function(
        "() => engine.work.isReady && !engine.work.loader.missing().length"
    )
    painter.stroke()
    assert painter.said("paint")


def refuse(painter: Painter) -> None:
    """Have what is said next fail."""
    painter.page.evaluate("() => { host.fails = 'That cannot be done.'; }")


def test_what_is_refused_is_shown_no_longer(painter: Painter) -> None:
    """Nor does it go along with what is asked next."""
    painter.page.get_by_role("button", name="key", exact=True).click()
    painter.type("At least", "20")
    before = {name: painter.ui(name) for name in ("asked", "ties", "settings", "weights")}
    at_most = painter.page.get_by_role("textbox", name="At most")
    refuse(painter)
    painter.type("At most", "1e308")
    painter.still()
    assert at_most.input_value() == ""
    painter.choose("Colour", "kelvin")
    asked = {"limits": {"min": "20%"}, "kelvin": [2700, 6500]}
    assert painter.said("ask")[-1]["asked"] == asked
    refuse(painter)
    painter.choose("Colour", "any")
    painter.still()
    assert painter.ui("asked") == {"key": asked}
    before["asked"] = painter.ui("asked")
    for act in (
        lambda: painter.choose("On one dimmer with", "cove"),
        lambda: painter.page.evaluate("() => void painter.session.setting('sparse', 99)"),
        lambda: painter.page.evaluate("() => painter.session.hold(2, [9, 9, 9], true)"),
    ):
        refuse(painter)
        act()
        painter.still()
        assert {name: painter.ui(name) for name in before} == before


def test_what_is_refused_leaves_what_is_on_its_way(painter: Painter) -> None:
    painter.page.evaluate(
        """() => {
          const { session } = painter;
          host.fails = 'That cannot be done.';
          session.ask(0, { limits: { max: '1e308%' } });
          session.ask(1, { off: true });
        }"""
    )
    painter.still()
    assert painter.ui("asked") == {"window left": {"off": True}}


def test_a_number_is_taken_as_it_is_shown(painter: Painter) -> None:
    painter.button("How the painting is answered").click()
    painter.type("Use at most", "1.5")
    assert painter.said("set")[-1]["values"] == {"sparse": 2}
    assert painter.page.get_by_role("textbox", name="Use at most").input_value() == "2"


def alert(painter: Painter) -> str:
    """What has to be known now, or nothing."""
    return " ".join(painter.page.get_by_role("alert").all_inner_texts())


def test_a_kernel_that_does_not_answer_is_said_to_until_it_does(opened: Any) -> None:
    painter = opened("model")
    painter.page.clock.install()
    painter.page.evaluate("() => { model.isBusy = true; }")
    painter.stroke()
    painter.page.clock.fast_forward(9_000)
    assert alert(painter) == ""
    painter.page.clock.fast_forward(1_100)
    assert "has not answered for 10 s" in alert(painter)
    painter.page.evaluate("() => { model.isBusy = false; return model.work(); }")
    assert painter.said("paint")[-1]["done"] is True
    assert alert(painter) == ""
    painter.page.clock.fast_forward(60_000)  # nothing is waited for
    assert alert(painter) == ""
    # Nor is what was lost on its way.
    painter.page.evaluate(
        """() => {
          model.isBusy = true;
          painter.session.host.fetch('thumb/0');
          model.waiting.length = 0;
          model.isBusy = false;
          return painter.session.host.fetch('thumb/0').then(() => {});
        }"""
    )
    painter.page.clock.fast_forward(60_000)
    assert alert(painter) == ""


@pytest.mark.parametrize("model", ["model", "model=taken"])
def test_a_kernel_that_has_ended_is_said_to_have(opened: Any, model: str) -> None:
    """Nothing is painted for nobody, and nobody is there to take it over from."""
    painter = opened(model)
    assert painter.page.get_by_role("button", name="Take over").count() == (model != "model")
    painter.page.evaluate("() => model.trigger('comm_live_update')")
    painter.still()
    assert "The kernel has ended: run the cell again" in alert(painter)
    assert painter.page.get_by_role("button", name="Take over").count() == 0
    painter.stroke()
    assert not painter.calls("begin")


def under_way(painter: Painter) -> set[str]:
    """What is shown to be: writing files, rendering, finding out why it is not closer."""
    ui = painter.page.evaluate("() => painter.store.value")
    flags = {"export": ui["isWriting"], "verify": ui["verifying"], "explain": ui["explaining"]}
    return {name for name, is_so in flags.items() if is_so}


def ask_for_all(painter: Painter) -> None:
    """Ask for everything that takes long."""
    painter.page.evaluate(
        "() => { const { session, store } = painter; store.set({ isWriting: true });"
        " session.send('export', { what: [] }); session.verify(); session.explain(); }"
    )
    painter.still()


LOST = "Promise.reject(new Error('there is no connection to the painter'))"


def test_what_could_not_be_asked_for_is_not_under_way(painter: Painter) -> None:
    painter.page.evaluate(f"() => {{ host.send = () => {LOST}; }}")
    ask_for_all(painter)
    assert under_way(painter) == set()
    painter.button("Write files").click()
    painter.button("Write", exact=True).click()
    assert painter.button("Write", exact=True).is_enabled()
    painter.page.keyboard.press("Escape")
    painter.button("How true?").click()
    painter.button("Out of reach").click()  # asks for what it shows, and once
    painter.page.wait_for_function("() => painter.store.value.show.overlay === null")


def test_what_fails_is_under_way_no_more_and_the_rest_is(painter: Painter) -> None:
    painter.page.evaluate("() => { host.send = () => new Promise(() => {}); }")
    ask_for_all(painter)
    assert under_way(painter) == {"export", "verify", "explain"}
    painter.tell(kind="say", text="The scene does not load.", tone="warn")
    painter.tell(kind="failed", text="A stroke is too large.")
    assert under_way(painter) == {"export", "verify", "explain"}
    for what in ("verify", "explain", "export"):
        assert what in under_way(painter)
        painter.tell(kind="say", text="It does not render.", tone="warn", what=what)
        assert what not in under_way(painter)


def test_what_ended_while_the_connection_was_lost_is_not_waited_for(painter: Painter) -> None:
    painter.page.evaluate("() => { host.send = () => new Promise(() => {}); }")
    ask_for_all(painter)
    painter.page.evaluate("() => host.tell(host.state())")  # another round of samples is there
    assert under_way(painter) == {"export", "verify", "explain"}
    painter.tell(kind="connection", state="lost")
    painter.page.evaluate("() => host.tell(host.state())")
    assert under_way(painter) == set()
    painter.tell(kind="progress", what="verification", done=5, total=16, unit="passes")
    assert under_way(painter) == {"verify"}  # which still goes on
    painter.tell(kind="closed", reason="taken", text="It is open on another page.")
    painter.page.evaluate("() => host.tell(host.state())")
    assert under_way(painter) == set()


def test_by_keyboard_alone(painter: Painter) -> None:
    """All controls are reached by Tab, each says what it is, and the pictures take paint."""
    reached = []
    for _ in range(110):
        painter.page.keyboard.press("Tab")
        reached.append(painter.page.evaluate("() => document.activeElement.outerHTML.slice(0, 90)"))
    controls = painter.page.evaluate(
        "() => [...document.querySelectorAll('.lightpaint :is(button, input, select)')]"
        ".filter((one) => !one.disabled && one.checkVisibility()).map((one) =>"
        " one.outerHTML.slice(0, 90))"
    )
    assert set(controls) <= set(reached)
    painter.page.locator(".stage").focus()
    for key in ("ArrowRight", "ArrowDown", "Enter"):
        painter.page.keyboard.press(key)
    assert len(painter.calls("begin")) == len(painter.calls("end")) == 1


def test_in_a_shadow_root_it_looks_the_same(opened: Any) -> None:
    plain, shadow = opened(), opened("shadow")
    width = "engine.element.getBoundingClientRect().width"
    wide = plain.page.evaluate(f"() => {width}")
    shadow.page.wait_for_function(f"(wide) => {width} === wide", arg=wide)
    shadow.stroke()
    assert shadow.calls("begin")
    shadow.page.keyboard.press("e")  # the pictures have the focus
    assert shadow.ui("tool") == "eraser"


def test_around_it_nothing_hears_its_keys(opened: Any) -> None:
    """In a notebook `B` makes a cell, Delete deletes the painter's own."""
    painter = opened("shadow")
    painter.page.evaluate(
        "() => { window.heard = [];"
        " window.addEventListener('keydown', (event) => window.heard.push(event.key)); }"
    )

    def heard(*keys: str) -> list[str]:
        painter.page.evaluate("() => { window.heard = []; }")
        for key in keys:
            painter.page.keyboard.press(key)
        return [key for key in painter.page.evaluate("() => window.heard") if key != "Control"]

    painter.stroke()  # the pictures have the focus
    assert heard("b", "Delete", "7", "d", "Escape", "Shift+Enter", "Alt+ArrowUp") == []
    assert heard("Control+z", "Control+s", "Control+x", "Control+v", "Control+Enter") == []
    assert heard("Control+k", "F2") == ["k", "F2"]
    painter.stroke(modifiers="Space")
    assert painter.ui("show")["pan"][0] < 0
    painter.page.get_by_role("textbox").first.focus()
    assert heard("f", "Delete", "Control+v") == ["v"]
    painter.page.locator(".top").click(position={"x": 3, "y": 3})  # nothing is there
    assert heard("e") == []
    assert painter.ui("tool") == "eraser"
    # Nor where what had the focus is gone.
    painter.page.evaluate("() => document.activeElement.shadowRoot.activeElement.blur()")
    assert painter.page.evaluate("() => document.activeElement === document.body")
    assert heard("b", "Delete", "?", "Escape", "Delete") == []
    assert painter.ui("tool") == "brush"
    painter.page.evaluate(
        "() => { const cell = document.body.appendChild(document.createElement('textarea'));"
        " cell.focus(); cell.blur(); }"
    )
    assert heard("e") == ["e"]
    assert painter.ui("tool") == "brush"


def test_a_window_is_open_before_the_next_key(opened: Any) -> None:
    """An Escape that comes at once closes it, and is not lost."""
    painter = opened()
    painter.page.evaluate(
        """() => {
          const press = (key) => document.body.dispatchEvent(
            new KeyboardEvent('keydown', { key, bubbles: true, cancelable: true }));
          press('?');
          window.isOpen = new Promise((tell) => setTimeout(() =>
            tell(document.querySelector('dialog')?.open ?? null)));
        }"""
    )
    assert painter.page.evaluate("() => window.isOpen") is True
    painter.page.keyboard.press("Escape")
    painter.page.wait_for_function("() => !document.querySelector('dialog')")


def test_windows_lie_over_it(opened: Any) -> None:
    """In a frame as high as all of a notebook; over the frame where hardly any of it is seen."""
    painter = opened("shadow", viewport={"width": 1280, "height": 5000})

    def shown(key: str, top: int) -> tuple[Any, Any]:
        painter.page.evaluate(
            "(top) => { document.getElementById('lightpaint').style = 'position: absolute;"
            " left: 50px; width: 800px; height: 560px; top: ' + top + 'px'; }",
            top,
        )
        painter.stroke()
        painter.page.keyboard.press(key)
        window = painter.page.get_by_role("dialog")
        boxes = window.bounding_box(), painter.page.locator(".lightpaint").bounding_box()
        painter.page.keyboard.press("Escape")
        assert not window.is_visible()
        return boxes

    window, around = shown("?", 4000)
    assert window["x"] > around["x"]
    assert window["x"] + window["width"] < around["x"] + around["width"]
    assert window["y"] > around["y"]
    assert window["y"] + window["height"] < around["y"] + around["height"]
    painter.page.set_viewport_size({"width": 1280, "height": 720})
    window, around = shown("?", 500)
    assert 0 < window["y"] < window["y"] + window["height"] < 720
    assert window["height"] > 300


def test_a_space_is_typed_beside_it(opened: Any) -> None:
    """Where the pointer rests on the pictures meanwhile."""
    painter = opened("shadow")
    painter.page.evaluate(
        "() => { const cell = document.createElement('p'); cell.contentEditable = 'true';"
        " document.body.append(cell); cell.focus(); }"
    )
    painter.page.mouse.move(*painter.place())
    painter.page.keyboard.type("a b")
    assert painter.page.locator("p[contenteditable]").inner_text() == "a b"


#: Windows, and columns of notebooks.
SIZES = [(1280, 720), (1920, 1080), (1024, 768), (900, 600)]
COLUMNS = [(970, 640), (780, 600), (760, 600), (690, 560), (584, 560), (480, 640)]
LOW = [(1280, 300), (970, 260), (780, 300), (690, 300), (584, 260), (480, 300)]

#: A long one.
SENTENCE = (
    "About half of the way, 46 %: brighter and redder light on the left is missing; what keeps it"
    " from coming closer is that no light reaches the floor there, and the cove is at its limit."
)


def cut_off(painter: Painter) -> list[str]:
    """What is wider, or higher, than what is seen of it."""
    names: list[str] = painter.page.evaluate(
        "() => ['.top', '.options', '.tools', '.side', '.answer', '.said', '.fold-body'].filter("
        "(name) => [...document.querySelectorAll(`.lightpaint ${name}`)].some((one) =>"
        " one.scrollWidth > one.clientWidth + 1 || (!['.side', '.fold-body'].includes(name) &&"
        " one.scrollHeight > one.clientHeight + 1)))"
    )
    return names


@pytest.mark.parametrize("size", SIZES + COLUMNS + LOW)
def test_nothing_is_cut_off(opened: Any, size: tuple[int, int]) -> None:
    painter = opened("lights=12", viewport={"width": size[0], "height": size[1]})
    painter.tell(kind="answer", version=2, exact=True, headline=SENTENCE, lights=[], delta_e=11.2)
    for key in "bwa":
        painter.page.keyboard.press(key)
        assert cut_off(painter) == []


@pytest.mark.parametrize("size", LOW)
def test_of_a_low_painter_the_sentence_comes_first(opened: Any, size: tuple[int, int]) -> None:
    """Nothing that is needed lies below what is seen, and panels scroll."""
    painter = opened("lights=12", viewport={"width": size[0], "height": size[1]})
    stage = painter.page.locator(".stage").bounding_box()
    said = painter.page.locator(".said").bounding_box()
    assert said["y"] + said["height"] <= stage["y"]
    assert stage["height"] > 60
    for name in (".stage", ".tools .two-colours", ".answer button", ".options input >> nth=-1"):
        box = painter.page.locator(name).first.bounding_box()
        assert box["y"] + box["height"] <= size[1]
    assert not painter.page.locator(".here").is_visible()
    if not painter.ui("side"):
        painter.button("Panels").click()
    light = painter.page.locator(".light").last
    light.scroll_into_view_if_needed()
    assert light.bounding_box()["y"] < size[1]


@pytest.mark.parametrize("size", [(1280, 720), (690, 560), (690, 300)])
def test_what_has_to_be_known_does_not_lie_over_a_name(opened: Any, size: tuple[int, int]) -> None:
    painter = opened(viewport={"width": size[0], "height": size[1]})
    painter.page.keyboard.press("Control+s")
    painter.tell(kind="closed", reason="taken", text="The painter is open at another place.")
    top = painter.page.locator(".banner").bounding_box()["y"]
    name = painter.page.locator(".tag", has_text="Painting").bounding_box()
    assert name["y"] + name["height"] <= top


def test_panels_leave_the_pictures_of_a_narrow_column_their_room(opened: Any) -> None:
    painter = opened(viewport={"width": 690, "height": 560})
    stage, side = painter.page.locator(".stage"), painter.page.locator(".side")
    width = stage.bounding_box()["width"]
    assert side.count() == 0
    assert width > 600
    painter.button("Panels").click()
    assert side.is_visible()
    assert stage.bounding_box()["width"] == width  # they lie over them while they are wanted
    painter.button("Panels").click()
    assert side.count() == 0
    for room, count in ((1000, 1), (690, 0)):
        painter.page.set_viewport_size({"width": room, "height": 560})
        painter.page.wait_for_function(
            "(count) => document.querySelectorAll('.lightpaint .side').length === count", arg=count
        )


@pytest.mark.parametrize("state", ["first", "busy", "keys", "export", "settings"])
def test_axe_finds_nothing(opened: Any, axe: str, state: str) -> None:
    painter = opened("first&lights=12", init=axe)
    if state == "busy":
        painter.button("How true?").click()
        painter.button("False colour").click()
        painter.button("Keep look").click()
        painter.button("Keep look").click()
        painter.page.get_by_role("button", name="key", exact=True).click()
        painter.button("Solo: show pendant").click()
        painter.page.keyboard.press("v")
        painter.tell(kind="closed", reason="taken", text="It is open on another page.")
        painter.tell(kind="say", text="Something is so.", tone="warn")
        painter.page.get_by_text("Something is so.").wait_for()
    elif state != "first":
        painter.page.evaluate("(dialog) => painter.store.set({ dialog })", state)
    painter.page.evaluate(
        """async () => {  // toasts have faded in
          const moving = document.querySelector('.toasts').getAnimations({ subtree: true });
          await Promise.all(moving.map(({ finished }) => finished));
        }"""
    )
    found = painter.page.evaluate("() => axe.run(document.querySelector('.lightpaint'))")
    assert [(one["id"], [n["html"] for n in one["nodes"]]) for one in found["violations"]] == []
