"""A scene's folder never has native code run: plugins are Mitsuba's own, or the user's."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from command import run_refused
from renderer import GLOSSY, LIGHTS, PATH, ROOM

from lightpaint.errors import SceneError
from lightpaint.scene.runtime.plugins import IN_PYTHON
from lightpaint.scene.scene_reader import load_scene

ROOM_TEXT = ROOM.format(integrator=PATH, film="", sensors="", wall=GLOSSY, lights=LIGHTS["bulb"])

#: It leaves a file where it is loaded, and is no plugin of Mitsuba's.
SOURCE = '#include <stdio.h>\n__attribute__((constructor)) void ran(void) { fopen("%s", "w"); }\n'


def room_with(folder: Path, addition: str) -> Path:
    path = folder / "room.xml"
    path.write_text(ROOM_TEXT.replace("</scene>", addition + "</scene>"))
    return path


def library(folder: Path, *names: str) -> Path:
    """Native code under names of plugins beside a scene. Returns the file by which it shows."""
    if shutil.which("cc") is None:
        pytest.skip("a C compiler")
    mark = folder / "ran"
    (folder / "ran.c").write_text(SOURCE % mark)
    subprocess.run(
        ["cc", "-shared", "-fPIC", "-o", folder / "ran.so", folder / "ran.c"], check=True
    )
    for name in names:
        target = folder / f"{name}.so"
        target.parent.mkdir(exist_ok=True, parents=True)
        shutil.copy(folder / "ran.so", target)
    return mark


@pytest.mark.parametrize(
    "addition",
    [
        '<bsdf type="evil"/>',
        '<bsdf type="./evil"/>',
        '<bsdf type="../plugins/evil"/>',
        '<bsdf type="evil.so"/>',
        '<default name="kind" value="evil"/><bsdf type="$kind"/>',
        '<default name="kind" value="vil"/><bsdf type="e$kind"/>',
        '<shape type="sphere"><bsdf type="twosided"><bsdf type="evil"/></bsdf></shape>',
        '<include filename="part.xml"/>',
        '<path value="other"/><emitter type="evil"/>',
        '<integrator type="aov"><integrator type="evil"/></integrator>',
        '<shape type="sphere"><bsdf type="diffuse"><texture type="evil" name="reflectance"/>'
        "</bsdf></shape>",
    ],
)
def test_a_plugin_beside_the_scene_is_refused_before_mitsuba_sees_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, addition: str
) -> None:
    mark = library(tmp_path, "plugins/evil", "other/plugins/evil", "evil")
    (tmp_path / "part.xml").write_text('<scene version="3.0.0"><bsdf type="evil"/></scene>')
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SceneError, match=r"room\.xml: .*Mitsuba has no \w+ plugin '.*evil"):
        load_scene(room_with(tmp_path, addition))
    assert not mark.exists()


@pytest.mark.parametrize("choice", ["evil", "evil:max_depth=2"])
def test_nor_is_an_integrator_that_is_asked_for(tmp_path: Path, choice: str) -> None:
    mark = library(tmp_path, "plugins/evil")
    with pytest.raises(SceneError, match="Mitsuba has no integrator plugin 'evil'"):
        load_scene(room_with(tmp_path, ""), integrator=choice)
    assert not mark.exists()


def test_commands_refuse_it_in_one_line(tmp_path: Path) -> None:
    mark = library(tmp_path, "plugins/evil")
    path = room_with(tmp_path, '<bsdf type="evil"/>')
    line = run_refused(tmp_path, "lights", path)
    assert "line " in line
    assert "Mitsuba has no bsdf plugin 'evil'" in line
    assert not mark.exists()


def test_a_plugin_called_like_one_of_mitsubas_is_never_opened(tmp_path: Path) -> None:
    """In a process that has loaded none: there Mitsuba looked beside the scene first."""
    mark = library(tmp_path, *(f"plugins/{x}" for x in ("hdrfilm", "path", "gaussian", "diffuse")))
    path = room_with(tmp_path, "")
    code = f"import lightpaint as lp; print(len(lp.load_scene({str(path)!r}).lights))"
    completed = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert completed.stdout.strip() == "1"
    assert not mark.exists()


def test_nor_one_in_the_place_of_an_integrator_in_python(tmp_path: Path) -> None:
    mark = library(tmp_path, *(f"plugins/{name}" for name in IN_PYTHON))
    path = room_with(tmp_path, "")
    with pytest.raises(SceneError, match=r"would run instead: move that file away"):
        load_scene(path, integrator="prb_projective")
    assert not mark.exists()


def test_a_user_names_plugins_of_their_own(tmp_path: Path) -> None:
    """Of the folder that LIGHTPAINT_PLUGINS names, and only what Mitsuba can load."""
    mark = library(tmp_path, "mine/evil", "plugins/evil")
    path = room_with(tmp_path, '<bsdf type="evil"/>')
    code = f"import lightpaint as lp; lp.load_scene({str(path)!r})"
    run = {"cwd": tmp_path, "capture_output": True, "text": True}
    env = {**os.environ, "LIGHTPAINT_PLUGINS": str(tmp_path / "mine")}
    completed = subprocess.run([sys.executable, "-c", code], env=env, **run)
    assert "has 'evil', which this Mitsuba cannot load as a plugin" in completed.stderr
    assert mark.exists()  # it was asked for
