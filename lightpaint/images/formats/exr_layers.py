"""The colour layers of an EXR file, in any representation, as linear Rec.709."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lightpaint import colour
from lightpaint.arrays import Floats
from lightpaint.display_text import some_names
from lightpaint.errors import ImageError
from lightpaint.images.formats.exr import ExrPart
from lightpaint.sentences import Hint

#: Attribute of EXR files with separate Krita layers, which have no merged picture.
KRITA_LAYERS = "krita_layers_info"

#: Names of colour and alpha channels in various programs, in lower case.
RGB_NAMES = (("r", "g", "b"), ("red", "green", "blue"))
ALPHA_NAMES = ("a", "alpha")

#: Text attribute in which Blender and others store the colour space, and its values without
#: meaning.
COLOR_SPACE = "colorInteropID"
UNSPECIFIED = ("", "data", "unknown")


@dataclass(frozen=True)
class ExrLayer:
    """A colour image in a part, whose channels have this prefix.

    name: its name for display; "" if it is the only layer in its file and has no name.
    """

    name: str
    part: ExrPart
    prefix: str

    def rgb(self) -> Floats:
        """Return a copy as (h, w, 3) float32, linear Rec.709. See `linear_rgb`."""
        return linear_rgb(self.part, self.prefix)

    def channel(self, *names: str) -> npt.NDArray[np.float32] | None:
        """Return the first of these channels that exists in the layer, (h, w) float32."""
        name = channel_named(self.part.channels, self.prefix, *names)
        return None if name is None else self.part.channels[name].astype(np.float32, copy=False)


def colour_channels(names: Iterable[str]) -> dict[str, tuple[str, str, str]]:
    """Return layer (prefix) → its red, green and blue channels, for layers with all three."""
    layers = {}
    for layer, channels in _by_layer(names).items():
        for r, g, b in RGB_NAMES:
            if layer not in layers and r in channels and g in channels and b in channels:
                layers[layer] = (channels[r], channels[g], channels[b])
    return layers


def vector_channels(names: Iterable[str]) -> dict[str, tuple[str, str, str]]:
    """Return layer (prefix) → its x, y and z channels, for layers with all three."""
    vectors = {}
    for layer, channels in _by_layer(names).items():
        if {"x", "y", "z"} <= channels.keys():
            vectors[layer] = (channels["x"], channels["y"], channels["z"])
    return vectors


def channel_named(names: Iterable[str], layer: str, *lasts: str) -> str | None:
    """Return the channel of `layer`, a prefix, with the first existing suffix among `lasts`."""
    channels = _by_layer(names).get(layer, {})
    return next((channels[x] for x in map(str.casefold, lasts) if x in channels), None)


def _by_layer(names: Iterable[str]) -> dict[str, dict[str, str]]:
    """Return layer → lower-case suffix → channel; of duplicates the first."""
    layers: dict[str, dict[str, str]] = {}
    for name in names:
        layer, _, last = name.rpartition(".")
        layers.setdefault(layer, {}).setdefault(last.casefold(), name)
    return layers


def linear_rgb(part: ExrPart, layer: str = "") -> Floats:
    """Return the colour of `layer`, a channel prefix in `part`, as (h, w, 3) float32 Rec.709.

    Its channels are R, G, B; or Y for grey; or Y, RY and BY for luminance and chroma. Other
    primaries declared in the header are converted. Raises ImageError, listing the channels, if it
    has none of these, or if its colour space is unknown.
    """
    primaries = primaries_of(part)
    if (names := colour_channels(part.channels).get(layer)) is not None:
        image = np.empty((*part.size, 3), np.float32)
        for k, name in enumerate(names):
            image[..., k] = part.channels[name]
        return _in_rec709(image, primaries)
    luminance = part.channels.get(_joined(layer, "Y"))
    if luminance is None:
        raise ImageError(
            f"no channel {', '.join(_joined(layer, c) for c in 'RGB')} or {_joined(layer, 'Y')} "
            f"in part {part.name!r}, which has {some_names(part.channels)}"
        )
    luminance = luminance.astype(np.float32, copy=False)
    chroma = [part.channels.get(_joined(layer, name)) for name in ("RY", "BY")]
    if chroma[0] is None or chroma[1] is None:
        # Grey needs no conversion, since white is adapted to white.
        return np.repeat(luminance[..., None], 3, axis=-1)
    image = _from_chroma(luminance, chroma[0], chroma[1], primaries or colour.REC709)
    return _in_rec709(image, primaries)


def colour_layers(parts: Sequence[ExrPart]) -> list[ExrLayer]:
    """Return all colour layers of a file in file order, within a part the unnamed one first."""
    layers = []
    for part in parts:
        prefixes = dict.fromkeys(name.rpartition(".")[0] for name in part.channels)
        for prefix in sorted(filter(lambda p: _is_colour(part, p), prefixes), key=bool):
            layers.append(ExrLayer(_layer_name(part, prefix, several=len(parts) > 1), part, prefix))
    return layers


def choose_layer(parts: Sequence[ExrPart], requested: str | None = None) -> ExrLayer:
    """Return the layer called `requested`, by its own name, its part's or view's name, or its
    prefix.

    Without a request, returns the only layer, or the only one without a prefix, unless Krita wrote
    the file: there the layer without a prefix is only the background. Raises ImageError, listing
    the layers, if there is no such layer or more than one.
    """
    layers = colour_layers(parts)
    if not layers:
        channels = dict.fromkeys(name for part in parts for name in part.channels)
        raise ImageError(
            f"is not an RGB image: no channels R, G, B or Y; it has {some_names(channels)}"
        )
    if requested is None:
        if len(layers) > 1 and any(KRITA_LAYERS in part.attributes for part in parts):
            raise ImageError(
                f"has {len(layers)} layers of Krita ({_names(layers)}) and no merged picture: "
                "flatten the image and export it again, or name the painted one with ",
                Hint("layer"),
            )
        plain = [layer for layer in layers if not layer.prefix] or layers
        if len(plain) > 1:
            raise ImageError(
                f"has {len(plain)} layers ({_names(plain)}), and any of them could be meant: "
                "name one with ",
                Hint("layer"),
                ", or export a single image",
            )
        return plain[0]
    for matches in (
        [layer for layer in layers if layer.name == requested],
        [layer for layer in layers if requested in _views(layer)],
        [layer for layer in layers if layer.prefix == requested],
    ):
        if len(matches) == 1:
            return matches[0]
    raise ImageError(f"has no layer {requested!r}: it has {_names(layers)}")


def _names(layers: Sequence[ExrLayer]) -> str:
    return some_names(layer.name or "one without a name" for layer in layers)


def _layer_name(part: ExrPart, prefix: str, *, several: bool) -> str:
    if not several or prefix == part.name or prefix.startswith(f"{part.name}."):
        return prefix
    return _joined(part.name, prefix) if prefix else part.name


def _views(layer: ExrLayer) -> list[str]:
    """Return the view names of the layer: the view of its part, or the first of a multi-view
    part."""
    if layer.prefix:
        return []
    return [v for v in (layer.part.attributes.get("view"), *layer.part.views[:1]) if v]


def _is_colour(part: ExrPart, prefix: str) -> bool:
    if _joined(prefix, "Y") in part.channels:
        # Next to an X, this Y is a coordinate rather than luminance.
        return _joined(prefix, "X") not in part.channels
    return prefix in colour_channels(part.channels)


def _from_chroma(y: Floats, ry: Floats, by: Floats, primaries: tuple[float, ...]) -> Floats:
    """Return RGB from luminance and RY = (R − Y)/Y, BY = (B − Y)/Y, as OpenEXR defines them."""
    red, green, blue = colour.rgb_to_xyz(primaries)[1]
    image = np.empty((*y.shape, 3), np.float32)
    with np.errstate(invalid="ignore", over="ignore"):
        image[..., 0] = (ry + 1) * y
        image[..., 2] = (by + 1) * y
        image[..., 1] = (y - red * image[..., 0] - blue * image[..., 2]) / green
    return image


def _in_rec709(image: Floats, primaries: tuple[float, ...] | None) -> Floats:
    return image if primaries is None else colour.converted(image, colour.to_rec709(primaries))


def primaries_of(part: ExrPart) -> tuple[float, ...] | None:
    """Return the primaries that a part declares, as numbers or by name; None for Rec.709.

    Raises ImageError, without naming the file, if the name is not the name of a known linear space.
    """
    if part.primaries is not None:
        return None if colour.is_rec709(part.primaries) else part.primaries
    space = part.attributes.get(COLOR_SPACE, "")
    if space in UNSPECIFIED or space.startswith(("lin_rec709", "lin_srgb")):
        return None
    if space not in colour.SPACES:
        raise ImageError(
            f"is in the colour space {space!r}, but linear Rec.709 is expected: convert it and "
            "export it again"
        )
    return colour.primaries_in(colour.SPACES[space])


def _joined(layer: str, name: str) -> str:
    return f"{layer}.{name}" if layer else name
