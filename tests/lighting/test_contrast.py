"""Contrasts of wishes: the ratio of a subject's light to the rest comes out as painted."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lightpaint as lp
from lightpaint.basis.light_basis import meter_exposure
from lightpaint.colour.color import kelvin_to_rgb, luminance
from lightpaint.lighting import PaintComparison, default_answer, solution_of, tie_frames
from lightpaint.lighting.analysis.appearance import held_answer
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.fit import resolve_for_targets
from lightpaint.lighting.live.live_solver import LiveSolver
from lightpaint.lighting.live.live_sums import SmallFilm
from lightpaint.lighting.live.live_view import LiveView
from lightpaint.lighting.loss import expected_lights, weight_penalty
from lightpaint.lighting.loss.expected_lights import ExpectedLights, Wash, adjusted_share
from lightpaint.lighting.loss.weight_penalty import ContrastRows
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.pipeline.job.settings import Settings
from lightpaint.target.painted_target import Wish

SCENES = Path(__file__).parents[2] / "scenes"

H, W = 24, 40


def subject() -> np.ndarray:
    mask = np.zeros((H, W), bool)
    mask[10:14, 18:22] = True
    return mask


def room(make_basis: Any, spill: Any = 0.3) -> lp.Basis:
    """A lamp over everything and a spot on the subject, which also spills over the rest."""
    pools = [np.ones((H, W)), np.where(subject(), 1.0, spill)]
    images = np.array([pool[..., None] * np.ones(3) for pool in pools])
    basis: lp.Basis = make_basis(
        images=images, names=["wash", "spot"], emission=[(0.3, 0.3, 0.3), (0.1, 0.1, 0.1)]
    )
    return basis


def uneven() -> np.ndarray:
    """Factors of light, (h, w, 1), of half a stop from left to right, as a brush leaves them."""
    return np.tile(2 ** np.linspace(-0.25, 0.25, W), (H, 1))[..., None]


def painting(basis: lp.Basis, image: np.ndarray, *, with_layers: bool = True) -> lp.Target:
    area = subject().astype(np.float32)
    wishes = (Wish("rest", 1 - area), Wish("subject", area)) if with_layers else ()
    return lp.Target(
        "painting",
        image.astype(np.float32),
        np.ones((H, W), np.float32),
        everything=False,
        transform=lp.ViewTransform("srgb", 0.0),
        through_view=True,
        over_look=True,
        wishes=wishes,
    )


def test_the_term_vanishes_for_what_was_painted(make_basis: Any) -> None:
    basis = room(make_basis)
    meant = np.array([[0.1, 0.12, 0.2], [0.4, 0.3, 0.2]])
    target = painting(basis, basis.mix(meant))
    rows = ContrastRows.of(Wash.of(basis, target), target.transform)
    assert rows.contrast.shape == (1, 3, 2)  # the rest is not a subject
    np.testing.assert_allclose(np.einsum("kcn,nc->kc", rows.contrast, meant), 0, atol=1e-6)
    np.testing.assert_allclose(np.einsum("kcn,nc->kc", rows.rest, meant), rows.rest_goal, rtol=1e-5)
    brush, numbers = (replace(rows, exact=np.array([x])).term(7.0) for x in (0.0, 1.0))
    assert brush is not None
    assert numbers is not None
    assert brush.objective(2 * meant).max() < 1e-9  # contrast is of ratios
    assert numbers.objective(meant).max() < 1e-9
    # Twice the light of an exact rest misses it by itself.
    np.testing.assert_allclose(
        numbers.objective(2 * meant),
        weight_penalty.EXACT_REST * 7.0 * rows.rest_goal[0] ** 2,
        rtol=1e-5,
    )
    other = meant * [[1], [2]]
    value = 7.0 * np.einsum("kcn,nc->kc", rows.contrast, other)[0] ** 2
    np.testing.assert_allclose(brush.objective(other), weight_penalty.CONTRAST * value, rtol=1e-9)
    half = replace(rows, exact=np.array([0.5])).term(7.0)
    assert half is not None
    np.testing.assert_allclose(
        half.objective(other), (brush.objective(other) + numbers.objective(other)) / 2, rtol=1e-9
    )


def test_rows_are_the_formula(make_basis: Any) -> None:
    basis = room(make_basis)
    image = np.where(subject()[..., None], 0.4, 0.1) * np.ones(3)
    rows = ContrastRows.of(Wash.of(basis, painting(basis, image)), None).contrast
    # In linear light A is the painted light: 0.4 (1 / 0.4 − 1 / 0.1), 0.4 (1 / 0.4 − 0.3 / 0.1).
    np.testing.assert_allclose(rows[0], np.tile([-3.0, -0.2], (3, 1)), rtol=1e-5)


@pytest.mark.parametrize("has_strokes", [True, False])
def test_strokes_have_a_weak_contrast_even_to_numbers(make_basis: Any, has_strokes: bool) -> None:
    """A rest in numbers keeps its light as well beside them, exactly and under the brush."""
    basis, area = room(make_basis), subject().astype(np.float32)
    wishes = (
        Wish("rest", 1 - area, layer=1, is_exact=True),
        Wish("strokes", area, layer=2, has_strokes=has_strokes),
    )
    image = basis.current_look * np.where(subject()[..., None], 3, 0.35)
    target = replace(painting(basis, image), wishes=wishes)
    film = SmallFilm(basis, target.image, target.importance)
    weights = np.array([[0.1, 0.1, 0.1], [0.5, 0.5, 0.5]])
    strength = weight_penalty.CONTRAST if has_strokes else weight_penalty.EXACT_CONTRAST
    for wash in (Wash.of(basis, target), film.wash(lambda _side: wishes, is_sketch=True)):
        rows = ContrastRows.of(wash, target.transform)
        contrast, rest = (
            np.einsum("kcn,nc->kc", x, weights)[0] for x in (rows.contrast, rows.rest)
        )
        missed = weight_penalty.EXACT_REST * (rest - rows.rest_goal[0]) ** 2
        term = rows.term(7.0)
        assert term is not None
        np.testing.assert_allclose(
            term.objective(weights), 7.0 * (strength * contrast**2 + missed), rtol=1e-5
        )


def test_a_small_subject_stands_out(make_basis: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its spot lights half of the room, too: pixels alone would leave the subject dark."""
    spill = np.tile(np.arange(W) < W // 2, (H, 1)) * 0.8
    basis = room(make_basis, spill)
    image = np.where(subject()[..., None], 0.6, 0.1) * np.ones(3)

    def ratio() -> float:
        got = basis.mix(lp.solve(basis, painting(basis, image)).weights)[..., 1]
        return float(got[subject()].mean() / got[~subject()].mean())

    with_contrast = ratio()
    for name in ("CONTRAST", "EXACT_CONTRAST", "EXACT_REST"):
        monkeypatch.setattr(weight_penalty, name, 0.0)
    assert with_contrast > ratio() + 0.05


@pytest.mark.parametrize(("factor", "exact"), [(0.5, 1.0), (1.0, 0.0)])
def test_a_rest_is_exact_where_a_number_changed_it(
    make_basis: Any, factor: float, exact: float
) -> None:
    """Neither what was repainted as it is, nor what a brush changed."""
    basis = room(make_basis)
    image = basis.current_look * np.where(subject()[..., None], 2.0, factor)
    rows = ContrastRows.of(Wash.of(basis, painting(basis, image)), None)
    assert rows.exact == pytest.approx([exact], abs=1e-6)
    image = np.where(subject()[..., None], image, image * uneven())
    rows = ContrastRows.of(Wash.of(basis, painting(basis, image)), None)
    assert rows.exact == pytest.approx([0], abs=0.05)


def test_a_locked_subject_leaves_most_of_its_light_to_the_rest(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its contrast to an exact rest could otherwise be had by a dark rest alone."""
    pools = np.array([np.where(subject(), 0.02, 1.0), np.where(subject(), 1.0, 0.02)])
    basis = make_basis(
        images=pools[..., None] * np.ones(3), names=["wash", "spot"], emission=[(0.2,) * 3] * 2
    )
    image = basis.current_look * np.where(subject()[..., None], 2.0, 0.8)
    constraints = lp.Constraints.of({"spot": {"lock": True}})

    def rest() -> float:
        # The least loss: a default answer would be held to the lights as they are.
        problem = lp.Problem.of(basis, painting(basis, image), constraints=constraints)
        got = basis.mix(solution_of(problem).weights)[~subject()].mean()
        return float(got / image[~subject()].mean())

    kept = rest()
    monkeypatch.setattr(weight_penalty, "EXACT_REST", 0.0)
    assert kept > rest() + 0.03


def test_light_set_by_hand_wins_over_grey(make_basis: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bright warm sculptures in a cool dark room, and a spot that spills on a wall.

    What pixels alone call the best is grey; a warm spot in a room bluer than painted is farther
    from the painting in pixels, and nearer in contrast.
    """
    spill = np.tile(np.arange(W) < W // 8, (H, 1)) * 0.8
    basis = room(make_basis, spill)
    warm, cool = np.array([1.2, 1.0, 0.7]), np.array([0.85, 1.0, 1.2])
    image = basis.current_look * np.where(subject()[..., None], 2 * warm, 0.35 * cool)
    target = painting(basis, image)
    by_hand = basis.current_weights * [0.2 * cool**1.5, 4 * warm**1.5]
    answer = lp.solve(basis, target).weights
    for name in ("CONTRAST", "EXACT_CONTRAST", "EXACT_REST"):
        monkeypatch.setattr(weight_penalty, name, 0.0)
    grey = lp.solve(basis, target).weights
    monkeypatch.undo()

    def pixels(weights: np.ndarray) -> float:
        codes = (lp.ViewTransform("srgb", 0.0).encode(x) for x in (basis.mix(weights), image))
        return float(np.square(np.subtract(*codes)).sum())

    wash = Wash.of(basis, target)
    term = replace(ContrastRows.of(wash, target.transform), exact=np.zeros(1)).term(1.0)
    assert term is not None
    missed = [float(term.objective(x).sum()) for x in (grey, by_hand, answer)]
    assert pixels(grey) < pixels(by_hand)
    assert missed[1] < 0.5 * missed[0]
    assert missed[2] < 0.5 * missed[0]


def test_each_place_of_a_wish_stands_out(make_basis: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two sculptures of one layer: a mean of both could be had by one that is very bright."""
    places = np.zeros((2, H, W), bool)
    places[0, 10:14, 6:10] = places[1, 10:14, 28:32] = True
    # The spot on the second spills over the rest.
    pools = [np.ones((H, W)), np.where(places[0], 1, 0.05), np.where(places[1], 1, 0.3)]
    images = np.array(pools)[..., None] * np.ones(3)
    emission = [(0.3,) * 3, (0.1,) * 3, (0.1,) * 3]
    basis = make_basis(images=images, names=["wash", "one", "other"], emission=emission)
    area = places.any(axis=0).astype(np.float32)
    image = basis.current_look * np.where(area > 0, 1.5, 0.4)[..., None]
    wishes = Wish("rest", 1 - area), Wish("sculptures", area)
    target = replace(painting(basis, image), wishes=wishes)

    def least() -> float:
        """The contrast of the fainter place to the rest, relative to the painted one."""
        got = basis.mix(lp.solve(basis, target).weights)
        came = [got[x].mean() / got[area == 0].mean() for x in places]
        asked = [image[x].mean() / image[area == 0].mean() for x in places]
        return float(np.min(np.divide(came, asked)))

    of_each = least()
    wash = Wash.of(basis, target)
    assert wash.places.max(axis=1).tolist() == [0, 2]
    rows = ContrastRows.of(wash, target.transform)
    np.testing.assert_allclose(rows.share, [0.5, 0.5])
    monkeypatch.setattr(expected_lights, "wish_places", lambda x, _: np.zeros(x.shape, int))
    assert of_each > least() + 0.05


def test_light_beyond_white_counts_as_white(make_basis: Any) -> None:
    """Half of the subject is a highlight of eight times white, the other half a tenth of white.

    What the other half lacks is 10 % of the mean that is seen, and 1 % of that of all light.
    """
    pools = [~subject(), subject(), subject()]
    pools[1], pools[2] = pools[1].copy(), pools[2].copy()
    pools[1][12:], pools[2][:12] = False, False
    basis = make_basis(
        images=np.array(pools, float)[..., None] * np.ones(3), emission=[(0.1,) * 3] * 3
    )
    target = painting(basis, basis.mix(np.array([[0.1], [8.0], [0.1]]) * np.ones(3)))
    wash = Wash.of(basis, target)
    for transform, share in ((target.transform, 0.1 / 1.1), (None, 0.1 / 8.1)):
        rows = ContrastRows.of(wash, transform)
        own = rows.contrast[0, 0, 1:]
        np.testing.assert_allclose(own[1] * 0.1 / (own @ [8.0, 0.1]), share, rtol=1e-5)


def test_texels_have_the_contrast_of_a_brush(make_basis: Any) -> None:
    """As far as a subject is lit by them: a spot of texels gives a quarter of its light here."""
    basis = room(make_basis)
    image = basis.current_look * np.where(subject()[..., None], 2.0, 0.5)
    wash = Wash.of(basis, painting(basis, image))
    weights = np.array([[0.3] * 3, [0.1] * 3])
    for texels, share in (([False, False], 0.0), ([False, True], 0.25), ([True, True], 1.0)):
        rows = ContrastRows.of(wash, None, weights * np.array(texels)[:, None])
        np.testing.assert_allclose(rows.exact, [1 - share], atol=1e-6)  # .1 / (.3 + .1)


def test_a_flame_is_no_wish_for_the_light_on_its_lantern() -> None:
    """A quarter of the second block, and half of the third, are emitters in view."""
    counted = np.array([[1, 0.75, 0.5, 0]])
    areas = {"flame": [0, 0.25, 0.5, 1], "both": [0, 0.625, 1, 1], "beside": [1, 0, 0, 0]}
    wishes = [Wish(name, np.array([area], np.float32)) for name, area in areas.items()]
    found = [x.area[0].tolist() for x in expected_lights.counted_wishes(wishes, counted)]
    assert found == [[0, 0, 0, 0], [0, 0.5, 1, 0], [1, 0, 0, 0]]


def lantern(make_basis: Any, *, is_exact: bool = False) -> tuple[lp.Basis, lp.Target]:
    """A flame that was painted brighter and warmer, in a lantern and a room painted darker."""
    flame = np.zeros((120, 160), bool)
    flame[60:62, 81:83] = True
    y, x = np.mgrid[:120, :160]
    glow = np.exp(-np.hypot(y - 60.5, x - 81.5) / 4)
    images = np.array([np.where(flame, 0.0, 1.0), np.where(flame, 50.0, glow)])
    basis = make_basis(
        images=images[..., None] * np.ones(3),
        emission=[(0.3,) * 3, (0.3,) * 3],
    )
    basis = replace(basis, emitters_seen=flame)
    image = basis.current_look * np.where(flame[..., None], 4 * warmer(80), 0.2)
    wishes = (
        Wish("room", (~flame).astype(np.float32)),
        Wish("flame", flame.astype(np.float32), is_exact=is_exact),
    )
    target = replace(
        painting(room(make_basis), np.ones((H, W, 3))),
        image=image.astype(np.float32),
        importance=np.ones(flame.shape, np.float32),
        wishes=wishes,
    )
    return basis, target


@pytest.mark.parametrize("is_exact", [False, True])
def test_a_locked_lamp_in_view_does_not_light_up_the_room(make_basis: Any, is_exact: bool) -> None:
    """Its flame was painted brighter, and the lantern around it darker, as the room."""
    basis, target = lantern(make_basis, is_exact=is_exact)
    constraints = lp.Constraints.of({"light 1": {"lock": [2.4] * 3}})
    weights = lp.solve(basis, target, constraints=constraints).weights
    assert weights[0].max() < 0.1  # it was painted at 0.06


def test_a_flame_in_numbers_is_a_wish_for_its_lamp(make_basis: Any) -> None:
    """A display shows any flame as white, and what is around it was painted dark."""
    basis, target = lantern(make_basis, is_exact=True)
    weights = lp.solve(basis, target).weights
    painted = 0.3 * 4 * warmer(80)
    # It gives way to the paint around it by a few percent.
    np.testing.assert_allclose(weights[1], painted, rtol=0.1)
    assert weights[0].max() < 0.1
    by_brush = lp.solve(basis, lantern(make_basis)[1]).weights
    assert by_brush[1].max() < 0.5 * painted.max()


def test_the_term_of_a_flame_vanishes_for_its_painted_light(make_basis: Any) -> None:
    basis, target = lantern(make_basis, is_exact=True)
    flames = Wash.of(basis, target).flames
    painted = 0.3 * 4 * warmer(80)
    np.testing.assert_allclose(flames.rows, np.tile([0.0, 50.0], (1, 3, 1)))
    np.testing.assert_allclose(flames.light, [50 * painted], rtol=1e-6)  # float32 paint
    term = weight_penalty.flame_term(flames, target.transform, 7.0)
    assert term is not None
    met, twice = (term.objective(np.array([[5.0] * 3, x * painted])) for x in (1, 2))
    assert met.max() < 1e-9
    shown = 50 * painted * weight_penalty.BELOW_WHITE / (50 * painted.max())
    amplitude = weight_penalty.display_amplitude(shown[:, None], target.transform)[:, 0]
    np.testing.assert_allclose(twice, weight_penalty.FLAME * 7.0 * amplitude**2, rtol=1e-5)
    assert weight_penalty.flame_term(flames, None, 7.0) is None
    assert len(expected_lights.FlameWishes.joined([flames, flames]).light) == 2


def test_an_object_with_a_flame_in_it_is_no_wish_for_the_flame(make_basis: Any) -> None:
    basis, target = lantern(make_basis, is_exact=True)
    around = target.wishes[1].area.copy()
    around[58:64, 79:85] = 1
    wishes = (replace(target.wishes[1], area=around),)
    assert not len(Wash.of(basis, replace(target, wishes=wishes)).flames.light)


def test_a_brush_reads_the_same_flames(make_basis: Any) -> None:
    """Also where the pixels of its film are blocks of several."""
    basis, target = lantern(make_basis, is_exact=True)
    film = SmallFilm(basis, target.image, target.importance, max_pixels=2000)

    def layers(side: int) -> list[Wish]:
        return [x.reduced(side) if side > 1 else x for x in target.wishes]

    live, exact = film.wash(layers, is_sketch=True).flames, Wash.of(basis, target).flames
    np.testing.assert_allclose(live.rows, exact.rows, rtol=1e-12)
    np.testing.assert_allclose(live.light, exact.light, rtol=1e-12)


def test_an_unpainted_rest_has_no_contrast(make_basis: Any) -> None:
    basis = room(make_basis)
    target = lp.Target(
        "stroke",
        np.full((H, W, 3), 0.6, np.float32),
        subject().astype(np.float32),
        everything=False,
    )
    rows = ContrastRows.of(Wash.of(basis, target), None)
    assert not len(rows.contrast)
    assert rows.term(1.0) is None


def test_a_flat_painting_has_the_wishes_of_its_layers(make_basis: Any) -> None:
    place = np.zeros((60, 90), bool)
    place[24:40, 36:54] = True
    images = [np.ones(place.shape), np.where(place, 1.0, 0.3)]
    basis = make_basis(
        images=np.array(images)[..., None] * np.ones(3), emission=[(0.3,) * 3, (0.1,) * 3]
    )
    flat = lp.Target.of((np.where(place[..., None], 0.6, 0.1) * np.ones(3)).astype(np.float32))
    layers = tuple(
        Wish(name, area.astype(np.float32)) for name, area in (("rest", ~place), ("subject", place))
    )
    rows = [
        ContrastRows.of(Wash.of(basis, replace(flat, wishes=wishes)), None).contrast
        for wishes in ((), layers)
    ]
    assert len(rows[0]) == len(rows[1]) == 1
    # Found in a wash, the corners of a place are round.
    np.testing.assert_allclose(*rows, rtol=0.02)


@pytest.mark.parametrize(
    ("stops", "least", "most"), [(0.0, 0.0, 0.0), (0.25, 0.0, 0.01), (2.0, 0.99, 1.0)]
)
def test_how_clearly_colours_are_asked_for(
    make_basis: Any, stops: float, least: float, most: float
) -> None:
    """A hue that is a little off asks for nothing; a mood decides."""
    basis = room(make_basis)
    tint = 2.0 ** np.array([-stops / 2, 0, stops / 2])
    wash = Wash.of(basis, painting(basis, basis.current_look * uneven() * tint))
    clarity = ExpectedLights.of(wash, basis.current_weights).clarity
    assert clarity.min() >= least
    assert clarity.max() <= most


def test_numbers_are_meant(make_basis: Any) -> None:
    """A tint of a quarter of a stop by eye is an error, and by a slider it is a wish."""
    basis = room(make_basis)
    tint = 2.0 ** np.array([-0.125, 0, 0.125])
    target = painting(basis, basis.current_look * uneven() * tint)
    exact = tuple(replace(wish, is_exact=True) for wish in target.wishes)
    by_eye, by_numbers = (
        ExpectedLights.of(Wash.of(basis, replace(target, wishes=x)), basis.current_weights)
        for x in (target.wishes, exact)
    )
    assert by_eye.clarity.max() < 0.01
    assert by_numbers.clarity.min() > 0.9


@pytest.mark.parametrize("with_layers", [True, False])
def test_an_adjustment_in_pixels_is_numbers_too(make_basis: Any, with_layers: bool) -> None:
    """The same tint of a quarter of a stop everywhere, in 8 bits, is an adjustment layer's."""
    basis = room(make_basis)
    tint = 2.0 ** np.array([-0.125, 0, 0.125])
    transform = lp.ViewTransform("srgb", 0.0)
    image = np.where(subject()[..., None], 2.0, 1.0) * basis.current_look * tint
    image = transform.decode(np.round(255 * transform.encode(image)) / 255)
    wash = Wash.of(basis, painting(basis, image, with_layers=with_layers))
    assert ExpectedLights.of(wash, basis.current_weights).clarity.min() > 0.9
    np.testing.assert_allclose(
        adjusted_share(wash, wash.asked())[~subject().ravel()],
        1,
        atol=1e-6,  # float32 areas
    )
    by_brush = Wash.of(basis, painting(basis, image * uneven(), with_layers=with_layers))
    assert not adjusted_share(by_brush, by_brush.asked()).any()


def test_lights_are_expected_as_dim_as_what_they_light(make_basis: Any) -> None:
    basis = room(make_basis, spill=0.0)
    image = basis.current_look * np.where(subject()[..., None], 0.25, 1.0)
    wash = Wash.of(basis, painting(basis, image))
    expected = ExpectedLights.of(wash, basis.current_weights).emission
    ratio = np.log2(expected / basis.current_weights)[:, 1]
    # The spot lights nothing else; the wash as much as its part of the blocks, in shares of light.
    assert ratio[1] == pytest.approx(-2, abs=0.1)
    assert -0.1 < ratio[0] < 0


def test_views_keep_their_wishes_apart(make_basis: Any) -> None:
    basis = room(make_basis)
    image = np.where(subject()[..., None], 0.6, 0.1) * np.ones(3)
    wash = Wash.of(basis, painting(basis, image))
    joined = Wash.joined([wash, wash])
    assert joined.wishes.shape == (4, 2 * wash.counts.size)
    assert not (joined.wishes[:2, wash.counts.size :]).any()
    assert not (joined.wishes[2:, : wash.counts.size]).any()


@pytest.mark.nightly
def test_in_the_gallery_light_set_by_hand_wins_over_grey(monkeypatch: pytest.MonkeyPatch) -> None:
    """By the whole loss, pixels and contrasts: three warm spots in a room bluer than painted."""
    scene = lp.load_scene(SCENES / "gallery" / "scene.xml").reduced("160x90")
    basis = lp.render_basis(scene, spp=64)
    assert basis.objects is not None
    masks = [basis.objects.mask(name) for name in ("knot", "figure", "vase")]
    area = np.any(masks, axis=0).astype(np.float32)
    asked = np.where(area[..., None] > 0, 2**-0.1 * warmer(30), 2**-1.5 * warmer(-40))
    image = basis.current_look * asked
    for subjects in ([area], [mask.astype(np.float32) for mask in masks]):
        target = lp.Target(
            "sculptures",
            image.astype(np.float32),
            np.ones(basis.size, np.float32),
            everything=False,
            transform=lp.ViewTransform("srgb", meter_exposure(basis.current_look, basis)),
            through_view=True,
            over_look=True,
            wishes=(Wish("rest", 1 - area), *(Wish("subject", x) for x in subjects)),
        )
        solution = lp.solve(basis, target)
        with monkeypatch.context() as without:
            for name in ("CONTRAST", "EXACT_CONTRAST", "EXACT_REST"):
                without.setattr(weight_penalty, name, 0.0)
            grey = lp.solve(basis, target).weights
        is_spot = np.isin(basis.names, ["spot_figure", "spot_knot", "spot_vase"])[:, None]
        gains = np.where(is_spot, 2**0.5 * warmer(150), 2**-1.5 * warmer(-150))
        by_hand = _missed(solution.problem, basis.current_weights * gains)
        without_contrasts = _missed(solution.problem, grey)
        assert without_contrasts[0] < by_hand[0]
        assert _missed(solution.problem, solution.weights)[1] < by_hand[1] < without_contrasts[1]


def _missed(problem: Any, weights: np.ndarray) -> tuple[float, float]:
    """The loss of pixels, and that with contrasts."""
    pixels = float(problem.objective(weights).sum())
    return pixels, pixels + float(problem.contrast.objective(weights).sum())


def warmer(mired: float) -> np.ndarray:
    """Gains (3,) of luminance 1 that make a white of 5000 K warmer, or cooler below 0."""
    gains = kelvin_to_rgb(1e6 / (200 + mired)) / kelvin_to_rgb(5000)
    return np.asarray(gains / luminance(gains))


def out_of_reach(make_basis: Any) -> tuple[lp.Basis, lp.Target]:
    """Two lamps that light everything alike, and a third of the picture painted warm and bright."""
    slopes = [np.tile(np.linspace(1, x, W), (H, 1)) for x in (0.9, 1.1)]
    images = np.array(slopes)[..., None] * np.ones(3)
    emission = [(0.12, 0.1, 0.08), (0.08, 0.08, 0.08)]
    basis: lp.Basis = make_basis(images=images, names=["dome", "bulb"], emission=emission)
    place = np.zeros((H, W, 1), bool)
    place[6:18, 10:28] = True
    rest = np.tile(np.linspace(1, 1.15, W), (H, 1))[..., None]
    image = basis.current_look * np.where(place, [2.2, 1.1, 0.35], rest)
    target = painting(basis, image, with_layers=False)
    return basis, replace(target, over_look=False)


def test_a_contrast_out_of_reach_does_not_darken_the_picture(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The ratio of subject to rest stays as it is however dark both are: the least contrast that is
    missed is the one of a dark picture, farther from the painting than the current lights.
    """
    basis, target = out_of_reach(make_basis)
    problem = lp.Problem.of(basis, target)
    solution = solution_of(problem)  # before it is held to the current lights
    objective = solution.problem.objective
    assert objective(solution.weights).sum() < objective(basis.current_weights).sum()
    monkeypatch.setattr(weight_penalty, "MISSED_CONTRAST", np.inf)  # never given up
    dark = solution_of(problem).weights
    assert objective(dark).sum() > objective(basis.current_weights).sum()
    assert basis.mix(dark).mean() < 0.9 * basis.mix(solution.weights).mean()


def test_contrasts_given_up_under_the_brush_come_back(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Once the paint asks for others: the answer then is the answer of a brush that begins there.

    A place that no lamp lights alone is painted first, and then a place under a spot instead.
    """
    basis, target = out_of_reach(make_basis)
    corner = np.zeros((H, W, 1), bool)
    corner[:5, 30:38] = True
    monkeypatch.setattr(held_answer, "PULLS", ())  # lights are not held to the current ones
    images = np.stack([*basis.planes, np.where(corner, np.float32(1), 0.1) * np.ones(3)])
    emission = [*(light.emission for light in basis.lights), (0.02, 0.02, 0.02)]
    basis = make_basis(images=images, names=["dome", "bulb", "spot"], emission=emission)
    fit = resolve_for_targets(lp.Fit(), [target])
    lit = basis.current_look * np.where(corner, 3.0, 0.5)
    image, importance = lit.copy(), np.ones((H, W), np.float32)

    def live() -> tuple[LiveSolver, LiveView]:
        view = LiveView(basis, image, importance)
        return LiveSolver([view], fit=fit, constraints=Constraints(), is_sketch=True), view

    def rested(solver: LiveSolver, weights: np.ndarray) -> np.ndarray:
        for _ in range(20):
            weights = solver.answer(weights)
        return weights

    fresh = rested(live()[0], basis.current_weights)
    image[...] = target.image
    solver, view = live()
    weights = rested(solver, basis.current_weights)
    with monkeypatch.context() as never:
        never.setattr(weight_penalty, "MISSED_CONTRAST", np.inf)
        kept = rested(live()[0], basis.current_weights)
    assert basis.mix(kept).mean() < 0.9 * basis.mix(weights).mean()  # they were given up
    image[...] = lit
    view.update((slice(0, H), slice(0, W)))
    # Squares under a brush are sums in float32.
    np.testing.assert_allclose(rested(solver, weights), fresh, rtol=1e-3)


def test_lights_stay_where_every_change_leads_away_from_the_paint(make_basis: Any) -> None:
    """In ΔE, which reports give: the least squares change all of the picture for a part of it."""
    basis, target = out_of_reach(make_basis)
    squares = lp.compare_appearance(solution_of(lp.Problem.of(basis, target)))
    assert squares.is_worse
    held = lp.compare_appearance(lp.solve(basis, target))
    assert held.delta_e < squares.delta_e - 0.2
    assert held.delta_e <= held.requested_change
    literal = lp.Problem.of(basis, target, fit=lp.Fit(literal=True))
    # The paper's answer stays what it is.
    assert default_answer(literal).lighting == solution_of(literal).lighting


def test_no_constraint_is_blamed_for_lights_that_stay(make_basis: Any) -> None:
    """Without the hold they stay as well, as larger changes lead away from the paint."""
    basis, target = out_of_reach(make_basis)
    held = lp.solve(basis, target, hold=4.0, colors="gentle")
    assert lp.compare_appearance(held).reasons == ()


def test_every_default_answer_is_held_alike(make_basis: Any) -> None:
    """Under the brush, in Python, in a painter's session and as the only frame of a shot."""
    basis, target = out_of_reach(make_basis)
    target = replace(target, over_look=True)
    problem = lp.Problem.of(basis, target)
    squares, now = solution_of(problem).weights, basis.current_weights
    assert _difference(problem, squares) > _difference(problem, now) + 0.2  # else nothing holds
    answers = {"solve": lp.solve(basis, target).weights}
    [frame] = tie_frames([default_answer(problem)], [1])
    answers["shot"] = frame.weights
    image, importance = target.image.copy(), target.importance.copy()
    fit = resolve_for_targets(lp.Fit(), [target])
    views = [LiveView(basis, image, importance)]
    live = LiveSolver(views, fit=fit, constraints=Constraints(), is_sketch=True)
    answers["brush"] = now
    for _ in range(12):
        answers["brush"] = live.answer(answers["brush"])
    transform = lp.ViewTransform("srgb", 0.0)
    state = SessionRequests(), Settings(), Constraints(), transform
    snapshot = SessionSnapshot(0, (basis,), (target,), *state)
    exact = snapshot.solution()
    assert exact is not None
    answers["session"] = exact.weights
    differences = {name: _difference(problem, w) for name, w in answers.items()}
    assert max(differences.values()) <= _difference(problem, now) + 0.01, differences
    for weights in answers.values():
        np.testing.assert_allclose(basis.mix(weights), basis.mix(answers["solve"]), rtol=0.02)


def _difference(problem: Any, weights: np.ndarray) -> float:
    """The mean ΔE of an answer from the paint."""
    look = PaintComparison.of_problem(problem)
    return look.mean(look.difference(look.pixels(problem.basis.mix(weights))))


def test_the_term_of_contrasts_is_the_symmetric_sum_over_its_rows():
    rng = np.random.default_rng(2)
    contrast, rest = rng.normal(size=(2, 7, 3, 5))
    shares = rng.random((4, 7))
    goal = rng.random((7, 3))
    rows = ContrastRows(contrast, rest, goal, shares[0], shares[1], shares[2])
    term = rows.term(3.0)
    assert term is not None
    constant, exact = weight_penalty.CONTRAST, shares[0] * shares[1]
    lift = 3 * shares[2] * (constant + exact * (weight_penalty.EXACT_CONTRAST - constant))
    keep = 3 * shares[2] * weight_penalty.EXACT_REST * shares[0]
    expected = sum(
        x * c[:, :, None] * c[:, None] + y * r[:, :, None] * r[:, None]
        for x, y, c, r in zip(lift, keep, contrast, rest, strict=True)
    )
    np.testing.assert_allclose(term.M, expected, rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(term.M, term.M.transpose(0, 2, 1))
