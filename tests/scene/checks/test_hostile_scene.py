"""Scenes that are damaged, or made to crash, hang or fill the memory: each ends in one line.

All are loaded in a process of their own, which may take 2 GB.
"""

import math
import os
import struct
import subprocess
import sys
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from damaged_files import Case, damage, outcomes, wrong_outcomes
from nightly import TENTHS, nightly, tenth_of
from patience import PATIENCE_S
from renderer import GLOSSY, LIGHTS, PATH, ROOM, write_room

from lightpaint.errors import SceneError
from lightpaint.images.formats.exr import ExrPart, read_parts, write_parts, write_rgb
from lightpaint.scene.checks.assets import check_asset
from lightpaint.scene.scene_reader import load_scene

ROOM_TEXT = ROOM.format(integrator=PATH, film="", sensors="", wall=GLOSSY, lights=LIGHTS["bulb"])
DEVICES = ("/dev/zero", "/dev/random", "/dev/stdin", "/proc/self/mem", "/", "pipe", "gone")


def _with(addition: str) -> str:
    return ROOM_TEXT.replace("</scene>", addition + "</scene>")


def _entities() -> str:
    levels = "".join(f'<!ENTITY e{k} "{f"&e{k - 1};" * 10}">' for k in range(1, 10))
    return f'<!DOCTYPE scene [<!ENTITY e0 "lol">{levels}]>' + _with('<emitter type="&e9;"/>')


def _hostile() -> dict[str, str]:
    """XML by what is wrong with it; none may be read."""
    deep = "<bsdf type='twosided'>"
    chain = "".join(
        f'<bsdf type="mask" id="m{k}"><ref id="m{k - 1}"/></bsdf>' for k in range(1, 9000)
    )
    doubling = "".join(f'<default name="a{k}" value="{f"$a{k - 1}" * 10}"/>' for k in range(1, 10))
    scenes = {
        "entities": _entities(),
        "itself": _with('<include filename="itself.xml"/>'),
        "to_and": _with('<include filename="fro.xml"/>'),
        "fro": '<scene version="3.0.0"><include filename="to_and.xml"/></scene>',
        "wide": _with('<include filename="wide_0.xml"/>'),
        "deep": _with(deep * 100_000 + "</bsdf>" * 100_000),
        "open": _with(deep * 100_000),
        "chain": _with('<bsdf type="diffuse" id="m0"/>' + chain),
        "circle": _with('<bsdf type="twosided" id="m"><ref id="m"/></bsdf>'),
        "doubling": _with('<default name="a0" value="xxxxxxxxxx"/>' + doubling),
        "many": _with('<shape type="sphere"/>' * 200_000),
        "lookups": _with(
            "".join(f'<default name="p{k}" value=""/>' for k in range(4000))
            + '<bsdf type="diffuse" id="$p"/>' * 4000
        ),
        "plugin": ROOM_TEXT.replace('type="sphere"', 'type="nope"'),
        "typo": ROOM_TEXT.replace('name="radius"', 'name="radios"'),
        "long_name": ROOM_TEXT.replace('id="bulb"', f'id="{"x" * 10**6}"'),
        "empty": "",
        "no_scene": "<bsdf version='3.0.0' type='diffuse'/>",
    }
    for size in ("0", "-5", "1000000000", "1000000000000", "nan", "1e9", "9" * 400):
        scenes[f"width_{size[:14]}"] = ROOM_TEXT.replace(
            '"width" value="24"', f'"width" value="{size}"'
        )
    for spp in ("-5", "1000000000", "1000000000000", "many"):
        scenes[f"spp_{spp}"] = ROOM_TEXT.replace('"spp" value="16"', f'"spp" value="{spp}"')
    for number in ("nan", "inf", "-inf", "1e39", "1e999"):
        scenes[f"emission_{number}"] = ROOM_TEXT.replace("0.5 0.6 0.7", f"1 {number} 1")
        scenes[f"place_{number}"] = ROOM_TEXT.replace('x="-0.5"', f'x="{number}"')
        scenes[f"fov_{number}"] = ROOM_TEXT.replace('"fov" value="50"', f'"fov" value="{number}"')
        scenes[f"move_{number}"] = ROOM_TEXT.replace('y="1" z="-1"', f'y="{number}"')
    scenes["emission_negative"] = ROOM_TEXT.replace("0.5 0.6 0.7", "1 -2 1")
    for device in DEVICES:
        name = device.replace("/", "_")
        file = f'<string name="filename" value="{device}"/>'
        scenes[f"include{name}"] = _with(f'<include filename="{device}"/>')
        scenes[f"spectrum{name}"] = _with(
            f'<bsdf type="diffuse"><spectrum name="reflectance" filename="{device}"/></bsdf>'
        )
        scenes[f"bitmap{name}"] = _with(f'<texture type="bitmap">{file}</texture>')
        scenes[f"envmap{name}"] = _with(f'<emitter type="envmap">{file}</emitter>')
        for plugin in ("ply", "obj", "serialized"):
            scenes[f"{plugin}{name}"] = _with(f'<shape type="{plugin}">{file}</shape>')
    scenes["by_path"] = _with('<path value="/dev"/><include filename="zero"/>')
    scenes["by_parameter"] = _with('<default name="d" value="/dev"/><include filename="$d/zero"/>')
    return scenes


def test_hostile_scenes(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for k in range(8):
        inner = f'<include filename="wide_{k + 1}.xml"/>' * 10
        (tmp_path / f"wide_{k}.xml").write_text(f'<scene version="3.0.0">{inner}</scene>')
    (tmp_path / "wide_8.xml").write_text('<scene version="3.0.0"/>')
    cases = [Case(f"{name}.xml", name, text.encode()) for name, text in _hostile().items()]
    (tmp_path / "fro.xml").write_text(_hostile()["fro"])
    cases += [Case(device, "as a scene") for device in DEVICES if device != "/dev/stdin"]
    results = outcomes("scene", {}, cases, tmp_path)
    assert wrong_outcomes(results, ("refused",)) == []


@pytest.mark.parametrize("tenth", TENTHS)
def test_damage_of_the_text(tmp_path: Path, tenth: int) -> None:
    content = write_room(tmp_path).read_bytes()
    cases = [
        case
        for case in damage("bent.xml", content, 1, 150, 60)
        if not case.done.startswith("cut") or int(case.done[-1]) % 2
    ]
    cases = tenth_of(cases, tenth)
    bent = content.replace(b'id="bulb"', b'id="\xff\xfe"')
    cases += [
        Case("bent.xml", "no UTF-8", bent),
        Case("bent.xml", "NUL", content.replace(b"bulb", b"bu\0b")),
        Case("bent.xml", "UTF-16", content.decode().encode("utf-16")),
        Case("bent.xml", "mark", b"\xef\xbb\xbf" + content),
    ]
    results = outcomes("scene", {"bent.xml": content}, cases, tmp_path)
    assert wrong_outcomes(results) == []
    cut = [
        case.done for case, outcome in results if case.done[:3] == "cut" and outcome != "refused"
    ]
    assert set(cut) <= {f"cut at {len(content) - 1}"}


def _ply(vertices: int, index: int, *, ascii: bool = False) -> bytes:
    head = (
        f"ply\nformat {'ascii' if ascii else 'binary_little_endian'} 1.0\n"
        f"element vertex {vertices}\n"
        "property float x\nproperty float y\nproperty float z\nelement face 1\n"
        "property list uchar int vertex_indices\nend_header\n"
    ).encode()
    if ascii:
        return head + b"0 0 0\n1 0 0\n0 1 0\n" + f"3 0 1 {index}\n".encode()
    return head + struct.pack("<9fB3i", 0, 0, 0, 1, 0, 0, 0, 1, 0, 3, 0, 1, index)


def _serialized(vertices: int, faces: int, index: int) -> bytes:
    mesh = struct.pack("<I2s2Q9f3I", 0x1000, b"x\0", vertices, faces, *range(9), 0, 1, index)
    return struct.pack("<HH", 0x041C, 4) + zlib.compress(mesh) + struct.pack("<QI", 0, 1)


def _assets(folder: Path, tenth: int = 0) -> list[tuple[str, bytes]]:
    """Endings of files, and what no plugin should be given, beside what it may be given."""
    write_rgb(folder / "t.exr", np.random.default_rng(0).random((8, 8, 3)).astype(np.float32))
    exr = (folder / "t.exr").read_bytes()
    wide = struct.pack(">HBHHB", 11, 8, 65500, 65500, 1) + b"\1\x11\0"
    return [
        *(("exr", case.content) for case in tenth_of(damage("", exr, 1, 60, 60), tenth)),
        *(("ply", _ply(3, index)) for index in (-1, 3, 2_000_000, -2_000_000)),
        *(("ply", _ply(3, index, ascii=True)) for index in (3, 2_000_000)),
        *(("ply", x.content) for x in tenth_of(damage("", _ply(3, 2), 2, 40, 40), tenth)),
        ("ply", _ply(4_000_000_000, 2)),
        ("serialized", _serialized(3, 1, 2_000_000)),
        ("serialized", _serialized(3, 2**30, 2)),
        ("serialized", _serialized(2**40, 1, 2)),
        ("jpg", b"\xff\xd8\xff\xc0" + wide),
        (
            "png",
            b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + struct.pack(">II", 60_000, 60_000) + b"\x08\2" * 9,
        ),
    ]


@pytest.mark.nightly
@pytest.mark.parametrize("tenth", TENTHS)
def test_hostile_files_of_a_scene(tmp_path: Path, tenth: int) -> None:
    cases = []
    for k, (ending, content) in enumerate(_assets(tmp_path, tenth)):
        file = f"asset_{k}.{ending}"
        (tmp_path / file).write_bytes(content)
        name = f'<string name="filename" value="{file}"/>'
        kind = ending if ending in ("ply", "serialized") else "bitmap"
        text = _with(
            f'<shape type="{kind}">{name}</shape>'
            if kind != "bitmap"
            else f'<emitter type="envmap">{name}</emitter>'
        )
        cases.append(Case(f"asset_{k}.xml", f"{ending} {k}", text.encode()))
    results = outcomes("scene", {}, cases, tmp_path)
    assert wrong_outcomes(results) == []
    assert sum(outcome == "refused" for _, outcome in results) > 20


def _grid(*size: int, channels: int = 1) -> bytes:
    numbers = max(0, math.prod(size) * channels)
    head = struct.pack("<5i6f", 1, *size, channels, 0, 0, 0, 1, 1, 1)
    return b"VOL\x03" + head + struct.pack(f"<{numbers}f", *(0.5,) * numbers)


def _wall(content: str) -> str:
    return _with(f'<shape type="cube"><bsdf type="diffuse">{content}</bsdf></shape>')


@pytest.mark.nightly
def test_plugins_that_lack_what_mitsuba_takes_for_granted(tmp_path: Path) -> None:
    """Each of these ended the process by a signal."""
    texture = '<texture type="{}" name="reflectance">{}</texture>'
    volume = '<volume type="gridvolume" name="volume"><string name="filename" value="{}"/></volume>'
    scenes = {
        "volume": _wall(texture.format("volume", "")),
        "bitmap": _wall(texture.format("bitmap", "")),
        "misspelt": _wall(texture.format("bitmap", '<string name="file" value="a.png"/>')),
        "inner": _wall(
            texture.format("checkerboard", '<texture type="bitmap" name="color0"/>'),
        ),
        "lamp": _with('<emitter type="spot"><texture type="bitmap" name="texture"/></emitter>'),
        "blend": _with('<shape type="cube"><bsdf type="blendbsdf"/></shape>'),
    }
    for k, size in enumerate([(0, 2, 2), (2, 2, 0), (-2, -2, 2), (-2, 2, 2)]):
        (tmp_path / f"{k}.vol").write_bytes(_grid(*size))
        scenes[f"grid_{k}"] = _wall(texture.format("volume", volume.format(f"{k}.vol")))
    cases = [Case(f"{name}.xml", name, text.encode()) for name, text in scenes.items()]
    assert wrong_outcomes(outcomes("scene", {}, cases, tmp_path), ("refused",)) == []
    with pytest.raises(SceneError, match=r"line \d+: the texture 'bitmap', which has file, needs"):
        load_scene(tmp_path / "misspelt.xml")
    (tmp_path / "good.vol").write_bytes(_grid(2, 2, 2))
    (tmp_path / "good.xml").write_text(_wall(texture.format("volume", volume.format("good.vol"))))
    assert [light.name for light in load_scene(tmp_path / "good.xml").lights] == ["bulb"]


def test_what_nobody_need_be_warned_of_is_read_as_mitsuba_reads_it(tmp_path: Path) -> None:
    """Thousands of parameters; and entities, which Mitsuba never replaces by what they say."""
    path = tmp_path / "scene.xml"
    path.write_text(_with("".join(f'<default name="p{k}" value=""/>' for k in range(2000))))
    assert [light.name for light in load_scene(path).lights] == ["bulb"]
    outside = '<!DOCTYPE s [<!ENTITY e SYSTEM "file:///dev/zero">]>'
    path.write_text(outside + ROOM_TEXT.replace('"bulb"', '"&e;"'))
    assert [light.name for light in load_scene(path).lights] == ["&e;"]


def test_good_files_are_still_read(tmp_path: Path) -> None:
    _assets(tmp_path)
    (tmp_path / "a.ply").write_bytes(_ply(3, 2))
    (tmp_path / "b.ply").write_bytes(_ply(3, 2, ascii=True))
    (tmp_path / "c.serialized").write_bytes(_serialized(3, 1, 2))
    shapes = "".join(
        f'<shape type="{name[2:]}"><string name="filename" value="{name}"/></shape>'
        for name in ("a.ply", "b.ply", "c.serialized")
    )
    image = '<emitter type="envmap" id="sky"><string name="filename" value="t.exr"/></emitter>'
    path = tmp_path / "good.xml"
    path.write_text("<!DOCTYPE scene>" + _with(shapes + image), encoding="utf-8")
    assert [light.name for light in load_scene(path).lights] == ["bulb", "sky"]
    path.write_text(_with('<bsdf type="diffuse"><float name="odd" value="1"/></bsdf>'))
    with pytest.raises(SceneError, match="unreferenced"):
        load_scene(path)


@pytest.mark.nightly
@pytest.mark.parametrize(
    "name", ["entities", nightly("deep"), nightly("include_dev_zero"), "width_1000000000"]
)
def test_the_command_says_it_in_one_line(tmp_path: Path, name: str) -> None:
    path = tmp_path / f"{name}.xml"
    path.write_text(_hostile()[name], encoding="utf-8")
    completed = subprocess.run(
        [sys.executable, "-m", "lightpaint", "lights", "--no-sheet", str(path)],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
    )
    assert completed.returncode == 2
    assert completed.stdout == ""
    assert len(completed.stderr.splitlines()) == 1
    assert path.name in completed.stderr


def test_a_picture_that_begins_before_its_coordinates_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Mitsuba 3.9.1 ends with a segmentation fault on it, so none is written here."""
    path = tmp_path / "slide.exr"
    pixels = {"Y": np.ones((2, 3), np.float32)}
    write_parts(path, [ExrPart("", pixels, display=(4, 4), offset=(2, 1))])
    (part,) = read_parts(path)
    assert part.origin == (2, 1)
    check_asset(path, "projector")
    before = replace(part, origin=(-2, 0))
    monkeypatch.setattr("lightpaint.scene.checks.assets.read_parts", lambda path: [before])
    with pytest.raises(SceneError, match=r"slide\.exr begins at pixel \(0, -2\), .*: crop it"):
        check_asset(path, "projector")
