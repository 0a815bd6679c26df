"""The files of a relit scene: its XML, edited copies of includes, and scaled images."""

import os
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from lightpaint.arrays import RGB, Doubles, Floats
from lightpaint.errors import OutputError, SceneError
from lightpaint.relit import emission_xml
from lightpaint.relit.xml_edit import XmlFile
from lightpaint.scene import Emitter, Scene, texel_image
from lightpaint.scene.checks.tokens import tag
from lightpaint.scene.lights.texels import GridSize


def settings_of(scene: Scene, emission: Mapping[str, RGB]) -> Iterator[tuple[Emitter, RGB]]:
    """Yield each adjusted emitter with its emission. emission: emission by light name."""
    for light in scene.lights:
        if not light.is_fixed:
            for member in light.members:
                yield member, light.emission_of(member, emission[light.name])


@dataclass
class _Edits:
    """The changes in one file. settings: settings of its emitters, by byte offset.

    texel_images: images of lights whose texels are set, with one of these and its sampling weight,
    by byte offset.
    spectra: of emitters that have one, by byte offset: power at WAVELENGTHS, for luminance.
    integrators: replacements of elements, by byte offset; None for an addition.
    moved: child elements to set in the elements of moved lights, by byte offset, as XML by name.
    added: lines of the elements of new lights. removed: byte offsets of elements to leave out.
    """

    original: Path
    settings: dict[int, tuple[Emitter, RGB, float | None]] = field(default_factory=dict)
    texel_images: dict[int, tuple[Emitter, Floats, float | None]] = field(default_factory=dict)
    spectra: dict[int, Doubles] = field(default_factory=dict)
    integrators: dict[int | None, str] = field(default_factory=dict)
    moved: dict[int, Mapping[str, str]] = field(default_factory=dict)
    added: list[str] = field(default_factory=list)
    removed: list[int] = field(default_factory=list)


def relit_files(
    scene: Scene,
    emission: Mapping[str, RGB],
    path: Path,
    *,
    spectra: Mapping[str, Doubles] | None = None,
) -> dict[Path, bytes | Floats]:
    """Return the content of the relit XML at `path`, and of its includes and images.

    spectra: of lights that have one in the place of a colour, as in `LightSetting.powers`.
    Raises OutputError if one of them would replace a file of the scene itself.
    """
    root = scene.files[0]
    contents: dict[Path, bytes | Floats] = {}
    for edit in _edits_of(scene, emission, spectra or {}).values():
        is_root = edit.original == root
        target = path if is_root else path.parent / _place_of_include(edit.original, root)
        content, images = _edit(edit, target.parent, scene, path.stem)
        # Mitsuba looks for images beside the scene, even for the images of an included file.
        contents |= {path.parent / name: image for name, image in images.items()}
        contents[target] = content
    originals = {file.resolve() for file in scene.originals}
    if in_the_way := [file for file in contents if file.resolve() in originals]:
        raise OutputError(
            f"{in_the_way[0]} belongs to the scene itself: write the relit scene to another folder"
        )
    return contents


def _edits_of(
    scene: Scene, emission: Mapping[str, RGB], spectra: Mapping[str, Doubles]
) -> dict[Path, _Edits]:
    """Return the edits of each file, by its resolved path; the root comes first."""
    root = scene.files[0]
    edits = {root.resolve(): _Edits(root)}
    settings = dict(settings_of(scene, emission))
    unchanged = [emitter for emitter in scene.emitters if emitter not in settings]
    sampled = _sampled_emitters(settings, unchanged)
    added = {x.name: x for x in scene.added}
    for emitter in scene.emitters:
        if emitter.name in added:
            rgb = settings.pop(emitter, emitter.emission)
            lines = added[emitter.name].lines(rgb, is_sampled=emitter in sampled)
            edits[root.resolve()].added += lines
    unchanged = [emitter for emitter in unchanged if emitter.name not in added]
    _edit_images(scene, edits, settings, sampled)
    settings = {emitter: rgb for emitter, rgb in settings.items() if emitter.texel is None}
    # Luminaires are written even if they stay as they are: the file has other emitters there.
    kept = {x: x.emission for x in unchanged if emission_xml.luminaire_of(scene, x) is not None}
    sampled = {*sampled, *(x for x in kept if x.sampling_weight)}
    unchanged = [emitter for emitter in unchanged if emitter not in kept]
    settings |= kept
    _edit_emitters(scene, edits, settings, unchanged, sampled)
    for name, powers in spectra.items():
        for member in scene.light(name).members:
            edits[scene.files[member.file].resolve()].spectra[member.offset] = powers
    _edit_integrators(scene, edits)
    for index, offset in (x for hung in scene.luminaires for x in hung.further):
        file = scene.files[index]
        edits.setdefault(file.resolve(), _Edits(file)).removed.append(offset)
    for file, offset, children in scene.moved_elements:
        edits.setdefault(file.resolve(), _Edits(file)).moved[offset] = children
    return edits


def _edit_emitters(
    scene: Scene,
    edits: dict[Path, _Edits],
    settings: Mapping[Emitter, RGB],
    unchanged: Iterable[Emitter],
    sampled: Collection[Emitter],
) -> None:
    """Add edits of the emitters of a scene's files.

    Raises SceneError if one element, included twice, would need two settings, or one and none.
    """
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


def _edit_images(
    scene: Scene,
    edits: dict[Path, _Edits],
    settings: Mapping[Emitter, RGB],
    sampled: Collection[Emitter],
) -> None:
    """Add edits of the lights whose texels are among `settings`."""
    for texels, image in images_of_texels(scene, settings):
        if scene.map_size is not None:
            image = enlarged(image, texels[0], scene.map_size)
        is_sampled = bool(image.any()) or any(x in sampled for x in texels)
        weight = _sampling_weight(texels[0], is_sampled=is_sampled)
        file = scene.files[texels[0].file]
        edits_of_file = edits.setdefault(file.resolve(), _Edits(file))
        edits_of_file.texel_images[texels[0].offset] = texels[0], image, weight


def images_of_texels(
    scene: Scene, settings: Mapping[Emitter, RGB]
) -> Iterator[tuple[list[Emitter], Floats]]:
    """Yield the texels of each light that has some among `settings`, and its image.

    Its other texels stay as they are.
    """
    for node in dict.fromkeys(x.node for x in settings if x.texel is not None):
        texels = [x for x in scene.emitters if x.node == node]
        yield (
            texels,
            texel_image({x.texel: settings.get(x, x.emission) for x in texels if x.texel}),
        )


def enlarged(image: Floats, emitter: Emitter, map_size: GridSize) -> Floats:
    """Return the image of a light at the size in which it is written, as Mitsuba interpolates it.

    emitter: one of its texels. Raises SceneError if that is smaller than the image.
    """
    assert emitter.texel is not None
    texel, size = emitter.texel, map_size
    if texel.domain.has_proportions:
        size = texel.domain.picture_size(texel.layout.size, size[0])
    columns, rows = texel.layout.finest
    if size[0] < columns or size[1] < rows:
        raise SceneError(
            f"the map size is {size[0]}x{size[1]}: expected at least {columns}x{rows}, a pixel for "
            f"each texel of {texel.image!r}"
        )
    return texel.domain.interpolated(image, size).astype(np.float32)


def _edit_integrators(scene: Scene, edits: dict[Path, _Edits]) -> None:
    """Add edits that replace the scene's own integrator by the one it was loaded with."""
    if scene.integrator_choice is None:
        return
    text = scene.integrator_choice.xml
    for file, offset in scene.replaced_integrators:
        edits.setdefault(file.resolve(), _Edits(file)).integrators[offset] = text
        text = ""  # one is enough
    if text:
        edits[scene.files[0].resolve()].integrators[None] = text


def _included_twice(file: Path, first: Emitter, second: Emitter) -> SceneError:
    return SceneError(
        file,
        " is included more than once, and its light would have to be both "
        f"{first.name!r} and {second.name!r} with different emissions: "
        "include two copies of it, or tie the two into a group",
    )


def _sampled_emitters(
    settings: Mapping[Emitter, RGB], unchanged: Sequence[Emitter]
) -> set[Emitter]:
    """Return the emitters among `settings` to be sampled: lit ones that are not only hit by chance.

    Mitsuba rejects a scene without any sampled emitter. So if there are no others, black ones are
    sampled, and as a last resort those that are hit by chance.
    """
    can_be_sampled = {emitter for emitter in settings if not emitter.hit_by_chance}
    lit_emitters = {emitter for emitter in can_be_sampled if any(settings[emitter])}
    if lit_emitters or any(emitter.sampling_weight for emitter in unchanged):
        return lit_emitters
    return can_be_sampled or set(settings)


def _sampling_weight(emitter: Emitter, *, is_sampled: bool) -> float | None:
    """Return the sampling weight to write, or None to leave it unchanged."""
    if not is_sampled:
        return 0.0
    return 1.0 if emitter.sampling_weight == 0 else None


def _place_of_include(file: Path, root: Path) -> Path:
    """Return the path of an edited copy, relative to relit.xml, where Mitsuba finds it before the
    original.
    """
    try:
        return file.resolve().relative_to(root.resolve().parent)
    except ValueError:
        raise SceneError(
            file,
            f" has to be edited, but it lies outside the folder of {root}, where an edited "
            "copy would not be found: move it below that folder",
        ) from None


def _edit(edit: _Edits, folder: Path, scene: Scene, stem: str) -> tuple[bytes, dict[str, Floats]]:
    """Return the edited XML for `folder`, and the images that it refers to, by name.

    stem: prefix of image names.
    """
    xml = XmlFile(edit.original)
    if xml.root.tag == "scene":
        # Assets and includes stay beside the original.
        origin = os.path.relpath(edit.original.resolve().parent, folder.resolve())
        lines = [tag("path", value=Path(origin).as_posix())]
        lines += [text for at, text in edit.integrators.items() if at is None]
        xml.insert_first(xml.root, lines)
    if edit.added:
        xml.insert_last(xml.root, edit.added)
    for at, text in edit.integrators.items():
        if at is not None:
            xml.replace(xml.element_at(at), text)
    for at in edit.removed:
        xml.remove(xml.element_at(at))
    images: dict[str, Floats] = {}
    for offset in sorted({*edit.settings, *edit.texel_images, *edit.moved}):
        if (
            offset in edit.settings
            and emission_xml.luminaire_of(scene, edit.settings[offset][0]) is not None
        ):
            # It has the place that it was moved to.
            lines = emission_xml.luminaire_xml(
                scene, *edit.settings[offset], edit.spectra.get(offset)
            )
            xml.replace_by_lines(xml.element_at(offset), lines)
            continue
        changes = emission_xml.Changes(xml, xml.element_at(offset))
        for name, text in edit.moved.get(offset, {}).items():
            changes.set_element(name, text)
        if offset in edit.settings:
            emitter, rgb, weight = edit.settings[offset]
            if weight is not None:
                changes.set("float", "sampling_weight", f"{weight:g}")
            if offset in edit.spectra:
                emission_xml.set_spectrum(changes, emitter, edit.spectra[offset])
            else:
                images |= emission_xml.set_emission(changes, scene, emitter, rgb, stem=stem)
        if offset in edit.texel_images:
            emitter, image, weight = edit.texel_images[offset]
            if weight is not None:
                changes.set("float", "sampling_weight", f"{weight:g}")
            images |= emission_xml.set_image(changes, emitter, image, stem=stem)
        changes.finish()
    return xml.edited(), images
