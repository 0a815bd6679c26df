"""`lightpaint solve`: from what was painted, in one view or several, to results in folders."""

from argparse import Namespace
from pathlib import Path
from typing import Any

from lightpaint.basis.file import is_basis_file, read_basis
from lightpaint.basis.lightgroups.read import LightGroups
from lightpaint.basis.render.render import basis_lights
from lightpaint.cli import tables, terminal
from lightpaint.cli.options import constraints_of, folders_of, load, render_or_find, view_of
from lightpaint.cli.sources import light_group_source, read_source
from lightpaint.cli.suggestion_table import show_suggestions
from lightpaint.errors import BasisError, TargetError
from lightpaint.files import check_writable
from lightpaint.lighting.constraints.file import read_constraints
from lightpaint.lighting.constraints.reduction import reduce_to
from lightpaint.pipeline import (
    all_constraints,
    check_each_once,
    command_line,
    paint_views_with_light,
    paint_with_light,
)
from lightpaint.placement.suggest import check_suggestible
from lightpaint.relit.export.exports import EXPORTS
from lightpaint.relit.relight import check_relightable
from lightpaint.scene.quality import on_film
from lightpaint.scene.scene import Scene
from lightpaint.target.read import read_target
from lightpaint.target.target import Target


def solve(options: Namespace, given: list[str]) -> int:
    """`lightpaint solve SCENE|BASIS TARGET...` or `SCENE --target SENSOR=TARGET...`"""
    groups = None
    if (source := light_group_source(options)) is not None:
        groups = read_source(source, options)
        options.source, options.targets = str(source.path), list(source.targets)
        for remark in groups.remarks:
            terminal.say(remark)
    if options.views and options.targets:
        raise TargetError("TARGET and --target at once: give every painting with its sensor")
    paths = options.targets or [path for _, path in options.views]
    if not paths:
        raise TargetError("no painting to solve for: give a TARGET, or --target SENSOR=TARGET")
    # Everything a user gave is looked at before the first sample is taken.
    masks = _one_for_each(options.masks or [None], paths)
    how: dict[str, Any] = {
        "layer": options.layer,
        "view": view_of(options),
        "template": options.template,
        "find": options.find_template,
        "paint": options.paint,
    }
    targets = [read_target(t, mask=m, **how) for t, m in zip(paths, masks, strict=True)]
    if options.views:
        return _solve_views(options, targets, given)
    return _solve_each(options, targets, groups, given)


def _solve_each(
    options: Namespace, targets: list[Target], groups: LightGroups | None, given: list[str]
) -> int:
    """One lighting for each painting, all of one view."""
    folders = folders_of(options.output, [Path(path).stem for path in options.targets])
    constraints = constraints_of(options)
    scene, made = None, None
    source = Path(options.source)
    if groups is not None or is_basis_file(source):
        if groups is None:
            _check_nothing_to_render(options)
        made = read_basis(source) if groups is None else groups.basis
        if options.lights_file:
            constraints = read_constraints(options.lights_file).and_then(constraints)
        reduce_to(constraints, made.lights)
        size = made.size
    else:
        scene = on_film(load(options, path=source), options.quality, options.resolution)
        reduce_to(all_constraints(scene, constraints), basis_lights(scene))
        if options.suggest:
            check_suggestible(scene)
        size = scene.size
    if scene is not None:
        for target in targets:
            _check_same_picture(target, scene)
    targets = [_fitted(target, size, options) for target in targets]
    for folder in folders:
        check_writable(folder)
        if scene is not None:
            check_relightable(scene, folder / "relit.xml")
    _say_how_read(targets, options)
    for target, folder in zip(targets, folders, strict=True):
        if made is None and scene is not None:
            made = render_or_find(scene, options)
        with terminal.progress() as progress:
            look = paint_with_light(
                scene,
                target,
                folder,
                basis=made if groups is None else groups,
                constraints=constraints,
                progress=progress,
                **_settings(options, given),
            )
        tables.show_look(look, folder)
        if look.suggestions is not None:
            show_suggestions(look.suggestions, cd_per_unit=options.cd_per_unit)
        if groups is not None:
            there = ", ".join(name for name in EXPORTS if (folder / name).is_file())
            terminal.write(f"for other programs: {there}")
    if scene is None and groups is None:
        terminal.say("solved from a saved basis: no render was made; lightpaint relight makes one")
    return 0


def _solve_views(options: Namespace, targets: list[Target], given: list[str]) -> int:
    """One lighting for the paintings of several views."""
    if options.sensor:
        raise TargetError("-s cannot be had with --target, which names the sensors: leave it out")
    if options.suggest:
        raise TargetError("--suggest is for one view only: solve for a single painting")
    if is_basis_file(Path(options.source)):
        raise BasisError("a basis has one view only: give the scene, to solve for several")
    scenes: list[Scene] = []
    for sensor, _ in options.views:
        options.sensor = sensor
        scene = load(options, path=Path(options.source), is_first=not scenes)
        scenes.append(on_film(scene, options.quality, options.resolution))
    check_each_once(scenes)
    constraints = constraints_of(options)
    reduce_to(all_constraints(scenes[0], constraints), basis_lights(scenes[0]))
    folder = Path(options.output or targets[0].name)
    for target, scene in zip(targets, scenes, strict=True):
        _check_same_picture(target, scene)
    targets = [_fitted(t, s.size, options) for t, s in zip(targets, scenes, strict=True)]
    check_writable(folder)
    check_relightable(scenes[0], folder / "relit.xml")
    _say_how_read(targets, options)
    share_s = None if options.time_s is None else options.time_s / len(scenes)
    made = [render_or_find(scene, options, time_s=share_s) for scene in scenes]
    with terminal.progress() as progress:
        looks = paint_views_with_light(
            scenes,
            targets,
            folder,
            bases=made,
            constraints=constraints,
            progress=progress,
            **_settings(options, given),
        )
    for look in looks:
        terminal.write(f"\n{look.basis.origin.sensor}:")
        tables.show_look(look, folder / look.basis.origin.sensor)
    return 0


def _settings(options: Namespace, given: list[str]) -> dict[str, Any]:
    """What the options say of `Settings`, but for constraints and what is done already."""
    return {
        "unpainted": options.unpainted,
        "method": options.method,
        "space": options.space,  # through the view of the target, which has what was asked
        "suggest": options.suggest,
        "spp": options.spp,
        "time_s": options.time_s,
        "seed": options.seed,
        "quality": options.quality,
        "noise_correction": options.noise_correction,
        "refine": options.refine,
        "cd_per_unit": options.cd_per_unit,
        "command": command_line(given),
    }


def _say_how_read(targets: list[Target], options: Namespace) -> None:
    for target in targets:
        name = "srgb" if target.view is None else target.view.name
        if options.space == "linear" and name not in ("srgb", "linear"):
            terminal.say(
                f"{target.name}: painted through {name}, whose highlights stand for very much "
                "light and rule the fit: --space display fits what the eye sees"
            )
        for note in target.notes:
            terminal.say(f"{target.name}: {note}")
        if target.not_finite:
            terminal.say(
                f"{target.name}: {target.not_finite} pixels hold NaN or Inf and count nothing"
            )


def _check_same_picture(target: Target, scene: Scene) -> None:
    """Raise TargetError for a painting of another view; say so if the scene has changed since."""
    sensor = scene.sensor_names[scene.sensor]
    if target.sensor not in ("", sensor):
        raise TargetError(
            f"{target.name} was painted on a template of the sensor {target.sensor}, not of "
            f"{sensor}: choose it with -s or --target {target.sensor}=..., or pass --no-template"
        )
    if target.content not in ("", scene.content):
        terminal.say(f"{target.name}: the scene has changed since its template was made")


def _fitted(target: Target, size: tuple[int, int], options: Namespace) -> Target:
    """`target` at the size of the basis. Says so where nobody has asked for another size."""
    fitted = target.fitted_to(size, resize=options.resize)
    if fitted.size != target.size and not (options.resize or options.resolution or options.quality):
        terminal.say(
            f"{target.name}: {target.size[1]}x{target.size[0]} pixels averaged to the basis's "
            f"{size[1]}x{size[0]}"
        )
    return fitted


def _check_nothing_to_render(options: Namespace) -> None:
    asked = {"-s": options.sensor, "-D": options.parameters, "-m": options.variant}
    asked |= {"--lights": options.lights, "--group": options.groups}
    asked |= {"--spp": options.spp, "--time": options.time_s}
    asked |= {"--quality": options.quality}
    asked |= {"--resolution": options.resolution, "--refine": options.refine}
    asked |= {"--suggest": options.suggest}
    if idle := [name for name, value in asked.items() if value]:
        raise BasisError(
            f"{', '.join(idle)} cannot change a saved basis: leave "
            f"{'it' if len(idle) == 1 else 'them'} out, or give the scene"
        )


def _one_for_each(masks: list[str | None], targets: list[str]) -> list[str | None]:
    if len(masks) == 1:
        return masks * len(targets)
    if len(masks) != len(targets):
        raise TargetError(
            f"{len(masks)} masks for {len(targets)} targets: give one for all, or one for each"
        )
    return masks
