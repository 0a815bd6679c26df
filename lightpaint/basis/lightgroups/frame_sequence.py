"""A sequence of frames: files whose paths differ only in a number, as `shot.####.exr` names them.

The place of the number is written as in other programs: `####` and `%04d` (Nuke), `@@@@` (Shake,
Karma), `$F4` and `<F4>` (Houdini). A sign that stands for a single digit fits a number of any
length.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

from lightpaint.display_text import some_of, visible
from lightpaint.errors import BasisError
from lightpaint.keywords import keywords

#: The signs for a frame number. Their number of characters, or the digit in them, is its least
#: length.
SIGN = re.compile(r"#+|@+|%0?([0-9]{0,2})d|\$F([0-9]?)|<F([0-9]?)>")

#: A range of frames: `12`, `1-48`, or every second one of them, `1-48x2`.
_RANGE = re.compile(r"(-?[0-9]+)(?:-(-?[0-9]+)(?:x([0-9]+))?)?")

#: What errors say of patterns.
_SIGNS = (
    "the sign stands for the number in the names of files, as #### in shot.####.exr for "
    "shot.0012.exr"
)

#: Largest number of frames in one folder.
MAX_FRAMES = 100_000


@keywords()
@dataclass(frozen=True)
class FrameSequence:
    """The frames that exist of a sequence, as `find_frames` returns them.

    Attributes:
        pattern: The path, with a sign such as `####` for the number.
        folder: The part of it that has no sign, although a name in it may look as if it had.
        numbers: The number of each frame as its path has it, `0012`, by frame, in order.
        files: The file or folder of each frame.

    Examples:
        >>> shot = lp.find_frames("shot.####.exr")
        >>> shot.frames, shot.path(2).name
        ((1, 2), 'shot.0002.exr')
    """

    pattern: str
    folder: Path
    numbers: Mapping[int, str]
    files: Mapping[int, Path]

    @property
    def frames(self) -> tuple[int, ...]:
        """The frames, in order."""
        return tuple(self.numbers)

    def path(self, frame: int) -> Path:
        """Return the file or folder of a frame. Raises BasisError if there is none."""
        if frame not in self.files:
            raise BasisError(
                f"{visible(self.pattern)} has no frame {frame}: it has {spoken_frames(self.frames)}"
            )
        return self.files[frame]

    def frame_of(self, path: Path) -> int:
        """Return the frame of a file or folder of this sequence. Raises BasisError for others."""
        for frame, file in self.files.items():
            if file == Path(path):
                return frame
        raise BasisError(f"{visible(str(path))} is not a frame of {visible(self.pattern)}")

    def with_hashes(self, file: Path, frame: int) -> Path:
        """Return the path of a frame, or of a file in its folder, with `####` for the number.

        Raises BasisError for a file that is neither.
        """
        if not file.is_relative_to(self.path(frame)):
            raise BasisError(f"{visible(str(file))} is not in frame {frame}")
        tail = Path(self.pattern).relative_to(self.folder).as_posix()
        hashes = SIGN.sub(lambda sign: "#" * _length(sign), tail)
        below = file.relative_to(self.path(frame)).as_posix()
        sign = SIGN.search(tail)
        assert sign is not None
        number = re.compile(rf"(?<![0-9]){re.escape(self.numbers[frame])}(?![0-9])")
        return self.folder / hashes / number.sub("#" * _length(sign), below)


def is_pattern(path: str | Path) -> bool:
    """Return True if `path` names a sequence of frames, and no file or folder that exists."""
    return SIGN.search(str(path)) is not None and not Path(path).exists()


@keywords()
def find_frames(pattern: str | Path) -> FrameSequence:
    """Find the frames of a sequence.

    Args:
        pattern: Path with a sign for the number: `####`, `%04d`, `@@@@`, `$F4` or `<F4>`.

    Raises:
        BasisError: If there are none.

    Examples:
        >>> lp.find_frames("shot.%04d.exr").frames
        (1, 2)
    """
    parts, literal = Path(pattern).parts, 0
    if not any(map(SIGN.search, parts)):
        name = visible(str(pattern))
        raise BasisError(f"{name!r} has no sign for the number of a frame: {_SIGNS}")
    # A folder that exists may have a sign in its name.
    while literal < len(parts) - 1 and Path(*parts[: literal + 1]).is_dir():
        literal += 1
    folder, tail = Path(*parts[:literal]), parts[literal:]
    found: dict[int, Path] = {}
    numbers: dict[int, str] = {}
    expected = _expression("/".join(tail))
    for path in _walk(folder, tail, str(pattern)):
        if match := expected.fullmatch(path.relative_to(folder).as_posix()):
            found[int(match["frame"])], numbers[int(match["frame"])] = path, match["frame"]
    if not found:
        raise BasisError(f"no frame matches {visible(str(pattern))}: {_SIGNS}")
    frames = sorted(found)
    return FrameSequence(
        str(Path(pattern)),
        folder,
        {x: numbers[x] for x in frames},
        {x: found[x] for x in frames},
    )


def _walk(folder: Path, parts: Sequence[str], pattern: str) -> Iterable[Path]:
    """Yield the paths in a folder that may match the parts, each of which may have a sign."""
    first, *remaining = parts
    if not SIGN.search(first):
        paths = [folder / first]
    else:
        expected = _expression(first)
        try:
            paths = [path for path in folder.iterdir() if expected.fullmatch(path.name)]
        except OSError as error:
            reason = error.strerror or error
            raise BasisError(f"no frames of {visible(pattern)}: {folder}: {reason}") from None
    if len(paths) > MAX_FRAMES:
        raise BasisError(f"more than {MAX_FRAMES} files match {visible(pattern)}: name fewer")
    for path in paths:
        if not remaining and path.exists():
            yield path
        elif remaining and path.is_dir():
            yield from _walk(path, remaining, pattern)


def _expression(text: str) -> re.Pattern[str]:
    """Return what paths of a pattern look like; a number that occurs twice is the same."""
    expression, end = "", 0
    for match in SIGN.finditer(text):
        is_first = "(?P<frame>" not in expression
        number = f"(?P<frame>{_digits(match)})" if is_first else "(?P=frame)"
        expression += re.escape(text[end : match.start()]) + number
        end = match.end()
    return re.compile(expression + re.escape(text[end:]))


def _length(sign: re.Match[str]) -> int:
    """Return the least number of digits that a sign stands for."""
    sizes = [x for x in sign.groups() if x]
    return max(int(sizes[0]), 1) if sizes else len(sign[0]) if sign[0][0] in "#@" else 1


def _digits(sign: re.Match[str]) -> str:
    """Return the digits that a sign stands for: padded with zeros, and longer only without."""
    length = _length(sign)
    return r"-?[0-9]+" if length == 1 else rf"-?(?:[0-9]{{{length}}}|[1-9][0-9]{{{length},}})"


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
