"""A painting that Mitsuba rendered with its own filter is another picture than lights make."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from renderer import LIGHTS, write_room
from scipy.ndimage import gaussian_filter

import lightpaint as lp
from lightpaint.images.neighbourhoods import TAP, film_filtered
from lightpaint.scene.runtime.variant import use_variant

SIZE = (48, 64)
Y, X = np.mgrid[: SIZE[0], : SIZE[1]]

#: Two walls with an edge of light, and a lamp in view.
LAMP = np.hypot(X - 20, Y - 12) < 3
WALLS = np.where(X < 40, 0.1 + Y / 48, 0.02), np.where(X > 24, 0.1 + X / 64, 0.05) + 0.1 * (Y < 20)
TRUE = np.array([[1.5, 1.0, 0.5], [0.4, 0.8, 1.2]])


def sums_over_subpixels() -> float:
    """The share of a Gaussian of σ = ½ pixel in the pixel beside, by a sum over its points."""
    x = (np.arange(-4000, 4000) + 0.5) / 2000
    weight = np.exp(-2 * x**2)
    return float(weight[x > 0.5].sum() / weight.sum())


def test_a_box_becomes_a_gaussian() -> None:
    image = np.zeros((5, 5))
    image[2, 2] = 1
    line = np.array([0, TAP, 1 - 2 * TAP, TAP, 0])
    np.testing.assert_allclose(film_filtered(image), np.outer(line, line), atol=1e-15)
    assert pytest.approx(sums_over_subpixels(), abs=1e-4) == TAP  # 2 pixels hold all but 6e-5
    # At the border as if it went on.
    np.testing.assert_allclose(film_filtered(np.ones((3, 1))), 1, atol=1e-15)


@pytest.fixture
def basis(make_basis: Any) -> lp.Basis:
    """Two lights, the first of which is seen."""
    images = np.repeat(np.stack(WALLS)[..., None], 3, axis=-1)
    images[0][LAMP] = 12
    halves = 0.01 * np.random.default_rng(0).normal(size=images.shape)
    noise = 0.01 * np.random.default_rng(1).normal(size=images.shape)
    return make_basis(images=images + noise, half_differences=halves, seen=LAMP)


def answer_to(basis: lp.Basis, image: Any) -> lp.Solution:
    """The literal answer to a painting of all pixels."""
    return lp.correct_noise(lp.solve(basis, lp.Target.of(image), literal=True))


def bars_of(answer: lp.Solution) -> lp.Uncertainty:
    """Error bars of an answer."""
    bars = lp.error_bars(answer)
    assert bars is not None
    return bars


def picture() -> Any:
    """The picture of these lights, (h, w, 3), without noise."""
    image = np.einsum("nhw,nc->hwc", np.stack(WALLS), TRUE)
    image[LAMP] = 12 * TRUE[0]
    return image


@pytest.mark.parametrize("sigma", [None, 0.45])
def test_an_answer_allows_for_the_filter_of_a_painting(
    basis: lp.Basis, sigma: float | None
) -> None:
    """Without it the lamp in view and its halo make lights wrong, as least squares of the picture
    with that filter are."""
    clean = picture()
    image = film_filtered(clean) if sigma is None else gaussian_filter(clean, (sigma, sigma, 0))
    walls = [np.where(LAMP, 12, WALLS[0]), WALLS[1]]
    columns = np.stack([x.ravel() for x in walls], axis=1)
    wrong = np.linalg.lstsq(columns, image.reshape(-1, 3), rcond=None)[0]
    assert np.abs(wrong - TRUE).max() > 0.05
    answer = answer_to(basis, image)
    bars = bars_of(answer)
    # What is left is by noise of the basis, and by a kernel that is nearly the right one.
    assert np.abs(answer.weights - TRUE).max() < (0.01 if sigma is None else 0.03)
    low, high = bars.interval
    assert ((low <= TRUE) & (high >= TRUE)).mean() >= 5 / 6
    assert bars.is_filtered


def test_views_lose_their_filter_each_by_itself(basis: lp.Basis) -> None:
    """Also in display values, where light is compared as it is shown."""
    image = film_filtered(picture())
    target = lp.Target.of(image.astype(np.float32))
    for space in ("linear", "display"):
        answer = lp.solve([basis, basis], [target, target], literal=True, space=space)
        assert answer.problem.filter_share > 0.9
        assert np.abs(answer.weights - TRUE).max() < 0.02


@pytest.mark.parametrize("is_filtered", [True, False])
def test_a_filter_is_seen_in_eight_bits(make_basis: Any, is_filtered: bool) -> None:
    """Read as a sketch, a render of leaves, whose filter makes as much grain as its noise does.

    Without its filter the lights are off by a twentieth, as the lights of a box are: noise shows
    wishes. With it they are off by .08.
    """
    leaves = np.random.default_rng(9).uniform(0.6, 1.4, SIZE)
    walls, rng = np.stack(WALLS) * leaves, np.random.default_rng(0)
    images = np.repeat(walls[..., None], 3, axis=-1)
    a, b = (images * (1 + 0.02 * rng.normal(size=images.shape)) for _ in range(2))
    emission = (TRUE / [[1.6], [0.7]]).tolist()
    basis = make_basis(images=(a + b) / 2, half_differences=(a - b) / 2, emission=emission)
    clean = np.einsum("nhw,nc->hwc", walls, TRUE)
    image = film_filtered(clean) if is_filtered else clean
    image = image * (1 + 0.03 * np.random.default_rng(2).normal(size=(*SIZE, 1)))
    view = lp.ViewTransform("srgb")
    codes = np.round(255 * np.clip(view.encode(image), 0, 1))
    target = lp.Target(
        "render.png",
        view.decode(codes / 255).astype(np.float32),
        np.ones(SIZE, np.float32),
        everything=True,
        at_least=codes >= 255,
        transform=view,
        through_view=True,
    )
    answer = lp.correct_noise(lp.solve(basis, target))
    assert (answer.problem.filter_share > 0.9) == is_filtered
    assert (answer.problem.filter_share == 0) != is_filtered
    assert np.abs(answer.weights / TRUE - 1).max() < 0.06


def test_a_box_and_a_brush_are_no_filter(basis: lp.Basis) -> None:
    stroke = 1 + 0.5 * np.clip((14 - np.hypot(X - 30, Y - 24)) / 6, 0, 1)[..., None]
    glow = 1.0 * gaussian_filter(LAMP * 1.0, 6)[..., None]
    for image in (picture(), picture() * stroke, picture() + glow):
        bars = bars_of(answer_to(basis, image))
        # Flat sums of noise of the painting are below the noise of the basis.
        assert (bars.painting_scatter < bars.scatter).all()
        assert not bars.is_filtered


def test_paint_that_lacks_the_texture_of_the_scene_is_no_filter(make_basis: Any) -> None:
    """It lacks more of it than a filter would take."""
    rng = np.random.default_rng(0)
    basis = make_basis(3, half_differences=0.01 * rng.normal(size=(3, 12, 10, 3)))
    answer = answer_to(basis, 0.5 + 0.1 * rng.normal(size=(12, 10, 3)))
    assert not answer.problem.filter_share


@pytest.mark.nightly
def test_renders_of_mitsuba(tmp_path: Path) -> None:
    """The levels are those of the painting; only its filter differs from the filter of the basis.

    Seen are halos of a panel, and edges of shadows.
    """
    use_variant()
    import mitsuba as mi

    lights = LIGHTS["panel"] + LIGHTS["bulb"] + LIGHTS["beam"]
    for film, is_wide in (('<rfilter type="gaussian"/>', True), ('<rfilter type="box"/>', False)):
        path = write_room(tmp_path, lights=lights, film=film)
        basis = lp.render_basis(lp.load_scene(path), spp=1024, seed=1)
        image = np.array(mi.render(mi.load_file(str(path)), spp=4096, seed=2))[..., :3]
        answer = answer_to(basis, image)
        low, high = bars_of(answer).interval
        held = (low <= basis.current_weights) & (basis.current_weights <= high)
        # Nine channels; one may miss by chance.
        assert held.sum() >= 8
        assert (answer.problem.filter_share > 0) == is_wide
        # Of the filter up to a tenth is left, where its kernel depends on where edges are.
        off = np.abs(answer.weights / basis.current_weights - 1).max()
        assert off < 0.1
