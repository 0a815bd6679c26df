"""Damaged and hostile files in thousands, read in a process of its own that may take 2 GB.

Run as a program it reads a pickle of cases and prints one line for each; the process that gave
them counts one that never came as a crash or a hang. `damage_readers.py` knows the kinds of files.
"""

import gc
import os
import pickle
import random
import re
import resource
import signal
import struct
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from damage_readers import Reader

from lightpaint.errors import LightpaintError

MEMORY = 2 * 2**30
SECONDS = 10

#: Numbers that headers lie with.
LIES = (0, 1, 2, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x10000, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)

#: What may become of a case: read as it was before; read as it now says, which another reader
#: agrees with (`alone` where that one sees none, `read` where there is no other); or refused in one
#: line that names the file.
FINE = ("same", "agreed", "alone", "read", "refused")


@dataclass(frozen=True)
class Case:
    """A file, its name and what it holds, and what was done to it.

    file: in the folder of cases, or wherever it says. content: None for what is there already.
    """

    file: str
    done: str
    content: bytes | None = None


def flip_bit(content: bytes, position: int, bit: int) -> bytes:
    """`content` with one bit turned."""
    return content[:position] + bytes([content[position] ^ 1 << bit]) + content[position + 1 :]


def damage(file: str, content: bytes, seed: int, flips: int, lies: int) -> Iterator[Case]:
    """Cut at 250 places and near the end, bits turned, numbers made to lie."""
    rng = random.Random(seed)
    step = max(1, len(content) // 250)
    for end in sorted({*range(0, len(content), step), *range(len(content) - 20, len(content))}):
        yield Case(file, f"cut at {end}", content[:end])
    for k in range(flips):
        # Every other one in the head, where the structure is.
        position = rng.randrange(min(400, len(content)) if k % 2 else len(content))
        yield Case(file, f"flip at {position}", flip_bit(content, position, rng.randrange(8)))
    for _ in range(lies):
        position = rng.randrange(min(600, len(content)))
        lie = struct.pack(rng.choice("<>") + rng.choice("HI"), 0)
        number = rng.choice(LIES) & (256 ** len(lie) - 1)
        order = rng.choice(("little", "big"))
        bent = (
            content[:position] + number.to_bytes(len(lie), order) + content[position + len(lie) :]
        )
        if bent != content:
            yield Case(file, f"lie at {position}", bent)


def outcomes(
    kind: str, originals: Mapping[str, bytes], cases: Sequence[Case], folder: Path
) -> list[tuple[Case, str]]:
    """What becomes of each case, read as `kind` (see `Reader`). whole: undamaged files by name."""
    results: list[tuple[Case, str]] = []
    while len(results) < len(cases):
        remaining = cases[len(results) :]
        (folder / "cases.pickle").write_bytes(pickle.dumps((kind, originals, remaining)))
        outcome, end = _worker(folder)
        results += zip(remaining, outcome, strict=False)
        if len(outcome) < len(remaining):
            results.append((remaining[len(outcome)], end))
    print(
        kind,
        dict(Counter(outcome if outcome in FINE else "anything else" for _, outcome in results)),
    )
    return results


def wrong_outcomes(results: Iterable[tuple[Case, str]], right: Sequence[str] = FINE) -> list[str]:
    """What ended in any other way."""
    return [
        f"{case.file}, {case.done}: {outcome}" for case, outcome in results if outcome not in right
    ]


def read_despite_cut(results: Iterable[tuple[Case, str]]) -> list[tuple[Case, str]]:
    """What was cut off, and read as if something were left of it."""
    return [(c, s) for c, s in results if c.done.startswith("cut") and s not in ("same", "refused")]


def is_legible(error: BaseException, path: Path, longest: int = 2500) -> bool:
    """Whether an error is one line, no longer than can be read, that names the file once."""
    text = str(error)
    return is_named_once(text, path) and text.isprintable() and len(text) < longest


def is_named_once(text: str, path: Path) -> bool:
    """Whether a message names the file once, or another beside it instead.

    A template is a folder, and named as that or as a file in it, not as both. What a scene refers
    to may be named beside the scene: each once.
    """
    folder = str(path.parent)
    paths = re.findall(rf"{re.escape(folder)}(?:/[^\s/\"':,;]+)*", text)
    return len(paths) == len(set(paths)) > 0 and (len(paths) == 1 or folder not in paths)


def attempt(read: Callable[[Path], Any], path: Path, error: type[Exception]) -> Any:
    """What is read, or None for a clear error of that type."""
    try:
        return read(path)
    except error as refusal:
        if not is_legible(refusal, path):
            raise AssertionError(f"unclear: {refusal}") from refusal
        return None


def _worker(folder: Path) -> tuple[list[str], str]:
    root = Path(__file__).parents[1]
    path = os.pathsep.join([str(root), str(root / "tests"), os.environ.get("PYTHONPATH", "")])
    with (folder / "said").open("w+") as log:
        completed = subprocess.run(
            [sys.executable, __file__, str(folder)],
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": path},
            timeout=600,
            check=False,
        )
        log.seek(0)
        end = (
            "hung"
            if completed.returncode == -signal.SIGALRM
            else f"ended with {completed.returncode}"
        )
        return log.read().splitlines(), end


def _read_all(folder: Path) -> None:
    kind, originals, cases = pickle.loads((folder / "cases.pickle").read_bytes())
    output = os.fdopen(os.dup(1), "w")
    from lightpaint.colour.primaries import colour_science

    reader = Reader(kind)
    known_values = {}
    # Everything that is used is loaded before the limit: threads reserve what they never take.
    colour_science()
    for file, content in originals.items():
        (folder / file).write_bytes(content)
        known_values[file] = reader.read(folder / file)
    gc.freeze()  # scenes collect garbage, for which libraries need not be looked through
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    for case in cases:
        path = folder / case.file
        if case.content is not None:
            path.write_bytes(case.content)
        signal.alarm(10 * SECONDS)
        output.write(_describe_outcome(reader, path, known_values.get(case.file)) + "\n")
        output.flush()
    gc.unfreeze()


def _describe_outcome(reader: Reader, path: Path, known_value: Any) -> str:
    start_s = time.process_time()  # however busy the machine is
    try:
        read = reader.read(path)
    except LightpaintError as error:
        # Pictures are refused for less than scenes may be.
        is_clear = (
            is_legible(error, path, 600) if reader.kind == "picture" else is_legible(error, path)
        )
        outcome = "refused" if is_clear else f"unclear: {str(error)!r}"
    except BaseException as error:
        return f"{type(error).__name__}: {str(error)[:200]!r}"
    else:
        outcome = "same" if read == known_value else reader.opinion(path, read)
    took = time.process_time() - start_s
    return outcome if took < SECONDS else f"took {took:.1f} s"


if __name__ == "__main__":
    _read_all(Path(sys.argv[1]))
