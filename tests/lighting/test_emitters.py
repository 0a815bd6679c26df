"""Paint over an emitter in view: for what it lights, or for its glow, and seldom for less of it."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import lightpaint as lp
from lightpaint.arrays import Doubles
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.lights import Lights
from lightpaint.lighting.fit import resolve_for_targets
from lightpaint.lighting.live.live_solver import LiveSolver
from lightpaint.lighting.live.live_view import LiveView
from lightpaint.lighting.loss.painting import find_glow_paint
from lightpaint.lighting.unknowns.lamps_in_view import LampsInView
from lightpaint.target import Wish

SIZE = (36, 30)
FLAME = (slice(16, 19), slice(14, 17))
AROUND = (slice(10, 26), slice(8, 24))
WARM = np.array([1.5, 0.9, 0.4])


@pytest.fixture
def basis(make_basis: Any) -> Basis:
    """`sky` lights all evenly; `lantern` what is near it, and its flame is 12 times white."""
    emitter_mask = np.zeros(SIZE, bool)
    emitter_mask[FLAME] = True
    rows, columns = np.mgrid[: SIZE[0], : SIZE[1]]
    near = np.exp(-np.hypot(rows - 17, columns - 15) / 3)
    images = np.stack([np.full(SIZE, 0.03), np.where(emitter_mask, 12, 0.2 * near)])[..., None]
    emission = [[1.0] * 3, [1.0] * 3]
    images = np.repeat(images, 3, axis=-1)
    return make_basis(images=images, names=["sky", "lantern"], seen=emitter_mask, emission=emission)


def _paint(basis: Basis, region: Any, color: Any, *, times: bool = False) -> lp.Target:
    """A stroke over the current look. times: whether it multiplies what is there."""
    image = basis.current_look.copy()
    image[region] = image[region] * color if times else color
    counts = np.zeros(SIZE, np.float32)
    counts[region] = 1
    options: dict[str, Any] = {"through_view": True, "over_look": True}
    return lp.Target("t", image, counts, False, transform=lp.ViewTransform(), **options)


def _lantern_levels(basis: Basis, target: lp.Target, **fit: Any) -> tuple[float, float]:
    """How bright it comes out, exactly and live, beside the present."""
    exact = lp.solve(basis, target, **fit).weights
    view = LiveView(basis, target.image.copy(), target.importance.copy())
    live = LiveSolver(
        [view], fit=resolve_for_targets(lp.Fit(**fit), [target]), constraints=lp.Constraints()
    )
    weights: Doubles = basis.current_weights
    for _ in range(8):
        weights = live.answer(weights)
    return float(exact[1].max()), float(weights[1].max())


@pytest.mark.parametrize("space", ["display", "linear"])
def test_a_warm_stroke_over_a_lantern_leaves_it_on(basis: Basis, space: Any):
    """What it lights is painted brighter, the flame itself darker than it is, or even black."""
    for flame in (0.5 * WARM, 0 * WARM):
        target = _paint(basis, AROUND, 0.5 * WARM)
        target.image[FLAME] = flame
        exact, live = _lantern_levels(basis, target, space=space)
        assert exact > 1.5
        assert live > 1.5


@pytest.mark.parametrize("space", ["display", "linear"])
def test_a_warm_stroke_over_a_lantern_leaves_it_on_in_a_dark_room(basis: Basis, space: Any):
    """The room two stops down, then the brush: darker than it was, but brighter than the room."""
    whole_picture = (slice(None), slice(None))
    target = _paint(basis, whole_picture, 0.25, times=True)
    room = _lantern_levels(basis, target, space=space)
    assert room == pytest.approx((0.25, 0.25), rel=0.05)
    target.image[AROUND] = 0.06 * WARM
    target.importance[AROUND] = 10  # as a page counts strokes over what was asked of the whole
    exact, live = _lantern_levels(basis, target, space=space)
    assert exact > 0.35
    assert live > 0.35


def test_a_room_that_becomes_darker_and_warmer_dims_its_lantern(basis: Basis):
    whole_picture = (slice(None), slice(None))
    exact, live = _lantern_levels(basis, _paint(basis, whole_picture, 0.15 * WARM, times=True))
    assert exact < 0.3
    assert live < 0.3


def test_a_clearly_darker_stroke_dims_it(basis: Basis):
    exact, live = _lantern_levels(basis, _paint(basis, AROUND, 0.2, times=True))
    assert exact < 0.7
    assert live < 0.7


@pytest.mark.parametrize(
    ("color", "is_less"), [(WARM, False), (0.9 * WARM, False), (0.1 * WARM, True), (0 * WARM, True)]
)
def test_of_a_flame_alone_what_a_display_shows_decides(basis: Basis, color: Any, is_less: bool):
    exact, live = _lantern_levels(basis, _paint(basis, FLAME, color))
    assert (exact < 0.7) == is_less
    # Beyond white a display's curve is flat, which answers under the brush cannot leave.
    assert is_less or live > 0.7


def test_a_glow_that_is_painted_brighter_comes_about(make_basis: Any, basis: Basis):
    """Of an emitter that a display can show: a window, of a tenth of white."""
    images = basis.images.copy()
    images[1][FLAME] = 0.1
    window = make_basis(
        images=images,
        names=["sky", "window"],
        seen=basis.emitters_seen,
        emission=[[1.0] * 3, [1.0] * 3],
    )
    exact, _ = _lantern_levels(window, _paint(window, FLAME, 0.3), hold=0.1)
    assert exact > 2


@pytest.mark.parametrize("fit", [{"emitters": "count"}, {"literal": True}])
def test_who_says_so_has_it_as_painted(basis: Basis, fit: Any):
    target = _paint(basis, AROUND, 0.5 * WARM)
    target.image[FLAME] = 0
    assert lp.solve(basis, target, **fit).weights[1].max() < 0.7


def test_what_is_read_once_is_not_read_again(basis: Basis):
    [resolved] = lp.Problem.of(basis, _paint(basis, AROUND, 0.5 * WARM)).views.targets
    assert resolved.at_least is not None
    assert (resolved.at_least.any(axis=-1) == basis.emitters_seen).all()
    [resolved_again] = lp.Problem.of(basis, resolved).views.targets
    assert resolved_again.at_least is resolved.at_least


def test_strokes_one_after_the_other_count_as_all_at_once(basis: Basis):
    """Also those beside an emitter, which change what the paint on it means."""
    rng = np.random.default_rng(2)
    image, counts = basis.current_look.copy(), np.zeros(SIZE, np.float32)
    view = LiveView(basis, image, counts)
    view.set_transform(lp.ViewTransform())
    view.film(lp.ViewTransform(), 100)
    view.tiles()
    for _ in range(30):
        top, left = rng.integers(0, 30), rng.integers(0, 24)
        region = (slice(top, top + 6), slice(left, left + 6))
        image[region] = rng.choice([0, 0.02, 0.5, 20]) * WARM
        counts[region] = rng.choice([0, 0.3, 1, 10])
        view.update(region)
        rebuilt = LiveView(basis, image, counts)
        rebuilt.set_transform(lp.ViewTransform())
        assert (view.counts == rebuilt.counts).all()
        updated_pixels, rebuilt_pixels = (
            x.film(lp.ViewTransform(), 100).pixels(0.1, None) for x in (view, rebuilt)
        )
        assert (updated_pixels.importance == rebuilt_pixels.importance).all()
        assert (updated_pixels.painted == rebuilt_pixels.painted).all()
        one, other = (x.tiles().equations(0.1) for x in (view, rebuilt))
        np.testing.assert_allclose(one.M, other.M, rtol=1e-9)


def test_nothing_painted_is_nothing_meant(basis: Basis):
    look, none = basis.current_look, np.zeros(SIZE, np.float32)
    assert not find_glow_paint(look, none, look, basis.emitters_seen, None, dark=0.01).any()


CAGE = (slice(12, 22), slice(11, 19))
CLOTH = (slice(24, 32), slice(6, 24))


def lantern_on_a_cloth(make_basis: Any) -> lp.Basis:
    """`boom` lights a cloth and the lantern on it, `lantern` its own cage most."""
    seen = np.zeros(SIZE, bool)
    seen[FLAME] = True
    rows, columns = np.mgrid[: SIZE[0], : SIZE[1]]
    near = np.exp(-np.hypot(rows - 17, columns - 15) / 4)
    is_lit = np.zeros(SIZE)
    is_lit[CAGE] = is_lit[CLOTH] = 1
    images = np.stack([np.full(SIZE, 0.05), 0.4 * is_lit, np.where(seen, 12, 1.0 * near)])
    return make_basis(  # type: ignore[no-any-return]
        images=np.repeat(images[..., None], 3, axis=-1),
        names=["sky", "boom", "lantern"],
        seen=seen,
        emission=[(0.8, 1, 1.2), (0.8, 1, 1.2), (1.4, 1, 0.5)],
    )


def answers_to_a_warm_cloth(basis: lp.Basis) -> dict[str, Doubles]:
    """The lighting for a cool cage on a warm cloth, exactly and under the brush."""
    image, counts = basis.current_look.copy(), np.ones(SIZE, np.float32)
    image *= 0.5
    image[CLOTH] *= 2 * WARM
    counts[FLAME] = 0
    options: dict[str, Any] = {"through_view": True, "over_look": True}
    target = lp.Target("t", image, counts, False, transform=lp.ViewTransform(), **options)
    live = LiveSolver(
        [LiveView(basis, image.copy(), counts.copy())],
        fit=resolve_for_targets(lp.Fit(), [target]),
        constraints=lp.Constraints(),
        is_sketch=True,
    )
    weights = basis.current_weights
    for _ in range(8):
        weights = live.answer(weights)
    return {"exact": lp.solve(basis, target).weights, "live": weights}


def warmth(light: Any) -> float:
    return float(light[0] / light[2])


@pytest.mark.parametrize("kind", ["exact", "live"])
def test_a_flame_in_view_does_not_turn_blue_for_a_warm_cloth(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    """The lamp on the cloth also warms the cage, which blue light of the lantern could undo."""
    basis = lantern_on_a_cloth(make_basis)
    own = basis.current_weights[2]
    answer = answers_to_a_warm_cloth(basis)[kind][2]
    assert answer.max() > 0.1 * own.max()  # it shines
    assert warmth(answer) > 0.85 * warmth(own)  # as much as cannot be seen
    # Were it not in view, it would be another lamp.
    monkeypatch.setattr(LampsInView, "lamps", np.zeros(3, bool))
    assert warmth(answers_to_a_warm_cloth(basis)[kind][2]) < 0.4 * warmth(own)


def test_a_flame_that_is_painted_blue_becomes_so(make_basis: Any) -> None:
    basis = lantern_on_a_cloth(make_basis)
    image, counts = basis.current_look * 0.5, np.ones(SIZE, np.float32)
    image[FLAME] *= [0.3, 1, 2.5]
    wish = Wish("flame", np.zeros(SIZE, np.float32), is_exact=True)
    wish.area[FLAME] = 1
    room = Wish("room", 1 - wish.area)
    options: dict[str, Any] = {"through_view": True, "over_look": True, "wishes": (room, wish)}
    target = lp.Target("t", image, counts, False, transform=lp.ViewTransform(), **options)
    answer = lp.solve(basis, target).weights[2]
    assert warmth(answer) < 0.4 * warmth(basis.current_weights[2])


def test_lamps_in_view_and_the_light_that_is_painted_on_them(make_basis: Any) -> None:
    """A spot, which has no surface, cannot be seen, however bright a pixel is."""
    basis = lantern_on_a_cloth(make_basis)
    image, counts = basis.current_look.copy(), np.zeros(SIZE, np.float32)
    now = basis.current_weights

    def found(at_least: Any = None, basis: lp.Basis = basis) -> LampsInView:
        return LampsInView.of([basis], now, lambda: [(image, counts, at_least)], lambda: 2 * now)

    np.testing.assert_array_equal(found().lamps, [False, False, True])
    np.testing.assert_array_equal(found().painted(), np.stack([now, 2 * now], axis=1))
    image[FLAME] *= [0.5, 1, 3]
    counts[FLAME] = 0.7
    expected = now * [[1, 1, 1], [1, 1, 1], [0.5, 1, 3]]
    np.testing.assert_allclose(found().painted()[:, 0], expected, rtol=1e-5)  # float32 paint
    # Paint at the top of its range has no colour.
    everywhere = np.ones((*SIZE, 3), bool)
    np.testing.assert_array_equal(found(everywhere).painted()[:, 0], now)
    spots = [replace(light, parameter="intensity") for light in basis.lights]
    assert not found(basis=replace(basis, lights=Lights.of(spots))).lamps.any()
