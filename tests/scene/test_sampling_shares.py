"""Emitters that are sampled by their share of the light: the same picture with less noise."""

import gc
from pathlib import Path

import numpy as np
import pytest
from renderer import LIGHTS, write_room

from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene
from lightpaint.scene.scene_render import EVEN_SHARE, Stream, render, sampled_by

#: One surface, which lights reach without a bounce.
DIRECT = '<integrator type="path"><integer name="max_depth" value="2"/></integrator>'


def weights_of(scene: Scene) -> dict[str, float]:
    """Sampling weights of the emitters of the loaded scene, by name."""
    loaded = scene.load()
    weights = {x.id(): float(np.ravel(x.sampling_weight())[0]) for x in loaded.emitters()}
    del loaded
    gc.collect()
    return weights


def test_weights_follow_shares_and_none_is_starved_or_woken(tmp_path: Path) -> None:
    off = '<emitter type="point" id="off"><float name="sampling_weight" value="0"/></emitter>'
    lights = "".join(f'<emitter type="point" id="{name}"/>' for name in "abcd") + off
    scene = load_scene(write_room(tmp_path, lights=lights))
    weights = weights_of(sampled_by(scene, {"a": 9, "b": 3, "c": 0, "off": 50}))
    rest = 3 * (1 - EVEN_SHARE)
    expected = {
        "a": EVEN_SHARE + rest * 3 / 4,
        "b": EVEN_SHARE + rest / 4,
        "c": EVEN_SHARE,
        "d": 1,
        "off": 0,
    }
    assert weights == pytest.approx(expected, rel=1e-6)  # float32
    assert weights_of(sampled_by(scene, {"a": 0, "b": 0})) == weights_of(scene)


def test_wrong_shares_change_no_picture(tmp_path: Path) -> None:
    scene = load_scene(write_room(tmp_path))
    shares = dict(zip(LIGHTS, (1.0, 0.0, 30.0, 0.1, 3.0), strict=True))
    plain = render(scene, spp=512, stream=Stream.TEMPLATE)
    other = render(sampled_by(scene, shares), spp=512, stream=Stream.VERIFICATION)
    error = np.sqrt(
        sum(np.square(x.half_difference, dtype=np.float64).sum((0, 1)) for x in (plain, other))
    )
    sums = (plain.image - other.image).sum((0, 1), dtype=np.float64)
    assert (np.abs(sums) < 4 * error).all()


def test_true_shares_save_the_samples_of_lights_that_do_little(tmp_path: Path) -> None:
    names = [f"lamp_{k}" for k in range(8)]
    lights = "".join(
        f'<emitter type="point" id="{name}"><point name="position" x="0" y="1.8" z="2"/>'
        f'<rgb name="intensity" value="{2 if name == "lamp_0" else 1e-4}"/></emitter>'
        for name in names
    )
    scene = load_scene(write_room(tmp_path, lights=lights, integrator=DIRECT))
    shares = {name: 2 if name == "lamp_0" else 1e-4 for name in names}
    noise = [
        np.square(render(x, spp=64, stream=Stream.TEMPLATE).half_difference).mean()
        for x in (scene, sampled_by(scene, shares))
    ]
    # A sample that finds the lamp with probability p has the variance 1/p − 1.
    found = [1 / 8, EVEN_SHARE / 8 + 1 - EVEN_SHARE]
    expected = (1 / found[0] - 1) / (1 / found[1] - 1)
    assert noise[0] / noise[1] > expected / 2  # pixels at edges have noise of their own
