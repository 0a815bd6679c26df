"""Conversion of options to jobs: paintings, constraints, settings and folders."""

from argparse import Namespace
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lightpaint.basis import FrameSequence
from lightpaint.cli.options import source_options
from lightpaint.cli.output.vocabulary import BY_OPTION, from_any_folder
from lightpaint.colour import TransformChoice
from lightpaint.display_text import some_names
from lightpaint.errors import LOOK_ERRORS, LightpaintError, OutputError, TargetError
from lightpaint.files import check_files, is_name, is_utf_8, one_line
from lightpaint.lighting import LAMP_KEYS, LIGHT_KEYS, Constraints, read_constraints
from lightpaint.pipeline import Painting, PlacementFile, SceneFile, Settings
from lightpaint.placement import Rigging
from lightpaint.scene.lights.lights_file import MOVES

if TYPE_CHECKING:
    from lightpaint.pipeline import Job


def is_folder(output: Path) -> bool:
    """Return True if a template goes to a folder, and not to a single EXR with its PNG."""
    return output.suffix.lower() != ".exr"


def settings_of(options: Namespace, words: Sequence[str]) -> Settings:
    """Return the settings in the options; others have their defaults."""
    # The transform belongs to the painting; the command is the whole line.
    names = {field.name for field in fields(Settings)} - {"transform", "command"}
    values = {name: value for name, value in vars(options).items() if name in names}
    return Settings(**values, command=from_any_folder(["lightpaint", *words]))


def jobs_of(
    options: Namespace, settings: Settings, failures: dict[str, str] | None = None
) -> "list[Job]":
    """Return the jobs of `solve`, one for each painting, or one for several views.

    All are created, and so checked, before the first runs. failures: receives the reason of each
    failure, by the name of the folder, if the others are to go on.
    """
    # Imported late: jobs import much that other commands do not need.
    from lightpaint.pipeline import Job

    if (sequence := source_options.sequence_of(options)) is not None:
        return [_job_of_frames(options, settings, sequence)]
    basis = source_options.basis_of(options)
    if options.views and options.targets:
        raise TargetError("TARGET and --target at once: give every painting with its sensor")
    paths = options.targets or [path for _, path in options.views]
    if not paths:
        if basis is None and Path(options.source).suffix.lower() != ".xml":
            raise TargetError(
                f"{options.source} stands where the scene belongs: give the scene first, then the "
                "painting"
            )
        raise TargetError("no painting to solve for: give a TARGET, or --target SENSOR=TARGET")
    paintings = _paintings_of(options, paths)
    constraints, rigging = constraints_of(options), rigging_of(options)
    if basis is not None and options.lights_file:
        constraints = read_constraints(options.lights_file).and_then(constraints)
    if options.views:
        scenes, folder = _scenes_of_views(options), _folder_of_views(options, paths)
        job_fields: dict[str, Any] = {
            "by_sensor": True,
            "rigging": rigging,
            "placement": placement_of(options),
        }
        return [Job(scenes, tuple(paintings), folder, None, constraints, settings, **job_fields)]
    # One scene, loaded once for all jobs.
    source = () if basis is not None else (source_options.scene_of(options),)
    jobs = []
    for painting, folder in zip(paintings, _folders_of_looks(options, paths), strict=True):
        try:
            job = Job(
                source,
                (painting,),
                folder,
                basis,
                constraints,
                settings,
                rigging=rigging,
                placement=placement_of(options),
            )
            jobs.append(job)
        except LOOK_ERRORS as error:
            if failures is None or not options.keep_going or len(paintings) == 1:
                raise
            failures[folder.name] = error.sentence
    if options.lights_file:
        for job in jobs:  # if no scene has read it
            check_files(job.results.files, [Path(options.lights_file)])
    return jobs


def _job_of_frames(options: Namespace, settings: Settings, sequence: FrameSequence) -> "Job":
    """Return the job of a shot whose frames are views of one lighting."""
    from lightpaint.pipeline import Job

    if options.variations:
        raise LightpaintError("--variations are of one picture: give one frame, or leave them out")
    paintings = source_options.paintings_by_frame(options, sequence)
    paths, frames = list(paintings.values()), tuple(paintings)
    options.masks = source_options.masks_by_frame(options, frames)
    constraints = constraints_of(options)
    if options.lights_file:
        constraints = read_constraints(options.lights_file).and_then(constraints)
    given = (options.targets or paths)[0]
    [folder] = folders_of(
        options.output and Path(options.output), [source_options.name_without_frame(given)]
    )
    job = Job(
        (),
        tuple(_paintings_of(options, paths)),
        folder,
        source_options.groups_of_frames(options, sequence, frames),
        constraints,
        settings,
        rigging=rigging_of(options),
        placement=placement_of(options),
        sequence=sequence,
    )
    if options.lights_file:
        check_files(job.results.files, [Path(options.lights_file)])
    return job


def _scenes_of_views(options: Namespace) -> tuple[SceneFile, ...]:
    """Return the scene through the sensor of each view. Raises TargetError for an option -s."""
    if options.sensor:
        raise TargetError("-s cannot be used with --target, which names the sensors")
    return tuple(source_options.scene_of(options, sensor=sensor) for sensor, _ in options.views)


def _folder_of_views(options: Namespace, paths: Sequence[str]) -> Path:
    """Return the folder for the answer to the views at `paths`, below the folder of variations."""
    folder = Path(options.output or Path(paths[0]).stem)
    if options.output and options.variations:
        folder /= Path(paths[0]).stem
    return folder


def _folders_of_looks(options: Namespace, paths: Sequence[str]) -> list[Path]:
    """Return a folder for the answer to each painting."""
    output = options.output and Path(options.output)
    names = [Path(path).stem for path in paths]
    # A painting with variations beside it is several looks.
    is_several = bool(options.variations) and len(names) == 1 and output
    return [output / names[0]] if is_several else folders_of(output, names)


def _paintings_of(options: Namespace, paths: list[str]) -> list[Painting]:
    """Return the paintings at `paths`, each with its mask."""
    return [
        Painting(
            path,
            mask=mask,
            layer=options.layer,
            transform=transform_of(options),
            template=options.template,
            find=options.find_template,
            paint=options.paint,
        )
        for path, mask in zip(paths, _one_for_each(options.masks or [None], paths), strict=True)
    ]


def transform_of(options: Namespace) -> TransformChoice:
    """Return the choice of --view and --exposure."""
    return TransformChoice(options.view, options.exposure)


def constraints_of(options: Namespace) -> Constraints:
    """Return the constraints in the options."""
    lights: dict[str, dict[str, Any]] = {}
    for key in (key for key in LIGHT_KEYS if key not in ("off", *LAMP_KEYS)):
        for name, value in getattr(options, key):
            lights.setdefault(name, {})[key] = value
    for name in options.off:
        lights.setdefault(name, {})["off"] = True
    return Constraints.of(
        lights,
        tie=options.tie,
        prefer_current=options.prefer_current,
        sparse=options.sparse,
        start=dict(options.start),
        near=options.near,
        prefer_emitters=options.prefer_emitters,
        where=BY_OPTION,
    )


def rigging_of(options: Namespace) -> Rigging:
    """Return the rigging that the options ask for.

    Raises LightpaintError for lights that may move, or are new, and --no-move.
    """
    lights: dict[str, dict[str, Any]] = {}
    for key in MOVES:
        for name, value in getattr(options, key):
            lights.setdefault(name, {})[key] = value
    if not options.move_lights and (lights or options.added):
        moving = [f"--{key} {name}" for name, table in lights.items() for key in table]
        raise LightpaintError(
            f"{[*moving, '--add'][0]} and --no-move, which keeps all lights in place and adds "
            "none: leave one of the two out"
        )
    return Rigging.of(lights, new=options.added, where=BY_OPTION)


def placement_of(options: Namespace) -> PlacementFile | None:
    """Return the file of places that the options name, if any."""
    return None if options.places is None else PlacementFile(options.places)


def folders_of(output: Path | None, names: Sequence[str]) -> list[Path]:
    """Return one result folder per name: DIR itself for a single one, DIR/<name> for several."""
    if output is not None and len(names) == 1:
        return [output]
    for name in names:
        # The reader of the file reports names that are not UTF-8.
        if not is_name(name) and is_utf_8(Path(name)):
            advice = "choose one with -o" if len(names) == 1 else "solve it alone, with -o"
            raise OutputError(f"{one_line(repr(name))} cannot be the name of a folder: {advice}")
    if repeated := sorted({name for name in names if names.count(name) > 1}):
        raise OutputError(
            f"results would overwrite each other in {some_names(repeated)}: run equal names "
            "separately, each with its own -o"
        )
    return [(output or Path()) / name for name in names]


def _one_for_each(masks: list[str | None], targets: list[str]) -> list[str | None]:
    if len(masks) == 1:
        return masks * len(targets)
    if len(masks) != len(targets):
        raise TargetError(
            f"{len(masks)} masks for {len(targets)} targets: give one for all, or one for each"
        )
    return masks
