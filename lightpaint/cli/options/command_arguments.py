"""Conversion of options to the arguments of the command's function."""

from argparse import Namespace
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from lightpaint.cli.options import job_options, source_options
from lightpaint.cli.options.argument_order import options_but
from lightpaint.cli.options.console_options import console_of, rig_file, sending_of
from lightpaint.cli.output.documents import Tolerances
from lightpaint.errors import BatchError
from lightpaint.files import scene_name
from lightpaint.lighting import read_constraints
from lightpaint.pipeline import GroupsFile, SceneFile, Settings


def values_of(options: Namespace, words: Sequence[str]) -> dict[str, Any]:
    """Return the keyword arguments of a command's function. words: the options as typed."""
    values, settings = vars(options), job_options.settings_of(options, words)
    output = Path(values["output"]) if values.get("output") else None
    match options.command:
        case "lights":
            return _lights_arguments(options, output)
        case "basis":
            output = output or Path(Path(options.scene).stem + ".basis.exr")
            return {
                "scene": source_options.scene_of(options),
                "output": output,
                "settings": settings,
            }
        case "measure":
            return _measure_arguments(options, output or Path("measured"), settings)
        case "template":
            return _template_arguments(options, output or Path("template"), settings)
        case "demo":
            output = output or Path("lightpaint-demo")
            return {"folder": output, "variant": options.variant, "settings": settings}
        case "solve":
            return _solve_arguments(options, settings)
        case "batch":
            return _batch_arguments(options)
        case "export":
            return _export_arguments(options, output)
        case "send":
            return {
                "lighting": Path(options.lighting),
                "rig": rig_file(options),
                "sending": sending_of(options),
                "dump": options.dump,
                "force": options.force,
            }
        case "listen":
            return {
                "rig": rig_file(options),
                "protocol": options.protocol,
                "universes": dict(options.universes),
                "address": options.interface,
                "port": options.port,
                "seconds": options.seconds,
            }
        case "plan":
            return {
                "scene": source_options.scene_of(options),
                "planes": Path(options.planes) if options.planes else None,
                "output": output,
                "constraints": job_options.constraints_of(options),
                "settings": replace(settings, planes=None),
            }
        case "paint":
            return _paint_arguments(options, settings, words)
        case "relight":
            scene = source_options.scene_of(options, is_to_solve=False)
            paths = list(map(Path, options.lightings))
            return {"scene": scene, "lightings": paths, "output": output, "settings": settings}
        case "verify":
            folders = list(map(Path, options.folders))
            return {"folders": folders, "variant": options.variant, "settings": settings}
        case "rig":
            return _rig_arguments(options, output)
        case "blender":
            return {"output": output or Path("lightpaint-blender.zip"), "force": options.force}
        case "cache":
            return {"action": options.action, "names": options.names}
        case _:
            return {"variant": options.variant}


def _lights_arguments(options: Namespace, output: Path | None) -> dict[str, Any]:
    """Return the arguments of `lights`."""
    is_drawn = output is not None or not (options.no_sheet or options.as_json)
    return {
        "scene": source_options.scene_of(options),
        "cd_per_unit": options.cd_per_unit,
        "sheet": (output or Path("lights.png")) if is_drawn else None,
        "is_named": output is not None,
        "force": options.force,
    }


def _measure_arguments(options: Namespace, output: Path, settings: Settings) -> dict[str, Any]:
    """Return the arguments of `measure`. A lighting says how its lights are grouped."""
    scene = source_options.scene_of(options)
    if options.lighting:
        scene = source_options.scene_of(options, is_to_solve=False)
    return {
        "scene": scene,
        "planes": Path(options.planes) if options.planes else None,
        "lighting": Path(options.lighting) if options.lighting else None,
        "output": output,
        "settings": settings,
    }


def _template_arguments(options: Namespace, output: Path, settings: Settings) -> dict[str, Any]:
    """Return the arguments of `template`."""
    transform = job_options.transform_of(options)
    return {
        "source": source_options.source_of_template(options),
        "output": output,
        "transform": None if transform.is_open else transform.over(None),
        "settings": settings,
        "force": options.force,
    }


def _export_arguments(options: Namespace, output: Path | None) -> dict[str, Any]:
    """Return the arguments of `export`."""
    return {
        "lightings": list(map(Path, options.lightings)),
        "forms": options.to,
        "rig": rig_file(options),
        "fade_s": options.fade_s,
        "positions": options.positions,
        "scene": source_options.scene_to_export(options),
        "groups": GroupsFile(options.groups, options.pattern) if options.groups else None,
        "stage": Path(options.stage) if options.stage else None,
        "output": output,
        "force": options.force,
    }


def _rig_arguments(options: Namespace, output: Path | None) -> dict[str, Any]:
    """Return the arguments of `rig`."""
    show = Path(options.show)
    return {
        "show": show,
        "output": output or Path(f"{show.stem}.xml"),
        "room": Path(options.room) if options.room else None,
        "only_lights": options.only_lights,
        "usual_colors": options.usual_colors,
        "open_wheels": options.open_wheels,
        "force": options.force,
        **rig_reading_of(options),
    }


def rig_reading_of(options: Namespace) -> dict[str, Any]:
    """Return the arguments of `read_rig` but for its path."""
    folder = Path(options.gdtf) if options.gdtf else None
    return {"gdtf_folder": folder, "zoom": options.zoom, "pixels": options.pixels}


def _solve_arguments(options: Namespace, settings: Settings) -> dict[str, Any]:
    """Return the arguments of `solve`, with a gallery if there are several looks."""
    arguments: dict[str, Any] = {
        "table": options.table,
        "tolerances": Tolerances(options.max_miss, options.min_fit),
    }
    if options.frames is not None:
        arguments["frames"] = options.frames
    if source_options.is_of_frames(options) or (
        len(options.targets) <= 1 and not options.variations
    ):
        return {"jobs": job_options.jobs_of(options, settings), **arguments}

    # Imported late: a single look needs no gallery.
    from lightpaint.batch import parse_variations
    from lightpaint.cli.solve_variations import look_set

    failures: dict[str, str] = {}
    jobs, set_of_looks = look_set(
        job_options.jobs_of(options, settings, failures),
        parse_variations(options.variations),
        failures,
        output=Path(options.output) if options.output else None,
        keep_going=options.keep_going,
        force=options.force,
    )
    return {"jobs": jobs, "look_set": set_of_looks, **arguments}


def _batch_arguments(options: Namespace) -> dict[str, Any]:
    """Return the arguments of `batch`."""
    from lightpaint.batch import RunOptions

    if options.cluster is None and options.shared_fs:
        raise BatchError("--shared-fs concerns workers of a cluster: give --cluster ADDRESS, too")
    if options.cluster is not None and options.workers > 1:
        raise BatchError(
            f"--cluster {options.cluster} and --workers {options.workers}: give one of them"
        )
    return {
        "paths": options.paths,
        "output": Path(options.output) if options.output else None,
        "is_first": options.init,
        "is_dry": options.dry_run,
        "name_patterns": options.only,
        "form": options.export,
        "run_options": RunOptions(**{x.name: getattr(options, x.name) for x in fields(RunOptions)}),
        "force": options.force,
        "log": Path(options.log) if options.log else None,
    }


def _paint_arguments(
    options: Namespace, settings: Settings, words: Sequence[str]
) -> dict[str, Any]:
    """Return the arguments of `paint`."""
    sources, constraints = source_options.painted_of(options), job_options.constraints_of(options)
    source = sources[0]
    if options.lights_file and not isinstance(source, SceneFile):
        constraints = read_constraints(options.lights_file).and_then(constraints)
    session_name = f"{scene_name(Path(source.path))}.paint"
    [folder] = job_options.folders_of(options.output and Path(options.output), [session_name])
    # The command that the page shows for exported paintings has only options that `solve` knows.
    excluded = ["output", "new", "layers", "host", "port", "with_browser", "view", "exposure"]
    excluded += ["rig", "gdtf", "pixels", "target", "universes", "priority", "positions"]
    excluded += ["as_json", "is_quiet", "is_verbose", "json_progress"]
    excluded += ["lights"] * isinstance(source, GroupsFile) + ["sensors"] * (len(sources) > 1)
    return {
        "sources": sources,
        "folder": folder,
        "settings": settings,
        "constraints": constraints,
        "choice": job_options.transform_of(options),
        "options": options_but(options.parser, words[words.index("paint") + 1 :], *excluded),
        "layers": None if options.layers is None else Path(options.layers),
        "new": options.new,
        "host": options.host,
        "port": options.port,
        "with_browser": options.with_browser,
        "console": _console_arguments(options),
    }


def _console_arguments(options: Namespace) -> dict[str, Any] | None:
    """Return the arguments of the painter's console; None without a rig."""
    named = console_of(options)
    if named is None:
        return None
    rig, target = named
    universes = dict(options.universes)
    return {
        "rig": rig,
        "target": target,
        "universes": universes,
        "priority": options.priority,
        "positions": options.positions,
    }
