"""Which layer is the sum of others: as the plain definition says, at a pass over each."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from light_groups import interleaved, pictures

from lightpaint.basis.lightgroups.beauty_comparison import (
    LayerSum,
    find_beauty,
    find_beauty_of_lights,
    rounding,
)
from lightpaint.basis.lightgroups.light_groups import read_light_groups
from lightpaint.basis.lightgroups.render_layers import RenderLayer


def _layers(images: Any, kind: Any = np.float32) -> list[RenderLayer]:
    return [
        RenderLayer(f"l{k}", Path("a.exr"), "", ("R", "G", "B"), (), image.astype(kind))
        for k, image in enumerate(images)
    ]


def _adds_up(beauty: RenderLayer, lights: list[RenderLayer]) -> bool:
    """The definition: off by more than rounding, in all, by a 1e-5 of the light."""
    total = sum(layer.image.astype(np.float64) for layer in lights)
    beyond = np.maximum(np.abs(beauty.image - total) - rounding([*lights, beauty]), 0)
    size = np.abs(beauty.image.astype(np.float64)).sum()
    return bool(size > 0 and np.nansum(beyond) <= 1e-5 * size)


@pytest.mark.parametrize("kind", [np.float16, np.float32])
@pytest.mark.parametrize("relative_error", [0, 2e-6, 2e-5, 1e-3])
@pytest.mark.parametrize("location", ["everywhere", "in one pixel"])
def test_sums_are_found_as_the_definition_says(kind: Any, relative_error: float, location: str):
    images = pictures(5, size=(37, 29))
    total = images.sum(axis=0)
    error = relative_error * total if location == "everywhere" else np.zeros_like(total)
    if location == "in one pixel":
        # One that a coarse look does not see.
        error[3, 5] = relative_error * total.sum() / 3
    layers = _layers([*images, total + error], kind)
    lights, picture = layers[:-1], layers[-1]
    expected = _adds_up(picture, lights)
    # In float16 some of it is rounding, unless it is all in one place.
    rounds_away = kind == np.float16 and location == "everywhere" and relative_error < 1e-4
    assert expected is (relative_error < 1e-5 or rounds_away)
    assert LayerSum.of(lights).is_of(picture) is expected
    assert (find_beauty_of_lights([lights[0], picture], lights) is picture) is expected
    assert (find_beauty(layers) is picture) is expected
    for light in lights:
        assert not _adds_up(light, [x for x in layers if x is not light])
        assert not LayerSum.of(layers).is_of(light, less_itself=True)


def test_black_is_no_sum():
    black = _layers(np.zeros((3, 9, 9, 3)))
    assert find_beauty(black) is None
    assert find_beauty_of_lights(black, black) is None


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_pixels_without_a_number_have_no_say(bad: float):
    images = pictures(4, size=(20, 20))
    total = images.sum(axis=0)
    images[1, 3, 3] = bad
    layers = _layers([*images, total])
    assert find_beauty(layers) is layers[-1]
    assert find_beauty_of_lights(layers[-1:], layers[:-1]) is layers[-1]


def test_one_more_layer():
    layers = _layers(pictures(4))
    added = LayerSum.of(layers[:3])
    extra_sum, total = added.and_also(layers[3]), LayerSum.of(layers)
    np.testing.assert_allclose(extra_sum.total, total.total, rtol=1e-14)
    np.testing.assert_allclose(extra_sum.bound, total.bound, rtol=1e-14)
    assert total.lacks(layers[0]) == pytest.approx(
        np.abs(sum(x.image.astype(np.float64) for x in layers[1:])).sum(), rel=1e-12
    )


class _Counted(np.ndarray):
    """Counts how many numbers are taken from it to compute with, in any arithmetic."""

    read = 0

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        _Counted.read += sum(x.size for x in inputs if isinstance(x, _Counted))
        plain = [np.asarray(x) if isinstance(x, _Counted) else x for x in inputs]
        return getattr(ufunc, method)(*plain, **options)


def test_every_layer_is_gone_through_a_few_times_however_many_there_are():
    images = pictures(24, size=(40, 40))
    layers = _layers(images)
    for layer in layers:
        object.__setattr__(layer, "image", layer.image.view(_Counted))
    _Counted.read = 0
    assert find_beauty(layers) is None
    # Sum, bound, size and the coarse look. With a sum for each candidate it would be 24 times
    # as many.
    assert 0 < _Counted.read < 12 * images.size


def _lossy_layers(
    path: Path,
    compression: str,
    kind: Any,
    extra: float,
    *,
    is_even: bool = False,
    light: float = 1,
    level: float | None = None,
) -> dict[str, Any]:
    """Layers with grain, and one light of a hundredth of the picture in a corner, in no group.

    is_even: whether it shines on all that the others do, in proportion, where it hides best.
    light: a factor of all. level: of DWA.
    """
    rng = np.random.default_rng(3)
    y, x = (side[..., None] for side in np.mgrid[:64, :96])
    smooth = [np.exp(np.sin(x / a) + np.cos(y / b)) for a, b in ((9, 14), (17, 8), (30, 30))]
    images = np.stack([light * s * rng.gamma(9, 1 / 9, (64, 96, 3)) for s in smooth])
    images = images.astype(np.float32)
    corner = np.zeros_like(images[0])
    corner[:16, :16] = extra * images.sum() / (16 * 16 * 3)
    if is_even:
        corner = extra * images.sum(axis=0)
    layers = {"Combined": images.sum(axis=0) + corner}
    layers |= {f"Combined_{name}": image for name, image in zip("abc", images, strict=True)}
    header = {"compression": getattr(OpenEXR, f"{compression}_COMPRESSION")}
    header |= {} if level is None else {"dwaCompressionLevel": level}
    return {"path": interleaved(path / "a.exr", layers, kind=kind, header=header)}


@pytest.mark.parametrize(
    ("compression", "kind"),
    [
        ("DWAA", np.float16),
        ("DWAB", np.float32),
        ("B44", np.float16),
        ("B44A", np.float16),
        ("LJ2K", np.float16),
        ("LJ2K", np.float32),
    ],
)
def test_what_lossy_compression_changes_is_not_missing(tmp_path: Path, compression: str, kind: Any):
    groups = read_light_groups(**_lossy_layers(tmp_path, compression, kind, extra=0))
    assert groups.basis.names == ("a", "b", "c")
    assert groups.missing is not None
    assert groups.missing > 1e-4  # which without the loss would be a rest
    [remark] = [x for x in groups.remarks if "add up" in x]
    assert f"the lossy compression {compression}" in remark
    [hidden] = re.findall(r"may hide a lamp of up to ([\d.]+) % of it", remark)
    # A light that is missing is missing.
    groups = read_light_groups(**_lossy_layers(tmp_path, compression, kind, extra=0.01))
    assert groups.has_rest
    [remark] = [x for x in groups.remarks if "lack" in x]
    assert f"some of it is the loss of the compression {compression}" in remark
    # So is every one that is larger than what may be hidden, wherever it shines.
    assert 0 < float(hidden) < 20
    share = 1.02 * float(hidden) / 100  # of the beauty, of which two digits are shown
    larger = _lossy_layers(tmp_path, compression, kind, extra=share / (1 - share), is_even=True)
    assert read_light_groups(**larger).has_rest


@pytest.mark.parametrize("compression", ["DWAA", "DWAB", "LJ2K", "B44"])
@pytest.mark.parametrize("light", [1e-3, 1e-2, 0.1, 100])
def test_compression_loses_more_of_dark_pictures(tmp_path: Path, compression: str, light: float):
    """Those that quantise along a curve as eyes see; B44 keeps shares."""
    groups = read_light_groups(**_lossy_layers(tmp_path, compression, np.float16, 0, light=light))
    assert not groups.has_rest
    dark = _lossy_layers(tmp_path, compression, np.float16, extra=0.6, light=light)
    assert read_light_groups(**dark).has_rest


@pytest.mark.parametrize("light", [1e-6, 1e-5, 1e-4, 1e-3])
def test_lj2k_of_floats_loses_as_much_of_the_darkest_specks(tmp_path: Path, light: float):
    """A pixel of a hundred is lit; its error is that of one that is a thousand times brighter."""
    rng = np.random.default_rng(4)
    size = (3, 64, 96, 3)
    images = (light * (rng.random(size) < 0.01) * rng.random(size)).astype(np.float32)
    layers = {"Combined": images.sum(axis=0)}
    layers |= {f"Combined_{name}": image for name, image in zip("abc", images, strict=True)}
    header = {"compression": OpenEXR.LJ2K_COMPRESSION}
    path = interleaved(tmp_path / "a.exr", layers, kind=np.float32, header=header)
    assert not read_light_groups(path).has_rest


@pytest.mark.parametrize("level", [0.0, 1.0, 10.0, 200.0])
@pytest.mark.parametrize("light", [1e-3, 1, 1000])
def test_what_dwa_loses_grows_with_its_level(tmp_path: Path, level: float, light: float):
    kinds = {"compression": "DWAB", "kind": np.float16, "light": light, "level": level}
    groups = read_light_groups(**_lossy_layers(tmp_path, extra=0, **kinds))
    assert not groups.has_rest
    assert any("the lossy compression DWAB" in x for x in groups.remarks)


@pytest.mark.parametrize(
    ("compression", "kind"),
    [("B44", np.float32), ("PXR24", np.float16), ("ZSTD", np.float16), ("HTJ2K32", np.float32)],
)
def test_lossless_compression_is_not_called_lossy(tmp_path: Path, compression: str, kind: Any):
    for extra, is_missing in ((0, False), (3e-4, True)):
        groups = read_light_groups(**_lossy_layers(tmp_path, compression, kind, extra))
        assert groups.has_rest is is_missing
        assert not any("compression" in x for x in groups.remarks)
