"""Layers as people work with them: the panel, the real engine and a real session.

After each step the page's list is the session's, and what is drawn equals its painting to the bit.
"""

import base64
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from axe import violations
from nightly import nightly
from painter_page import Painter
from patience import PATIENCE_S

import lightpaint as lp
from lightpaint.images.object_map import Objects
from lightpaint.paint.layers.canvas import ViewLayers
from lightpaint.paint.layers.layer_files import write_layers_openraster
from lightpaint.paint.layers.layer_pixels import LayerPixels
from lightpaint.paint.layers.layer_stack import Layer, LayerStack
from lightpaint.paint.server.page_server import Server
from lightpaint.paint.store.history_steps import Pixels
from lightpaint.paint.store.session_file import Store
from lightpaint.paint.studio.session_studio import Studio
from lightpaint.paint.subject_factory import make_subject
from lightpaint.pipeline.job.sources import BasisFile

H, W = 54, 96

PAINTER = "document.getElementById('lightpaint').painter"

#: Counts the requests that are not answered yet.
COUNT = f"""() => {{
  const {{ host }} = {PAINTER}, send = host.send.bind(host);
  window.unanswered = 0;
  host.send = async (...request) => {{
    window.unanswered += 1;
    try {{ return await send(...request); }} finally {{ window.unanswered -= 1; }}
  }};
}}"""

IS_STILL = f"""() => {{
  const {{ engine }} = {PAINTER}, {{ mirror }} = engine;
  return !window.unanswered && mirror.isReady && !mirror.strokes.isPending
    && !mirror.layers.isLoading && !mirror.loader.missingSlots().length
    && engine.panes().length > 0;
}}"""

#: Numbers as the text of their bytes: as numbers they take ten times as long to come here.
DRAWN = f"""() => {{
  const {{ picture, list }} = {PAINTER}.engine.mirror.layers;
  const text = (numbers) => {{
    const bytes = new Uint8Array(new Float32Array(numbers).buffer);
    return btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
  }};
  return [text(picture.image), text(picture.importance), list];
}}"""


def numbers_of(text: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), np.float32)


class Person:
    """Somebody who works with layers."""

    def __init__(self, page: Any, studio: Studio) -> None:
        self.page, self.studio = page, studio

    @property
    def names(self) -> list[str]:
        """Names in the list, the topmost first."""
        return list(self.page.locator(".layer-name").all_inner_texts())

    def row(self, name: str) -> Any:
        return self.page.locator(".layer-name", has_text=name).first

    def still(self) -> "Person":
        """Wait until everything is answered; what is drawn is what the session has."""
        end = time.monotonic() + PATIENCE_S
        while not self.page.evaluate(IS_STILL):
            assert time.monotonic() < end, "the page is not still"
            time.sleep(0.02)
        self.page.evaluate("() => new Promise((done) => requestAnimationFrame(done))")
        image, importance, layers = self.page.evaluate(DRAWN)
        view = self.studio.session.views[0]
        assert [layer["id"] for layer in layers] == list(self.studio.session.views.layers.ids)
        counts = numbers_of(importance).reshape(H, W)
        np.testing.assert_array_equal(counts, view.importance)
        drawn = numbers_of(image).reshape(H, W, 3)
        # Where nothing is painted the page may show the present look in halves.
        painted = counts > 0
        np.testing.assert_array_equal(drawn[painted], view.image[painted])
        np.testing.assert_allclose(drawn, view.image, rtol=1e-3)
        return self

    def drag(self, *places: tuple[float, float]) -> "Person":
        """Drag over the painting, from place to place in its pixels."""
        left, top, scale = self.page.evaluate(
            f"""() => {{ const {{ engine }} = {PAINTER};
                const box = engine.element.getBoundingClientRect(), pane = engine.panes()[0];
                return [box.left + pane.left, box.top + pane.top, pane.scale]; }}"""
        )
        at = [(left + (x + 0.5) * scale, top + (y + 0.5) * scale) for x, y in places]
        self.page.mouse.move(*at[0])
        self.page.mouse.down()
        for place in at[1:]:
            self.page.mouse.move(*place, steps=3)
        self.page.mouse.up()
        return self.still()

    def press(self, key: str) -> "Person":
        self.page.keyboard.press(key)
        return self.still()

    def button(self, name: str) -> "Person":
        self.page.get_by_role("button", name=name, exact=True).first.click()
        return self.still()


@pytest.fixture(scope="module")
def basis_file(make_basis: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two soft lights on a wall and a floor."""
    y, x = np.mgrid[:H, :W] / H
    images = np.array(
        [(np.exp(-((y - a) ** 2 + (x - b) ** 2) / 0.3) + 0.05)[..., None] * np.array([1, 0.9, 0.7])
         for a, b in ((0.2, 0.3), (0.6, 1.2))]
    )  # fmt: skip
    made = make_basis(images=images, half_differences=0.01 * images, emission=[[0.5] * 3] * 2)
    index = np.zeros((H, W), np.int32)
    index[H // 2 :] = 1
    path = tmp_path_factory.mktemp("basis") / "room.basis.exr"
    lp.write_basis(path, replace(made, objects=Objects(index, ("wall", "floor"))))
    return path


@pytest.fixture
def me(basis_file: Path, tmp_path: Path, browser: Any) -> Iterator[Person]:
    """Somebody at a new painter."""
    subject = make_subject(BasisFile(str(basis_file)), tmp_path / "room")
    studio = Studio([subject], lambda identity: Store.open(tmp_path / "session.db", identity))
    server = Server(studio, port=0)
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    studio.start()
    page = browser.new_context(viewport={"width": 1280, "height": 720}).new_page()
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.goto(server.url.replace("#", "?view=cpu#"))
    page.wait_for_selector(".lightpaint .tag")
    page.evaluate(COUNT)
    yield Person(page, studio).still()
    page.context.close()
    server.stop()
    thread.join()
    server.close()
    studio.close()
    assert wrong == []


@pytest.fixture
def wishes(me: Person) -> Person:
    """A stroke, the floor made darker, everything cooler, a stroke above, and a filled wall."""
    me.drag((20, 10), (40, 12))
    me.page.keyboard.press("a")
    me.page.get_by_role("button", name="Object", exact=True).first.click()
    me.drag((60, 40), (61, 44))
    me.page.evaluate(f"() => {PAINTER}.engine.adjust({{ stops: -0.5, mired: -40, object: null }})")
    me.still().press("b").drag((60, 20), (80, 30))
    return me.press("g").drag((5, 5), (5, 5))


@pytest.mark.nightly
@pytest.mark.long
def test_layers_are_made_hidden_weakened_ordered_grouped_and_deleted(wishes: Person) -> None:
    me = wishes
    session = me.studio.session
    made = me.names
    assert [name.split(",")[0] for name in made] == [
        *("Wall", "1 stroke", "Whole picture", "Floor", "Painting"),
    ]
    assert "cooler" in made[2]
    assert "stop" in made[3]
    before = session.views[0].image.copy()
    me.button(f"Hide {made[0]}")
    assert not np.array_equal(session.views[0].image, before)
    me.row("Whole picture").click()
    slider = me.page.get_by_role("slider", name="Strength", exact=True)
    slider.focus()
    count = len(session.store.steps)
    slider.press("ArrowRight")
    me.still()
    assert session.views.layers[2].strength == 1.01
    assert len(session.store.steps) == count + 1
    me.row("Whole picture").press("Alt+ArrowDown")
    me.still()
    assert [name.split(",")[0] for name in me.names][2:4] == ["Floor", "Whole picture"]
    assert me.page.evaluate("() => document.activeElement.innerText").startswith("Whole picture")
    top, low = me.row("Wall").bounding_box(), me.row("Painting").bounding_box()
    me.page.mouse.move(top["x"] + 9, top["y"] + 9)
    me.page.mouse.down()
    me.page.mouse.move(low["x"] + 9, low["y"] + low["height"] - 2, steps=5)
    me.page.mouse.up()
    me.still()
    assert me.names[-1].startswith("Wall")
    me.row("1 stroke").click(modifiers=["Control"])
    me.row("Floor").click(modifiers=["Control"])
    me.page.get_by_role("button", name="Delete 3 layers").click()
    me.still()
    assert len(me.names) == 2
    me.press("Control+z")
    me.row("Floor").click()
    me.button("Put into a group")
    assert "Group" in me.names
    me.row("Floor").press("Alt+ArrowUp")
    me.still()
    assert [layer.group for layer in session.views.layers if layer.group] == []
    for _ in range(session.store.position):
        me.press("Control+z")
    assert me.page.locator(".layer").count() == 0
    for _ in range(len(session.store.steps)):
        me.press("Control+Shift+Z")
    listed = me.names
    me.page.reload()
    me.page.wait_for_selector(".lightpaint .layer")
    assert me.still().names == listed


@pytest.mark.nightly
@pytest.mark.long
def test_a_mask_is_painted_and_shown_and_the_eraser_takes_what_lies_there(wishes: Person) -> None:
    me = wishes
    views = me.studio.session.views
    me.row("Floor").hover()
    me.page.locator(".layer-mask:not([hidden])").wait_for(state="attached")
    me.row("Floor").click()
    me.button("Mask")
    assert me.page.get_by_text("the brush adds, the eraser removes").is_visible()
    me.drag((20, 10), (30, 10))
    floor = views[0].layer(1)
    assert floor.part((10, 11, 25, 26)).importance > 0.3
    me.press("e").drag((20, 45), (40, 45))
    assert floor.part((45, 46, 30, 31)).importance < 0.7
    me.press("Escape")
    assert me.page.locator(".mask-note").count() == 0
    # Of the stroke above, not of the wall that was filled and is active elsewhere.
    me.row("Wall").click()
    me.drag((60, 45), (80, 45))
    before = len(me.studio.session.store.steps)
    me.button(f"Hide {me.names[0]}").drag((70, 25), (71, 25))
    assert len(me.studio.session.store.steps) == before + 2
    assert views[0].layer(3).part((25, 26, 70, 71)).importance < 0.6


@pytest.mark.nightly
@pytest.mark.long
def test_a_wish_is_changed_later_and_its_name_follows(wishes: Person) -> None:
    me = wishes
    me.row("Floor").click()
    field = me.page.get_by_role("textbox", name="Brighter").first
    field.fill("1.5")
    field.press("Enter")
    me.still()
    layer = me.studio.session.views.layers[1]
    assert layer.gain == 2**1.5
    assert layer.name.startswith("Floor, +1.5 stops")
    field = me.page.get_by_role("textbox", name="Name", exact=True)
    field.fill("my floor")
    field.press("Enter")
    me.still()
    me.button("Duplicate")
    assert {"my floor", "my floor copy"} <= set(me.names)
    copy, original = (
        next(one for one in me.studio.session.views.layers if one.name == name)
        for name in ("my floor copy", "my floor")
    )
    assert (copy.gain, copy.tint) == (original.gain, original.tint)


@pytest.mark.nightly
@pytest.mark.long
def test_strokes_and_adjustments_keep_to_what_is_selected_and_it_survives(me: Person) -> None:
    session, selections = me.studio.session, f"{PAINTER}.engine.selections"
    before = session.views[0].image.copy()
    me.press("m").drag((9.5, 9.5), (39.5, 29.5))
    mask = np.zeros((H, W), bool)
    mask[10:30, 10:40] = True
    np.testing.assert_array_equal(session.views[0].selection.part((0, H, 0, W)).importance, mask)
    me.press("b").drag((5, 12), (60, 12))
    me.press("a").drag((70, 45), (71, 40))  # beside the selection, which is what it is about
    image, importance = session.views[0].image, session.views[0].importance
    np.testing.assert_array_equal(image[~mask], before[~mask])
    np.testing.assert_array_equal(importance > 0, mask)
    assert me.names[0].startswith("Selection, +")
    me.press("g").drag((70, 45), (70, 45))
    np.testing.assert_array_equal(session.views[0].layer(2).part((0, H, 0, W)).importance, mask)
    assert me.names[0].startswith("Selection, ")
    me.press("Control+z")
    me.page.reload()
    me.page.wait_for_selector(".lightpaint .layer")
    me.page.evaluate(COUNT)
    me.still()
    state = f"[...({selections}.current?.mask ?? [])].reduce((a, b) => a + b, 0)"
    me.page.wait_for_function(f"() => {state} === {255 * mask.sum()}")
    for total in (255 * mask.sum(), 255 * mask.sum(), 0):
        me.press("Control+z")
        me.page.wait_for_function(f"() => {state} === {total}")
    me.press("Control+Shift+Z")
    me.page.wait_for_function(f"() => {state} > 0")
    # What a light lights, and what is bright in the answer as it is shown.
    view = session.views[0]
    me.page.evaluate(f"() => {selections}.select({{ kind: 'light', light: 0 }})")
    me.still()
    share = view.selection.part(view.full_region).importance
    assert share[:, : W // 2].mean() > 1.5 * share[:, W // 2 :].mean() > 0
    bright = "{ kind: 'brightness', picture: 'solution', low: 55, high: 100 }"
    me.page.evaluate(f"() => {selections}.select({bright})")
    me.still()
    light = np.clip(view.basis.mix(session.weights), 0, 1) @ [0.2126, 0.7152, 0.0722]
    share, lightness = view.selection.part(view.full_region).importance, 116 * np.cbrt(light) - 16
    assert (share[lightness > 56] == 1).all()
    assert not share[lightness < 51].any()
    assert 0.1 < share.mean() < 0.9


@pytest.mark.nightly
@pytest.mark.long
def test_a_gradient_falls_off_within_the_selection_and_its_ends_are_moved_later(
    me: Person,
) -> None:
    session = me.studio.session
    me.press("m").drag((9.5, 9.5), (79.5, 29.5))
    me.press("r").drag((15, 20), (60, 20))
    [_, layer] = session.views.layers
    assert layer.gradient is not None
    assert layer.gradient.end == pytest.approx((60.5, 20.5), abs=0.2)
    importance = session.views[0].importance.copy()
    assert importance[15, 12] == 1
    assert 0.2 < importance[15, 40] < 0.8
    assert not importance[15, 64:].any()
    assert not importance[:10].any()
    steps = len(session.store.steps)
    handle = me.page.get_by_role("button", name="End of the gradient")
    handle.focus()
    handle.press("Shift+ArrowLeft")
    me.still()
    assert session.views.layers[1].gradient.end == pytest.approx((50.5, 20.5), abs=0.2)
    assert session.views[0].importance[15, 40] < importance[15, 40]
    assert len(session.store.steps) == steps + 1
    me.press("Control+z")
    assert session.views.layers[1] == layer
    # A click makes none, and another one adjusts.
    me.drag((20, 20), (20, 20))
    assert len(session.views.layers) == 2
    me.button("Adjust")
    me.button("Radial").drag((30, 20), (40, 20))
    *_, last = session.views.layers
    assert last.gain == 2
    assert me.names[0].startswith("Gradient, +1.0 stop")


# What the panel is made of, over a session that is made up


def test_without_layers_the_panel_is_one_line(new_painter: Any) -> None:
    painter: Painter = new_painter()
    head = painter.page.locator(".fold.is-layers")
    assert head.bounding_box()["height"] <= 40
    assert painter.page.locator(".layer").count() == 0


@pytest.mark.nightly
@pytest.mark.parametrize("size", [(1280, 720), nightly((820, 1180)), (700, 500)])
def test_nothing_in_the_panel_is_cut_or_unnamed(new_painter: Any, axe: str, size: Any) -> None:
    painter: Painter = new_painter(axe=axe, viewport={"width": size[0], "height": size[1]})
    painter.page.evaluate(
        "() => { engine.makeLayers(8); painter.store.set({ side: true, openLayer: 1 }); }"
    )
    painter.still()
    assert violations(painter.page, ".lightpaint") == []
    cut = painter.page.evaluate(
        """async () => {
          const { cutOff } = await import('/cut.js');
          return cutOff(document.querySelector('.is-layers'));
        }"""
    )
    assert cut == []


def test_arrows_go_through_the_list_and_delete_deletes(new_painter: Any) -> None:
    painter: Painter = new_painter()
    painter.page.evaluate("() => engine.makeLayers(3)")
    painter.still()
    rows = painter.page.locator(".layer-name")
    rows.first.focus()
    painter.page.keyboard.press("ArrowDown")
    assert rows.nth(1).evaluate("(row) => row === document.activeElement")
    painter.page.keyboard.press("Delete")
    painter.still()
    assert painter.calls("changeLayers")[-1][1]["order"] == [0, 1, 3]
    start = time.monotonic()
    while not rows.nth(1).evaluate("(row) => row === document.activeElement"):
        assert time.monotonic() < start + PATIENCE_S


@pytest.mark.nightly
@pytest.mark.long
def test_layers_are_imported_by_dialog_and_by_drop(me: Person, tmp_path: Path) -> None:
    layer = LayerPixels((H, W))
    pixels = Pixels(np.full((H, 9, 3), 0.5, np.float32), np.ones((H, 9), np.float32))
    layer.put((0, H, 4, 13), pixels)
    look = me.studio.session.views[0].current
    view = ViewLayers(LayerStack.of([Layer(1, "paint", "Strip")]), {1: layer}, look)
    path = tmp_path / "strip.ora"
    write_layers_openraster(path, view, look, me.studio.session.transform)
    page = me.page

    def choose() -> None:
        with page.expect_file_chooser() as chooser:
            page.get_by_role("button", name="Import layers …").click()
        chooser.value.set_files(path)

    page.locator(".fold.is-layers .fold-head").first.click()
    choose()
    page.get_by_text("Imported 1 layer of strip.ora; undo leads back.").wait_for()
    assert me.still().names == ["Strip"]
    me.drag((60, 20), (80, 30))
    choose()
    page.get_by_role("button", name="Put them on top").click()
    page.locator(".layer-name").nth(2).wait_for()
    assert [name.split(",")[0] for name in me.still().names] == ["Strip", "1 stroke", "Strip"]
    # Dropped, the file replaces all.
    data = page.evaluate_handle(
        """([bytes, name]) => { const data = new DataTransfer();
            data.items.add(new File([new Uint8Array(bytes)], name)); return data; }""",
        [list(path.read_bytes()), "Other.ORA"],
    )
    page.locator(".lightpaint").dispatch_event("dragover", {"dataTransfer": data})
    page.get_by_text("Drop a reference picture, or layers").wait_for()
    page.locator(".lightpaint").dispatch_event("drop", {"dataTransfer": data})
    page.get_by_role("button", name="Replace all layers").click()
    page.get_by_text("Imported 1 layer of Other.ORA").wait_for()
    assert me.still().names == ["Strip"]
    assert page.get_by_text("Drop a reference picture, or layers").count() == 0
    me.press("Control+z")
    assert len(me.names) == 3


@pytest.mark.nightly
@pytest.mark.long
def test_a_page_opens_without_the_pixels_of_layers_and_fetches_them_when_needed(
    wishes: Person,
) -> None:
    me, head = wishes, ".fold.is-layers .fold-head button"
    me.page.locator(head).first.click()  # the list shows small pictures of layers
    me.page.reload()
    me.page.wait_for_selector(".lightpaint .tag")
    me.page.evaluate(COUNT)

    def fetched() -> int:
        return int(me.page.evaluate(f"() => {PAINTER}.engine.mirror.layers.picture.pixels.size"))

    me.still()
    assert fetched() == 0
    me.press("b").drag((30, 40), (50, 44)).drag((30, 30), (50, 34))
    assert fetched() == 1  # the new layer
    me.press("Control+z").press("Control+z").press("Control+Shift+z").drag((8, 30), (20, 34))
    assert fetched() == 2  # what was redone is a wish of its own
    me.page.evaluate(f"() => {PAINTER}.engine.adjust({{ stops: 0.5, mired: 40, object: null }})")
    me.still().press("b").drag((30, 10), (50, 12))
    assert fetched() == 4
    me.page.locator(head).first.click()
    me.row("Whole picture").wait_for()
    me.page.wait_for_function(f"() => {PAINTER}.engine.mirror.layers.picture.pixels.size > 4")
    me.still()
    me.page.reload()
    me.page.wait_for_selector(".lightpaint .tag")
    me.page.evaluate(COUNT)
    me.page.get_by_role("button", name="Hide Floor").click()
    me.still().press("Control+z").press("e").drag((60, 40), (70, 44))
