"""Passes beside light groups: what pictures are denoised by is found, and is no light."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from light_groups import SIZE, channels, interleaved, pictures, write

from lightpaint.basis.denoised_mixes import blend_by_grain, denoise_plane
from lightpaint.basis.file.basis_file import read_basis, write_basis
from lightpaint.basis.lightgroups.light_groups import read_light_groups
from lightpaint.errors import BasisError
from lightpaint.images.denoiser import denoised, oidn_is_installed
from lightpaint.relit.export.nuke import needs_copy

Writer = Callable[..., Path]


def surfaces(*, seed: int = 5) -> tuple[Any, Any, Any]:
    """Albedo, normals of any length, and positions, (h, w, 3) float32."""
    rng = np.random.default_rng(seed)
    surface_planes = (
        rng.random((*SIZE, 3)),
        rng.normal(size=(*SIZE, 3)),
        rng.normal(size=(*SIZE, 3)),
    )
    return tuple(x.astype(np.float32) for x in surface_planes)


def cycles(view: str, images: Any, *, seed: int = 5) -> dict[str, Any]:
    """Channels of a view layer with denoising data and the pass of positions."""
    albedo, normal, position = surfaces(seed=seed)
    file_channels = channels(f"{view}.Combined", images.sum(axis=0))
    for name, image in zip("ab", images, strict=True):
        file_channels |= channels(f"{view}.Combined_{name}", image)
    file_channels |= channels(f"{view}.Denoising Albedo", albedo)
    file_channels |= channels(f"{view}.Denoising Normal", normal, names="XYZ")
    file_channels |= channels(f"{view}.Position", position, names="XYZ")
    return file_channels | {f"{view}.Denoising Depth.Z": position[..., 0]}


def write_one_part(path: Path, file_channels: dict[str, Any]) -> Path:
    return write(path, ("", file_channels))


def write_part_each(path: Path, file_channels: dict[str, Any]) -> Path:
    layers: dict[str, dict[str, Any]] = {}
    for name, plane in file_channels.items():
        layers.setdefault(name.rpartition(".")[0], {})[name] = plane
    return write(path, *layers.items())


@pytest.mark.parametrize("writer", [write_one_part, write_part_each])
def test_denoising_data_of_cycles(tmp_path: Path, writer: Writer):
    images = pictures(2)
    groups = read_light_groups(writer(tmp_path / "a.exr", cycles("ViewLayer", images)))
    albedo, normal, position = surfaces()
    features = groups.basis.features
    assert groups.basis.names == ("a", "b")
    assert features is not None
    np.testing.assert_array_equal(features.albedo, albedo)
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    np.testing.assert_allclose(features.normal, normal / length, rtol=1e-5, atol=1e-6)
    np.testing.assert_array_equal(features.position, position)
    assert groups.basis.indirect is None
    assert "pictures are denoised by albedo and normals of the file" in groups.remarks


def test_of_several_view_layers_the_surfaces_of_the_one_that_is_read(tmp_path: Path):
    file_channels = cycles("Far", pictures(2), seed=1) | cycles("Near", pictures(2), seed=2)
    groups = read_light_groups(write(tmp_path / "a.exr", ("", file_channels)))
    features = groups.basis.features
    assert groups.basis.origin.sensor == "Far"
    assert features is not None
    np.testing.assert_array_equal(features.albedo, surfaces(seed=1)[0])


def test_without_normals_there_are_no_features(tmp_path: Path):
    images = pictures(2)
    file_channels = {k: v for k, v in cycles("ViewLayer", images).items() if "Normal" not in k}
    basis = read_light_groups(write(tmp_path / "a.exr", ("", file_channels))).basis
    assert basis.names == ("a", "b")
    assert basis.features is None


def write_folder(path: Path, layers: dict[str, Any]) -> Path:
    path.mkdir()
    for name, image in layers.items():
        interleaved(path / f"shot_{name}_v1.exr", {"": image})
    return path


def test_files_of_surfaces_are_no_lights(tmp_path: Path):
    images, (albedo, normal, _) = pictures(2), surfaces()
    layers = {"key": images[0], "fill": images[1], "albedo": albedo, "normal": normal}
    groups = read_light_groups(write_folder(tmp_path / "lights", layers))
    assert set(groups.basis.names) == {"key", "fill"}
    assert groups.basis.features is not None
    np.testing.assert_array_equal(groups.basis.features.albedo, albedo)


def test_a_light_may_be_called_normal(tmp_path: Path):
    """Nothing but an albedo beside it says otherwise."""
    images = pictures(3)
    layers = dict(zip(("key", "fill", "normal"), images, strict=True))
    groups = read_light_groups(write_folder(tmp_path / "lights", layers))
    assert set(groups.basis.names) == {"key", "fill", "normal"}


def split(n: int = 2) -> tuple[Any, Any]:
    """Direct and indirect light of n lights."""
    return pictures(n), pictures(n, seed=1)


@pytest.mark.parametrize("passes_present", [("direct", "indirect"), ("indirect",), ("direct",)])
@pytest.mark.parametrize("label", ["{part}_{name}", "RGBA_{name}_{part}"])
def test_parts_of_each_light(tmp_path: Path, passes_present: tuple[str, ...], label: str):
    direct, indirect = split()
    layers = {"RGBA": (direct + indirect).sum(axis=0)}
    for k, name in enumerate(("key", "back light")):
        layers[f"RGBA_{name}"] = direct[k] + indirect[k]
        light_parts = {"direct": direct[k], "indirect": indirect[k]}
        layers |= {label.format(part=part, name=name): light_parts[part] for part in passes_present}
    groups = read_light_groups(interleaved(tmp_path / "a.exr", layers))
    parts = groups.basis.indirect
    assert groups.basis.names == ("back light", "key")  # in the order of the file's channels
    assert groups.missing is not None
    assert groups.missing < 1e-6
    assert parts is not None
    np.testing.assert_allclose(parts.planes.array(), indirect[::-1], atol=1e-5 * indirect.max())
    assert not parts.noise.array().any()
    assert any(x.endswith("by direct and indirect light of the file") for x in groups.remarks)


def test_what_has_no_parts_counts_as_indirect(tmp_path: Path):
    """All of it is denoised then, as it was before there were parts; and so is the rest."""
    direct, indirect = split()
    total = direct + indirect
    layers = {
        "RGBA": total.sum(axis=0) + 1,
        "RGBA_a": total[0],
        "RGBA_b": total[1],
        "indirect_b": indirect[1],
    }
    groups = read_light_groups(interleaved(tmp_path / "a.exr", layers))
    parts = groups.basis.indirect
    assert groups.basis.names == ("a", "b", "rest")
    assert parts is not None
    expected = [total[0], indirect[1], groups.basis.images[2]]
    for plane, image in zip(parts.planes, expected, strict=True):
        np.testing.assert_array_equal(plane, image)


@pytest.mark.parametrize("pattern", [None, "{name}", "Light pass {name}"])
def test_both_parts_alone_are_one_light(tmp_path: Path, pattern: str | None):
    """As Octane may write them; the file has no layer of their sum."""
    direct, indirect = split()
    indirect[1] = 0
    layers = {"Main": (direct + indirect).sum(axis=0)}
    for k in range(2):
        layers[f"Light pass {k + 1} direct"] = direct[k]
        layers[f"Light pass {k + 1} indirect"] = indirect[k]
    groups = read_light_groups(interleaved(tmp_path / "a.exr", layers), pattern=pattern)
    names = {None: "light_{}", "{name}": "Light pass {}"}.get(pattern, "{}")
    assert groups.basis.names == (names.format(1), names.format(2))
    np.testing.assert_array_equal(groups.basis.images, direct + indirect)
    assert groups.basis.indirect is not None
    np.testing.assert_array_equal(groups.basis.indirect.planes.array(), indirect)
    # No layer of the file is a light, so Nuke reads a copy.
    assert needs_copy(groups)


def test_lamps_that_a_user_calls_direct_and_indirect_are_two(tmp_path: Path):
    up, down = pictures(2)
    layers = {"RGBA": up + down, "RGBA_cove_indirect": up, "RGBA_cove_direct": down}
    groups = read_light_groups(interleaved(tmp_path / "a.exr", layers))
    assert groups.basis.names == ("cove_direct", "cove_indirect")


def test_a_light_may_be_named_like_a_part(tmp_path: Path):
    """It is brighter somewhere than the light whose part it would be."""
    images = pictures(2)
    layers = {"RGBA": images.sum(axis=0), "RGBA_cove": images[0], "RGBA_cove_indirect": images[1]}
    groups = read_light_groups(interleaved(tmp_path / "a.exr", layers))
    assert groups.basis.names == ("cove", "cove_indirect")
    assert groups.basis.indirect is None


def test_passes_alone_are_no_light_groups(tmp_path: Path):
    albedo, normal, _ = surfaces()
    file_channels = channels("albedo", albedo) | channels("N", normal, names="XYZ")
    with pytest.raises(BasisError):
        read_light_groups(write(tmp_path / "a.exr", ("", file_channels)))
    with pytest.raises(BasisError, match="has no RGB layers"):
        read_light_groups(write(tmp_path / "b.exr", ("", channels("N", normal, names="XYZ"))))


def test_normals_of_another_size_are_passed_by(tmp_path: Path):
    images, (albedo, normal, _) = pictures(2), surfaces()
    layers = {"key": images[0], "fill": images[1], "albedo": albedo}
    folder = write_folder(tmp_path / "lights", layers)
    small = channels("", normal[::2, ::2], names="XYZ")
    write(folder / "shot_normal_v1.exr", ("", small))
    basis = read_light_groups(folder).basis
    assert set(basis.names) == {"key", "fill"}
    assert basis.features is None


def test_a_saved_basis_keeps_them(tmp_path: Path):
    file_channels = cycles("ViewLayer", pictures(2))
    basis = read_light_groups(write(tmp_path / "a.exr", ("", file_channels))).basis
    write_basis(tmp_path / "b.basis.exr", basis)
    reread = read_basis(tmp_path / "b.basis.exr")
    assert reread.features is not None
    assert basis.features is not None
    # Albedo and normals become half floats.
    np.testing.assert_allclose(reread.features.albedo, basis.features.albedo, rtol=2**-11)
    np.testing.assert_array_equal(reread.features.position, basis.features.position)


def test_grain_is_taken_out_of_light_of_unknown_noise():
    """Of white noise neighbours share nothing, and the share of the denoised form is 1."""
    rng = np.random.default_rng(7)
    truth = np.full((120, 160, 3), 2, np.float32)
    raw = truth + rng.normal(size=truth.shape).astype(np.float32)
    remaining_error = np.square(blend_by_grain(raw, truth) - truth).mean()
    # A mean over 121 pixels of what differs by chance, the largest of four directions: some 0.1.
    assert remaining_error < 0.03


@pytest.mark.parametrize("step", [(0, 1), (1, 0), (1, 1)])
def test_edges_stay_in_light_of_unknown_noise(step: tuple[int, int]):
    """A denoised form that has blurred an edge differs alike along it."""
    y, x = np.mgrid[:80, :100]
    edge = ((step[1] * y - step[0] * x) % 24 < 12)[..., None] * np.ones(3, np.float32)
    blurred = (np.roll(edge, 1, (0, 1)) + edge + np.roll(edge, -1, (0, 1))) / 3
    if step == (1, 1):
        blurred = (np.roll(edge, 1, 0) + edge + np.roll(edge, -1, 0)) / 3
    interior = np.s_[14:-14, 14:-14]  # Beyond the border a picture goes on at its other end.
    blur_error = np.square(blurred - edge)[interior].mean()
    assert blur_error > 0.01
    assert np.square(blend_by_grain(edge, blurred) - edge)[interior].mean() < 1e-6


@pytest.mark.skipif(not oidn_is_installed(), reason="Open Image Denoise")
def test_parts_and_surfaces_keep_what_a_denoiser_blurs(tmp_path: Path):
    """A texture and pools of direct light, in noisy indirect light, against the picture alone."""
    rng = np.random.default_rng(8)
    y, x = np.mgrid[:96, :128]
    albedo = np.where((x + y) % 4 < 2, np.float32(0.8), np.float32(0.2))[..., None]
    albedo = albedo * np.ones(3, np.float32)
    direct = ((x // 8 + y // 8) % 2).astype(np.float32)[..., None] * albedo
    truth = direct + albedo
    indirect = albedo * rng.exponential(size=(96, 128, 1)).astype(np.float32)
    normal = np.broadcast_to(np.float32([0, 0, 1]), albedo.shape)
    layers = {"RGBA": direct + indirect, "RGBA_key": direct + indirect, "indirect_key": indirect}
    file_channels = {
        k: v for name, image in layers.items() for k, v in channels(name, image).items()
    }
    file_channels |= channels("albedo", albedo) | channels("N", normal, names="XYZ")
    basis = read_light_groups(write(tmp_path / "a.exr", ("", file_channels))).basis
    error = np.square(denoise_plane(basis, 0) - truth).mean()
    plain_error = np.square(denoised(basis.planes.plane(0)) - truth).mean()
    assert error < 0.2 * plain_error
