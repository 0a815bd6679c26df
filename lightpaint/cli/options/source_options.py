"""Conversion of options to sources: scenes, bases, light groups, and the frames of a shot.

`solve --lights FILE.exr TARGET` and `solve FILE.exr TARGET` both mean another renderer's light
groups; `--lights key,fill` goes on to mean the lights of a scene.
"""

import re
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lightpaint.basis import (
    SIGN,
    FrameSequence,
    find_frames,
    is_basis_file,
    is_exr,
    is_light_groups,
    is_own_basis,
    is_pattern,
    spoken_frames,
)
from lightpaint.display_text import visible
from lightpaint.errors import BasisError, TargetError
from lightpaint.pipeline import BasisFile, GroupsFile, SceneFile, check_needed

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
    seen = {"spectral": options.spectral, "observer": options.observer}
    return basis_of(options) or scene_of(options, **seen)


def scene_of(options: Namespace, *, is_to_solve: bool = True, **fields: Any) -> SceneFile:
    """Return the scene of a command. is_to_solve: whether its lights are chosen."""
    path = options.source if options.command in ("solve", "paint") else options.scene
    if is_to_solve:
        fields |= {
            "lights": options.lights,
            "groups": _groups(options.groups),
            "use_lights_file": options.use_lights_file,
            "group_alike": options.group_alike,
            "split": _split_of(options),
            "symmetric": getattr(options, "symmetric", None),
        }
    fields |= {"lights_file": options.lights_file, "only_luminaires": not is_to_solve}
    loading = {"sensor": options.sensor, "variant": options.variant, **fields}
    loading["integrator"] = options.integrator
    loading["map_size"] = getattr(options, "map_size", None)
    return SceneFile(path, parameters=dict(options.parameters), **loading)


def _split_of(options: Namespace) -> dict[str, str] | None:
    """Return the sizes of images by name of the light; None for the sizes of the lights file."""
    if options.split is None:
        return None
    return {name: size for name, size in options.split if name}


def scene_to_export(options: Namespace) -> SceneFile | None:
    """Return the scene that a lighting is exported for, if given, with all of its lights."""
    if options.scene is None:
        return None
    parameters = dict(options.parameters)
    fields: dict[str, Any] = {"sensor": options.sensor, "variant": options.variant}
    fields |= {"map_size": options.map_size, "lights_file": options.lights_file}
    return SceneFile(options.scene, parameters=parameters, only_luminaires=True, **fields)


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


#: Digits of a file name that may be its frame, and what separates them from the name.
_NUMBER = re.compile(r"[._-]?(-?[0-9]+)")


def is_of_frames(options: Namespace) -> bool:
    """Return True if `solve` is of the frames of a shot."""
    return is_pattern(options.source) or is_pattern(",".join(options.lights or ()))


def sequence_of(options: Namespace) -> FrameSequence | None:
    """Return the frames of `solve` if it names a sequence of light groups; None for one picture.

    If `--lights` names the sequence, the source is really the first target.
    """
    light_list = ",".join(options.lights or ())
    if light_list and is_pattern(light_list):
        options.targets, options.source = [options.source, *options.targets], light_list
        options.lights = None
    return find_frames(options.source) if is_pattern(options.source) else None


def paintings_by_frame(options: Namespace, sequence: FrameSequence) -> dict[int, str]:
    """Return the path of the painting of each painted frame, in the order of frames.

    Raises TargetError for a painting without a frame, and for two of one frame.
    """
    pairs = [(_frame(text, path, sequence), path) for text, path in options.views]
    for path in options.targets:
        pairs += _matches(path, sequence) if is_pattern(path) else [(_named(path, sequence), path)]
    if not pairs:
        raise TargetError("no painting to solve for: give a TARGET whose name has its frame")
    paintings = dict(sorted(pairs))
    if len(paintings) < len(pairs):
        frame = next(x for x in paintings if [frame for frame, _ in pairs].count(x) > 1)
        first, second = [path for number, path in pairs if number == frame][:2]
        raise TargetError(f"{first} and {second} are both of frame {frame}: give one of them")
    return paintings


def masks_by_frame(options: Namespace, frames: tuple[int, ...]) -> list[str] | None:
    """Return the masks in the options, with one for each frame if they name a sequence."""
    masks = options.masks
    if not masks or len(masks) > 1 or not is_pattern(masks[0]):
        return masks  # type: ignore[no-any-return]
    sequence = find_frames(masks[0])
    return [str(sequence.path(frame)) for frame in frames]


def groups_of_frames(
    options: Namespace, sequence: FrameSequence, frames: tuple[int, ...]
) -> tuple[GroupsFile, ...]:
    """Return the light groups of these frames. Raises BasisError for options of a scene."""
    groups = tuple(groups_file(str(sequence.path(frame)), options) for frame in frames)
    check_scene_options(options, groups[0], options.lights)
    return groups


def name_without_frame(path: str) -> str:
    """Return what a painting is called apart from its frame: `evening` of evening.0012.exr."""
    stem = Path(SIGN.sub("", path)).stem if is_pattern(path) else Path(path).stem
    matches = [*_NUMBER.finditer(stem)]
    if matches and not is_pattern(path):
        stem = stem[: matches[-1].start()] + stem[matches[-1].end() :]
    return stem.strip("._-") or Path(path).stem


def _matches(pattern: str, sequence: FrameSequence) -> list[tuple[int, str]]:
    """Return the paintings of a pattern whose frames the shot has."""
    paintings = find_frames(pattern)
    pairs = [(frame, str(paintings.path(frame))) for frame in paintings.frames]
    if not (common := [pair for pair in pairs if pair[0] in sequence.numbers]):
        raise TargetError(
            f"no frame is in both: {visible(sequence.pattern)} has "
            f"{spoken_frames(sequence.frames)}, {visible(pattern)} has "
            f"{spoken_frames(paintings.frames)}"
        )
    return common


def _frame(text: str, path: str, sequence: FrameSequence) -> int:
    """Return the frame of `--target FRAME=TARGET`."""
    if not re.fullmatch(r"-?[0-9]+", text):
        raise TargetError(
            f"--target {text}={path}: {visible(sequence.pattern)} has frames, so expected the "
            f"number of one, like {sequence.frames[0]}={path}"
        )
    return _existing(int(text), path, sequence)


def _named(path: str, sequence: FrameSequence) -> int:
    """Return the frame in the name of a painting: its last number that looks like one."""
    texts = [match[1] for match in _NUMBER.finditer(Path(path).stem)]
    known = [text for text in texts if text in sequence.numbers.values()]
    if not texts:
        raise TargetError(
            f"{visible(path)} names no frame of {visible(sequence.pattern)}: call it like "
            f"{Path(path).stem}.{sequence.numbers[sequence.frames[0]]}{Path(path).suffix}, or give "
            f"it with --target {sequence.frames[0]}={visible(path)}"
        )
    return _existing(int((known or texts)[-1]), path, sequence)


def _existing(frame: int, path: str, sequence: FrameSequence) -> int:
    """Return a frame. Raises BasisError if the shot lacks it."""
    if frame not in sequence.numbers:
        raise BasisError(
            f"{visible(path)} is of frame {frame}, which {visible(sequence.pattern)} lacks: it has "
            f"{spoken_frames(sequence.frames)}"
        )
    return frame
