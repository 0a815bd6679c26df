"""A verification that stops early: its stages, its false alarms, and what it still finds."""

from pathlib import Path
from statistics import NormalDist

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from renderer import LIGHTS, write_room

from lightpaint.basis.render.basis_render import render_basis
from lightpaint.images.estimate import Estimate
from lightpaint.lighting.answer.combination import combine
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.relit.detection_power import LightShares
from lightpaint.relit.relight import relight
from lightpaint.relit.sample_budget import FEWEST
from lightpaint.relit.sequential_verification import (
    PARTS,
    limit_of_looks,
    stages_of,
    unchecked,
    verify_in_stages,
)
from lightpaint.relit.verification import LIMIT
from lightpaint.scene.scene_reader import load_scene

SIZE = (24, 32)


@given(st.integers(2, 5000), st.sampled_from([1, 4, 16]))
def test_stages_grow_up_to_all_samples_in_equal_halves(samples: int, block_pixels: int):
    spp = max(samples // (2 * block_pixels), 1) * 2 * block_pixels
    stages = stages_of(spp, block_pixels)
    assert stages[-1] == spp
    assert stages == sorted(set(stages))
    assert len(stages) <= len(PARTS)
    for stage in stages:
        assert stage % (2 * block_pixels) == 0
    assert stages[0] >= min(spp, FEWEST // 2)


def test_one_look_has_the_limit_and_more_looks_no_more_false_alarms():
    assert limit_of_looks(1) == pytest.approx(LIMIT, rel=1e-9)  # float64 in the tail
    # Sums of white noise, looked at after 1/8, 1/4, 1/2 and all: how often one is beyond. At 5
    # standard errors nothing would ever be, so it is tried where one look alarms in 1 of 20.
    once, runs = NormalDist().inv_cdf(0.975), 20_000
    looks = limit_of_looks(len(PARTS), once=once)
    rng = np.random.default_rng(0)
    walk = rng.normal(size=(runs, PARTS[0])).cumsum(axis=1)
    at = np.array([PARTS[0] // part for part in PARTS])
    z = walk[:, at - 1] / np.sqrt(at)
    alarms = (np.abs(z) > looks).any(axis=1).mean()
    error = 4 * np.sqrt(0.05 * 0.95 / runs)
    assert alarms <= 0.05 + error
    # Without the farther limit it would alarm much more often.
    assert (np.abs(z) > once).any(axis=1).mean() > 0.1


def _estimate(picture: np.ndarray, sigma: float, rng: np.random.Generator) -> Estimate:
    noise = rng.normal(scale=sigma * 2**0.5, size=(2, *SIZE, 3))
    return Estimate.of_halves(*(picture + noise).astype(np.float32))


def test_what_is_unchecked_are_the_lights_that_only_more_samples_show():
    rng = np.random.default_rng(1)
    strengths = {"sun": 30.0, "lamp": 1.0, "glow": 0.001}
    pictures = [np.full((*SIZE, 3), strength) for strength in strengths.values()]
    whole = sum(pictures)
    clean = np.zeros((*SIZE, 3), np.float32)
    lights = LightShares.of_pictures(
        list(strengths), [Estimate(x.astype(np.float32), clean) for x in pictures]
    )
    predicted = Estimate(np.asarray(whole, np.float32), clean)
    # 5 % of the lamp is .05 in each pixel: 5 standard errors of the sum at sigma .05 √(h w) / 5.
    sigma = 0.05 * np.sqrt(SIZE[0] * SIZE[1]) / LIMIT
    noisy = _estimate(np.asarray(whole), 1.5 * sigma, rng)
    share = 1 / sum(strengths.values())
    # An eighth of the samples is there: √8 less noise shows the lamp, and never the glow.
    found = unchecked(predicted, noisy, lights, 1 / 8, limit=LIMIT)
    assert found == pytest.approx(share, rel=1e-5)  # float32
    assert unchecked(predicted, noisy, lights, 1.0, limit=LIMIT) == 0


def test_it_stops_early_and_still_finds_what_is_wrong(tmp_path: Path):
    scene = load_scene(write_room(tmp_path, lights=LIGHTS["panel"] + LIGHTS["sky"]))
    basis = render_basis(scene, spp=256, seed=0)
    lighting = Lighting.of_weights(basis, basis.present_weights)
    relit = relight(scene, lighting, tmp_path / "relit.xml")
    predicted = combine(basis, lighting)
    right = verify_in_stages(predicted, relit, basis, lighting, spp=1024)
    assert right.agrees
    assert right.spp is not None
    assert right.spp < 1024
    assert right.limit == pytest.approx(limit_of_looks(len(stages_of(1024))))
    wrong = Estimate(predicted.image * np.float32(1.2), predicted.half_difference)
    found = verify_in_stages(wrong, relit, basis, lighting, spp=1024)
    assert not found.agrees
    assert found.spp == stages_of(1024)[0]
