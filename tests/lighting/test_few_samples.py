"""Answers to bases of one to four samples: no lamp runs away, and none is worse than the present.

Judged by a basis of many samples, which the answer does not know. Tolerances come from noise.
"""

from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from nightly import nightly

import lightpaint as lp
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.colour.color import kelvin_to_rgb
from lightpaint.colour.display.exposure import choose_exposure
from lightpaint.lighting.analysis.noise.noise_correction import correct_noise
from lightpaint.lighting.fit import resolve_for_targets
from lightpaint.lighting.live.live_solver import LiveSolver
from lightpaint.lighting.live.live_view import LiveView
from lightpaint.lighting.loss.lit_pixels import bin_pixels, block_side
from lightpaint.lighting.loss.painting_loss import PaintingLoss

SCENES = Path(__file__).parent.parent.parent / "scenes"
FILMS = {"cornell": "32x32", "stage": "80x45", "gallery": "80x45"}

#: Samples of the basis that judges.
MANY = 32

#: What an answer may miss beside the present: noise of the judge, and of a basis of one sample.
NOISE = 1.03

#: Stops by which a lamp may leave the present: four are asked of a place that others light, too.
MOST_STOPS = 6.5


def _bases_of_few_samples(scene: lp.Scene) -> dict[int, Basis]:
    """Bases of one, two and four samples, each of which has those of the one before."""
    two = render_basis(scene, spp=2, seed=2)
    # Of two halves one, which has twice the noise of both.
    half = two.half_differences
    one = replace(two, planes=two.images + half, noise=half * np.float32(2**0.5))
    return {1: one, 2: two, 4: render_basis(scene, spp=4, seed=2, start=two)}


def _painting(basis: Basis, look: Any, request: str) -> lp.Target:
    """Over a look without grain (h, w, 3), painted as people do."""
    height, width = basis.size
    rows, columns = np.mgrid[:height, :width] / np.array([height, width])[:, None, None]
    spot = np.hypot(rows - 0.6, (columns - 0.55) * width / height)
    warm, cool = (kelvin_to_rgb(k) / kelvin_to_rgb(6500) for k in (2700, 9000))
    soft = np.clip((0.2 - spot) / 0.05, 0, 1)
    image, counts = {
        "all darker, a warm spot": (
            look * cool / 4 * (1 + soft[..., None] * (16 * warm - 1)),
            1 + 7 * soft,
        ),
        "a warm spot": (look * (1 + soft[..., None] * (3 * warm - 1)), soft),
        "a darker side": (look / 4, np.clip((0.4 - columns) / 0.1, 0, 1)),
        "nothing else": (look, np.ones(basis.size)),
    }[request]
    transform = lp.ViewTransform("srgb", choose_exposure(basis.current_look))
    return lp.Target(
        request,
        np.asarray(image, np.float32),
        np.asarray(counts, np.float32),
        everything=False,
        transform=transform,
        through_view=True,
        over_look=True,
    )


def _live_answer(basis: Basis, target: lp.Target) -> Any:
    view = LiveView(basis, target.image.copy(), target.importance.copy())
    live = LiveSolver(
        [view], fit=resolve_for_targets(lp.Fit(), [target]), constraints=lp.Constraints()
    )
    return live.answer(live.answer(basis.current_weights))


@pytest.mark.nightly
@pytest.mark.parametrize("name", [name if name == "cornell" else nightly(name) for name in FILMS])
def test_no_answer_is_worse_than_none(name: str):
    scene = lp.load_scene(SCENES / name / "scene.xml").reduced(FILMS[name])
    judge = render_basis(scene, spp=MANY, seed=MANY)
    wishes = ("all darker, a warm spot", "a warm spot", "a darker side", "nothing else")
    for (spp, few), request in product(_bases_of_few_samples(scene).items(), wishes):
        target = _painting(few, judge.current_look, request)
        problem = lp.Problem.of(judge, target)

        def miss_of(weights: Any, problem: lp.Problem = problem) -> float:
            # Contrasts of wishes count as well.
            contrast = problem.contrast
            asked = 0.0 if contrast is None else float(contrast.objective(weights).sum())
            return float(problem.objective(weights).sum()) + asked

        black_miss = miss_of(np.zeros_like(judge.current_weights))
        current_miss = miss_of(judge.current_weights) * NOISE + 0.02 * black_miss
        solution = lp.solve(few, target)
        answers = {
            "exact": solution.weights,
            "noise taken out": correct_noise(solution).weights,
            "live": _live_answer(few, target),
        }
        for kind, weights in answers.items():
            assert miss_of(weights) <= current_miss, (name, spp, request, kind)
            ratio = weights.max(axis=1) / few.current_weights.max(axis=1)
            assert np.log2(ratio.max()) < MOST_STOPS, (name, spp, request, kind)


@pytest.fixture
def noisy_basis(make_basis: Any) -> Basis:
    """Two lights, even but for noise that is as bright as they are, and halves that say so."""
    rng = np.random.default_rng(0)
    size = (48, 64)
    level = np.array([0.2, 0.1])[:, None, None, None]
    halves = level * rng.exponential(1, (2, 2, *size, 3))
    images, half = halves.mean(axis=0), (halves[0] - halves[1]) / 2
    noisy = make_basis(images=images, half_differences=half, emission=[[1, 1, 1], [1, 1, 1]])
    return replace(noisy, origin=replace(noisy.origin, halves=(1, 1)))


def _paint_over(basis: Basis, times: float) -> lp.Target:
    mean = basis.current_look.mean(axis=(0, 1))
    look = np.broadcast_to(times * mean, (*basis.size, 3)).astype(np.float32)
    options: dict[str, Any] = {"through_view": True, "over_look": True}
    counts = np.ones(basis.size, np.float32)
    return lp.Target("t", look, counts, False, transform=lp.ViewTransform(), **options)


def test_blocks_are_as_large_as_noise_asks(noisy_basis: Basis):
    quiet = replace(noisy_basis, noise=noisy_basis.half_differences / 50)
    unknown = replace(noisy_basis, origin=replace(noisy_basis.origin, halves=(0, 0)))
    tiny = replace(
        noisy_basis,
        planes=noisy_basis.images[:, :12, :10],
        noise=noisy_basis.half_differences[:, :12, :10],
        emitters_seen=noisy_basis.emitters_seen[:12, :10],
    )
    sides = []
    for basis in (noisy_basis, quiet, unknown, tiny):
        assert block_side([basis], None) == 1  # linear light needs none
        sides.append(block_side([basis], lp.ViewTransform()))
    assert sides == [3, 1, 1, 1]


def test_noise_of_what_a_display_shows_moves_no_light(noisy_basis: Basis):
    """Fitted pixel by pixel a display's curve would make up for it: 15 % here."""
    solution = lp.solve(noisy_basis, _paint_over(noisy_basis, 0.25), colors="free")
    display = (
        noisy_basis.images.mean(axis=(1, 2)).T
        @ solution.weights
        / noisy_basis.current_look.mean((0, 1))
    )
    # Of 48 x 64 pixels in blocks of nine, the residual noise's bias.
    assert np.diag(display) == pytest.approx(np.full(3, 0.25), rel=0.06)
    assert solution.problem.block_side == 3
    assert correct_noise(solution) is solution


def test_blocks_cost_what_their_pixels_do(make_basis: Any):
    """Where all pixels of a block are the same, to round-off."""
    rng = np.random.default_rng(1)

    def blocks(*shape: int) -> Any:
        return rng.random(shape).repeat(2, axis=-3).repeat(2, axis=-2)

    basis = make_basis(images=np.stack([blocks(6, 5, 3) for _ in range(2)]))
    loss = PaintingLoss(
        painted=blocks(6, 5, 3),
        importance=blocks(6, 5, 1)[..., 0],
        share=blocks(6, 5, 1)[..., 0],
        current=blocks(6, 5, 3),
        at_least=blocks(6, 5, 3) > 0.5,
        transform=lp.ViewTransform(),
    )
    views = lp.Problem.of(basis, lp.Target.of(loss.painted.astype(np.float32))).views
    binned = bin_pixels(views, loss, 2)
    weights = rng.random((2, 3))
    full_objective = loss.objective(basis.mix(weights))
    assert binned.loss.objective(binned.basis.mix(weights)) == pytest.approx(
        full_objective, rel=1e-6
    )
