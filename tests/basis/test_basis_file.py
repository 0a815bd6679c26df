"""The basis and its file: exact, plain EXR to others, and refused when damaged."""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest

from lightpaint.basis.file.basis_file import (
    FORMAT_KEY,
    ORIGIN_KEY,
    as_stored,
    is_basis_file,
    read_basis,
    read_origin,
    write_basis,
)
from lightpaint.basis.file.file_parts import CHECKSUMS_KEY, LIGHT_KEY, NAMES_KEY, OBJECTS_KEY
from lightpaint.basis.light_basis import Basis
from lightpaint.errors import BasisError, ImageError, SizeError
from lightpaint.images.estimate import HALF_DIFFERENCE
from lightpaint.images.formats.exr import ExrPart, read_parts, write_parts, write_rgb
from lightpaint.images.object_map import Objects

SIZE = (6, 5)


@pytest.fixture
def basis(make_basis: Any) -> Basis:
    rng = np.random.default_rng(3)
    source = make_basis(
        3,
        SIZE,
        names=["key", "Fülllicht 灯 №2", "back/rim.left"],
        # Values of every size, some beyond half float.
        images=10.0 ** rng.uniform(-30, 30, (3, *SIZE, 3)),
        half_differences=rng.normal(size=(3, *SIZE, 3)),
        seen=rng.random(SIZE) < 0.3,
    )
    return as_stored(source)


@pytest.fixture
def path(tmp_path: Path, basis: Basis) -> Path:
    write_basis(tmp_path / "a.basis.exr", basis)
    return tmp_path / "a.basis.exr"


def _assert_equal(actual: Basis, expected: Basis) -> None:
    assert actual.lights == expected.lights
    assert actual.origin == expected.origin
    assert actual.images.tobytes() == expected.images.tobytes()
    assert actual.half_differences.tobytes() == expected.half_differences.tobytes()
    assert actual.images.dtype == actual.half_differences.dtype == np.float32
    assert actual.emitters_seen.dtype == bool
    np.testing.assert_array_equal(actual.emitters_seen, expected.emitters_seen)


def test_there_and_back_is_exact(path: Path, basis: Basis):
    reread = read_basis(path)
    _assert_equal(reread, basis)
    assert reread.names == ("key", "Fülllicht 灯 №2", "back/rim.left")
    assert reread.size == SIZE
    np.testing.assert_array_equal(reread.current_weights, [x.emission for x in basis.lights])


def _add_objects(basis: Basis) -> Basis:
    """More of them than half floats can number, one without a name, many of the same."""
    index = np.random.default_rng(4).integers(-1, 5000, SIZE, np.int32)
    names = ("", "Säule <b>\n", *["column"] * 4998)
    return replace(basis, objects=Objects(index, names))


def test_objects_there_and_back(tmp_path: Path, basis: Basis):
    basis = _add_objects(basis)
    assert basis.objects is not None
    write_basis(tmp_path / "a.basis.exr", basis)
    reread = read_basis(tmp_path / "a.basis.exr")
    _assert_equal(reread, basis)
    assert reread.objects is not None
    assert reread.objects.names == basis.objects.names
    np.testing.assert_array_equal(reread.objects.index, basis.objects.index)
    assert reread.objects.index.dtype == np.int32
    assert reread.objects.mask("column").sum() == (basis.objects.index > 1).sum()
    assert not reread.objects.mask("vase").any()


@pytest.mark.parametrize("damage", ["index", "names"])
def test_objects_that_are_not_as_they_were_are_left_out(tmp_path: Path, basis: Basis, damage: str):
    path = tmp_path / "a.basis.exr"
    write_basis(path, _add_objects(basis))
    parts = read_parts(path)
    k = next(k for k, part in enumerate(parts) if OBJECTS_KEY in part.attributes)
    if damage == "index":
        parts[k].channels["index"][0, 0] += 1
    else:
        attributes = {**parts[k].attributes, NAMES_KEY: '["other"]'}
        parts[k] = replace(parts[k], attributes=attributes)
    write_parts(path, parts)
    reread = read_basis(path)
    _assert_equal(reread, basis)
    assert reread.objects is None


@pytest.mark.parametrize(
    "index", [np.zeros((2, 3)), np.full((2, 3), 2), np.full((2, 3), -2), np.zeros((2, 3, 1), int)]
)
def test_what_is_no_picture_of_objects(index: Any):
    with pytest.raises(SizeError, match="objects"):
        Objects(index, ("a", "b"))


@pytest.mark.parametrize(
    "names", [["emitters seen"], ["emitters seen", "emitters seen_"], ["Y", "rgb"], [" ", "\n"]]
)
def test_lights_of_any_name(tmp_path: Path, make_basis: Any, names: list[str]):
    basis = make_basis(len(names), SIZE, names=names, seen=np.eye(*SIZE, dtype=bool))
    write_basis(tmp_path / "a.exr", basis)
    _assert_equal(read_basis(tmp_path / "a.exr"), basis)


def test_other_programs_see_one_rgb_part_per_light(path: Path, basis: Basis):
    parts = OpenEXR.File(str(path), separate_channels=True).parts
    assert [part.name() for part in parts] == [*basis.names, "emitters seen"]
    for part, image, half in zip(parts, basis.images, basis.half_differences, strict=False):
        for c, channel in enumerate("RGB"):
            np.testing.assert_array_equal(part.channels[channel].pixels, image[..., c])
            noise = part.channels[f"{HALF_DIFFERENCE}.{channel}"].pixels
            np.testing.assert_array_equal(noise, half[..., c])
    np.testing.assert_array_equal(parts[-1].channels["Y"].pixels, basis.emitters_seen)


def test_parts_in_another_order(path: Path, basis: Basis):
    *lights, emitter_part = read_parts(path)
    # The marks of the file may be on any part.
    write_parts(path, [emitter_part, *reversed(lights)])
    _assert_equal(read_basis(path), basis)
    # Where there are no checksums, as in files from before there were any, the parts' is all.
    parts = [
        replace(p, attributes=_drop_attribute(p.attributes, CHECKSUMS_KEY))
        for p in read_parts(path)
    ]
    write_parts(path, parts)
    reread = read_basis(path)
    assert reread.names == basis.names[::-1]
    np.testing.assert_array_equal(reread.images, basis.images[::-1])


def _drop_attribute(attributes: Mapping[str, str], key: str) -> dict[str, str]:
    return {k: v for k, v in attributes.items() if k != key}


def _rewrite(path: Path, index: int, **changes: Any) -> None:
    """Write the file at `path` again with other attributes in part `index`."""
    parts = read_parts(path)
    attributes = {**parts[index].attributes, **changes}
    attributes = {k: v for k, v in attributes.items() if v is not None}
    parts[index] = replace(parts[index], attributes=attributes)
    write_parts(path, parts)


def test_rewriting_alone_damages_nothing(path: Path, basis: Basis):
    _rewrite(path, 0)
    _assert_equal(read_basis(path), basis)


@pytest.mark.parametrize("mark", [None, "lightpaint-basis 4", ""])
def test_a_file_of_another_format(path: Path, mark: str | None):
    _rewrite(path, 0, **{FORMAT_KEY: mark})
    with pytest.raises(BasisError, match=r"a\.basis\.exr is not a basis this version can read"):
        read_basis(path)


def test_an_ordinary_picture_is_no_basis(tmp_path: Path):
    write_rgb(tmp_path / "a.exr", np.ones((2, 2, 3)))
    with pytest.raises(BasisError, match="found 'no such mark'"):
        read_basis(tmp_path / "a.exr")


GOOD_LIGHT = {
    "name": "key",
    "plugin": "area",
    "parameter": "radiance",
    "unit": "",
    "emission": [1, 2, 3],
    "form": "",
}
BAD_LIGHTS: list[Any] = [
    *[{k: v for k, v in GOOD_LIGHT.items() if k != gone} for gone in GOOD_LIGHT if gone != "form"],
    GOOD_LIGHT | {"colour": "red"},
    *[GOOD_LIGHT | {"emission": bad} for bad in ([1, 2], 5, None, [1, 2, "x"], [1, 2, 10**400])],
    *[
        GOOD_LIGHT | {"unit_flux": bad}
        for bad in ([1, 2], 5, [1, 2, "x"], [1, 2, -1], [1, 2, None])
    ],
    GOOD_LIGHT | {"name": "back/rim.left"},
    [],
    "key",
    None,
    3,
]


@pytest.mark.parametrize("light", BAD_LIGHTS, ids=lambda x: str(x)[:70])
def test_damaged_lights(path: Path, light: Any):
    _rewrite(path, 0, **{LIGHT_KEY: json.dumps(light)})
    with pytest.raises(BasisError):
        read_basis(path)


@pytest.mark.parametrize("text", ["{", "key", "[" * 100_000, '{"a":' * 100_000])
@pytest.mark.parametrize("key", [LIGHT_KEY, ORIGIN_KEY])
def test_damaged_json(path: Path, key: str, text: str):
    _rewrite(path, 0, **{key: text})
    with pytest.raises(BasisError, match=r"a\.basis\.exr is a damaged basis"):
        read_basis(path)


@pytest.mark.parametrize("origin", [None, "{}", "[]", '{"scene": "a"}', '{"x": 1}', "7"])
def test_damaged_origin(path: Path, origin: str | None):
    _rewrite(path, 0, **{ORIGIN_KEY: origin})
    with pytest.raises(BasisError, match=r"a\.basis\.exr is a damaged basis"):
        read_basis(path)


@pytest.mark.parametrize("keep", [slice(0, -1), slice(0, 0), slice(-1, None)])
def test_lost_parts(path: Path, keep: slice):
    parts = read_parts(path)
    marks = {k: parts[0].attributes[k] for k in (FORMAT_KEY, ORIGIN_KEY)}
    mark = ExrPart("marks", {"Z": np.zeros(SIZE, np.float32)}, marks)
    remaining_parts = [replace(p, attributes={**p.attributes, **marks}) for p in parts[keep]]
    write_parts(path, [*remaining_parts, mark])
    with pytest.raises(BasisError, match="has lost parts of its basis"):
        read_basis(path)


def test_lost_noise(path: Path):
    parts = read_parts(path)
    colours = {k: v for k, v in parts[1].channels.items() if len(k) == 1}
    parts[1] = replace(parts[1], channels=colours)
    write_parts(path, parts)
    with pytest.raises(BasisError, match=r"a damaged basis: no channel half_difference\.R"):
        read_basis(path)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_values_that_are_not_finite(tmp_path: Path, basis: Basis, bad: float):
    images = basis.images.copy()
    images[1, 2, 3, 0] = bad
    write_basis(tmp_path / "a.exr", replace(basis, planes=images))
    with pytest.raises(BasisError, match="not finite"):
        read_basis(tmp_path / "a.exr")


def test_a_cut_off_basis(path: Path):
    content = path.read_bytes()
    for length in np.linspace(0, len(content) - 1, 40, dtype=int):
        path.write_bytes(content[:length])
        with pytest.raises(ImageError):
            read_basis(path)


def test_what_a_basis_must_be(make_basis: Any, basis: Basis):
    with pytest.raises(BasisError, match="light names repeat: a, a"):
        make_basis(2, SIZE, names=["a", "a"])
    for changes, message in [
        ({"planes": basis.images[:2]}, "for 3 lights"),
        ({"planes": basis.images[..., :2]}, "for 3 lights"),
        ({"noise": basis.half_differences[:, 1:]}, "half differences"),
        ({"emitters_seen": basis.emitters_seen.T}, "mask of seen emitters"),
    ]:
        with pytest.raises(BasisError, match=message):
            replace(basis, **changes)


def test_names_of_basis_files():
    assert is_basis_file(Path("a.basis.exr"))
    assert is_basis_file(Path("A.EXR"))
    assert not is_basis_file(Path("scene.xml"))


def test_flux_goes_along_where_it_is_known(tmp_path: Path, make_basis: Any):
    source = make_basis(2)
    light_with_flux = replace(source.lights[0], unit_flux=(1.5, 1.5, 1.5))
    basis = replace(source, lights=(light_with_flux, source.lights[1]))
    write_basis(tmp_path / "f.basis.exr", basis)
    assert read_basis(tmp_path / "f.basis.exr").lights == basis.lights


def test_what_is_asked_often_is_computed_once(make_basis: Any) -> None:
    basis = make_basis(4, (150, 120), seen=np.random.default_rng(1).random((150, 120)) < 0.2)
    images = basis.images.astype(np.float64)
    visible = images * ~basis.emitters_seen[..., None]
    # Sums of 18,000 products in float64, in another order.
    np.testing.assert_allclose(basis.power, np.square(visible).sum(axis=(1, 2)), rtol=1e-12)
    np.testing.assert_allclose(basis.totals, images.sum(axis=(1, 2)), rtol=1e-12)
    np.testing.assert_array_equal(basis.current_weights, [x.emission for x in basis.lights])
    for attribute in ("names", "current_weights", "is_fixed", "power", "totals"):
        assert getattr(basis, attribute) is getattr(basis, attribute)
        assert attribute == "names" or not getattr(basis, attribute).flags.writeable
    # Another basis has its own.
    assert replace(basis, planes=basis.images * 2).power[0, 0] == 4 * basis.power[0, 0]


def test_a_basis_is_shown_on_one_screen(make_basis: Any) -> None:
    basis = make_basis(3, (4, 5), names=["key", "fill", "rim"])
    assert repr(basis) == "Basis(3 lights, 5x4, 64 spp, of scene.xml: key, fill, rim)"
    many = make_basis(300, (1, 1), names=[f"chandelier_{k}_of_the_great_hall" for k in range(300)])
    assert len(repr(many)) < 1000
    assert "chandelier_0" in repr(many)
    assert "and 28" in repr(many)
    assert len(repr(many.lights)) < 1000
    assert repr(many.lights).count("\n") < 25
    assert "\n … and 29" in repr(many.lights)
    assert "BasisLight('key', area radiance 0." in repr(basis.lights)


def test_more_samples_than_any_render_has(path: Path) -> None:
    origin = json.loads(read_parts(path)[0].attributes[ORIGIN_KEY])
    for change in (
        {"halves": [2**41, 1]},
        {"passes": [1, 2**41]},
        {"each_light": [[1, 1, 2**41, 1]] * 3},
        {"halves": [1, -1]},
        {"halves": [1, True]},
        {"each_light": [[1, 1, 1]] * 3},
    ):
        _rewrite(path, 0, **{ORIGIN_KEY: json.dumps(origin | change), CHECKSUMS_KEY: None})
        for read in (read_basis, read_origin):
            with pytest.raises(BasisError, match=r"a\.basis\.exr"):
                read(path)
