"""Lamps in lumens or candela give a scene its scale, and `lights` lists what they make."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from command import run, run_refused, succeed
from lit_planes import BULB, DISC, floor, write_scene
from webs import cosine, ies_text, write_web

from lightpaint import Job, Painting, SceneFile, Settings, Target, load_scene, render_basis, solve
from lightpaint import run as run_job
from lightpaint.errors import ConstraintError
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.paint.subject_factory import make_subject
from lightpaint.pipeline.wished_planes import constraints_and_scale, measure_planes
from lightpaint.progress import listener, silent

#: A bulb of 100 cd in all directions, at a height of 2.
LUMENS = 400 * math.pi
EMITTERS = f'emitters = [{{ name = "led", rgb = [1, 1, 1], lm = {LUMENS}, watts = 9 }}]\n'
PLANES = "[plane.spot]\npoints = [[0, 0, 0]]\nmean = 20\n"
#: Below the floor, which hides it from all planes.
BELOW = """<emitter type="point" id="below"><point name="position" x="0" y="-2" z="0"/>
    <rgb name="intensity" value="100"/></emitter>"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a scene lit.xml whose only lamp is in lumens."""
    write_scene(tmp_path, BULB + floor(), max_depth=2)
    (tmp_path / "lit.lights.toml").write_text(f"[light.bulb]\n{EMITTERS}", encoding="utf-8")
    (tmp_path / "lit.planes.toml").write_text(PLANES, encoding="utf-8")
    write_rgb(tmp_path / "paint.exr", np.full((8, 8, 3), 3.0, np.float32))
    return tmp_path


def _job(folder: Path, **settings: object) -> Job:
    options = {"spp": 16, "use_cache": False, "literal": True, "verify": False, **settings}
    source = SceneFile(str(folder / "lit.xml"))
    return Job(
        (source,),
        (Painting(str(folder / "paint.exr")),),
        folder / "out",
        settings=Settings(**options),
    )


def test_lumens_say_the_unit(folder: Path) -> None:
    """At the bulb's 100 cd 25 lx reach the point 2 m below; 20 lx take .8 of its power."""
    succeed(folder, "measure", "lit.xml")
    document = json.loads((folder / "measured" / "planes.json").read_text("utf-8"))
    assert document["planes"]["spot"]["mean"] == pytest.approx(25, rel=1e-3)
    plan = succeed(folder, "plan", "lit.xml", "-o", "least")
    assert "The lamps take 7.2" in plan
    [look] = run_job(_job(folder, planes=str(folder / "lit.planes.toml")))
    assert look.lighting.cd_per_unit == 1
    assert look.planes is not None
    assert look.planes.readings["", "spot"].mean >= 20 * (1 - 1e-6)
    # Without planes, too: lumens in the report, as with the unit given.
    [alone] = run_job(_job(folder, force=True))
    [given] = run_job(_job(folder, force=True, cd_per_unit=1.0))
    assert alone.lighting.cd_per_unit == 1
    assert alone.lighting == given.lighting


def test_another_light_that_reaches_a_plane_is_refused_by_name(folder: Path) -> None:
    planes = str(folder / "lit.planes.toml")
    write_scene(folder, BULB + floor() + BELOW, max_depth=2)
    run_job(_job(folder, planes=planes))
    message = (
        r"'below' is in W/sr, beside lamps in candela or lumens: list its emitters in cd or lm"
    )
    with pytest.raises(ConstraintError, match=message):
        _job(folder)  # of a picture it is a part, wherever it shines
    write_scene(folder, BULB + floor() + DISC, max_depth=2)
    with pytest.raises(ConstraintError, match="'disc', which reaches spot, is in"):
        run_job(_job(folder, planes=planes, force=True))
    assert "'disc' is in W/(m² sr), beside lamps" in run_refused(
        folder, "solve", "lit.xml", "paint.exr"
    )
    run_job(_job(folder, planes=planes, cd_per_unit=1.0, force=True))


def test_the_painter_needs_no_unit_either(folder: Path) -> None:
    settings = Settings(planes=str(folder / "lit.planes.toml"), use_cache=False)
    source = SceneFile(str(folder / "lit.xml"))
    subject = make_subject(source, settings=settings)
    assert subject.constraints.cd_per_unit is None
    every, scale = constraints_and_scale(source.content, subject.constraints, settings)
    assert (every.cd_per_unit, scale.cd_per_unit, scale.unscaled) == (1, 1, ())
    found = measure_planes(source.content, str(settings.planes), settings, scale, listener(silent))
    [lux] = found.illuminance.matrix.sum(axis=(1, 2)) * 100
    assert lux == pytest.approx(25, rel=1e-3)
    write_scene(folder, BULB + floor() + DISC, max_depth=2)
    with pytest.raises(ConstraintError, match="'disc' is in"):
        make_subject(load_scene(folder / "lit.xml"), settings=Settings(use_cache=False))


def test_a_solve_in_python_has_the_scale_too(folder: Path) -> None:
    basis = render_basis(load_scene(folder / "lit.xml"), spp=4)
    target = Target.of(np.full((8, 8, 3), 3.0, np.float32))
    assert solve(basis, target, literal=True).lighting.cd_per_unit == 1


LAMP = 'photometry = "lamp.ies"\nfactor = 0.8\n'
WARM_COOL = """emitters = [
    { name = "warm", rgb = [1.4, 0.9, 0.4], lm = 1500, watts = 16 },
    { name = "cool", rgb = [0.9, 1.0, 1.4], lm = 1700, watts = 17 }]
"""


def _listed(folder: Path, table: str, content: str = BULB + floor()) -> dict[str, dict]:
    """Return the entry of a bulb in `lights --json`, whose lights file has this table."""
    write_web(folder / "lamp.ies", ies_text(cosine))
    write_scene(folder, content, max_depth=2)
    (folder / "lit.lights.toml").write_text(f"[light.bulb]\n{table}", encoding="utf-8")
    document = json.loads(succeed(folder, "lights", "lit.xml", "--json", "--no-sheet"))
    return {light["name"]: light for light in document["lights"]}


@pytest.mark.parametrize(
    ("table", "lumens", "watts", "kelvin"),
    [
        (LAMP + 'color = "2700K"\n', 0.8 * 1000 * math.pi, 25, 2700),
        (LAMP + WARM_COOL, 0.8 * 3200, 33, None),
        (LAMP + WARM_COOL + "power_share = 0.5\n", 0.4 * 3200, 16.5, None),
        (LAMP + WARM_COOL + "lock = true\n", 0.8 * 3200, 33, None),
        (LAMP + WARM_COOL + 'limits = { max = "40%" }\n', 0.8 * 3200, 33, None),
    ],
    ids=["white", "two", "power", "locked", "limited"],
)
def test_luminaires_are_listed_as_the_lights_file_makes_them(
    tmp_path: Path, table: str, lumens: float, watts: float, kelvin: float | None
) -> None:
    bulb = _listed(tmp_path, table)["bulb"]
    # The web's integral is that of its straight lines, .1 % above the cosine's.
    assert bulb["at_full"]["flux_lm"] == pytest.approx(lumens, rel=2e-3)
    assert bulb["at_full"]["watts"] == pytest.approx(watts)
    assert bulb["photometry"]["flux_lm"] == pytest.approx(bulb["at_full"]["flux_lm"])
    if kelvin is not None:
        assert bulb["photometry"]["cct_k"] == pytest.approx(kelvin, abs=1)
    scene = SceneFile(str(tmp_path / "lit.xml")).content
    basis = render_basis(scene, spp=4)
    # Templates show it so, and so does Mitsuba.
    np.testing.assert_allclose(basis.current_weights[0], bulb["at_full"]["emission"])
    import mitsuba as mi

    loaded = scene.load()
    loaded_rgb = mi.traverse(loaded)["bulb.intensity.value"]
    np.testing.assert_allclose(np.ravel(loaded_rgb), bulb["emission"], rtol=1e-6)


def test_a_table_has_emitters_lumens_and_watts(folder: Path) -> None:
    lines = succeed(folder, "lights", "lit.xml", "--no-sheet").splitlines()
    assert lines[0].endswith("emitters  lm at full  W at full")
    assert lines[1].split()[-3:] == ["led", "1,257", "9"]


def test_what_the_scene_says_of_a_luminaire_stays(tmp_path: Path) -> None:
    """A relit scene's level is kept; a light that is off stays so."""
    dark = BULB.replace("100 100 100", "0 0 0")
    bulb = _listed(tmp_path, LAMP + WARM_COOL, dark + DISC + floor())["bulb"]
    assert bulb["emission"] == [0, 0, 0]
    assert bulb["at_full"]["watts"] == 33


def test_a_mistake_in_the_lights_file_is_no_reason_to_list_nothing(folder: Path) -> None:
    (folder / "lit.lights.toml").write_text('[light.bulp]\ncolor = "2700K"\n', encoding="utf-8")
    listed = run(folder, "lights", "lit.xml", "--no-sheet")
    assert listed.returncode == 0
    assert "no light 'bulp'" in listed.stderr
    assert "bulb" in listed.stdout


def test_relit_luminaires_stay_at_their_level(folder: Path) -> None:
    _listed(folder, LAMP + WARM_COOL)
    [look] = run_job(_job(folder))
    answer = read_lighting(folder / "out" / "lighting.json")
    source = SceneFile(str(folder / "out/relit.xml"), lights_file=str(folder / "lit.lights.toml"))
    emission = source.content.light("bulb").emission
    assert emission == pytest.approx(answer.emission["bulb"], rel=1e-5)
    assert look.lighting.emission["bulb"] == answer.emission["bulb"]
