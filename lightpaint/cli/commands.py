"""What each sub-command does: calls of the corridor, and tables of what came out."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.markup import escape

from lightpaint.basis import cache as bases
from lightpaint.basis.file import write_basis
from lightpaint.cli import tables, terminal
from lightpaint.cli.doctor import examine
from lightpaint.cli.options import folders_of, is_folder
from lightpaint.colour.transform import ViewTransform
from lightpaint.errors import OutputError
from lightpaint.files import check_files, check_name, check_writable
from lightpaint.job import Job
from lightpaint.lighting.file import read_lighting
from lightpaint.pipeline import obtain, run
from lightpaint.relit.export.exports import EXPORTS
from lightpaint.relit.relight import scene_of
from lightpaint.remarks import remarks_of_memory, remarks_of_scene
from lightpaint.renders import relight_look, relit_folder, render_look, render_template
from lightpaint.results import result_folders, verify_result
from lightpaint.scene.quality import on_film
from lightpaint.scene.scene import Scene
from lightpaint.scene.variant import use_variant
from lightpaint.settings import Settings
from lightpaint.sources import SceneFile
from lightpaint.staging import finish
from lightpaint.target.template import LIGHT, LIGHTS, MATTES, SHOWN, files_in_the_way


def lights(*, scene: SceneFile, as_json: bool, cd_per_unit: float | None) -> int:
    """`lightpaint lights SCENE`"""
    loaded = scene.content
    for remark in remarks_of_scene(loaded):
        terminal.say(remark)
    if as_json:
        listed = [tables.described(light, cd_per_unit) for light in loaded.lights]
        scale = {} if cd_per_unit is None else {"cd_per_unit": cd_per_unit}
        data = {"scene": str(loaded.path), **scale, "lights": listed}
        terminal.write(json.dumps(data, indent=2))
        return 0
    tables.show_lights(loaded, cd_per_unit)
    return 0


def basis(*, scene: SceneFile, output: Path, settings: Settings) -> int:
    """`lightpaint basis SCENE -o F.basis.exr`"""
    if output.suffix.lower() != ".exr":
        raise OutputError(f"{output} must end in .exr, the format that is written")
    check_writable(output.parent)
    loaded = on_film(scene.content, settings.quality, settings.resolution)
    check_files([output], loaded.read_files)
    with terminal.Listener() as listen:
        for remark in (*remarks_of_scene(loaded), *remarks_of_memory(loaded)):
            listen.say(remark)
        made = obtain(loaded, settings, listen)
    write_basis(output, made)
    kept = " and what is kept" if made.is_fixed.any() else ""
    count = int((~made.is_fixed).sum())
    terminal.write(f"{output}: {count} lights{kept}, {made.origin.spp} samples per pixel")
    return 0


def template(
    *,
    scene: SceneFile,
    output: Path,
    transform: ViewTransform | None,
    settings: Settings,
    force: bool,
) -> int:
    """`lightpaint template SCENE -o DIR`"""
    _check_template(output, force=force)
    loaded = _loaded(scene)
    replaced = (
        files_in_the_way(output) if is_folder(output) else [output, output.with_suffix(".png")]
    )
    check_files(replaced, loaded.read_files)
    if settings.resolution:
        loaded = loaded.reduced(settings.resolution)
    how: dict[str, Any] = {"transform": transform, "spp": settings.spp, "seed": settings.seed}
    linear, picture = output / LIGHT, output / SHOWN
    with terminal.Listener() as listen:
        if is_folder(output):
            render_template(loaded, output, progress=listen, **how)
        else:
            linear, picture = output, render_look(loaded, output, progress=listen, **how)
    terminal.write(f"{linear}: paint over it in linear light, in a program that knows EXR")
    terminal.write(
        f"{picture}: the same in 16 bits, for any program: paint over it and save as PNG"
    )
    if is_folder(output):
        terminal.write(f"{output}/{MATTES}, {output}/{LIGHTS}: what to select, and what lights do")
    return 0


def solve(*, jobs: Sequence[Job]) -> int:
    """`lightpaint solve SCENE|BASIS TARGET...` or `SCENE --target SENSOR=TARGET...`"""
    listen, obtained = terminal.Listener(), None
    # Those of all before the first is run, which says its own again: once is enough.
    for remark in (remark for job in jobs for remark in job.remarks):
        listen.say(remark)
    for job in jobs:
        with listen:
            looks = run(job, listen, bases=obtained)
        # Several paintings of one scene share its basis.
        obtained = [look.basis for look in looks]
        for view, look in zip(job.views, looks, strict=True):
            if job.by_sensor:
                terminal.write(f"\n{look.basis.origin.sensor}:")
            tables.show_look(look, view.folder)
            if look.suggestions is not None:
                tables.show_suggestions(look.suggestions, cd_per_unit=job.settings.cd_per_unit)
        if job.groups is not None:
            there = ", ".join(name for name in EXPORTS if (job.folder / name).is_file())
            terminal.write(f"for other programs: {there}")
    if not jobs[0].scenes and jobs[0].groups is None:
        terminal.say("solved from a saved basis: no render was made; lightpaint relight makes one")
    return 0


def relight(
    *, scene: SceneFile, lightings: Sequence[Path], output: Path | None, settings: Settings
) -> int:
    """`lightpaint relight SCENE lighting.json...`"""
    for path in lightings:
        finish(path.parent)
    answers = [read_lighting(path) for path in lightings]
    names = [a.target or path.stem for a, path in zip(answers, lightings, strict=True)]
    folders = folders_of(output, names)
    loaded = _loaded(scene)
    results = [
        relit_folder(loaded, path, folder, force=settings.force)
        for path, folder in zip(lightings, folders, strict=True)
    ]
    for place in results:
        place.check()
    for lighting, place in zip(answers, results, strict=True):
        folder = place.folder
        if lighting.scene_identity not in ("", scene_of(loaded, lighting).identity):
            terminal.say(f"{folder}: the lighting was solved for another state of the scene")
        with terminal.Listener() as listen:
            how: dict[str, Any] = {"spp": settings.spp, "seed": settings.seed}
            relight_look(loaded, lighting, place, progress=listen, **how)
        terminal.write(f"{folder}: relit.xml, relit.exr, relit.png")
    return 0


def verify(*, folders: Sequence[Path], variant: str | None, settings: Settings) -> int:
    """`lightpaint verify DIR...`"""
    use_variant(variant)
    agree = True
    for folder in (view for given in folders for view in result_folders(given)):
        with terminal.Listener() as listen:
            how: dict[str, Any] = {"spp": settings.spp, "seed": settings.seed}
            result = verify_result(folder, progress=listen, **how)
        terminal.write(f"{folder}: {tables.spoken_agreement(result)}")
        agree &= result.agrees
    return 0 if agree else 1


def cache(*, action: str) -> int:
    """`lightpaint cache [clear]`"""
    if action == "clear":
        terminal.write(f"{bases.clear()} deleted from {bases.folder()}")
        return 0
    table = terminal.table("scene", "sensor", "pixels", "lights", "spp", "seed", "MB", "file")
    for entry in reversed(bases.entries()):
        known, about = entry.origin, ["?"] * 6
        if known is not None and entry.image_size is not None:
            height, width = entry.image_size
            about = [known.scene, known.sensor, f"{width}x{height}", str(entry.lights)]
            about += [str(known.spp), str(known.seed)]
        table.add_row(*map(escape, about), f"{entry.size / 1e6:.0f}", escape(entry.path.name))
    terminal.print_table(table)
    terminal.write(f"kept in {bases.folder()}")
    return 0


def doctor(*, variant: str | None) -> int:
    """`lightpaint doctor`"""
    findings = examine(variant)
    for finding in findings:
        mark = {"ok": "ok", "missing": "MISSING", "info": ""}[finding.state]
        terminal.write(f"{finding.what:18s} {mark:8s} {finding.found}")
    missing = [finding for finding in findings if finding.state == "missing"]
    for finding in missing:
        if finding.remedy:
            terminal.write(f"to mend {finding.what}: {finding.remedy}")
    terminal.write("something is missing" if missing else "everything needed is here")
    return 2 if missing else 0


def _check_template(output: Path, *, force: bool) -> None:
    """Raise OutputError for a place that a template cannot or should not go to."""
    is_tree = is_folder(output)
    check_name(output)
    check_files(_replaced(output), ())
    for file in _replaced(output):
        if file.exists() and not force:
            raise OutputError(
                f"{file} exists and may have been painted on: choose another name with -o, or "
                "pass --force"
            )
    if output.suffix.lower() in (".png", ".tif", ".tiff", ".jpg", ".jpeg"):
        raise OutputError(
            f"{output} is no folder: name one with -o, or a file that ends in .exr (a PNG comes "
            "along)"
        )
    if is_tree and output.is_file():
        raise OutputError(f"{output} is a file: name a folder with -o, or a file that ends in .exr")
    check_writable(output if is_tree else output.parent)


def _replaced(output: Path) -> list[Path]:
    """What a template at `output` may take the place of."""
    if not is_folder(output):
        return [output, output.with_suffix(".png")]
    finish(output)
    return files_in_the_way(output)


def _loaded(scene: SceneFile) -> Scene:
    """The scene, of whose lights only the sum counts."""
    loaded = scene.content
    if note := use_variant().note:
        terminal.say(note)
    return loaded
