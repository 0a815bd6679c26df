"""Suggested lights: a hidden one is found, and where none is missing none is named."""

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from nightly import nightly
from renderer import LIGHTS, PLASTIC, write_room

from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.errors import SceneError
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.default_solve import solve
from lightpaint.lighting.solution import Solution
from lightpaint.placement.light_changes import Placement
from lightpaint.placement.place_search import (
    check_suggestible,
    emitter_xml,
    place,
    suggest_lights,
)
from lightpaint.placement.suggestion import Suggestion
from lightpaint.report.page.placement_section import spoken_suggestions, suggestion_section
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene
from lightpaint.target.painted_target import Target

#: A light that the scene to solve does not have.
HIDDEN = (0.4, 1.2, 0.6)
INTENSITY = (0.9, 0.6, 0.3)
EXTRA = emitter_xml("extra", HIDDEN, INTENSITY)

#: How near positions lie that are tried first: 64 of them in some 20 cubic units.
SPACING = 0.7

#: Samples of basis and target, whose noise is then a few per cent of a pixel.
SPP = 256


def _target(image: Any) -> Target:
    ones = np.ones(image.shape[:2], np.float32)
    return Target("painted", image.astype(np.float32), ones, everything=True)


def _current(path: Path, *, seed: int = 1) -> Any:
    basis = render_basis(load_scene(path), spp=SPP, seed=seed)
    return basis.mix(basis.current_weights)


def _solved(path: Path, target: Target) -> tuple[Scene, Basis, Solution]:
    scene = load_scene(path)
    basis = render_basis(scene, spp=SPP)
    return scene, basis, solve(basis, target)


#: What lights the room that lacks a light.
LIT = LIGHTS["panel"] + LIGHTS["sky"]


@pytest.fixture(scope="module")
def lacking(tmp_path_factory: pytest.TempPathFactory) -> tuple[Scene, Basis]:
    """The room without the light, and its basis."""
    scene = load_scene(write_room(tmp_path_factory.mktemp("lacking"), lights=LIT, wall=PLASTIC))
    return scene, render_basis(scene, spp=SPP)


@pytest.fixture(scope="module")
def missing(
    lacking: tuple[Scene, Basis], tmp_path_factory: pytest.TempPathFactory
) -> Callable[..., tuple[Target, Solution, tuple[Suggestion, ...]]]:
    """A function: a painting with the light at this place, and what is solved and suggested."""

    @cache
    def suggested(hidden: Any = HIDDEN) -> tuple[Target, Solution, tuple[Suggestion, ...]]:
        extra = emitter_xml("extra", hidden, INTENSITY)
        room = write_room(tmp_path_factory.mktemp("painted"), lights=LIT + extra, wall=PLASTIC)
        scene, basis = lacking
        target = _target(_current(room))
        solution = solve(basis, target)
        return target, solution, suggest_lights(scene, basis, solution)

    return suggested


@pytest.mark.nightly
@pytest.mark.parametrize("hidden", [HIDDEN, nightly((-0.9, 1.0, 2.5))])
def test_a_light_that_is_missing_is_found(
    tmp_path: Path, lacking: tuple[Scene, Basis], missing: Any, hidden: Any
):
    """The painting is a render of the room with one light more; the room is solved without it.

    The second is beside the camera, out of the picture.
    """
    scene, _ = lacking
    target, solution, suggestions = missing(hidden)
    first = suggestions[0]
    assert np.linalg.norm(np.subtract(first.position, hidden)) < SPACING
    assert (first.seen_at is None) == (hidden != HIDDEN)
    assert first.gain_share > 0.7
    # Of the same colour; how bright depends on how near it is to what it lights.
    colour, expected = (np.array(rgb) / sum(rgb) for rgb in (first.emission, INTENSITY))
    np.testing.assert_allclose(colour, expected, rtol=0.05)
    for k, one in enumerate(suggestions):
        assert one.gain_share >= 0.01
        assert one.missed_share == pytest.approx(
            1 - sum(x.gain_share for x in suggestions[: k + 1])
        )

    # What is promised holds where the light is put into the scene and all is solved anew.
    pasted = scene.path.read_text(encoding="utf-8").replace("</scene>", f"{first.xml}</scene>")
    with_it = tmp_path / "pasted.xml"
    with_it.write_text(pasted, encoding="utf-8")
    _, _, repeat = _solved(with_it, target)
    remaining_loss = sum(repeat.certificate.objective) / sum(solution.certificate.objective)
    assert remaining_loss == pytest.approx(first.missed_share, abs=0.05)
    np.testing.assert_allclose(repeat.lighting.emission[first.name], first.emission, rtol=0.15)


@pytest.mark.nightly
def test_gains_of_a_display_fit_are_shares_of_its_last_linear_problem(
    lacking: tuple[Scene, Basis], missing: Any, monkeypatch: pytest.MonkeyPatch
):
    """Its loss has another scale, by which a light would remove more than there is."""
    scene, basis = lacking
    solution = solve(basis, missing()[0], space="display")
    placements: list[Placement] = []

    def recorded(*arguments: Any, **options: Any) -> Placement:
        placements.append(place(*arguments, **options))
        return placements[-1]

    monkeypatch.setattr("lightpaint.placement.place_search.place", recorded)
    [first] = suggest_lights(scene, basis, solution, count=1)
    [light] = placements[0].additions
    # The search's film is that of the basis here: nothing is missed that it does not see but noise.
    assert first.gain_share == pytest.approx(light.gain_share, rel=0.1)
    assert solution.norm2.sum() != pytest.approx(solution.equations.target_norm2.sum(), rel=0.2)


@pytest.mark.nightly
def test_the_same_seed_gives_the_same_light(lacking: tuple[Scene, Basis], missing: Any):
    _, solution, suggestions = missing()
    [first] = suggest_lights(*lacking, solution, count=1)
    assert first.position == suggestions[0].position


@pytest.mark.nightly
def test_the_ring_is_where_the_light_is_seen(tmp_path: Path, missing: Any):
    """A small bright ball at the place of the light is brightest at that pixel."""
    first = missing()[-1][0]
    x, y, z = first.position
    ball = f"""<shape type="sphere"><point name="center" x="{x}" y="{y}" z="{z}"/>
        <float name="radius" value="0.03"/><emitter type="area"><rgb name="radiance"
        value="1000 1000 1000"/></emitter></shape>"""
    image = _current(write_room(tmp_path, lights=ball))
    row, column = np.unravel_index(int(image.sum(axis=-1).argmax()), image.shape[:2])
    assert first.seen_at is not None
    # Within the pixel beside it.
    assert abs(first.seen_at[0] * image.shape[1] - (column + 0.5)) < 1.5
    assert abs(first.seen_at[1] * image.shape[0] - (row + 0.5)) < 1.5


def test_where_the_lights_can_do_it_none_is_named(small_room: Scene, small_room_basis: Any):
    basis = small_room_basis(spp=64)
    exact = _target(basis.mix(0.5 * basis.current_weights))
    assert suggest_lights(small_room, basis, solve(basis, exact)) == ()


@pytest.mark.nightly
@pytest.mark.parametrize("seed", [1, nightly(2), nightly(3)])
def test_noise_is_not_taken_for_a_lack_of_light(
    small_room: Scene, small_room_basis: Any, seed: int
):
    """Few samples of the basis, and a grainy painting: much is missed, and no light would help.

    Stray bright pixels of a painting with 4 samples are another matter (docs/limits.md).
    """
    basis, painted = small_room_basis(spp=4), small_room_basis(spp=64, seed=seed)
    solution = solve(basis, _target(painted.mix(painted.current_weights)))
    missed_share = sum(solution.certificate.objective) / solution.equations.target_norm2.sum()
    assert missed_share > 0.01**2  # else it would not look at all
    assert suggest_lights(small_room, basis, solution) == ()


@pytest.mark.nightly
def test_constraints_hold_beside_a_suggestion(lacking: tuple[Scene, Basis], missing: Any):
    scene, basis = lacking
    solution = solve(basis, missing()[0], constraints=Constraints.of({"*": {"lock": True}}))
    [first] = suggest_lights(scene, basis, solution, count=1)
    assert np.linalg.norm(np.subtract(first.position, HIDDEN)) < SPACING
    assert first.gain_share > 0.7


@pytest.mark.nightly
@pytest.mark.parametrize("sensor", ["orthographic", nightly("thinlens")])
def test_other_cameras(tmp_path: Path, sensor: str):
    camera = f"""<sensor type="{sensor}" id="other">
        {
        '<float name="aperture_radius" value="0.01"/><float name="focus_distance" value="3"/>'
        if sensor == "thinlens"
        else ""
    }
        <transform name="to_world"><scale x="1.2" y="1.2"/><lookat origin="0 1 3.5"
        target="0 0.8 0" up="0 1 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="20"/>
        </film></sensor>"""
    if sensor == "thinlens":
        camera = camera.replace('<scale x="1.2" y="1.2"/>', "")
    path = write_room(tmp_path, lights=LIGHTS["sky"], sensors=camera)
    extra = write_room(tmp_path, lights=LIGHTS["sky"] + EXTRA, sensors=camera, name="extra.xml")
    painted = render_basis(load_scene(extra, sensor="other"), spp=64, seed=1)
    scene = load_scene(path, sensor="other")
    basis = render_basis(scene, spp=64)
    solution = solve(basis, _target(painted.mix(painted.current_weights)))
    suggestions = suggest_lights(scene, basis, solution, count=1)
    assert suggestions[0].gain_share > 0.5
    assert (suggestions[0].seen_at is None) == (sensor == "orthographic")


def test_a_camera_that_sees_nothing_but_the_sky(tmp_path: Path):
    away = """<sensor type="perspective" id="away"><transform name="to_world">
        <lookat origin="0 3 0" target="0 9 0" up="0 0 1"/></transform>
        <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="20"/>
        </film></sensor>"""
    scene = load_scene(
        write_room(tmp_path, lights=LIGHTS["sky"] + LIGHTS["bulb"], sensors=away), sensor="away"
    )
    basis = render_basis(scene, spp=4)
    full_target = Target(
        "t", np.random.default_rng(0).random((20, 24, 3)), np.ones((20, 24)), everything=False
    )
    assert suggest_lights(scene, basis, solve(basis, full_target)) == ()


@pytest.mark.nightly
def test_a_basis_of_a_smaller_film_and_names_that_are_taken(tmp_path: Path):
    lights = LIGHTS["sky"].replace('"sky"', '"suggested_1"')
    lights += LIGHTS["bulb"].replace('"bulb"', '"candidate_1"')
    target = _target(_current(write_room(tmp_path, lights=lights + EXTRA, name="extra.xml")))
    scene = load_scene(write_room(tmp_path, lights=lights))
    basis = render_basis(scene.reduced("1/2"), spp=SPP)
    solution = solve(basis, target)
    [first] = suggest_lights(scene, basis, solution, count=1)
    assert first.with_it.shape == (10, 12, 3)
    assert first.gain_share > 0.5
    assert first.name == "suggested_2"
    assert ElementTree.fromstring(first.xml).attrib == {"type": "point", "id": "suggested_2"}
    other = basis.on_pixels(
        basis.images[:, :7], basis.half_differences[:, :7], basis.emitters_seen[:7]
    )
    with pytest.raises(SceneError, match="not blocks of pixels of the film"):
        suggest_lights(scene, other, solution, count=1)


def test_what_one_pass_cannot_do_is_refused(
    tmp_path: Path, small_room: Scene, small_room_basis: Any
):
    scene = load_scene(write_room(tmp_path, integrator='<integrator type="ptracer"/>'))
    with pytest.raises(SceneError, match=r"suggesting lights .* the integrator is ptracer"):
        check_suggestible(scene)
    basis = small_room_basis(spp=4)
    solution = solve(basis, _target(np.ones((20, 24, 3))))
    with pytest.raises(SceneError, match="the integrator is ptracer"):
        suggest_lights(scene, basis, solution)
    with pytest.raises(SceneError, match="0 lights cannot be suggested: ask for one or more"):
        suggest_lights(small_room, basis, solution, count=0)


def _made(name: str, gain: float, missed_share: float, place: Any = (0.25, 0.5)) -> Suggestion:
    image = np.full((4, 6, 3), 0.5, np.float32)
    xml = emitter_xml(name, (1, 2, 3), (0.5, 0.25, 0))
    return Suggestion(name, (1, 2, 3), (0.5, 0.25, 0), gain, missed_share, xml, place, image, image)


def test_the_section_says_what_was_found():
    assert suggestion_section(None, transform=ViewTransform()) == ""
    assert "No point light would certainly" in suggestion_section((), transform=ViewTransform())
    two = (_made("a", 0.4, 0.6), _made("b & c", 0.2, 0.4, None))
    page = suggestion_section(two, transform=ViewTransform(), cd_per_unit=100)
    assert "would remove 40 % of the difference" in page
    assert "together, 60 %" in page
    assert page.count("<img") == 4
    assert page.count("left:25.00%;top:50.00%") == 1
    assert "b &amp; c" in page
    assert "b & c" not in page
    assert "&lt;emitter type=&#34;point&#34;" in page
    assert " cd, " in page
    assert " lm" in page
    assert "together" not in spoken_suggestions(two[:1])
    ElementTree.fromstring(_closed(page))


def _closed(page: str) -> str:
    """With the tags closed that HTML leaves open, so that the rest can be checked to be."""
    return re.sub(r"<img([^>]*)>", r"<img\1/>", page)
