"""What leaves a session: files that other programs read, and the verifying render."""

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.errors import OutputError, PaintError
from lightpaint.images.denoise import denoised
from lightpaint.job import Job
from lightpaint.lighting.file import write_lighting
from lightpaint.lighting.lighting import Lighting, combine
from lightpaint.paint.session import Moment
from lightpaint.paint.subject import PAINTING, Subject
from lightpaint.pipeline import run
from lightpaint.progress import Progress
from lightpaint.relit.relight import relight
from lightpaint.relit.verify import verify
from lightpaint.report.verdict import agreement
from lightpaint.scene.scene import load_scene
from lightpaint.target.own import write_painting

#: Files of an export beside the painting, and the folder of its report.
LIGHTING, RELIT, ANSWER = "lighting.json", "relit.xml", "answer"


def export(
    subject: Subject,
    moment: Moment,
    lighting: Lighting,
    what: Sequence[str],
    progress: Progress,
) -> list[Path]:
    """Write what is asked for into the folder of the session; returns the files.

    Raises PaintError for what there is not, OutputError for what cannot be written.
    """
    folder = subject.folder
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot make {folder}: {error.strerror}") from None
    written = []
    if "target" in what or "report" in what:
        if moment.target is None:
            raise PaintError("nothing is painted yet: there is no painting to write")
        write_painting(folder / PAINTING, moment.target)
        written.append(folder / PAINTING)
    if "lighting" in what:
        write_lighting(folder / LIGHTING, lighting)
        written.append(folder / LIGHTING)
    if "relit" in what:
        if subject.scene is None:
            raise PaintError("there is no scene to relight: it was opened from a saved basis")
        relight(subject.loaded, lighting, folder / RELIT)
        written.append(folder / RELIT)
    if "report" in what:
        written.append(_report(subject, moment, progress))
    return written


def _report(subject: Subject, moment: Moment, progress: Progress) -> Path:
    """All that `solve` leaves, for the painting as it is."""
    assert moment.target is not None
    answer = subject.folder / ANSWER
    settings = replace(moment.settings, force=True)
    scenes = () if subject.scene is None else (subject.loaded,)
    basis = moment.basis if subject.groups is None else subject.groups
    job = Job(scenes, (moment.target,), answer, basis, moment.constraints, settings)
    run(job, progress)
    return answer / "report.html"


def verified(
    subject: Subject, basis: Basis, lighting: Lighting, progress: Progress
) -> tuple[Floats, str, bool]:
    """The scene as it is relit, rendered: (h, w, 3) clean, what that says, whether it agrees."""
    scene = subject.loaded
    with tempfile.TemporaryDirectory(dir=scene.path.parent, prefix=".lightpaint-") as place:
        relit = relight(scene, lighting, Path(place) / RELIT)
        if relit.sensor != scene.sensor:
            relit = load_scene(relit.path, sensor=scene.sensor, use_lights_file=False)
        predicted = combine(basis, lighting)
        result = verify(predicted, relit, spp=basis.origin.spp, progress=progress)
    picture = denoised(result.verified.image, basis.features)
    says = "confirms it" if result.agrees else "does NOT confirm it"
    said = f"A render of {basis.origin.spp} samples per pixel {says}: {agreement(result)}."
    return picture, said, result.agrees
