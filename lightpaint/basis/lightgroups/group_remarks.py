"""Light that the groups of a file lack, and remarks on it for the user."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.lightgroups.beauty_comparison import (
    NEGLIGIBLE_SHARE,
    describe_sum,
    missing_and_exceeding,
    share_text,
)
from lightpaint.basis.lightgroups.layer_choice import ONE_FILE_PER_LIGHT
from lightpaint.basis.lightgroups.layer_roles import Roles
from lightpaint.basis.lightgroups.naming_conventions import convention_of
from lightpaint.basis.lightgroups.render_layers import RenderLayer
from lightpaint.basis.lights import free_name
from lightpaint.display_text import some_names

#: Name of the light that holds the missing part; underscores are added if a light has that name.
REST_NAME = "rest"

#: Share of the beauty in no group from which the user is told how to put lights into groups.
MIN_MISSING_SHARE = 1e-3


@dataclass(frozen=True)
class MissingLight:
    """The difference between the groups and the beauty.

    rest: (h, w, 3), None if it is within rounding. share, exceeding: shares of the beauty, None
    without one. remark: the difference in words.
    """

    rest: Floats | None
    share: float | None
    exceeding: float | None
    remark: str


def missing_light(roles: Roles, holes: npt.NDArray[np.bool_]) -> MissingLight:
    """Return what the groups lack of the beauty. holes: (h, w), pixels that count nothing."""
    lights, beauty = list(roles.lights.values()), roles.beauty
    if beauty is None:
        text = "no beauty among the layers, so it is unknown whether the groups add up to all of it"
        if roles.renderer == ONE_FILE_PER_LIGHT:
            text += ", and whether each of them is a light"
        elif setting := _setting(roles, "beauty"):
            text += f": render it with them ({setting})"
        return MissingLight(None, None, None, text)
    whole = without_holes(beauty.image, holes).astype(np.float64)
    rest = whole - sum(without_holes(layer.image, holes).astype(np.float64) for layer in lights)
    missing, exceeding = missing_and_exceeding(rest, whole)
    name = free_name(REST_NAME, roles.lights)
    if roles.noisy is not None:
        text = (
            f"the groups add up to {roles.noisy.name}; what denoising changed in {beauty.name}, "
            f"{share_text(max(missing, exceeding))} of its light, becomes the fixed light {name}"
        )
        return MissingLight(rest, missing, exceeding, text)
    text, is_missing = describe_sum(rest, whole, [*lights, beauty], missing, exceeding, name)
    setting = _setting(roles, "group")
    if is_missing and setting and missing > MIN_MISSING_SHARE and missing > exceeding:
        text += f"; a light in no group gets one by {setting}"
        if ungrouped := _setting(roles, "ungrouped"):
            text += f", but {ungrouped} is in none"
    return MissingLight(rest if is_missing else None, missing, exceeding, text)


def _setting(roles: Roles, of: Literal["group", "beauty", "ungrouped"]) -> str:
    """Return where the renderer is told the group of a light, or to write the beauty, or which
    light it writes into no group; "" if it is not known.
    """
    convention = convention_of(roles.renderer)
    if convention is None:
        return ""
    settings = {
        "group": convention.group_setting,
        "beauty": convention.beauty_setting,
        "ungrouped": convention.ungrouped,
    }
    return settings[of]


def without_holes(image: Floats, holes: npt.NDArray[np.bool_]) -> npt.NDArray[np.float32]:
    """Return a picture (h, w, 3) that is black in the holes (h, w)."""
    return np.where(holes[..., None], np.float32(0), image.astype(np.float32))


def remarks_on_black(lights: Mapping[str, RenderLayer], missing: float | None) -> list[str]:
    """Return a sentence on lights that are black in the file, with the likely reason."""
    black = [name for name, layer in lights.items() if not layer.image.any()]
    if not black:
        return []
    text = f"the file holds nothing of {some_names(black)}: black in every pixel, so fixed"
    if missing is None or missing <= NEGLIGIBLE_SHARE:
        return [f"{text}; is the light off, or the group renamed?"]
    return [
        f"{text}; {share_text(missing)} of the light of the beauty is in no group: was the group "
        "renamed after its lights were given it?"
    ]


def remarks_on_passes(basis: Basis) -> list[str]:
    """Return a sentence on the passes used for denoising, if the file has any."""
    known_parts = ["albedo and normals"] if basis.features is not None else []
    known_parts += ["direct and indirect light"] if basis.indirect is not None else []
    return (
        [f"pictures are denoised by {' and by '.join(known_parts)} of the file"]
        if known_parts
        else []
    )
