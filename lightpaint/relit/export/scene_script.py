"""A Python script for Blender that sets the lights of a scene by their names."""

from collections.abc import Iterable
from importlib import resources
from string import Template

from lightpaint.arrays import RGB

#: Blender's quantity for each parameter of Mitsuba's emitters.
KINDS = {
    "radiance": "radiance",
    "intensity": "intensity",
    "irradiance": "irradiance",
}


def scene_script(target: str, source: str, emitters: Iterable[tuple[str, str, RGB]]) -> str:
    """Return the script. emitters: name, Mitsuba's parameter and emission of each adjusted one.
    emitters: name, Mitsuba's parameter and emission of each that is adjusted.

    Emitters without a plain colour, like a scaled sky, are left to the user.
    """
    rows, left = [], []
    for name, parameter, emission in emitters:
        if parameter not in KINDS:  # a multiple, which says nothing of what it is to be
            left.append(name)
            continue
        numbers = ", ".join(f"{channel:.9g}" for channel in emission)
        rows.append(f"    {name!r}: ({KINDS[parameter]!r}, ({numbers})),\n")
    template = resources.files("lightpaint.relit.export").joinpath("set_scene.py.in")
    return Template(template.read_text(encoding="utf-8")).substitute(
        target=_in_docstring(target),
        source=_in_docstring(source),
        lights="{\n" + "".join(rows) + "}",
        left=repr(tuple(left)),
    )


def _in_docstring(text: str) -> str:
    """Return a foreign name that cannot end the string around it."""
    return repr(text).replace('"', "'").replace("\\", "/")
