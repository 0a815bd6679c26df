"""A basis from another renderer's light groups: layers of an EXR file that add up to the picture.

Weights multiply the rendered light, so 1, 1, 1 is the light as rendered. The part of the beauty
that no group contains becomes one more light, `rest`, which is not adjusted.

The frames of a shot have the same lights in all. `rest` may be negligible in one frame and not in
the next: a frame without one gets a black one.
"""

import hashlib
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.basis.light_basis import LIGHT_GROUPS, REST, Basis, Origin
from lightpaint.basis.lightgroups import beauty_comparison
from lightpaint.basis.lightgroups.denoising_passes import DenoisingPasses, split_passes
from lightpaint.basis.lightgroups.frame_sequence import FrameSequence
from lightpaint.basis.lightgroups.layer_roles import ONE_FILE_PER_LIGHT, Roles, roles_of
from lightpaint.basis.lightgroups.naming_conventions import convention_of
from lightpaint.basis.lightgroups.render_layers import RenderFile, RenderLayer, read_render
from lightpaint.basis.lights import BasisLight, Lights, free_name
from lightpaint.basis.planes import IndirectLight, Planes, as_planes
from lightpaint.basis.working_primaries import name_of_primaries, working_primaries
from lightpaint.colour import LUMINANCE
from lightpaint.display_text import short_repr, some_names
from lightpaint.errors import BasisError
from lightpaint.keywords import keywords
from lightpaint.sentences import Hint

#: Name of the light that holds the missing part; underscores are added if a light has that name.
REST_NAME = "rest"

#: Share of the beauty in no group from which a remark explains how to put lights into groups.
MIN_MISSING_SHARE = 1e-3

#: The unit of weights.
AS_RENDERED = "× as rendered"

#: Maximum negative light of a group, as a share of its positive light: filters have negative lobes.
MAX_NEGATIVE_SHARE = 0.25


@keywords()
@dataclass(frozen=True)
class LightGroups:
    """The light groups that `read_light_groups` returns.

    Attributes:
        basis: A light for each group, and `rest` last if the groups lack part of the beauty.
        path: The file or folder.
        renderer: The renderer whose naming convention the layers follow.
        layers: The layers of the groups, in the order of the lights and without `rest`. Their
            pixels are dropped, since the basis has them.
        beauty: The layer of the whole picture; None if the file has none.
        missing: Luminance of the beauty that the groups lack, summed over pixels, as a share of its
            total; None without a beauty.
        exceeding: Luminance by which the groups exceed the beauty, likewise.
        holes: (h, w) bool, pixels where a layer is not finite. They are 0 in all images of the
            basis, so that they do not contribute to any sum.
        remarks: Messages for the user, one sentence each.
        sequence: The frames of the shot of which this is one; None for a single picture.

    Examples:
        >>> groups = lp.read_light_groups("groups.exr")
        >>> lp.solve(groups.basis, lp.Target.of(groups.basis.image("key")))
        Solution(closest there is ...)
    """

    basis: Basis
    path: Path
    renderer: str
    layers: tuple[RenderLayer, ...]
    beauty: RenderLayer | None
    missing: float | None
    exceeding: float | None
    holes: npt.NDArray[np.bool_]
    remarks: tuple[str, ...]
    sequence: FrameSequence | None = None

    __repr__ = short_repr

    @property
    def has_rest(self) -> bool:
        """True if the last light of the basis is the part of the beauty that the groups lack."""
        return len(self.basis.lights) > len(self.layers)

    @property
    def name(self) -> str:
        """Name of the file, the folder, or the sequence of frames."""
        return self.path.name if self.sequence is None else Path(self.sequence.pattern).name

    @property
    def files(self) -> list[Path]:
        """The files that were read."""
        read = self.layers if self.beauty is None else (*self.layers, self.beauty)
        return list(dict.fromkeys(layer.file for layer in read))

    @property
    def is_half(self) -> bool:
        """True if all layers are stored as float16."""
        return all(layer.is_half for layer in self.layers)


@keywords()
def read_light_groups(
    path: str | Path, *, pattern: str | None = None, leave_out: Iterable[str | Path] = ()
) -> LightGroups:
    """Read the light groups of an EXR file, or of a folder with one file for each group.

    Args:
        path: EXR file or folder. In a folder, hidden files, lightpaint's own output and recognised
            paintings are skipped; `remarks` lists them.
        pattern: Pattern of the layers, parts or files that are lights, such as `Light_{name}`; by
            default the names that known renderers use.
        leave_out: Files of the folder that are not lights, such as the painting.

    Raises:
        ImageError: If a file cannot be read or is not linear Rec.709.
        BasisError: If the lights cannot be identified, or differ in size.

    Examples:
        >>> groups = lp.read_light_groups("groups.exr")
        >>> groups.renderer, groups.basis.names
        ('Arnold', ('fill', 'key', 'rim'))
    """
    path = Path(path)
    read = read_render(path, leave_out=leave_out)
    candidates, passes = split_passes(read.layers)
    return _light_groups(path, roles_of(path, candidates, pattern), passes, read)


def _remark_on_primaries(primaries: tuple[float, ...]) -> str:
    """Return a sentence on a file of other primaries than Rec.709."""
    worked_in = working_primaries(primaries)
    if not worked_in:
        return (
            "the file has other primaries than Rec.709, in which no renderer is known to work: "
            "multipliers are for linear Rec.709"
        )
    name, own = name_of_primaries(primaries), name_of_primaries(worked_in)
    place = "it" if name == own else own
    return f"the file is linear {name}: lights are multiplied in {place}, as its renderer does"


def _check_light(
    path: Path, lights: Mapping[str, RenderLayer], holes: npt.NDArray[np.bool_]
) -> None:
    """Raise BasisError if a group has much negative light, which would make every result
    useless.
    """
    for name, layer in lights.items():
        light = np.where(holes, 0, layer.image.astype(np.float32) @ LUMINANCE)
        light_given, light_taken = float(light[light > 0].sum()), -float(light[light < 0].sum())
        if light_taken > MAX_NEGATIVE_SHARE * light_given:
            part = (
                f"{light_taken / light_given:.2g} times what it gives"
                if light_given
                else "and gives none"
            )
            raise BasisError(
                f"{path}: the light group {name!r} takes light away, {part}, which no light does: "
                "render it again, or leave it out (",
                Hint("pattern"),
                ")",
            )


def _light_groups(
    path: Path, roles: Roles, passes: DenoisingPasses, render: RenderFile
) -> LightGroups:
    """Return the light groups in layers with known roles. render: the layers were read from it."""
    names, lights, beauty = list(roles.lights), list(roles.lights.values()), roles.beauty
    if not lights:
        raise BasisError(f"{path} has no light group beside its beauty {beauty and beauty.name!r}")
    read = [*lights, beauty] if beauty is not None else lights
    holes = ~np.logical_and.reduce([np.isfinite(x.image).all(axis=-1) for x in read])
    if holes.all():
        raise BasisError(f"{path} holds NaN or Inf in every pixel: render it again")
    _check_light(path, roles.lights, holes)
    missing = missing_light(roles, holes)
    remark = f"light groups named as in {roles.renderer}: {some_names(names)}"
    if beauty is not None:
        remark += f"; the whole picture: {beauty.name or 'R, G, B'}"
    remarks = [*render.remarks, remark, *roles.remarks, missing.remark]
    remarks += _remarks_on_black(roles.lights, missing.share)
    if lights[0].primaries is not None:
        remarks.append(_remark_on_primaries(lights[0].primaries))
    if holes.any():
        remarks.append(f"{int(holes.sum())} pixels hold NaN or Inf in a layer and count nothing")
    basis = _basis(path, roles, passes, missing.rest, holes)
    basis = replace(basis, objects=render.objects)
    remarks += _remarks_on_passes(basis)
    without_pixels = np.empty((0, 0, 3))
    layers = [replace(x, image=without_pixels.astype(x.image.dtype)) for x in lights]
    return LightGroups(
        basis,
        path,
        roles.renderer,
        tuple(layers),
        beauty,
        missing.share,
        missing.exceeding,
        holes,
        tuple(remarks),
    )


def _basis(
    path: Path,
    roles: Roles,
    passes: DenoisingPasses,
    rest: Floats | None,
    holes: npt.NDArray[np.bool_],
) -> Basis:
    """Return the basis in linear Rec.709, with `rest`, if given, as a fixed light."""
    lights = roles.lights
    basis_lights = [_light(name, layer.name, "light group") for name, layer in lights.items()]
    height, width = holes.shape
    first = next(iter(lights.values()))
    # What other primaries change is added to the rest.
    primaries = working_primaries(first.primaries)
    has_rest = rest is not None or bool(primaries)
    images = np.empty((len(lights) + has_rest, height, width, 3), np.float32)
    for image, layer in zip(images, lights.values(), strict=False):
        image[:] = layer.in_rec709(_without_holes(layer.image, holes))
    if has_rest:
        basis_lights.append(_rest_light(lights))
        images[-1] = 0.0 if rest is None else first.in_rec709(rest)
    unknown_noise = as_planes(np.zeros_like(images))
    indirect = _indirect_planes(roles, passes, images, holes)
    return Basis(
        lights=Lights(tuple(basis_lights)),
        planes=as_planes(images),
        noise=unknown_noise,
        emitters_seen=np.zeros(holes.shape, dtype=bool),
        origin=replace(_origin(path, roles, images, [*lights]), primaries=primaries),
        features=passes.features(roles.view),
        indirect=None if indirect is None else IndirectLight(as_planes(indirect), unknown_noise),
    )


def _indirect_planes(
    roles: Roles, passes: DenoisingPasses, images: Floats, holes: npt.NDArray[np.bool_]
) -> Floats | None:
    """Return indirect light, (n, h, w, 3), equal to the whole image where the parts are unknown;
    None if they are unknown for all lights.
    """
    parts = [passes.indirect.get(layer.name) for layer in roles.lights.values()]
    if all(part is None for part in parts):
        return None
    indirect = images.copy()
    for plane, part, layer in zip(indirect, parts, roles.lights.values(), strict=False):
        if part is not None:
            plane[:] = layer.in_rec709(_without_holes(part, holes))
    return indirect


def _rest_light(names: Collection[str]) -> BasisLight:
    """Return the light that holds what the lights of these names lack of the beauty."""
    name = free_name(REST_NAME, names)
    return _light(name, "beauty less the groups", REST, is_fixed=True)


def _light(name: str, layer: str, plugin: str, *, is_fixed: bool = False) -> BasisLight:
    form = layer if layer != name else ""
    return BasisLight(name, plugin, "", AS_RENDERED, (1.0, 1.0, 1.0), form, is_fixed=is_fixed)


def _origin(path: Path, roles: Roles, images: Floats, names: Sequence[str]) -> Origin:
    """Return an origin without samples: their number, and hence the noise, is unknown."""
    digest = hashlib.sha256(repr((names, images.shape)).encode())
    for image in images:
        digest.update(np.ascontiguousarray(image).data)
    return Origin(
        scene=path.name,
        scene_identity=digest.hexdigest()[:32],
        sensor=roles.view or "as rendered",
        seed=0,
        method=f"{LIGHT_GROUPS}{roles.renderer}",
        halves=(0, 0),
        passes=(0, 0),
    )


@dataclass(frozen=True)
class MissingLight:
    """The difference between the groups and the beauty, the picture with all lights.

    rest: (h, w, 3), the beauty less the sum of the groups; None if it is within rounding. share: of
    the beauty that the groups lack. exceeding: by how much of it they are brighter; both None
    without a beauty. remark: the difference in words.
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
    whole = _without_holes(beauty.image, holes).astype(np.float64)
    rest = whole - sum(_without_holes(layer.image, holes).astype(np.float64) for layer in lights)
    missing, exceeding = beauty_comparison.missing_and_exceeding(rest, whole)
    name = free_name(REST_NAME, roles.lights)
    if roles.noisy is not None:
        text = (
            f"the groups add up to {roles.noisy.name}; what denoising changed in {beauty.name}, "
            f"{beauty_comparison.share_text(max(missing, exceeding))} of its light, becomes the "
            f"fixed light {name}"
        )
        return MissingLight(rest, missing, exceeding, text)
    text, is_missing = beauty_comparison.describe_sum(
        rest, whole, [*lights, beauty], missing, exceeding, name
    )
    setting = _setting(roles, "group")
    if is_missing and setting and missing > MIN_MISSING_SHARE and missing > exceeding:
        text += f"; a light in no group gets one by {setting}"
        if ungrouped := _setting(roles, "ungrouped"):
            text += f", but {ungrouped} is in none"
    return MissingLight(rest if is_missing else None, missing, exceeding, text)


def _setting(roles: Roles, of: Literal["group", "beauty", "ungrouped"]) -> str:
    """Return the renderer's setting for the group of a light, its setting for writing the beauty,
    or the light that it writes into no group; "" if it is not known.
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


def _without_holes(image: Floats, holes: npt.NDArray[np.bool_]) -> npt.NDArray[np.float32]:
    """Return a picture (h, w, 3) that is black in the holes (h, w)."""
    return np.where(holes[..., None], np.float32(0), image.astype(np.float32))


def _remarks_on_black(lights: Mapping[str, RenderLayer], missing: float | None) -> list[str]:
    """Return a sentence on lights that are black in the file, with the likely reason."""
    black = [name for name, layer in lights.items() if not layer.image.any()]
    if not black:
        return []
    text = f"the file holds nothing of {some_names(black)}: black in every pixel, so fixed"
    if missing is None or missing <= beauty_comparison.NEGLIGIBLE_SHARE:
        return [f"{text}; is the light off, or the group renamed?"]
    return [
        f"{text}; {beauty_comparison.share_text(missing)} of the light of the beauty is in no "
        "group: was the group renamed after its lights were given it?"
    ]


def _remarks_on_passes(basis: Basis) -> list[str]:
    """Return a sentence on the passes used for denoising, if the file has any."""
    known_parts = ["albedo and normals"] if basis.features is not None else []
    known_parts += ["direct and indirect light"] if basis.indirect is not None else []
    return (
        [f"pictures are denoised by {' and by '.join(known_parts)} of the file"]
        if known_parts
        else []
    )


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
    return [frame if frame.has_rest else _with_black_rest(frame) for frame in frames]


def first_frame(
    sequence: FrameSequence, pattern: str | None = None, *, has_rest: bool
) -> LightGroups:
    """Return the light groups of the first frame of a shot, for exports of all of it.

    pattern: as of `read_light_groups`. has_rest: whether the answer has a `rest`, which this frame
    may lack.
    """
    groups = read_light_groups(sequence.path(sequence.frames[0]), pattern=pattern)
    groups = replace(groups, sequence=sequence)
    return _with_black_rest(groups) if has_rest and not groups.has_rest else groups


def group_names(groups: LightGroups) -> tuple[str, ...]:
    """Return the names of the groups, in their order, without `rest`."""
    return groups.basis.names[: len(groups.layers)]


def _with_black_rest(groups: LightGroups) -> LightGroups:
    """Return groups that add up to the whole picture with a `rest` that is black."""
    basis, indirect = groups.basis, groups.basis.indirect
    noise = as_planes(np.zeros((len(basis.lights) + 1, *basis.size, 3), np.float32))
    with_rest = replace(
        basis,
        lights=Lights((*basis.lights, _rest_light(basis.names))),
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
