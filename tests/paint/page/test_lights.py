"""What can be seen and asked of lights on a painter's page."""

from typing import Any

import numpy as np
import pytest
from painter_page import Finger, Painter


def visible_lights(painter: Painter) -> list[bool] | None:
    """Return which lights the engine shows, None for all."""
    lights: list[bool] | None = painter.page.evaluate("() => window.engine.shown.visibleLights")
    return lights


def newest_constraints(painter: Painter) -> Any:
    """Return the constraints of the last request on one light."""
    return painter.requests("constrain_light")[-1]["constraints"]


def test_a_light_is_moved_by_hand_and_freed(painter: Painter) -> None:
    painter.slide("key, stops from now", "ArrowRight", 20)
    requests = painter.requests("constrain_light")
    assert requests[-1]["light"] == 0
    assert requests[-1]["is_final"] is True
    current = painter.page.evaluate("() => window.painter.store.value.lights[0].present")
    lock = requests[-1]["constraints"]["lock"]
    assert lock == pytest.approx([x * 2 for x in current], rel=1e-6)  # 20 steps of a twentieth
    painter.button("Unlock key").click()
    assert newest_constraints(painter) == {}
    painter.slide("key, stops from now", "Home")
    assert newest_constraints(painter) == {"lock": [0, 0, 0]}


@pytest.mark.nightly
def test_a_moved_light_says_why_it_stays_and_a_press_releases_it(painter: Painter) -> None:
    row = painter.page.locator('[data-light="key"]')
    assert row.locator(".kept").count() == 0
    constraints = {"key": {"lock": [1, 1, 1]}}
    painter.tell(kind="answer", version=9, exact=False, constraints=constraints, kept=["key"])
    kept = row.get_by_role("button", name="Release key: the solve sets it again")
    assert kept.inner_text() == "kept"
    assert "You moved it" in kept.get_attribute("data-tip")
    assert row.locator(".badge").count() == 0  # it is said once
    kept.click()
    assert painter.requests("constrain_light")[-1]["constraints"] == {}
    painter.tell(kind="answer", version=10, exact=False, constraints={}, kept=[])
    assert row.locator(".kept").count() == 0


@pytest.mark.nightly
def test_the_solve_starts_from_lamps_that_were_set(painter: Painter) -> None:
    lamps = painter.page.locator(".start-lamps")
    assert lamps.count() == 0  # nothing was set by hand
    painter.slide("key, stops from now", "ArrowRight")
    painter.button("Start from my lamps").click()
    assert painter.requests("start_from_lamps") == [{"kind": "start_from_lamps", "is_on": True}]
    painter.tell(kind="answer", version=9, exact=False, constraints={}, is_started=True)
    slider = painter.page.get_by_role("slider", name="Near my lamps")
    assert float(slider.input_value()) == pytest.approx(100 / 3, abs=1)
    slider.focus()
    slider.press("End")
    assert painter.requests("change_settings")[-1]["settings"] == {"near": 10}
    slider.press("Home")
    assert painter.requests("change_settings")[-1]["settings"] == {"near": 0.01}
    lamps.get_by_role("button", name="Start from the scene again").click()
    assert painter.requests("start_from_lamps")[-1]["is_on"] is False
    painter.tell(kind="answer", version=10, exact=False, constraints={}, is_started=False)
    assert lamps.count() == 0


@pytest.mark.nightly
def test_a_lamp_of_emitters_shows_a_bar_for_each_drive(painter: Painter) -> None:
    drives = painter.page.locator('[data-light="key"] .drives')
    assert drives.count() == 0  # its lights file lists none
    painter.page.evaluate(
        """() => {
            const { store } = window.painter;
            const [first, ...others] = store.value.lights;
            const emitters = [{ name: 'red', swatch: '#f00' }, { name: 'white', swatch: '#fff' }];
            const [answer, ...answers] = store.value.lightAnswers;
            store.set({
                lights: [{ ...first, emitters }, ...others],
                lightAnswers: [{ ...answer, drives: [0.25, 1] }, ...answers],
            });
        }"""
    )
    assert drives.get_attribute("aria-label") == "Drives: red 25 %, white 100 %"
    widths = drives.locator("i").evaluate_all(
        "bars => bars.map(x => x.style.getPropertyValue('--drive'))"
    )
    assert widths == ["0.25", "1"]
    # They follow the brush; lights without emitters have none.
    painter.tell(kind="answer", version=9, exact=False, drives=[[0.5, 0.125], None])
    assert drives.get_attribute("aria-label") == "Drives: red 50 %, white 13 %"
    painter.tell(kind="answer", version=10, exact=False)
    assert drives.get_attribute("aria-label") == "Drives: red 50 %, white 13 %"


@pytest.mark.nightly
def test_a_colour_wheel_shows_its_slot_and_how_far_it_is_off(painter: Painter) -> None:
    painter.page.evaluate(
        """() => {
            const { store } = window.painter;
            const [first, ...others] = store.value.lights;
            const emitters = [{ name: 'open', swatch: '#fff' }, { name: 'red', swatch: '#f00' }];
            const [answer, ...answers] = store.value.lightAnswers;
            store.set({
                lights: [{ ...first, emitters, address: 'Spot 1 2.21' }, ...others],
                lightAnswers: [{ ...answer, drives: [0, 0.7], slot_delta_e: 7.04 }, ...answers],
            });
        }"""
    )
    slot = painter.page.locator('[data-light="key"] .wheel-slot')
    assert slot.inner_text() == "red, ΔE 7.0 off"
    assert painter.page.locator('[data-light="key"] .lamp-notes').inner_text().startswith("2.21")
    # Under the brush only its drives are known.
    painter.tell(kind="answer", version=9, exact=False, drives=[[0.5, 0], None])
    assert slot.count() == 0


def test_a_blackout_of_the_console_takes_two_presses(painter: Painter) -> None:
    assert painter.page.get_by_role("checkbox", name="Console").count() == 0  # there is none
    console = {"address": "sacn://127.0.0.1, universe 1", "is_on": False, "is_dark": False}
    painter.tell(kind="console", console={**console, "trouble": None})
    painter.page.get_by_role("checkbox", name="Console").click()
    assert painter.requests("switch_console") == [{"kind": "switch_console", "is_on": True}]
    painter.tell(kind="console", console={**console, "is_on": True, "trouble": None})
    painter.button("Blackout").click()
    assert painter.requests("black_out") == []
    painter.button("Press again").click()
    assert painter.requests("black_out") == [{"kind": "black_out"}]
    painter.tell(
        kind="console", console={**console, "is_on": True, "is_dark": True, "trouble": None}
    )
    painter.button("Light again").click()
    assert painter.requests("switch_console")[-1]["is_on"] is True


def test_a_level_is_typed_in_stops_or_percent(painter: Painter) -> None:
    current = painter.page.evaluate("() => window.painter.store.value.lights[0].present")

    def lock() -> Any:
        return newest_constraints(painter)["lock"]

    for text, factor in (
        ("+1.5", 2**1.5),
        ("\u22121 st", 0.5),
        ("80 %", 0.8),
        ("0,5", 2**0.5),
        ("off", 0),
        ("as now", 1),
        ("-8", 2**-8),
        ("12 st", 2**12),
        ("-9 st", 2**-9),  # beyond the left end of the slider
    ):
        painter.type("key, level", text)
        assert lock() == pytest.approx([factor * x for x in current], rel=1e-6)
    count = len(painter.requests("constrain_light"))
    for text in ("bright", "-3 %", "21 st", "12", "80", "-200"):
        painter.type("key, level", text)
        painter.page.get_by_role("textbox", name="key, level").blur()
        words = "is not a level. Type stops from now (+1.5), percent (80 %), as now, or off."
        if text[-1].isdigit():
            words = "could be stops or percent: add the unit (12 st, 80 %)."
        assert painter.ui("toasts")[-1]["text"] == f"{text} {words}"
    toast_count = len(painter.ui("toasts"))
    painter.type("key, level", " ")
    assert len(painter.ui("toasts")) == toast_count
    assert len(painter.requests("constrain_light")) == count
    level = painter.page.get_by_role("textbox", name="key, level")
    assert level.input_value() == "\u22129.0 st"
    level.press("ArrowUp")
    assert lock() == pytest.approx([2**-8.9 * x for x in current], rel=1e-6)
    painter.type("key, level", "off")
    count = len(painter.requests("constrain_light"))
    level.press("ArrowDown")  # there is nothing below it
    assert len(painter.requests("constrain_light")) == count
    assert level.input_value() == "off"
    level.press("ArrowUp")
    assert level.input_value() == "\u22127.9 st"


def test_a_light_is_held_at_what_is_typed_in_any_unit(painter: Painter) -> None:
    painter.page.get_by_role("button", name="key", exact=True).click()
    panel = painter.page.get_by_role("group", name="Constraints on key")
    panel.get_by_role("button", name="Locked", exact=True).click()
    current = painter.page.evaluate("() => window.painter.store.value.lights[0].present")
    level = sum(a * b for a, b in zip((0.2126, 0.7152, 0.0722), current, strict=True))
    for unit, text, factor in (
        ("stops", "-1.5", 2**-1.5),
        ("share", "40", 0.4),
        ("value", "3", 3 / level),
        ("stops", "", 0),
        ("stops", "2", 4),
    ):
        painter.choose("Unit", unit)
        painter.type("Locked at", text)
        lock = newest_constraints(painter)["lock"]
        assert lock == pytest.approx([factor * x for x in current], rel=1e-6)


@pytest.mark.nightly
def test_of_a_light_that_is_off_there_are_no_percent(painter: Painter) -> None:
    painter.type("cove, level", "80 %")
    assert "cove is off now" in painter.ui("toasts")[-1]["text"]
    assert painter.requests("constrain_light") == []
    painter.type("cove, level", "as now")
    assert newest_constraints(painter) == {"lock": [0, 0, 0]}


@pytest.mark.nightly
def test_limits_that_leave_nothing_are_not_sent(painter: Painter) -> None:
    painter.page.get_by_role("button", name="key", exact=True).click()
    painter.type("Max", "150")
    count = len(painter.requests("constrain_light"))
    for label, before, text, words in (
        ("Min", "", "200", "The minimum (200 %) is above the maximum (150 %)"),
        ("Min", "", "150", ""),
        ("Max", "150", "140.5", "The minimum (150 %) is above the maximum (140.5 %)"),
    ):
        painter.type(label, text)
        field = painter.page.get_by_role("textbox", name=label, exact=True)
        if words:
            assert painter.ui("toasts")[-1]["text"] == f"{words}. The limits have not changed."
            assert field.input_value() == before
        else:
            count += 1
        assert len(painter.requests("constrain_light")) == count


@pytest.mark.nightly
@pytest.mark.parametrize("size", [(1280, 720), (1920, 1080), (690, 560), (480, 640)])
def test_what_is_asked_of_a_level_stands_in_one_row(
    new_painter: Any, size: tuple[int, int]
) -> None:
    painter = new_painter(viewport={"width": size[0], "height": size[1]})
    painter.page.evaluate("() => painter.store.set({ side: true, open: { lights: true } })")
    painter.page.get_by_role("button", name="key", exact=True).click()
    panel = painter.page.get_by_role("group", name="Constraints on key")
    room = panel.bounding_box()

    def in_a_row(*labels: str) -> None:
        controls = [
            panel.get_by_role("combobox" if label == "Unit" else "textbox", name=label, exact=True)
            for label in labels
        ]
        boxes = [control.bounding_box() for control in controls]
        assert len({box["y"] + box["height"] for box in boxes}) == 1
        for box, after in zip(boxes, [*boxes[1:], None], strict=True):
            assert box["width"] > 40
            end = after["x"] if after else room["x"] + room["width"]
            assert box["x"] + box["width"] < end

    in_a_row("Min", "Max")
    unit, least = panel.get_by_role("combobox", name="Unit"), panel.get_by_label("Min")
    assert unit.bounding_box()["y"] > least.bounding_box()["y"]  # levels need all of the width
    painter.choose("Colour", "kelvin")
    in_a_row("From", "To", "Tint")
    panel.get_by_role("button", name="Locked", exact=True).click()
    in_a_row("Locked at", "Unit")


@pytest.mark.nightly
def test_a_long_name_of_a_dimmer_has_one_line(painter: Painter) -> None:
    painter.page.evaluate(
        """() => {
          const { lights } = painter.store.value;
          const named = ['spotlight_figure_left', 'spotlight_knot_right'];
          painter.store.set({
            lights: lights.map((one, k) => ({ ...one, name: named[k] ?? one.name })),
            ties: [named],
          });
        }"""
    )
    name = "spotlight_figure_left and spotlight_knot_right, tied"
    head = painter.page.locator(".group-name")
    assert head.get_attribute("data-tip") == name
    assert head.bounding_box()["height"] == 28
    strong = head.locator("strong")
    assert strong.evaluate("(one) => one.scrollWidth > one.clientWidth")
    assert strong.bounding_box()["height"] < 20


@pytest.mark.nightly
@pytest.mark.parametrize("way", ["off", "slider"])
def test_what_was_asked_of_a_light_is_known_until_it_is_free(painter: Painter, way: str) -> None:
    """Also where an answer of before comes while the session has not heard of the hand."""
    limits = {"limits": {"max": "150%"}}
    painter.page.evaluate(
        """async ([limits, way]) => {
          const { session } = painter;
          await session.constrainLight(0, limits);
          const asked =
            way === 'off' ? session.switchLight(0, true) : session.lockLight(0, [1, 1, 1], true);
          host.tell({ kind: 'answer', exact: true, constraints: { key: limits }, arrays: {} });
          await asked;
        }""",
        [limits, way],
    )
    painter.still()
    painter.page.evaluate("() => painter.session.unlockLight(0)")
    assert newest_constraints(painter) == limits


@pytest.mark.nightly
def test_limits_of_a_locked_light_are_known_after_a_reload(painter: Painter) -> None:
    """The session remembers what a page that is gone has replaced by a lock."""
    limits = {"limits": {"max": "150%"}}
    names = [light["name"] for light in painter.ui("lights")[:2]]
    constraints = {name: {"lock": [1, 1, 1]} for name in names}
    painter.page.evaluate(
        """([constraints, earlier]) => {
          host.constraints = constraints;
          const state = host.state();
          host.tell({ kind: 'state', ...state, constraints, earlier });
        }""",
        [constraints, dict.fromkeys(names, limits)],
    )
    painter.still()
    painter.page.evaluate("() => painter.session.unlockLight(0)")
    assert newest_constraints(painter) == limits
    painter.page.evaluate("() => painter.session.unlockAll()")
    assert painter.requests("constrain_lights")[-1]["constraints"] == {names[1]: limits}


@pytest.mark.nightly
def test_what_a_light_may_do(painter: Painter) -> None:
    page = painter.page
    page.get_by_role("button", name="key", exact=True).click()
    painter.type("Max", "150")
    assert newest_constraints(painter) == {"limits": {"max": "150%"}}
    painter.type("Min", "20")
    assert newest_constraints(painter) == {"limits": {"min": "20%", "max": "150%"}}
    painter.choose("Colour", "kelvin")
    painter.type("From", "3000")
    constraints = newest_constraints(painter)
    assert constraints == {"limits": {"min": "20%", "max": "150%"}, "kelvin": [3000, 6500]}
    panel = page.get_by_role("group", name="Constraints on key")
    panel.get_by_role("button", name="Off", exact=True).click()
    assert newest_constraints(painter) == {"off": True}
    panel.get_by_role("button", name="Free", exact=True).click()
    assert newest_constraints(painter) == constraints  # as it was before it was off
    painter.choose("Colour", "color")
    painter.type("Hex or kelvin", "3200K")
    assert newest_constraints(painter)["color"] == "3200K"
    painter.choose("Colour", "primaries")
    assert len(newest_constraints(painter)["primaries"]) == 3
    panel.get_by_role("button", name="As now", exact=True).click()
    assert newest_constraints(painter) == {"lock": True}
    painter.choose("Tie to", "cove")
    assert painter.requests("tie")[-1]["ties"] == [["key", "cove"]]
    group = painter.page.get_by_role("group", name="key and cove, tied")
    painter.page.evaluate("() => painter.session.constrainLight(0, { color: '3200K' })")
    colour = painter.page.get_by_role("combobox", name="Colour", exact=True)
    colour.select_option("any")
    panel.get_by_text("lights keep their current colours").wait_for()
    assert colour.count() == 0
    assert group.locator(".light").count() == 2
    group.get_by_role("button", name="key and cove, tied").first.click()  # it folds
    assert group.locator(".light").count() == 0
    group.get_by_role("button", name="key and cove, tied").first.click()
    painter.button("Untie").click()
    assert painter.requests("tie")[-1]["ties"] == []


@pytest.mark.nightly
def test_who_holds_a_light_holds_its_dimmer(painter: Painter) -> None:
    painter.page.evaluate("() => painter.session.tie(['key', 'cove'])")
    painter.still()
    key, cove = (
        painter.page.get_by_role("group", name=name, exact=True) for name in ("key", "cove")
    )
    key.get_by_role("button", name="Lock key as it is").click()
    free = cove.get_by_role("button", name="Unlock cove")
    free.wait_for()
    assert cove.locator(".dimmer.is-held").count() == 1
    free.click()
    assert newest_constraints(painter) == {}
    assert (
        painter.requests("constrain_light")[-1]["light"]
        == painter.requests("constrain_light")[0]["light"]
    )  # key holds both
    key.get_by_role("button", name="Lock key as it is").wait_for()


@pytest.mark.nightly
def test_a_light_is_said_to_be_held_back_by_what_is_asked_of_it_alone(painter: Painter) -> None:
    badge = painter.page.locator(".badge")
    hold_script = (
        "(constraints) => host.tell({ kind: 'answer', exact: true, constraints, arrays: {}, lights:"
    )
    hold_script += (
        " painter.store.value.lights.map(() => ({ share: 0.1, is_constrained: true })) })"
    )
    painter.page.evaluate(hold_script, {})
    assert badge.count() == 0
    painter.page.evaluate(hold_script, {"key": {"limits": {"max": "150%"}, "kelvin": [2700, 3000]}})
    assert badge.all_inner_texts() == ["held back"]
    assert "This keeps it from what the painting asks" in badge.get_attribute("data-tip")
    within = "(one) => one.scrollWidth <= one.clientWidth"
    assert badge.evaluate(within)
    painter.page.evaluate(hold_script, {"key": {"lock": [1, 1, 1]}})
    assert badge.all_inner_texts() == ["locked"]


@pytest.mark.nightly
def test_names_that_differ_at_their_end_are_told_apart(new_painter: Any) -> None:
    """On a tablet, whose buttons need most of a row."""
    painter = new_painter(has_touch=True)
    painter.page.evaluate(
        """() => {
          const [first, second, ...rest] = window.painter.store.value.lights;
          const called = (light, label) => ({ ...light, label });
          const lights = [called(first, 'ceiling_window_12_3'), called(second, 'key'), ...rest];
          window.painter.store.set({ lights });
        }"""
    )
    painter.still()
    row = painter.page.get_by_role("button", name="ceiling_window_12_3", exact=True)
    box, (start, end) = row.bounding_box(), row.locator(".its-name > span").all()
    assert (start.inner_text(), end.inner_text()) == ("ceiling_window", "_12_3")
    widths = start.evaluate("(its) => [its.clientWidth, its.scrollWidth]")
    assert 12 < widths[0] < widths[1]  # something is left out, and it is not all of it
    end_box = end.bounding_box()
    assert end_box["x"] + end_box["width"] <= box["x"] + box["width"] + 0.5
    assert end.evaluate("(its) => its.scrollWidth <= its.clientWidth + 1")
    assert painter.page.get_by_role("button", name="key", exact=True).inner_text() == "key"


@pytest.mark.nightly
def test_a_light_says_its_unit_in_its_tip_and_keeps_its_height_while_it_is_sought(
    new_painter: Any,
) -> None:
    painter = new_painter(viewport={"width": 1280, "height": 720})
    row = painter.page.locator(".light").first
    value, error = row.locator(".values"), row.locator(".error")
    texts = value.inner_text(), "W/(m² sr)", error.inner_text()
    assert all(texts)
    assert value.get_attribute("data-tip") == " ".join(texts)
    before = row.bounding_box()
    painter.tell(kind="answer", version=100, exact=False)
    assert not error.is_visible()
    assert row.bounding_box() == before


@pytest.mark.nightly
def test_a_light_that_hardly_shines_is_turned_up_in_its_own_colour(painter: Painter) -> None:
    """Nobody has seen the blue that the solve has left it."""
    current = painter.page.evaluate("() => window.painter.store.value.lights[0].present")
    dark = "(rgb) => painter.store.set(({ weights }) => ({ weights: [rgb, ...weights.slice(1)] }))"
    painter.page.evaluate(dark, [0, 0, current[2] / 100])
    painter.type("key, level", "-1")
    assert newest_constraints(painter)["lock"] == pytest.approx([x / 2 for x in current])
    painter.page.evaluate(dark, [0, 0, 5 * current[2]])  # this one everybody has
    painter.type("key, level", "-1")
    red, green, blue = newest_constraints(painter)["lock"]
    assert (red, green) == (0, 0)
    assert blue > current[2]


@pytest.mark.nightly
def test_on_its_way_through_the_dark_a_light_keeps_its_colour(painter: Painter) -> None:
    painter.page.evaluate(
        "() => painter.store.set(({ weights }) => ({ weights: [[1, 0.5, 0.25],"
        " ...weights.slice(1)] }))"
    )
    painter.still()
    painter.page.evaluate(
        """async () => {
          const slider = document.querySelector('[aria-label="key, stops from now"]');
          for (const [value, kind] of [[-7.5, 'input'], [-2, 'input'], [-1, 'change']]) {
            slider.value = value;
            slider.dispatchEvent(new Event(kind, { bubbles: true }));
            await new Promise((done) => setTimeout(done, 60));
          }
        }"""
    )
    red, green, blue = newest_constraints(painter)["lock"]
    assert [green / red, blue / red] == pytest.approx([0.5, 0.25])


@pytest.mark.nightly
def test_a_light_is_held_at_a_white(painter: Painter) -> None:
    painter.button("key", exact=True).click()
    painter.button("Locked", exact=True).click()
    before = newest_constraints(painter)["lock"]
    kelvin = painter.page.locator(".held-colour").get_by_role("textbox", name="CCT")
    kelvin.fill("2700")
    kelvin.press("Enter")
    [request] = painter.requests("constrain_lights")
    lock = np.array(request["constraints"]["key"]["lock"])
    luminance = [0.2126, 0.7152, 0.0722]
    assert lock @ luminance == pytest.approx(np.array(before) @ luminance)
    white = painter.page.evaluate(
        "async () => (await import('/viewer/drawing/colour.js')).fromKelvin(2700)",
    )
    np.testing.assert_allclose(lock / lock[0], np.array(white) / white[0], rtol=1e-9)


@pytest.mark.nightly
def test_solo_and_mute_ask_nothing_of_the_solve(painter: Painter) -> None:
    solo, tag = painter.button("Solo: show pendant"), painter.page.locator(".tag.is-part")
    before = solo.bounding_box()
    solo.click()
    assert visible_lights(painter) == [k == 2 for k in range(7)]
    assert tag.inner_text().strip() == "Answer: only pendant"
    assert solo.bounding_box() == before  # a second click takes it back
    painter.button("Show all", exact=True).click()
    painter.button("Mute: show the picture without key").click()
    assert tag.inner_text().strip() == "Answer: without key"
    painter.button("Show all lights").click()
    painter.still()
    assert visible_lights(painter) is None
    assert not painter.calls("begin")
    painter.button("Mute: show the picture without key").click()
    assert visible_lights(painter) == [k != 0 for k in range(7)]
    assert not painter.requests("constrain_light")
    painter.page.locator(".light-thumb").nth(1).hover()
    painter.still()
    shown_view = painter.page.evaluate("() => window.engine.shown")
    assert shown_view["right"] == "other"
    assert [max(rgb) > 0 for rgb in shown_view["otherWeights"]] == [k == 1 for k in range(7)]


@pytest.mark.nightly
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


@pytest.mark.nightly
def test_64_lights_are_found_sorted_and_folded(new_painter: Any) -> None:
    painter = new_painter("lights=64")
    rows = painter.page.locator(".light")
    assert rows.count() == 64
    painter.page.get_by_label("Search lights").fill("row b")
    assert rows.count() == 8
    painter.button("Row B", exact=False).click()
    assert rows.count() == 0
    painter.page.get_by_label("Search lights").fill("nothing such")
    assert painter.page.get_by_text("No light has this name").is_visible()
    painter.page.get_by_label("Search lights").fill("")
    painter.choose("Sort by", "share")
    names = [row.get_attribute("data-light") for row in rows.all()]
    shares = painter.page.evaluate(
        "() => Object.fromEntries(painter.store.value.lights.map((one, k) =>"
        " [one.name, painter.store.value.lightAnswers[k].share]))"
    )
    sole_shares = [shares[name] for name in names[:3]]
    assert sole_shares == sorted(sole_shares, reverse=True)


@pytest.mark.nightly
def test_a_number_is_taken_as_it_is_shown(painter: Painter) -> None:
    painter.button("Solve settings").click()
    painter.type("At most", "1.5")
    assert painter.requests("change_settings")[-1]["settings"] == {"sparse": 2}
    assert painter.page.get_by_role("textbox", name="At most").input_value() == "2"


@pytest.mark.nightly
def test_a_finger_scrolls_lights_and_moves_none(new_painter: Any) -> None:
    """Where it begins on a slider; sideways it moves it, and so does a tap."""
    painter = new_painter("lights=12", viewport={"width": 1024, "height": 768}, has_touch=True)
    slider = painter.page.get_by_role("slider", name="sconce, stops from now", exact=True)
    finger = Finger(painter.page)

    def place() -> tuple[float, float, float]:
        """A third along the slider, in the middle of what is seen; and how long it is."""
        slider.evaluate("(one) => one.scrollIntoView({ block: 'center' })")
        box = slider.bounding_box()
        return box["x"] + box["width"] / 3, box["y"] + box["height"] / 2, box["width"]

    def mark(x: float) -> float:
        """How far from there the slider's mark is."""
        share_script = "(one) => (one.value - one.min) / (one.max - one.min)"
        return float(slider.bounding_box()["x"] + slider.evaluate(share_script) * place()[2] - x)

    x, y, _ = place()
    scrolled = "() => document.querySelector('.is-lights .fold-body').scrollTop"
    before, value = painter.page.evaluate(scrolled), slider.input_value()
    finger.drag(*((x, y - 12 * k) for k in range(8)), *[(x, y - 84)] * 8)
    assert painter.page.evaluate(scrolled) > before + 40
    painter.page.evaluate("() => document.activeElement.blur()")
    assert painter.requests("constrain_light") == []
    assert slider.input_value() == value
    x, y, _ = place()
    finger.drag(*((x + 6 * k, y + k) for k in range(8)))
    requests = painter.requests("constrain_light")
    assert {request["light"] for request in requests} == {4}
    assert [request["is_final"] for request in requests][:: len(requests) - 1] == [False, True]
    assert mark(x + 42) == pytest.approx(0, abs=10)  # half of the mark, which stays on the track
    search = painter.page.get_by_role("searchbox", name="Search lights")
    search.focus()
    finger.drag((x, y))
    assert slider.evaluate("(one) => one === document.activeElement")
    assert [
        request["is_final"] for request in painter.requests("constrain_light")[len(requests) :]
    ] == [True]
    assert mark(x) == pytest.approx(0, abs=10)
    slider.press("ArrowRight")  # keys are heard as before
    assert len(painter.requests("constrain_light")) > len(requests) + 1
    painter.page.mouse.click(x + 30, y)  # and so is a mouse
    assert mark(x + 30) == pytest.approx(0, abs=10)


def open_key_panel(painter: Painter) -> Any:
    """What may be asked of the key light."""
    painter.page.get_by_role("button", name="key", exact=True).click()
    return painter.page.get_by_role("group", name="Constraints on key")


@pytest.mark.nightly
def test_what_is_off_is_not_turned_up_by_turning_it_down(painter: Painter) -> None:
    panel = open_key_panel(painter)
    panel.get_by_role("button", name="Locked", exact=True).click()
    painter.type("Locked at", "")
    painter.still()
    level = panel.get_by_role("textbox", name="Locked at", exact=True)
    level.press("ArrowDown")
    assert max(newest_constraints(painter)["lock"]) == 0
    level.press("ArrowUp")
    lock, current = (
        newest_constraints(painter)["lock"],
        painter.ui("lights")[0]["present"],
    )
    assert lock == pytest.approx([x * 2**-7.9 for x in current], rel=1e-6)


@pytest.mark.nightly
def test_levels_far_below_one_are_not_off(painter: Painter) -> None:
    panel = open_key_panel(painter)
    panel.get_by_role("button", name="Locked", exact=True).click()
    painter.choose("Unit", "value")
    painter.type("Locked at", "0.00004")
    lock = newest_constraints(painter)["lock"]
    assert 0.2126 * lock[0] + 0.7152 * lock[1] + 0.0722 * lock[2] == pytest.approx(4e-5, rel=1e-3)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("limits", "words", "position"),
    [
        ({"min": 0.05, "max": "150%"}, ("0.05", 1.5), ("share", 0.05, "150%")),
        ({"max": [0.3, 0.3, 0.3]}, ("", 0.3), ("share", None, 0.3)),
        ({"min": "20%", "max": "150%"}, ("20", 150), ("value", 0.2, 1.5)),
    ],
)
def test_limits_of_a_lights_file_are_shown_in_one_unit(
    painter: Painter, limits: Any, words: Any, position: Any
) -> None:
    painter.page.evaluate("(limits) => painter.session.constrainLight(0, { limits })", limits)
    painter.still()
    panel = open_key_panel(painter)
    red, green, blue = painter.ui("lights")[0]["present"]
    current = 0.2126 * red + 0.7152 * green + 0.0722 * blue
    is_share = panel.get_by_role("combobox", name="Unit").input_value() == "share"
    assert is_share == all(isinstance(x, str) for x in limits.values())
    fields = [panel.get_by_role("textbox", name=name) for name in ("Min", "Max")]
    assert fields[0].input_value() == words[0]
    maximum = words[1] * (current if isinstance(limits["max"], str) and not is_share else 1)
    assert float(fields[1].input_value()) == pytest.approx(maximum, rel=1e-3)
    unit, *ends = position
    painter.choose("Unit", unit)
    limits_asked = newest_constraints(painter)["limits"]
    for key, end in zip(("min", "max"), ends, strict=True):
        if isinstance(end, str):
            assert float(limits_asked[key].rstrip("%")) == pytest.approx(
                float(end.rstrip("%")), rel=1e-3
            )
        elif end is None:
            assert key not in limits_asked
        elif unit == "share":
            assert float(limits_asked[key].rstrip("%")) == pytest.approx(
                100 * end / current, rel=1e-3
            )
        else:
            assert limits_asked[key] == pytest.approx(end * current, rel=1e-3)


@pytest.mark.nightly
def test_all_lights_are_let_go_of_in_one_step(painter: Painter) -> None:
    """Each has again what was asked of it before; as after a look that holds all of them."""
    painter.page.evaluate("() => painter.session.constrainLight(0, { limits: { max: '150%' } })")
    painter.still()
    free = painter.page.get_by_role("button", name="Unlock all")
    for name in ("key", "cove"):
        assert free.count() == 0
        painter.button(f"Lock {name} as it is").click()
        painter.still()
    steps = painter.ui("history")["count"]
    free.click()
    free.wait_for(state="detached")
    [request] = painter.requests("constrain_lights")
    assert request["constraints"] == {"key": {"limits": {"max": "150%"}}, "cove": {}}
    assert painter.ui("history")["count"] == steps + 1
    assert painter.page.locator(".dimmer.is-held").count() == 0


@pytest.mark.nightly
def test_a_white_that_is_green_or_pink_is_said_to_be(painter: Painter) -> None:
    def tint_text(rgb: list[float]) -> str:
        painter.page.evaluate("(rgb) => painter.session.lockLight(0, rgb, true)", rgb)
        painter.still()
        return str(painter.page.locator('[data-light="key"] .values').inner_text())

    white = [1.0, 0.98, 0.95]
    assert " K" in tint_text(white)
    assert "green" not in tint_text(white)
    assert "K green" in tint_text([1.0, 1.12, 0.95])
    assert "K pink" in tint_text([1.0, 0.75, 0.95])
    # Nobody sees the tint of a lamp that is hardly a part of the light.
    assert "K green" not in tint_text([0.010, 0.0112, 0.0095])
