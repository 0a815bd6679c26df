"""What is known of a scene without loading it: right, or nothing at all."""

import os
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image

import lightpaint
from lightpaint.basis.cache import basis_cache, scene_facts
from lightpaint.basis.cache.scene_facts import SceneFacts, facts_key, recall_facts, remember_facts
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render.rendered_basis import basis_lights
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene

SCENE = """<scene version="3.0.0">
  <include filename="parts/lamp.xml"/>
  <sensor type="perspective"><film type="hdrfilm">
    <integer name="width" value="4"/><integer name="height" value="3"/></film></sensor>
  <shape type="rectangle"><bsdf type="diffuse"><texture type="bitmap" name="reflectance">
    <string name="filename" value="textures/wood.png"/></texture></bsdf></shape>{more}
</scene>"""
LAMP = """<scene version="3.0.0"><emitter type="point" id="lamp"/></scene>"""
LATER_S = 60.0  # after which files count as old


@pytest.fixture(autouse=True)
def _fresh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An empty cache, and a process that has loaded no renderer."""
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(scene_facts, "sys", SimpleNamespace(modules={}, version=sys.version))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A scene of several files."""
    place = tmp_path / "scene"
    for name in ("parts", "textures"):
        (place / name).mkdir(parents=True)
    (place / "hall.xml").write_text(SCENE.format(more=""))
    (place / "parts" / "lamp.xml").write_text(LAMP)
    Image.new("RGB", (2, 2), (200, 100, 50)).save(place / "textures" / "wood.png")
    return place


def key_of_facts(folder: Path, **fields: Any) -> str:
    return facts_key({"path": str(folder / "hall.xml"), **fields})


def keep_basis(scene: Scene, make_basis: Any) -> Basis:
    """A made-up basis of it, in the cache."""
    source = make_basis(len(scene.lights), scene.size)
    origin = replace(source.origin, scene_identity=scene.identity, sensor=scene.sensor_names[0])
    basis: Basis = replace(source, lights=basis_lights(scene), origin=origin)
    assert basis_cache.keep(basis)
    return basis


def test_another_version_of_any_module_that_reads_scenes_is_another_key() -> None:
    package = Path(lightpaint.__file__).parent
    modules = {path for room in ("scene", "basis") for path in (package / room).rglob("*.py")}
    files = {
        Path(path)
        for folder in scene_facts._code_folders()
        for path, *_ in scene_facts._files_in_folder(folder)
    }
    assert files == modules


def test_it_is_what_the_scene_would_have_told(folder: Path, make_basis: Any) -> None:
    (folder / "hall.lights.toml").write_text('[light.lamp]\nmax = 3.0\nkelvin = "2700..4000"\n')
    scene = load_scene(folder / "hall.xml")
    basis = keep_basis(scene, make_basis)
    key, later_s = key_of_facts(folder), time.time() + LATER_S
    assert recall_facts(key) is None
    assert remember_facts(key, scene, basis, remarks=["one"], began_s=later_s)
    facts = recall_facts(key)
    assert facts == SceneFacts(
        scene.identity,
        "sensor_0",
        (3, 4),
        scene.spp,
        str(scene.path),
        basis_lights(scene),
        ("one",),
    )
    [entry] = basis_cache.entries()
    assert entry.size > entry.path.stat().st_size
    basis_cache.delete_entries([entry])
    assert recall_facts(key) is None
    assert [x.name for x in basis_cache.folder().iterdir()] == [basis_cache.TAG]


def rewrite_same_bytes(path: Path) -> None:
    """Write it anew as it was, at the time at which it was."""
    status = path.stat()
    data = bytearray(path.read_bytes())
    data[-20] ^= 1
    path.write_bytes(data)
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))


def create_file(path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("<!-- -->")


CHANGES: dict[str, Callable[[Path], object]] = {
    "the scene": lambda at: (at / "hall.xml").write_text(SCENE.format(more="<!-- -->")),
    "an include": lambda at: (at / "parts/lamp.xml").write_text(LAMP.replace("lamp", "bulb")),
    "a texture of the same size and time": lambda at: rewrite_same_bytes(at / "textures/wood.png"),
    "a texture that is gone": lambda at: (at / "textures/wood.png").unlink(),
    "another texture that would be found": lambda at: create_file(at / "parts/textures/wood.png"),
    "an include in another place": lambda at: create_file(at / "parts/parts/lamp.xml"),
    "a lights file": lambda at: (at / "hall.lights.toml").write_text("group_alike = false\n"),
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_nothing_is_known_once_a_file_is_another(
    folder: Path, make_basis: Any, change: Callable[[Path], object]
) -> None:
    scene = load_scene(folder / "hall.xml")
    key, later_s = key_of_facts(folder), time.time() + LATER_S
    assert remember_facts(key, scene, keep_basis(scene, make_basis), remarks=(), began_s=later_s)
    assert recall_facts(key) is not None
    change(folder)
    assert recall_facts(key) is None


def test_nor_where_it_is_asked_for_otherwise(
    folder: Path, make_basis: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    scene = load_scene(folder / "hall.xml")
    key, later_s = key_of_facts(folder), time.time() + LATER_S
    assert remember_facts(key, scene, keep_basis(scene, make_basis), remarks=(), began_s=later_s)
    for options in (
        {"sensor": 1},
        {"parameters": {"a": "1"}},
        {"resolution": "1/2"},
        {"lights": []},
    ):
        assert recall_facts(key_of_facts(folder, **options)) is None
    monkeypatch.setattr(scene_facts, "_code_version", lambda: "another version")
    assert recall_facts(key_of_facts(folder)) is None
    monkeypatch.undo()
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(folder)  # where relative names are looked for, too
    assert key_of_facts(folder) != key
    # A process that has loaded scenes may look for files elsewhere.
    assert recall_facts(key) is None
    monkeypatch.setattr(scene_facts, "sys", SimpleNamespace(modules={}, version=sys.version))
    assert recall_facts(key) is not None


def test_what_is_in_doubt_is_not_kept(folder: Path, make_basis: Any) -> None:
    scene = load_scene(folder / "hall.xml")
    basis, key = keep_basis(scene, make_basis), key_of_facts(folder)
    later_s = time.time() + LATER_S
    # Its files were written just before they were read.
    assert not remember_facts(key, scene, basis, remarks=(), began_s=time.time())
    # The basis is not there, or not with just these samples.
    other = replace(basis, origin=replace(basis.origin, halves=(8, 8)))
    assert not remember_facts(key, scene, other, remarks=(), began_s=later_s)
    # The parser reads a file that is not part of the scene later, or looks into another folder.
    (folder / "blue.spd").write_text("400 1\n700 2\n")
    spectrum = '<spectrum name="reflectance" filename="blue.spd"/>'
    for addition in (f'<bsdf type="diffuse" id="b">{spectrum}</bsdf>', '<path value="textures"/>'):
        (folder / "hall.xml").write_text(SCENE.format(more=addition))
        scene = load_scene(folder / "hall.xml")
        assert not remember_facts(
            key, scene, keep_basis(scene, make_basis), remarks=(), began_s=time.time() + LATER_S
        )
    assert recall_facts(key) is None


def test_what_is_damaged_is_not_believed(folder: Path, make_basis: Any) -> None:
    scene = load_scene(folder / "hall.xml")
    key, later_s = key_of_facts(folder), time.time() + LATER_S
    assert remember_facts(key, scene, keep_basis(scene, make_basis), remarks=(), began_s=later_s)
    [path] = basis_cache.folder().glob("*.known.json")
    text = path.read_text("utf-8")
    for damage in ("", "[]", text[:-9], text.replace('"spp"', '"ssp"'), text.replace("lamp", "[")):
        path.write_text(damage, "utf-8")
        assert recall_facts(key) is None


def test_what_lies_beside_no_basis_goes_when_it_was_not_used(tmp_path: Path) -> None:
    place = tmp_path / "cache"
    place.mkdir()
    (place / basis_cache.TAG).write_text(basis_cache.TAG_TEXT)
    orphan = place / f"{'0a' * 16}.clean.npz"
    user_file = place / "notes.clean.npz"
    for path in (orphan, user_file):
        np.savez(path, made_of=np.array("0"))
    size = orphan.stat().st_size
    assert basis_cache.delete_orphans(3600) == 0
    assert basis_cache.delete_orphans() == size
    assert not orphan.exists()
    assert user_file.exists()
