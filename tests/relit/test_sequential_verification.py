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
from lightpaint.relit.relit_scene import relight
from lightpaint.relit.verification import LIMIT, LightShares, limit_of_tests
from lightpaint.relit.verification_render import (
    ALL_PARTS,
    FIRST_LOOK,
    LOOKS,
    can_tell,
    shares_of_emitters,
    stages_of,
    verify_in_stages,
)
from lightpaint.scene.scene_reader import load_scene

SIZE = (24, 32)


@given(st.integers(2, 5000), st.sampled_from([1, 4, 16]))
def test_stages_grow_up_to_all_samples_in_equal_halves(samples: int, block_pixels: int):
    spp = max(samples // (2 * block_pixels), 1) * 2 * block_pixels
    stages = stages_of(spp, block_pixels)
    assert stages[-1] == spp
    assert stages == sorted(set(stages))
    assert len(stages) <= len(LOOKS)
    for stage in stages:
        assert stage % (2 * block_pixels) == 0
    assert stages[0] >= min(spp, FIRST_LOOK)


def test_one_look_has_the_limit_and_more_looks_no_more_false_alarms():
    assert limit_of_tests(1) == pytest.approx(LIMIT, rel=1e-9)  # float64 in the tail
    # Sums of white noise, looked at after some and all: how often one is beyond. At 5 standard
    # errors nothing would ever be, so it is tried where one look alarms in 1 of 20.
    single_limit, runs = NormalDist().inv_cdf(0.975), 20_000
    looks = limit_of_tests(len(LOOKS), once=single_limit)
    rng = np.random.default_rng(0)
    walk = rng.normal(size=(runs, ALL_PARTS)).cumsum(axis=1)
    look_counts = np.array(LOOKS)
    z = walk[:, look_counts - 1] / np.sqrt(look_counts)
    alarms = (np.abs(z) > looks).any(axis=1).mean()
    error = 4 * np.sqrt(0.05 * 0.95 / runs)
    assert alarms <= 0.05 + error
    # Without the farther limit it would alarm much more often.
    assert (np.abs(z) > single_limit).any(axis=1).mean() > 0.1


def _estimate(picture: np.ndarray, sigma: float, rng: np.random.Generator) -> Estimate:
    noise = rng.normal(scale=sigma * 2**0.5, size=(2, *SIZE, 3))
    return Estimate.of_halves(*(picture + noise).astype(np.float32))


def _lit(strengths: dict[str, float]) -> tuple[Estimate, LightShares]:
    """Return a prediction without noise and its lights, each alone in a column of the picture."""
    clean, pictures = np.zeros((*SIZE, 3), np.float32), []
    for k, strength in enumerate(strengths.values()):
        picture = clean.copy()
        picture[:, 8 * k : 8 * k + 8] = strength
        pictures.append(Estimate(picture, clean))
    total = np.sum([x.image for x in pictures], axis=0)
    return Estimate(total, clean), LightShares.of_pictures(list(strengths), pictures)


def test_it_ends_when_errors_show_in_most_of_the_light_and_in_each_large_light():
    rng = np.random.default_rng(1)
    # 5 % of a light of 1 is .05 in each of its pixels: so noisy that it is far beyond the limit.
    sigma = 0.05 * np.sqrt(SIZE[0] * 8) / (3 * LIMIT)

    def ends(strengths: dict[str, float], done: float = 1 / 32) -> bool:
        predicted, lights = _lit(strengths)
        return can_tell(predicted, _estimate(predicted.image, sigma, rng), lights, done)

    # What does not show makes 4 % of the light; 17 %, but all in one light; 40 % in small ones.
    assert ends({"a": 2.0, "b": 2.0, "c": 0.16})
    assert not ends({"a": 1.0, "b": 0.2})
    assert not ends({"a": 0.9, "b": 0.2, "c": 0.2, "d": 0.2})
    # Where more samples would show no more, it ends as well.
    assert ends({"a": 1.0, "b": 0.2}, done=1.0)
    assert ends({"a": 1e-3, "b": 1e-3, "c": 1e-3})


def test_it_ends_at_once_where_they_disagree():
    predicted, lights = _lit({"a": 1.0, "b": 0.2, "c": 0.2})
    rng = np.random.default_rng(2)
    sigma = 0.05 * np.sqrt(SIZE[0] * 8) / (3 * LIMIT)
    assert not can_tell(predicted, _estimate(predicted.image, sigma, rng), lights, 1 / 32)
    wrong_image = predicted.image.copy()
    wrong_image[:, :8] *= 1.3
    assert can_tell(predicted, _estimate(wrong_image, sigma, rng), lights, 1 / 32)


@pytest.mark.parametrize("spp", [2, 6, 9])
def test_it_never_takes_more_samples_than_its_budget(tmp_path: Path, spp: int):
    scene = load_scene(write_room(tmp_path, lights=LIGHTS["panel"] + LIGHTS["sky"]))
    basis = render_basis(scene, spp=4, seed=0)
    lighting = Lighting.of_weights(basis, basis.current_weights)
    relit = relight(scene, lighting, tmp_path / "relit.xml")
    verification = verify_in_stages(combine(basis, lighting), relit, basis, lighting, spp=spp)
    assert verification.spp is not None
    # Two halves of equally many, so one more than an odd number.
    assert verification.spp <= spp + spp % 2


def test_it_stops_early_and_still_finds_what_is_wrong(tmp_path: Path):
    scene = load_scene(write_room(tmp_path, lights=LIGHTS["panel"] + LIGHTS["sky"]))
    basis = render_basis(scene, spp=256, seed=0)
    lighting = Lighting.of_weights(basis, basis.current_weights)
    relit = relight(scene, lighting, tmp_path / "relit.xml")
    predicted = combine(basis, lighting)
    right = verify_in_stages(predicted, relit, basis, lighting, spp=1024)
    assert right.agrees
    assert right.spp is not None
    assert right.spp < 1024
    assert right.limit == pytest.approx(limit_of_tests(len(stages_of(1024))))
    wrong_estimate = Estimate(predicted.image * np.float32(1.2), predicted.half_difference)
    verification = verify_in_stages(wrong_estimate, relit, basis, lighting, spp=1024)
    assert not verification.agrees
    assert verification.spp == stages_of(1024)[0]


def test_members_share_the_light_of_a_group_and_an_image_has_that_of_its_texels(tmp_path: Path):
    room = write_room(tmp_path, lights="".join(LIGHTS[x] for x in ("panel", "bulb", "sky")))
    scene = load_scene(room, groups={"pair": ["panel", "bulb"]}, split={"sky": (2, 3)})
    basis = render_basis(scene, spp=2, seed=0)
    lighting = Lighting.of_weights(basis, basis.current_weights)
    relit = relight(scene, lighting, tmp_path / "relit.xml")
    shares = {name: 0.5 if name == "pair" else 0.1 for name in basis.names if name != "sky.x1.y2"}
    expected = {"panel": 0.25, "bulb": 0.25, "sky": 0.5}
    assert shares_of_emitters(relit, lighting, shares) == pytest.approx(expected, rel=1e-12)
