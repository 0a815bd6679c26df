"""comparison.png and the pictures in it: what is shown where, and at which exposure."""

import io
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageDraw

import lightpaint as lp
from lightpaint.colour.color import luminance
from lightpaint.colour.display.exposure import choose_exposure
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.colour.primaries import encode_display, to_8_bit
from lightpaint.errors import SizeError
from lightpaint.files import write_bytes
from lightpaint.images.formats.exr import write_rgb
from lightpaint.images.formats.png import png_bytes
from lightpaint.lighting.analysis.appearance.answer_appearance import Appearance
from lightpaint.lighting.analysis.appearance.delivery import Delivery
from lightpaint.lighting.analysis.appearance.limiting_reasons import Reason
from lightpaint.lighting.analysis.diagnosis import Place
from lightpaint.lighting.answer.combination import combine
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.default_solve import solve
from lightpaint.pipeline.job.solve_job import Job
from lightpaint.pipeline.job.sources import Painting
from lightpaint.pipeline.job_run import run
from lightpaint.report import comparison
from lightpaint.report.answer_pictures import (
    DIVERGING,
    coverage,
    diverging,
    importance_picture,
    residual_of,
    residual_picture,
    round_up,
    target_picture,
    unpainted_look,
)
from lightpaint.report.comparison import SURROUND, Tile, comparison_image, compose
from lightpaint.report.measures import ReportedAnswer
from lightpaint.report.report_json import report_numbers
from lightpaint.report.verdict_sentences import headline
from lightpaint.target.painted_target import Target
from lightpaint.target.target_reader import read_target

SIZE = (24, 32)


def _look(make_basis: Any, *, scale: float = 1.0, name: str = "dusk") -> dict[str, Any]:
    """A painting of random colours over the left half, its answer, and a noisy second render."""
    rng = np.random.default_rng(7)
    basis = make_basis(3, SIZE, emission=[[0.3, 0.2, 0.1]] * 3)
    basis = make_basis(images=scale * basis.images, emission=basis.current_weights)
    importance = np.zeros(SIZE, np.float32)
    importance[:, :16] = 1
    image = (scale * rng.random((*SIZE, 3))).astype(np.float32)
    target = Target(name, image, importance, everything=False)
    solution = solve(basis, target)
    predicted = combine(basis, solution.lighting).image
    verified = predicted * rng.uniform(0.9, 1.1, predicted.shape).astype(np.float32)
    return {
        "basis": basis,
        "target": target,
        "solution": solution,
        "predicted": predicted,
        "verified": verified,
    }


def _tiles(sheet: Any) -> list[Any]:
    """The pictures of a sheet at their own size, found by the surround between them."""
    top = int(np.argmax((sheet != SURROUND).any(axis=(1, 2))))
    # The first line of pixels tells left from right: no caption reaches it.
    is_drawn = np.concatenate([[False], (sheet[top] != SURROUND).any(axis=-1), [False]])
    edges = np.flatnonzero(is_drawn[1:] != is_drawn[:-1])
    zoom = (edges[1] - edges[0]) // SIZE[1]
    bottom = top + SIZE[0] * zoom
    return [
        sheet[top:bottom:zoom, left:right:zoom]
        for left, right in zip(edges[::2], edges[1::2], strict=True)
    ]


@pytest.mark.parametrize("scale", [1.0, 1e-3, 1e3])
def test_four_pictures_at_one_exposure(make_basis: Any, scale: float):
    look = _look(make_basis, scale=scale)
    sheet = comparison_image(**look)
    assert sheet.dtype == np.uint8
    target, predicted, verified, residual = _tiles(sheet)
    stops = choose_exposure(look["verified"])
    assert (stops == 0) == (scale == 1)
    for tile, image in ((predicted, look["predicted"]), (verified, look["verified"])):
        np.testing.assert_array_equal(tile, to_8_bit(encode_display(image, stops=stops)))
    # Painted with full importance, a pixel is what the display makes of it, and nothing else.
    painted = to_8_bit(encode_display(look["target"].image, stops=stops))
    np.testing.assert_array_equal(target[:, :16], painted[:, :16])
    assert residual.shape == (*SIZE, 3)


def test_three_pictures_without_a_verification(make_basis: Any):
    look = _look(make_basis)
    with_render = _tiles(comparison_image(**look))
    without = _tiles(comparison_image(**{**look, "verified": None}))
    assert len(without) == 3
    for a, b in zip(without, [*with_render[:2], with_render[3]], strict=True):
        np.testing.assert_array_equal(a, b)


def test_captions_of_numbers_are_whole_below_small_pictures(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch
):
    cut = comparison.shorten_to_width
    captions: dict[str, str] = {}

    def record(words: str, font: Any, width: int) -> str:
        captions[words] = cut(words, font, width)
        return captions[words]

    monkeypatch.setattr(comparison, "shorten_to_width", record)
    comparison_image(**_look(make_basis), verified_spp=128)
    told = [words for words in captions if "dE" in words or "128 spp" in words]
    assert len(told) == 2
    assert [captions[words] for words in told] == told


WISHES = (Delivery("Moonlight", 0.98, 0.43), Delivery("Wall", 1.0, 1.0))
PLACE = Place((1, 1), 0.9, (0, 0, 8, 8), (0.4, 0.4, 0.4), (0.1, 0.1, 0.1))
FAR = Appearance(14.0, 0.0, 16.0, PLACE)


@pytest.mark.parametrize(
    ("appearance", "caption", "start"),
    [
        (
            Appearance(2.0, 0.0, 20.0, None, deliveries=WISHES),
            "close on the whole: mean dE 2.0 (noise 0.0)",
            "Close on the whole: ",
        ),
        (
            replace(FAR, reasons=(Reason("hold"),)),
            "held back: mean dE 14.0 (noise 0.0)",
            "Unpainted parts keep the lights from this: ",
        ),
        (
            FAR,
            "out of reach: mean dE 14.0 (noise 0.0)",
            "These lights cannot match this: ",
        ),
    ],
)
def test_the_caption_rates_an_answer_as_the_sentence_does(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch, appearance: Any, caption: str, start: str
):
    cut = comparison.shorten_to_width
    captions: dict[str, str] = {}

    def record(words: str, font: Any, width: int) -> str:
        captions[words] = cut(words, font, width)
        return captions[words]

    monkeypatch.setattr(comparison, "shorten_to_width", record)
    comparison_image(**_look(make_basis), appearance=appearance)
    assert captions[caption] == caption
    assert headline(appearance).startswith(start)


def test_a_long_name_stays_below_its_own_picture(make_basis: Any):
    short = comparison_image(**_look(make_basis))
    long = comparison_image(**_look(make_basis, name="dusk over the old harbour " * 9))
    pictures = (short[12] != SURROUND).any(axis=-1)
    second = int(np.flatnonzero(pictures[1:] & ~pictures[:-1])[1])
    np.testing.assert_array_equal(short[:, second:], long[:, second:])
    assert (short[:, :second] != long[:, :second]).any()


FILMS = [(16, 16), (9, 16), (16, 9), (256, 320), (2160, 3840)]


@pytest.mark.parametrize(
    ("size", "limit"),
    [
        *((film, limit) for film in FILMS[:4] for limit in (0.2, 0.0002, 1e-12, 5e15)),
        *((film, 0.002) for film in (FILMS[4], (40, 1000), (1000, 40), (20, 4000))),
    ],
)
def test_captions_do_not_meet(monkeypatch: pytest.MonkeyPatch, size: tuple[int, int], limit: float):
    drawn: list[tuple[float, float, float, float]] = []
    text, paste = ImageDraw.ImageDraw.text, Image.Image.paste

    def drawing(draw: Any, xy: Any, words: str, fill: Any, font: Any) -> None:
        left, top, right, bottom = font.getbbox(words)
        drawn.append((xy[0] + left, xy[1] + top, xy[0] + right, xy[1] + bottom))
        text(draw, xy, words, fill, font)

    def pasting(sheet: Any, picture: Any, xy: Any) -> None:
        drawn.append((*xy, xy[0] + picture.width, xy[1] + picture.height))
        paste(sheet, picture, xy)

    monkeypatch.setattr(ImageDraw.ImageDraw, "text", drawing)
    monkeypatch.setattr(Image.Image, "paste", pasting)
    flat = np.full((*size, 3), 128, np.uint8)
    long = "over the old harbour, version 12, final"
    tiles = [
        Tile(f"target: evening {long}", f"31 % painted, the rest the current look {long}", flat),
        Tile("predicted (agx, exposure +1.5 stops)", "misses 46 % of the target (RMS)", flat),
        Tile("residual", "luminance, predicted - target", flat, limit),
    ]
    height, width, _ = compose(tiles).shape
    assert len(drawn) == 3 * 3 + 3
    for k, (left, top, right, bottom) in enumerate(drawn):
        assert 0 <= left < right <= width
        assert 0 <= top < bottom <= height
        # What is of one tile stays below it, but for the pixel that is round a letter.
        assert any(
            tile[0] - 1 <= left
            and right <= max(tile[2], tile[0] + comparison.MIN_WIDTH) + 1  # beside a narrow one
            for tile in drawn[0:9:3]
        )
        for other in drawn[:k]:
            gaps = (right <= other[0], other[2] <= left, bottom <= other[1], other[3] <= top)
            assert any(gaps)


@pytest.mark.parametrize("size", FILMS)
def test_text_is_as_large_beside_any_picture(size: tuple[int, int]):
    """A sheet that is fitted to a screen can be read, however many pixels it has."""
    flat = np.full((*size, 3), 128, np.uint8)
    height, width, _ = compose([Tile("a", "b", flat, 0.2)] * 4).shape
    tile = (width - 5 * max(12, width // 100)) / 4
    below = height - tile * size[0] / size[1]
    assert 0.2 < below / tile < 0.45


def test_the_exposure_stands_in_the_caption(make_basis: Any):
    """Same pictures, other exposure: the captions must differ."""
    dark = comparison_image(**_look(make_basis, scale=2.0**-8))
    darker = comparison_image(**_look(make_basis, scale=2.0**-9))
    for a, b in zip(_tiles(dark)[1:3], _tiles(darker)[1:3], strict=True):
        np.testing.assert_array_equal(a, b)
    captions = slice(-48, None)
    assert (dark[captions] != darker[captions]).any()


def test_the_file_holds_the_image(make_basis: Any, tmp_path: Path):
    look = _look(make_basis)
    write_bytes(tmp_path / "comparison.png", png_bytes(comparison_image(**look)))
    data = (tmp_path / "comparison.png").read_bytes()
    with Image.open(io.BytesIO(data)) as file:
        np.testing.assert_array_equal(np.asarray(file), comparison_image(**look))


def test_a_larger_verification_is_shown_whole_beside_enlarged_pixels(make_basis: Any):
    look = _look(make_basis)
    small_look = {**look, "verified": look["predicted"]}
    larger = {**look, "verified": np.kron(look["predicted"], np.ones((16, 16, 1), np.float32))}
    # 32 pixels are shown 256 wide either way, and here the verification is 512.
    assert comparison_image(**small_look).shape[1] < comparison_image(**larger).shape[1]
    half = {**look, "verified": np.kron(look["predicted"], np.ones((8, 8, 1), np.float32))}
    np.testing.assert_array_equal(comparison_image(**small_look), comparison_image(**half))


def test_another_size_is_refused(make_basis: Any):
    look = _look(make_basis)
    other = make_basis(3, (12, 17))
    with pytest.raises(SizeError, match="32x24 but the basis is 17x12"):
        comparison_image(**{**look, "basis": other})


def test_what_is_not_painted_is_grey_and_not_the_paintings(make_basis: Any):
    look = _look(make_basis)
    current = combine(look["basis"], Lighting.current(look["basis"])).image
    picture = target_picture(look["target"], current, transform=ViewTransform())
    right = picture[:, 16:]
    assert np.ptp(right, axis=-1).max() == 0
    np.testing.assert_array_equal(right, unpainted_look(current, transform=ViewTransform())[:, 16:])


def test_the_rest_of_a_painting_over_the_current_look_is_that_look(make_basis: Any):
    look = _look(make_basis)
    target = replace(look["target"], over_look=True)
    current = combine(look["basis"], Lighting.current(look["basis"])).image
    picture = target_picture(target, current, transform=ViewTransform())
    np.testing.assert_array_equal(picture[:, :16], encode_display(target.image)[:, :16])
    np.testing.assert_array_equal(picture[:, 16:], encode_display(current)[:, 16:])


def test_a_painting_is_as_small_as_the_look_below_it():
    """Blocks of pixels have the mean of their paint, whatever lies where nothing is painted."""
    image, importance = np.full((4, 6, 3), 9, np.float32), np.zeros((4, 6), np.float32)
    image[:, :3], importance[:, :3] = 0.5, 1
    image[0, 0] = 0.9
    target = Target("left", image, importance, everything=False)
    look = np.full((2, 3, 3), 0.2, np.float32)
    picture = target_picture(target, look, transform=ViewTransform())
    dim = unpainted_look(look, transform=ViewTransform())
    np.testing.assert_allclose(picture[0, 0], encode_display(np.full(3, 0.6)), rtol=1e-6)
    np.testing.assert_allclose(picture[1, 0], encode_display(np.full(3, 0.5)), rtol=1e-6)
    half = (encode_display(np.full(3, 0.5)) + dim[0, 1]) / 2
    np.testing.assert_allclose(picture[:, 1], np.stack([half, half]), rtol=1e-6)
    np.testing.assert_allclose(picture[:, 2], dim[:, 2])


@pytest.mark.parametrize("weight", [0.3, 0.64, 1.0])
def test_a_painting_is_shown_as_it_was_painted_however_little_it_counts(
    make_basis: Any, weight: float
):
    """Nobody who painted a whole picture with half the weight sees it dimmed or hatched."""
    image = _look(make_basis)["target"].image
    importance = np.full(SIZE, weight, np.float32)
    importance[0] = 1
    target = Target("soft", image, importance, everything=False)
    picture = target_picture(target, np.zeros((*SIZE, 3)), transform=ViewTransform())
    np.testing.assert_array_equal(picture, encode_display(image))


def test_emitters_are_shown_as_they_were_painted(make_basis: Any):
    """Although they do not count: the map of importance says so."""
    emitter_mask = np.zeros(SIZE, bool)
    emitter_mask[4:8, 4:8] = True
    basis = make_basis(3, SIZE, seen=emitter_mask)
    image = np.full((*SIZE, 3), 0.5, np.float32)
    target = Target("all", image, np.ones(SIZE, np.float32), everything=True)
    assert not solve(basis, target).importance[emitter_mask].any()
    picture = target_picture(target, np.zeros(image.shape), transform=ViewTransform())
    np.testing.assert_array_equal(picture, encode_display(image))


def test_lines_cross_only_the_map_of_importance(make_basis: Any):
    """Neighbours of an even look differ where lines cross it, and nowhere else."""
    even, corner = np.full((*SIZE, 3), 0.2), np.zeros(SIZE, np.float32)
    corner[:4, :4] = 1
    target = Target("corner", np.zeros((*SIZE, 3), np.float32), corner, everything=False)
    painting = target_picture(target, even, transform=ViewTransform())
    importance = importance_picture(corner, even, transform=ViewTransform())
    assert [len(np.unique(picture[4:])) for picture in (painting, importance)] == [1, 2]


@pytest.mark.parametrize(
    ("importance", "expected"),
    [([0, 0.5, 1], [0, 0.5, 1]), ([0, 0.1, 0.2], [0, 0.5, 1]), ([0, 0.5, 10], [0, 0.5, 1])],
)
def test_coverage_is_alpha(importance: list[float], expected: list[float]):
    np.testing.assert_allclose(coverage(np.array([importance])), [expected], rtol=1e-12)


def test_importance_is_brighter_where_it_counts(make_basis: Any):
    ramp = np.tile(np.linspace(0, 1, SIZE[1]), (SIZE[0], 1))
    picture = importance_picture(ramp, np.full((*SIZE, 3), 0.3), transform=ViewTransform())
    # By whole columns: the lines cross all of them alike.
    assert (np.diff(luminance(picture).mean(axis=0)) > 0).all()


def test_the_sign_of_a_residual_shows_without_colour():
    values = np.linspace(-1, 1, 41)
    assert (np.diff(luminance(diverging(values))) > 0).all()
    np.testing.assert_allclose(diverging(np.array([-5.0, 0, 5])), DIVERGING[[0, 2, 4]])


def test_residual_is_prediction_minus_target(make_basis: Any):
    look = _look(make_basis)
    solution, current = look["solution"], np.zeros((*SIZE, 3))
    offset = np.zeros((*SIZE, 3))
    offset[:12], offset[12:] = 0.2, -0.2
    predicted = solution.image + offset
    residual = residual_of(solution, predicted, transform=ViewTransform())
    assert residual.limit == pytest.approx(0.2)
    assert residual.spoken == ""  # of images that have no noise
    residual = replace(residual, limit=0.4)
    picture = residual_picture(residual, solution, current, transform=ViewTransform())
    above, below = diverging(np.array([0.5, -0.5]))
    # The prediction is float64 here; sums of the luminance weights round in the last digits.
    np.testing.assert_allclose(picture[:12, :16], np.broadcast_to(above, (12, 16, 3)), rtol=1e-9)
    np.testing.assert_allclose(picture[12:, :16], np.broadcast_to(below, (12, 16, 3)), rtol=1e-9)
    np.testing.assert_array_equal(
        picture[:, 16:], unpainted_look(current, transform=ViewTransform())[:, 16:]
    )


def test_residual_scale_is_never_finer_than_sight(make_basis: Any):
    solution = _look(make_basis)["solution"]
    almost = solution.image + 1e-7
    assert residual_of(solution, almost, transform=ViewTransform()).limit == 0.01
    # Three stops brighter on the display, an eighth of it can be seen: 0.00125, rounded up.
    brighter = residual_of(solution, almost, transform=ViewTransform("srgb", 3))
    assert brighter.limit == pytest.approx(0.002)


def test_a_residual_is_averaged_until_its_noise_does_not_show(make_basis: Any):
    """What is missed by 0.1 in the middle third, under noise of 0.2 in every pixel."""
    rng = np.random.default_rng(2)
    height, width = 60, 90
    noise = 0.2 * rng.standard_normal((1, height, width, 1)).repeat(3, -1)
    other = 0.2 * rng.standard_normal((1, height, width, 1)).repeat(3, -1)
    basis = make_basis(images=1 + noise, half_differences=other, emission=[[1, 1, 1]])
    truth = np.zeros((height, width))
    truth[:, 30:60] = 0.1
    image = (1 - truth[..., None].repeat(3, -1)).astype(np.float32)
    target = Target("third", image, np.ones((height, width), np.float32), everything=True)
    # A locked light is shown as it is: the answer itself would be a little dimmer.
    solution = solve(basis, target, constraints=Constraints.of({"light 0": {"lock": True}}))
    residual = residual_of(solution, basis.mix(solution.weights), transform=ViewTransform())
    assert residual.radius > 0
    side = 2 * residual.radius + 1
    assert residual.spoken == f", averaged over {side}x{side} pixels"
    # Away from the edges of the third, which the average blurs: four standard errors of it.
    flat = np.ones(width, bool)
    for edge in (30, 60):
        flat[edge - side : edge + side] = False
    deviation = residual.values - truth
    assert np.sqrt(np.square(deviation[:, flat]).mean()) < 1.5 * 0.2 / side
    assert np.abs(residual.values).max() < 0.1 + 5 * 0.2 / side


@pytest.mark.parametrize(
    ("value", "expected"),
    [(0.011, 0.02), (0.02, 0.02), (0.2, 0.2), (0.3, 0.5), (0.51, 1), (1, 1), (700, 1000)],
)
def test_round_up(value: float, expected: float):
    assert round_up(value) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("factor", [1, 3])
def test_how_much_is_painted_is_one_number(
    tmp_path: Path, make_basis: Any, monkeypatch: pytest.MonkeyPatch, factor: int
):
    """A soft brush, as the terminal, the sheet and report.json have it, on a film of any size."""
    rng, size = np.random.default_rng(3), (24 * factor, 48 * factor)
    y, x = np.mgrid[: size[0], : size[1]] / factor
    alpha = np.clip(1.2 - np.hypot(y - 12, x - 24) / 14, 0, 1)
    rgba = np.dstack([rng.random((*size, 3)), alpha])
    Image.fromarray(to_8_bit(rgba)).save(tmp_path / "soft.png")
    full = read_target(tmp_path / "soft.png")
    share = float((full.importance > 0).mean())
    assert share > full.importance.mean() + 0.1  # else every definition would give it
    basis = make_basis(2, (24, 48))
    target = full.fitted_to(basis.size, resize=False)
    solution = solve(basis, target)
    predicted = combine(basis, solution.lighting)
    look_fields = {"basis": basis, "target": target, "solution": solution}
    captions: list[str] = []
    draw = comparison._caption
    monkeypatch.setattr(
        comparison,
        "_caption",
        lambda *arguments: (captions.append(arguments[1].detail), draw(*arguments))[1],
    )
    comparison_image(**look_fields, predicted=predicted.image, verified=None)
    assert captions[0] == f"{100 * share:.3g} % painted, the rest the current look"
    numbers = json.loads(
        report_numbers(ReportedAnswer(**look_fields, predicted=predicted, verification=None))
    )
    assert numbers["painting"]["share"] == pytest.approx(share, abs=1e-12)
    assert full.spoken_share == target.spoken_share == f"{100 * share:.3g} %"


def test_a_thin_picture_does_not_become_a_tower() -> None:
    """Enlarged until its captions can be read, one of 3x3000 pixels had 240,000 rows."""
    tiles = [Tile("target", "", np.full((3000, 3, 3), 255, np.uint8))] * 2
    sheet = compose(tiles)
    assert sheet.shape[0] < 3200
    assert sheet.shape[1] > 2 * comparison.MIN_WIDTH
    assert (sheet == 255).all(axis=-1).sum() == 2 * 3 * 3000
    small = compose([Tile("target", "", np.full((30, 3, 3), 255, np.uint8))])
    assert (small == 255).all(axis=-1).sum() >= 3 * 30 * (2000 // 30) ** 2


@pytest.mark.parametrize("size", [(1, 1), (2, 600), (600, 2)])
def test_thin_pictures_are_solved_and_reported(
    size: tuple[int, int], make_basis: Any, tmp_path: Path
) -> None:
    basis = make_basis(3, size)
    write_rgb(tmp_path / "p.exr", np.tensordot([0.2, 0.7, 0.4], basis.images, 1))
    job = Job((), (Painting(str(tmp_path / "p.exr")),), tmp_path / "out", basis)
    run(job)
    with Image.open(tmp_path / "out" / "comparison.png") as picture:
        assert max(picture.size) < 4 * max(*size, 600)


def test_a_film_that_sees_an_emitter_everywhere_is_solved(make_basis: Any) -> None:
    basis = make_basis(3, (1, 1), seen=np.ones((1, 1), bool))
    target = Target.of(basis.images.sum(axis=0))
    assert lp.analyse(solve(basis, target, emitters="count"))
