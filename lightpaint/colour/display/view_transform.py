"""View transforms: from linear light to what a display is sent, and back.

Every picture that is shown, and every painting of 8 or 16 bits that is read, goes through a
`ViewTransform`: an exposure and one of

    srgb      the display's own curve, IEC 61966-2-1; white at 1
    linear    no curve: the numbers are light; white at 1
    filmic    a shoulder up to 7.2, then the sRGB curve
    agx       AgX's base: colours drawn together, 16.5 stops in one sigmoid; white at 16.3
    ocio:DISPLAY/VIEW   of the OpenColorIO configuration (`lightpaint.colour.display.ocio`)

Display values lie in [0, 1]. Encoding clips what the display cannot show: what is brighter than
`ViewTransform.white`, and negative light.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.colour.display.tone_curves import BUILT_IN, Curve
from lightpaint.colour.srgb import MAX_STOPS
from lightpaint.errors import ViewError
from lightpaint.keywords import keywords


class Encoding(Protocol):
    """Linear Rec.709 to display values and back, without exposure. Arrays are (..., 3)."""

    @property
    def white(self) -> float:
        """Light of the grey that is display white."""

    def encode(self, image: Floats) -> Floats:
        """Display values in [0, 1] of linear light."""

    def decode(self, image_display: Floats) -> Floats:
        """Linear light of display values in [0, 1]."""

    def encode_planes(self, planes: Floats) -> Floats:
        """`encode` of linear light (3, p), a row for each channel."""

    def with_slopes(self, planes: Floats) -> tuple[Floats, Floats]:
        """Of linear light (3, p): display values (3, p), and derivatives (3, 3, p) of display value
        i by linear channel j, 0 where clipped; (3, p), by its own, where no channel has a say in
        another.
        """


@keywords()
@dataclass(frozen=True)
class ViewTransform:
    """A view transform at an exposure. Build it with `ViewTransform.parse`, or by its name.

    Attributes:
        name: `srgb`, `linear`, `filmic`, `agx` or `ocio:DISPLAY/VIEW`.
        stops: Light is scaled by 2^stops before it is encoded.

    Raises:
        ViewError: For a name that there is none of.

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
    @keywords()
    def parse(text: str, stops: float = 0.0) -> "ViewTransform":
        """The transform that `text` names. `ocio` is the default display and view of the
        configuration.

        `ViewTransform.parse(t.name, t.stops) == t`.
        """
        name = text.strip()
        if name.lower() == "ocio":
            from lightpaint.colour.display.ocio import default_name

            return ViewTransform(default_name(), stops)
        return ViewTransform(name if name.lower().startswith("ocio:") else name.lower(), stops)

    @property
    def spoken(self) -> str:
        """`srgb`, or with its exposure, `srgb at +1.5 stops`."""
        return f"{self.name} at {self.stops:+.1f} stops" if self.stops else self.name

    @property
    def white(self) -> float:
        """Linear light of the grey at which the display is white: it shows nothing brighter."""
        return _encoding(self.name).white / float(2.0**self.stops)

    @property
    def is_per_channel(self) -> bool:
        """Whether each display value depends on its own channel alone, by the same curve."""
        encoding = _encoding(self.name)
        return isinstance(encoding, Curve) and encoding.matrix is None

    def encode(self, image: Floats) -> Floats:
        """Display values in [0, 1] of a linear Rec.709 image (..., 3)."""
        return _encoding(self.name).encode(image * 2.0**self.stops)

    def decode(self, image_display: Floats) -> Floats:
        """Linear Rec.709 of display values in [0, 1], (..., 3). Does not undo clipping."""
        linear = _encoding(self.name).decode(np.clip(image_display, 0, 1))
        return np.asarray(linear / 2.0**self.stops)

    def jacobian(self, image: Floats) -> Floats:
        """Derivatives of `encode` at a linear image (..., 3).

        (..., 3, 3): of display value i by linear channel j. 0 where the display clips. Only
        `agx` and `ocio:` mix channels.
        """
        _, slopes = self.with_slopes(np.reshape(image, (-1, 3)).T)
        if slopes.ndim == 2:
            slopes = slopes * np.eye(3)[..., None]
        return np.asarray(slopes.transpose(2, 0, 1).reshape(*image.shape, 3))

    def encode_planes(self, planes: Floats) -> Floats:
        """Encode pixels whose channels lie apart, (3, p) linear, as `encode` does."""
        return _encoding(self.name).encode_planes(planes * 2.0**self.stops)

    def with_slopes(self, planes: Floats) -> tuple[Floats, Floats]:
        """Return `encode` and `jacobian` of pixels whose channels lie apart, at once.

        planes: (3, p) linear. Returns display values, (3, p), and derivatives, (3, 3, p) or, where
        no channel has a say in another, the diagonal of these, (3, p).
        """
        scale = 2.0**self.stops
        shown, slopes = _encoding(self.name).with_slopes(planes * scale)
        return shown, slopes * scale if self.stops else slopes


@keywords()
@dataclass(frozen=True)
class TransformChoice:
    """A choice of transform, maybe half of one; a picture says the rest.

    Attributes:
        name: As of `ViewTransform.parse`.
        stops: Of exposure. None for what is left open.

    Raises:
        ViewError: For what no transform has.

    Examples:
        >>> lp.TransformChoice(stops=1.0).over(lp.ViewTransform("agx"))
        ViewTransform(name='agx', stops=1.0)
    """

    name: str | None = None
    stops: float | None = None

    def __post_init__(self) -> None:
        self.over(None)

    @staticmethod
    @keywords()
    def of(transform: "ViewTransform | TransformChoice | None") -> "TransformChoice":
        """A whole transform, a choice as it is, or nothing asked."""
        if isinstance(transform, ViewTransform):
            return TransformChoice(transform.name, transform.stops)
        return transform or TransformChoice()

    @property
    def is_open(self) -> bool:
        """Whether nothing is asked."""
        return self.name is None and self.stops is None

    @property
    def is_whole(self) -> bool:
        """Whether nothing is left open."""
        return self.name is not None and self.stops is not None

    def over(self, said: ViewTransform | None) -> ViewTransform:
        """The one asked for, where that is open the one `said`, where nobody says it sRGB's."""
        said = said or ViewTransform()
        return ViewTransform.parse(
            said.name if self.name is None else self.name,
            said.stops if self.stops is None else self.stops,
        )


def _encoding(name: str) -> Encoding:
    if name.lower().startswith("ocio:"):
        from lightpaint.colour.display.ocio import ocio_encoding

        return ocio_encoding(name[len("ocio:") :])
    if name not in BUILT_IN:
        raise ViewError(
            f"no view transform {name!r}: expected {', '.join(BUILT_IN)}, ocio or ocio:DISPLAY/VIEW"
        )
    return BUILT_IN[name]
