"""Naming conventions of renderers for light groups and the beauty that they add up to."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

#: Placeholder for the name of the light in a pattern.
NAME_FIELD = "{name}"

#: Names of the whole picture in most renderers, compared without regard to case; `image` is the
#: name in Blender's File Output node.
BEAUTY_NAMES = (
    *("", "rgba", "rgb", "beauty", "combined", "image", "main", "color", "rgb_color", "ci", "c"),
)

#: The view layer that programs such as Blender write before the names of any renderer in them.
VIEW_PATTERN = r"(?:(?P<view>.+?)\.)??"

#: An optional prefix, such as a shot name, before a marker that is distinctive enough.
PREFIX_PATTERN = r"(?:(?P<prefix>.+?)[ ._-])??"

#: Names of other versions of a layer, `base`, which would count a light twice. They only propose
#: it: a light may be called `sun normal`. A pattern may match them.
OTHER_VERSION = re.compile(
    r"(?P<base>.*)[ _.](?P<version>denoised?|denoising|variance|mse|noisy|albedo|normal)", re.I
)

#: Blender's settings for the group of a light, and for writing the whole picture.
CYCLES_GROUP = "Light Group in the properties of the object (under Shading) or of the world"
CYCLES_UNGROUPED = "light that Fast GI Approximation of method Add adds (in the render properties)"
CYCLES_BEAUTY = "Combined under Passes in the properties of the view layer"

#: Characters that separate parts of a name.
SEPARATORS = " ._-"


@dataclass(frozen=True)
class Convention:
    """The naming convention of a family of renderers.

    layer: matches the whole name of a layer; its group `name` is the light, `view` the view layer,
    and `prefix` distinguishes lights with the same name.
    beauty: name of the picture that the lights add up to, without the view layer; tried before
    BEAUTY_NAMES.
    whole: name of a group that contains all lights, if the renderer has one.
    optional: layers, in lower case, that belong to the sum in some versions and settings.
    light: template for the name of a light.
    joint: what stands between a view layer and the rest of a name.
    group_setting: the renderer's setting for the group of a light.
    beauty_setting: its setting for writing the whole picture beside the groups.
    ungrouped: light that it writes into no group, and what leads to it.
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
    ungrouped: str = ""


CONVENTIONS = (
    Convention(
        "Blender Cycles",
        re.compile(VIEW_PATTERN + r"Combined_(?P<name>.+)"),
        "Combined",
        group_setting=CYCLES_GROUP,
        beauty_setting=CYCLES_BEAUTY,
        ungrouped=CYCLES_UNGROUPED,
    ),
    Convention(
        # Nuke makes underscores of all characters but letters and digits, dots included.
        "Blender Cycles, written by Nuke",
        re.compile(r"(?!Combined_)(?P<view>\w+?)_Combined_(?P<name>\w+)", re.A),
        "Combined",
        joint="_",
        group_setting=CYCLES_GROUP,
        beauty_setting=CYCLES_BEAUTY,
        ungrouped=CYCLES_UNGROUPED,
    ),
    Convention(
        "Arnold",
        re.compile(VIEW_PATTERN + r"RGBA_(?P<name>.+)"),
        "RGBA",
        group_setting="AOV Light Group of the light",
        beauty_setting="an AOV RGBA",
    ),
    Convention(
        "Karma",
        re.compile(VIEW_PATTERN + r"C_(?P<name>.+)"),
        "C",
        group_setting="LPE Tag of the light",
        beauty_setting="Beauty in the Karma Render Settings",
    ),
    Convention(
        "RenderMan or Redshift",
        re.compile(VIEW_PATTERN + r"(?:[Bb]eauty|Ci)_(?P<name>.+)"),
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
        "LuxCore in Blender",
        re.compile(VIEW_PATTERN + r'LG \d+: "(?P<name>.+)"'),
        "Combined",
        group_setting="Light Group in the properties of the light, under LuxCore",
        beauty_setting=CYCLES_BEAUTY,
    ),
    Convention(
        "Radeon ProRender",
        re.compile(VIEW_PATTERN + r"Light[ _.]?Group[ _.]?(?P<name>\d+)", re.I),
        "Color",
        light="group_{name}",
        group_setting="Light Group of the light",
        beauty_setting="the AOV Color or Combined",
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
        re.compile(VIEW_PATTERN + r"Light(?:[ _]?pass)?[ _](?P<name>\d+)", re.I),
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


def is_fixed_name(name: str) -> bool:
    """Return True if a known renderer gives this name to a layer of a light, and no user does: a
    number follows a fixed word, or it is of the `optional` ones.
    """
    return any(
        name.casefold() in convention.optional
        or (convention.light != NAME_FIELD and convention.layer.fullmatch(name))
        for convention in CONVENTIONS
    )


def is_beauty(name: str, *, view: str = "") -> bool:
    """Return True if the last component of a layer's name is one of BEAUTY_NAMES.

    view: the view layer that the name must begin with, if it has components before the last.
    """
    before, _, last = name.rpartition(".")
    return last.casefold() in BEAUTY_NAMES and (not view or not before or before == view)


def beauty_name(names: Iterable[str], *, first: str = "", view: str = "") -> str | None:
    """Return the name of the whole picture: `first`, or else one of BEAUTY_NAMES, alone or behind
    the view layer; None if absent.

    view: the view layer; "" if it is not known, so that a beauty of any will do.
    """
    known = [*names]
    candidates = [name for name in known if is_beauty(name, view=view)]
    by_folded = {name.casefold(): name for name in reversed(known)}
    if found := by_folded.get(first.casefold()) if first else None:
        return found

    def rank(name: str) -> tuple[bool, int]:
        before, _, last = name.rpartition(".")
        return before != view, BEAUTY_NAMES.index(last.casefold())

    return min(candidates, key=rank, default=None)


def short_names(stems: Sequence[str]) -> dict[str, str]:
    """Return names without their common start and end, cut at a separator or before a number:
    `shot_key_v1` → `key`, `key0001` → `key`.
    """
    if len(stems) < 2:
        return {stem: stem for stem in stems}
    head = _shared_head(stems)
    head = head[: max((head.rfind(joint) + 1 for joint in SEPARATORS), default=0)]
    trimmed_names = [stem[len(head) :] for stem in stems]
    tail = _shared_head([name[::-1] for name in trimmed_names])[::-1]
    starts = [k for joint in SEPARATORS if (k := tail.find(joint)) >= 0]
    if not starts:
        number = re.search(r"\d*$", tail)
        starts = (
            [number.start()] if number and not _is_part_of_number(trimmed_names, number) else []
        )
    tail = tail[min(starts) :] if starts else ""
    trimmed_names = [name.removesuffix(tail) for name in trimmed_names]
    return dict(zip(stems, trimmed_names if all(trimmed_names) else stems, strict=True))


def _is_part_of_number(names: Sequence[str], end: re.Match[str]) -> bool:
    """Return True if a digit stands before the end that all names share in one of them."""
    length = len(end[0])
    return any(name[: len(name) - length][-1:].isdigit() for name in names)


def _shared_head(names: Sequence[str]) -> str:
    """Return the common start of all names."""
    low, high = min(names), max(names)
    common_length = next(
        (k for k, (a, b) in enumerate(zip(low, high, strict=False)) if a != b), len(low)
    )
    return low[:common_length]
