"""What leaves a session: files that other programs read, and the verifying render."""

import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.colour.display.srgb import to_8_bit
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.errors import OutputError, PaintError
from lightpaint.files import write_bytes
from lightpaint.images.denoiser import denoised, how_denoised
from lightpaint.images.formats.png import png_bytes
from lightpaint.lighting.answer.lighting import Lighting, combine
from lightpaint.paint.session.snapshot import Moment
from lightpaint.paint.subject import Subject, painting_of, picture_of
from lightpaint.pipeline.answer_folder import LIGHTING, RELIT, write_answer
from lightpaint.pipeline.job import Job
from lightpaint.pipeline.pipeline import run
from lightpaint.progress import Progress
from lightpaint.relit.relight import relight
from lightpaint.relit.sequential_verification import verify_in_stages
from lightpaint.report.clean_pictures import CleanLooks
from lightpaint.report.verdict import agreement
from lightpaint.scene.scene import load_scene
from lightpaint.target.painting_file import write_painting
from lightpaint.target.template import texts_of

#: The folder of the report.
ANSWER = "answer"

#: What is of a painting, and writes it.
OF_PAINTING = {"target", "report"}


def export(
    subjects: Sequence[Subject],
    moment: Moment,
    lighting: Lighting,
    what: Sequence[str],
    progress: Progress,
) -> Iterator[Path]:
    """Write what is asked for into the folder of the session; yields each file as it is there.

    subjects: of all views. Where nothing is painted, what is of a painting is left out. Raises
    PaintError for what there is not, OutputError for what cannot be written.
    """
    if not moment.painted:
        what = [one for one in what if one not in OF_PAINTING]
        if not what:
            raise PaintError("nothing is painted yet: there is no painting to write")
    first, folder = subjects[0], subjects[0].folder
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot make {folder}: {error.strerror}") from None
    if set(what) & OF_PAINTING:
        for sensor, target in zip(moment.painted_sensors, moment.painted_targets, strict=True):
            write_painting(painting_of(folder, sensor), target)
            yield painting_of(folder, sensor)
    if "picture" in what:
        for sensor, basis in zip(moment.sensors, moment.bases, strict=True):
            write_bytes(picture_of(folder, sensor), picture(basis, lighting, moment.transform))
            yield picture_of(folder, sensor)
    if "lighting" in what:
        write_answer(folder, lighting)
        yield folder / LIGHTING
    if "relit" in what:
        if first.scene is None:
            raise PaintError("there is no scene to relight: it was opened from a saved basis")
        write_answer(folder, lighting, scene=first.loaded, has_lighting=True)
        yield folder / RELIT
    if "report" in what:
        yield from _report(subjects, moment, progress)


def picture(basis: Basis, lighting: Lighting, transform: ViewTransform) -> bytes:
    """The answer in a view, as pages and reports show it: a PNG, through `transform`, clean."""
    weights = lighting.weights_for(basis)
    looks = CleanLooks.clean(basis, weights, basis.mix(weights), None)
    shown = to_8_bit(transform.encode(looks.predicted))
    return png_bytes(shown, texts_of(transform) | how_denoised(basis.features, raw="not kept"))


def _report(subjects: Sequence[Subject], moment: Moment, progress: Progress) -> list[Path]:
    """All that `solve` leaves, for the paintings as they are; the reports of it."""
    answer = subjects[0].folder / ANSWER
    settings = replace(moment.settings, force=True)
    of_painted = [subjects[k] for k in moment.painted]
    scenes = tuple(its.loaded for its in of_painted if its.scene is not None)
    targets, asked = moment.painted_targets, moment.constraints
    if len(subjects) == 1:
        groups = subjects[0].groups
        basis = moment.bases[0] if groups is None else groups
        job, bases = Job(scenes, targets, answer, basis, asked, settings), None
    elif scenes:
        bases = [moment.bases[k] for k in moment.painted]
        # They are on their film already, and have their samples.
        spp = bases[0].origin.spp if settings.checks_as_basis else settings.spp
        done: dict[str, Any] = {"resolution": None, "quality": None, "time_s": None, "spp": spp}
        settings = replace(settings, **done)
        job = Job(scenes, targets, answer, None, asked, settings, by_sensor=True)
    else:
        raise PaintError("a report of several saved bases needs their scene: open that instead")
    run(job, progress, bases=bases)
    return [view.folder / "report.html" for view in job.views]


def verified(
    subject: Subject, basis: Basis, lighting: Lighting, progress: Progress
) -> tuple[Floats, str, bool]:
    """The scene as it is relit, rendered: (h, w, 3) clean, what that says, whether it agrees."""
    scene = subject.loaded
    with tempfile.TemporaryDirectory(prefix="lightpaint-") as place:
        relit = relight(scene, lighting, Path(place) / RELIT)
        if relit.sensor != scene.sensor:
            relit = load_scene(relit.path, sensor=scene.sensor, use_lights_file=False)
        predicted = combine(basis, lighting)
        result = verify_in_stages(
            predicted, relit, basis, lighting, spp=basis.origin.spp, progress=progress
        )
    picture = denoised(result.verified.image, basis.features)
    says = "confirms it" if result.agrees else "does NOT confirm it"
    said = f"A render of {result.spp} samples per pixel {says}: {agreement(result)}."
    return picture, said, result.agrees
