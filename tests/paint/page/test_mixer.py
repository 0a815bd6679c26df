"""The mixer of a report, opened from a disk with the network off: its pixels are Σ w Φ."""

import json
import zlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from axe import violations
from mixer_canvas import mixer_pixels
from painter_page import Finger

import lightpaint as lp
from lightpaint.colour.color import kelvin_to_rgb
from lightpaint.colour.display.view_transform import curve_of, lattice_of
from lightpaint.colour.primaries import to_8_bit
from lightpaint.images.packed_picture import BRIGHTEST, DROPPED_BITS, PackedPicture, pack_picture
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.report.measures import ReportedAnswer
from lightpaint.report.page.html import ROWS_SHOWN
from lightpaint.report.page.mixer import mixer_assets, mixer_html
from lightpaint.report.page.report_page import report_page

SIZE = (36, 64)
EVIL = "</script><script>document.title='x'</script>"


def light_basis(make_basis: Any, n: int, **options: Any) -> lp.Basis:
    """Soft spots of light of whitish colours, over 12 stops."""
    rng = np.random.default_rng(4)
    y, x = np.mgrid[: SIZE[0], : SIZE[1]] / SIZE[0]
    cy, cx = rng.uniform(0, 1, (2, n, 1, 1))
    distance = np.hypot(y - cy, x - 1.7 * cx)
    images = np.exp(-7 * distance)[..., None] * rng.uniform(0.6, 1, (n, 1, 1, 3))
    emission = rng.uniform(0.5, 1, (n, 3))
    emission[:, 0] = 1.2
    return make_basis(images=images, emission=emission, **options)


def solve_painting(basis: lp.Basis, **options: Any) -> tuple[lp.Target, lp.Solution]:
    """The answer to a painting of other weights."""
    weights = np.random.default_rng(1).uniform(0.1, 1.5, (len(basis.lights), 3))
    image = basis.mix(weights).astype(np.float32)
    target = lp.Target("evening", image, np.ones(SIZE, np.float32), everything=True, **options)
    return target, lp.solve(basis, target)


def report(basis: lp.Basis, **options: Any) -> str:
    """A whole report."""
    target, solution = solve_painting(basis, **options)
    predicted = lp.combine(basis, solution.lighting)
    report_data: dict[str, Any] = {"target": target, "solution": solution, "predicted": predicted}
    return report_page(
        ReportedAnswer(basis=basis, verification=None, command="lightpaint solve", **report_data)
    )


@pytest.fixture(scope="module")
def offline_tab(browser: Any) -> Iterator[tuple[Any, list[str]]]:
    """One tab without a network for all tests, and whatever goes wrong in it."""
    errors: list[str] = []
    context = browser.new_context(offline=True, viewport={"width": 1100, "height": 800})
    page = context.new_page()
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda line: errors.append(line.text) if line.type == "error" else None)
    page.on("requestfailed", lambda request: errors.append(request.url))
    yield page, errors
    context.close()


@pytest.fixture
def open_file(offline_tab: tuple[Any, list[str]], tmp_path: Path) -> Any:
    """Opens a page from a file; whatever goes wrong in it fails the test."""
    page, errors = offline_tab

    def open_text(text: str) -> Any:
        path = tmp_path / "report.html"
        path.write_text(text, encoding="utf-8")
        page.goto(path.as_uri())
        page.locator(".mixer-body").first.wait_for()
        return page

    yield open_text
    page.goto("about:blank")
    page.set_viewport_size({"width": 1100, "height": 800})
    page_errors, errors[:] = errors[:], []
    assert page_errors == []


def codes(basis: lp.Basis, weights: Any, transform: lp.ViewTransform) -> Any:
    """What is to be there."""
    return to_8_bit(transform.encode(basis.mix(np.asarray(weights)))).astype(np.int16)


def transform_of_report(basis: lp.Basis) -> lp.ViewTransform:
    """The transform of the report of `report(basis)`."""
    from lightpaint.report.answer_pictures import report_transform

    target, solution = solve_painting(basis)
    return report_transform(target, basis, lp.combine(basis, solution.lighting).image)


def move(page: Any, light: int, slider: int, value: float) -> None:
    """Move one of a light's sliders."""
    row = page.locator(".mixer-light").nth(light)
    row.locator("input[type=range]").nth(slider).evaluate(
        "(input, value) => { input.value = value; input.dispatchEvent(new Event('input')) }",
        str(value),
    )


def check(page: Any, expected: Any) -> None:
    """Within a code of the display, but for what rounding of the planes adds up to."""
    difference = np.abs(mixer_pixels(page) - expected)
    assert difference.mean() < 0.5
    assert difference.max() <= 2


def test_sliders_solo_and_mute_show_the_sum_of_the_planes(make_basis: Any, open_file: Any) -> None:
    basis = light_basis(make_basis, 3)
    transform, answer = transform_of_report(basis), solve_painting(basis)[1].weights
    page = open_file(report(basis))
    check(page, codes(basis, answer, transform))
    weights = answer.copy()
    # From the present by stops; the colour stays.
    y = np.array([0.2126, 0.7152, 0.0722])
    weights[1] *= 2**1.5 * (basis.current_weights[1] @ y) / (answer[1] @ y)
    move(page, 1, 0, 1.5)
    check(page, codes(basis, weights, transform))
    rows = page.locator(".mixer-light")
    rows.nth(1).get_by_text("S", exact=True).click()
    solo_weights = np.where(np.arange(3)[:, None] == 1, weights, 0)
    check(page, codes(basis, solo_weights, transform))
    rows.nth(1).get_by_text("S", exact=True).click()
    rows.nth(0).get_by_text("M", exact=True).click()
    check(page, codes(basis, np.where(np.arange(3)[:, None] == 0, 0, weights), transform))
    page.get_by_text("Reset to now").click()
    check(page, codes(basis, basis.current_weights, transform))
    move(page, 0, 0, -8)
    dark = basis.current_weights.copy()
    dark[0] = 0
    check(page, codes(basis, dark, transform))
    page.get_by_text("Reset to answer").click()
    check(page, codes(basis, answer, transform))


@pytest.mark.nightly
def test_selected_lights_are_dimmed_together_and_the_master_dims_all(
    make_basis: Any, open_file: Any
) -> None:
    basis = light_basis(make_basis, 3, names=("spot_a", "spot_b", "sky"))
    transform, answer = transform_of_report(basis), solve_painting(basis)[1].weights
    page = open_file(report(basis))
    page.get_by_role("searchbox", name="Select lights by a pattern").fill("SPOT_?")
    page.get_by_text("2 selected").wait_for()
    drag = """(slider, values) => values.forEach(([value, kind]) => {
        slider.value = value; slider.dispatchEvent(new Event(kind)) })"""
    dim = page.get_by_role("slider", name="Dim selected")
    dim.evaluate(drag, [[-3, "input"], [-1, "input"], [-1, "change"]])
    assert dim.input_value() == "0"
    weights = answer * np.array([0.5, 0.5, 1])[:, None]
    check(page, codes(basis, weights, transform))
    page.get_by_role("slider", name="Master").evaluate(drag, [[70, "input"]])
    check(page, codes(basis, 0.7 * weights, transform))
    # With Shift all from the last one; a colour keeps the level.
    page.get_by_role("searchbox").fill("")
    page.get_by_role("checkbox", name="Select spot_a").click()
    page.get_by_role("checkbox", name="Select sky").click(modifiers=["Shift"])
    page.get_by_text("3 selected").wait_for()
    page.get_by_label("sky: colour", exact=True).evaluate(drag, [["#ff0000", "input"]])
    weights[2] = [weights[2] @ [0.2126, 0.7152, 0.0722] / 0.2126, 0, 0]
    check(page, codes(basis, 0.7 * weights, transform))
    page.get_by_text("Reset to answer").click()
    check(page, codes(basis, answer, transform))


@pytest.mark.nightly
def test_a_gel_takes_its_light_and_another_takes_its_place(make_basis: Any, open_file: Any) -> None:
    basis = light_basis(make_basis, 2)
    transform, answer = transform_of_report(basis), solve_painting(basis)[1].weights
    page = open_file(report(basis))
    gel = page.get_by_label("Gel of the selected lights")
    assert gel.is_disabled()  # no light is selected
    page.get_by_role("checkbox", name="Select light 0").press("Space")
    white, y = basis.current_weights[0], np.array([0.2126, 0.7152, 0.0722])

    def filtered(x: float, y_: float, share: float, source: tuple[float, float]) -> Any:
        """Weights under a filter of published CIE x and y, and share of light that passes."""
        light, lamp = (_rgb_of_chromaticity(*xy) for xy in ((x, y_), source))
        factor = np.maximum(light, 0) / lamp
        return factor * share * (lamp @ y) / ((factor * lamp) @ y) * white

    open_level = (answer[0] @ y) / (white @ y)
    for text, weights in (
        ("r80", filtered(0.157, 0.209, 0.0595, (0.44757, 0.40745))),
        ("full c.t. orange", filtered(0.51, 0.42, 0.628, (0.4234, 0.399))),
        ("", white),
    ):
        gel.fill(text)
        gel.press("Enter")
        expected = answer.copy()
        expected[0] = open_level * weights
        check(page, codes(basis, expected, transform))
    gel.fill("9999")
    gel.press("Enter")
    page.get_by_text("no such gel").wait_for()
    check(page, codes(basis, expected, transform))


def _rgb_of_chromaticity(x: float, y: float) -> Any:
    """Linear Rec.709 of luminance 1."""
    to_rgb = [
        [3.2409699, -1.5373832, -0.4986108],
        [-0.9692436, 1.8759675, 0.0415551],
        [0.0556301, -0.203977, 1.0569715],
    ]
    return np.array(to_rgb) @ [x / y, 1, (1 - x - y) / y]


def test_kelvin_turns_the_colour_and_keeps_the_luminance(make_basis: Any, open_file: Any) -> None:
    basis = light_basis(make_basis, 2)
    transform, answer = transform_of_report(basis), solve_painting(basis)[1].weights
    page = open_file(report(basis))
    move(page, 0, 1, 1e6 / 3000)
    warm = np.asarray(kelvin_to_rgb(3000.0))
    weights = answer.copy()
    weights[0] = warm * (answer[0] @ [0.2126, 0.7152, 0.0722])
    check(page, codes(basis, weights, transform))
    assert "3000 K" in page.locator(".mixer-light").nth(0).inner_text()


@pytest.mark.nightly
def test_a_finger_scrolls_past_sliders(make_basis: Any, open_file: Any, browser: Any) -> None:
    """One that begins on them; sideways it moves them."""
    basis = light_basis(make_basis, 3)
    path = open_file(report(basis)).url
    context = browser.new_context(viewport={"width": 400, "height": 500}, has_touch=True)
    page = context.new_page()
    page.goto(path)
    finger = Finger(page)
    page.evaluate(
        "() => { window.scrolls = 0; addEventListener('pointercancel', () => window.scrolls++); }"
    )
    for k, slider in enumerate(page.locator(".mixer-light input[type=range]").all()[:2]):
        slider.evaluate("(one) => one.scrollIntoView({ block: 'center' })")
        box, value = slider.bounding_box(), float(slider.input_value())
        x, y = box["x"] + 0.2 * box["width"], box["y"] + box["height"] / 2
        finger.drag(*((x, y + 12 * k) for k in range(8)), *[(x, y + 84)] * 8)
        assert page.evaluate("window.scrolls") == k + 1
        assert float(slider.input_value()) == value
        slider.evaluate("(one) => one.scrollIntoView({ block: 'center' })")
        box = slider.bounding_box()
        y = box["y"] + box["height"] / 2
        finger.drag(*((x + 6 * k, y) for k in range(8)))
        part = slider.evaluate("(one) => (one.value - one.min) / (one.max - one.min)")
        assert part * box["width"] == pytest.approx(x + 42 - box["x"], abs=10)
    context.close()


@pytest.mark.nightly
def test_on_a_phone_nothing_parts_lights_and_buttons(make_basis: Any, open_file: Any) -> None:
    """But what is said of a copy, while it is; and nothing is wider than the phone."""
    page = open_file(report(light_basis(make_basis, 4)))
    gap_script = """() => document.querySelector('.mixer-light').getBoundingClientRect().top
        - document.querySelector('.mixer-buttons').getBoundingClientRect().bottom"""
    for width in (360, 400):
        page.set_viewport_size({"width": width, "height": 740})
        assert 8 < page.evaluate(gap_script) < 24
        assert page.evaluate("() => document.documentElement.scrollWidth") == width
    page.get_by_role("button", name="Copy as lighting.json").click()
    sentence = page.locator(".mixer-said")
    sentence.get_by_text("clipboard").or_(sentence.get_by_text("copy here")).wait_for()
    box, buttons, light = (
        page.locator(x).first.bounding_box()
        for x in (".mixer-said", ".mixer-buttons", ".mixer-light")
    )
    assert buttons["y"] + buttons["height"] <= box["y"]
    assert box["y"] + box["height"] <= light["y"]


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["filmic", "agx", "linear"])
def test_through_other_transforms(make_basis: Any, open_file: Any, name: str) -> None:
    basis = light_basis(make_basis, 3)
    transform = lp.ViewTransform(name, 0.5)
    lighting = solve_painting(basis)[1].lighting
    text = mixer_html(basis, lighting, transform=transform) + mixer_assets()
    page = open_file(f"<!doctype html><body>{text}")
    difference = np.abs(mixer_pixels(page) - codes(basis, lighting.weights_for(basis), transform))
    assert difference.mean() < 1


def test_what_is_copied_is_read(make_basis: Any, open_file: Any, tmp_path: Path) -> None:
    """Names, whatever they are, are text on the page and in the file."""
    basis = light_basis(make_basis, 3, names=(EVIL, 'a "b" <i>', "key"))
    page = open_file(report(basis))
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    assert page.title().startswith("evening")
    assert [x.inner_text() for x in page.locator(".mixer-name").all()] == list(basis.names)
    move(page, 2, 0, -1.0)
    page.get_by_text("Copy as lighting.json").click()
    page.get_by_text("is on the clipboard").wait_for()
    (tmp_path / "lighting.json").write_text(page.evaluate("navigator.clipboard.readText()"))
    lighting = lp.read_lighting(tmp_path / "lighting.json")
    answer = solve_painting(basis)[1].weights
    weights = lighting.weights_for(basis)
    # As the answer has them to the last bit, but for the one that was moved.
    np.testing.assert_array_equal(weights[:2], answer[:2])
    level = weights[2] @ [0.2126, 0.7152, 0.0722]
    luminance = basis.current_weights[2] @ [0.2126, 0.7152, 0.0722]
    assert level == pytest.approx(luminance / 2, rel=1e-9)
    assert lighting.certificate is None
    page.get_by_text("Copy command").click()
    page.get_by_text("The command is on the clipboard").wait_for()
    copied = page.evaluate("navigator.clipboard.readText()")
    assert copied == "lightpaint relight scene.xml lighting.json"


@pytest.mark.nightly
def test_of_hundreds_of_lights_the_rest_is_one(make_basis: Any, open_file: Any) -> None:
    basis = light_basis(make_basis, 60)
    transform, answer = transform_of_report(basis), solve_painting(basis)[1].weights
    page = open_file(report(basis))
    assert page.locator(".mixer-light").count() == ROWS_SHOWN + 1
    check(page, codes(basis, answer, transform))
    page.get_by_text("Reset to now").click()
    check(page, codes(basis, basis.current_weights, transform))
    data = json.loads(page.locator(".mixer script").inner_text())
    [rest] = data["joint"]
    assert len(rest["answer"]) == 60 - ROWS_SHOWN
    remaining = [basis.names.index(name) for name in rest["present"]]
    weights = basis.current_weights.copy()
    weights[remaining] *= 2
    move(page, ROWS_SHOWN, 0, 1)
    check(page, codes(basis, weights, transform))


@pytest.mark.nightly
def test_an_image_is_one_row_with_its_map(make_basis: Any, open_file: Any) -> None:
    names = ["bulb", *(f"sky.x{x}.y{y}" for y in range(3) for x in range(4))]
    basis = light_basis(make_basis, 13, names=names)
    lights = [
        replace(x, plugin="envmap" if x.name.startswith("sky") else "point") for x in basis.lights
    ]
    basis = replace(basis, lights=tuple(lights))
    transform, answer = transform_of_report(basis), solve_painting(basis)[1].weights
    page = open_file(report(basis))
    assert page.locator(".mixer-light").count() == 2
    check(page, codes(basis, answer, transform))
    page.get_by_text("Reset to now").click()
    check(page, codes(basis, basis.current_weights, transform))
    weights = basis.current_weights.copy()
    weights[1:] *= 2
    move(page, 1, 0, 1)
    check(page, codes(basis, weights, transform))
    thumb = page.locator(".mixer-light canvas").nth(1)
    assert thumb.evaluate("map => [map.width, map.height]") == [88, 66]
    page.evaluate("navigator.clipboard.writeText = async (text) => { window.copied = text; }")
    page.get_by_text("Copy as lighting.json").click()
    copied = json.loads(page.evaluate("window.copied"))["lights"]
    np.testing.assert_allclose(copied["sky.x2.y1"]["emission"], weights[7], rtol=1e-9)


def test_the_wipe(make_basis: Any, open_file: Any) -> None:
    page = open_file(report(light_basis(make_basis, 2)))
    stage = page.locator(".mixer-stage")
    box = stage.bounding_box()
    # The mix is whole at first: in the painting no slider changes anything.
    tag = page.locator(".mixer-stage .wipe-tag", has_text="painting")
    assert page.get_by_role("slider", name="Wipe: how much").input_value() == "0"
    assert not tag.is_visible()
    stage.click(position={"x": 0.25 * box["width"], "y": 20})
    part = float(stage.evaluate("x => x.style.getPropertyValue('--p')").rstrip("%"))
    assert part == pytest.approx(25, abs=1)
    assert tag.is_visible()


def test_axe_finds_nothing_in_the_mixer(make_basis: Any, open_file: Any, axe: str) -> None:
    page = open_file(report(light_basis(make_basis, 3)))
    page.evaluate(axe)
    assert violations(page, ".mixer") == []


def test_without_scripts_a_report_is_as_it_was(
    make_basis: Any, browser: Any, tmp_path: Path
) -> None:
    (tmp_path / "report.html").write_text(report(light_basis(make_basis, 2)), encoding="utf-8")
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto((tmp_path / "report.html").as_uri())
    assert not page.locator(".mixer").is_visible()
    assert page.locator("#lights").is_visible()
    context.close()


def test_twelve_lights_of_noise_can_be_mailed(make_basis: Any) -> None:
    """Independent noise in every pixel is the worst there is to compress."""
    basis = make_basis(12, (360, 640))
    page = mixer_html(basis, Lighting.current(basis))
    assert len(page) + len(mixer_assets()) < 6_000_000


def _unpack(packed: PackedPicture) -> Any:
    """The picture (h, w, 3) of packed data, pixel by pixel as in `mixer_data.js`."""
    height, width = packed.size
    data = np.frombuffer(zlib.decompress(packed.data), np.uint8).astype(np.int32)
    folded = (data[: data.size // 2] | data[data.size // 2 :] << 8).reshape(3, height, width)
    residuals = (folded >> 1) ^ -(folded & 1)
    planes = np.zeros((3, height + 1, width + 1), np.int32)
    for y in range(1, height + 1):
        for x in range(1, width + 1):
            left, above, corner = planes[:, y, x - 1], planes[:, y - 1, x], planes[:, y - 1, x - 1]
            plane = np.clip(left + above - corner, np.minimum(left, above), np.maximum(left, above))
            planes[:, y, x] = residuals[:, y - 1, x - 1] + plane
    green, red, blue = planes[:, 1:, 1:]
    codes = np.stack([red + green, green, blue + green], axis=-1)
    halves = np.asarray(codes << packed.dropped, np.uint16).view(np.float16)
    return np.asarray(halves.astype(np.float32) * np.float32(packed.scale))


@pytest.mark.parametrize("dropped", [0, DROPPED_BITS])
def test_a_compact_picture_is_the_picture(dropped: int) -> None:
    rng = np.random.default_rng(0)
    image = np.exp2(rng.uniform(-12, 9, (7, 11, 3))).astype(np.float32)
    image[2, 3], image[4] = 0, [0, 5, 1e-9]
    packed = pack_picture(image, dropped=dropped)
    assert packed.scale * BRIGHTEST >= image.max()
    unpacked = _unpack(packed)
    # Rounded to the 11 bits of halves, then to those that are left; and there is a least value.
    rtol = 2.0**-11 + (2.0 ** (dropped - 11) if dropped else 0)
    np.testing.assert_allclose(unpacked, image, rtol=rtol, atol=packed.scale * 2.0**-20)
    assert not unpacked[2, 3].any()


def test_a_lattice_has_what_the_transform_has_at_its_points() -> None:
    transform = lp.ViewTransform("agx", 1.0)
    axis = np.r_[0.0, 2.0 ** np.linspace(-4, 2, 4)[1:]]
    lattice = lattice_of(transform, 4, -4, 2)
    expected = transform.encode(np.array([axis[3], axis[1], axis[0]]))
    np.testing.assert_allclose(lattice[3, 1, 0], expected, atol=1e-6)
    curve = curve_of(lp.ViewTransform("filmic"), 4, -4, 2)
    np.testing.assert_allclose(curve, lp.ViewTransform("filmic").encode(axis), atol=1e-6)
