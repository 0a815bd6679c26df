"""Final renders of a session: what they show, where they go, and that they outlive a page."""

from collections.abc import Callable
from copy import copy
from pathlib import Path
from threading import Event
from typing import Any, Literal

import numpy as np
import pytest
from moving import MovingStudio, stroke
from patience import PATIENCE_S
from PIL import Image
from renderer import mitsuba_render, write_room

import lightpaint as lp
from lightpaint import pipeline
from lightpaint.errors import OutputError, PaintError
from lightpaint.images.estimate import read_estimate
from lightpaint.images.formats.exr import read_parts
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.paint import protocol
from lightpaint.paint.studio import session_exports
from lightpaint.pipeline.relit_renders import DENOISED, render_final

#: Samples that take much longer than a test.
ENDLESS_SPP = 2**16


def renders(moving: MovingStudio) -> list[dict[str, Any]]:
    """The list as the last event has it."""
    events = [m.fields["renders"] for m in moving.messages if m.kind == "renders"]
    return list(events[-1]) if events else []


def wait_for(moving: MovingStudio, state: str, number: int) -> dict[str, Any]:
    def find() -> Any:
        return next((x for x in renders(moving) if x["id"] == number and x["state"] == state), None)

    found = moving.wait(find)
    assert isinstance(found, dict)
    return found


def request(width: int = 48, spp: int = 16, **fields: Any) -> protocol.RenderFinal:
    return protocol.RenderFinal("Evening", width, spp, **fields)


def test_a_larger_render_has_the_same_frame(tmp_path: Path) -> None:
    """Its blocks are the pixels that Mitsuba renders at the film's own size, with doubled lights.

    Tolerance: five standard errors of both, of 16 neighbours' variance, and clamped pixels.
    """
    scene = lp.load_scene(write_room(tmp_path))
    basis = lp.render_basis(scene, spp=16)
    lighting = Lighting.of_weights(basis, 2 * basis.current_weights)
    picture = render_final(scene, lighting, width=48, spp=256)
    assert picture.image.size == (40, 48)
    blocks = picture.image.reduced(2)
    expected = 2 * mitsuba_render(scene, seed=11, spp=2048)
    errors = np.sqrt(blocks.variance() + 1e-6)
    assert np.mean(np.abs(blocks.image - expected) < 5 * errors) > 0.98
    np.testing.assert_allclose(blocks.image.mean(), expected.mean(), rtol=0.02)  # noise


@pytest.mark.usefixtures("without_reasons")
def test_a_final_render_is_written_as_light_and_as_a_display_shows_it(
    moving: MovingStudio, tmp_path: Path
) -> None:
    stroke(moving, 1)
    for number, folder in ((1, "Evening"), (2, "Evening 2")):
        [listed] = moving.send(request())
        assert listed.fields["renders"][-1]["state"] in ("waiting", "rendering")
        info = wait_for(moving, "done", number)
        place = tmp_path / "renders" / folder
        names = ["render.exr", "render.png", "lighting.json"]
        assert info["files"] == [str(place / x) for x in names]
        assert (info["width"], info["height"]) == (48, 40)
    estimate, _ = read_estimate(place / "render.exr")
    [part] = read_parts(place / "render.exr")
    clean, transform = part.rgb(DENOISED), moving.studio.session.transform
    assert estimate.size == (40, 48)
    assert np.abs(estimate.half_difference).max() > 0
    with Image.open(place / "render.png") as opened:
        assert opened.mode.startswith("RGB")
    target = lp.read_target(place / "render.png")
    assert target.transform == transform
    levels = transform.encode(target.image), transform.encode(clean)
    np.testing.assert_allclose(*levels, atol=1.5 / 65535 + 1e-4)  # 16 bits, and the inverse curve
    lighting = lp.read_lighting(place / "lighting.json")
    weights = lighting.weights_for(moving.studio.session.basis)
    np.testing.assert_allclose(weights, moving.studio.session.weights, rtol=1e-6)


def test_a_page_that_opens_later_finds_the_renders_and_their_files(moving: MovingStudio) -> None:
    moving.send(request(formats=("png",)))
    info = wait_for(moving, "done", 1)
    state = moving.studio.state().fields
    assert state["renders"] == [info]
    png, _ = map(Path, info["files"])
    content = moving.studio.resource("render_file/1/render.png")
    assert content.tobytes() == png.read_bytes()
    height, width, channels = moving.studio.resource("render/1").shape
    assert (height / width, channels) == (pytest.approx(40 / 48, rel=0.02), 3)
    for name in ("render_file/1/../session.db", "render_file/1/render.exr", "render_file/2/a",
                 "render_file/x", "render/2", "render/"):  # fmt: skip
        with pytest.raises(PaintError, match="there is no"):
            moving.studio.resource(name)
    [listed] = moving.send(protocol.DropRender(1))
    assert listed.fields["renders"] == []
    assert png.exists()


@pytest.mark.nightly
@pytest.mark.usefixtures("without_reasons")
def test_renders_are_listed_again_by_a_painter_that_is_started_anew(
    moving: MovingStudio, tmp_path: Path
) -> None:
    """Small pictures come from the files; a render that was interrupted is stopped."""
    stroke(moving, 1)
    formats: list[tuple[Literal["exr", "png"], ...]] = [("exr", "png"), ("exr",), ("png",)]
    for number, some in enumerate(formats, start=1):
        moving.send(request(formats=some))
        wait_for(moving, "done", number)
    before = moving.studio.state().fields["renders"]
    pictures = [moving.studio.resource(f"render/{number}") for number in (1, 2)]
    moving.send(request(spp=ENDLESS_SPP))
    wait_for(moving, "rendering", 4)
    moving.close()
    [png] = (Path(x) for x in before[2]["files"] if x.endswith(".png"))
    png.unlink()
    Path(before[1]["files"][-1]).unlink()
    other = MovingStudio(tmp_path)
    first, second, last = other.studio.state().fields["renders"]
    assert first == before[0]
    assert second == {**before[1], "files": before[1]["files"][:-1]}
    assert (last["id"], last["state"], last["files"]) == (4, "stopped", [])
    for number, picture in zip((1, 2), pictures, strict=True):
        again = other.studio.resource(f"render/{number}")
        np.testing.assert_allclose(again.astype(int), picture, atol=1)  # 16 bits, float32
    with pytest.raises(PaintError, match="no picture"):
        other.studio.resource("render/3")
    other.send(protocol.DropRender(4))
    [listed] = other.send(request(formats=("png",)))
    assert [x["id"] for x in listed.fields["renders"]] == [1, 2, 3]
    wait_for(other, "done", 3)
    other.close()
    third = MovingStudio(tmp_path)
    states = [(x["id"], x["state"]) for x in third.studio.state().fields["renders"]]
    assert states == [(1, "done"), (2, "done"), (3, "done")]
    third.close()


def test_a_final_render_can_be_stopped_and_leaves_nothing(
    moving: MovingStudio, tmp_path: Path
) -> None:
    moving.send(request(width=256, spp=ENDLESS_SPP))
    moving.send(request())
    wait_for(moving, "rendering", 1)
    moving.wait(lambda: any(m.fields.get("task") == "final" for m in moving.messages))
    running, waiting = moving.studio.state().fields["renders"]
    assert (running["state"], waiting["state"]) == ("rendering", "waiting")
    assert running["total"] > running["done"]
    with pytest.raises(PaintError, match="stop it first"):
        moving.send(protocol.DropRender(1))
    [listed] = moving.send(protocol.StopRender(1))
    assert listed.fields["renders"][0]["state"] == "stopped"
    wait_for(moving, "done", 2)
    assert [x.name for x in (tmp_path / "renders").iterdir()] == ["Evening"]
    moving.send(protocol.StopRender(2))  # has ended already
    assert renders(moving)[1]["state"] == "done"


def test_final_renders_go_in_the_order_of_their_requests(
    moving: MovingStudio, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also if the exact answer of a later one is there first."""
    is_second_answered = Event()
    solve = session_exports.FinalRenders._run

    def run(self: Any, number: int, message: protocol.RenderFinal) -> None:
        exact_answer = self._exact_answer

        def late(check: Callable[[], None]) -> Any:
            answer = exact_answer(check)
            assert is_second_answered.wait(PATIENCE_S)
            return answer

        def early(check: Callable[[], None]) -> Any:
            answer = exact_answer(check)
            is_second_answered.set()
            return answer

        mine = copy(self)
        mine._exact_answer = late if number == 1 else early
        solve(mine, number, message)

    monkeypatch.setattr(session_exports.FinalRenders, "_run", run)
    moving.send(request())
    moving.send(request())
    wait_for(moving, "done", 2)
    lists = [m.fields["renders"] for m in moving.messages if m.kind == "renders"]
    states = {tuple(x["state"] for x in infos) for infos in lists if len(infos) == 2}
    assert ("done", "done") in states
    assert {first for first, second in states if second != "waiting"} == {"done"}


def test_a_render_that_cannot_be_written_says_why(
    moving: MovingStudio, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "renders").touch()
    with pytest.raises(OutputError, match=r"cannot write into .*renders"):
        moving.send(request())  # before hours of rendering
    (tmp_path / "renders").unlink()

    def fail(*_: Any) -> None:
        raise OutputError("the disk is full")

    monkeypatch.setattr(pipeline, "write_final_png", fail)
    moving.send(request())
    assert wait_for(moving, "failed", 1)["text"] == "the disk is full"
    refused: dict[str, Callable[[], protocol.RenderFinal]] = {
        "no view 3": lambda: request(view=3),
        "another name": lambda: protocol.RenderFinal("/", 48, 16),
    }
    for text, make in refused.items():
        with pytest.raises(PaintError, match=text):
            moving.send(make())
    for width, spp, formats in ((1, 16, ("png",)), (48, 1, ("png",)), (48, 16, ())):
        with pytest.raises(ValueError, match=r"is 16 to|is 2 to|expected exr"):
            protocol.RenderFinal("a", width, spp, formats)  # type: ignore[arg-type]
