"""A lighting as a patch of the scene's XML, for `patch` and for reading the changes."""

import difflib
import math
import os
import re
from pathlib import Path

from lightpaint.arrays import RGB
from lightpaint.errors import OutputError, SceneError
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.relit.relight import scene_of
from lightpaint.relit.relit_files import relit_files, settings_of
from lightpaint.scene.checks.tokens import tag
from lightpaint.scene.lights.emitters import Emitter
from lightpaint.scene.properties.emission import Scaling
from lightpaint.scene.scene import Scene

#: A non-existing folder that stands for any location of the relit scene.
PATCH_SUFFIX = ".lightpaint-patch"


def scene_patch(scene: Scene, lighting: Lighting) -> str:
    """Return a unified diff of the scene's files, relative to its folder, that changes only the
    lights.

    `patch -p1 < relit.patch` in the folder of the scene applies it. Raises SceneError for scaled
    images, which a text patch cannot contain, and LightingError if the two name different emitters.
    """
    scene = scene_of(scene, lighting)
    root = scene.files[0].resolve()
    place = root.parent / PATCH_SUFFIX / root.name
    lines: list[str] = []
    for file, content in relit_files(scene, lighting.emission, place).items():
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


def emitters_of(scene: Scene, lighting: Lighting) -> list[tuple[str, str, RGB]]:
    """Return name, Mitsuba's parameter and emission of every adjusted emitter but texels.

    The parameter is "" if the emission is a multiple of that in the scene, as for a sky. A
    projector of one colour has the intensity along its axis.
    """
    regrouped_scene = scene_of(scene, lighting)
    return [
        (emitter.name, *_quantity(emitter, rgb))
        for emitter, rgb in settings_of(regrouped_scene, lighting.emission)
        if emitter.texel is None
    ]


def _quantity(emitter: Emitter, rgb: RGB) -> tuple[str, RGB]:
    kind = emitter.kind
    if kind is None or kind.scaling is not Scaling.COLOUR:
        return "", rgb
    if emitter.plugin != "projector":
        return kind.parameter, rgb
    # Its irradiance is π times smaller than what a plane at distance 1 gets.
    r, g, b = (math.pi * channel for channel in rgb)
    return "intensity", (r, g, b)


def _lines(text: str) -> list[str]:
    """Return lines with line ends, adding one to the last line if missing."""
    lines = text.splitlines(keepends=True)
    if lines and not lines[-1].endswith("\n"):
        lines[-1] += "\n"
    return lines
