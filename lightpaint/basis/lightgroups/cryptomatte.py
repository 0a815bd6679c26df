"""The objects of a render, from the Cryptomatte layers of its file.

Friedman and Jones, "Fully automatic ID mattes with support for motion blur and transparency",
SIGGRAPH 2015 posters; and the Cryptomatte specification 1.2. Each layer `name00`, `name01`, … has
two objects of each pixel: their ids, 32 bits in a float, in R and B, and their coverage in G and A.
Text attributes of the file hold the names of the ids.
"""

import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from lightpaint.display_text import some_names
from lightpaint.errors import BasisError
from lightpaint.files import one_line, read_bytes
from lightpaint.images import BACKGROUND, Objects
from lightpaint.images.formats import ExrPart, channel_named

#: Attributes `cryptomatte/<key>/<field>`.
ATTRIBUTE = re.compile(r"cryptomatte/(?P<key>[^/]+)/(?P<field>name|manifest|manif_file)")

#: What mattes may be of, best first: people paint objects.
KINDS = ("object", "node", "asset", "material")

#: The end of an entry of a manifest: of its name, and its id. Blender does not escape quotes and
#: line breaks in names, so that only an id shows where a name ends.
ENTRY_END = re.compile(r'"\s*+:\s*+"(?P<id>[0-9a-f]{8})"\s*+(?=[,}])', re.I)

#: Longest manifest in bytes, and longest name in characters that is kept of it.
MAX_MANIFEST_BYTES, MAX_OBJECT_NAME = 2**24, 1000

#: Most mattes of a file: renderers write one of objects, one of materials and one of assets.
MAX_MATTES = 64

#: Most objects that are distinguished, those that cover most pixels: painters get indices of 16
#: bits.
MAX_OBJECTS = 2**15 - 1

#: Names of the four channels of a layer, in lower case.
ID_AND_COVERAGE = ((("r", "red"), ("g", "green")), (("b", "blue"), ("a", "alpha")))


@dataclass(frozen=True)
class Cryptomatte:
    """The mattes of one kind, such as objects.

    name: of the layers, without their two digits. manifest: text of the file's header that names
    the ids, or "". manifest_file: a file in the same folder that does, or "".
    """

    name: str
    manifest: str = ""
    manifest_file: str = ""

    def is_layer(self, layer: str) -> bool:
        """Return True if a layer of the file holds a part of these mattes."""
        suffix = layer.removeprefix(self.name)
        return layer.startswith(self.name) and (
            not suffix or re.fullmatch(r"\d\d", suffix) is not None
        )


def declared_mattes(parts: Iterable[ExrPart]) -> list[Cryptomatte]:
    """Return the mattes that the headers of a file declare, the best for painting first."""
    fields: dict[str, dict[str, str]] = {}
    for part in parts:
        for attribute, text in part.attributes.items():
            if match := ATTRIBUTE.fullmatch(attribute):
                fields.setdefault(match["key"], {})[match["field"]] = text
    mattes = [
        Cryptomatte(x["name"], x.get("manifest", ""), x.get("manif_file", ""))
        for x in fields.values()
        if x.get("name")
    ]
    return sorted(mattes, key=lambda matte: (_rank(matte.name), matte.name))[:MAX_MATTES]


def _rank(name: str) -> int:
    """Return the place of what mattes are of in `KINDS`."""
    plain = name.casefold()
    return next((k for k, kind in enumerate(KINDS) if kind in plain), len(KINDS))


def objects_of(
    parts: Sequence[ExrPart], mattes: Sequence[Cryptomatte], path: Path
) -> tuple[Objects | None, list[str]]:
    """Return the objects that cover most of each pixel, by the first mattes with pixels, and
    remarks.

    parts: of the file at `path`, in their display window. Returns None if no layer has ids.
    """
    for matte in mattes:
        index, ids = _seen(parts, matte)
        if index is None:
            continue
        names, remark = _names(matte, path)
        known = tuple(names.get(x, f"object {x:08x}") for x in ids.tolist())
        remarks = [f"{path.name} names no object of {matte.name}: {remark}"] if remark else []
        if known:
            remarks.append(f"objects by Cryptomatte {matte.name}: {some_names(known)}")
        return Objects(index, known), remarks
    return None, []


def _seen(
    parts: Sequence[ExrPart], matte: Cryptomatte
) -> tuple[npt.NDArray[np.int32] | None, npt.NDArray[np.uint32]]:
    """Return the index (h, w) of the object that covers most of each pixel, and the ids."""
    pairs = [
        pair
        for part in parts
        for layer in sorted(filter(matte.is_layer, _layers(part)))
        for pair in _ranked(part, layer)
    ]
    pairs = [(ids, coverage) for ids, coverage in pairs if ids.shape == pairs[0][0].shape]
    if not pairs:
        return None, np.empty(0, np.uint32)
    nothing = 1 - np.sum([coverage for _, coverage in pairs], axis=0)
    best, most = np.zeros(nothing.shape, np.uint32), np.maximum(nothing, 0)
    for ids, coverage in pairs:
        is_more = (coverage > 0) & (coverage >= most)
        best[is_more], most[is_more] = ids[is_more], coverage[is_more]
    seen, inverse, counts = np.unique(best, return_inverse=True, return_counts=True)
    if len(seen) > MAX_OBJECTS:
        best[np.isin(best, seen[np.argsort(counts)[:-MAX_OBJECTS]])] = 0
        seen, inverse = np.unique(best, return_inverse=True)
    index = inverse.reshape(best.shape).astype(np.int32)
    if seen[0] == 0:  # the id of nothing
        return index + BACKGROUND, seen[1:]
    return index, seen


def _layers(part: ExrPart) -> set[str]:
    return {name.rpartition(".")[0] for name in part.channels} | {part.name}


def _ranked(
    part: ExrPart, layer: str
) -> list[tuple[npt.NDArray[np.uint32], npt.NDArray[np.float32]]]:
    """Return ids and coverage of the two objects of a layer; nothing for channels that are not
    floats of 32 bits, in which no id survives.
    """
    pairs = []
    for id_names, coverage_names in ID_AND_COVERAGE:
        prefix = layer if channel_named(part.channels, layer, *id_names) else ""  # of a part
        id_name = channel_named(part.channels, prefix, *id_names)
        coverage_name = channel_named(part.channels, prefix, *coverage_names)
        if id_name is None or coverage_name is None:
            continue
        ids = part.channels[id_name]
        if ids.dtype != np.float32:
            continue
        coverage = np.nan_to_num(part.channels[coverage_name].astype(np.float32), nan=0)
        pairs.append((np.ascontiguousarray(ids).view(np.uint32), coverage))
    return pairs


def _names(matte: Cryptomatte, path: Path) -> tuple[dict[int, str], str]:
    """Return the names by id, and why there are none, or ""."""
    text, source = matte.manifest, "its header"
    if not text and matte.manifest_file:
        source = Path(matte.manifest_file).name
        try:
            data = read_bytes(
                path.parent / source, "manifest", BasisError, limit=MAX_MANIFEST_BYTES
            )
        except BasisError as error:
            return {}, one_line(str(error))
        text = data.decode("utf-8", errors="replace")
    if not text:
        return {}, "its header has no manifest"
    if len(text) > MAX_MANIFEST_BYTES:
        return {}, f"the manifest in {source} is too long"
    names = parse_manifest(text)
    return names, "" if names else f"{source} has no valid manifest"


def parse_manifest(text: str) -> dict[int, str]:
    """Return the names by id in the text of a manifest, JSON or what Blender writes for it.

    The time grows as the length of the text.
    """
    pairs: Iterable[tuple[str, object]]
    try:
        parsed = json.loads(text)
        pairs = parsed.items() if isinstance(parsed, Mapping) else ()
    except (ValueError, RecursionError):
        pairs = _unescaped_entries(text)
    names = {}
    for name, hexadecimal in pairs:
        if isinstance(hexadecimal, str) and re.fullmatch(r"[0-9a-fA-F]{1,8}", hexadecimal):
            names[int(hexadecimal, 16)] = name[:MAX_OBJECT_NAME]
    return names


def _unescaped_entries(text: str) -> Iterator[tuple[str, str]]:
    """Yield names and ids of a manifest whose names are not escaped."""
    begin = 0
    for end in ENTRY_END.finditer(text):
        quote = text.find('"', begin, end.start())
        if quote >= 0:
            yield text[quote + 1 : end.start()], end["id"]
        begin = end.end()
