"""A scene that is painted: open before it is loaded, and told apart from what it was."""

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from command import spawn
from renderer import assert_equal_bits, write_room

import lightpaint as lp
from lightpaint.basis.cache import basis_cache, scene_facts
from lightpaint.basis.render.rendered_basis import basis_lights
from lightpaint.errors import ConstraintError, PaintError
from lightpaint.images.denoiser import Features
from lightpaint.images.object_map import Objects
from lightpaint.paint.launch import SessionFile
from lightpaint.paint.store.history_steps import Identity
from lightpaint.paint.store.session_file import Store
from lightpaint.paint.subject import LazyScene, Subject, session_identity
from lightpaint.paint.subject_factory import make_subject
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.sources import SceneFile
from lightpaint.pipeline.job_bases import obtain
from lightpaint.progress import silent


@pytest.fixture(autouse=True)
def _fresh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An empty cache, and a process that has loaded no renderer."""
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(scene_facts, "sys", SimpleNamespace(modules={}, version="3"))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return write_room(tmp_path)


def open_subject(path: Path, **settings: Any) -> Subject:
    return make_subject(SceneFile(str(path)), path.parent / "s", settings=Settings(**settings))


def keep_basis(
    path: Path, make_basis: Any, before_keeping: Callable[[], object] = lambda: None
) -> lp.Basis:
    """A made-up basis, kept as a first session leaves it, and what was known then.

    meanwhile: happens between the two.
    """
    first = open_subject(path)
    assert session_identity([first]) is None
    scene, opening = first.loaded_scene, first.scene
    assert isinstance(opening, LazyScene)
    new_basis = make_basis(len(scene.lights), scene.size)
    origin = replace(
        new_basis.origin,
        scene_identity=scene.identity,
        sensor=scene.sensor_names[0],
        scene=path.name,
        halves=(scene.spp // 2, scene.spp // 2),
    )
    flat = np.zeros((*scene.size, 3), np.float32)
    basis: lp.Basis = replace(
        new_basis,
        lights=basis_lights(scene),
        origin=origin,
        features=Features(flat, flat),
        objects=Objects(np.zeros(scene.size, np.int32), ("wall",)),
    )
    assert basis_cache.keep(basis)
    opening._began_s = time.time() + 60  # as if its files were older
    opening.remarks = ("a remark",)
    before_keeping()
    opening.remember(basis)
    return basis


@pytest.mark.nightly
def test_previews_of_more_and_more_samples_come_to_the_bits_of_one_render(path: Path) -> None:
    solved = obtain(lp.load_scene(path), Settings(spp=48, use_cache=False), silent)
    bases = list(open_subject(path, spp=48).bases())
    assert [basis.origin.spp for basis in bases] == [0, 2, 8, 32, 48]
    assert [basis.origin.is_plain_look for basis in bases] == [True, *[False] * 4]
    assert_equal_bits(bases[-1], solved)
    [final_basis] = open_subject(path, spp=48).bases()
    assert_equal_bits(final_basis, solved)


@pytest.mark.parametrize("set_by", [-3600.0, 3600.0])
def test_nothing_is_known_of_a_scene_where_the_clock_was_set_meanwhile(
    path: Path, make_basis: Any, monkeypatch: pytest.MonkeyPatch, set_by: float
) -> None:
    """A file that was written since it was read could then look older."""
    real_time = time.time
    keep_basis(
        path, make_basis, lambda: monkeypatch.setattr(time, "time", lambda: real_time() + set_by)
    )
    monkeypatch.setattr(time, "time", real_time)
    assert session_identity([open_subject(path)]) is None


def test_a_second_painter_is_refused_before_the_first_has_loaded_its_scene(path: Path) -> None:
    remarks: list[str] = []
    session = path.parent / "s" / "session.db"
    first = SessionFile([open_subject(path)], session, remarks.append)
    with pytest.raises(PaintError, match="is in use"):
        SessionFile([open_subject(path)], session, remarks.append)
    first.close()
    assert not session.exists()  # nothing was ever painted, so nothing is left


def test_the_session_of_a_scene_that_is_loaded_before_it_is_kept(path: Path) -> None:
    """As all new scenes are, so that mistakes show, and those whose planes are measured."""
    subject, session = open_subject(path), path.parent / "s" / "session.db"
    subject.check_files()
    remarks: list[str] = []
    opened = SessionFile([subject], session, remarks.append)
    assert opened.store.identity == session_identity([subject], {0: subject.loaded_scene})
    opened.close()
    assert session.exists()


def test_a_known_scene_is_painted_without_being_loaded(
    path: Path, make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    basis = keep_basis(path, make_basis)
    identity = session_identity([open_subject(path)], {0: open_subject(path).loaded_scene})

    def loads(**_: Any) -> None:
        raise AssertionError("the scene is loaded")

    with monkeypatch.context() as patch:
        patch.setattr("lightpaint.pipeline.job.sources.load_scene", loads)
        subject = open_subject(path)
        assert session_identity([subject]) == identity
        assert subject.target_spp == basis.origin.spp
        assert isinstance(subject.scene, LazyScene)
        assert subject.scene.remarks == ("a remark",)
        [cached_basis] = subject.bases()
        assert cached_basis.lights == basis.lights
        np.testing.assert_array_equal(cached_basis.images, basis.images)
        # Of more samples than there are it has to be loaded, as for what is asked of no light.
        with pytest.raises(AssertionError):
            next(open_subject(path, spp=4 * basis.origin.spp).bases())
        constraints = lp.Constraints.of({"nobody": {"lock": True}})
        with pytest.raises(ConstraintError, match="nobody"):
            make_subject(SceneFile(str(path)), path.parent / "s", constraints=constraints)
    # Whoever exports gets the scene that was painted, or is told.
    assert subject.loaded_scene.identity == basis.origin.scene_identity
    other = open_subject(path)
    path.write_text(path.read_text().replace("</scene>", "<!-- later --></scene>"))
    with pytest.raises(PaintError, match="not what it was when this session was opened"):
        _ = other.loaded_scene


@pytest.mark.nightly
def test_what_is_wrong_with_a_scene_ends_the_painter_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "scene.xml").write_text("<scene version='3.0.0'><bsdf type='no'/></scene>")
    completed = spawn(tmp_path, "paint", "scene.xml", "--no-browser", "--port", "0")
    assert completed.returncode == 2
    [line] = completed.stderr.strip().splitlines()
    assert "scene.xml" in line
    assert completed.stdout == ""
    assert not list(tmp_path.glob("*.paint"))


@pytest.mark.nightly
def test_a_session_of_other_lights_is_refused_when_the_scene_tells(
    path: Path, make_basis: Any
) -> None:
    folder = path.parent / "s"
    Store.open(folder / "session.db", Identity.of([make_basis(2)])).close()
    completed = spawn(path.parent, "paint", path.name, "-o", "s", "--no-browser", "--port", "0")
    assert completed.returncode == 2
    assert "session.db is a session of" in completed.stderr
    assert "(--new)" in completed.stderr
