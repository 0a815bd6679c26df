"""The gallery in a browser: failures first, filter, order, two under a border, lights, mixer."""

import io
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from axe import axe_source, violations
from batches import NAMES, run_whole_batch, small_basis, write_batch
from command import succeed
from mixer_canvas import mixer_pixels
from PIL import Image

from lightpaint.basis.lights import BasisLight
from lightpaint.batch.gallery import summary
from lightpaint.batch.gallery.gallery_page import (
    gallery_page,
    planes_name,
    read_planes,
    write_planes,
)
from lightpaint.batch.gallery.summary import NARROW, WIDE, LightRow, SummaryRow, lights_of_answer
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.colour.primaries import to_8_bit
from lightpaint.images.estimate import Estimate, write_estimate
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.answer.lighting_file import read_lighting, write_lighting


@pytest.fixture
def page(browser: Any) -> Iterator[Any]:
    """A page that may load nothing from a network and complain of nothing."""
    new_page, messages = browser.new_page(viewport={"width": 1100, "height": 800}), []
    new_page.on("console", lambda message: messages.append(message.text))
    new_page.on("pageerror", lambda error: messages.append(str(error)))
    new_page.route("http*://**", lambda route: messages.append(route.request.url) or route.abort())
    yield new_page
    new_page.close()
    assert messages == []


@pytest.fixture(scope="module")
def batch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a batch of three lights."""
    folder = tmp_path_factory.mktemp("batch")
    run_whole_batch(str(write_batch(folder)), str(folder / "out"))
    return folder / "out"


def _names(page: Any) -> list[str]:
    return list(page.locator("#cards .name").all_text_contents())


@pytest.mark.nightly
def test_two_looks_under_a_border(page: Any, batch: Path) -> None:
    page.goto((batch / "index.html").as_uri())
    assert _names(page) == NAMES
    assert page.locator("#wipe").is_hidden()
    page.get_by_label("p0 as A", exact=True).click()
    assert page.locator("#wipe").is_hidden()
    assert page.locator("#tray").is_visible()
    page.get_by_label("dusk-1 as B", exact=True).click()
    page.locator("#wipe").wait_for()
    assert page.locator(".stage span").all_text_contents() == ["p0", "dusk-1"]
    page.wait_for_function(
        "[...document.querySelectorAll('.stage img')].every(x => x.naturalWidth)"
    )
    page.locator("#slide").fill("25")
    assert page.locator(".stage").evaluate("x => x.style.getPropertyValue('--p')") == "25%"
    # The lights of both, with what changes, those that change most first.
    changes = page.locator("#beside-body td:last-child").all_text_contents()
    sizes = [abs(float(x.replace("−", "-"))) for x in changes]
    assert sizes == sorted(sizes, reverse=True)
    page.get_by_text("Swap").click()
    assert page.locator(".stage span").all_text_contents() == ["dusk-1", "p0"]
    page.get_by_label("Next look").click()
    assert page.locator(".stage span").all_text_contents() == ["dusk-1", "p1"]
    page.keyboard.press("Escape")
    page.locator("#wipe").wait_for(state="hidden")
    page.get_by_label("p1 as A", exact=True).click()
    assert page.locator("[data-side=a][aria-pressed=true]").count() == 1


def test_one_look_large(page: Any, batch: Path) -> None:
    page.goto((batch / "index.html").as_uri())
    page.get_by_label("Enlarge third", exact=True).click()
    page.locator("#wipe").wait_for()
    assert page.locator("#slide").is_hidden()
    assert page.locator("#beside-body tr").count() == 3
    page.keyboard.press("ArrowRight")
    assert page.locator("#pair").text_content() == "dusk-0"
    page.get_by_text("Close").click()
    page.locator("#tray").wait_for(state="hidden")


def test_links_lead_to_what_is_there_and_lights_to_each_look(page: Any, batch: Path) -> None:
    page.goto((batch / "index.html").as_uri())
    links = page.locator("a").evaluate_all("all => all.map((x) => x.href)")
    assert len(links) > len(NAMES)
    assert all(Path(link.removeprefix("file://")).is_file() for link in links)
    page.get_by_role("tab", name="Lights").click()
    assert page.locator("#lights tbody tr").count() == len(NAMES)
    heads = page.locator("#lights thead th").all_text_contents()
    assert heads == ["look", "lamp 0", "lamp 1", "lamp 2"]
    page.locator("#filter").fill("dusk")
    assert page.locator("#lights tbody th").all_text_contents() == ["dusk-0", "dusk-1", "dusk-2"]


#: The canvas of the mixer that is open.
OPEN_MIX = ".mixer:not([hidden]) .mixer-mix"


def test_every_look_can_be_mixed_from_planes_that_are_there_once(page: Any, batch: Path) -> None:
    page.goto((batch / "index.html").as_uri())
    basis = small_basis()
    looks = json.loads((batch / "summary.json").read_text(encoding="utf-8"))["looks"]
    views = {look["look"]: look["view"] for look in looks}
    assert page.locator(".mixer").count() == 1
    for name in ("p1", "dusk-1", "p0-warmer"):
        page.locator(".card", has=page.get_by_text(name, exact=True)).get_by_label(
            f"Mix the lights of {name}", exact=True
        ).click()
        page.locator(".mixer:not([hidden]) .mixer-body").wait_for()
        assert page.locator("#from option:checked").text_content() == name
        weights = read_lighting(batch / name / "lighting.json").weights_for(basis)
        expected = to_8_bit(ViewTransform(*views[name]).encode(basis.mix(weights)))
        # Until what has begun is drawn: another look's picture is far off.
        page.wait_for_function("document.querySelectorAll('.mixer-light').length === 3")
        for _ in range(50):
            difference = np.abs(mixer_pixels(page, OPEN_MIX) - expected.astype(np.int16))
            if difference.max() <= 2:
                break
            page.wait_for_timeout(100)
        assert difference.max() <= 2  # a code of rounding of the planes, and of their sum
        page.get_by_role("tab", name="Looks").click()
    page.get_by_role("tab", name="Mixer").click()
    page.get_by_role("searchbox", name="Select lights by a pattern").fill("*")
    gel = page.get_by_label("Gel of the selected lights")
    gel.fill("201")
    gel.press("Enter")
    page.get_by_text("Lee 201, \u22121.").wait_for()
    for swatch in page.locator(".mixer:not([hidden]) .mixer-swatch").all():
        code = swatch.input_value()
        assert int(code[1:3], 16) < int(code[5:7], 16) == 255  # bluer than the lamp's own white


@pytest.mark.nightly
def test_of_many_lights_those_that_do_most_have_sliders(page: Any, tmp_path: Path) -> None:
    small = small_basis()
    lights = tuple(replace(small.lights[0], name=f"lamp {k}") for k in range(60))
    images = np.repeat(small.images, 20, 0)
    large_basis = replace(small, lights=lights, planes=images, noise=0 * images)
    key = '{"view": 0}'
    write_planes(tmp_path, key, large_basis)
    run_whole_batch(str(write_batch(tmp_path)), str(tmp_path / "out"))
    (tmp_path / "many").mkdir()
    text = (tmp_path / "out" / "p0" / "lighting.json").read_text(encoding="utf-8")
    (tmp_path / "many" / "lighting.json").write_text(text, encoding="utf-8")
    light_rows = tuple(
        LightRow(light.name, 0.0 if k < 20 else 1.0, (1.0, 1.0, 1.0))
        for k, light in enumerate(lights)
    )
    rows = [SummaryRow("many", "done", "", "many", lights=light_rows)]
    name = planes_name(tmp_path, key)
    page_text = gallery_page(tmp_path, "many", rows, {"many": name})
    (tmp_path / "index.html").write_text(page_text, encoding="utf-8")
    page.goto((tmp_path / "index.html").as_uri())
    page.get_by_role("tab", name="Mixer").click()
    page.locator(".mixer-light").first.wait_for()
    assert page.locator(".mixer-light").count() == 40
    assert page.locator(".mixer-name").first.text_content() == "lamp 20"


@pytest.mark.nightly
def test_an_image_is_one_row_of_the_mixer_and_one_column(page: Any, tmp_path: Path) -> None:
    small = small_basis()
    names = ["lamp", *(f"sky.x{x}.y{y}" for y in range(3) for x in range(4))]
    lights = tuple(replace(small.lights[0], name=name, members=(name,)) for name in names)
    images = np.repeat(small.images[:1], 13, 0)
    basis = replace(small, lights=lights, planes=images, noise=0 * images)
    key = '{"view": 0}'
    write_planes(tmp_path, key, basis)
    run_whole_batch(str(write_batch(tmp_path)), str(tmp_path / "out"))
    (tmp_path / "sky").mkdir()
    text = (tmp_path / "out" / "p0" / "lighting.json").read_text(encoding="utf-8")
    (tmp_path / "sky" / "lighting.json").write_text(text, encoding="utf-8")
    levels = [1.0, *([0.02] * 4), *([0.06] * 4), *([0.01] * 4)]
    light_rows = tuple(LightRow(x, y, (y, y, y)) for x, y in zip(names, levels, strict=True))
    rows = [SummaryRow("sky", "done", "", "sky", lights=light_rows)]
    page_text = gallery_page(tmp_path, "sky", rows, {"sky": planes_name(tmp_path, key)})
    (tmp_path / "index.html").write_text(page_text, encoding="utf-8")
    page.goto((tmp_path / "index.html").as_uri())
    page.get_by_role("tab", name="Lights").click()
    heads = page.locator("#lights-head th").all_text_contents()
    assert heads == ["look", "lamp", "sky"]
    assert page.locator("#lights-body td").last.text_content() == "0.03"
    page.get_by_role("tab", name="Mixer").click()
    page.locator(".mixer-light").first.wait_for()
    assert page.locator(".mixer-name").all_text_contents() == ["lamp", "sky"]

    def brightness() -> float:
        picture = page.locator(".mixer-mix").screenshot()
        return float(np.asarray(Image.open(io.BytesIO(picture)).convert("RGB")).mean())

    slider = page.get_by_role("slider", name="sky: stops from now")
    levels_seen = []
    for stops in (-8, 0, 1):  # off, as in the look, twice as bright
        slider.evaluate(f"x => {{ x.value = '{stops}'; x.dispatchEvent(new Event('input')) }}")
        page.wait_for_timeout(60)
        levels_seen.append(brightness())
    assert levels_seen[0] < levels_seen[1] < levels_seen[2]


def symmetric_sky() -> tuple[BasisLight, ...]:
    """Lights of a symmetric sky of 4x3 texels."""
    pairs = [[f"sky.x{x}.y{y}", f"sky.x{3 - x}.y{y}"] for y in range(3) for x in range(2)]
    light = replace(small_basis().lights[0], plugin="envmap", is_fixed=False)
    return tuple(replace(light, name=pair[0], members=tuple(pair)) for pair in pairs)


@pytest.mark.nightly
def test_a_symmetric_image_shows_both_halves(page: Any, tmp_path: Path) -> None:
    small, lights, key = small_basis(), symmetric_sky(), '{"view": 0}'
    images = np.repeat(small.images[:1], 6, 0)
    basis = replace(small, lights=lights, planes=images, noise=0 * images)
    write_planes(tmp_path, key, basis)
    (tmp_path / "sky").mkdir()
    write_lighting(tmp_path / "sky" / "lighting.json", Lighting.current(basis))
    levels = [1.0, 0.1, 0.5, 0.5, 0.5, 0.5]
    light_rows = tuple(LightRow(x.name, y, (y, y, y)) for x, y in zip(lights, levels, strict=True))
    rows = [SummaryRow("sky", "done", "", "sky", lights=light_rows)]
    page_text = gallery_page(tmp_path, "sky", rows, {"sky": planes_name(tmp_path, key)})
    (tmp_path / "index.html").write_text(page_text, encoding="utf-8")
    page.goto((tmp_path / "index.html").as_uri())
    page.get_by_role("tab", name="Mixer").click()
    canvas = page.locator(".mixer-light canvas").first
    canvas.wait_for()
    pixels = canvas.evaluate(
        "x => [x.width, x.height, [...x.getContext('2d').getImageData(0, 0, x.width, 1).data]]"
    )
    width, height, top = pixels[0], pixels[1], np.array(pixels[2]).reshape(-1, 4)[:, 0]
    assert height == round(width * 3 / 4)
    np.testing.assert_allclose(top, top[::-1], atol=2)
    assert top[0] > top[width // 2 - 1]


def test_the_mean_of_an_image_is_over_what_it_covers(tmp_path: Path) -> None:
    small, lights = small_basis(), symmetric_sky()
    images = np.repeat(small.images[:1], 6, 0)
    basis = replace(small, lights=lights, planes=images, noise=0 * images)
    write_lighting(tmp_path / "lighting.json", Lighting.current(basis))
    shares = [row.share for row in lights_of_answer(tmp_path, {})]
    pole = (1 - 2 / np.pi) / 2 / 2  # two of the four texels at a pole
    np.testing.assert_allclose(shares, [pole, pole, *([0.5 - 2 * pole] * 2), pole, pole])


def two_mixers(folder: Path) -> tuple[Path, dict[str, str]]:
    """A gallery of two looks, `slow` and `quick`, and the planes of each."""
    rows, names = [], {}
    for name in ("slow", "quick"):
        basis, key = small_basis(), json.dumps({"view": name})
        write_planes(folder, key, basis)
        lights = tuple(LightRow(light.name, 1.0, (1.0, 1.0, 1.0)) for light in basis.lights)
        (folder / name).mkdir()
        write_lighting(folder / name / "lighting.json", Lighting.current(basis))
        rows.append(SummaryRow(name, "done", "", name, lights=lights))
        names[name] = planes_name(folder, key)
    index = folder / "index.html"
    index.write_text(gallery_page(folder, "two", rows, names), encoding="utf-8")
    return index, names


#: What is unpacked while `isHeld` waits for `go()`, which is over when its readers have it.
HELD = """{
  const { arrayBuffer } = Response.prototype, read = [];
  let open;
  const gate = new Promise((done) => { open = done; });
  window.isHeld = true;
  Response.prototype.arrayBuffer = function () {
    const made = (isHeld ? gate : Promise.resolve()).then(() => arrayBuffer.call(this));
    read.push(made);
    return made;
  };
  window.go = async () => {
    open();
    await Promise.all(read);
    await new Promise((done) => setTimeout(done));
  };
}"""


@pytest.mark.nightly
def test_of_two_mixers_the_one_that_was_asked_for_last_is_shown(page: Any, tmp_path: Path) -> None:
    page.add_init_script(HELD)
    index, names = two_mixers(tmp_path)
    page.goto(index.as_uri())
    page.get_by_role("tab", name="Mixer").click()
    page.evaluate("() => { isHeld = false; }")
    page.locator("#from").select_option(label="quick")
    page.locator(".mixer-body").wait_for()
    page.evaluate("() => go()")
    visible = page.locator(".mixer:visible")
    assert [mixer.get_attribute("data-basis") for mixer in visible.all()] == [names["quick"]]


def test_what_a_browser_lacks_for_a_mixer_is_said(page: Any, tmp_path: Path) -> None:
    page.add_init_script("delete window.DecompressionStream")
    page.goto(two_mixers(tmp_path)[0].as_uri())
    page.get_by_role("tab", name="Mixer").click()
    page.get_by_text("one that has DecompressionStream").wait_for()


def test_planes_are_written_once_and_follow_their_basis(tmp_path: Path) -> None:
    basis, key = small_basis(), json.dumps({"basis": {"path": f"{tmp_path}/b.basis.exr"}})
    path = tmp_path / "out" / "thumbnails" / f"{planes_name(tmp_path / 'out', key)}.planes.json"
    write_planes(tmp_path / "out", key, basis)
    planes, before = read_planes(path), path.stat().st_ino
    assert [x["name"] for x in planes["lights"]] == list(basis.names)
    write_planes(tmp_path / "out", key, basis)
    assert path.stat().st_ino == before
    write_planes(tmp_path / "out", key, small_basis(seed=1))
    assert read_planes(path)["planes"] != planes["planes"]
    # Found again where all of it was moved.
    other = json.dumps({"basis": {"path": f"{tmp_path}/there/b.basis.exr"}})
    assert planes_name(tmp_path / "there" / "out", other) == path.name.split(".")[0]
    assert read_planes(tmp_path / "none") == {}


def write_many_looks(folder: Path, count: int = 1000) -> Path:
    """A page of so many looks, one of which failed."""
    lights = (LightRow("<b>key", 0.0), LightRow("fill", 2.5, hex="#ff8800", stops=-1.25))
    rows = [SummaryRow("broken", "failed", "no such file: <i>x</i>", "broken")]
    rows += [
        SummaryRow(f"look {k}", "done", "", f"look {k}", delta_e=k % 17 / 2, lights=lights)
        for k in range(count)
    ]
    (folder / "index.html").write_text(gallery_page(folder, "many", rows), encoding="utf-8")
    return folder / "index.html"


@pytest.mark.nightly
def test_a_thousand_looks_are_filtered_and_ordered(page: Any, tmp_path: Path) -> None:
    page.goto(write_many_looks(tmp_path).as_uri())
    assert page.locator("#count").text_content() == "1001 of 1001"
    assert page.locator("#mixer-tab").is_hidden()
    assert _names(page)[0] == "broken"
    assert page.locator(".why").text_content() == "no such file: <i>x</i>"
    page.locator("#filter").fill("LOOK 99")
    assert len(_names(page)) == 19  # with both words, in any place
    page.locator("#filter").fill("nothing at all")
    assert page.get_by_text("No look matches").is_visible()
    page.locator("#filter").fill("")
    page.locator("#order").select_option("look")
    assert _names(page)[:4] == ["broken", "look 0", "look 1", "look 2"]
    page.locator("#order").select_option("delta_e")
    assert _names(page)[0] == "look 16"
    page.get_by_role("tab", name="Lights").click()
    cells = page.locator("#lights tbody tr").first.locator("td").all_text_contents()
    assert cells == ["off", "2.5"]
    page.locator("#unit").select_option("stops")
    cells = page.locator("#lights tbody tr").first.locator("td").all_text_contents()
    assert cells == ["off", "−1.3"]
    page.get_by_role("tab", name="Looks").click()
    page.locator("#state").select_option("failed")
    assert _names(page) == ["broken"]


@pytest.mark.nightly
def test_axe_finds_nothing(page: Any, batch: Path) -> None:
    source = axe_source()
    page.goto((batch / "index.html").as_uri())
    page.evaluate(source)
    assert violations(page) == []
    page.get_by_label("p0 as A", exact=True).click()
    assert violations(page) == []
    page.get_by_label("third as B", exact=True).click()
    page.locator("#wipe").wait_for()
    assert violations(page) == []
    page.keyboard.press("Escape")
    page.get_by_role("tab", name="Lights").click()
    assert violations(page) == []
    page.get_by_role("tab", name="Mixer").click()
    page.locator(".mixer:not([hidden]) .mixer-body").wait_for()
    assert violations(page) == []


@pytest.mark.nightly
def test_several_paintings_of_solve_are_mixed_as_well(page: Any, tmp_path: Path) -> None:
    write_batch(tmp_path)
    succeed(tmp_path, "solve", "b.basis.exr", "p0.exr", "p1.exr", "-o", "out")
    page.goto((tmp_path / "out" / "index.html").as_uri())
    page.get_by_label("Mix the lights of p1", exact=True).click()
    page.locator(".mixer:not([hidden]) .mixer-body").wait_for()


@pytest.mark.parametrize(("widest", "width"), [(WIDE, 600), (NARROW, 300)])
def test_pictures_of_few_looks_fill_a_window(tmp_path: Path, widest: int, width: int) -> None:
    """Those of many are half as wide: their page would be too large."""
    image = np.full((8, 600, 3), 0.2, np.float32)
    (tmp_path / "p0").mkdir()
    write_estimate(tmp_path / "p0" / "predicted.exr", Estimate(image, 0 * image), {})
    row = SummaryRow("p0", "done", "", "p0")
    for _ in range(2):  # made, and found
        picture_row = summary._with_picture(row, tmp_path, tmp_path / "p0", None, "key", widest)
        assert picture_row.size[0] == width
    with Image.open(tmp_path / picture_row.picture) as picture:
        assert picture.size == picture_row.size
