"""Writes a lighting into the user's own scene XML.

The original text is edited, not written anew, so that comments, includes and defaults
survive and a diff shows the lights and nothing else.
"""

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from lightpaint.arrays import RGB, Floats
from lightpaint.errors import LightingError, OutputError, SceneError
from lightpaint.files import write_bytes
from lightpaint.images.formats.exr import write_rgb
from lightpaint.keywords import keywords
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.relit.emission_xml import Changes, set_emission
from lightpaint.relit.xml_edit import XmlFile
from lightpaint.scene.checks.tokens import tag
from lightpaint.scene.lights.emitters import Emitter
from lightpaint.scene.lights.new_emitter import new_emitter_at
from lightpaint.scene.properties.emission import Scaling
from lightpaint.scene.properties.pose import pose_of
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_reader import load_scene
from lightpaint.screen import some_names

#: A parameter in Mitsuba's list of unused ones.
UNUSED = re.compile(r"- \$(\w+)=")


@keywords()
def relight(scene: Scene, lighting: Lighting, path: str | Path) -> Scene:
    """Write `scene` with the emissions of `lighting` to `path`, and load it back.

    Only the lights change in it: values of `$name` parameters that the scene was loaded with are
    not written, and are given again whenever it is loaded, as to the scene itself (the scene
    returned has those that it still asks for). The file refers to the original folder by relative
    path, so it loads in plain Mitsuba from where it lies. Included files that hold lights are
    copied beside it, and so are scaled images of lights that emit one. A light that is off keeps
    its emitter, is black and is never sampled.

    Which emitters make up each light is what `lighting` says, however `scene` ties them; those it
    keeps are not touched. In the scene returned every emitter is a light.

    Args:
        scene: The scene of the lighting.
        lighting: A setting for all its emitters.
        path: XML to write.

    Raises:
        LightingError: If the two name different emitters.
        SceneError: If the XML cannot express the answer.
        OutputError: If `path` cannot be written.

    Examples:
        >>> scene = lp.load_scene("room.xml")
        >>> relit = lp.relight(scene, lp.read_lighting("lighting.json"), "relit.xml")
        >>> relit.light("panel").emission
        (2.0, 1.5, 1.0)
    """
    path = Path(path)
    scene = scene_of(scene, lighting)
    for file, content in relit_files(scene, lighting.emission, path).items():
        if isinstance(content, bytes):
            write_bytes(file, content)
        else:
            write_rgb(file, content)
    relit = _loaded(path, scene)
    emissions = {emitter.name: emitter.emission for emitter in relit.emitters}
    for emitter, new_emission in settings_of(scene, lighting.emission):
        if emitter.kind is None or emitter.kind.scaling is not Scaling.COLOUR:
            continue  # a factor of 1 means as authored there
        if not np.array_equal(
            np.asarray(new_emission, np.float32), np.asarray(emissions[emitter.name], np.float32)
        ):
            raise SceneError(f"{path} did not take the emission of light {emitter.name!r}")
    return relit


def _loaded(path: Path, scene: Scene) -> Scene:
    """Load a written scene with those of the parameters that it still uses.

    Parameters that only lights used have no use now, and Mitsuba refuses a value without use.
    """
    left = dict(scene.parameters)
    while True:
        try:
            return load_scene(path, sensor=scene.sensor, parameters=left, use_lights_file=False)
        except SceneError as error:
            unused = set(left) & set(UNUSED.findall(str(error)))
            if not unused:
                raise
            left = {name: value for name, value in left.items() if name not in unused}


def settle(scene: Scene, lighting: Lighting, path: Path, home: Path) -> bool:
    """Make the relit XML at `path` right for its later place `home`, with all beside it.

    Only relative paths change, and only if the two have different places among folders. Returns
    whether anything changed.
    """

    def ways(to: Path) -> list[str]:
        folder = Path(os.path.realpath(to.parent))
        return [os.path.relpath(file.resolve(), folder) for file in scene.files]

    if ways(path) == ways(home):
        return False
    for file, content in relit_files(scene_of(scene, lighting), lighting.emission, home).items():
        if isinstance(content, bytes):
            write_bytes(path.parent / file.relative_to(home.parent), content)
    return True


def check_relightable(scene: Scene, path: Path) -> list[Path]:
    """Raise the errors that `relight` would raise for some lighting, before a costly render.

    Returns all files that it might write.

    The probe is a colour that no light has, so that every light takes its most demanding change.
    """
    probe: dict[str, RGB] = {
        light.name: (0.5, 0.5, 0.5) if light.is_scalar else (0.5, 0.25, 0.125)
        for light in scene.lights
        if not light.is_fixed
    }
    return list(relit_files(scene, probe, path))


def scene_of(scene: Scene, lighting: Lighting) -> Scene:
    """Return `scene` with its emitters tied and placed as `lighting` ties and places them.

    Raises LightingError unless it names exactly the emitters of `scene`, and gives each light
    in the unit that the scene has it in.
    """
    scene = placed_scene(scene, lighting)
    emitter_names = {name for members in lighting.members.values() for name in members}
    scene_names = {emitter.name for emitter in scene.emitters}
    if emitter_names != scene_names:
        raise LightingError(
            f"the lighting does not fit {scene.path}: it lacks "
            f"{some_names(sorted(scene_names - emitter_names)) or 'no light'} and names "
            f"{some_names(sorted(emitter_names - scene_names)) or 'none'} that the scene does not "
            "have"
        )
    tied = scene.with_lights(lighting.members, lighting.fixed)
    for setting in lighting.lights:
        if (unit := tied.light(setting.name).unit) != setting.unit:
            raise LightingError(
                f"the lighting has light {setting.name!r} in {setting.unit}, but in {scene.path} "
                f"as it is now it would be {unit}: solve again"
            )
    return tied


def placed_scene(scene: Scene, lighting: Lighting) -> Scene:
    """Return `scene` with the lights that `lighting` has moved or added, unless it has them."""
    names = {emitter.name for emitter in scene.emitters}
    new = [x for x in lighting.places if x.new and x.name not in names]
    if new:
        scene = scene.with_new_emitters([new_emitter_at(place) for place in new])
    sites = {emitter.name: emitter.site for emitter in scene.emitters}
    poses = {
        place.name: pose_of(place.site)
        for place in lighting.places
        if (place.moved_from is not None or place.new)
        and place.name in sites
        and not place.site.is_near(sites[place.name])
    }
    return scene.moved(poses) if poses else scene


def settings_of(scene: Scene, emission: Mapping[str, RGB]) -> Iterator[tuple[Emitter, RGB]]:
    """Return the setting of each adjusted emitter. emission: by name of light."""
    for light in scene.lights:
        if not light.is_fixed:
            for member in light.members:
                yield member, light.emission_of(member, emission[light.name])


@dataclass
class _Edits:
    """The changes in one file: the settings of the emitters in it, by byte offset.

    integrators: the replacements of elements, by byte offset; at None, an addition.
    moved: children to set of the elements of moved lights, by byte offset: XML by name.
    added: lines of the elements of new lights.
    """

    original: Path
    settings: dict[int, tuple[Emitter, RGB, float | None]] = field(default_factory=dict)
    integrators: dict[int | None, str] = field(default_factory=dict)
    moved: dict[int, Mapping[str, str]] = field(default_factory=dict)
    added: list[str] = field(default_factory=list)


def relit_files(
    scene: Scene, emission: Mapping[str, RGB], path: Path
) -> dict[Path, bytes | Floats]:
    """Return the content of the relit XML at `path`, and of its includes and images.

    Raises OutputError if one of them would replace a file of the scene itself.
    """
    root = scene.files[0]
    edits = {root.resolve(): _Edits(root)}
    settings = dict(settings_of(scene, emission))
    unchanged = [emitter for emitter in scene.emitters if emitter not in settings]
    sampled = _sampled_emitters(settings, unchanged)
    added = {x.name: x for x in scene.added}
    new_lines: list[str] = []
    for emitter in scene.emitters:
        if emitter.name in added:
            rgb = settings.pop(emitter, emitter.emission)
            new_lines += added[emitter.name].lines(rgb, is_sampled=emitter in sampled)
    unchanged = [emitter for emitter in unchanged if emitter.name not in added]
    edits[root.resolve()].added = new_lines
    for emitter, rgb in settings.items():
        file = scene.files[emitter.file]
        setting = (emitter, rgb, _sampling_weight(emitter, is_sampled=emitter in sampled))
        edits_of_file = edits.setdefault(file.resolve(), _Edits(file)).settings
        if emitter.offset in edits_of_file and edits_of_file[emitter.offset][1:] != setting[1:]:
            raise _included_twice(file, edits_of_file[emitter.offset][0], emitter)
        edits_of_file[emitter.offset] = setting
    for emitter in unchanged:
        file = scene.files[emitter.file]
        edits_of_file = edits.get(file.resolve(), _Edits(file)).settings
        if emitter.offset in edits_of_file:
            raise _included_twice(file, edits_of_file[emitter.offset][0], emitter)

    _edit_integrators(scene, edits)
    for file, offset, children in scene.moved_elements:
        edits.setdefault(file.resolve(), _Edits(file)).moved[offset] = children
    written: dict[Path, bytes | Floats] = {}
    for edit in edits.values():
        is_root = edit.original == root
        target = path if is_root else path.parent / _place_of_include(edit.original, root)
        content, images = _edit(edit, target.parent, scene, path.stem)
        # Mitsuba looks for images beside the scene, also for those of an included file.
        written |= {path.parent / name: image for name, image in images.items()}
        written[target] = content
    originals = {file.resolve() for file in scene.originals}
    if in_the_way := [file for file in written if file.resolve() in originals]:
        raise OutputError(
            f"{in_the_way[0]} belongs to the scene itself: write the relit scene to another folder"
        )
    return written


def _edit_integrators(scene: Scene, edits: dict[Path, _Edits]) -> None:
    """Add edits that replace the scene's own integrator by the one that it was loaded with."""
    if scene.instead is None:
        return
    text = scene.instead.xml
    for file, offset in scene.replaced_integrators:
        edits.setdefault(file.resolve(), _Edits(file)).integrators[offset] = text
        text = ""  # one is enough
    if text:
        edits[scene.files[0].resolve()].integrators[None] = text


def _included_twice(file: Path, first: Emitter, second: Emitter) -> SceneError:
    return SceneError(
        f"{file} is included more than once, and its light would have to be both "
        f"{first.name!r} and {second.name!r} with different emissions: "
        "include two copies of it, or tie the two into a group"
    )


def _sampled_emitters(
    settings: Mapping[Emitter, RGB], unchanged: Sequence[Emitter]
) -> set[Emitter]:
    """Return those of `settings` that a render may sample: the lit ones that are not only hit by
    chance.

    Mitsuba refuses a scene in which no emitter may be sampled: black ones may where there are no
    others, and at last those that are hit by chance.
    """
    can_be_sampled = {emitter for emitter in settings if not emitter.hit_by_chance}
    lit = {emitter for emitter in can_be_sampled if any(settings[emitter])}
    if lit or any(emitter.sampling_weight for emitter in unchanged):
        return lit
    return can_be_sampled or set(settings)


def _sampling_weight(emitter: Emitter, *, is_sampled: bool) -> float | None:
    """Return the sampling weight to write, or None to leave it as it is."""
    if not is_sampled:
        return 0.0
    return 1.0 if emitter.sampling_weight == 0 else None


def _place_of_include(file: Path, root: Path) -> Path:
    """Return the path of an edited copy, relative to relit.xml, at which Mitsuba finds it first."""
    try:
        return file.resolve().relative_to(root.resolve().parent)
    except ValueError:
        raise SceneError(
            f"{file} has to be edited, but it lies outside the folder of {root}, where an edited "
            "copy would not be found: move it below that folder"
        ) from None


def _edit(edit: _Edits, folder: Path, scene: Scene, stem: str) -> tuple[bytes, dict[str, Floats]]:
    """Return the edited XML for `folder`, and the images that it refers to, by name.

    stem: the beginning of image names.
    """
    xml = XmlFile(edit.original)
    if xml.root.tag == "scene":
        # Assets and includes lie where the original lies.
        origin = os.path.relpath(edit.original.resolve().parent, folder.resolve())
        lines = [tag("path", value=Path(origin).as_posix())]
        lines += [text for at, text in edit.integrators.items() if at is None]
        xml.insert_first(xml.root, lines)
    if edit.added:
        xml.insert_last(xml.root, edit.added)
    for at, text in edit.integrators.items():
        if at is not None:
            xml.replace(xml.element_at(at), text)
    images: dict[str, Floats] = {}
    for offset in sorted({*edit.settings, *edit.moved}):
        changes = Changes(xml, xml.element_at(offset))
        for name, text in edit.moved.get(offset, {}).items():
            changes.set_element(name, text)
        if offset in edit.settings:
            emitter, rgb, weight = edit.settings[offset]
            if weight is not None:
                changes.set("float", "sampling_weight", f"{weight:g}")
            images |= set_emission(changes, scene, emitter, rgb, stem=stem)
        changes.finish()
    return xml.edited(), images
