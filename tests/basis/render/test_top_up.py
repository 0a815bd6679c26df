"""A basis with further samples of some pixels: means of all of them, and noise that says so."""

import os
import signal
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from nightly import nightly
from renderer import LIGHTS, SAME_SAMPLES, render_in_parts, same_basis, write_room

import lightpaint.scene.scene_render
from lightpaint.basis.cache import basis_cache
from lightpaint.basis.cache.cached_render import obtain_basis, top_up_basis
from lightpaint.basis.file.basis_file import read_basis, write_basis
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render import basis_render, pixel_top_up
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.basis.render.rendered_basis import is_on_the_way
from lightpaint.errors import BasisError
from lightpaint.progress import Interrupted
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene

SECOND_SENSOR = """<sensor type="perspective" id="second"><transform name="to_world">
        <lookat origin="0.5, 1, 3" target="0, 0.5, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="24"/>
        <integer name="height" value="20"/></film></sensor>"""


@pytest.fixture(autouse=True)
def short_training(monkeypatch: pytest.MonkeyPatch) -> None:
    """A short training, and passes of some hundred samples of a pixel's half."""
    monkeypatch.setattr(basis_render, "TRAINING_SAMPLES", (2**12,))
    monkeypatch.setattr(lightpaint.scene.scene_render, "SAMPLES_PER_PASS", 4 * 4 * 24 * 20)


@pytest.fixture(scope="module")
def counts() -> Any:
    """None in the upper rows, and 1 to 24 below."""
    rng = np.random.default_rng(0)
    sample_counts = rng.integers(1, 25, (20, 24))
    sample_counts[:6] = 0
    return sample_counts


def weighted_sums(basis: Basis, samples: Any) -> Any:
    """The sums that means of so many samples of each half stand for, (2, n, h, w, 3) float64."""
    images, halves = (x.astype(np.float64) for x in (basis.images, basis.half_differences))
    return np.stack([images + halves, images - halves]) * samples[..., None]


def assert_close(a: Any, b: Any) -> None:
    """Assert that two arrays differ by the round-off of some sums."""
    np.testing.assert_allclose(a, b, rtol=0, atol=8 * SAME_SAMPLES * np.abs(b).max())


def test_pixels_without_further_samples_keep_their_bits(small_room: Scene, counts: Any):
    basis = render_basis(small_room, spp=8)
    topped = pixel_top_up.top_up(small_room, basis, counts)
    for a, b in ((basis, topped), (basis.indirect, topped.indirect)):
        np.testing.assert_array_equal(a.planes.rows(0, 6), b.planes.rows(0, 6))
        np.testing.assert_array_equal(a.noise.rows(0, 6), b.noise.rows(0, 6))
    assert (basis.planes.rows(6, 20) != topped.planes.rows(6, 20)).any(axis=(0, 3)).mean() > 0.5
    np.testing.assert_array_equal(topped.extra, counts)
    assert topped.origin.mean_spp == pytest.approx(8 + 2 * counts.mean())


def test_in_two_goes_as_in_one(small_room: Scene, counts: Any, tmp_path: Path):
    """Samples of a pixel are terms of a sequence, and means are weighed by their numbers."""
    basis = render_basis(small_room, spp=8)
    first = np.random.default_rng(1).integers(0, counts + 1)
    in_one = pixel_top_up.top_up(small_room, basis, counts)
    partial = pixel_top_up.top_up(small_room, basis, first)
    same_basis(pixel_top_up.top_up(small_room, partial, counts - first), in_one)
    write_basis(tmp_path / "b.exr", partial)
    read = read_basis(tmp_path / "b.exr")
    np.testing.assert_array_equal(read.extra, partial.extra)
    same_basis(pixel_top_up.top_up(small_room, read, counts - first), in_one, of_file=True)


@pytest.mark.nightly
def test_a_scene_that_stays_loaded_changes_no_bit(
    small_room: Scene, counts: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """Two views in turn: the scene of each is loaded anew only after the other's."""
    scenes = [small_room, load_scene(write_room(tmp_path, lights=LIGHTS["panel"] + LIGHTS["bulb"]))]
    bases = [render_basis(scene, spp=4) for scene in scenes]
    separate, rounds = list(bases), [0, 0, 1, 0]
    for k in rounds:
        separate[k] = pixel_top_up.top_up(scenes[k], separate[k], counts)
    loads: list[Scene] = []
    load = Scene.load
    monkeypatch.setattr(
        Scene, "load", lambda self, *a, **options: loads.append(self) or load(self, *a, **options)
    )
    with pixel_top_up.kept_loaded() as tracers:
        for k in rounds:
            bases[k] = pixel_top_up.top_up(scenes[k], bases[k], counts, tracers=tracers)
    assert [scenes.index(loaded_scene) for loaded_scene in loads] == [0, 1, 0]
    for a, b in zip(bases, separate, strict=True):
        same_basis(a, b)


@pytest.mark.nightly
def test_views_of_a_scene_are_loaded_once(counts: Any, tmp_path: Path, monkeypatch: Any):
    """Each goes on from its own sensor, with the bits that it has alone."""
    path = write_room(tmp_path, lights=LIGHTS["panel"] + LIGHTS["bulb"], sensors=SECOND_SENSOR)
    scenes = [load_scene(path, sensor=k) for k in range(2)]
    bases = [render_basis(scene, spp=4) for scene in scenes]
    separate = [pixel_top_up.top_up(*view, counts) for view in zip(scenes, bases, strict=True)]
    loads: list[Scene] = []
    load = Scene.load

    def counting(self: Scene, *a: Any, **options: Any) -> Any:
        loads.append(self)
        return load(self, *a, **options)

    monkeypatch.setattr(Scene, "load", counting)
    with pixel_top_up.kept_loaded(scenes) as tracers:
        for _ in range(2):
            results = [
                pixel_top_up.top_up(scene, basis, counts, tracers=tracers)
                for scene, basis in zip(scenes, bases, strict=True)
            ]
    assert loads == scenes[:1]
    for a, b in zip(results, separate, strict=True):
        same_basis(a, b)


@pytest.mark.nightly
def test_uniform_samples_go_on_after_a_top_up(small_room: Scene, counts: Any):
    """Both kinds of samples come to the same, in whichever order they are taken."""
    basis = render_basis(small_room, spp=8)
    before = pixel_top_up.top_up(small_room, basis, counts)
    after = render_basis(small_room, spp=24, start=before)
    np.testing.assert_array_equal(after.extra, counts)
    uniform = weighted_sums(render_basis(small_room, spp=24), np.full(counts.shape, 12.0))
    added = weighted_sums(before, 4.0 + counts) - weighted_sums(basis, np.full(counts.shape, 4.0))
    assert_close(weighted_sums(after, 12.0 + counts), uniform + added)
    same_basis(render_in_parts(small_room, spp=24, start=before), after)


@pytest.mark.parametrize("most", [nightly(1), nightly(7), 2**20])
def test_batches_change_no_bit(
    small_room: Scene, counts: Any, monkeypatch: pytest.MonkeyPatch, most: int
):
    basis = render_basis(small_room, spp=4)
    single_batch = pixel_top_up.top_up(small_room, basis, counts)
    monkeypatch.setattr(pixel_top_up, "PART_MAX_BYTES", 12 * 20 * most)
    second = pixel_top_up.top_up(small_room, basis, counts * (counts > 18) if most == 1 else counts)
    mask = counts > 18 if most == 1 else counts >= 0
    np.testing.assert_array_equal(second.images[:, mask], single_batch.images[:, mask])
    np.testing.assert_array_equal(
        second.half_differences[:, mask], single_batch.half_differences[:, mask]
    )


def test_batches_have_every_pixel_once(counts: Any):
    batches = list(pixel_top_up.pixel_batches(counts, 10))
    all_pixels = np.concatenate(batches)
    np.testing.assert_array_equal(np.sort(all_pixels), np.flatnonzero(counts))
    batch_samples = [int(counts.ravel()[pixels].sum()) for pixels in batches]
    assert all(a <= lightpaint.scene.scene_render.SAMPLES_PER_PASS // 4 for a in batch_samples)


@pytest.mark.nightly
def test_noise_falls_with_the_samples(small_room: Scene):
    """Half differences and true errors of pixels with 16 times the samples fall alike."""
    counts = np.zeros((20, 24), int)
    counts[::2] = 30
    long = render_basis(small_room, spp=512, seed=90)
    squared_errors, stated_variances = np.zeros((2, 2))
    for seed in range(1, 6):
        basis = pixel_top_up.top_up(small_room, render_basis(small_room, spp=4, seed=seed), counts)
        for k in range(2):
            squared_errors[k] += np.square(basis.images[:, k::2] - long.images[:, k::2]).sum()
            stated_variances[k] += np.square(basis.half_differences[:, k::2]).sum()
    # Evenly spread samples do better than independent ones, of which 16 times as many are.
    assert squared_errors[0] < squared_errors[1] / 8
    assert (
        0.7
        < (stated_variances[0] / stated_variances[1]) / (squared_errors[0] / squared_errors[1])
        < 1.4
    )


def test_an_interrupt_keeps_what_is_done(small_room: Scene, counts: Any):
    basis, saved_bases = render_basis(small_room, spp=4), []

    def press_ctrl_c(_label: str, done: int, _total: int) -> None:
        if done == 2:
            os.kill(os.getpid(), signal.SIGINT)

    def keep(basis: Basis) -> bool:
        saved_bases.append(basis)
        return True

    with pytest.raises(Interrupted, match="run the same command to continue"):
        pixel_top_up.top_up(small_room, basis, counts, keep=keep, progress=press_ctrl_c)
    assert 0 < saved_bases[-1].extra.sum() < counts.sum()
    rest = pixel_top_up.top_up(small_room, saved_bases[-1], counts - saved_bases[-1].extra)
    same_basis(rest, pixel_top_up.top_up(small_room, basis, counts))


def test_enough_is_enough(small_room: Scene, counts: Any):
    basis = render_basis(small_room, spp=4)
    same_basis(pixel_top_up.top_up(small_room, basis, counts, is_enough=lambda: True), basis)


def test_what_is_kept_is_not_taken_for_uniform_samples(
    small_room: Scene, counts: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path))
    basis = obtain_basis(small_room, spp=8)
    topped = top_up_basis(small_room, basis, counts)
    uniform_basis = obtain_basis(small_room, spp=8)
    assert uniform_basis.origin == topped.origin
    np.testing.assert_array_equal(uniform_basis.extra, counts)
    assert not is_on_the_way(small_room, uniform_basis, 16)
    exact = obtain_basis(small_room, spp=8, exact_spp=True)
    assert exact.extra is None
    np.testing.assert_array_equal(exact.images, basis.images)
    # Fewer samples do not replace more of them.
    assert basis_cache.is_cached(topped)
    assert obtain_basis(small_room, spp=16).origin.extra_spp == topped.origin.extra_spp


def test_damaged_numbers_of_samples_are_no_basis(small_room: Scene, counts: Any, tmp_path: Path):
    topped = pixel_top_up.top_up(small_room, render_basis(small_room, spp=4), counts)
    write_basis(tmp_path / "b.exr", topped)
    plain = replace(topped, extra=None, origin=replace(topped.origin, extra_spp=0.0))
    write_basis(tmp_path / "plain.exr", plain)
    assert read_basis(tmp_path / "plain.exr").extra is None
    write_basis(tmp_path / "b.exr", replace(topped, extra=-topped.extra))
    with pytest.raises(BasisError, match="extra samples are damaged"):
        read_basis(tmp_path / "b.exr")
    with pytest.raises(BasisError, match="extra samples"):
        replace(topped, extra=None)
    with pytest.raises(BasisError, match="another size"):
        replace(topped, extra=counts[1:])


def test_nothing_else_is_topped_up(small_room: Scene, counts: Any, tmp_path: Path):
    basis = render_basis(small_room, spp=4)
    changed = load_scene(write_room(tmp_path), parameters={"width": 20})
    with pytest.raises(BasisError, match="of this scene and film"):
        pixel_top_up.top_up(changed, basis, counts)
