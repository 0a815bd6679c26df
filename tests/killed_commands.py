"""`solve` and `relight` over an earlier result, killed: the folder is the earlier or the new one.

    python tests/killed_commands.py --kills 40 --seed 1

kills real processes at random moments, half of them around the one at which results appear, and
prints what was found; some minutes. A handful is among the tests (cli/test_kills.py).
"""

import argparse
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from command import succeed
from light_groups import interleaved, pictures
from renderer import LIGHTS, write_room

from lightpaint.images.formats.exr import write_rgb
from lightpaint.storage.staging import JOURNAL, MARK, finish

SIDE = """<sensor type="perspective" id="side"><transform name="to_world">
    <lookat origin="2 1 2" target="0 0.5 0" up="0 1 0"/></transform><film type="hdrfilm">
    <integer name="width" value="24"/><integer name="height" value="20"/></film></sensor>"""

VIEWS = ("--target", "camera=look.exr", "--target", "side=other.exr")

#: What is done over an earlier result in `look`, and by which command that came about.
COMMANDS: dict[str, tuple[list[list[str]], list[str]]] = {
    "solve": (
        [["solve", "room.xml", "look.exr", "--spp", "4"]],
        ["solve", "room.xml", "look.exr", "--spp", "4", "--off", "bulb"],
    ),
    "solve, two views": (
        [["solve", "room.xml", *VIEWS, "--spp", "4"]],
        ["solve", "room.xml", *VIEWS, "--spp", "4", "--off", "bulb"],
    ),
    "solve, another painting": (
        [["solve", "room.xml", *VIEWS, "--spp", "4"]],
        ["solve", "room.xml", "other.exr", "--spp", "4", "-o", "look", "--force"],
    ),
    "solve, light groups": (
        [["solve", "groups.exr", "groups/look.exr"]],
        ["solve", "groups.exr", "groups/look.exr", "--off", "a"],
    ),
    "relight": (
        [
            ["solve", "room.xml", "look.exr", "--spp", "4"],
            ["relight", "room.xml", "look/lighting.json", "--spp", "4"],
        ],
        ["relight", "room.xml", "look/lighting.json", "--spp", "8"],
    ),
    "solve, where somebody works": (
        [["solve", "room.xml", "look.exr", "--spp", "4"]],
        ["solve", "../room.xml", "../look.exr", "--spp", "4", "--off", "bulb", "-o", "."],
    ),
}


@dataclass(frozen=True)
class Outcome:
    """After a kill. kind: `earlier`, `new`, or what is wrong; code: of the process."""

    kind: str
    code: int
    stderr: str


class Stage:
    """A folder with an earlier result, to do the same command over and over in."""

    def __init__(self, folder: Path, name: str) -> None:
        self.folder, self.look = folder, folder / "look"
        before, self.command = COMMANDS[name]
        write_room(folder, lights=LIGHTS["panel"] + LIGHTS["bulb"], sensors=SIDE)
        for k, painting in enumerate(("look.exr", "other.exr"), start=1):
            write_rgb(folder / painting, np.full((20, 24, 3), 0.3 * k, np.float32))
        layers = {f"RGBA_{name}": x for name, x in zip("abc", pictures(), strict=True)}
        interleaved(folder / "groups.exr", layers)
        write_rgb(folder / "groups" / "look.exr", pictures()[0])
        self.environment = {**os.environ, "LIGHTPAINT_CACHE": str(folder / "cache")}
        for command in before:
            succeed(folder, *command, LIGHTPAINT_CACHE=self.environment["LIGHTPAINT_CACHE"])
        (self.look / "notes.txt").write_text("mine", encoding="utf-8")
        shutil.copytree(self.look, folder / "earlier")
        self.earlier = contents(self.look)
        # One that is not killed: it says how long that takes, and fills the cache.
        self.run_s = 0.0
        begun_s = time.monotonic()
        assert self.killed(lambda _: None, 0).kind == "new"
        self.run_s = time.monotonic() - begun_s

    def killed(self, until: Callable[["Stage"], None], number: int) -> Outcome:
        """Do the command, wait `until`, send the signal `number`, and look."""
        shutil.rmtree(self.look)
        shutil.copytree(self.folder / "earlier", self.look)
        with subprocess.Popen(
            [sys.executable, "-m", "lightpaint", *self.command],
            cwd=self.look if self.command[-1] == "." else self.folder,
            env=self.environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        ) as process:
            until(self)
            if number:
                process.send_signal(number)
            stderr = process.communicate()[1]
        kind = self.what_is_there()
        finish(self.look)
        # Killed between the record of a new result and its first file, it has the earlier one yet.
        later = self.what_is_there()
        if kind in ("earlier", "new") and later not in (kind, "new"):
            kind = f"{kind}, and {later} when finished"
        leftovers = [path.name for path in self.hidden]
        return Outcome(
            f"{kind}, with {leftovers}" if leftovers else kind, process.returncode, stderr
        )

    def what_is_there(self) -> str:
        """`earlier`, `new`, or what is wrong."""
        contents_now = contents(self.look)
        if contents_now == self.earlier:
            return "earlier"
        record = json.loads(contents_now.get("result.json", b'{"files": {}}'))
        files = set(record["files"]) | {"notes.txt", "result.json"}
        if set(contents_now) != files:
            return f"not whole: {sorted(set(contents_now) ^ files)}"
        sums = {name: f"{zlib.crc32(contents_now[name]):08x}" for name in record["files"]}
        mixed = [name for name, known_sum in record["files"].items() if sums[name] != known_sum]
        return f"mixed: {mixed}" if mixed else "new"

    @property
    def hidden(self) -> list[Path]:
        """Folders in which a new result is on its way, or was."""
        hidden_files: list[Path] = []
        for place in (self.folder, self.look):
            with suppress(FileNotFoundError):
                hidden_files += [place / name for name in os.listdir(place) if MARK in name]
        return hidden_files


def contents(folder: Path) -> dict[str, bytes]:
    """What a person finds there."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and not path.relative_to(folder).as_posix().startswith((MARK, JOURNAL))
    }


def wait_for_seconds(seconds: float) -> Callable[[Stage], None]:
    """Wait so long."""
    return lambda _: time.sleep(seconds)


def wait_for_staging(seconds: float) -> Callable[[Stage], None]:
    """Wait until the new result is on its way, and then so long."""

    def wait(stage: Stage) -> None:
        end_s = time.monotonic() + 60
        while not stage.hidden and time.monotonic() < end_s:
            time.sleep(0.001)
        time.sleep(seconds)

    return wait


def wait_for_record(stage: Stage) -> None:
    """Wait until the new result is there or about to be: its record is written last."""
    end_s = time.monotonic() + 60
    while time.monotonic() < end_s:
        staged = [path / "result.json" for path in stage.hidden]
        try:
            if any(path.exists() for path in staged) or stage.what_is_there() != "earlier":
                return
        except FileNotFoundError:  # it appears at this moment
            return


def moments(stage: Stage, chance: random.Random) -> Iterator[tuple[str, Callable[[Stage], None]]]:
    """Without end: at any time, and around the time when the new result appears."""
    while True:
        yield "any", wait_for_seconds(chance.uniform(0, 1.05 * stage.run_s))
        yield "staging", wait_for_staging(chance.uniform(0, 0.5 * stage.run_s))
        yield "any", wait_for_seconds(chance.uniform(0, 1.05 * stage.run_s))
        yield "staged", wait_for_record


def _main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--kills", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    chance = random.Random(options.seed)
    mixtures: Counter[tuple[str, str, str, str, int]] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        stages = {}
        for name in COMMANDS:
            place = Path(folder) / name.replace(" ", "_")
            place.mkdir()
            stages[name] = Stage(place, name)
            print(f"{name}: {stages[name].run_s:.1f} s", flush=True)
        turns = {name: moments(stage, chance) for name, stage in stages.items()}
        for k in range(options.kills):
            name = list(COMMANDS)[k % len(COMMANDS)]
            number = chance.choice([signal.SIGKILL, signal.SIGKILL, signal.SIGTERM])
            moment, until = next(turns[name])
            outcome = stages[name].killed(until, number)
            if "Traceback" in outcome.stderr:
                print(outcome.stderr)
            mixtures[name, moment, number.name, outcome.kind, outcome.code] += 1
    for row, count in sorted(mixtures.items()):
        print(count, *row, sep="\t")
    return int(any(row[3] not in ("earlier", "new") for row in mixtures))


if __name__ == "__main__":
    sys.exit(_main())
