"""The RGB layers of an EXR file or of a folder of them, from any renderer.

A layer is three channels whose names differ only in their last component, such as `key.R`, `key.G`
and `key.B`. A separate part of the file may have plain `R`, `G`, `B`, and the layer is then named
after the part.

Paintings and lightpaint's own output often lie beside a render. Taken for a light, they would be
the ones that match the painting best. A file of a folder is left out only if this is certain, and
is always reported.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis.file.basis_file import FORMAT_KEY
from lightpaint.basis.lightgroups.cryptomatte import declared_mattes, objects_of
from lightpaint.basis.lightgroups.naming_conventions import is_known, short_names
from lightpaint.colour import are_same, converted, to_rec709
from lightpaint.display_text import some_names
from lightpaint.errors import BasisError, ImageError
from lightpaint.images import HALF_DIFFERENCE, Objects, formats

#: Maximum number of files in a folder of light groups: more are probably frames of a film.
MAX_FILES = 1000


@dataclass(frozen=True)
class RenderLayer:
    """Three channels of a file, as stored by a renderer.

    name: the name for choosing it. part, channels: its location; part is "" if the file has only
    one.
    others: alternative names that a pattern may match.
    image: (h, w, 3) in the display window, as stored: linear light, float16 or float32.
    alpha: (h, w), or None.
    is_vector: whether its channels are X, Y and Z, so that it is not a light. is_sum: whether it is
    the sum of two layers, of which it has the channels of one.
    compression, loss: as in ExrPart; no loss if these pixels are stored exactly.
    primaries: CIE xy of red, green, blue and white; None for Rec.709.
    """

    name: str
    file: Path
    part: str
    channels: tuple[str, str, str]
    others: tuple[str, ...]
    image: Floats
    alpha: Floats | None = None
    primaries: tuple[float, ...] | None = None
    is_vector: bool = False
    is_sum: bool = False
    compression: str = ""
    loss: float = 0.0

    @property
    def is_half(self) -> bool:
        """True if the file stores it as float16."""
        return bool(self.image.dtype == np.float16)

    def in_rec709(self, image: Floats) -> Floats:
        """Return an image in these primaries, (h, w, 3), converted to linear Rec.709 float32."""
        if self.primaries is None:
            return image.astype(np.float32)
        return converted(image, to_rec709(self.primaries))

    @property
    def place(self) -> str:
        """File and layer, for messages."""
        return f"{self.file}{f' ({self.name})' if self.name else ''}"


@dataclass(frozen=True)
class RenderFile:
    """The contents of a render, a file or folder.

    layers: RGB layers in the order of the file, followed by vector layers of the same size.
    objects: those that its Cryptomatte shows; None without one. remarks: sentences for the user.
    """

    layers: Sequence[RenderLayer]
    objects: Objects | None
    remarks: Sequence[str]


def read_render(path: Path, *, leave_out: Iterable[str | Path] = ()) -> RenderFile:
    """Return what the file, or the files in the folder, at `path` hold.

    In a folder, a file with plain R, G, B becomes a layer named after the file, without the common
    parts of these names. Files in `leave_out` and others that cannot be lights (`_candidate_files`)
    are skipped, which the remarks report.

    Raises ImageError if a file cannot be read, and BasisError if there are no RGB layers, if they
    differ in size or if names repeat.
    """
    path = Path(path)
    remarks: list[str] = []
    files = [path]
    if path.is_dir():
        files, remarks = _candidate_files(path, leave_out)
    contents = {file: _content(file) for file in files}
    layers = _joined_layers(contents)
    colours = [layer for layer in layers if not layer.is_vector]
    if not colours:
        raise BasisError(f"{path} has no RGB layers: give the multi-layer EXR, or a folder of them")
    first = colours[0]
    for layer in colours[1:]:
        if layer.image.shape != first.image.shape:
            raise BasisError(
                f"{layer.place} is {_size(layer)} but {first.place} is {_size(first)}: light "
                "groups must have the same size"
            )
        if not are_same(layer.primaries, first.primaries):
            raise BasisError(
                f"{layer.place} and {first.place} declare different primaries: light groups must "
                "have the same colour space"
            )
    names = [layer.name for layer in colours]
    if repeated := sorted({name for name in names if names.count(name) > 1}):
        raise BasisError(
            f"{path} has the layers {some_names(name or 'R, G, B' for name in repeated)} more than "
            "once: is it a sequence of frames, or several views? give one file of one view"
        )
    vectors = [x for x in layers if x.is_vector and x.image.shape == first.image.shape]
    objects = None
    for content in contents.values():
        if objects is None and content.objects is not None:
            remarks += content.remarks
            if content.objects.size == first.image.shape[:2]:
                objects = content.objects
    return RenderFile(colours + vectors, objects, remarks)


def _joined_layers(contents: Mapping[Path, RenderFile]) -> list[RenderLayer]:
    """Return the layers of a folder's files; a single file may have any layers."""
    read = {file: content.layers for file, content in contents.items()}
    if len(read) == 1:
        return [layer for layers in read.values() for layer in layers]
    # Files of mattes alone hold no light.
    read = {file: layers for file, layers in read.items() if layers}
    plain_stems = [file.stem for file, layers in read.items() if [x.name for x in layers] == [""]]
    short = short_names(plain_stems)
    layers_of_folder = []
    for file, layers in read.items():
        for x in layers:
            name = x.name or file.stem
            # A renderer's own name for a light is better than the shortened one.
            if not x.name and not is_known(name):
                name = short.get(name, name)
            layers_of_folder.append(replace(x, name=name, others=(file.stem, file.name, *x.others)))
    return layers_of_folder


def _content(path: Path) -> RenderFile:
    parts = [part.in_display_window() for part in formats.read_parts(path)]
    mattes = declared_mattes(parts)
    objects, remarks = objects_of(parts, mattes, path)
    layers = []
    for part in parts:
        primaries = _primaries(path, part)
        colours = formats.colour_channels(part.channels)
        vectors = formats.vector_channels(part.channels)
        for prefix, channels in [*colours.items(), *vectors.items()]:
            if any(matte.is_layer(prefix or part.name) for matte in mattes):
                continue
            image = _rgb(path, part.channels, channels)
            alpha = formats.channel_named(part.channels, prefix, *formats.ALPHA_NAMES)
            other_names = [part.name, f"{part.name}.{prefix}"]
            if len(parts) == 1 and not prefix:
                other_names += [
                    path.stem,
                    path.name,
                ]  # a file with one layer names that layer
            layers.append(
                RenderLayer(
                    name=part.name if prefix == "" and len(parts) > 1 else prefix,
                    file=path,
                    part=part.name if len(parts) > 1 else "",
                    channels=channels,
                    others=tuple(other_names),
                    image=image,
                    alpha=None if alpha is None else part.channels[alpha],
                    primaries=primaries,
                    is_vector=vectors.get(prefix) == channels,
                    compression=part.compression,
                    loss=0.0 if _is_exact(part.compression, image) else part.loss,
                )
            )
    return RenderFile(layers, objects, remarks)


def _is_exact(compression: str, image: Floats) -> bool:
    """Return True if a compression that loses light of one kind of numbers keeps the numbers of the
    image.
    """
    is_half = image.dtype == np.float16
    return not is_half if compression.startswith("B44") else is_half and compression == "PXR24"


def _primaries(path: Path, part: formats.ExrPart) -> tuple[float, ...] | None:
    """Return the declared primaries, None for Rec.709. Raises ImageError if they are invalid."""
    try:
        return formats.primaries_of(part)
    except ImageError as error:
        raise ImageError(path, " ", error) from None


def _rgb(path: Path, pixels: Mapping[str, Floats], channels: tuple[str, str, str]) -> Floats:
    """Return (h, w, 3), float16 if all channels are. Raises ImageError if they differ in size."""
    planes = [pixels[name] for name in channels]
    if len({plane.shape for plane in planes}) > 1:
        raise ImageError(f"{path}: channels {some_names(channels)} differ in size: export it again")
    kind = np.float16 if all(p.dtype == np.float16 for p in planes) else np.float32
    return np.stack(planes, axis=-1).astype(kind, copy=False)


def _size(layer: RenderLayer) -> str:
    return f"{layer.image.shape[1]}x{layer.image.shape[0]}"


def is_light_groups(path: Path) -> bool:
    """Return True for a folder with an EXR, or an EXR that is not lightpaint's own basis."""
    path = Path(path)
    if path.is_dir():
        return bool(_named_exr(_visible(path)))
    try:
        return is_exr(path) and not is_own_basis(path)
    except ImageError:
        return False


def is_exr(path: Path) -> bool:
    """Return True if `path` is a file with the signature of OpenEXR, whatever its name.

    May raise ImageError.
    """
    return path.is_file() and formats.kind_of(formats.head_of(path, 16)) == "exr"


def is_own_basis(path: Path) -> bool:
    """Return True if an EXR is lightpaint's own basis. Raises ImageError if it is unreadable."""
    return any(FORMAT_KEY in header for header in formats.read_headers(path)[0])


def _candidate_files(
    folder: Path, leave_out: Iterable[str | Path] = ()
) -> tuple[list[Path], list[str]]:
    """Return the files of a folder that may hold light groups, by name, and a sentence on those
    left out.

    leave_out: files that are not lights, such as the painting. Raises BasisError if no file
    remains, if there are too many, or if the folder cannot be read.
    """
    visible = _visible(folder)
    files = _named_exr(visible)
    if len(files) > MAX_FILES:
        raise BasisError(
            f"{folder} holds {len(files)} EXR files, more than {MAX_FILES}: is it a sequence of "
            "frames? give a folder with the light groups of one"
        )
    left_out = [Path(file) for file in leave_out]
    reasons = {file: _reason_against(file, left_out) for file in files}
    candidates = [file for file in files if not reasons[file]]
    reasons |= {
        file: "not named .exr" for file in visible if file not in reasons and _is_readable(file)
    }
    text = _list_with_reasons({file: reason for file, reason in reasons.items() if reason})
    if not candidates:
        empty_message = (
            f"{folder} holds no .exr file" if not text else f"{folder} holds no light: {text}"
        )
        raise BasisError(
            f"{empty_message}; give the EXR with the light groups, or a folder of them"
        )
    return candidates, [f"left out of the lights: {text}"] if text else []


def _visible(folder: Path) -> list[Path]:
    """Return the files that are not hidden; operating systems keep metadata in hidden ones."""
    try:
        return sorted(f for f in folder.iterdir() if not f.name.startswith(".") and f.is_file())
    except OSError as error:
        raise BasisError(f"cannot read {folder}: {error.strerror or error}") from None


def _named_exr(files: Iterable[Path]) -> list[Path]:
    return [file for file in files if file.suffix.lower() == ".exr"]


def _is_readable(file: Path) -> bool:
    """Return True if a file without the suffix `.exr` is an EXR."""
    try:
        return is_exr(file)
    except ImageError:
        return False


def _reason_against(file: Path, others: Sequence[Path]) -> str:
    """Return briefly why a file is not the render of a light; "" if it may be one."""
    if any(_is_same(file, other) for other in others):
        return "painting or mask"
    try:
        headers, _ = formats.read_headers(file)
        channels = formats.read_channels(file)
    except ImageError:
        return ""  # Reading it reports the error.
    if any(key.startswith(formats.OWN_PREFIX) for header in headers for key in header):
        return "made by lightpaint"
    if any(name.startswith(f"{HALF_DIFFERENCE}.") for name in channels):
        return "made by lightpaint"
    if any(formats.KRITA_LAYERS in header for header in headers):
        return "painted in Krita"
    return "a painting, with weights W" if "W" in channels else ""


def _is_same(file: Path, other: Path) -> bool:
    try:
        return file.samefile(other)
    except OSError:
        return False


def _list_with_reasons(reasons: dict[Path, str]) -> str:
    """Return files grouped by reason: `a.exr, b.exr (made by lightpaint); c.exr (painting or
    mask)`.
    """
    texts = []
    for reason in dict.fromkeys(reasons.values()):
        names = [file.name for file, reason_of_file in reasons.items() if reason_of_file == reason]
        texts.append(f"{some_names(names)} ({reason})")
    return "; ".join(texts)
