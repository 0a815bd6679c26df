"""The sums behind answers under a brush, against those over the whole picture."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import lightpaint as lp
from lightpaint.basis.planes import MemoryPlanes
from lightpaint.images.estimate import Estimate
from lightpaint.lighting.live import live_sums
from lightpaint.lighting.live.live_sums import PaintedTiles, SmallFilm
from lightpaint.lighting.loss import expected_lights
from lightpaint.lighting.loss.expected_lights import Wash
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.target import Wish

SIZE = 40, 70


@pytest.mark.parametrize("most", [1.0, 10.0])
@pytest.mark.parametrize("over_seen", [False, True])
def test_paint_and_rest_are_those_of_the_whole_picture(
    make_basis: Any, most: float, over_seen: bool
):
    """Also where importance is beyond 1, and where an emitter is seen, of which no rest counts."""
    rng = np.random.default_rng(3)
    emitter_mask = np.zeros(SIZE, bool)
    emitter_mask[10:20, 30:50] = True
    basis = make_basis(4, SIZE, seen=emitter_mask)
    image, importance = basis.current_look.copy(), np.zeros(SIZE, np.float32)
    tiles = PaintedTiles(basis, image, importance)
    for top, left in ((0, 0), (12, 25), (30, 60), (12, 25)):
        region = slice(top, top + 12), slice(left, left + 17)
        shape = importance[region].shape
        image[region] = rng.random((*shape, 3))
        importance[region] = most * rng.random(shape) * (over_seen | ~emitter_mask[region])
        tiles.update(region, with_importance=True)
        equations = tiles.equations(2.5)
        left_of_1 = np.where(emitter_mask, 0, np.maximum(1 - importance.astype(np.float64), 0))
        paint = NormalEquations.of(basis, image, importance)
        rest = NormalEquations.of(basis, basis.current_look, left_of_1).scaled(2.5)
        for name in ("M", "b", "target_norm2"):
            expected = getattr(paint, name) + getattr(rest, name)
            # The current look, and what is left of 1, are in single precision.
            np.testing.assert_allclose(getattr(equations, name), expected, rtol=1e-6)


def test_what_was_painted_first_has_the_same_rest(make_basis: Any):
    rng = np.random.default_rng(4)
    basis = make_basis(3, SIZE)
    image, importance = basis.current_look.copy(), np.zeros(SIZE, np.float32)
    before = PaintedTiles(basis, image, importance)
    importance[5:25, 8:40] = rng.random((20, 32))
    before.update((slice(5, 25), slice(8, 40)), with_importance=True)
    after = PaintedTiles(basis, image, importance)
    for name in ("M", "b", "target_norm2"):
        one, other = (getattr(x.equations(1.0), name) for x in (before, after))
        np.testing.assert_array_equal(one, other)


def test_the_film_reads_the_paint_as_exact_answers_do(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Importance of more than 1 is no larger cover; a block of emitters alone asks for nothing."""
    size, side = (16, 24), 4
    pixels = size[0] * size[1] // side**2
    monkeypatch.setattr(expected_lights, "BLOCKS", pixels)
    rng = np.random.default_rng(5)
    seen = np.zeros(size, bool)
    seen[:4, :6] = True  # a block of emitters alone, and half of another one
    basis = make_basis(2, size, seen=seen)
    importance = rng.choice([0, 0.3, 1, 4], size).astype(np.float32)
    importance[8:12, 8:] = 0
    target = lp.Target(
        "painting",
        rng.random((*size, 3), np.float32),
        importance,
        everything=False,
        over_look=True,
    )
    film = SmallFilm(basis, target.image, importance, pixels)
    live, exact = film.wash(lambda _side: (), is_sketch=True), Wash.of(basis, target)
    counts = exact.counts > 0
    for name in ("painted", "importance", "counts", "exact", "strokes"):
        one, other = (np.asarray(getattr(x, name))[..., counts] for x in (live, exact))
        np.testing.assert_allclose(one, other, rtol=1e-6, err_msg=name)
    np.testing.assert_array_equal(live.importance, exact.importance)


def test_wishes_that_stay_as_they_are_are_summed_and_divided_once(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch
):
    """Kept sums and places equal those of a new film, after a stroke and after a light moves."""
    basis = make_basis(5, SIZE)
    image, importance = basis.current_look.copy(), np.zeros(SIZE, np.float32)
    areas = [np.zeros(SIZE, np.float32) for _ in range(6)]
    for k, area in enumerate(areas):
        area[6 * k : 6 * k + 4, 10 + 2 * k : 40] = 1
        image[area > 0] *= 1 + 0.1 * k
        importance[area > 0] = 1
    film = SmallFilm(basis, image, importance, 2**12)
    summed: list[int] = []
    light_sums, wish_places = Wash._light_sums, live_sums.wish_places
    monkeypatch.setattr(
        Wash, "_light_sums", lambda wash, x: summed.append(len(x)) or light_sums(wash, x)
    )
    monkeypatch.setattr(
        live_sums, "wish_places", lambda x, size: summed.append(len(x)) or wish_places(x, size)
    )

    def read(film: SmallFilm) -> tuple[Wash, Any]:
        wishes = [Wish(f"wish {k}", area) for k, area in enumerate(areas)]
        wash = film.wash(lambda _side: wishes, is_sketch=True)
        return wash, wash.light_sums(wash.wishes * wash.counts)

    def check() -> None:
        wash, sums = read(film)
        expected, expected_sums = read(SmallFilm(film_basis, image, importance, 2**12))
        np.testing.assert_array_equal(wash.places, expected.places)
        np.testing.assert_allclose(sums, expected_sums, rtol=1e-13)  # of a product of other shape

    film_basis = basis
    read(film)
    areas[2][30:34, 50:60] = 1  # a second place of the third wish
    areas.append(np.zeros(SIZE, np.float32))
    areas[-1][36:, 60:] = 1
    summed.clear()
    read(film)
    assert summed == [2, 2]
    check()
    areas.pop(0)
    summed.clear()
    read(film)
    assert not summed  # the others have other numbers now, and are the same
    check()
    planes = MemoryPlanes(basis.images.copy()).replaced({1: 2 * basis.images[1]})
    former = Estimate(basis.current_look, basis.current_noise)
    film_basis = replace(basis, planes=planes, former=former)
    film.replace_planes(film_basis, [1])
    check()
