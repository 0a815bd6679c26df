"""View transforms: from linear light to display values, and back.

Every displayed picture, and every painting with 8 or 16 bits, goes through a `ViewTransform`, which
is an exposure and one of these:

    srgb      the display's own curve, IEC 61966-2-1; white at 1
    linear    no curve: the numbers are light; white at 1
    filmic    a shoulder up to 7.2, then the sRGB curve
    agx       AgX's base: colours drawn together, 16.5 stops in one sigmoid; white at 16.3
    ocio:DISPLAY/VIEW   from the OpenColorIO configuration (`lightpaint.colour.display.ocio`)

Display values lie in [0, 1]. Encoding clips what the display cannot show: light brighter than
`ViewTransform.white`, and negative light.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lightpaint.errors import ViewError
from lightpaint.keywords import keywords

# NumPy is imported late, with the curves: --help reads the settings, which have a transform.
if TYPE_CHECKING:
    from lightpaint.arrays import Floats
    from lightpaint.colour.display.tone_curves import Encoding

#: Maximum exposure in stops; a larger number is a typing error.
MAX_STOPS = 64.0


@keywords()
@dataclass(frozen=True)
class ViewTransform:
    """A view transform at an exposure. Create it with `ViewTransform.parse`, or by name.

    Attributes:
        name: `srgb`, `linear`, `filmic`, `agx` or `ocio:DISPLAY/VIEW`.
        stops: Exposure: light is scaled by 2^stops before encoding.

    Raises:
        ViewError: If the name is unknown.

    Examples:
        >>> lp.ViewTransform("agx", 1.0).spoken
        'agx at +1.0 stops'
        >>> np.round(lp.ViewTransform().encode(np.array([0.0, 0.5, 1.0])), 2).tolist()
        [0.0, 0.74, 1.0]
    """

    name: str = "srgb"
    stops: float = 0.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.stops) and abs(self.stops) <= MAX_STOPS):
            raise ViewError(
                f"exposure {self.stops:g} is out of range: expected stops from {-MAX_STOPS:g} to "
                f"{MAX_STOPS:g}"
            )
        _encoding(self.name)

    @staticmethod
    def parse(text: str, stops: float = 0.0) -> "ViewTransform":
        """Return the transform named `text`, so that `ViewTransform.parse(t.name, t.stops) == t`.

        `ocio` stands for the default display and view of the configuration.
        """
        name = text.strip()
        if name.lower() == "ocio":
            from lightpaint.colour.display.ocio import default_name

            return ViewTransform(default_name(), stops)
        return ViewTransform(name if name.lower().startswith("ocio:") else name.lower(), stops)

    @property
    def spoken(self) -> str:
        """Its name, with the exposure unless that is 0: `srgb at +1.5 stops`."""
        return f"{self.name} at {self.stops:+.1f} stops" if self.stops else self.name

    @property
    def white(self) -> float:
        """Linear light of the grey shown as white, the brightest that the display can show."""
        return _encoding(self.name).white / float(2.0**self.stops)

    @property
    def is_per_channel(self) -> bool:
        """True if each display value depends on its own channel alone, by the same curve."""
        from lightpaint.colour.display.tone_curves import Curve

        encoding = _encoding(self.name)
        return isinstance(encoding, Curve) and encoding.matrix is None

    def encode(self, image: "Floats") -> "Floats":
        """Return a linear Rec.709 image (..., 3) as display values in [0, 1].

        Raises ViewError for another shape, unless no channel depends on another.
        """
        self._check_channels(image, -1)
        return _encoding(self.name).encode(image * 2.0**self.stops)

    def decode(self, image_display: "Floats") -> "Floats":
        """Return display values in [0, 1], (..., 3), as linear Rec.709. Clipping cannot be
        undone. Raises ViewError as `encode` does.
        """
        import numpy as np

        self._check_channels(image_display, -1)
        linear = _encoding(self.name).decode(np.clip(image_display, 0, 1))
        return np.asarray(linear / 2.0**self.stops)

    def encode_planes(self, planes: "Floats") -> "Floats":
        """Return `encode` of linear light with channels first, (3, p)."""
        self._check_channels(planes, 0)
        return _encoding(self.name).encode_planes(planes * 2.0**self.stops)

    def with_slopes(self, planes: "Floats") -> "tuple[Floats, Floats]":
        """Return `encode` of light with channels first, and its derivatives.

        planes: (3, p) linear. Returns display values, (3, p), and the derivatives of display value
        i by linear channel j, (3, 3, p), which are 0 where the display clips. If channels do not
        mix (they do only in `agx` and `ocio:`), only their diagonal, (3, p).
        """
        self._check_channels(planes, 0)
        scale = 2.0**self.stops
        shown, slopes = _encoding(self.name).with_slopes(planes * scale)
        return shown, slopes * scale if self.stops else slopes

    def _check_channels(self, image: "Floats", axis: int) -> None:
        """Raise ViewError unless channels that mix are those along an axis, 0 or -1."""
        shape = getattr(image, "shape", ())
        is_right = not shape or (shape[axis] == 3 and (axis == -1 or len(shape) == 2))
        if not (is_right or self.is_per_channel):
            expected = "(..., 3)" if axis else "(3, p)"
            raise ViewError(f"pixels of the shape {shape}: expected {expected}")


@keywords()
@dataclass(frozen=True)
class TransformChoice:
    """A choice of transform that may be partial; the picture's own transform completes it.

    Attributes:
        name: As in `ViewTransform.parse`; None if left open.
        stops: Exposure; None if left open.

    Raises:
        ViewError: If the name is unknown, or the exposure out of range.

    Examples:
        >>> lp.TransformChoice(stops=1.0).over(lp.ViewTransform("agx"))
        ViewTransform(name='agx', stops=1.0)
    """

    name: str | None = None
    stops: float | None = None

    def __post_init__(self) -> None:
        self.over(None)

    @staticmethod
    def of(transform: "ViewTransform | TransformChoice | None") -> "TransformChoice":
        """Return a transform as a choice, a choice unchanged, or the open choice for None."""
        if isinstance(transform, ViewTransform):
            return TransformChoice(transform.name, transform.stops)
        return transform or TransformChoice()

    @property
    def is_open(self) -> bool:
        """True if nothing is chosen."""
        return self.name is None and self.stops is None

    @property
    def is_whole(self) -> bool:
        """True if nothing is left open."""
        return self.name is not None and self.stops is not None

    def over(self, fallback: ViewTransform | None) -> ViewTransform:
        """Return the chosen transform, with open parts from `fallback`, or from sRGB if that is
        None.
        """
        fallback = fallback or ViewTransform()
        return ViewTransform.parse(
            fallback.name if self.name is None else self.name,
            fallback.stops if self.stops is None else self.stops,
        )


def _encoding(name: str) -> "Encoding":
    if name.lower().startswith("ocio:"):
        from lightpaint.colour.display.ocio import ocio_encoding

        return ocio_encoding(name[len("ocio:") :])

    from lightpaint.colour.display.tone_curves import BUILT_IN

    if name not in BUILT_IN:
        raise ViewError(
            f"there is no view transform {name!r}: expected {', '.join(BUILT_IN)}, ocio or "
            "ocio:DISPLAY/VIEW"
        )
    return BUILT_IN[name]


def lattice_of(transform: ViewTransform, side: int, low: float, high: float) -> "Floats":
    """Return display values, (side, side, side, 3) float32, with axes r, g, b in log2 of light.

    It is the transform for programs without its code, such as the painter's page. low, high: stops
    at the ends of an axis; the first point stands for all light below it.
    """
    import numpy as np

    axis = _axis(side, low, high)
    light = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
    encoded = transform.encode(light.reshape(1, -1, 3))
    return np.asarray(encoded.reshape(side, side, side, 3), np.float32)


def curve_of(transform: ViewTransform, side: int, low: float, high: float) -> "Floats":
    """Return the diagonal of `lattice_of`, (side,) float32, which suffices if channels do not
    mix.
    """
    import numpy as np

    grey = np.repeat(_axis(side, low, high)[:, None], 3, axis=1)
    return np.asarray(transform.encode(grey)[:, 0], np.float32)


def _axis(side: int, low: float, high: float) -> "Floats":
    import numpy as np

    axis = 2.0 ** np.linspace(low, high, side)
    axis[0] = 0.0
    return axis
