"""Light groups of other renderers, as files: read, held against the beauty, solved on."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from light_groups import SIZE, channels, interleaved, multi_part, pictures, write

from lightpaint.basis.file.basis_file import read_basis, write_basis
from lightpaint.basis.lightgroups.light_groups import LightGroups, read_light_groups
from lightpaint.basis.lightgroups.render_layers import is_light_groups
from lightpaint.colour.primaries import to_rec709
from lightpaint.errors import BasisError, ImageError
from lightpaint.lighting.analysis.noise.noise_correction import correct_noise
from lightpaint.lighting.analysis.noise.uncertainty import error_bars
from lightpaint.lighting.default_solve import solve
from lightpaint.target.painted_target import Target

Writer = Callable[..., Path]

#: A sum of three float32 that was rounded once more: a few units in the last place.
FLOAT32 = 1e-6


def _layers(
    images: Any, *, name_pattern: str = "ViewLayer.Combined_{}", beauty: str = "ViewLayer.Combined"
):
    return {beauty: images.sum(axis=0)} | {
        name_pattern.format(name): image for name, image in zip("abc", images, strict=False)
    }


def _target(image: Any) -> Target:
    return Target("t", image.astype(np.float32), np.ones(image.shape[:2], np.float32), True)


def _solve(groups: LightGroups, image: Any) -> Any:
    return solve(groups.basis, _target(image)).lighting.weights_for(groups.basis)


@pytest.mark.parametrize("writer", [interleaved, multi_part])
def test_groups_that_add_up(tmp_path: Path, writer: Writer):
    images = pictures()
    groups = read_light_groups(writer(tmp_path / "a.exr", _layers(images)))
    basis = groups.basis
    assert basis.names == ("a", "b", "c")
    np.testing.assert_array_equal(basis.images, images)
    assert not groups.has_rest
    assert not basis.is_fixed.any()
    assert groups.missing is not None
    assert groups.missing < FLOAT32
    assert (basis.current_weights == 1).all()
    assert {light.unit for light in basis.lights} == {"× as rendered"}
    assert "the groups add up to the beauty" in groups.remarks
    assert not any("WARNING" in remark for remark in groups.remarks)


@pytest.mark.parametrize("writer", [interleaved, multi_part])
@pytest.mark.parametrize("lacks", [False, True])
def test_a_rebalanced_beauty_gives_back_its_multipliers(
    tmp_path: Path, writer: Writer, lacks: bool
):
    images = pictures(4)
    layers = _layers(images[:3]) | {"ViewLayer.Combined": images[: 4 if lacks else 3].sum(axis=0)}
    groups = read_light_groups(writer(tmp_path / "a.exr", layers))
    multipliers = np.array([[2, 1, 0.5], [0, 0.25, 3], [1, 1, 1]], np.float64)
    mixed = np.einsum("nhwc,nc->hwc", images[:3], multipliers) + images[3] * lacks
    actual = _solve(groups, mixed)
    # The painting and the rest are rounded to float32, the solve is in float64.
    np.testing.assert_allclose(actual[:3], multipliers, atol=10 * FLOAT32)
    assert groups.basis.names[3:] == (("rest",) if lacks else ())
    assert (actual[3:] == 1).all()


def test_what_is_missing_stays_and_is_told(tmp_path: Path):
    images = np.ones((3, *SIZE, 3), np.float32)
    layers = _layers(images) | {"ViewLayer.Combined": 4 * images[0]}
    groups = read_light_groups(interleaved(tmp_path / "a.exr", layers))
    assert groups.missing == pytest.approx(0.25, rel=FLOAT32)
    assert groups.exceeding == 0
    rest = groups.basis.lights[-1]
    assert (rest.name, rest.is_fixed) == ("rest", True)
    np.testing.assert_array_equal(groups.basis.image("rest"), images[0])
    assert any("lack 25 % of the light" in remark for remark in groups.remarks)
    assert not any("WARNING" in remark for remark in groups.remarks)


def test_groups_brighter_than_the_beauty_are_a_warning(tmp_path: Path):
    images = pictures()
    layers = _layers(images)
    # A beauty whose fireflies were clamped.
    layers["ViewLayer.Combined"] = np.minimum(layers["ViewLayer.Combined"], 1)
    groups = read_light_groups(interleaved(tmp_path / "a.exr", layers))
    assert groups.exceeding is not None
    assert groups.exceeding > 0.1
    assert any("WARNING" in remark and "clamped" in remark for remark in groups.remarks)
    total = groups.basis.mix(groups.basis.current_weights)
    np.testing.assert_allclose(total, layers["ViewLayer.Combined"], atol=10 * FLOAT32)


@pytest.mark.parametrize("scale", [1e-6, 1, 1e3])
def test_rounding_to_half_is_nothing_missing(tmp_path: Path, scale: float):
    path = interleaved(tmp_path / "a.exr", _layers(pictures() * scale), kind=np.float16)
    groups = read_light_groups(path)
    assert groups.is_half
    assert groups.missing is not None
    assert groups.missing > 1e-5  # which in float32 would be a rest
    assert not groups.has_rest


def test_a_rest_in_half_is_found(tmp_path: Path):
    images = pictures(4)
    layers = _layers(images[:3]) | {"ViewLayer.Combined": images[:3].sum(axis=0) + images[3] * 0.02}
    groups = read_light_groups(interleaved(tmp_path / "a.exr", layers, kind=np.float16))
    assert groups.has_rest


def test_without_a_beauty_nothing_is_made_up(tmp_path: Path):
    layers = {f"C_{name}": image for name, image in zip("abc", pictures(), strict=True)}
    groups = read_light_groups(interleaved(tmp_path / "a.exr", layers))
    assert (groups.beauty, groups.missing, groups.has_rest) == (None, None, False)
    assert any("no beauty" in remark for remark in groups.remarks)


def test_a_beauty_of_unknown_name_is_known_by_its_sum(tmp_path: Path):
    images = pictures()
    layers = _layers(images, name_pattern="RGBA_{}", beauty="final_v3") | {"N": pictures(seed=5)[0]}
    groups = read_light_groups(interleaved(tmp_path / "a.exr", layers))
    assert groups.beauty is not None
    assert groups.beauty.name == "final_v3"


def test_layers_beside_count_where_they_make_the_sum(tmp_path: Path):
    images = pictures(4)
    layers = {"LightSelect_key": images[0], "Environment": images[1], "Rest": images[2]}
    path = interleaved(tmp_path / "a.exr", {"": images[:2].sum(axis=0)} | layers)
    assert read_light_groups(path).basis.names == ("key", "Environment")
    whole_file = interleaved(tmp_path / "b.exr", {"": images[:3].sum(axis=0)} | layers)
    assert sorted(read_light_groups(whole_file).basis.names) == ["Environment", "Rest", "key"]


def test_a_light_called_rest_keeps_its_name(tmp_path: Path):
    layers = {"RGBA_rest": pictures()[0], "RGBA": 2 * pictures()[0]}
    groups = read_light_groups(interleaved(tmp_path / "a.exr", layers))
    assert groups.basis.names == ("rest", "rest_")


def test_messages_call_the_rest_by_its_name(tmp_path: Path):
    image = pictures()[0]
    groups = read_light_groups(
        interleaved(tmp_path / "a.exr", {"RGBA_rest": image, "RGBA": 2 * image})
    )
    assert any("becomes the fixed light rest_" in x for x in groups.remarks)
    layers = {"RGBA_rest": 2 * image, "RGBA": image}
    groups = read_light_groups(interleaved(tmp_path / "a.exr", layers))
    assert any("which the light rest_ subtracts" in x for x in groups.remarks)


@pytest.mark.parametrize("share", [0.0, 0.1, 0.6])
def test_whether_beauty_all_is_a_light_the_sum_tells(tmp_path: Path, share: float):
    """Redshift's is the sum. share: of the light of the picture that is in no group."""
    a, b = pictures(2)
    lights = {"Beauty_a": a, "Beauty_b": b}
    beauty = (a + b) / (1 - share)
    layers = {"Beauty": beauty, **lights, "Beauty_all": beauty}
    groups = read_light_groups(interleaved(tmp_path / "a.exr", layers))
    assert [light.name for light in groups.basis.lights if not light.is_fixed] == ["a", "b"]
    assert any("Beauty_all: taken for the sum" in x for x in groups.remarks)
    # A light that is called so.
    c = pictures(3)[2]
    layers = {"Beauty": a + b + c, **lights, "Beauty_all": c}
    groups = read_light_groups(interleaved(tmp_path / "b.exr", layers))
    assert sorted(groups.basis.names) == ["a", "all", "b"]
    # Without another picture it is the picture.
    groups = read_light_groups(interleaved(tmp_path / "c.exr", lights | {"Beauty_all": a + b}))
    assert groups.basis.names == ("a", "b")
    assert groups.beauty is not None
    assert groups.beauty.name == "Beauty_all"


def test_a_group_without_a_pixel_is_told_and_what_the_beauty_lacks(tmp_path: Path):
    images = np.ones((3, *SIZE, 3), np.float32)
    layers = _layers(images) | {"ViewLayer.Combined_a": 0 * images[0]}
    groups = read_light_groups(interleaved(tmp_path / "a.exr", layers))
    [remark] = [x for x in groups.remarks if "holds nothing of a:" in x]
    assert "33 % of the light of the beauty is in no group" in remark
    layers["ViewLayer.Combined"] = 2 * images[0]
    groups = read_light_groups(interleaved(tmp_path / "a.exr", layers))
    [remark] = [x for x in groups.remarks if "holds nothing of a:" in x]
    assert "is the light off" in remark


@pytest.mark.parametrize("names", [("r", "g", "b"), ("red", "green", "blue")])
def test_channels_in_other_words(tmp_path: Path, names: tuple[str, ...]):
    images = pictures()
    groups = read_light_groups(interleaved(tmp_path / "a.exr", _layers(images), names=names))
    np.testing.assert_array_equal(groups.basis.images, images)


def test_parts_with_plain_channels_have_their_names(tmp_path: Path):
    images = pictures()
    layers = _layers(images, name_pattern="LightSelect_{}", beauty="beauty")
    groups = read_light_groups(multi_part(tmp_path / "a.exr", layers, is_plain=True))
    assert groups.basis.names == ("a", "b", "c")
    assert groups.beauty is not None
    assert groups.beauty.name == "beauty"


@pytest.mark.parametrize(
    ("files", "lights"),
    [
        (["RADIANCE_GROUP_0", "RADIANCE_GROUP_1", "RGB"], ["group_0", "group_1"]),
        (["on_RADIANCE_GROUP_0", "on_RADIANCE_GROUP_1", "on_RGB"], ["group_0", "group_1"]),
        (["shot_key_v2", "shot_fill_v2", "shot_beauty_v2"], ["fill", "key"]),
        (["s.LightSelect_a", "s.LightSelect_b", "s.RGB_color"], ["a", "b"]),
        (["whatever", "key", "fill"], ["fill", "key"]),  # the last by its sum
    ],
)
def test_a_folder_with_a_file_for_each(tmp_path: Path, files: list[str], lights: list[str]):
    images = pictures(2)
    (tmp_path / "notes.txt").write_text("no image")
    order = sorted(files)
    picture = next(f for f in files if f.endswith(("RGB", "RGB_color", "beauty_v2", "whatever")))
    rest = iter(images)
    for file in order:
        image = images.sum(axis=0) if file == picture else next(rest)
        write(tmp_path / f"{file}.exr", ("rgb", channels("", image)))
    groups = read_light_groups(tmp_path)
    assert list(groups.basis.names) == lights
    np.testing.assert_array_equal(groups.basis.images, images)
    assert groups.beauty is not None
    assert groups.beauty.file.stem == picture
    assert is_light_groups(tmp_path)


def test_a_pattern_over_files(tmp_path: Path):
    images = pictures(2)
    for name, image in zip(["lgt-key-x", "lgt-fill-x"], images, strict=True):
        write(tmp_path / f"{name}.exr", ("rgb", channels("", image)))
    write(tmp_path / "albedo.exr", ("rgb", channels("", images[0])))
    groups = read_light_groups(tmp_path, pattern="lgt-{name}-x")
    assert set(groups.basis.names) == {"key", "fill"}


def test_sizes_must_agree(tmp_path: Path):
    for name, size in (("key", (6, 8)), ("fill", (5, 8))):
        write(tmp_path / f"{name}.exr", ("rgb", channels("", pictures(1, size=size)[0])))
    with pytest.raises(BasisError, match=r"key\.exr .* is 8x6 but .*fill\.exr .* is 8x5"):
        read_light_groups(tmp_path)


def test_a_crop_lies_where_it_was_cut(tmp_path: Path):
    """Cycles writes a border render into its data window."""
    images = pictures(2)
    layers = {"Combined": images.sum(axis=0), "Combined_a": images[0], "Combined_b": images[1]}
    path = interleaved(
        tmp_path / "a.exr",
        layers,
        header={
            "dataWindow": ((2, 1), (9, 6)),
            "displayWindow": ((0, 0), (11, 7)),
        },
    )
    basis = read_light_groups(path).basis
    assert basis.size == (8, 12)
    np.testing.assert_array_equal(basis.images[:, 1:7, 2:10], images)
    assert basis.images.sum() == pytest.approx(images.sum(), rel=FLOAT32)


def test_pixels_without_a_number_count_nothing(tmp_path: Path):
    images = pictures()
    layers = _layers(images)
    layers["ViewLayer.Combined_a"] = images[0].copy()
    layers["ViewLayer.Combined_a"][2, 3, 1] = np.nan
    layers["ViewLayer.Combined"] = layers["ViewLayer.Combined"].copy()
    layers["ViewLayer.Combined"][0, 0] = np.inf
    groups = read_light_groups(interleaved(tmp_path / "a.exr", layers))
    assert np.argwhere(groups.holes).tolist() == [[0, 0], [2, 3]]
    assert any("2 pixels hold NaN or Inf" in remark for remark in groups.remarks)
    assert not groups.has_rest
    painted = np.einsum("nhwc,n->hwc", images, [2, 0.5, 1])
    painted[0, 0] = painted[2, 3] = 100  # nobody can reach that, and nobody tries to
    np.testing.assert_allclose(
        _solve(groups, painted), np.repeat([[2], [0.5], [1]], 3, axis=1), atol=10 * FLOAT32
    )


def test_nothing_but_holes_is_refused(tmp_path: Path):
    layers = _layers(np.full((3, *SIZE, 3), np.nan, np.float32))
    with pytest.raises(BasisError, match="NaN or Inf in every pixel"):
        read_light_groups(interleaved(tmp_path / "a.exr", layers))


ACESCG = (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767)


@pytest.mark.parametrize("kind", [np.float32, np.float16])
@pytest.mark.parametrize(
    "header", [{"chromaticities": ACESCG}, {"colorInteropID": "lin_ap1_scene"}]
)
def test_other_primaries_are_converted(tmp_path: Path, header: dict[str, Any], kind: Any):
    images = pictures()
    path = interleaved(tmp_path / "a.exr", _layers(images), header=header, kind=kind)
    groups = read_light_groups(path)
    expected = np.einsum("nhwc,dc->nhwd", images.astype(kind), to_rec709(ACESCG))
    # The header holds the chromaticities in float32; images are rounded to it.
    *lights, rest = groups.basis.images
    np.testing.assert_allclose(lights, expected, atol=1e-5, rtol=1e-5)
    # What multiplying in these primaries changes is to be in it.
    assert not rest.any()
    assert groups.is_half == (kind == np.float16)
    assert "the file is linear ACEScg: lights are multiplied in it, as its renderer does" in (
        groups.remarks
    )


def test_one_space_in_two_words_is_one_space(tmp_path: Path):
    """Numbers are rounded by whoever writes them; names stand for the exact ones."""
    images = pictures()
    for k, (name, image) in enumerate(_layers(images).items()):
        rounded = {"chromaticities": tuple(round(x, 4) for x in ACESCG)}
        header = rounded if k % 2 else {"colorInteropID": "lin_ap1_scene"}
        interleaved(tmp_path / f"{name}.exr", {"": image}, header=header)
    groups = read_light_groups(tmp_path)
    expected = np.einsum("nhwc,dc->nhwd", images, to_rec709(ACESCG))
    # Rounding to four digits moves colours by as much.
    np.testing.assert_allclose(groups.basis.images[:3], expected, atol=2e-3, rtol=1e-3)


def test_light_of_a_wide_gamut_is_no_excess(tmp_path: Path):
    """Green of ACEScg is negative in Rec.709, and still light that the groups lack."""
    images = pictures(4)
    images[3, ..., [0, 2]] = 0
    layers = _layers(images[:3]) | {"ViewLayer.Combined": images.sum(axis=0)}
    header = {"chromaticities": ACESCG}
    groups = read_light_groups(interleaved(tmp_path / "a.exr", layers, header=header))
    assert (groups.basis.image("rest") < -0.01).any()
    assert groups.exceeding == pytest.approx(0, abs=FLOAT32)
    assert not any("WARNING" in remark for remark in groups.remarks)


def test_encoded_colours_are_refused(tmp_path: Path):
    header = {"colorInteropID": "srgb_rec709_display"}
    path = interleaved(tmp_path / "a.exr", _layers(pictures()), header=header)
    with pytest.raises(ImageError, match=r"colour space .srgb_rec709_display.* linear Rec\.709"):
        read_light_groups(path)


def test_a_sequence_of_frames_is_refused(tmp_path: Path):
    for frame in (1, 2):
        interleaved(tmp_path / f"shot.{frame:04}.exr", _layers(pictures()))
    with pytest.raises(BasisError, match=r"more than once: is it a sequence of frames"):
        read_light_groups(tmp_path)


@pytest.mark.parametrize(
    ("layers", "message"),
    [
        (lambda p: p.mkdir(), "holds no .exr file"),
        (lambda p: write(p, ("z", {"Z": np.ones(SIZE, np.float32)})), "has no RGB layers"),
        (lambda p: interleaved(p, {"depth": pictures()[0]}), "no layers named like"),
        (lambda p: interleaved(p, {"": pictures()[0]}), "no layers named like"),
    ],
)
def test_what_has_no_light_groups_is_refused(tmp_path: Path, layers: Any, message: str):
    path = tmp_path / "x.exr"
    layers(path)
    with pytest.raises(BasisError, match=message):
        read_light_groups(path)


def test_nobody_claims_that_there_is_no_noise(tmp_path: Path):
    groups = read_light_groups(interleaved(tmp_path / "a.exr", _layers(pictures())))
    assert not groups.basis.knows_noise
    solution = solve(groups.basis, _target(pictures(seed=3)[0]))
    assert error_bars(solution) is None
    with pytest.raises(BasisError, match="is unknown, so"):
        correct_noise(solution)


def test_the_basis_can_be_saved_and_is_no_light_group_file_then(tmp_path: Path):
    path = interleaved(tmp_path / "a.exr", _layers(pictures()))
    groups = read_light_groups(path)
    write_basis(tmp_path / "a.basis.exr", groups.basis)
    reread = read_basis(tmp_path / "a.basis.exr")
    np.testing.assert_array_equal(reread.images, groups.basis.images)
    assert replace(reread, planes=groups.basis.images).lights == groups.basis.lights
    assert not reread.knows_noise
    assert is_light_groups(path)
    assert not is_light_groups(tmp_path / "a.basis.exr")
    assert not is_light_groups(tmp_path / "none.exr")


def test_identity_is_of_what_is_in_it(tmp_path: Path):
    def identity(images: Any) -> str:
        path = interleaved(tmp_path / "a.exr", _layers(images))
        return read_light_groups(path).basis.origin.scene_identity

    assert identity(pictures()) == identity(pictures())
    assert identity(pictures()) != identity(pictures(seed=1))


def test_a_file_of_cycles(tmp_path: Path):
    """Rendered by Blender 5.0.1: area, point, spot, sun, mesh and world, and nothing else."""
    path = Path(__file__).parents[2] / "data" / "cycles_light_groups.exr"
    groups = read_light_groups(path)
    basis = groups.basis
    names = ("Key Area", "point_fill", "Spot_001", "sun", "emissive_mesh", "world")
    assert basis.names == names
    assert groups.missing is not None
    assert groups.exceeding is not None
    # Of groups that the renderer adds in float32.
    assert groups.missing + groups.exceeding < 1e-6
    assert groups.beauty is not None
    total = basis.mix(basis.current_weights)
    np.testing.assert_allclose(total, groups.beauty.image, rtol=1e-5, atol=1e-6)
    multipliers = np.random.default_rng(0).uniform(0, 3, (6, 3))
    multipliers[2] = 0
    np.testing.assert_allclose(_solve(groups, basis.mix(multipliers)), multipliers, atol=1e-4)


@pytest.mark.parametrize("position", [0, 2])
def test_a_light_that_takes_light_away_is_named_first(tmp_path: Path, position: int):
    """Before anything is said of their sum, which is of no use then."""
    images = pictures()
    images[position] *= -1
    with pytest.raises(BasisError, match=rf"the light group '{'abc'[position]}' takes light away"):
        read_light_groups(interleaved(tmp_path / "a.exr", _layers(images)))
    # Negative lobes of a filter at edges are no such thing.
    images[position] = np.abs(images[position])
    images[position, ::3] *= -0.1
    read_light_groups(interleaved(tmp_path / "b.exr", _layers(images)))


@pytest.mark.parametrize("in_parts", [False, True])
@pytest.mark.parametrize(
    ("layers", "names"),
    [
        (("ViewLayer_Combined_key", "ViewLayer_Combined_fill"), {"key", "fill"}),
        (("RGBA_key", "RGBA_fill"), {"key", "fill"}),
        (("C_key", "C_fill"), {"key", "fill"}),
        (("VRayLightSelect_key", "VRayLightSelect_fill"), {"key", "fill"}),
        (("RADIANCE_GROUP_0", "RADIANCE_GROUP_1"), {"group_0", "group_1"}),
        (("Light_1", "Light_2"), {"light_1", "light_2"}),
    ],
)
def test_layers_as_nuke_writes_them(
    tmp_path: Path, layers: Sequence[str], names: set[str], in_parts: bool
) -> None:
    images = pictures(2)
    colors = ("red", "green", "blue")
    beauty = channels("", images.sum(axis=0))
    parts = [(x, channels(x, y, names=colors)) for x, y in zip(layers, images, strict=True)]
    if in_parts:
        file = write(tmp_path / "nuke.exr", ("rgba", beauty), *parts)
    else:
        file = write(tmp_path / "nuke.exr", ("", beauty | parts[0][1] | parts[1][1]))
    groups = read_light_groups(file)
    assert set(groups.basis.names) == names
    assert groups.beauty is not None
    assert groups.missing == pytest.approx(0, abs=1e-6)
