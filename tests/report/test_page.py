"""report.html: whole in itself, safe against names, and loud when it must be."""

import base64
import html
import io
import re
from dataclasses import replace
from html.parser import HTMLParser
from typing import Any

import numpy as np
import pytest
from PIL import Image

from lightpaint.colour.primaries import encode_display, to_8_bit
from lightpaint.errors import SizeError
from lightpaint.images.estimate import Estimate
from lightpaint.lighting.answer.combination import combine
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.default_solve import solve
from lightpaint.relit.verification import compare
from lightpaint.report.answer_pictures import CleanLooks
from lightpaint.report.basis_memo import look_reduction
from lightpaint.report.comparison import comparison_image
from lightpaint.report.measures import (
    ReportedAnswer,
    energy_shares,
    noise_residual,
    relative_residual,
)
from lightpaint.report.page.figures import data_uri, thumbnail
from lightpaint.report.page.lights_table import hex_color
from lightpaint.report.page.mixer import mixer_html, mixes_of_mixer
from lightpaint.report.page.report_page import report_page
from lightpaint.target.painted_target import Target

SIZE = (24, 32)
VOID = {"meta", "link", "img", "input", "br", "wbr"}


class Page(HTMLParser):
    """A page taken apart: elements with their attributes, and the text inside them."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[tuple[tuple[str, ...], str]] = []
        self._open: list[str] = []
        self.feed(text)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, {**dict(attrs), "inside": " ".join(self._open)}))
        if tag not in VOID:
            self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append((tuple(self._open), data))

    def all(self, tag: str) -> list[dict[str, Any]]:
        return [attributes for name, attributes in self.elements if name == tag]

    def text(self, tag: str) -> str:
        return "".join(text for open_tags, text in self.texts if tag in open_tags)


def _result(
    make_basis: Any,
    *,
    names: tuple[str, ...] = ("key", "fill", "back"),
    target: str = "dusk",
    bias: float = 1.0,
) -> dict[str, Any]:
    """Two lights that overlap on the painted left, one that shines on the right alone."""
    rng = np.random.default_rng(3)
    x = np.linspace(0, 1, SIZE[1])[None, :, None]
    images = np.empty((3, *SIZE, 3))
    images[0], images[1], images[2] = 1 - 0.8 * x, 0.2 + 0.5 * x, np.where(x > 0.6, 1, 0)
    sigma = 0.01
    basis = make_basis(
        images=images + np.where(images > 0, rng.normal(0, sigma, images.shape), 0),
        half_differences=np.where(images > 0, rng.normal(0, sigma, images.shape), 0),
        names=names,
        emission=[[0.5, 0.5, 0.5], [0.4, 0.4, 0.4], [0.2, 0.3, 0.4]],
    )
    importance = np.zeros(SIZE, np.float32)
    importance[:, :16] = 1
    # The key light alone, twice as bright as now, and orange: the fill must go off.
    image = (np.array([1.0, 0.75, 0.5]) * images[0] - 0.05 * images[1]).astype(np.float32)
    painting = Target(target, image, importance, everything=False, not_finite=5)
    solution = solve(basis, painting)
    predicted = combine(basis, solution.lighting)
    truth = np.einsum("nhwc,nc->hwc", images, solution.lighting.weights_for(basis))
    noise = rng.normal(0, sigma, (2, *truth.shape))
    verified = Estimate((bias * truth + noise[0]).astype(np.float32), noise[1].astype(np.float32))
    return {
        "basis": basis,
        "target": painting,
        "solution": solution,
        "predicted": predicted,
        "verification": compare(predicted, verified),
        "command": "lightpaint solve scene.xml dusk.exr",
    }


def _decoded(uri: str) -> Any:
    head, data = uri.split(",", 1)
    assert head in ("data:image/png;base64", "data:image/jpeg;base64")
    with Image.open(io.BytesIO(base64.b64decode(data, validate=True))) as image:
        return np.asarray(image)


def _looks(page: Page) -> dict[str, Any]:
    """The pictures under the wipe by name."""
    figures = [i for i in page.all("img") if "is-" in i.get("class", "") or i.get("class") == ""]
    return {i["alt"].split(":")[0]: _decoded(i["src"]) for i in figures}


def test_nothing_is_loaded_from_anywhere(make_basis: Any):
    text = report_page(ReportedAnswer(**_result(make_basis)))
    page = Page(text)
    plain = re.sub(r"base64,[A-Za-z0-9+/=]+", "base64,", text)
    assert len(plain) < 60_000
    assert not re.search(r"https?:|//\w|@import|url\(|srcset|\bfetch\b", plain, re.IGNORECASE)
    for _, attributes in page.elements:
        for key in ("src", "href", "action", "data", "poster"):
            assert (attributes.get(key) or "data:").startswith("data:")
    [policy] = [m["content"] for m in page.all("meta") if "http-equiv" in m]
    assert policy.startswith("default-src 'none'; img-src data:;")
    # Every placeholder of the template is filled; the mixer's script has some of its own.
    assert "$" not in re.sub(r'<script type="module">.*?</script>', "", plain, flags=re.DOTALL)


def test_pictures_are_the_display_encoded_images(make_basis: Any):
    result = _result(make_basis)
    looks = _looks(Page(report_page(ReportedAnswer(**result))))
    current = combine(result["basis"], Lighting.current(result["basis"])).image
    assert list(looks) == ["now", "painting", "answer", "render"]
    for name, image in (
        ("now", current),
        ("answer", result["predicted"].image),
        ("render", result["verification"].verified.image),
    ):
        np.testing.assert_array_equal(looks[name], to_8_bit(encode_display(image)))
    painted = to_8_bit(encode_display(result["target"].image))[:, :16]
    np.testing.assert_array_equal(looks["painting"][:, :16], painted)


def test_every_picture_has_its_size_and_words(make_basis: Any):
    images = Page(report_page(ReportedAnswer(**_result(make_basis)))).all("img")
    # Four looks, three maps, three lights.
    assert len(images) == 10
    for image in images:
        height, width, _ = _decoded(image["src"]).shape
        assert (int(image["height"]), int(image["width"])) == (height, width) == SIZE
        assert len(image["alt"]) > 10


def test_pictures_of_a_wide_film_are_no_larger_than_shown(make_basis: Any):
    """All but the lights' small pictures, each of which has blocks of 2 × 2 pixels."""
    basis = make_basis(2, (24, 1300))
    target = Target("t", basis.current_look * 2, np.ones((24, 1300), np.float32), everything=True)
    solution = solve(basis, target)
    predicted = combine(basis, solution.lighting)
    answer = ReportedAnswer(
        basis=basis,
        target=target,
        solution=solution,
        predicted=predicted,
        verification=None,
        command="",
    )
    clean = CleanLooks.clean(basis, solution.weights, predicted.image, None, factor=2)
    for looks in (None, clean):
        page = Page(report_page(answer, looks=looks))
        sizes = [_decoded(image["src"]).shape[:2] for image in page.all("img")]
        assert set(sizes[:5]) == {(12, 650)}
        assert max(width for _, width in sizes) == 650
        sheet = comparison_image(
            basis=basis,
            target=target,
            solution=solution,
            predicted=predicted.image,
            verified=None,
            looks=looks,
        )
        assert 3 * 650 < sheet.shape[1] < 3 * 650 + 5 * 54


def test_a_verification_is_reduced_by_whole_blocks_to_what_is_shown(make_basis: Any):
    """It has the size of the other looks, or a multiple of it where there is room."""
    for width, whole, expected in ((1300, 2600, 650), (640, 1280, 1280), (640, 1920, 640)):
        basis = make_basis(2, (24, width))
        times = whole // width
        verified = np.ones((24 * times, whole, 3), np.float32)
        factor = look_reduction(basis.size)
        looks = CleanLooks.raw(basis, basis.current_look, verified, factor=factor)
        assert looks.verified is not None
        assert looks.verified.shape == (24 * times * expected // whole, expected, 3)


def test_lights_that_share_a_row_are_denoised_with_the_looks(make_basis: Any):
    """In the same walk over the planes, to the same bits as alone."""
    basis = make_basis(16, (20, 30))
    rng = np.random.default_rng(3)
    weights = rng.uniform(0.5, 2, (16, 3))
    lighting = Lighting.current(basis)
    mixes = mixes_of_mixer(basis, lighting)
    assert len(mixes.weights) == 2
    looks = CleanLooks.clean(basis, weights, basis.mix(weights), None, others=mixes)
    assert len(looks.others) == 2
    alone = CleanLooks.clean(basis, weights, basis.mix(weights), None)
    np.testing.assert_array_equal(looks.predicted, alone.predicted)
    made = mixer_html(basis, lighting, is_clean=True, denoised_mixes=looks.others)
    assert made == mixer_html(basis, lighting, is_clean=True)


def test_every_control_has_a_label_and_offers_every_look(make_basis: Any):
    text = report_page(ReportedAnswer(**_result(make_basis)))
    page = Page(text)
    controls = [*page.all("select"), *page.all("input")]
    assert len(controls) == 3
    assert all("label" in control["inside"].split() for control in controls)
    assert len(page.all("option")) == 8
    chosen = re.findall(r"selected>([^<]+)<", text)
    assert chosen == ["painting", "answer"]


def test_remarks_of_the_command_stand_in_the_page(make_basis: Any):
    remarks = ("fog: <b>a light without a size</b>", "rendered with path")
    page = Page(report_page(ReportedAnswer(**_result(make_basis), job_remarks=remarks)))
    shown = [text for inside, text in page.texts if inside[-1:] == ("li",)]
    assert [f"{remark}." for remark in remarks] == [x for x in shown if x.rstrip(".") in remarks]


def test_names_are_text_whatever_they_are(make_basis: Any):
    evil = ("<script>alert(1)</script>", '"><img src=x onerror=y>', "a & b $title ${x}")
    result = _result(make_basis, names=evil, target="</title><b>'dusk'</b>")
    result["command"] = "lightpaint solve '<b>.xml' && echo $HOME ${title} \"&amp;\""
    page = Page(report_page(ReportedAnswer(**result)))
    # The wipe's, and the mixer's with its data.
    assert [x.get("type") for x in page.all("script")] == ["application/json", "module", None]
    assert not page.all("b")
    assert len(page.all("img")) == 10
    for name in evil:
        assert name in page.text("tbody")
    assert page.text("h1") == "</title><b>'dusk'</b>"
    assert page.text("title").startswith("</title><b>'dusk'</b>")
    assert page.text("pre") == result["command"]


def test_agreement_is_said_calmly(make_basis: Any):
    result = _result(make_basis)
    assert result["verification"].agrees
    text = report_page(ReportedAnswer(**result))
    assert "Rendered again: equal within noise." in Page(text).text("header")
    assert 'role="alert"' not in text


@pytest.mark.parametrize("bias", [0.9, 1.1])
def test_a_disagreement_is_loud(make_basis: Any, bias: float):
    result = _result(make_basis, bias=bias)
    page = Page(report_page(ReportedAnswer(**result)))
    [warning] = [d for d in page.all("div") if d.get("role") == "alert"]
    assert warning["class"] == "warning"
    assert "header" in warning["inside"].split()
    assert "do not trust the prediction" in page.text("header")
    assert "DISAGREE" in page.text("header")


def test_without_a_verification(make_basis: Any):
    result = _result(make_basis)
    page = Page(report_page(ReportedAnswer(**{**result, "verification": None})))
    assert list(_looks(page)) == ["now", "painting", "answer"]
    assert len(page.all("option")) == 6
    assert "Not verified" in page.text("header")
    assert "Not checked by a render." in page.text("header")
    # Neither a warning nor a map of what was not rendered.
    assert not [d for d in page.all("div") if d.get("role") == "alert"]
    assert len(page.all("img")) == 8


def test_how_to_paint_again(make_basis: Any):
    result = _result(make_basis)
    painting = result["target"]
    cases = (
        (painting, "run the command again. The basis is kept; only the verification"),
        (replace(painting, content="abc"), "differs from the template"),
        (replace(painting, everything=True), "output of lightpaint template scene.xml"),
    )
    for target, words in cases:
        page = Page(report_page(ReportedAnswer(**{**result, "target": target})))
        assert words in page.text("details")
        assert page.text("summary") == "NumbersChange the painting"
        assert all(x.get("open") is None for x in page.all("details"))


def test_lights_in_order_with_what_happens_to_them(make_basis: Any):
    result = _result(make_basis)
    page = Page(report_page(ReportedAnswer(**result)))
    body = "".join(t for open_tags, t in page.texts if "region" not in open_tags)
    rows = re.split("key|fill|back", page.text("tbody").split("red")[0])[1:]
    assert len(rows) == 3
    assert "back" in body.partition("Reach nothing painted, so unchanged")[2]
    key, fill, back_row = rows
    assert result["solution"].lighting.lights[1].emission == (0, 0, 0)
    assert "×1.5" in key
    assert "off" in fill
    assert "0.0 %" in fill
    assert result["solution"].certificate.unreached == ("back",)
    assert "unchanged: reaches nothing painted" in back_row


def test_the_numbers_are_there(make_basis: Any):
    result = _result(make_basis)
    certificate, checked = result["solution"].certificate, result["verification"]
    text = Page(report_page(ReportedAnswer(**result))).text("main")
    for number in (
        *(f"{value:.3g}" for value in certificate.relative_objective),
        *(f"{value:.1e}" for value in certificate.kkt_residual),
        f"{checked.rmse:.3g}; noise alone gives {checked.noise_rmse:.3g}",
        f"{checked.z_rms:.3f}; about 1 is noise",
        f"mean {checked.delta_e_mean:.2f}; 95 % of pixels below {checked.delta_e_95:.2f}",
        "synthetic, 64 samples per pixel, seed 0",
        "32 × 24 pixels",
        "5 pixels, not counted",
        "in 0 pixels",
    ):
        assert number in text


def test_a_page_of_usual_size_can_be_mailed(make_basis: Any):
    basis = make_basis(8, (360, 640))
    rng = np.random.default_rng(0)
    image = rng.random((360, 640, 3), dtype=np.float32)
    target = Target("noise", image, np.ones((360, 640), np.float32), everything=True)
    solution = solve(basis, target)
    predicted = combine(basis, solution.lighting)
    page = report_page(
        ReportedAnswer(
            basis=basis,
            target=target,
            solution=solution,
            predicted=predicted,
            verification=compare(predicted, predicted),
            command="",
        )
    )
    # Independent noise in every pixel is the worst there is to compress.
    assert len(page) < 7_000_000
    assert _looks(Page(page))["render"].shape == (360, 640, 3)


@pytest.mark.parametrize(
    ("spp", "words"),
    [
        (None, "An independent render of the relit scene."),
        (2, "with 2 samples per pixel; so few may leave out small bright patches."),
        (64, "relit scene with 64 samples per pixel."),
    ],
)
def test_the_picture_of_a_render_says_how_many_samples_it_has(
    make_basis: Any, spp: int | None, words: str
):
    result = _result(make_basis)
    verification = replace(result["verification"], spp=spp)
    page = report_page(ReportedAnswer(**{**result, "verification": verification}))
    assert words in html.unescape(page)


def test_another_size_is_refused(make_basis: Any):
    result = _result(make_basis)
    with pytest.raises(SizeError, match="32x24 but the basis is 10x12"):
        report_page(ReportedAnswer(**{**result, "basis": make_basis(3)}))


def test_a_large_picture_becomes_a_good_jpeg():
    y, x = np.mgrid[:200, :300] / 300
    picture = to_8_bit(np.stack([x, y, 0.5 + 0.5 * np.sin(9 * x * y)], axis=-1))
    lossless, lossy = data_uri(picture), data_uri(picture, largest_png=0)
    np.testing.assert_array_equal(_decoded(lossless), picture)
    assert lossy.startswith("data:image/jpeg")
    # Quality 91 leaves a smooth picture within a few steps of 255.
    assert np.abs(_decoded(lossy).astype(int) - picture).max() <= 6


@pytest.mark.parametrize("level", [1e-4, 0.2, 3e4])
def test_a_thumbnail_shows_something_however_dim(level: float):
    image = np.full((20, 400, 3), level, np.float32)
    image[:10, :40] = 1e6 * level
    emitter_mask = np.zeros((20, 400), bool)
    emitter_mask[:10, :40] = True
    picture, stops = thumbnail(image, emitter_mask)
    assert picture.shape == (7, 144, 3)
    assert stops == pytest.approx(-np.log2(level), abs=0.06)  # rounded to tenths
    assert np.median(picture) > 0.95


def test_a_thumbnail_of_a_light_that_reaches_nothing():
    picture, stops = thumbnail(np.zeros((4, 5, 3), np.float32), np.zeros((4, 5), bool))
    assert stops == 0
    assert not picture.any()


@pytest.mark.parametrize(
    ("emission", "expected"),
    [((2.0, 2, 2), "#ffffff"), ((8, 0, 0), "#ff0000"), ((0, 0, 0), None), ((1, 0.5, 0), "#ffbc00")],
)
def test_swatches_are_chromaticity_alone(emission: Any, expected: str | None):
    # 0.5 encodes to 0.735 by IEC 61966-2-1, 188 of 255.
    assert hex_color(emission) == expected


def test_energy_shares_in_closed_form(make_basis: Any):
    images = np.empty((2, 4, 5, 3))
    images[0], images[1] = 1, 0.5
    basis = make_basis(images=images)
    # Luminance 1 · 20 pixels and 0.7152 · 3 · 0.5 · 20 pixels.
    lighting = Lighting.of_weights(basis, np.array([[1.0, 1, 1], [0, 3, 0]]))
    expected = np.array([1, 0.7152 * 1.5])
    np.testing.assert_allclose(
        energy_shares(basis, lighting), expected / expected.sum(), rtol=1e-12
    )


def test_energy_shares_equal_the_plain_sum(make_basis: Any):
    """In float32 a sum of 40 000 pixels of 1000, one of which is 1 more, would not notice it."""
    images = np.full((3, 200, 203, 3), 1000, np.float32)
    images[1, 7, 9] += 1
    images[2] = np.random.default_rng(4).random((200, 203, 3))
    basis = make_basis(images=images)
    lighting = Lighting.of_weights(basis, np.array([[1.0, 1, 1], [1, 1, 1], [9, 0, 500]]))
    flux = images.astype(np.float64).sum(axis=(1, 2))
    energy = (flux * lighting.weights_for(basis)) @ [0.2126, 0.7152, 0.0722]
    shares = energy_shares(basis, lighting)
    np.testing.assert_allclose(shares, energy / energy.sum(), rtol=1e-12)
    assert shares[1] > shares[0]


def test_energy_shares_sum_to_one(make_basis: Any):
    basis = make_basis(7)
    shares = energy_shares(basis, Lighting.current(basis))
    assert shares.dtype == np.float64
    assert shares.shape == (7,)
    assert shares.sum() == pytest.approx(1, rel=1e-12)
    dark = Lighting.of_weights(basis, np.zeros((7, 3)))
    np.testing.assert_array_equal(energy_shares(basis, dark), np.zeros(7))


def test_what_is_missed_as_squares_in_closed_form(make_basis: Any):
    """One even light, half the pixels painted white: it settles at 1/2 and misses √(1/2)."""
    basis = make_basis(images=np.ones((1, 4, 6, 3)))
    image = np.zeros((4, 6, 3), np.float32)
    image[:, :3] = 1
    target = Target("half", image, np.full((4, 6), 0.3, np.float32), everything=False)
    solution = solve(basis, target)
    # The objective is a difference of float64 sums.
    assert relative_residual(solution) == pytest.approx(np.sqrt(0.5), rel=1e-9)
    # Noise of half the painting's RMS.
    noisy = Estimate(image, np.full_like(image, 0.5 * np.sqrt(0.5)))
    assert noise_residual(solution, noisy) == pytest.approx(0.5, rel=1e-6)


@pytest.mark.parametrize(
    ("scale", "texts"), [(None, ["flux(relative)", "6504 K"]), (100.0, ["200 cd/m²", "600 lm"])]
)
def test_colour_and_flux_of_a_light(make_basis: Any, scale: float | None, texts: list[str]):
    result = _result(make_basis)
    solution = result["solution"]
    light = replace(
        solution.lighting.lights[0], emission=(2, 2, 2), weight=(2, 2, 2), unit_flux=(3, 3, 3)
    )
    lights = (light, *solution.lighting.lights[1:])
    lighting = replace(solution.lighting, lights=lights, cd_per_unit=scale)
    text = report_page(
        ReportedAnswer(**result | {"solution": replace(solution, lighting=lighting)})
    )
    plain = text.replace("<br>", "")
    assert all(words in plain for words in [*texts, "#ffffff"])
    assert (" lm" in plain) == (scale is not None)
