"""The file of a basis: a multi-part OpenEXR file that other programs can open.

Part k is named after light k and holds its image as R, G, B; docs/formats.md has the details. A
file is read completely into memory or, if it is large, row by row on request.
"""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path

import numpy as np

from lightpaint.arrays import is_finite, release_freed_memory
from lightpaint.basis.file.deferred_planes import DeferredPlanes, LoadOnce
from lightpaint.basis.file.file_parts import (
    CHECKSUMS_KEY,
    LARGEST_SCALE,
    LIGHT_KEY,
    Checksums,
    all_channels,
    as_encoded_plane,
    as_lit_plane,
    check,
    checked_text,
    checksum,
    fields_of_others,
    light_texts,
    lit_channels,
    other_parts,
    picture_size,
    plane_sets,
    planes_of_part,
    scales_of,
    stored_planes_of,
)
from lightpaint.basis.file.file_planes import FilePlanes
from lightpaint.basis.file.half_floats import EncodedPlane, EncodedPlanes
from lightpaint.basis.file.light_channels import (
    INDIRECT_CHANNELS,
    LIGHT_CHANNELS,
    PLANE_CHANNELS,
    has_indirect_channels,
    is_lit_part,
)
from lightpaint.basis.file.lit_planes import MIN_LIGHTS, LitCollector, LitPlane, LitPlanes
from lightpaint.basis.file.noise_rounding import MANY_LIGHTS
from lightpaint.basis.light_basis import Basis, Origin
from lightpaint.basis.lights import BasisLight, Lights
from lightpaint.basis.plane_results import set_file_content
from lightpaint.basis.planes import IndirectLight, Planes, as_planes
from lightpaint.errors import BasisError, ImageError, LightpaintError
from lightpaint.files import file_length, one_line
from lightpaint.images.formats import (
    Channels,
    ExrPart,
    PartHead,
    PartLayout,
    RowFile,
    RowsUnsupportedError,
    read_headers,
    read_parts,
    room_for,
    write_streamed,
)
from lightpaint.keywords import keywords
from lightpaint.progress import with_progress
from lightpaint.storage.json_records import fields_of, read_record, strict_json
from lightpaint.threads import parallel_map

#: The written formats, of which the second has parts with only lit pixels, and an older one that is
#: still read, in which all planes are float32.
FORMAT, LIT_FORMAT, OLD_FORMAT = (f"lightpaint-basis {k}" for k in (2, 3, 1))
FORMATS = FORMAT, LIT_FORMAT, OLD_FORMAT
FORMAT_KEY = "lightpaint.format"
ORIGIN_KEY = "lightpaint.origin"

#: Size of all images in float32, in bytes, above which memory holds half floats: below it decoding
#: time matters more, above it memory.
SINGLES_MAX_BYTES = 2**27

#: Size of all planes in float32, in bytes, above which they stay in their file.
IN_MEMORY_MAX_BYTES = 2**31

#: The same for many lights, of which then only lit pixels are read into memory if these have room.
SPARSE_MIN_BYTES = 2**29

#: Maximum size in bytes of all pixels of images and noise in half floats, of many lights that light
#: most of them.
WHOLE_MAX_BYTES = 3 * 2**28

#: Maximum size in bytes of a basis file that the library reads in less than two seconds.
QUICK_MAX_BYTES = 2**29

#: Maximum size in bytes of indirect light, images and noise in half floats, that stays in memory.
INDIRECT_MAX_BYTES = 2**28

#: Level of ZIP of parts with lit pixels alone, whose numbers have few digits. The usual level saves
#: 5 to 9 % of the bytes, and takes half as much time again.
LIT_LEVEL = 1

#: Maximum size in bytes of a basis file that is read.
MAX_BYTES = 2**36

#: Exceptions raised by a header with unexpected content.
_HEADER_ERRORS = (AttributeError, LookupError, OverflowError, TypeError, ValueError)


@keywords()
def write_basis(path: str | Path, basis: Basis) -> None:
    """Write `basis` as a multi-part EXR file, atomically.

    Args:
        path: The file to write, by convention `*.basis.exr`.
        basis: The basis to write.

    Examples:
        >>> lp.write_basis("again.basis.exr", basis)
        >>> lp.read_basis("again.basis.exr").names
        ('panel', 'bulb')
    """
    # Newer fields are left out at their defaults, as in files that are older than these fields.
    later = ("each_light", "integrator", "is_composed", "extra_spp", "observer", "primaries")
    of_origin = json.dumps(fields_of(basis.origin, *later), ensure_ascii=False)
    others, sums, has_lit_parts = list(other_parts(basis)), dict[str, str](), list[bool]()

    def parts() -> Iterator[tuple[PartHead, Channels]]:
        for k, light in enumerate(with_progress(basis.lights, "lights")):
            planes = stored_planes_of(basis, k)
            texts = light_texts(light, [plane.scale for plane in planes])
            lit = lit_channels(planes, basis.size) if len(basis.lights) >= MANY_LIGHTS else None
            channels = lit or all_channels([as_encoded_plane(x, basis.size) for x in planes])
            has_lit_parts.append(lit is not None)
            sums[light.name] = checksum(checked_text(texts), channels)
            head = PartHead.of(light.name, channels, texts, display=basis.size)
            yield head if lit is None else replace(head, level=LIT_LEVEL), channels
        for part in others:
            head = PartHead.of(part.name, part.channels, part.attributes, display=part.display)
            yield head, part.channels

    def texts() -> dict[str, str]:
        seen_checksum = checksum("", others[0].channels)
        guide = "" if basis.guide_table is None else checksum("", others[1].channels)
        checksums = Checksums(sums, checksum(of_origin, {}), seen_checksum, guide)
        form = LIT_FORMAT if any(has_lit_parts) else FORMAT
        return {FORMAT_KEY: form, ORIGIN_KEY: of_origin, CHECKSUMS_KEY: checksums.text()}

    write_streamed(Path(path), parts(), room=_room(basis, others, of_origin), texts=texts)


def _room(basis: Basis, others: Sequence[ExrPart], of_origin: str) -> int:
    """Return an upper bound for the number of bytes before the first pixel of a basis file."""
    scales = [LARGEST_SCALE] * len(PLANE_CHANNELS)
    lights = [(light.name, light_texts(light, scales), basis.size[0]) for light in basis.lights]
    parts = [(part.name, part.attributes, part.size[0]) for part in others]
    checksums = Checksums(dict.fromkeys(basis.names, "0" * 8), *("0" * 8,) * 3)
    of_file = {FORMAT_KEY: FORMAT, ORIGIN_KEY: of_origin, CHECKSUMS_KEY: checksums.text()}
    return sum(room_for(*part) for part in (*lights, *parts, ("", of_file, 0)))


def as_stored(basis: Basis, keep: Callable[[Basis], object] = lambda basis: None) -> Basis:
    """Return `basis` with its planes rounded as `write_basis` stores them.

    Solving a basis that was just rendered then gives the same result as solving the one read back
    from its file. A large basis is returned with new planes in half floats. The planes of a small
    one, which must be in memory, are rounded in place.

    keep: called with the basis in stored encoding, which can be written without further rounding.
    """
    stored_basis = _encoded(basis)
    keep(stored_basis)
    if _is_encoded(len(basis.lights), basis.size):
        return stored_basis
    for planes, stored_planes in zip(plane_sets(basis), plane_sets(stored_basis), strict=True):
        if planes is not stored_planes:
            for plane, rounded in zip(planes, stored_planes, strict=True):
                plane[...] = rounded
    return basis.without_cached_values()


def _is_encoded(lights: int, size: tuple[int, int]) -> bool:
    """Return whether planes of this number of lights are held in memory in their file's
    encoding.
    """
    return 12 * lights * size[0] * size[1] > SINGLES_MAX_BYTES


def _encoded(basis: Basis) -> Basis:
    """Return `basis` with planes in the encoding of its file."""
    numbers = with_progress(range(len(basis.lights)), "lights")
    of_lights = (stored_planes_of(basis, k) for k in numbers)
    sets = [list(planes) for planes in zip(*of_lights, strict=True)]
    held = list[Planes]()
    while sets:  # one is gone before the next is joined
        held.append(_in_memory(sets.pop(0), basis.size, is_indirect=len(held) > 1))
        if is_large(len(basis.lights), basis.size):
            release_freed_memory()
    indirect = IndirectLight(*held[2:]) if held[2:] else None
    return replace(basis, planes=held[0], noise=held[1], indirect=indirect)


def _in_memory(
    planes: Sequence[EncodedPlane | LitPlane], size: tuple[int, int], *, is_indirect: bool
) -> Planes:
    """Return stored planes of a set as one: of many lights by their lit pixels, if these are few.

    Walks over indirect light are rare, and need no copy in float32.
    """
    count, whole_bytes = len(planes), 6 * size[0] * size[1]  # in half floats
    lit_bytes = sum(x.nbytes if isinstance(x, LitPlane) else whole_bytes for x in planes)
    if count >= MIN_LIGHTS and not is_indirect and lit_bytes < count * whole_bytes / 2:
        return LitPlanes([as_lit_plane(plane) for plane in planes], size)
    whole = [as_encoded_plane(plane, size) for plane in planes]
    return EncodedPlanes(whole, is_decoded_once=not is_indirect)


def is_large(lights: int, size: tuple[int, int]) -> bool:
    """Return whether planes of this number of lights stay in their file when it is read."""
    return _float_bytes(lights, size) > IN_MEMORY_MAX_BYTES


def _float_bytes(lights: int, size: tuple[int, int]) -> int:
    """Return the bytes that images and noise of this number of lights take in float32."""
    return 4 * len(LIGHT_CHANNELS) * lights * size[0] * size[1]


def is_basis_file(path: Path) -> bool:
    """Return True if `path` has the suffix of a basis file (EXR) rather than of a scene (XML)."""
    return path.suffix.lower() == ".exr"


@dataclass(frozen=True)
class _Parts:
    """The parts of a basis file, whether its pixels are in memory or not.

    head: attributes of the first part. texts: attributes of each light's part. channel_readers:
    functions that read the channels of each light's part, to check them; none if that is left for
    later. others: parts of no light. planes: function of an order of the parts and an index into
    `PLANE_CHANNELS` that returns those planes. has_indirect: whether the parts have planes of
    indirect light.
    """

    head: Mapping[str, str]
    texts: Sequence[Mapping[str, str]]
    channel_readers: Sequence[Callable[[], Channels]]
    others: Sequence[ExrPart]
    planes: Callable[[Sequence[int], int], Planes]
    has_indirect: bool

    def read_records(self) -> tuple[list[BasisLight], Origin, Checksums | None]:
        """Read lights, origin and checksums. Raises BasisError or one of _HEADER_ERRORS."""
        lights = [
            read_record(BasisLight, strict_json(attributes[LIGHT_KEY])) for attributes in self.texts
        ]
        origin = read_record(Origin, strict_json(self.head[ORIGIN_KEY]))
        text = self.head.get(CHECKSUMS_KEY)
        return lights, origin, None if text is None else Checksums.of_text(text)

    def check_pixels(self, lights: Sequence[BasisLight], checksums: Checksums | None) -> None:
        """Raise BasisError if a light's pixels are not finite or do not match their checksum."""
        names = LIGHT_CHANNELS | INDIRECT_CHANNELS if self.has_indirect else LIGHT_CHANNELS
        readers = with_progress(self.channel_readers, "lights")
        for light, texts, read in zip(lights, self.texts, readers, strict=True):
            channels = read()  # one light at a time, since together they may exceed memory
            its_names = channels if is_lit_part(channels) else names
            if not all(is_finite(channels[name]) for name in its_names):
                raise BasisError("holds values that are not finite: make it again")
            if checksums is not None:
                its_text = checked_text(texts)
                check(checksums.lights[light.name], f"light {light.name!r}", its_text, channels)


@keywords()
def read_basis(path: str | Path) -> Basis:
    """Read a basis file, even if another program has reordered its parts.

    Args:
        path: A file written by `write_basis` or the command line.

    Raises:
        ImageError: If the file is damaged.
        BasisError: If it is not a basis, or was changed after it was written.

    Examples:
        >>> lp.read_basis("room.basis.exr")
        Basis(2 lights, 16x16, 4 spp, of room.xml: panel, bulb)
    """
    path = Path(path)
    file_length(path, "image file", ImageError, limit=MAX_BYTES)
    try:
        if (large_basis := _read_large(path)) is not None:
            release_freed_memory()
            return replace(large_basis, source=str(path))
        parts = _read_by_lights(path) or read_parts(path)
        head = _head(p.attributes for p in parts)
        basis = replace(leave_indirect(_basis_of_parts(parts, head), path), source=str(path))
        _note_content(basis, head)
        del parts
        if path.stat().st_size > QUICK_MAX_BYTES:
            release_freed_memory()
        return basis
    except BasisError as error:
        raise BasisError(path, " ", error) from error
    except _HEADER_ERRORS as error:
        raise BasisError(f"{path} is a damaged basis: {one_line(str(error))}") from error
    except MemoryError:
        raise ImageError(f"{path} needs more memory than there is") from None


def leave_indirect(basis: Basis, path: Path) -> Basis:
    """Return `basis` with indirect planes that are read on demand from `path`, if they are large,
    since only denoised pictures need them.

    path: the file that holds exactly this basis; if it does not, or has another layout, `basis` is
    returned unchanged.
    """
    count, (height, width) = len(basis.lights), basis.size
    is_small = 12 * count * height * width <= INDIRECT_MAX_BYTES
    if basis.indirect is None or is_small or not _is_encoded(count, basis.size):
        return basis
    try:
        file = RowFile(path)
        light_parts = {
            strict_json(p.texts[LIGHT_KEY])["name"]: p for p in file.parts if LIGHT_KEY in p.texts
        }
        parts = [light_parts[name] for name in basis.names]
        origin = read_record(Origin, strict_json(_head(p.texts for p in file.parts)[ORIGIN_KEY]))
    except (RowsUnsupportedError, OSError, BasisError, *_HEADER_ERRORS):
        return basis
    if origin != basis.origin or any(picture_size(p) != basis.size for p in parts):
        return basis
    scales = [scales_of(p.texts) for p in parts]
    images, noise = (
        FilePlanes(file, parts, k, [light_scales[k] for light_scales in scales]) for k in (2, 3)
    )
    return replace(basis, indirect=IndirectLight(images, noise))


def _read_large(path: Path) -> Basis | None:
    """Return a basis whose rows are read on demand, or of which lit pixels are in memory.

    Returns None if all pixels fit in memory or the file does not support reading rows. Of many
    lights, whose dark pixels would take most of it, all pixels may take less.
    """
    try:
        file = RowFile(path)
    except (RowsUnsupportedError, OSError):
        return None
    light_parts = [p for p in file.parts if LIGHT_KEY in p.texts]
    count, size = len(light_parts), light_parts[0].display if light_parts else (0, 0)
    stays_in_file = is_large(count, size)
    is_sparse = count >= MIN_LIGHTS and _float_bytes(count, size) > SPARSE_MIN_BYTES
    if not stays_in_file and not (is_sparse and not _is_mostly_lit(light_parts, size)):
        return None
    basis = _basis_of_rows(file, _head(p.texts for p in file.parts))
    has_room = basis is not None and isinstance(basis.planes, LitPlanes)
    return basis if stays_in_file or has_room else None


def _is_mostly_lit(light_parts: Sequence[ExrPart | PartLayout], size: tuple[int, int]) -> bool:
    """Return whether half floats of all pixels have room, and are walked along faster than lit
    pixels alone, since these are many.
    """
    whole = len(light_parts) * size[0] * size[1]
    lit = sum(part.size[0] * part.size[1] for part in light_parts)
    # A lit pixel has its index beside its three channels.
    return 12 * whole <= WHOLE_MAX_BYTES and 10 * lit >= 6 * whole / 2


def _read_by_lights(path: Path) -> list[ExrPart] | None:
    """Return the parts of a file that takes seconds to read, with progress and checks for signals,
    which one call of the library would not allow. None if the file is smaller, or RowFile does not
    support it.
    """
    if path.stat().st_size <= QUICK_MAX_BYTES:
        return None
    try:
        file = RowFile(path)
    except (RowsUnsupportedError, OSError):
        return None

    def read(layout: PartLayout) -> ExrPart:
        return ExrPart("", file.channels(layout), layout.texts, layout.display)

    return parallel_map(read, file.parts, unit="lights")


def _head(texts: Iterable[Mapping[str, str]]) -> Mapping[str, str]:
    """Return the attributes of the first part. Raises BasisError for another format."""
    head: Mapping[str, str] = next((part for part in texts if FORMAT_KEY in part), {})
    if head.get(FORMAT_KEY) not in FORMATS:
        mark = one_line(repr(head.get(FORMAT_KEY, "no such mark")))
        raise BasisError(
            f"is not a basis this version can read: expected {FORMAT!r}, found {mark}; "
            "make one with lightpaint basis"
        )
    return head


def _note_content(basis: Basis, head: Mapping[str, str]) -> None:
    """Note that the file with this head, if it has checksums, has the planes of a basis."""
    if CHECKSUMS_KEY in head:
        for planes in plane_sets(basis):
            set_file_content(planes, f"{head[CHECKSUMS_KEY]} {head[ORIGIN_KEY]}")


def note_file(basis: Basis, path: Path) -> None:
    """Note that a file has the planes of a basis, so that `read_basis` returns the same."""
    with suppress(LightpaintError, OSError, *_HEADER_ERRORS):
        _note_content(basis, _head(read_headers(path)[0]))


def _basis_of_parts(parts: Sequence[ExrPart], head: Mapping[str, str]) -> Basis:
    """Return the basis of EXR parts. Raises BasisError or one of _HEADER_ERRORS."""
    light_parts = [
        p if is_lit_part(p.channels) else p.in_display_window()
        for p in parts
        if LIGHT_KEY in p.attributes
    ]
    others = [p for p in parts if LIGHT_KEY not in p.attributes]

    def of_light(k: int) -> list[EncodedPlane | LitPlane]:
        return planes_of_part(light_parts[k], scales_of(light_parts[k].attributes))

    stored = cache(of_light)

    @cache
    def whole_sets(order: tuple[int, ...], size: tuple[int, int]) -> list[EncodedPlanes]:
        lights = ([as_encoded_plane(x, size) for x in of_light(k)] for k in order)
        return EncodedPlanes.sets(lights, len(order), size)

    def planes(order: Sequence[int], number: int) -> Planes:
        size = _common_size(light_parts)
        if not _is_encoded(len(order), size):
            singles = np.empty((len(order), *size, 3), np.float32)
            for k, stored_plane in enumerate(stored(k)[number] for k in order):
                singles[k] = as_encoded_plane(stored_plane, size).decoded()
            return as_planes(singles)
        if len(order) >= MIN_LIGHTS and _is_mostly_lit(light_parts, size):
            return whole_sets(tuple(order), size)[number]
        of_lights = [stored(k)[number] for k in order]
        if len(order) >= MIN_LIGHTS and number < 2:
            return LitPlanes([as_lit_plane(x) for x in of_lights], size)
        whole = [as_encoded_plane(x, size) for x in of_lights]
        return EncodedPlanes(whole, is_decoded_once=number < 2)

    channel_readers = [partial(getattr, part, "channels") for part in light_parts]
    has_indirect = all(has_indirect_channels(p.channels) for p in light_parts)
    texts = [p.attributes for p in light_parts]
    return _checked_basis(
        _Parts(head, texts, channel_readers, others, planes, has_indirect=has_indirect)
    )


def _common_size(parts: Sequence[ExrPart]) -> tuple[int, int]:
    """Return (height, width) of the planes of all lights. Raises BasisError if they differ."""
    sizes = [picture_size(part) for part in parts]
    for part, size in zip(parts, sizes, strict=True):
        if size is None or size != sizes[0]:
            raise BasisError(f"parts {parts[0].name!r} and {part.name!r} differ in size")
    assert sizes[0] is not None
    return sizes[0]


def _basis_of_rows(
    file: RowFile, head: Mapping[str, str], *, is_deferred: bool = False
) -> Basis | None:
    """Return a basis whose planes stay in the file; None if its parts differ in layout.

    is_deferred: whether planes are read and checked by the first walk over them. Raises the errors
    of `_basis_of_parts`.
    """
    light_parts = [p for p in file.parts if LIGHT_KEY in p.texts]
    size = picture_size(light_parts[0])
    if size is None or any(
        picture_size(p) != size or not (is_lit_part(p.channels) or {*p.channels} >= LIGHT_CHANNELS)
        for p in light_parts
    ):
        return None
    scales = [scales_of(p.texts) for p in light_parts]

    def part(layout: PartLayout) -> ExrPart:
        return ExrPart("", file.channels(layout), layout.texts, layout.display)

    def planes(order: Sequence[int], number: int) -> Planes:
        plane_scales = [scales[k][number] for k in order]
        of_file = FilePlanes(file, [light_parts[k] for k in order], number, plane_scales)
        return DeferredPlanes(of_file, load, number) if is_deferred and number < 2 else of_file

    def read_sets() -> tuple[Planes, Planes]:
        whole = _basis_of_rows(file, head)
        assert whole is not None
        return whole.planes, whole.noise

    load = LoadOnce(read_sets)

    collector = LitCollector(size) if len(light_parts) >= MIN_LIGHTS else None

    def collected(layout: PartLayout, scale: tuple[float, ...]) -> Channels:
        channels = file.channels(layout)
        if collector is not None:
            name = strict_json(layout.texts[LIGHT_KEY])["name"]
            planes = planes_of_part(ExrPart(name, channels, display=size), scale)[:2]
            collector.add(name, [as_lit_plane(plane) for plane in planes])
        return channels

    channel_readers = [
        partial(collected, *x) for x in zip(light_parts, scales, strict=True) if not is_deferred
    ]
    others = [part(p) for p in file.parts if LIGHT_KEY not in p.texts]
    has_indirect = all(has_indirect_channels(p.channels) for p in light_parts)
    texts = [p.texts for p in light_parts]
    basis = _checked_basis(
        _Parts(head, texts, channel_readers, others, planes, has_indirect=has_indirect)
    )
    lit = None if collector is None or is_deferred else collector.planes(basis.names)
    return basis if lit is None else replace(basis, planes=lit[0], noise=lit[1])


class DeferredFile:
    """The open file of a basis of many lights, whose planes are read at the first walk over them.

    Raises RowsUnsupportedError for a file of another kind, OSError, and BasisError.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._file = path, RowFile(path)
        self._head = _head(part.texts for part in self._file.parts)
        if sum(LIGHT_KEY in part.texts for part in self._file.parts) < MIN_LIGHTS:
            raise RowsUnsupportedError("few lights are read at once")
        if CHECKSUMS_KEY not in self._head:
            raise RowsUnsupportedError("no checksums")

    @property
    def content(self) -> str:
        """A text that is another one for another basis."""
        return f"{self._head[CHECKSUMS_KEY]} {self._head[ORIGIN_KEY]}"

    def basis(self) -> Basis:
        """Return the basis as `read_basis` does, with planes that are checked when they are read.

        Raises RowsUnsupportedError for parts that differ in layout, and the errors of `read_basis`.
        """
        try:
            basis = _basis_of_rows(self._file, self._head, is_deferred=True)
        except _HEADER_ERRORS as error:
            raise BasisError(f"{self._path} is a damaged basis: {one_line(str(error))}") from error
        if basis is None:
            raise RowsUnsupportedError("parts differ in layout")
        return replace(basis, source=str(self._path))


def _checked_basis(parts: _Parts) -> Basis:
    """Return the basis of a file after checking it, but for pixels that are checked later."""
    masks = [p.in_display_window().channels["Y"] for p in parts.others if "Y" in p.channels]
    if not parts.texts or not masks:
        raise BasisError("has lost parts of its basis: make it again with lightpaint basis")
    try:
        lights, origin, checksums = parts.read_records()
    except (BasisError, ImageError) as error:
        raise BasisError(f"is a damaged basis: {one_line(str(error))}") from error
    order = list(range(len(lights)))
    if checksums is not None:
        order = checksums.in_order([light.name for light in lights])
        check(checksums.origin, "origin", parts.head[ORIGIN_KEY], {})
    planes = parts.planes
    try:
        images, noise = planes(order, 0), planes(order, 1)
        basis = Basis(
            lights=Lights(tuple(lights[k] for k in order)),
            planes=images,
            noise=noise,
            emitters_seen=masks[0] > 0,
            origin=origin,
            indirect=IndirectLight(planes(order, 2), planes(order, 3))
            if parts.has_indirect
            else None,
            **fields_of_others(parts.others, checksums, images.size),
        )
    except (BasisError, ImageError) as error:
        raise BasisError(f"is a damaged basis: {one_line(str(error))}") from error
    if parts.channel_readers:
        parts.check_pixels(lights, checksums)
    if checksums is not None:
        check(checksums.seen, "mask of seen emitters", "", {"Y": masks[0]})
    return basis


def read_origin(path: Path) -> tuple[Origin, tuple[int, int], tuple[str, ...]]:
    """Return origin, (height, width) and light identities of the basis at `path`, without reading
    pixels.
    """
    file_length(path, "basis", BasisError, limit=MAX_BYTES)
    try:
        headers, size = read_headers(path)
        light_parts = [strict_json(header[LIGHT_KEY]) for header in headers if LIGHT_KEY in header]
        identities = tuple(str(light.get("identity", "")) for light in light_parts)
        text = next(header[ORIGIN_KEY] for header in headers if ORIGIN_KEY in header)
        return read_record(Origin, strict_json(text)), size, identities
    except (*_HEADER_ERRORS, BasisError, StopIteration) as error:
        reason = one_line(str(error)) or "it does not say where it comes from"
        raise BasisError(f"{path} is not a basis this version can read: {reason}") from error


def is_file_of(path: Path, basis: Basis) -> bool:
    """Return whether a file has the origin, the lights and all parts of `basis`, without reading
    pixels.
    """
    try:
        origin, size, _ = read_origin(path)
        file = RowFile(path)
        form = _head(part.texts for part in file.parts)[FORMAT_KEY]
    except (LightpaintError, RowsUnsupportedError, OSError):
        return False
    light_parts = [part for part in file.parts if LIGHT_KEY in part.texts]
    others = [{*part.channels} for part in file.parts if LIGHT_KEY not in part.texts]
    has_indirect = all(has_indirect_channels(part.channels) for part in light_parts)
    return (
        (form != OLD_FORMAT, origin, size) == (True, basis.origin, basis.size)
        and has_indirect == (basis.indirect is not None)
        and [part.texts[LIGHT_KEY] for part in light_parts]
        == [light_texts(light, ())[LIGHT_KEY] for light in basis.lights]
        and others == [{*part.channels} for part in other_parts(basis)]
    )
