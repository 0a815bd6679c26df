"""What each sub-command does: calls of the corridor, and tables of what came out."""

import json
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.markup import escape

from lightpaint import console, tables
from lightpaint.basis import cache as bases
from lightpaint.basis.basis import Basis, is_basis_file, read_basis, write_basis
from lightpaint.basis.render import basis_lights, memory_needed, why_not_one_pass
from lightpaint.doctor import examine
from lightpaint.errors import BasisError, OutputError, TargetError
from lightpaint.files import check_writable
from lightpaint.pipeline import (
    all_constraints,
    command_line,
    obtain_basis,
    paint_views_with_light,
    paint_with_light,
    relight_look,
    render_template,
    result_folders,
    verify_result,
)
from lightpaint.relight.relight import check_relightable, scene_of
from lightpaint.scene.quality import with_quality
from lightpaint.scene.scene import Scene, load_scene
from lightpaint.scene.variant import use_variant
from lightpaint.solve.constraints import Constraints
from lightpaint.solve.constraints_file import read_constraints
from lightpaint.solve.lighting import read_lighting
from lightpaint.solve.reduction import reduce_to
from lightpaint.target.target import Target, read_target


def lights(options: Namespace, _given: list[str]) -> int:
    """`lightpaint lights SCENE`"""
    scene = _load(options)
    if options.json:
        listed = [tables.described(light, options.cd_per_unit) for light in scene.lights]
        scale = {} if options.cd_per_unit is None else {"cd_per_unit": options.cd_per_unit}
        data = {"scene": str(scene.path), **scale, "lights": listed}
        console.write(json.dumps(data, indent=2))
        return 0
    tables.show_lights(scene, options.cd_per_unit)
    return 0


def basis(options: Namespace, _given: list[str]) -> int:
    """`lightpaint basis SCENE -o F.basis.exr`"""
    output = Path(options.output or Path(options.scene).stem + ".basis.exr")
    _check_suffix(output)
    check_writable(output.parent)
    scene, spp = _with_quality(_load(options), options)
    made = _basis(scene, spp, options)
    write_basis(output, made)
    kept = " and what is kept" if made.is_fixed.any() else ""
    count = int((~made.is_fixed).sum())
    console.write(f"{output}: {count} lights{kept}, {made.origin.spp} samples per pixel")
    return 0


def template(options: Namespace, _given: list[str]) -> int:
    """`lightpaint template SCENE -o F.exr`"""
    output = Path(options.output or "template.exr")
    _check_suffix(output)
    for file in (output, output.with_suffix(".png")):
        if file.exists() and not options.force:
            raise OutputError(
                f"{file} exists and may have been painted on: choose another name with -o, or "
                "pass --force"
            )
    check_writable(output.parent)
    scene = _load(options, is_to_solve=False)
    if options.resolution:
        scene = scene.reduced(options.resolution)
    with console.progress() as progress:
        picture = render_template(
            scene, output, spp=options.spp, seed=options.seed, progress=progress
        )
    console.write(f"{output}: paint over it in linear light, and save with alpha where it matters")
    console.write(f"{picture}: the same as a picture")
    return 0


def solve(options: Namespace, given: list[str]) -> int:
    """`lightpaint solve SCENE|BASIS TARGET...`"""
    if options.views:
        return _solve_views(options, given)
    if not options.targets:
        raise TargetError("no painting to solve for: give a TARGET, or --target SENSOR=TARGET")
    folders = _folders(options.output, [Path(t).stem for t in options.targets])
    # Everything a user gave is looked at before the first sample is taken.
    masks = _one_for_each(options.masks or [None], options.targets)
    targets = [read_target(t, mask=m) for t, m in zip(options.targets, masks, strict=True)]
    constraints = _constraints(options)
    source = Path(options.source)
    if is_basis_file(source):
        _check_nothing_to_render(options)
        scene, made, spp = None, read_basis(source), None
        size = made.size
        if options.lights_file:
            constraints = read_constraints(options.lights_file).and_then(constraints)
        reduce_to(constraints, made.lights)
    else:
        scene, spp = _with_quality(_load(options, path=source), options)
        made, size = None, scene.size
        reduce_to(all_constraints(scene, constraints), basis_lights(scene))
    targets = [_fitted(target, size, options) for target in targets]
    for folder in folders:
        check_writable(folder)
        if scene is not None:
            check_relightable(scene, folder / "relit.xml")

    for target, folder in zip(targets, folders, strict=True):
        _warn_of_pixels(target.not_finite, target.name)
        if made is None and scene is not None:
            made = _basis(scene, spp, options)
        with console.progress() as progress:
            look = paint_with_light(
                scene,
                target,
                folder,
                basis=made,
                constraints=constraints,
                unpainted=options.unpainted,
                cd_per_unit=options.cd_per_unit,
                noise_correction=options.noise_correction,
                refine=options.refine,
                spp=options.spp,
                time_s=options.time_s,
                quality=options.quality,
                seed=options.seed,
                command=command_line(given),
                progress=progress,
            )
        tables.show_look(look, folder)
    if scene is None:
        console.say("solved from a saved basis: no render was made; lightpaint relight makes one")
    return 0


def _solve_views(options: Namespace, given: list[str]) -> int:
    """`lightpaint solve SCENE --target SENSOR=TARGET...`"""
    if options.targets:
        raise TargetError("TARGET and --target at once: give every painting with its sensor")
    not_for_views = {"-s": options.sensor, "--time": options.time_s, "--refine": options.refine}
    not_for_views |= {"--quality": options.quality, "--correct-noise": options.noise_correction}
    if idle := [name for name, value in not_for_views.items() if value]:
        raise TargetError(f"{', '.join(idle)} cannot be had with --target: leave it out")
    if is_basis_file(Path(options.source)):
        raise BasisError("a basis has one view only: give the scene, to solve for several")
    paths = [path for _, path in options.views]
    masks = _one_for_each(options.masks or [None], paths)
    targets = [read_target(t, mask=m) for t, m in zip(paths, masks, strict=True)]
    scenes: list[Scene] = []
    for sensor, _ in options.views:
        options.sensor = sensor
        scene = _load(options, path=Path(options.source), is_first=not scenes)
        scenes.append(scene.reduced(options.resolution) if options.resolution else scene)
    folder = Path(options.output or targets[0].name)
    targets = [_fitted(t, s.size, options) for t, s in zip(targets, scenes, strict=True)]
    check_writable(folder)
    check_relightable(scenes[0], folder / "relit.xml")
    for target in targets:
        _warn_of_pixels(target.not_finite, target.name)
    bases_made = [_basis(scene, options.spp, options) for scene in scenes]
    with console.progress() as progress:
        looks = paint_views_with_light(
            scenes,
            targets,
            folder,
            bases=bases_made,
            constraints=_constraints(options),
            unpainted=options.unpainted,
            cd_per_unit=options.cd_per_unit,
            spp=options.spp,
            seed=options.seed,
            command=command_line(given),
            progress=progress,
        )
    for look in looks:
        console.write(f"\n{look.basis.origin.sensor}:")
        tables.show_look(look, folder / look.basis.origin.sensor)
    return 0


def relight(options: Namespace, _given: list[str]) -> int:
    """`lightpaint relight SCENE lighting.json...`"""
    answers = [read_lighting(path) for path in options.lightings]
    names = [a.target or Path(p).stem for a, p in zip(answers, options.lightings, strict=True)]
    folders = _folders(options.output, names)
    scene = _load(options, is_to_solve=False)
    for folder in folders:
        check_writable(folder)
    for lighting, folder in zip(answers, folders, strict=True):
        if lighting.scene_identity not in ("", scene_of(scene, lighting).identity):
            console.say(f"{folder}: the lighting was solved for another state of the scene")
        with console.progress() as progress:
            relight_look(
                scene, lighting, folder, spp=options.spp, seed=options.seed, progress=progress
            )
        console.write(f"{folder}: relit.xml, relit.exr, relit.png")
    return 0


def verify(options: Namespace, _given: list[str]) -> int:
    """`lightpaint verify DIR...`"""
    use_variant(options.variant)
    agree = True
    folders = [view for folder in options.folders for view in result_folders(Path(folder))]
    for folder in folders:
        with console.progress() as progress:
            result = verify_result(folder, spp=options.spp, seed=options.seed, progress=progress)
        console.write(f"{folder}: {tables.spoken_agreement(result)}")
        agree &= result.agrees
    return 0 if agree else 1


def cache(options: Namespace, _given: list[str]) -> int:
    """`lightpaint cache [clear]`"""
    if options.action == "clear":
        console.write(f"{bases.clear()} deleted from {bases.folder()}")
        return 0
    table = console.table("scene", "sensor", "pixels", "lights", "spp", "seed", "MB", "file")
    for entry in reversed(bases.entries()):
        known, about = entry.origin, ["?"] * 6
        if known is not None and entry.image_size is not None:
            height, width = entry.image_size
            about = [known.scene, known.sensor, f"{width}x{height}", str(entry.lights)]
            about += [str(known.spp), str(known.seed)]
        table.add_row(*map(escape, about), f"{entry.size / 1e6:.0f}", escape(entry.path.name))
    console.print_table(table)
    console.write(f"kept in {bases.folder()}")
    return 0


def doctor(options: Namespace, _given: list[str]) -> int:
    """`lightpaint doctor`"""
    findings = examine(options.variant)
    for finding in findings:
        mark = {"ok": "ok", "missing": "MISSING", "info": ""}[finding.state]
        console.write(f"{finding.what:18s} {mark:8s} {finding.found}")
    missing = [finding for finding in findings if finding.state == "missing"]
    for finding in missing:
        if finding.remedy:
            console.write(f"to mend {finding.what}: {finding.remedy}")
    console.write("something is missing" if missing else "everything needed is here")
    return 2 if missing else 0


def _load(
    options: Namespace,
    *,
    path: Path | None = None,
    is_to_solve: bool = True,
    is_first: bool = True,
) -> Scene:
    """The scene that was asked for, and what is worth knowing of it.

    is_to_solve: whether its lights are looked at, and not only their sum. is_first: whether
    anything is to be said that would be said again of another view.
    """
    chosen: dict[str, Any] = {"use_lights_file": False}
    if is_to_solve:
        chosen = {
            "lights": options.lights,
            "groups": _groups(options.groups),
            "lights_file": options.lights_file,
            "use_lights_file": options.use_lights_file,
        }
    scene = load_scene(
        path or options.scene,
        sensor=options.sensor,
        parameters=dict(options.parameters),
        variant=options.variant,
        **chosen,
    )
    if not is_first:
        return scene
    if is_to_solve:
        if scene.lights_file is not None:
            console.say(f"lights and groups as in {scene.lights_file}")
        obstacles = [f"{x.name!r} {x.obstacle}" for x in scene.emitters if x.obstacle]
        if obstacles:
            console.say(f"left as it is: {'; '.join(obstacles)}")
    # Python gets the same as a warning.
    if note := use_variant().note:
        console.say(note)
    elif is_to_solve and (reason := why_not_one_pass(scene)):
        console.say(
            f"{reason}: every light is rendered separately, {len(scene.lights)} times the work"
        )
    return scene


def _with_quality(scene: Scene, options: Namespace) -> tuple[Scene, int | None]:
    """The scene on the film that was asked for, and samples per pixel."""
    return with_quality(
        scene,
        options.quality,
        spp=options.spp,
        time_s=options.time_s,
        resolution=options.resolution,
    )


def _fitted(target: Target, size: tuple[int, int], options: Namespace) -> Target:
    """`target` at the size of the basis. Says so where nobody has asked for another size."""
    fitted = target.fitted_to(size, resize=options.resize)
    if fitted.size != target.size and not (options.resize or options.resolution or options.quality):
        console.say(
            f"{target.name}: {target.size[1]}x{target.size[0]} pixels averaged to the basis's "
            f"{size[1]}x{size[0]}"
        )
    return fitted


def _basis(scene: Scene, spp: int | None, options: Namespace) -> Basis:
    """Render the basis, or say that it was there already."""
    if (needed := memory_needed(scene)) > 2e9:
        console.say(
            f"{len(scene.lights)} lights of {scene.size[1]}x{scene.size[0]} pixels: "
            f"{needed / 1e9:.1f} GB of memory at most"
        )
    rendered = False
    with console.progress() as report:

        def progress(label: str, done: int, total: int, unit: str = "passes") -> None:
            nonlocal rendered
            rendered = True
            report(label, done, total, unit)

        made = obtain_basis(
            scene,
            spp=spp,
            time_s=options.time_s,
            seed=options.seed,
            use_cache=options.cache,
            progress=progress,
        )
    if options.cache and not bases.is_kept(made):
        console.say(
            f"the basis could not be kept in {bases.folder()}, so the next run renders it again: "
            "is the disk full, or the folder not yours?"
        )
    if not rendered:
        console.say(
            f"basis of {made.origin.spp} samples per pixel kept from an earlier run "
            "(--no-cache renders it anew)"
        )
    return made


def _groups(given: Sequence[tuple[str, list[str]]]) -> dict[str, list[str]]:
    """Emitters by name of the group. Given twice, a group has both lists."""
    groups: dict[str, list[str]] = {}
    for name, members in given:
        groups[name] = groups.get(name, []) + members
    return groups


def _constraints(options: Namespace) -> Constraints:
    """What the options ask of the lights."""
    lights: dict[str, dict[str, Any]] = {}
    for key in ("lock", "limits", "color", "kelvin", "primaries"):
        for name, value in getattr(options, key):
            lights.setdefault(name, {})[key] = value
    for name in options.off:
        lights.setdefault(name, {})["off"] = True
    return Constraints.of(
        lights,
        tie=options.tie,
        prefer_current=options.prefer_current,
        sparse=options.sparse,
        where="on the command line",
    )


def _folders(output: str | None, names: Sequence[str]) -> list[Path]:
    """One result folder per name: DIR itself for a single one, DIR/<name> for several."""
    for name in names:
        if Path(name).name != name or name == "..":
            raise OutputError(f"{name!r} is no name for a folder: choose one with -o")
    if len(names) == 1:
        return [Path(output or names[0])]
    if len(set(names)) < len(names):
        raise OutputError(f"results would overwrite each other: {', '.join(names)}")
    return [Path(output or ".") / name for name in names]


def _check_nothing_to_render(options: Namespace) -> None:
    asked = {"-s": options.sensor, "-D": options.parameters, "-m": options.variant}
    asked |= {"--lights": options.lights, "--group": options.groups}
    asked |= {"--spp": options.spp, "--time": options.time_s}
    asked |= {"--quality": options.quality}
    asked |= {"--resolution": options.resolution, "--refine": options.refine}
    if idle := [name for name, value in asked.items() if value]:
        raise BasisError(
            f"{', '.join(idle)} cannot change a saved basis: leave them out, or give the scene"
        )


def _one_for_each(masks: list[str | None], targets: list[str]) -> list[str | None]:
    if len(masks) == 1:
        return masks * len(targets)
    if len(masks) != len(targets):
        raise TargetError(
            f"{len(masks)} masks for {len(targets)} targets: give one for all, or one for each"
        )
    return masks


def _check_suffix(path: Path) -> None:
    if path.suffix.lower() != ".exr":
        raise OutputError(f"{path} must end in .exr, the format that is written")


def _warn_of_pixels(count: int, name: str) -> None:
    if count:
        console.say(f"{name}: {count} pixels hold NaN or Inf and count nothing")
