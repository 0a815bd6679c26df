"""What each sub-command does: calls of the corridor, and tables of what came out."""

import json
from argparse import Namespace
from pathlib import Path
from typing import Any

from rich.markup import escape

from lightpaint.basis import cache as bases
from lightpaint.basis.file import write_basis
from lightpaint.cli import tables, terminal
from lightpaint.cli.doctor import examine
from lightpaint.cli.options import folders_of, load, render_or_find, view_of
from lightpaint.cli.solve import solve
from lightpaint.errors import OutputError
from lightpaint.files import check_writable
from lightpaint.lighting.lighting import read_lighting
from lightpaint.pipeline import relight_look, render_look, render_template
from lightpaint.relit.relight import scene_of
from lightpaint.results import result_folders, verify_result
from lightpaint.scene.quality import on_film
from lightpaint.scene.variant import use_variant
from lightpaint.target.template import LIGHT, LIGHTS, MATTES, SHOWN, earlier_files

__all__ = ["basis", "cache", "doctor", "lights", "relight", "solve", "template", "verify"]


def lights(options: Namespace, _given: list[str]) -> int:
    """`lightpaint lights SCENE`"""
    scene = load(options)
    if options.json:
        listed = [tables.described(light, options.cd_per_unit) for light in scene.lights]
        scale = {} if options.cd_per_unit is None else {"cd_per_unit": options.cd_per_unit}
        data = {"scene": str(scene.path), **scale, "lights": listed}
        terminal.write(json.dumps(data, indent=2))
        return 0
    tables.show_lights(scene, options.cd_per_unit)
    return 0


def basis(options: Namespace, _given: list[str]) -> int:
    """`lightpaint basis SCENE -o F.basis.exr`"""
    output = Path(options.output or Path(options.scene).stem + ".basis.exr")
    _check_suffix(output)
    check_writable(output.parent)
    scene = on_film(load(options), options.quality, options.resolution)
    made = render_or_find(scene, options)
    write_basis(output, made)
    kept = " and what is kept" if made.is_fixed.any() else ""
    count = int((~made.is_fixed).sum())
    terminal.write(f"{output}: {count} lights{kept}, {made.origin.spp} samples per pixel")
    return 0


def template(options: Namespace, _given: list[str]) -> int:
    """`lightpaint template SCENE -o DIR`"""
    output = Path(options.output or "template")
    only_look = output.suffix.lower() == ".exr"
    painted_on = [output, output.with_suffix(".png")] if only_look else earlier_files(output)
    for file in painted_on:
        if file.exists() and not options.force:
            raise OutputError(
                f"{file} exists and may have been painted on: choose another name with -o, or "
                "pass --force"
            )
    if not only_look and output.suffix.lower() in (".png", ".tif", ".tiff", ".jpg", ".jpeg"):
        raise OutputError(
            f"{output} is no folder: name one with -o, or a file that ends in .exr (a PNG comes "
            "along)"
        )
    if not only_look and output.is_file():
        raise OutputError(f"{output} is a file: name a folder with -o, or a file that ends in .exr")
    check_writable(output.parent if only_look else output)
    asked = view_of(options)
    view = None if asked.is_open else asked.over(None)
    scene = load(options, is_to_solve=False, with_lights_file=not only_look)
    if options.resolution:
        scene = scene.reduced(options.resolution)
    how: dict[str, Any] = {"view": view, "spp": options.spp, "seed": options.seed}
    with terminal.progress() as progress:
        if only_look:
            picture = render_look(scene, output, progress=progress, **how)
        else:
            render_template(scene, output, progress=progress, **how)
            picture = output / SHOWN
    linear = output if only_look else output / LIGHT
    terminal.write(f"{linear}: paint over it in linear light, in a program that knows EXR")
    terminal.write(
        f"{picture}: the same in 16 bits, for any program: paint over it and save as PNG"
    )
    if not only_look:
        terminal.write(f"{output}/{MATTES}, {output}/{LIGHTS}: what to select, and what lights do")
    return 0


def relight(options: Namespace, _given: list[str]) -> int:
    """`lightpaint relight SCENE lighting.json...`"""
    answers = [read_lighting(path) for path in options.lightings]
    names = [a.target or Path(p).stem for a, p in zip(answers, options.lightings, strict=True)]
    folders = folders_of(options.output, names)
    scene = load(options, is_to_solve=False)
    for folder in folders:
        check_writable(folder)
    for lighting, folder in zip(answers, folders, strict=True):
        if lighting.scene_identity not in ("", scene_of(scene, lighting).identity):
            terminal.say(f"{folder}: the lighting was solved for another state of the scene")
        with terminal.progress() as progress:
            relight_look(
                scene, lighting, folder, spp=options.spp, seed=options.seed, progress=progress
            )
        terminal.write(f"{folder}: relit.xml, relit.exr, relit.png")
    return 0


def verify(options: Namespace, _given: list[str]) -> int:
    """`lightpaint verify DIR...`"""
    use_variant(options.variant)
    agree = True
    folders = [view for folder in options.folders for view in result_folders(Path(folder))]
    for folder in folders:
        with terminal.progress() as progress:
            result = verify_result(folder, spp=options.spp, seed=options.seed, progress=progress)
        terminal.write(f"{folder}: {tables.spoken_agreement(result)}")
        agree &= result.agrees
    return 0 if agree else 1


def cache(options: Namespace, _given: list[str]) -> int:
    """`lightpaint cache [clear]`"""
    if options.action == "clear":
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


def doctor(options: Namespace, _given: list[str]) -> int:
    """`lightpaint doctor`"""
    findings = examine(options.variant)
    for finding in findings:
        mark = {"ok": "ok", "missing": "MISSING", "info": ""}[finding.state]
        terminal.write(f"{finding.what:18s} {mark:8s} {finding.found}")
    missing = [finding for finding in findings if finding.state == "missing"]
    for finding in missing:
        if finding.remedy:
            terminal.write(f"to mend {finding.what}: {finding.remedy}")
    terminal.write("something is missing" if missing else "everything needed is here")
    return 2 if missing else 0


def _check_suffix(path: Path) -> None:
    if path.suffix.lower() != ".exr":
        raise OutputError(f"{path} must end in .exr, the format that is written")
