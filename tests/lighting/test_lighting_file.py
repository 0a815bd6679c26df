"""lighting.json: exact there and back, and every damaged one refused."""

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lightpaint.errors import LightingError
from lightpaint.lighting.answer.lighting import (
    Certificate,
    Lighting,
    LightSetting,
)
from lightpaint.lighting.answer.lighting_file import read_lighting, write_lighting
from lightpaint.validation import BRIGHTEST

AMOUNTS = st.floats(min_value=0, allow_nan=False, allow_infinity=False)
COLOURS = st.tuples(AMOUNTS, AMOUNTS, AMOUNTS)
EMISSIONS = st.tuples(*[st.floats(0, BRIGHTEST)] * 3)
COUNTS = st.integers(0, 10**6)
SETTINGS = st.builds(
    LightSetting,
    name=st.text(max_size=12),
    plugin=st.text(max_size=6),
    parameter=st.text(max_size=6),
    unit=st.text(max_size=6),
    emission=EMISSIONS,
    weight=EMISSIONS,
)
CERTIFICATES = st.builds(
    Certificate,
    kkt_residual=COLOURS,
    objective=COLOURS,
    relative_objective=COLOURS,
    sweeps=st.tuples(COUNTS, COUNTS, COUNTS),
    converged=st.booleans(),
    unreached=st.lists(st.text(max_size=8)).map(tuple),
)
LIGHTINGS = st.builds(
    Lighting,
    lights=st.lists(SETTINGS, max_size=5, unique_by=lambda s: s.name).map(tuple),
    target=st.text(max_size=8),
    scene_identity=st.text(max_size=8),
    certificate=st.none() | CERTIFICATES,
)


@given(lighting=LIGHTINGS)
def test_there_and_back_is_exact(tmp_path_factory: pytest.TempPathFactory, lighting: Lighting):
    path = tmp_path_factory.getbasetemp() / "lighting.json"
    write_lighting(path, lighting)
    assert read_lighting(path) == lighting


@pytest.fixture
def good_file(tmp_path: Path) -> tuple[Path, dict[str, Any]]:
    """A file of two lights, and its content."""
    lamp = LightSetting("lamp", "area", "radiance", "W/(m² sr)", (1.5, 2, 3), (1.5, 2, 3))
    sun = LightSetting("sun", "directional", "irradiance", "W/m²", (0.1, 0, 0), (0.1, 0, 0))
    certificate = Certificate((0, 0, 0), (1, 1, 1), (0.1, 0.1, 0.1), (5, 6, 7), True, ("sun",))
    path = tmp_path / "lighting.json"
    write_lighting(path, Lighting((lamp, sun), "evening", "1234", certificate))
    return path, json.loads(path.read_text(encoding="utf-8"))


def test_the_file_is_for_people_too(good_file: tuple[Path, dict[str, Any]]):
    path, data = good_file
    assert data["lights"]["lamp"]["emission"] == [1.5, 2, 3]
    assert list(data["lights"]) == ["lamp", "sun"]
    text = path.read_text(encoding="utf-8")
    assert "W/(m² sr)" in text
    assert text.endswith("}\n")


def test_a_file_without_a_solve_is_complete(good_file: tuple[Path, dict[str, Any]]):
    path, data = good_file
    del data["solve"], data["target"], data["scene_identity"], data["lightpaint"]
    path.write_text(json.dumps(data))
    assert read_lighting(path).certificate is None


REMOVALS = [
    ("format",),
    ("lights",),
    *[("lights", "lamp", k) for k in ("plugin", "parameter", "unit", "emission", "weight")],
    *[
        ("solve", k)
        for k in ("kkt_residual", "objective", "relative_objective", "sweeps", "converged")
    ],
    ("solve", "unreached"),
]


@pytest.mark.parametrize("key_path", REMOVALS, ids="/".join)
def test_a_missing_key(good_file: tuple[Path, dict[str, Any]], key_path: tuple[str, ...]):
    path, data = good_file
    *outer, last = key_path
    inner = data
    for key in outer:
        inner = inner[key]
    del inner[last]
    path.write_text(json.dumps(data))
    with pytest.raises(LightingError, match=last if last != "format" else "expected"):
        read_lighting(path)


BAD_COLOURS = [
    [1, 2],
    [1, 2, 3, 4],
    [],
    [[1], [2], [3]],
    [1, 2, None],
    [1, 2, "x"],
    ["1", "2", "3"],
    [True, False, True],
    [1, 2, -1e-30],
    [1, 2, float("nan")],
    [1, 2, float("inf")],
    [1, 2, 10**400],
    7,
    None,
    True,
    "123",
    {"1": 0, "2": 0, "3": 0},
]


@pytest.mark.parametrize("colour", BAD_COLOURS, ids=lambda c: str(c)[:20])
@pytest.mark.parametrize("key", ["emission", "weight"])
def test_a_colour_that_is_none(good_file: tuple[Path, dict[str, Any]], key: str, colour: Any):
    path, data = good_file
    data["lights"]["lamp"][key] = colour
    path.write_text(json.dumps(data))
    with pytest.raises(LightingError, match=r"lighting\.json"):
        read_lighting(path)


def test_another_json_is_refused_as_a_lighting(tmp_path: Path):
    path = tmp_path / "lighting.json"
    path.write_text('{"lamp": 1}')
    with pytest.raises(LightingError, match=r"json is not a lighting: expected a lighting\.json"):
        read_lighting(path)


@pytest.mark.parametrize(
    "change",
    [
        {"format": "lightpaint-lighting 2"},
        {"format": ["lightpaint-lighting 1"]},
        {"format": None},
        {"lights": None},
        {"lights": 3},
        {"lights": "lamp"},
        {"lights": [{"name": "lamp"}]},
        {"lights": {"lamp": None}},
        {"lights": {"lamp": [1, 2, 3]}},
        {"solve": None},
        {"solve": []},
        {"solve": {"sweeps": [1, 2, float("inf")]}},
    ],
    ids=lambda c: str(c)[:40],
)
def test_wrong_types(good_file: tuple[Path, dict[str, Any]], change: dict[str, Any]):
    path, data = good_file
    path.write_text(json.dumps(data | change))
    with pytest.raises(LightingError, match=r"lighting\.json"):
        read_lighting(path)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"{",
        b"null",
        b"[]",
        b"3",
        b'"lightpaint-lighting 1"',
        b"\x76\x2f\x31\x01" + bytes(range(256)),
        b"\xff\xfe{\x00}\x00",
        b"[" * 200_000,
        b'{"a":' * 200_000,
        b'{"format": ' + b"9" * 10_000 + b"}",
    ],
    ids=lambda c: repr(c[:12]),
)
def test_no_lighting_at_all(tmp_path: Path, content: bytes):
    path = tmp_path / "lighting.json"
    path.write_bytes(content)
    with pytest.raises(LightingError, match=r"lighting\.json"):
        read_lighting(path)


def test_a_file_cut_off_anywhere(good_file: tuple[Path, dict[str, Any]]):
    path, _ = good_file
    content = path.read_bytes()
    # All but the final newline is needed; `test_damage` cuts another everywhere, by night.
    for length in (*range(0, len(content) - 2, 7), len(content) - 2):
        path.write_bytes(content[:length])
        with pytest.raises(LightingError):
            read_lighting(path)


def test_no_file(tmp_path: Path):
    with pytest.raises(LightingError, match="no such lighting file"):
        read_lighting(tmp_path / "none.json")
    with pytest.raises(LightingError, match="a folder, not a lighting file: name the file in it"):
        read_lighting(tmp_path)


def test_names_that_repeat():
    lamp = LightSetting("lamp", "area", "radiance", "", (1, 1, 1), (1, 1, 1))
    with pytest.raises(LightingError, match="repeat: lamp, lamp"):
        Lighting((lamp, lamp))


def test_a_light_that_stands_twice_is_refused(tmp_path: Path):
    path = tmp_path / "lighting.json"
    light = '{"plugin": "area", "parameter": "radiance", "unit": "", '
    light += '"emission": [1, 1, 1], "weight": [1, 1, 1]}'
    path.write_text(
        f'{{"format": "lightpaint-lighting 1", "lights": {{"a": {light}, "a": {light}}}}}',
        encoding="utf-8",
    )
    with pytest.raises(LightingError, match="repeated among a, a"):
        read_lighting(path)


@given(members=st.lists(st.text(max_size=5), min_size=1, unique=True))
def test_what_a_light_consists_of_there_and_back(
    tmp_path_factory: pytest.TempPathFactory, members: list[str]
) -> None:
    path = tmp_path_factory.mktemp("l") / "lighting.json"
    one = (1.0, 1.0, 1.0)
    kept_setting = LightSetting("rest", "area", "emission", "×", one, one, True, tuple(members))
    write_lighting(path, Lighting((kept_setting,)))
    assert read_lighting(path).lights == (kept_setting,)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"members": []}, "members is a list"),
        ({"members": "lamp"}, "members is a list"),
        ({"members": [1]}, "members is a list"),
        ({"is_fixed": 1}, "is_fixed is true or false"),
        ({"is_fixed": True, "weight": [2, 1, 1], "emission": [1, 1, 1]}, "is fixed"),
        ({"members": ["other"]}, "an emitter is in two lights"),
    ],
)
def test_ties_that_are_wrong(tmp_path: Path, change: dict[str, Any], words: str) -> None:
    path = tmp_path / "lighting.json"
    one = (1.0, 1.0, 1.0)
    lights = [LightSetting(name, "area", "radiance", "W", one, one) for name in ("lamp", "other")]
    write_lighting(path, Lighting(tuple(lights)))
    data = json.loads(path.read_text(encoding="utf-8"))
    data["lights"]["lamp"] |= change
    path.write_text(json.dumps(data), encoding="utf-8")
    with pytest.raises(LightingError, match=words):
        read_lighting(path)


def test_photometry_goes_along_and_what_follows_is_not_read_back(tmp_path: Path):
    lamp = LightSetting(
        "lamp", "area", "radiance", "W/(m² sr)", (1, 1, 1), (1, 1, 1), unit_flux=(2, 2, 2)
    )
    dark_setting = LightSetting("off", "directional", "irradiance", "W/m²", (0, 0, 0), (0, 0, 0))
    lighting = Lighting((lamp, dark_setting), cd_per_unit=100)
    path = tmp_path / "lighting.json"
    write_lighting(path, lighting)
    assert read_lighting(path) == lighting
    data = json.loads(path.read_text(encoding="utf-8"))
    photometry = data["lights"]["lamp"]["photometry"]
    assert photometry["hex"] == "#ffffff"
    assert photometry["cct_k"] == pytest.approx(6504, abs=1)
    assert photometry["luminous"] == pytest.approx(100)
    assert photometry["flux_lm"] == pytest.approx(200)
    assert data["lights"]["off"]["photometry"] == {"y": 0, "luminous": 0, "luminous_unit": "lx"}
    data["lights"]["lamp"]["photometry"] = "whatever"
    path.write_text(json.dumps(data), encoding="utf-8")
    assert read_lighting(path) == lighting


@pytest.mark.parametrize("scale", [0, -1, "1", True])
def test_a_scale_that_is_none(tmp_path: Path, scale: object):
    path = tmp_path / "lighting.json"
    write_lighting(path, Lighting(()))
    data = json.loads(path.read_text(encoding="utf-8")) | {"cd_per_unit": scale}
    path.write_text(json.dumps(data), encoding="utf-8")
    with pytest.raises(LightingError, match=r"cd/m²|cd_per_unit"):
        read_lighting(path)
