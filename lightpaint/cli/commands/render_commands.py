"""The sub-commands that render: lights, basis, template, demo, relight and verify; and `solve`, of
one painting or several, with their variations and a gallery of all.
"""

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

from lightpaint import pipeline
from lightpaint.basis import Basis, write_basis
from lightpaint.basis.cache import write_from_cache
from lightpaint.cli.commands.answer_text import Table, show_look, spoken_settings
from lightpaint.cli.options.job_options import folders_of, is_folder
from lightpaint.cli.output import documents, tables, terminal
from lightpaint.cli.output.documents import Tolerances
from lightpaint.cli.output.lines import CommandOutcome
from lightpaint.cli.output.vocabulary import from_any_folder
from lightpaint.colour import ViewTransform
from lightpaint.demo import write_demo
from lightpaint.display_text import some_of
from lightpaint.errors import LOOK_ERRORS, BackendError, ConstraintError, OutputError
from lightpaint.files import check_files, check_name, check_writable
from lightpaint.lighting import FullLamp, agreed_scale, read_lighting
from lightpaint.placement import PlacementRecord, record_of
from lightpaint.progress import stage
from lightpaint.relit import EXPORTS, solved_identity
from lightpaint.report import spoken_turn
from lightpaint.scene import Scene
from lightpaint.scene.quality_presets import on_film, samples
from lightpaint.scene.runtime.variant import use_variant
from lightpaint.sentences import Sentence
from lightpaint.storage.staging import finish
from lightpaint.target import CLEAN, LIGHT_FILE, LIGHTS, MATTES, SHOWN_FILE, files_in_the_way

if TYPE_CHECKING:
    from lightpaint.cli.solve_variations import LookSet

#: No requirements.
NO_REQUIREMENTS = Tolerances()


def solve(
    *,
    jobs: Sequence[pipeline.Job],
    table: Table = "short",
    tolerances: Tolerances = NO_REQUIREMENTS,
    look_set: "LookSet | None" = None,
    frames: str | None = None,
) -> CommandOutcome:
    """Run `lightpaint solve SCENE|BASIS TARGET...` or `SCENE --target SENSOR=TARGET...`.

    look_set: the set of looks, if there are several. frames: the frames of a shot to write, as
    `parse_frames` reads them.
    """
    chosen_frames = [pipeline.frames_to_write(job, frames) for job in jobs]
    listen, shared = terminal.TerminalListener(), _SharedWork()
    results: list[tuple[pipeline.Job, pipeline.PaintedView, pipeline.Look]] = []
    frame_files: list[Path] = []
    # The remarks of all jobs come before the first one runs; the listener drops repeats.
    for remark in (remark for job in jobs for remark in job.remarks):
        listen.say(remark)
    for job, job_frames in zip(jobs, chosen_frames, strict=True):
        listen.note(f"files read; {spoken_settings(job.fit)}")
        is_variation = look_set is not None and job.folder in look_set.variation_names
        job = shared.prepare(job, is_variation=is_variation)
        try:
            with listen:
                looks = pipeline.run(
                    job, listen, bases=None if shared.bases is None else [*shared.bases]
                )
            shared.take_from(looks)
            if look_set is not None:
                bases = [look.basis for look in looks]
                look_set.finish_look(job, looks[0].lighting, bases, listen)
        except LOOK_ERRORS as error:
            if look_set is None or not look_set.continues_after(job, error):
                raise
            continue
        _show(job, looks, table)
        if job_frames:
            frame_files += _write_frames(job, job_frames, listen)
        results += [(job, view, look) for view, look in zip(job.views, looks, strict=True)]
    if look_set is not None:
        look_set.show(shared.bases or [])
    if jobs and not jobs[0].scenes and jobs[0].groups is None:
        terminal.say("solved from a saved basis, without a render: lightpaint relight makes one")
    return _outcome(results, tolerances, look_set, frame_files)


def _write_frames(
    job: pipeline.Job, frames: Sequence[int], listen: terminal.TerminalListener
) -> list[Path]:
    """Write frames of a shot, and print which."""
    try:
        with listen:
            files = pipeline.relight_frames(job, frames=frames, progress=listen)
    except KeyboardInterrupt:
        raise KeyboardInterrupt("frames that are written stay; the same command goes on") from None
    count = f" to {files[-1].name}, {len(files)} files" if len(files) > 1 else ""
    terminal.write(f"frames: {files[0]}{count}")
    return files


class _SharedWork:
    """Results that the jobs of one command share: several paintings of one scene its bases, and
    variations the places of lights.
    """

    def __init__(self) -> None:
        self.bases: list[Basis] | None = None
        self._placement: PlacementRecord | None = None

    def prepare(self, job: pipeline.Job, *, is_variation: bool) -> pipeline.Job:
        """Return the next job: a variation has the places that were found for its original."""
        if self._placement is None:
            return job
        if is_variation:
            return job.with_placement(self._placement)
        # The bases are of lights which another painting moved.
        self.bases, self._placement = None, None
        return job

    def take_from(self, looks: Sequence[pipeline.Look]) -> None:
        """Keep the results of a job for those that follow."""
        self.bases = [look.basis for look in looks]
        if (placement := looks[0].placement) is not None and not placement.is_empty:
            self._placement = record_of(placement)


def _outcome(
    results: Sequence[tuple[pipeline.Job, pipeline.PaintedView, pipeline.Look]],
    tolerances: Tolerances,
    look_set: "LookSet | None",
    frame_files: Sequence[Path],
) -> CommandOutcome:
    """Print the requirements that are not met, and return the results for programs."""
    shortfalls = [
        f"{view.folder} {text}"
        for _, view, look in results
        for text in tolerances.shortfalls(look.analysis.appearance)
    ]
    if shortfalls:
        terminal.complain("solve", some_of(shortfalls, joint="; "))
    variations = [] if look_set is None else look_set.shifted_looks

    def document() -> dict[str, Any]:
        results_document: dict[str, Any] = {
            "results": [documents.result_document(*x, tolerances) for x in results]
        }
        if frame_files:
            results_document["frames"] = [str(file) for file in frame_files]
        return results_document | ({"variations": variations} if variations else {})

    has_failures = look_set is not None and look_set.failures
    answers = [look.planes for *_, look in results if look.planes is not None]
    has_missed_wishes = any(x.missed and not x.are_ignored for x in answers)
    return CommandOutcome(document, 1 if shortfalls or has_missed_wishes or has_failures else 0)


def _show(job: pipeline.Job, looks: Sequence[pipeline.Look], table: Table) -> None:
    """Print the results of one job."""
    for view, look in zip(job.views, looks, strict=True):
        if job.by_sensor or len(looks) > 1:
            terminal.write("")
            terminal.write(f"{'frame ' * bool(job.sequence)}{view.folder.name}:")
        show_look(look, view.folder, table=table)
        if look is not looks[-1]:
            continue
        # Suggestions are of all views together.
        if look.move_suggestion is not None:
            text = spoken_turn(look.move_suggestion)
            option = f"--aim {quote(f'{look.move_suggestion.name}={look.move_suggestion.aim}')}"
            terminal.write(f"{text} Let it turn: {option}")
        if look.suggestions is not None:
            tables.show_suggestions(look.suggestions, cd_per_unit=job.settings.cd_per_unit)
    if job.groups is not None:
        exports = ", ".join(name for name in EXPORTS if (job.folder / name).is_file())
        terminal.write(f"for other programs: {exports}")


def lights(
    *,
    scene: pipeline.SceneFile,
    cd_per_unit: float | None,
    sheet: Path | None,
    is_named: bool = True,
    force: bool = False,
) -> CommandOutcome:
    """Run `lightpaint lights SCENE`.

    sheet: file of the light sheet; None for none. is_named: True if the user named it; otherwise a
    sheet that cannot be written is not an error.
    """
    content = scene.content
    cd_per_unit = agreed_scale(content.cd_per_unit, cd_per_unit)
    lamps, cd_per_unit = _lamps(content, cd_per_unit)
    if sheet is not None and is_named:
        pipeline.check_sheet(content, sheet, force=force)
    note_scene(content)
    for remark in pipeline.remarks_of_scene(content):
        terminal.say(remark)
    tables.show_lights(content, cd_per_unit, lamps)
    is_drawn = sheet is not None and _draw_sheet(content, sheet, is_named=is_named, force=force)
    sheet_fields = {"sheet": str(sheet)} if is_drawn else {}
    return CommandOutcome(
        lambda: {**documents.lights_document(content, cd_per_unit, lamps), **sheet_fields}
    )


def _lamps(scene: Scene, cd_per_unit: float | None) -> tuple[Mapping[str, FullLamp], float | None]:
    """Return the lamps of a scene, none if its lights file has a mistake, which is printed; and
    candelas of an intensity of 1, as given or as the lights file says.
    """
    try:
        scaled = pipeline.scaled_constraints(scene, cd_per_unit)
        return pipeline.lamps_of_scene(scene, scaled), scaled.cd_per_unit
    except ConstraintError as error:
        terminal.say(error.sentence)
        return {}, cd_per_unit


def _draw_sheet(scene: Scene, sheet: Path, *, is_named: bool, force: bool) -> bool:
    """Write the light sheet; print the reason and return False if it cannot be written."""
    try:
        pipeline.check_sheet(scene, sheet, force=force)
        with terminal.TerminalListener() as listen:
            reason = pipeline.render_sheet(scene, sheet, listen)
    except (OutputError, BackendError) as error:
        if is_named and isinstance(error, OutputError):
            raise
        reason = error.sentence
    if reason:
        terminal.say(Sentence(f"no {sheet}: ", reason))
        return False
    terminal.note("lights drawn")
    terminal.write(f"{sheet}: each light alone")
    return True


def note_scene(scene: Scene) -> None:
    """Print details of a loaded scene, in verbose mode."""
    height, width = scene.size
    terminal.note(
        f"{scene.path} read: {len(scene.emitters)} emitters, {len(scene.lights)} lights, "
        f"{width}x{height} pixels through {scene.sensor_names[scene.sensor]}, "
        f"{use_variant().variant}"
    )


def basis(
    *, scene: pipeline.SceneFile, output: Path, settings: pipeline.Settings
) -> CommandOutcome:
    """Run `lightpaint basis SCENE -o F.basis.exr`."""
    if output.suffix.lower() != ".exr":
        raise OutputError(f"{output} must end in .exr: a basis is an EXR")
    check_writable(output.parent)
    scene_on_film = on_film(scene.content, settings.quality, settings.resolution)
    note_scene(scene_on_film)
    check_files([output], scene_on_film.read_files)
    with terminal.TerminalListener() as listen:
        of_film = pipeline.remarks_of_film(scene_on_film, settings)
        for remark in (
            *pipeline.remarks_of_scene(scene_on_film),
            *of_film,
            *pipeline.remarks_of_memory(scene_on_film, settings.basis_spp),
        ):
            listen.say(remark)
        basis_on_film = pipeline.obtain(scene_on_film, settings, listen)
        write = write_from_cache if settings.use_cache else write_basis
        with stage("writing the basis", listen):
            write(output, basis_on_film)
    note = " and the fixed light" if basis_on_film.is_fixed.any() else ""
    count = int((~basis_on_film.is_fixed).sum())
    terminal.write(f"{output}: {count} lights{note}, {basis_on_film.origin.spp} samples per pixel")
    return CommandOutcome(lambda: documents.basis_document(output, basis_on_film))


def template(
    *,
    source: pipeline.SceneFile | pipeline.BasisFile | pipeline.GroupsFile,
    output: Path,
    transform: ViewTransform | None,
    settings: pipeline.Settings,
    force: bool,
) -> CommandOutcome:
    """Run `lightpaint template SCENE|BASIS|LIGHTS -o DIR`."""
    _check_template(output, force=force)
    if not isinstance(source, pipeline.SceneFile):
        return _template_of_basis(source, output, transform, settings)
    scene_on_film = on_film(source.content, settings.quality, settings.resolution)
    note_scene(scene_on_film)
    check_files(_replaced_files(output), scene_on_film.read_files)
    for remark in pipeline.remarks_of_film(scene_on_film, settings):
        terminal.say(remark)
    options: dict[str, Any] = {
        "transform": transform,
        "spp": samples(settings.quality, spp=settings.spp, time_s=settings.time_s),
        "time_s": settings.time_s,
        "seed": settings.seed,
        "use_cache": settings.use_cache,
    }
    with terminal.TerminalListener() as listen:
        for remark in pipeline.remarks_of_scene(scene_on_film, is_rendered=False):
            listen.say(remark)
        if is_folder(output):
            files = pipeline.render_template(scene_on_film, output, progress=listen, **options)
        else:
            files = [
                output,
                pipeline.render_look(scene_on_film, output, progress=listen, **options),
            ]
    return _show_template(output, files)


def _template_of_basis(
    source: pipeline.BasisFile | pipeline.GroupsFile,
    output: Path,
    transform: ViewTransform | None,
    settings: pipeline.Settings,
) -> CommandOutcome:
    """Write a template of a saved basis or of light groups."""
    pipeline.check_nothing_unused(settings, source)
    content = source.content
    basis = content if isinstance(content, Basis) else content.basis
    check_files(
        _replaced_files(output),
        [Path(source.path)] if isinstance(content, Basis) else content.files,
    )
    if not isinstance(content, Basis):
        for remark in content.remarks:
            terminal.say(remark)
    if is_folder(output):
        files = pipeline.template_of_basis(basis, output, transform=transform)
    else:
        files = [output, pipeline.look_of_basis(basis, output, transform=transform)]
    return _show_template(output, files, is_denoised=basis.knows_noise)


def _show_template(
    output: Path, files: Sequence[Path], *, is_denoised: bool = True
) -> CommandOutcome:
    """Print the purpose of each file of a template."""
    is_tree = is_folder(output)
    picture = output / SHOWN_FILE if is_tree else output.with_suffix(".png")
    linear = output / LIGHT_FILE if is_tree else output
    for line in template_lines(output, files, is_denoised=is_denoised):
        terminal.write(line)
    folder = output if is_tree else output.parent
    paths = {"picture": str(picture), "light": str(linear)}
    return CommandOutcome(lambda: documents.files_document(folder, files, **paths))


def template_lines(output: Path, files: Sequence[Path], *, is_denoised: bool = True) -> list[str]:
    """Return a line on each file of a template, those to paint over first."""
    is_tree = is_folder(output)
    picture = output / SHOWN_FILE if is_tree else output.with_suffix(".png")
    look = "the current look, denoised" if is_denoised else "the current look"
    steps = "paint over it in any program, save that under another name beside it, and solve for it"
    lines = [f"{picture}: {look}; {steps}"]
    if CLEAN in {file.name for file in files}:
        lines.append(
            f"{output / CLEAN}: the same in linear light, to paint over in programs that read EXR"
        )
    description = (
        "the look as rendered, with its noise" if is_denoised else "the same in linear light"
    )
    lines.append(f"{output / LIGHT_FILE if is_tree else output}: {description}")
    if is_tree and (output / MATTES) in {file.parent for file in files}:
        lines.append(f"{output}/{MATTES}: a mask for each object")
        lines.append(f"{output}/{LIGHTS}: what each light does alone")
    elif is_tree:
        lines.append(f"{output}/{LIGHTS}: what each light does alone")
    return lines


def demo(*, folder: Path, variant: str | None, settings: pipeline.Settings) -> CommandOutcome:
    """Run `lightpaint demo -o DIR`."""
    demo_files = write_demo(folder)
    options = [f"--spp {settings.spp}"] if settings.spp else []
    options += [f"-m {variant}"] if variant else []
    files = shlex.join(map(str, (demo_files.scene, demo_files.painting, "-o", demo_files.answer)))
    command = " ".join(("lightpaint solve", files, *options))
    terminal.say(
        f"wrote a gallery and a painting of it in the evening to {folder}; this solves for it:"
    )
    terminal.say(command)
    scene = pipeline.SceneFile(str(demo_files.scene), variant=variant)
    settings = replace(settings, command=from_any_folder(command))
    painting = pipeline.Painting(str(demo_files.painting))
    outcome = solve(
        jobs=[pipeline.Job((scene,), (painting,), demo_files.answer, settings=settings)]
    )
    terminal.write("")
    terminal.write(f"Open {demo_files.answer / 'report.html'} in a browser. Then paint your own:")
    terminal.write(f"lightpaint template {shlex.quote(str(demo_files.scene))}")
    fields = {
        "scene": str(demo_files.scene),
        "painting": str(demo_files.painting),
        "command": command,
    }
    results = outcome.document
    return replace(outcome, document=lambda: fields | (results() if results is not None else {}))


def relight(
    *,
    scene: pipeline.SceneFile,
    lightings: Sequence[Path],
    output: Path | None,
    settings: pipeline.Settings,
) -> CommandOutcome:
    """Run `lightpaint relight SCENE lighting.json...`."""
    for path in lightings:
        finish(path.parent)
    answers = [read_lighting(path) for path in lightings]
    names = [a.target or path.stem for a, path in zip(answers, lightings, strict=True)]
    folders = folders_of(output, names)
    scene_on_film = scene.content
    note_scene(scene_on_film)
    if note := use_variant().note:
        terminal.say(note)
    results = [
        pipeline.relit_folder(scene_on_film, path, folder, force=settings.force)
        for path, folder in zip(lightings, folders, strict=True)
    ]
    for place in results:
        place.check()
    for lighting, place in zip(answers, results, strict=True):
        folder = place.folder
        if lighting.scene_identity not in ("", solved_identity(scene_on_film, lighting)):
            terminal.say(f"{folder}: the lighting was solved for an earlier state of the scene")
        with terminal.TerminalListener() as listen:
            options: dict[str, Any] = {"spp": settings.spp, "seed": settings.seed}
            pipeline.relight_look({"": scene_on_film}, lighting, place, progress=listen, **options)
            listen.note(f"{folder} relit and rendered")
        camera = lighting.observer
        seen = f", as {camera.name} sees the scene" if camera.is_camera else ""
        terminal.write(f"{folder}: relit.xml, relit.exr, relit.png{seen}")
    return CommandOutcome(
        lambda: {"results": [_relit(*x) for x in zip(lightings, results, strict=True)]}
    )


def _relit(lighting: Path, place: pipeline.ResultFolder) -> dict[str, Any]:
    """Return the files of a relit scene, for programs."""
    files = [file for file in place.files if file.is_file()]
    return documents.files_document(place.folder, files, lighting=str(lighting))


def verify(
    *, folders: Sequence[Path], variant: str | None, settings: pipeline.Settings
) -> CommandOutcome:
    """Run `lightpaint verify DIR...`."""
    use_variant(variant)
    results = []
    for folder in (
        view for folder_given in folders for view in pipeline.result_folders(folder_given)
    ):
        with terminal.TerminalListener() as listen:
            options: dict[str, Any] = {"spp": settings.spp, "seed": settings.seed}
            result = pipeline.verify_result(folder, progress=listen, **options)
            listen.note(f"{folder} rendered and compared")
        terminal.write(f"{folder}: {tables.spoken_agreement(result)}")
        results.append((folder, result))
    agrees = all(result.agrees for _, result in results)
    return CommandOutcome(
        lambda: {
            "agrees": agrees,
            "results": [documents.verified_document(*result) for result in results],
        },
        0 if agrees else 1,
    )


def _check_template(output: Path, *, force: bool) -> None:
    """Raise OutputError if a template cannot or should not be written there."""
    is_tree = is_folder(output)
    check_name(output)
    check_files(_replaced_files(output), ())
    for file in _replaced_files(output):
        if file.exists() and not force:
            raise OutputError(
                f"{file} exists and may have been painted on: choose another name with -o, or "
                "pass --force"
            )
    if output.suffix.lower() in (".png", ".tif", ".tiff", ".jpg", ".jpeg"):
        raise OutputError(
            f"{output} is not a folder: name one with -o, or a file that ends in .exr (a PNG is "
            "written beside it)"
        )
    if is_tree and output.is_file():
        raise OutputError(f"{output} is a file: name a folder with -o, or a file that ends in .exr")
    check_writable(output if is_tree else output.parent)


def _replaced_files(output: Path) -> list[Path]:
    """Return the files that a template at `output` may replace."""
    if not is_folder(output):
        return [output, output.with_suffix(".png")]
    finish(output)
    return files_in_the_way(output)
