"""Parts of a basis file: lights, visible emitters, the guide table and the surface features, with
their checksums, which detect that another program has changed the file.

OpenEXR's own compression detects damage, but not a part that was painted over, converted to half,
cropped or replaced, and written again. The header of the first part has, as the text attribute
`lightpaint.checksums`, the CRC-32s of every light (header text and pixels together), of the origin
and of the mask of seen emitters. A file without this attribute is read unchecked.

Bases of many lights have parts that hold only the lit pixels of a light. The numbers of the lit
pixels follow one another, in row-major order, in rows as wide as the picture. `step` is the
distance in pixels from the previous lit pixel, or from the pixel before the first one; 0 ends the
list. Half differences are stored as ratios to their image, of which most are 1 or −1, since most
pixels of noisy lights are lit by one half of the samples alone.
"""

import json
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lightpaint.arrays import Floats, Indices
from lightpaint.basis.file import half_floats, light_channels
from lightpaint.basis.file.deferred_planes import loaded
from lightpaint.basis.file.half_floats import HALF, EncodedPlane, PlaneEncoding
from lightpaint.basis.file.light_channels import PLANE_CHANNELS, has_indirect_channels, is_lit_part
from lightpaint.basis.file.lit_planes import LitPlane, LitPlanes
from lightpaint.basis.file.noise_rounding import MANY_LIGHTS, noise_ratios, round_to_noise
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.lights import BasisLight, free_name
from lightpaint.basis.planes import Planes
from lightpaint.errors import BasisError
from lightpaint.files import one_line
from lightpaint.images import Features, Objects
from lightpaint.images.formats import Channels, ExrPart, PartLayout, rgb_channels
from lightpaint.storage.json_records import fields_of, read_record, strict_json

VISIBLE_EMITTERS_PART = "emitters seen"
GUIDE_PART = "learned"
FEATURES_PART, FEATURES_KEY = "features", "lightpaint.features"
OBJECTS_PART, OBJECTS_KEY, NAMES_KEY = "objects", "lightpaint.objects", "lightpaint.names"

EXTRA_PART, EXTRA_KEY = "extra samples", "lightpaint.extra"

LIGHT_KEY, SCALE_KEY = "lightpaint.light", "lightpaint.scale"

#: Maximum number of extra samples of a pixel, up to which float32 holds integers exactly.
MAX_EXTRA = 2**24

#: Range of the scale of a stored plane.
LEAST_SCALE, LARGEST_SCALE = 2.0**-126, 2.0**126

CHECKSUMS_KEY = "lightpaint.checksums"

#: Largest step, up to which half floats hold integers exactly. Where no pixel is lit for longer,
#: black ones stand in between.
MAX_STEP = 2**11


@dataclass(frozen=True)
class Checksums:
    """The checksums of a basis. lights: by name, in the order of the lights. learned: the checksum
    of the guide table.
    """

    lights: Mapping[str, str]
    origin: str
    seen: str
    learned: str = ""

    def text(self) -> str:
        """Return the text for the header."""
        return json.dumps(vars(self), ensure_ascii=False)

    @classmethod
    def of_text(cls, text: str) -> "Checksums":
        """Read what `text` returned. Raises ValueError for anything else."""
        return read_record(cls, strict_json(text))

    def in_order(self, names: Sequence[str]) -> list[int]:
        """Return the indices of `names` in the order in which the lights were written.

        Raises BasisError if a light is missing, duplicated, or was not written with the others.
        """
        if missing := [name for name in self.lights if name not in names]:
            raise BasisError(f"has lost the light {one_line(missing[0])!r}: make it again")
        if new := [name for name in names if name not in self.lights]:
            raise BasisError(
                f"has the light {one_line(new[0])!r}, which was not written with the others: "
                "remove it"
            )
        if len(names) > len(self.lights):
            repeated_name = next(name for name in names if names.count(name) > 1)
            raise BasisError(
                f"has the light {one_line(repeated_name)!r} more than once: remove one"
            )
        return [list(names).index(name) for name in self.lights]


def checksum(text: str, channels: Channels) -> str:
    """Return the CRC-32 of a text and of pixels with their sizes, types and names, as eight
    hexadecimal digits.
    """
    crc = zlib.crc32(text.encode())
    for name in sorted(channels):
        pixels = np.ascontiguousarray(channels[name])
        crc = zlib.crc32(repr((name, pixels.shape, pixels.dtype.str)).encode(), crc)
        crc = zlib.crc32(pixels.data, crc)
    return f"{crc:08x}"


def check(expected: str, part: str, text: str, channels: Channels) -> None:
    """Raise BasisError unless text and pixels match the checksum that was stored for them."""
    if checksum(text, channels) == expected:
        return
    raise BasisError(
        f"has a changed {part}: another program has edited or converted the "
        "file; use the original, or make it again with lightpaint basis"
    )


def plane_sets(basis: Basis) -> list[Planes]:
    """Return the sets of planes that are stored, in the order of `PLANE_CHANNELS`."""
    sets = [basis.planes, basis.noise]
    if basis.indirect is not None:
        sets += [basis.indirect.planes, basis.indirect.noise]
    return sets


def stored_planes_of(basis: Basis, k: int) -> list[half_floats.EncodedPlane | LitPlane]:
    """Return the planes of light k as they are stored, in the order of `PLANE_CHANNELS`."""
    sets = [loaded(planes) for planes in plane_sets(basis)]
    if all(isinstance(planes, half_floats.EncodedPlanes | LitPlanes) for planes in sets):
        return [x.stored(k) for x in sets if isinstance(x, half_floats.EncodedPlanes | LitPlanes)]
    planes = [plane_set.plane(k) for plane_set in sets]
    if len(basis.lights) >= MANY_LIGHTS and (rounded := round_to_noise(planes)) is not None:
        return [*rounded]
    pairs = zip(planes[::2], planes[1::2], strict=True)
    return [encoded for pair in pairs for encoded in half_floats.encode_pair(*pair)]


def light_texts(light: BasisLight, scales: Sequence[float]) -> dict[str, str]:
    """Return the text attributes for the part of a light. scales: of its planes."""
    data = fields_of(light, "is_fixed", "unit_flux", "identity", "is_outside_gamut", "lamp")
    if light.members == (light.name,):
        del data["members"]  # the default for a single emitter
    texts = {LIGHT_KEY: json.dumps(data, ensure_ascii=False)}
    if any(scale != 1 for scale in scales):
        texts[SCALE_KEY] = json.dumps([*scales])
    return texts


def all_channels(planes: Sequence[half_floats.EncodedPlane]) -> Channels:
    """Return the channels of a light with all pixels of its planes, in the order of
    `PLANE_CHANNELS`.
    """
    return {
        name: numbers
        for plane, names in zip(planes, PLANE_CHANNELS, strict=False)
        for name, numbers in zip(names, plane.numbers, strict=True)
    }


def checked_text(texts: Mapping[str, str]) -> str:
    """Return the text that enters the checksum of a light, besides its pixels."""
    return texts[LIGHT_KEY] + texts.get(SCALE_KEY, "")


def scales_of(texts: Mapping[str, str]) -> tuple[float, ...]:
    """Return the scales of the stored planes of a light, in the order of `PLANE_CHANNELS`.

    Raises BasisError for anything but two or four numbers above 0.
    """
    scales = strict_json(texts.get(SCALE_KEY, "[1, 1, 1, 1]"))
    if isinstance(scales, list) and len(scales) in (2, 4) and all(map(_is_scale, scales)):
        return (*map(float, scales), 1.0, 1.0)[:4]
    raise BasisError(f"is a damaged basis: {SCALE_KEY} is {one_line(repr(scales))}")


def _is_scale(scale: object) -> bool:
    return type(scale) in (int, float) and LEAST_SCALE <= scale <= LARGEST_SCALE  # type: ignore[operator]


def picture_size(part: ExrPart | PartLayout) -> tuple[int, int] | None:
    """Return (height, width) of the planes in the part of a light; None if it is cropped, or has a
    margin.
    """
    display = part.display or part.size
    is_whole = part.size[1] == display[1] if is_lit_part(part.channels) else part.size == display
    return display if is_whole else None


def planes_of_part(
    part: ExrPart, scales: Sequence[float]
) -> list[half_floats.EncodedPlane | LitPlane]:
    """Return the planes of a light as they are stored, in the order of `PLANE_CHANNELS`.

    Raises BasisError if the part lacks channels, or is damaged.
    """
    if is_lit_part(part.channels):
        return [*read_lit_planes(part.channels, scales, part.display or part.size)]
    count = 4 if has_indirect_channels(part.channels) else 2
    for name in (name for names in PLANE_CHANNELS[:count] for name in names):
        if name not in part.channels:
            raise BasisError(f"no channel {name} in part {part.name!r}")
    return [
        half_floats.encoded_plane([part.channels[name] for name in names], scale)
        for names, scale in zip(PLANE_CHANNELS[:count], scales, strict=False)
    ]


def other_parts(basis: Basis) -> Iterator[ExrPart]:
    """Yield all parts except the parts of the lights, beginning with the visible emitters."""
    seen_channel = {"Y": basis.emitters_seen.astype(np.float16)}
    # OpenEXR requires unique part names, and a light may already have this one.
    yield ExrPart(free_name(VISIBLE_EMITTERS_PART, basis.names), seen_channel)
    if basis.guide_table is not None:
        guide_table = dict(zip(("received", "asked"), basis.guide_table, strict=True))
        # A table rather than a picture, but OpenEXR requires one display window for all parts.
        yield ExrPart(free_name(GUIDE_PART, basis.names), guide_table, display=basis.size)
    if basis.features is not None:
        channels = _feature_channels(basis.features)
        about_them = {FEATURES_KEY: checksum("", channels)}
        yield ExrPart(free_name(FEATURES_PART, basis.names), channels, about_them)
    if basis.objects is not None:
        names_text = json.dumps(basis.objects.names, ensure_ascii=False)
        # Integers small enough for float32.
        index = {"index": basis.objects.index.astype(np.float32)}
        about_it = {NAMES_KEY: names_text, OBJECTS_KEY: checksum(names_text, index)}
        yield ExrPart(free_name(OBJECTS_PART, basis.names), index, about_it)
    if basis.extra is not None:
        counts = {"samples": basis.extra.astype(np.float32)}
        about_it = {EXTRA_KEY: checksum("", counts)}
        yield ExrPart(free_name(EXTRA_PART, basis.names), counts, about_it)


def fields_of_others(
    others: Sequence[ExrPart], checksums: Checksums | None, size: tuple[int, int]
) -> dict[str, Any]:
    """Return the fields of a `Basis` that have a part each in the file, by name.

    size: (height, width) of its planes. Raises BasisError if a part that cannot be left out is
    damaged.
    """
    return {
        "guide_table": guide_table_of(others, checksums),
        "features": features_of(others, size),
        "objects": objects_of(others, size),
        "extra": extra_of(others, size),
    }


def guide_table_of(others: Sequence[ExrPart], checksums: Checksums | None) -> Floats | None:
    """Return the table of the emitter guide; None if it is missing or damaged, since it is
    optional.
    """
    for channels in (p.channels for p in others if {"received", "asked"} <= p.channels.keys()):
        if checksums is not None and checksum("", channels) != checksums.learned:
            return None
        return np.stack([channels["received"], channels["asked"]])
    return None


def _feature_channels(features: Features) -> Channels:
    """Return the channels of the features: positions in float32, all others in half floats."""
    albedo = rgb_channels(features.albedo, "albedo")
    channels = {
        x: y.astype(np.float16) for x, y in (albedo | _xyz(features.normal, "normal")).items()
    }
    return channels if features.position is None else channels | _xyz(features.position, "position")


def _xyz(vectors: Floats, name: str) -> dict[str, Floats]:
    return {f"{name}.{c}": vectors[..., k] for k, c in enumerate("XYZ")}


def features_of(others: Sequence[ExrPart], size: tuple[int, int]) -> Features | None:
    """Return albedo, normals and, except from files of an earlier version, positions.

    None if they are missing or damaged, since they are optional.
    """
    for part in (p.in_display_window() for p in others if FEATURES_KEY in p.attributes):
        channels = part.channels
        if checksum("", channels) != part.attributes[FEATURES_KEY] or part.size != size:
            return None
        normal, position = (
            np.stack([channels[f"{name}.{c}"] for c in "XYZ"], axis=-1).astype(np.float32)
            if f"{name}.X" in channels
            else None
            for name in ("normal", "position")
        )
        return None if normal is None else Features(part.rgb("albedo"), normal, position)
    return None


def objects_of(others: Sequence[ExrPart], size: tuple[int, int]) -> Objects | None:
    """Return the map of objects; None if it is missing or damaged, since it is optional."""
    for part in (p.in_display_window() for p in others if OBJECTS_KEY in p.attributes):
        names_text = part.attributes.get(NAMES_KEY, "")
        if checksum(names_text, part.channels) != part.attributes[OBJECTS_KEY] or part.size != size:
            return None
        names = strict_json(names_text)
        if not (isinstance(names, list) and all(isinstance(name, str) for name in names)):
            return None
        return Objects(part.channels["index"].astype(np.int32), tuple(names))
    return None


def extra_of(others: Sequence[ExrPart], size: tuple[int, int]) -> Indices | None:
    """Return the numbers of extra samples; None if the file has none.

    Raises BasisError if they are damaged, because they weight the means of samples.
    """
    for part in (p.in_display_window() for p in others if EXTRA_KEY in p.attributes):
        counts = part.channels.get("samples", np.full(1, np.nan))
        is_whole = checksum("", part.channels) == part.attributes[EXTRA_KEY] and part.size == size
        if not (is_whole and (counts >= 0).all() and (counts <= MAX_EXTRA).all()):
            raise BasisError("its numbers of extra samples are damaged")
        return counts.astype(np.intp)
    return None


def as_lit_plane(plane: EncodedPlane | LitPlane) -> LitPlane:
    """Return the lit pixels of a plane."""
    return plane if isinstance(plane, LitPlane) else LitPlane.of([*plane.numbers], plane.scale)


def as_lit_planes(planes: Sequence[EncodedPlane | LitPlane]) -> list[LitPlane]:
    """Return the planes of a light with the same lit pixels."""
    lit = [as_lit_plane(plane) for plane in planes]
    pixels = lit[0].pixels
    if all(x.pixels is pixels or np.array_equal(x.pixels, pixels) for x in lit):
        return lit
    merged = np.sort(np.concatenate([x.pixels for x in lit]), kind="stable")
    is_new = np.ones(merged.size, bool)
    np.not_equal(merged[1:], merged[:-1], out=is_new[1:])
    return [x.at(merged[is_new]) for x in lit]


def as_encoded_plane(plane: EncodedPlane | LitPlane, size: tuple[int, int]) -> EncodedPlane:
    """Return a plane with all its pixels."""
    if isinstance(plane, EncodedPlane):
        return plane
    numbers = plane.at_its_pixels(size[0] * size[1])
    encoding = PlaneEncoding(plane.numbers.dtype, plane.scale)
    return EncodedPlane(encoding, numbers.reshape(3, *size))


def lit_channels(
    planes: Sequence[EncodedPlane | LitPlane], size: tuple[int, int]
) -> Channels | None:
    """Return the channels of a part with the lit pixels of a light; None if they do not hold its
    planes exactly.
    """
    lit = as_lit_planes(planes)
    pairs = list(zip(lit[::2], lit[1::2], strict=True))
    # Half differences that are read have the scale of their image.
    if any(x.numbers.dtype != HALF for x in lit) or any(x.scale != y.scale for x, y in pairs):
        return None
    steps = np.diff(lit[0].pixels.astype(np.intp), prepend=-1)
    places = np.cumsum(-(-steps // MAX_STEP)) - 1  # with the black pixels in between
    count, width = int(places[-1]) + 1 if places.size else 0, size[1]
    rows = max(1, -(-count // width))
    listed = np.zeros(rows * width, HALF)
    listed[:count] = MAX_STEP
    listed[places] = steps - MAX_STEP * (-(-steps // MAX_STEP) - 1)
    channels = {light_channels.STEP: listed.reshape(rows, width)}
    for (image, noise), prefixes in zip(pairs, light_channels.PREFIXES, strict=False):
        ratios = noise_ratios(image.numbers, noise.numbers)
        if ratios is None:
            return None
        for prefix, numbers in zip(prefixes, (image.numbers, ratios), strict=True):
            for c, values in zip("RGB", numbers, strict=True):
                channel = np.zeros(rows * width, HALF)
                channel[places] = values
                channels[prefix + c] = channel.reshape(rows, width)
    return channels


def read_lit_planes(
    channels: Channels, scales: Sequence[float], size: tuple[int, int]
) -> list[LitPlane]:
    """Return the planes that a part with lit pixels holds, in the order of `PLANE_CHANNELS`.

    Raises BasisError if it is damaged.
    """
    pixels = light_channels.lit_pixels(channels[light_channels.STEP].reshape(-1), size)
    planes = []
    has_indirect = channels.keys() >= light_channels.LIT_CHANNELS
    for k, (first, second) in enumerate(
        light_channels.PREFIXES if has_indirect else light_channels.PREFIXES[:1]
    ):
        light, ratios = (
            np.stack([channels[prefix + c].reshape(-1)[: pixels.size] for c in "RGB"])
            for prefix in (first, second)
        )
        planes.append(LitPlane(pixels, light, scales[2 * k]))
        planes.append(LitPlane(pixels, light_channels.noise_numbers(light, ratios), scales[2 * k]))
    return planes
