"""A painter's page in windows of all sizes, in notebooks, and by keyboard alone."""

from typing import Any

import pytest
from axe import violations
from nightly import nightly
from painter_page import Painter


@pytest.mark.nightly
def test_a_button_that_is_on_is_seen_under_the_pointer(painter: Painter) -> None:
    opener = painter.button("Solve settings")
    opener.click()  # the pointer stays on it
    opener.locator("xpath=self::*[contains(@class, 'is-on')]").wait_for()
    colours = opener.evaluate(
        "(one) => [getComputedStyle(one)].map((its) => [its.backgroundColor, its.color])[0]"
    )
    assert colours == ["rgb(242, 181, 92)", "rgb(29, 20, 4)"]


@pytest.mark.nightly
def test_by_keyboard_alone(painter: Painter) -> None:
    """All controls are reached by Tab, each says what it is, and the pictures take paint."""
    names_reached = []
    count = painter.page.evaluate(
        "() => document.querySelectorAll('.lightpaint :is(button, input, select)').length"
    )
    for _ in range(count + 5):  # the pictures and long texts take the focus, too
        painter.page.keyboard.press("Tab")
        names_reached.append(
            painter.page.evaluate("() => document.activeElement.outerHTML.slice(0, 90)")
        )
    controls = painter.page.evaluate(
        "() => [...document.querySelectorAll('.lightpaint :is(button, input, select)')]"
        ".filter((one) => !one.disabled && one.checkVisibility()).map((one) =>"
        " one.outerHTML.slice(0, 90))"
    )
    assert set(controls) <= set(names_reached)
    painter.page.locator(".stage").focus()
    for key in ("ArrowRight", "ArrowDown", "Enter"):
        painter.page.keyboard.press(key)
    assert len(painter.calls("begin")) == len(painter.calls("end")) == 1


@pytest.mark.nightly
@pytest.mark.parametrize("query", ["lights=12", "lights=40&shadow"])
def test_tab_leads_to_pictures_and_lights_at_once(new_painter: Any, query: str) -> None:
    painter = new_painter(query)
    before = painter.page.locator(".stage").bounding_box()
    find = (
        "() => { const all = document.activeElement; const one = all.shadowRoot?.activeElement"
        " ?? all; return one.className + ' ' + (one.ariaLabel ?? one.textContent); }"
    )

    def focused() -> str:
        painter.still()
        return str(painter.page.evaluate(find))

    skips = painter.page.locator(".skips button")
    painter.page.keyboard.press("Tab")
    assert "Skip to the pictures" in focused()
    assert skips.first.bounding_box()["width"] > 80
    assert skips.last.bounding_box()["width"] == 1  # not seen
    painter.page.keyboard.press("Enter")
    assert focused().startswith("stage")
    painter.page.evaluate("() => painter.store.set({ side: false, open: {} })")
    skips.first.focus()
    painter.page.keyboard.press("Tab")
    assert "Skip to the lights" in focused()
    painter.page.keyboard.press("Enter")
    assert focused().startswith("light-name key" if "=12" in query else "light-name")
    assert painter.page.locator(".stage").bounding_box() == before


@pytest.mark.nightly
@pytest.mark.parametrize("size", [(1280, 720), (900, 600)])
def test_how_true_is_seen_where_it_opens(new_painter: Any, size: tuple[int, int]) -> None:
    painter = new_painter("lights=12", viewport={"width": size[0], "height": size[1]})
    button = painter.button("Analysis")
    button.click()
    painter.still()
    panel = painter.page.get_by_role("region", name="Analysis").bounding_box()
    assert panel["height"] > 80
    assert panel["y"] + panel["height"] <= size[1] + 1
    painter.page.reload()
    painter.page.wait_for_selector(".lightpaint .tag")
    painter.still()
    assert painter.ui("open")["truth"] is True
    assert painter.page.locator(".side").evaluate("(one) => one.scrollTop") == 0


@pytest.mark.nightly
def test_in_a_shadow_root_it_looks_the_same(new_painter: Any) -> None:
    plain, shadow = new_painter(), new_painter("shadow")
    width = "engine.element.getBoundingClientRect().width"
    wide = plain.page.evaluate(f"() => {width}")
    shadow.page.wait_for_function(f"(wide) => {width} === wide", arg=wide)
    shadow.stroke()
    assert shadow.calls("begin")
    shadow.page.keyboard.press("e")  # the pictures have the focus
    assert shadow.ui("tool") == "eraser"


@pytest.mark.nightly
def test_around_it_nothing_hears_its_keys(new_painter: Any) -> None:
    """In a notebook `B` makes a cell, Delete deletes the painter's own."""
    painter = new_painter("shadow")
    painter.page.evaluate(
        "() => { window.heard = [];"
        " window.addEventListener('keydown', (event) => window.heard.push(event.key)); }"
    )

    def keys_heard(*keys: str) -> list[str]:
        painter.page.evaluate("() => { window.heard = []; }")
        for key in keys:
            painter.page.keyboard.press(key)
        return [key for key in painter.page.evaluate("() => window.heard") if key != "Control"]

    painter.stroke()  # the pictures have the focus
    assert keys_heard("b", "Delete", "7", "d", "Escape", "Shift+Enter", "Alt+ArrowUp") == []
    assert keys_heard("Control+z", "Control+s", "Control+x", "Control+v", "Control+Enter") == []
    assert keys_heard("Control+k", "F2") == ["k", "F2"]
    painter.stroke(modifiers="Space")
    assert painter.ui("display")["pan"][0] < 0
    painter.page.get_by_role("textbox").first.focus()
    assert keys_heard("f", "Delete", "Control+v") == ["v"]
    painter.page.locator(".top").click(position={"x": 3, "y": 3})  # nothing is there
    assert keys_heard("e") == []
    assert painter.ui("tool") == "eraser"
    # Nor where what had the focus is gone.
    painter.page.evaluate("() => document.activeElement.shadowRoot.activeElement.blur()")
    assert painter.page.evaluate("() => document.activeElement === document.body")
    assert keys_heard("b", "Delete", "?", "Escape", "Delete") == []
    assert painter.ui("tool") == "brush"
    painter.page.evaluate(
        "() => { const cell = document.body.appendChild(document.createElement('textarea'));"
        " cell.focus(); cell.blur(); }"
    )
    assert keys_heard("e") == ["e"]
    assert painter.ui("tool") == "brush"


@pytest.mark.nightly
@pytest.mark.parametrize("query", ["", "shadow"])
def test_a_look_is_kept_from_anywhere(new_painter: Any, query: str) -> None:
    """With what is being typed; the browser's own window for that never opens."""
    painter = new_painter(query)
    painter.page.evaluate(
        "() => { window.prevented = []; window.addEventListener('keydown', (event) =>"
        " setTimeout(() => event.key.length === 1 && window.prevented.push("
        "event.key + event.defaultPrevented)), true); }"
    )

    def press(key: str) -> str:
        painter.page.keyboard.press(key)
        painter.still()
        return str(painter.page.evaluate("() => window.prevented.at(-1)"))

    def kept_looks() -> int:
        return len(painter.requests("save_look"))

    level = painter.page.get_by_role("textbox", name="key, level")
    level.fill("-1")
    assert press("Control+s") == "strue"
    kinds = [request["kind"] for request in painter.page.evaluate("() => window.host.requests")]
    assert kinds[-2:] == ["constrain_light", "save_look"]
    assert level.input_value() == "\u22121.0 st"
    assert level.evaluate("(one) => one.getRootNode().activeElement === one")
    assert press("Control+a") == "afalse"  # marks what is in the field
    painter.page.locator(".look-name").click()
    assert press("Control+s") == "strue"
    assert kept_looks() == 2
    painter.button("Solve settings").click()
    painter.page.get_by_role("textbox", name="At most").focus()
    assert press("Control+s") == "strue"
    assert kept_looks() == 3
    painter.page.locator(".stage").focus()
    assert press("Control+s") == "strue"
    assert kept_looks() == 4
    assert press("Control+a") == "atrue"
    assert painter.page.evaluate("() => String(getSelection())") == ""
    painter.page.keyboard.press("?")
    painter.page.get_by_role("dialog").wait_for()
    assert press("Control+s") == "strue"
    assert kept_looks() == 4


@pytest.mark.nightly
def test_a_window_is_open_before_the_next_key(new_painter: Any) -> None:
    """An Escape that comes at once closes it, and is not lost."""
    painter = new_painter()
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


@pytest.mark.nightly
def test_windows_lie_over_it(new_painter: Any) -> None:
    """In a frame as high as all of a notebook; over the frame where hardly any of it is seen."""
    painter = new_painter("shadow", viewport={"width": 1280, "height": 5000})

    def open_window(key: str, top: int) -> tuple[Any, Any]:
        painter.page.evaluate(
            "(top) => { document.getElementById('lightpaint').style = 'position: absolute;"
            " left: 50px; width: 800px; height: 560px; top: ' + top + 'px'; }",
            top,
        )
        # Where pictures lie is known once the page has been laid out again, and shown.
        painter.page.evaluate(
            "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
        )
        painter.stroke()
        painter.page.keyboard.press(key)
        window = painter.page.get_by_role("dialog")
        boxes = window.bounding_box(), painter.page.locator(".lightpaint").bounding_box()
        painter.page.keyboard.press("Escape")
        assert not window.is_visible()
        return boxes

    window, surroundings = open_window("?", 4000)
    assert window["x"] > surroundings["x"]
    assert window["x"] + window["width"] < surroundings["x"] + surroundings["width"]
    assert window["y"] > surroundings["y"]
    assert window["y"] + window["height"] < surroundings["y"] + surroundings["height"]
    painter.page.set_viewport_size({"width": 1280, "height": 720})
    window, surroundings = open_window("?", 500)
    assert 0 < window["y"] < window["y"] + window["height"] < 720
    assert window["height"] > 300


@pytest.mark.nightly
def test_a_space_is_typed_beside_it(new_painter: Any) -> None:
    """Where the pointer rests on the pictures meanwhile."""
    painter = new_painter("shadow")
    painter.page.evaluate(
        "() => { const cell = document.createElement('p'); cell.contentEditable = 'true';"
        " document.body.append(cell); cell.focus(); }"
    )
    painter.page.mouse.move(*painter.place())
    painter.page.keyboard.type("a b")
    assert painter.page.locator("p[contenteditable]").inner_text() == "a b"


#: Windows, and columns of notebooks: one of each kind by day.
SIZES = [(1280, 720), *map(nightly, [(1920, 1080), (1100, 900), (1024, 768), (900, 600)])]


COLUMNS = [
    *map(nightly, [(970, 640), (780, 600), (760, 600), (690, 560), (584, 560)]),
    (480, 640),
]


LOW = [*map(nightly, [(1280, 300), (970, 260), (780, 300), (690, 300), (480, 300)]), (584, 260)]


#: A long one.
SENTENCE = (
    "About half way, 46 %: brighter and redder light on the left is missing; what keeps it"
    " from coming closer is that no light reaches the floor there, and the cove is at its limit."
)


#: The longest of those that end in advice.
ADVICE = (
    "Most of the way: brightness 98 %, colour 83 %. Blue with gold pools, middle: out of reach in"
    " colour (42 % came), since spot_field and spot_figure light the trim, too. More importance,"
    " or lights that move, may help."
)


HELP = {"kind": "colors", "names": [], "gain": 0.57, "hold": None}


def clipped_elements(painter: Painter) -> list[str]:
    """What is wider, or higher, than what is seen of it."""
    names: list[str] = painter.page.evaluate(
        "() => ['.top', '.options', '.tools', '.side', '.answer', '.said', '.fold-body'].filter("
        "(name) => [...document.querySelectorAll(`.lightpaint ${name}`)].some((one) =>"
        " one.scrollWidth > one.clientWidth + 1 || (!['.side', '.fold-body'].includes(name) &&"
        " one.scrollHeight > one.clientHeight + 1)))"
    )
    return names


@pytest.mark.parametrize("size", SIZES + COLUMNS + LOW)
def test_nothing_is_cut_off(new_painter: Any, size: tuple[int, int]) -> None:
    painter = new_painter("lights=12", viewport={"width": size[0], "height": size[1]})
    answer = {"headline": SENTENCE, "help": HELP, "delta_e": 11.2, "delta_e_present": 20.5}
    painter.tell(kind="answer", version=2, exact=True, lights=[], **answer)
    painter.page.keyboard.press("Control+s")
    for key in "bwa":
        painter.page.keyboard.press(key)
        assert clipped_elements(painter) == []


@pytest.mark.parametrize("size", [(1440, 900), *map(nightly, [(1360, 800), (1200, 700)])])
def test_advice_and_its_button_are_in_view(new_painter: Any, size: tuple[int, int]) -> None:
    painter = new_painter("lights=12", viewport={"width": size[0], "height": size[1]})
    answer = {"headline": ADVICE, "help": HELP, "delta_e": 11.2, "delta_e_present": 20.5}
    painter.tell(kind="answer", version=2, exact=True, lights=[], **answer)
    assert clipped_elements(painter) == []
    line = painter.page.locator(".answer").bounding_box()
    for button in painter.page.locator(".answer .button").all():
        box = button.bounding_box()
        assert line["y"] <= box["y"]
        assert box["y"] + box["height"] <= line["y"] + line["height"]
        assert box["x"] + box["width"] <= line["x"] + line["width"]
    sentence, choices = (painter.page.locator(x).bounding_box() for x in (".said", ".choices"))
    assert sentence["x"] + sentence["width"] <= choices["x"]


@pytest.mark.nightly
@pytest.mark.parametrize("size", [(1280, 720), (1024, 768)])
def test_numbers_show_all_their_digits(new_painter: Any, size: tuple[int, int]) -> None:
    """Also the second colour that a painter begins with, 12000 K."""
    painter = new_painter("", viewport={"width": size[0], "height": size[1]})
    painter.page.keyboard.press("x")
    fields = painter.page.locator(".lightpaint .number input:visible")
    assert "12000" in fields.evaluate_all("(all) => all.map((one) => one.value)")
    cut = "(all) => all.filter((one) => one.scrollWidth > one.clientWidth).map((one) => one.value)"
    assert fields.evaluate_all(cut) == []


@pytest.mark.parametrize(
    "size", [(853, 480), *map(nightly, [(1024, 768), (1280, 720), (1600, 900)])]
)
def test_without_panels_pictures_have_all_there_is(new_painter: Any, size: tuple[int, int]) -> None:
    painter = new_painter(viewport=dict(zip(("width", "height"), size, strict=True)))
    painter.page.keyboard.press("p")
    painter.still()
    tools, stage = (painter.page.locator(x).bounding_box() for x in (".tools", ".stage"))
    assert stage["x"] == pytest.approx(tools["x"] + tools["width"], abs=1)
    assert stage["x"] + stage["width"] == pytest.approx(size[0], abs=1)


@pytest.mark.nightly
@pytest.mark.parametrize("size", LOW)
def test_of_a_low_painter_the_sentence_comes_first(new_painter: Any, size: tuple[int, int]) -> None:
    """Nothing that is needed lies below what is seen, and panels scroll."""
    painter = new_painter("lights=12", viewport={"width": size[0], "height": size[1]})
    stage = painter.page.locator(".stage").bounding_box()
    sentence_box = painter.page.locator(".said").bounding_box()
    assert sentence_box["y"] + sentence_box["height"] <= stage["y"]
    assert stage["height"] > 60
    for name in (".stage", ".tools .two-colours", ".answer .button", ".options input >> nth=-1"):
        box = painter.page.locator(name).first.bounding_box()
        assert box["y"] + box["height"] <= size[1]
    assert not painter.page.locator(".here").is_visible()
    if not painter.ui("side"):
        painter.button("Show or hide the panels").click()
    light = painter.page.locator(".light").last
    light.scroll_into_view_if_needed()
    assert light.bounding_box()["y"] < size[1]


@pytest.mark.nightly
@pytest.mark.parametrize("size", [(1280, 720), (690, 560), (690, 300)])
def test_what_has_to_be_known_does_not_lie_over_a_name(
    new_painter: Any, size: tuple[int, int]
) -> None:
    painter = new_painter(viewport={"width": size[0], "height": size[1]})
    painter.page.keyboard.press("Control+s")
    painter.tell(kind="closed", reason="taken", text="The painter is open at another place.")
    top = painter.page.locator(".banner").bounding_box()["y"]
    name = painter.page.locator(".tag", has_text="Painting").bounding_box()
    assert name["y"] + name["height"] <= top


@pytest.mark.nightly
def test_panels_leave_the_pictures_of_a_narrow_column_their_room(new_painter: Any) -> None:
    painter = new_painter(viewport={"width": 690, "height": 560})
    stage, side = painter.page.locator(".stage"), painter.page.locator(".side")
    width = stage.bounding_box()["width"]
    assert side.count() == 0
    assert width > 600
    painter.button("Show or hide the panels").click()
    assert side.is_visible()
    assert stage.bounding_box()["width"] == width  # they lie over them while they are wanted
    painter.button("Show or hide the panels").click()
    assert side.count() == 0
    for room, count in ((1000, 1), (690, 0)):
        painter.page.set_viewport_size({"width": room, "height": 560})
        painter.page.wait_for_function(
            "(count) => document.querySelectorAll('.lightpaint .side').length === count", arg=count
        )


@pytest.mark.parametrize("state", ["busy", *map(nightly, ["first", "keys", "export", "settings"])])
def test_axe_finds_nothing(new_painter: Any, axe: str, state: str) -> None:
    painter = new_painter("first&lights=12", axe=axe)
    if state == "busy":
        painter.button("Analysis").click()
        painter.button("False colour").click()
        painter.button("Save look").click()
        painter.button("Save look").click()
        painter.button("Compare looks").click()
        painter.choose("First look", "2")
        painter.stroke()
        painter.page.evaluate("() => painter.session.lockLight(0, [9, 9, 9], true)")
        painter.page.locator(".is-unseen").wait_for()
        painter.page.get_by_role("button", name="key", exact=True).click()
        painter.button("Solo: show pendant").click()
        painter.page.keyboard.press("v")
        painter.tell(kind="closed", reason="taken", text="It is open on another page.")
        painter.tell(kind="notice", text="Something is so.", tone="warn")
        painter.page.get_by_text("Something is so.").wait_for()
    elif state == "settings":
        painter.button("Solve settings").click()
        painter.button("Hold", exact=True).click()
    elif state != "first":
        painter.page.evaluate("(dialog) => painter.store.set({ dialog })", state)
    painter.page.evaluate(
        """async () => {  // toasts have faded in
          const moving = document.querySelector('.toasts').getAnimations({ subtree: true });
          await Promise.all(moving.map(({ finished }) => finished));
        }"""
    )
    assert violations(painter.page, ".lightpaint") == []


@pytest.mark.nightly
def test_a_picture_at_the_right_edge_is_named_on_one_line(painter: Painter) -> None:
    """In the wipe the name of the right picture ends where the window does."""
    painter.button("Wipe").click()
    painter.still()
    boxes = [tag.bounding_box() for tag in painter.page.locator(".tag").all()]
    left, right = sorted(boxes, key=lambda box: box["x"])
    assert right["height"] == left["height"]


@pytest.mark.nightly
def test_every_comparison_shows_the_two_pictures_that_it_names(new_painter: Any) -> None:
    painter = new_painter("lights=5")
    choice = painter.page.get_by_role("combobox", name="Compare", exact=True)
    names = choice.locator("option").all_inner_texts()
    assert len(names) == 3
    for name in names:
        choice.select_option(label=name)
        painter.still()
        assert painter.page.locator(".stage .tag").all_inner_texts() == name.split(" | ")


@pytest.mark.nightly
def test_two_fingers_zoom_by_as_much_as_they_spread(painter: Painter) -> None:
    """Though both move within one frame, and each alone is told to the page."""
    zoom = painter.page.evaluate(
        """async () => {
          const stage = document.querySelector('.lightpaint .stage')
          const { left, top, width, height } = stage.getBoundingClientRect()
          const put = (kind, spread) => {
            for (const pointerId of [1, 2]) {
              const clientX = left + width / 4 + (2 * pointerId - 3) * spread
              const place = { clientX, clientY: top + height / 2, pointerId, pointerType: 'touch' }
              stage.dispatchEvent(new PointerEvent(kind, { ...place, bubbles: true, button: 0 }))
            }
          }
          put('pointerdown', 30)
          for (const spread of [40, 50, 60]) {
            put('pointermove', spread)
            await new Promise((done) => requestAnimationFrame(() => setTimeout(done)))
          }
          put('pointerup', 60)
          await new Promise((done) => setTimeout(done, 50))
          return window.painter.store.value.display.zoom
        }"""
    )
    assert zoom == pytest.approx(2, rel=0.02)


@pytest.mark.nightly
def test_what_a_press_moves_below_the_pointer_shows_no_tip(painter: Painter) -> None:
    painter.button("Fit").hover()
    painter.page.evaluate(
        """() => {
          const cover = document.createElement('div')
          cover.dataset.tip = 'moved here'
          cover.style = 'position: fixed; inset: 0; z-index: 99'
          const add = () => document.querySelector('.lightpaint').append(cover)
          addEventListener('pointerup', add, { once: true })
        }"""
    )
    painter.page.mouse.down()
    painter.page.mouse.up()
    painter.page.wait_for_timeout(900)
    assert painter.page.locator(".tip").count() == 0
    painter.page.mouse.move(300, 300)
    painter.page.evaluate("() => document.querySelector('[data-tip=\"moved here\"]').remove()")
    painter.button("Save look").hover()
    painter.page.locator(".tip").wait_for()
