"""A sequence of frames: files whose paths differ only in a number, as `shot.####.exr` names them.

The place of the number is written as in other programs: `####` and `%04d` (Nuke), `@@@@` (Shake,
Karma), `$F4` and `<F4>` (Houdini). A sign that stands for a single digit fits a number of any
length.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from pathlib import Path

from lightpaint.display_text import some_of, visible
from lightpaint.errors import BasisError
from lightpaint.keywords import keywords

#: The signs for a frame number. Their number of characters, or the digit in them, is its least
#: length.
SIGN = re.compile(r"#+|@+|%0?(\d*)d|\$F(\d?)|<F(\d?)>")

#: A range of frames: `12`, `1-48`, or every second one of them, `1-48x2`.
_RANGE = re.compile(r"(-?\d+)(?:-(-?\d+)(?:x(\d+))?)?")

#: Largest number of files and folders that are looked at for frames.
MAX_ENTRIES = 200_000


@keywords()
@dataclass(frozen=True)
class FrameSequence:
    """The frames that exist of a sequence.

    Attributes:
        pattern: The path, with a sign such as `####` for the number.
        numbers: The number of each frame as its path has it, `0012`, by frame, in order.

    Examples:
        >>> FrameSequence("shot.####.exr", {12: "0012"}).path(12).name
        'shot.0012.exr'
    """

    pattern: str
    numbers: Mapping[int, str]

    @property
    def frames(self) -> tuple[int, ...]:
        """The frames, in order."""
        return tuple(self.numbers)

    def path(self, frame: int) -> Path:
        """Return the file or folder of a frame. Raises BasisError if there is none."""
        if frame not in self.numbers:
            raise BasisError(
                f"{visible(self.pattern)} has no frame {frame}: it has {spoken_frames(self.frames)}"
            )
        return Path(SIGN.sub(self.numbers[frame], self.pattern))

    @cached_property
    def paths(self) -> Mapping[Path, int]:
        """The frames by their files or folders."""
        return {self.path(frame): frame for frame in self.frames}

    def frame_of(self, path: Path) -> int:
        """Return the frame of a file or folder of this sequence."""
        return self.paths[Path(path)]

    def renamed(self, name: str) -> "FrameSequence":
        """Return the sequence of files called `name`, with its own sign, of the same frames."""
        return FrameSequence(name, self.numbers)


def is_pattern(path: str | Path) -> bool:
    """Return True if `path` names a sequence of frames, and no file or folder that exists."""
    return SIGN.search(str(path)) is not None and not Path(path).exists()


def find_frames(pattern: str | Path) -> FrameSequence:
    """Return the frames of a pattern. Raises BasisError if there are none."""
    parts = Path(pattern).parts
    expected = _regex(str(Path(pattern)))
    found: dict[int, str] = {}
    first = next(k for k, part in enumerate(parts) if SIGN.search(part))
    for path in _walk(Path(*parts[:first]), parts[first:], str(pattern)):
        if match := expected.fullmatch(str(path)):
            found[int(match["frame"])] = match["frame"]
    if not found:
        raise BasisError(
            f"no frame matches {visible(str(pattern))}: the sign stands for the number in the "
            "names of files, such as shot.0012.exr"
        )
    return FrameSequence(str(Path(pattern)), {frame: found[frame] for frame in sorted(found)})


def _walk(folder: Path, parts: Sequence[str], pattern: str) -> Iterable[Path]:
    """Yield the paths in a folder that may match the parts, each of which may have a sign."""
    first, *remaining = parts
    if not SIGN.search(first):
        paths = [folder / first]
    else:
        expected = re.compile(_regex(first).pattern)
        try:
            paths = [path for path in folder.iterdir() if expected.fullmatch(path.name)]
        except OSError as error:
            reason = error.strerror or error
            raise BasisError(f"no frames of {visible(pattern)}: {folder}: {reason}") from None
    if len(paths) > MAX_ENTRIES:
        raise BasisError(f"more than {MAX_ENTRIES} files match {visible(pattern)}")
    for path in paths:
        if not remaining and path.exists():
            yield path
        elif remaining and path.is_dir():
            yield from _walk(path, remaining, pattern)


def _regex(text: str) -> re.Pattern[str]:
    """Return what paths of a pattern look like; a number that occurs twice is the same."""
    expression, end = "", 0
    for match in SIGN.finditer(text):
        expression += re.escape(text[end : match.start()])
        is_first = "(?P<frame>" not in expression
        expression += f"(?P<frame>{_digits(match)})" if is_first else "(?P=frame)"
        end = match.end()
    return re.compile(expression + re.escape(text[end:]))


def _digits(sign: re.Match[str]) -> str:
    """Return the digits that a sign stands for: padded with zeros, and longer only without."""
    text, sizes = sign[0], [x for x in sign.groups() if x]
    length = int(sizes[0]) if sizes else len(text) if text[0] in "#@" else 1
    return r"-?\d+" if length <= 1 else rf"-?(?:\d{{{length}}}|[1-9]\d{{{length},}})"


def parse_frames(text: str, sequence: FrameSequence) -> tuple[int, ...]:
    """Return the frames that `text` names: `all`, or ranges such as `1-48x2,60`.

    Of a range, those that exist count. Raises BasisError for other text, and if none exists.
    """
    if text == "all":
        return sequence.frames
    chosen: set[int] = set()
    for word in text.split(","):
        match = _RANGE.fullmatch(word.strip())
        if match is None or match[3] == "0":
            raise BasisError(f"{text!r} names no frames: expected all, 12, 1-48 or 1-48x2, ...")
        first, last, step = int(match[1]), int(match[2] or match[1]), int(match[3] or 1)
        chosen |= {x for x in sequence.frames if first <= x <= last and (x - first) % step == 0}
    if not chosen:
        raise BasisError(
            f"{visible(sequence.pattern)} has none of the frames {text}: it has "
            f"{spoken_frames(sequence.frames)}"
        )
    return tuple(sorted(chosen))


def spoken_frames(frames: Sequence[int]) -> str:
    """Return frames for people: `1-12, 14, 20-48`."""
    runs = []
    for _, run in groupby(enumerate(sorted(frames)), lambda pair: pair[1] - pair[0]):
        members = [frame for _, frame in run]
        runs.append(f"{members[0]}-{members[-1]}" if len(members) > 1 else f"{members[0]}")
    return some_of(runs, room=200)
