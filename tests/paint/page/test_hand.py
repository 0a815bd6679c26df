"""What the hand does on a painter's page: strokes, colours, what lies under the pointer."""

import re
from typing import Any

import pytest
from nightly import nightly
from painter_page import Painter


def test_a_stroke_goes_to_the_engine_and_the_hint_goes_away(new_painter: Any) -> None:
    painter = new_painter("first")
    assert painter.page.get_by_text("Paint how it should look").is_visible()
    assert painter.page.get_by_text("You can paint already").is_visible()
    painter.stroke()
    assert [call[1] for call in painter.calls("begin")] == ["brush"]
    assert painter.calls("end")
    assert painter.requests("paint")[-1]["is_final"] is True
    assert not painter.page.get_by_text("Paint how it should look").is_visible()
    assert painter.page.get_by_text("Close to what was painted").is_visible()


#: Moves the pointer, pressed, as browsers say before the next frame, and lets the stroke be sent.
MOVE_EARLY = """([clientX, clientY]) => {
  const event = { clientX, clientY, pointerId: 1, bubbles: true };
  engine.element.dispatchEvent(new PointerEvent('pointerrawupdate', event));
  engine.tell('send', {});
}"""


def test_a_stroke_follows_the_hand_between_frames(painter: Painter) -> None:
    """As soon as it is sent, and once."""
    (x, y), mouse = painter.place(), painter.page.mouse

    def moves() -> int:
        return len(painter.calls("move"))

    painter.page.evaluate(MOVE_EARLY, [x + 5, y])
    assert moves() == 0  # no stroke has begun
    mouse.move(x, y)
    mouse.down()
    begun = moves()
    painter.page.evaluate(MOVE_EARLY, [x + 20, y])
    assert moves() == begun + 1
    painter.page.evaluate("() => engine.tell('send', {})")
    assert moves() == begun + 1
    painter.page.evaluate(MOVE_EARLY.replace("engine.tell('send', {});", ""), [x + 40, y])
    mouse.up()
    painter.still()
    assert moves() == begun + 2
    assert painter.calls("end")


@pytest.mark.nightly
def test_keys_of_paint_programs(painter: Painter) -> None:
    press = painter.page.keyboard.press
    tools = {"e": "eraser", "w": "weight", "i": "pick", "g": "fill", "l": "line", "a": "adjust"}
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
    assert painter.requests("undo")
    assert painter.requests("redo")
    for layout in ("wipe", "blink", "inset", "side"):
        press("v")
        assert painter.ui("display")["layout"] == layout
    press("c")
    press("o")
    press(".")
    show = painter.ui("display")
    assert (show["clean"], show["overlay"], show["stops"]) == (False, "missed", 0.5)
    press("+")
    assert painter.ui("display")["zoom"] > 1
    press("f")
    assert painter.ui("display")["zoom"] == 1


@pytest.mark.nightly
def test_every_key_of_the_overlay_is_there(painter: Painter) -> None:
    painter.page.keyboard.press("?")
    dialog = painter.page.get_by_role("dialog", name="Keyboard shortcuts")
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
    assert painter.ui("display")["pan"][0] < 0
    assert len(painter.calls("begin")) == 1
    painter.page.keyboard.down("Control")
    painter.page.mouse.wheel(0, -240)
    painter.page.keyboard.up("Control")
    painter.still()
    assert painter.ui("display")["zoom"] == pytest.approx(2, rel=1e-6)


@pytest.mark.nightly
def test_escape_leaves_a_stroke(painter: Painter) -> None:
    painter.give_up()
    assert painter.calls("cancel")
    assert not painter.calls("end")
    assert painter.requests("drop_stroke")


@pytest.mark.nightly
def test_one_finger_paints_and_two_move_and_zoom(new_painter: Any) -> None:
    size = {"width": 1024, "height": 768}
    painter = new_painter(viewport=size, has_touch=True, is_mobile=True)
    touch = painter.page.context.new_cdp_session(painter.page)
    x, y = painter.place()

    def send(kind: str, *points: tuple[float, float]) -> None:
        touches = [{"x": a, "y": b, "id": k} for k, (a, b) in enumerate(points)]
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": touches})

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
    assert painter.ui("display")["zoom"] == pytest.approx(2, rel=0.1)
    assert painter.calls("cancel")  # of what the first finger had begun
    assert len(painter.calls("end")) == 1


#: Widths of the lines of a text.
LINE_WIDTHS = """(one) => {
  const range = document.createRange();
  range.selectNodeContents(one);
  return [...range.getClientRects()].map(({ width }) => width);
}"""


@pytest.mark.nightly
def test_hints_are_of_the_tool_and_of_fingers(new_painter: Any) -> None:
    painter = new_painter("first")
    hint, status = painter.page.locator(".hint"), painter.page.locator("#lp-status")
    assert "Shift-click" in status.text_content()
    for key, first in (
        ("a", "up brighter"),
        ("g", "an object in this picture"),
        ("l", "drag over this picture"),
        ("w", "Drag over it"),
        ("i", "Pick light"),
    ):
        painter.page.keyboard.press(key)
        painter.still()
        assert first in hint.inner_text()
        *lines, last = hint.locator("span").evaluate(LINE_WIDTHS)
        assert last > 0.4 * max([*lines, last])
    assert "Click" in status.text_content()
    tablet = new_painter(
        "first", viewport={"width": 1024, "height": 768}, has_touch=True, is_mobile=True
    )
    status = tablet.page.locator("#lp-status")
    for key, words in (("b", "Two fingers pan and zoom"), ("g", "Tap an"), ("i", "Tap either")):
        tablet.page.keyboard.press(key)
        tablet.still()
        assert words in status.text_content()
        assert "lick" not in status.text_content()


@pytest.mark.nightly
def test_lines_by_keys_and_no_ask(painter: Painter) -> None:
    painter.page.locator(".stage").focus()
    press = painter.page.keyboard.press
    for key in ("Shift+Enter", "ArrowRight", "ArrowDown", "Shift+Enter"):
        press(key)
    assert len(painter.calls("begin")) == 1  # there was none to go on from
    [line] = painter.calls("line")
    scale = painter.page.evaluate("() => window.engine.panes()[0].scale")
    start, end = line[1:3]
    way = [end[name] - start[name] for name in "xy"]
    assert way == pytest.approx([12 / scale, 12 / scale])
    press("a")
    press("Enter")
    assert "By numbers" in painter.ui("toasts")[-1]["text"]
    assert len(painter.calls("begin")) == 1


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
    wheel = painter.page.locator(".wheel").bounding_box()
    middle = wheel["x"] + wheel["width"] / 2, wheel["y"] + wheel["height"] / 2
    painter.page.mouse.move(*middle)
    painter.page.mouse.down()
    # A third of a turn clockwise from red, at the top, is green; further out than the rim is pure.
    painter.page.mouse.move(middle[0] + 3**0.5 * wheel["width"], middle[1] + wheel["height"])
    painter.page.mouse.up()
    red, green, blue = painter.ui("colour")
    assert (red, blue) == pytest.approx((0, 0), abs=1e-3 * green)
    painter.button("White", exact=True).click()
    painter.type("CCT", "6504")
    painter.type("Tint", "10")
    rgb = painter.ui("colour")
    assert rgb[1] == max(rgb)  # greener than daylight, in which green is not the largest
    painter.type("Brightness", "2")
    assert painter.ui("stops") == 2
    painter.button("2700 K").click()
    warm = painter.ui("colour")
    assert warm[0] > warm[1] > warm[2]
    below = painter.page.locator(".is-ask").bounding_box()
    painter.stroke()
    recent_colours = painter.page.get_by_role("group", name="Recent colours")
    assert recent_colours.get_by_role("button").count() == 1
    assert painter.page.locator(".is-ask").bounding_box() == below  # its room was there
    painter.button("Colour", exact=True).click()
    assert painter.ui("paintMode") == "colour"


@pytest.mark.nightly
def test_how_bright_a_colour_is_is_seen_and_said(painter: Painter) -> None:
    """On the patch, beside the colour itself; of what was used lately, in stops."""

    def patch() -> list[str]:
        styles: list[str] = painter.page.locator(".patch").evaluate(
            "(one) => ['--colour', '--shown'].map((name) => one.style.getPropertyValue(name))"
        )
        return styles

    painter.type("Hex", "#808080")
    assert patch() == ["#808080", "rgb(128 128 128)"]
    painter.type("Brightness", "1")  # 0.2159 of light twice, by IEC 61966-2-1
    assert patch() == ["#808080", "rgb(176 176 176)"]
    painter.stroke()
    painter.type("Exposure", "1")  # and as the pictures show it
    assert patch() == ["#808080", "rgb(239 239 239)"]
    painter.type("Brightness", "-2.5")
    painter.stroke()
    recent_colours = painter.page.get_by_role("group", name="Recent colours").get_by_role("button")
    names = [button.get_attribute("aria-label") for button in recent_colours.all()]
    labels = ["1: #808080, \u22122.5 stops", "2: #808080, +1 stops"]
    assert names == [f"Recent {button}" for button in labels]
    assert recent_colours.all_inner_texts() == ["\u22122.5", "+1"]


#: What the hand has.
HELD = ("colour", "stops", "second", "recent", "flow", "fillFlow", "hardness", "size")


def reopen(painter: Painter, query: str = "") -> None:
    url = painter.page.url
    painter.page.goto("about:blank")
    painter.page.goto(url.replace("?", f"?{query}&"))
    painter.page.wait_for_selector(".lightpaint .tag")
    painter.still()


@pytest.mark.nightly
def test_a_page_that_is_loaded_anew_knows_what_was_in_the_hand(painter: Painter) -> None:
    reloaded = {name: painter.ui(name) for name in HELD}
    painter.type("Hex", "#336699")
    painter.type("Brightness", "1.5")
    painter.stroke()
    painter.page.keyboard.press("x")
    painter.type("Brightness", "-1")
    painter.page.locator(".stage").focus()
    for key in "37]]":
        painter.page.keyboard.press(key)
    painter.page.keyboard.press("Shift+}")
    painter.page.keyboard.press("g")
    painter.page.keyboard.press("6")
    held_values = {name: painter.ui(name) for name in HELD}
    assert all(held_values[name] != reloaded[name] for name in HELD)
    reopen(painter)
    assert {name: painter.ui(name) for name in HELD} == held_values
    reopen(painter, "size=96x54")
    assert painter.ui("size") == 2 * held_values["size"]  # it is a part of the picture


@pytest.mark.nightly
@pytest.mark.parametrize(
    "junk",
    [
        "nothing of ours",
        "null",
        "[3]",
        '{"colour": [1, 2, 3], "stops": 0, "recent": [{"colour": "red"}, 7], "flow": 0}',
        '{"colour": [1, 1, 1], "stops": "x", "second": 1, "recent": 5, "hardness": 9,'
        ' "flow": null, "fillFlow": "1", "share": -1}',
    ],
)
def test_what_is_remembered_is_not_believed(painter: Painter, junk: str) -> None:
    names = (*HELD, "open")
    reloaded = {name: painter.ui(name) for name in names}
    painter.page.evaluate(
        "(junk) => { for (const key of ['hand', 'open'])"
        " localStorage[`lightpaint.${key}`] = junk; }",
        junk,
    )
    reopen(painter)
    assert {name: painter.ui(name) for name in names} == reloaded


@pytest.mark.nightly
def test_what_was_used_in_painters_beside_each_other_is_remembered(painter: Painter) -> None:
    """A notebook has several, and a browser several tabs."""
    assert painter.page.evaluate("() => localStorage['lightpaint.hand']") is None
    painter.type("Hex", "#112233")
    second_painter = Painter(painter.page.context.new_page())
    second_painter.page.goto(painter.page.url)
    second_painter.page.wait_for_selector(".lightpaint .tag")
    second_painter.type("Hex", "#445566")
    second_painter.stroke()
    painter.page.bring_to_front()  # a page behind another answers slowly
    painter.stroke()
    painter.type("Hex", "#778899")
    painter.stroke()
    second_painter.page.bring_to_front()
    reopen(second_painter)
    recent_colours = second_painter.page.get_by_role("group", name="Recent colours").get_by_role(
        "button"
    )
    names = [str(button.get_attribute("aria-label")) for button in recent_colours.all()]
    assert [name.split(": ")[1] for name in names] == ["#778899", "#112233", "#445566"]


@pytest.mark.nightly
def test_warm_is_right(painter: Painter) -> None:
    """On the slider, among the swatches, and where somebody asks by a drag."""

    def warmth() -> float:
        red, green, blue = painter.ui("colour")
        return float(red - blue - 0.1 * green)  # the warmest have no blue, and less green

    kelvins = []
    for key in ("Home", "ArrowRight", "ArrowRight", "End"):
        painter.slide("CCT", key)
        kelvins.append(warmth())
    assert kelvins == sorted(set(kelvins))
    for swatch in painter.page.locator(".swatch").all()[:7]:
        swatch.click()
        kelvins.append(warmth())
    assert kelvins[4:] == sorted(set(kelvins[4:]))
    kelvin = painter.page.get_by_role("slider", name="CCT", exact=True)
    track = kelvin.evaluate("(one) => one.style.getPropertyValue('--track')")
    first, last = re.findall("#(..)..(..)", track)[:: len(re.findall("#", track)) - 1]
    assert int(first[0], 16) < int(first[1], 16)
    assert int(last[0], 16) > int(last[1], 16)
    painter.page.keyboard.press("a")
    x, y = painter.place()
    painter.page.mouse.move(x, y)
    painter.page.mouse.down()
    painter.page.mouse.move(x + 40, y)
    painter.page.locator(".asking", has_text="warmer").wait_for()
    painter.page.mouse.up()


@pytest.mark.nightly
def test_asking_in_numbers(painter: Painter) -> None:
    lights = painter.page.get_by_role("region", name="Lights")
    before = lights.bounding_box()
    painter.page.keyboard.press("a")
    assert lights.bounding_box() == before  # who drags needs no numbers: nothing moves
    painter.button("By numbers", exact=True).click()
    painter.choose("Area", "red ball")
    painter.type("Brighter", "-1.5")
    painter.type("Warmer", "40")
    painter.button("Apply").click()
    assert painter.calls("adjust")[-1][1] == {"stops": -1.5, "mired": 40, "object": 3}
    painter.stroke()
    assert painter.calls("begin")[-1][1] == "adjust"


@pytest.mark.nightly
def test_importance_is_seen_while_it_is_painted(painter: Painter) -> None:
    painter.page.keyboard.press("w")
    painter.still()
    assert painter.page.evaluate("() => window.engine.shown.overlay") == "importance"
    assert painter.page.locator(".legend").get_by_text("Importance").is_visible()
    assert painter.page.evaluate("() => window.engine.tool.importance") == 4
    painter.slide("Weight", "Home")
    assert painter.ui("importance") == 0.1
    painter.page.keyboard.press("o")  # another overlay is what was asked for
    painter.still()
    assert painter.page.evaluate("() => window.engine.shown.overlay") == "missed"


@pytest.mark.nightly
def test_importance_is_hidden_with_its_brush(painter: Painter) -> None:
    painter.page.keyboard.press("w")
    painter.page.keyboard.press("b")
    painter.still()
    assert painter.page.evaluate("() => window.engine.shown.overlay") is None


@pytest.mark.nightly
def test_space_is_not_held_in_a_window_that_is_left(painter: Painter) -> None:
    painter.page.mouse.move(*painter.place())
    painter.page.keyboard.down("Space")
    assert painter.page.locator(".stage.is-panning").count() == 1
    painter.page.evaluate("() => window.dispatchEvent(new Event('blur'))")
    assert painter.page.locator(".stage.is-panning").count() == 0
    painter.stroke()
    assert painter.calls("begin")


@pytest.mark.nightly
def test_what_is_picked_has_its_brightness_in_stops(painter: Painter) -> None:
    """As its panel, and what stands beside the pointer, have it."""
    for light, stops, colour in (
        ([0.25, 0.125, 0.25], -2, [1, 0.5, 1]),
        ([4, 4, 2], 2, [1, 1, 0.5]),
        ([2**-10, 0, 0], -8, [0.25, 0, 0]),  # beyond the slider
    ):
        painter.page.evaluate("(light) => { engine.paintAt = () => light; }", light)
        painter.stroke(modifiers="Alt")
        assert painter.ui("stops") == pytest.approx(stops)
        assert painter.ui("colour") == pytest.approx(colour)


@pytest.mark.nightly
def test_what_is_under_a_pointer_that_rests_is_that_of_the_last_answer(painter: Painter) -> None:
    painter.page.mouse.move(*painter.place())
    painter.page.locator(".here", has_text="back wall").wait_for()
    shares = painter.ui("probe")["shares"]
    painter.page.evaluate(
        """() => {
          const { probe } = engine;
          const alone = window.painter.store.value.lights.map((_, k) => Number(k === 1));
          engine.probe = (x, y) => ({ ...probe.call(engine, x, y), shares: alone });
        }"""
    )
    painter.tell(kind="answer", version=100, exact=False)
    painter.page.locator(".here b", has_text="100 %").wait_for()
    assert shares[1] < 1


@pytest.mark.nightly
def test_what_is_under_the_pointer(painter: Painter) -> None:
    painter.page.mouse.move(*painter.place())
    painter.page.locator(".here", has_text="back wall").wait_for()
    painter.page.evaluate("() => { engine.lightAt = () => [0.25, 0.25, 0.25]; }")
    painter.page.mouse.move(*painter.place(0.1))
    readout = painter.page.locator(".light-here")
    readout.get_by_text(
        "\u22122.0 st · 6500 K", exact=True
    ).wait_for()  # D65, two stops below white
    assert painter.page.locator(".near").count() == 0
    painter.page.keyboard.press("i")
    readout.get_by_text("RGB 0.25 0.25 0.25").wait_for()
    assert painter.page.locator(".near").inner_text() == "\u22122.0 st · 6500 K"
    painter.page.evaluate("() => { engine.lightAt = () => [0, 0.5, 0]; }")
    painter.page.mouse.move(*painter.place())
    painter.page.locator(".near", has_text=re.compile(r"^\u22121.0 st$")).wait_for()  # no white
    assert sum(painter.ui("probe")["shares"]) == pytest.approx(1, abs=1e-6)
    assert painter.page.locator(".share.is-here").count() == 7


@pytest.mark.nightly
def test_a_pointer_that_has_left_is_over_nothing(painter: Painter) -> None:
    """Also where it moved and left within one frame, and where it moved twice."""
    move_script = """([[x, y], [to, across], leaves]) => {
        const stage = document.querySelector('.stage');
        const tell = (kind, clientX, clientY) =>
          stage.dispatchEvent(new PointerEvent(kind, { clientX, clientY, bubbles: true }));
        tell('pointermove', x, y);
        tell('pointermove', to, across);
        if (leaves) tell('pointerleave', to, across);
        return new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
    }"""
    place, other = painter.place(-0.3), painter.place(0.3)
    painter.page.evaluate(move_script, [other, other, False])
    pointed_place = painter.ui("probe")
    painter.page.evaluate(move_script, [place, place, False])
    assert painter.ui("probe") != pointed_place
    painter.page.evaluate(move_script, [place, other, False])
    assert painter.ui("probe") == pointed_place
    painter.page.evaluate(move_script, [place, place, True])
    assert painter.ui("probe") is None


@pytest.mark.nightly
@pytest.mark.parametrize("tool", ["adjust", "pick"])
def test_what_is_said_beside_the_brush_lies_in_the_picture(painter: Painter, tool: str) -> None:
    """Above it, or beside it where there is no room; never under the hand."""
    page = painter.page
    page.keyboard.press(tool[0] if tool == "adjust" else "i")
    stage = page.locator(".stage").bounding_box()
    for k in (0, 1):
        pane = page.evaluate("(k) => engine.panes()[k]", k)
        left, top = stage["x"] + pane["left"], stage["y"] + pane["top"]
        wide, high = (n * pane["scale"] for n in (48, 27))
        for a, b in ((0.5, 0.5), (0.02, 0.02), (0.98, 0.02), (0.02, 0.98), (0.98, 0.98)):
            x, y = left + a * wide, top + b * high
            page.mouse.move(x, y)
            if tool == "adjust":
                page.mouse.down()
                page.mouse.move(x + 20, y + 30)
            painter.still()
            box = page.locator(".near").bounding_box()
            page.mouse.up()
            assert left - 1 <= box["x"] <= box["x"] + box["width"] <= left + wide + 1
            assert top - 1 <= box["y"] <= box["y"] + box["height"] <= top + high + 1
            gap = max(box["x"] - x, x - box["x"] - box["width"], 0)
            down = max(box["y"] - y, y - box["y"] - box["height"], 0)
            assert 8 < max(gap, down) < 40
            assert box["y"] + box["height"] <= y or gap


@pytest.mark.nightly
def test_what_a_drag_asks_about_stays_where_it_began(painter: Painter) -> None:
    """Ring, readout, and what is said of the place; they are at the pointer before and after."""
    page = painter.page
    page.keyboard.press("a")
    rings = """() => [...document.querySelectorAll('.ring')].map((one) => one.style.transform)
        .concat(document.querySelector('#lp-status').textContent)"""
    page.mouse.move(*painter.place())
    painter.still()
    before = page.evaluate(rings)
    page.mouse.down()
    painter.still()
    readout = page.locator(".asking").bounding_box()
    for offset in (0.1, 0.7, 1.2):  # on the other picture, too
        page.mouse.move(*painter.place(offset))
        painter.still()
        assert page.evaluate(rings) == before
        box = page.locator(".asking").bounding_box()
        middle = (box["x"] + box["width"] / 2, box["y"])
        assert middle == pytest.approx((readout["x"] + readout["width"] / 2, readout["y"]), abs=1)
    page.mouse.up()
    painter.still()
    assert page.evaluate(rings) != before
    page.mouse.move(*painter.place())
    page.mouse.down()
    page.mouse.move(*painter.place(0.3))
    page.keyboard.press("Escape")
    page.mouse.move(*painter.place(0.4))  # it asks no more
    painter.still()
    after = page.evaluate(rings)
    page.mouse.move(*painter.place())
    painter.still()
    assert after != page.evaluate(rings) == before


@pytest.mark.nightly
def test_numbers_that_were_typed_stay_while_other_panels_are_open(painter: Painter) -> None:
    """In another view the same object is meant, though its number is another."""
    page = painter.page
    page.keyboard.press("a")
    painter.button("By numbers", exact=True).click()
    painter.choose("Area", "red ball")
    painter.type("Brighter", "-1.5")
    painter.type("Warmer", "40")
    painter.button("Solve settings").click()
    page.keyboard.press("Escape")
    page.keyboard.press("p")
    page.keyboard.press("p")
    ask = painter.button("Apply")
    ask.click()
    assert painter.calls("adjust")[-1][1] == {"stops": -1.5, "mired": 40, "object": 3}
    page.evaluate(
        """() => window.painter.store.set(({ state, views }) => ({
          state: { ...state, objects: ['red ball', 'floor'] } }))"""
    )
    ask.click()
    assert painter.calls("adjust")[-1][1]["object"] == 0
    page.evaluate(
        """() => window.painter.store.set(({ state }) => ({
          state: { ...state, objects: ['floor'] } }))"""
    )
    painter.still()
    assert ask.is_disabled()
    area_box = page.get_by_role("combobox", name="Area")
    assert area_box.evaluate("(one) => one.selectedOptions[0].text") == "red ball: not in this view"


@pytest.mark.nightly
def test_keys_among_numbers_are_none_of_the_pictures(painter: Painter) -> None:
    page = painter.page
    page.keyboard.press("a")
    painter.button("By numbers", exact=True).click()
    ask = painter.button("Apply")
    for element in (page.get_by_role("combobox", name="Area"), ask):
        element.focus()
        page.keyboard.press("e")
        assert painter.ui("tool") == "adjust"
    ask.press("Enter")
    assert ask.evaluate("(one) => one === document.activeElement")
    ask.click()  # who clicks goes back to the pictures
    painter.still()
    page.keyboard.press("e")
    assert painter.ui("tool") == "eraser"


@pytest.mark.nightly
def test_undo_takes_back_what_a_field_has_taken(painter: Painter) -> None:
    """Ctrl+Z in a field undoes what is being typed, and the step once the field has taken it."""
    painter.stroke()
    painter.still()
    field = painter.page.get_by_role("textbox", name=re.compile(", level$")).first
    assert not field.evaluate("(one) => one.spellcheck")
    field.fill("+1 st")
    field.press("Control+z")  # the text alone
    assert painter.requests("undo") == []
    field.fill("+1 st")
    field.press("Enter")
    painter.still()
    field.press("Control+z")
    assert len(painter.requests("undo")) == 1


#: Outlines as they are drawn, beside what they are to be: (wrong pixels, white ones).
OUTLINE = """(object) => {
  const canvas = document.querySelector('.outline');
  const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext('2d');
  copy.drawImage(canvas, 0, 0);
  const pixels = copy.getImageData(0, 0, canvas.width, canvas.height).data;
  const { data, width, height } = engine.objects();
  const panes = engine.panes();
  const isIts = (x, y, pane) => {
    const [i, j] = [x + 0.5 - pane.left, y + 0.5 - pane.top].map((n) => Math.floor(n / pane.scale));
    return i >= 0 && j >= 0 && i < width && j < height && data[j * width + i] === object;
  };
  let [wrong, white] = [0, 0];
  for (let y = 0; y < canvas.height; y += 1)
    for (let x = 0; x < canvas.width; x += 1) {
      const pane = panes.find((one) => x >= one.x && x < one.x + one.width &&
        y >= one.y && y < one.y + one.height);
      const own = pane && isIts(x, y, pane);
      const isEdge = pane && [[1, 0], [-1, 0], [0, 1], [0, -1]].some(([a, b]) =>
        isIts(x + a, y + b, pane) !== own);
      const at = 4 * (y * canvas.width + x);
      const wanted = isEdge ? (own ? [255, 255] : [0, 180]) : [0, 0];
      if (pixels[at] !== wanted[0] || pixels[at + 3] !== wanted[1]) wrong += 1;
      if (pixels[at] === 255) white += 1;
    }
  return [wrong, white];
}"""


@pytest.mark.nightly
@pytest.mark.parametrize("engine", ["", nightly("engine")], ids=["made up", "real"])
def test_the_object_that_would_be_filled_has_an_outline(new_painter: Any, engine: str) -> None:
    painter = new_painter(engine, is_fresh=True)
    page = painter.page
    page.wait_for_function("() => engine.objects() !== null")
    outline = page.locator(".outline")
    page.evaluate(
        "() => { window.drawn = 0; const put = CanvasRenderingContext2D.prototype.putImageData;"
        " CanvasRenderingContext2D.prototype.putImageData = function (...of) {"
        " if (this.canvas.className === 'outline') drawn += 1; return put.apply(this, of); }; }"
    )
    page.mouse.move(*painter.place())
    painter.stroke()
    painter.still()
    assert not outline.is_visible()
    page.keyboard.press("g")
    page.mouse.move(*painter.place(0.05))
    outline.wait_for()
    wall = painter.ui("probe")["index"]
    miscoloured, white = page.evaluate(OUTLINE, wall)
    assert miscoloured == 0
    assert white > 400
    assert page.evaluate("() => drawn") == 2  # on each picture, once
    page.mouse.move(*painter.place(0.1))
    painter.still()
    assert page.evaluate("() => drawn") == 2  # it is the same one
    page.keyboard.press("+")
    page.wait_for_function("() => drawn === 4")
    page.keyboard.press("v")
    page.wait_for_function("() => drawn > 4")
    assert page.evaluate(OUTLINE, wall)[0] == 0
    page.keyboard.press("a")
    painter.button("Object", exact=True).click()
    page.mouse.move(*painter.place())
    outline.wait_for()
    page.mouse.down()
    page.mouse.move(*painter.place(0.3))
    page.locator(".asking").wait_for()
    assert outline.is_visible()
    assert page.evaluate(OUTLINE, wall)[0] == 0  # that of where the drag began
    page.mouse.up()
    page.keyboard.press("b")
    page.mouse.move(*painter.place())
    painter.still()
    assert not outline.is_visible()
    # A view of which no objects are known has no outline, and none that is left of another.
    page.keyboard.press("g")
    page.mouse.move(*painter.place(0.05))
    outline.wait_for()
    page.evaluate(
        "() => { engine.objects = () => null;"
        " const probe = engine.probe.bind(engine);"
        " engine.probe = (x, y) => ({ ...probe(x, y), object: null, index: -1 }); }"
    )
    page.mouse.move(*painter.place(0.1))
    painter.still()
    assert page.evaluate(
        "() => { const one = document.querySelector('.outline'); return one.getContext('2d')"
        ".getImageData(0, 0, one.width, one.height).data.every((code) => code === 0); }"
    )


@pytest.mark.nightly
def test_fill_has_a_flow_of_its_own(painter: Painter) -> None:
    def flows() -> tuple[float, float]:
        return painter.page.evaluate("() => engine.tool.flow"), painter.ui("flow")

    painter.page.keyboard.press("3")
    assert flows() == (0.3, 0.3)
    painter.page.keyboard.press("g")
    assert flows() == (1, 0.3)
    painter.page.keyboard.press("6")
    assert flows() == (0.6, 0.3)
    painter.type("Flow", "80")
    assert flows() == (0.8, 0.3)
    painter.page.locator(".stage").focus()
    painter.page.keyboard.press("b")
    assert flows() == (0.3, 0.3)


@pytest.mark.nightly
def test_zoom_is_said_in_pixels_of_the_picture(painter: Painter) -> None:
    def zoom() -> tuple[str, float]:
        painter.still()
        scale = painter.page.evaluate("() => engine.panes()[0].scale")
        return painter.page.locator(".zoom").first.inner_text(), scale

    label, fitted = zoom()
    assert label == "Fit"
    painter.page.keyboard.press("+")
    label, scale = zoom()
    assert scale == pytest.approx(1.25 * fitted)
    assert label == f"{round(100 * scale)} %"
    painter.page.keyboard.press("Shift+F")
    assert zoom() == ("100 %", pytest.approx(1))
    painter.page.set_viewport_size({"width": 1600, "height": 900})  # a larger one to fit into
    painter.page.wait_for_function("() => engine.panes()[0].scale > 1.05")
    label, scale = zoom()
    assert label == f"{round(100 * scale)} %"
    painter.page.keyboard.press("f")
    assert zoom()[0] == "Fit"
    painter.page.mouse.move(*painter.place())
    painter.stroke(modifiers="Space")
    label, scale = zoom()
    assert label == f"{round(100 * scale)} %"  # all of it is seen no more
    painter.button("1:1", exact=True).click()
    assert zoom() == ("100 %", pytest.approx(1))
    painter.page.locator(".zoom").first.click()
    assert zoom()[0] == "Fit"


@pytest.mark.nightly
@pytest.mark.parametrize("width", [nightly(1600), 1280, 1024])
def test_what_is_under_the_pointer_has_room_beside_what_goes_on(
    new_painter: Any, width: int
) -> None:
    painter = new_painter("first&lights=12", viewport={"width": width, "height": 720})
    painter.tell(kind="progress", task="basis", done=128, total=1024, unit="samples")
    painter.page.mouse.move(*painter.place())
    readout, working = painter.page.locator(".here"), painter.page.locator(".working")
    readout.locator(".light-here").wait_for()
    assert working.inner_text() == "12 %"
    row, room = readout.bounding_box(), working.bounding_box()
    assert room["x"] + room["width"] <= painter.page.locator(".status").bounding_box()["x"] + width
    assert row["x"] + row["width"] <= room["x"]
    shown_count = 0
    for span in readout.locator("> span").all():
        box = span.bounding_box()
        if box["y"] < row["y"] + row["height"]:  # the others are not seen at all
            shown_count += 1
            assert box["x"] + box["width"] <= row["x"] + row["width"]
    assert shown_count >= 4
