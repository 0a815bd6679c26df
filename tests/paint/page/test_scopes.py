"""Scopes: their arithmetic against closed forms, and what they show, and when."""

from typing import Any

import numpy as np
import pytest
from axe import violations
from nightly import nightly
from painter_page import Painter

LUMA = np.array([0.2126, 0.7152, 0.0722])

ARITHMETIC = """async (given) => {
  const m = await import('/ui/scopes/scope_arithmetic.js');
  const plain = (x) => x?.counts ? { ...x, counts: [...x.counts] } : x;
"""

#: Colour bars of 75 %, by the names of their targets.
BARS = {
    "R": (1, 0, 0),
    "Mg": (1, 0, 1),
    "B": (0, 0, 1),
    "Cy": (0, 1, 1),
    "G": (0, 1, 0),
    "Yl": (1, 1, 0),
}


def codes(picture: Any) -> dict[str, Any]:
    """Return a picture (h, w, 3) of codes as the page has it."""
    height, width = picture.shape[:2]
    rgba = np.concatenate([picture, np.full((height, width, 1), 255)], axis=-1)
    return {"data": rgba.astype(int).ravel().tolist(), "width": width, "height": height}


def flat(colour: tuple[float, ...], size: tuple[int, int] = (4, 6)) -> dict[str, Any]:
    return codes(np.broadcast_to(np.array(colour), (*size, 3)))


def trace(page: Any, call: str, *given: Any) -> Any:
    """Return the counts of a waveform or vectorscope, (rows, columns)."""
    found = page.evaluate(ARITHMETIC + f"return plain(m.{call}(...given)); }}", list(given))
    return np.array(found["counts"]).reshape(found["height"], found["width"])


@pytest.mark.nightly
def test_the_waveform_of_a_ramp_is_a_diagonal(page: Any) -> None:
    """100 % is on top; each column has its one level, as often as there are rows."""
    ramp = np.repeat(np.arange(256)[None, :, None], 3, axis=-1).repeat(5, axis=0)
    for channel in ("luma", 0, 1, 2):
        np.testing.assert_array_equal(
            trace(page, "waveform", codes(ramp), channel), 5 * np.eye(256)[::-1]
        )


def test_the_waveform_of_a_flat_colour_is_a_line(page: Any) -> None:
    """At the colour's luma as in Rec. 709, and in a parade at each of its channels."""
    colour = (200, 100, 40)
    levels = {"luma": round(float(LUMA @ colour)), 0: 200, 1: 100, 2: 40}
    for channel, level in levels.items():
        counts = trace(page, "waveform", flat(colour), channel)
        assert (counts[255 - level] == 4).all()
        assert counts.sum() == 24


def test_the_histogram_of_a_ramp_is_even(page: Any) -> None:
    ramp = np.repeat(np.arange(256)[None, :, None], 3, axis=-1).repeat(3, axis=0)
    counts = page.evaluate(
        ARITHMETIC + "return m.histogram(given).map((one) => [...one]); }", codes(ramp)
    )
    assert np.shape(counts) == (4, 256)
    assert (np.array(counts) == 3).all()
    found = page.evaluate(
        ARITHMETIC + "const c = m.histogram(given); return [m.percentile(c[3], 0.5),"
        " m.percentile(c[3], 1), m.clippedPart(c, 255), m.clippedPart(c, 0)]; }",
        codes(ramp),
    )
    np.testing.assert_allclose(found, [100 * 127 / 255, 100, 1 / 256, 1 / 256])


@pytest.mark.nightly
def test_greys_lie_in_the_middle_of_a_vectorscope(page: Any) -> None:
    for level in (0, 77, 255):
        counts = trace(page, "vectorscope", flat((level,) * 3), 201)
        assert counts[100, 100] == 24
        assert counts.sum() == 24


def test_bars_lie_on_their_targets(page: Any) -> None:
    """By the matrix of Rec. 709, blue to the right and red upwards."""
    targets = page.evaluate(ARITHMETIC + "return m.targets(); }")
    assert [one["name"] for one in targets] == [*BARS]
    for name, target in zip(BARS, targets, strict=True):
        bar = 0.75 * np.array(BARS[name])
        y = LUMA @ bar
        expected = [(bar[2] - y) / 1.8556, (bar[0] - y) / 1.5748]
        np.testing.assert_allclose(target["difference"], expected, atol=1e-12, err_msg=name)
        counts = trace(page, "vectorscope", flat(tuple(np.round(255 * bar))), 201)
        [[row, column]] = np.argwhere(counts)
        np.testing.assert_allclose(
            [column, row],
            [100 + 200 * expected[0], 100 - 200 * expected[1]],
            atol=1,
            err_msg=name,
        )


def test_skin_lies_along_its_line(page: Any) -> None:
    """Tones of skin, dark and light, within ten degrees of it."""
    angle = page.evaluate(ARITHMETIC + "return m.SKIN_ANGLE; }")
    for tone in [(241, 194, 165), (198, 134, 96), (141, 85, 56), (80, 48, 34)]:
        [blue, red] = page.evaluate(
            ARITHMETIC + "return m.colourDifferences(...given); }", [x / 255 for x in tone]
        )
        assert np.degrees(np.arctan2(red, blue)) == pytest.approx(angle, abs=10)


def open_scopes(painter: Painter) -> None:
    painter.button("Scopes", exact=True).click()
    painter.page.locator(".scope canvas").wait_for()
    painter.page.wait_for_function("() => document.querySelector('.scope canvas').width > 0")
    painter.still()


@pytest.mark.nightly
def test_scopes_cost_nothing_while_they_are_folded(new_painter: Any) -> None:
    """Open, they follow the picture that is chosen."""
    painter = new_painter()
    painter.stroke()
    painter.still()
    assert painter.calls("displayedCodes") == []
    open_scopes(painter)
    assert {kind for _, kind in painter.calls("displayedCodes")} == {"solution"}
    group = painter.page.get_by_role("group", name="Picture", exact=True)
    group.get_by_role("button", name="Painting").click()
    painter.page.wait_for_function("() => engine.calls.at(-1)[1] === 'painting'")
    painter.button("Scopes", exact=True).click()
    count = len(painter.calls("displayedCodes"))
    painter.stroke()
    painter.still()
    assert len(painter.calls("displayedCodes")) == count


@pytest.mark.nightly
def test_scopes_are_rare_under_a_brush(new_painter: Any) -> None:
    """A tenth of the time at most, by a clock that the test sets."""
    painter = new_painter(is_fresh=True)
    page = painter.page
    open_scopes(painter)
    before = len(painter.calls("displayedCodes"))
    page.evaluate(
        """async () => {
          const { displayedCodes } = engine;
          engine.displayedCodes = (kind) => {  // which now takes 100 ms
            const end = performance.now() + 100;
            while (performance.now() < end);
            return displayedCodes.call(engine, kind);
          };
          window.start = performance.now();
          for (let k = 0; performance.now() < window.start + 1500; k += 1) {
            painter.store.set({ version: 1000 + k });
            await new Promise((done) => setTimeout(done, 10));
          }
        }"""
    )
    assert 1 <= len(painter.calls("displayedCodes")) - before <= 2


def test_a_scope_says_its_levels(new_painter: Any) -> None:
    painter = new_painter()
    painter.page.evaluate(
        "() => { engine.displayedCodes = () => ({ width: 4, height: 1, data:"
        " [0, 0, 0, 255, 51, 51, 51, 255, 102, 102, 102, 255, 255, 255, 255, 255] }); }"
    )
    open_scopes(painter)
    text = "Luma 0 % to 100 %, middle 20 %. White 25 %, black 25 % of the pixels."
    assert painter.page.locator(".scopes p").inner_text() == text
    name = f"Waveform of the picture: Answer. {text}"
    assert painter.page.get_by_role("img", name=name).count() == 1


@pytest.mark.nightly
@pytest.mark.parametrize(
    "kind", ["Waveform", *map(nightly, ["Histogram", "Parade", "Vectorscope"])]
)
def test_axe_finds_nothing_in_scopes(new_painter: Any, axe: str, kind: str) -> None:
    painter = new_painter(axe=axe)
    open_scopes(painter)
    painter.button(kind, exact=True).click()
    painter.still()
    drawn = painter.page.locator(".scope canvas").evaluate(
        "(one) => { const copy = new OffscreenCanvas(one.width, one.height).getContext('2d');"
        " copy.drawImage(one, 0, 0);"
        " return copy.getImageData(0, 0, one.width, one.height).data.some((x) => x > 0); }"
    )
    assert drawn
    assert violations(painter.page, ".side") == []


@pytest.mark.parametrize("kind", ["painting", *map(nightly, ["solution", "present"])])
def test_codes_are_those_of_the_pictures(new_painter: Any, kind: str) -> None:
    """Of the engine that ships, at the exposure of the display."""
    painter = new_painter("engine&view=cpu")
    page = painter.page
    page.evaluate(
        "async () => { while (engine.mirror.loader.missingSlots().length || !engine.mirror.isReady)"
        " await new Promise((done) => setTimeout(done, 20)); }"
    )
    page.keyboard.press(".")
    painter.stroke()
    painter.page.evaluate("() => painter.session.lockLight(0, [0.5, 0.2, 0.1], true)")
    painter.choose("Compare", "present solution" if kind == "present" else "painting solution")
    painter.still()
    found = page.evaluate(
        """(kind) => {
          const { data, width, height } = engine.displayedCodes(kind);
          const places = [[3, 3], [24, 13], [40, 20], [47, 26]];
          return [width, height, places.map(([x, y]) => [
            [...data.slice(4 * (y * width + x), 4 * (y * width + x) + 3)],
            engine.codes(engine.lightAt(kind, x, y), 0.5)])];
        }""",
        kind,
    )
    assert found[:2] == [48, 27]
    shown, expected = zip(*found[2], strict=True)
    np.testing.assert_allclose(shown, expected, atol=1)  # light of halves
    assert np.ptp(shown) > 20
