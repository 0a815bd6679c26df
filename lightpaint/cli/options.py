"""What the options of a command give: scenes, bases, constraints, places for results."""

from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lightpaint.basis import cache
from lightpaint.basis.basis import Basis
from lightpaint.basis.render.obtain import obtain_basis
from lightpaint.basis.render.render import memory_needed, why_not_one_pass
from lightpaint.cli import terminal
from lightpaint.colour.view import ViewChoice
from lightpaint.errors import OutputError
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.scene.quality import samples
from lightpaint.scene.scene import Scene, load_scene
from lightpaint.scene.variant import use_variant


def load(
    options: Namespace,
    *,
    path: Path | None = None,
    is_to_solve: bool = True,
    is_first: bool = True,
    with_lights_file: bool = False,
) -> Scene:
    """The scene that was asked for, and what is worth knowing of it.

    is_to_solve: whether its lights are looked at, and not only their sum. is_first: whether
    anything is to be said that would be said again of another view. with_lights_file: whether
    the one beside the scene ties lights that no option does.
    """
    chosen: dict[str, Any] = {"use_lights_file": with_lights_file}
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
            terminal.say(f"lights and groups as in {scene.lights_file}")
        obstacles = [f"{x.name!r} {x.obstacle}" for x in scene.emitters if x.obstacle]
        if obstacles:
            terminal.say(f"left as it is: {'; '.join(obstacles)}")
    # Python gets the same as a warning.
    if note := use_variant().note:
        terminal.say(note)
    elif is_to_solve and (reason := why_not_one_pass(scene)):
        terminal.say(
            f"{reason}: every light is rendered separately, {len(scene.lights)} times the work"
        )
    return scene


def render_or_find(scene: Scene, options: Namespace, *, time_s: float | None = None) -> Basis:
    """Render the basis, or say that it was there already.

    time_s: instead of what the options say.
    """
    if (needed := memory_needed(scene)) > 2e9:
        terminal.say(
            f"{len(scene.lights)} lights of {scene.size[1]}x{scene.size[0]} pixels: "
            f"{needed / 1e9:.1f} GB of memory at most"
        )
    rendered = False
    with terminal.progress() as report:

        def progress(label: str, done: int, total: int, unit: str = "passes") -> None:
            nonlocal rendered
            rendered = True
            if getattr(options, "views", None):
                label += f" of {scene.sensor_names[scene.sensor]}"
            report(label, done, total, unit)

        made = obtain_basis(
            scene,
            spp=samples(options.quality, spp=options.spp, time_s=options.time_s),
            time_s=options.time_s if time_s is None else time_s,
            seed=options.seed,
            use_cache=options.cache,
            progress=progress,
        )
    if options.cache and not cache.is_kept(made):
        terminal.say(
            f"the basis could not be kept in {cache.folder()}, so the next run renders it again: "
            "is the disk full, or the folder not yours?"
        )
    if not rendered:
        terminal.say(
            f"basis of {made.origin.spp} samples per pixel kept from an earlier run "
            "(--no-cache renders it anew)"
        )
    return made


def view_of(options: Namespace) -> ViewChoice:
    """What --view and --exposure ask for, each alone or both."""
    return ViewChoice(options.view, options.exposure)


def constraints_of(options: Namespace) -> Constraints:
    """What the options ask of the lights."""
    lights: dict[str, dict[str, Any]] = {}
    for key in ("lock", "limits", "color", "kelvin", "duv", "primaries"):
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


def folders_of(output: str | None, names: Sequence[str]) -> list[Path]:
    """One result folder per name: DIR itself for a single one, DIR/<name> for several."""
    for name in names:
        if Path(name).name != name or name == "..":
            raise OutputError(f"{name!r} is no name for a folder: choose one with -o")
    if len(names) == 1:
        return [Path(output or names[0])]
    if len(set(names)) < len(names):
        raise OutputError(f"results would overwrite each other: {', '.join(names)}")
    return [Path(output or ".") / name for name in names]


def _groups(given: Sequence[tuple[str, list[str]]]) -> dict[str, list[str]]:
    """Emitters by name of the group. Given twice, a group has both lists."""
    groups: dict[str, list[str]] = {}
    for name, members in given:
        groups[name] = groups.get(name, []) + members
    return groups
