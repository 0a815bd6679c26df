"""The emitters of luminaires against closed forms, and against Radiance."""

import gc
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from blender import blender_command, found_in_blender
from radiance import illuminance
from webs import Distribution, batwing, cosine, ies_text, street, trough, write_web

from lightpaint.arrays import Doubles
from lightpaint.errors import BackendError
from lightpaint.luminaires.registration import check_can_have_luminaires
from lightpaint.luminaires.web import hanging_frame, turned, world_from_web
from lightpaint.luminaires.web_file import read_web
from lightpaint.scene.runtime.variant import spectral_variant, use_variant

#: The renderer's numbers are float32; angles near the axis lose half of their digits.
SINGLE = 2e-4

#: Of Radiance: its tables hold six digits, and it rounds angles.
RADIANCE = 0.005


@pytest.fixture(autouse=True)
def _renderer() -> Iterator[None]:
    use_variant()
    yield
    gc.collect()


def _emitter(web: Path, *, plugin: str = "ies", **parameters: Any) -> Any:
    """An emitter in the middle, which shines straight down with C0 at +x and C90 at +y."""
    import mitsuba as mi

    down = mi.ScalarTransform4f().look_at([0, 0, 0], [0, 0, -1], [0, 1, 0])
    return mi.load_dict({"type": plugin, "filename": str(web), "to_world": down, **parameters})


def _lux(emitter: Any, points: Doubles, normals: Doubles) -> Doubles:
    """The illuminance (n,) of an emitter at points, without what is in between."""
    import drjit as dr
    import mitsuba as mi

    it = dr.zeros(mi.SurfaceInteraction3f, len(points))
    it.p = mi.Point3f(points.T.astype(np.float32))
    ds, arriving = emitter.sample_direction(it, mi.Point2f(0.5))
    cosine_there = dr.maximum(dr.dot(ds.d, mi.Vector3f(normals.T.astype(np.float32))), 0)
    return np.array(arriving.y * cosine_there, np.float64)


def _around(count: int) -> tuple[Doubles, Doubles]:
    """Points on a floor and on walls around the origin, and normals towards the inside."""
    numbers = np.random.default_rng(5)
    floor = np.column_stack([numbers.uniform(-3, 3, (count, 2)), np.full(count, -2.0)])
    wall = np.column_stack([np.full(count, 3.0), numbers.uniform(-2, 2, (count, 2))])
    points = np.vstack([floor, wall, wall * [-1, 1, 1], wall[:, [1, 0, 2]]])
    inward = np.repeat([[0, 0, 1], [-1, 0, 0], [1, 0, 0], [0, -1, 0]], count, axis=0)
    return points, inward.astype(float)


def test_a_point_over_a_plane(tmp_path: Path) -> None:
    web = write_web(tmp_path / "lamp.ies", ies_text(batwing))
    angles = np.radians([0.001, 10, 25, 47.5, 80])
    points = np.column_stack([2 * np.tan(angles), 0 * angles, np.full(5, -2.0)])
    intensity = np.interp(np.degrees(angles), read_web(web).gammas, read_web(web).profile())
    expected = intensity * np.cos(angles) ** 3 / 2**2
    found = _lux(_emitter(web), points, np.tile([0.0, 0, 1], (5, 1)))
    assert found == pytest.approx(expected, rel=SINGLE)


@pytest.mark.parametrize(("turn", "tilt"), [(0, 0), (30, 0), (-75, 20)])
def test_every_direction_is_that_of_the_web(tmp_path: Path, turn: float, tilt: float) -> None:
    text = ies_text(street, np.arange(0, 361, 15).tolist(), np.arange(0, 180.1, 5))
    path = write_web(tmp_path / "lamp.ies", text)
    points = np.random.default_rng(2).normal(size=(500, 3))
    away = points / np.linalg.norm(points, axis=1, keepdims=True)
    # Where the web is turned away from, seen from it.
    in_web = turned(np.eye(3), turn=turn, tilt=tilt)
    expected = read_web(path).candela(away @ in_web.T) / (points**2).sum(axis=1)
    found = _lux(_emitter(path, turn=float(turn), tilt=float(tilt)), points, -away)
    assert found == pytest.approx(expected, rel=SINGLE)


def test_c0_is_to_the_right_and_c90_up_as_seen_from_the_lamp(tmp_path: Path) -> None:
    import mitsuba as mi

    view = mi.ScalarTransform4f().look_at([1, 2, 3], [4, 1, 1], [0, 0, 1])
    axes = world_from_web(np.array(view.matrix)[:3, :3])
    c0, c90, up_of_web = axes.T
    assert c0 == pytest.approx(
        -np.array(view.matrix)[:3, 0], abs=1e-6
    )  # Mitsuba's x is to the left
    assert c90 == pytest.approx(np.array(view.matrix)[:3, 1], abs=1e-6)
    assert up_of_web == pytest.approx(-np.array(view.matrix)[:3, 2], abs=1e-6)


@pytest.mark.parametrize(
    ("up", "c90"), [((0, 0, 1), (0, 1, 0)), ((0, 1, 0), (0, 0, -1)), ((1, 0, 0), (0, 0, 1))]
)
def test_a_lamp_that_hangs(up: tuple[float, float, float], c90: tuple[float, float, float]) -> None:
    axes = world_from_web(hanging_frame(up))
    assert axes[:, 1] == pytest.approx(c90)
    assert axes[:, 2] == pytest.approx(up)
    assert np.linalg.det(axes) == pytest.approx(1)


@pytest.mark.parametrize("turn", [0, 30])
@pytest.mark.parametrize(
    ("light", "planes"),
    [
        (batwing, [0]),
        (trough, np.arange(0, 91, 15).tolist()),
        (street, np.arange(0, 361, 15).tolist()),
    ],
)
def test_illuminance_is_that_of_radiance(
    tmp_path: Path, light: Distribution, planes: list[float], turn: float
) -> None:
    # Radiance wants to be told that it is dark above.
    web = write_web(tmp_path / "lamp.ies", ies_text(light, planes, np.arange(0, 180.1, 5)))
    points, normals = _around(20)
    expected = illuminance(web, points, normals, (0, 0, 0), turn=turn)
    found = _lux(_emitter(web, turn=float(turn)), points, normals)
    assert found.mean() == pytest.approx(expected.mean(), rel=RADIANCE)
    assert found == pytest.approx(expected, rel=RADIANCE, abs=1e-4 * expected.max())


@pytest.mark.nightly
def test_cycles_has_c0_at_minus_y_and_turns_the_other_way(tmp_path: Path) -> None:
    """Seen from above C0 to C270 follow each other to the left here, and to the right in Cycles."""
    blender = blender_command()

    def light(c: Doubles, gamma: Doubles) -> Doubles:
        return np.interp(c % 360, [0, 90, 180, 270, 360], [800, 400, 200, 100, 800]) + 0 * gamma

    planes = np.arange(0, 361, 15).tolist()
    web = write_web(tmp_path / "lamp.ies", ies_text(light, planes, np.arange(0, 180.1, 5)))
    found = found_in_blender(blender, Path(__file__).parent / "blender_ies.py", tmp_path, {})
    shares = {side: value / found["-y"] for side, value in found.items()}
    # Between the planes the candela change by 2 % from pixel to pixel.
    assert shares == pytest.approx({"-y": 1, "-x": 0.5, "+y": 0.25, "+x": 0.125}, rel=0.02)
    sides = np.array([[0.0, -1, 0], [-1, 0, 0], [0, 1, 0], [1, 0, 0]])
    points, normals = 2 * sides - [0, 0, 2], np.tile([0.0, 0, 1], (4, 1))
    lux = _lux(_emitter(web, turn=-90.0), points, normals)
    assert lux / lux[0] == pytest.approx([1, 0.125, 0.25, 0.5], rel=SINGLE)


def test_a_panel_of_a_cosine_web_is_an_area_light(tmp_path: Path) -> None:
    import mitsuba as mi

    web = write_web(tmp_path / "lamp.ies", ies_text(cosine, gammas=np.linspace(0, 90, 361)))
    down = mi.ScalarTransform4f().look_at([0, 0, 0], [0, 0, -1], [0, 1, 0])
    sides = mi.ScalarTransform4f().scale([0.6, 0.15, 1])
    radiance = {"type": "rgb", "value": 1000 / (4 * 0.6 * 0.15)}
    points, normals = _around(50)
    found = []
    for emitter in (
        {"type": "iesarea", "filename": str(web)},
        {"type": "area", "radiance": radiance},
    ):
        panel = mi.load_dict({"type": "rectangle", "to_world": down @ sides, "emitter": emitter})
        found.append(_lux(panel.emitter(), points, normals))
    # The chords of a cosine in steps of 0.25 degrees, and grazing light.
    assert found[0] == pytest.approx(found[1], rel=1e-4, abs=1e-5 * found[1].max())


def test_a_panel_has_its_web_from_afar_and_shows_it_to_the_camera(tmp_path: Path) -> None:
    import drjit as dr
    import mitsuba as mi

    text = ies_text(street, np.arange(0, 361, 15).tolist(), np.arange(0, 180.1, 5))
    web = write_web(tmp_path / "lamp.ies", text)
    down = mi.ScalarTransform4f().look_at([0, 0, 0], [0, 0, -1], [0, 1, 0])
    shape = {"type": "rectangle", "to_world": down @ mi.ScalarTransform4f().scale([0.6, 0.15, 1])}
    scene = mi.load_dict(
        {"type": "scene", "lamp": {**shape, "emitter": {"type": "iesarea", "filename": str(web)}}}
    )
    away = np.random.default_rng(4).normal(size=(300, 3))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    expected = read_web(web).candela(away)
    lux = _lux(scene.emitters()[0], 1000 * away, -away)
    assert lux * 1000**2 == pytest.approx(expected, rel=2e-3, abs=1e-3 * expected.max())
    ray = mi.Ray3f(mi.Point3f((3 * away).T), mi.Vector3f(-away.T))
    si = scene.ray_intersect(ray)
    radiance = np.array(si.emitter(scene).eval(si).y, float)
    seen = np.array(dr.isfinite(si.t)) & (np.abs(away[:, 2]) > 0.1)
    area = 4 * 0.6 * 0.15 * np.abs(away[:, 2])
    assert radiance[seen] == pytest.approx((expected / area)[seen], rel=SINGLE)


@pytest.mark.parametrize("plugin", ["ies", "iesarea"])
def test_light_traced_from_it_carries_its_flux(tmp_path: Path, plugin: str) -> None:
    import mitsuba as mi

    text = ies_text(street, np.arange(0, 361, 15).tolist(), np.arange(0, 180.1, 5))
    web = write_web(tmp_path / "lamp.ies", text)
    emitter = {"type": plugin, "filename": str(web), "lumens": 800.0}
    scene = mi.load_dict(
        {"type": "scene", "x": emitter}
        if plugin == "ies"
        else {"type": "scene", "x": {"type": "rectangle", "emitter": emitter}}
    )
    numbers = mi.load_dict({"type": "independent"})
    numbers.seed(1, 100_000)
    draws = numbers.next_1d(), numbers.next_2d(), numbers.next_2d()
    _, weight = scene.emitters()[0].sample_ray(0.0, *draws)
    carried = np.array(weight.y, float)
    error = carried.std() / np.sqrt(carried.size)
    assert carried.mean() == pytest.approx(800, abs=4 * error)
    assert error < 5


def _spectral_lamp(folder: Path, plugin: str, waves: Sequence[float], powers: Doubles) -> Any:
    """A lamp of 1000 cd times the cosine to z, with a spectrum straight between these points."""
    import mitsuba as mi

    points = {"wavelengths": waves, "values": powers}
    spectrum = {key: ", ".join(map(str, np.array(x).tolist())) for key, x in points.items()}
    web = write_web(folder / "lamp.ies", ies_text(cosine))
    emitter = {"type": plugin, "filename": str(web), "intensity": {"type": "irregular"} | spectrum}
    if plugin == "iesarea":
        small = mi.ScalarTransform4f().scale(0.01)
        emitter = {"type": "rectangle", "to_world": small, "emitter": emitter}
    return mi.load_dict({"type": "scene", "x": emitter})


@pytest.mark.parametrize("plugin", ["ies", "iesarea"])
def test_with_spectra_the_web_scales_and_the_spectrum_colours(tmp_path: Path, plugin: str) -> None:
    import drjit as dr
    import mitsuba as mi

    waves, powers = [420.0, 500.0, 580.0, 660.0], np.array([0.5, 2.0, 1.0, 0.25])
    with spectral_variant():
        scene = _spectral_lamp(tmp_path, plugin, waves, powers)
        it = dr.zeros(mi.SurfaceInteraction3f, 1)
        it.wavelengths = mi.Spectrum(*waves)
        it.p = mi.Point3f(float(2 * np.sin(np.radians(60))), 0, 1)
        _, arriving = scene.emitters()[0].sample_direction(it, mi.Point2f(0.5))
        # 2 m away, 60 degrees from the axis. The panel is a hundredth of that in size.
        assert np.array(arriving).ravel() == pytest.approx(1000 * 0.5 / 4 * powers, rel=2e-3)


@pytest.mark.parametrize("plugin", ["ies", "iesarea"])
def test_with_spectra_light_traced_from_it_carries_its_power(tmp_path: Path, plugin: str) -> None:
    import mitsuba as mi

    with spectral_variant():
        scene = _spectral_lamp(tmp_path, plugin, [400.0, 700.0], np.ones(2))
        numbers = mi.load_dict({"type": "independent"})
        numbers.seed(1, 50_000)
        draws = numbers.next_1d(), numbers.next_2d(), numbers.next_2d()
        _, weight = scene.emitters()[0].sample_ray(0.0, *draws)
        carried = np.array(weight, float).mean(axis=0)
        error = carried.std() / np.sqrt(carried.size)
        # 1000 π lumens at full, times 300 nm of power 1.
        assert carried.mean() == pytest.approx(1000 * np.pi * 300, abs=4 * error)
        assert error < 0.01 * carried.mean()


def test_plain_mitsuba_has_them_after_an_import(tmp_path: Path) -> None:
    web = write_web(tmp_path / "lamp.ies", ies_text(batwing))
    script = f"""
import lightpaint.mitsuba
import mitsuba as mi
for variant in ("scalar_rgb", "llvm_ad_rgb"):
    mi.set_variant(variant)
emitter = mi.load_dict({{"type": "ies", "filename": {str(web)!r}}})
print(type(emitter).__name__, round(emitter.flux))
"""
    found = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert found.stdout.split() == ["LuminairePoint", f"{read_web(web).flux:.0f}"], found.stderr


def test_variants_without_dr_jit_are_refused() -> None:
    check_can_have_luminaires("cuda_ad_rgb")
    with pytest.raises(BackendError, match="such as llvm_ad_rgb, and this is scalar_rgb"):
        check_can_have_luminaires("scalar_rgb")
