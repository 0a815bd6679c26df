"""A painting taken at its word is the paper's problem: for every painting that comes along.

What shows it are the optimality conditions, written out here from the pixels: nothing of the solve
is asked.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import lightpaint as lp

TARGETS = Path(__file__).parents[2] / "targets"
PAINTINGS = [
    path
    for path in sorted([*TARGETS.glob("*/*.exr"), *TARGETS.glob("*/*.png")])
    if not path.name.endswith(".mask.exr")
]

#: Lights of a made-up scene, and the size that paintings are looked at.
LIGHTS, SIZE = 7, (36, 64)


def _target(path: Path) -> lp.Target:
    mask = path.with_suffix(".mask.exr")
    target = lp.read_target(path, mask=mask if mask.is_file() else None)
    height, width = target.size
    return target.resized(SIZE if width > height else (36, 36))


def _basis(size: tuple[int, int], make_basis: object) -> lp.Basis:
    """Soft lights, each of its own colour, that overlap."""
    rng = np.random.default_rng(8)
    y, x = np.mgrid[: size[0], : size[1]] / size[0]
    images = [
        (np.exp(-((y - rng.random()) ** 2 + (x - 2 * rng.random()) ** 2) / 0.2) + 0.03)[..., None]
        * rng.uniform(0.2, 1, 3)
        for _ in range(LIGHTS)
    ]
    return make_basis(images=images)  # type: ignore[operator, no-any-return]


@pytest.mark.parametrize("path", PAINTINGS, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_every_painting_at_its_word_is_the_papers_problem(path: Path, make_basis: object):
    """Non-negative least squares of each channel, in linear light, of what is painted alone."""
    target = _target(path)
    basis = _basis(target.size, make_basis)
    weights = lp.solve(basis, target, literal=True).weights
    light = np.einsum("nhwc,nc->hwc", basis.images.astype(np.float64), weights)
    loss_gradient = target.importance[..., None] * (light - target.image)
    if target.at_least is not None:  # the file cannot say more, so brighter is as good
        loss_gradient[target.at_least & (light > target.image)] = 0
    gradient = np.einsum("nhwc,hwc->nc", basis.images.astype(np.float64), loss_gradient)
    painted = np.abs(target.importance[..., None] * target.image)
    size = np.einsum("nhwc,hwc->nc", basis.images.astype(np.float64), painted)
    assert (weights >= 0).all()
    # Round-off of the sums, beside what is summed.
    assert (gradient >= -1e-11 * size).all()
    assert (np.abs(gradient) <= 1e-11 * size)[weights > 0].all()


@pytest.mark.parametrize(
    "path", [p for p in PAINTINGS if p.suffix == ".exr"], ids=lambda p: f"{p.parent.name}-{p.stem}"
)
def test_an_exr_with_its_own_mask_is_taken_at_its_word_unasked(path: Path, make_basis: object):
    target = _target(path)
    basis = _basis(target.size, make_basis)
    assert not target.over_look
    one, other = (lp.solve(basis, target, literal=x).weights for x in (False, True))
    np.testing.assert_array_equal(one, other)


def test_paint_over_the_look_is_not(make_basis: object):
    target = _target(TARGETS / "gallery" / "opening.png")
    basis = _basis(target.size, make_basis)
    by_meaning, literal = (lp.solve(basis, target, literal=x) for x in (False, True))
    assert by_meaning.problem.fit.space == "display"
    assert literal.problem.fit.space == "linear"
    over_look = replace(target, over_look=True)
    assert lp.solve(basis, over_look).problem.fit.hold
    assert np.abs(by_meaning.weights - literal.weights).max() > 0.01
