"""Lights that are marked, dragged and pointed in the pictures of a real page over a real scene."""

import math
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from axe import violations
from patience import PATIENCE_S
from renderer import write_room

from lightpaint.paint.server.page_server import Server
from lightpaint.paint.store.session_file import Store
from lightpaint.paint.studio.session_studio import Studio
from lightpaint.paint.subject import Subject
from lightpaint.pipeline.job.settings import Settings
from lightpaint.placement.free_space import pixels_of
from lightpaint.scene.scene_reader import load_scene

PAINTER = "document.getElementById('lightpaint').painter"


def wait_until(is_so: Callable[[], Any], seconds: float = PATIENCE_S) -> Any:
    end = time.monotonic() + seconds
    while not (value := is_so()):
        assert time.monotonic() < end
        time.sleep(0.02)
    return value


class PaintedRoom:
    """A painter of the test room, and a page of it whose lights are marked."""

    def __init__(self, page: Any, folder: Path) -> None:
        self.page, self.scene = page, load_scene(write_room(folder))
        settings = Settings(spp=4, use_cache=False)
        subject = Subject("room", folder, scene=self.scene, settings=settings)
        self.studio = Studio(
            [subject], lambda identity: Store.open(folder / "session.db", identity)
        )
        self.server = Server(self.studio, port=0)
        self.thread = threading.Thread(target=self.server.run, daemon=True)
        self.thread.start()
        self.studio.start()
        wait_until(lambda: self.studio.is_ready)
        page.goto(self.server.url)
        page.wait_for_selector(".lightpaint .tag")
        page.keyboard.press("d")
        page.wait_for_selector(".lamp")

    @property
    def poses(self) -> Any:
        return self.studio.session.requests.poses

    def seen(self, point: Any) -> tuple[float, float]:
        """Where a point of the scene is on the screen, by the camera of the scene itself."""
        [place] = self.scene.while_loaded(
            lambda loaded: pixels_of(self.scene, loaded, np.array([point]))
        )
        height, width = self.scene.size
        left, top, scale = self.page.evaluate(
            f"() => {{ const {{ engine }} = {PAINTER}; const [pane] = engine.panes();"
            "const box = engine.element.getBoundingClientRect();"
            "return [box.left + pane.left, box.top + pane.top, pane.scale] }"
        )
        return left + place[0] * width * scale, top + place[1] * height * scale

    def mark(self, name: str) -> tuple[float, float]:
        """Where the first mark of a light is."""
        box = self.page.locator(f'[data-lamp="{name}"]').first.bounding_box()
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def until_step(self, count: int) -> None:
        """Wait for a step to be kept, and for its requests to be in effect, which follow it."""
        session = self.studio.session
        wait_until(lambda: session.store.position == count and not session.is_open)

    def drag(self, start: tuple[float, float], dx: float, dy: float) -> None:
        mouse = self.page.mouse
        mouse.move(*start)
        mouse.down()
        mouse.move(start[0] + dx, start[1] + dy, steps=5)
        mouse.up()

    def close(self) -> None:
        self.server.stop()
        self.thread.join()
        self.server.close()
        self.studio.close()
        self.studio.wait()


@pytest.fixture
def room(browser: Any, tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[PaintedRoom]:
    """A painted room, by default without a lights file."""
    if lights_text := getattr(request, "param", ""):
        (tmp_path / "room.lights.toml").write_text(lights_text, encoding="utf-8")
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    page, errors = context.new_page(), []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda line: errors.append(line.text) if line.type == "error" else None)
    painted_room = PaintedRoom(page, tmp_path)
    yield painted_room
    context.close()
    painted_room.close()
    assert errors == []


@pytest.mark.long
def test_lights_are_marked_dragged_and_taken_back(room: PaintedRoom) -> None:
    bulb = (-0.5, 1, 0.5)
    assert room.mark("bulb") == pytest.approx(room.seen(bulb), abs=1)
    assert room.page.locator('[data-lamp="sky"]').count() == 0
    room.drag(room.mark("bulb"), 40, 0)
    room.until_step(1)
    place = room.poses["bulb"]["position"]
    assert place[1] == pytest.approx(bulb[1])  # in its horizontal plane
    assert place[0] > bulb[0]
    wait_until(lambda: room.mark("bulb") == pytest.approx(room.seen(place), abs=1))
    room.page.keyboard.down("Shift")
    room.drag(room.mark("bulb"), 0, -30)
    room.page.keyboard.up("Shift")
    room.until_step(2)
    higher = room.poses["bulb"]["position"]
    assert (higher[0], higher[2]) == pytest.approx((place[0], place[2]))
    assert higher[1] > place[1]
    room.page.keyboard.press("Control+z")
    room.page.keyboard.press("Control+z")
    wait_until(lambda: room.poses == {})
    wait_until(lambda: room.mark("bulb") == pytest.approx(room.seen(bulb), abs=1))


@pytest.mark.nightly
def test_a_mark_follows_the_pointer_before_the_answer_comes(room: PaintedRoom) -> None:
    room.page.evaluate(f"() => {{ {PAINTER}.host.send = () => new Promise(() => {{}}); }}")
    x, y = room.mark("bulb")
    mouse = room.page.mouse
    mouse.move(x, y)
    mouse.down()
    for dx in (20, 45):
        mouse.move(x + dx, y)
        assert room.mark("bulb") == pytest.approx((x + dx, y), abs=1)
    # The rest of the page, which is drawn later, does not move it away.
    room.page.wait_for_selector(".stage.is-dragging")
    assert room.mark("bulb") == pytest.approx((x + 45, y), abs=1)
    mouse.up()


@pytest.mark.nightly
def test_a_drag_begins_with_a_few_pixels_and_escape_takes_it_back(room: PaintedRoom) -> None:
    page, session, start = room.page, room.studio.session, room.mark("bulb")
    room.drag(start, 2, 1)
    # A click shows its row, with its numbers.
    page.wait_for_selector('[data-light="bulb"] .lamp-fields')
    page.mouse.move(*start)
    page.mouse.down()
    page.mouse.move(start[0] + 40, start[1], steps=4)
    wait_until(lambda: session.is_open)
    page.keyboard.press("Escape")
    page.mouse.up()
    wait_until(lambda: not session.is_open)
    wait_until(lambda: room.mark("bulb") == pytest.approx(start, abs=1))
    assert (session.store.position, room.poses) == (0, {})
    # The keys move it in its plane, and with Shift upwards.
    page.locator('[data-lamp="bulb"]').first.focus()
    page.keyboard.press("ArrowRight")
    right = wait_until(lambda: room.poses.get("bulb"))["position"]
    assert right[0] > -0.5
    assert right[1:] == pytest.approx([1, 0.5])
    page.keyboard.press("Shift+ArrowUp")
    wait_until(lambda: room.poses["bulb"]["position"][1] > 1)


@pytest.mark.nightly
def test_a_drag_in_the_plan_ignores_that_the_plan_shifts(room: PaintedRoom) -> None:
    """The end of a search brings back a button above or below it."""
    page = room.page
    circle = page.locator(".room-plan g:has(title:text-is('bulb')) circle")
    circle.scroll_into_view_if_needed()
    box = circle.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.evaluate("document.querySelector('.room-plan').style.marginTop = '40px'")
    page.mouse.move(x + 12, y, steps=3)
    page.mouse.up()
    room.until_step(1)
    position = room.poses["bulb"]["position"]
    assert position[0] > -0.5
    assert position[1:] == pytest.approx([1, 0.5], abs=1e-6)


@pytest.mark.nightly
def test_what_cannot_be_taken_is_said(room: PaintedRoom) -> None:
    page, session = room.page, room.studio.session
    row = page.locator('[data-light="beam"]')
    row.get_by_role("button", name="beam", exact=True).first.click()

    def typed(label: str, text: str) -> None:
        row.get_by_label(label).fill(text)
        row.get_by_label(label).press("Enter")

    for text in ("NaN", "0x10", "1e999", "left"):
        typed("Position x", text)
        page.wait_for_selector(f"text=Position x is {text}: expected a number")
    assert room.poses == {}
    typed("Cone", "200")
    page.wait_for_selector("text=Cone cannot be 200: it is 89 now")
    wait_until(lambda: room.poses.get("beam", {}).get("cutoff") == 89)
    # The second number does not wait for the answer to the first.
    typed("Position x", "0.123456")
    typed("Position z", "1.25")
    wait_until(lambda: room.poses["beam"].get("position") == pytest.approx([0.123456, 1.8, 1.25]))
    # A refused one goes back.
    typed("Position x", "1e9")
    page.wait_for_selector("text=expected numbers of at most")
    wait_until(lambda: row.get_by_label("Position x", exact=True).input_value() == "0.1235")
    # A click beside the picture is none, and the next one counts.
    row.get_by_role("button", name="Aim here").click()
    left, top = room.seen((-0.4, 0, 0.3))
    page.mouse.click(left, page.locator(".stage").bounding_box()["y"] + 2)
    page.wait_for_selector("text=That is outside the picture")
    page.mouse.click(left, top)
    wait_until(lambda: "target" in room.poses["beam"])
    page.get_by_role("button", name="Add a light").click()
    box = page.locator(".room-plan > svg").bounding_box()
    page.mouse.click(box["x"] + 1, box["y"] + 1)
    page.wait_for_selector("text=That is outside the room")
    assert session.requests.added == {}


#: A lights file whose beam may slide along a rail that is level.
ON_A_RAIL = """
[on.track]
line = [[-0.3, 1.8, 0.5], [1.8, 1.8, 2.0]]

[light.beam]
move = { on = "track" }
"""


@pytest.mark.nightly
@pytest.mark.parametrize("room", [ON_A_RAIL], indirect=True)
def test_a_number_slides_a_light_along_its_rail(room: PaintedRoom) -> None:
    row = room.page.locator('[data-light="beam"]')
    row.get_by_role("button", name="beam", exact=True).first.click()
    row.get_by_label("Position x").wait_for()
    assert row.get_by_label("Position y").is_disabled()
    for text, expected in (("0.75", [0.75, 1.8, 1.25]), ("9", [1.8, 1.8, 2])):  # beyond its end
        row.get_by_label("Position x").fill(text)
        row.get_by_label("Position x").press("Enter")
        close = pytest.approx(expected, abs=1e-6)
        wait_until(lambda close=close: room.poses.get("beam", {}).get("position") == close)
    room.page.wait_for_selector("text=Position x cannot be 9: it is 1.8 now")


@pytest.mark.nightly
def test_no_typed_number_is_lost_while_answers_wait(room: PaintedRoom) -> None:
    page = room.page
    row = page.locator('[data-light="beam"]')
    row.get_by_role("button", name="beam", exact=True).first.click()
    page.evaluate(
        f"""() => {{
          const {{ host }} = {PAINTER}, send = host.send.bind(host);
          const answers = new Promise((resolve) => (window.letAnswer = resolve));
          host.send = async (...all) => {{ await answers; return send(...all); }};
        }}"""
    )
    numbers = (("Position x", 0.7), ("Position y", 1.7), ("Position z", 1.4), ("Cone", 33))
    for label, number in numbers:
        row.get_by_label(label).fill(str(number))
        row.get_by_label(label).press("Enter")
    page.evaluate("letAnswer()")
    wait_until(lambda: room.poses.get("beam", {}).get("cutoff") == 33)
    assert room.poses["beam"]["position"] == pytest.approx([0.7, 1.7, 1.4])


@pytest.mark.nightly
def test_a_sun_is_turned_by_numbers(room: PaintedRoom) -> None:
    row = room.page.locator('[data-light="sun"]')
    row.get_by_role("button", name="sun", exact=True).first.click()
    for label, text in (("Elevation", "30"), ("Azimuth", "90")):
        row.get_by_label(label).fill(text)
        row.get_by_label(label).press("Enter")
    # Up is y: azimuths count from z towards x, and light goes the other way.
    shine = [-math.cos(math.radians(30)), -0.5, 0]
    wait_until(lambda: room.poses.get("sun", {}).get("target") == pytest.approx(shine, abs=1e-6))


@pytest.mark.nightly
def test_a_spot_is_pointed_by_clicks_and_by_numbers(room: PaintedRoom, axe: str) -> None:
    row = room.page.locator('[data-light="beam"]')
    row.get_by_role("button", name="beam", exact=True).first.click()
    room.page.evaluate(axe)
    assert violations(room.page, ".lightpaint") == []
    row.get_by_role("button", name="Aim here").click()
    room.page.mouse.click(*room.seen((-0.4, 0, 0.3)))
    target = wait_until(lambda: room.poses.get("beam"))["target"]
    assert target == pytest.approx((-0.4, 0, 0.3), abs=0.02)
    assert not room.studio.session.is_painted
    row.get_by_label("Position y").fill("1.5")
    row.get_by_label("Position y").press("Enter")
    wait_until(lambda: room.poses["beam"].get("position"))
    assert room.poses["beam"]["position"] == pytest.approx([0.8, 1.5, 1.5])
    assert room.poses["beam"]["target"] == target
    # A click that the keyboard gives up paints nothing and points nothing.
    row.get_by_role("button", name="Highlight here").click()
    room.page.keyboard.press("Escape")
    assert room.page.locator(".is-pointing").count() == 0
    row.get_by_role("button", name="Put back").click()
    wait_until(lambda: room.poses == {})


@pytest.mark.nightly
def test_a_light_is_added_by_a_click_dragged_and_removed(room: PaintedRoom) -> None:
    page, session = room.page, room.studio.session
    page.get_by_role("button", name="Add a light").click()
    page.mouse.click(*room.seen((-0.4, 0, 0.3)))
    place = wait_until(lambda: session.requests.added.get("spot_1"))["position"]
    wait_until(lambda: room.mark("spot_1") == pytest.approx(room.seen(place), abs=1))
    assert not session.is_painted
    room.drag(room.mark("spot_1"), 40, 0)
    room.until_step(2)
    position = room.poses["spot_1"]["position"]
    assert position[0] > place[0]
    row = page.get_by_role("group", name="spot_1", exact=True)
    row.get_by_role("button", name="Remove").click()
    page.wait_for_selector('[data-lamp="spot_1"]', state="detached")
    page.keyboard.press("Control+z")
    page.wait_for_selector('[data-lamp="spot_1"]')
    wait_until(lambda: room.mark("spot_1") == pytest.approx(room.seen(position), abs=1))
    # In the plan it hangs below the ceiling, where it was clicked.
    page.get_by_label("New light").select_option("point")
    page.get_by_role("button", name="Add a light").click()
    box = page.locator(".room-plan > svg").bounding_box()
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    wait_until(lambda: "point_1" in session.requests.added)
    page.wait_for_selector('[data-lamp="point_1"]')


@pytest.mark.nightly
@pytest.mark.long
def test_compared_looks_are_shown_with_their_own_places(room: PaintedRoom) -> None:
    page, session = room.page, room.studio.session
    page.keyboard.press("Control+s")
    wait_until(lambda: len(session.store.looks()) == 1)
    room.drag(room.mark("bulb"), 60, 0)
    room.until_step(1)
    page.keyboard.press("Control+s")
    wait_until(lambda: len(session.store.looks()) == 2)
    wait_until(lambda: not room.studio.rig.unrendered(session.requests.placed))
    there, here = session.basis.mix(session.weights), session.bases[0].mix(session.weights)
    page.keyboard.press("c")  # without the denoiser
    page.get_by_role("button", name="Compare looks").click()

    def shown(kind: str, row: int, column: int) -> Any:
        read = f"([kind, x, y]) => {PAINTER}.engine.lightAt(kind, x, y)"
        return page.evaluate(read, [kind, column, row])

    # Where the move changes most.
    row, column = divmod(int(np.abs(there - here).sum(-1).argmax()), here.shape[1])
    assert not np.allclose(here[row, column], there[row, column], rtol=0.3)
    wait_until(lambda: np.allclose(shown("solution", row, column), here[row, column], rtol=0.1))
    wait_until(lambda: np.allclose(shown("other", row, column), there[row, column], rtol=0.1))
    page.get_by_text("Places differ").wait_for()
    assert page.get_by_role("button", name="Save as look").count() == 0
    page.keyboard.press("Control+z")
    wait_until(lambda: room.poses == {})
    wait_until(lambda: np.allclose(shown("other", row, column), there[row, column], rtol=0.1))
    wait_until(lambda: np.allclose(shown("solution", row, column), here[row, column], rtol=0.1))
    page.get_by_role("button", name="Back to the painting").click()
    wait_until(lambda: np.allclose(shown("solution", row, column), here[row, column], rtol=0.1))


@pytest.mark.nightly
@pytest.mark.long
def test_axe_finds_nothing_with_a_light_added_and_moved(room: PaintedRoom, axe: str) -> None:
    """Handles are on, and the fields of the light's pose are unfolded."""
    page, session = room.page, room.studio.session
    page.get_by_role("button", name="Add a light").click()
    page.mouse.click(*room.seen((-0.4, 0, 0.3)))
    wait_until(lambda: "spot_1" in session.requests.added)
    page.wait_for_selector('[data-lamp="spot_1"]')
    room.drag(room.mark("spot_1"), 40, 0)
    room.until_step(2)
    row = page.get_by_role("group", name="spot_1", exact=True)
    row.get_by_role("button", name="Remove").wait_for()
    page.evaluate(axe)
    assert violations(page, ".lightpaint") == []
    # The plan below leaves the list room for an unfolded light.
    assert page.locator(".fold.is-lights .fold-body").bounding_box()["height"] > 400
