"""Naming conventions of renderers for light groups and the beauty that they add up to."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

#: Placeholder for the name of the light in a pattern.
NAME_FIELD = "{name}"

#: Names of the whole picture in most renderers, compared without regard to case.
BEAUTY_NAMES = ("", "rgba", "rgb", "beauty", "combined", "main", "color", "rgb_color", "ci", "c")

#: An optional prefix, such as a shot name, before a marker that is distinctive enough.
PREFIX_PATTERN = r"(?:(?P<prefix>.+?)[ ._-])??"

#: Other versions of a layer, which would count a light twice. A pattern may still match them.
OTHER_VERSION = re.compile(r".*[ _.](denoised?|denoising|variance|mse|noisy|albedo|normal)", re.I)

#: Where Blender is told the group of a light, and to write the whole picture.
CYCLES_GROUP = "Light Group in the properties of the object (under Shading) or of the world"
CYCLES_BEAUTY = "Combined under Passes in the properties of the view layer"

#: Characters that separate parts of a name.
SEPARATORS = " ._-"


@dataclass(frozen=True)
class Convention:
    """The naming convention of a family of renderers.

    layer: matches the whole name of a layer; its group `name` is the light, `view` the view layer,
    and `prefix` distinguishes lights with the same name.
    beauty: name of the picture that the lights add up to, tried before BEAUTY_NAMES.
    whole: name of a group that contains all lights, if the renderer has one.
    optional: layers, in lower case, that belong to the sum in some versions and settings.
    light: template for the name of a light.
    joint: what stands between a view layer and the rest of a name.
    group_setting: where the renderer is told the group of a light.
    beauty_setting: where it is told to write the whole picture beside the groups.
    """

    renderer: str
    layer: re.Pattern[str]
    beauty: str = ""
    whole: str | None = None
    optional: tuple[str, ...] = ()
    light: str = NAME_FIELD
    joint: str = "."
    group_setting: str = ""
    beauty_setting: str = ""


CONVENTIONS = (
    Convention(
        "Blender Cycles",
        re.compile(r"(?:(?P<view>.+)\.)?Combined_(?P<name>.+)"),
        "{view}Combined",
        group_setting=CYCLES_GROUP,
        beauty_setting=CYCLES_BEAUTY,
    ),
    Convention(
        # Nuke makes underscores of all characters but letters and digits, dots included.
        "Blender Cycles, written by Nuke",
        re.compile(r"(?!Combined_)(?P<view>\w+?)_Combined_(?P<name>\w+)", re.A),
        "{view}Combined",
        joint="_",
        group_setting=CYCLES_GROUP,
        beauty_setting=CYCLES_BEAUTY,
    ),
    Convention(
        "Arnold",
        re.compile(r"RGBA_(?P<name>.+)"),
        "RGBA",
        group_setting="AOV Light Group of the light",
        beauty_setting="an AOV RGBA",
    ),
    Convention(
        "Karma",
        re.compile(r"C_(?P<name>.+)"),
        "C",
        group_setting="LPE Tag of the light",
        beauty_setting="Beauty in the Karma Render Settings",
    ),
    Convention(
        "RenderMan or Redshift",
        re.compile(r"(?:[Bb]eauty|Ci)_(?P<name>.+)"),
        "beauty",
        whole="all",  # Redshift's Beauty_all
        group_setting="Light Group of the light",
        beauty_setting="a Beauty AOV for all lights",
    ),
    Convention(
        "LuxCore",
        re.compile(PREFIX_PATTERN + r"RADIANCE_GROUP_(?P<name>\d+)(?:[ ._-].*)?"),
        "RGBA",
        light="group_{name}",
        group_setting="Light Group ID of the light",
        beauty_setting="an output RGBA",
    ),
    Convention(
        "V-Ray or Corona",
        re.compile(PREFIX_PATTERN + r"(?:VRay)?LightSelect_(?P<name>.+)", re.I),
        "RGBA",
        optional=("environment", "self illumination", "self_illumination", "selfillum", "rest"),
        group_setting="the list of lights of a LightSelect element",
        beauty_setting="the RGB colour channel of the same EXR",
    ),
    Convention(
        "Octane",
        re.compile(r"Light(?:[ _]?pass)?[ _](?P<name>\d+)", re.I),
        "Main",
        optional=("ambient light", "ambient_light", "sunlight"),
        light="light_{name}",
        group_setting="Light Pass ID of the emitter",
        beauty_setting="the beauty pass Main",
    ),
)


def convention_of(renderer: str) -> Convention | None:
    """Return the convention of a renderer; None for one that is not known."""
    return next((x for x in CONVENTIONS if x.renderer == renderer), None)


def is_known(name: str) -> bool:
    """Return True if a known renderer gives this name to a light group."""
    return any(convention.layer.fullmatch(name) for convention in CONVENTIONS)


def beauty_name(names: Iterable[str], *, first: str = "") -> str | None:
    """Return the name of the whole picture: `first`, or else one of BEAUTY_NAMES; None if
    absent.
    """
    by_folded: dict[str, str] = {}
    for name in names:
        by_folded.setdefault(name.casefold(), name)
    candidates = (first.casefold(), *BEAUTY_NAMES)
    return next((by_folded[name] for name in candidates if name in by_folded), None)
