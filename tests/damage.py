"""Damaged pictures in thousands, read in a process of its own that may take 2 GB.

Run as a program it reads a pickle of cases and prints one line for each; the process that gave
them counts one that never came as a crash or a hang.
"""

import os
import pickle
import random
import resource
import struct
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

MEMORY = 2 * 2**30
SECONDS = 10.0

#: Numbers that headers lie with.
LIES = (0, 1, 2, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x10000, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)


@dataclass(frozen=True)
class Outcome:
    """What became of one damaged file.

    said: `same` as undamaged; `refused`; `agreed`: another picture, and another reader sees it
    too; `alone`: the other reader sees none; or what went wrong.
    """

    name: str
    kind: str
    at: int
    said: str


def damaged(content: bytes, seed: int, flips: int, lies: int) -> Iterator[tuple[str, int, bytes]]:
    """(kind of damage, where, bytes): cut at 250 places, bits turned, numbers made to lie."""
    rng = random.Random(seed)
    step = max(1, len(content) // 250)
    for end in sorted({*range(0, len(content), step), *range(len(content) - 20, len(content))}):
        yield "cut", end, content[:end]
    for k in range(flips):
        # Every other one in the head, where the structure is.
        at = rng.randrange(min(400, len(content)) if k % 2 else len(content))
        bent = bytearray(content)
        bent[at] ^= 1 << rng.randrange(8)
        yield "flip", at, bytes(bent)
    for _ in range(lies):
        at = rng.randrange(min(600, len(content)))
        lie = struct.pack(rng.choice("<>") + rng.choice("HI"), 0)
        number = rng.choice(LIES) & (256 ** len(lie) - 1)
        order = rng.choice(("little", "big"))
        yield "lie", at, content[:at] + number.to_bytes(len(lie), order) + content[at + len(lie) :]


def outcomes(samples: dict[str, bytes], folder: Path, *, flips: int, lies: int) -> list[Outcome]:
    """What becomes of every damaged version of these files."""
    cases = [
        (name, kind, at, bent)
        for k, (name, content) in enumerate(samples.items())
        for kind, at, bent in damaged(content, k, flips, lies)
        if bent != content
    ]
    results: list[Outcome] = []
    while len(results) < len(cases):
        remaining = cases[len(results) :]
        with (folder / "cases.pickle").open("wb") as file:
            pickle.dump((samples, remaining), file)
        said, end = _worker(folder)
        for (name, kind, at, _), line in zip(remaining, said, strict=False):
            results.append(Outcome(name, kind, at, line))
        if len(said) < len(remaining):
            name, kind, at, bent = remaining[len(said)]
            (folder / f"broke_{len(results)}_{name}").write_bytes(bent)
            results.append(Outcome(name, kind, at, end))
    return results


def counted(results: list[Outcome]) -> Counter[str]:
    """How many are read, refused, and anything else."""
    fine = ("same", "refused", "agreed", "alone")
    return Counter(r.said if r.said in fine else "anything else" for r in results)


def _worker(folder: Path) -> tuple[list[str], str]:
    root = Path(__file__).parents[1]
    path = os.pathsep.join([str(root), str(root / "tests"), os.environ.get("PYTHONPATH", "")])
    with (folder / "said").open("w+") as said:
        try:
            done = subprocess.run(
                [sys.executable, __file__, str(folder)],
                stdout=said,
                stderr=subprocess.DEVNULL,
                env={**os.environ, "PYTHONPATH": path},
                timeout=300,
                check=False,
            )
            end = f"ended with {done.returncode}"
        except subprocess.TimeoutExpired:
            end = "hung"
        said.seek(0)
        return said.read().splitlines(), end


def _read_all(folder: Path) -> None:
    # Everything that is used is loaded before the limit: threads reserve what they never take.
    from lightpaint.images.picture import read_picture

    samples, cases = pickle.loads((folder / "cases.pickle").read_bytes())
    whole = {}
    for name, content in samples.items():
        path = folder / name
        path.write_bytes(content)
        whole[name] = _picture(read_picture(path))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    for name, _, _, bent in cases:
        path = folder / name
        path.write_bytes(bent)
        print(_said(path, whole[name]), flush=True)


def _said(path: Path, whole: tuple[object, ...]) -> str:
    from lightpaint.errors import ImageError
    from lightpaint.images.picture import read_picture

    began = time.perf_counter()
    try:
        picture = read_picture(path)
    except ImageError as error:
        clear = path.name in str(error) and "\n" not in str(error) and len(str(error)) < 600
        said = "refused" if clear else f"unclear: {str(error)!r}"
    except BaseException as error:
        return f"{type(error).__name__}: {str(error)[:200]!r}"
    else:
        said = "same" if _picture(picture) == whole else _second_opinion(path, picture)
    took = time.perf_counter() - began
    return said if took < SECONDS else f"took {took:.1f} s"


def _second_opinion(path: Path, picture: Any) -> str:
    """Whether another reader sees in the file what was read: `agreed`, `alone` or `disputed`.

    No reader can know of a bit that is turned in pixels without a checksum; but two that see
    different pixels in one file cannot both be right.
    """
    import numpy as np

    from lightpaint.images.bitmap import read_bitmap
    from lightpaint.images.picture import file_kind

    try:
        theirs = _theirs(path, file_kind(path))
    except Exception:
        return "alone"
    if theirs.ndim == 2:
        theirs = theirs[..., None]
    if theirs.size == 0:
        return "alone"
    theirs = theirs[..., :3] if theirs.shape[-1] >= 3 else theirs[..., :1].repeat(3, axis=-1)
    if picture.kind == "exr":
        ours = np.where(picture.finite[..., None], picture.image, 0)
    else:
        ours = read_bitmap(path, picture.kind).values
    if ours.shape != theirs.shape:
        return f"disputed: {ours.shape} and {theirs.shape}"
    if picture.codes is None:
        finite = np.isfinite(theirs).all(axis=-1, keepdims=True)
        theirs = np.where(finite, theirs, 0)
        ours = np.where(finite, ours, 0)
    if picture.alpha is not None and picture.kind == "psd":
        # What is partly transparent is left out, since readers differ there.
        theirs, ours = (np.where(picture.alpha[..., None] > 0, v, 0) for v in (theirs, ours))
    # Two builds of JPEG's library round apart.
    close = 3 if picture.lossy else 1e-6 * np.abs(theirs).max()
    with np.errstate(all="ignore"):
        miss = np.abs(ours.astype(float) - theirs.astype(float)).max()
    return "agreed" if miss <= close else f"disputed by {miss:g}"


def _theirs(path: Path, kind: str) -> Any:
    """Pixels by a reader that is not ours, (h, w) or (h, w, n)."""
    import numpy as np

    if kind == "exr":
        import OpenImageIO

        file = OpenImageIO.ImageInput.open(str(path))
        spec = file.spec()
        if "uint" in map(str, [spec.format, *spec.channelformats]):
            raise ValueError("integers, which it scales to be between 0 and 1")
        order = [list(spec.channelnames).index(c) for c in "RGB"]
        stored = file.read_image(0, 0, 0, spec.nchannels, OpenImageIO.FLOAT)[..., order]
        canvas = np.zeros((spec.full_height, spec.full_width, 3), np.float32)
        y, x = spec.y - spec.full_y, spec.x - spec.full_x
        for row in range(stored.shape[0]):
            for column in range(stored.shape[1]):
                if 0 <= y + row < canvas.shape[0] and 0 <= x + column < canvas.shape[1]:
                    canvas[y + row, x + column] = stored[row, column]
        return canvas
    if kind == "tiff":
        import tifffile

        with tifffile.TiffFile(path) as file:
            return file.pages[0].asarray()
    if kind == "psd":
        head = struct.unpack(">HIIH", path.read_bytes()[12:24])
        channels, height, width, depth = head
        stored = np.frombuffer(path.read_bytes(), ">u2")
        if depth == 16 and path.read_bytes()[-channels * height * width * 2 - 2 :][:2] == b"\0\0":
            return np.moveaxis(
                stored[-channels * height * width :].reshape(channels, height, -1), 0, -1
            )
    from PIL import Image

    with Image.open(path) as image:
        return np.asarray(image)


def _picture(picture: object) -> tuple[object, ...]:
    """All that is known of a picture, to compare."""
    import numpy as np

    return tuple(
        (value.shape, value.tobytes()) if isinstance(value, np.ndarray) else repr(value)
        for value in vars(picture).values()
    )


if __name__ == "__main__":
    _read_all(Path(sys.argv[1]))
