"""How much of each wish came: against closed forms, on flat pictures of one or two colours."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.colour.primaries import colour_science
from lightpaint.images.object_map import Objects
from lightpaint.lighting.analysis.appearance.answer_appearance import compare_appearance
from lightpaint.lighting.analysis.appearance.delivery import (
    Delivery,
    DeliveryReport,
    main_deliveries,
    mean_shares,
    measure_deliveries,
    merge_views,
    newest_delivery,
    worst_delivery,
)
from lightpaint.lighting.analysis.appearance.wish_parts import wish_parts
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.default_solve import solve
from lightpaint.target.painted_target import Target, Wish

SIZE = (24, 48)
WHOLE = np.ones(SIZE, np.float32)
LEFT = np.broadcast_to(np.arange(48) < 24, SIZE).astype(np.float32)
SUBJECT = np.zeros(SIZE, np.float32)
SUBJECT[8:16, 20:28] = 1


def _grey(lightness: float) -> np.ndarray:
    """Light of this L*, by the definition of CIE 1976."""
    return np.full(3, ((lightness + 16) / 116) ** 3)


def _picture(*parts: tuple[np.ndarray, Any]) -> np.ndarray:
    """Flat light in areas, later ones over earlier ones."""
    image = np.zeros((*SIZE, 3))
    for area, light in parts:
        image[area > 0] = light
    return image


def _painting(image: np.ndarray, *wishes: Wish) -> Target:
    target = Target.of(image, np.ones(SIZE, np.float32), name="evening")
    return replace(target, wishes=wishes, transform=ViewTransform(), over_look=True)


def _measure(
    make_basis: Any, now: np.ndarray, asked: np.ndarray, got: np.ndarray, *wishes: Wish
) -> DeliveryReport:
    """Delivery of an answer that is given, whatever would have been solved."""
    basis = make_basis(images=now[None], names=["lamp"], emission=[[1.0] * 3])
    solution = solve(basis, _painting(asked, *wishes))
    return measure_deliveries(solution, got.astype(np.float32))


@pytest.mark.parametrize("share", [-0.5, 0.0, 0.25, 0.5, 1.0, 1.4])
def test_brightness_that_came_is_a_share_of_the_asked_lightness(make_basis: Any, share: float):
    now, asked, got = (
        _picture((WHOLE, _grey(x))) for x in (40.0, 60.0, 40.0 + share * (60.0 - 40.0))
    )
    [delivery] = _measure(make_basis, now, asked, got, Wish("Day", WHOLE)).deliveries
    assert delivery.brightness == pytest.approx(share, abs=1e-4)
    assert delivery.color is None
    assert not delivery.is_darker
    [back] = _measure(make_basis, asked, now, got, Wish("Night", WHOLE)).deliveries
    assert back.is_darker
    assert delivery.is_met == (share >= 0.75)
    assert delivery.asked_brightness == pytest.approx(
        colour_science().delta_E([40, 0, 0], [60, 0, 0], method="CIE 2000"), rel=1e-3
    )


def test_brightness_and_colour_count_apart(make_basis: Any):
    """Light of the asked colour that is too dark, and light of the old colour that is not."""
    orange, level = np.array([0.5, 0.3, 0.12]), np.array([0.2126, 0.7152, 0.0722])
    now = _picture((WHOLE, _grey(70)))
    asked = _picture((WHOLE, orange))
    wish = Wish("Evening", WHOLE)
    same_level = _picture((WHOLE, np.full(3, orange @ level)))
    [bright] = _measure(make_basis, now, asked, same_level, wish).deliveries
    assert bright.brightness == pytest.approx(1, abs=1e-3)
    assert bright.color == pytest.approx(0, abs=1e-3)
    same_color = _picture((WHOLE, orange * (_grey(70)[0] / (orange @ level))))
    [coloured] = _measure(make_basis, now, asked, same_color, wish).deliveries
    assert coloured.brightness == pytest.approx(0, abs=1e-3)
    # The fade to grey in the dark is 1 % here.
    assert coloured.color == pytest.approx(1, abs=0.01)
    assert coloured.spoken == "Evening: brightness 0 %, colour 100 %"


def test_colour_is_a_projection_in_lab(make_basis: Any):
    """Of flat light of one luminance, colour-science gives the same."""
    now, asked, got = (_rgb(60, *ab) for ab in ((0, 0), (10, -20), (12, -5)))
    pictures = (_picture((WHOLE, x)) for x in (now, asked, got))
    [delivery] = _measure(make_basis, *pictures, Wish("Night", WHOLE)).deliveries
    wanted, came = np.array([10, -20]), np.array([12, -5])
    assert delivery.color == pytest.approx(wanted @ came / (wanted @ wanted), abs=0.01)
    assert delivery.brightness is None
    assert delivery.spoken == "Night: 44 %"


def _rgb(*lab: float) -> np.ndarray:
    """Linear Rec.709 of L*a*b*, by colour-science."""
    white = colour_science().CCS_ILLUMINANTS["CIE 1931 2 Degree Standard Observer"]["D65"]
    xyz = colour_science().Lab_to_XYZ(np.array(lab), white)
    return np.asarray(colour_science().XYZ_to_RGB(xyz, "sRGB", white, None))


def test_a_subject_that_stands_out_as_asked_came_in_any_light(make_basis: Any):
    """All is darker than painted, by the same L*. The rest counts by its share of the picture."""
    share = 1 - SUBJECT.mean()
    now = _picture((WHOLE, _grey(50)))
    asked = _picture((WHOLE, _grey(30)), (SUBJECT, _grey(50)))
    wishes = (Wish("Room", WHOLE - SUBJECT), Wish("Figure", SUBJECT))
    darker = _picture((WHOLE, _grey(20)), (SUBJECT, _grey(40)))
    room, figure = _measure(make_basis, now, asked, darker, *wishes).deliveries
    assert room.brightness == pytest.approx(1.5, abs=0.02)
    assert figure.brightness == pytest.approx((30 * share - 10) / (20 * share), abs=0.01)
    alike = _picture((WHOLE, _grey(30)))
    room, figure = _measure(make_basis, now, asked, alike, *wishes).deliveries
    assert room.brightness == pytest.approx(1, abs=0.02)
    assert figure.brightness == pytest.approx((20 * share - 20) / (20 * share), abs=0.01)


def test_surroundings_are_not_judged_by_their_subject(make_basis: Any):
    """They stay, as was asked, while the subject does not come."""
    now = _picture((WHOLE, _grey(50)))
    asked = _picture((WHOLE, _grey(50)), (SUBJECT, _grey(90)))
    wishes = (Wish("Room", WHOLE - SUBJECT), Wish("Figure", SUBJECT))
    room, figure = _measure(make_basis, now, asked, now, *wishes).deliveries
    assert room.least is None
    assert figure.brightness == pytest.approx(0, abs=1e-6)
    assert worst_delivery([room, figure]) is figure


def test_noise_does_not_count(make_basis: Any):
    rng = np.random.default_rng(3)
    now, asked, got = (_picture((WHOLE, _grey(x))) for x in (40, 60, 50))
    noisy = [x + rng.normal(0, 0.03, (*SIZE, 3)) for x in (now, got)]
    [clean] = _measure(make_basis, now, asked, got, Wish("Day", WHOLE)).deliveries
    [delivery] = _measure(make_basis, noisy[0], asked, noisy[1], Wish("Day", WHOLE)).deliveries
    assert delivery.brightness == pytest.approx(clean.brightness, abs=0.03)


def test_the_dark_half_of_a_picture_says_nothing(make_basis: Any):
    """Its lit half is far off, and the mean over all of it is half of that."""
    now, asked = (_picture((LEFT, _grey(x))) for x in (40, 60))
    report = _measure(make_basis, now, asked, now, Wish("Day", WHOLE))
    difference = colour_science().delta_E([40, 0, 0], [60, 0, 0], method="CIE 2000")
    # But for the blur of its edge.
    assert report.lit_delta_e == pytest.approx(difference, rel=0.06)
    assert report.deliveries[0].lit_pixels == pytest.approx(LEFT.sum(), rel=0.1)
    everywhere = _measure(make_basis, 0 * now, 0 * now, 0 * now, Wish("Day", WHOLE))
    assert everywhere.deliveries == ()
    assert everywhere.lit_delta_e == 0


def test_brighter_light_is_as_good_where_the_painting_is_white(make_basis: Any):
    basis = make_basis(
        images=_picture((WHOLE, _grey(50)))[None], names=["lamp"], emission=[[1.0] * 3]
    )
    target = _painting(_picture((WHOLE, _grey(80))), Wish("Day", WHOLE))
    target = replace(target, at_least=np.ones((*SIZE, 3), bool))
    solution = solve(basis, target)
    report = measure_deliveries(solution, np.ones((*SIZE, 3), np.float32))
    assert report.deliveries[0].brightness == pytest.approx(1)
    assert report.lit_delta_e == 0


def test_the_rim_of_a_lamp_in_view_is_no_wish(make_basis: Any) -> None:
    """A painting may show a lamp in part of a pixel in which the samples met none of it."""
    seen = SUBJECT > 0
    rim = np.pad(seen, 1)[1:-1, 2:] & ~seen  # the column to the left
    now = _picture((WHOLE, _grey(30)), (SUBJECT, np.full(3, 5.0)))
    asked = np.where(rim[..., None], 2.0, now)
    basis = make_basis(images=now[None], names=["lamp"], emission=[[1.0] * 3], seen=seen)
    target = replace(_painting(asked), importance=np.where(seen, 0, 1).astype(np.float32))
    solution = solve(basis, target, space="display")
    assert worst_delivery(measure_deliveries(solution, now.astype(np.float32)).deliveries) is None
    # The same pixels are a wish where no lamp is beside them.
    unseen = replace(basis, emitters_seen=np.zeros(SIZE, bool))
    missed = measure_deliveries(solve(unseen, target), now.astype(np.float32)).deliveries
    assert worst_delivery(missed) is not None


def test_noise_of_a_few_dark_pixels_lacks_nothing(make_basis: Any) -> None:
    """Half of a small change came, or all of it: the noise of its pixels does not tell."""
    now, asked, got = (
        _picture((WHOLE, _grey(30)), (SUBJECT, _grey(x))) for x in (20.0, 24.0, 22.0)
    )
    wish = Wish("Shade", SUBJECT)
    rng = np.random.default_rng(0)
    for noise, is_met in ((0.0, False), (1.0, True)):
        halves = noise * now * SUBJECT[..., None] * rng.choice([-1, 1], (*SIZE, 1))
        basis = make_basis(
            images=now[None],
            names=["lamp"],
            emission=[[1.0] * 3],
            half_differences=np.maximum(np.abs(halves), 1e-9)[None],
        )
        solution = solve(basis, _painting(asked, wish))
        [delivery] = measure_deliveries(solution, got.astype(np.float32)).deliveries
        assert delivery.brightness == pytest.approx(0.5, abs=1e-3)
        assert delivery.is_met == is_met
        assert (delivery.brightness_error > 0.125) == is_met


@pytest.mark.parametrize("space", ["linear", "display"])
def test_an_answer_that_is_held_by_a_lock_came_half_way(make_basis: Any, space: Any):
    """From the answer itself: two lamps, one of them locked, light a half of the picture each."""
    now = _grey(40)[0]
    images = np.stack([_picture((LEFT, 1)), _picture((1 - LEFT, 1))])
    basis = make_basis(images=images, names=["left", "right"], emission=[[now] * 3] * 2)
    image = _picture((WHOLE, _grey(60)))
    target = _painting(image, Wish("Left", LEFT), Wish("Right", 1 - LEFT))
    half = Constraints.of({"left": {"lock": float(_grey(50)[0])}})
    solution = solve(basis, target, constraints=half, space=space)
    appearance = compare_appearance(solution)
    left, right = appearance.deliveries
    assert left.brightness == pytest.approx(0.5, abs=0.02)
    lightness = 116 * np.cbrt(solution.weights[1].mean()) - 16
    assert right.brightness == pytest.approx((lightness - 40) / (60 - 40), abs=0.02)
    assert appearance.worst_wish is left
    assert not appearance.is_close
    # The reason is that of the wish.
    assert appearance.reasons[0].kind == "lock"
    assert appearance.place is not None
    assert appearance.place.region[1] == 0


def test_groups_and_layers_are_measured_as_a_whole(make_basis: Any):
    now, asked = (_picture((WHOLE, _grey(x))) for x in (40, 60))
    got = _picture((WHOLE, _grey(60)), (LEFT, _grey(40)))
    wishes = (
        Wish("Everything", 1 - LEFT, layer=4, group="Dawn"),
        Wish("Shadows", LEFT, layer=5, group="Dawn"),
    )
    first, second, group = _measure(make_basis, now, asked, got, *wishes).deliveries
    assert (group.name, group.kind, group.layers) == ("Dawn", "group", (4, 5))
    assert group.brightness == pytest.approx(0.5, abs=0.03)
    assert [first.kind, second.kind] == ["layer", "layer"]
    assert main_deliveries([first, second, group]) == [group]
    assert worst_delivery([first, second, group]) is group
    assert newest_delivery([first, second, group]) is group


def test_strokes_of_one_layer_are_named_by_where_they_lie(make_basis: Any):
    """By the object below, or by the part of the picture."""
    now = _picture((WHOLE, _grey(40)))
    corner = np.zeros(SIZE, np.float32)
    corner[:8, :16] = 1
    asked = _picture((WHOLE, _grey(40)), (SUBJECT, _grey(70)), (corner, _grey(60)))
    basis = make_basis(images=now[None], names=["lamp"], emission=[[1.0] * 3])
    index = np.where(SUBJECT > 0, 1, 0).astype(np.int32)
    basis = replace(basis, objects=Objects(index, ("wall", "small_vase")))
    layer = Wish("Painting", np.maximum(SUBJECT, corner), layer=0, has_strokes=True)
    target = replace(
        _painting(asked, layer), importance=np.maximum(SUBJECT, corner).astype(np.float32)
    )
    report = measure_deliveries(solve(basis, target), now.astype(np.float32))
    names = {x.name: x.kind for x in report.deliveries}
    assert names == {
        "Painting, small vase": "wish",
        "Painting, top left": "wish",
        "Painting": "layer",
    }
    assert [x.kind for x in main_deliveries(report.deliveries)] == ["wish", "wish"]
    # Without layers, the place is the name.
    flat = measure_deliveries(solve(basis, replace(target, wishes=())), now.astype(np.float32))
    assert {x.name for x in flat.deliveries} == {"Small vase", "Top left"}
    assert {x.kind for x in flat.deliveries} == {"wish"}


def test_places_in_one_part_of_the_picture_are_told_apart_by_what_is_in_them():
    """By the object that takes a fair part of each, and by a number where that does not help."""
    areas = [np.zeros(SIZE, np.float32) for _ in range(4)]
    for k, area in enumerate(areas):
        area[8:16, 34 + 3 * k : 36 + 3 * k] = 1
    index = np.tile(np.arange(SIZE[0]) % 2, (SIZE[1], 1)).T.astype(np.int32)  # floor and wall
    index[8:12, 34:36] = 2
    index[8:12, 37:39] = 3
    objects = Objects(index, ("wall", "floor", "small_vase", "bench"))
    parts = wish_parts([Wish("evening", area) for area in areas], objects)
    by_name = [part.name for part in parts]
    assert by_name[:2] == ["Right (small vase)", "Right (bench)"]
    assert len(set(by_name)) == 4
    assert [x.name for x in wish_parts([Wish("evening", x) for x in areas[:2]], None)] == [
        "Right",
        "Right (2)",
    ]


def test_places_on_one_object_are_told_apart_by_where_they_lie():
    areas = [np.zeros(SIZE, np.float32) for _ in range(3)]
    for k, area in enumerate(areas):
        area[2:6, 4 + 16 * k : 8 + 16 * k] = 1
    index = np.ones(SIZE, np.int32)
    index[:8] = 0
    objects = Objects(index, ("back_wall", "floor"))
    wishes = [Wish("Strokes", area, layer=1) for area in areas]
    assert [x.name for x in wish_parts(wishes, objects)[:3]] == [
        "Strokes, back wall (top left)",
        "Strokes, back wall (top)",
        "Strokes, back wall (top right)",
    ]


def test_views_count_by_what_they_ask_for():
    stalls = Delivery("Key", 1.0, None, 2.0, 10.0, 0.0, 300.0, layers=(3,), kind="layer")
    balcony = Delivery("Key", 0.0, 0.5, 8.0, 10.0, 6.0, 100.0, layers=(3,), kind="layer")
    other = Delivery("Fill", 0.9, 0.9, layers=(4,), kind="layer")
    merged, untouched = merge_views([stalls, balcony, other])
    assert merged.brightness == pytest.approx(0.75)
    assert merged.color == 0.5
    assert merged.delta_e == pytest.approx(3.5)
    assert untouched is other


def test_two_views_are_one_delivery(make_basis: Any):
    """One view asks for what the other one does, of one lamp."""
    bases = [make_basis(images=np.ones((1, *SIZE, 3)), names=["lamp"], emission=[[0.1] * 3])] * 2
    image = _picture((WHOLE, 0.4))
    target = _painting(image, Wish("Day", WHOLE, layer=1))
    appearance = compare_appearance(solve(bases, [target, target]))
    [delivery] = appearance.deliveries
    assert delivery.brightness == pytest.approx(1, abs=0.02)
    assert delivery.lit_pixels == pytest.approx(2 * WHOLE.size)


def test_all_wishes_together_count_alike():
    def wish(layer: int, brightness: float | None, color: float | None, **options: Any) -> Delivery:
        return Delivery("wish", brightness, color, layers=(layer,), kind="layer", **options)

    large = wish(1, 0.9, 1.3, lit_pixels=50_000)
    small = wish(2, 0.1, None, lit_pixels=50)
    member, wrong = wish(3, 0.0, 0.0, group="Night"), wish(4, None, -0.4)
    group = Delivery("Night", 0.5, 0.2, layers=(3,), group="Night", kind="group")
    # A layer of a group counts with its group. 130 % is all, and the other way is nothing.
    brightness, color = mean_shares([large, small, member, group, wrong])
    assert brightness == pytest.approx((0.9 + 0.1 + 0.5) / 3)
    assert color == pytest.approx((1 + 0.2 + 0) / 3)
    assert mean_shares([wrong]) == (None, 0.0)
    assert mean_shares([]) == (None, None)
