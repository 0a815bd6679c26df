"""Area lights that are moved: they light from a new place, and block the light of others there."""

import shlex
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from moving import MovingStudio, exact_answer, stroke
from renderer import LIGHTS, mitsuba_render

from lightpaint.cli import main
from lightpaint.cli.commands.paint_command import command_for_paintings
from lightpaint.images.estimate import read_estimate
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.paint import protocol
from lightpaint.scene.scene_reader import load_scene

#: Below the bulb, whose light it takes from the floor, and tilted.
POSE = {"position": [-0.4, 0.6, 0.4], "target": [0.1, 0.0, 0.2]}


@pytest.mark.nightly
@pytest.mark.usefixtures("without_reasons")
def test_a_moved_panel_is_solved_for_where_it_hangs(moving: MovingStudio) -> None:
    """Plain Mitsuba makes of relit.xml what is predicted, with the shadow that is new."""
    moving.send(protocol.MoveLights({"panel": POSE}))
    stroke(moving)
    exact_answer(moving.rendered())
    moving.send(protocol.Export(("target",)))
    moving.wait(lambda: next((m for m in moving.messages if m.kind == "exported"), None))
    folder, requests = moving.folder, moving.studio.session.requests
    paintings, options = {"": str(folder / "painting.exr")}, ["--spp", "256", "--no-cache"]
    line = command_for_paintings(str(folder / "room.xml"), paintings, options, requests)
    answer = folder / "terminal"
    assert main([*shlex.split(line)[1:], "-o", str(answer), "--lock=bulb"]) == 0
    relit = load_scene(answer / "relit.xml")
    assert relit.light("panel").members[0].site.position == pytest.approx(POSE["position"])
    plain = mitsuba_render(relit, seed=9, spp=1024)
    # Pixels that show an emitter are noise at its edges.
    seen = plain.max(axis=-1) < 1.5
    assert seen.mean() > 0.8

    def error(image: np.ndarray) -> float:
        return float(np.square(image - plain)[seen].sum() / np.square(plain)[seen].sum())

    predicted = read_estimate(answer / "predicted.exr")[0].image
    basis = moving.studio.session.basis
    without_shadow = basis.mix(read_lighting(answer / "lighting.json").weights_for(basis))
    assert error(predicted) < 0.01  # noise of few samples
    assert error(without_shadow) > 3 * error(predicted)


@pytest.fixture
def two_lights(tmp_path: Path) -> Iterator[MovingStudio]:
    """The room with a panel, and a bulb whose light it can take."""
    room = MovingStudio(tmp_path, LIGHTS["panel"] + LIGHTS["bulb"])
    yield room
    room.close()


@pytest.mark.nightly
@pytest.mark.usefixtures("without_reasons")
def test_a_verification_names_panels_whose_shadow_is_new(two_lights: MovingStudio) -> None:
    moving = two_lights
    moving.send(protocol.MoveLights({"panel": POSE, "bulb": {"position": [-0.4, 1.2, 0.4]}}))
    stroke(moving)
    moving.send(protocol.Verify())
    text = moving.wait(
        lambda: next((m for m in moving.messages if m.kind == "verified"), None)
    ).fields["text"]
    assert text.endswith(
        "In it panel casts its shadow, which the pictures of the other lights do not have yet."
    )
    moving.messages.clear()
    moving.send(protocol.MoveLights({"panel": {}}))
    moving.send(protocol.Verify())
    text = moving.wait(
        lambda: next((m for m in moving.messages if m.kind == "verified"), None)
    ).fields["text"]
    assert "shadow" not in text
