"""Objects of a render by its Cryptomatte, as programs write it."""

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from light_groups import SIZE, channels, pictures, write

import lightpaint as lp
from lightpaint.basis.lightgroups import cryptomatte
from lightpaint.basis.lightgroups.cryptomatte import MAX_OBJECTS, declared_mattes, parse_manifest
from lightpaint.basis.lightgroups.light_groups import read_light_groups
from lightpaint.images.formats.exr import ExrPart

IDS = {"Cube": 0xA8FCE865, "floor": 0xE20E7901, "lamp": 0x0677345A}


def as_float(identity: int) -> float:
    return float(np.uint32(identity).view(np.float32))


def matte_channels(layer: str, ranked: Any, names: str = "rgba") -> dict[str, Any]:
    """Channels of ids and coverage: ranked is (ranks, 2, h, w), id and coverage."""
    file_channels = {}
    for k in range(0, len(ranked), 2):
        planes = [plane for pair in ranked[k : k + 2] for plane in pair]
        planes += [np.zeros(SIZE, np.float32)] * (4 - len(planes))
        for name, plane in zip(names, planes, strict=True):
            file_channels[f"{layer}{k // 2:02d}.{name}"] = np.ascontiguousarray(plane, np.float32)
    return file_channels


def ranks(*pairs: tuple[Any, Any]) -> list[tuple[Any, Any]]:
    """Ids (whole numbers) and coverage, each of a pixel or of all."""
    return [
        (
            np.broadcast_to(np.asarray(ids, np.uint32), SIZE).copy().view(np.float32),
            np.broadcast_to(np.asarray(coverage, np.float32), SIZE),
        )
        for ids, coverage in pairs
    ]


def header(name: str = "ViewLayer.CryptoObject", **fields: str) -> dict[str, str]:
    manifest = json.dumps({k: f"{v:08x}" for k, v in IDS.items()})
    values = {"name": name, "hash": "MurmurHash3_32", "conversion": "uint32_to_float32"}
    values |= {"manifest": manifest, **fields}
    return {f"cryptomatte/542cafa/{k}": v for k, v in values.items() if v}


def render(path: Path, mattes: dict[str, Any], attributes: dict[str, str]) -> Path:
    images = pictures(2)
    file_channels = channels("ViewLayer.Combined", images.sum(axis=0))
    for name, image in zip("ab", images, strict=True):
        file_channels |= channels(f"ViewLayer.Combined_{name}", image)
    return write(path, ("", {**file_channels, **mattes}), **attributes)


def halves() -> Any:
    """Ids: the cube on the left, the floor on the right."""
    ids = np.full(SIZE, IDS["floor"], np.uint32)
    ids[:, : SIZE[1] // 2] = IDS["Cube"]
    return ids


def test_the_object_that_covers_most_of_a_pixel(tmp_path: Path):
    # The third rank, in the second layer, covers most; a corner shows mostly nothing.
    most = np.full(SIZE, 0.5, np.float32)
    most[0, 0] = 0.1
    pairs = ranks((IDS["lamp"], 0.3), (IDS["lamp"] + 1, 0.1), (halves(), most))
    file = render(tmp_path / "a.exr", matte_channels("ViewLayer.CryptoObject", pairs), header())
    groups = read_light_groups(file)
    objects = groups.basis.objects
    assert objects is not None
    expected = halves() == IDS["Cube"]
    expected[0, 0] = False
    np.testing.assert_array_equal(objects.mask("Cube"), expected)
    assert objects.index[0, 0] == -1
    assert set(objects.names) == {"Cube", "floor"}
    assert groups.basis.names == ("a", "b")  # mattes are not lights, and leave no rest
    assert any(x.startswith("objects by Cryptomatte") for x in groups.remarks)


def test_objects_are_kept_in_a_basis_file(tmp_path: Path):
    mattes = matte_channels("ViewLayer.CryptoObject", ranks((halves(), 1)))
    groups = read_light_groups(render(tmp_path / "a.exr", mattes, header()))
    lp.write_basis(tmp_path / "a.basis.exr", groups.basis)
    again = lp.read_basis(tmp_path / "a.basis.exr")
    assert again.objects is not None
    assert groups.basis.objects is not None
    np.testing.assert_array_equal(again.objects.index, groups.basis.objects.index)
    assert again.objects.names == groups.basis.objects.names


def test_objects_before_materials(tmp_path: Path):
    other = {k.replace("542cafa", "111"): v for k, v in header("ViewLayer.CryptoMaterial").items()}
    mattes = matte_channels("ViewLayer.CryptoMaterial", ranks((IDS["lamp"], 1)))
    mattes |= matte_channels("ViewLayer.CryptoObject", ranks((halves(), 1)))
    groups = read_light_groups(render(tmp_path / "a.exr", mattes, other | header()))
    assert groups.basis.objects is not None
    assert set(groups.basis.objects.names) == {"Cube", "floor"}


def test_mattes_in_a_file_of_their_own(tmp_path: Path):
    """As Arnold writes them: channels in capitals, the manifest in a file beside."""
    images = pictures(2)
    for name, image in zip(("RGBA_key", "RGBA_fill"), images, strict=True):
        write(tmp_path / f"{name}.exr", ("", channels(name, image)))
    write(tmp_path / "RGBA.exr", ("", channels("RGBA", images.sum(axis=0))))
    mattes = matte_channels("crypto_object", ranks((halves(), 1)), "RGBA")
    attributes = header("crypto_object", manifest="", manif_file="../names.json")
    write(tmp_path / "mattes.exr", ("", mattes), **attributes)
    (tmp_path / "names.json").write_text(json.dumps({k: f"{v:08x}" for k, v in IDS.items()}))
    groups = read_light_groups(tmp_path)
    assert groups.basis.objects is not None
    assert groups.basis.objects.mask("Cube").sum() == SIZE[0] * SIZE[1] // 2
    assert groups.basis.names == ("fill", "key")


@pytest.mark.parametrize("manifest", ["", "{", "[1]", '{"a": 3}', '{"a": "xyz"}'])
def test_ids_stand_for_names_that_are_missing(tmp_path: Path, manifest: str):
    mattes = matte_channels("ViewLayer.CryptoObject", ranks((IDS["Cube"], 1)))
    groups = read_light_groups(render(tmp_path / "a.exr", mattes, header(manifest=manifest)))
    assert groups.basis.objects is not None
    assert groups.basis.objects.names == ("object a8fce865",)
    assert any("names no object" in remark for remark in groups.remarks)


def test_names_as_blender_writes_them():
    """It escapes nothing: this is the manifest of a render by Blender 3.4 and 5.0."""
    text = '{"Cube":"a8fce865","floor "big"\nline":"e20e7901","kugel.ü":"16773450"}'
    expected = {0xA8FCE865: "Cube", 0xE20E7901: 'floor "big"\nline', 0x16773450: "kugel.ü"}
    assert parse_manifest(text) == expected


@pytest.mark.parametrize("text", ['"' * 2**17, '"a' * 2**17, '{"a":' * 2**15, '"a":"' * 2**15])
def test_text_that_is_no_manifest_is_passed_over_once(text: str):
    """A pattern that looked for the end of a name from every quote took minutes for these."""
    assert parse_manifest(text) == {}
    assert parse_manifest(text + '","Cube":"a8fce865"}').keys() == {IDS["Cube"]}


def test_a_manifest_is_read_up_to_a_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    mattes = matte_channels("ViewLayer.CryptoObject", ranks((IDS["Cube"], 1)))
    text = header()["cryptomatte/542cafa/manifest"]
    (tmp_path / "names.json").write_text(text)
    beside = header(manifest="", manif_file="names.json")
    for limit, is_read in ((len(text), True), (len(text) - 1, False)):
        monkeypatch.setattr(cryptomatte, "MAX_MANIFEST_BYTES", limit)
        for attributes in (header(), beside):
            groups = read_light_groups(render(tmp_path / "a.exr", mattes, attributes))
            assert groups.basis.objects is not None
            assert groups.basis.objects.names == (("Cube",) if is_read else ("object a8fce865",))
            assert any("names no object" in remark for remark in groups.remarks) != is_read


def test_a_manifest_may_be_a_file_only(tmp_path: Path):
    """A pipe was opened, which waits for somebody to write into it."""
    os.mkfifo(tmp_path / "names.json")
    mattes = matte_channels("ViewLayer.CryptoObject", ranks((IDS["Cube"], 1)))
    attributes = header(manifest="", manif_file="names.json")
    groups = read_light_groups(render(tmp_path / "a.exr", mattes, attributes))
    assert any("is a device or a pipe" in remark for remark in groups.remarks)


def test_only_the_best_of_many_mattes_are_looked_for(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(cryptomatte, "MAX_MATTES", 2)
    names = ["other", "CryptoMaterial", "CryptoObject"]
    attributes = {f"cryptomatte/{k}/name": name for k, name in enumerate(names)}
    part = ExrPart("", {"R": np.zeros(SIZE, np.float32)}, attributes)
    assert [matte.name for matte in declared_mattes([part])] == names[:0:-1]


def test_layers_of_halves_hold_no_ids(tmp_path: Path):
    mattes = matte_channels("ViewLayer.CryptoObject", ranks((halves(), 1)))
    with np.errstate(over="ignore"):
        small = {name: plane.astype(np.float16) for name, plane in mattes.items()}
    groups = read_light_groups(render(tmp_path / "a.exr", small, header()))
    assert groups.basis.objects is None
    assert groups.basis.names == ("a", "b")


def test_the_largest_of_too_many_objects_are_kept(tmp_path: Path, monkeypatch: Any):
    monkeypatch.setattr("lightpaint.basis.lightgroups.cryptomatte.MAX_OBJECTS", 2)
    ids = halves()
    ids[0, :3] = [7, 8, 9]
    mattes = matte_channels("ViewLayer.CryptoObject", ranks((ids, 1)))
    objects = read_light_groups(render(tmp_path / "a.exr", mattes, header())).basis.objects
    assert objects is not None
    assert set(objects.names) == {"Cube", "floor"}
    assert (objects.index[0, :3] == -1).all()
    assert np.iinfo(np.int16).max >= MAX_OBJECTS


def test_a_beauty_that_was_denoised_beside_its_noisy_image(tmp_path: Path):
    """Cycles denoises the whole picture and no group, and keeps the sum as `Noisy Image`."""
    images = pictures(2)
    noisy = images.sum(axis=0)
    smooth = noisy + np.random.default_rng(1).normal(0, 0.05, noisy.shape).astype(np.float32)
    file_channels = channels("ViewLayer.Combined", smooth)
    file_channels |= channels("ViewLayer.Noisy Image", noisy)
    for name, image in zip("ab", images, strict=True):
        file_channels |= channels(f"ViewLayer.Combined_{name}", image)
    groups = read_light_groups(write(tmp_path / "a.exr", ("", file_channels)))
    assert groups.basis.names == ("a", "b", "rest")
    look = sum(groups.basis.image(name) for name in groups.basis.names)
    np.testing.assert_allclose(look, smooth, rtol=1e-5, atol=1e-5)  # a painting over it is known
    text = "\n".join(groups.remarks)
    assert "add up to ViewLayer.Noisy Image; what denoising changed" in text
    assert "WARNING" not in text
