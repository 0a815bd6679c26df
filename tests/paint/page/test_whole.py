"""Nothing on a painter's page is cut: not with 69 lights of long names, 40 looks, and the longest
sentences of each kind. What has no room is whole in a tip that keyboard and pointer reach.
"""

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from axe import violations
from nightly import nightly
from painter_page import Painter

SIZES = ((1280, 720), (1440, 900))

CUT = """async (where) => {
  const { cutOff } = await import('/cut.js');
  return cutOff(document.querySelector(where));
}"""


@pytest.fixture(scope="module")
def crowded_page(browser: Any, site: Any) -> Iterator[Painter]:
    """One page for all panels and sizes; each of them is brought to how it begins."""
    page = browser.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(f"{site.url}/fake/bundled.html?crowd&lights=69&size=48x27")
    page.wait_for_selector(".lightpaint .tag")
    painter = Painter(page)
    painter.still()  # what comes after the first marks belongs to how it begins
    page.evaluate("() => { window.first = window.painter.store.value; }")
    yield painter
    page.close()
    assert not errors


@pytest.fixture(scope="module", params=[SIZES[0], nightly(SIZES[1])], ids=["1280x720", "1440x900"])
def crowded_painter(request: pytest.FixtureRequest, crowded_page: Painter) -> Painter:
    width, height = request.param
    crowded_page.page.set_viewport_size({"width": width, "height": height})
    return crowded_page


@pytest.fixture
def painter(crowded_painter: Painter) -> Painter:
    crowded_painter.page.evaluate(
        "() => window.painter.store.set({ ...window.first, toasts: [], preview: null })"
    )
    crowded_painter.page.mouse.move(5, 5)
    crowded_painter.still()
    crowded_painter.page.evaluate(
        """() => {
          for (const one of document.querySelectorAll('.lightpaint, .lightpaint *')) {
            one.scrollTo(0, 0);
          }
        }"""
    )
    return crowded_painter


def clipped_elements(painter: Painter, selector: str = ".lightpaint") -> list[str]:
    painter.still()
    elements: list[str] = painter.page.evaluate(CUT, selector)
    return elements


def show_check(painter: Painter) -> None:
    painter.button("Analysis").click()
    painter.button("Why not closer?").click()
    painter.page.get_by_text("Of the difference (large").wait_for()


def verified(painter: Painter) -> None:
    show_check(painter)
    painter.button("Verify").click()
    painter.page.locator(".verified").wait_for()


def numbers(painter: Painter) -> None:
    painter.page.keyboard.press("a")
    painter.button("By numbers", exact=True).click()
    objects = painter.ui("state")["objects"]
    painter.choose("Area", max(objects, key=len))


def importance(painter: Painter) -> None:
    painter.page.keyboard.press("w")


def over_the_picture(painter: Painter) -> None:
    painter.page.keyboard.press("i")
    painter.page.mouse.move(*painter.place())


def longest(painter: Painter) -> None:
    painter.page.evaluate(
        """async () => {
          const { LONGEST } = await import('/fake/crowd.js');
          window.painter.store.set({ headline: LONGEST });
        }"""
    )


def preview(painter: Painter) -> None:
    painter.page.locator(".answer .help").click()
    painter.page.get_by_role("dialog").get_by_text("changes the annex").wait_for()


def comparing(painter: Painter) -> None:
    painter.button("Compare looks").click()


def show_some_lights(painter: Painter) -> None:
    painter.page.evaluate("() => window.painter.store.set({ solo: [3, 4] })")


def settings(painter: Painter) -> None:
    painter.button("Solve settings").click()
    painter.button("Hold", exact=True).click()
    painter.button("Stay", exact=True).click()


def files(painter: Painter) -> None:
    painter.button("Export").click()
    painter.page.get_by_role("dialog").get_by_role("button", name="Export", exact=True).click()
    painter.page.get_by_text("The same from the command line").wait_for()


def exporting(painter: Painter) -> None:
    """Into a folder of a long name, far from its end."""
    painter.button("Export").click()
    painter.page.evaluate(
        """() => {
          const unit = 'samples per pixel';
          const exportProgress = { task: 'export', done: 205, total: 1024, unit };
          window.painter.store.set({ isExporting: true, exportProgress });
        }"""
    )
    folder = painter.page.locator(".export .folder").first
    assert folder.bounding_box()["width"] > 250


def wide_colour(painter: Painter) -> None:
    painter.type("Hex", "#a4d0d4")


def keys(painter: Painter) -> None:
    painter.page.keyboard.press("?")


def messages(painter: Painter) -> None:
    painter.page.evaluate(
        """async () => {
          const { TOAST } = await import('/fake/crowd.js');
          const basis = { task: 'basis', done: 128, total: 1024, unit: 'samples per pixel' };
          const toasts = [{ id: 1, text: TOAST, tone: 'warn' }];
          const closure = { reason: 'taken', text: `${TOAST} ${TOAST}` };
          window.painter.store.set({ basis, toasts, closure });
        }"""
    )


def agx(painter: Painter) -> None:
    painter.choose("View", "ocio:sRGB - Display/ACES 1.0 - SDR Video")


PANELS: tuple[Callable[[Painter], None], ...] = (
    show_check,
    verified,
    numbers,
    importance,
    over_the_picture,
    longest,
    preview,
    comparing,
    show_some_lights,
    settings,
    files,
    exporting,
    wide_colour,
    keys,
    messages,
    agx,
)


@pytest.mark.nightly
def test_it_begins_with_nothing_cut(painter: Painter) -> None:
    assert clipped_elements(painter) == []


@pytest.mark.nightly
@pytest.mark.parametrize("panel", PANELS, ids=lambda panel: panel.__name__)
def test_no_panel_has_anything_cut(painter: Painter, panel: Callable[[Painter], None]) -> None:
    panel(painter)
    assert clipped_elements(painter) == []


@pytest.mark.nightly
def test_no_light_has_anything_cut(painter: Painter) -> None:
    """Folded, and with all that can be asked of it."""
    for k in (*range(7), 40):
        painter.page.evaluate(
            """(k) => {
              const open = { colour: false, ask: false, lights: true, truth: false };
              window.painter.store.set({ openLights: [k], open });
            }""",
            k,
        )
        painter.still()
        row = painter.page.locator(".light.is-open")
        row.evaluate("(one) => one.scrollIntoView({ block: 'center' })")
        assert (k, clipped_elements(painter, ".lightpaint .side")) == (k, [])


def test_all_that_is_said_of_an_answer_comes_into_sight(painter: Painter) -> None:
    """As it comes, and not what there is room for below what was there before."""
    show_check(painter)
    painter.still()
    side, panel = (painter.page.locator(x).bounding_box() for x in (".side", ".fold.is-truth"))
    assert panel["y"] >= side["y"] - 1
    assert panel["y"] + panel["height"] <= side["y"] + side["height"] + 1


def test_a_sentence_with_its_button_is_whole(painter: Painter) -> None:
    """The reason stands at its end."""
    painter.page.evaluate(
        """async () => {
          const { HELP } = await import('/fake/crowd.js');
          window.painter.store.set({
            headline: 'Farther from the paint than the current lighting, which undo brings back, '
              + 'and changes the back wall by ΔE 6.2. Brighter light on the annex is missing: '
              + 'annex_window is switched off.',
            advice: HELP, deltaE: 23, deltaPresent: 6.9, isJudgementCurrent: true,
          });
        }"""
    )
    painter.still()
    assert painter.page.locator(".answer .help").is_visible()
    sentence = painter.page.locator(".answer .said")
    assert sentence.evaluate("(one) => one.scrollHeight - one.clientHeight") <= 1


def test_numbers_stay_on_the_lines_of_their_units(painter: Painter) -> None:
    show_check(painter)
    truth_text = painter.page.locator(".truth").evaluate("(one) => one.textContent")
    assert truth_text.count("\u00a0%") >= 5
    assert " %" not in truth_text


def test_lines_of_a_name_end_between_words(painter: Painter) -> None:
    """A line that is seen alone, beside one that is scrolled away, is a part of the name."""
    lines = painter.page.evaluate(
        """() => [...document.querySelectorAll('.light .its-name')].map(
          (name) => [...name.children].map((line) => line.textContent))"""
    )
    assert len(lines) == 69
    for start, end in lines:
        assert not end or (start + end).endswith(end)
        assert not (start[-1:].isalnum() and end[:1].isalnum()), (start, end)


@pytest.mark.nightly
@pytest.mark.parametrize("theme", ["dark", "light"])
def test_axe_finds_nothing_in_a_crowd(painter: Painter, axe: str, theme: Any) -> None:
    painter.page.emulate_media(color_scheme=theme)
    longest(painter)
    painter.page.evaluate("() => window.painter.store.set({ openLights: [0, 40] })")
    painter.page.evaluate(axe)
    assert violations(painter.page, ".lightpaint") == []


def test_what_has_no_room_is_read_by_keyboard(painter: Painter) -> None:
    longest(painter)
    painter.still()
    sentence = painter.page.locator(".answer .said")
    # Tab leads there.
    painter.page.locator(".stage").focus()
    painter.page.keyboard.press("Tab")
    for _ in range(30):
        if sentence.evaluate("(one) => one === document.activeElement"):
            break
        painter.page.keyboard.press("Tab")
    tip = painter.page.locator(".tip")
    tip.wait_for()
    assert tip.inner_text().strip() == sentence.inner_text().strip()
    box = tip.bounding_box()
    assert box["x"] >= 0
    assert box["y"] >= 0
