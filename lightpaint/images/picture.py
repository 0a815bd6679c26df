"""Reads pictures in any format of paint programs, as linear Rec.709."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.colour import TransformChoice, ViewTransform
from lightpaint.errors import ImageError
from lightpaint.files import one_line
from lightpaint.images.formats.bitmap import (
    Bitmap,
    bitmap_size,
    light_of_floats,
    light_of_integers,
    read_bitmap,
    transform_of,
    unpremultiply,
)
from lightpaint.images.formats.exr import ExrPart, read_headers, read_parts
from lightpaint.images.formats.exr_layers import ALPHA_NAMES, RGB_NAMES, ExrLayer, choose_layer
from lightpaint.images.formats.file_kinds import head_of, kind_of, name_of
from lightpaint.images.formats.openraster import LAYERED, layered_kind, merged_size, read_merged

Mask = npt.NDArray[np.bool_]

#: Sublayer of a painted EXR layer that is > 0 where the light may also be brighter.
AT_LEAST = "at_least"

#: Number of codes by which JPEG's rounding may reduce white below the largest code.
JPEG_WHITE = 2


@dataclass(frozen=True)
class Picture:
    """A picture in linear Rec.709.

    kind: `exr`, `png`, `tiff`, `jpeg`, `psd`, `ora` or `kra`.
    image: (h, w, 3) float32, not premultiplied, 0 where not finite.
    finite: (h, w), True where the file holds neither NaN nor Inf.
    alpha: (h, w) float32; None if absent, or if an integer file is opaque everywhere.
    weight: (h, w) float32, the channel W of an EXR; in that case RGB is not unpremultiplied.
    stored: (h, w), True where the file has pixels; None if everywhere.
    saturated: (h, w, 3), True where the light is the light of `image` or brighter, because the file
    cannot hold a larger number or its layer `at_least` marks it.
    transform: the transform that decoded the numbers; None if the file holds light.
    codes: largest possible integer; None for floats.
    lossy: whether compression changed the numbers.
    notes: remarks for the user, one line each.
    attributes: texts in the header of an EXR.
    """

    kind: str
    image: Floats
    finite: Mask
    alpha: Floats | None = None
    weight: Floats | None = None
    stored: Mask | None = None
    saturated: Mask | None = None
    transform: ViewTransform | None = None
    codes: int | None = None
    lossy: bool = False
    notes: tuple[str, ...] = field(default=())
    attributes: Mapping[str, str] = field(default_factory=dict)

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        return self.image.shape[0], self.image.shape[1]


def read_picture(
    path: str | Path,
    *,
    layer: str | None = None,
    transform: ViewTransform | TransformChoice | None = None,
    otherwise: ViewTransform | None = None,
    kind: str | None = None,
) -> Picture:
    """Return the picture in a file of any supported format.

    layer: layer, part or view of an EXR; required if it has several. transform: the view transform
    that encoded integers. Its open parts come from lightpaint's own text in a PNG, else from
    `otherwise`, else from sRGB. Files of floats hold light and need no transform. kind: the format,
    which may be `webp` or `hdr`; by default one of a painting, by its first bytes.
    Raises ImageError, with one line that names the file, if it cannot be read.
    """
    path = Path(path)
    kind = kind or file_kind(path)
    try:
        if kind == "exr":
            parts = read_parts(path)
            with naming_file(path):
                return _picture_of_layer(choose_layer(parts, layer))
        with naming_file(path):
            if layer is not None:
                raise ImageError(f"has no layers to choose {layer!r} from: only EXR files have")
            return _picture_of_bitmap(_bitmap(path, kind), TransformChoice.of(transform), otherwise)
    except MemoryError:
        raise ImageError(path, " needs more memory than there is") from None
    except OSError as error:
        raise ImageError("cannot read ", path, f": {error.strerror or error}") from error


def picture_size(path: str | Path) -> tuple[int, int] | None:
    """Return the (height, width) of the picture in a file, without decoding it; None if its head
    does not say it, or is damaged, which reading it reports.
    """
    path = Path(path)
    with suppress(ImageError, OSError, MemoryError):
        kind = file_kind(path)
        if kind == "exr":
            return read_headers(path)[1]
        return merged_size(path) if kind in LAYERED.values() else bitmap_size(path, kind)
    return None


def read_mask(path: str | Path) -> npt.NDArray[np.float32]:
    """Return an importance mask, (h, w) float32.

    From an EXR, the first existing channel of Y, W, A and R. From other files the stored numbers,
    scaled to [0, 1] but not decoded to light: the brightest channel, times alpha.
    """
    path = Path(path)
    kind = file_kind(path)
    try:
        parts = read_parts(path) if kind == "exr" else []
        with naming_file("mask ", path):
            return _mask_in(parts) if parts else _mask_of(_bitmap(path, kind))
    except MemoryError:
        raise ImageError(path, " needs more memory than there is") from None
    except OSError as error:
        raise ImageError("cannot read mask ", path, f": {error.strerror or error}") from error


def file_kind(path: Path) -> str:
    """Return the format of a picture file, from its first bytes. Raises ImageError if unknown."""
    head = head_of(path, 128)
    if kind := kind_of(head):
        return kind if kind != "zip" else layered_kind(path, head)
    if b"<scene" in head:
        raise ImageError(
            path, " is a scene, not a picture: name the scene first, then what is painted of it"
        )
    name = name_of(head)
    raise ImageError(
        path,
        f" is {f'a {name} file' if name else 'not a picture that can be read'}: export it as "
        "OpenEXR, or as PNG or TIFF with 16 bits",
    )


def _bitmap(path: Path, kind: str) -> Bitmap:
    return read_merged(path, kind) if kind in LAYERED.values() else read_bitmap(path, kind)


def _picture_of_layer(layer: ExrLayer) -> Picture:
    stored_part = layer.part
    layer = replace(layer, part=stored_part.in_display_window())
    image = layer.rgb()
    alpha, weight = layer.channel(*ALPHA_NAMES), layer.channel("W")
    notes: tuple[str, ...] = ()
    if alpha is not None and weight is None:
        if _looks_straight(image, alpha):
            notes = (
                "there is colour where alpha is 0: if it is not premultiplied, as OpenEXR "
                "requires, edges of strokes are read too bright",
            )
        unpremultiply(image, alpha)
    return Picture(
        kind="exr",
        image=image,
        finite=_only_finite(image),
        alpha=alpha,
        weight=weight,
        stored=_stored(stored_part),
        saturated=_at_least(layer),
        notes=notes,
        attributes=stored_part.attributes,
    )


def _at_least(layer: ExrLayer) -> Mask | None:
    """Return where an EXR marks light that may be brighter, as the largest 8-bit code implies."""
    inner = replace(layer, prefix=f"{layer.prefix}.{AT_LEAST}" if layer.prefix else AT_LEAST)
    marks = [inner.channel(*names) for names in zip(*RGB_NAMES, strict=True)]
    if all(mark is None for mark in marks):
        return None
    empty_mask = np.zeros(layer.part.size, np.bool_)
    return np.stack([empty_mask if mark is None else mark > 0 for mark in marks], axis=-1)


def _stored(part: ExrPart) -> Mask | None:
    """Return where a part has pixels in its display window; None if everywhere."""
    if part.display in (None, part.size) and part.offset == (0, 0):
        return None
    ones = replace(part, channels={"Y": np.ones(part.size, np.bool_)})
    return ones.in_display_window().channels["Y"]


def _picture_of_bitmap(
    bitmap: Bitmap, choice: TransformChoice, otherwise: ViewTransform | None
) -> Picture:
    alpha: Floats | None = None
    if bitmap.alpha is not None:
        alpha = np.asarray(bitmap.alpha / np.float32(bitmap.codes or 1), np.float32)
    notes: tuple[str, ...] = ()
    if bitmap.kind == "psd" and alpha is not None:
        alpha, notes = _without_partial(alpha)
    if bitmap.codes is None:
        image = light_of_floats(bitmap, alpha)
        saturated, chosen_transform = None, None
    else:
        chosen_transform = choice.over(
            None if choice.is_whole else transform_of(bitmap) or otherwise
        )
        image = light_of_integers(bitmap, alpha, chosen_transform)
        saturated = _saturated(bitmap)
    return Picture(
        kind=bitmap.kind,
        image=image,
        finite=_only_finite(image),
        alpha=alpha,
        saturated=saturated,
        transform=chosen_transform,
        codes=bitmap.codes,
        lossy=bitmap.lossy,
        notes=notes,
    )


def _saturated(bitmap: Bitmap) -> Mask:
    """Return where numbers have their maximum, (h, w, 3); with premultiplied alpha that is
    alpha.
    """
    assert bitmap.codes is not None
    if bitmap.premultiplied and bitmap.alpha is not None:
        alpha = bitmap.alpha[..., None]
        return np.asarray((bitmap.values >= alpha) & (alpha > 0))
    return np.asarray(bitmap.values >= bitmap.codes - (JPEG_WHITE if bitmap.lossy else 0))


def _without_partial(alpha: Floats) -> tuple[Floats, tuple[str, ...]]:
    """Return alpha with partly transparent pixels cleared, and a note if there were any.

    Photoshop blends such pixels of its merged picture with white, but Krita does not, and the file
    does not say which program wrote it. So their colours are unknown.
    """
    partial = (alpha > 0) & (alpha < 1)
    if not partial.any():
        return alpha, ()
    note = (
        f"{partial.sum()} partly transparent pixels are left out, since a Photoshop file does not "
        "store their colour: flatten it, or export a PNG or TIFF"
    )
    return np.where(partial, np.float32(0), alpha), (note,)


def _mask_in(parts: Sequence[ExrPart]) -> npt.NDArray[np.float32]:
    if len(parts) > 1:
        raise ImageError(
            f"has {len(parts)} parts ({', '.join(p.name for p in parts)}), and any of them could "
            "be the mask: export a single image"
        )
    part = parts[0].in_display_window()
    for name in ("Y", "W", "A", "R"):
        if name in part.channels:
            return part.channels[name].astype(np.float32)
    raise ImageError(f"has none of the channels Y, W, A, R: it has {', '.join(part.channels)}")


def _mask_of(bitmap: Bitmap) -> npt.NDArray[np.float32]:
    scale = np.float32(bitmap.codes or 1)
    mask = bitmap.values.max(axis=-1) / scale
    if bitmap.alpha is not None and not bitmap.premultiplied:
        mask = mask * (bitmap.alpha / scale)
    return np.asarray(mask, np.float32)


def _only_finite(image: Floats) -> Mask:
    """Return where all channels are finite, and set all other pixels of `image` to 0 in place."""
    finite = np.asarray(np.isfinite(image).all(axis=-1))
    if not finite.all():
        image[~finite] = 0
    return finite


def _looks_straight(image: Floats, alpha: Floats) -> bool:
    """Return True if most transparent pixels have a colour, which is rare in premultiplied
    light.
    """
    clear = alpha == 0
    return bool((image.any(axis=-1) & clear).sum() > clear.sum() / 2)


@contextmanager
def naming_file(*name: str | Path) -> Iterator[None]:
    """Prefix errors such as `is damaged` with the file's name, and escape foreign names in them.

    name: in parts. Names inside the file may contain control characters for a terminal.
    """
    try:
        yield
    except ImageError as error:
        raise ImageError(*name, " ", one_line(error.sentence, limit=2000)) from error
