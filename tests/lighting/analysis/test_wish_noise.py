"""Error bars of sketches, whose wishes are found in a noisy look."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image
from scipy.stats import norm, t

import lightpaint as lp
from lightpaint.lighting.analysis.noise import uncertainty
from lightpaint.lighting.analysis.noise.uncertainty import ReadingNoise
from lightpaint.lighting.loss import expected_lights
from lightpaint.lighting.loss.expected_lights import NoisyBlocks, PaintedBlocks, Wash
from lightpaint.target.wish_finding import DISTINCT_STOPS, find_wishes

SIZE, SEEDS, NOISE = (27, 48), 16, 0.1


def _pools() -> Any:
    """Three pools of light and one for the whole picture, (n, h, w, 3); white is 1."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]] / SIZE[1]
    places = [(0.2, 0.2), (0.6, 0.35), (0.85, 0.2)]
    pools = [0.05 + np.exp(-((x - a) ** 2 + (y - b) ** 2) / 0.02) for a, b in places]
    return 0.2 * np.stack([np.ones(SIZE), *pools])[..., None] * np.ones(3)


def _noisy_basis(make_basis: Any, seed: int) -> lp.Basis:
    """The pools with noise in each pixel, the same in all channels."""
    clean, rng = _pools(), np.random.default_rng(seed)
    a, b = (clean * (1 + NOISE * rng.normal(size=(*clean.shape[:3], 1))) for _ in range(2))
    ones = np.ones((len(clean), 3))
    return make_basis(images=(a + b) / 2, half_differences=(a - b) / 2, emission=ones)


def _sketch() -> lp.Target:
    """A picture in which two places ask for about as much more light as it takes to be a wish."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1], :1][:2]
    stops = 1.15 * DISTINCT_STOPS * ((x < 16) & (y < 16)) + 1.3 * DISTINCT_STOPS * (x > 36)
    image = _pools().sum(axis=0) * 2.0 ** (stops - 0.2) * np.array([1, 0.95, 0.9])
    return lp.Target(
        "sketch",
        image.astype(np.float32),
        np.ones(SIZE, np.float32),
        everything=True,
        transform=lp.ViewTransform(),
        through_view=True,
    )


def _corrected(basis: lp.Basis, target: lp.Target, **fit: Any) -> lp.Solution:
    return lp.correct_noise(lp.solve(basis, target, **fit))


def test_intervals_of_a_sketch_hold_whatever_wishes_noise_shows(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Some seeds show two wishes, others three or more."""
    target, clean = _sketch(), make_basis(images=_pools(), emission=np.ones((4, 3)))
    best = lp.solve(clean, target).weights
    answers = [_corrected(_noisy_basis(make_basis, seed), target) for seed in range(SEEDS)]
    counts = {len(find_wishes(target, x.basis.current_look)) for x in answers}
    assert len(counts) > 1

    def share_held() -> float:
        held = []
        for answer in answers:
            bars = lp.error_bars(answer)
            assert bars is not None
            low, high = bars.interval
            held.append((low <= best) & (best <= high))
        return float(np.mean(held))

    # Wishes move all lights together, so that seeds count alone: two standard errors below 95 %.
    least = 0.95 - 2 * (0.95 * 0.05 / SEEDS) ** 0.5
    assert share_held() > least
    unread = ReadingNoise(*np.zeros((3, *best.shape)), 4)
    monkeypatch.setattr(uncertainty.ReadingNoise, "of", lambda _solution: unread)
    assert share_held() < least - 0.3


def test_wishes_are_found_under_the_look_that_is_read(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Noise of the look alone finds and loses wishes: without it, all seeds show the same."""
    target = _sketch()

    def counts() -> set[int]:
        bases = [_noisy_basis(make_basis, seed) for seed in range(SEEDS)]
        return {len(PaintedBlocks.of(basis, target).wash.wishes) for basis in bases}

    assert len(counts()) > 1
    clean = make_basis(images=_pools(), emission=np.ones((4, 3))).current_look
    monkeypatch.setattr(expected_lights, "read_look", lambda _basis: clean)
    assert counts() == {len(find_wishes(target, clean))}


def test_a_literal_painting_and_one_without_noise_are_read_in_one_way(make_basis: Any) -> None:
    target, basis = _sketch(), _noisy_basis(make_basis, 0)
    literal = ReadingNoise.of(_corrected(basis, target, literal=True, space="display"))
    assert not np.any([literal.scatter, literal.below, literal.above])
    known = np.full((4, 3), 2.0)
    np.testing.assert_array_equal(literal.widened(known), known)
    assert ReadingNoise.of(_corrected(basis, target)).scatter.max() > 1e-3
    clean = make_basis(images=_pools(), emission=np.ones((4, 3)))
    # What is left is the round-off of the solves.
    reading = ReadingNoise.of(lp.solve(clean, target))
    assert np.max([reading.scatter, reading.below, reading.above]) < 1e-9


def test_disturbed_blocks_have_the_noise_of_the_basis_twice(make_basis: Any) -> None:
    """Of many draws, the mean is the wash, and its scatter the half difference."""
    target, basis = _sketch(), _noisy_basis(make_basis, 3)
    view, wash = NoisyBlocks.of(basis, target), PaintedBlocks.of(basis, target).wash
    assert np.array_equal(wash.rows, Wash.of(basis, target).rows)
    rng = np.random.default_rng(0)
    pairs = [view.disturbed(rng) for _ in range(32)]
    for first, second in pairs:
        np.testing.assert_allclose(first.rows + second.rows, 2 * wash.rows, atol=1e-6)
    draws = [first for first, _ in pairs]
    rows, looks = (np.stack([getattr(x, k) for x in draws]) for k in ("rows", "look"))
    # Each draw adds or subtracts the same amount: exact but for float32.
    assert np.allclose(np.abs(rows - wash.rows), np.abs(view.noise), atol=1e-6)
    assert np.allclose(looks, rows.sum(axis=2), rtol=1e-5)
    assert np.abs((rows > wash.rows).mean() - 0.5) < 4 * 0.5 / np.sqrt(64 * wash.counts.size)


def test_pixels_of_a_square_whose_mean_was_denoised_have_noise_of_one_sign(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else the mean would have the noise again that was taken out of it."""
    target, basis = _sketch(), _noisy_basis(make_basis, 3)

    def signs() -> Any:
        view, wash = NoisyBlocks.of(basis, target), PaintedBlocks.of(basis, target).wash
        first, _ = view.disturbed(np.random.default_rng(0))
        return ((first.rows - wash.rows) * view.noise > 0).reshape(3, -1, *SIZE)

    def in_squares(values: Any) -> Any:
        y, x = np.indices(SIZE) // 2 * 2
        return values[..., y, x]

    alone = signs()
    assert (alone != in_squares(alone)).mean() > 0.3
    monkeypatch.setattr(expected_lights, "read_look_side", lambda _basis: 2)
    np.testing.assert_array_equal(signs(), in_squares(signs()))


@pytest.mark.parametrize("steady", [-6.0, 3.0, 8.0])
def test_what_readings_change_alike_is_no_scatter(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch, steady: float
) -> None:
    """In closed form: the variance of opposite parts, 1 and 2, about 0, and of equal parts, 4 and
    1, about their mean. Half the square of a steadier look's change counts beyond that."""
    answer = _corrected(_noisy_basis(make_basis, 0), _sketch())
    pairs = [[SimpleNamespace(change=x) for x in pair] for pair in ((5.0, 3.0), (3.0, -1.0))]
    monkeypatch.setattr(uncertainty, "_disturbed_washes", lambda *_: iter(pairs))
    monkeypatch.setattr(uncertainty, "_steady_wash", lambda _: SimpleNamespace(change=steady))
    as_read = uncertainty.solve_for(answer, answer.problem.solved)
    monkeypatch.setattr(uncertainty, "_answer_to_reading", lambda _, wash: as_read + wash.change)
    monkeypatch.setattr(uncertainty, "PAIRS", 2)
    reading, squares = ReadingNoise.of(answer), (1 + 4) / 2 + 2 * 1.5**2
    np.testing.assert_allclose(reading.scatter, squares**0.5, rtol=1e-9)
    expected = [
        np.sqrt(max(steady**2 / 2 - squares, 0)) * side for side in (steady < 0, steady > 0)
    ]
    np.testing.assert_allclose(reading.below, expected[0], rtol=1e-9)
    np.testing.assert_allclose(reading.above, expected[1], rtol=1e-9)


def test_an_interval_is_as_wide_as_those_parts_are_uncertain_that_few_readings_tell() -> None:
    """By Student's t: alone with as many degrees of freedom as pairs, with as much that is known
    with four times as many, and beside much more with a normal distribution's."""
    reading = ReadingNoise(np.ones((1, 3)), *np.zeros((2, 1, 3)), 4)
    known = np.array([[0, 1, 1e6]])
    expected = np.hypot(known, 1) * t.ppf(0.975, [[4, 16, 1e9]]) / norm.ppf(0.975)
    # The approximation of t is good to .3 %.
    np.testing.assert_allclose(reading.widened(known), expected, rtol=3e-3)


TEXTURED_ROOM = """<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="5"/></integrator>
    <sensor type="perspective" id="camera"><float name="fov" value="60"/>
        <transform name="to_world"><lookat origin="0 1.1 3.6" target="0 0.95 0" up="0 1 0"/>
        </transform><film type="hdrfilm"><integer name="width" value="40"/>
        <integer name="height" value="24"/></film></sensor>
    <bsdf type="diffuse" id="t"><texture name="reflectance" type="bitmap">
        <string name="filename" value="texture.png"/></texture></bsdf>
    <shape type="rectangle"><transform name="to_world"><scale value="3"/>
        <rotate x="1" angle="-90"/></transform><ref id="t"/></shape>
    <shape type="rectangle"><transform name="to_world"><scale value="3"/><translate z="-1"/>
        </transform><ref id="t"/></shape>
    <shape type="sphere"><point name="center" x="0" y="0.6" z="0"/>
        <float name="radius" value="0.6"/><ref id="t"/></shape>
    <shape type="rectangle" id="panel"><transform name="to_world"><scale value="0.4"/>
        <rotate x="1" angle="90"/><translate x="-1" y="2.4"/></transform>
        <emitter type="area"><rgb name="radiance" value="6 5 4"/></emitter></shape>
    <shape type="rectangle" id="strip"><transform name="to_world"><scale x="0.1" y="0.6"/>
        <rotate y="1" angle="-90"/><translate x="2" y="1" z="1"/></transform>
        <emitter type="area"><rgb name="radiance" value="9 9 12"/></emitter></shape>
    <emitter type="spot" id="spot"><transform name="to_world">
        <lookat origin="1 2.5 2" target="0 0 0" up="0 1 0"/></transform>
        <rgb name="intensity" value="5"/></emitter>
    <emitter type="constant" id="sky"><rgb name="radiance" value="0.2"/></emitter>
</scene>"""


@pytest.mark.nightly
@pytest.mark.parametrize("spp", [16, 32, 64])
def test_error_bars_of_default_answers_in_a_textured_room_are_as_wide_as_the_errors(
    tmp_path: Path, spp: int
) -> None:
    """Of a painting in 8 bits; where a light is near 0, its errors are smaller than its scatter."""
    texels = np.random.default_rng(3).integers(20, 255, (256, 256, 3), dtype=np.uint8)
    Image.fromarray(texels).save(tmp_path / "texture.png")
    (tmp_path / "room.xml").write_text(TEXTURED_ROOM, encoding="utf-8")
    scene = lp.load_scene(tmp_path / "room.xml")
    truth = lp.render_basis(scene, spp=4096, seed=999)
    levels = [[0.5, 0.5, 0.5], [1.5, 1, 0.7], [2, 2, 2], [0.3, 0.4, 0.6]]
    view = lp.ViewTransform("srgb")
    codes = np.round(255 * view.encode(0.5 * truth.mix(np.array(levels))))
    target = lp.Target(
        "painted",
        view.decode(codes / 255).astype(np.float32),
        np.ones(truth.size, np.float32),
        everything=True,
        at_least=codes >= 255,
        transform=view,
        through_view=True,
    )
    best, solved, stated, held = _corrected(truth, target).weights, [], [], []
    for seed in range(60):
        answer = _corrected(lp.render_basis(scene, spp=spp, seed=seed), target)
        bars = lp.error_bars(answer)
        assert bars is not None
        low, high = bars.interval
        solved.append(answer.weights)
        stated.append(bars.standard_error)
        held.append((low <= best) & (best <= high))
    errors = np.sqrt(np.square(np.array(solved) - best).mean(axis=0))
    ratio = np.exp(np.log(np.median(stated, axis=0) / errors).mean())
    # One wish moves all lights together, so that a scatter over seeds has an error of a tenth.
    assert 0.8 < ratio < 1.4
    assert 0.92 < np.mean(held) < 0.99
