"""Lamps of emitters against answers of three numbers a lamp, and the way through DMX.

    pip install '.[stage]'
    python benchmarks/emitters.py [--spp 64] [--drives 504] [--drives-only]

The shipped show, four lamps with four emitters and two with six, lights its room with known drives.
The picture gets 2 % of noise, and is solved

    three numbers    as lamps without emitters, which have any colour in Rec.709
    levels of these  when the red, green and blue emitters get the levels of fixtures.csv, at the
                     best common scale
    drives           as lamps of emitters
    received         by the drives that a receiver decodes after sACN on this machine
    rendered         by Mitsuba with the received drives, in blocks of 5 x 5 pixels, whose noise is
                     that of the basis and of this render; and the means of its channels, relative

Errors are relative to the picture without noise (RMS). Before, lamps of six emitters with so many
drives are solved, in turns with the same lights with three channels each: for a picture whose
colours all lamps can mix, and for one of known drives, many of which are 0 or 1; literally, and as
a display shows it, with any colours and by default. `--drives-only` ends there. At last larger
shows of the same types are read, and their levels leave for this machine while they change.
"""

from __future__ import annotations

import argparse
import copy
import socket
import subprocess
import sys
import tempfile
import time
import zipfile
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from subprocess import DEVNULL
from typing import Any
from xml.etree import ElementTree

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

import lightpaint as lp  # noqa: E402
from lightpaint.basis.light_basis import Basis, Origin  # noqa: E402
from lightpaint.basis.lights import BasisLight  # noqa: E402
from lightpaint.dmx.console_link import ConsoleLink  # noqa: E402
from lightpaint.dmx.console_receiver import ConsoleReceiver  # noqa: E402
from lightpaint.dmx.console_target import PROTOCOLS, network_universes  # noqa: E402
from lightpaint.dmx.levels import decode_levels  # noqa: E402
from lightpaint.dmx.mvr import DESCRIPTION, read_rig  # noqa: E402
from lightpaint.lighting.answer.lighting import Lighting  # noqa: E402
from lightpaint.lighting.unknowns.reduction import reduce_to  # noqa: E402
from lightpaint.relit.export.fixtures import fixtures_of  # noqa: E402
from lightpaint.scene.quality_presets import on_film  # noqa: E402
from lightpaint.scene.scene_render import Stream, render  # noqa: E402

SHOW, ROOM = ROOT / "scenes" / "rig" / "show.mvr", ROOT / "scenes" / "rig" / "room.xml"
RESOLUTION, BLOCK = "1/2", 5
NOISE, SEED = 0.02, 7

#: Emitters that today's levels for red, green and blue drive.
RGB = ("red", "green", "blue")


def error(picture: Any, truth: Any) -> float:
    """Return the RMS difference of two pictures, relative to the second."""
    return float(np.sqrt(np.square(picture - truth).sum() / np.square(truth).sum()))


def blocks(image: Any) -> Any:
    """Return the means of blocks."""
    h, w, _ = image.shape
    return image.reshape(h // BLOCK, BLOCK, w // BLOCK, BLOCK, 3).mean((1, 3))


def show_scene(folder: Path) -> Path:
    """Return the scene that `lightpaint rig` makes of the show."""
    scene = folder / "rig.xml"
    words = ["rig", str(SHOW), "--room", str(ROOM), "-o", str(scene), "-q"]
    subprocess.run([sys.executable, "-m", "lightpaint", *words], check=True, stdout=DEVNULL)
    return scene


def levels_today(lighting: Lighting, lamps: Any, names: Any) -> Any:
    """Return the emissions (n, 3) that the levels of fixtures.csv give on these emitters."""
    emissions = np.zeros((len(names), 3))
    for k, fixture in enumerate(fixtures_of(lighting)):
        dmx = fixture.dmx
        levels = dict(zip(RGB, (dmx.red, dmx.green, dmx.blue), strict=True))
        drives = [levels.get(name, 0) / 255 for name in lamps[k].names]
        emissions[k] = dmx.dimmer / 255 * lamps[k].mix(np.array(drives))
    return emissions


def received_drives(rig: Any, drives: Any) -> Any:
    """Send drives by sACN to this machine, and return those that arrive."""
    sacn = PROTOCOLS["sacn"]
    numbers = network_universes(rig, sacn, {})
    with (
        ConsoleReceiver.open(sacn, address="127.0.0.1") as receiver,
        ConsoleLink.open("sacn://127.0.0.1", rig) as link,
    ):
        link.show(drives)
        end = time.monotonic() + 3
        while time.monotonic() < end and len(receiver.levels) < len(numbers):
            receiver.receive(0.1)
        levels = {own: receiver.levels[number] for own, number in numbers.items()}
    return decode_levels(rig, levels)


def compare(spp: int) -> None:
    """Print the errors of all ways."""
    with tempfile.TemporaryDirectory() as folder:
        path = show_scene(Path(folder))
        scene = on_film(lp.load_scene(path), None, RESOLUTION)
        basis = lp.render_basis(scene, spp=spp)
        constraints = lp.read_constraints(path.with_suffix(".lights.toml"))
        lamps, names = reduce_to(constraints, basis.lights).lamps, basis.names
        rng = np.random.default_rng(SEED)
        steps = np.array([0, 0, 32, 90, 180, 255]) / 255
        true = np.array([lamps[k].mix(rng.choice(steps, len(lamps[k].most))) for k in lamps])
        truth = basis.mix(true)
        noisy = truth * (1 + NOISE * rng.standard_normal(truth.shape[:2]))[..., None]
        target = lp.Target(
            "known", noisy.astype(np.float32), np.ones(truth.shape[:2], np.float32), everything=True
        )
        three = lp.solve(basis.with_requests(type(basis.requests)()), target, literal=True)
        found = lp.solve(basis, target, constraints=constraints, literal=True)
        rows = {"three numbers": basis.mix(three.weights)}
        levels = basis.mix(levels_today(three.lighting, lamps, names))
        rows["levels of these"] = levels * float((levels * truth).sum() / np.square(levels).sum())
        rows["drives"] = basis.mix(found.weights)
        rig = read_rig(SHOW)
        arrived = received_drives(rig, {x.name: x.drives for x in found.lighting.lights})
        emissions = np.array(
            [lamps[k].mix(np.array([*arrived[name].values()])) for k, name in enumerate(names)]
        )
        rows["received"] = basis.mix(emissions)
        for name, picture in rows.items():
            print(f"{name:16} {100 * error(picture, truth):6.2f} %")
        lighting = Lighting.of_weights(basis, emissions, lamps=lamps)
        relit = lp.relight(scene, lighting, Path(folder) / "relit.xml")
        relit = on_film(relit, None, RESOLUTION)
        rendered = render(relit, spp=4 * spp, seed=SEED, stream=Stream.VERIFICATION).image
        means = rendered.mean((0, 1)) / truth.mean((0, 1))
        print(
            f"{'rendered':16} {100 * error(blocks(rendered), blocks(truth)):6.2f} %, means of "
            f"channels {', '.join(f'{x:.4f}' for x in means)}"
        )


def made_lamps(drives: int) -> tuple[Basis, lp.Constraints, dict[str, Any]]:
    """Return a basis of lamps of six emitters, their constraints, and two paintings by name."""
    lights, size = drives // 6, (45, 80)
    rng = np.random.default_rng(SEED)
    images = (rng.random((lights, *size, 3)) ** 8).astype(np.float32)
    basis = Basis(
        tuple(BasisLight(f"l{k}", "spot", "intensity", "W/sr", (1, 1, 1)) for k in range(lights)),
        images,
        np.zeros_like(images),
        np.zeros(size, bool),
        Origin("made", "made", "camera", 0, "separate", (0, 0), (0, 0)),
    )
    xy = {
        **{"red": [0.7, 0.299], "green": [0.17, 0.7], "blue": [0.135, 0.055]},
        **{"white": [0.33, 0.34], "amber": [0.57, 0.42], "lime": [0.41, 0.55]},
    }
    emitters = [{"name": name, "xy": x, "Y": 1.0} for name, x in xy.items()]
    constraints = lp.Constraints.of({"l*": {"emitters": emitters}})
    inside = basis.mix(rng.random((lights, 3)) * 3) * rng.uniform(0.8, 1.2, (*size, 1))
    lamps = reduce_to(constraints, basis.lights).lamps.values()
    known = np.array([lamp.mix(rng.choice([0, 0, 0.1, 0.4, 0.7, 1], 6)) for lamp in lamps])
    at_bounds = basis.mix(known) * (1 + NOISE * rng.standard_normal((*size, 1)))
    ones = np.ones(size, np.float32)
    targets = {
        name: lp.Target(name, image.astype(np.float32), ones, everything=True)
        for name, image in (("inside", inside), ("known drives", at_bounds))
    }
    return basis, constraints, targets


def speed(drives: int) -> None:
    """Print the time of solves for so many drives, relative to three channels a light."""
    basis, constraints, targets = made_lamps(drives)
    display = {"space": "display", "transform": lp.ViewTransform("srgb")}
    fits = {
        "literal": {"literal": True},
        "display": {**display, "colors": "free"},
        "default": {**display, "colors": "gentle"},
    }
    print(f"{drives} drives of {len(basis.lights)} lamps, relative to three channels a light")
    for name, target in targets.items():
        for fit, options in fits.items():
            times: dict[bool, list[float]] = {False: [], True: []}
            for _ in range(5):
                for has_drives, spent in times.items():
                    given = constraints if has_drives else None
                    begin_s = time.process_time()
                    found = lp.solve(basis, target, constraints=given, **options)
                    spent.append(time.process_time() - begin_s)
            three, many = (min(spent) for spent in times.values())
            print(f"{name:12} {fit:8} {1000 * many:6.1f} ms, {many / three:5.2f} times")
    fresh = [replace(x) for x in found.lighting.lights]
    begin_s = time.process_time()
    for light in fresh:
        _ = light.drives
    print(f"preferred mixes of all: {1000 * (time.process_time() - begin_s):.0f} ms")


def large_show(folder: Path, count: int) -> Path:
    """Return a show with so many copies of the fixtures of the shipped one, at free addresses."""
    path = folder / f"{count}.mvr"
    with zipfile.ZipFile(SHOW) as old, zipfile.ZipFile(path, "w") as new:
        root = ElementTree.fromstring(old.read(DESCRIPTION))
        parents = [(x, e) for x in root.iter("ChildList") for e in x.findall("Fixture")]
        for k in range(count):
            parent, fixture = parents[k % len(parents)]
            made = copy.deepcopy(fixture)
            made.find("FixtureID").text = str(1000 + k)
            made.find("Addresses/Address").text = str(1 + 512 * (k // 16) + 30 * (k % 16))
            parent.append(made)
        for parent, fixture in parents:
            parent.remove(fixture)
        new.writestr(DESCRIPTION, ElementTree.tostring(root))
        for name in set(old.namelist()) - {DESCRIPTION}:
            new.writestr(name, old.read(name))
    return path


def console(read: int, sent: int) -> None:
    """Print the times of a show with so many fixtures, and of sending to another."""
    with tempfile.TemporaryDirectory() as folder:
        path = large_show(Path(folder), read)
        begin_s = time.process_time()
        read_rig(path)
        print(f"a show of {read} fixtures is read in {time.process_time() - begin_s:.3f} s")
        rig = read_rig(large_show(Path(folder), sent))
    rng = np.random.default_rng(SEED)
    lights = [light for fixture in rig.fixtures for light in fixture.lights]

    def drives() -> Any:
        return {x.name: {e.name: float(rng.random()) for e in x.emitters} for x in lights}

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
        port.bind(("127.0.0.1", 0))
        with ConsoleLink.open(f"sacn://127.0.0.1:{port.getsockname()[1]}", rig) as link:
            look, start = drives(), time.monotonic()
            link.show(look)
            port.recv(1024)
            print(
                f"first packet of {sent} fixtures after {1000 * (time.monotonic() - start):.0f} ms"
            )
            port.setblocking(False)
            count, end, begin = 0, time.monotonic() + 3, time.process_time()
            while time.monotonic() < end:
                link.show(drives())
                time.sleep(0.01)
                with suppress(BlockingIOError):
                    while port.recv(1024):
                        count += 1
            share = (time.process_time() - begin) / 3
    frames = count / 3 / len(rig.universes)
    print(
        f"{frames:.0f} frames a second leave while all levels change, {100 * share:.0f} % of a core"
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--drives", type=int, default=504)
    parser.add_argument("--drives-only", action="store_true", help="skip the shipped show")
    asked = parser.parse_args()
    speed(asked.drives)
    if not asked.drives_only:
        compare(asked.spp)
        console(76, 100)
