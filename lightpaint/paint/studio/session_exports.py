"""Exports of a session: files for other programs, and the verification render."""

import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from lightpaint.arrays import Floats
from lightpaint.basis import Basis
from lightpaint.colour import ViewTransform, to_8_bit
from lightpaint.errors import OutputError, PaintError
from lightpaint.files import write_bytes
from lightpaint.images import denoised, denoiser_text
from lightpaint.images.formats import png_bytes
from lightpaint.lighting import Lighting, combine
from lightpaint.paint.layers.canvas import ViewLayers
from lightpaint.paint.layers.layer_files import write_layers_exr, write_layers_openraster
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.subject import Subject, layers_paths, painting_path, picture_path
from lightpaint.pipeline import LIGHTING, RELIT, Job, run, write_answer
from lightpaint.progress import Progress
from lightpaint.relit import relight, verify_in_stages
from lightpaint.report import CleanLooks, spoken_distance
from lightpaint.scene import load_scene
from lightpaint.target import texts_of, write_painting

#: Folder of the report, in that of the session.
ANSWER_FOLDER = "answer"

#: Exports that write the painting, and those that need one.
WRITES_PAINTING = {"target", "report"}
NEEDS_PAINTING = WRITES_PAINTING | {"layers"}


def export(
    subjects: Sequence[Subject],
    snapshot: SessionSnapshot,
    lighting: Lighting,
    outputs: Sequence[str],
    progress: Progress,
    layers: Sequence[ViewLayers] = (),
) -> Iterator[Path]:
    """Write the requested files into the folder of the session; yield each one once it exists.

    subjects, layers: of all views; layers are needed for their files alone. If nothing is painted,
    files that need a painting are left out. Raises PaintError for files that this session cannot
    export, OutputError for files that cannot be written.
    """
    if not snapshot.painted_views:
        outputs = [name for name in outputs if name not in NEEDS_PAINTING]
        if not outputs:
            raise PaintError("nothing is painted yet: there is no painting to write")
    first, folder = subjects[0], subjects[0].folder
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot make {folder}: {error.strerror}") from None
    if set(outputs) & WRITES_PAINTING:
        for sensor, target in zip(snapshot.painted_sensors, snapshot.painted_targets, strict=True):
            write_painting(painting_path(folder, sensor), target)
            yield painting_path(folder, sensor)
    if "layers" in outputs:
        yield from _write_layers(folder, snapshot, layers)
    if "picture" in outputs:
        for sensor, basis in zip(snapshot.sensors, snapshot.bases, strict=True):
            write_bytes(
                picture_path(folder, sensor), answer_png(basis, lighting, snapshot.transform)
            )
            yield picture_path(folder, sensor)
    if "lighting" in outputs:
        write_answer(folder, lighting)
        yield folder / LIGHTING
    if "relit" in outputs:
        if first.scene is None:
            raise PaintError("there is no scene to relight: it was opened from a saved basis")
        write_answer(folder, lighting, scene=first.loaded_scene, has_lighting=True)
        yield folder / RELIT
    if "report" in outputs:
        yield from _write_report(subjects, snapshot, progress)


def _write_layers(
    folder: Path, snapshot: SessionSnapshot, layers: Sequence[ViewLayers]
) -> Iterator[Path]:
    """Write the layers of each painted view."""
    for view, sensor in zip(snapshot.painted_views, snapshot.painted_sensors, strict=True):
        exr, openraster = layers_paths(folder, sensor)
        write_layers_exr(exr, layers[view], snapshot.bases[view].origin.sensor)
        yield exr
        target = snapshot.targets[view]
        assert target is not None
        write_layers_openraster(openraster, layers[view], target.image, snapshot.transform)
        yield openraster


def answer_png(basis: Basis, lighting: Lighting, transform: ViewTransform) -> bytes:
    """Return the answer in a view as pages and reports show it: a PNG, through `transform`,
    denoised.
    """
    weights = lighting.weights_for(basis)
    looks = CleanLooks.clean(basis, weights, basis.mix(weights), None)
    pixels = to_8_bit(transform.encode(looks.predicted))
    return png_bytes(pixels, texts_of(transform) | denoiser_text(basis.features, raw="not kept"))


def _write_report(
    subjects: Sequence[Subject], snapshot: SessionSnapshot, progress: Progress
) -> list[Path]:
    """Run `solve` on the current paintings; return the reports."""
    answer = subjects[0].folder / ANSWER_FOLDER
    # In the painter no light moves unless somebody moves it.
    settings = replace(snapshot.settings, force=True, move_lights=False)
    painted_subjects = [subjects[k] for k in snapshot.painted_views]
    scenes = tuple(
        subject.loaded_scene for subject in painted_subjects if subject.scene is not None
    )
    targets, constraints = snapshot.painted_targets, snapshot.constraints
    if len(subjects) == 1:
        groups = subjects[0].groups
        basis = snapshot.bases[0] if groups is None else groups
        job, bases = Job(scenes, targets, answer, basis, constraints, settings), None
    elif scenes:
        bases = [snapshot.bases[k] for k in snapshot.painted_views]
        # The scenes are already on their film, and the bases have their samples.
        spp = bases[0].origin.spp if settings.checks_as_basis else settings.spp
        rendered: dict[str, Any] = {"resolution": None, "quality": None, "time_s": None, "spp": spp}
        settings = replace(settings, **rendered, error=None)
        job = Job(scenes, targets, answer, None, constraints, settings, by_sensor=True)
    else:
        raise PaintError("a report of several saved bases needs their scene: open that instead")
    run(job, progress, bases=bases)
    return [view.folder / "report.html" for view in job.views]


def render_verification(
    subject: Subject, basis: Basis, lighting: Lighting, progress: Progress
) -> tuple[Floats, str, bool]:
    """Render the relit scene. Returns the denoised picture (h, w, 3), a sentence, and whether it
    agrees.
    """
    scene = subject.loaded_scene
    with tempfile.TemporaryDirectory(prefix="lightpaint-") as place:
        relit = relight(scene, lighting, Path(place) / RELIT)
        if relit.sensor != scene.sensor:
            relit = load_scene(relit.path, sensor=scene.sensor, use_lights_file=False, lamps=["*"])
        predicted = combine(basis, lighting)
        result = verify_in_stages(
            predicted, relit, basis, lighting, spp=basis.origin.spp, progress=progress
        )
    picture = denoised(result.verified.image, basis.features)
    state = "equal within noise" if result.agrees else "NOT equal, by more than noise explains"
    if result.agrees and result.is_blind:
        state = "nothing found against it"
    text = f"Rendered again with {result.spp} samples per pixel: {state}"
    # How many standard errors apart they are helps whoever looks for a mistake.
    text += "." if result.agrees else f" ({spoken_distance(result)})."
    return picture, text, result.agrees
