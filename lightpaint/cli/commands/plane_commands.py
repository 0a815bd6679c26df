"""`lightpaint measure` and `lightpaint plan`: the illuminance on the planes of a scene, and the
least power that meets the wishes for it.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint import photometry, pipeline
from lightpaint.arrays import RGB, Doubles
from lightpaint.basis import BasisLight
from lightpaint.basis.render import basis_lights
from lightpaint.cli.commands.answer_text import show_glare, show_planes
from lightpaint.cli.output import documents, terminal
from lightpaint.cli.output.lines import CommandOutcome
from lightpaint.errors import OutputError, SceneError
from lightpaint.files import check_files, check_writable, write_text
from lightpaint.lighting import Constraints, Scale, constraints_of, read_lighting
from lightpaint.photometry.measure import measure_glare, measure_illuminance
from lightpaint.photometry.planes_file import planes_file_beside, read_planes
from lightpaint.progress import stage
from lightpaint.relit import scene_of
from lightpaint.report import glare_sentences, planes_numbers, spoken_drives
from lightpaint.scene import Scene
from lightpaint.sentences import Hint
from lightpaint.storage.staging import finish, staged
from lightpaint.version import __version__


def measure(
    *,
    scene: pipeline.SceneFile,
    planes: Path | None,
    lighting: Path | None,
    output: Path,
    settings: pipeline.Settings,
) -> CommandOutcome:
    """Run `lightpaint measure SCENE`."""
    content, emission, unit, unscaled = _lit_scene(scene, lighting, settings)
    planes_path = planes or planes_file_beside(content.path)
    if planes is None and not planes_path.is_file():
        raise SceneError(
            f"{planes_path} does not exist: write where to measure into it (docs/photometry.md), "
            "or name another file with --planes"
        )
    with terminal.TerminalListener() as listen, stage("placing the points", listen):
        found = read_planes(planes_path, content)
    for remark in (*_luminaire_remarks(content), *found.remarks(content)):
        terminal.say(remark)
    weights = _weights(content, emission)
    inputs = [*content.read_files, planes_path, *([] if lighting is None else [lighting])]
    files = [output / name for name in photometry.readings_files(x.name for x in found.planes)]
    _check(output, files, inputs, force=settings.force)
    if (earlier := photometry.measured_origin(output)) is not None:
        terminal.say(f"{output} had a measurement, {earlier}: it is replaced (-o names another)")
    with terminal.TerminalListener() as listen:
        options: dict[str, Any] = {
            "error": settings.error or found.error,
            "cd_per_unit": unit,
            "weights": weights,
            "seed": settings.seed,
            "use_cache": settings.use_cache,
            "progress": listen,
        }
        measured = measure_illuminance(content, found.planes, spp=settings.spp, **options)
        pipeline.check_reached(measured, unscaled, weights)
        rates_glare = found.observers and not unscaled
        glare = measure_glare(content, found.observers, **options) if rates_glare else None
    if unscaled:
        terminal.say(pipeline.no_glare_remark(unscaled))
    origin = content.path.name + ("" if lighting is None else f" lit by {lighting.name}")
    with staged(output) as folder:
        photometry.write_readings(folder, measured, weights, origin, glare=glare)
    _print(measured, weights)
    if glare is not None:
        show_glare(readings := glare.readings(weights))
        for sentence in glare_sentences(readings):
            terminal.tell(sentence)
    terminal.write(f"{output / photometry.POINTS}: all points; a picture of each plane beside it")
    written = {"scene": str(content.path), "files": [*map(str, files)]}
    return CommandOutcome(
        lambda: photometry.readings_document(measured, weights, glare=glare) | written
    )


def _luminaire_remarks(scene: Scene) -> list[str]:
    """Return what the luminaires of a scene are taken for, each remark once."""
    return list(dict.fromkeys(text for x in scene.luminaires for text in x.remarks()))


def _lit_scene(
    source: pipeline.SceneFile, lighting: Path | None, settings: pipeline.Settings
) -> tuple[Scene, Mapping[str, RGB] | None, float, tuple[BasisLight, ...]]:
    """Return the scene, the emissions of a lighting, cd/m² of a radiance of 1, and the lights of
    which that is a guess.

    Raises SceneError if nothing says cd/m².
    """
    scene, emission = source.content, None
    own = Scale.of(constraints_of(scene.requests), basis_lights(scene)).cd_per_unit
    unscaled = pipeline.constraints_and_scale(scene, Constraints(), settings)[1].unscaled
    if lighting is not None:
        finish(lighting.parent)
        answer = read_lighting(lighting)
        scene, emission = scene_of(scene, answer), answer.emission
        own = answer.cd_per_unit or own
        unscaled = () if answer.cd_per_unit else unscaled
    given = settings.cd_per_unit
    if given is None and own is None:
        raise SceneError(
            "a radiance of 1 is how many cd/m²? Lux need that number: add ",
            Hint("cd_per_unit"),
            ", or cd_per_unit to the lights file",
        )
    if given is not None and own is not None and given != own:
        file = "lights file" if lighting is None else "lighting"
        raise SceneError(
            f"cd_per_unit is {own:g} in the {file} and {given:g} by ",
            Hint("cd_per_unit"),
            ": leave one out",
        )
    return scene, emission, float(given or own or 0), unscaled


def _weights(scene: Scene, emission: Mapping[str, RGB] | None) -> Doubles:
    """Return the weights of the lights, (n, 3): the weights of a lighting, or the current ones."""
    lights = basis_lights(scene)
    if emission is None:
        return lights.current_weights
    return np.array([emission[name] for name in lights.names], np.float64)


def _check(folder: Path, files: Sequence[Path], inputs: Sequence[Path], *, force: bool) -> None:
    """Raise OutputError if the files of a measurement cannot or should not be written."""
    if folder.is_file():
        raise OutputError(f"{folder} is a file: name a folder with -o")
    check_files(files, inputs)
    check_writable(folder)
    finish(folder)
    existing_files = [file for file in files if file.exists()]
    if existing_files and not force and photometry.measured_origin(folder) is None:
        raise OutputError(
            f"{existing_files[0]} exists and is of no measurement: name another folder with -o, "
            "or pass ",
            Hint("force", True),
        )


def _print(measured: photometry.Illuminance, weights: Doubles) -> None:
    """Print a row for each plane, the wishes that are missed, and where presets are from."""
    table = terminal.table("plane", "points", "Em lx", "±", "U0", "±", "least lx", "most lx")
    for name, reading in measured.readings(weights).items():
        table.row(
            name,
            str(reading.points),
            f"{reading.mean:.4g}",
            f"{reading.mean_interval:.2g}",
            f"{reading.uniformity:.2f}",
            f"{reading.uniformity_interval:.2g}",
            f"{reading.least:.4g}",
            f"{reading.most:.4g}",
        )
    terminal.print_table(table)
    for text in photometry.missed_wishes(measured, weights):
        terminal.write(text)
    for name in sorted({plane.wishes.preset for plane in measured.planes} - {""}):
        terminal.say(f"{name}: {photometry.PRESETS[name]}")


def plan(
    *,
    scene: pipeline.SceneFile,
    planes: Path | None,
    output: Path | None,
    constraints: Constraints,
    settings: pipeline.Settings,
) -> CommandOutcome:
    """Run `lightpaint plan SCENE`."""
    content = scene.content
    path = planes or planes_file_beside(content.path)
    if planes is None and not path.is_file():
        raise SceneError(
            f"{content.path} has no {path.name} beside it: write one, with the planes and what is "
            "wished for there, or name one with --planes"
        )
    folder = output or Path(f"{content.path.stem}-plan")
    results = pipeline.plan_folder(content, path, folder, force=settings.force)
    results.check()
    for remark in _luminaire_remarks(content):
        terminal.say(remark)
    with terminal.TerminalListener() as listen:
        found = pipeline.plan_lighting(
            content, path, constraints=constraints, settings=settings, progress=listen
        )
    with pipeline.new_answer(results, found.lighting, scene=content) as answer:
        text = json.dumps(_numbers(found), indent=2, ensure_ascii=False, allow_nan=False)
        write_text(answer.path / pipeline.PLAN, text + "\n")
        origin, illuminance = f"{content.path.name} as planned", found.planes.wished.illuminance
        lit, glare = found.planes.weights_by_case, found.planes.glare
        pipeline.write_planes(answer.path, illuminance, lit, origin, glare=glare)
    show_planes(found.planes)
    _show_lamps(found)
    terminal.write(f"results in {folder}/")
    files = [file for file in results.files if file.is_file()]
    is_met = not found.planes.missed
    return CommandOutcome(
        lambda: documents.files_document(folder, files) | _numbers(found), 0 if is_met else 1
    )


def _numbers(found: pipeline.LightPlan) -> dict[str, Any]:
    return {
        "format": "lightpaint-plan 1",
        "lightpaint": __version__,
        **planes_numbers(found.planes),
    }


def _show_lamps(found: pipeline.LightPlan) -> None:
    """Print the drives of all lamps."""
    table = terminal.table("lamp", "drive", "W")
    for light in found.lighting.lights:
        if light.lamp is not None:
            watts = light.lamp.watts_for(np.array(light.emission))
            table.row(
                light.name, spoken_drives(light.drives), "" if watts is None else f"{watts:.4g}"
            )
    terminal.print_table(table)
