"""The wishes of a painting: its layers, its strokes, and places that ask for something else."""

import numpy as np
import pytest

import lightpaint as lp
from lightpaint.colour.primaries import decode_display, encode_display
from lightpaint.errors import SizeError
from lightpaint.progress import cancellable
from lightpaint.target import wish_finding
from lightpaint.target.painted_target import Wish, separate
from lightpaint.target.wish_finding import asked_ratio, find_wishes, number_places

LOOK = np.full((40, 60, 3), 0.2, np.float32)


def target(image, importance=None, wishes=()):
    counts = np.ones(image.shape[:2], np.float32) if importance is None else importance
    return lp.Target("painting", image, counts, everything=False, wishes=wishes)


def box(top, bottom, left, right):
    mask = np.zeros(LOOK.shape[:2], bool)
    mask[top:bottom, left:right] = True
    return mask


def test_each_stroke_is_a_wish():
    first, second = box(4, 16, 4, 20), box(24, 36, 40, 56)
    painted = target(np.where((first | second)[..., None], 2 * LOOK, LOOK), first * 1.0 + second)
    wishes = find_wishes(painted, LOOK)
    assert len(wishes) == 2
    for mask in (first, second):
        assert any(np.array_equal(wish.area > 0, mask) for wish in wishes)


def test_a_subject_in_a_repainted_picture_is_a_wish_of_its_own():
    subject = box(10, 30, 20, 40)
    painted = target(np.where(subject[..., None], 2 * LOOK, 0.4 * LOOK).astype(np.float32))
    rest, found = find_wishes(painted, LOOK)
    overlap = ((found.area > 0) & subject).sum() / ((found.area > 0) | subject).sum()
    assert overlap > 0.8  # its border is as soft as the wash
    np.testing.assert_allclose(rest.area + found.area, 1)


def test_places_that_touch_at_a_corner_are_wishes_of_their_own():
    """Of both as one, more than half of the painting, none would be a wish."""
    stops = np.select([box(0, 24, 0, 40), box(24, 40, 40, 60)], [-3.0, 3.0])[..., None]
    wishes = find_wishes(target((LOOK * 2**stops).astype(np.float32)), LOOK)
    assert len(wishes) == 3
    areas = [wish.area > 0 for wish in wishes]
    for place in (stops[..., 0] < 0, stops[..., 0] > 0):
        overlap = max((x & place).sum() / (x | place).sum() for x in areas)
        assert overlap > 0.8  # its border is as soft as the wash


def soft(row, column, radius):
    """An ellipse that fades from its centre to its rim, (h, w), from 0 to 1."""
    rows, columns = np.mgrid[: WALL.shape[0], : WALL.shape[1]]
    return np.clip(1 - np.hypot(rows - row, columns - column) / radius, 0, 1)[..., None]


#: A white wall with a dark red picture on it.
WALL = np.full((80, 120, 3), 0.6, np.float32)
WALL[30:50, 45:70] = (0.1, 0.02, 0.02)


def over(look, cover, color):
    """`look` with a colour over it, as an editor of 8-bit pictures mixes them."""
    mixed = cover * encode_display(np.array(color)) + (1 - cover) * encode_display(look)
    return decode_display(mixed).astype(np.float32)


def with_light(look, cover, color):
    """`look` with a colour over it, as an editor of EXR files mixes them."""
    return (cover * np.array(color) + (1 - cover) * look).astype(np.float32)


def gained(look, cover, stops):
    return (look * 2.0 ** (cover * np.array(stops))).astype(np.float32)


@pytest.mark.parametrize("brush", [over, with_light])
@pytest.mark.parametrize("color", [(0.05, 0.1, 0.5), (0.9, 0.7, 0.3), (0.001, 0.001, 0.002)])
def test_a_stroke_of_one_color_is_one_wish_whatever_it_covers(brush, color):
    """The stops that it asks for differ by much: between rim and centre, wall and picture."""
    cover = 0.8 * soft(40, 60, 34)
    image = brush(WALL, cover, color)
    asked = np.abs(np.log2(image / WALL)).sum(axis=-1)[cover[..., 0] > 0.05]
    assert np.ptp(np.quantile(asked, [0.1, 0.9])) > 1.5
    assert len(find_wishes(target(image, cover[..., 0].astype(np.float32)), WALL)) == 1


@pytest.mark.parametrize("stops", [(-3, -3, -3), (2, 1, -1)])
def test_a_gain_that_fades_is_one_wish(stops):
    cover = soft(40, 60, 34)
    painted = target(gained(WALL, cover, stops), cover[..., 0].astype(np.float32))
    assert len(find_wishes(painted, WALL)) == 1


def test_strokes_of_two_colors_that_touch_are_wishes_of_their_own():
    warm, cool = soft(40, 40, 26), soft(40, 80, 26)
    image = over(over(WALL, 0.8 * warm, (0.9, 0.5, 0.1)), 0.8 * cool, (0.05, 0.1, 0.5))
    cover = np.maximum(warm, cool)[..., 0].astype(np.float32)
    wishes = find_wishes(target(image, cover), WALL)
    assert len(wishes) >= 2
    most = [max(wishes, key=lambda x, k=k: float(x.area[40, k])) for k in (35, 85)]
    assert most[0] is not most[1]


def test_a_subject_within_a_stroke_is_a_wish_of_its_own():
    look = np.full((80, 120, 3), 0.4, np.float32)
    image = gained(look, soft(40, 60, 36) ** 0.2, (-2, -2, -2))
    image[30:50, 50:70] = 0.8
    cover = (soft(40, 60, 36)[..., 0] > 0).astype(np.float32)
    areas = sorted(float(wish.area.sum()) for wish in find_wishes(target(image, cover), look))
    assert len(areas) == 2
    assert areas[0] == pytest.approx(400, rel=0.5)  # a wash, of a radius of some pixels


def test_what_asks_for_one_thing_is_one_wish():
    assert len(find_wishes(target(0.5 * LOOK), LOOK)) == 1


def test_texture_makes_no_wishes():
    rng = np.random.default_rng(0)
    look = LOOK * rng.uniform(0.2, 5, (*LOOK.shape[:2], 1)).astype(np.float32)
    assert len(find_wishes(target(0.5 * look), look)) == 1


@pytest.mark.parametrize("seed", range(3))
def test_noise_of_the_look_makes_no_wishes(seed):
    """A clean painting over a render of few samples: its ratio to the look has the look's noise."""
    image = np.full((60, 80, 3), 0.1, np.float32)
    image[20:40, 10:30] *= 4  # 400 pixels
    noise = np.random.default_rng(seed).gamma(9, 1 / 9, (60, 80, 1))
    look = (0.2 * noise * np.ones(3)).astype(np.float32)
    areas = sorted(float(wish.area.sum()) for wish in find_wishes(lp.Target.of(image), look))
    assert len(areas) == 2
    assert areas[0] == pytest.approx(400, rel=0.5)  # a wash, of a radius of some pixels


def test_layers_stay_as_they_are():
    areas = separate([np.ones(LOOK.shape[:2]), box(10, 30, 20, 40).astype(float)])
    layers = tuple(
        Wish(name, area, layer=k) for k, (name, area) in enumerate(zip("ab", areas, strict=True))
    )
    assert find_wishes(target(0.5 * LOOK, wishes=layers), LOOK) == layers
    assert not (areas[0] * areas[1]).any()


def test_the_ratio_is_in_stops():
    painted = target(LOOK * np.array([4, 1, 0.5], np.float32))
    stops = asked_ratio(painted.image, painted.importance, LOOK)[:, 20, 30]
    # Darkness of a hundredth of the mean is added to both.
    exact = np.log2((0.2 * np.array([4, 1, 0.5]) + 0.002) / 0.202)
    np.testing.assert_allclose(stops, exact, atol=1e-6)


def test_wishes_follow_the_size_of_the_target():
    wish = Wish("left", box(0, 40, 0, 30).astype(np.float32))
    painted = target(LOOK, wishes=(wish,))
    assert painted.reduced(2).wishes[0].area.mean() == pytest.approx(0.5)
    assert painted.resized((20, 30)).wishes[0].area.mean() == pytest.approx(0.5)
    assert painted.cropped(40, 30).wishes[0].area.min() == 1


def test_a_wish_of_another_size_is_refused():
    with pytest.raises(SizeError, match="wish"):
        target(LOOK, wishes=(Wish("small", np.ones((2, 2), np.float32)),))


@pytest.mark.parametrize(
    ("squares", "counts"),
    [
        ([((2, 6), (4, 8)), ((12, 16), (4, 8))], [0, 16, 16]),
        ([((2, 12), (4, 14)), ((20, 24), (4, 8))], [0, 100, 16]),
        ([((2, 6), (4, 8))], [0]),  # one place is the wish
        ([((2, 22), (4, 14)), ((28, 30), (20, 21))], [0]),  # a crumb of less than a tenth
    ],
)
def test_separate_places_of_a_wish_have_numbers(squares, counts):
    """The larger ones first; soft edges belong to none."""
    area = np.full((32, 48), 0.1)
    for rows, columns in squares:
        area[slice(*rows), slice(*columns)] = 0.9
    numbers = number_places(area)
    assert [int((numbers == k).sum()) for k in range(1, numbers.max() + 1)] == counts[1:]


def test_strokes_are_remembered_as_long_as_nothing_of_them_changes(monkeypatch):
    """Under the brush most layers stay as they are, and each takes as long as the one that does
    not.
    """
    looked_at, owners = [], wish_finding._owners

    def counted(painted, painting):
        looked_at.append(painted)
        return owners(painted, painting)

    monkeypatch.setattr(wish_finding, "_owners", counted)
    monkeypatch.setattr(wish_finding, "_REMEMBERED", wish_finding._RememberedStrokes())
    boxes = box(4, 16, 4, 20), box(24, 36, 40, 56), box(0, 40, 0, 45)
    layers = [Wish(str(k), x.astype(np.float32), has_strokes=True) for k, x in enumerate(boxes)]
    importance = np.ones(LOOK.shape[:2], np.float32)
    image = np.where(boxes[0][..., None], 2 * LOOK, LOOK)

    def areas(**changed):
        of = {"image": image, "importance": importance, "current_look": LOOK} | changed
        return [wish.area for wish in wish_finding.split_wishes(layers, **of)]

    first = areas()
    assert len(looked_at) == 3
    np.testing.assert_array_equal(areas(), first)
    assert len(looked_at) == 3
    within = image.copy()
    within[6:10, 6:10] *= 4
    changed = areas(image=within)
    # The second lies elsewhere; the third covers most of the picture, around which a wash reads.
    assert len(looked_at) == 5
    monkeypatch.setattr(wish_finding, "_REMEMBERED", wish_finding._RememberedStrokes())
    np.testing.assert_array_equal(areas(image=within), changed)
    areas(current_look=1.5 * LOOK)
    assert len(looked_at) == 5 + 3 + 3


def test_finding_wishes_ends_when_it_is_cancelled():
    """An exact answer of many layers: the next stroke gets the processors at once."""

    def stop():
        raise KeyError

    with pytest.raises(KeyError), cancellable(stop):
        find_wishes(target(2 * LOOK), LOOK)
