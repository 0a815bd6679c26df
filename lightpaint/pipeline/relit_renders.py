"""Renders of a scene under a lighting, in a folder with the relit scene; and pictures of the frames
of a shot with its new lighting, one frame in memory at a time.

Each picture says in its header which answer and which file it is of. So a stopped run continues
where it was, and a new answer, or a new render of a frame, makes its picture anew.
"""

import hashlib
import json
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from lightpaint import images
from lightpaint.arrays import Floats
from lightpaint.basis import LightGroups, parse_frames, read_light_groups
from lightpaint.basis.render import emitters_seen
from lightpaint.colour import ViewTransform, choose_exposure
from lightpaint.errors import BasisError, ImageError, OutputError
from lightpaint.files import check_files
from lightpaint.images import formats
from lightpaint.keywords import keywords
from lightpaint.lighting import Lighting, read_lighting
from lightpaint.pipeline import result_folder
from lightpaint.pipeline.job.job_checks import remarks_of_pictures
from lightpaint.pipeline.job.solve_job import Job
from lightpaint.pipeline.job.sources import GroupsFile
from lightpaint.progress import Progress, listener, silent
from lightpaint.relit import relight, relit_part
from lightpaint.scene import Scene, Stream, render, render_features, with_width
from lightpaint.scene.quality_presets import on_film
from lightpaint.sentences import Hint
from lightpaint.target import texts_of

#: EXR layer of a final render without its noise.
DENOISED = "denoised"

#: Header attribute of a frame: the answer and the render that it shows.
FRAME_KEY = "lightpaint.frame"


def relit_folder(
    scene: Scene,
    lighting: Path,
    folder: Path,
    *,
    views: Sequence[str] = ("",),
    force: bool = False,
) -> result_folder.ResultFolder:
    """Return the folder that `relight_look` writes to.

    lighting: the file of the lighting. views: as in `relight_look`.
    """
    files = result_folder.answer_files(folder, scene=scene, has_lighting=True)
    files += [folder / view / name for view in views for name in ("relit.exr", "relit.png")]
    input_files = (lighting, *scene.read_files)
    return result_folder.ResultFolder(
        folder, tuple(files), input_files, (lighting,), adds_to=lighting, force=force
    )


def relight_look(
    scenes: Mapping[str, Scene],
    lighting: Lighting,
    results: result_folder.ResultFolder,
    *,
    spp: int | None = None,
    seed: int = 0,
    resolution: str | None = None,
    progress: Progress = silent,
    render_elsewhere: Callable[[Scene], images.Estimate] | None = None,
) -> None:
    """Write relit.xml, and its renders as relit.exr and, denoised, relit.png.

    scenes: the scene through each sensor, by the folder in `results` for its pictures; "" for
    `results` itself. resolution: part of the film to render, as in `Settings`. render_elsewhere:
    function that renders the relit scene outside this process.
    """
    for remark in remarks_of_pictures():
        listener(progress).say(remark)
    results.check()
    options: dict[str, Any] = {"seed": seed, "stream": Stream.VERIFICATION, "progress": progress}
    first, *_ = scenes.values()
    with result_folder.new_answer(results, lighting, scene=first, has_lighting=True) as answer:
        for view, scene in scenes.items():
            folder = answer.path
            relit = on_film(answer.seen_through(scene.sensor), None, resolution)
            label = f"relit of {view}" if view else "relit"
            image = (
                render_elsewhere(relit)
                if render_elsewhere
                else render(relit, spp=spp, label=label, **options)
            )
            (folder / view).mkdir(exist_ok=True)
            images.write_estimate(folder / view / "relit.exr", image, {})
            features = render_features(relit, seed=seed)
            clean = images.denoised(image.image, features, quality="high")
            texts = images.denoiser_text(features, raw="relit.exr")
            stops = choose_exposure(clean, emitters_seen(relit))
            formats.write_png(folder / view / "relit.png", clean, stops=stops, texts=texts)


@dataclass(frozen=True)
class FinalPicture:
    """A render of a scene under a lighting, for use elsewhere.

    image: as rendered. clean: (h, w, 3) linear, denoised. features: what guided the denoiser.
    """

    image: images.Estimate
    clean: Floats
    features: images.Features


def render_final(
    scene: Scene,
    lighting: Lighting,
    *,
    width: int,
    spp: int,
    seed: int = 0,
    progress: Progress = silent,
) -> FinalPicture:
    """Render a scene under a lighting at another size; the picture has the same frame.

    width: in pixels; the height follows from the film of the scene's file. spp: samples per pixel.
    Raises LightpaintError if the lighting does not fit the scene.
    """
    with tempfile.TemporaryDirectory(prefix="lightpaint-") as place:
        relit = relight(scene, lighting, Path(place) / result_folder.RELIT)
        if relit.sensor != scene.sensor:
            relit = result_folder.reload_relit(relit, relit.path, scene.sensor)
        relit = replace(relit, film=with_width(relit.film, width))
        options: dict[str, Any] = {"seed": seed, "stream": Stream.VERIFICATION}
        image = render(relit, spp=spp, label="final", progress=progress, **options)
        features = render_features(relit, seed=seed)
    return FinalPicture(image, images.denoised(image.image, features, quality="high"), features)


def write_final_exr(path: Path, picture: FinalPicture) -> None:
    """Write the light of a final render: as rendered, its noise, and denoised as a layer."""
    channels = formats.rgb_channels(picture.image.image)
    channels |= formats.rgb_channels(picture.image.half_difference, images.HALF_DIFFERENCE)
    channels |= formats.rgb_channels(picture.clean, DENOISED)
    formats.write_parts(path, [formats.ExrPart("rgb", channels, {})])


def write_final_png(path: Path, picture: FinalPicture, transform: ViewTransform) -> None:
    """Write a final render, denoised, as a display shows it: 16 bits a channel."""
    texts = texts_of(transform) | images.denoiser_text(picture.features, raw="render.exr")
    formats.write_png_16(path, transform.encode(picture.clean), texts=texts)


def frames_to_write(job: Job, text: str | None) -> tuple[int, ...]:
    """Return the frames that a job of a shot writes: those in `text`, and the painted ones.

    text: as `parse_frames` reads it. Raises BasisError for frames of a job that is of no shot, or
    of another size than the painted ones, ImageError for a frame without a header, and OutputError
    for a file in the way.
    """
    if job.sequence is None:
        if text is not None:
            raise BasisError(Hint("frames"), " are of a shot, like 'shot.####.exr': leave it out")
        return ()
    chosen = () if text is None else parse_frames(text, job.sequence)
    frames = tuple(sorted({*job.painted_frames, *chosen}))
    _check_pictures(job, frames)
    _check_sizes(job, frames)
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
    listen, lighting = listener(progress), read_lighting(job.folder / result_folder.LIGHTING)
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
        formats.write_parts(pictures[frame], [replace(part, attributes={FRAME_KEY: marks[frame]})])
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


def _check_sizes(job: Job, frames: Sequence[int]) -> None:
    """Raise BasisError if a frame differs in size from the first painted one, by their headers.

    So a solve does not end in frames that it cannot write.
    """
    assert job.sequence is not None
    painted = _size_in_header(job.sequence.path(job.painted_frames[0]))
    for frame in frames:
        path = job.sequence.path(frame)
        size = _size_in_header(path)
        if painted is not None and size is not None:
            _check_size(path, size, painted)


def _size_in_header(path: Path) -> tuple[int, int] | None:
    """Return (height, width) of a frame; None for a folder without an EXR file."""
    file = min(path.glob("*.exr"), default=None) if path.is_dir() else path
    return None if file is None else formats.read_headers(file)[1]


def _check_size(path: Path, size: tuple[int, int], painted: tuple[int, int]) -> None:
    """Raise BasisError unless a frame has the (height, width) of the painted ones."""
    if size != painted:
        (height, width), (rows, columns) = size, painted
        raise BasisError(
            f"{path} is {width}x{height}, but the painted frames are {columns}x{rows}: the frames "
            "of a shot must have the same size"
        )


def _groups_of(job: Job, frame: int) -> LightGroups:
    """Return the light groups of a frame, read now and not kept, in the way of the painted ones."""
    assert job.sequence is not None
    path, example = str(job.sequence.path(frame)), job.given_bases[0]
    if isinstance(example, GroupsFile):
        groups = replace(example, path=path).content
    else:
        groups = read_light_groups(path)
    if job.groups is not None:
        _check_size(Path(path), groups.basis.size, job.groups.basis.size)
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
        return formats.read_headers(file)[0][0].get(FRAME_KEY, "")
    except (ImageError, OSError, IndexError):
        return ""
