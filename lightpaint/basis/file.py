"""The file of a basis: one multi-part OpenEXR file that other programs can open as it is.

Part k is named after light k and holds its image as R, G, B; docs/formats.md has the details.
"""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis, Origin, free_name
from lightpaint.basis.checksums import CHECKSUMS_KEY, Checksums, check, checksum
from lightpaint.basis.file_planes import FilePlanes
from lightpaint.basis.lights import BasisLight, Lights
from lightpaint.basis.planes import Planes, as_planes
from lightpaint.errors import BasisError, ImageError
from lightpaint.files import file_length, one_line
from lightpaint.images.denoiser import Features
from lightpaint.images.estimate import HALF_DIFFERENCE
from lightpaint.images.formats.exr import (
    ExrPart,
    read_headers,
    read_parts,
    rgb_channels,
    write_parts,
)
from lightpaint.images.formats.exr_rows import NotByRowsError, PartLayout, RowFile
from lightpaint.images.object_map import Objects
from lightpaint.keywords import keywords
from lightpaint.storage.json_records import fields_of, read_record, strict_json

FORMAT = "lightpaint-basis 1"
FORMAT_KEY = "lightpaint.format"
ORIGIN_KEY = "lightpaint.origin"
LIGHT_KEY = "lightpaint.light"
EMITTERS_SEEN = "emitters seen"
LEARNED = "learned"
FEATURES, FEATURES_KEY = "features", "lightpaint.features"
OBJECTS, OBJECTS_KEY, NAMES_KEY = "objects", "lightpaint.objects", "lightpaint.names"

#: Longest basis file that is read, in bytes.
MAX_BYTES = 2**36

#: Bytes of a file up to which its planes are brought into memory.
IN_MEMORY = 2**31

#: Channels that each light has.
_NAMES = {*"RGB", *(f"{HALF_DIFFERENCE}.{c}" for c in "RGB")}

#: What comes of a header that says something else than it should.
_DAMAGES = (AttributeError, LookupError, OverflowError, TypeError, ValueError)


@keywords()
def write_basis(path: str | Path, basis: Basis) -> None:
    """Write `basis` as a multi-part EXR, whole or not at all.

    Args:
        path: Of the file; `.basis.exr` by custom.
        basis: To keep.

    Examples:
        >>> lp.write_basis("again.basis.exr", basis)
        >>> lp.read_basis("again.basis.exr").names
        ('panel', 'bulb')
    """
    parts, sums = [], {}
    for light, image, half in zip(basis.lights, basis.planes, basis.noise, strict=True):
        about = json.dumps(_light_fields(light), ensure_ascii=False)
        channels = rgb_channels(image) | rgb_channels(half, HALF_DIFFERENCE)
        parts.append(ExrPart(light.name, channels, {LIGHT_KEY: about}))
        sums[light.name] = checksum(about, channels)
    seen = {"Y": basis.emitters_seen.astype(np.float16)}
    # The format's rule: a part name never repeats, so a light may not take this one.
    parts.append(ExrPart(free_name(EMITTERS_SEEN, basis.names), seen))
    learned = {}
    if basis.learned is not None:
        learned = dict(zip(("received", "asked"), basis.learned, strict=True))
        # A table and no picture; the format wants one display window for all parts.
        parts.append(ExrPart(free_name(LEARNED, basis.names), learned, display=basis.size))
    if basis.features is not None:
        its = _feature_channels(basis.features)
        about_them = {FEATURES_KEY: checksum("", its)}
        parts.append(ExrPart(free_name(FEATURES, basis.names), its, about_them))
    if basis.objects is not None:
        named = json.dumps(basis.objects.names, ensure_ascii=False)
        # Whole numbers that float32 holds.
        index = {"index": basis.objects.index.astype(np.float32)}
        about_it = {NAMES_KEY: named, OBJECTS_KEY: checksum(named, index)}
        parts.append(ExrPart(free_name(OBJECTS, basis.names), index, about_it))
    # Without `each_light` and `integrator` as in files from before there was any.
    of_origin = json.dumps(fields_of(basis.origin, "each_light", "integrator"), ensure_ascii=False)
    checksums = Checksums(
        sums, checksum(of_origin, {}), checksum("", seen), checksum("", learned) if learned else ""
    )
    head = {FORMAT_KEY: FORMAT, ORIGIN_KEY: of_origin, CHECKSUMS_KEY: checksums.text()}
    parts[0] = ExrPart(parts[0].name, parts[0].channels, {**head, **parts[0].attributes})
    write_parts(Path(path), parts)


@keywords()
def read_basis(path: str | Path) -> Basis:
    """Read what `write_basis` wrote, also where another program has put its parts in another order.

    Args:
        path: What `write_basis` or the command line wrote.

    Raises:
        ImageError: If the file is damaged.
        BasisError: If it is not a basis or not as it was written.

    Examples:
        >>> lp.read_basis("room.basis.exr")
        Basis(2 lights, 16x16, 4 spp, of room.xml: panel, bulb)
    """
    path = Path(path)
    length = file_length(path, "image file", ImageError, limit=MAX_BYTES)
    try:
        if length > IN_MEMORY and (large := _large(path)) is not None:
            return replace(large, source=str(path))
        parts = read_parts(path)
        head = _head(p.attributes for p in parts)
        return replace(_of_parts(parts, head), source=str(path))
    except BasisError as error:
        raise BasisError(f"{path} {error}") from error
    except _DAMAGES as error:
        raise BasisError(f"{path} is damaged as a basis: {one_line(str(error))}") from error
    except MemoryError:
        raise ImageError(f"{path} takes more memory than there is") from None


def _large(path: Path) -> Basis | None:
    """Return a basis whose rows are read when they are asked for; None if that cannot be done."""
    try:
        file = RowFile(path)
    except NotByRowsError:
        return None
    return _of_rows(file, _head(p.texts for p in file.parts))


def _head(texts: Iterable[Mapping[str, str]]) -> Mapping[str, str]:
    """Return the attributes of the first part. Raises BasisError for another format."""
    head: Mapping[str, str] = next((its for its in texts if FORMAT_KEY in its), {})
    if head.get(FORMAT_KEY) != FORMAT:
        found = one_line(repr(head.get(FORMAT_KEY, "no such mark")))
        raise BasisError(
            f"is not a basis this version can read: expected {FORMAT!r}, found {found}; "
            "make one with lightpaint basis"
        )
    return head


def _of_parts(parts: Sequence[ExrPart], head: Mapping[str, str]) -> Basis:
    """Raises BasisError, without naming the file, or one of _DAMAGES."""
    lit = [p.in_display_window() for p in parts if LIGHT_KEY in p.attributes]
    others = [p for p in parts if LIGHT_KEY not in p.attributes]

    def planes(order: Sequence[int]) -> tuple[Planes, Planes]:
        its = [lit[k] for k in order]
        return as_planes(_stacked(its)), as_planes(_stacked(its, HALF_DIFFERENCE))

    stored = [p.channels.__getitem__ for p in lit]
    names = [tuple(p.channels) for p in lit]
    about = [p.attributes[LIGHT_KEY] for p in lit]
    return _assembled(about, names, stored, others, head, planes)


def _of_rows(file: RowFile, head: Mapping[str, str]) -> Basis | None:
    """Return the basis whose planes stay in the file; None where its parts are not alike.

    Raises as `_of_parts` does.
    """
    lit = [p for p in file.parts if LIGHT_KEY in p.texts]
    if any(
        p.size != p.display or p.size != lit[0].size or not {*p.channels} >= _NAMES for p in lit
    ):
        return None

    def part(layout: PartLayout) -> ExrPart:
        channels = {name: file.channel(layout, name) for name in layout.channels}
        return ExrPart("", channels, layout.texts, layout.display)

    def planes(order: Sequence[int]) -> tuple[Planes, Planes]:
        its = [lit[k] for k in order]
        noise = [f"{HALF_DIFFERENCE}.{c}" for c in "RGB"]
        return FilePlanes(file, its, "RGB"), FilePlanes(file, its, noise)

    stored = [partial(file.channel, p) for p in lit]
    names = [tuple(p.channels) for p in lit]
    others = [part(p) for p in file.parts if LIGHT_KEY not in p.texts]
    return _assembled([p.texts[LIGHT_KEY] for p in lit], names, stored, others, head, planes)


def _assembled(
    about: Sequence[str],
    names: Sequence[Sequence[str]],
    stored: Sequence[Callable[[str], npt.NDArray[Any]]],
    others: Sequence[ExrPart],
    head: Mapping[str, str],
    planes: Callable[[Sequence[int]], tuple[Planes, Planes]],
) -> Basis:
    """Return the basis of a file, checked.

    about, names, stored: of the part of each light what is said of it, its channels, and what reads
    one. planes: makes images and noise of the parts in an order.
    """
    seen = [p.in_display_window().channels["Y"] for p in others if "Y" in p.channels]
    if not about or not seen:
        raise BasisError("has lost parts of its basis: make it again with lightpaint basis")
    try:
        lights = [read_record(BasisLight, strict_json(text)) for text in about]
        origin = read_record(Origin, strict_json(head[ORIGIN_KEY]))
        checksums = None
        if CHECKSUMS_KEY in head:
            checksums = Checksums.of_text(head[CHECKSUMS_KEY])
    except (BasisError, ImageError) as error:
        raise BasisError(f"is damaged as a basis: {one_line(str(error))}") from error
    order = list(range(len(about)))
    if checksums is not None:
        order = checksums.in_order([light.name for light in lights])
        check(checksums.origin, "origin", head[ORIGIN_KEY], {})
    try:
        images, noise = planes(order)
        basis = Basis(
            lights=Lights(tuple(lights[k] for k in order)),
            planes=images,
            noise=noise,
            emitters_seen=seen[0] > 0,
            origin=origin,
            learned=_learned(others, checksums),
            features=_features(others, images.size),
            objects=_objects(others, images.size),
        )
    except (BasisError, ImageError) as error:
        raise BasisError(f"is damaged as a basis: {one_line(str(error))}") from error
    for k, light in enumerate(lights):  # one at a time: they may be larger than memory
        channels = {name: stored[k](name) for name in names[k]}
        if not all(np.isfinite(channels[name]).all() for name in _NAMES):
            raise BasisError("holds values that are not finite: make it again")
        if checksums is not None:
            check(checksums.lights[light.name], f"light {light.name!r}", about[k], channels)
    if checksums is not None:
        check(checksums.seen, "mask of seen emitters", "", {"Y": seen[0]})
    return basis


def _stacked(parts: Sequence[ExrPart], layer: str = "") -> Floats:
    """(n, h, w, 3), without the copies that np.stack of np.stack would make."""
    stacked = np.empty((len(parts), *parts[0].size, 3), np.float32)
    for image, part in zip(stacked, parts, strict=True):
        if part.size != parts[0].size:
            raise BasisError(f"parts {parts[0].name!r} and {part.name!r} differ in size")
        prefix = f"{layer}." if layer else ""
        for k, c in enumerate("RGB"):
            if prefix + c not in part.channels:
                raise BasisError(f"no channel {prefix}{c} in part {part.name!r}")
            image[..., k] = part.channels[prefix + c]
    return stacked


def _learned(others: Sequence[ExrPart], checksums: Checksums | None) -> Floats | None:
    """The table of what was learned; None for one that is not as it was, which nothing needs."""
    for channels in (p.channels for p in others if {"received", "asked"} <= p.channels.keys()):
        if checksums is not None and checksum("", channels) != checksums.learned:
            return None
        return np.stack([channels["received"], channels["asked"]])
    return None


def _feature_channels(features: Features) -> dict[str, Floats]:
    """In half floats, which is what they were rendered to."""
    albedo = rgb_channels(features.albedo, "albedo")
    normal = {f"normal.{c}": features.normal[..., k] for k, c in enumerate("XYZ")}
    return {name: plane.astype(np.float16) for name, plane in (albedo | normal).items()}


def _features(others: Sequence[ExrPart], size: tuple[int, int]) -> Features | None:
    """Albedo and normals; None if there are none or not as they were, which nothing needs."""
    for part in (p.in_display_window() for p in others if FEATURES_KEY in p.attributes):
        channels = part.channels
        if checksum("", channels) != part.attributes[FEATURES_KEY] or part.size != size:
            return None
        normal = np.stack([channels[f"normal.{c}"] for c in "XYZ"], axis=-1)
        return Features(part.rgb("albedo"), normal.astype(np.float32))
    return None


def _objects(others: Sequence[ExrPart], size: tuple[int, int]) -> Objects | None:
    """Whose surfaces are seen; None if nothing says so or not as it was, which nothing needs."""
    for part in (p.in_display_window() for p in others if OBJECTS_KEY in p.attributes):
        named = part.attributes.get(NAMES_KEY, "")
        if checksum(named, part.channels) != part.attributes[OBJECTS_KEY] or part.size != size:
            return None
        names = strict_json(named)
        if not (isinstance(names, list) and all(isinstance(name, str) for name in names)):
            return None
        return Objects(part.channels["index"].astype(np.int32), tuple(names))
    return None


def read_origin(path: Path) -> tuple[Origin, tuple[int, int], int]:
    """Origin, (height, width) and number of lights of the basis at `path`, without its pixels."""
    file_length(path, "basis", BasisError, limit=MAX_BYTES)
    try:
        headers, size = read_headers(path)
        lights = sum(LIGHT_KEY in header for header in headers)
        text = next(header[ORIGIN_KEY] for header in headers if ORIGIN_KEY in header)
        return read_record(Origin, strict_json(text)), size, lights
    except (*_DAMAGES, BasisError, StopIteration) as error:
        said = one_line(str(error)) or "it does not say where it comes from"
        raise BasisError(f"{path} is no basis this version can read: {said}") from error


def is_basis_file(path: Path) -> bool:
    """Whether the name says so: a basis is an EXR, a scene is XML."""
    return path.suffix.lower() == ".exr"


def _light_fields(light: BasisLight) -> dict[str, Any]:
    """What the file says of a light; what goes without saying for one emitter is left out."""
    data = fields_of(light, "is_fixed", "unit_flux")
    if light.members == (light.name,):
        del data["members"]
    return data
