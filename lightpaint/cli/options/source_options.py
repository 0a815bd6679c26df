"""Conversion of options to sources: scenes, bases and light groups.

`solve --lights FILE.exr TARGET` and `solve FILE.exr TARGET` both mean another renderer's light
groups; `--lights key,fill` goes on to mean the lights of a scene.
"""

from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lightpaint.basis.file.basis_file import is_basis_file
from lightpaint.basis.lightgroups.frame_sequence import find_frames, is_pattern, spoken_frames
from lightpaint.basis.lightgroups.render_layers import is_exr, is_light_groups, is_own_basis
from lightpaint.errors import BasisError
from lightpaint.pipeline.job.sources import BasisFile, GroupsFile, SceneFile, check_needed

#: Options for loading a scene, by their Python names.
LOADING = (
    "sensor",
    "parameters",
    "variant",
    "lights",
    "groups",
    "integrator",
    "split",
    "symmetric",
    "map_size",
)


def source_of_template(options: Namespace) -> SceneFile | BasisFile | GroupsFile:
    """Return the source of a template: a scene, a saved basis, or light groups."""
    light_list = ",".join(options.lights or ())
    if options.scene is None:
        if not light_list:
            raise BasisError("nothing to paint on: give a scene, a basis, or light groups")
        _check_light_groups(light_list)
        options.scene, options.lights = light_list, None
    elif light_list and _is_file_to_be(light_list, Path(options.scene)):
        raise BasisError(f"{options.scene} and --lights {light_list} at once: give one to paint on")
    options.source, options.targets, options.masks, options.views = options.scene, [], [], []
    return basis_of(options) or scene_of(options)


def scene_of(options: Namespace, *, is_to_solve: bool = True, **fields: Any) -> SceneFile:
    """Return the scene of a command. is_to_solve: whether its lights are chosen."""
    path = options.source if options.command in ("solve", "paint") else options.scene
    if is_to_solve:
        fields |= {
            "lights": options.lights,
            "groups": _groups(options.groups),
            "lights_file": options.lights_file,
            "use_lights_file": options.use_lights_file,
            "group_alike": options.group_alike,
            "split": _split_of(options),
            "symmetric": getattr(options, "symmetric", None),
        }
    loading = {"sensor": options.sensor, "variant": options.variant, **fields}
    loading["integrator"] = options.integrator
    loading["map_size"] = getattr(options, "map_size", None)
    return SceneFile(path, parameters=dict(options.parameters), **loading)


def _split_of(options: Namespace) -> dict[str, str] | None:
    """Return the sizes of images by name of the light; None for those of the lights file."""
    if options.split is None:
        return None
    return {name: size for name, size in options.split if name}


def scene_to_export(options: Namespace) -> SceneFile | None:
    """Return the scene that a lighting is exported for, if given, with all of its lights."""
    if options.scene is None:
        return None
    parameters = dict(options.parameters)
    fields: dict[str, Any] = {"sensor": options.sensor, "variant": options.variant}
    fields["map_size"] = options.map_size
    return SceneFile(options.scene, parameters=parameters, use_lights_file=False, **fields)


def painted_of(options: Namespace) -> list[SceneFile | BasisFile | GroupsFile]:
    """Return the sources to paint.

    They are a scene, once for each sensor; bases of several views; or light groups.
    """
    light_list = ",".join(options.lights or ())
    paths = options.sources
    if not paths and not light_list:
        raise BasisError("nothing to paint: give a scene, a basis, or light groups")
    options.sensor = options.sensors[0] if options.sensors else None
    if not paths:
        _check_light_groups(light_list)
        paths, options.lights = [light_list], None
    elif light_list and _is_file_to_be(light_list, Path(paths[0])):
        raise BasisError(f"{paths[0]} and --lights {light_list} at once: give one to paint")
    sources = []
    for options.source in paths:
        sources.append(basis_of(options) or scene_of(options))
    if len(paths) > 1 and not all(isinstance(source, BasisFile) for source in sources):
        raise BasisError(
            f"{len(paths)} things to paint: several must be bases of the views of one scene; for "
            "views of a scene repeat --sensor"
        )
    if len(options.sensors) > 1:
        return [scene_of(options, sensor=sensor) for sensor in options.sensors]
    return sources


def basis_of(options: Namespace) -> BasisFile | GroupsFile | None:
    """Return the basis or the light groups that `solve` starts from; None for a scene.

    If `--lights` names the light groups, the source is really the first target. Raises BasisError
    for options that are useless without a scene.
    """
    source, names = Path(options.source), options.lights
    light_list = ",".join(names or ())
    for path in filter(is_pattern, (options.source, light_list)):
        frame = find_frames(path)
        raise BasisError(
            f"{path} has the frames {spoken_frames(frame.frames)}: give one of them, like "
            f"{frame.path(frame.frames[0])}"
        )
    basis: BasisFile | GroupsFile
    if light_list and _is_file_to_be(light_list, source):
        _check_light_groups(light_list)
        options.targets = [options.source, *options.targets]
        basis, names = groups_file(light_list, options), None
    elif source.suffix.lower() != ".xml" and is_light_groups(source):
        basis = groups_file(options.source, options)
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
            f"--target cannot be used with {basis.path}, which has only one view: give the scene "
            "to solve for several"
        )
    check_scene_options(options, basis, names)
    return basis


def check_scene_options(
    options: Namespace, basis: BasisFile | GroupsFile, names: Sequence[str] | None
) -> None:
    """Raise BasisError for options that are useless without a scene. names: chosen lights."""
    light_list = ",".join(names or ())
    is_groups = isinstance(basis, GroupsFile)
    unusable_options = [
        name for name in LOADING if getattr(options, name, None) and name != "lights"
    ]
    check_needed([*unusable_options, *(["lights"] if names and not is_groups else [])], basis)
    if names:
        raise BasisError(
            f"--lights {light_list} chooses lights of a scene: of light groups, keep the "
            "others as they are with --lock NAME"
        )


def groups_file(path: str, options: Namespace) -> GroupsFile:
    """Return light groups; paintings in their folder are not among them."""
    pictures = (*options.targets, *(options.masks or ()))
    return GroupsFile(path, options.pattern, leave_out=pictures)


def _is_file_to_be(text: str, source: Path) -> bool:
    """Return True if `--lights` means a file or folder, and not lights of a scene or a basis."""
    if text.lower().endswith(".exr"):
        return True
    # A folder of results may well have the name of a light.
    return source.suffix.lower() != ".xml" and Path(text).exists()


def _check_light_groups(text: str) -> None:
    """Raise BasisError if `--lights` names something else, ImageError if it is damaged."""
    path = Path(text)
    if not path.exists():
        raise BasisError(f"no such file or folder of light groups: --lights {text}")
    if path.is_dir() and not is_light_groups(path):
        raise BasisError(f"--lights {text} is a folder without an .exr file")
    # The reader refuses files that are not EXR.
    if path.is_file() and is_exr(path) and is_own_basis(path):
        raise BasisError(
            f"--lights {text} holds no light groups: give an EXR of another renderer, or a "
            "folder of them; pass a basis of lightpaint in place of the scene"
        )


def _groups(pairs: Sequence[tuple[str, list[str]]]) -> dict[str, list[str]]:
    """Return emitters by name of the group; lists of repeated groups are joined."""
    groups: dict[str, list[str]] = {}
    for name, members in pairs:
        groups[name] = groups.get(name, []) + members
    return groups
