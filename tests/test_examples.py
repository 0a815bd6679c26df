"""The docstrings of the public names: sections that tools parse, and examples that run."""

import doctest
import inspect
import re
import shutil
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from light_groups import interleaved, pictures
from renderer import LIGHTS, write_room

import lightpaint as lp
from lightpaint.images.formats.exr import write_rgb

NAMES = sorted({*lp.__all__, *lp._EXTRAS} - {"__version__"})
SECTION = re.compile(r"^(Args|Attributes|Returns|Raises|Examples):$", re.MULTILINE)


@pytest.fixture(scope="session")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with everything that the examples name."""
    folder = tmp_path_factory.mktemp("desk")
    room = write_room(folder, lights=LIGHTS["panel"] + LIGHTS["bulb"])
    small = room.read_text("utf-8").replace('value="24"', 'value="16"')
    room.write_text(small.replace('name="height" value="20"', 'name="height" value="16"'), "utf-8")
    basis = lp.render_basis(lp.load_scene(room), spp=4)
    target = lp.Target.of(basis.mix(basis.current_weights * [[0.5], [2.0]]))
    lp.write_basis(folder / "room.basis.exr", basis)
    write_rgb(folder / "painting.exr", target.image)
    lighting = lp.Lighting.current(basis)
    for name, emission in {"panel": (2.0, 1.5, 1.0), "bulb": (1.0, 1.2, 1.4)}.items():
        lighting = lighting.with_emission(name, emission)
    lp.write_lighting(folder / "lighting.json", lighting)
    (folder / "hall.lights.toml").write_text("[light.bulb]\noff = true\n", "utf-8")
    planes_text = '[plane.desk]\nshape = "floor"\nheight = 0.7\n'
    (folder / "room.planes.toml").write_text(planes_text, "utf-8")
    groups = zip(("fill", "key", "rim"), pictures(), strict=True)
    layers = {f"RGBA_{name}": image for name, image in groups}
    for name in ("groups", "shot.0001", "shot.0002"):
        interleaved(folder / f"{name}.exr", layers)
    return folder


@pytest.fixture
def namespace(desk: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """What examples start with, in a copy of that folder."""
    shutil.copytree(desk, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    basis = lp.read_basis("room.basis.exr")
    return {"lp": lp, "np": np, "basis": basis, "target": lp.read_target("painting.exr")}


@pytest.mark.usefixtures("short_search")
@pytest.mark.parametrize("name", NAMES)
def test_examples_run(name: str, namespace: dict[str, Any]):
    member = getattr(lp, name)
    finder = doctest.DocTestFinder(recurse=inspect.isclass(member))
    module = inspect.getmodule(member)
    tests = [x for x in finder.find(member, name, module=module, globs=namespace) if x.examples]
    assert name in [test.name for test in tests], "it has no example"
    output: list[str] = []
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    for test in tests:
        runner.run(test, out=output.append)
    assert not output, "".join(output)


@pytest.mark.parametrize("name", NAMES)
def test_sections_are_those_of_the_signature(name: str):
    member = getattr(lp, name)
    head, *parts = SECTION.split(inspect.getdoc(member) or "")
    sections = dict(zip(parts[::2], parts[1::2], strict=True))
    assert re.fullmatch(r"[^\n]+\.( [^\n]+\.)*\n\n.*", head, re.DOTALL)
    assert list(sections)[-1] == "Examples"
    if is_dataclass(member):
        expected = [x.name for x in fields(member) if not x.name.startswith("_")]
        assert _items(sections["Attributes"]) == expected
    elif inspect.isfunction(member):
        assert _items(sections["Args"]) == list(inspect.signature(member).parameters)
    for error in _items(sections.get("Raises", "")):
        assert error == "Interrupted" or issubclass(getattr(lp.errors, error), lp.LightpaintError)


def _items(section: str) -> list[str]:
    """Names at the first level of indentation, as tools read them."""
    return re.findall(r"^    \*{0,2}(\w+): \S", section, re.MULTILINE)
