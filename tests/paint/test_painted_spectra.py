"""Painting with spectra: a light for each emitter of a lamp, and what does not go with that."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from moving import MovingStudio, exact_answer
from spectral_room import DRIVES, LEVELS, write_spectral_room

import lightpaint as lp
from lightpaint.errors import ConstraintError, LightpaintError
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.constraints.constraints_file import constraints_of
from lightpaint.lighting.unknowns.reduction import reduce_to
from lightpaint.paint import protocol
from lightpaint.paint.subject_factory import make_subject
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.sources import SceneFile
from lightpaint.scene.scene_reader import load_scene

#: At the most: how far drives are off by the noise of two renders.
NOISE = 0.05

NAMES = [f"{lamp}/{emitter}" for lamp in DRIVES for emitter in LEVELS]


@pytest.fixture(scope="module")
def spectral(tmp_path_factory: pytest.TempPathFactory) -> Iterator[MovingStudio]:
    """A studio whose painting is the picture of DRIVES; no test leaves a request behind."""
    folder = tmp_path_factory.mktemp("spectral")
    path = write_spectral_room(folder)
    settings = Settings(spp=256, seed=1, use_cache=False, spectral=True, literal=True)
    subject = make_subject(SceneFile(str(path)), folder / "room.paint", settings=settings)
    studio = MovingStudio(folder, subject=subject)
    basis = studio.studio.session.basis
    drives = np.concatenate([np.array(x) * [*LEVELS.values()] for x in DRIVES.values()])
    weights = np.append(drives, 1.0)[:, None] * np.ones(3)
    height, width = basis.size
    studio.send(
        protocol.Paint(0, (0, height, 0, width), True),
        image=np.maximum(basis.mix(weights), 0).astype(np.float32),  # as people can paint it
        importance=np.ones(basis.size, np.float32),
    )
    yield studio
    studio.close()


def test_a_camera_sees_what_is_painted(tmp_path: Path) -> None:
    """Another camera is another scene; its table is read before the scene is loaded."""
    path = write_spectral_room(tmp_path)
    waves = np.arange(380, 781, 10.0)
    camera = tmp_path / "camera.csv"
    identities = []
    for red in (600, 620):
        curves = [np.exp(-0.5 * ((waves - x) / 35) ** 2) for x in (red, 540, 460)]
        np.savetxt(camera, np.column_stack([waves, *curves]), delimiter=",")
        settings = Settings(spp=4, use_cache=False, spectral=True, observer=str(camera))
        subject = make_subject(SceneFile(str(path)), tmp_path / "paint", settings=settings)
        identities.append(subject.loaded_scene.identity)
    assert identities[0] != identities[1]
    *_, basis = subject.bases()
    assert basis.origin.observer == "camera.csv"
    assert [*basis.names[:6]] == NAMES
    camera.write_text("400,1\n")
    with pytest.raises(LightpaintError, match=r"camera.csv has '400,1' in line 1: expected nano"):
        make_subject(SceneFile(str(path)), tmp_path / "paint", settings=settings)


def test_files_of_spectra_are_those_of_a_scene(tmp_path: Path) -> None:
    """What is kept of a scene for the next session ends with a change of them."""
    path = write_spectral_room(tmp_path)
    assert {tmp_path / f"{name}.csv" for name in LEVELS} <= load_scene(path).places


def undone(studio: MovingStudio, message: Any) -> np.ndarray:
    """Send a request, take it back, and return the answer to it, a level for each light."""
    [answer] = studio.send(message)
    studio.send(protocol.Undo())
    return np.asarray(answer.weights)[:, 0]


def test_rows_are_emitters_in_their_own_colours(spectral: MovingStudio) -> None:
    state = next(m for m in spectral.messages if m.kind == "state")
    lights: Any = state.lights
    assert [light.name for light in lights] == [*NAMES, "rest"]
    assert [light.lamp for light in lights[:4]] == ["panel", "panel", "panel", "bulb"]
    assert [light.emitters[0].swatch for light in lights[:3]] == ["#ff0000", "#00ff00", "#3300ff"]
    answer = exact_answer(spectral)
    found = [light["drives"][0] for light in answer["lights"][:6]]
    assert found == pytest.approx([*DRIVES["panel"], *DRIVES["bulb"]], abs=NOISE)
    assert [light["kelvin"] for light in answer["lights"][:6]] == [None] * 6
    assert "rendering" not in answer["lights"][6]


def test_constraints_hold_a_lamp_or_one_of_its_emitters(spectral: MovingStudio) -> None:
    locked = undone(spectral, protocol.ConstrainLight(1, {"lock": 2.0}))
    assert locked[1] == pytest.approx(2.0)
    limited = undone(spectral, protocol.ConstrainLight(0, {"limits": {"max": 0.5}}))
    assert limited[0] == pytest.approx(0.5)  # 2 is painted
    off = undone(spectral, protocol.ConstrainLight(2, {"off": True}))
    assert off[2] == 0
    assert off[0] > 0
    with pytest.raises(ConstraintError, match=r"holds 'panel/red' at 5 5 5, which its emitters"):
        spectral.send(protocol.ConstrainLight(0, {"lock": 5.0}))
    with pytest.raises(ConstraintError, match="'panel/red' can only be dimmed as a whole"):
        spectral.send(protocol.ConstrainLight(0, {"kelvin": 3000}))


def test_a_constraint_on_an_emitter_is_that_of_a_solve(spectral: MovingStudio) -> None:
    """And one on its lamp leaves no room for it."""
    lights = spectral.studio.session.basis.lights
    base = constraints_of(lights.requests)
    one = base.and_then(Constraints.of({"bulb/green": {"off": True}}))
    reduction = reduce_to(one, lights)
    assert [knob.lights for knob in reduction.knobs] == [(0,), (1,), (2,), (3,), (5,)]
    assert reduction.labels[4].endswith("off")
    both = one.and_then(Constraints.of({"bulb": {"lock": True}}))
    with pytest.raises(ConstraintError, match="on an emitter of 'bulb', whose own constraint"):
        reduce_to(both, lights)


REFUSED = {
    "a move": (
        protocol.MoveLights({"bulb/red": {"position": [0, 1, 0]}}),
        "bulb/red is rendered with its spectrum: it cannot be moved here",
    ),
    "a new light": (
        protocol.AddLight("point", position=(0.0, 1.0, 0.0)),
        "has no spectrum: it cannot be hung where lights are rendered with theirs",
    ),
    "a search": (protocol.PlaceLights(True), "with spectra all lights stay where they are"),
    "a start": (protocol.StartFromLamps(True), "a solve with spectra starts from the scene"),
    "a tie": (
        protocol.TieLights((("panel/red", "bulb/red"),)),
        "'panel/red' is an emitter of 'panel': tie lamps, not their emitters",
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_needs_renders_in_rgb_is_refused(spectral: MovingStudio, what: str) -> None:
    message, text = REFUSED[what]
    before = spectral.studio.session.requests
    with pytest.raises(LightpaintError, match=text):
        spectral.send(message)
    assert spectral.studio.session.requests == before


def heard(studio: MovingStudio, kind: type, begin: int) -> Any:
    """Return the last message of a kind since there were so many."""
    found = [m for m in studio.messages[begin:] if isinstance(m, kind)]
    return found[-1] if found else None


def test_exports_have_the_drives_of_lamps(spectral: MovingStudio) -> None:
    begin = len(spectral.messages)
    spectral.send(protocol.Export(("lighting", "relit")))
    spectral.wait(lambda: heard(spectral, protocol.ExportResult, begin))
    folder = spectral.folder / "room.paint"
    lighting = read_lighting(folder / "lighting.json")
    for lamp, drives in DRIVES.items():
        assert list(lighting[lamp].drives.values()) == pytest.approx(drives, abs=NOISE)
    assert (folder / "relit.xml").read_text().count('<spectrum name="') == len(DRIVES)


def test_without_paint_the_lamps_of_the_scene_are_exported(spectral: MovingStudio) -> None:
    """Their emitters mix the nearest to what the scene shows."""
    begin = len(spectral.messages)
    spectral.send(protocol.Undo())
    spectral.send(protocol.Export(("lighting",)))
    spectral.wait(lambda: heard(spectral, protocol.ExportResult, begin))
    lighting = read_lighting(spectral.folder / "room.paint" / "lighting.json")
    assert set(lighting) == {*DRIVES, "rest"}
    levels = spectral.studio.session.basis.current_weights[:3, 0]
    expected = levels / [*LEVELS.values()]
    assert list(lighting["panel"].drives.values()) == pytest.approx(expected, abs=1e-6)
    spectral.send(protocol.Redo())


@pytest.mark.nightly
def test_reports_and_renders_have_the_spectra(spectral: MovingStudio) -> None:
    """Mitsuba's own spectral integrators agree with what is painted."""
    begin = len(spectral.messages)
    spectral.send(protocol.Export(("report",)))
    spectral.wait(lambda: heard(spectral, protocol.ExportResult, begin))
    report = json.loads((spectral.folder / "room.paint/answer/report.json").read_text())
    assert set(report["rendering"]) == set(DRIVES)
    spectral.send(protocol.Verify())
    assert spectral.wait(lambda: heard(spectral, protocol.VerificationResult, begin)).agrees
    spectral.send(protocol.RenderFinal("still", width=24, spp=256, formats=("exr",)))
    ended = ("done", "failed")
    renders = spectral.wait(
        lambda: (
            (x := heard(spectral, protocol.RenderList, begin))
            and x.renders[-1].state in ended
            and x
        )
    ).renders
    assert renders[-1].state == "done", renders[-1].text
    [render] = (spectral.folder / "room.paint/renders/still").glob("*.exr")
    image = lp.read_target(render).image
    predicted = spectral.studio.session.basis.mix(spectral.studio.session.weights)
    # Means over the picture, each with the noise of its own samples.
    np.testing.assert_allclose(image.mean(axis=(0, 1)), predicted.mean(axis=(0, 1)), rtol=0.05)
