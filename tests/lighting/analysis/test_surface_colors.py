"""Colours of objects under spectra: beside colour-science, by hand, and in a render."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from renderer import LIGHTS, write_room

from lightpaint.basis.render.basis_render import render_basis
from lightpaint.colour.color import kelvin_to_rgb
from lightpaint.colour.primaries import colour_science
from lightpaint.colour.rendering_indices import adapted_color
from lightpaint.colour.spectrum import (
    WAVELENGTHS,
    daylight,
    rgb_of_powers,
    spectrum_of,
    xyz_of_powers,
)
from lightpaint.images.object_map import Objects
from lightpaint.lighting.analysis.rendered_colors import surface_colors
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.default_solve import solve
from lightpaint.report.page.lights_table import rendering_section
from lightpaint.scene.scene_reader import load_scene
from lightpaint.scene.surfaces import render_reflectances
from lightpaint.target.painted_target import Target

SIZE = (4, 12)
PEAKS = {"red": (630, 12), "green": (525, 16), "blue": (455, 12)}


def _steps(*edges: float) -> np.ndarray:
    """Reflectances that rise from .05 to .7 at wavelengths."""
    return np.array([0.05 + 0.65 / (1 + np.exp(-(WAVELENGTHS - edge) / 10)) for edge in edges])


SURFACES = {0: np.full(len(WAVELENGTHS), 0.5), 1: _steps(600)[0], 2: _steps(520)[0]}


def _powers(name: str) -> np.ndarray:
    peak, width = PEAKS[name]
    return np.array(spectrum_of(WAVELENGTHS, np.exp(-0.5 * ((WAVELENGTHS - peak) / width) ** 2)))


#: Of a light of 4000 K.
DRIVES = np.linalg.solve(
    np.array([rgb_of_powers(_powers(x)) for x in PEAKS]).T, 0.9 * np.asarray(kelvin_to_rgb(4000.0))
)


def _solution(make_basis: Any) -> Any:
    """The answer to three surfaces side by side, lit by a lamp of three emitters."""
    names = [f"a/{name}" for name in PEAKS]
    basis = make_basis(3, SIZE, names=names)
    index = np.repeat(np.arange(3), 4)[None].repeat(4, axis=0).astype(np.int32)
    images = np.zeros((3, *SIZE, 3), np.float32)
    for k, name in enumerate(PEAKS):
        for surface, reflectance in SURFACES.items():
            images[k][index == surface] = 0.8 * rgb_of_powers(_powers(name) * reflectance)
    lights = tuple(replace(x, lamp="a", members=("a",), is_scalar=True) for x in basis.lights)
    objects = Objects(index, ("wall", "dress", "lawn"))
    planes = basis.planes.replaced(dict(enumerate(images)))
    basis = replace(basis, planes=planes, lights=lights, objects=objects)
    weights = np.repeat(DRIVES[:, None], 3, axis=1)
    target = Target("t", basis.mix(weights), np.ones(SIZE, np.float32), everything=True)
    emitters = [
        {"name": x, "spectrum": np.stack([WAVELENGTHS, _powers(x)], axis=1).tolist(), "Y": 1}
        for x in PEAKS
    ]
    constraints = Constraints.of({"a": {"emitters": emitters}})
    return solve(basis, target, constraints=constraints, literal=True)


def test_colours_are_those_of_colour_science(make_basis):
    """Spectrum times reflectance, adapted from the light's white to D65."""
    colour = colour_science()
    found = {x.name: x for x in surface_colors(_solution(make_basis), SURFACES, daylight())}
    assert [*found] == ["dress", "lawn", "wall"]  # the most changed first
    light = DRIVES @ np.array([_powers(x) for x in PEAKS])
    for (_, reflectance), name in zip(SURFACES.items(), ("wall", "dress", "lawn"), strict=True):
        labs = []
        for powers in (daylight(), light):
            white, seen = (xyz_of_powers(powers * x) for x in (1.0, reflectance))
            d65 = xyz_of_powers(daylight())
            adapted = colour.adaptation.chromatic_adaptation_VonKries(
                seen / white[1], white / white[1], d65 / d65[1], transform="Bradford"
            )
            labs.append(colour.XYZ_to_Lab(adapted, colour.XYZ_to_xy(d65)))
        expected = float(colour.delta_E(*labs, method="CIE 2000"))
        # D65 of 5 nm and that of Rec.709 differ in the fourth digit.
        assert found[name].delta_e == pytest.approx(expected, abs=0.1)
    assert found["wall"].delta_e == pytest.approx(0, abs=0.05)
    assert found["dress"].delta_e > 3


def test_daylight_changes_nothing():
    for reflectance in SURFACES.values():
        shown = adapted_color(daylight(), reflectance)
        assert adapted_color(7 * daylight(), reflectance) == pytest.approx(shown)
    assert adapted_color(_powers("red") + daylight(), np.ones(81)) == pytest.approx(1, abs=1e-3)


def test_coloured_light_and_black_surfaces_have_no_number(make_basis):
    solution = _solution(make_basis)
    black = surface_colors(solution, {0: np.full(81, 0.001)}, daylight())
    assert black == ()
    lights = [replace(x, weight=(0, 0, 0), emission=(0, 0, 0)) for x in solution.lighting.lights]
    lights[0] = solution.lighting.lights[0]
    red = replace(solution, lighting=replace(solution.lighting, lights=tuple(lights)))
    [found] = surface_colors(red, {0: SURFACES[0]}, daylight())
    assert found.seen is None
    assert found.delta_e is None


def test_the_report_shows_them(make_basis):
    solution = _solution(make_basis)
    found = surface_colors(solution, SURFACES, daylight())
    page = rendering_section(solution.lighting, found)
    assert page.index(">dress<") < page.index(">lawn<") < page.index(">wall<")
    assert f"<td>{found[0].delta_e:.1f}</td>" in page


def test_reflectances_are_those_of_the_materials(tmp_path: Path):
    """Mitsuba's own: a spectrum in points, and a grey."""
    spectrum = "400:0.1, 500:0.1, 600:0.7, 700:0.7"
    text = write_room(tmp_path, lights=LIGHTS["bulb"])
    xml = text.read_text()
    ball = (
        '<shape type="sphere" id="dress"><point name="center" x="0" y="1" z="0"/>'
        '<float name="radius" value="0.6"/><bsdf type="twosided"><bsdf type="diffuse">'
        f'<spectrum name="reflectance" value="{spectrum}"/></bsdf></bsdf></shape></scene>'
    )
    text.write_text(xml.replace("</scene>", ball))
    emitters = ", ".join(f'{{name = "{x}", spectrum = "D65", Y = 1}}' for x in "ab")
    (tmp_path / "room.lights.toml").write_text(f"[light.bulb]\nemitters = [{emitters}]\n")
    scene = load_scene(text)
    basis = render_basis(scene, spp=4)
    assert basis.objects is not None
    spectral = replace(scene, is_spectral=True)
    found = {
        basis.objects.names[k]: x for k, x in render_reflectances(spectral, basis.objects).items()
    }
    inside = (WAVELENGTHS >= 400) & (WAVELENGTHS <= 700)
    expected = np.interp(WAVELENGTHS, [500, 600], [0.1, 0.7])
    # Some pixels of its edge see the wall behind it in their middle.
    np.testing.assert_allclose(found["dress"][inside], expected[inside], atol=0.08)
    assert found["dress"].max() <= 1
    for name, reflectance in found.items():
        assert reflectance.shape == (81,), name
