"""Which layers of a file are lights, by their names alone."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lightpaint.basis.lightgroups.layer_roles import LayerChoice, choose_files, choose_layers
from lightpaint.basis.lightgroups.naming_conventions import short_names
from lightpaint.errors import BasisError


def _choose(*names: str, pattern: str | None = None) -> LayerChoice:
    return choose_layers(dict.fromkeys(names, ()), pattern=pattern, file_name="a.exr")


CASES: list[tuple[str, list[str], dict[str, str], str | None]] = [
    (
        "Blender Cycles",
        [
            "ViewLayer.Combined",
            "ViewLayer.Combined_Key Area",
            "ViewLayer.Combined_sun",
            "ViewLayer.Depth",
        ],
        {"Key Area": "ViewLayer.Combined_Key Area", "sun": "ViewLayer.Combined_sun"},
        "ViewLayer.Combined",
    ),
    ("Blender Cycles", ["Combined", "Combined_a"], {"a": "Combined_a"}, "Combined"),
    ("Blender Cycles", ["Combined_a_Combined_b"], {"a_Combined_b": "Combined_a_Combined_b"}, None),
    (
        "Blender Cycles, written by Nuke",
        ["View_Layer_Combined", "View_Layer_Combined_Key_Area", "View_Layer_Combined_sun"],
        {"Key_Area": "View_Layer_Combined_Key_Area", "sun": "View_Layer_Combined_sun"},
        "View_Layer_Combined",
    ),
    (
        "Blender Cycles, written by Nuke",
        ["", "ViewLayer_Combined_sun", "ViewLayer_Normal"],
        {"sun": "ViewLayer_Combined_sun"},
        "",
    ),
    # With "Split per LPE Tag" Karma splits its beauty, C, by the tags of lights.
    (
        "Karma",
        ["", "C_Key", "C_Fill", "C_Rim", "beautyunshadowed"],
        {"Key": "C_Key", "Fill": "C_Fill", "Rim": "C_Rim"},
        "",
    ),
    (
        "Arnold",
        ["", "RGBA_key", "RGBA_default", "diffuse_key", "N"],
        {"key": "RGBA_key", "default": "RGBA_default"},
        "",
    ),
    ("Karma", ["C", "C_key", "C_a.b", "N"], {"key": "C_key", "a.b": "C_a.b"}, "C"),
    ("RenderMan or Redshift", ["Ci", "beauty_key"], {"key": "beauty_key"}, "Ci"),
    (
        "RenderMan or Redshift",
        ["", "Beauty_key", "Beauty_fill", "Beauty_denoised"],
        {"key": "Beauty_key", "fill": "Beauty_fill"},
        "",
    ),
    (
        "LuxCore",
        ["RADIANCE_GROUP_0", "RADIANCE_GROUP_12"],
        {"group_0": "RADIANCE_GROUP_0", "group_12": "RADIANCE_GROUP_12"},
        None,
    ),
    (
        "V-Ray or Corona",
        ["", "LightSelect_key", "VRayLightSelect_sun"],
        {"key": "LightSelect_key", "sun": "VRayLightSelect_sun"},
        "",
    ),
    (
        "Octane",
        ["Main", "Light 1", "Light pass 2", "Light 1 direct"],
        {"light_1": "Light 1", "light_2": "Light pass 2"},
        "Main",
    ),
    # Renderers that run in Blender write their names behind the view layer.
    (
        "RenderMan or Redshift",
        ["ViewLayer.Combined", "ViewLayer.Ci_key", "ViewLayer.Ci_fill", "ViewLayer.Depth"],
        {"key": "ViewLayer.Ci_key", "fill": "ViewLayer.Ci_fill"},
        "ViewLayer.Combined",
    ),
    (
        "LuxCore in Blender",
        ["ViewLayer.Combined", 'ViewLayer.LG 1: "Default Lightgroup"', 'ViewLayer.LG 2: "a.b"'],
        {
            "Default Lightgroup": 'ViewLayer.LG 1: "Default Lightgroup"',
            "a.b": 'ViewLayer.LG 2: "a.b"',
        },
        "ViewLayer.Combined",
    ),
    (
        "Radeon ProRender",
        ["View Layer.Combined", "View Layer.Light Group 1", "View Layer.Light Group 2"],
        {"group_1": "View Layer.Light Group 1", "group_2": "View Layer.Light Group 2"},
        "View Layer.Combined",
    ),
    (
        "Arnold",
        ["a.b.RGBA_key", "a.b.RGBA_c.d", "a.b.RGBA"],
        {"key": "a.b.RGBA_key", "c.d": "a.b.RGBA_c.d"},
        "a.b.RGBA",
    ),
    # The beauty of another view layer is none.
    ("Karma", ["near.C", "far.C_key"], {"key": "far.C_key"}, None),
]


@pytest.mark.parametrize(("renderer", "names", "lights", "beauty"), CASES)
def test_each_renderer_by_its_names(
    renderer: str, names: list[str], lights: dict[str, str], beauty: str | None
):
    choice = _choose(*names)
    assert choice.renderer == renderer
    assert choice.lights == lights
    assert list(choice.lights) == list(lights)  # in the order of the file
    assert choice.beauty == beauty


def test_layers_that_may_belong_to_the_sum_are_told_apart():
    choice = _choose(
        "", "LightSelect_key", "Environment", "Self Illumination", "Rest", "Reflection"
    )
    assert choice.lights == {"key": "LightSelect_key"}
    assert sorted(choice.optional) == ["Environment", "Rest", "Self Illumination"]


def test_of_several_view_layers_the_first():
    names = ["far.Combined", "far.Combined_a", "near.Combined", "near.Combined_a"]
    choice = _choose(*names)
    assert (choice.lights, choice.beauty, choice.view) == (
        {"a": "far.Combined_a"},
        "far.Combined",
        "far",
    )
    [remark] = choice.remarks
    assert "pattern='near.Combined_{name}' takes near" in remark
    [remark] = _choose("a.Ci_key", "b.Ci_key").remarks
    assert "pattern='b.Ci_{name}' takes b" in remark
    other = _choose(*names, pattern="near.Combined_{name}")
    assert (other.lights, other.beauty) == ({"a": "near.Combined_a"}, "near.Combined")


def test_of_several_eyes_one_must_be_named():
    names = [f"View.Combined{n}.{eye}" for n in ("", "_a", "_b") for eye in ("left", "right")]
    with pytest.raises(BasisError, match=r"the views left and right.*_\{name\}\.left'"):
        _choose(*names)
    choice = _choose(*names, pattern="View.Combined_{name}.left")
    assert list(choice.lights) == ["a", "b"]
    assert choice.beauty == "View.Combined.left"
    # Names with dots are not eyes.
    assert list(_choose("C", "C_lamp.1", "C_lamp.2", "C_key").lights) == ["lamp.1", "lamp.2", "key"]


def test_only_where_a_renderer_calls_the_sum_so_a_group_may_be_all_of_them():
    choice = _choose("Beauty", "Beauty_all", "Beauty_key")
    assert (list(choice.lights), choice.whole, choice.beauty) == (
        ["key"],
        {"all": "Beauty_all"},
        "Beauty",
    )
    assert list(_choose("Beauty", "Beauty_all").lights) == ["all"]


@pytest.mark.parametrize(
    ("layer", "beauty"),
    [
        ("ViewLayer.Combined_{}", "ViewLayer.Combined"),
        ("RGBA_{}", "RGBA"),
        ("C_{}", "C"),
        ("LightSelect_{}", ""),
    ],
)
def test_elsewhere_a_light_may_be_called_all(layer: str, beauty: str):
    choice = _choose(beauty, layer.format("all"), layer.format("key"))
    assert (list(choice.lights), choice.whole, choice.beauty) == (["all", "key"], {}, beauty)


@pytest.mark.parametrize(
    ("names", "lights"),
    [
        (["on_RADIANCE_GROUP_0", "on_RADIANCE_GROUP_1"], ["group_0", "group_1"]),
        (["on.RADIANCE_GROUP_0"], ["group_0"]),
        (["my shot RADIANCE_GROUP_3_v2", "my shot RADIANCE_GROUP_4_v2"], ["group_3", "group_4"]),
        (["on_RADIANCE_GROUP_0", "off_RADIANCE_GROUP_0"], ["on_group_0", "off_group_0"]),
        (["RADIANCE_GROUP_0", "off_RADIANCE_GROUP_0"], ["group_0", "off_group_0"]),
        (["s01_LightSelect_key", "s01_VRayLightSelect_fill"], ["key", "fill"]),
        (["a.LightSelect_key", "b.LightSelect_key"], ["a_key", "b_key"]),
        (["LightSelect_x_LightSelect_y"], ["x_LightSelect_y"]),
    ],
)
def test_what_stands_before_a_marker_is_left_out_unless_it_tells_lights_apart(
    names: list[str], lights: list[str]
):
    assert list(_choose(*names).lights) == lights
    assert list(_choose(*names).lights.values()) == names


def test_a_pattern_finds_what_no_convention_does():
    choice = _choose("beauty", "L[1].key!", "L[1].fill!", "depth", pattern="L[1].{name}!")
    assert choice.lights == {"key": "L[1].key!", "fill": "L[1].fill!"}
    assert choice.beauty == "beauty"
    # Parts and files have names too.
    choice = choose_layers(
        {"x": ("key.light",), "y": ("z",)}, pattern="{name}.light", file_name="a"
    )
    assert choice.lights == {"key": "x"}
    # So wide a pattern must not take the picture for a light before the sum says so.
    choice = _choose("rgba", "key", "fill", pattern="{name}")
    assert (list(choice.lights), choice.whole) == (["key", "fill"], {"rgba": "rgba"})
    # A plain R, G, B is the picture before a light that is called like one.
    choice = _choose("", "L_main", "L_key", pattern="L_{name}")
    assert (list(choice.lights), choice.beauty) == (["main", "key"], "")


@pytest.mark.parametrize(
    ("names", "pattern", "message"),
    [
        (
            ["", "L_key", "L_fill"],
            None,
            r"like pattern='L_\{name\}'; .* are R, G, B, L_key, L_fill",
        ),
        (
            ["V.Combined", "V.Depth", "V.Mist", "V.lamp 1", "V.lamp 2", "V.Denoising Normal"],
            None,
            r"like pattern='V\.lamp \{name\}'",
        ),
        (["V.Combined", "V.key", "V.fill"], None, r"like pattern='V\.\{name\}'"),
        (["a.l_key_x", "a.l_fill_x", "a.l_fill_y"], None, r"like pattern='a\.l_\{name\}'"),
        (["Image", "key", "fill"], None, r"like pattern='\{name\}'"),
        (["depth"], None, r"like pattern='Light_\{name\}'; its RGB layers are depth"),
        (["RGBA_key", "C_key"], None, "1 as of Arnold, 1 as of Karma"),
        (["a", "b"], "L_{name}", r"'L_\{name\}' fits no layer of a\.exr: its RGB layers are a, b"),
        (["a"], "L_", r"must have \{name\} once"),
        (["a"], "{name}{name}", r"must have \{name\} once"),
        (["LightSelect_a", "VRayLightSelect_a"], None, "has the light 'a' twice"),
        ([f"x{k}" for k in range(99)], None, "x61, … and 37 more$"),
    ],
)
def test_what_cannot_be_told_lists_the_layers(names: list[str], pattern: Any, message: str):
    with pytest.raises(BasisError, match=message) as raised:
        _choose(*names, pattern=pattern)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("stems", "short"),
    [
        (["shot_key_v1", "shot_fill_v1", "shot_beauty_v1"], ["key", "fill", "beauty"]),
        (["key", "keyring"], ["key", "keyring"]),
        (["a.0001", "b.0001"], ["a", "b"]),
        (["spot_1", "spot_2"], ["1", "2"]),
        (["key0001", "ray0001"], ["key", "ray"]),
        (["key0001", "key10001"], ["key0001", "key10001"]),
        (["a_b", "a"], ["a_b", "a"]),
        (["one"], ["one"]),
    ],
)
def test_what_all_files_share_is_left_out(stems: list[str], short: list[str]):
    assert list(short_names(stems).values()) == short


@given(st.lists(st.text("ab_.- ", min_size=1, max_size=6), min_size=1, max_size=5, unique=True))
def test_short_names_stay_apart(stems: list[str]):
    short = short_names(stems)
    assert list(short) == stems
    assert len(set(short.values())) == len(stems)
    assert all(name and name in stem for stem, name in short.items())


def test_files_of_any_name_are_lights_but_for_the_beauty():
    choice = choose_files(["key", "Beauty", "fill"])
    assert (choice.lights, choice.beauty) == ({"key": "key", "fill": "fill"}, "Beauty")


def test_of_several_views_each_has_a_name_in_the_remark() -> None:
    """Also the default view of an EXR of two eyes, whose layers have no view in their names."""
    choice = _choose("", "RGBA_key", "right", "right.RGBA_key")
    [remark] = choice.remarks
    assert str(remark).startswith("of the view layers (unnamed), right the first is taken")
