"""The colour layers of an EXR file, whatever they are made of, as linear Rec.709."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lightpaint.errors import ImageError
from lightpaint.images.exr import Floats, Part
from lightpaint.images.primaries import REC709, converted, is_rec709, rgb_to_xyz, to_rec709

#: Channel that holds importance in a layer whose RGB is not premultiplied.
WEIGHT_CHANNEL = "W"

#: What programs call the channels of a colour.
RGB_NAMES = (("R", "G", "B"), ("r", "g", "b"), ("red", "green", "blue"))


@dataclass(frozen=True)
class Layer:
    """A colour image in a part: its channels are those with this prefix.

    name: what a person calls it by; "" if it is the only one in its file without a name.
    """

    name: str
    part: Part
    prefix: str

    def rgb(self) -> Floats:
        """(h, w, 3) float32, linear Rec.709, a copy. See `linear_rgb`."""
        return linear_rgb(self.part, self.prefix)

    def channel(self, *names: str) -> npt.NDArray[np.float32] | None:
        """The first of these channels that the layer has, (h, w) float32."""
        for name in names:
            if (pixels := self.part.channels.get(_joined(self.prefix, name))) is not None:
                return pixels.astype(np.float32, copy=False)
        return None


def linear_rgb(part: Part, layer: str = "") -> Floats:
    """The colour of `layer`, a prefix of channels in `part`, as (h, w, 3) float32 Rec.709.

    Its channels are R, G, B; or Y, which is grey; or Y, RY and BY, luminance and chroma.
    `chromaticities` that the header declares are converted. Raises ImageError, listing what
    is there, if it has none of these.
    """
    primaries = part.primaries
    for names in RGB_NAMES:
        if all(_joined(layer, name) in part.channels for name in names):
            image = np.empty((*part.size, 3), np.float32)
            for k, name in enumerate(names):
                image[..., k] = part.channels[_joined(layer, name)]
            return image if is_rec709(primaries) else converted(image, _matrix(part))
    luminance = part.channels.get(_joined(layer, "Y"))
    if luminance is None:
        raise ImageError(
            f"no channel {', '.join(_joined(layer, c) for c in 'RGB')} nor {_joined(layer, 'Y')} "
            f"in part {part.name!r}, which has {', '.join(part.channels)}"
        )
    luminance = luminance.astype(np.float32, copy=False)
    chroma = [part.channels.get(_joined(layer, name)) for name in ("RY", "BY")]
    if chroma[0] is None or chroma[1] is None:
        # A grey has the colour of white, and white is adapted.
        return np.repeat(luminance[..., None], 3, axis=-1)
    image = _from_chroma(luminance, chroma[0], chroma[1], primaries or REC709)
    return image if is_rec709(primaries) else converted(image, _matrix(part))


def colour_layers(parts: Sequence[Part]) -> list[Layer]:
    """Every layer of a file that holds a colour, in the file's order, the unnamed one first."""
    layers = []
    for part in parts:
        prefixes = dict.fromkeys(name.rpartition(".")[0] for name in part.channels)
        for prefix in sorted(filter(lambda p: _is_colour(part, p), prefixes), key=bool):
            layers.append(Layer(_layer_name(part, prefix, several=len(parts) > 1), part, prefix))
    return layers


def choose_layer(parts: Sequence[Part], wanted: str | None = None) -> Layer:
    """The layer called `wanted`: its name, that of its part or view, or its prefix.

    Without one, the only layer, or the only one without a prefix. Raises ImageError, listing
    the layers, where there is none or more than one.
    """
    layers = colour_layers(parts)
    if not layers:
        channels = dict.fromkeys(name for part in parts for name in part.channels)
        raise ImageError(f"is no RGB image: no channel R, G, B nor Y; it has {', '.join(channels)}")
    if wanted is None:
        plain = [layer for layer in layers if not layer.prefix] or layers
        if len(plain) > 1:
            raise ImageError(
                f"has {len(plain)} layers ({_names(plain)}), and which of them is meant cannot be "
                "told: name it with --layer, or export a single image"
            )
        return plain[0]
    for named in (
        [layer for layer in layers if layer.name == wanted],
        [layer for layer in layers if wanted in _views(layer)],
        [layer for layer in layers if layer.prefix == wanted],
    ):
        if len(named) == 1:
            return named[0]
    raise ImageError(f"has no layer {wanted!r}: it has {_names(layers)}")


def _names(layers: Sequence[Layer]) -> str:
    return ", ".join(layer.name or "one without a name" for layer in layers)


def _layer_name(part: Part, prefix: str, *, several: bool) -> str:
    if not several or prefix == part.name or prefix.startswith(f"{part.name}."):
        return prefix
    return _joined(part.name, prefix) if prefix else part.name


def _views(layer: Layer) -> list[str]:
    """Names of the view that the layer is: the part's, or the first of several in one part."""
    if layer.prefix:
        return []
    return [v for v in (layer.part.attributes.get("view"), *layer.part.views[:1]) if v]


def _is_colour(part: Part, prefix: str) -> bool:
    if _joined(prefix, "Y") in part.channels:
        # Beside X it is no luminance but a direction or a place.
        return _joined(prefix, "X") not in part.channels
    return any(all(_joined(prefix, n) in part.channels for n in names) for names in RGB_NAMES)


def _from_chroma(y: Floats, ry: Floats, by: Floats, primaries: Sequence[float]) -> Floats:
    """RGB of luminance and RY = (R − Y)/Y, BY = (B − Y)/Y, as OpenEXR defines them."""
    red, green, blue = rgb_to_xyz(primaries)[1]
    image = np.empty((*y.shape, 3), np.float32)
    with np.errstate(invalid="ignore", over="ignore"):
        image[..., 0] = (ry + 1) * y
        image[..., 2] = (by + 1) * y
        image[..., 1] = (y - red * image[..., 0] - blue * image[..., 2]) / green
    return image


def _matrix(part: Part) -> Floats:
    assert part.primaries is not None
    return to_rec709(part.primaries)


def _joined(layer: str, name: str) -> str:
    return f"{layer}.{name}" if layer else name
