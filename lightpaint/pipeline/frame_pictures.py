"""Pictures of the frames of a shot with its new lighting, one frame in memory at a time.

Each picture says in its header which answer and which file it is of. So a stopped run continues
where it was, and a new answer, or a new render of a frame, makes its picture anew.
"""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from lightpaint.basis import LightGroups, parse_frames, read_light_groups
from lightpaint.errors import BasisError, ImageError, OutputError
from lightpaint.files import check_files
from lightpaint.images.formats import read_headers, write_parts
from lightpaint.keywords import keywords
from lightpaint.lighting import Lighting, read_lighting
from lightpaint.pipeline.job.job import Job
from lightpaint.pipeline.job.sources import GroupsFile
from lightpaint.pipeline.results.answer_folder import LIGHTING
from lightpaint.progress import Progress, listener, silent
from lightpaint.relit import relit_part
from lightpaint.sentences import Hint

#: Header attribute of a frame: the answer and the render that it shows.
FRAME_KEY = "lightpaint.frame"


def frames_to_write(job: Job, text: str | None) -> tuple[int, ...]:
    """Return the frames that a job of a shot writes: those in `text`, and the painted ones.

    text: as `parse_frames` reads it. Raises BasisError for frames of a job that is of no shot, and
    OutputError for a file in the way.
    """
    if job.sequence is None:
        if text is not None:
            raise BasisError(Hint("frames"), " are of a shot, like 'shot.####.exr': leave it out")
        return ()
    chosen = () if text is None else parse_frames(text, job.sequence)
    frames = tuple(sorted({*job.painted_frames, *chosen}))
    _check_pictures(job, frames)
    return frames


@keywords()
def relight_frames(
    job: Job, *, frames: Sequence[int] | str = "all", progress: Progress = silent
) -> list[Path]:
    """Write relit.####.exr, the frames of a shot with the lighting that `run` found for it.

    Frames that are already written for this answer are skipped, so a stopped call continues.
    Pictures of another answer are deleted, since they would be taken for this one's.

    Args:
        job: A job with a sequence, after its run.
        frames: Numbers of frames, or text such as `1-48x2,60`.
        progress: Receives progress and, if it is a `Listener`, remarks.

    Returns:
        The files of these frames.

    Raises:
        BasisError: If the job has no sequence, or that none of these frames.
        OutputError: For a file of such a name that is no such picture, unless `force` is set.

    Examples:
        >>> from pathlib import Path
        >>> shot = lp.find_frames("shot.####.exr")
        >>> first = lp.read_light_groups(shot.path(1))
        >>> wish = lp.Target.of(2 * first.basis.current_look)
        >>> job = lp.Job((), (wish,), Path("brighter"), first, sequence=shot)
        >>> [look] = lp.run(job)
        >>> [file.name for file in lp.relight_frames(job)]
        ['relit.0001.exr', 'relit.0002.exr']
    """
    listen, lighting = listener(progress), read_lighting(job.folder / LIGHTING)
    frames = frames_to_write(job, frames) if isinstance(frames, str) else tuple(frames)
    pictures, sequence = _check_pictures(job, frames), job.sequence
    assert sequence is not None
    marks = {x: _mark(sequence.path(x), lighting.at_frame(x)) for x in sequence.frames}
    present = {x: _mark_in(file) for x, file in pictures.items() if file.exists()}
    for frame, mark in present.items():
        if mark and mark != marks[frame]:
            pictures[frame].unlink()
    missing = [frame for frame in frames if present.get(frame) != marks[frame]]
    if written := len(frames) - len(missing):
        listen.say(f"{written} of {len(frames)} frames are already written for this answer")
    for done, frame in enumerate(missing):
        listen("frames", done, len(missing), "frames")
        part = relit_part(_groups_of(job, frame), lighting.at_frame(frame))
        write_parts(pictures[frame], [replace(part, attributes={FRAME_KEY: marks[frame]})])
        listen("frames", done + 1, len(missing), "frames")
    return [pictures[frame] for frame in frames]


def _check_pictures(job: Job, frames: Sequence[int]) -> dict[int, Path]:
    """Return the picture of each frame of a shot, after checking that `frames` may be written."""
    if job.sequence is None:
        raise BasisError("this job is of no shot, like 'shot.####.exr': it has no frames")
    numbers = job.sequence.numbers
    pictures = {frame: job.folder / f"relit.{number}.exr" for frame, number in numbers.items()}
    if unknown := [frame for frame in frames if frame not in pictures]:
        job.sequence.path(unknown[0])
    check_files((pictures[frame] for frame in frames), job.sequence.files.values())
    for file in (pictures[frame] for frame in frames):
        if not job.settings.force and file.exists() and not _mark_in(file):
            raise OutputError(
                f"{file} exists and is not a frame of lightpaint: name another folder (",
                Hint("folder"),
                "), or pass ",
                Hint("force", True),
            )
    return pictures


def _groups_of(job: Job, frame: int) -> LightGroups:
    """Return the light groups of a frame, read now and not kept, in the way of the painted ones."""
    assert job.sequence is not None
    path, example = str(job.sequence.path(frame)), job.given_bases[0]
    if isinstance(example, GroupsFile):
        groups = replace(example, path=path).content
    else:
        groups = read_light_groups(path)
    expected = groups.basis.size if job.groups is None else job.groups.basis.size
    if groups.basis.size != expected:
        (height, width), (rows, columns) = groups.basis.size, expected
        raise BasisError(
            f"{path} is {width}x{height}, but the painted frames are {columns}x{rows}: the frames "
            "of a shot must have the same size"
        )
    return groups


def _mark(path: Path, lighting: Lighting) -> str:
    """Return what a picture of the frame at `path` is made of, as text."""
    weights = {light.name: [f"{v:.6g}" for v in light.weight] for light in lighting.lights}
    digest = hashlib.sha256(json.dumps(weights, sort_keys=True).encode())
    files = sorted(path.iterdir()) if path.is_dir() else [path]
    for file in files:
        facts = file.stat()
        digest.update(f"{file.name} {facts.st_size} {facts.st_mtime_ns}".encode())
    return digest.hexdigest()[:32]


def _mark_in(file: Path) -> str:
    """Return the mark of a picture; "" if it has none."""
    try:
        return read_headers(file)[0][0].get(FRAME_KEY, "")
    except (ImageError, OSError, IndexError):
        return ""
