"""Several views of a scene as one long picture, so that methods for one serve all.

Pixels of all views count the same, and neither the normal equations nor their noise depend on the
place of a pixel. Concatenated, the pixels of all views form one picture, so the solve, its error
bars and its refinement do not deal with views at all.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.basis import Basis, joined_planes
from lightpaint.display_text import some_names
from lightpaint.errors import BasisError
from lightpaint.images import Estimate
from lightpaint.target import Target

#: Pixels in a row of the long picture. Pixels without importance fill the last row.
ROW_PIXELS = 2**10


@dataclass(frozen=True)
class Views:
    """The views of one design: basis and target of each, and the layout of their pixels.

    The bases share the memory of the joint basis, so that every pixel is stored once.
    """

    bases: tuple[Basis, ...]
    targets: tuple[Target, ...]

    def __len__(self) -> int:
        return len(self.bases)

    def join(self, images: Sequence[npt.NDArray[Any]]) -> npt.NDArray[Any]:
        """Join images (h, w, …) of views into one, (rows, ROW_PIXELS, …); keep a single one."""
        return images[0] if len(self) == 1 else join_rows(images)

    def part(self, joint: npt.NDArray[Any], k: int) -> npt.NDArray[Any]:
        """Return view k of a joint image, (h, w, …), in the same memory."""
        if len(self) == 1:
            return joint
        height, width = self.bases[k].size
        start = sum(basis.emitters_seen.size for basis in self.bases[:k])
        pixels = joint.reshape(-1, *joint.shape[2:])[start : start + height * width]
        return pixels.reshape(height, width, *joint.shape[2:])


def joint_basis(bases: Sequence[Basis]) -> tuple[Basis, tuple[Basis, ...]]:
    """Return the basis of all views together, n long pictures, and the bases of the views.

    The returned bases share the memory of the joint one: after the given ones are dropped, every
    pixel is stored once. Raises BasisError if their lights are not the same.
    """
    first = bases[0]
    if len(bases) == 1:
        return first, (first,)
    for basis in bases[1:]:
        check_same_lights(first, basis)
    planes, views_planes = joined_planes([basis.planes for basis in bases], ROW_PIXELS)
    noise, views_noise = joined_planes([basis.noise for basis in bases], ROW_PIXELS)
    seen = join_rows([basis.emitters_seen for basis in bases])
    formers = [basis.former for basis in bases if basis.former is not None]
    former = joint_estimate(formers) if len(formers) == len(bases) else None
    joint = first.on_pixels(planes, noise, seen, former)
    views = tuple(
        replace(basis, planes=view_planes, noise=view_noise)
        for basis, view_planes, view_noise in zip(bases, views_planes, views_noise, strict=True)
    )
    return joint, views


def joint_estimate(estimates: Sequence[Estimate]) -> Estimate:
    """Return renders of all views in the shape of their joint basis."""
    if len(estimates) == 1:
        return estimates[0]
    return Estimate(
        join_rows([estimate.image for estimate in estimates]),
        join_rows([estimate.half_difference for estimate in estimates]),
    )


def join_rows(images: Sequence[npt.NDArray[Any]]) -> npt.NDArray[Any]:
    """Return images (h, w, …) as rows of one, (rows, ROW_PIXELS, …), with zeros at the end."""
    pixels = np.concatenate([x.reshape(-1, *x.shape[2:]) for x in images])
    fill = np.zeros((-len(pixels) % ROW_PIXELS, *pixels.shape[1:]), pixels.dtype)
    return np.concatenate([pixels, fill]).reshape(-1, ROW_PIXELS, *pixels.shape[1:])


def check_same_lights(a: Basis, b: Basis) -> None:
    """Raise BasisError unless two bases have the same lights, which do and emit the same."""
    if a.names != b.names:
        raise BasisError(
            f"the bases of {a.origin.sensor} and {b.origin.sensor} have different lights, "
            f"{some_names(a.names)} and {some_names(b.names)}: make both of one scene"
        )
    for first, second in zip(a.lights, b.lights, strict=True):
        for field in ("unit", "members", "is_fixed", "is_scalar", "emission"):
            if (value := getattr(first, field)) != (other_value := getattr(second, field)):
                raise BasisError(
                    f"light {first.name!r} has {_describe(field, value)} in the basis of "
                    f"{a.origin.sensor} and {_describe(field, other_value)} in the basis of "
                    f"{b.origin.sensor}: "
                    "make both of one scene as it is"
                )


def _describe(field: str, value: Any) -> str:
    """Return a property of a light as a noun."""
    if field == "is_fixed":
        return "no weight of its own" if value else "a weight of its own"
    if field == "is_scalar":
        return "one weight for all channels" if value else "a weight for each channel"
    if field == "emission":
        return "the emission " + " ".join(f"{v:g}" for v in value)
    return f"the {field} {value if isinstance(value, str) else some_names(value)}"
