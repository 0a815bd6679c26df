"""Files of layers hold what the painter shows, and come back as layers."""

import io
import json
import time
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from damaged_files import Case, damage, outcomes, read_despite_cut, wrong_outcomes
from displays import FREE_DISPLAY
from layered_sessions import SIZES, RandomEditor, bases_of, identity_of, open_session
from nightly import FIFTHS, fifth_of, seeds
from paint_programs import needs, run
from patience import PATIENCE_S
from picture_files import png
from PIL import Image

import lightpaint as lp
from lightpaint.errors import ImageError, PaintError
from lightpaint.images import formats
from lightpaint.images.formats import openraster
from lightpaint.images.formats.exr import ExrPart, read_parts, write_parts
from lightpaint.images.formats.openraster import (
    DIGEST,
    NOTE,
    RasterGroup,
    RasterLayer,
    opened_openraster,
    write_openraster,
)
from lightpaint.paint import protocol
from lightpaint.paint.layers import layer_files
from lightpaint.paint.layers.canvas import ViewLayers
from lightpaint.paint.layers.canvases import LayeredPaintings
from lightpaint.paint.layers.composition import ShownLayer, compose, compose_layer, with_effect
from lightpaint.paint.layers.layer_files import (
    FORMAT,
    KEY,
    LOOK_NAME,
    read_layers,
    write_layers_exr,
    write_layers_openraster,
)
from lightpaint.paint.layers.layer_pixels import LayerPixels
from lightpaint.paint.layers.layer_stack import Gradient, Layer, LayerStack
from lightpaint.paint.protocol import Message
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.store.history_steps import Pixels
from lightpaint.paint.store.session_file import MemoryStore
from lightpaint.paint.studio.file_imports import begin_with_layers
from lightpaint.paint.studio.session_studio import Studio
from lightpaint.paint.subject import Subject
from lightpaint.paint.subject_factory import make_subjects

SIZE = SIZES[0]
KRITA_SCRIPTS = Path(__file__).parents[1] / "target" / "programs"
WHOLE = (0, SIZE[0], 0, SIZE[1])
TRANSFORM = lp.ViewTransform("srgb", -2.0)
CURRENT = np.random.default_rng(1).uniform(0.1, 2, (*SIZE, 3)).astype(np.float32)


def worked_on(seed: int, count: int = 20) -> Session:
    editor = RandomEditor(seed, views=1)
    for _ in range(count):
        editor.act()
    return editor.session


def view_layers(session: Session) -> ViewLayers:
    return ViewLayers.of(session.views[0], session.views.layers)


def loaded(layered: LayeredPaintings) -> Session:
    session = open_session(MemoryStore(identity_of(1)), 1)
    session.load({}, session.requests, "layers", layers=layered)
    return session


def without_ids(session: Session) -> list[dict[str, Any]]:
    """The layers of a session, whose ids are new after loading."""
    layers = session.views.layers
    names = {layer.id: layer.name for layer in layers}
    return [
        {**layer.as_json(), "id": 0, "group": layer.group and names[layer.group]}
        for layer in layers
    ]


def put_on(layer: LayerPixels, pixels: Pixels) -> LayerPixels:
    height, width = layer.size
    layer.put((0, height, 0, width), pixels)
    return layer


def layered(*layers: tuple[Layer, Any, Any], group: Layer | None = None) -> ViewLayers:
    """Layers with a colour and a coverage, and a group without."""
    pixels = {}
    for layer, colour, coverage in layers:
        image = np.broadcast_to(np.asarray(colour, np.float32), (*SIZE, 3)).astype(np.float32)
        mask = np.broadcast_to(np.float32(coverage), SIZE).astype(np.float32)
        pixels[layer.id] = put_on(LayerPixels(SIZE), Pixels(image, mask))
    groups = [] if group is None else [group]
    return ViewLayers(LayerStack.of([*(x for x, *_ in layers), *groups]), pixels, CURRENT)


def shown(items: Any) -> np.ndarray:
    """Return the layers composited in order, as a paint program shows them, in display values."""
    picture = np.zeros((*SIZE, 3))
    for item in items:
        inner = item.layers if isinstance(item, RasterGroup) else [item]
        for layer in inner if item.is_visible else ():
            if layer.is_visible:
                (y, x), (h, w) = layer.corner, layer.display.shape[:2]
                alpha = layer.display[..., 3:] * layer.opacity
                below = picture[y : y + h, x : x + w]
                picture[y : y + h, x : x + w] = below + alpha * (layer.display[..., :3] - below)
    return picture


@pytest.mark.parametrize("seed", seeds(2, 6))
def test_layers_come_back_from_an_exr_as_they_were(tmp_path: Path, seed: int) -> None:
    session = worked_on(seed)
    path = tmp_path / "layers.exr"
    write_layers_exr(path, view_layers(session), "eye")
    again = loaded(read_layers(path, SIZE, session.transform))
    assert without_ids(again) == without_ids(session)
    view, other = session.views[0], again.views[0]
    # Colour is multiplied by alpha in the file and divided again: two roundings of float32.
    np.testing.assert_allclose(other.image, view.image, rtol=1e-5, atol=1e-7)
    np.testing.assert_array_equal(other.importance, view.importance)


def test_an_exr_shows_each_layer_multiplied_by_alpha_in_its_order(tmp_path: Path) -> None:
    path = tmp_path / "layers.exr"
    group = Layer(3, "group", "Night")
    view = layered(
        (Layer(1, "paint", "Lamp, +1.2 stops"), (2.0, 1.0, 0.5), 0.5),
        (Layer(2, "adjust", "Darker", gain=0.25, group=3), 0.0, 1.0),
        group=group,
    )
    write_layers_exr(path, view, "eye")
    channels = read_parts(path)[0].channels
    names = list(dict.fromkeys(name.rpartition(".")[0] for name in sorted(channels)))
    assert names == ["02 Night/Darker", "03 Lamp, +1,2 stops", "05 Unpainted"]
    np.testing.assert_array_equal(channels["03 Lamp, +1,2 stops.R"], 1.0)
    np.testing.assert_array_equal(channels["03 Lamp, +1,2 stops.A"], 0.5)
    np.testing.assert_array_equal(channels["05 Unpainted.G"], CURRENT[..., 1])
    below = CURRENT[..., 0] + 0.5 * (2 - CURRENT[..., 0])
    # Luminance is computed in float32.
    np.testing.assert_allclose(channels["02 Night/Darker.R"], 0.25 * below, rtol=1e-5)


@pytest.mark.parametrize("seed", seeds(2, 4))
def test_an_openraster_file_shows_the_target(tmp_path: Path, seed: int) -> None:
    """Where layers cover fully: programs mix display values, and the painter mixes light."""
    rng = np.random.default_rng(seed)
    edge = int(rng.integers(5, 60))
    mask = (np.arange(SIZE[1]) < edge) * np.ones(SIZE)
    view = layered(
        (Layer(1, "paint"), (0.5, 0.4, 0.3), mask),
        (Layer(2, "adjust", gain=2.0, tint=(1.1, 1.0, 0.9), strength=1.5), 0.0, mask[:, ::-1]),
        (Layer(3, "weigh", times=3.0), 0.0, 1.0),
        (Layer(4, "pixels", is_visible=False), 3.0, 1.0),
        (Layer(5, "pixels", strength=1.5), 0.7, mask),
    )
    below = Pixels.unpainted(CURRENT)
    for layer in view.layers.shown():
        if layer.id in view.pixels:
            below = compose_layer(layer, view.pixels[layer.id].part(WHOLE), below)
    path = tmp_path / "layers.ora"
    write_layers_openraster(path, view, below.image, TRANSFORM)
    with opened_openraster(path) as (size, layers):
        items = list(layers)
    assert size == SIZE
    assert len(items) == 5  # importance has no look
    np.testing.assert_allclose(shown(items), TRANSFORM.encode(below.image), atol=2e-5)  # 16 bits
    assert lp.read_target(path).transform == TRANSFORM


def test_an_openraster_file_is_as_the_format_prescribes(tmp_path: Path) -> None:
    path = tmp_path / "layers.ora"
    group = Layer(3, "group", "Night", is_visible=False)
    view = layered(
        (Layer(1, "paint", 'Lamp "<&>"', strength=0.25), (2.0, 1.0, 0.5), 0.5),
        (Layer(2, "adjust", "Darker", gain=0.25, group=3), 0.0, 1.0),
        group=group,
    )
    write_layers_openraster(path, view, CURRENT, TRANSFORM)
    assert path.read_bytes()[30:54] == b"mimetypeimage/openraster"
    with zipfile.ZipFile(path) as archive:
        assert archive.infolist()[0].compress_type == zipfile.ZIP_STORED
        root = ElementTree.fromstring(archive.read("stack.xml"))
        assert (root.get("w"), root.get("h")) == (str(SIZE[1]), str(SIZE[0]))
        with archive.open("Thumbnails/thumbnail.png") as file:
            assert max(Image.open(file).size) <= 256
        with archive.open("mergedimage.png") as file:
            assert Image.open(file).size == (SIZE[1], SIZE[0])
        [stack] = root
        top, *others = stack
        assert (top.tag, top.get("name"), top.get("visibility")) == ("stack", "Night", "hidden")
        assert [x.get("name") for x in top] == ["Darker"]
        lamp, look = others
        assert (lamp.get("name"), lamp.get("opacity")) == ('Lamp "<&>"', "0.25")
        assert look.get("name") == LOOK_NAME
        assert all(x.get("src") in archive.namelist() for x in (top[0], lamp, look))


def test_an_openraster_file_comes_back_as_layers_of_paint(tmp_path: Path) -> None:
    path = tmp_path / "layers.ora"
    view = layered(
        (Layer(1, "paint", "Lamp", strength=0.25), (2.0, 1.0, 0.5), 0.5),
        (Layer(2, "pixels", "Strokes", is_visible=False, group=3), (0.5, 0.5, 1.0), 1.0),
        group=Layer(3, "group", "Night", is_visible=False),
    )
    write_layers_openraster(path, view, CURRENT, TRANSFORM)
    again = read_layers(path, SIZE, TRANSFORM)
    layers = {layer.name: layer for layer in again.layers}
    assert set(layers) == {"Painting", "Lamp", "Night", "Strokes"}
    lamp, strokes, night = layers["Lamp"], layers["Strokes"], layers["Night"]
    assert (lamp.kind, lamp.strength, lamp.is_visible) == ("paint", 0.25, True)
    assert (strokes.kind, strokes.group, strokes.is_visible) == ("paint", night.id, False)
    assert (night.kind, night.is_visible) == ("group", False)
    _, pixels = again.pixels[0, lamp.id]
    # White is at 4; 16 bits of a display value, whose light has 2.4 times its relative error.
    np.testing.assert_allclose(pixels.image[0, 0], (2.0, 1.0, 0.5), rtol=2e-4)
    np.testing.assert_allclose(pixels.importance, 0.5, atol=1e-5)


def test_an_openraster_file_brings_adjustments_back(tmp_path: Path) -> None:
    """On their own, in a group that doubles their stops, and as a gradient."""
    half = (np.arange(SIZE[1]) < 35) * np.ones(SIZE)
    gradient = Gradient("linear", (0.0, 6.0), (70.0, 6.0))
    view = layered(
        (Layer(1, "paint", "Lamp"), (0.4, 0.2, 0.1), half),
        (Layer(2, "adjust", "Darker", gain=0.25, strength=0.5, importance=3), 0.0, 0.5 * half),
        (Layer(4, "adjust", "Warm", tint=(1.2, 1.0, 0.8), group=3), 0.0, half[:, ::-1]),
        (Layer(5, "gradient", "Left", gain=2.0, gradient=gradient), 0.0, 1.0),
        group=Layer(3, "group", "Night", strength=2.0, importance=2.0),
    )
    path = tmp_path / "layers.ora"
    write_layers_openraster(path, view, CURRENT, TRANSFORM)
    again = read_layers(path, SIZE, TRANSFORM)
    layers = {layer.name: layer for layer in again.layers}
    kinds = {name: layer.kind for name, layer in layers.items() if name != "Painting"}
    adjustments = dict.fromkeys(("Darker", "Warm", "Left"), "adjust")
    assert kinds == {"Lamp": "paint", "Night": "group", **adjustments}
    darker, warm = layers["Darker"], layers["Warm"]
    assert (darker.gain, darker.strength, darker.importance) == (0.25, 0.5, 3)
    assert (warm.tint, warm.strength, warm.importance) == ((1.2, 1.0, 0.8), 2, 2)
    assert warm.group == layers["Night"].id
    pixels = {number: LayerPixels(SIZE) for number in again.layers.ids}
    for (_, number), (region, part) in again.pixels.items():
        pixels[number].put(region, part)
    expected, found = composed(view.layers, view.pixels), composed(again.layers, pixels)
    # 16 bits of a display value, whose light has 2.4 times its relative error; and of coverage.
    np.testing.assert_allclose(found.image, expected.image, rtol=1e-3)
    np.testing.assert_allclose(found.importance, expected.importance, atol=1e-4)


def composed(layers: LayerStack, pixels: Mapping[int, LayerPixels]) -> Pixels:
    """Return the target that layers come to, without accents."""
    shown = [with_effect(x, pixels[x.id], lambda: None) for x in layers.shown() if x.id in pixels]
    return compose([ShownLayer(*pair, 1.0) for pair in shown], CURRENT, WHOLE)


@pytest.mark.parametrize(
    ("attributes", "change", "kind"),
    [
        ({}, lambda codes: codes, "adjust"),
        ({"name": "Dim", "visibility": "hidden"}, lambda codes: codes, "adjust"),
        ({}, lambda codes: np.where(codes[..., 3:] > 0, codes, 0), "adjust"),
        ({DIGEST: ""}, lambda codes: codes, "paint"),
        ({NOTE: ""}, lambda codes: codes, "paint"),
        ({"x": "1"}, lambda codes: codes, "paint"),
        ({"opacity": "0.5"}, lambda codes: codes, "paint"),
        ({}, lambda codes: codes - np.uint16(codes > 40000), "paint"),
        ({}, lambda codes: (codes >> 8).astype(np.uint8), "paint"),
    ],
)
def test_pixels_that_a_program_changes_win_over_the_note_of_an_adjustment(
    tmp_path: Path, attributes: dict[str, str], change: Callable[[Any], Any], kind: str
) -> None:
    path = tmp_path / "layers.ora"
    half = (np.arange(SIZE[1]) < 35) * np.ones(SIZE)
    view = layered((Layer(1, "adjust", "Darker", gain=0.25), 0.0, half))
    write_layers_openraster(path, view, CURRENT, TRANSFORM)
    with opened_openraster(path) as (_, items):
        codes = np.round(65535 * list(items)[1].display).astype(np.uint16)
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    root = ElementTree.fromstring(members["stack.xml"])
    layer = root[0][0]
    layer.attrib.update(attributes)
    members |= {"stack.xml": ElementTree.tostring(root), layer.attrib["src"]: png(change(codes))}
    path.write_bytes(archived(members))
    again = read_layers(path, SIZE, TRANSFORM)
    [found] = [x for x in again.layers if x.name in ("Darker", "Dim")]
    assert found.kind == kind
    assert found.gain == (0.25 if kind == "adjust" else 1)
    assert found.is_visible == ("visibility" not in attributes)
    assert again.pixels[0, found.id][1].image.any() == (kind == "paint")


@pytest.mark.parametrize(
    "note", ["{", "[]", '{"format": "x", "kind": "adjust"}', '"gain": -1', '"id": 3']
)
def test_a_damaged_note_of_a_layer_is_refused_in_one_line(tmp_path: Path, note: str) -> None:
    path = tmp_path / "layers.ora"
    start = f'{{"format": "{FORMAT}", "kind": "adjust", '
    text = note if note[0] in "{[" else f"{start}{note}}}"
    write_openraster(path, [RasterLayer("one", np.ones((*SIZE, 4)), note=text)], CURRENT, {})
    with pytest.raises(ImageError, match=r"layers\.ora is damaged: the note of a layer"):
        read_layers(path, SIZE, TRANSFORM)


def test_files_without_usable_layers_are_refused_in_one_line(tmp_path: Path) -> None:
    view = layered((Layer(1, "paint"), 0.5, 0.5))
    exr, openraster = tmp_path / "layers.exr", tmp_path / "layers.ora"
    write_layers_exr(exr, view, "eye")
    write_layers_openraster(openraster, view, CURRENT, TRANSFORM)
    for path in (exr, openraster):
        with pytest.raises(PaintError, match="70x12 pixels, and the view 8x9"):
            read_layers(path, (9, 8), TRANSFORM)
    [part] = read_parts(exr)
    write_parts(exr, [ExrPart("other", part.channels)])
    with pytest.raises(PaintError, match="does not say what its layers mean"):
        read_layers(exr, SIZE, TRANSFORM)
    for text in ("{", '{"format": "other"}', "[]", part.attributes[KEY].replace('"paint"', '"x"')):
        write_parts(exr, [ExrPart("other", part.channels, {KEY: text})])
        with pytest.raises(PaintError, match="its layers are damaged"):
            read_layers(exr, SIZE, TRANSFORM)
    values = {**part.channels, "01 Layer.A": 4 * part.channels["01 Layer.A"]}
    write_parts(exr, [ExrPart("layers", values, part.attributes)])
    with pytest.raises(PaintError, match="beyond 0 to 1"):
        read_layers(exr, SIZE, TRANSFORM)
    content = openraster.read_bytes()
    openraster.write_bytes(content[: len(content) // 2])
    with pytest.raises(ImageError, match="is damaged"):
        read_layers(openraster, SIZE, TRANSFORM)
    (tmp_path / "other").write_text("nothing")
    with pytest.raises(PaintError, match="no layers to open"):
        read_layers(tmp_path / "other", SIZE, TRANSFORM)


@pytest.mark.parametrize("fifth", FIFTHS)
def test_damaged_files_are_refused_or_read(tmp_path: Path, fifth: int) -> None:
    rng = np.random.default_rng(0)
    pixels = Pixels(*(rng.random(shape, np.float32) for shape in ((6, 5, 3), (6, 5))))
    layers = [Layer(1, "paint", group=2), Layer(2, "group", "Night"), Layer(3, "pixels")]
    named = dict.fromkeys((1, 3), put_on(LayerPixels((6, 5)), pixels))
    view = ViewLayers(LayerStack.of(layers), named, CURRENT[:6, :5])
    exr, openraster = tmp_path / "layers.exr", tmp_path / "layers.ora"
    write_layers_exr(exr, view, "eye")
    write_layers_openraster(openraster, view, CURRENT[:6, :5], TRANSFORM)
    contents = {path.name: path.read_bytes() for path in (exr, openraster)}
    cases = [
        case
        for k, (name, content) in enumerate(contents.items())
        for case in fifth_of(damage(name, content, k, 150, 150), fifth)
    ]
    # What stands in the list of layers is under no checksum that a liar could not renew.
    with zipfile.ZipFile(openraster) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    text = members["stack.xml"].decode()
    for old, new in LIES:
        assert old in text
        content = archived({**members, "stack.xml": text.replace(old, new).encode()})
        cases.append(Case("layers.ora", f"said {new[:40]}", content))
    results = outcomes("layers", contents, cases, tmp_path)
    assert wrong_outcomes(results) == []
    assert read_despite_cut(results) == []
    lies = [outcome for case, outcome in results if case.done.startswith("said ")]
    assert lies == ["refused"] * len(LIES)


#: Words of a list of layers, and what a liar writes instead.
LIES = (
    ('w="5"', 'w="-5"'),
    ('h="6"', 'h="6000000000000"'),
    ('x="0"', 'x="nan"'),
    ('y="0"', 'y="inf"'),
    ('opacity="1"', 'opacity="much"'),
    ('src="data/layer0.png"', 'src="../../layer0.png"'),
    ('src="data/layer0.png"', 'src="stack.xml"'),
    ("<image ", "<!-- -->" + 3000 * "<stack>" + "<image "),
)


def archived(members: dict[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return buffer.getvalue()


def test_a_list_of_layers_may_not_declare_anything(tmp_path: Path) -> None:
    path = tmp_path / "layers.ora"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("mimetype", "image/openraster")
        archive.writestr("stack.xml", '<!DOCTYPE x [<!ENTITY a "b">]><image w="1" h="1"/>')
    with pytest.raises(ImageError, match="declarations of its own"):
        read_layers(path, SIZE, TRANSFORM)


def openraster_of(names: list[str], *, groups: int = 0) -> bytes:
    """An OpenRaster file of the view's size, whose layers are the same two pictures of 10x5."""
    buffer = io.BytesIO()
    Image.new("RGBA", (10, 5), (200, 100, 50, 255)).save(buffer, "PNG")
    layers = "".join(f'<layer name="one" src="{name}"/>' for name in names)
    stack = f"<stack>{groups * '<stack>'}{layers}{groups * '</stack>'}</stack>"
    return archived(
        {
            "mimetype": b"image/openraster",
            "stack.xml": f'<image w="{SIZE[1]}" h="{SIZE[0]}">{stack}</image>'.encode(),
            "a.png": buffer.getvalue(),
            "b.png": buffer.getvalue(),
        }
    )


@pytest.mark.parametrize(
    ("limits", "names", "groups", "expected"),
    [
        # Several layers of one picture count as often as they name it.
        ({"MAX_LAYER_PIXELS": 149}, ["a.png", "a.png", "b.png"], 0, "0 million pixels together"),
        ({"MAX_LAYERS": 2}, ["a.png", "a.png", "b.png"], 0, "has 3 layers: expected at most 2"),
        ({"MAX_DEPTH": 3}, ["a.png"], 4, "groups in groups, more than 3 deep"),
    ],
)
def test_a_short_file_with_many_layers_is_refused_before_any_is_decoded(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    limits: dict[str, int],
    names: list[str],
    groups: int,
    expected: str,
) -> None:
    path = tmp_path / "layers.ora"
    path.write_bytes(openraster_of(names, groups=groups))
    assert len(read_layers(path, SIZE, TRANSFORM).pixels) == len(names)
    for name, limit in limits.items():
        monkeypatch.setattr(openraster, name, limit)
    monkeypatch.setattr(openraster, "read_bitmap", None)
    with pytest.raises(ImageError, match=expected):
        read_layers(path, SIZE, TRANSFORM)


def test_the_size_of_a_file_is_compared_before_its_pixels_are_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_layers_exr(tmp_path / "layers.exr", layered((Layer(1, "paint"), 0.5, 0.5)), "eye")
    (tmp_path / "layers.ora").write_bytes(openraster_of(["a.png"]))
    monkeypatch.setattr(openraster, "read_bitmap", None)
    monkeypatch.setattr(formats, "read_parts", None)
    for name in ("layers.exr", "layers.ora"):
        with pytest.raises(PaintError, match="70x12 pixels, and the view 8x9"):
            read_layers(tmp_path / name, (9, 8), TRANSFORM)


def test_layers_keep_no_more_pixels_than_fit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two layers of 10x5 pixels: those of a layer beside the view are not kept."""
    view = layered(*((Layer(k, "paint"), 0.5, np.pad(np.ones((5, 10)), ((0, 7), (0, 60))))
                     for k in (1, 2)))  # fmt: skip
    write_layers_exr(tmp_path / "layers.exr", view, "eye")
    (tmp_path / "layers.ora").write_bytes(openraster_of(["a.png", "b.png"]))
    for name in ("layers.exr", "layers.ora"):
        monkeypatch.setattr(layer_files, "MAX_KEPT_PIXELS", 100)
        assert len(read_layers(tmp_path / name, SIZE, TRANSFORM).pixels) == 2
        monkeypatch.setattr(layer_files, "MAX_KEPT_PIXELS", 99)
        with pytest.raises(PaintError, match="cover more than 0 million pixels together"):
            read_layers(tmp_path / name, SIZE, TRANSFORM)


def test_layers_of_an_exr_do_not_share_channels(tmp_path: Path) -> None:
    exr = tmp_path / "layers.exr"
    write_layers_exr(exr, layered((Layer(1, "paint"), 0.5, 0.5)), "eye")
    [part] = read_parts(exr)
    about = json.loads(part.attributes[KEY])
    [painting] = [x for x in about["layers"] if x["id"] == 1]
    about["layers"] += [{**painting, "id": 5}]
    write_parts(exr, [ExrPart("layers", part.channels, {KEY: json.dumps(about)})])
    with pytest.raises(PaintError, match="two layers have the same channels"):
        read_layers(exr, SIZE, TRANSFORM)


@pytest.mark.parametrize("encoding", ["none-such", "utf-7", "UTF-16"])
def test_a_list_of_layers_in_an_unknown_encoding_is_refused(tmp_path: Path, encoding: str) -> None:
    text = f'<?xml version="1.0" encoding="{encoding}"?><image w="70" h="12"><stack/></image>'
    members = {"mimetype": b"image/openraster", "stack.xml": text.encode()}
    (tmp_path / "layers.ora").write_bytes(archived(members))
    with pytest.raises(ImageError, match=r"layers\.ora is damaged"):
        read_layers(tmp_path / "layers.ora", SIZE, TRANSFORM)


@pytest.mark.parametrize("method", [zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_damaged_compression_is_refused_in_one_line(tmp_path: Path, method: int) -> None:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("mimetype", "image/openraster")
        archive.writestr("stack.xml", '<image w="70" h="12"><stack/></image>', method)
        start, size = archive.start_dir, archive.infolist()[1].compress_size
    content = bytearray(buffer.getvalue())
    content[start - size // 2 : start] = (size - size // 2) * b"\xff"
    (tmp_path / "layers.ora").write_bytes(content)
    with pytest.raises(ImageError, match=r"layers\.ora is damaged"):
        read_layers(tmp_path / "layers.ora", SIZE, TRANSFORM)


@pytest.mark.nightly
def test_krita_opens_both_files_and_saves_layers_that_come_back(tmp_path: Path) -> None:
    # It wants a display, and on Linux takes no other than X11's.
    krita, display = needs("kritarunner", "Krita"), needs("xvfb-run", "Xvfb")
    half = (np.arange(SIZE[1]) < 35) * np.ones(SIZE)
    view = layered(
        (Layer(1, "paint", "Lamp, +1.2 stops", strength=0.4), (2.0, 1.0, 0.5), half),
        (Layer(2, "adjust", "Darker", gain=0.25, group=3), 0.0, half[:, ::-1]),
        (Layer(4, "pixels", "Strokes", is_visible=False), (0.2, 0.3, 0.4), 0.5 * half),
        group=Layer(3, "group", "Night"),
    )
    write_layers_exr(tmp_path / "layers.exr", view, "eye")
    write_layers_openraster(tmp_path / "layers.ora", view, CURRENT, TRANSFORM)
    run(
        tmp_path,
        *(display, *FREE_DISPLAY, krita, "-s", "lightpaint_krita_layers"),
        PYTHONPATH=str(KRITA_SCRIPTS),
        LIGHTPAINT_FOLDER=str(tmp_path),
    )
    error = tmp_path / "error"
    assert not error.exists(), error.read_text(encoding="utf-8")
    found = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))
    # The lowest first.
    names = [name for name, *_ in found["exr"]]
    assert [name[3:] for name in names] == [
        LOOK_NAME,
        *("Lamp, +1,2 stops", "Strokes", "Night/Darker"),
    ]
    assert names == sorted(names, reverse=True)
    # An EXR has neither eye nor strength: hidden strokes cover.
    np.testing.assert_allclose(found["pixel"], (0.2, 0.3, 0.4, 1.0), rtol=1e-6)
    assert found["ora"] == [
        [LOOK_NAME, 1.0, True, []],
        ["Lamp, +1.2 stops", 0.4, True, []],
        ["Strokes", 1.0, False, []],
        ["Night", 1.0, True, [["Darker", 1.0, True, []]]],
    ]
    again = read_layers(tmp_path / "again.ora", SIZE, TRANSFORM)
    layers = {layer.name: layer for layer in again.layers}
    assert set(layers) == {"Painting", "Lamp, +1.2 stops", "Night", "Darker", "Strokes"}
    lamp = layers["Lamp, +1.2 stops"]
    assert lamp.strength == pytest.approx(0.4, abs=1 / 255)
    assert not layers["Strokes"].is_visible
    assert layers["Darker"].group == layers["Night"].id
    region, pixels = again.pixels[0, lamp.id]
    assert region == (0, SIZE[0], 0, 35)
    # Krita saves 8 bits: half a step in 188, whose light has 2.4 times its relative error.
    np.testing.assert_allclose(pixels.image[3, 3], (2.0, 1.0, 0.5), rtol=0.015)


@contextmanager
def opened(subject: Subject) -> Iterator[tuple[Studio, list[Message]]]:
    """A studio with its session, and what it publishes."""
    messages: list[Message] = []
    studio = Studio([subject], MemoryStore)
    studio.on_message = messages.append
    studio.start()
    try:
        wait_for(messages, "state", "notice")
        yield studio, messages
    finally:
        studio.close()


def wait_for(messages: list[Message], *kinds: str) -> Message:
    """The first message of these kinds."""
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        for message in list(messages):
            if message.kind in kinds:
                return message
        time.sleep(0.01)
    raise AssertionError([message.kind for message in messages])


@pytest.mark.nightly
@pytest.mark.parametrize(("name", "precision"), [("layers.exr", 1e-4), ("layers.ora", 1e-3)])
def test_exported_layers_open_in_another_session(
    tmp_path: Path, name: str, precision: float
) -> None:
    """With the same lights, to the precision of floats or of 16 bits; and undo takes them back."""
    [basis] = bases_of(1)
    subject = Subject("room", tmp_path, basis=basis)
    with opened(subject) as (studio, messages):
        layer = Layer(1, "adjust", "All, darker", gain=0.7)
        request = protocol.Paint(1, WHOLE, True, layer=1, properties=layer)
        studio.handle(request, {"importance": np.ones(SIZE, np.float32)})
        shape = (SIZE[0], 10)
        arrays = {
            "image": np.full((*shape, 3), 0.2, np.float32),
            "importance": np.ones(shape, np.float32),
        }
        studio.handle(protocol.Paint(2, (0, SIZE[0], 30, 40), True), arrays)
        studio.handle(protocol.Export(("layers",)), {})
        exported = wait_for(messages, "exported").fields
        assert exported["files"] == [str(tmp_path / "layers.exr"), str(tmp_path / "layers.ora")]
        assert exported["command"] == ""
        expected = studio.snapshot().solution()
    with opened(replace(subject, layers=tmp_path / name)) as (studio, _):
        names = {layer.name for layer in studio.session.views.layers}
        assert names == {"Painting", "All, darker"}
        found = studio.snapshot().solution()
        assert found is not None
        assert expected is not None
        np.testing.assert_allclose(found.weights, expected.weights, rtol=precision)
        studio.handle(protocol.Undo(), {})
        assert not studio.session.views.is_painted


def test_a_session_begins_with_a_file_once(tmp_path: Path) -> None:
    path = tmp_path / "layers.exr"
    write_layers_exr(path, layered((Layer(1, "paint", "Lamp"), 0.5, 0.5)), "eye")
    session = loaded(LayeredPaintings(LayerStack(), {}))
    assert begin_with_layers(session, path)
    session.handle(protocol.ChangeLayers(layers=(Layer(1, "paint", "Dim", strength=0.2),)), {})
    again = open_session(session.store, 1)
    assert not begin_with_layers(again, path)
    assert [layer.name for layer in again.views.layers] == ["Painting", "Dim"]
    write_layers_exr(path, layered((Layer(1, "paint", "Other"), 0.5, 0.5)), "eye")
    assert begin_with_layers(again, path)
    assert [layer.name for layer in again.views.layers] == ["Painting", "Other"]


def test_a_page_imports_a_file_in_parts(tmp_path: Path) -> None:
    group = Layer(3, "group", "Night")
    write_layers_exr(
        tmp_path / "layers.exr",
        layered(
            (Layer(1, "paint", "Lamp", group=3), 0.5, 0.5),
            (Layer(0, "pixels", "Painting"), 0.3, 1.0),
            group=group,
        ),
        "eye",
    )
    content = (tmp_path / "layers.exr").read_bytes()

    def send(studio: Studio, content: bytes, **options: Any) -> None:
        middle, size = len(content) // 2, len(content)
        for start, end in ((0, middle), (middle, size)):
            part = np.frombuffer(content[start:end], np.uint8)
            request = protocol.ImportLayers("wall.exr", size, start, **options)
            assert studio.handle(request, {"part": part})[0].fields["task"] == "import"

    [basis] = bases_of(1)
    with opened(Subject("room", tmp_path, basis=basis)) as (studio, messages):
        views = studio.session.views
        studio.handle(
            protocol.Paint(1, WHOLE, True, layer=1, properties=Layer(1, "adjust", "Own", gain=0.5)),
            {"importance": np.ones(SIZE, np.float32)},
        )
        image = views[0].image.copy()
        for replaces, names in (
            (False, ["Painting", "Own", "Painting", "Lamp", "Night"]),
            (True, ["Painting", "Lamp", "Night"]),
        ):
            del messages[:]
            send(studio, content, replaces=replaces)
            text = wait_for(messages, "notice").fields["text"]
            assert text.startswith("Imported ")
            assert text.endswith(" of wall.exr; undo leads back.")
            patches = [message for message in messages if message.kind == "patch"]
            assert [x["name"] for x in patches[0].fields["layers"]["layers"]] == names
            assert [layer.name for layer in views.layers] == names
            studio.handle(protocol.Undo(), {})
            np.testing.assert_array_equal(views[0].image, image)
        del messages[:]
        send(studio, content[:-200])
        text = wait_for(messages, "notice").fields["text"]
        assert text.startswith("wall.exr is cut off or damaged")
        for request, part, error in (
            (protocol.ImportLayers("wall.exr", 10, 5), np.zeros(5, np.uint8), "in order"),
            (protocol.ImportLayers("wall.exr", 10, 0), np.zeros(11, np.uint8), "in order"),
            (protocol.ImportLayers("wall.exr", 10, 0, view=3), np.zeros(5, np.uint8), "no view 3"),
            (protocol.ImportLayers("wall.exr", 2**40, 0), np.zeros(5, np.uint8), "1099.5 GB"),
            (protocol.ImportLayers("wall.exr", 10, 0), None, "without its bytes"),
        ):
            with pytest.raises(PaintError, match=error):
                studio.handle(request, {} if part is None else {"part": part})
        assert [layer.name for layer in views.layers] == ["Painting", "Own"]


def test_a_session_of_another_size_says_why_it_does_not_open(tmp_path: Path) -> None:
    write_layers_exr(tmp_path / "other.exr", layered((Layer(1, "paint"), 0.5, 0.5)), "eye")
    basis = bases_of(2)[1]
    subject = Subject("room", tmp_path, basis=basis, layers=tmp_path / "other.exr")
    with opened(subject) as (studio, messages):
        text = wait_for(messages, "notice").fields["text"]
        assert "other.exr has 70x12 pixels, and the view 8x9" in text
        assert isinstance(studio.failure, PaintError)


def test_layers_are_of_one_view_and_have_to_exist(tmp_path: Path) -> None:
    first, other = bases_of(2)
    with pytest.raises(PaintError, match="has the layers of one view"):
        make_subjects([first, other], tmp_path, layers=tmp_path / "layers.exr")
    with pytest.raises(ImageError, match=r"no such image file: .*layers\.exr"):
        make_subjects([first], tmp_path, layers=tmp_path / "layers.exr")
