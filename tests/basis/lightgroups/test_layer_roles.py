"""The role of each layer: names propose, sums decide."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from light_groups import interleaved, pictures

from lightpaint.basis.lightgroups.light_groups import LightGroups, read_light_groups


def _read(path: Path, layers: dict[str, Any], **options: Any) -> LightGroups:
    return read_light_groups(interleaved(path / "a.exr", layers), **options)


def _named(images: Any, names: list[str], beauty: str) -> dict[str, Any]:
    return {beauty: images.sum(axis=0), **dict(zip(names, images, strict=True))}


@pytest.mark.parametrize(
    ("names", "beauty", "pattern"),
    [
        (["ViewLayer.Ci_a", "ViewLayer.Ci_b", "ViewLayer.Ci_c"], "ViewLayer.Combined", None),
        ([f'V.LG {k}: "{x}"' for k, x in enumerate("abc", 1)], "V.Combined", None),
        (["V.a", "V.b", "V.c"], "V.Combined", "V.{name}"),
        (["a", "b", "c"], "Image", "{name}"),
        (["V.a", "V.b", "V.c"], "V.whole thing", "V.{name}"),
        (["V.a", "V.b", "V.c"], "V.whole thing", "{name}"),
    ],
)
def test_the_whole_picture_is_not_a_light(
    tmp_path: Path, names: list[str], beauty: str, pattern: str | None
):
    groups = _read(tmp_path, _named(pictures(), names, beauty), pattern=pattern)
    assert [x.rpartition(".")[2] for x in groups.basis.names] == list("abc")
    assert groups.beauty is not None
    assert groups.beauty.name == beauty
    assert not groups.has_rest


def test_light_in_no_group_does_not_make_the_picture_a_light(tmp_path: Path):
    images = pictures(4)
    layers = _named(images, ["V.a", "V.b", "V.c", "V.Combined"], "V.Combined")
    layers["V.Combined"] = images.sum(axis=0)
    groups = _read(tmp_path, layers, pattern="V.{name}")
    assert groups.basis.names == ("a", "b", "c", "rest")


def test_a_light_named_like_the_picture_is_a_light_where_the_sum_says_so(tmp_path: Path):
    images = pictures(3)
    layers = _named(images, ["V.main", "V.a", "V.b"], "V.all of it")
    groups = _read(tmp_path, layers, pattern="V.{name}")
    assert sorted(groups.basis.names) == ["a", "b", "main"]
    # Less than its neighbours it cannot be their sum.
    del layers["V.all of it"]
    layers["V.main"] *= np.float32(0.1)
    groups = _read(tmp_path, layers, pattern="V.{name}")
    assert sorted(groups.basis.names) == ["a", "b", "main"]
    assert groups.beauty is None


def test_a_denoised_image_beside_noisy_groups(tmp_path: Path):
    """The groups add up to the noisy one, which a pattern matches too."""
    images = pictures()
    noisy = images.sum(axis=0)
    layers = _named(images, ["a", "b", "c"], "Image") | {"Noisy Image": noisy}
    grain = np.random.default_rng(1).uniform(0.9, 1.1, noisy.shape)
    layers["Image"] = (noisy * grain).astype(np.float32)
    groups = _read(tmp_path, layers, pattern="{name}")
    assert groups.basis.names == ("a", "b", "c", "rest")
    assert groups.beauty is not None
    assert groups.beauty.name == "Image"
    assert any(
        "add up to Noisy Image; what denoising changed in Image" in x for x in groups.remarks
    )
    # Without the noisy one what denoising changed is in `rest` as well.
    del layers["Noisy Image"]
    groups = _read(tmp_path, layers, pattern="{name}")
    assert groups.basis.names == ("a", "b", "c", "rest")
    assert any("is the beauty denoised" in x for x in groups.remarks)


@pytest.mark.parametrize("odd", ["sun normal", "wall_albedo", "a_noisy", "a_variance", "normal"])
def test_a_group_may_be_called_like_a_version_of_a_layer(tmp_path: Path, odd: str):
    images = pictures()
    names = [f"V.Combined_{x}" for x in ("a", "b", odd)]
    groups = _read(tmp_path, _named(images, names, "V.Combined"))
    assert sorted(groups.basis.names) == sorted(["a", "b", odd])
    assert not groups.has_rest
    assert not any("another version" in x for x in groups.remarks)


def test_all_groups_may_be_called_so(tmp_path: Path):
    names = ["V.Combined_wall albedo", "V.Combined_sun normal"]
    groups = _read(tmp_path, _named(pictures(2), names, "V.Combined"))
    assert sorted(groups.basis.names) == ["sun normal", "wall albedo"]


@pytest.mark.parametrize("lacks", [False, True])
@pytest.mark.parametrize("beauty", ["RGBA", None])
def test_versions_of_a_layer_are_left_out(tmp_path: Path, lacks: bool, beauty: str | None):
    images = pictures(4)
    layers = {"RGBA_a": images[0], "RGBA_b": images[1], "RGBA_a_denoised": images[0] * 0.95}
    layers |= {"RGBA_variance": images[2], "RGBA_denoised": images[:2].sum(axis=0) * 0.95}
    if beauty:
        layers[beauty] = images[:2].sum(axis=0) + images[3] * lacks
    groups = _read(tmp_path, layers)
    assert groups.basis.names == ("a", "b", "rest")[: 3 if beauty and lacks else 2]
    assert any("RGBA_a_denoised, RGBA_denoised, RGBA_variance" in x for x in groups.remarks)


def test_files_with_a_number_behind_their_names(tmp_path: Path):
    """Blender's File Output node writes one for each frame, without a separator."""
    images = pictures(2)
    picture = images.sum(axis=0) * np.random.default_rng(1).uniform(0.9, 1.1, images[0].shape)
    for name, image in (("Image", picture), ("key", images[0]), ("fill", images[1])):
        interleaved(tmp_path / f"{name}0001.exr", {"": image.astype(np.float32)})
    groups = read_light_groups(tmp_path)
    assert groups.basis.names == ("fill", "key", "rest")
    assert groups.beauty is not None
    assert groups.beauty.name == "Image"
