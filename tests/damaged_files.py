"""Damaged bases, lightings, lights files and scenes, read in a process that may take 2 GB.

As `damage.py` does it for pictures: run as a program it reads a pickle of cases and prints one
line for each; the process that gave them counts one that never came as a crash or a hang.
"""

import json
import os
import pickle
import resource
import signal
import subprocess
import sys
import time
import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

MEMORY = 2 * 2**30
SECONDS = 10


@dataclass(frozen=True)
class Case:
    """A file, its name and what it holds, and what was done to it.

    file: in the folder of cases, or wherever it says. content: None for what is there already.
    """

    file: str
    done: str
    content: bytes | None = None


#: What may become of a case: read as it was before, read as it now says (which another reader
#: agrees with; `read` where there is none), or refused in one line that names the file.
FINE = ("same", "agreed", "read", "refused")


def outcomes(
    kind: str, whole: Path | None, cases: Sequence[Case], folder: Path
) -> list[tuple[Case, str]]:
    """What becomes of each case, read as `kind` (see `_reader`). whole: the undamaged file."""
    results: list[tuple[Case, str]] = []
    while len(results) < len(cases):
        remaining = cases[len(results) :]
        (folder / "cases.pickle").write_bytes(pickle.dumps((kind, whole, remaining)))
        said, end = _worker(folder)
        results += zip(remaining, said, strict=False)
        if len(said) < len(remaining):
            results.append((remaining[len(said)], end))
    print(kind, dict(Counter(said if said in FINE else "anything else" for _, said in results)))
    return results


def wrong(results: Iterable[tuple[Case, str]], right: Sequence[str] = FINE) -> list[str]:
    """What ended in any other way."""
    return [f"{case.file}, {case.done}: {said}" for case, said in results if said not in right]


def _worker(folder: Path) -> tuple[list[str], str]:
    root = Path(__file__).parents[1]
    path = os.pathsep.join([str(root), str(root / "tests"), os.environ.get("PYTHONPATH", "")])
    with (folder / "said").open("w+") as said:
        done = subprocess.run(
            [sys.executable, __file__, str(folder)],
            stdin=subprocess.DEVNULL,
            stdout=said,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": path},
            timeout=600,
            check=False,
        )
        said.seek(0)
        end = "hung" if done.returncode == -signal.SIGALRM else f"ended with {done.returncode}"
        return said.read().splitlines(), end


def _read_all(folder: Path) -> None:
    kind, whole, cases = pickle.loads((folder / "cases.pickle").read_bytes())
    out = os.fdopen(os.dup(1), "w")
    reader = Reader(kind)
    # Everything that is used is loaded before the limit: threads reserve what they never take.
    known = reader.read(whole) if whole is not None else None
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    for case in cases:
        path = folder / case.file
        if case.content is not None:
            path.write_bytes(case.content)
        signal.alarm(2 * SECONDS)
        out.write(_said(reader, path, known) + "\n")
        out.flush()


class Reader:
    """Reads one kind of file, and compares it."""

    def __init__(self, kind: str) -> None:
        self.kind = kind
        if kind == "scene":
            from lightpaint.scene.variant import use_variant

            use_variant("scalar_rgb")

    def read(self, path: Path) -> Any:
        """All that is known of the file, to compare."""
        if self.kind == "lighting":
            from lightpaint.lighting.lighting import read_lighting

            return read_lighting(path)
        if self.kind == "lights":
            from lightpaint.lighting.constraints.file import read_constraints
            from lightpaint.scene.lights_file import read_lights_file

            file = read_lights_file(path)
            return file.lights, dict(file.groups), read_constraints(path)
        if self.kind == "template":
            from lightpaint.target.template import read_template

            template = read_template(path.parent)
            return template.view, template.scene, template.content, template.sensor
        if self.kind == "basis":
            from lightpaint.basis.file import read_basis, read_origin

            basis = read_basis(path)
            assert read_origin(path) == (basis.origin, basis.size, len(basis.lights))
            arrays = (basis.images, basis.half_differences, basis.emitters_seen)
            return basis.lights, basis.origin, [(a.shape, a.tobytes()) for a in arrays]
        if self.kind == "groups":
            from lightpaint.basis.lightgroups.read import read_light_groups

            found = read_light_groups(path)
            return found.basis.names, found.basis.images.tobytes()
        from lightpaint.scene.scene import load_scene

        scene = load_scene(path)
        return scene.film, scene.spp, scene.integrator, scene.emitters

    def agrees(self, path: Path, read: Any) -> bool:
        """Whether what was read is what a plain parser finds in the file."""
        if self.kind == "lighting":
            return contents(read) == contents_of_json(json.loads(path.read_text("utf-8-sig")))
        if self.kind == "lights":
            data = tomllib.loads(path.read_text("utf-8-sig"))
            lights, groups, constraints = read
            return (
                list(lights or ()) == data.get("lights", [])
                and {k: list(v) for k, v in groups.items()} == data.get("groups", {})
                and {k: v for k, v, _ in constraints.lights} == data.get("light", {})
                and constraints.sparse == data.get("sparse")
            )
        if self.kind == "template":
            data = json.loads(path.read_text("utf-8-sig"))
            view = data["view"]
            return (read[0].name, read[0].stops, *read[1:]) == (
                *(view["name"], view["stops"]),
                *(data[k] for k in ("scene", "content", "sensor")),
            )
        return False


def contents(lighting: Any) -> Any:
    """What a lighting says, by way of the file that is written of it."""
    from lightpaint.lighting.lighting import write_lighting

    path = Path(os.environ.get("TMPDIR", "/tmp")) / f"lighting.{os.getpid()}.json"
    write_lighting(path, lighting)
    try:
        return contents_of_json(json.loads(path.read_text(encoding="utf-8")))
    finally:
        path.unlink()


def contents_of_json(data: Any) -> Any:
    """What a lighting.json says, with what goes without saying; the rest it may say is not read."""
    lights = []
    for name, light in data["lights"].items():
        constraint = light.get("constraint", "")
        lights.append(
            (
                *(name, light["plugin"], light["parameter"], light["unit"]),
                *(light["emission"], light["weight"], light.get("members", [name])),
                *(light.get("is_fixed", False), light.get("unit_flux"), constraint),
                light.get("is_active", False) if constraint else False,
                light.get("standard_error"),
            )
        )
    solve = data.get("solve")
    if solve is not None:
        needed = ("kkt_residual", "objective", "relative_objective", "sweeps", "converged")
        solve = [*(solve[k] for k in (*needed, "unreached")), solve.get("curve", [])]
        bounds = ("lights", "kind", "held_by", "gain", "multiplier", "per")
        solve.append([[b[k] for k in bounds] for b in data["solve"].get("bounds", [])])
    about = [data.get(k, "") for k in ("target", "scene_identity")]
    return data["format"], about, data.get("cd_per_unit"), lights, solve


def clear(error: BaseException, path: Path) -> bool:
    """Whether an error is one line, no longer than can be read, that names the file."""
    text = str(error)
    # A template is a folder; a scene may name what it refers to, which has its name here.
    named = path.stem in text or path.parent.name in text
    return named and text.isprintable() and len(text) < 2500


def attempt(read: Callable[[Path], Any], path: Path, error: type[Exception]) -> Any:
    """What is read, or None for a clear error of that type."""
    try:
        return read(path)
    except error as refusal:
        if not clear(refusal, path):
            raise AssertionError(f"unclear: {refusal}") from refusal
        return None


def _said(reader: Reader, path: Path, known: Any) -> str:
    from lightpaint.errors import LightpaintError

    began = time.perf_counter()
    try:
        read = reader.read(path)
    except LightpaintError as error:
        said = "refused" if clear(error, path) else f"unclear: {str(error)!r}"
    except BaseException as error:
        return f"{type(error).__name__}: {str(error)[:200]!r}"
    else:
        if read == known:
            said = "same"
        elif reader.kind in ("scene", "groups"):
            said = "read"  # a bit that is turned in a number of these nobody can know of
        else:
            said = "agreed" if reader.agrees(path, read) else f"misread as {read!r}"[:300]
    took = time.perf_counter() - began
    return said if took < SECONDS else f"took {took:.1f} s"


if __name__ == "__main__":
    _read_all(Path(sys.argv[1]))
