"""Naming conventions of renderers, for light groups and for the picture that they add up to."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

#: Placeholder of the light's name in a pattern.
NAME_FIELD = "{name}"

#: The whole picture, in the words of most renderers; names compare without regard to case.
BEAUTY_NAMES = ("", "rgba", "rgb", "beauty", "combined", "main", "color", "rgb_color", "ci", "c")

#: Prefix of an unmistakable marker: files are often named after a shot.
PREFIX_PATTERN = r"(?:(?P<prefix>.+?)[ ._-])??"

#: Versions of a layer beside it, which would count a light twice. A pattern may still name them.
OTHER_VERSION = re.compile(r".*[ _.](denoised?|denoising|variance|mse|noisy|albedo|normal)", re.I)

#: Characters that join a name to its surroundings.
SEPARATORS = " ._-"


@dataclass(frozen=True)
class Convention:
    """The naming convention of a family of renderers.

    layer: fits the whole name of a layer; its group `name` is the light, `view` the view layer,
    `prefix` what tells apart lights of one name.
    beauty: name of the picture that they add up to, before BEAUTIES are tried.
    whole: name of the group of all lights, if the renderer has one. optional: layers that are part
    of the sum in some versions and settings (in lower case). light: name of the light.
    """

    renderer: str
    layer: re.Pattern[str]
    beauty: str = ""
    whole: str | None = None
    optional: tuple[str, ...] = ()
    light: str = NAME_FIELD


CONVENTIONS = (
    Convention(
        "Blender Cycles",
        re.compile(r"(?:(?P<view>.+)\.)?Combined_(?P<name>.+)"),
        "{view}Combined",
    ),
    Convention("Arnold", re.compile(r"RGBA_(?P<name>.+)"), "RGBA"),
    Convention("Karma", re.compile(r"C_(?P<name>.+)"), "C"),
    Convention(
        "RenderMan or Redshift",
        re.compile(r"(?:[Bb]eauty|Ci)_(?P<name>.+)"),
        "beauty",
        whole="all",  # Redshift's Beauty_all
    ),
    Convention(
        "LuxCore",
        re.compile(PREFIX_PATTERN + r"RADIANCE_GROUP_(?P<name>\d+)(?:[ ._-].*)?"),
        "RGBA",
        light="group_{name}",
    ),
    Convention(
        "V-Ray or Corona",
        re.compile(PREFIX_PATTERN + r"(?:VRay)?LightSelect_(?P<name>.+)", re.I),
        "RGBA",
        optional=("environment", "self illumination", "self_illumination", "selfillum", "rest"),
    ),
    Convention(
        "Octane",
        re.compile(r"Light(?:[ _]?pass)?[ _](?P<name>\d+)", re.I),
        "Main",
        optional=("ambient light", "ambient_light", "sunlight"),
        light="light_{name}",
    ),
)


def is_known(name: str) -> bool:
    """Return True if a known renderer gives a light group this name."""
    return any(convention.layer.fullmatch(name) for convention in CONVENTIONS)


def beauty_name(names: Iterable[str], *, first: str = "") -> str | None:
    """Return the name of the whole picture: `first`, else one of BEAUTIES; None if none is."""
    by_folded: dict[str, str] = {}
    for name in names:
        by_folded.setdefault(name.casefold(), name)
    candidates = (first.casefold(), *BEAUTY_NAMES)
    return next((by_folded[name] for name in candidates if name in by_folded), None)
