"""From emitters to lights: groups, filters, what is kept, and every way to ask wrongly."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

from lightpaint.arrays import RGB
from lightpaint.errors import SceneError
from lightpaint.scene.lights.emitters import Emitter
from lightpaint.scene.lights.light import Light
from lightpaint.scene.lights.light_choice import REST, choose_lights
from lightpaint.scene.lights.lights_file import read_lights_file
from lightpaint.scene.properties.emission import MULTIPLE, EmissionKind, Scaling

AREA = EmissionKind(Scaling.COLOUR, "radiance", "W/(m² sr)")
POINT = EmissionKind(Scaling.COLOUR, "intensity", "W/sr")
IMAGE = EmissionKind(Scaling.IMAGE, "radiance", MULTIPLE)
FACTORS = EmissionKind(Scaling.FACTORS, "radiance", MULTIPLE, ("scale",))
ONE: RGB = (1.0, 1.0, 1.0)
OBSTACLE = "has a textured radiance that is neither a bitmap nor a single colour"


def emitters(*kinds: tuple[str, EmissionKind | None, RGB]) -> tuple[Emitter, ...]:
    return tuple(
        Emitter(
            name, "area", kind, rgb, "form", 1.0, k, 0, 10 * k, "" if kind is not None else OBSTACLE
        )
        for k, (name, kind, rgb) in enumerate(kinds)
    )


HALL = emitters(
    ("key", AREA, (4, 3, 2)),
    ("bulb_1", POINT, (1, 2, 3)),
    ("window_1", AREA, ONE),
    ("bulb_2", POINT, (1, 2, 3)),
    ("window_2", AREA, (2, 2, 2)),
    ("sky", IMAGE, ONE),
    ("mesh", FACTORS, ONE),
    ("screen", None, ONE),
)


def choose(
    lights: Sequence[str] | None = None,
    groups: Mapping[str, Sequence[str]] | None = None,
    among: Sequence[Emitter] = HALL,
) -> dict[str, Light]:
    choice = choose_lights(among, scene="hall.xml", lights=lights, groups=groups)
    names = [name for light in choice for name in light.member_names]
    assert sorted(names) == sorted(e.name for e in among)  # each emitter is somewhere, once
    assert [light.is_fixed for light in choice] == sorted(light.is_fixed for light in choice)
    return {light.name: light for light in choice}


def test_without_a_wish_every_emitter_is_a_light_and_what_cannot_be_scaled_is_kept() -> None:
    choice = choose()
    assert list(choice) == [*(e.name for e in HALL[:-1]), REST]
    assert choice[REST].is_fixed
    assert choice[REST].member_names == ("screen",)
    assert choice["key"].emission == (4, 3, 2)
    assert choice["key"].unit == "W/(m² sr)"
    assert not any(light.is_fixed for light in choose(among=HALL[:-1]).values())


def test_a_group_of_one_colour_has_that_colour_as_its_unknown() -> None:
    chandelier = choose(groups={"chandelier": ["bulb_*"]})["chandelier"]
    assert chandelier.member_names == ("bulb_1", "bulb_2")
    assert (chandelier.parameter, chandelier.unit) == ("intensity", "W/sr")
    assert chandelier.emission == (1, 2, 3)
    assert chandelier.emission_of(chandelier.members[1], (7, 8, 9)) == (7, 8, 9)


def test_a_group_of_several_colours_or_kinds_keeps_their_proportions() -> None:
    windows = choose(groups={"windows": ["window_1", "window_2"]})["windows"]
    assert (windows.unit, windows.emission, windows.is_scalar) == (MULTIPLE, ONE, False)
    assert windows.emission_of(windows.members[1], (1, 2, 3)) == (2, 4, 6)
    mixed = choose(groups={"mixed": ["key", "bulb_1", "sky"]})["mixed"]
    assert (mixed.unit, mixed.is_scalar) == (MULTIPLE, False)
    assert choose(groups={"dim": ["key", "mesh"]})["dim"].is_scalar


def test_black_groups() -> None:
    black = emitters(("a", AREA, (0, 0, 0)), ("b", AREA, (0, 0, 0)), ("c", POINT, (0, 0, 0)))
    assert choose(groups={"g": ["a", "b"]}, among=black)["g"].unit == "W/(m² sr)"
    with pytest.raises(SceneError, match="only black lights of different kinds"):
        choose(groups={"g": ["a", "c"]}, among=black)


def test_a_filter_keeps_all_else_in_one_fixed_light() -> None:
    choice = choose(["key", "window_*", "chandelier"], {"chandelier": ["bulb_1", "bulb_2"]})
    assert list(choice) == ["key", "chandelier", "window_1", "window_2", REST]
    assert choice[REST].member_names == ("sky", "mesh", "screen")
    # A group that is not chosen is kept as well, and patterns take what can be taken.
    assert choose(["key"], {"g": ["bulb_*"]})[REST].members == HALL[1:]
    assert "g" in choose(groups={"g": ["s*"]})


def test_the_rest_never_takes_the_name_of_a_light() -> None:
    among = emitters(("rest", AREA, ONE), ("rest_", AREA, ONE), ("c", AREA, ONE))
    assert list(choose(["rest"], among=among)) == ["rest", "rest__"]


def test_a_name_that_looks_like_a_pattern_is_a_name() -> None:
    among = emitters(("a[1]", AREA, ONE), ("a1", AREA, ONE), ("b*", AREA, ONE), ("bc", AREA, ONE))
    assert list(choose(["a[1]", "b*"], among=among)) == ["a[1]", "b*", REST]
    assert list(choose(["a[[]1]"], among=among)) == ["a[1]", REST]


@pytest.mark.parametrize(
    ("lights", "groups", "words"),
    [
        (["keyy"], {}, "has no light 'keyy'; did you mean 'key'"),
        (["no_*"], {}, "has no light 'no_\\*'; it has key, bulb_1"),
        ([], {}, "expected a list of at least one name"),
        ([""], {}, "expected a list of at least one name"),
        (["screen"], {}, "'screen' has a textured radiance"),
        (["bulb_1"], {"g": ["bulb_1", "key"]}, "'bulb_1' is part of the group 'g'"),
        (None, {"g": []}, "group 'g': expected a list of at least one name"),
        (None, {"g": ["window_3"]}, "group 'g': .* 'window_3'; did you mean 'window_"),
        (None, {"g": ["screen"]}, "'screen' has a textured radiance"),
        (None, {"g": ["key"], "h": ["k*"]}, "'key' is in two groups, 'g' and 'h'"),
        (None, {"sky": ["key"]}, "group 'sky' has the name of a light"),
        (None, {"": ["key"]}, "a group needs a name"),
    ],
)
def test_wishes_that_cannot_be_met(
    lights: list[str] | None, groups: dict[str, list[str]], words: str
) -> None:
    with pytest.raises(SceneError, match=words) as refusal:
        choose(lights, groups)
    assert "\n" not in str(refusal.value)


def test_a_scene_of_nothing_that_can_be_scaled() -> None:
    with pytest.raises(SceneError, match="no light that can be solved for: 'screen' has a text"):
        choose(among=HALL[-1:])


def test_lights_file(tmp_path: Path) -> None:
    path = tmp_path / "hall.lights.toml"
    path.write_text('lights = ["key", "g"]\n[groups]\ng = ["bulb_*"]\n', encoding="utf-8")
    read = read_lights_file(path)
    assert read.lights == ("key", "g")
    assert read.groups == {"g": ("bulb_*",)}
    path.write_text("", encoding="utf-8")
    assert read_lights_file(path).lights is None


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (b'lights = ["key"]\n[groups\n', "hall.lights.toml is not TOML: .*line 2"),
        (b"[groups]\nlights = [\n\n", "line 2, the end"),
        (b"lights = 'key'", "lights is a list"),
        (b"lights = []", "lights is a list"),
        (b"lights = [1]", "lights is a list"),
        (b'group = ["key"]', "unknown key 'group'; known are lights, groups"),
        (b"gruops = 1", "did you mean 'groups'?"),
        (b"[lite.key]\nmax = 3\n", "unknown key 'lite'"),
        (b'groups = ["key"]', "groups is a table"),
        (b'[groups]\na = "key"', "groups.a is a list"),
        (b"[groups]\na = []", "groups.a is a list"),
        (b"\xff", "not text in UTF-8"),
    ],
)
def test_lights_files_that_are_wrong(tmp_path: Path, text: bytes, words: str) -> None:
    path = tmp_path / "hall.lights.toml"
    path.write_bytes(text)
    with pytest.raises(SceneError, match=words) as refusal:
        read_lights_file(path)
    assert "\n" not in str(refusal.value)
    assert "hall.lights.toml" in str(refusal.value)


def test_no_lights_file(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="no such lights file"):
        read_lights_file(tmp_path / "gone.toml")
    with pytest.raises(SceneError, match="is a folder"):
        read_lights_file(tmp_path)
