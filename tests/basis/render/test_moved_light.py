"""Lights that were moved, added or removed: only they are rendered, the others' planes are kept."""

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from nightly import nightly
from renderer import LIGHTS, render_in_parts, same_basis, write_room

from lightpaint.basis.cache import basis_cache
from lightpaint.basis.cache import cached_render as obtain_module
from lightpaint.basis.cache.cached_render import obtain_basis
from lightpaint.basis.cache.plane_reuse import mean_variance
from lightpaint.basis.file import basis_file
from lightpaint.basis.file.basis_file import read_basis, write_basis
from lightpaint.basis.file.file_planes import FilePlanes
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.basis.render.render_budget import Budget, steps
from lightpaint.batch.distributed_work import PartwiseRender
from lightpaint.batch.work.item_execution import run_item
from lightpaint.batch.work.work_items import ItemResult, SceneFilm
from lightpaint.batch.work.worker_storage import WorkerCache
from lightpaint.errors import BasisError
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.sources import SceneFile
from lightpaint.pipeline.job_bases import obtain
from lightpaint.progress import Interrupted, listener, silent
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene

#: Edits of the XML of the test room.
MOVED = ('x="-0.5" y="1" z="0.5"', 'x="-0.2" y="1.2" z="0.4"')
NAMES = tuple(LIGHTS)

#: (names of lights that were rendered, samples per pixel at which they stop, whether from nothing).
Rendered = list[tuple[tuple[str, ...], int, bool]]


@pytest.fixture(autouse=True)
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path / "cache"))


@pytest.fixture
def rendered_lights(monkeypatch: pytest.MonkeyPatch) -> Rendered:
    """List what is rendered from now on."""
    log: Rendered = []

    def render(scene: Scene, **options: Any) -> Basis:
        progress_counts: list[int] = []
        options["progress"] = lambda _label, count, _total, *_: progress_counts.append(count)
        basis = render_basis(scene, **options)
        if progress_counts:
            spp = options.get("spp") or options.get("until_spp") or basis.origin.spp
            log.append((basis.names, spp, options.get("start") is None))
        return basis

    # What `obtain_basis` takes for its own must stay the same object.
    monkeypatch.setattr(obtain_module, "render_basis", render)
    monkeypatch.setitem(obtain_basis.__kwdefaults__, "render", render)
    return log


def room(folder: Path, *edits: tuple[str, str], **options: Any) -> Scene:
    """The test room after some edits of its XML."""
    path = write_room(folder, **options)
    text = path.read_text(encoding="utf-8")
    for old, new in edits:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")
    return load_scene(path)


def reused_lights(basis: Basis, of: Basis) -> set[str]:
    """Names of the lights whose planes are those of the other basis to the bit."""
    return {
        name
        for name in {*basis.names} & {*of.names}
        if all(
            getattr(basis, planes).plane(basis.names.index(name)).tobytes()
            == getattr(of, planes).plane(of.names.index(name)).tobytes()
            for planes in ("planes", "noise")
        )
    }


def assert_agrees(a: Basis, b: Basis) -> None:
    """Assert that two bases of other random numbers show the same, and know their noise.

    Pixels are independent. Four standard errors: of the sum of differences, and of the squares
    that half differences say these have.
    """
    assert a.names == b.names
    for name, x, y, u, v in zip(
        a.names, a.images, b.images, a.half_differences, b.half_differences, strict=True
    ):
        error, noise = (x - y).astype(float), u.astype(float) ** 2 + v.astype(float) ** 2
        error, noise = error.sum(axis=-1), noise.sum(axis=-1)
        bound = ((u.sum(axis=-1) ** 2) + (v.sum(axis=-1) ** 2)).astype(float)
        assert abs(error.sum()) <= 4 * np.sqrt(bound.sum()), name
        excess = ((x - y).astype(float) ** 2).sum(axis=-1) - noise
        assert abs(excess.sum()) <= 4 * np.sqrt((excess**2).sum()), name


def test_a_moved_lamp_is_rendered_alone(tmp_path: Path, rendered_lights: Rendered) -> None:
    first = obtain_basis(room(tmp_path), spp=64)
    scene = room(tmp_path, MOVED)
    assert rendered_lights == [(NAMES, 64, True)]
    second = obtain_basis(scene, spp=64)
    assert rendered_lights[1:] == [(("bulb",), 64, True)]
    assert reused_lights(second, first) == {*NAMES} - {"bulb"}
    assert (second.origin.halves, second.origin.each_light) == ((32, 32), ())
    assert second.origin.is_composed
    assert second.origin.scene_identity == scene.identity
    assert_agrees(second, render_basis(scene, spp=64, seed=5))
    # The camera sees emitters where it did.
    np.testing.assert_array_equal(second.emitters_seen, first.emitters_seen)
    assert second.features is not None
    # And again: then it is kept as a whole. Moved back, the first is.
    same_basis(obtain_basis(scene, spp=64), second)
    same_basis(obtain_basis(room(tmp_path), spp=64), first)
    assert len(rendered_lights) == 2


def relative_variance(image: Any, noise: Any) -> float:
    """Σ noise² / Σ light² without the noisiest thousandth of the pixels, at least one."""
    squares = [np.square(x.astype(float)).sum(axis=-1).ravel() for x in (noise, image)]
    quiet = np.argsort(squares[0])[: -max(1, round(squares[0].size / 1000))]
    return float(squares[0][quiet].sum() / squares[1][quiet].sum())


def test_a_stray_pixel_does_not_make_a_light_noisy(make_basis: Any) -> None:
    rng = np.random.default_rng(7)
    images = 1 + rng.random((2, 24, 20, 3))
    noise = rng.normal(0, 0.1, images.shape)
    images[1, 3, 4] = noise[1, 3, 4] = 1000
    basis = make_basis(images=images, half_differences=noise)
    expected = [relative_variance(*pair) for pair in zip(images, noise, strict=True)]
    np.testing.assert_allclose(basis.relative_variances, expected, rtol=1e-5)
    np.testing.assert_allclose(expected, 0.01 / (7 / 3), rtol=0.2)  # E[(1 + u)²] is 7/3


@pytest.mark.nightly
def test_a_moved_lamp_takes_samples_until_it_is_as_clean_as_the_others(tmp_path: Path) -> None:
    """Shadow rays to it alone bring less noise than those that are shared, so these are fewer."""
    rendered: list[int] = []

    def render(scene: Scene, **options: Any) -> Basis:
        basis = render_basis(scene, **options)
        rendered.append(basis.origin.spp)
        return basis

    def variances(basis: Basis) -> dict[str, float]:
        pairs = zip(basis.images, basis.half_differences, strict=True)
        return dict(zip(basis.names, (relative_variance(*pair) for pair in pairs), strict=True))

    obtain_basis(room(tmp_path), spp=64, render=render)
    scene = room(tmp_path, MOVED)
    basis = obtain_basis(scene, spp=64, render=render)
    first, spp, _ = rendered
    assert (first, basis.origin.spp, basis.origin.each_light) == (64, 64, ())
    assert 16 <= spp < 64
    others = variances(basis)
    bulb = others.pop("bulb")
    assert bulb <= np.mean([*others.values()])
    # One step less is not enough.
    fewer = render_basis(scene.only(["bulb"]), spp=spp - 8)
    assert variances(fewer)["bulb"] > np.mean([*others.values()])
    # It counts as one of 64 samples from now on, and each of its samples for more than one.
    assert obtain_basis(scene, spp=64, render=render).origin == basis.origin
    assert_agrees(obtain_basis(scene, spp=128, render=render), render_basis(scene, spp=64, seed=5))
    assert rendered[-1] == 128
    # A render of exactly so many takes nothing of it.
    exact = obtain_basis(scene, spp=64, exact_spp=True, render=render)
    same_basis(exact, obtain_basis(scene, spp=64, use_cache=False))


def test_a_lamp_whose_light_is_not_found_gets_all_samples(tmp_path: Path) -> None:
    lamp = '<emitter type="point" id="{}"><point name="position" x="0" y="{}" z="0"/></emitter>'
    lights = LIGHTS["beam"]
    obtain_basis(room(tmp_path, lights=lights), spp=16)
    scene = room(tmp_path, lights=lights + lamp.format("far", -9))
    rendered: dict[tuple[str, ...], int] = {}

    def render(scene: Scene, **options: Any) -> Basis:
        basis = render_basis(scene, **options)
        rendered[basis.names] = basis.origin.spp
        assert len(basis.lights) > 1 or options["until_variance"] > 0
        return basis

    basis = obtain_basis(scene, spp=16, render=render)
    assert not basis.images[basis.names.index("far")].any()
    assert rendered["far",] == 16
    # Among black lights, nobody knows what is clean.
    assert mean_variance(replace(basis, planes=0 * basis.images), 16) is None


@pytest.mark.nightly
def test_two_moved_lamps_are_one_pass_and_planes_come_from_several_files(
    tmp_path: Path, rendered_lights: Rendered
) -> None:
    turn = ('origin="0.8 1.8 1.5"', 'origin="0.6 1.8 1.5"')
    first = obtain_basis(room(tmp_path), spp=16)
    basis = obtain_basis(room(tmp_path, MOVED, turn), spp=16)
    assert rendered_lights[1:] == [(("bulb", "beam"), 16, True)]
    # The bulb from the one and the beam from the other.
    last = obtain_basis(room(tmp_path, MOVED), spp=16)
    assert len(rendered_lights) == 2
    assert reused_lights(last, basis) == {*NAMES} - {"beam"}
    assert reused_lights(last, first) == {*NAMES} - {"bulb"}


def test_edits_of_colour_and_name_render_nothing(tmp_path: Path, rendered_lights: Rendered) -> None:
    first = obtain_basis(room(tmp_path), spp=16)
    scene = room(tmp_path, ("0.5 0.6 0.7", "0 0 3"), ('id="beam"', 'id="ray"'))
    second = obtain_basis(scene, spp=16)
    assert len(rendered_lights) == 1
    assert second.names == ("panel", "bulb", "ray", "sun", "sky")
    assert second.lights[1].emission == (0, 0, 3)
    assert second.images.tobytes() == first.images.tobytes()
    # Names of shapes are those of now.
    assert second.objects is not None
    third = obtain_basis(room(tmp_path, ('id="panel"', 'id="lid"')), spp=16)
    assert third.objects is not None
    assert {"panel"} ^ {*second.objects.names} == {"lid"} ^ {*third.objects.names}


@pytest.mark.nightly
def test_lamps_that_come_and_go(tmp_path: Path, rendered_lights: Rendered) -> None:
    lights = LIGHTS["panel"] + LIGHTS["bulb"]
    first = obtain_basis(room(tmp_path, lights=lights), spp=32)
    basis = obtain_basis(scene := room(tmp_path, lights=lights + LIGHTS["sky"]), spp=32)
    assert rendered_lights[1:] == [(("sky",), 32, True)]
    assert reused_lights(basis, first) == {"panel", "bulb"}
    assert_agrees(basis, render_basis(scene, spp=32, seed=5))
    assert basis.emitters_seen.sum() > first.emitters_seen.sum()  # where there is sky
    fewer = obtain_basis(scene := room(tmp_path, lights=lights[: len(LIGHTS["panel"])]), spp=32)
    assert len(rendered_lights) == 2
    assert reused_lights(fewer, first) == {"panel"}
    np.testing.assert_array_equal(fewer.emitters_seen, first.emitters_seen)
    assert_agrees(fewer, render_basis(scene, spp=32, seed=5))


@pytest.mark.nightly
def test_an_area_lamp_that_moves_is_another_room(tmp_path: Path, rendered_lights: Rendered) -> None:
    obtain_basis(room(tmp_path), spp=4)
    obtain_basis(room(tmp_path, ('<translate y="1.9"/>', '<translate y="1.7"/>')), spp=4)
    assert rendered_lights == [(NAMES, 4, True)] * 2


@pytest.mark.nightly
def test_lights_with_fewer_samples_catch_up(tmp_path: Path, rendered_lights: Rendered) -> None:
    obtain_basis(room(tmp_path), spp=16)
    scene = room(tmp_path, MOVED)
    basis = obtain_basis(scene, spp=64)
    # First to what the others have, then all together.
    assert rendered_lights[1:] == [(("bulb",), 16, True), (NAMES, 64, False)]
    assert (basis.origin.halves, basis.origin.each_light) == ((32, 32), ())
    assert basis.origin.is_composed
    assert_agrees(basis, render_basis(scene, spp=64, seed=5))


@pytest.mark.nightly
def test_unequal_numbers_of_samples(tmp_path: Path, rendered_lights: Rendered) -> None:
    first = obtain_basis(room(tmp_path), spp=64)
    scene = room(tmp_path, MOVED)
    basis = obtain_basis(scene, spp=16)
    assert reused_lights(basis, first) == {*NAMES} - {"bulb"}
    assert [entry[:2] for entry in basis.origin.each_light] == [
        (8, 8) if name == "bulb" else (32, 32) for name in NAMES
    ]
    assert basis.origin.spp == 16
    assert basis.knows_noise
    assert_agrees(basis, render_basis(scene, spp=64, seed=5))
    write_basis(tmp_path / "b.exr", basis)
    same_basis(read_basis(tmp_path / "b.exr"), basis)
    # The one that lags behind goes on by itself; nobody else's call does as if all were equal.
    with pytest.raises(BasisError, match="unequal numbers of samples"):
        render_basis(scene, spp=64, start=basis)
    grown_basis = obtain_basis(scene, spp=64)
    assert rendered_lights[1:] == [(("bulb",), 16, True), (("bulb",), 64, False)]
    assert (grown_basis.origin.halves, grown_basis.origin.each_light) == ((32, 32), ())
    assert_agrees(grown_basis, render_basis(scene, spp=64, seed=5))


def test_a_time_is_spent_on_what_lacks(tmp_path: Path, rendered_lights: Rendered) -> None:
    obtain_basis(room(tmp_path), spp=4)
    basis = obtain_basis(room(tmp_path, MOVED), time_s=0.01)
    # No more than the others have: what is left of a time is for all.
    assert rendered_lights[1:] == [(("bulb",), 4, True)]
    assert (basis.origin.halves, basis.origin.each_light) == ((2, 2), ())


@pytest.mark.nightly
def test_what_is_left_of_a_time_is_for_all_lights(
    tmp_path: Path, rendered_lights: Rendered
) -> None:
    """As soon as the one that was moved has as many samples as the others."""
    obtain_basis(room(tmp_path), spp=4)
    scene = room(tmp_path, MOVED)
    requests: list[dict[str, Any]] = []

    def render(
        scene: Scene, *, time_s: float, until_spp: int | None = None, **options: Any
    ) -> Basis:
        requests.append({"names": len(scene.lights), "time_s": time_s, "until_spp": until_spp})
        return render_basis(scene, **options | {"spp": until_spp or 8})

    basis = obtain_basis(scene, time_s=1000.0, render=render)
    assert [(request["names"], request["until_spp"]) for request in requests] == [
        (1, 4),
        (len(NAMES), None),
    ]
    assert 0 < requests[1]["time_s"] < requests[0]["time_s"] <= 1000
    assert (basis.origin.halves, basis.origin.each_light) == ((4, 4), ())


@pytest.mark.nightly
def test_exactly_what_is_asked_for_is_rendered_as_a_whole(
    tmp_path: Path, rendered_lights: Rendered
) -> None:
    obtain_basis(room(tmp_path), spp=16)
    scene = room(tmp_path, MOVED)
    fresh_basis = obtain_basis(scene, spp=16, use_cache=False)
    obtain_basis(scene, spp=16)  # which is composed, and kept
    del rendered_lights[:]
    same_basis(obtain_basis(scene, spp=16, exact_spp=True), fresh_basis)
    assert rendered_lights == [(NAMES, 16, True)]
    assert not obtain_basis(scene, spp=16).origin.is_composed


@pytest.mark.parametrize("other", [{"seed": 1}, *map(nightly, [{"half": True}, {"sensor": True}])])
def test_nothing_of_another_view_size_or_seed_is_taken(
    tmp_path: Path, rendered_lights: Rendered, other: dict[str, Any]
) -> None:
    sensor = """<sensor type="perspective" id="other"><film type="hdrfilm">
        <integer name="width" value="24"/><integer name="height" value="20"/></film></sensor>"""
    obtain_basis(room(tmp_path, sensors=sensor), spp=4)
    scene = room(tmp_path, MOVED, sensors=sensor)
    scene = scene.reduced("1/2") if "half" in other else scene
    scene = load_scene(scene.path, sensor="other") if "sensor" in other else scene
    obtain_basis(scene, spp=4, seed=other.get("seed", 0))
    assert [record[0] for record in rendered_lights] == [NAMES] * 2


@pytest.mark.nightly
def test_a_reduced_film_has_planes_of_its_own(tmp_path: Path, rendered_lights: Rendered) -> None:
    first = obtain_basis(room(tmp_path).reduced("1/3"), spp=36)
    scene = room(tmp_path, MOVED).reduced("1/3")
    second = obtain_basis(scene, spp=36)
    assert rendered_lights[1:] == [(("bulb",), 36, True)]
    assert reused_lights(second, first) == {*NAMES} - {"bulb"}
    assert_agrees(second, render_basis(scene, spp=36, seed=5))


@pytest.mark.nightly
def test_groups_and_what_is_kept(tmp_path: Path, rendered_lights: Rendered) -> None:
    options: dict[str, Any] = {"lights": ["pair", "panel"], "groups": {"pair": ["bulb", "beam"]}}
    first = obtain_basis(load_scene(room(tmp_path).path, **options), spp=32)
    assert first.names == ("panel", "pair", "rest")
    scene = load_scene(room(tmp_path, MOVED).path, **options)
    second = obtain_basis(scene, spp=32)
    assert rendered_lights[1:] == [(("pair",), 32, True)]
    assert_agrees(second, render_basis(scene, spp=32, seed=5))
    scene = load_scene(room(tmp_path, ('x="0.3" y="-1"', 'x="0.5" y="-1"')).path, **options)
    third = obtain_basis(scene, spp=32)
    assert rendered_lights[2:] == [(("rest",), 32, True)]
    assert reused_lights(third, first) == {"panel", "pair"}
    assert_agrees(third, render_basis(scene, spp=32, seed=5))


@pytest.mark.nightly
def test_separate_renders(tmp_path: Path, rendered_lights: Rendered) -> None:
    options: dict[str, Any] = {"integrator": '<integrator type="volpathmis"/>'}
    first = obtain_basis(room(tmp_path, **options), spp=16)
    passes: list[str] = []
    scene = room(tmp_path, MOVED, **options)

    def count(label: str, done: int, *_: object) -> None:
        passes.extend([label] * (done > 0))

    second = obtain_basis(scene, spp=16, render=render_basis, progress=count)
    assert {*passes} == {"basis: bulb"}
    # Up to half floats: sums are taken apart and put together again.
    scale = 2.0**-10 * first.images.max()
    others = [k for k, name in enumerate(NAMES) if name != "bulb"]
    assert np.abs(second.images[others] - first.images[others]).max() <= scale
    assert_agrees(second, render_basis(scene, spp=16, seed=5))
    assert second.origin.is_composed


@pytest.mark.nightly
def test_what_is_rendered_in_parts(tmp_path: Path) -> None:
    log: list[tuple[tuple[str, ...], bool]] = []

    def render(scene: Scene, *, spp: int, seed: int, start: Basis | None, **_: Any) -> Basis:
        if start is not None and start.origin.spp >= spp:
            return start
        log.append((tuple(x.name for x in scene.lights), start is None))
        return render_in_parts(scene, spp=spp, seed=seed, start=start)

    first = obtain_basis(room(tmp_path), spp=16, render=render)
    scene = room(tmp_path, MOVED)
    second = obtain_basis(scene, spp=16, render=render)
    third = obtain_basis(scene, spp=32, render=render)
    assert log == [(NAMES, True), (("bulb",), True), (NAMES, False)]
    assert reused_lights(second, first) == {*NAMES} - {"bulb"}
    assert_agrees(second, render_basis(scene, spp=16, seed=5))
    assert_agrees(third, render_basis(scene, spp=32, seed=5))


@pytest.mark.nightly
def test_what_is_larger_than_memory(
    tmp_path: Path, rendered_lights: Rendered, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = obtain_basis(room(tmp_path), spp=16)
    expected = obtain_basis(room(tmp_path, MOVED), spp=16)
    basis_cache.delete_entries(
        [entry for entry in basis_cache.entries() if entry.origin == expected.origin]
    )
    monkeypatch.setattr(basis_file, "IN_MEMORY_MAX_BYTES", 0)
    large = obtain_basis(room(tmp_path, MOVED), spp=16)
    assert [record[0] for record in rendered_lights] == [NAMES, ("bulb",), ("bulb",)]
    assert isinstance(large.planes, FilePlanes)
    assert reused_lights(large, first) == {*NAMES} - {"bulb"}
    assert large.lights == expected.lights
    # Where it cannot be kept it stays in several files.
    basis_cache.delete_entries(
        [entry for entry in basis_cache.entries() if entry.origin == large.origin]
    )
    monkeypatch.setattr(basis_cache, "keep", lambda basis: False)
    separate = obtain_basis(room(tmp_path, MOVED), spp=16)
    assert reused_lights(separate, large) >= {*NAMES} - {"bulb"}
    weights = np.linspace(0, 1, 15).reshape(5, 3)
    np.testing.assert_allclose(separate.mix(weights), large.mix(weights), atol=2e-3)
    some = slice(100, 333)
    np.testing.assert_array_equal(separate.planes.pixels(some)[2:], large.planes.pixels(some)[2:])


@pytest.mark.parametrize("damage", ["cut", "gone"])
def test_a_damaged_file_costs_its_planes(
    tmp_path: Path, rendered_lights: Rendered, damage: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    obtain_basis(room(tmp_path), spp=16)
    [entry] = basis_cache.entries()
    listed = basis_cache.entries
    if damage == "cut":
        content = entry.path.read_bytes()
        entry.path.write_bytes(content[: len(content) * 3 // 4])
    else:  # between being listed and being read

        def and_gone() -> list[basis_cache.Entry]:
            entries = listed()
            entry.path.unlink(missing_ok=True)
            return entries

        monkeypatch.setattr(basis_cache, "entries", and_gone)
    basis = obtain_basis(scene := room(tmp_path, MOVED), spp=16)
    assert [record[0] for record in rendered_lights] == [NAMES] * 2
    assert basis.origin.scene_identity == scene.identity
    assert not basis.origin.is_composed


@pytest.mark.nightly
def test_planes_without_an_identity_are_none_of_anybodys(
    tmp_path: Path, rendered_lights: Rendered
) -> None:
    """As in files of versions that knew of none."""
    first = obtain_basis(room(tmp_path), spp=16)
    lights = tuple(replace(light, identity="") for light in first.lights)
    basis_cache.delete_entries(basis_cache.entries())
    assert basis_cache.keep(replace(first, lights=lights))
    obtain_basis(room(tmp_path, MOVED), spp=16)
    assert [record[0] for record in rendered_lights] == [NAMES] * 2
    same_basis(obtain_basis(room(tmp_path), spp=16), first)
    assert len(rendered_lights) == 2


def test_an_interrupt_keeps_what_is_done(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rendered_lights: Rendered
) -> None:
    monkeypatch.setattr("lightpaint.scene.scene_render.SAMPLES_PER_PASS", 4 * 2 * 24 * 20)
    obtain_basis(room(tmp_path), spp=32)
    scene = room(tmp_path, MOVED)

    def press_ctrl_c(_label: str, done: int, _total: int) -> None:
        if done == 4:
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(Interrupted, match="16 of 32"):
        obtain_basis(scene, spp=32, render=render_basis, progress=press_ctrl_c)
    basis = obtain_basis(scene, spp=32)
    assert rendered_lights[1:] == [(("bulb",), 32, False)]
    assert_agrees(basis, render_basis(scene, spp=32, seed=5))


def test_two_scenes_in_one_folder_share_what_is_the_same(
    tmp_path: Path, rendered_lights: Rendered
) -> None:
    first = obtain_basis(room(tmp_path), spp=16)
    path = write_room(tmp_path, name="hall.xml", lights=LIGHTS["panel"] + LIGHTS["sun"])
    second = obtain_basis(load_scene(path), spp=16)
    assert len(rendered_lights) == 1
    assert reused_lights(second, first) == {"panel", "sun"}
    assert (second.origin.scene, second.source) == ("hall.xml", str(path))


def test_a_person_is_told(tmp_path: Path, make_listener: Callable[[], Any]) -> None:
    obtain(room(tmp_path), Settings(spp=4), make_listener())
    listener = make_listener()
    obtain(room(tmp_path, MOVED), Settings(spp=4), listener)
    assert listener.remarks == [
        "4 of 5 lights come from an earlier run; 1 is rendered (use_cache=False renders all again)"
    ]
    listener = make_listener()
    obtain(room(tmp_path, MOVED), Settings(spp=4), listener)
    assert listener.remarks == [
        "basis of 4 samples per pixel kept from an earlier run (use_cache=False renders it again)"
    ]


@pytest.fixture
def make_listener() -> Callable[[], Any]:
    class Hears:
        def __init__(self) -> None:
            self.remarks: list[str] = []

        def __call__(self, *_: object) -> None: ...

        def say(self, text: str) -> None:
            self.remarks.append(text)

    return Hears


class LocalEngine:
    """An engine that does its items in this process, and notes of which lights they are."""

    def __init__(self) -> None:
        self.lights: set[tuple[str, ...]] = set()

    def run(self, items: Sequence[Any]) -> Iterator[ItemResult]:
        memory = WorkerCache()
        for item in items:
            self.lights.add(item.film.light_names)
            yield run_item(item, memory, listener(silent))


def test_workers_render_the_moved_lamp_alone(tmp_path: Path) -> None:
    def obtained(scene: Scene) -> tuple[Basis, set[tuple[str, ...]]]:
        engine = LocalEngine()
        render = PartwiseRender(engine, SceneFilm(SceneFile(str(scene.path))))  # type: ignore[arg-type]
        return obtain_basis(scene, spp=16, render=render), engine.lights

    first, lights = obtained(room(tmp_path))
    assert lights == {()}
    second, lights = obtained(scene := room(tmp_path, MOVED))
    assert lights == {("bulb",)}
    assert reused_lights(second, first) == {*NAMES} - {"bulb"}
    assert_agrees(second, render_basis(scene, spp=16, seed=5))


@pytest.mark.parametrize("sample_count", [0, 2, 5])
def test_a_time_ends_where_no_more_samples_are_wanted(sample_count: int) -> None:
    budget = Budget(4, time_s=1e6, until_spp=9)
    assert sum(steps(100, budget, sample_count, silent)) == 5 - sample_count
