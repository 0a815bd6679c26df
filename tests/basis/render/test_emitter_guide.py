"""Choosing emitters by what was learned: probabilities, no bias, less noise, and going on."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from nightly import nightly
from renderer import REPOSITORY, assert_equal_bits, write_room

from lightpaint.basis.file.basis_file import read_basis, write_basis
from lightpaint.basis.render import basis_render
from lightpaint.basis.render.basis_render import _render_one_by_one, render_basis
from lightpaint.basis.render.render_budget import Budget, Keeper
from lightpaint.progress import silent
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.runtime.variant import use_variant
from lightpaint.scene.scene_reader import load_scene

#: Two spots that each light one end of the floor, and a lamp behind the wall.
SPOTS = "".join(
    f"""<emitter type="spot" id="spot{x}"><float name="cutoff_angle" value="12"/>
    <transform name="to_world"><lookat origin="{x} 1.8 0.5" target="{x} 0 0.2" up="1 0 0"/>
    </transform></emitter>"""
    for x in (-0.7, 0.7)
)
BEHIND = '<emitter type="point" id="behind"><point name="position" x="0" y="1" z="-3"/></emitter>'


def probabilities(received: np.ndarray, samples: np.ndarray, lights: list[int]) -> np.ndarray:
    use_variant()
    from lightpaint.basis.render.tracer.emitter_guide import _probabilities

    sampled = np.ones(len(lights), dtype=bool)
    return _probabilities(received, samples, np.asarray(lights), sampled)


@given(st.integers(0, 2**32 - 1), st.integers(1, 7), st.integers(1, 5))
def test_probabilities_are_probabilities(seed: int, emitters: int, cells: int) -> None:
    use_variant()
    from lightpaint.basis.render.tracer.emitter_guide import EVEN_SHARE

    rng = np.random.default_rng(seed)
    samples = rng.integers(0, 5, (cells, emitters)).astype(float)
    received = rng.lognormal(0, 10, (cells, emitters)) * (samples > rng.integers(0, 4))
    probability_table = probabilities(
        received, samples, rng.integers(0, emitters, emitters).tolist()
    )
    # Precision of float64.
    np.testing.assert_allclose(probability_table.sum(axis=1), 1, rtol=1e-12)
    assert probability_table.min() >= EVEN_SHARE / emitters * (1 - 1e-12)


def test_an_untrained_guide_chooses_evenly() -> None:
    np.testing.assert_allclose(
        probabilities(np.zeros((3, 4)), np.zeros((3, 4)), [0, 1, 2, 3]), 0.25
    )


def test_a_light_is_asked_where_it_matters_however_faint_it_is() -> None:
    use_variant()
    from lightpaint.basis.render.tracer.emitter_guide import EVEN_SHARE

    samples = np.full((2, 2), 1e6)
    probability_table = probabilities(np.array([[1e6, 0], [0, 1.0]]), samples, [0, 1])
    # Each reaches one cell alone and gets that cell, but for the even share.
    sure = 1 - EVEN_SHARE / 2
    # 1e-6: what one sample of trust in the mean does beside a million.
    np.testing.assert_allclose(probability_table, [[sure, 1 - sure], [1 - sure, sure]], atol=2e-6)


@pytest.mark.parametrize("samples", [nightly((2**10,)), (2**16, 2**18)])
def test_guided_planes_are_those_of_separate_renders_within_noise(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, samples: tuple[int, ...]
) -> None:
    """However short or long the training."""
    monkeypatch.setattr(basis_render, "TRAINING_SAMPLES", samples)
    monkeypatch.setattr(basis_render, "TRAINING_SPP", 2**20)
    from renderer import LIGHTS

    lights = SPOTS + BEHIND + LIGHTS["panel"] + LIGHTS["sky"]
    scene = load_scene(write_room(tmp_path, lights=lights))
    basis = render_basis(scene, spp=512)
    separate = _render_one_by_one(scene, Budget(256), 1, None, Keeper(None), silent)
    for k, name in enumerate(basis.names):
        gap = basis.images[k] - separate.images[k]
        noise = np.square(basis.half_differences[k], dtype=np.float64)
        noise += np.square(separate.half_differences[k], dtype=np.float64)
        # Noise: five standard errors of the sums over the left and the right half.
        for half in (np.s_[:, :12], np.s_[:, 12:]):
            assert abs(gap[half].sum(dtype=np.float64)) <= 5 * np.sqrt(noise[half].sum()), name


def test_lights_that_reach_little_get_their_samples_there(tmp_path: Path) -> None:
    from renderer import one_pass

    integrator = '<integrator type="path"><integer name="max_depth" value="2"/></integrator>'
    scene = load_scene(write_room(tmp_path, lights=SPOTS + BEHIND, integrator=integrator))
    guided = render_basis(scene, spp=512, seed=1)
    chance = np.stack([one_pass(scene, seed=k, spp=16) for k in range(8)])
    variance = np.square(guided.half_differences, dtype=np.float64).mean(axis=(1, 2, 3)) * 512
    hit_by_chance = chance.var(axis=0, ddof=1).mean(axis=(1, 2, 3)) * 16
    # At least twice lower for both spots; no claim for a lamp that the wall hides.
    assert (variance[:2] < 0.5 * hit_by_chance[:2]).all()


def test_a_small_picture_trains_with_as_many_samples_as_suit_it() -> None:
    scene = load_scene(REPOSITORY / "scenes" / "gallery" / "scene.xml")
    whole, small = basis_render.training_samples(scene), scene.reduced("64x36")
    assert whole == basis_render.TRAINING_SAMPLES
    few = basis_render.training_samples(small)
    assert abs(sum(few) - basis_render.TRAINING_SPP * 64 * 36) <= len(few)
    assert few[1] == few[2] == pytest.approx(2 * few[0], abs=1)
    # Where many emitters are to choose from, each wants some.
    nodes = range(10 * len(small.emitters))
    crowd = replace(small, emitters=tuple(replace(small.emitters[0], node=k) for k in nodes))
    expected = basis_render.TRAINING_SPP_PER_EMITTER * len(crowd.emitters) * 64 * 36
    assert abs(sum(basis_render.training_samples(crowd)) - expected) <= 3
    assert basis_render.training_samples(replace(crowd, film=scene.film)) == whole


def test_a_guide_without_a_choice_is_not_trained(
    small_room: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its planes are those of a trained one, to the bit."""
    use_variant()
    from lightpaint.basis.render.tracer.emitter_guide import EmitterGuide

    alone = small_room.only(["panel"])
    untrained = render_basis(alone, spp=8)
    assert untrained.guide_table is not None
    assert not untrained.guide_table.any()
    monkeypatch.setattr(EmitterGuide, "has_choice", True)
    trained = render_basis(alone, spp=8)
    assert trained.guide_table is not None
    assert trained.guide_table.any()
    assert_equal_bits(untrained, replace(trained, guide_table=untrained.guide_table))


def test_the_table_goes_through_the_file(tmp_path: Path) -> None:
    scene = load_scene(write_room(tmp_path, lights=SPOTS + BEHIND))
    basis = render_basis(scene, spp=8)
    assert basis.guide_table is not None
    received, samples = basis.guide_table
    assert samples.sum() > 0
    assert (received[samples == 0] == 0).all()
    write_basis(tmp_path / "b.exr", basis)
    reread = read_basis(tmp_path / "b.exr").guide_table
    assert reread is not None
    np.testing.assert_array_equal(reread, basis.guide_table)


@pytest.mark.nightly
@pytest.mark.parametrize("damage", ["nan", "negative", "shape", "none"])
def test_a_damaged_memory_is_forgotten(tmp_path: Path, damage: str) -> None:
    scene = load_scene(write_room(tmp_path, lights=SPOTS))
    basis = render_basis(scene, spp=4)
    assert basis.guide_table is not None
    guide_table = basis.guide_table.copy()
    if damage in ("nan", "negative"):
        guide_table[0, 0, 0] = np.nan if damage == "nan" else -1
    spoilt = {"shape": guide_table[:, :1], "none": None}.get(damage, guide_table)
    continuation = render_basis(scene, spp=64, start=replace(basis, guide_table=spoilt))
    assert np.isfinite(continuation.images).all()
    assert continuation.images.max() > 0


def test_a_kept_emitter_that_is_never_sampled_is_as_dark_as_in_mitsuba(tmp_path: Path) -> None:
    from renderer import LIGHTS, mitsuba_render

    unsampled = '<float name="sampling_weight" value="0"/></emitter>'
    bulb, panel = (LIGHTS[name].replace("</emitter>", unsampled) for name in ("bulb", "panel"))
    path = write_room(tmp_path, lights=bulb + panel + LIGHTS["sky"])
    scene = load_scene(path, lights=["sky"])
    basis = render_basis(scene, spp=512)
    rendered = mitsuba_render(scene, {"sky": (0.0, 0.0, 0.0)}, seed=1, spp=512)
    rest_image = basis.image("rest")
    noise = 2 * np.square(basis.half_differences[basis.names.index("rest")]).sum(dtype=np.float64)
    # Noise: five standard errors of the difference of the sums. The panel is there by chance
    # hits alone, the bulb not at all.
    assert abs((rest_image - rendered).sum(dtype=np.float64)) <= 5 * np.sqrt(noise)
    assert rendered.sum() > 0


def test_a_table_of_another_size_is_learned_anew(tmp_path: Path) -> None:
    """As one of a version whose tables had other cells."""
    use_variant()
    from lightpaint.basis.render.tracer.one_pass import Tracer

    scene = load_scene(write_room(tmp_path, lights=SPOTS))
    for cells, is_trained in ((2**10, False), (2**16, True)):
        tracer = Tracer(scene, 0, np.ones((2, cells, 2), np.float32))
        assert tracer.is_trained is is_trained
        tracer.close()


@pytest.mark.parametrize("lights", [2, 300])
def test_a_hall_has_fewer_cells_than_the_table(tmp_path: Path, lights: int) -> None:
    """So that few of them share a place in it and mix what they learn."""
    use_variant()
    import drjit as dr
    import mitsuba as mi

    from lightpaint.basis.render.tracer.emitter_guide import EmitterGuide
    from lightpaint.basis.render.tracer.light_planes import lights_by_instance

    points = "".join(
        f'<emitter type="point" id="l{k}"><point name="position" x="{k}" y="9" z="0"/></emitter>'
        for k in range(lights)
    )
    scene = load_scene(write_room(tmp_path, lights=points))
    loaded = scene.load({})
    eye = mi.ScalarPoint3f(0, 1.6, 0)
    guide = EmitterGuide(loaded, lights_by_instance(loaded, scene.plane_of), eye)
    # A floor of 40 metres, from which the cells of walls and ceiling differ by their place alone.
    x, z = dr.meshgrid(dr.linspace(mi.Float, -20, 20, 1000), dr.linspace(mi.Float, 0, 40, 1000))
    floor = dr.zeros(mi.SurfaceInteraction3f, dr.width(x))
    floor.p, floor.n, floor.wi = mi.Point3f(x, 0, z), mi.Normal3f(0, 1, 0), mi.Vector3f(0, 0, 1)
    used = np.unique(np.array(guide.cell(floor))).size
    del guide, loaded
    assert used < guide_cells(lights) / 3


def guide_cells(emitters: int) -> int:
    from lightpaint.basis.render.tracer.emitter_guide import table_cells

    return table_cells(emitters)
