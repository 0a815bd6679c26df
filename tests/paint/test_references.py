"""*Look like this* asks for the light of a reference, softly, in one step."""

import io
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import OpenImageIO
import pytest
from PIL import Image, ImageCms

import lightpaint as lp
from lightpaint.basis.lights import Lights
from lightpaint.colour.color import kelvin_to_rgb, luminance
from lightpaint.errors import ImageError, PaintError
from lightpaint.paint import protocol
from lightpaint.paint.protocol import LookLike, PlacePair
from lightpaint.paint.references.reference_light import (
    LampLight,
    contrast_of_light,
    match_light,
)
from lightpaint.paint.references.reference_table import (
    MAX_REFERENCES,
    MAX_SIDE,
    ReferenceTable,
    read_reference,
)
from lightpaint.paint.references.tones import LightTones
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.store.history_steps import Identity
from lightpaint.paint.store.session_file import MemoryStore, Store
from lightpaint.pipeline.job.settings import Settings
from lightpaint.target.painted_pixels import compressed_like

H, W = 36, 64

AREAS = ("whole", "regions", "parts", "pairs")

#: Pairs of places that the two pictures have at the same place.
PAIRS = (PlacePair((0.2, 0.2), (0.2, 0.2)), PlacePair((0.7, 0.6), (0.7, 0.6)))

#: Number of EXIF's orientation.
ORIENTATION = 0x112

TRANSFORM = lp.ViewTransform()


def room(make_basis: Any) -> lp.Basis:
    """A wall of a pattern that two lights reach, each from a side."""
    y, x = np.mgrid[:H, :W] / W
    pattern = 0.6 + 0.3 * np.sin(40 * x) * np.cos(30 * y)
    light = (0.1 + np.exp(-(x**2) / 0.2) * (1.2 - y))[..., None] * np.array([1, 0.8, 0.6])
    first = 0.5 * pattern[..., None] * light
    basis: lp.Basis = make_basis(
        images=np.array([first, 0.7 * first[:, ::-1]]), emission=[[0.7] * 3, [0.4] * 3]
    )
    return basis


def session_in(basis: lp.Basis, store: Store | None = None) -> Session:
    store = store or MemoryStore(Identity.of([basis]))
    look = basis.current_look
    return Session([basis], [look], store, settings=Settings(), transform=TRANSFORM)


def as_shown(light: np.ndarray) -> np.ndarray:
    return np.round(255 * TRANSFORM.encode(light)).astype(np.uint8)


def ask(session: Session, light: np.ndarray, areas: str = "regions", **options: Any) -> None:
    """Ask for the light of a picture."""
    number = session.references.add("evening", as_shown(light)).id
    request: Any = {"areas": areas, **options}
    if areas == "pairs":
        request = {"pairs": PAIRS, **request}
    session.handle(LookLike(number, **request), {})


def stops(session: Session) -> np.ndarray:
    """Return the change that the painting asks for at each pixel, (h, w), in stops of luminance."""
    view = session.views[0]
    return np.asarray(np.log2(luminance(view.image) / luminance(view.current)))


@pytest.fixture
def session(make_basis: Any) -> Session:
    return session_in(room(make_basis))


@pytest.mark.parametrize("name", ["cut.webp", "cut.jpg"])
def test_an_exif_block_that_is_cut_off_is_no_warning(tmp_path: Path, name: str) -> None:
    orientation = b"\x12\x01\x03\x00\xff\x00\x00\x00\x01\x00\x00\x00"  # of 255 values that lack
    exif = b"Exif\0\0II*\0\x08\0\0\0\x05\0" + orientation
    grey = np.full((16, 16, 3), 128, np.uint8)
    Image.fromarray(grey).save(tmp_path / name, exif=exif)
    assert read_reference(tmp_path / name, TRANSFORM).shape == grey.shape
    if name.endswith("jpg"):
        again = compressed_like(tmp_path / name, grey.astype(np.float32) / 255)
        np.testing.assert_allclose(again, grey / 255, atol=1.5 / 255)


@pytest.mark.parametrize("areas", AREAS)
@pytest.mark.parametrize("gain", [1.0, 1.5, 0.5])
def test_the_picture_itself_asks_for_nothing_at_any_exposure(
    session: Session, areas: str, gain: float
) -> None:
    with pytest.raises(PaintError, match="Like evening: the picture has that light already"):
        ask(session, gain * session.views[0].current, areas)
    assert not session.store.steps
    assert not session.is_painted


@pytest.mark.parametrize("areas", AREAS)
def test_a_brighter_reference_makes_brighter_if_that_is_wanted(
    session: Session, areas: str
) -> None:
    ask(session, 1.5 * session.views[0].current, areas, matches_brightness=True)
    asked = stops(session)
    covered = session.views[0].importance > 0.9
    np.testing.assert_allclose(asked[covered].mean(), np.log2(1.5), atol=0.12)


def test_a_brighter_ceiling_raises_the_top_against_the_rest(session: Session) -> None:
    light = session.views[0].current.copy()
    light[: H // 4] *= 2
    ask(session, light, "regions")
    asked = stops(session)
    assert asked[: H // 5].mean() - asked[H // 2 :].mean() > 0.5


@pytest.mark.parametrize("areas", ["parts", "pairs"])
def test_a_brighter_left_half_raises_the_left(session: Session, areas: str) -> None:
    light = session.views[0].current.copy()
    light[:, : W // 2] *= 2
    ask(session, light, areas)
    asked, counts = stops(session), session.views[0].importance
    left, right = ((asked * counts)[:, half].mean() for half in (np.s_[: W // 3], np.s_[-W // 3 :]))
    assert left - right > 0.15


@pytest.mark.parametrize("areas", AREAS)
def test_warm_light_is_asked_for_as_warm_light(session: Session, areas: str) -> None:
    ask(session, session.views[0].current * np.array([1.2, 1.0, 0.6]), areas)
    view = session.views[0]
    covered = view.importance > 0.9
    ratio = (view.image / view.current)[covered].mean(axis=0)
    assert ratio[0] / ratio[2] == pytest.approx(2, rel=0.2)
    assert abs(stops(session)[covered].mean()) < 0.15


def test_light_is_soft_and_no_pattern_of_a_reference_comes_through(session: Session) -> None:
    rng = np.random.default_rng(0)
    light = session.views[0].current * rng.uniform(0.5, 1.5, (H, W, 1))
    light[:, W // 2 :] *= 0.4
    ask(session, light, "parts")
    asked = stops(session)
    assert np.ptp(asked) > 0.5
    assert np.abs(np.diff(asked, axis=1)).max() < 0.15


def test_parts_of_another_scene_do_not_make_the_whole_brighter(session: Session) -> None:
    """A bright figure before a dark stage: its parts are far above the mean of the picture."""
    y, x = np.mgrid[:H, :W]
    spot = np.exp(-(((y / H - 0.6) / 0.15) ** 2 + ((x / W - 0.5) / 0.12) ** 2))
    light = (0.002 + spot)[..., None] * np.ones(3)
    ask(session, light, "parts")
    asked = stops(session)
    assert np.ptp(asked) > 2
    assert abs(asked.mean()) < 0.3


def test_a_mirrored_reference_of_the_same_tones_asks_the_whole_for_nothing(
    session: Session,
) -> None:
    with pytest.raises(PaintError, match="that light already"):
        ask(session, session.views[0].current[:, ::-1], "whole")


def test_it_is_a_group_of_layers_and_one_step_that_undo_takes_back(session: Session) -> None:
    light = session.views[0].current.copy()
    light[: H // 3] *= 2
    ask(session, light)
    group = session.views.layers.layers[-1]
    assert (group.kind, group.name) == ("group", "Like evening")
    assert [step.label for step in session.store.steps] == ["Like evening"]
    asked = session.views[0].image.copy()
    session.handle(protocol.ChangeLayers(layers=(replace(group, strength=0.5),)), {})
    assert 0.2 < np.ptp(stops(session)) < 0.9 * np.ptp(np.log2(luminance(asked)))
    session.handle(protocol.Undo(), {})
    np.testing.assert_array_equal(session.views[0].image, asked)
    session.handle(protocol.Undo(), {})
    assert not session.is_painted
    session.handle(protocol.Redo(), {})
    np.testing.assert_array_equal(session.views[0].image, asked)


def test_asked_again_there_is_hardly_more_to_ask_for(session: Session) -> None:
    light = session.views[0].current.copy()
    light[: H // 3] *= 2
    ask(session, light)
    first = stops(session)
    try:
        session.handle(LookLike(1), {})
    except PaintError:
        return
    assert np.abs(stops(session) - first).max() < 0.3 * np.abs(first).max()


def test_it_keeps_to_what_is_selected(session: Session) -> None:
    session.handle(protocol.Select((0, H, 0, 10)), {"mask": np.full((H, 10), 255, np.uint8)})
    ask(session, session.views[0].current * np.array([1.3, 1, 0.5]))
    assert session.views[0].importance[:, :10].all()
    assert not session.views[0].importance[:, 10:].any()


def test_layers_and_references_are_there_again_and_the_painting_is_exported(
    make_basis: Any, tmp_path: Path
) -> None:
    basis, path = room(make_basis), tmp_path / "session.db"
    with Store.open(path, Identity.of([basis])) as store:
        session = session_in(basis, store)
        light = np.asarray(session.views[0].current.copy())
        light[: H // 3] *= 2
        ask(session, light)
        session.references.drop(session.references.add("other", as_shown(light)).id)
        asked = session.views[0].image.copy()
    with Store.open(path, Identity.of([basis])) as store:
        session = session_in(basis, store)
        np.testing.assert_array_equal(session.views[0].image, asked)
        [reference] = session.references
        assert reference.name == "evening"
        np.testing.assert_array_equal(reference.pixels, as_shown(light))
        target = session.target()
        assert target is not None
        np.testing.assert_array_equal(target.image, asked)
        session.references.drop(reference.id)
    with Store.open(path, Identity.of([basis])) as store:
        assert list(session_in(basis, store).references) == []


def test_references_of_a_damaged_file_are_recovered(make_basis: Any, tmp_path: Path) -> None:
    basis, path = room(make_basis), tmp_path / "session.db"
    with Store.open(path, Identity.of([basis])) as store:
        session = session_in(basis, store)
        ask(session, session.views[0].current * np.array([1.3, 1, 0.5]))
        store.recover()
        assert [x.name for x in ReferenceTable(store, TRANSFORM)] == ["evening"]


def test_a_file_without_references_has_no_table_of_them(make_basis: Any, tmp_path: Path) -> None:
    basis, path = room(make_basis), tmp_path / "session.db"
    with Store.open(path, Identity.of([basis])) as store:
        references = ReferenceTable(store, TRANSFORM)
        assert list(references) == []
        assert store.rows("SELECT name FROM sqlite_schema WHERE name = 'reference'") == []
        references.add("new", np.full((2, 3, 3), 9, np.uint8))
        assert len(list(ReferenceTable(store, TRANSFORM))) == 1


def test_what_cannot_be_asked_for_is_refused_and_nothing_changes(session: Session) -> None:
    with pytest.raises(PaintError, match="there is no reference 7"):
        session.handle(LookLike(7), {})
    with pytest.raises(PaintError, match="no places to compare"):
        ask(session, session.views[0].current, "pairs", pairs=())
    with pytest.raises(PaintError, match="no view 3"):
        session.handle(LookLike(1, view=3), {})
    with pytest.raises(ValueError, match="0 to 1"):
        LookLike(1, pairs=(PlacePair((0, 2), (0, 0)),))
    assert not session.store.steps
    for _ in range(MAX_REFERENCES - 1):
        session.references.add("x", np.zeros((1, 1, 3), np.uint8))
    with pytest.raises(PaintError, match=f"^{MAX_REFERENCES} references are kept: remove one"):
        session.references.add("x", np.zeros((1, 1, 3), np.uint8))


@pytest.mark.parametrize("areas", ["regions", "pairs"])
def test_regions_are_of_all_views_and_places_of_one(make_basis: Any, areas: str) -> None:
    bases = [room(make_basis), room(make_basis)]
    looks = [basis.current_look for basis in bases]
    store = MemoryStore(Identity.of(bases))
    session = Session(bases, looks, store, settings=Settings(), transform=TRANSFORM)
    ask(session, looks[1] * np.array([1.3, 1, 0.5]), areas, view=1)
    first, second = (view.importance.any() for view in session.views)
    assert (first, second) == (areas == "regions", True)


def lit_room(make_basis: Any) -> lp.Basis:
    """A wall under an even sky, with a patch of sun at its left and one of a spot at its right."""
    x = np.mgrid[:H, :W][1] / W
    lamps = {
        "sky": ("constant", 0.5 * np.ones((H, W))),
        "sun": ("directional", np.where(x < 0.25, 0.5, 0.005)),
        "spot": ("spot", np.where(np.abs(x - 0.85) < 0.1, 0.4, 0.004)),
    }
    images = [light[..., None] * np.ones(3) for _, light in lamps.values()]
    basis: lp.Basis = make_basis(
        images=np.array(images), names=list(lamps), emission=[[0.3] * 3] * 3
    )
    lights = [
        replace(light, plugin=plugin)
        for light, (plugin, _) in zip(basis.lights, lamps.values(), strict=True)
    ]
    return replace(basis, lights=Lights.of(lights))


def other_place(left: list[float], right: list[float]) -> np.ndarray:
    """Return a picture of another place: a pattern, with other light at the left than the right."""
    y, x = np.mgrid[:H, :W]
    pattern = 0.8 + 0.2 * ((x // 3 + y // 5) % 2)
    return np.where((x < 0.5 * W)[..., None], left, right) * pattern[..., None]


def test_a_golden_hour_gives_the_sun_warm_light_and_dims_the_rest(make_basis: Any) -> None:
    session = session_in(lit_room(make_basis))
    ask(session, other_place([0.9, 0.55, 0.2], [0.06, 0.065, 0.08]))
    view = session.views[0]
    ratio = view.image / view.current
    warmth = np.log2(ratio[..., 0] / ratio[..., 2])
    assert warmth[:, :12].mean() > 1
    assert -1.2 < warmth[:, 24:40].mean() < 0
    asked = stops(session)
    assert asked[:, 24:40].mean() < -1.2
    assert asked[:, :12].mean() - asked[:, 24:40].mean() > 1.5
    assert asked[:, -12:-8].mean() < -0.8
    names = [layer.name for layer in session.views.layers.layers]
    assert names[1:3] == ["Fill light", "Key light"]


def test_light_of_two_colours_comes_from_lamps_at_both_sides(make_basis: Any) -> None:
    session = session_in(lit_room(make_basis))
    ask(session, other_place([0.8, 0.05, 0.5], [0.05, 0.4, 0.8]), "whole")
    view = session.views[0]
    ratio = np.log2(view.image / view.current)
    left, right = ratio[:, :12].mean(axis=(0, 1)), ratio[:, -12:-8].mean(axis=(0, 1))
    assert left[0] - left[1] > right[0] - right[1] + 1


def light_of(levels: list[float], lit: list[float], shadows: list[float]) -> LightTones:
    sides = np.array(lit), np.array(lit)
    return LightTones(np.array(levels), np.array(lit), np.array(shadows), sides, 0.5)


def white_lamps() -> tuple[LampLight, LampLight]:
    return LampLight(0.3, np.zeros(3)), LampLight(0.9, np.zeros(3))


def test_key_and_fill_get_the_contrast_of_the_reference_and_lit_parts_stay() -> None:
    reference = light_of([-4, -3, -1, -0.2, 0, 0], [0.8, -0.2, -1.5], [0.2, 0, -0.6])
    picture = light_of([-3, -2.5, -2, -1, 0, 0.2], [0, 0, 0], [0, 0, 0])
    match = match_light(reference, picture, *white_lamps())
    key, fill = 0.3 * 2**match.key_stops, 0.9 * 2**match.fill_stops
    np.testing.assert_allclose(key + fill, 0.3 + 0.9)
    np.testing.assert_allclose(np.log2((key + fill) / fill), contrast_of_light(reference))
    warmth = match.key_tints[0][0] - match.key_tints[0][2]
    assert warmth == pytest.approx(2.3, abs=0.05)


def test_a_change_of_white_has_no_green_in_it() -> None:
    reference = light_of([-3, -2.5, -2, -1, 0, 0.2], [-0.3, 0.12, 0.35], [-0.3, 0.12, 0.35])
    picture = light_of([-3, -2.5, -2, -1, 0, 0.2], [0, 0, 0], [0, 0, 0])
    [tint] = match_light(reference, picture, *white_lamps()).key_tints
    kelvin = 1e6 / np.arange(60, 200)
    whites = np.log2([kelvin_to_rgb(x) / kelvin_to_rgb(5300) for x in kelvin])
    assert np.abs(whites - tint).max(axis=1).min() < 0.02


def picture(size: tuple[int, int] = (24, 40)) -> np.ndarray:
    y, x = np.mgrid[: size[0], : size[1]]
    return np.dstack([5 * x, 6 * y, np.full(size, 90)]).clip(0, 255).astype(np.uint8)


@pytest.mark.parametrize("kind", ["png", "jpeg", "webp", "tiff"])
def test_pictures_of_display_values_are_kept_as_they_are(tmp_path: Path, kind: str) -> None:
    options = {"lossless": True} if kind == "webp" else {"quality": 98, "subsampling": 0}
    Image.fromarray(picture()).save(tmp_path / "file", format=kind, **options)
    read = read_reference(tmp_path / "file", TRANSFORM)
    assert read.dtype == np.uint8
    np.testing.assert_allclose(read.astype(int), picture(), atol=6 if kind == "jpeg" else 1)


def test_a_turned_and_transparent_webp_is_read_as_a_png_is(tmp_path: Path) -> None:
    turned = Image.Exif()
    turned[ORIENTATION] = 6
    alpha = np.linspace(0, 255, picture().shape[1]).astype(np.uint8)
    pixels = np.dstack([picture(), np.broadcast_to(alpha, picture().shape[:2])])
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    for kind, options in (("png", {}), ("webp", {"lossless": True, "exact": True})):
        Image.fromarray(pixels).save(
            tmp_path / kind, format=kind, exif=turned, icc_profile=profile, **options
        )
    png, webp = (read_reference(tmp_path / kind, TRANSFORM) for kind in ("png", "webp"))
    assert webp.shape == (40, 24, 3)
    np.testing.assert_array_equal(webp, png)


def test_a_large_picture_is_reduced(tmp_path: Path) -> None:
    Image.fromarray(picture((900, 3000))).save(tmp_path / "file", format="png")
    assert read_reference(tmp_path / "file", TRANSFORM).shape == (384, MAX_SIDE, 3)


@pytest.mark.parametrize("kind", ["exr", "hdr"])
def test_pictures_of_light_are_exposed_and_kept_beyond_white(tmp_path: Path, kind: str) -> None:
    light = 400 * (0.01 + picture() / np.float32(255)).astype(np.float32)
    path = tmp_path / f"sun.{kind}"
    if kind == "exr":
        OpenEXR.File({}, {"RGB": light}).write(str(path))
    else:
        file = OpenImageIO.ImageOutput.create(str(path))
        file.open(str(path), OpenImageIO.ImageSpec(40, 24, 3, "float"))
        file.write_image(light)
        file.close()
    read = read_reference(path, lp.ViewTransform("agx", 2.0)).astype(np.float32)
    ratio = read / light
    # Radiance's three numbers share an exponent.
    brightest = np.median(ratio) * light.max(axis=-1, keepdims=True)
    assert (np.abs(read - np.median(ratio) * light) <= 0.01 * brightest).all()
    assert 0.02 < np.median(read) < 2
    store = MemoryStore(None)
    references = ReferenceTable(store, lp.ViewTransform("agx", 2.0))
    reference = references.add("sun", read.astype(np.float16))
    np.testing.assert_allclose(references.light(reference), read / 4, rtol=1e-3)
    assert references.picture(reference).dtype == np.uint8


def _cut(kind: str, **options: Any) -> bytes:
    file = io.BytesIO()
    Image.fromarray(picture()).save(file, format=kind, **options)
    return file.getvalue()[: len(file.getvalue()) // 2]


HOSTILE: dict[str, Callable[[], bytes]] = {
    "empty": lambda: b"",
    "text": lambda: b"a picture of the evening\n" * 9,
    "cut png": lambda: _cut("png"),
    "cut jpeg": lambda: _cut("jpeg"),
    "cut webp": lambda: _cut("webp"),
    "webp of nothing": lambda: b"RIFF\x10\0\0\0WEBPVP8 \xff\xff\xff\xff" + bytes(30),
    "webp of a damaged profile": lambda: _whole(picture(), "webp", icc_profile=b"no profile" * 20),
    "riff of sound": lambda: b"RIFF\x10\0\0\0WAVEfmt " + bytes(30),
    "radiance without end": lambda: b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 9 +X 9\n",
    "radiance of millions": lambda: (
        b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 99999999 +X 99999999\n" + bytes(99)
    ),
    "exr of nothing": lambda: b"\x76\x2f\x31\x01" + bytes(60),
    "black": lambda: _whole(np.zeros((4, 4, 3), np.uint8)),
}


def _whole(pixels: np.ndarray, kind: str = "png", **options: Any) -> bytes:
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, format=kind, **options)
    return file.getvalue()


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_file_ends_in_one_line_that_names_it(tmp_path: Path, name: str) -> None:
    path = tmp_path / "reference"
    path.write_bytes(HOSTILE[name]())
    with pytest.raises(ImageError) as caught:
        read_reference(path, TRANSFORM)
    text = str(caught.value)
    assert str(path) in text
    assert "\n" not in text
    assert len(text) < 300 + len(str(path))
