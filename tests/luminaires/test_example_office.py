"""The shipped office: its files are those that its script writes, and its webs are believable."""

import importlib.util
from pathlib import Path
from typing import Any

import pytest

from lightpaint.basis.render.rendered_basis import basis_lights
from lightpaint.lighting.constraints.constraints_file import constraints_of
from lightpaint.lighting.unknowns.reduction import reduce_to
from lightpaint.luminaires.web_file import read_web
from lightpaint.photometry.planes_file import plane_names
from lightpaint.scene.scene_reader import load_scene

OFFICE = Path(__file__).parents[2] / "scenes" / "office"


def _script() -> Any:
    spec = importlib.util.spec_from_file_location("make_office", OFFICE / "make_office.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_its_files_are_those_that_the_script_writes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    script = _script()
    monkeypatch.setattr(script, "HERE", tmp_path)
    script.main()
    written = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    assert written == {name: (OFFICE / name).read_bytes() for name in written}
    shipped = {file.name for file in OFFICE.iterdir() if file.is_file()}
    assert shipped == {*written, "make_office.py"}


@pytest.mark.parametrize(
    ("name", "efficacy"), [("pendant", (60, 130)), ("washer", (60, 130)), ("downlight", (60, 130))]
)
def test_its_lamps_give_as_many_lumens_per_watt_as_leds_do(
    name: str, efficacy: tuple[float, float]
) -> None:
    web = read_web(OFFICE / f"{name}.ies")
    assert web.watts is not None
    assert efficacy[0] < web.flux / web.watts < efficacy[1]


def test_it_has_twelve_luminaires_of_known_power_and_three_desks() -> None:
    scene = load_scene(OFFICE / "office.xml")
    lights = basis_lights(scene)
    lamps = reduce_to(constraints_of(scene.requests), lights).lamps
    assert len(lamps) == 12
    assert all(x.watts for lamp in lamps.values() for x in lamp.emitters)
    planes, cases = plane_names(OFFICE / "office.planes.toml")
    assert planes == ("room", "wall", "desk_1", "desk_2", "desk_3")
    assert cases == ()
