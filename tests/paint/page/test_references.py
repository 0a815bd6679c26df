"""Reference pictures beside the canvas: they come by file, drop and clipboard."""

import io
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from axe import violations
from painter_page import Painter
from PIL import Image

import lightpaint as lp
from lightpaint.paint.server.page_server import Server
from lightpaint.paint.store.session_file import Store
from lightpaint.paint.studio.session_studio import Studio
from lightpaint.paint.subject_factory import make_subject
from lightpaint.pipeline.job.sources import BasisFile

H, W = 60, 100

#: Gives the painter a file, as a drop or a paste.
GIVE = """([kind, name, type, bytes, selector]) => {
  const data = new DataTransfer();
  data.items.add(new File([new Uint8Array(bytes)], name, { type }));
  const options = { bubbles: true, cancelable: true };
  const event = kind === 'paste'
    ? new ClipboardEvent(kind, { ...options, clipboardData: data })
    : new DragEvent(kind, { ...options, dataTransfer: data });
  document.querySelector(selector).dispatchEvent(event);
}"""


def png(colour: tuple[int, int, int] = (220, 140, 60)) -> bytes:
    """Return a picture that is bright at its top and dark at its bottom."""
    file = io.BytesIO()
    ramp = np.linspace(1, 0.2, 30)[:, None, None] * np.array(colour) * np.ones((30, 40, 1))
    Image.fromarray(ramp.astype(np.uint8)).save(file, format="png")
    return file.getvalue()


def give(page: Any, kind: str, name: str, data: bytes, selector: str = ".stage") -> None:
    mime = "" if name.endswith((".exr", ".ora")) else "image/png"
    page.evaluate(GIVE, [kind, name, mime, list(data), selector])


def at(page: Any, selector: str, x: float, y: float) -> tuple[float, float]:
    """Return a place of the page. x, y: as shares of what `selector` finds."""
    box = page.locator(selector).first.bounding_box()
    return box["x"] + x * box["width"], box["y"] + y * box["height"]


@pytest.fixture
def room(new_painter: Any, axe: str) -> Painter:
    painter: Painter = new_painter("lights=5", axe=axe)
    return painter


def test_references_come_by_file_drop_and_clipboard_and_one_is_shown(room: Painter) -> None:
    page = room.page
    room.button("References").click()
    assert page.get_by_text("A picture whose light you want here.").is_visible()
    assert violations(page, ".lightpaint") == []
    with page.expect_file_chooser() as chooser:
        room.button("Choose a file …").click()
    chooser.value.set_files({"name": "dusk.png", "mimeType": "image/png", "buffer": png()})
    room.still()
    give(page, "drop", "dawn.jpg", b"dawn", ".stage")
    room.still()
    give(page, "paste", "image.png", b"clip", "body")
    room.still()
    give(page, "drop", "sun.exr", b"sun", ".reference-pane")
    room.still()
    assert [one["name"] for one in room.requests("add_reference")] == [
        "dusk.png",
        "dawn.jpg",
        "image.png",
        "sun.exr",
    ]
    assert [one["name"] for one in room.ui("references")] == ["dusk", "dawn", "image", "sun"]
    assert page.locator(".reference-name").inner_text() == "sun"
    assert page.locator(".reference-list [aria-current]").get_attribute("aria-label") == "Show sun"
    assert not room.ui("isReferenceComing")
    room.button("Show dawn").click()
    assert violations(page, ".lightpaint") == []
    room.button("Remove dawn").click()
    room.still()
    assert room.requests("drop_reference")[-1]["reference"] == 2
    assert [one["name"] for one in room.ui("references")] == ["dusk", "image", "sun"]
    room.button("Close the references").click()
    assert page.locator(".reference-pane").count() == 0


@pytest.mark.nightly
def test_the_pictures_make_room_for_the_references(room: Painter) -> None:
    page = room.page
    before = page.locator(".stage").bounding_box()["width"]
    room.button("References").click()
    room.still()
    pane, stage = (page.locator(x).bounding_box() for x in (".reference-pane", ".stage"))
    assert stage["x"] + stage["width"] == pytest.approx(pane["x"], abs=1)
    assert stage["width"] + pane["width"] == pytest.approx(before, abs=1)
    page.set_viewport_size({"width": 720, "height": 720})
    room.still()
    assert page.locator(".stage").bounding_box()["width"] > 600
    assert page.locator(".reference-pane").bounding_box()["width"] <= 300


@pytest.mark.nightly
def test_a_dropped_exr_may_be_a_reference_or_layers(room: Painter) -> None:
    page = room.page
    give(page, "drop", "sky.exr", b"light")
    room.button("Use it as a reference").click()
    room.still()
    give(page, "drop", "layers.exr", b"layers")
    room.button("Put them on top").click()
    room.still()
    give(page, "drop", "sky.exr", b"light")
    room.button("Cancel").click()
    assert [one["name"] for one in room.requests("add_reference")] == ["sky.exr"]
    assert [one["name"] for one in room.requests("import_layers")] == ["layers.exr"]


@pytest.mark.nightly
def test_a_paste_into_a_field_is_no_reference(room: Painter) -> None:
    room.page.get_by_role("searchbox").first.focus()
    give(room.page, "paste", "image.png", b"clip", "input[type=search]")
    give(room.page, "paste", "song.ora", b"clip", "body")
    assert room.requests("add_reference") == []


def test_look_like_this_asks_what_is_chosen(room: Painter) -> None:
    give(room.page, "drop", "dusk.png", png())
    room.still()
    room.button("Look like this").click()
    room.button("Whole", exact=True).click()
    room.page.get_by_role("checkbox", name="As bright as it").check()
    room.button("Look like this").click()
    first, second = room.requests("look_like")
    assert (first["areas"], first["matches_brightness"], first["reference"]) == (
        "regions",
        False,
        1,
    )
    assert (second["areas"], second["matches_brightness"]) == ("whole", True)
    assert room.ui("open")["layers"]


@pytest.mark.nightly
def test_pairs_of_places_are_pressed_listed_and_removed(room: Painter) -> None:
    page = room.page
    give(page, "drop", "dusk.png", png())
    room.still()
    room.button("Places", exact=True).click()
    assert room.button("Look like this").is_disabled()
    for x, further in ((0.25, 0), (0.75, 0.2)):
        page.mouse.click(*at(page, ".reference-picture", x, 0.5))
        assert page.get_by_text("Now press the place in the picture").is_visible()
        page.mouse.click(*room.place(further))
    page.mouse.click(*at(page, ".reference-picture", 0.5, 0.5))
    page.keyboard.press("Escape")
    page.keyboard.press("Escape")
    room.still()
    assert page.locator(".pair-list li").count() == 2
    assert page.locator(".stage .pair-mark").count() >= 2
    assert room.calls("begin") == []
    assert violations(page, ".lightpaint") == []
    room.button("Look like this").click()
    [asked] = room.requests("look_like")
    assert asked["areas"] == "pairs"
    places = [(pair["reference"], pair["picture"]) for pair in asked["pairs"]]
    np.testing.assert_allclose([place[0][0] for place in places], [0.25, 0.75], atol=0.02)
    np.testing.assert_allclose([place[1] for place in places], [[0.4, 0.5], [0.6, 0.5]], atol=0.2)
    room.button("Remove pair 1").click()
    room.still()
    assert page.locator(".pair-list li").count() == 1


@pytest.mark.nightly
def test_places_are_pressed_by_keyboard(room: Painter) -> None:
    page = room.page
    give(page, "drop", "dusk.png", png())
    room.still()
    room.button("Places", exact=True).click()
    page.locator(".reference-picture").focus()
    for key in ("ArrowLeft", "ArrowUp", "Enter"):
        page.keyboard.press(key)
    page.locator(".stage").focus()
    page.keyboard.press("Enter")
    room.still()
    [pair] = room.ui("placePairs")
    np.testing.assert_allclose(pair["reference"], [0.48, 0.48])


@pytest.fixture
def studio(make_basis: Any, tmp_path: Path) -> Iterator[Studio]:
    """A painter of a room that two lights reach from above and from below."""
    y = np.mgrid[:H, :W][0][..., None] / H
    images = np.array([0.1 + (1 - y) * np.ones(3), 0.1 + y * np.array([0.7, 0.8, 1])])
    basis = make_basis(images=images, half_differences=0.01 * images, emission=[[0.4] * 3] * 2)
    path = tmp_path / "room.basis.exr"
    lp.write_basis(path, basis)
    subject = make_subject(BasisFile(str(path)), tmp_path / "room")
    studio = Studio([subject], lambda identity: Store.open(tmp_path / "session.db", identity))
    server = Server(studio, port=0)
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    studio.start()
    vars(studio)["url"] = server.url
    yield studio
    server.stop()
    thread.join()
    server.close()
    studio.close()


@pytest.mark.nightly
@pytest.mark.long
def test_a_real_painter_looks_like_a_picture_from_the_clipboard(
    studio: Studio, browser: Any
) -> None:
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    page = context.new_page()
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.goto(vars(studio)["url"].replace("#", "?view=cpu#"))
    page.wait_for_selector(".lightpaint .tag")
    give(page, "paste", "dusk.png", png(), "body")
    page.locator(".reference-picture canvas[width='40']").wait_for()
    # Its light is picked as paint: of the brightest rows, nearly of this colour.
    before = page.locator(".colour input[type=text]").first.input_value()
    page.keyboard.down("Alt")
    page.mouse.click(*at(page, ".reference-picture", 0.5, 0.02))
    page.keyboard.up("Alt")
    page.wait_for_function(
        "old => document.querySelector('.colour input[type=text]').value !== old", arg=before
    )
    shown = page.locator(".colour input[type=text]").first.input_value()
    assert shown.startswith("#ff")
    red, green, blue = (int(shown[k : k + 2], 16) for k in (1, 3, 5))
    np.testing.assert_allclose([green / red, blue / red], [140 / 220, 60 / 220], atol=0.06)
    page.get_by_role("button", name="Look like this").click()
    page.get_by_text("Like dusk").first.wait_for()
    image, current = studio.session.views[0].image, studio.session.views[0].current
    ratio = image / current
    assert (ratio[..., 0] > 1.5 * ratio[..., 2]).mean() > 0.9
    assert ratio[: H // 4, :, 1].mean() > 1.3 * ratio[-H // 4 :, :, 1].mean()
    page.keyboard.press("Control+z")
    page.get_by_text("Like dusk").first.wait_for(state="hidden")
    assert not studio.session.is_painted
    give(page, "drop", "evil.png", b"\x89PNG\r\n\x1a\n" + bytes(40), ".reference-pane")
    toast = page.locator(".toast.is-warn")
    toast.wait_for()
    assert toast.inner_text().startswith("evil.png is damaged")
    assert page.get_by_text("Reading the picture").count() == 0
    page.reload()
    page.wait_for_selector(".lightpaint .tag")
    page.get_by_role("button", name="References").first.click()
    assert page.locator(".reference-name").inner_text() == "dusk"
    context.close()
    assert wrong == []
