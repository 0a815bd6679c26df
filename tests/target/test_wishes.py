"""The wishes of a painting: its layers, its strokes, and places that ask for something else."""

import numpy as np
import pytest

import lightpaint as lp
from lightpaint.errors import SizeError
from lightpaint.target.wish import Wish, separate
from lightpaint.target.wish_finding import asked_ratio, find_wishes

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
