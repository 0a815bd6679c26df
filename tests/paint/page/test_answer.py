"""What a painter's page says of an answer; how it is looked at, kept, written and sought."""

from typing import Any

import pytest
from nightly import nightly
from painter_page import Painter


@pytest.mark.nightly
def test_what_was_said_of_the_answer_before_is_marked(painter: Painter) -> None:
    painter.stroke()
    painter.still()
    line, badge = painter.page.locator(".headline"), painter.page.locator(".headline .live")
    sentence = line.locator(".said").inner_text()
    assert badge.count() == 0
    box = line.locator(".said").bounding_box()
    lights = painter.page.evaluate("() => window.host.exact().lights")
    painter.tell(kind="answer", version=100, exact=False)
    assert badge.inner_text() == "live"
    painter.tell(kind="answer", version=101, exact=True, lights=lights)
    assert badge.inner_text() == "analysing"
    assert line.locator(".said").bounding_box() == box
    assert "is-old" in line.get_attribute("class")
    assert line.locator(".said").inner_text() == sentence
    answer = {"lights": lights, "delta_e": 2.0, "sentences": []}
    painter.tell(kind="answer", version=101, exact=True, headline="Nearly.", **answer)
    assert line.locator(".said").inner_text() == "Nearly."
    assert badge.count() == 0
    assert "is-old" not in line.get_attribute("class")


def test_names_from_files_are_text(painter: Painter) -> None:
    painter.page.keyboard.press("a")
    painter.button("By numbers", exact=True).click()
    assert "blue <b>ball</b>" in painter.page.get_by_role("combobox", name="Area").inner_text()
    painter.tell(kind="notice", text="<img src=x>", tone="info")
    assert painter.page.get_by_text("<img src=x>").is_visible()
    assert painter.page.locator(".toasts img").count() == 0


def test_an_answer_to_what_was_undone_says_nothing(painter: Painter) -> None:
    constraints, history = {"key": {"lock": 1}}, {"undo": ["brush"], "redo": []}
    painter.tell(kind="answer", version=6, constraints=constraints, history=history)
    assert (painter.ui("constraints"), painter.ui("history")) == (constraints, history)
    undone = {"undo": [], "redo": ["brush"]}
    painter.tell(kind="patch", version=7, constraints={}, history=undone)
    painter.tell(
        kind="answer",
        version=6,
        exact=True,
        constraints=constraints,
        history=history,
        headline="Old",
    )
    assert (painter.ui("constraints"), painter.ui("history")) == ({}, undone)
    painter.page.evaluate("() => host.tell({ ...host.state(), headline: '' })")  # counts anew
    painter.tell(kind="answer", version=1, constraints=constraints, history=history)
    assert (painter.ui("constraints"), painter.ui("history")) == (constraints, history)


@pytest.mark.nightly
def test_overlays_by_their_key_say_what_their_colours_mean(painter: Painter) -> None:
    legend, press = painter.page.locator(".legend"), painter.page.keyboard.press
    painter.page.locator(".stage").focus()
    assert legend.count() == 0
    press("o")
    assert "too dark" in legend.inner_text()
    press("o")  # asks for what it shows
    painter.page.get_by_text("Out of reach", exact=True).wait_for()
    request_count = len(painter.requests("explain"))
    assert request_count == 1
    # An answer to an earlier painting is none.
    painter.tell(kind="explained", sentences=["Old"], view=0, is_old=True)
    painter.page.wait_for_function(
        "(asked) => host.requests.filter(({ kind }) => kind === 'explain').length > asked",
        arg=request_count,
    )
    painter.page.get_by_text("Out of reach", exact=True).wait_for()
    assert len(painter.requests("explain")) == request_count + 1
    press("o")
    assert "grey" in legend.inner_text()
    press("o")
    assert "painted" in legend.inner_text()
    press("o")
    assert legend.count() == 0


#: Pictures and how they are shown; whether there is room for a legend beside them.
LEGENDS = [("48x27", "side", True), ("27x48", "wipe", True), ("48x27", "wipe", False)]


@pytest.mark.nightly
@pytest.mark.parametrize(("size", "layout", "has_room"), LEGENDS)
def test_a_legend_lies_on_no_picture_where_there_is_room(
    new_painter: Any, size: str, layout: str, has_room: bool
) -> None:
    painter = new_painter(f"size={size}")
    if layout == "wipe":
        painter.page.keyboard.press("v")
    painter.page.evaluate("() => { engine.importance = 10; }")
    painter.page.keyboard.press("w")
    legend = painter.page.locator(".legend")
    assert legend.get_by_text("weight 10 ×").is_visible()
    box, stage = legend.bounding_box(), painter.page.locator(".stage").bounding_box()
    left, top, width, height = painter.page.evaluate(
        "() => { const pane = engine.panes().find(({ kind }) => kind === 'painting');"
        " const { w, h } = engine.room;"
        " return [pane.left, pane.top, w * pane.scale, h * pane.scale]; }"
    )
    x, y = box["x"] - stage["x"], box["y"] - stage["y"]
    is_apart = x + box["width"] <= left or x >= left + width or y >= top + height
    assert is_apart == has_room
    assert box["height"] <= (60 if has_room else 24)
    assert 0 <= x <= stage["width"] - box["width"]
    assert 0 <= y <= stage["height"] - box["height"]


def test_truth(painter: Painter) -> None:
    button = painter.page.locator(".answer").get_by_role("button", name="Analysis")
    box = button.bounding_box()
    button.click()
    assert button.bounding_box() == box  # or Save look, and its tip, would be under the pointer
    assert button.get_attribute("aria-pressed") == "true"
    painter.button("False colour").click()
    assert painter.ui("display")["overlay"] == "falsecolor"
    painter.button("Out of reach").click()  # asks for what it shows
    assert painter.requests("explain")
    assert painter.page.get_by_text("The cove is at its limit").is_visible()
    painter.button("Verify").click()
    assert painter.requests("verify")[-1]["run"] is True
    bar = painter.page.get_by_role("progressbar", name="Verifying")
    painter.tell(kind="progress", task="verify", done=5, total=16, unit="passes")
    assert bar.get_attribute("aria-valuenow") == "5"
    painter.button("Stop", exact=True).click()
    assert painter.requests("verify")[-1]["run"] is False
    painter.button("Verify").click()
    painter.tell(kind="progress", task="lights", done=5, total=16, unit="passes")
    painter.tell(kind="stopped", task="verify")
    assert painter.button("Verify").is_visible()
    assert painter.page.locator(".working").is_visible()  # what else is under way goes on
    painter.tell(kind="verified", agrees=True, text="The render agrees.")
    painter.button("Answer | Render").click()
    show = painter.ui("display")
    assert (show["left"], show["right"], show["layout"]) == ("solution", "verified", "wipe")
    painter.slide("Wipe", "ArrowRight")
    assert painter.ui("display")["wipe"] == pytest.approx(0.52)


@pytest.mark.nightly
def test_how_pictures_are_shown(painter: Painter) -> None:
    painter.choose("Compare", "present solution")
    painter.choose("View", "agx")
    painter.type("Exposure", "1.5")
    painter.page.get_by_label("Denoise").uncheck()
    show = painter.page.evaluate("() => window.engine.shown")
    assert (show["left"], show["transform"], show["stops"]) == ("present", "agx", 1.5)
    assert show["clean"] is False
    assert not painter.requests("change_settings")  # for the eye only


@pytest.mark.nightly
def test_looks(painter: Painter) -> None:
    painter.button("Save look").click()
    painter.stroke()
    painter.page.keyboard.press("Control+s")
    assert [request["name"] for request in painter.requests("save_look")] == ["Look 1", "Look 2"]
    painter.button("Look 2", exact=True).click()
    painter.page.get_by_label("Name of Look 2").fill("Dawn")
    painter.page.get_by_label("Name of Look 2").press("Enter")
    assert painter.requests("rename_look")[-1] == {"kind": "rename_look", "look": 2, "name": "Dawn"}
    painter.button("Load Look 1").click()
    assert painter.requests("load_look")[-1]["look"] == 1
    painter.button("Compare looks").click()
    painter.type("Crossfade", "25")
    request, two = (look["weights"] for look in painter.ui("looks"))
    shown_picture = painter.page.evaluate("() => window.engine.shown")
    assert shown_picture["solutionWeights"] == two  # what is there now lies on the right
    mixture = [0.75 * a + 0.25 * b for a, b in zip(two[0], request[0], strict=True)]
    assert shown_picture["otherWeights"][0] == pytest.approx(mixture)
    painter.stroke()
    painter.page.get_by_text("The painting is not shown: press Back to the painting").wait_for()
    assert len(painter.calls("begin")) == 1  # the one before
    painter.button("Back to the painting").click()
    assert painter.ui("display")["left"] == "painting"
    painter.page.locator(".look").first.hover()
    painter.button("Duplicate Look 1").click()
    painter.button("Delete Look 1", exact=True).click()
    assert not painter.requests("drop_look")  # asks once more
    painter.button("Delete Look 1: press again").click()
    assert painter.requests("drop_look")[-1]["look"] == 1
    assert painter.requests("copy_look")[-1]["look"] == 1


@pytest.mark.nightly
@pytest.mark.parametrize("way", ["deleted", "elsewhere"])
def test_looks_are_compared_while_both_are_there(new_painter: Any, way: str) -> None:
    painter = new_painter(viewport={"width": 1600, "height": 900})
    for _ in range(3):
        painter.page.keyboard.press("Control+s")
        painter.still()
    painter.button("Compare looks").click()
    assert painter.ui("mix") == {"a": 2, "b": 3, "share": 1}  # the newest, and the one before
    painter.choose("First look", "1")
    assert painter.ui("mix") == {"a": 1, "b": 3, "share": 1}
    if way == "deleted":
        painter.page.locator(".look").first.hover()
        painter.button("Delete Look 1", exact=True).click()
        painter.button("Delete Look 1: press again").click()
        assert painter.requests("drop_look")
    else:
        painter.page.evaluate("() => { host.drop_look({ look: 1 }); host.tell(host.state()); }")
    painter.still()
    show = painter.page.evaluate("() => engine.shown")
    assert [show[name] for name in ("left", "right", "solutionWeights")] == [
        "painting",
        "solution",
        None,
    ]
    compared = painter.page.get_by_role("combobox", name="Compare")
    assert compared.input_value() == "painting solution"
    painter.stroke()
    assert painter.calls("begin")
    painter.button("Compare looks").click()
    selected = [
        painter.page.get_by_role("combobox", name=name).input_value()
        for name in ("First look", "Second look")
    ]
    assert selected == ["2", "3"]
    painter.page.evaluate("() => painter.session.send('drop_look', { look: 3 })")
    painter.still()
    assert painter.page.get_by_role("combobox", name="First look").count() == 0
    painter.stroke()
    assert len(painter.calls("begin")) == 2


@pytest.mark.nightly
def test_what_is_said_while_looks_are_compared_is_of_the_answer(painter: Painter) -> None:
    for _ in range(3):
        painter.stroke()
        painter.still()
        painter.page.keyboard.press("Control+s")
        painter.still()
    badge, caption = painter.page.locator(".live"), painter.page.locator(".whose")
    places = painter.page.locator(".stage, .said, .answer button, .light, .fold-head")

    def boxes() -> Any:
        return [place.bounding_box() for place in places.all()]

    before = boxes()
    painter.button("Compare looks").click()
    assert (badge.count(), caption.inner_text()) == (0, "of Look 3")
    assert boxes() == before
    painter.type("Crossfade", "25")  # which no answer is
    assert badge.inner_text() == "answer not shown"
    assert caption.inner_text() == "of the answer (not shown)"
    assert caption.evaluate("(one) => one.scrollWidth <= one.clientWidth")
    assert boxes() == before
    assert painter.page.locator(".is-unseen .light").count() == 7
    painter.choose("Second look", "1")
    painter.type("Crossfade", "100")
    assert badge.inner_text() == "answer not shown"
    painter.choose("First look", "3")
    assert (badge.count(), caption.inner_text()) == (0, "of Look 3")
    painter.button("Back to the painting").click()
    assert (badge.count(), caption.count()) == (0, 0)


@pytest.mark.nightly
def test_a_render_of_before_is_offered_again(painter: Painter) -> None:
    render = painter.button("Answer | Render")
    painter.button("Analysis").click()
    assert render.count() == 0
    begin = "(is_old) => host.tell({ ...host.state(), verifications: [{ agrees: true, view: 0,"
    begin += " text: 'The render agrees.', is_old }] })"
    painter.page.evaluate(begin, False)
    assert "The render agrees." in painter.page.locator(".verified").inner_text()
    assert "earlier answer" not in painter.page.locator(".verified").inner_text()
    painter.page.evaluate(begin, True)
    assert "of an earlier answer" in painter.page.locator(".verified").inner_text()
    render.click()
    assert painter.ui("display")["right"] == "verified"


#: Windows, a column beside panels, one without room for them.
WITH_LOOKS = [(1280, 720), nightly((1600, 900)), nightly((780, 600)), (690, 560), (480, 640)]


@pytest.mark.nightly
@pytest.mark.parametrize("size", WITH_LOOKS)
def test_pictures_stay_as_large_whatever_is_done_with_looks(
    new_painter: Any, size: tuple[int, int]
) -> None:
    painter = new_painter(viewport={"width": size[0], "height": size[1]})
    stage, strip = painter.page.locator(".stage"), painter.page.locator(".looks")
    before = stage.bounding_box()
    assert "saves painting and answer" in strip.inner_text()
    for _ in range(12):  # more than there is room for
        painter.page.keyboard.press("Control+s")
        painter.still()
        assert stage.bounding_box() == before
    place = painter.button("Compare looks").bounding_box()
    assert place["x"] + place["width"] <= strip.bounding_box()["x"] + strip.bounding_box()["width"]
    painter.button("Compare looks").click()
    assert stage.bounding_box() == before
    slider = painter.page.get_by_role("slider", name="Crossfade").bounding_box()
    assert slider["width"] >= 160
    strip_box = strip.bounding_box()
    assert strip_box["height"] <= 56
    for control in painter.page.locator(".mix :is(select, input, button)").all():
        if control.is_visible():
            box = control.bounding_box()
            assert strip_box["x"] <= box["x"]
            assert box["x"] + box["width"] <= strip_box["x"] + strip_box["width"]
            assert strip_box["y"] <= box["y"]
            assert box["y"] + box["height"] <= strip_box["y"] + strip_box["height"]
    # The pointer is where it goes back.
    button_box = painter.button("Back to the painting").bounding_box()
    assert (
        button_box["x"] <= place["x"] + place["width"] / 2 <= button_box["x"] + button_box["width"]
    )
    painter.button("Back to the painting").click()
    for look in range(1, 13):
        painter.page.evaluate("(look) => painter.session.send('drop_look', { look })", look)
    painter.still()
    assert stage.bounding_box() == before
    assert "saves painting and answer" in strip.inner_text()


@pytest.mark.nightly
def test_in_a_low_painter_an_empty_strip_gives_pictures_its_room(new_painter: Any) -> None:
    painter = new_painter(viewport={"width": 1280, "height": 300})
    assert not painter.page.locator(".looks").is_visible()
    painter.page.keyboard.press("Control+s")
    painter.page.locator(".look").wait_for()
    assert painter.page.locator(".looks").bounding_box()["height"] <= 36


@pytest.mark.nightly
def test_what_lies_between_two_looks_is_kept_under_a_name_that_says_so(painter: Painter) -> None:
    painter.page.keyboard.press("Control+s")
    painter.stroke()
    painter.page.keyboard.press("Control+s")
    painter.still()
    painter.button("Compare looks").click()
    painter.type("Crossfade", "60")
    painter.button("Save as look").click()
    request = painter.requests("mix_looks")[-1]
    assert (request["first"], request["second"], request["part"]) == (1, 2, 0.6)
    assert request["name"] == "Look 1 → Look 2, 60 %"
    painter.button("Back to the painting").click()
    name = painter.page.get_by_role("button", name=request["name"], exact=True)
    assert request["name"] in name.get_attribute("data-tip")


@pytest.mark.nightly
def test_the_look_that_is_seen_is_marked(painter: Painter) -> None:
    def marked() -> list[str]:
        painter.still()
        elements = painter.page.locator("[aria-current=true]").all()
        return [str(element.get_attribute("aria-label")) for element in elements]

    painter.page.keyboard.press("Control+s")
    assert marked() == ["Load Look 1"]
    painter.stroke()
    assert marked() == []
    painter.page.keyboard.press("Control+s")
    assert marked() == ["Load Look 2"]
    painter.button("Load Look 1").click()
    assert marked() == ["Load Look 1"]
    # It has the same lights as another.
    painter.page.evaluate("() => painter.session.send('copy_look', { look: 1 })")
    assert marked() == ["Load Look 1"]
    painter.button("Load Look 1 2").click()
    assert marked() == ["Load Look 1 2"]
    for way in ("undo", "redo"):  # and is the one that was gone on from, after that, too
        painter.page.evaluate("(way) => { painter.session.send(way); }", way)
    assert marked() == ["Load Look 1 2"]
    # Where all lights are held, they stay as they are while somebody paints.
    painter.page.evaluate("() => painter.session.send('drop_look', { look: 1 })")
    painter.page.evaluate(
        "() => { host.constraints = Object.fromEntries(host.room.lights.map(({ name }) =>"
        " [name, { lock: true }])); }"
    )
    weights = painter.ui("weights")
    painter.stroke()
    painter.still()
    assert painter.ui("weights") == weights
    assert marked() == []


@pytest.mark.nightly
def test_a_key_that_is_held_down_keeps_one_look(painter: Painter) -> None:
    painter.page.keyboard.down("Control")
    for _ in range(4):
        painter.page.keyboard.down("s")
    painter.page.keyboard.up("s")
    painter.page.keyboard.up("Control")
    assert [request["name"] for request in painter.requests("save_look")] == ["Look 1"]
    painter.page.keyboard.down("]")
    size = painter.ui("size")
    painter.page.keyboard.down("]")  # what goes by steps goes on
    assert painter.ui("size") > size


def test_files_are_written_and_their_command_shown(painter: Painter) -> None:
    painter.button("Export").click()
    painter.page.get_by_label("Report").uncheck()
    painter.page.get_by_role("dialog").get_by_role("button", name="Export", exact=True).click()
    outputs = ["target", "picture", "lighting", "relit"]
    request = painter.requests("export")[-1]
    assert (request["outputs"], request["name"]) == (outputs, "gallery")
    window = painter.page.get_by_role("dialog")
    files = window.locator(".exported li").all_inner_texts()
    assert files == [f"exports/gallery/{name}" for name in outputs]
    assert window.inner_text().count("/shows/gallery-evening") == 1
    painter.page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    painter.button("Copy the folder's path").click()
    painter.button("Copied").wait_for()
    copied = painter.page.evaluate("navigator.clipboard.readText()")
    assert copied == "/shows/gallery-evening/exports"
    assert painter.page.get_by_text("lightpaint solve gallery.xml").is_visible()
    assert not painter.page.get_by_text("Nothing is painted yet").count()
    painter.page.evaluate("() => { host.unpainted = true; }")
    painter.page.get_by_role("dialog").get_by_role("button", name="Export", exact=True).click()
    painter.page.get_by_text("Nothing is painted yet, so no painting").wait_for()
    assert not painter.page.get_by_text("lightpaint solve gallery.xml").count()
    painter.page.get_by_role("checkbox", name="Layers").check()  # not by itself: it takes room
    painter.page.get_by_role("dialog").get_by_role("button", name="Export", exact=True).click()
    assert painter.requests("export")[-1]["outputs"][-1] == "layers"


@pytest.mark.nightly
def test_an_export_has_the_name_of_the_look_that_equals_the_answer(painter: Painter) -> None:
    painter.stroke()
    painter.page.keyboard.press("Control+s")
    painter.page.locator(".look-name", has_text="Look 1").click()
    painter.page.get_by_role("textbox", name="Name of Look 1").fill("Evening")
    painter.page.keyboard.press("Enter")
    painter.button("Load Evening").wait_for()
    painter.button("Export").click()
    window = painter.page.get_by_role("dialog")
    name, export = window.get_by_label("Name"), window.get_by_role("button", name="Export")
    assert name.input_value() == "Evening"
    name.fill("Evening, warmer")
    export.click()
    assert painter.requests("export")[-1]["name"] == "Evening, warmer"
    name.fill("  ")
    assert export.is_disabled()


@pytest.mark.nightly
def test_settings(painter: Painter) -> None:
    painter.button("Solve settings").click()
    painter.button("Ignore").click()
    assert painter.requests("change_settings")[-1]["settings"]["hold"] == 0
    painter.button("Hold", exact=True).click()
    painter.type("Strength", "2.5")
    painter.button("Linear").click()
    painter.button("White", exact=True).click()
    painter.button("Literal").click()
    painter.type("At most", "3")
    painter.button("Stay", exact=True).click()
    painter.type("Pull", "0.02")
    settings_asked: dict[str, Any] = {}
    for request in painter.requests("change_settings"):
        settings_asked |= request["settings"]
    assert settings_asked == {
        "hold": 2.5, "space": "linear", "colors": "white", "literal": True,
        "prefer_current": 0.02, "sparse": 3,
    }  # fmt: skip
    painter.type("At most", "")
    assert painter.requests("change_settings")[-1]["settings"]["sparse"] is None
    painter.button("May change").click()
    assert painter.requests("change_settings")[-1]["settings"]["prefer_current"] is None


@pytest.mark.nightly
def test_settings_leave_the_pictures_seen_and_the_keys_alone(painter: Painter) -> None:
    stage, panel = painter.page.locator(".stage"), painter.page.locator(".settings")
    opener = painter.button("Solve settings")
    before = stage.bounding_box()
    for way_out in ("Escape", "button", "pictures"):
        opener.click()
        assert stage.bounding_box() == before
        box = panel.bounding_box()
        assert box["x"] >= before["x"] + before["width"]
        assert panel.evaluate("(panel) => panel === document.activeElement")
        painter.page.keyboard.press("Tab")
        painter.page.keyboard.press("e" if way_out == "Escape" else "b")
        assert painter.ui("tool") == ("eraser" if way_out == "Escape" else "brush")
        strokes = len(painter.calls("end"))
        if way_out == "Escape":
            painter.page.keyboard.press("Escape")
        elif way_out == "button":
            panel.get_by_role("button", name="Close").click()
        else:
            painter.stroke()
            assert len(painter.calls("end")) == strokes + 1  # it paints beside them
            assert panel.is_visible()
            painter.page.keyboard.press("Escape")
        panel.wait_for(state="detached")
        if way_out != "pictures":
            assert opener.evaluate("(button) => button === document.activeElement")
    assert painter.page.locator(".side").is_visible()


@pytest.mark.nightly
def test_settings_typed_into_are_closed_by_escape(painter: Painter) -> None:
    painter.button("Solve settings").click()
    painter.page.get_by_role("textbox", name="At most").focus()
    painter.page.keyboard.press("Escape")
    painter.page.locator(".settings").wait_for(state="detached")


@pytest.mark.nightly
def test_escape_gives_up_the_stroke_before_it_closes_anything(painter: Painter) -> None:
    painter.button("Solve settings").click()
    painter.give_up()
    assert painter.requests("drop_stroke")
    assert painter.page.locator(".settings").is_visible()


#: What the sentence advises, what its button is called, and the message that it comes to.
HELPS: list[tuple[dict[str, Any], str, str, dict[str, Any]]] = [
    (
        {"kind": "hold", "hold": 0.8, "gain": 0.35, "delta_e": [11.2, 7.44]},
        "Loosen: ΔE 7.4 instead of 11",
        "change_settings",
        {"hold": 0.8},
    ),
    (
        {"kind": "colors", "gain": 0.6, "delta_e": [11.2, 4.5]},
        "Any colour: ΔE 4.5 instead of 11",
        "change_settings",
        {"colors": "free"},
    ),
    (
        {"kind": "off", "names": ["key"], "gain": 0.57, "delta_e": [11.2, 6.9]},
        "Turn on key: ΔE 6.9 instead of 11",
        "constrain_lights",
        {"key": {}},
    ),
    (
        {"kind": "colour", "names": ["cove"], "gain": None},
        "Any colour for cove",
        "constrain_lights",
        {"cove": {"limits": {"max": 2}}},
    ),
]


@pytest.mark.nightly
@pytest.mark.parametrize(("help_", "label", "kind", "change"), HELPS)
def test_what_is_advised_is_seen_before_it_is_done(
    painter: Painter, help_: dict[str, Any], label: str, kind: str, change: dict[str, Any]
) -> None:
    constraints = {"key": {"off": True}, "cove": {"kelvin": 2700, "limits": {"max": 2}}}
    answer = {
        "kind": "answer",
        "exact": True,
        "lights": [],
        "delta_e": 11.2,
        "constraints": constraints,
    }
    button_box = painter.button("Analysis").bounding_box()
    help_ = {"names": [], "hold": None, **help_}
    painter.tell(**answer, version=2, headline="A first step, 10 %.", help=help_)
    assert painter.button("Analysis").bounding_box() == button_box
    button = painter.page.get_by_role("button", name=label, exact=True)
    button.focus()
    painter.page.keyboard.press("Enter")
    dialog = painter.page.get_by_role("dialog")
    dialog.get_by_text("changes the annex by ΔE 49").wait_for()
    assert [dialog.locator("canvas").nth(k).get_attribute("width") for k in (0, 1)] == ["16"] * 2
    field = {"change_settings": "settings", "constrain_lights": "constraints"}[kind]
    assert painter.requests("preview")[-1][field] == change
    assert not painter.requests(kind)  # nothing is done yet
    painter.page.keyboard.press("Escape")
    dialog.wait_for(state="detached")
    assert not painter.requests(kind)
    button.click()
    painter.button("Apply").click()
    assert painter.requests(kind)[-1][field] == change
    assert dialog.count() == 0


@pytest.mark.nightly
def test_a_preview_of_before_is_none(painter: Painter) -> None:
    answer = {"kind": "answer", "exact": True, "lights": [], "delta_e": 11.2, "version": 2}
    help_ = {"kind": "hold", "names": [], "hold": 0.8, "gain": 0.35}
    painter.tell(**answer, headline="A first step, 10 %.", help=help_)
    painter.page.evaluate("() => { window.host.preview = () => ({ kind: 'started' }); }")
    painter.button("Loosen").click()
    number = painter.requests("preview")[-1]["number"]
    painter.tell(kind="previewed", number=number - 1, text="Old.", arrays={})
    assert painter.page.get_by_text("Computing the preview").is_visible()
    assert painter.button("Apply").is_disabled()
    painter.tell(kind="notice", text="That could not be found.", tone="warn", task="preview")
    painter.page.get_by_role("dialog").wait_for(state="detached")


@pytest.mark.nightly
@pytest.mark.parametrize(
    "help_",
    [
        {"kind": "off", "names": ["key"], "gain": 0.5},  # asked before the session began
        {"kind": "hold", "names": [], "hold": 3, "gain": 0.5},  # is so already
        {"kind": "tie", "names": ["key", "cove"], "gain": 0.5},
        {"kind": "sparse", "names": [], "gain": 0.5},
    ],
)
def test_what_cannot_be_let_go_here_has_no_button(painter: Painter, help_: dict[str, Any]) -> None:
    answer = {"kind": "answer", "exact": True, "lights": [], "delta_e": 11.2, "version": 2}
    painter.tell(**answer, headline="A first step, 10 %.", help={"hold": None, **help_})
    painter.still()
    assert painter.page.locator(".answer .help").count() == 0


@pytest.mark.nightly
def test_a_render_of_what_was_there_before_is_said_to_be(painter: Painter) -> None:
    """Somebody has painted on while it was made."""
    painter.button("Analysis").click()
    painter.button("Verify").click()
    painter.stroke()
    painter.tell(
        kind="verified",
        agrees=True,
        text="Rendered again: equal within noise.",
        view=0,
        is_old=True,
    )
    assert "(of an earlier answer)" in painter.page.locator(".verified").inner_text()
    painter.tell(
        kind="verified",
        agrees=True,
        text="Rendered again: equal within noise.",
        view=0,
        is_old=False,
    )
    assert "earlier" not in painter.page.locator(".verified").inner_text()


@pytest.mark.nightly
def test_what_another_page_has_done_is_no_look_of_this_one(painter: Painter) -> None:
    painter.page.keyboard.press("Control+s")
    painter.button("Analysis").click()
    painter.button("Why not closer?").click()
    painter.still()
    assert painter.page.locator("[aria-current=true]").count() == 1
    assert painter.ui("reasons")
    painter.tell(kind="closed", reason="taken", text="It is open on another page.")
    painter.page.evaluate(
        "() => { host.weights = host.weights.map((rgb) => rgb.map((x) => 3 * x));"
        " host.step('brush'); }"
    )
    painter.button("Take over").click()
    painter.still()
    assert painter.page.locator("[aria-current=true]").count() == 0
    assert painter.ui("reasons") == []


@pytest.mark.nightly
def test_looks_that_are_kept_at_once_have_names_of_their_own(painter: Painter) -> None:
    """And what was typed before is in them."""
    painter.page.evaluate("() => { void painter.session.lockLight(1, [1, 1, 1], true); }")
    for _ in range(2):
        painter.page.evaluate(
            "() => window.dispatchEvent("
            "new KeyboardEvent('keydown', { key: 's', ctrlKey: true, bubbles: true }))"
        )
    assert [request["name"] for request in painter.requests("save_look")] == ["Look 1", "Look 2"]
    kinds = [request["kind"] for request in painter.page.evaluate("() => host.requests")]
    assert kinds.index("constrain_light") < kinds.index("save_look")


@pytest.mark.nightly
def test_what_is_half_typed_is_given_up_by_escape(painter: Painter) -> None:
    painter.button("Solve settings").click()
    painter.page.get_by_role("textbox", name="At most").focus()
    painter.page.keyboard.type("3")
    painter.page.keyboard.press("Escape")
    painter.page.locator(".settings").wait_for(state="detached")
    level = painter.page.get_by_role("textbox", name="key, level")
    level.fill("-1")
    level.press("Escape")
    level.blur()
    assert painter.requests("change_settings") == painter.requests("constrain_light") == []


@pytest.mark.nightly
def test_where_a_page_may_not_copy_it_says_so(new_painter: Any) -> None:
    painter = new_painter(
        init="Object.defineProperty(navigator, 'clipboard', { value: undefined })"
    )
    painter.button("Export").click()
    painter.button("Copy the folder's path").click()
    painter.page.get_by_text("select the text instead").wait_for()


@pytest.mark.nightly
def test_a_double_click_begins_no_render(painter: Painter) -> None:
    """The panel comes to lie under its second click."""
    painter.button("Analysis").click()
    painter.button("Verify").dispatch_event("click", {"detail": 2})
    assert painter.requests("verify") == []
    painter.button("Verify").click()
    assert painter.requests("verify")


@pytest.mark.nightly
def test_a_bar_on_the_row_of_a_layer_says_how_much_of_its_wish_came(painter: Painter) -> None:
    """On that of a group too; while somebody paints they are those of the last answer."""
    painter.page.evaluate(
        """() => { engine.makeLayers(4); painter.store.set({ side: true });
          engine.changeLayers({ layers: [{ ...engine.layers[2], group: 4 }] }); }"""
    )
    painter.still()
    shares = {"delta_e": 2.0, "name": "x"}
    deliveries = [
        {"kind": "wish", "layers": [1], "brightness": 0.1, "color": None, **shares},
        {"kind": "layer", "layers": [1], "brightness": 0.98, "color": 0.43, **shares},
        {"kind": "layer", "layers": [2], "brightness": None, "color": 1.3, **shares},
        {"kind": "group", "layers": [2], "brightness": -0.2, "color": None, **shares},
        {"kind": "layer", "layers": [3], "brightness": None, "color": None, **shares},
    ]
    lights = painter.page.evaluate("() => window.host.exact().lights")
    answer = {"kind": "answer", "exact": True, "lights": lights, "delta_e": 2.0, "sentences": []}
    painter.tell(**answer, version=100, headline="Nearly.", deliveries=deliveries)

    def bars(layer: int) -> list[str]:
        row = painter.page.locator(f"[data-layer='{layer}'] .layer-came")
        return row.locator("b").evaluate_all("(all) => all.map(({ style }) => style.width)")

    assert [bars(k) for k in (1, 2, 3, 4)] == [["98%", "43%"], ["100%"], [], ["0%"]]
    came = painter.page.locator("[data-layer='1'] .layer-came")
    assert came.get_attribute("aria-label") == (
        "Of what it asks for, 98 % of the brightness and 43 % of the colour came"
    )
    assert came.locator("i.is-short").count() == 1
    assert painter.page.locator("[data-layer='2'] .is-short").count() == 0
    assert painter.page.locator("[data-layer='4'] .layer-came").get_attribute("aria-label") == (
        "0 % of the change of brightness came"
    )
    painter.tell(kind="answer", version=101, exact=False)
    assert "is-old" in came.get_attribute("class")
    painter.tell(**answer, version=102, headline="Nothing is painted.")
    assert came.count() == 0
