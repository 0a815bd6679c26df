"""Whatever is wrong with a file that a command is given, the error names this file.

A person who gave twelve has to know which. So each command gets each of its files damaged in
ways that any file can be, and in some that only its kind can be.
"""

import io
import json
import re
import shutil
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from batches import LOOKS, small_basis, write_batch
from command import run
from nightly import nightly
from PIL import Image
from renderer import LIGHTS, write_room
from rig_files import EXAMPLE, unzipped, zipped
from webs import cosine, ies_text

import lightpaint as lp
from lightpaint.images.formats.exr import write_rgb


@dataclass(frozen=True)
class Given:
    """A file among others that a command is given.

    command: for `lightpaint`. file: its place. own: damaged contents that only its kind of file
    can have. make: writes whatever the command needs, whole.
    """

    command: tuple[str, ...]
    file: str
    make: Callable[[Path], object]
    own: tuple[bytes, ...] = ()


def _pictures(folder: Path) -> None:
    """A basis, three paintings of it, a mask, and paintings of all kinds."""
    write_batch(folder)
    image = np.clip(small_basis().images.sum(axis=0), 0, 1)
    codes = Image.fromarray((255 * image**0.45).astype(np.uint8))
    for name in ("p.png", "p.tif", "p.jpg", "mask.png"):
        codes.save(folder / name)


def _answer(folder: Path) -> None:
    """A room with its answer, its planes and places."""
    _pictures(folder)
    write_room(folder, lights=LIGHTS["panel"] + LIGHTS["bulb"])
    basis, target = small_basis(), lp.read_target(folder / "p0.exr")
    lp.write_lighting(folder / "lighting.json", lp.solve(basis, target).lighting)
    (folder / "room.planes.toml").write_text('[plane.desk]\nshape = "floor"\nlux = 300\n')
    (folder / "room.lights.toml").write_text('lights = ["panel", "bulb"]\n')
    places = {"format": 1, "lights": {}}
    (folder / "places.json").write_text(json.dumps(places))


def _template(folder: Path) -> None:
    _pictures(folder)
    lp.write_basis(folder / "b.basis.exr", small_basis())
    assert run(folder, "template", "b.basis.exr", "-o", "template").returncode == 0


def _rig(folder: Path) -> None:
    for file in (EXAMPLE, EXAMPLE.with_name("room.xml")):
        shutil.copy(file, folder)
    (folder / "types").mkdir()
    (folder / "types" / TYPE).write_bytes(unzipped(EXAMPLE.read_bytes())[TYPE])


def _webs(folder: Path) -> None:
    write_room(folder, lights=LIGHTS["bulb"])
    (folder / "lamp.ies").write_text(ies_text(cosine, [0.0], [0.0, 45.0, 90.0]))
    text = '[light.bulb]\nphotometry = "lamp.ies"\n'
    (folder / "room.lights.toml").write_text(text)


def _spectra(folder: Path) -> None:
    write_room(folder, lights=LIGHTS["bulb"])
    waves = np.arange(380, 781, 5.0)
    table = np.stack([waves, np.ones_like(waves)], axis=1)
    np.savetxt(folder / "led.csv", table, delimiter=",")
    np.savetxt(folder / "camera.csv", np.repeat(table, [1, 3], axis=1), delimiter=",")
    text = '[light.bulb]\nemitters = [{name = "w", spectrum = "led.csv", Y = 1}]\n'
    (folder / "room.lights.toml").write_text(text)
    image = np.ones((20, 24, 3), np.float32)
    write_rgb(folder / "p.exr", image)


def _layers(folder: Path) -> None:
    """A basis, and an OpenRaster file of its size with one layer."""
    _pictures(folder)
    picture = io.BytesIO()
    Image.new("RGBA", (12, 8), (9, 9, 9, 255)).save(picture, "png")
    stack = '<image w="12" h="8"><stack><layer name="a" src="data/a.png"/></stack></image>'
    with zipfile.ZipFile(folder / "layers.ora", "w") as archive:
        archive.writestr("mimetype", "image/openraster")
        archive.writestr("stack.xml", stack)
        for name in ("data/a.png", "mergedimage.png"):
            archive.writestr(name, picture.getvalue())


def _groups(folder: Path) -> None:
    """Light groups, a file each."""
    _pictures(folder)
    (folder / "groups").mkdir()
    for k, plane in enumerate(small_basis().images):
        write_rgb(folder / "groups" / f"lamp_{k}.exr", plane)


#: A type of the example show.
TYPE = "Example@PAR four colours.gdtf"

OUT = ("-o", "out")
OUT_RIG = ("-o", "out/rig.xml")
SOLVE = ("solve", "b.basis.exr", *OUT)
SMALL = np.ones((3, 4, 3), np.float32)
UNFIT = (b'{"format": 99}', b'{"format": 1, "lights": 5}', b"[]")
TOML = (b"lights = 5\n", b"[light]\nx = 1\n", b"surprise = 1\n", b'[light."none_*"]\nlock = true\n')

CASES = {
    **{
        f"painting {name}": Given((*SOLVE, name, "--no-verify"), name, _pictures)
        for name in ("p0.exr", "p.png", "p.tif", "p.jpg")
    },
    "several paintings": Given((*SOLVE, "p0.exr", "p1.exr", "p2.exr"), "p1.exr", _pictures),
    "mask": Given((*SOLVE, "p0.exr", "--mask", "mask.png"), "mask.png", _pictures),
    "several masks": Given(
        (*SOLVE, "p0.exr", "p1.exr", "--mask", "p.png", "--mask", "mask.png"), "mask.png", _pictures
    ),
    "template": Given(
        (*SOLVE, "p.png", "--template", "template"), "template/template.json", _template, UNFIT
    ),
    "template's picture": Given(
        (*SOLVE, "p.png", "--template", "template"), "template/template.exr", _template
    ),
    "basis": Given((*SOLVE, "p0.exr"), "b.basis.exr", _pictures),
    "lights file": Given(
        (*SOLVE, "p0.exr", "--lights-file", "some.lights.toml"), "some.lights.toml", _pictures, TOML
    ),
    "manifest": Given(
        ("batch", "looks.toml", *OUT),
        "looks.toml",
        _pictures,
        (b"[[look]]\n", b'basis = "none.exr"\n', LOOKS.encode() + b"\n[[look]]\nx = 1\n"),
    ),
    "painting of a batch": Given(("batch", "looks.toml", *OUT), "p1.exr", _pictures),
    "basis of a batch": Given(("batch", "looks.toml", *OUT), "b.basis.exr", _pictures),
    "lighting to export": Given(
        ("export", "lighting.json", "--to", "csv", "-o", "out/a.csv"),
        "lighting.json",
        _answer,
        UNFIT,
    ),
    "lighting to relight": Given(
        ("relight", "room.xml", "lighting.json", *OUT), "lighting.json", _answer, UNFIT
    ),
    "scene": Given(("lights", "room.xml"), "room.xml", _answer, (b"<scene/>", b"<a/>")),
    "lights file of a scene": Given(("lights", "room.xml"), "room.lights.toml", _answer, TOML),
    "planes": Given(
        ("measure", "room.xml", "--planes", "room.planes.toml", "--unit", "1", "--spp", "4"),
        "room.planes.toml",
        _answer,
        (b"x = 1\n", b'[plane.a]\nshape = "none"\n', b"[plane.a]\n", b'[plane.a]\nlux = "x"\n'),
    ),
    "places": Given(
        ("solve", "room.xml", *OUT, "p0.exr", "--places", "places.json"),
        "places.json",
        _answer,
        UNFIT,
    ),
    "show": Given(("rig", "show.mvr", *OUT_RIG, "--room", "room.xml"), "show.mvr", _rig),
    "room of a show": Given(
        ("rig", "show.mvr", *OUT_RIG, "--room", "room.xml"),
        "room.xml",
        _rig,
        (b"<scene/>", b"<a/>"),
    ),
    "type of a fixture": Given(
        ("rig", "show.mvr", *OUT_RIG, "--gdtf", "types"), f"types/{TYPE}", _rig
    ),
    "web": Given(("lights", "room.xml"), "lamp.ies", _webs, (b"IESNA:LM-63-2002\nTILT=NONE\n1\n",)),
    "spectrum": Given(
        ("solve", "room.xml", *OUT, "p.exr", "--spectral"),
        "led.csv",
        _spectra,
        (b"400,1\n", b"400,1\n410,x\n", b"400,-1\n500,-1\n", b"1,2\n2,3\n"),
    ),
    "observer": Given(
        ("solve", "room.xml", *OUT, "p.exr", "--spectral", "--observer", "camera.csv"),
        "camera.csv",
        _spectra,
        (b"400,1,1,1\n", b"400,1\n500,1\n", b"400,0,0,0\n700,0,0,0\n"),
    ),
    "layers to paint on": Given(
        ("paint", "b.basis.exr", *OUT, "--layers", "layers.ora", "--port", "0", "--no-browser"),
        "layers.ora",
        _layers,
    ),
    "light group": Given(("solve", "groups", "p0.exr", *OUT), "groups/lamp_1.exr", _groups),
}

#: What every check tries: at night the rest, too.
QUICK = ("several paintings", "template", "lights file", "painting of a batch", "web")


def _damages(content: bytes) -> Iterator[tuple[str, bytes]]:
    """Yield names and contents of a file as copies, programs and people damage any."""
    yield "empty", b""
    yield "cut", content[: len(content) // 2]
    yield "text", b"no such thing\n"
    yield "bytes", bytes(range(256)) * 8
    yield "zeros", bytes(len(content))
    yield "another kind", zipped({"mimetype": "x", "a.txt": "b"})


def _unfit_pictures(name: str) -> Iterator[tuple[str, bytes]]:
    """Yield pictures that can be read, and are of no use."""
    if not name.endswith(".exr") or name.endswith("basis.exr"):
        return
    odd = {
        "of another size": SMALL,
        "not a number": np.full((8, 12, 3), np.nan, np.float32),
        "negative": np.full((8, 12, 3), -1, np.float32),
    }
    for done, image in odd.items():
        path = Path(name + ".odd.exr")
        write_rgb(path, image)
        content = path.read_bytes()
        path.unlink()
        yield done, content


@pytest.mark.parametrize("case", [x if x in QUICK else nightly(x) for x in CASES])
def test_an_error_names_the_file(
    tmp_path: Path, case: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = CASES[case]
    monkeypatch.chdir(tmp_path)
    given.make(tmp_path)
    path = tmp_path / given.file
    whole = path.read_bytes() if path.exists() else b"x" * 1000
    own = ((f"own {k}", content) for k, content in enumerate(given.own))
    unclear, refused = [], 0
    for done, content in [*_damages(whole), *_unfit_pictures(given.file), *own]:
        path.write_bytes(content)
        shutil.rmtree(tmp_path / "out", ignore_errors=True)
        completed = run(tmp_path, *given.command, "-q")
        said = completed.stderr + completed.stdout
        if completed.returncode not in (0, 1, 2) or "Traceback" in said:
            unclear.append(f"{done}: ended with {completed.returncode}: {said[:400]}")
        elif completed.returncode:
            refused += 1
            lines = completed.stderr.splitlines()
            # Of several looks each has a line, and another one counts those that failed.
            others = [x for x in lines if not _names(x, path)]
            if len(others) == len(lines) or not all(" failed" in x for x in others):
                unclear.append(f"{done}: {completed.stderr}")
    assert unclear == []
    assert refused >= 3


def _names(line: str, path: Path) -> bool:
    """Return whether a line has the name of a file; the folder of a template is one."""
    names = [path.name, path.parent.name + "/"] if path.suffix == ".json" else [path.name]
    return any(re.search(rf"(?<![\w.]){re.escape(name)}", line) for name in names)
