"""What was painted, found by comparing a file that came back with its template."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from lightpaint.colour.display.view_transform import TransformChoice, ViewTransform
from lightpaint.colour.primaries import decode_display
from lightpaint.errors import SizeError, TargetError, ViewError
from lightpaint.images.formats.exr import ExrPart, write_parts, write_rgb
from lightpaint.images.formats.png import write_png_16
from lightpaint.target.target_reader import read_target
from lightpaint.target.template import Template, read_template, write_look, write_template

SIZE = (60, 80)


def template_of(transform: ViewTransform = ViewTransform("srgb")) -> Template:  # noqa: B008 (frozen)
    """A red wall and a grey one, like a render of few samples, a little of it beyond white."""
    rng = np.random.default_rng(0)
    ramp = np.linspace(0.02, 0.9, SIZE[1])[None, :, None] * np.array([1, 0.8, 0.6])
    albedo = np.broadcast_to(np.float32([0.6, 0.06, 0.05]), (*SIZE, 3)).copy()
    albedo[:, 40:] = 0.7
    image = (2 * ramp * albedo * rng.gamma(8, 1 / 8, (*SIZE, 3))).astype(np.float32)
    return Template(image, transform, "room.xml", "abc", "camera", albedo)


def write(folder: Path, template: Template) -> Path:
    height, width = template.size
    write_template(
        folder,
        template,
        normals=np.zeros((height, width, 3)),
        depth=np.ones((height, width)),
        mattes={},
        lights={},
    )
    return folder


def brushed(display: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Display values under a soft brush, and its coverage (h, w)."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    coverage = np.clip((18 - np.hypot(x - 40, y - 30)) / 8, 0, 1)
    paint = np.array([0.9, 0.7, 0.3]) * (0.5 + 0.5 * display)
    return display + coverage[..., None] * (paint - display), coverage


def save(path: Path, display: np.ndarray, transform: ViewTransform) -> None:
    eight = np.round(display * 255).astype(np.uint8)
    if path.suffix == ".exr":
        light = transform.decode(display).astype(np.float16 if "half" in path.stem else np.float32)
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        OpenEXR.File(header, {"RGB": light}).write(str(path))
    elif "16" in path.stem:
        write_png_16(path, display)
    elif path.suffix == ".jpg":
        Image.fromarray(eight).save(path, quality=92)
    else:
        Image.fromarray(eight).save(path)


@pytest.mark.parametrize(
    "transform", [ViewTransform("srgb"), ViewTransform("srgb", -1.5), ViewTransform("agx", 0.5)]
)
@pytest.mark.parametrize("name", ["p16.png", "p8.png", "p8.tif", "p.jpg", "half.exr", "float.exr"])
def test_in_every_format_the_brush_is_found(
    tmp_path: Path, name: str, transform: ViewTransform
) -> None:
    template = template_of(transform)
    write(tmp_path, template)
    display, coverage = brushed(template.shown)
    save(tmp_path / name, display, transform)
    target = read_target(tmp_path / name)
    assert not target.everything
    assert "painted" in target.notes[0]
    # A JPEG is compared over 9 x 9 pixels, and so finds paint up to 4 pixels away.
    reach = 6 if name.endswith("jpg") else 1
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    away = np.hypot(x - 40, y - 30) > 18 + reach
    assert target.importance[away].max() < (0.05 if name.endswith("jpg") else 1e-6)
    assert target.importance[coverage > 0.6].min() > 0.9
    # A soft brush leaves soft importance, where it is not widened.
    edge = target.importance[(coverage > 0) & (coverage < 0.2)]
    assert edge.mean() > 0.02
    assert name.endswith("jpg") or edge.mean() < 0.98


def test_a_file_that_was_only_saved_again_is_no_painting(tmp_path: Path) -> None:
    template = template_of()
    write(tmp_path, template)
    for name in ("p16.png", "p8.png", "p8.tif", "p.jpg", "half.exr", "float.exr"):
        save(tmp_path / name, template.shown, template.transform)
        with pytest.raises(TargetError, match=r"nothing in .* differs from .*template\.(png|exr):"):
            read_target(tmp_path / name)
        assert read_target(tmp_path / name, find=False).everything


def test_mask_and_alpha_go_before(tmp_path: Path) -> None:
    template = template_of()
    write(tmp_path, template)
    display, _ = brushed(template.shown)
    save(tmp_path / "p8.png", display, template.transform)
    mask = np.zeros(SIZE, np.uint8)
    mask[:5] = 255
    Image.fromarray(mask).save(tmp_path / "mask.png")
    importance = read_target(tmp_path / "p8.png", mask=tmp_path / "mask.png").importance
    assert importance[:5].min() == 1
    assert importance[5:].max() == 0
    layer = np.dstack([np.round(display * 255).astype(np.uint8), mask])
    Image.fromarray(layer).save(tmp_path / "layer.png")
    np.testing.assert_array_equal(read_target(tmp_path / "layer.png").importance, importance)


def test_the_template_is_found_where_people_keep_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    template = template_of()
    display, _ = brushed(template.shown)
    for folder, painting in (("a/template", "a/p8.png"), ("template", "elsewhere/p8.png")):
        write(tmp_path / folder, template)
        (tmp_path / painting).parent.mkdir(exist_ok=True)
        save(tmp_path / painting, display, template.transform)
    monkeypatch.chdir(tmp_path)
    for painting in ("a/p8.png", "elsewhere/p8.png"):
        assert not read_target(painting).everything
    assert read_target("a/p8.png").content == "abc"
    assert read_target("a/p8.png").sensor == "camera"


def test_the_only_template_beside_a_painting_is_found_under_any_name(tmp_path: Path) -> None:
    """A second one leaves open which is meant, as the remark says."""
    template = template_of()
    save(tmp_path / "p8.png", brushed(template.shown)[0], template.transform)
    write(tmp_path / "monday", template)
    (tmp_path / "job").mkdir()
    (tmp_path / "job" / "template.json").write_text("{}")  # as jobs of render farms have it
    assert not read_target(tmp_path / "p8.png").everything
    write(tmp_path / "tuesday", template)
    target = read_target(tmp_path / "p8.png")
    assert target.everything
    assert "no template says what was painted (template=... names one)" in target.notes[0]


def test_of_another_size(tmp_path: Path) -> None:
    template = template_of()
    write(tmp_path / "template", template)
    Image.new("RGB", (31, 17), "red").save(tmp_path / "p.png")
    target = read_target(tmp_path / "p.png")
    assert target.everything
    assert "another size" in target.notes[0]
    assert "no template says what was painted" in target.notes[1]
    with pytest.raises(SizeError, match=r"31x17 but .*template\.png is 80x60"):
        read_target(tmp_path / "p.png", template=tmp_path / "template")
    alpha = np.full((17, 31, 4), 128, np.uint8)
    Image.fromarray(alpha).save(tmp_path / "layer.png")
    with pytest.raises(SizeError, match="31x17"):
        read_target(tmp_path / "layer.png", template=tmp_path / "template", paint="light")
    # A file in it stands for the folder.
    same_file = tmp_path / "same.png"
    save(same_file, brushed(template.shown)[0], template.transform)
    for name in ("template", "template/template.png", "template/template.json"):
        assert not read_target(same_file, template=tmp_path / name).everything


@pytest.mark.parametrize("name", ["p8.png", "half.exr"])
@pytest.mark.parametrize("has_template", [True, False])
@pytest.mark.parametrize(
    ("choice", "expected"),
    [
        (None, ViewTransform("agx", 0.5)),
        (TransformChoice(), ViewTransform("agx", 0.5)),
        (TransformChoice(stops=2.0), ViewTransform("agx", 2.0)),
        (TransformChoice(stops=0.0), ViewTransform("agx", 0.0)),
        (TransformChoice(name="filmic"), ViewTransform("filmic", 0.5)),
        (TransformChoice("linear", 1.0), ViewTransform("linear", 1.0)),
        (ViewTransform("linear", 1.0), ViewTransform("linear", 1.0)),
    ],
)
def test_what_is_left_open_of_a_view_is_the_templates(
    tmp_path: Path,
    choice: ViewTransform | TransformChoice | None,
    expected: ViewTransform,
    name: str,
    has_template: bool,
) -> None:
    write(tmp_path, template_of(ViewTransform("agx", 0.5)))
    display = np.random.default_rng(1).integers(0, 256, (*SIZE, 3)) / 255
    save(tmp_path / name, display, ViewTransform("agx", 0.5))
    target = read_target(
        tmp_path / name, transform=choice, template=tmp_path if has_template else None
    )
    assert target.transform == expected
    if name == "p8.png":
        np.testing.assert_allclose(target.image, expected.decode(display), rtol=1e-4, atol=1e-6)


def test_what_nobody_says_of_a_view_is_srgbs(tmp_path: Path) -> None:
    for name in ("p8.png", "half.exr"):
        save(tmp_path / name, np.full((4, 4, 3), 0.5), ViewTransform())
        for choice, expected in (
            (TransformChoice(stops=2.0), ViewTransform("srgb", 2.0)),
            (TransformChoice(name="agx"), ViewTransform("agx")),
            (TransformChoice(), ViewTransform() if name == "p8.png" else None),
        ):
            assert read_target(tmp_path / name, transform=choice).transform == expected


def test_what_no_view_has_cannot_be_asked() -> None:
    with pytest.raises(ViewError, match=r"^there is no view transform 'srgbb'"):
        TransformChoice(name="srgbb")
    with pytest.raises(ViewError, match="out of range"):
        TransformChoice(stops=1e9)


def test_a_template_of_another_size_says_nothing_of_the_view(tmp_path: Path) -> None:
    """It is not what was painted on: neither compared with nor decoded by."""
    write(tmp_path, template_of(ViewTransform("agx", 2.0)))
    save(tmp_path / "p8.png", np.full((8, 8, 3), 0.5), ViewTransform())
    for choice, transform in (
        (None, ViewTransform()),
        (TransformChoice(stops=1.0), ViewTransform("srgb", 1.0)),
    ):
        target = read_target(tmp_path / "p8.png", transform=choice)
        assert target.transform == transform
        np.testing.assert_allclose(target.image, transform.decode(np.float32(128 / 255)), rtol=1e-4)
        assert "another size" in target.notes[0]
    assert "no template says what was painted" in target.notes[1]
    # An EXR holds light: only --space display asks for a view.
    save(tmp_path / "half.exr", np.full((8, 8, 3), 0.5), ViewTransform())
    assert read_target(tmp_path / "half.exr").transform is None


def test_what_a_picture_says_of_its_view_goes_before_a_template_that_was_found(
    tmp_path: Path,
) -> None:
    """Painted on the look that a template of another view has replaced since."""
    old = ViewTransform("filmic", -1.0)
    write(tmp_path, template_of(ViewTransform("agx", 2.0)))
    light = np.full((*SIZE, 3), 0.2)
    write_look(tmp_path / "old.exr", light, old)
    target = read_target(tmp_path / "old.png")
    assert target.transform == old
    np.testing.assert_allclose(target.image, light, rtol=1e-3)
    assert read_target(
        tmp_path / "old.png", transform=TransformChoice("srgb")
    ).transform == ViewTransform("srgb", -1.0)
    # A template that is given is meant.
    assert read_target(tmp_path / "old.png", template=tmp_path).transform == ViewTransform(
        "agx", 2.0
    )


def test_what_a_cropped_exr_does_not_store_is_not_painted(tmp_path: Path) -> None:
    template = template_of()
    write(tmp_path, template)
    painted = template.image[10:40, 20:60].copy()
    painted[10:20, 10:20] += 0.3
    planes = {name: np.ascontiguousarray(painted[..., k]) for k, name in enumerate("RGB")}
    crop = ExrPart("", planes, offset=(10, 20), display=SIZE)
    write_parts(tmp_path / "crop.exr", [crop])
    target = read_target(tmp_path / "crop.exr")
    stored = np.zeros(SIZE, bool)
    stored[10:40, 20:60] = True
    assert target.importance[~stored].max() == 0
    brush = np.zeros(SIZE, bool)
    brush[20:30, 30:40] = True
    np.testing.assert_array_equal(target.importance[stored] > 0, brush[stored])
    share = f"{100 * brush.mean():.3g} % painted"
    assert target.notes[0].startswith(share)
    # And a crop that shows the template alone is not a painting.
    painted[:] = template.image[10:40, 20:60]
    write_parts(
        tmp_path / "crop.exr",
        [replace(crop, channels={n: painted[..., k].copy() for k, n in enumerate("RGB")})],
    )
    with pytest.raises(TargetError, match="nothing in"):
        read_target(tmp_path / "crop.exr")


def _room() -> Template:
    """Walls of several colours with light on them that falls off, and the noise of a render."""
    rng = np.random.default_rng(0)
    y, x = np.mgrid[:90, :120] / 90
    walls = np.array([(0.6, 0.1, 0.08), (0.7, 0.7, 0.7), (0.1, 0.5, 0.2), (0.3, 0.25, 0.2)])
    albedo = walls[(x > 0.6).astype(int) + 2 * (y > 0.45 + 0.2 * x)]
    light = 0.05 + 1.2 / (1 + 6 * np.hypot(x - 0.4, y - 0.3) ** 2)
    image = albedo * light[..., None] * rng.gamma(60, 1 / 60, (90, 120, 3))
    return Template(image.astype(np.float32), ViewTransform("srgb"))


P3 = np.array([(0.8225, 0.1774, 0), (0.0332, 0.9669, 0), (0.0171, 0.0724, 0.9108)])
SRGB = ViewTransform("srgb")
CONVERTED = {
    "darker": lambda shown, light: 0.8 * shown,
    "agx": lambda shown, light: ViewTransform("agx", 1.0).encode(light),
    "filmic": lambda shown, light: ViewTransform("filmic", 1.0).encode(light),
    "another gamma": lambda shown, light: shown ** (2.2 / 1.8),
    "linear": lambda shown, light: np.clip(light, 0, 1),
    "exposure": lambda shown, light: SRGB.encode(2 * light),
    "a profile": lambda shown, light: SRGB.encode(1.3 * light @ P3.T),
}


@pytest.mark.nightly
@pytest.mark.parametrize("style", CONVERTED)
@pytest.mark.parametrize("name", ["p8.png", "p.jpg", "half.exr"])
def test_a_conversion_of_all_of_it_is_doubted(tmp_path: Path, style: str, name: str) -> None:
    template = _room()
    write(tmp_path, template)
    save(tmp_path / name, np.clip(CONVERTED[style](template.shown, template.image), 0, 1), SRGB)
    [note] = read_target(tmp_path / name).notes
    assert "through another view or profile (transform=..., mask=...)" in note


def _repainted(style: str, display: np.ndarray) -> np.ndarray:
    y, x = np.mgrid[: display.shape[0], : display.shape[1]]
    if style == "light from the other side":
        return display * (0.2 + 0.6 * x / x.max())[..., None]
    if style == "a warm glaze on the left":
        return 0.1 + display * (1 - 0.9 * np.array([0.1, 0.4, 0.9]) * (1 - x / x.max())[..., None])
    waves = [0.5 + 0.4 * np.sin(x / 17 + k) * np.cos(y / 11 - k) for k in range(3)]
    free = np.stack(waves, axis=-1)
    return free if style == "freely" else 0.4 * display + 0.6 * free


@pytest.mark.parametrize(
    "style", ["light from the other side", "a warm glaze on the left", "freely", "translucently"]
)
@pytest.mark.parametrize("name", ["p8.png", "p.jpg", "half.exr"])
def test_a_repaint_of_all_of_it_is_not(tmp_path: Path, style: str, name: str) -> None:
    template = _room()
    write(tmp_path, template)
    save(tmp_path / name, np.clip(_repainted(style, template.shown), 0, 1), SRGB)
    [note] = read_target(tmp_path / name).notes
    compared = "template.exr" if name.endswith("exr") else "template.png"
    share, _, rest = note.partition(" % painted: ")
    assert float(share) > 97
    assert rest == f"what differs from {tmp_path / compared}"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda shown: shown[:, ::-1], "it is the template mirrored: turn it back"),
        (lambda shown: shown[::-1, ::-1], "it is the template upside down: turn it back"),
        (lambda shown: np.roll(shown, (4, -9), (0, 1)), "moved by -9 pixels to the right and 4 d"),
    ],
)
def test_a_template_that_was_moved_is_told(tmp_path: Path, change: object, words: str) -> None:
    template = _room()
    write(tmp_path, template)
    save(tmp_path / "p8.png", change(template.shown), SRGB)  # type: ignore[operator]
    assert words in read_target(tmp_path / "p8.png").notes[0]


def test_the_template_itself_is_no_painting(tmp_path: Path) -> None:
    write(tmp_path, template_of())
    for name in ("template.png", "template.exr"):
        with pytest.raises(TargetError, match=rf"{name} is the template itself: give the painting"):
            read_target(tmp_path / name)


def test_paint_as_light_is_multiplied_by_albedo(tmp_path: Path) -> None:
    template = template_of()
    assert template.albedo is not None
    write(tmp_path, template)
    painted = template.image.copy()
    painted[10:50, 30:50] = 0.1, 0.2, 0.8
    write_rgb(tmp_path / "p.exr", painted)
    target = read_target(tmp_path / "p.exr", paint="light")
    is_painted = target.importance > 0
    np.testing.assert_allclose(
        target.image[is_painted], painted[is_painted] * template.albedo[is_painted], rtol=1e-6
    )
    assert is_painted[12:48, 32:48].all()


def test_where_nothing_reflects_light_cannot_be_painted(tmp_path: Path) -> None:
    template = template_of()
    assert template.albedo is not None
    template.albedo[:, :40] = 0
    write(tmp_path, template)
    painted = template.image.copy()
    painted[10:50, 30:50] = 0.1, 0.2, 0.8
    write_rgb(tmp_path / "p.exr", painted)
    target = read_target(tmp_path / "p.exr", paint="light")
    assert target.importance[:, :40].max() == 0
    assert any("no surface that reflects" in note for note in target.notes)
    template.albedo[:] = 0
    write(tmp_path, template)
    with pytest.raises(TargetError, match="no painted pixel shows a surface"):
        read_target(tmp_path / "p.exr", paint="light")


def test_light_needs_a_template(tmp_path: Path) -> None:
    write_rgb(tmp_path / "p.exr", np.ones((4, 4, 3)))
    with pytest.raises(TargetError, match="as light needs its template"):
        read_target(tmp_path / "p.exr", paint="light")


def test_blue_paint_on_a_red_wall_is_remarked(tmp_path: Path) -> None:
    template = template_of()
    write(tmp_path, template)
    painted = template.image.copy()
    painted[10:50, 10:30] = 0.05, 0.1, 0.9
    write_rgb(tmp_path / "red.exr", painted)
    assert any("hardly reflect" in note for note in read_target(tmp_path / "red.exr").notes)
    painted = template.image.copy()
    painted[10:50, 50:70] = 0.05, 0.1, 0.9
    write_rgb(tmp_path / "grey.exr", painted)
    assert not any("hardly" in note for note in read_target(tmp_path / "grey.exr").notes)


def test_an_error_names_a_template_and_its_file_within_it(tmp_path: Path) -> None:
    folder = write(tmp_path / "template", template_of())
    for content in (b"no picture", None):
        (folder / "template.exr").unlink()
        if content is not None:
            (folder / "template.exr").write_bytes(content)
        with pytest.raises(TargetError) as refusal:
            read_template(folder)
        text = str(refusal.value)
        assert text.startswith(f"{folder} is not a template: ")
        assert "template.exr" in text
        assert str(folder / "template.exr") not in text


def test_what_is_no_template_is_refused(tmp_path: Path) -> None:
    template = template_of()
    write(tmp_path, template)
    write_rgb(tmp_path / "p.exr", np.ones((*SIZE, 3)))
    metadata_file = tmp_path / "template.json"
    good = metadata_file.read_text(encoding="utf-8")
    for bad, words in (
        ("{", "not a template"),
        ("[]", "not a template"),
        (good.replace("template 1", "template 9"), "format is 'lightpaint-template 1', not"),
        (good.replace('"srgb"', '"srgbb"'), "no view transform"),
        (good.replace('"stops": 0.0', '"stops": 1e99'), "out of range"),
        (good.replace('"sensor": "camera"', '"sensor": 7'), "sensor is a text"),
    ):
        metadata_file.write_text(bad, encoding="utf-8")
        with pytest.raises(TargetError, match=words):
            read_target(tmp_path / "p.exr")
    metadata_file.write_text(good, encoding="utf-8")
    (tmp_path / "template.exr").unlink()
    with pytest.raises(TargetError, match=r"template\.exr"):
        read_target(tmp_path / "p.exr")


def test_png_holds_what_the_view_shows(tmp_path: Path) -> None:
    template = template_of()
    write(tmp_path, template)
    target = read_target(tmp_path / "template.png", find=False)
    display = np.clip(template.image, 0, 1)
    # Half a code of 16 bits, in light.
    np.testing.assert_allclose(target.image, display, atol=2e-5)
    np.testing.assert_allclose(decode_display(template.shown), display, atol=2e-5)
