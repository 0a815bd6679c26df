"""Lights that a painting cannot tell apart, of images made for it."""

from typing import Any

import numpy as np
import pytest

from lightpaint.basis.light_basis import Basis, Origin
from lightpaint.basis.lights import BasisLight
from lightpaint.lighting.analysis import answer_analysis
from lightpaint.lighting.analysis.answer_analysis import ambiguities, analyse, indistinguishable
from lightpaint.lighting.default_solve import solve
from lightpaint.target.painted_target import Target

NAMES = ["key", "fill", "rim", "sky", "lamp"]


def _images(seed: int = 0) -> Any:
    """(3, 5, 200): five different lights."""
    return np.random.default_rng(seed).random((3, 5, 200)) ** 3


def _gram(images: Any) -> Any:
    return images @ images.transpose(0, 2, 1)


def test_different_lights_are_told_apart():
    for seed in range(20):
        assert indistinguishable(_gram(_images(seed)), NAMES) == ()


def test_coincident_lights_are_a_group_whatever_their_power():
    images = _images()
    images[:, 2] = 7 * images[:, 0]
    # Another colour is another weight, not another light.
    images[:, 4] = images[:, 0] * np.array([1, 0.5, 1e-3])[:, None]
    (group,) = indistinguishable(_gram(images), NAMES)
    assert group.names == ("key", "rim", "lamp")
    assert not group.is_mix
    assert "key, rim and lamp light the painted part alike" in group.sentence
    assert "wider mask" in group.sentence


def test_a_light_that_is_a_mix_of_others():
    images = _images()
    images[:, 3] = 0.5 * images[:, 0] + 2 * images[:, 1]
    (group,) = indistinguishable(_gram(images), NAMES)
    assert group.names == ("key", "fill", "sky")
    assert group.is_mix
    assert "mixes of key, fill and sky" in group.sentence


def test_fewer_pixels_than_lights():
    groups = indistinguishable(_gram(_images()[:, :, :2]), NAMES)
    assert groups
    assert all(each.is_mix for each in groups)


def test_lights_that_reach_nothing_are_not_compared():
    images = _images()
    images[:, 1] = images[:, 4] = 0
    assert indistinguishable(_gram(images), NAMES) == ()


def test_one_channel_and_no_lights():
    images = _images()
    images[0, 1] = images[0, 0]
    (group,) = indistinguishable(_gram(images)[0], NAMES)
    assert group.names == ("key", "fill")
    # In the other channels they do differ: it is in one that they can trade.
    (group,) = indistinguishable(_gram(images), NAMES)
    assert group.names == ("key", "fill")
    assert group.is_mix
    assert indistinguishable(np.zeros((3, 0, 0)), []) == ()


def _noisy_basis() -> Basis:
    """Three lights, of which the first and the last are at one place."""
    rng = np.random.default_rng(0)
    clean = rng.random((3, 16, 16, 3))
    clean[2] = clean[0]
    noise = rng.normal(scale=0.01, size=(2, *clean.shape))
    images = (clean + noise[0]).astype(np.float32)
    lights = tuple(
        BasisLight(name, "area", "radiance", "W/(m² sr)", (1.0, 1.0, 1.0)) for name in "abc"
    )
    origin = Origin("s", "", "c", 0, "one pass", (8, 8), (1, 1))
    emitter_mask = np.zeros((16, 16), dtype=bool)
    return Basis(lights, images, noise[1].astype(np.float32), emitter_mask, origin)


@pytest.mark.parametrize("share_lights", [3, 1])
def test_two_lights_at_one_place_are_named_in_spite_of_noise(
    monkeypatch: pytest.MonkeyPatch, share_lights: int
):
    """Also where the noise of some lights has to tell about the others."""
    monkeypatch.setattr(answer_analysis, "SHARE_LIGHTS", share_lights)
    basis = _noisy_basis()
    target = Target("t", basis.mix(np.ones((3, 3))), np.ones((16, 16), np.float32), False)
    [ambiguity] = ambiguities(solve(basis, target))
    assert ambiguity.names == ("a", "c")
    assert not ambiguity.is_mix


def test_the_analysis_of_many_lights_is_that_of_few(monkeypatch: pytest.MonkeyPatch):
    """Its parts come one after the other then, which needs less memory."""
    basis = _noisy_basis()
    image = basis.mix(np.full((3, 3), 0.7)) + np.float32(0.1)
    solution = solve(basis, Target("t", image, np.ones((16, 16), np.float32), everything=False))
    [few] = analyse(solution)
    running: list[str] = []
    run_stage = answer_analysis._run_stage

    def alone(label: str, work: Any) -> Any:
        assert running == []
        running.append(label)
        result = run_stage(label, work)
        running.clear()
        return result

    monkeypatch.setattr(answer_analysis, "FEW_LIGHTS", 2)
    monkeypatch.setattr(answer_analysis, "_run_stage", alone)
    [many] = analyse(solution)
    assert few.uncertainty is not None
    assert many.uncertainty is not None
    errors = many.uncertainty.standard_error, few.uncertainty.standard_error
    np.testing.assert_array_equal(*errors)
    assert many.ambiguities == few.ambiguities != ()
    assert many.appearance.delta_e == few.appearance.delta_e
