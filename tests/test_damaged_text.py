"""Lightings, templates and lights files, damaged and hostile: each is refused or read right.

Read right means that a plain parser finds the same in the file.
"""

import copy
import json
import os
import random
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from damage_readers import Reader, contents, contents_of_json
from damaged_files import Case, attempt, flip_bit, is_legible, outcomes, wrong_outcomes
from hypothesis import given, settings
from hypothesis import strategies as st
from nightly import FIFTHS, examples, fifth_of, nightly

from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.errors import LightingError, LightpaintError, SceneError, TargetError
from lightpaint.files import MAX_TEXT
from lightpaint.lighting.answer.certificate import Bound
from lightpaint.lighting.answer.lighting import Certificate, Lighting, LightSetting
from lightpaint.lighting.answer.lighting_file import read_lighting, write_lighting
from lightpaint.scene.lights.lights_file import read_lights_file
from lightpaint.target.template import Template, read_template, write_template

LIGHTS = b"""\
lights = ["key", "window_*"]
sparse = 6
prefer = { current = 0.01 }
tie = [["cove_1", "cove_2"]]

[groups]
"chandelier \xe2\x9c\xa8" = ["bulb_1", "bulb_2"]

[light."spot_*"]
kelvin = [2700, 6500]
limits = { max = "150%", min = 0.5 }
duv = 0.003

[light.window]
lock = true

[light.strip]
primaries = ["#ff0000", "3000K", [0.1, 0.2, 0.3]]
"""


def _lighting() -> Lighting:
    lamp = LightSetting(
        *("lamp", "area", "radiance", "W/(m² sr)", (1.5, 2, 3), (1.5, 2, 3)),
        unit_flux=(1.0, 2.0, 3.0),
        members=("a", "b"),
        constraint="lock",
        is_active=True,
        standard_error=(0.1, 0.2, 0.3),
    )
    rest = LightSetting("rest", "sunsky", "", "×", (1, 1, 1), (1, 1, 1), is_fixed=True)
    bound = Bound(("lamp",), "lock", "lock", 0.5, (1.0, 2.0, 3.0), "emission")
    residuals = ((0.0,) * 3, (1.0,) * 3, (0.1,) * 3, (5, 6, 7))
    quality = Certificate(*residuals, True, ("rest",), ((1, 0.5), (2, 0.25)), (bound,))
    return Lighting((lamp, rest), "evening", "1234", quality, cd_per_unit=100.0)


@pytest.fixture
def lighting(tmp_path: Path) -> Path:
    write_lighting(tmp_path / "lighting.json", _lighting())
    return tmp_path / "lighting.json"


@pytest.fixture
def lights(tmp_path: Path) -> Path:
    (tmp_path / "hall.lights.toml").write_bytes(LIGHTS)
    return tmp_path / "hall.lights.toml"


def _write_template(folder: Path) -> Path:
    image = np.ones((4, 5, 3), np.float32)
    template = Template(image, ViewTransform("srgb", 0.5), "hall.xml", "12ab", "camera", image)
    write_template(folder, template, normals=image, depth=image[..., 0], mattes={}, lights={})
    return folder / "template.json"


#: What stands where something else is expected.
ODD = [
    *(b"1e999", b"-1e999", b"9" * 400, b"9" * 5000, b"NaN", b"-Infinity", b"null", b"true", b"{}"),
    *(b"[]", b'""', b'"\\ud800"', b'"\\u0000"', b'"\x00"', b'"\xff"', b"0x10", b"1_000", b"-1"),
    *(b"[" * 100_000, b'{"a":' * 100_000, b"1" + b"0" * 100_000, b"'" * 1000, b"\xed\xa0\x80"),
    *(b"1e-999", b"0.1e1", b'"\x1b[2J"', b"nan", b"-inf", b"0b1", b"1979-05-27T07:32:00Z"),
]


def _damaged(content: bytes, file: str, seed: int) -> Iterator[Case]:
    """Cut at every byte, every bit of the structure turned, and odd things put everywhere."""
    rng = random.Random(seed)
    for end in range(len(content)):
        yield Case(file, f"cut at {end}", content[:end])
    for _ in range(400):
        position, bit = rng.randrange(len(content)), rng.randrange(8)
        yield Case(file, f"bit {bit} of byte {position}", flip_bit(content, position, bit))
    starts = [i for i in range(1, len(content)) if content[i - 1 : i] in b' :=[,{"\n']
    for odd in ODD:
        for position in rng.sample(starts, min(8, len(starts))):
            end = position + rng.choice((0, 1, 3, 8))
            yield Case(
                file,
                f"{odd[:12]!r} at {position} to {end}",
                content[:position] + odd + content[end:],
            )


def _bent(content: bytes, file: str) -> Iterator[Case]:
    """Yield a file as editors and copies damage it as a whole."""
    half = len(content) // 2
    for damage, damaged_content in {
        "twice": content * 2,
        "with a mark": b"\xef\xbb\xbf" + content,
        "in UTF-16": content.decode().encode("utf-16"),
        "in Latin-1": content.decode().encode("latin-1", "replace"),
        "with NUL": content[:half] + b"\0" + content[half:],
        "carriage returns": content.replace(b"\n", b"\r\n"),
        "empty": b"",
        "spaces": b" " * 10_000,
        "half": content[half:],
    }.items():
        yield Case(file, damage, damaged_content)


@pytest.mark.parametrize("fifth", FIFTHS)
@pytest.mark.parametrize("kind", ["lights", *map(nightly, ["lighting", "template"])])
def test_damage(tmp_path: Path, lighting: Path, lights: Path, kind: str, fifth: int) -> None:
    source = {"lighting": lighting, "lights": lights}.get(kind) or _write_template(tmp_path)
    content = source.read_bytes()
    cases = fifth_of(_damaged(content, source.name, 1), fifth)
    cases += _bent(content, source.name)
    results = outcomes(kind, {source.name: content}, cases, tmp_path)
    assert wrong_outcomes(results) == []
    assert len(results) > 160
    # The harness is not blind: both come about, and what is cut is never read as whole.
    all_outcomes = [outcome for _, outcome in results]
    assert all_outcomes.count("refused") > 100
    assert all_outcomes.count("same") + all_outcomes.count("agreed") > 4
    if kind != "lights":  # of which the first lines are a lights file too
        cut = [(case.done, s) for case, s in results if case.done[:3] == "cut" and s != "refused"]
        assert {damage for damage, _ in cut} <= {f"cut at {len(content) - 1}"}


JSON = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.just(10**400)
    | st.floats()
    | st.text(max_size=5)
    | st.just("\ud800"),
    lambda below: st.lists(below, max_size=4) | st.dictionaries(st.text(max_size=5), below),
    max_leaves=8,
)


def _places(value: Any, place: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Where anything stands in a document."""
    yield place
    if isinstance(value, dict | list):
        for key in value if isinstance(value, dict) else range(len(value)):
            yield from _places(value[key], (*place, key))


def _changed(document: Any, place: tuple[Any, ...], value: Any, change: str) -> Any:
    """A copy in which `value` stands at a place or beside it, or nothing does."""
    changed = copy.deepcopy(document)
    if not place:
        return value
    holder = changed
    for key in place[:-1]:
        holder = holder[key]
    if change == "gone":
        del holder[place[-1]]
    elif change == "beside" and isinstance(holder, list):
        holder.insert(place[-1], value)
    elif change == "beside":
        holder["odd"] = value
    else:
        holder[place[-1]] = value
    return changed


HOW = st.sampled_from(["instead", "instead", "beside", "gone"])


@settings(max_examples=examples(50, 250))
@given(data=st.data())
def test_anything_anywhere_in_a_lighting(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    path = tmp_path_factory.getbasetemp() / "anything.json"
    write_lighting(path, _lighting())
    document = json.loads(path.read_text(encoding="utf-8"))
    place = data.draw(st.sampled_from(sorted(_places(document), key=repr)))
    changed = _changed(document, place, data.draw(JSON), data.draw(HOW))
    path.write_text(json.dumps(changed))
    read = attempt(read_lighting, path, LightingError)
    assert read is None or contents(read) == contents_of_json(changed)


@settings(max_examples=examples(30, 150))
@given(data=st.data())
def test_anything_anywhere_in_a_template(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    folder = tmp_path_factory.getbasetemp() / "anything"
    path = folder / "template.json"
    if not path.exists():
        good = _write_template(folder).read_bytes()
        (folder / "good.json").write_bytes(good)
    document = json.loads((folder / "good.json").read_text(encoding="utf-8"))
    place = data.draw(st.sampled_from(sorted(_places(document), key=repr)))
    changed = _changed(document, place, data.draw(JSON), data.draw(HOW))
    path.write_text(json.dumps(changed))
    reader = Reader("template")
    read = attempt(reader.read, path, TargetError)
    assert read is None or reader.agrees(path, read)


TOML = st.recursive(
    st.booleans()
    | st.integers()
    | st.just(10**400)
    | st.floats()
    | st.text(st.characters(codec="utf-8"), max_size=5)
    | st.sampled_from(["40%", "3200K", "nanK", "#ff", "#ffaa66", "1e999%", "-1", "infK", "1_0"]),
    lambda below: (
        st.lists(below, max_size=4)
        | st.dictionaries(st.text(st.characters(codec="utf-8"), max_size=5), below)
    ),
    max_leaves=8,
)


def _toml(value: Any) -> str:
    """A value as TOML; strings of JSON are strings of TOML."""
    if isinstance(value, dict):
        pairs = (f"{json.dumps(k)} = {_toml(v)}" for k, v in value.items())
        return f"{{{', '.join(pairs)}}}"
    if isinstance(value, list):
        return f"[{', '.join(map(_toml, value))}]"
    return repr(value) if isinstance(value, float) else json.dumps(value).replace("\x7f", "\\u007f")


@settings(max_examples=examples(50, 250))
@given(data=st.data())
def test_anything_anywhere_in_a_lights_file(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    path = tmp_path_factory.getbasetemp() / "anything.lights.toml"
    document = tomllib.loads(LIGHTS.decode())
    place = data.draw(st.sampled_from(sorted(filter(None, _places(document)), key=repr)))
    changed = _changed(document, place, data.draw(TOML), data.draw(HOW))
    text = "\n".join(f"{json.dumps(k)} = {_toml(v)}" for k, v in changed.items())
    path.write_text(text, encoding="utf-8")
    reader = Reader("lights")
    read = attempt(reader.read, path, LightpaintError)
    assert read is None or reader.agrees(path, read)


def _readers() -> list[tuple[Any, type[LightpaintError], str]]:
    return [
        (read_lighting, LightingError, "a.json"),
        (read_lights_file, SceneError, "a.toml"),
        (lambda path: read_template(path.parent), TargetError, "template.json"),
    ]


@pytest.mark.parametrize("reader", _readers(), ids=lambda r: r[2])
def test_what_is_no_file_is_not_read(tmp_path: Path, reader: Any) -> None:
    read, error, name = reader
    path = tmp_path / name
    for target in ("/dev/zero", "/dev/random", "/dev/stdin", "/proc/self/mem", "/", "gone", name):
        path.symlink_to(target)
        with pytest.raises(error) as refusal:
            read(path)
        assert is_legible(refusal.value, path) or target in str(refusal.value)
        path.unlink()
    os.mkfifo(path)  # which opening would wait at for ever
    with pytest.raises(error, match="is a device or a pipe"):
        read(path)
    path.unlink()
    with path.open("wb") as file:
        file.truncate(MAX_TEXT + 1)
    with pytest.raises(error, match="bytes long"):
        read(path)


@pytest.mark.parametrize("name", ["a\0b", "a" * 5000, "a/" * 3000, "\ud800"])
def test_names_that_no_file_has(name: str) -> None:
    for read, error in ((read_lighting, LightingError), (read_lights_file, SceneError)):
        with pytest.raises(error) as refusal:
            read(Path(name))
        assert "\n" not in str(refusal.value)


def test_keys_of_very_many_parts_are_refused_at_once(tmp_path: Path) -> None:
    path = tmp_path / "a.lights.toml"
    for key in ("a." * 100_000 + "a", '"a" . ' * 50_000 + "a", "'.'." * 9000 + "a"):
        path.write_text(f"lights = ['a']\n{key} = 1\n")
        with pytest.raises(SceneError, match="line 2 has too many dots"):
            read_lights_file(path)
    # Dots in names are another thing.
    path.write_text('lights = ["a.b.c.d.e.f.g.h.i.j.k.l.m.n.o.p"]\n[groups]\n"a.b.c" = ["a.b"]\n')
    assert read_lights_file(path).groups == {"a.b.c": ("a.b",)}
