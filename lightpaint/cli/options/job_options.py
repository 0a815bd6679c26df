"""From options to jobs and values: what each command is called with.

Nothing else reads the Namespace. `solve --lights FILE.exr TARGET` and `solve FILE.exr TARGET`
both mean another renderer's light groups; `--lights key,fill` goes on to mean the lights of a
scene.
"""

from argparse import Namespace
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lightpaint.basis.file import is_basis_file
from lightpaint.basis.lightgroups.folder import is_exr, is_light_groups, is_own_basis
from lightpaint.cli.options.argument_order import options_but
from lightpaint.cli.output.vocabulary import from_any_folder
from lightpaint.cli.tolerances import Wanted
from lightpaint.colour.display.view_transform import TransformChoice
from lightpaint.errors import LOOK_ERRORS, BasisError, BatchError, OutputError, TargetError
from lightpaint.files import check_files, is_name, is_utf_8, one_line, scene_name
from lightpaint.lighting.constraints.constraints import LIGHT_KEYS, Constraints
from lightpaint.lighting.constraints.constraints_file import read_constraints
from lightpaint.pipeline.settings import Settings
from lightpaint.pipeline.sources import BasisFile, GroupsFile, Painting, SceneFile, check_needed
from lightpaint.screen import some_names

if TYPE_CHECKING:
    from lightpaint.batch.run_options import RunOptions
    from lightpaint.pipeline.job import Job

#: Where what options ask of lights stands, as errors say it.
BY_OPTION = "on the command line"

#: Options that say how a scene is loaded, by the names that Python has for them.
LOADING = ("sensor", "parameters", "variant", "lights", "groups", "integrator")


def values_of(options: Namespace, given: Sequence[str]) -> dict[str, Any]:
    """The arguments that the function of a command takes. given: as they were typed."""
    asked, settings = vars(options), settings_of(options, given)
    output = Path(asked["output"]) if asked.get("output") else None
    match options.command:
        case "lights":
            is_drawn = output is not None or not (options.no_sheet or options.as_json)
            return {
                "scene": scene_of(options),
                "cd_per_unit": options.cd_per_unit,
                "sheet": (output or Path("lights.png")) if is_drawn else None,
                "is_asked": output is not None,
                "force": options.force,
            }
        case "basis":
            output = output or Path(Path(options.scene).stem + ".basis.exr")
            return {"scene": scene_of(options), "output": output, "settings": settings}
        case "template":
            output, transform = output or Path("template"), transform_of(options)
            return {
                "source": _source_of_template(options),
                "output": output,
                "transform": None if transform.is_open else transform.over(None),
                "settings": settings,
                "force": options.force,
            }
        case "demo":
            output = output or Path("lightpaint-demo")
            return {"folder": output, "variant": options.variant, "settings": settings}
        case "solve":
            return _to_solve(options, settings)
        case "batch":
            return _to_do(options)
        case "export":
            return {
                "lighting": Path(options.lighting),
                "to": options.to,
                "scene": _scene_to_export(options),
                "groups": GroupsFile(options.groups, options.pattern) if options.groups else None,
                "stage": Path(options.stage) if options.stage else None,
                "output": output,
                "force": options.force,
            }
        case "paint":
            return _to_paint(options, settings, given)
        case "relight":
            scene = scene_of(options, is_to_solve=False, use_lights_file=False)
            paths = list(map(Path, options.lightings))
            return {"scene": scene, "lightings": paths, "output": output, "settings": settings}
        case "verify":
            folders = list(map(Path, options.folders))
            return {"folders": folders, "variant": options.variant, "settings": settings}
        case "cache":
            return {"action": options.action, "names": options.names}
        case _:
            return {"variant": options.variant}


def _source_of_template(options: Namespace) -> SceneFile | BasisFile | GroupsFile:
    """Return what `template` is to show: a scene, a saved basis, or light groups."""
    given = ",".join(options.lights or ())
    if options.scene is None:
        if not given:
            raise BasisError("nothing to paint on: give a scene, a basis, or light groups")
        _check_light_groups(given)
        options.scene, options.lights = given, None
    elif given and _is_file_to_be(given, Path(options.scene)):
        raise BasisError(f"{options.scene} and --lights {given} at once: give one to paint on")
    options.source, options.targets, options.masks, options.views = options.scene, [], [], []
    return basis_of(options) or scene_of(options)


def is_folder(output: Path) -> bool:
    """Whether a template goes to a folder, and not only to an EXR and a PNG."""
    return output.suffix.lower() != ".exr"


def settings_of(options: Namespace, given: Sequence[str]) -> Settings:
    """What the options say of `Settings`; those without an option are as by default."""
    # A transform is of the painting, which has it; the command is the whole line.
    names = {field.name for field in fields(Settings)} - {"transform", "command"}
    said = {name: value for name, value in vars(options).items() if name in names}
    return Settings(**said, command=from_any_folder(["lightpaint", *given]))


def scene_of(options: Namespace, *, is_to_solve: bool = True, **how: Any) -> SceneFile:
    """The scene that was asked for. is_to_solve: whether its lights are chosen."""
    path = options.source if options.command in ("solve", "paint") else options.scene
    if is_to_solve:
        how |= {
            "lights": options.lights,
            "groups": _groups(options.groups),
            "lights_file": options.lights_file,
            "use_lights_file": options.use_lights_file,
            "group_alike": options.group_alike,
        }
    loading = {"sensor": options.sensor, "variant": options.variant, **how}
    loading["integrator"] = options.integrator
    return SceneFile(path, parameters=dict(options.parameters), **loading)


def jobs_of(
    options: Namespace, settings: Settings, failed: dict[str, str] | None = None
) -> "list[Job]":
    """What `solve` is asked for, a job for each painting or one for several views.

    All are born, and so checked, before the first is run. failed: where the others are to go on,
    receives why one cannot be done, by the name of its folder.
    """
    # Jobs know all rooms, of which other commands need less.
    from lightpaint.pipeline.job import Job

    basis = basis_of(options)
    if options.views and options.targets:
        raise TargetError("TARGET and --target at once: give every painting with its sensor")
    paths = options.targets or [path for _, path in options.views]
    if not paths:
        raise TargetError("no painting to solve for: give a TARGET, or --target SENSOR=TARGET")
    paintings = [
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
    asked = constraints_of(options)
    if basis is not None and options.lights_file:
        asked = read_constraints(options.lights_file).and_then(asked)
    if options.views:
        if options.sensor:
            raise TargetError("-s cannot be used with --target, which names the sensors")
        scenes = tuple(scene_of(options, sensor=sensor) for sensor, _ in options.views)
        folder = Path(options.output or Path(paths[0]).stem)
        if options.output and options.variations:
            folder /= Path(paths[0]).stem
        return [Job(scenes, tuple(paintings), folder, None, asked, settings, by_sensor=True)]
    # One scene, which is loaded once for all.
    source = () if basis is not None else (scene_of(options),)
    output = options.output and Path(options.output)
    names = [Path(path).stem for path in paths]
    # With its variations beside it, one painting is several looks.
    is_several = bool(options.variations) and len(names) == 1 and output
    folders = [output / names[0]] if is_several else folders_of(output, names)
    jobs = []
    for painting, folder in zip(paintings, folders, strict=True):
        try:
            jobs.append(Job(source, (painting,), folder, basis, asked, settings))
        except LOOK_ERRORS as error:
            if failed is None or not options.keep_going or len(paintings) == 1:
                raise
            failed[folder.name] = str(error)
    if options.lights_file:
        for job in jobs:  # where there is no scene to have read it
            check_files(job.results.files, [Path(options.lights_file)])
    return jobs


def _to_solve(options: Namespace, settings: Settings) -> dict[str, Any]:
    """What `solve` is asked for, with a gallery where it is of several looks."""
    how: dict[str, Any] = {
        "table": options.table,
        "wanted": Wanted(options.max_miss, options.min_fit),
    }
    if len(options.targets) <= 1 and not options.variations:
        return {"jobs": jobs_of(options, settings), **how}

    # Galleries, which one look has no need of.
    from lightpaint.batch.manifest.variations import parse_variations
    from lightpaint.cli.solve_variations import several_of

    failed: dict[str, str] = {}
    jobs, several = several_of(
        jobs_of(options, settings, failed),
        parse_variations(options.variations),
        failed,
        output=Path(options.output) if options.output else None,
        keep_going=options.keep_going,
        force=options.force,
    )
    return {"jobs": jobs, "several": several, **how}


def _scene_to_export(options: Namespace) -> SceneFile | None:
    """The scene that a lighting is exported for, if one was given; its lights are all told of."""
    if options.scene is None:
        return None
    parameters = dict(options.parameters)
    how: dict[str, Any] = {"sensor": options.sensor, "variant": options.variant}
    return SceneFile(options.scene, parameters=parameters, use_lights_file=False, **how)


def _to_do(options: Namespace) -> dict[str, Any]:
    """What `batch` is asked for."""
    return {
        "paths": options.paths,
        "output": Path(options.output) if options.output else None,
        "is_first": options.init,
        "is_dry": options.dry_run,
        "only": options.only,
        "form": options.export,
        "how": _how(options),
        "force": options.force,
        "log": Path(options.log) if options.log else None,
    }


def _how(options: Namespace) -> "RunOptions":
    """How a batch is done. Raises BatchError for what does not go together."""
    from lightpaint.batch.run_options import RunOptions

    if options.cluster is None and (options.shared_fs or options.task_limit_s is not None):
        idle = "--shared-fs" if options.shared_fs else "--task-limit"
        raise BatchError(f"{idle} is about workers of a cluster: give --cluster ADDRESS, too")
    if options.cluster is not None and options.workers > 1:
        raise BatchError(
            f"--cluster {options.cluster} and --workers {options.workers}: give one of them"
        )
    return RunOptions(
        options.workers,
        options.keep_going,
        options.retry,
        options.apart,
        options.cluster,
        options.shared_fs,
        options.task_limit_s,
    )


def _to_paint(options: Namespace, settings: Settings, given: Sequence[str]) -> dict[str, Any]:
    """What `paint` is asked for."""
    sources, asked = painted_of(options), constraints_of(options)
    source = sources[0]
    if options.lights_file and not isinstance(source, SceneFile):
        asked = read_constraints(options.lights_file).and_then(asked)
    named = f"{scene_name(Path(source.path))}.paint"
    [folder] = folders_of(options.output and Path(options.output), [named])
    # Those that `solve` has too, for the command that answers what was exported.
    dropped = ["output", "new", "host", "port", "with_browser", "view", "exposure"]
    dropped += ["as_json", "is_quiet", "is_verbose"]
    dropped += ["lights"] * isinstance(source, GroupsFile) + ["sensors"] * (len(sources) > 1)
    return {
        "sources": sources,
        "folder": folder,
        "settings": settings,
        "constraints": asked,
        "choice": transform_of(options),
        "options": options_but(options.parser, given[given.index("paint") + 1 :], *dropped),
        "new": options.new,
        "host": options.host,
        "port": options.port,
        "with_browser": options.with_browser,
    }


def painted_of(options: Namespace) -> list[SceneFile | BasisFile | GroupsFile]:
    """What `paint` paints: a scene, by each sensor that is named; bases of several views; or light
    groups, also those that --lights names.
    """
    given = ",".join(options.lights or ())
    paths = options.sources
    if not paths and not given:
        raise BasisError("nothing to paint: give a scene, a basis, or light groups")
    options.sensor = options.sensors[0] if options.sensors else None
    if not paths:
        _check_light_groups(given)
        paths, options.lights = [given], None
    elif given and _is_file_to_be(given, Path(paths[0])):
        raise BasisError(f"{paths[0]} and --lights {given} at once: give one to paint")
    made = []
    for options.source in paths:
        made.append(basis_of(options) or scene_of(options))
    if len(paths) > 1 and not all(isinstance(one, BasisFile) for one in made):
        raise BasisError(
            f"{len(paths)} things to paint: several are bases of the views of one scene; views of "
            "a scene are named with --sensor, once for each"
        )
    if len(options.sensors) > 1:
        return [scene_of(options, sensor=sensor) for sensor in options.sensors]
    return made


def basis_of(options: Namespace) -> BasisFile | GroupsFile | None:
    """The basis or the light groups that `solve` starts from; None where it is a scene.

    Where `--lights` names the light groups, the source is put in front of the targets, since it
    is one. Raises BasisError for options that a basis without its scene has no use of.
    """
    source, names = Path(options.source), options.lights
    given = ",".join(names or ())
    basis: BasisFile | GroupsFile
    if given and _is_file_to_be(given, source):
        _check_light_groups(given)
        options.targets = [options.source, *options.targets]
        basis, names = _groups_file(given, options), None
    elif source.suffix.lower() != ".xml" and is_light_groups(source):
        basis = _groups_file(options.source, options)
    elif options.pattern:
        raise BasisError(
            f"--pattern names the layers of light groups, and {source} has none: leave it out, or "
            "give the EXR"
        )
    elif is_basis_file(source):
        basis = BasisFile(options.source)
    else:
        return None
    if options.views:
        raise BasisError(
            f"--target cannot be used with {basis.path}, which has one view only: give the scene, "
            "to solve for several"
        )
    is_groups = isinstance(basis, GroupsFile)
    idle = [name for name in LOADING if getattr(options, name) and name != "lights"]
    check_needed([*idle, *(["lights"] if names and not is_groups else [])], basis)
    if names:
        raise BasisError(
            f"--lights {given} chooses lights of a scene: of light groups, keep the "
            "others as they are with --lock NAME"
        )
    return basis


def _groups_file(path: str, options: Namespace) -> GroupsFile:
    """Light groups, in whose folder what this command paints with may lie."""
    pictures = (*options.targets, *(options.masks or ()))
    return GroupsFile(path, options.pattern, leave_out=pictures)


def _is_file_to_be(given: str, source: Path) -> bool:
    """Whether `--lights` means a file or folder, and not lights of a scene or a basis."""
    if given.lower().endswith(".exr"):
        return True
    # A folder or file may well have the name of a light: results are kept in such.
    return source.suffix.lower() != ".xml" and Path(given).exists()


def _check_light_groups(given: str) -> None:
    """Raise BasisError for a `--lights` that names something else, ImageError for one damaged."""
    path = Path(given)
    if not path.exists():
        raise BasisError(f"no such file or folder of light groups: --lights {given}")
    if path.is_dir() and not is_light_groups(path):
        raise BasisError(f"--lights {given} is a folder without an .exr file")
    # What is no EXR at all is refused where it is read.
    if path.is_file() and is_exr(path) and is_own_basis(path):
        raise BasisError(
            f"--lights {given} holds no light groups: give an EXR of another renderer's, or a "
            "folder of them; a basis of lightpaint's own stands where the scene does"
        )


def transform_of(options: Namespace) -> TransformChoice:
    """What --view and --exposure ask for, each alone or both."""
    return TransformChoice(options.view, options.exposure)


def constraints_of(options: Namespace) -> Constraints:
    """What the options ask of the lights."""
    lights: dict[str, dict[str, Any]] = {}
    for key in (key for key in LIGHT_KEYS if key != "off"):
        for name, value in getattr(options, key):
            lights.setdefault(name, {})[key] = value
    for name in options.off:
        lights.setdefault(name, {})["off"] = True
    return Constraints.of(
        lights,
        tie=options.tie,
        prefer_current=options.prefer_current,
        sparse=options.sparse,
        where=BY_OPTION,
    )


def folders_of(output: Path | None, names: Sequence[str]) -> list[Path]:
    """One result folder per name: DIR itself for a single one, DIR/<name> for several."""
    if output is not None and len(names) == 1:
        return [output]
    for name in names:
        # Names that are not UTF-8 are told by whoever reads the file that is called so.
        if not is_name(name) and is_utf_8(Path(name)):
            how = "choose one with -o" if len(names) == 1 else "take it alone, with -o"
            raise OutputError(f"{one_line(repr(name))} is no name for a folder: {how}")
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise OutputError(
            f"results would overwrite each other in {some_names(twice)}: give those of one name "
            "a command each, with another -o"
        )
    return [(output or Path()) / name for name in names]


def _groups(given: Sequence[tuple[str, list[str]]]) -> dict[str, list[str]]:
    """Emitters by name of the group. Given twice, a group has both lists."""
    groups: dict[str, list[str]] = {}
    for name, members in given:
        groups[name] = groups.get(name, []) + members
    return groups


def _one_for_each(masks: list[str | None], targets: list[str]) -> list[str | None]:
    if len(masks) == 1:
        return masks * len(targets)
    if len(masks) != len(targets):
        raise TargetError(
            f"{len(masks)} masks for {len(targets)} targets: give one for all, or one for each"
        )
    return masks
