"""Many lamps at once, on a painter's page: selection, dimming, colour and gels, and the master."""

from typing import Any

import numpy as np
import pytest
from axe import violations
from nightly import nightly
from painter_page import Painter

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def select(painter: Painter, *names: str, modifier: str = "Control") -> None:
    """Press the names of lights in the list, with a key held."""
    for name in names:
        painter.page.get_by_role("button", name=name, exact=True).click(modifiers=[modifier])


def selection(painter: Painter) -> list[str]:
    """Return the names of the selected lights, in the order in which they were selected."""
    lights = painter.ui("lights")
    return [lights[k]["name"] for k in painter.ui("selectedLights")]


def weights(painter: Painter) -> Any:
    return np.array(painter.ui("weights"))


def last_locks(painter: Painter) -> dict[str, Any]:
    """Return the levels of the last request on several lights, by name."""
    constraints = painter.requests("constrain_lights")[-1]["constraints"]
    return {name: np.array(entry["lock"]) for name, entry in constraints.items()}


@pytest.mark.nightly
def test_lights_are_selected_by_keys_patterns_and_groups(new_painter: Any) -> None:
    painter = new_painter("lights=64")
    page = painter.page
    select(painter, "key", "sun")
    assert selection(painter) == ["key", "sun"]
    select(painter, "key")
    assert selection(painter) == ["sun"]
    select(painter, "window left", "cove", modifier="Shift")
    assert selection(painter) == ["sun", "key", "window left", "pendant", "cove"]
    page.get_by_role("button", name="Select none").click()
    assert selection(painter) == []
    search = page.get_by_label("Search lights")
    for text, names in (
        ("row 1?", [f"row {k}" for k in range(10, 20)]),
        ("row [12]0, k*y", ["key", "row 10", "row 20"]),
        ("[z-a]*", []),
        ("SUN", ["sun"]),
    ):
        search.fill(text)
        search.press("Enter")
        if names:
            assert sorted(selection(painter)) == sorted(names)
    search.fill("")
    page.get_by_role("button", name="Select none").click()
    page.get_by_role("button", name="Select Row B").click()
    assert len(selection(painter)) == 8
    box = page.get_by_role("checkbox", name="Select row 16", exact=True)
    assert box.get_attribute("aria-checked") == "true"
    box.focus()
    page.keyboard.press("Space")
    assert "row 16" not in selection(painter)
    page.keyboard.press("Escape")
    assert selection(painter) == []


def test_selected_lights_are_dimmed_in_one_step_and_keep_their_ratio(painter: Painter) -> None:
    select(painter, "key", "pendant", "cove")  # cove is off, and stays so
    before = weights(painter)
    painter.type("Dim by", "-1")
    locks = last_locks(painter)
    assert list(locks) == ["key", "pendant"]
    np.testing.assert_allclose(locks["key"], before[0] / 2, rtol=1e-9)
    np.testing.assert_allclose(locks["pendant"], before[2] / 2, rtol=1e-9)
    [request] = painter.requests("constrain_lights")
    assert request["label"] == "key and pendant, \u22121.0 st"
    assert painter.ui("history")["count"] == 1
    painter.slide("Dim", "ArrowRight", 2)  # each press is a step of a tenth, from where it is
    np.testing.assert_allclose(last_locks(painter)["key"], before[0] * 2**-0.8, rtol=1e-9)
    assert painter.page.get_by_role("slider", name="Dim").input_value() == "0"
    for text, factor in (("50 %", 0.5), ("+1 st", 2), ("bright", None), ("off", 0)):
        level = weights(painter)[0]
        count = len(painter.requests("constrain_lights"))
        painter.type("Dim by", text)
        if factor is None:
            assert "bright is not a change" in painter.ui("toasts")[-1]["text"]
            assert len(painter.requests("constrain_lights")) == count
        else:
            np.testing.assert_allclose(last_locks(painter)["key"], level * factor, rtol=1e-9)
    painter.type("Dim by", "1")
    assert painter.ui("toasts")[-1]["text"] == "3 lights off: switch on first."


@pytest.mark.nightly
def test_a_drag_of_the_dimmer_begins_at_the_answer_and_is_one_step(painter: Painter) -> None:
    select(painter, "key", "sun")
    before = weights(painter)
    painter.page.evaluate(
        """async () => {
          const slider = document.querySelector('.lamp-selection input[aria-label="Dim"]');
          for (const [value, kind] of [[-0.5, 'input'], [-3, 'input'], [-2, 'change']]) {
            slider.value = value;
            slider.dispatchEvent(new Event(kind, { bubbles: true }));
            await new Promise((done) => setTimeout(done, 40));
          }
        }"""
    )
    np.testing.assert_allclose(last_locks(painter)["sun"], before[5] / 4, rtol=1e-9)
    finals = [one["is_final"] for one in painter.requests("constrain_lights")]
    assert finals[-1] is True
    assert not any(finals[:-1])
    assert painter.ui("history")["count"] == 1


@pytest.mark.nightly
def test_warmth_keeps_the_level_and_moves_by_mireds(painter: Painter) -> None:
    select(painter, "window left", "sun")
    before = weights(painter)
    painter.type("Warm by", "60")
    locks = last_locks(painter)
    kelvins = painter.page.evaluate(
        "async (colours) => { const { toKelvin } = await import('/viewer/drawing/colour.js');"
        " return colours.map((rgb) => toKelvin(rgb).kelvin) }",
        [before[1].tolist(), locks["window left"].tolist()],
    )
    assert 1e6 / kelvins[1] - 1e6 / kelvins[0] == pytest.approx(60, abs=0.5)
    np.testing.assert_allclose(locks["sun"] @ LUMINANCE, before[5] @ LUMINANCE, rtol=1e-9)


@pytest.mark.nightly
def test_tied_lights_move_by_their_dimmer_and_keep_their_colours(painter: Painter) -> None:
    select(painter, "key", "pendant")
    painter.button("Tie", exact=True).click()
    assert painter.requests("tie")[-1]["ties"] == [["key", "pendant"]]
    before = weights(painter)
    painter.type("Dim by", "-1")
    assert list(last_locks(painter)) == ["key"]  # which holds both
    np.testing.assert_allclose(
        painter.page.evaluate("() => painter.store.value.weights[0]"), before[0] / 2, rtol=1e-9
    )
    assert painter.page.get_by_role("slider", name="Warm").is_disabled()
    count = len(painter.requests("constrain_lights"))
    dimmer = painter.page.get_by_role("textbox", name="key and pendant, tied, dim by")
    dimmer.fill("1")
    dimmer.press("Enter")
    assert len(painter.requests("constrain_lights")) == count + 1
    painter.button("Untie", exact=True).first.click()
    assert painter.requests("tie")[-1]["ties"] == []


@pytest.mark.nightly
def test_selected_lights_are_locked_switched_off_and_let_go(painter: Painter) -> None:
    painter.page.evaluate("() => painter.session.constrainLight(0, { limits: { max: '150%' } })")
    select(painter, "key", "sun")
    panel = painter.page.get_by_role("region", name="Selected lights")
    press = lambda name: panel.get_by_role("button", name=name, exact=True).click()  # noqa: E731
    press("Lock")
    assert set(last_locks(painter)) == {"key", "sun"}
    press("Off")
    assert painter.requests("constrain_lights")[-1]["constraints"] == {
        "key": {"off": True},
        "sun": {"off": True},
    }
    press("On")
    assert painter.requests("constrain_lights")[-1]["constraints"] == {
        "key": {"limits": {"max": "150%"}},
        "sun": {},
    }
    press("Solo")
    assert painter.ui("solo") == [0, 5]
    assert painter.ui("history")["count"] == 4


@pytest.mark.nightly
def test_a_gel_is_put_on_by_its_number_with_its_loss_and_taken_off(painter: Painter) -> None:
    select(painter, "key", "sun")
    before = weights(painter)
    panel = painter.page.get_by_role("region", name="Selected lights")
    panel.get_by_role("button", name="Colour", exact=True).click()
    panel.get_by_role("button", name="Gel", exact=True).click()
    painter.type("Filter", "201")
    assert painter.requests("constrain_lights")[-1]["label"] == "key and sun, Lee 201"
    locks = last_locks(painter)
    ratio = locks["key"] / before[0]
    np.testing.assert_allclose(locks["sun"] / before[5], ratio, rtol=1e-9)
    assert ratio[2] > ratio[1] > ratio[0]
    assert panel.get_by_text("Lee 201 Full C.T. Blue, \u22121.").count() >= 1
    # Another takes its place, and none gives back the lamp's own white at the level before.
    painter.type("Filter", "R80")
    assert last_locks(painter)["key"][0] == 0
    panel.get_by_role("textbox", name="Filter").fill("")
    panel.get_by_role("listbox", name="Filters").select_option("")
    np.testing.assert_allclose(last_locks(painter)["key"], before[0], rtol=1e-6)
    for text, code in (("L106", "L106"), ("amber", None), ("zzz", "none")):
        panel.get_by_role("textbox", name="Filter").fill(text)
        options = panel.get_by_role("listbox", name="Filters").locator("option")
        if code == "none":
            assert panel.get_by_text("No filter has this number").is_visible()
        elif code:
            assert options.first.get_attribute("value") == code
        else:
            assert options.count() > 5


@pytest.mark.nightly
def test_a_held_lamp_takes_any_colour_at_its_level(painter: Painter) -> None:
    painter.button("key", exact=True).click()
    painter.button("Locked", exact=True).click()
    level = weights(painter)[0] @ LUMINANCE
    lamp = painter.page.locator(".held-colour")
    for mixer, label, text in (("HSV", "Hue", "240"), ("HSV", "Saturation", "100")):
        lamp.get_by_role("button", name=mixer, exact=True).click()
        field = lamp.get_by_role("textbox", name=label, exact=True)
        field.fill(text)
        field.press("Enter")
        assert last_locks(painter)["key"] @ LUMINANCE == pytest.approx(level)
    red, green, blue = last_locks(painter)["key"]
    assert (red, green) == pytest.approx((0, 0), abs=1e-6 * blue)
    wheel = lamp.locator(".wheel").bounding_box()
    painter.page.mouse.click(wheel["x"] + wheel["width"] / 2, wheel["y"] + wheel["height"] / 4)
    # Half of the saturation of red, in encoded values: the other two channels are encoded 0.5.
    red, green, blue = last_locks(painter)["key"]
    assert green == pytest.approx(blue, rel=1e-3)
    assert green / red == pytest.approx(0.2140, rel=0.03)  # of a pixel's rounding
    assert last_locks(painter)["key"] @ LUMINANCE == pytest.approx(level)
    hex_field = lamp.get_by_role("textbox", name="Hex")
    hex_field.fill("#ff0000")
    hex_field.press("Enter")
    red, green, blue = last_locks(painter)["key"]
    assert red == pytest.approx(level / 0.2126)
    assert (green, blue) == (0, 0)


def test_published_colours_of_gels_come_out_on_the_light_they_were_measured_with(
    painter: Painter,
) -> None:
    """The table against numbers of the makers' swatch books, and against itself."""
    gels = painter.page.evaluate(
        """async () => {
          const { GELS, gelOn, gelsNamed } = await import('/viewer/gels/gel_list.js');
          const { filtered, lossInStops } = await import('/viewer/gels/gels.js');
          const { fromKelvin, toKelvin } = await import('/viewer/drawing/colour.js');
          const white = fromKelvin(3200);
          return {
            codes: GELS.map(({ code }) => code),
            kelvins: ['L201', 'L202', 'L203', 'L204'].map(
              (code) => toKelvin(filtered(gelsNamed(code)[0], white)).kelvin),
            losses: ['L201', 'L209', 'L211', 'L106'].map(
              (code) => lossInStops(gelsNamed(code)[0], white)),
            found: GELS.every((gel) => gelsNamed(gel.code)[0] === gel),
            known: gelOn(filtered(GELS[1], white).map((x) => 7 * x), white)?.code,
            none: gelOn(white, white),
            finite: GELS.every(({ factor }) => factor.every((x) => x >= 0 && x < 1.1)),
          };
        }"""
    )
    assert len(set(gels["codes"])) == len(gels["codes"]) > 150
    assert gels["kelvins"] == pytest.approx([5700, 4300, 3600, 2190], rel=0.03)
    assert gels["losses"] == pytest.approx([1.51, 1.0, 3.08, 2.97], abs=0.06)
    assert gels["found"]
    assert gels["finite"]
    assert (gels["known"], gels["none"]) == (gels["codes"][1], None)


@pytest.mark.nightly
def test_the_master_dims_pictures_and_no_level(painter: Painter) -> None:
    before = weights(painter)
    painter.type("Master", "70")
    assert painter.requests("set_master") == [{"kind": "set_master", "level": 0.7}]
    np.testing.assert_allclose(weights(painter), before)
    assert painter.page.evaluate("() => engine.shown.master") == 0.7
    assert painter.page.get_by_text("Answer, master 70 %").count() == 1
    assert painter.page.get_by_text("before the master").count() == 1
    painter.page.get_by_role("button", name="Master to 100 %").click()
    painter.still()
    assert painter.ui("master") == 1
    # While the slider moves, the page alone shows it.
    count = len(painter.requests("set_master"))
    painter.page.evaluate(
        """() => {
          const slider = document.querySelector('.master input[type=range]');
          slider.value = 40;
          slider.dispatchEvent(new Event('input', { bubbles: true }));
          host.tell({ kind: 'answer', exact: true, version: 1000, master: 1, arrays: {} });
        }"""
    )
    assert painter.ui("master") == 0.4
    assert len(painter.requests("set_master")) == count


@pytest.mark.nightly
@pytest.mark.parametrize("size", [(1280, 720), nightly((1024, 768)), (480, 640)])
def test_the_controls_of_a_selection_fit_and_have_names(
    new_painter: Any, axe: str, size: tuple[int, int]
) -> None:
    painter = new_painter("lights=12", viewport={"width": size[0], "height": size[1]})
    page = painter.page
    page.evaluate("() => painter.store.set({ side: true, open: { lights: true } })")
    painter.type("sun, level", "-3")
    select(painter, "key", "sun", "cove")  # at several levels, and one off
    panel = page.get_by_role("region", name="Selected lights")
    panel.get_by_role("button", name="Colour", exact=True).click()
    panel.get_by_role("button", name="Gel", exact=True).click()
    painter.still()
    assert panel.evaluate("(one) => one.scrollWidth <= one.clientWidth")
    for control in panel.locator("button, input").all():
        assert control.evaluate("(one) => one.scrollWidth <= one.clientWidth + 1")
    page.evaluate(axe)
    assert violations(page, ".is-lights") == []


@pytest.mark.nightly
def test_a_lasso_selects_the_marks_that_it_encloses(new_painter: Any) -> None:
    painter = new_painter("lights=12")
    page = painter.page
    page.evaluate(
        """() => {
          const { store } = painter;
          const place = (x, y) => ({ position: [x, y, 5], direction: null, target: null,
            cutoff: null, beam: null, rail: null, immovable_reason: '' });
          const camera = { origin: [0, 0, 0], x_axis: [1, 0, 0], y_axis: [0, 1, 0],
            forward: [0, 0, 1], is_parallel: true };
          const lights = store.value.lights.map((_, k) => place(4 + 3.5 * k, 5 + 17 * (k % 2)));
          store.set({ areLampsMarked: true,
            rig: { kind: 'rig', lights, cameras: [camera], up: 1, low: [0, 0, 0], high: [48, 27, 9],
              surfaces: [], objects: [], skies: [] } });
        }"""
    )
    marks = page.locator(".lamp[data-lamp]")
    marks.first.wait_for()

    def centre(name: str) -> tuple[float, float]:
        box = page.locator(f'.lamp[data-lamp="{name}"]').first.bounding_box()
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def draw(first: str, last: str) -> None:
        """Draw around a row of marks."""
        painter.button("Lasso").click()
        (x0, y), (x1, _) = centre(first), centre(last)
        page.mouse.move(x0 - 15, y - 15)
        page.mouse.down()
        for x, dy in ((x1 + 15, -15), (x1 + 15, 15), (x0 - 15, 15)):
            page.mouse.move(x, y + dy, steps=3)
        page.mouse.up()
        painter.still()

    draw("key", "sconce")  # every other light hangs in the lower row
    assert selection(painter) == ["key", "pendant", "sconce"]
    assert not painter.calls("begin")
    page.locator('.lamp[data-lamp="cove"]').first.click(modifiers=["Control"])
    assert selection(painter) == ["key", "pendant", "sconce", "cove"]
    assert page.get_by_role("button", name="cove, selected").count() == 1
    draw("window left", "window left")
    assert selection(painter) == ["window left"]
    painter.button("Lasso").click()
    page.keyboard.press("Escape")
    assert painter.ui("isLassoing") is False
    assert selection(painter) == ["window left"]


def rows_that_exist(painter: Painter) -> list[int]:
    """Return the places, from 1, of the rows of the list that exist."""
    painter.still()
    places: list[int] = painter.page.locator(".light-rows > [role=listitem]").evaluate_all(
        "(items) => items.map((item) => Number(item.getAttribute('aria-posinset')))"
    )
    return places


def test_of_a_thousand_lights_groups_come_first_and_rows_in_view_exist(
    new_painter: Any, axe: str
) -> None:
    painter = new_painter("lights=1000&size=32x18", axe=axe)
    page = painter.page
    group = page.locator(".group-name", has_text="Row H")
    assert group.get_attribute("aria-expanded") == "false"
    assert not [place for place in rows_that_exist(painter) if place > 8]
    group.click()
    of_group = page.get_by_role("list", name="Row H")
    items = of_group.get_by_role("listitem")
    assert 5 < items.count() < 60
    assert items.first.get_attribute("aria-setsize") == "936"
    assert items.last.get_attribute("aria-posinset") == "936"
    heights = items.evaluate_all("(all) => all.map((x) => x.getBoundingClientRect().height)")
    whole = of_group.bounding_box()["height"]  # that of all rows, as estimated
    assert whole == pytest.approx(936 * np.mean(heights), rel=0.05)
    assert violations(page, ".lights") == []
    # The wheel brings the rows below, and the search those that it finds.
    items.first.hover()
    page.mouse.wheel(0, 20_000)
    page.wait_for_function(
        "() => [...document.querySelectorAll('.light-rows > [aria-posinset]')]"
        ".filter((x) => x.ariaPosInSet > 200 && x.ariaPosInSet < 400).length > 5"
    )
    assert len(rows_that_exist(painter)) < 80
    page.get_by_label("Search lights").fill("row 99?")
    painter.still()
    assert page.locator(".light-rows .light").count() == 10


@pytest.mark.nightly
def test_the_keyboard_reaches_all_rows_of_a_long_list(new_painter: Any) -> None:
    painter = new_painter("lights=300&size=32x18")
    page = painter.page
    page.locator(".group-name", has_text="Row H").click()
    page.get_by_role("button", name="row 64", exact=True).focus()
    seen: list[str] = []
    for _ in range(120):
        name = page.evaluate("() => document.activeElement.closest('[data-light]').dataset.light")
        if name not in seen:
            seen.append(name)
        page.keyboard.press("Tab")
    assert len(seen) > 20
    assert seen == [f"row {k}" for k in range(64, 64 + len(seen))]
    # The row with the focus stays, wherever the list is scrolled to.
    focused = page.evaluate("() => document.activeElement.closest('[data-light]').dataset.light")
    page.locator(".light-rows > :last-child").last.scroll_into_view_if_needed()
    painter.still()
    assert page.locator(f'[data-light="{focused}"]').count() == 1
    assert page.locator('[data-light="row 140"]').count() == 0


@pytest.mark.nightly
def test_a_light_of_a_long_list_is_unfolded_though_its_row_was_not_there(new_painter: Any) -> None:
    painter = new_painter("lights=300&size=32x18")
    page = painter.page
    assert page.locator('[data-light="row 250"]').count() == 0
    page.evaluate("() => window.painter.store.set({ openLights: [250] })")
    painter.still()
    assert page.get_by_role("group", name="Constraints on row 250").count() == 1
