"""Writes a lighting into the user's own scene XML.

The original text is edited rather than rewritten, so comments, includes and defaults are preserved,
and a diff shows the lights and nothing else.
"""

import difflib
import os
import re
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

import numpy as np

from lightpaint.arrays import RGB, Doubles
from lightpaint.display_text import some_names
from lightpaint.errors import LightingError, OutputError, SceneError
from lightpaint.files import write_bytes
from lightpaint.images.formats import write_rgb
from lightpaint.keywords import keywords
from lightpaint.lighting import Lighting
from lightpaint.relit.emission_xml import written_emission
from lightpaint.relit.relit_files import relit_files, settings_of
from lightpaint.scene import Scaling, Scene, load_scene, new_emitter_at, pose_of, with_split
from lightpaint.scene.checks.tokens import tag
from lightpaint.scene.lights.texels import image_of, layouts_of

#: A parameter in Mitsuba's list of unused ones.
UNUSED_PARAMETER = re.compile(r"- \$(\w+)=")

#: A non-existing folder that stands for any location of the relit scene.
PATCH_SUFFIX = ".lightpaint-patch"


@keywords()
def relight(scene: Scene, lighting: Lighting, path: str | Path) -> Scene:
    """Write `scene` with the emissions of `lighting` to `path`, and load it back.

    Only the lights change. Values of `$name` parameters are not written, and must be given again
    when the file is loaded; the returned scene has those that it still uses. The file refers to the
    original folder by a relative path, so plain Mitsuba can load it in place. Included files that
    contain lights are copied beside it, and so are scaled images of image lights. A light that is
    off keeps its emitter, which is black and never sampled.

    `lighting` decides which emitters belong to each light, however `scene` groups them, and the
    emitters that it keeps are not changed. In the returned scene every emitter is a light.

    Args:
        scene: The scene of the lighting.
        lighting: A setting for all its emitters.
        path: XML file to write.

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
    path, lighting = Path(path), lighting.of_lamps()
    scene, spectra = scene_of(scene, lighting), spectra_of(lighting)
    for file, content in relit_files(scene, lighting.emission, path, spectra=spectra).items():
        if isinstance(content, bytes):
            write_bytes(file, content)
        else:
            write_rgb(file, content)
    relit = replace(_loaded(path, scene), is_spectral=bool(spectra), observer=lighting.observer)
    with_spectrum = {x for name in spectra for x in lighting.members[name]}
    emissions = {emitter.name: emitter.emission for emitter in relit.emitters}
    for emitter, new_emission in settings_of(scene, lighting.emission):
        if emitter.name in with_spectrum:
            continue  # Mitsuba converts it in its own way in RGB
        if emitter.texel or emitter.kind is None or emitter.kind.scaling is not Scaling.COLOUR:
            continue  # a factor of 1 means as authored there, and texels are in an image
        written = written_emission(scene, emitter, new_emission)
        if not np.array_equal(
            np.asarray(written, np.float32), np.asarray(emissions[emitter.name], np.float32)
        ):
            raise SceneError(path, f" did not take the emission of light {emitter.name!r}")
    return relit


def _loaded(path: Path, scene: Scene) -> Scene:
    """Load a written scene with the parameters that it still uses.

    Parameters that only lights used are unused now, and Mitsuba rejects values for unused
    parameters.
    """
    parameters = dict(scene.parameters)
    while True:
        try:
            return load_scene(
                path,
                sensor=scene.sensor,
                parameters=parameters,
                use_lights_file=False,
                lamps=["*"],
            )
        except SceneError as error:
            unused_parameters = set(parameters) & set(UNUSED_PARAMETER.findall(str(error)))
            if not unused_parameters:
                raise
            parameters = {
                name: value for name, value in parameters.items() if name not in unused_parameters
            }


def spectra_of(lighting: Lighting) -> dict[str, Doubles]:
    """Return the spectra of the lamps of a lighting that was found with spectra."""
    powers = {x.name: x.powers for x in lighting.lights if x.mix is not None}
    return {name: spectrum for name, spectrum in powers.items() if spectrum is not None}


def solved_identity(scene: Scene, lighting: Lighting) -> str:
    """Return the identity of `scene` as a basis for that lighting would have it."""
    scene = scene_of(scene, lighting)
    lamps = {x.name: x.lamp for x in lighting.lights if x.lamp is not None and x.mix is not None}
    return (scene.with_lamps(lamps, lighting.observer) if lamps else scene).identity


def settle(scene: Scene, lighting: Lighting, path: Path, home: Path) -> bool:
    """Correct the relit XML at `path`, and the files beside it, for its final location `home`.

    Only relative paths change, and only if they differ between the two locations. Returns whether
    anything changed.
    """

    def ways(to: Path) -> list[str]:
        folder = Path(os.path.realpath(to.parent))
        return [os.path.relpath(file.resolve(), folder) for file in scene.files]

    if ways(path) == ways(home):
        return False
    lighting = lighting.of_lamps()
    of_lighting = scene_of(scene, lighting), lighting.emission
    for file, content in relit_files(*of_lighting, home, spectra=spectra_of(lighting)).items():
        if isinstance(content, bytes):
            write_bytes(path.parent / file.relative_to(home.parent), content)
    return True


def check_relightable(scene: Scene, path: Path) -> list[Path]:
    """Raise the errors that `relight` might raise for some lighting, before a costly render.

    Returns all files that it might write. The probe is a colour that no light has, so that every
    light undergoes its most demanding change.
    """
    probe: dict[str, RGB] = {
        light.name: (0.5, 0.5, 0.5) if light.is_scalar else (0.5, 0.25, 0.125)
        for light in scene.lights
        if not light.is_fixed
    }
    return list(relit_files(scene, probe, path))


def scene_of(scene: Scene, lighting: Lighting) -> Scene:
    """Return `scene` with its emitters grouped and placed as in `lighting`.

    Raises LightingError unless it names exactly the emitters of `scene`, with each light in the
    scene's unit.
    """
    emitter_names = {name for members in lighting.members.values() for name in members}
    scene = _split_scene(placed_scene(scene, lighting), lighting, emitter_names)
    scene_names = {emitter.name for emitter in scene.emitters}
    if emitter_names != scene_names:
        raise LightingError(
            "the lighting does not fit ",
            scene.path,
            ": it lacks "
            f"{some_names(sorted(scene_names - emitter_names)) or 'no light'} and names "
            f"{some_names(sorted(emitter_names - scene_names)) or 'none'} that the scene does not "
            "have",
        )
    regrouped_scene = scene.with_lights(lighting.members, lighting.fixed)
    for setting in lighting.lights:
        if (unit := regrouped_scene.light(setting.name).unit) != setting.unit:
            raise LightingError(
                f"the lighting has light {setting.name!r} in {setting.unit}, but in ",
                scene.path,
                f" as it is now it would be {unit}: solve again",
            )
    return regrouped_scene


def _split_scene(scene: Scene, lighting: Lighting, names: Collection[str]) -> Scene:
    """Return `scene` with a light split into texels if `names`, of the lighting's emitters, has all
    of these texels.
    """
    whole = {emitter.name for emitter in scene.emitters}
    sizes = {image: size for image, size in layouts_of(names).items() if image in whole}
    if not sizes:
        return scene
    # Only lights of texels and their mirror images have the name of one of their members.
    mirrored = {image_of(name) for name, x in lighting.members.items() if len(x) > 1 and name in x}
    facts = with_split({"emitters": scene.emitters}, scene.parsed, sizes, mirrored)
    symmetric = scene.symmetric | mirrored.intersection(sizes)
    return replace(scene, **facts, split={**scene.split, **sizes}, symmetric=symmetric)


def placed_scene(scene: Scene, lighting: Lighting) -> Scene:
    """Return `scene` with the lights that `lighting` moved or added, unless it has them already."""
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


def scene_patch(scene: Scene, lighting: Lighting) -> str:
    """Return a unified diff of the scene's files, relative to its folder, that changes only the
    lights.

    `patch -p1 < relit.patch` in the folder of the scene applies it. Raises SceneError for scaled
    images, which a text patch cannot contain, and LightingError if the two name different emitters.
    """
    lighting = lighting.of_lamps()
    scene = scene_of(scene, lighting)
    root = scene.files[0].resolve()
    place = root.parent / PATCH_SUFFIX / root.name
    lines: list[str] = []
    spectra = spectra_of(lighting)
    for file, content in relit_files(scene, lighting.emission, place, spectra=spectra).items():
        if not isinstance(content, bytes):
            raise SceneError(
                f"{file.name} is an image that this lighting scales, which a text patch cannot "
                "contain: use lightpaint relight"
            )
        name = file.relative_to(place.parent).as_posix()
        try:
            old_text = (root.parent / name).read_text(encoding="utf-8")
        except OSError as error:
            raise OutputError(f"cannot read {name}: {error.strerror or error}") from error
        # A file that stays in its folder needs no search path for its assets.
        origin = os.path.relpath((root.parent / name).parent, file.parent)
        path_line = r"\r?\n[ \t]*" + re.escape(tag("path", value=Path(origin).as_posix()))
        new = re.sub(path_line, "", content.decode("utf-8"), count=1)
        lines += difflib.unified_diff(_lines(old_text), _lines(new), f"a/{name}", f"b/{name}")
    return "".join(lines)


def _lines(text: str) -> list[str]:
    """Return lines with line ends, adding one to the last line if missing."""
    lines = text.splitlines(keepends=True)
    if lines and not lines[-1].endswith("\n"):
        lines[-1] += "\n"
    return lines
