"""Light groups of several frames of a shot: the same lights in all, one light apart.

Light in no group, `rest`, may be negligible in one frame and not in the next. A frame without one
gets a black one, so that all frames have the same lights.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lightpaint.basis.lightgroups.frame_sequence import FrameSequence
from lightpaint.basis.lightgroups.light_groups import LightGroups, read_light_groups, rest_light
from lightpaint.basis.lights import Lights
from lightpaint.basis.planes import IndirectLight, Planes, as_planes
from lightpaint.display_text import some_names
from lightpaint.errors import BasisError


def with_equal_lights(frames: Sequence[LightGroups]) -> list[LightGroups]:
    """Return the groups of each frame with the same lights.

    Raises BasisError if frames differ in groups, in their order, or in size.
    """
    first = frames[0]
    names, size = group_names(first), first.basis.size
    for frame in frames[1:]:
        if group_names(frame) != names:
            raise BasisError(_difference(first, frame))
        if frame.basis.size != size:
            raise BasisError(
                f"{frame.path} is {_size(frame)} but {first.path} is {_size(first)}: the frames of "
                "a shot must have the same size"
            )
    if not any(frame.has_rest for frame in frames):
        return list(frames)
    return [frame if frame.has_rest else with_black_rest(frame) for frame in frames]


def first_frame(
    sequence: FrameSequence, pattern: str | None = None, *, has_rest: bool
) -> LightGroups:
    """Return the light groups of the first frame of a shot, for exports of all of it.

    pattern: as of `read_light_groups`. has_rest: whether the answer has a `rest`, which this frame
    may lack.
    """
    groups = read_light_groups(sequence.path(sequence.frames[0]), pattern=pattern)
    groups = replace(groups, sequence=sequence)
    return with_black_rest(groups) if has_rest and not groups.has_rest else groups


def group_names(groups: LightGroups) -> tuple[str, ...]:
    """Return the names of the groups, in their order, without `rest`."""
    return groups.basis.names[: len(groups.layers)]


def with_black_rest(groups: LightGroups) -> LightGroups:
    """Return groups that add up to the whole picture with a `rest` that is black."""
    basis, indirect = groups.basis, groups.basis.indirect
    noise = as_planes(np.zeros((len(basis.lights) + 1, *basis.size, 3), np.float32))
    with_rest = replace(
        basis,
        lights=Lights((*basis.lights, rest_light(basis.names))),
        planes=_with_black(basis.planes),
        noise=noise,
        indirect=None if indirect is None else IndirectLight(_with_black(indirect.planes), noise),
    )
    return replace(groups, basis=with_rest)


def _with_black(planes: Planes) -> Planes:
    """Return planes with a black one at the end."""
    images = planes.array()
    return as_planes(np.concatenate([images, np.zeros_like(images[:1])]))


def _difference(first: LightGroups, other: LightGroups) -> str:
    """Return which groups one frame has and another lacks, as an error."""
    for lacking, whole in ((other, first), (first, other)):
        names = sorted(set(group_names(whole)) - set(group_names(lacking)))
        if names:
            return (
                f"{lacking.path} lacks the light groups {some_names(names)}, which {whole.path} "
                "has: render all frames with the same groups"
            )
    return f"{first.path} and {other.path} have their light groups in another order"


def _size(groups: LightGroups) -> str:
    height, width = groups.basis.size
    return f"{width}x{height}"
