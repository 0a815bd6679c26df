"""Conversion of options to the frames of a shot: `solve 'shot.####.exr' 'evening.####.png'`.

A painting belongs to the frame whose number its name has.
"""

import re
from argparse import Namespace
from pathlib import Path

from lightpaint.basis.lightgroups.frame_sequence import (
    SIGN,
    FrameSequence,
    find_frames,
    is_pattern,
    spoken_frames,
)
from lightpaint.cli.options.source_options import check_scene_options, groups_file
from lightpaint.display_text import visible
from lightpaint.errors import BasisError, TargetError
from lightpaint.pipeline.job.sources import GroupsFile

#: Digits of a file name that may be its frame, and what separates them from the name.
_NUMBER = re.compile(r"[._-]?(-?[0-9]+)")


def is_of_frames(options: Namespace) -> bool:
    """Return True if `solve` is of the frames of a shot."""
    return is_pattern(options.source) or is_pattern(",".join(options.lights or ()))


def sequence_of(options: Namespace) -> FrameSequence | None:
    """Return the frames of `solve` if it names a sequence of light groups; None for one picture.

    If `--lights` names the sequence, the source is really the first target.
    """
    light_list = ",".join(options.lights or ())
    if light_list and is_pattern(light_list):
        options.targets, options.source = [options.source, *options.targets], light_list
        options.lights = None
    return find_frames(options.source) if is_pattern(options.source) else None


def paintings_by_frame(options: Namespace, sequence: FrameSequence) -> dict[int, str]:
    """Return the path of the painting of each painted frame, in the order of frames.

    Raises TargetError for a painting without a frame, and for two of one frame.
    """
    pairs = [(_frame(text, path, sequence), path) for text, path in options.views]
    for path in options.targets:
        pairs += _matches(path, sequence) if is_pattern(path) else [(_named(path, sequence), path)]
    if not pairs:
        raise TargetError("no painting to solve for: give a TARGET whose name has its frame")
    paintings = dict(sorted(pairs))
    if len(paintings) < len(pairs):
        frame = next(x for x in paintings if [frame for frame, _ in pairs].count(x) > 1)
        first, second = [path for number, path in pairs if number == frame][:2]
        raise TargetError(f"{first} and {second} are both of frame {frame}: give one of them")
    return paintings


def masks_by_frame(options: Namespace, frames: tuple[int, ...]) -> list[str] | None:
    """Return the masks in the options, with one for each frame if they name a sequence."""
    masks = options.masks
    if not masks or len(masks) > 1 or not is_pattern(masks[0]):
        return masks  # type: ignore[no-any-return]
    sequence = find_frames(masks[0])
    return [str(sequence.path(frame)) for frame in frames]


def groups_of_frames(
    options: Namespace, sequence: FrameSequence, frames: tuple[int, ...]
) -> tuple[GroupsFile, ...]:
    """Return the light groups of these frames. Raises BasisError for options of a scene."""
    groups = tuple(groups_file(str(sequence.path(frame)), options) for frame in frames)
    check_scene_options(options, groups[0], options.lights)
    return groups


def name_without_frame(path: str) -> str:
    """Return what a painting is called apart from its frame: `evening` of evening.0012.exr."""
    stem = Path(SIGN.sub("", path)).stem if is_pattern(path) else Path(path).stem
    matches = [*_NUMBER.finditer(stem)]
    if matches and not is_pattern(path):
        stem = stem[: matches[-1].start()] + stem[matches[-1].end() :]
    return stem.strip("._-") or Path(path).stem


def _matches(pattern: str, sequence: FrameSequence) -> list[tuple[int, str]]:
    """Return the paintings of a pattern whose frames the shot has."""
    paintings = find_frames(pattern)
    pairs = [(frame, str(paintings.path(frame))) for frame in paintings.frames]
    if not (common := [pair for pair in pairs if pair[0] in sequence.numbers]):
        raise TargetError(
            f"no frame is in both: {visible(sequence.pattern)} has "
            f"{spoken_frames(sequence.frames)}, {visible(pattern)} has "
            f"{spoken_frames(paintings.frames)}"
        )
    return common


def _frame(text: str, path: str, sequence: FrameSequence) -> int:
    """Return the frame of `--target FRAME=TARGET`."""
    if not re.fullmatch(r"-?[0-9]+", text):
        raise TargetError(
            f"--target {text}={path}: {visible(sequence.pattern)} has frames, so expected the "
            f"number of one, like {sequence.frames[0]}={path}"
        )
    return _existing(int(text), path, sequence)


def _named(path: str, sequence: FrameSequence) -> int:
    """Return the frame in the name of a painting: its last number that looks like one."""
    texts = [match[1] for match in _NUMBER.finditer(Path(path).stem)]
    known = [text for text in texts if text in sequence.numbers.values()]
    if not texts:
        raise TargetError(
            f"{visible(path)} names no frame of {visible(sequence.pattern)}: call it like "
            f"{Path(path).stem}.{sequence.numbers[sequence.frames[0]]}{Path(path).suffix}, or give "
            f"it with --target {sequence.frames[0]}={visible(path)}"
        )
    return _existing(int((known or texts)[-1]), path, sequence)


def _existing(frame: int, path: str, sequence: FrameSequence) -> int:
    """Return a frame. Raises BasisError if the shot lacks it."""
    if frame not in sequence.numbers:
        raise BasisError(
            f"{visible(path)} is of frame {frame}, which {visible(sequence.pattern)} lacks: it has "
            f"{spoken_frames(sequence.frames)}"
        )
    return frame
